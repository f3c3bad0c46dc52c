//! Progress bars with the time left, on standard error; nothing where that is no terminal.

use crate::plan::Stage;
use crate::progress::Observer;
use indicatif::{ProgressBar, ProgressFinish, ProgressStyle};
use std::io::Write as _;
use std::sync::Mutex;

/// The bar of the stage that runs; those of its parts are hidden, and all of a quiet run, which
/// shows warnings alone.
pub(super) struct Bars {
    is_quiet: bool,
    style: ProgressStyle,
    stages: Mutex<Vec<ProgressBar>>,
}

impl Bars {
    pub(super) fn new(is_quiet: bool) -> Self {
        let template =
            "  {prefix:<16} [{bar:32}] {percent:>3} %  {elapsed} gone, {eta} left  {msg}";
        let style =
            ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
        Self {
            is_quiet,
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
        if !self.is_quiet {
            let _ = write!(std::io::stderr(), "{text}");
        }
    }

    fn begin(&self, stage: Stage, steps: u64) {
        self.with(|stages| {
            let bar = if stages.is_empty() && !self.is_quiet {
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
            Some(bar) => bar.suspend(|| print_warning(text)),
            None => print_warning(text),
        });
    }
}

fn print_warning(text: &str) {
    let _ = writeln!(std::io::stderr(), "warning: {text}");
}
