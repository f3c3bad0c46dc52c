//! The files of a run: what they take to be made, one after the other, in memory until all are there.
//!
//! Each format has its numbers in it as it writes them: a float of a table has some 15 letters, and the encoder of NetCDF holds
//! its data and two plans of the file, each with a copy.

use super::sizes::{MAP_FIELDS, Sizes, is_calm};
use super::stage::{PlannedStage, Target, run};
use crate::plan::geometry::Geometry;
use crate::progress::Stage;
use crate::scene::Scene;

/// Columns of the table of a map.
const MAP_COLUMNS: f64 = 25.0;
/// A number of a table, and its text.
const NUMBER_BYTES: f64 = 8.0;
const TEXT_BYTES: f64 = 15.0;
/// Program that drawing brings into memory, letters included.
const DRAWING_BYTES: f64 = 7e5;
/// Pixels of the picture of a profile.
const PROFILE_PIXELS: f64 = 1344.0 * 520.0;

/// Files that are made one after the other: the memory of what is there already, and the most that was held, bytes.
#[derive(Default)]
struct Written {
    done_bytes: f64,
    most_bytes: f64,
}

impl Written {
    /// A file, and what is held beside it until it is there.
    fn add(&mut self, wanted: bool, file_bytes: f64, beside_bytes: f64) {
        if wanted {
            self.most_bytes = self
                .most_bytes
                .max(self.done_bytes + file_bytes + beside_bytes);
            self.done_bytes += file_bytes;
        }
    }

    fn table(&mut self, wanted: bool, rows: f64, columns: f64) {
        self.add(
            wanted,
            rows * columns * TEXT_BYTES,
            rows * columns * NUMBER_BYTES,
        );
    }

    fn netcdf(&mut self, wanted: bool, file_bytes: f64) {
        self.add(wanted, file_bytes, 3.0 * file_bytes);
    }

    /// A picture of so many pixels, with rasters of so many in it.
    fn picture(&mut self, [svg, png]: [bool; 2], pixels: f64, raster_pixels: f64) {
        // Rasters are in the drawing, four bytes a pixel, and one at a time is coded or fitted, in growing buffers; the painted picture has four, and
        // one where its panels are cut out.
        let mask = if raster_pixels > 0.0 { 1.0 } else { 0.0 };
        let held_bytes = raster_pixels * 4.0 * 1.5 + DRAWING_BYTES;
        for (wanted, file_bytes, painted) in [
            (svg, raster_pixels * 0.5, 0.0),
            (png, pixels * 0.2, 4.0 + mask),
        ] {
            self.add(wanted, file_bytes, held_bytes + pixels * painted);
        }
    }
}

pub(super) fn files(scene: &Scene, target: Target, g: &Geometry, n: &Sizes) -> PlannedStage {
    let o = &scene.outputs;
    let (netcdf, plots) = (o.netcdf, cfg!(feature = "plots"));
    let pictures = [o.svg && plots, o.png && plots];
    let mut written = Written::default();
    if matches!(target, Target::Run | Target::Efficiency) {
        written.table(o.csv, o.profile_points as f64, 10.0);
        written.picture(pictures, PROFILE_PIXELS, 0.0);
    }
    if target == Target::Run && o.flow && !is_calm(scene) {
        let (ny, nz) = crate::measure::sizes::PLANE_POINTS;
        let points = (ny * nz) as f64;
        written.table(o.csv, points, 6.0);
        written.netcdf(netcdf, points * 8.0);
    }
    if n.kept > 0.0 {
        let others = n.kept * n.records * 28.0 + n.lines * n.layers * 4.0;
        written.netcdf(
            netcdf,
            n.kept * n.records * n.samples * n.parts * 8.0 + others,
        );
    }
    if matches!(target, Target::Run | Target::Map) {
        written.done_bytes += n.cells * MAP_FIELDS * 8.0;
        written.table(o.csv, n.cells, MAP_COLUMNS);
        written.netcdf(netcdf, n.cells * MAP_FIELDS * 4.0);
        written.add(o.hpl, n.cells * 40.0, 0.0);
        written.table(o.hpl && o.csv, n.cells, 6.0);
        let (panels, pixels, whole_pixels) = map_pixels(scene, g);
        written.done_bytes += panels * n.cells * 8.0;
        written.picture(pictures, whole_pixels, pixels);
    }
    let kinds = [
        (o.csv, "CSV"),
        (o.netcdf, "NetCDF"),
        (o.svg, "SVG"),
        (o.png, "PNG"),
    ];
    let kinds: Vec<&str> = kinds.into_iter().filter(|k| k.0).map(|k| k.1).collect();
    run(Stage::Files, kinds.join(", "), [written.most_bytes, 0.0])
}

/// Panels of the picture of a map, the pixels of their rasters and those of the whole: three panels side by side, each as high
/// as the scan, with room for letters around it.
fn map_pixels(scene: &Scene, g: &Geometry) -> (f64, f64, f64) {
    const BOX: f64 = 307.0;
    if !g.schedule.is_plane() {
        return (3.0, 12.0 * BOX * BOX, 1872.0 * (72.0 + 1.2 * (BOX + 92.0)));
    }
    let (low, high) = (scene.scan.elevation_min_rad, scene.scan.elevation_max_rad);
    let far_m = g.gate_range_m.last().copied().unwrap_or(1.0);
    let near_m = g.gate_range_m.first().copied().unwrap_or(0.0) * high.abs().max(low.abs()).cos();
    let top_m = (scene.scan.lidar_height_m + far_m * high.sin()).max(0.0);
    let bottom_m = (scene.scan.lidar_height_m + far_m * low.sin()).min(0.0);
    // The lidar is shown where that takes less than half as much again.
    let across_m = if near_m < 0.5 * (far_m - near_m) {
        far_m
    } else {
        far_m - near_m
    };
    // A single gate has no width.
    let height = (BOX * (top_m - bottom_m) / across_m.max(1e-9)).clamp(90.0, 780.0);
    let panels = if scene.scan.realisations == 1 {
        3.0
    } else {
        6.0
    };
    (
        panels,
        panels * 4.0 * BOX * height,
        1872.0 * (72.0 + 1.2 * panels / 3.0 * (height + 92.0)),
    )
}
