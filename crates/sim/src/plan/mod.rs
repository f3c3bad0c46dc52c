//! From a scene to a plan: which stages run, which are left out and why, what each will cost.
//!
//! Nothing is computed but sizes; the planes of a simulated flow are read. What a run would refuse, the plan refuses. The
//! forecasts are products of counts with unit costs; `cargo xtask forecast` holds them against what runs take.

use crate::Error;
use crate::measure::geometry::Geometry;
use crate::measure::instrument::Instrument;
use crate::measure::wind::SceneWind;
use crate::scene::{Method, Scene, SceneFile, Weighting};
use std::fmt;

mod ambiguity;
mod fit;
mod optics;
mod possible;
mod rehearsal;
mod sizes;
mod stages;
pub(crate) mod units;

/// What the user asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// Everything that the scene asks for.
    Run,
    /// Heterodyne efficiency and signal-to-noise ratio against range.
    Efficiency,
    /// The raw signals.
    Signal,
    /// The radial-velocity map with its errors.
    Map,
}

/// A part of the measurement that can run alone or be left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// Large-eddy simulation of the flow.
    FlowSimulation,
    /// Wind on a cross-plane, for the files.
    CrossPlane,
    /// Phase screens and beam propagation.
    PhaseScreens,
    /// Efficiency and SNR against range.
    Efficiency,
    /// Wind along the lines of sight.
    LinesOfSight,
    /// Heterodyne signals.
    Signals,
    /// Shot noise.
    Noise,
    /// Velocity estimates.
    Estimates,
    /// Estimates against the truth.
    Errors,
    /// Tables and pictures.
    Files,
}

impl Stage {
    /// The name that plans, progress and summaries use.
    pub fn name(self) -> &'static str {
        match self {
            Stage::FlowSimulation => "flow simulation",
            Stage::CrossPlane => "cross-plane",
            Stage::PhaseScreens => "phase screens",
            Stage::Efficiency => "efficiency",
            Stage::LinesOfSight => "lines of sight",
            Stage::Signals => "signals",
            Stage::Noise => "noise",
            Stage::Estimates => "estimates",
            Stage::Errors => "errors",
            Stage::Files => "files",
        }
    }
}

/// A stage with its decision.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedStage {
    /// Which stage.
    pub stage: Stage,
    /// What will be done, or why nothing is.
    pub reason: String,
    /// Forecast, for the stages that run.
    pub cost: Option<Cost>,
}

/// Forecast of one stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost {
    /// Computing time on one core, s.
    pub core_s: f64,
    /// Memory held at once, bytes.
    pub memory_bytes: f64,
}

/// What a run will do.
#[derive(Debug)]
pub struct Plan {
    /// The scene, checked.
    pub scene: SceneFile,
    /// What was asked for.
    pub target: Target,
    /// All stages, in the order in which they run.
    pub stages: Vec<PlannedStage>,
    /// The instrument and its air.
    pub instrument: Instrument,
    /// Sampling in angle, range and time.
    pub geometry: Geometry,
    /// The wind.
    pub wind: SceneWind,
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
        let wind = SceneWind::new(&scene)?;
        let instrument = Instrument::new(&scene.scene)?;
        let geometry = Geometry::new(&scene.scene, &instrument.pulse, &wind)?;
        let last_s = wind.start_s + geometry.line_time_s.last().copied().unwrap_or(0.0);
        if last_s > wind.end_s {
            let reason = format!(
                "the scan ends at {last_s:.3} s of the flow, the planes at {:.3} s: begin earlier, scan faster, or set \
                 flow.motion = \"frozen\"",
                wind.end_s
            );
            return Err(Error::Input { path: "flow.planes".into(), reason });
        }
        let mut warnings = warnings(&scene.scene, &wind);
        warnings.extend(ambiguity::warning(&scene.scene, &instrument.pulse));
        let optics = optics::stages(&scene, &instrument, target, &geometry, &mut warnings)?;
        let stages = stages::stages(&scene.scene, target, &geometry, &wind, optics);
        let plan = Self { scene, target, stages, instrument, geometry, wind, warnings };
        possible::check(&plan)?;
        crate::measure::write::check(&plan)?;
        Ok(plan)
    }

    /// Forecast of the whole: computing time on one core, s, and memory, bytes.
    pub fn total(&self) -> Cost {
        let none = Cost { core_s: 0.0, memory_bytes: 0.0 };
        self.stages.iter().filter_map(|s| s.cost).fold(none, |sum, c| Cost {
            core_s: sum.core_s + c.core_s,
            memory_bytes: sum.memory_bytes + c.memory_bytes,
        })
    }

    /// Whether a stage runs.
    pub fn runs(&self, stage: Stage) -> bool {
        self.stages.iter().any(|s| s.stage == stage && s.cost.is_some())
    }

    /// Realisations whose raw signals are kept for the files.
    pub fn kept_realisations(&self) -> usize {
        stages::kept_realisations(&self.scene.scene, self.target)
    }

    /// Whether raw signals are kept for the files.
    pub fn keeps_signals(&self) -> bool {
        self.kept_realisations() > 0
    }

    /// Realisations to run: the raw signals alone need those that are kept.
    pub fn realisations(&self) -> usize {
        if self.runs(Stage::Estimates) { self.scene.scene.scan.realisations } else { self.kept_realisations() }
    }
}

/// What is allowed but probably not meant.
fn warnings(scene: &Scene, wind: &SceneWind) -> Vec<String> {
    let mut out = Vec::new();
    let half_band_m_s = 0.25 * scene.laser.wavelength_m * scene.detector.bandwidth_hz;
    let speed_m_s = wind.max_speed_m_s;
    if speed_m_s > half_band_m_s {
        out.push(format!(
            "the flow reaches {speed_m_s:.1} m/s, the detector band ends at {half_band_m_s:.1} m/s: faster air is not seen"
        ));
    }
    if scene.estimator.padded_samples < 4 * scene.estimator.window_samples {
        let bin_m_s =
            0.5 * scene.laser.wavelength_m * scene.detector.sampling_hz / scene.estimator.padded_samples as f64;
        out.push(format!(
            "estimator.padded_samples gives a spectrum in steps of {bin_m_s:.2} m/s: expect a bias of that order"
        ));
    }
    let method = scene.estimator.method;
    let is_model = method.order().is_some() || matches!(method, Method::FirstMoment(_) | Method::LagWindow(_));
    if is_model && scene.estimator.weighting != Weighting::Rectangular {
        out.push(
            "this estimator.method is meant for windows without weighting: estimator.weighting = \"rectangular\""
                .into(),
        );
    }
    if scene.scan.realisations < 2 {
        out.push("one realisation: no standard deviation can be given".into());
    }
    out
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "scene {}, seed {}", self.scene.hash, self.scene.scene.seed)?;
        for s in &self.stages {
            match s.cost {
                Some(c) => {
                    let (time, memory) = (units::seconds(c.core_s), units::bytes(c.memory_bytes));
                    writeln!(f, "  run   {:<16} {time:>10} {memory:>10}   {}", s.stage.name(), s.reason)?;
                }
                None => writeln!(f, "  skip  {:<16} {:>10} {:>10}   {}", s.stage.name(), "", "", s.reason)?,
            }
        }
        let Cost { core_s, memory_bytes } = self.total();
        let (time, memory) = (units::seconds(core_s), units::bytes(memory_bytes));
        writeln!(f, "  total {:<16} {time:>10} {memory:>10}   forecast for one core", "")?;
        for w in &self.warnings {
            writeln!(f, "  warning: {w}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Flow, NoiseKind, SnrReference, VortexPair};

    fn plan(target: Target, change: impl FnOnce(&mut Scene)) -> Plan {
        let mut scene = Scene::default();
        change(&mut scene);
        Plan::new(SceneFile::new(scene).unwrap(), target).unwrap()
    }

    fn run_stages(plan: &Plan) -> Vec<&'static str> {
        plan.stages.iter().filter(|s| s.cost.is_some()).map(|s| s.stage.name()).collect()
    }

    #[test]
    fn each_target_runs_only_what_it_needs() {
        let stages = |target| run_stages(&plan(target, |_| {}));
        assert_eq!(stages(Target::Efficiency), ["efficiency", "files"]);
        let signal = ["efficiency", "lines of sight", "signals", "noise"];
        assert_eq!(stages(Target::Signal), [&signal[..], &["files"]].concat());
        assert_eq!(stages(Target::Map), [&signal[..], &["estimates", "errors", "files"]].concat());
        assert_eq!(stages(Target::Run).len(), 8);
    }

    #[test]
    fn what_the_scene_does_not_need_is_left_out_with_a_reason() {
        let lean = plan(Target::Map, |s| {
            s.detector.snr = SnrReference::Fixed { snr_db: 0.0 };
            s.detector.noise = NoiseKind::None;
        });
        assert_eq!(run_stages(&lean), ["lines of sight", "signals", "estimates", "errors", "files"]);
        assert!(lean.stages.iter().filter(|s| s.cost.is_none()).all(|s| !s.reason.is_empty()));
        let calm = plan(Target::Run, |s| s.flow = Flow::Calm {});
        assert!(!calm.runs(Stage::CrossPlane));
    }

    #[test]
    fn forecasts_grow_with_the_work() {
        let once = plan(Target::Map, |s| s.scan.realisations = 100).total().core_s;
        let twice = plan(Target::Map, |s| s.scan.realisations = 200).total().core_s;
        assert!((1.9..2.0).contains(&(twice / once)), "{}", twice / once);
    }

    #[test]
    fn air_faster_than_the_band_is_warned_of() {
        let fast =
            |s: &mut Scene| s.flow = Flow::VortexPair(VortexPair { core_radius_m: 1.0, ..VortexPair::default() });
        assert!(plan(Target::Map, fast).warnings.iter().any(|w| w.contains("19.4 m/s")));
        assert!(plan(Target::Map, |_| {}).warnings.is_empty());
    }
}
