//! How a run tells where it is.

use crate::plan::Stage;

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

/// An observer that looks away.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Observer for Silent {
    fn begin(&self, _: Stage, _: u64) {}
    fn advance(&self, _: u64) {}
    fn end(&self) {}
}
