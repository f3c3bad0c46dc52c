//! What figures 10 to 14 share: scans of the simulated wake or of the analytic pair, regions about the cores.
//!
//! Maps of neighbouring cells share their windows: as independent counts one line of sight in [`SHARED_LINES`] and one gate in
//! [`SHARED_GATES`].

use super::context::Context;
use crate::Failure;
use crate::wakes;
use std::path::PathBuf;
use wakescope_les::analysis::decay::value_at;
use wakescope_sim::io::csv::Column;
use wakescope_sim::io::{Provenance, Table};
use wakescope_sim::measure::cell_average::CellAverage;
use wakescope_sim::measure::map::VelocityEstimates;
use wakescope_sim::measure::progress::Silent;
use wakescope_sim::plan::Plan;
use wakescope_sim::scene::{
    Flow, Method, ModelOrder, Outside, RefractiveTurbulence, Scene, SceneFile, SimulatedFlow, SimulatedMotion,
    SnrReference, Turbulence, VortexPair, Weighting,
};
use wakescope_sim::sweep::{self, Request, Sweep};
use wakescope_sim::{measure::wind, measure::write};

/// Lines of sight 0.5 m apart that a region of 2 m shares.
const SHARED_LINES: f64 = 9.0;
/// Gates 3 m apart that share a window of 38.4 m and the pulse.
const SHARED_GATES: f64 = 10.0;
/// Cells of a map that are worth one that is independent.
pub(super) const SHARED_CELLS: f64 = SHARED_LINES * SHARED_GATES;
/// What counts as inside a vortex, m from its centre.
pub(super) const INSIDE_M: f64 = 8.0;
/// What counts as outside of both, m.
pub(super) const OUTSIDE_M: f64 = 30.0;

/// The two references of the signal-to-noise ratio for which the chapter's figures are drawn.
pub(super) const REFERENCES: [(&str, SnrReference); 2] =
    [("physical", SnrReference::Physical {}), ("chapter", SnrReference::Chapter {})];

/// One pulse a line, unweighted windows, regions of 2 m, the pair 400 m away; the first seed.
pub(super) fn early_scene(realisations: usize) -> Scene {
    let mut scene = Scene { seed: 0, ..Scene::default() };
    (scene.scan.elevation_min_rad, scene.scan.elevation_max_rad) = (0.03, 0.2);
    (scene.scan.range_min_m, scene.scan.range_max_m) = (310.0, 500.0);
    (scene.scan.pulses_per_line, scene.scan.realisations) = (1, realisations);
    scene.estimator.weighting = Weighting::Rectangular;
    scene
}

/// The scene with the chapter's periodogram accumulation (PA) or correlogram accumulation (CA).
pub(super) fn with_method(mut scene: Scene, method: &str) -> Scene {
    scene.estimator.method = match method {
        "CA" => Method::Autoregressive(ModelOrder::default()),
        _ => Method::PeriodogramAccumulation {},
    };
    scene.estimator.padded_samples = if method == "CA" { 2048 } else { 1024 };
    scene
}

/// The same scan about the cores alone.
pub(super) fn near_scene(realisations: usize) -> Scene {
    let mut scene = early_scene(realisations);
    (scene.scan.elevation_min_rad, scene.scan.elevation_max_rad) = (0.065, 0.175);
    (scene.scan.range_min_m, scene.scan.range_max_m) = (315.0, 485.0);
    scene
}

/// The scene with refractive turbulence on the path: few realisations on a grid of half the chapter's width with `quick`.
pub(super) fn with_turbulence(context: &Context, mut scene: Scene, cn2_m_m23: f64) -> Scene {
    let turbulence = RefractiveTurbulence {
        cn2_m_m23,
        realisations: context.choose(8, 100, 400),
        grid_points: context.choose(256, 512, 512),
        ..RefractiveTurbulence::default()
    };
    scene.atmosphere.turbulence = Turbulence::Refractive(turbulence);
    scene
}

/// The scene with the seed of a batch of scans.
pub(super) fn of_batch(scene: Scene, batch: u64) -> Scene {
    Scene { seed: scene.seed + 1_000_003 * batch, ..scene }
}

/// The flow that is looked at.
pub(super) struct Sight {
    flow: Flow,
    /// Folder from which the flow is read.
    folder: PathBuf,
    /// Centres of the vortices, (y, z), m.
    pub(super) cores: Vec<(f64, f64)>,
    /// Which flow it is, for captions.
    pub(super) words: String,
    /// The same in two words.
    pub(super) mark: String,
}

impl Sight {
    /// The wake of an age, simulated or analytic: at its start if early, on its inviscid path if late.
    pub(super) fn of(context: &Context, age: Age) -> Result<Self, Failure> {
        if context.analytic {
            let mut scene = Scene::default();
            let mut words = "ANALYTIC PAIR".to_owned();
            if age == Age::Late {
                let motion = wakescope_sim::scene::VortexMotion::Inviscid;
                scene.flow = Flow::VortexPair(VortexPair { motion, age_tau: age.tau(), ..VortexPair::default() });
                words = format!("{words} at tau = {} on its inviscid path", age.tau());
            }
            let cores = cores_of(&scene);
            return Ok(Self { flow: scene.flow, folder: PathBuf::new(), cores, words, mark: "analytic pair".into() });
        }
        let wake = wakes::of(context)?;
        let b0_m = wake.flow.pair.scales()?.spacing_m;
        let flow = SimulatedFlow {
            planes: "plane1".into(),
            motion: SimulatedMotion::Frozen,
            age_tau: Some(age.tau()),
            ..SimulatedFlow::default()
        };
        let core = |side: &str| -> Result<(f64, f64), Failure> {
            let at =
                |name: &str| Ok::<f64, Failure>(b0_m * value_at(&wake.curve(&format!("{name}_{side}"))?, age.tau()));
            Ok((flow.lateral_position_m + at("y")?, at("z")?))
        };
        let cores = vec![core("left")?, core("right")?];
        let words = format!("tau = {}, {}", age.tau(), wake.words());
        Ok(Self { flow: Flow::Simulated(flow), folder: wake.folder, cores, words, mark: "simulated flow".into() })
    }

    /// Where the files of its scenes are looked for.
    fn path(&self) -> PathBuf {
        self.folder.join("scene.toml")
    }

    /// The scene with this flow; its seed is counted from that of the figures.
    pub(super) fn scene(&self, context: &Context, mut scene: Scene) -> Scene {
        scene.seed += context.seed;
        scene.flow = self.flow.clone();
        if matches!(self.flow, Flow::Simulated(_)) {
            scene.scan.outside_flow = Outside::Mask {};
        }
        scene
    }
}

/// The two ages of the chapter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Age {
    Early,
    Late,
}

impl Age {
    fn tau(self) -> f64 {
        match self {
            Self::Early => 2.5,
            Self::Late => 5.0,
        }
    }
}

/// A map that was made, with what is needed to read it.
pub(super) struct Study {
    cores: Vec<(f64, f64)>,
    pub(super) plan: Plan,
    pub(super) map: VelocityEstimates,
    /// Distance to the nearer core, m, and range from it along the line, m: `[line][gate]`.
    pub(super) distance_m: Vec<Vec<f64>>,
}

impl Study {
    /// Runs the maps of scenes; what they have in common is computed once.
    pub(super) fn runs(context: &Context, sight: &Sight, scenes: Vec<Scene>) -> Result<Vec<Self>, Failure> {
        let file = |scene| SceneFile::parse(&sight.scene(context, scene).to_toml(), &sight.path());
        Self::of_files(sight, &scenes.into_iter().map(file).collect::<Result<Vec<_>, _>>()?)
    }

    /// Runs the maps of a scene with keys that vary, the last one fastest.
    pub(super) fn sweep(context: &Context, sight: &Sight, scene: Scene, vary: &[&str]) -> Result<Vec<Self>, Failure> {
        let toml = sight.scene(context, scene).to_toml();
        let request = Request { vary: vary.iter().map(ToString::to_string).collect(), ..Request::default() };
        let sweep = Sweep::parse(&toml, &sight.path(), &request)?;
        Self::of_files(sight, &sweep.cases.into_iter().map(|case| case.scene).collect::<Vec<_>>())
    }

    fn of_files(sight: &Sight, files: &[SceneFile]) -> Result<Vec<Self>, Failure> {
        Ok(sweep::maps(files, &Silent)?.into_iter().map(|(plan, map)| Self::of(sight, plan, map)).collect())
    }

    fn of(sight: &Sight, plan: Plan, map: VelocityEstimates) -> Self {
        let cores = sight.cores.clone();
        let distance = |el: f64, r: f64| {
            let (y, z) = (r * el.cos(), plan.scene.scene.scan.lidar_height_m + r * el.sin());
            cores.iter().map(|c| (y - c.0).hypot(z - c.1)).fold(f64::INFINITY, f64::min)
        };
        let row = |el: &f64| map.range_m.iter().map(|&r| distance(*el, r)).collect();
        let distance_m = map.elevation_rad.iter().map(row).collect();
        Self { cores, plan, map, distance_m }
    }

    pub(super) fn provenance(&self) -> Provenance {
        write::provenance(&self.plan)
    }

    /// Centres of the vortices in the polar coordinates of the scan: (range, elevation).
    pub(super) fn cores_polar(&self) -> Vec<(f64, f64)> {
        let height_m = self.plan.scene.scene.scan.lidar_height_m;
        self.cores.iter().map(|c| (c.0.hypot(c.1 - height_m), (c.1 - height_m).atan2(c.0))).collect()
    }

    /// Averages over the cells whose distance to the nearer core, m, is accepted.
    pub(super) fn over(&self, accept: impl Fn(f64) -> bool) -> CellAverage {
        let mut cells = Vec::new();
        for (i, row) in self.distance_m.iter().enumerate() {
            cells.extend(row.iter().enumerate().filter(|(_, d)| accept(**d)).map(|(j, _)| (i, j)));
        }
        self.over_cells(&cells)
    }

    /// Averages over some cells, whose neighbours share lines and gates.
    pub(super) fn over_cells(&self, cells: &[(usize, usize)]) -> CellAverage {
        CellAverage::over(&self.map, cells, (SHARED_LINES, SHARED_GATES))
    }

    /// Averages over cells of a profile: at one gate, or at one for each vortex.
    pub(super) fn over_profile(&self, cells: &[(usize, usize)]) -> CellAverage {
        CellAverage::over(&self.map, cells, (SHARED_LINES, SHARED_GATES))
    }
}

/// Centres of the vortices when the scan begins, (y, z), m; none where the flow is no pair.
fn cores_of(scene: &Scene) -> Vec<(f64, f64)> {
    match &scene.flow {
        Flow::VortexPair(pair) => {
            let c = wind::vortex_pair(pair).centres(wind::start_time_s(scene));
            vec![(c.left_y_m, c.height_m), (c.right_y_m, c.height_m)]
        }
        _ => Vec::new(),
    }
}

/// Tables of the same columns one below the other, with a last column that tells them apart.
pub(super) fn stacked(name: &str, parts: Vec<(&str, Table)>) -> Result<Table, Failure> {
    let labelled = parts.into_iter().map(|(label, table)| {
        let rows = table.columns().first().map_or(0, |(_, column)| match column {
            Column::Float(v) => v.len(),
            Column::Int(v) => v.len(),
            Column::Text(v) => v.len(),
        });
        table.text(name, std::iter::repeat_n(label, rows))
    });
    Ok(Table::stack(labelled)?)
}

/// Mean of some numbers and its standard error.
pub(super) fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stacked_tables_keep_their_rows_and_say_which_is_which() {
        let part = |x: f64| Table::new().float("x_m", [x, x + 1.0]).int("n", [1, 2]).text("t", ["a", "b"]);
        let both = stacked("which", vec![("one", part(1.0)), ("two", part(5.0))]).unwrap();
        let text = both.to_csv(&crate::workspace::provenance("", 0)).unwrap();
        assert!(text.ends_with("x_m,n,t,which\n1.0,1,a,one\n2.0,2,b,one\n5.0,1,a,two\n6.0,2,b,two\n"), "{text}");
    }

    #[test]
    fn the_mean_has_the_error_of_the_mean() {
        let (mean, error) = mean_and_error(&[1.0, 2.0, 3.0, 4.0]);
        assert!((mean - 2.5).abs() < 1e-12 && (error - (5.0_f64 / 12.0).sqrt()).abs() < 1e-12);
    }
}
