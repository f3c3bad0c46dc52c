//! Progress bars with the time left, on standard error; nothing where that is no terminal.

use crate::plan::Stage;
use crate::setup::progress::Observer;
use indicatif::{ProgressBar, ProgressFinish, ProgressStyle};
use std::io::Write as _;
use std::sync::Mutex;

/// The bar of the stage that runs; those of its parts are hidden.
pub(super) struct Bars {
    style: ProgressStyle,
    stages: Mutex<Vec<ProgressBar>>,
}

impl Bars {
    pub(super) fn new() -> Self {
        let template =
            "  {prefix:<16} [{bar:32}] {percent:>3} %  {elapsed} gone, {eta} left  {msg}";
        let style =
            ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
        Self {
            style: style.progress_chars("=> "),
            stages: Mutex::default(),
        }
    }

    fn with(&self, act: impl FnOnce(&mut Vec<ProgressBar>)) {
        // A panic elsewhere cannot leave a bar in a bad state.
        act(&mut self
            .stages
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner));
    }
}

impl Observer for Bars {
    fn forecast(&self, text: &str) {
        let _ = write!(std::io::stderr(), "{text}");
    }

    fn begin(&self, stage: Stage, steps: u64) {
        self.with(|stages| {
            let bar = if stages.is_empty() {
                ProgressBar::new(steps)
            } else {
                ProgressBar::hidden()
            };
            let bar = bar.with_style(self.style.clone()).with_prefix(stage.name());
            // A stage that does not come to its end stays where it is.
            stages.push(bar.with_finish(ProgressFinish::Abandon));
        });
    }

    fn advance(&self, steps: u64) {
        self.with(|stages| {
            stages
                .iter()
                .last()
                .into_iter()
                .for_each(|bar| bar.inc(steps))
        });
    }

    fn reach(&self, text: &str) {
        self.with(|stages| {
            stages
                .iter()
                .last()
                .into_iter()
                .for_each(|bar| bar.set_message(text.to_owned()))
        });
    }

    fn end(&self) {
        self.with(|stages| stages.pop().into_iter().for_each(|bar| bar.finish()));
    }

    fn warn(&self, text: &str) {
        self.with(|stages| match stages.first() {
            Some(bar) => bar.suspend(|| Quiet.warn(text)),
            None => Quiet.warn(text),
        });
    }
}

/// Shows warnings and no progress.
pub(super) struct Quiet;

impl Observer for Quiet {
    fn warn(&self, text: &str) {
        let _ = writeln!(std::io::stderr(), "warning: {text}");
    }
}
