//! The stages of a run, and who is told where it is.

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
    /// Vortices from maps and signals.
    Retrieval,
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
            Stage::Retrieval => "retrieval",
            Stage::Files => "files",
        }
    }
}

/// Told of the progress of a run, from any thread.
pub trait Observer: Sync {
    /// A stage begins, with so many steps.
    fn begin(&self, stage: Stage, steps: u64);
    /// So many steps of the current stage are done.
    fn advance(&self, steps: u64);
    /// The current stage is done.
    fn end(&self);
    /// Something that makes a result doubtful; to be shown even where progress is not.
    fn warn(&self, _text: &str) {}
}

/// An observer that does nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Observer for Silent {
    fn begin(&self, _: Stage, _: u64) {}
    fn advance(&self, _: u64) {}
    fn end(&self) {}
}
