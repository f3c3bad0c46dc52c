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
    /// Cases of a sweep.
    Cases,
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
            Stage::Cases => "cases",
        }
    }
}

/// Told of the progress of a run, from any thread. A stage may be part of another one.
pub trait Observer: Sync {
    /// What will be done, before it begins.
    fn forecast(&self, _text: &str) {}
    /// A stage begins, with so many steps.
    fn begin(&self, _stage: Stage, _steps: u64) {}
    /// So many steps of the current stage are done.
    fn advance(&self, _steps: u64) {}
    /// How far the current stage is, in words.
    fn reach(&self, _text: &str) {}
    /// The current stage is done.
    fn end(&self) {}
    /// Something that deserves attention; to be shown even where progress is not.
    fn warn(&self, _text: &str) {}
}

/// An observer that does nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Observer for Silent {}
