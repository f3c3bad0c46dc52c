//! What figures 10 to 14 and 25 share: scans of the simulated wake or of the analytic pair in batches, regions about the cores.

use super::context::*;
use crate::statistics::MOST_BATCHES;
use crate::wakes;
use std::iter::repeat_n;
use std::path::PathBuf;
use wakescope_sim::io::csv::Column;
use wakescope_sim::measure::cell_average::CellAverage;
use wakescope_sim::measure::map::VelocityEstimates;
use wakescope_sim::plan::wind;
use wakescope_sim::scene::{
    Autoregressive, Flow, Method, Outside, PeriodogramAccumulation, RefractiveTurbulence,
    SimulatedFlow, SimulatedMotion, Turbulence, VortexMotion, VortexPair, Weighting,
};
use wakescope_sim::sweep;

/// What counts as inside a vortex, m from its centre.
pub(super) const INSIDE_M: f64 = 8.0;
/// What counts as outside of both, m.
pub(super) const OUTSIDE_M: f64 = 30.0;

/// The two ages of the chapter.
pub(super) const EARLY_TAU: f64 = 2.5;
pub(super) const LATE_TAU: f64 = 5.0;

/// The two references of the signal-to-noise ratio for which the chapter's figures are drawn.
pub(super) const REFERENCES: [(&str, SnrReference); 2] = [
    ("physical", SnrReference::Physical {}),
    ("chapter", SnrReference::Chapter {}),
];

/// One pulse a line, regions of 2 m, the pair 400 m away; the first seed.
pub(super) fn early_scene(realisations: usize) -> Scene {
    let mut scene = Scene {
        seed: 0,
        ..Scene::default()
    };
    scene.scan.elevation_min_rad = 0.03;
    scene.scan.elevation_max_rad = 0.2;
    scene.scan.range_min_m = 310.0;
    scene.scan.range_max_m = 500.0;
    scene.scan.pulses_per_line = 1;
    scene.scan.realisations = realisations;
    scene
}

/// Periodogram accumulation without and with the chapter's usual weighting, and its correlogram accumulation.
pub(super) const METHODS: [&str; 3] = ["PA", "PA, Gaussian", "CA"];

/// The scene with one of the [`METHODS`].
pub(super) fn with_method(mut scene: Scene, method: &str) -> Scene {
    scene.estimator.method = match method {
        "CA" => Method::Autoregressive(Autoregressive::default()),
        _ => Method::PeriodogramAccumulation(PeriodogramAccumulation {}),
    };
    scene.estimator.weighting = if method == METHODS[1] {
        Weighting::Gaussian
    } else {
        Weighting::Rectangular
    };
    scene.estimator.padded_samples = if method == "CA" { 2048 } else { 1024 };
    scene
}

/// The same scan about the cores alone.
pub(super) fn near_scene(realisations: usize) -> Scene {
    let mut scene = early_scene(realisations);
    scene.scan.elevation_min_rad = 0.065;
    scene.scan.elevation_max_rad = 0.175;
    scene.scan.range_min_m = 315.0;
    scene.scan.range_max_m = 485.0;
    scene
}

/// The scene with refractive turbulence on the path: few realisations on a grid of half the chapter's width with `quick`.
pub(super) fn with_turbulence(context: &Context, mut scene: Scene, cn2_m_m23: f64) -> Scene {
    let turbulence = RefractiveTurbulence {
        cn2_m_m23,
        realisations: context.profile.choose(8, 100, 400),
        grid_points: context.profile.choose(256, 512, 512),
        ..RefractiveTurbulence::default()
    };
    scene.atmosphere.turbulence = Turbulence::Refractive(turbulence);
    scene
}

/// The flow that is looked at.
pub(super) struct Sight {
    flow: Flow,
    /// Folder from which the flow is read.
    pub(super) folder: PathBuf,
    /// Centres of the vortices, (y, z), m.
    pub(super) cores: Vec<(f64, f64)>,
    /// Which flow it is, for captions.
    pub(super) words: String,
    /// The same in two words.
    pub(super) mark: String,
}

impl Sight {
    /// The wake of an age, simulated or analytic: at its start if early, on its inviscid path if late.
    pub(super) fn of(context: &Context, tau: f64) -> Result<Self, Failure> {
        if !context.analytic {
            return Self::of_wake(&wakes::of(context)?, tau);
        }
        let pair = VortexPair::default();
        if tau == EARLY_TAU {
            return Ok(Self::of_pair(pair));
        }
        Ok(Self::of_pair(VortexPair {
            motion: VortexMotion::Inviscid,
            age_tau: tau,
            ..pair
        }))
    }

    /// A simulated wake of an age.
    pub(super) fn of_wake(wake: &FinishedWake, tau: f64) -> Result<Self, Failure> {
        let b0_m = wake.scales.spacing_m;
        let flow = SimulatedFlow {
            planes: "plane1".into(),
            motion: SimulatedMotion::Frozen,
            age_tau: Some(tau),
            ..SimulatedFlow::default()
        };
        let mut cores = Vec::new();
        for side in ["left", "right"] {
            let y_m = b0_m * value_at(&wake.curve(&format!("y_{side}"))?, tau);
            let z_m = b0_m * value_at(&wake.curve(&format!("z_{side}"))?, tau);
            cores.push((flow.lateral_position_m + y_m, z_m));
        }
        let words = format!("tau = {tau}, {}", wake.words());
        Ok(Self {
            flow: Flow::Simulated(flow),
            folder: wake.folder.clone(),
            cores,
            words,
            mark: "simulated flow".into(),
        })
    }

    /// An analytic pair.
    pub(super) fn of_pair(pair: VortexPair) -> Self {
        let words = match pair.age_tau {
            0.0 => format!("ANALYTIC PAIR, core {} m", pair.core_radius_m),
            tau => format!(
                "ANALYTIC PAIR at tau = {tau} on its inviscid path, core {} m",
                pair.core_radius_m
            ),
        };
        let scene = Scene {
            flow: Flow::VortexPair(pair),
            ..Scene::default()
        };
        let vortices = wind::vortex_pair(&pair).vortices(wind::start_s(&scene.flow));
        let cores = vortices
            .map(|vortex| (vortex.lateral_position_m, vortex.height_m))
            .to_vec();
        Self {
            flow: scene.flow,
            folder: PathBuf::new(),
            cores,
            words,
            mark: "analytic pair".into(),
        }
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

/// A map that was made, with what is needed to read it.
pub(super) struct Study {
    cores: Vec<(f64, f64)>,
    pub(super) plan: Plan,
    pub(super) map: VelocityEstimates,
    /// Distance to the nearer core, m: \[line, gate\].
    distance_m: Array2<f64>,
}

impl Study {
    /// Runs the maps of scenes; what they have in common is computed once.
    pub(super) fn runs(
        context: &Context,
        sight: &Sight,
        scenes: Vec<Scene>,
    ) -> Result<Vec<Self>, Failure> {
        let path = sight.folder.join("scene.toml");
        let mut files = Vec::new();
        for scene in scenes {
            let text = sight.scene(context, scene).to_toml();
            files.push(SceneFile::parse(&text, &path)?);
        }
        let maps = sweep::maps(&files, &Silent)?;
        Ok(maps
            .into_iter()
            .map(|(plan, map)| Self::of(sight, plan, map))
            .collect())
    }

    /// The same for both references of the signal-to-noise ratio.
    pub(super) fn at_references(
        context: &Context,
        sight: &Sight,
        scene: &Scene,
    ) -> Result<Vec<Self>, Failure> {
        let scenes = REFERENCES.map(|(_, reference)| {
            let mut scene = scene.clone();
            scene.detector.snr = reference;
            scene
        });
        Self::runs(context, sight, scenes.to_vec())
    }

    fn of(sight: &Sight, plan: Plan, map: VelocityEstimates) -> Self {
        let shape = (map.elevation_rad.len(), map.range_m.len());
        let distance_m = Array2::from_shape_fn(shape, |(line, gate)| {
            let elevation_rad = map.elevation_rad[line];
            let range_m = map.range_m[gate];
            let y_m = range_m * elevation_rad.cos();
            let z_m = plan.scene().scan.lidar_height_m + range_m * elevation_rad.sin();
            let mut nearest_m = f64::INFINITY;
            for core in &sight.cores {
                nearest_m = nearest_m.min((y_m - core.0).hypot(z_m - core.1));
            }
            nearest_m
        });
        Self {
            cores: sight.cores.clone(),
            plan,
            map,
            distance_m,
        }
    }

    /// Centres of the vortices in the polar coordinates of the scan: (range, elevation).
    pub(super) fn cores_polar(&self) -> Vec<(f64, f64)> {
        let height_m = self.plan.scene().scan.lidar_height_m;
        self.cores
            .iter()
            .map(|c| (c.0.hypot(c.1 - height_m), (c.1 - height_m).atan2(c.0)))
            .collect()
    }

    /// The cells with whole regions of accumulation, which the border of the sector does not cut, whose distance to the nearer core, m,
    /// and gate are accepted: cells of fewer windows err more, wherever they are.
    pub(super) fn cells(&self, accept: impl Fn(f64, usize) -> bool) -> Vec<(usize, usize)> {
        let level = &self.map.level;
        let gates = level.ncols();
        let mut largest = Vec::new();
        for gate in level.columns() {
            largest.push(gate.iter().copied().fold(0.0, f64::max));
        }
        let mut cells = Vec::new();
        for ((line, gate), distance_m) in self.distance_m.indexed_iter() {
            let is_whole =
                level[[line, gate]] >= 0.9 * largest[gate] && gate > 0 && gate + 1 < gates;
            if is_whole && accept(*distance_m, gate) {
                cells.push((line, gate));
            }
        }
        cells
    }

    /// Mean of a function of the errors of a cell over the scans, without those of one batch.
    pub(super) fn over_scans(
        &self,
        cell: (usize, usize),
        without: Option<usize>,
        function: fn(f64) -> f64,
    ) -> f64 {
        let mut values = Vec::new();
        for (k, scan) in self.map.scans.iter().enumerate() {
            let batch = k * BATCHES / self.map.scans.len();
            let value = function(scan.error_m_s[cell]);
            if Some(batch) != without && value.is_finite() {
                values.push(value);
            }
        }
        values.iter().sum::<f64>() / values.len() as f64
    }

    /// The errors over some cells.
    pub(super) fn zone(&self, cells: &[(usize, usize)]) -> Zone {
        let mut of_batch = vec![(0.0, 0.0); self.map.scans.len().min(MOST_BATCHES)];
        let batches = of_batch.len();
        for (k, scan) in self.map.scans.iter().enumerate() {
            let (sum, count) = &mut of_batch[k * batches / self.map.scans.len()];
            for cell in cells {
                let error = scan.error_m_s[*cell];
                if error.is_finite() {
                    *sum += error * error;
                    *count += 1.0;
                }
            }
        }
        let ranges_m = cells.iter().map(|(_, gate)| self.map.range_m[*gate]);
        Zone {
            range_m: ranges_m.sum::<f64>() / cells.len() as f64,
            of_batch,
            average: CellAverage::without_errors(&self.map, cells),
        }
    }
}

/// Errors over a set of cells, in batches of scans.
pub(super) struct Zone {
    /// Mean range of the cells, m.
    pub(super) range_m: f64,
    /// Sum of the squares of each batch, m^2/s^2, and how many they are.
    pub(super) of_batch: Vec<(f64, f64)>,
    /// Bias and standard deviation.
    pub(super) average: CellAverage,
}

impl Zone {
    /// Sum of the squares and number of the estimates without one batch.
    pub(super) fn sums(&self, without: Option<usize>) -> (f64, f64) {
        let mut sum = 0.0;
        let mut estimates = 0.0;
        for (batch, (sum_of_batch, estimates_of_batch)) in self.of_batch.iter().enumerate() {
            if Some(batch) != without {
                sum += sum_of_batch;
                estimates += estimates_of_batch;
            }
        }
        (sum, estimates)
    }

    /// Root mean square error without one batch, m/s.
    pub(super) fn rms_m_s(&self, without: Option<usize>) -> f64 {
        let (sum, estimates) = self.sums(without);
        (sum / estimates).sqrt()
    }

    pub(super) fn rms(&self) -> Estimate {
        Estimate::of(self.of_batch.len(), |without| self.rms_m_s(without))
    }

    /// How far its error is from that of another on the same scans, as a share of the latter.
    pub(super) fn over(&self, other: &Self) -> Estimate {
        Estimate::of(self.of_batch.len(), |without| {
            self.rms_m_s(without) / other.rms_m_s(without) - 1.0
        })
    }

    /// Its batches, from which claims on it follow, with the case and the name of the zone and its position in the figure.
    pub(super) fn batches(&self, case: &str, name: &str, place: f64) -> Table {
        let count = self.of_batch.len();
        let batches = self.of_batch.iter();
        Table::new()
            .text("case", repeat_n(case, count))
            .text("zone", repeat_n(name, count))
            .float("place", repeat_n(place, count))
            .float("range_m", repeat_n(self.range_m, count))
            .int("batch", 0..count as i64)
            .float("sum_of_squares_m2_s2", batches.clone().map(|(sum, _)| *sum))
            .int("estimates", batches.map(|(_, count)| *count as i64))
    }
}

/// Tables of the same columns one below the other, with a last column that tells them apart.
pub(super) fn stacked(name: &str, parts: Vec<(&str, Table)>) -> Result<Table, Failure> {
    let labelled = parts.into_iter().map(|(label, table)| {
        let rows = table
            .columns()
            .first()
            .map_or(0, |(_, column)| match column {
                Column::Float(v) => v.len(),
                Column::Int(v) => v.len(),
                Column::Text(v) => v.len(),
            });
        table.text(name, repeat_n(label, rows))
    });
    Ok(Table::stack(labelled)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stacked_tables_keep_their_rows_and_say_which_is_which() {
        let part = |x: f64| {
            Table::new()
                .float("x_m", [x, x + 1.0])
                .int("n", [1, 2])
                .text("t", ["a", "b"])
        };
        let both = stacked("which", vec![("one", part(1.0)), ("two", part(5.0))]).unwrap();
        let text = both.to_csv(&crate::workspace::provenance("", 0)).unwrap();
        assert!(
            text.ends_with("x_m,n,t,which\n1.0,1,a,one\n2.0,2,b,one\n5.0,1,a,two\n6.0,2,b,two\n"),
            "{text}"
        );
    }
}
