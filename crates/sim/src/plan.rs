//! From a scene to a plan: which stages run, which are left out and why, what each will cost.
//!
//! Nothing is computed but sizes; the planes of a simulated flow are read. The cost figures are the products of
//! counts with the unit costs at the end of this file, which `cargo bench` measures; they are forecasts, good to a
//! factor of two or three on another machine.

use crate::Error;
use crate::geometry::Geometry;
use crate::scene::{Flow, Method, NoiseKind, RegionRadius, Scene, SceneFile, Weighting};
use crate::wind::SceneWind;
use std::fmt;

mod optics;

/// What the user asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// Everything that the scene asks for.
    Run,
    /// Heterodyne efficiency and signal-to-noise ratio against range.
    Efficiency,
    /// The raw signals of the first realisation.
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
    /// Planes that cannot be read or end before the scan; what a crate refuses of the scene, such as phase screens
    /// too coarse for the turbulence.
    pub fn new(scene: SceneFile, target: Target) -> Result<Self, Error> {
        let wind = SceneWind::new(&scene)?;
        let geometry = Geometry::new(&scene.scene, &wind)?;
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
        let optics = optics::stages(&scene, target, &geometry, &mut warnings)?;
        let stages = stages(&scene.scene, target, &geometry, &wind.source, optics);
        Ok(Self { scene, target, stages, geometry, wind, warnings })
    }

    /// Whether a stage runs.
    pub fn runs(&self, stage: Stage) -> bool {
        self.stages.iter().any(|s| s.stage == stage && s.cost.is_some())
    }

    /// Whether the raw signals of the first realisation are kept for the files.
    pub fn keeps_signals(&self) -> bool {
        match self.target {
            Target::Signal => true,
            Target::Run => self.scene.scene.outputs.signals,
            Target::Efficiency | Target::Map => false,
        }
    }

    /// Realisations to run: the raw signals alone need one.
    pub fn realisations(&self) -> usize {
        if self.runs(Stage::Estimates) { self.scene.scene.scan.realisations } else { 1 }
    }
}

fn stages(scene: &Scene, target: Target, g: &Geometry, wind: &str, optics: [PlannedStage; 2]) -> Vec<PlannedStage> {
    let run = |stage, reason: String, core_s: f64, memory_bytes: f64| PlannedStage {
        stage,
        reason,
        cost: Some(Cost { core_s, memory_bytes }),
    };
    let skip = |stage, reason: &str| PlannedStage { stage, reason: reason.into(), cost: None };

    let lines = g.elevation_rad.len();
    let signals = target != Target::Efficiency;
    let maps = matches!(target, Target::Run | Target::Map);
    let realisations = if maps { scene.scan.realisations } else { 1 };
    let records = (lines * scene.scan.pulses_per_line) as f64;
    let samples = g.samples as f64;
    let layers = (lines * g.layers) as f64;
    let calm = matches!(scene.flow, Flow::Calm {});

    let mut out = vec![skip(Stage::FlowSimulation, wind)];
    out.push(if target != Target::Run || !scene.outputs.flow {
        skip(Stage::CrossPlane, "not asked for")
    } else if calm {
        skip(Stage::CrossPlane, "flow.kind is \"calm\"")
    } else {
        let (ny, nz) = crate::plane::POINTS;
        let points = (ny * nz) as f64;
        run(Stage::CrossPlane, format!("{ny} x {nz} points"), points * WIND_POINT_S, points * 48.0)
    });
    out.extend(optics);
    out.push(if signals {
        let reason = format!("{lines} lines of {} layers of {:.3} m", g.layers, g.layer_thickness_m);
        run(Stage::LinesOfSight, reason, if calm { 0.0 } else { layers * WIND_POINT_S }, layers * 16.0)
    } else {
        skip(Stage::LinesOfSight, "not asked for")
    });
    out.push(if signals {
        let reason =
            format!("{realisations} x {records} records of {} samples, {} layers each", g.samples, g.layers_per_sample);
        let terms = realisations as f64 * records * samples * g.layers_per_sample as f64;
        run(Stage::Signals, reason, terms * LAYER_SAMPLE_S, records * samples * 8.0)
    } else {
        skip(Stage::Signals, "not asked for")
    });
    out.push(match scene.detector.noise {
        _ if !signals => skip(Stage::Noise, "not asked for"),
        NoiseKind::None => skip(Stage::Noise, "detector.noise is \"none\""),
        _ => {
            let values = realisations as f64 * records * samples;
            run(Stage::Noise, format!("{values} samples"), values * NOISE_SAMPLE_S, samples * 64.0)
        }
    });
    let gates = g.gate_range_m.len();
    out.push(if maps {
        let windows = ((g.samples - scene.estimator.window_samples) / scene.estimator.window_step_samples + 1) as f64;
        let region = match scene.estimator.method {
            Method::Periodogram => "no region".to_owned(),
            _ => match &scene.estimator.radius {
                RegionRadius::Fixed {} => format!("regions of {} m", scene.estimator.radius_m),
                RegionRadius::OfRange { .. } => "regions whose radius depends on range".to_owned(),
                RegionRadius::Target { standard_deviation_m_s, .. } => {
                    format!("regions for a standard deviation of {standard_deviation_m_s} m/s")
                }
            },
        };
        let reason = format!("{lines} x {gates} gates, {region}");
        let lags = scene.estimator.window_samples as f64;
        let core_s = realisations as f64
            * (records * windows * lags * WINDOW_LAG_S
                + (lines * gates) as f64 * scene.estimator.padded_samples as f64 * SPECTRUM_POINT_S);
        run(Stage::Estimates, reason, core_s, lines as f64 * windows * lags * 8.0)
    } else {
        skip(Stage::Estimates, "not asked for")
    });
    out.push(if maps {
        let cells = (lines * gates) as f64;
        let reason = format!("against v_pulse (28) and v_gate over {realisations} realisations");
        run(Stage::Errors, reason, cells * TRUTH_CELL_S, cells * 80.0)
    } else {
        skip(Stage::Errors, "not asked for")
    });
    out
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
    let models =
        [Method::Autoregressive, Method::AutoregressivePole, Method::Capon, Method::FirstMoment, Method::LagWindow];
    if models.contains(&scene.estimator.method) && scene.estimator.weighting != Weighting::Rectangular {
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
        let (mut total_s, mut peak_bytes) = (0.0, 0.0);
        for s in &self.stages {
            match s.cost {
                Some(c) => {
                    let name = s.stage.name();
                    writeln!(
                        f,
                        "  run   {name:<16} {:>9} {:>10}   {}",
                        seconds(c.core_s),
                        bytes(c.memory_bytes),
                        s.reason
                    )?;
                    total_s += c.core_s;
                    peak_bytes += c.memory_bytes;
                }
                None => writeln!(f, "  skip  {:<16} {:>9} {:>10}   {}", s.stage.name(), "", "", s.reason)?,
            }
        }
        writeln!(f, "  total {:<16} {:>9} {:>10}   forecast for one core", "", seconds(total_s), bytes(peak_bytes))?;
        for w in &self.warnings {
            writeln!(f, "  warning: {w}")?;
        }
        Ok(())
    }
}

fn seconds(s: f64) -> String {
    match s {
        s if s < 1e-3 => "< 1 ms".into(),
        s if s < 1.0 => format!("{:.0} ms", s * 1e3),
        s if s < 120.0 => format!("{s:.1} s"),
        s if s < 7200.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

fn bytes(b: f64) -> String {
    match b {
        b if b < 1e5 => format!("{:.1} kB", b / 1e3),
        b if b < 1e9 => format!("{:.1} MB", b / 1e6),
        b => format!("{:.1} GB", b / 1e9),
    }
}

// Unit costs on one core.
const WIND_POINT_S: f64 = 3e-8;
const LAYER_SAMPLE_S: f64 = 7.5e-10;
const NOISE_SAMPLE_S: f64 = 4e-8;
const WINDOW_LAG_S: f64 = 5e-9;
const SPECTRUM_POINT_S: f64 = 1e-8;
const TRUTH_CELL_S: f64 = 1e-6;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{SnrReference, VortexPair};

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
        assert_eq!(stages(Target::Efficiency), ["efficiency"]);
        assert_eq!(stages(Target::Signal), ["efficiency", "lines of sight", "signals", "noise"]);
        assert_eq!(stages(Target::Map), ["efficiency", "lines of sight", "signals", "noise", "estimates", "errors"]);
        assert_eq!(stages(Target::Run).len(), 7);
    }

    #[test]
    fn what_the_scene_does_not_need_is_left_out_with_a_reason() {
        let lean = plan(Target::Map, |s| {
            s.detector.snr = SnrReference::Fixed { snr_db: 0.0 };
            s.detector.noise = NoiseKind::None;
        });
        assert_eq!(run_stages(&lean), ["lines of sight", "signals", "estimates", "errors"]);
        assert!(lean.stages.iter().filter(|s| s.cost.is_none()).all(|s| !s.reason.is_empty()));
        let calm = plan(Target::Run, |s| s.flow = Flow::Calm {});
        assert!(!calm.runs(Stage::CrossPlane));
    }

    #[test]
    fn forecasts_grow_with_the_work() {
        let cost = |change: fn(&mut Scene)| {
            plan(Target::Map, change).stages.iter().filter_map(|s| s.cost).map(|c| c.core_s).sum::<f64>()
        };
        let once = cost(|s| s.scan.realisations = 10);
        let twice = cost(|s| s.scan.realisations = 20);
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
