//! Pictures of a finished wake, from its files: circulation and paths; with NetCDF fields and planes surfaces of equal
//! vorticity and a cross-plane that moves.
//!
//! Check: a test draws a small run and looks for the files.

use super::finished::FinishedWake;
use crate::Error;
use crate::io::FileGroup;
use crate::plot::apng;
use crate::plot::{Axis, CurvePlot, Figure, Series, Style};
use std::path::PathBuf;
use wakescope_les::VortexPair;

/// Names of the pictures.
pub(in super::super) const PICTURES: [&str; 5] =
    ["wake.svg", "wake.png", "surfaces.svg", "surfaces.png", "plane1.apng"];

/// How long a cross-plane is shown, s.
const FRAME_S: f64 = 0.15;

/// The names of the two vortices in the columns of the history.
const SIDES: [&str; 2] = ["left", "right"];

impl FinishedWake {
    /// Circulation of both vortices, averaged over 5 to 15 m and over its value at the start, against age.
    ///
    /// # Errors
    /// A history without these columns.
    pub fn circulation_plot(&self) -> Result<CurvePlot, Error> {
        let mut plot = CurvePlot::new("", Axis::linear("τ"), Axis::linear("Γ_{5-15}(τ)/Γ_{5-15}(0)"));
        for side in SIDES {
            plot = plot.with(Series::new(side, Style::Line, self.curve(&format!("gamma_ratio_{side}"))?));
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
            let path: Vec<(f64, f64)> = y.zip(self.column(&format!("z_{side}"))?.iter().copied()).collect();
            plot = plot.with(Series::new(side, Style::Line, path));
        }
        Ok(plot)
    }

    /// The path of the pair without viscosity, along the hyperbola over the ground, to the last age; lengths in b0.
    fn inviscid_path(&self) -> Result<[Vec<(f64, f64)>; 2], Error> {
        let scales = self.flow.pair.scales().map_err(Error::Flow)?;
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
            let at = pair.centres(pair.time_s(*tau));
            for (path, y_m) in paths.iter_mut().zip([at.left_y_m, at.right_y_m]) {
                path.push((y_m / scales.spacing_m, at.height_m / scales.spacing_m));
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
        let mut figure = Figure::side_by_side([self.circulation_plot()?, paths]).titled(&self.words());
        figure.width = 1200.0;
        let mut pictures = vec![("wake", figure)];
        pictures.extend(self.surfaces_figure()?.map(|figure| ("surfaces", figure)));
        let mut group = FileGroup::new(&self.folder);
        for (name, figure) in &pictures {
            figure.add_to(&mut group, name, &self.origin)?;
        }
        if let frames = self.frames()?
            && frames.len() > 1
        {
            group.add("plane1.apng", apng(&frames, FRAME_S, &self.origin)?)?;
        }
        Ok(group.commit()?)
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::{Begin, CaseFile, CaseKind, FlowCase, WakePreset, run};
    use super::*;
    use crate::Silent;
    use std::path::Path;

    #[test]
    fn a_finished_wake_is_drawn_and_an_unfinished_one_is_refused() {
        let mut case = WakePreset::Coarse.case();
        let CaseKind::Wake(wake) = &mut case.case else { panic!("a wake") };
        wake.cells = [4, 16, 12];
        if let Some(output) = &mut case.wake {
            (output.end_tau, output.every_tau) = (0.04, 0.02);
            output.fields_tau = Some(vec![0.04]);
            output.planes_tau = Some(vec![0.0, 0.04]);
        }
        let file = |case: &FlowCase| CaseFile::parse(&toml::to_string(case).unwrap(), Path::new("case.toml")).unwrap();
        let folder = tempfile::tempdir().unwrap();
        case.time.pause_after_steps = Some(1);
        run(&file(&case), folder.path(), Begin::New, &Silent).unwrap();
        assert!(FinishedWake::read(folder.path()).unwrap_err().to_string().contains("the run stands at tau = "));
        case.time.pause_after_steps = None;
        run(&file(&case), folder.path(), Begin::Restart, &Silent).unwrap();
        let wake = FinishedWake::read(folder.path()).unwrap();
        let written = wake.draw().unwrap();
        let names: Vec<_> = written.iter().map(|path| path.file_name().unwrap().to_str().unwrap()).collect();
        let count = 5;
        assert_eq!(names, PICTURES[..count]);
        // The pair begins where the inviscid one does and has hardly sunk.
        let [left, right] = wake.inviscid_path().unwrap();
        for (found, expected) in [(left[0], (-0.5, 1.0)), (right[0], (0.5, 1.0))] {
            assert!((found.0 - expected.0).hypot(found.1 - expected.1) < 1e-12, "{found:?}");
        }
        let sunk = 1.0 - right.last().unwrap().1;
        assert!((sunk - 0.04).abs() < 0.01, "{sunk}: about tau at first");
    }
}
