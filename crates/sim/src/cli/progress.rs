//! Progress bars with the time left, on standard error; nothing where that is no terminal.

use crate::flow::{FlowForecast, Watch};
use crate::plan::Stage;
use crate::setup::progress::Observer;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::Write as _;
use std::sync::Mutex;
use wakescope_les::solver::StepRecord;

/// How a bar looks.
fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar()).progress_chars("=> ")
}

/// One bar at a time, for the stage that runs.
pub(super) struct Bars {
    style: ProgressStyle,
    current: Mutex<ProgressBar>,
}

impl Bars {
    pub(super) fn new() -> Self {
        let style = style("  {prefix:<16} [{bar:32}] {percent:>3} %  {elapsed} gone, {eta} left");
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

    fn warn(&self, text: &str) {
        self.bar().suspend(|| Quiet.warn(text));
    }
}

/// Shows warnings and no progress.
pub(super) struct Quiet;

impl Observer for Quiet {
    fn begin(&self, _: Stage, _: u64) {}
    fn advance(&self, _: u64) {}
    fn end(&self) {}
    fn warn(&self, text: &str) {
        let _ = writeln!(std::io::stderr(), "warning: {text}");
    }
}

/// The bar of a sweep: cases that are done, the time left, the last one.
pub(super) struct SweepBar(ProgressBar);

impl SweepBar {
    pub(super) fn new() -> Self {
        let style = style("  cases [{bar:32}] {pos}/{len}  {elapsed} gone, {eta} left  {msg}");
        Self(ProgressBar::no_length().with_style(style))
    }

    /// A case is done.
    pub(super) fn done(&self, case: &str, done: usize, of: usize) {
        self.0.set_length(of as u64);
        self.0.set_position(done as u64);
        self.0.set_message(case.to_owned());
    }
}

impl Drop for SweepBar {
    fn drop(&mut self) {
        self.0.abandon();
    }
}

/// Divisions of the bar of a flow.
const FLOW_DIVISIONS: f64 = 10_000.0;

/// The bar of a flow: share of the simulated time, the time left, where the flow is.
pub(super) struct FlowBar(ProgressBar);

impl FlowBar {
    pub(super) fn new() -> Self {
        let style = style("  flow [{bar:32}] {percent:>3} %  {elapsed} gone, {eta} left  {msg}");
        Self(ProgressBar::new(FLOW_DIVISIONS as u64).with_style(style))
    }
}

/// Four decimals, or the exponent form of what these would not show.
fn short(time_s: f64) -> String {
    if (1e-2..1e9).contains(&time_s) { format!("{time_s:.4}") } else { format!("{time_s:.3e}") }
}

/// No bar, but what deserves attention is said even where quiet was asked for.
pub(super) struct NotesOnly;

impl Watch for NotesOnly {
    fn note(&mut self, text: &str) {
        note(text);
    }
}

fn note(text: &str) {
    let _ = writeln!(std::io::stderr(), "note: {text}");
}

impl Watch for FlowBar {
    fn forecast(&mut self, forecast: &FlowForecast) {
        let _ = write!(std::io::stderr(), "{forecast}");
    }

    fn step(&mut self, share: f64, record: &StepRecord) {
        let r = &record.report;
        self.0.set_message(format!("step {}, t = {} s, Courant {:.2}", r.step, short(r.time_s), r.courant));
        self.0.set_position((share * FLOW_DIVISIONS) as u64);
    }

    fn note(&mut self, text: &str) {
        self.0.suspend(|| note(text));
    }
}

impl Drop for FlowBar {
    fn drop(&mut self) {
        self.0.abandon();
    }
}
