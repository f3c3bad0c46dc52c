//! From a scene to a plan: which stages run, which are left out and why, what each will cost.
//!
//! Nothing is computed but sizes; the planes of a simulated flow are read. What a run would refuse, the plan refuses. The
//! forecasts are products of counts with unit costs.

use crate::Error;
use crate::memo::Memo;
use crate::plan::wind::SceneWind;
use crate::quantities;
use crate::scene::SceneFile;
use std::fmt;
use std::ops::Deref;
use std::sync::Arc;
use wakescope_optics::plan::Plan as ScreenPlan;

pub(crate) mod described;
pub mod estimators;
mod fastest;
mod files;
mod fit;
pub mod geometry;
pub mod instrument;
mod optics;
mod possible;
pub(crate) mod scan_lines;
mod schedule;
mod setup;
mod sizes;
mod stage;
mod stages;
pub(crate) mod time;
mod warnings;
pub mod wind;

pub use crate::progress::Stage;
pub use schedule::ScanSchedule;
pub use setup::Setup;
pub use stage::{PlannedStage, Target};

/// What a run will do.
#[derive(Debug)]
pub struct Plan {
    /// The scene and what is made of it.
    pub setup: Setup,
    /// What was asked for.
    pub target: Target,
    /// All stages, in the order in which they run.
    pub stages: Vec<PlannedStage>,
    /// Computing time on one core, s, to a factor of two.
    pub core_s: f64,
    /// Phase screens of each stretch of range that has its own.
    pub(crate) screens: optics::ScreenPlans,
    /// Largest radial velocity of the air on the lines of sight, seen from the lidar, m/s.
    pub fastest_m_s: f64,
    /// What the user should know before the run.
    pub warnings: Vec<String>,
}

impl Plan {
    /// Plans a run; reads the planes of a simulated flow.
    ///
    /// # Errors
    /// Planes that cannot be read, end before the scan or are left by a line of sight; what a crate refuses of the scene,
    /// such as phase screens too coarse for the turbulence; results that a file cannot hold.
    pub fn new(scene: SceneFile, target: Target) -> Result<Self, Error> {
        let wind = Arc::new(SceneWind::new(&scene)?);
        Self::sharing(scene, target, wind, &Memo::default())
    }

    /// Plans a run with the wind of the scene, and phase screens that were planned before, which others may share.
    ///
    /// # Errors
    /// As [`Plan::new`].
    pub(crate) fn sharing(
        scene: SceneFile,
        target: Target,
        wind: Arc<SceneWind>,
        planned: &Memo<Vec<ScreenPlan>>,
    ) -> Result<Self, Error> {
        let file = scene.clone();
        let made = || {
            let setup = Setup::new(scene, wind)?;
            let scene = &setup.scene.content;
            let fastest_m_s = fastest::fastest_m_s(&setup)?;
            let mut warnings = warnings::of_scene(&setup, fastest_m_s)?;
            let (optics, optics_s, screens) =
                optics::stages(&setup, target, planned, &mut warnings)?;
            let sizes = sizes::Sizes::new(scene, target, &setup.geometry);
            let stages = stages::stages(&setup, target, &sizes, optics);
            let core_s = time::core_s(scene, target, &sizes, optics_s);
            let mut plan = Self {
                setup,
                target,
                stages,
                core_s,
                screens,
                fastest_m_s,
                warnings,
            };
            if plan.runs(Stage::Estimates) {
                plan.warnings.extend(warnings::of_empty_gates(&plan)?);
            }
            possible::check(&plan)?;
            Ok(plan)
        };
        made().map_err(|error| file.of_key(error))
    }

    /// Largest memory held at once, with the threads of the pool in which it was planned, bytes.
    pub fn memory_bytes(&self) -> f64 {
        stage::largest_memory(&self.stages).0
    }

    /// Whether a stage runs.
    pub fn runs(&self, stage: Stage) -> bool {
        self.stages.iter().any(|s| s.stage == stage && s.runs)
    }

    /// Realisations whose raw signals are kept for the files.
    pub fn kept_realisations(&self) -> usize {
        sizes::kept_realisations(&self.scene.content, self.target)
    }

    /// Realisations to run: the raw signals alone need those that are kept.
    pub fn realisations(&self) -> usize {
        if self.runs(Stage::Estimates) {
            self.scene.content.scan.realisations
        } else {
            self.kept_realisations()
        }
    }
}

impl Deref for Plan {
    type Target = Setup;

    fn deref(&self) -> &Setup {
        &self.setup
    }
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "scene {}, seed {}",
            self.scene.hash, self.scene.content.seed
        )?;
        for s in &self.stages {
            let (word, memory) = if s.runs {
                ("run", quantities::bytes(s.memory_bytes))
            } else {
                ("skip", String::new())
            };
            writeln!(
                f,
                "  {word:<5} {:<16} {memory:>10}   {}",
                s.stage.name(),
                s.reason
            )?;
        }
        let (time, memory) = (
            quantities::seconds(self.core_s),
            quantities::bytes(self.memory_bytes()),
        );
        writeln!(
            f,
            "  total {:<16} {memory:>10}   at once; some {time} of one core, to a factor of two",
            ""
        )?;
        if self.target != Target::Efficiency {
            writeln!(f, "  scan  {}", self.schedule())?;
        }
        for w in &self.warnings {
            writeln!(f, "  warning: {w}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Flow, NoiseModel, RefractiveTurbulence, Scene, SnrReference, Turbulence};

    fn plan(target: Target, change: impl FnOnce(&mut Scene)) -> Plan {
        let mut scene = Scene::default();
        change(&mut scene);
        Plan::new(SceneFile::new(scene).unwrap(), target).unwrap()
    }

    fn run_stages(plan: &Plan) -> Vec<&'static str> {
        plan.stages
            .iter()
            .filter(|s| s.runs)
            .map(|s| s.stage.name())
            .collect()
    }

    #[test]
    fn each_target_runs_only_what_it_needs() {
        let stages = |target| run_stages(&plan(target, |_| {}));
        assert_eq!(stages(Target::Efficiency), ["efficiency", "files"]);
        let signal = ["efficiency", "lines of sight", "signals", "noise"];
        assert_eq!(stages(Target::Signal), [&signal[..], &["files"]].concat());
        assert_eq!(
            stages(Target::Map),
            [&signal[..], &["estimates", "errors", "files"]].concat()
        );
        assert_eq!(stages(Target::Run).len(), 8);
    }

    #[test]
    fn what_the_scene_does_not_need_is_left_out_with_a_reason() {
        let lean = plan(Target::Map, |s| {
            s.detector.snr = SnrReference::Fixed { snr_db: 0.0 };
            s.detector.noise = NoiseModel::None;
        });
        assert_eq!(
            run_stages(&lean),
            ["lines of sight", "signals", "estimates", "errors", "files"]
        );
        assert!(
            lean.stages
                .iter()
                .filter(|s| !s.runs)
                .all(|s| !s.reason.is_empty())
        );
        let calm = plan(Target::Run, |s| s.flow = Flow::Calm {});
        assert!(!calm.runs(Stage::CrossPlane));
    }

    #[test]
    fn forecasts_grow_with_the_work() {
        let once = plan(Target::Map, |s| s.scan.realisations = 100).core_s;
        let twice = plan(Target::Map, |s| s.scan.realisations = 200).core_s;
        assert!((1.9..2.0).contains(&(twice / once)), "{}", twice / once);
    }

    #[test]
    fn memory_is_that_of_the_threads_of_the_pool() {
        let with = |threads: usize, of: fn(&mut Scene)| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| plan(Target::Run, of).memory_bytes())
        };
        let screens = |s: &mut Scene| {
            let t = RefractiveTurbulence {
                grid_points: 512,
                realisations: 64,
                ..RefractiveTurbulence::default()
            };
            s.atmosphere.turbulence = Turbulence::Refractive(t);
        };
        // Eight groups of realisations at most run at a time, each with some 80 bytes a point.
        let [one, two, eight, more] = [1, 2, 8, 16].map(|threads| with(threads, screens));
        let group = 512.0 * 512.0 * 80.0;
        assert!(
            two - one > 0.9 * group && (6.9..7.1).contains(&((eight - one) / (two - one))),
            "{one} {two} {eight}"
        );
        assert!(more - eight < 0.2 * group, "{eight} {more}");
    }

    #[test]
    fn coarse_spectra_are_warned_of_with_the_bias_that_their_refinement_leaves() {
        use crate::scene::Refinement;
        let off_m_s = |refinement| {
            let change = |s: &mut Scene| {
                (s.estimator.padded_samples, s.estimator.refinement) = (64, refinement)
            };
            let text = plan(Target::Map, change).warnings.remove(0);
            assert!(text.contains("steps of 3.03 m/s"), "{text}");
            text.split("up to ")
                .nth(1)
                .unwrap()
                .split(' ')
                .next()
                .unwrap()
                .parse::<f64>()
                .unwrap()
        };
        // half a step, and what the parabola and the image leave
        assert!(
            (off_m_s(Refinement::None) - 1.51).abs() < 0.04,
            "{}",
            off_m_s(Refinement::None)
        );
        assert!(off_m_s(Refinement::Parabola) < 0.15);
    }

    #[test]
    fn air_faster_than_the_band_is_warned_of() {
        let of = |words: &str| {
            let scene = SceneFile::parse(words, std::path::Path::new("s.toml")).unwrap();
            Plan::new(scene, Target::Map).unwrap()
        };
        // The largest speeds in brackets: where they are no radial velocities, nobody sees them.
        for (words, expected_m_s) in [
            // The horizontal line at 520 m; the air of the last line, 2.6 m/s faster each second.
            (
                "[scan]\nelevation_min_rad = 0.0\n[flow]\nkind = \"linear\"\ngradient_v_per_s = [0.0, 0.2, 0.0]\n",
                104.0,
            ),
            (
                "[flow]\nkind = \"linear\"\nvelocity_m_s = [0.0, 0.0, 5.0]\ngradient_u_per_s = [0.3, 0.0, 0.0]\n",
                f64::NAN,
            ),
            (
                "[flow]\nkind = \"linear\"\nvelocity_m_s = [0.0, 5.0, 0.0]\nacceleration_m_s2 = [0.0, 10.0, 0.0]\n",
                f64::NAN,
            ),
            ("[flow]\nprofile = \"lamb_oseen\"\n", 24.5),
            ("[flow]\ncirculation_m2_s = 570.0\n", 19.6),
            ("[flow]\nspacing_m = 12.0\n", 16.5),
            (
                "[flow]\nkind = \"uniform\"\nlateral_m_s = 12.0\nvertical_m_s = 0.0\n[[added_flows]]\nkind = \"uniform\"\n\
                 lateral_m_s = -12.0\nvertical_m_s = 0.0\n",
                0.0,
            ),
            (
                "[flow]\nkind = \"calm\"\n[scan.lidar]\nvelocity_m_s = [0.0, 25.0, 0.0]\n[scan]\nelevation_min_rad = 0.0\n",
                25.0,
            ),
        ] {
            let plan = of(words);
            // Each line at every five centimetres.
            let (scan, schedule) = (&plan.scene.content.scan, &plan.geometry.schedule);
            let mut dense_m_s = 0.0_f64;
            for line in 0..schedule.lines.len() {
                let beam = schedule.middle(line);
                let steps = ((scan.range_max_m - scan.range_min_m) / 0.05) as usize;
                let points: Vec<[f64; 3]> = (0..=steps)
                    .map(|i| beam.at_range_m(scan.range_min_m + 0.05 * i as f64))
                    .collect();
                let mut velocity = vec![[0.0; 3]; points.len()];
                plan.wind
                    .wind()
                    .velocity_into(&points, plan.wind.start_s + beam.time_s, &mut velocity)
                    .unwrap();
                let seen = velocity.iter().map(|v| {
                    beam.direction
                        .radial_velocity_m_s(*v, beam.velocity_m_s)
                        .abs()
                });
                dense_m_s = dense_m_s.max(seen.fold(0.0, f64::max));
            }
            let found_m_s = plan.fastest_m_s;
            assert!(
                (found_m_s - dense_m_s).abs() <= 2e-3 * dense_m_s,
                "{words}: {found_m_s} for {dense_m_s}"
            );
            assert!(
                expected_m_s.is_nan() || (found_m_s - expected_m_s).abs() <= 0.015 * expected_m_s,
                "{words}: {found_m_s}"
            );
            let warned = plan
                .warnings
                .iter()
                .any(|w| w.contains("reaches") && w.contains("19.4 m/s"));
            assert_eq!(warned, dense_m_s > 19.375, "{words}: {:?}", plan.warnings);
        }
        assert!(plan(Target::Map, |_| {}).warnings.is_empty());
    }
}
