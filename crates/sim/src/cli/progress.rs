//! Progress bars with the time left, on standard error; nothing where that is no terminal.

use crate::plan::Stage;
use crate::progress::Observer;
use indicatif::{ProgressBar, ProgressStyle};
use std::sync::Mutex;

/// One bar at a time, for the stage that runs.
pub(super) struct Bars {
    style: ProgressStyle,
    current: Mutex<ProgressBar>,
}

impl Bars {
    pub(super) fn new() -> Self {
        let style =
            ProgressStyle::with_template("  {prefix:<16} [{bar:32}] {percent:>3} %  {elapsed} gone, {eta} left")
                .unwrap_or_else(|_| ProgressStyle::default_bar())
                .progress_chars("=> ");
        Self { style, current: Mutex::new(ProgressBar::hidden()) }
    }

    fn bar(&self) -> std::sync::MutexGuard<'_, ProgressBar> {
        // A panic elsewhere cannot leave a bar in a bad state.
        self.current.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}

impl Observer for Bars {
    fn begin(&self, stage: Stage, steps: u64) {
        let bar = ProgressBar::new(steps).with_style(self.style.clone()).with_prefix(stage.name());
        *self.bar() = bar;
    }

    fn advance(&self, steps: u64) {
        self.bar().inc(steps);
    }

    fn end(&self) {
        self.bar().finish();
    }
}
