//! What figures 10 to 14 and 25 share: scans of the simulated wake or of the analytic pair in batches, regions about the cores.

use super::context::*;
use crate::statistics::MOST_BATCHES;
use crate::wakes;
use std::path::PathBuf;
use wakescope_sim::io::csv::Column;
use wakescope_sim::measure::cell_average::CellAverage;
use wakescope_sim::measure::map::VelocityEstimates;
use wakescope_sim::scene::{
    Autoregressive, Flow, Method, Outside, RefractiveTurbulence, SimulatedFlow, SimulatedMotion,
    Turbulence, VortexMotion, VortexPair, Weighting,
};
use wakescope_sim::setup::wind;
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
    (scene.scan.elevation_min_rad, scene.scan.elevation_max_rad) = (0.03, 0.2);
    (scene.scan.range_min_m, scene.scan.range_max_m) = (310.0, 500.0);
    (scene.scan.pulses_per_line, scene.scan.realisations) = (1, realisations);
    scene
}

/// Periodogram accumulation without and with the chapter's usual weighting, and its correlogram accumulation.
pub(super) const METHODS: [&str; 3] = ["PA", "PA, Gaussian", "CA"];

/// The scene with one of the [`METHODS`].
pub(super) fn with_method(mut scene: Scene, method: &str) -> Scene {
    scene.estimator.method = match method {
        "CA" => Method::Autoregressive(Autoregressive::default()),
        _ => Method::PeriodogramAccumulation {},
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
    (scene.scan.elevation_min_rad, scene.scan.elevation_max_rad) = (0.065, 0.175);
    (scene.scan.range_min_m, scene.scan.range_max_m) = (315.0, 485.0);
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
        let (motion, pair) = (VortexMotion::Inviscid, VortexPair::default());
        match (context.analytic, tau) {
            (true, EARLY_TAU) => Ok(Self::of_pair(pair)),
            (true, age_tau) => Ok(Self::of_pair(VortexPair {
                motion,
                age_tau,
                ..pair
            })),
            (false, tau) => Self::of_wake(&wakes::of(context)?, tau),
        }
    }

    /// A simulated wake of an age.
    pub(super) fn of_wake(wake: &FinishedWake, tau: f64) -> Result<Self, Failure> {
        let b0_m = wake.scales.spacing_m;
        let (planes, motion, age_tau) = ("plane1".into(), SimulatedMotion::Frozen, Some(tau));
        let flow = SimulatedFlow {
            planes,
            motion,
            age_tau,
            ..SimulatedFlow::default()
        };
        let at = |name: &str| Ok::<f64, Failure>(b0_m * value_at(&wake.curve(name)?, tau));
        let core = |y, z| Ok::<_, Failure>((flow.lateral_position_m + at(y)?, at(z)?));
        let cores = vec![core("y_left", "z_left")?, core("y_right", "z_right")?];
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
        let c = wind::vortex_pair(&pair).centres(wind::start_s(&scene.flow));
        let cores = vec![(c.left_y_m, c.height_m), (c.right_y_m, c.height_m)];
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
        let file = |scene| {
            SceneFile::parse(
                &sight.scene(context, scene).to_toml(),
                &sight.folder.join("scene.toml"),
            )
        };
        let files = scenes
            .into_iter()
            .map(file)
            .collect::<Result<Vec<_>, _>>()?;
        Ok(sweep::maps(&files, &Silent)?
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
        let at = |(_, reference)| {
            let mut scene = scene.clone();
            scene.detector.snr = reference;
            scene
        };
        Self::runs(context, sight, REFERENCES.map(at).to_vec())
    }

    fn of(sight: &Sight, plan: Plan, map: VelocityEstimates) -> Self {
        let cores = sight.cores.clone();
        let distance = |(line, gate): (usize, usize)| {
            let (el, r) = (map.elevation_rad[line], map.range_m[gate]);
            let (y, z) = (
                r * el.cos(),
                plan.scene.content.scan.lidar_height_m + r * el.sin(),
            );
            cores
                .iter()
                .map(|c| (y - c.0).hypot(z - c.1))
                .fold(f64::INFINITY, f64::min)
        };
        let distance_m =
            Array2::from_shape_fn((map.elevation_rad.len(), map.range_m.len()), distance);
        Self {
            cores,
            plan,
            map,
            distance_m,
        }
    }

    /// Centres of the vortices in the polar coordinates of the scan: (range, elevation).
    pub(super) fn cores_polar(&self) -> Vec<(f64, f64)> {
        let height_m = self.plan.scene.content.scan.lidar_height_m;
        self.cores
            .iter()
            .map(|c| (c.0.hypot(c.1 - height_m), (c.1 - height_m).atan2(c.0)))
            .collect()
    }

    /// The cells with whole regions of accumulation, which the border of the sector does not cut, whose distance to the nearer core, m,
    /// and gate are accepted: cells of fewer windows err more, wherever they are.
    pub(super) fn cells(&self, accept: impl Fn(f64, usize) -> bool) -> Vec<(usize, usize)> {
        let level = &self.map.level;
        let most: Vec<f64> = level
            .columns()
            .into_iter()
            .map(|gate| gate.iter().copied().fold(0.0, f64::max))
            .collect();
        let is_whole =
            |(i, j): (usize, usize)| level[[i, j]] >= 0.9 * most[j] && j > 0 && j + 1 < most.len();
        let all = self.distance_m.indexed_iter();
        all.filter(|(cell, d)| accept(**d, cell.1) && is_whole(*cell))
            .map(|(cell, _)| cell)
            .collect()
    }

    /// Mean of a function of the errors of a cell over the scans, without those of one batch.
    pub(super) fn over_scans(
        &self,
        cell: (usize, usize),
        without: Option<usize>,
        of: fn(f64) -> f64,
    ) -> f64 {
        let scans = self.map.scans.iter().enumerate();
        let kept = scans.filter(|(k, _)| Some(k * BATCHES / self.map.scans.len()) != without);
        let errors: Vec<f64> = kept
            .map(|(_, scan)| of(scan.error_m_s[cell]))
            .filter(|e| e.is_finite())
            .collect();
        errors.iter().sum::<f64>() / errors.len() as f64
    }

    /// The errors over some cells.
    pub(super) fn zone(&self, cells: &[(usize, usize)]) -> Zone {
        let mut of_batch = vec![(0.0, 0.0); self.map.scans.len().min(MOST_BATCHES)];
        let batches = of_batch.len();
        for (k, scan) in self.map.scans.iter().enumerate() {
            let (sum, count) = &mut of_batch[k * batches / self.map.scans.len()];
            for error in cells
                .iter()
                .map(|cell| scan.error_m_s[*cell])
                .filter(|error| error.is_finite())
            {
                (*sum, *count) = (*sum + error * error, *count + 1.0);
            }
        }
        let range_m = cells
            .iter()
            .map(|cell| self.map.range_m[cell.1])
            .sum::<f64>()
            / cells.len() as f64;
        Zone {
            range_m,
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
        let kept = self
            .of_batch
            .iter()
            .enumerate()
            .filter(|(batch, _)| Some(*batch) != without);
        kept.fold((0.0, 0.0), |sums, (_, of)| (sums.0 + of.0, sums.1 + of.1))
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
}

/// All that claims on zones need: case, zone, its place in the figure, the zone.
pub(super) fn batches<'z>(
    zones: impl Iterator<Item = (String, &'static str, f64, &'z Zone)>,
) -> Table {
    let of_zone = |(case, name, place, zone): (String, &'static str, f64, &'z Zone)| {
        let batches = zone.of_batch.iter().enumerate();
        batches
            .map(move |(batch, sums)| (case.clone(), name, place, zone.range_m, batch, *sums))
            .collect::<Vec<_>>()
    };
    let rows: Vec<_> = zones.flat_map(of_zone).collect();
    Table::new()
        .text("case", rows.iter().map(|r| r.0.clone()))
        .text("zone", rows.iter().map(|r| r.1))
        .float("place", rows.iter().map(|r| r.2))
        .float("range_m", rows.iter().map(|r| r.3))
        .int("batch", rows.iter().map(|r| r.4 as i64))
        .float("sum_of_squares_m2_s2", rows.iter().map(|r| r.5.0))
        .int("estimates", rows.iter().map(|r| r.5.1 as i64))
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
        table.text(name, std::iter::repeat_n(label, rows))
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
