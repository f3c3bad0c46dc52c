//! Pictures of a finished wake, from its files: circulation and paths; with NetCDF fields and planes surfaces of equal
//! vorticity and a cross-plane that moves.
//!
//! Check: a test draws a small run and looks for the files.

use super::finished::FinishedWake;
use crate::Error;
use crate::io::fields_input::read_scalar;
use crate::io::{CrossPlanes, FileGroup, planes_input};
use crate::plot::{
    Axis, Cells, ColourMap, CurvePlot, Figure, IsosurfacePlot, MapPlot, Panel, Series, Style,
    Surface, Volume, apng,
};
use std::path::PathBuf;
use wakescope_les::VortexPair;
use wakescope_les::winds::VolumeComponent;

/// Names of the pictures.
pub(in super::super) const PICTURES: [&str; 5] = [
    "wake.svg",
    "wake.png",
    "surfaces.svg",
    "surfaces.png",
    "plane1.apng",
];

/// How long a cross-plane is shown, s.
const FRAME_S: f64 = 0.15;

/// Times that the box is repeated along the flight, so that waves can be seen as such.
pub const REPEATS: usize = 2;

/// The names of the two vortices in the columns of the history.
const SIDES: [&str; 2] = ["left", "right"];

impl FinishedWake {
    /// Circulation of both vortices, averaged over 5 to 15 m and over its value at the start, against age.
    ///
    /// # Errors
    /// A history without these columns.
    pub fn circulation_plot(&self) -> Result<CurvePlot, Error> {
        let mut plot = CurvePlot::new(
            "",
            Axis::linear("τ"),
            Axis::linear("Γ_{5-15}(τ)/Γ_{5-15}(0)"),
        );
        for side in SIDES {
            plot = plot.with(Series::new(
                side,
                Style::Line,
                self.curve(&format!("gamma_ratio_{side}"))?,
            ));
        }
        Ok(plot)
    }

    /// Paths of both vortices, lengths in b0.
    ///
    /// # Errors
    /// A history without these columns.
    pub fn path_plot(&self) -> Result<CurvePlot, Error> {
        let mut plot = CurvePlot::new("", Axis::linear("y/b₀"), Axis::linear("z/b₀"));
        for side in SIDES {
            let y = self.column(&format!("y_{side}"))?.iter().copied();
            let path: Vec<(f64, f64)> = y
                .zip(self.column(&format!("z_{side}"))?.iter().copied())
                .collect();
            plot = plot.with(Series::new(side, Style::Line, path));
        }
        Ok(plot)
    }

    /// The path of the pair without viscosity, along the hyperbola over the ground, to the last age; lengths in b0.
    fn inviscid_path(&self) -> Result<[Vec<(f64, f64)>; 2], Error> {
        let scales = self.scales;
        let pair = VortexPair {
            circulation_m2_s: scales.circulation_m2_s,
            spacing_m: scales.spacing_m,
            core_radius_m: self.flow.core_radius * scales.spacing_m,
            lateral_position_m: 0.0,
            height_m: self.flow.height * scales.spacing_m,
            ground: wakescope_les::Ground::Image,
            profile: wakescope_les::CirculationProfile::Algebraic,
            motion: wakescope_les::Motion::Inviscid,
        };
        let mut paths = [Vec::new(), Vec::new()];
        for tau in self.column("tau")? {
            let vortices = pair.vortices(pair.time_s(*tau));
            for (path, vortex) in paths.iter_mut().zip(vortices) {
                let y = vortex.lateral_position_m / scales.spacing_m;
                path.push((y, vortex.height_m / scales.spacing_m));
            }
        }
        Ok(paths)
    }

    /// Draws the run into its folder; returns the files.
    ///
    /// # Errors
    /// Files of the run that cannot be read; pictures that cannot be written.
    pub fn draw(&self) -> Result<Vec<PathBuf>, Error> {
        let mut paths = self.path_plot()?;
        for (name, path) in ["inviscid", ""].into_iter().zip(self.inviscid_path()?) {
            paths = paths.with(Series::new(name, Style::Dash, path).in_colour(2));
        }
        let mut figure =
            Figure::side_by_side([self.circulation_plot()?, paths]).titled(&self.words());
        figure.width = 1200.0;
        let mut pictures = vec![("wake", figure)];
        pictures.extend(self.surfaces_figure()?.map(|figure| ("surfaces", figure)));
        let mut group = FileGroup::new(&self.folder);
        let origin = self.file.provenance();
        for (name, figure) in &pictures {
            figure.add_to(&mut group, name, &origin)?;
        }
        if let frames = self.frames()?
            && frames.len() > 1
        {
            group.add("plane1.apng", apng(&frames, FRAME_S, &origin)?)?;
        }
        group.commit()
    }

    /// Surfaces where the vorticity, over `Gamma0/b0^2`, is 1 and 10, at the ages of the fields; none without fields as NetCDF.
    ///
    /// # Errors
    /// Fields that cannot be read.
    pub fn surfaces_figure(&self) -> Result<Option<Figure>, Error> {
        let mut panels = Vec::new();
        for (index, tau) in self.fields_tau.iter().enumerate() {
            let path = self.folder.join(format!("fields_{:04}.nc", index + 1));
            if !path.exists() {
                return Ok(None);
            }
            let VolumeComponent {
                nodes_m: [x, y, z],
                values,
            } = read_scalar(&path, Some(0), "vorticity_magnitude")?;
            let scales = self.scales;
            let unit_per_s = self.scales.vorticity_per_s();
            let length = self.flow.size[0];
            let nx = x.len();
            let repeated = (0..REPEATS * nx + 1)
                .map(|i| x[i % nx] / scales.spacing_m + (i / nx) as f64 * length)
                .collect();
            let rows = values.chunks(nx);
            let values = rows
                .flat_map(|row| (0..REPEATS * nx + 1).map(|i| (row[i % nx] / unit_per_s) as f32))
                .collect();
            let y = y.iter().map(|y_m| y_m / scales.spacing_m).collect();
            let z = z.iter().map(|z_m| z_m / scales.spacing_m).collect();
            panels.push(Panel::Surfaces(IsosurfacePlot {
                title: format!("τ = {tau}"),
                volume: Volume::new([repeated, y, z], values)?,
                surfaces: vec![
                    Surface {
                        level: 1.0,
                        colour: [120, 170, 215],
                        opacity: 0.35,
                    },
                    Surface {
                        level: 10.0,
                        colour: [200, 60, 40],
                        opacity: 1.0,
                    },
                ],
                view_rad: [-0.55, 0.35],
            }));
        }
        if panels.is_empty() {
            return Ok(None);
        }
        let mut figure = Figure::stacked(panels);
        figure.columns = 2;
        figure.width = 1200.0;
        Ok(Some(figure))
    }

    /// Axial vorticity of the first cross-plane over time, over `Gamma0/b0^2`; empty without planes as NetCDF.
    ///
    /// # Errors
    /// Planes that cannot be read.
    pub fn frames(&self) -> Result<Vec<Figure>, Error> {
        let name = self.folder.join("plane1");
        if !self.folder.join("plane1_0001.nc").exists() {
            return Ok(Vec::new());
        }
        let unit_per_s = self.scales.vorticity_per_s();
        let mut frames: Vec<(f64, Figure)> = Vec::new();
        for path in planes_input::files(&name)? {
            let planes = planes_input::read(&path)?;
            for (place, tau) in planes.tau.iter().enumerate() {
                let vorticity = axial_vorticity_per_s(&planes, place)
                    .into_iter()
                    .map(|w| w / unit_per_s)
                    .collect();
                let cells = Cells::of_plane(&planes.y_m, &planes.z_m, vorticity);
                let map = MapPlot::of_cells(cells, "ω_{x} b₀²/Γ₀", true)
                    .coloured(ColourMap::Diverging { limit: 10.0 })
                    .titled(&format!("τ = {tau:.1}"));
                let mut figure = Figure::stacked([map]);
                figure.width = 640.0;
                frames.push((*tau, figure));
            }
        }
        frames.sort_by(|a, b| a.0.total_cmp(&b.0));
        frames.dedup_by(|a, b| (a.0 - b.0).abs() < 1e-6);
        Ok(frames.into_iter().map(|f| f.1).collect())
    }
}

/// `dw/dy - dv/dz` by differences over the neighbours, `[z][y]` \[1/s\].
fn axial_vorticity_per_s(planes: &CrossPlanes, place: usize) -> Vec<f64> {
    let ny = planes.y_m.len();
    let nz = planes.z_m.len();
    let mut out = Vec::with_capacity(ny * nz);
    for k in 0..nz {
        let low = k.saturating_sub(1);
        let high = (k + 1).min(nz - 1);
        for j in 0..ny {
            let left = j.saturating_sub(1);
            let right = (j + 1).min(ny - 1);
            let dw = planes.w_m_s[[place, k, right]] - planes.w_m_s[[place, k, left]];
            let dv = planes.v_m_s[[place, high, j]] - planes.v_m_s[[place, low, j]];
            out.push(
                dw / (planes.y_m[right] - planes.y_m[left])
                    - dv / (planes.z_m[high] - planes.z_m[low]),
            );
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::super::{Begin, CaseFile, CaseKind, FlowCase, WakePreset, run};
    use super::*;
    use crate::Silent;
    use crate::io::fields_input::places;
    use std::path::Path;

    #[test]
    fn a_finished_wake_is_drawn_and_an_unfinished_one_is_refused() {
        let mut case = WakePreset::Coarse.case();
        let CaseKind::Wake(wake) = &mut case.case else {
            panic!("a wake")
        };
        wake.cells = [4, 16, 12];
        if let Some(output) = &mut case.wake {
            (output.end_tau, output.every_tau) = (0.04, 0.02);
            output.fields_tau = Some(vec![0.04]);
            output.planes_tau = Some(vec![0.0, 0.04]);
        }
        let file = |case: &FlowCase| {
            CaseFile::parse(
                &crate::document::Content::to_toml(case),
                Path::new("case.toml"),
            )
            .unwrap()
        };
        let folder = tempfile::tempdir().unwrap();
        case.time.pause_after_steps = Some(1);
        run(&file(&case), folder.path(), Begin::New, &Silent).unwrap();
        assert!(
            FinishedWake::read(folder.path())
                .unwrap_err()
                .to_string()
                .contains("the run has reached tau = ")
        );
        case.time.pause_after_steps = None;
        run(&file(&case), folder.path(), Begin::Restart, &Silent).unwrap();
        let wake = FinishedWake::read(folder.path()).unwrap();
        let written = wake.draw().unwrap();
        let names: Vec<_> = written
            .iter()
            .map(|path| path.file_name().unwrap().to_str().unwrap())
            .collect();
        let count = 5;
        assert_eq!(names, PICTURES[..count]);
        // The pair begins where the inviscid one does and has hardly sunk.
        let [left, right] = wake.inviscid_path().unwrap();
        for (found, expected) in [(left[0], (-0.5, 1.0)), (right[0], (0.5, 1.0))] {
            assert!(
                (found.0 - expected.0).hypot(found.1 - expected.1) < 1e-12,
                "{found:?}"
            );
        }
        let sunk = 1.0 - right.last().unwrap().1;
        assert!((sunk - 0.04).abs() < 0.01, "{sunk}: about tau at first");
    }

    #[test]
    fn fields_and_planes_of_a_run_come_back() {
        let mut case = WakePreset::Coarse.case();
        let CaseKind::Wake(wake) = &mut case.case else {
            panic!("a wake")
        };
        wake.cells = [4, 16, 12];
        if let Some(output) = &mut case.wake {
            output.end_tau = 0.02;
            output.fields_tau = Some(vec![0.02]);
            output.planes_tau = Some(vec![0.0, 0.02]);
        }
        let file = CaseFile::parse(
            &crate::document::Content::to_toml(&case),
            Path::new("case.toml"),
        )
        .unwrap();
        let folder = tempfile::tempdir().unwrap();
        let outcome = run(&file, folder.path(), Begin::New, &Silent).unwrap();
        let path = folder.path().join("fields_0001.nc");
        let (times, _) = places(&path, "vorticity_magnitude").unwrap();
        let [(place, time_s)] = times[..] else {
            panic!("one time")
        };
        let field = read_scalar(&path, place, "vorticity_magnitude").unwrap();
        assert_eq!(field.nodes_m.each_ref().map(Vec::len), [4, 16, 12]);
        assert!((time_s - outcome.time_s).abs() < 1e-9);
        // The core turns by Gamma0/(pi r_c^2) at its centre; three cells see part of it.
        let largest = field.values.iter().copied().fold(0.0, f64::max);
        let core_per_s = 500.0 / (std::f64::consts::PI * 4.7_f64.powi(2));
        assert!(
            largest > 0.05 * core_per_s && largest < 3.0 * core_per_s,
            "{largest} of {core_per_s}"
        );
        let planes = planes_input::files(&folder.path().join("plane1")).unwrap();
        assert_eq!(
            planes
                .iter()
                .map(|path| planes_input::read(path).unwrap().tau.len())
                .sum::<usize>(),
            2
        );
        assert!(
            read_scalar(&path, place, "nothing")
                .unwrap_err()
                .to_string()
                .contains("nothing")
        );
        assert!(planes_input::files(&folder.path().join("plane7")).is_err());
    }
}
