//! What a user requests, and the decision on each stage of a run.
//!
//! Stages run one after another and free their working memory, so the memory of a run is the
//! largest over the stages of what the earlier ones keep and the stage itself holds.

use crate::progress::Stage;

/// What the user requests.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// Everything that the scene requests.
    Run,
    /// Heterodyne efficiency and signal-to-noise ratio against range.
    Efficiency,
    /// The raw signals.
    Signal,
    /// The radial-velocity map with its errors.
    Map,
}

impl Target {
    /// Whether there is a velocity map.
    pub(crate) fn has_map(self) -> bool {
        matches!(self, Self::Run | Self::Map)
    }

    /// Whether there is a table of efficiency and signal-to-noise ratio against range.
    pub(crate) fn has_profile(self) -> bool {
        matches!(self, Self::Run | Self::Efficiency)
    }
}

/// A stage with its decision.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedStage {
    /// Which stage.
    pub stage: Stage,
    /// What will be done, or why nothing is.
    pub reason: String,
    /// Whether it runs.
    pub runs: bool,
    /// Memory that it holds at once, including its results, bytes.
    pub memory_bytes: f64,
    /// Memory of its results, held to the end of the run, bytes.
    pub kept_bytes: f64,
    /// Computing time on one core, to a factor of two, s.
    pub core_s: f64,
    /// Keys whose change reduces its memory.
    pub(crate) remedy: String,
}

impl PlannedStage {
    /// A stage that runs, without memory and time of its own.
    pub(crate) fn running(stage: Stage, reason: String) -> Self {
        Self {
            stage,
            reason,
            runs: true,
            memory_bytes: 0.0,
            kept_bytes: 0.0,
            core_s: 0.0,
            remedy: String::new(),
        }
    }

    /// A stage that does not run.
    pub(crate) fn skipped(stage: Stage, reason: &str) -> Self {
        Self {
            runs: false,
            ..Self::running(stage, reason.into())
        }
    }

    /// The stage with working memory and the memory of its results, bytes, and keys that reduce it.
    pub(crate) fn with_memory(self, working_bytes: f64, kept_bytes: f64, remedy: String) -> Self {
        Self {
            memory_bytes: working_bytes + kept_bytes,
            kept_bytes,
            remedy,
            ..self
        }
    }

    /// The stage with its computing time on one core, s.
    pub(crate) fn with_time(self, core_s: f64) -> Self {
        Self { core_s, ..self }
    }
}

/// Largest memory, bytes, that stages which run one after another hold at once, and the stage that
/// holds it.
pub(super) fn largest_memory(stages: &[PlannedStage]) -> (f64, Option<&PlannedStage>) {
    let mut largest_bytes = 0.0;
    let mut largest_stage = None;
    let mut kept_bytes = 0.0;
    for stage in stages.iter().filter(|stage| stage.runs) {
        if kept_bytes + stage.memory_bytes > largest_bytes {
            largest_bytes = kept_bytes + stage.memory_bytes;
            largest_stage = Some(stage);
        }
        kept_bytes += stage.kept_bytes;
    }
    (largest_bytes, largest_stage)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn running(stage: Stage, working_bytes: f64, kept_bytes: f64) -> PlannedStage {
        PlannedStage::running(stage, String::new()).with_memory(
            working_bytes,
            kept_bytes,
            String::new(),
        )
    }

    #[test]
    fn memory_is_the_largest_of_what_is_held_at_once() {
        let stages = [
            PlannedStage::skipped(Stage::FlowSimulation, ""),
            running(Stage::CrossPlane, 50.0, 10.0),
            running(Stage::Signals, 40.0, 30.0),
            running(Stage::Files, 35.0, 0.0),
        ];
        let largest = |count: usize| {
            let (bytes, stage) = largest_memory(&stages[..count]);
            (bytes, stage.map(|stage| stage.stage))
        };
        assert_eq!(largest(1), (0.0, None));
        assert_eq!(largest(2), (60.0, Some(Stage::CrossPlane)));
        // 10 kept before, 40 at work and 30 of its own; the files then find 40 kept.
        assert_eq!(largest(3), (80.0, Some(Stage::Signals)));
        assert_eq!(largest(4), (80.0, Some(Stage::Signals)));
    }
}
