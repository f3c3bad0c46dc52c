//! From a scene to a plan: its instrument, wind and lines of sight, the stages that run, those that
//! do not and why, the memory and time of each.
//!
//! Nothing is computed but sizes; the planes of a simulated flow are read. A plan refuses what a
//! run would refuse. Each stage is planned by its own module, and [`Plan::new`], which calls them
//! all, is in `stages`.
//!
//! | module | what is in it |
//! |---|---|
//! | [`instrument`], [`estimators`] | a scene in the terms of the other crates |
//! | `layered_air` | the air of each line, where it changes with height |
//! | [`wind`], `line_wind`, `fastest` | the wind: analytic, or the planes of a simulated flow; the wind along beams, its largest velocity |
//! | [`geometry`], `scan_lines` | lines of sight, samples, gates, layers |
//! | `described` | pulse and site as files carry them |
//! | `stage`, `counts`, `fit` | the decision on a stage; the counts of its forecast; whether it fits the memory |
//! | `schedule`, `warnings` | duration and revisit time of the scan; what the user should know |

use crate::Error;
use crate::plan::counts::Counts;
use crate::plan::geometry::Geometry;
use crate::plan::instrument::Instrument;
use crate::plan::layered_air::LayeredAir;
use crate::plan::wind::SceneWind;
use crate::quantities;
use crate::scene::{Flow, Scene, SceneFile};
use std::fmt;
use std::sync::Arc;
use wakescope_optics::plan::Plan as ScreenPlan;

pub(crate) mod counts;
pub(crate) mod described;
pub mod estimators;
mod fastest;
pub(crate) mod fit;
pub mod geometry;
pub mod instrument;
pub(crate) mod layered_air;
pub(crate) mod line_wind;
pub(crate) mod scan_lines;
mod schedule;
mod stage;
mod warnings;
pub mod wind;

pub use crate::progress::Stage;
pub use schedule::ScanSchedule;
pub use stage::{PlannedStage, Target};

/// A scene with its instrument, wind and lines of sight, and the stages of its run.
#[derive(Debug)]
pub struct Plan {
    /// The scene, checked.
    pub file: SceneFile,
    /// What the user requests.
    pub target: Target,
    /// The instrument and its air.
    pub instrument: Instrument,
    /// The air of each line, where it changes with height; that of [`Self::instrument`] is of the line in the middle.
    pub(crate) layered_air: LayeredAir,
    /// Sampling in angle, range and time.
    pub geometry: Geometry,
    /// The wind.
    pub wind: Arc<SceneWind>,
    /// All stages, in the order in which they run.
    pub stages: Vec<PlannedStage>,
    /// Phase screens of each stretch of range that has its own.
    pub(crate) screens: Arc<Vec<ScreenPlan>>,
    /// Counts of what a run works on.
    pub(crate) counts: Counts,
    /// Largest radial velocity of the air on the lines of sight, relative to the lidar, m/s.
    pub fastest_m_s: f64,
    /// What the user should know before the run.
    pub warnings: Vec<String>,
}

impl Plan {
    /// The instrument, geometry and wind of a scene, without any stage: enough to simulate its
    /// signals and to estimate.
    ///
    /// # Errors
    /// Fails if a crate refuses the scene or its flow ends before the scan.
    pub(crate) fn without_stages(file: SceneFile, target: Target) -> Result<Self, Error> {
        let wind = Arc::new(SceneWind::new(&file)?);
        Self::with_wind(file, target, wind)
    }

    /// As [`Plan::without_stages`], with a wind that other plans may share.
    ///
    /// # Errors
    /// As there.
    pub(crate) fn with_wind(
        file: SceneFile,
        target: Target,
        wind: Arc<SceneWind>,
    ) -> Result<Self, Error> {
        let mut instrument = Instrument::new(&file.content)?;
        let geometry = Geometry::new(&file, &instrument.pulse, &wind)?;
        let layered_air = LayeredAir::new(&file.content, &instrument, &geometry.schedule)?;
        if let Some(of_middle_line) = layered_air.of_middle_line() {
            instrument = of_middle_line.clone();
        }
        let counts = Counts::new(&file.content, target, &geometry);
        let mut plan = Self {
            file,
            target,
            instrument,
            layered_air,
            geometry,
            wind,
            stages: Vec::new(),
            screens: Arc::default(),
            counts,
            fastest_m_s: 0.0,
            warnings: Vec::new(),
        };
        plan.refuse_short_flow()?;
        plan.fastest_m_s = fastest::fastest_m_s(&plan)?;
        plan.warnings = warnings::of_scene(&plan)?;
        Ok(plan)
    }

    /// Refuses a flow that ends before the scan.
    fn refuse_short_flow(&self) -> Result<(), Error> {
        let last_s = self.scan_end_s();
        let end_s = self.wind.end_s;
        if last_s <= end_s {
            return Ok(());
        }
        let (key, what) = match self.scene().flow {
            Flow::Fields(_) => ("flow.files", "fields"),
            Flow::VortexPair(_) => {
                let age_tau = self.wind.tau;
                let reason = format!(
                    "flow.motion = \"transported\" gives the pair a path of {end_s:.0} s, the scan ends at {last_s:.0} s: a smaller age \
                     than {age_tau} tau, or a faster scan"
                );
                return Err(Error::Key {
                    key: "flow.age_tau",
                    reason,
                });
            }
            _ => ("flow.planes", "planes"),
        };
        let reason = format!(
            "the scan ends at {last_s:.3} s of the flow, the {what} at {end_s:.3} s: begin earlier, scan faster, or set \
             flow.motion = \"frozen\""
        );
        Err(Error::Key { key, reason })
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.file.content
    }

    /// Time of the last wind of the scan from the start of the flow, s: of the middle of the last line, or of its last pulse where pulses
    /// have winds of their own.
    pub fn scan_end_s(&self) -> f64 {
        let times_s = geometry::wind_times_s(self.scene(), &self.geometry.schedule);
        self.wind.start_s + times_s.last().copied().unwrap_or(0.0)
    }

    /// Age of the wake at the end of the scan, s; behind an aircraft that in the plane of the lidar.
    pub(crate) fn oldest_age_s(&self) -> f64 {
        let scene = self.scene();
        let aircraft = scene.flow.pair().and_then(|pair| pair.aircraft);
        let x_m = scene.scan.lidar.x_m;
        let since_s = aircraft.map_or(0.0, |a| (a.x_m - x_m) / a.speed_m_s);
        (self.scan_end_s() + since_s).max(0.0)
    }

    /// Computing time on one core, s, to a factor of two; at least that of small files.
    pub fn core_s(&self) -> f64 {
        let mut core_s = 0.01;
        for stage in &self.stages {
            core_s += stage.core_s;
        }
        core_s
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
        counts::kept_realisations(self.scene(), self.target)
    }

    /// Realisations to run: the raw signals alone need those that are kept.
    pub fn realisations(&self) -> usize {
        if self.target.has_map() {
            self.scene().scan.realisations
        } else {
            self.kept_realisations()
        }
    }

    /// The key that reduces the lines of sight.
    pub(crate) fn fewer_lines(&self) -> String {
        match self.scene().scan.pattern.step_key() {
            Some(key) => format!("a larger {key}"),
            None => "fewer lines of sight".into(),
        }
    }

    /// Keys that reduce the memory of a stage along the lines: those of the records if some are
    /// kept, else `others`.
    pub(crate) fn fewer_records_or(&self, others: String) -> String {
        let lines = self.fewer_lines();
        match (self.kept_realisations(), self.target) {
            (0, _) => others,
            (_, Target::Run) => {
                format!("outputs.signals = false, {lines} or fewer scan.pulses_per_line")
            }
            _ => format!("{lines} or fewer scan.pulses_per_line"),
        }
    }

    /// Keys that reduce the memory of the points of a map.
    pub(crate) fn fewer_points(&self) -> String {
        let lines = self.fewer_lines();
        self.fewer_records_or(format!(
            "{lines}, estimator.gate_step_samples or estimator.window_step_samples"
        ))
    }
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "scene {}, seed {}", self.file.hash, self.scene().seed)?;
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
        let time = quantities::seconds(self.core_s());
        let memory = quantities::bytes(self.memory_bytes());
        writeln!(
            f,
            "  total {:<16} {memory:>10}   at once; some {time} of one core, to a factor of two",
            ""
        )?;
        if self.target != Target::Efficiency {
            writeln!(f, "  scan  {}", self.schedule())?;
        }
        let pair = self.wind.pair.as_ref();
        if let Some(text) = pair.and_then(|pair| pair.description(self.oldest_age_s())) {
            writeln!(f, "  wake  {text}")?;
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
    use std::path::Path;

    /// Two lines of 16 pulses through a pair that lives for some minutes.
    fn planned(pulse_repetition_hz: f64, wind_of_pulses: &str) -> Result<Plan, Error> {
        let text = format!(
            "[flow]\nmotion = \"transported\"\n[laser]\npulse_repetition_hz = {pulse_repetition_hz:?}\n\
             [scan]\nelevation_min_rad = 0.0\nelevation_max_rad = 0.25\nelevation_step_rad = 0.25\n\
             wind_of_pulses = {{ kind = \"{wind_of_pulses}\" }}\n"
        );
        let file = SceneFile::parse(&text, Path::new("s.toml")).unwrap();
        Plan::new(file, Target::Signal)
    }

    #[test]
    fn a_flow_must_last_to_the_last_wind_that_a_scan_asks_for() {
        let quick = planned(400.0, "pulse").unwrap();
        let start_s = quick.wind.start_s;
        assert!((quick.scan_end_s() - start_s - 31.0 / 400.0).abs() < 1e-9);
        let of_lines = planned(400.0, "line").unwrap();
        assert!((of_lines.scan_end_s() - start_s - 23.5 / 400.0).abs() < 1e-9);
        // The pair ends between the middle of the last line and its last pulse.
        let slow_hz = 27.0 / (quick.wind.end_s - start_s);
        assert!(planned(slow_hz, "line").is_ok());
        let refused = planned(slow_hz, "pulse").map(|plan| plan.scan_end_s());
        let message = refused.unwrap_err().to_string();
        assert!(message.contains("the scan ends at"), "{message}");
    }
}
