//! The stage of the files: memory to make them, one after the other, until all are complete.
//!
//! A float of a table has about 15 characters; the encoder of NetCDF holds its data and two plans of
//! the file, each with a copy.

use super::limits;
use crate::Error;
use crate::measure::map_stages::MAP_FIELDS;
use crate::measure::plane;
use crate::plan::{Plan, PlannedStage, Stage};

/// Columns of the table of a map.
const MAP_COLUMNS: f64 = 25.0;
/// Memory of a number of a table, and of its text, bytes.
const NUMBER_BYTES: f64 = 8.0;
const TEXT_BYTES: f64 = 15.0;
/// Memory of the program that draws, fonts included, bytes.
const DRAWING_BYTES: f64 = 7e5;
/// Pixels of the picture of a profile.
const PROFILE_PIXELS: f64 = 1344.0 * 520.0;
/// Side of a square panel of a map, pixels.
const PANEL_PIXELS: f64 = 307.0;

/// Files that are made one after the other.
struct FilesMemory {
    /// Whether there are pictures as SVG and as PNG.
    svg: bool,
    png: bool,
    /// Memory of the complete files, bytes.
    complete_bytes: f64,
    /// Largest memory so far, bytes.
    largest_bytes: f64,
}

impl FilesMemory {
    /// A file, and what is held beside it until it is complete.
    fn add(&mut self, file_bytes: f64, beside_bytes: f64) {
        let held_bytes = self.complete_bytes + file_bytes + beside_bytes;
        self.largest_bytes = self.largest_bytes.max(held_bytes);
        self.complete_bytes += file_bytes;
    }

    fn table(&mut self, rows: f64, columns: f64) {
        let numbers = rows * columns;
        self.add(numbers * TEXT_BYTES, numbers * NUMBER_BYTES);
    }

    fn netcdf(&mut self, file_bytes: f64) {
        self.add(file_bytes, 3.0 * file_bytes);
    }

    /// A picture with its pixels, and the pixels of the rasters in it.
    fn picture(&mut self, pixels: f64, raster_pixels: f64) {
        // Rasters are in the drawing, four bytes a pixel, and one at a time is encoded or fitted,
        // in growing buffers; the painted picture has four, and one where its panels are cut out.
        let mask = if raster_pixels > 0.0 { 1.0 } else { 0.0 };
        let held_bytes = raster_pixels * 4.0 * 1.5 + DRAWING_BYTES;
        if self.svg {
            self.add(raster_pixels * 0.5, held_bytes);
        }
        if self.png {
            self.add(pixels * 0.2, held_bytes + pixels * (4.0 + mask));
        }
    }
}

/// The stage of the files.
///
/// # Errors
/// Fails if a file cannot hold what the scene requests.
pub(crate) fn planned(plan: &Plan) -> Result<PlannedStage, Error> {
    limits::refuse_too_large(plan)?;
    let o = &plan.scene().outputs;
    let mut formats = Vec::new();
    for (is_wanted, name) in [
        (o.csv, "CSV"),
        (o.netcdf, "NetCDF"),
        (o.svg, "SVG"),
        (o.png, "PNG"),
    ] {
        if is_wanted {
            formats.push(name);
        }
    }
    let stage = PlannedStage::running(Stage::Files, formats.join(", "));
    Ok(stage.with_memory(largest_memory_bytes(plan), 0.0, plan.fewer_points()))
}

/// Largest memory while the files are made, bytes.
fn largest_memory_bytes(plan: &Plan) -> f64 {
    let n = &plan.counts;
    let o = &plan.scene().outputs;
    let plots = cfg!(feature = "plots");
    let mut files = FilesMemory {
        svg: o.svg && plots,
        png: o.png && plots,
        complete_bytes: 0.0,
        largest_bytes: 0.0,
    };
    if plan.target.has_profile() {
        if o.csv {
            files.table(o.profile_points as f64, 10.0);
        }
        files.picture(PROFILE_PIXELS, 0.0);
    }
    if plane::is_wanted(plan) && !plan.scene().is_calm() {
        let [across, up] = plane::POINTS;
        let points = (across * up) as f64;
        if o.csv {
            files.table(points, 6.0);
        }
        if o.netcdf {
            files.netcdf(points * 8.0);
        }
    }
    if n.kept > 0.0 && o.netcdf {
        let others_bytes = n.kept * n.records * 28.0 + n.lines * n.layers * 4.0;
        files.netcdf(n.kept * n.records * n.samples * n.parts * 8.0 + others_bytes);
    }
    if plan.target.has_map() {
        add_map(plan, &mut files);
    }
    files.largest_bytes
}

/// The files of the map.
fn add_map(plan: &Plan, files: &mut FilesMemory) {
    let n = &plan.counts;
    let o = &plan.scene().outputs;
    files.complete_bytes += n.cells * MAP_FIELDS * 8.0;
    if o.csv {
        files.table(n.cells, MAP_COLUMNS);
    }
    if o.netcdf {
        files.netcdf(n.cells * MAP_FIELDS * 4.0);
    }
    if o.hpl {
        files.add(n.cells * 40.0, 0.0);
    }
    if o.hpl && o.csv {
        files.table(n.cells, 6.0);
    }
    let (panels, pixels, raster_pixels) = map_pixels(plan);
    files.complete_bytes += panels * n.cells * 8.0;
    files.picture(pixels, raster_pixels);
}

/// Panels of the picture of a map, the pixels of the whole and those of the rasters: three panels
/// side by side, each as high as the scan, with room for labels around it.
fn map_pixels(plan: &Plan) -> (f64, f64, f64) {
    let scan = &plan.scene().scan;
    let gates_m = &plan.geometry.gate_range_m;
    if !plan.geometry.schedule.is_plane() {
        let whole = 1872.0 * (72.0 + 1.2 * (PANEL_PIXELS + 92.0));
        return (3.0, whole, 12.0 * PANEL_PIXELS * PANEL_PIXELS);
    }
    let low_rad = scan.elevation_min_rad;
    let high_rad = scan.elevation_max_rad;
    let far_m = gates_m.last().copied().unwrap_or(1.0);
    let steepest_rad = high_rad.abs().max(low_rad.abs());
    let near_m = gates_m.first().copied().unwrap_or(0.0) * steepest_rad.cos();
    let top_m = (scan.lidar_height_m + far_m * high_rad.sin()).max(0.0);
    let bottom_m = (scan.lidar_height_m + far_m * low_rad.sin()).min(0.0);
    // The lidar is shown where that takes less than half as much again.
    let across_m = if near_m < 0.5 * (far_m - near_m) {
        far_m
    } else {
        far_m - near_m
    };
    // A single gate has no width.
    let height = (PANEL_PIXELS * (top_m - bottom_m) / across_m.max(1e-9)).clamp(90.0, 780.0);
    let panels = if scan.realisations == 1 { 3.0 } else { 6.0 };
    let whole = 1872.0 * (72.0 + 1.2 * panels / 3.0 * (height + 92.0));
    (panels, whole, panels * 4.0 * PANEL_PIXELS * height)
}
