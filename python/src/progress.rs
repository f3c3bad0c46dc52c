//! What a command tells while it runs, for the thread that waits for it.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use wakescope_sim::cli::{Answer, Refusal};
use wakescope_sim::progress::{Observer, Stage, stop};

/// What is told.
pub(crate) enum Event {
    /// Part of a stage that is done, from 0 to 1.
    Progress {
        stage: &'static str,
        part: f64,
        text: String,
    },
    /// Something that deserves attention.
    Warning(String),
    /// The command has ended.
    Done(Box<Result<Answer, Refusal>>),
}

/// Least time between two calls for the same stage.
const SELDOM: Duration = Duration::from_millis(50);

/// A stage that runs.
struct Running {
    stage: Stage,
    steps: u64,
    done: u64,
    text: String,
    /// When it was reported last.
    reported: Option<Instant>,
}

/// Sends what it is told, and stops the command that tells it when this is wanted.
pub(crate) struct Teller {
    events: Mutex<Sender<Event>>,
    stopped: Arc<AtomicBool>,
    /// Stages that run, each a part of the one before it.
    running: Mutex<Vec<Running>>,
}

impl Teller {
    pub(crate) fn new(events: Sender<Event>, stopped: Arc<AtomicBool>) -> Self {
        Self {
            events: Mutex::new(events),
            stopped,
            running: Mutex::default(),
        }
    }

    fn send(&self, event: Event) {
        // Nobody may hear it any more.
        let _ = self
            .events
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .send(event);
    }

    /// Changes the stages and tells of the first one, of which the others are parts.
    fn change(&self, seldom: bool, change: impl FnOnce(&mut Vec<Running>)) {
        if self.stopped.load(Ordering::Relaxed) {
            stop();
        }
        let mut running = self.running.lock().unwrap_or_else(PoisonError::into_inner);
        change(&mut running);
        let Some(first) = running.first_mut() else {
            return;
        };
        if seldom && first.reported.is_some_and(|reported| reported.elapsed() < SELDOM) {
            return;
        }
        let part = if first.steps == 0 {
            0.0
        } else {
            (first.done as f64 / first.steps as f64).min(1.0)
        };
        self.send(Event::Progress {
            stage: first.stage.name(),
            part,
            text: first.text.clone(),
        });
        first.reported = Some(Instant::now());
    }
}

impl Observer for Teller {
    fn begin(&self, stage: Stage, steps: u64) {
        self.change(false, |running| {
            running.push(Running {
                stage,
                steps,
                done: 0,
                text: String::new(),
                reported: None,
            })
        });
    }

    fn advance(&self, steps: u64) {
        self.change(true, |running| {
            running
                .iter_mut()
                .last()
                .into_iter()
                .for_each(|last| last.done += steps)
        });
    }

    fn reach(&self, text: &str) {
        self.change(true, |running| {
            running
                .iter_mut()
                .last()
                .into_iter()
                .for_each(|last| text.clone_into(&mut last.text))
        });
    }

    fn end(&self) {
        self.change(false, |running| drop(running.pop()));
    }

    fn warn(&self, text: &str) {
        self.send(Event::Warning(text.to_owned()));
    }
}
