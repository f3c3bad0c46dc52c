//! The words of a plan: what may be asked for, the stages, and what each of them takes.
//!
//! Stages run one after another and free what they worked with, so memory is the largest over the stages of what the earlier
//! ones keep and the stage itself holds. Check: sums by hand.

use crate::progress::Stage;

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

/// A stage with its decision.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedStage {
    /// Which stage.
    pub stage: Stage,
    /// What will be done, or why nothing is.
    pub reason: String,
    /// Whether it runs.
    pub runs: bool,
    /// Memory that it holds at once, its results among it, bytes.
    pub memory_bytes: f64,
    /// Memory of its results, held to the end of the run, bytes.
    pub kept_bytes: f64,
}

/// A stage that runs, and the memory that it works with and keeps.
pub(super) fn run(
    stage: Stage,
    reason: String,
    [working_bytes, kept_bytes]: [f64; 2],
) -> PlannedStage {
    PlannedStage {
        stage,
        reason,
        runs: true,
        memory_bytes: working_bytes + kept_bytes,
        kept_bytes,
    }
}

/// A stage that is left out.
pub(super) fn skip(stage: Stage, reason: &str) -> PlannedStage {
    PlannedStage {
        stage,
        reason: reason.into(),
        runs: false,
        memory_bytes: 0.0,
        kept_bytes: 0.0,
    }
}

/// Largest memory, bytes, that stages which run one after another hold at once, and the stage that
/// holds it.
pub(super) fn largest_memory(stages: &[PlannedStage]) -> (f64, Option<Stage>) {
    let mut largest_bytes = 0.0;
    let mut largest_stage = None;
    let mut kept_bytes = 0.0;
    for stage in stages.iter().filter(|stage| stage.runs) {
        if kept_bytes + stage.memory_bytes > largest_bytes {
            largest_bytes = kept_bytes + stage.memory_bytes;
            largest_stage = Some(stage.stage);
        }
        kept_bytes += stage.kept_bytes;
    }
    (largest_bytes, largest_stage)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_the_largest_of_what_is_held_at_once() {
        let planned = |stage, held_bytes: Option<[f64; 2]>| {
            held_bytes.map_or_else(
                || skip(stage, ""),
                |held_bytes| run(stage, String::new(), held_bytes),
            )
        };
        let stages = [
            planned(Stage::FlowSimulation, None),
            planned(Stage::CrossPlane, Some([50.0, 10.0])),
            planned(Stage::Signals, Some([40.0, 30.0])),
            planned(Stage::Files, Some([35.0, 0.0])),
        ];
        let largest = |count: usize| largest_memory(&stages[..count]);
        assert_eq!(largest(1), (0.0, None));
        assert_eq!(largest(2), (60.0, Some(Stage::CrossPlane)));
        // 10 kept before, 40 at work and 30 of its own; the files then find 40 kept.
        assert_eq!(largest(3), (80.0, Some(Stage::Signals)));
        assert_eq!(largest(4), (80.0, Some(Stage::Signals)));
    }
}
