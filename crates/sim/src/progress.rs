//! The stages of a run, who is told where it is, and how one who is told stops it.

use crate::Error;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

crate::keys::choice! {
    /// A part of the measurement that can run alone or be left out, by the name that plans, progress and summaries use.
    Stage {
        /// Large-eddy simulation of the flow.
        FlowSimulation = "flow simulation",
        /// Wind on a cross-plane, for the files.
        CrossPlane = "cross-plane",
        /// Phase screens and beam propagation.
        PhaseScreens = "phase screens",
        /// Efficiency and SNR against range.
        Efficiency = "efficiency",
        /// Wind along the lines of sight.
        LinesOfSight = "lines of sight",
        /// Heterodyne signals.
        Signals = "signals",
        /// Shot noise.
        Noise = "noise",
        /// Velocity estimates.
        Estimates = "estimates",
        /// Estimates against the truth.
        Errors = "errors",
        /// Vortices from maps and signals.
        Retrieval = "retrieval",
        /// Scans that are drawn for thresholds and shares of wakes that are found.
        Detection = "detection",
        /// Tables and pictures.
        Files = "files",
        /// Cases of a sweep.
        Cases = "cases",
        /// Flights of a data set.
        Flights = "flights",
    }
}

/// Told of the progress of a run, from any thread. A stage may be part of another one. Each call may [`stop`] the run.
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

/// Ends the run from within an [`Observer`]: [`stoppable`], around the run, gives [`Error::Stopped`]. Nothing is printed.
pub fn stop() -> ! {
    resume_unwind(Box::new(Error::Stopped))
}

/// Runs work whose observer may [`stop`] it.
///
/// # Errors
/// [`Error::Stopped`] where it was stopped; those of the work.
pub fn stoppable<T>(work: impl FnOnce() -> Result<T, Error>) -> Result<T, Error> {
    // What the work was about to change is gone with it: files are put into place as wholes.
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|cause| match cause.downcast::<Error>() {
        Ok(stopped) => Err(*stopped),
        Err(cause) => resume_unwind(cause),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::{Plan, Target};
    use crate::run::{RunResult, run};
    use crate::scene::{Scene, SceneFile};
    use std::sync::atomic::{AtomicU64, Ordering};

    /// Stops the run after so many steps.
    struct Impatient(AtomicU64, u64);

    impl Observer for Impatient {
        fn advance(&self, steps: u64) {
            if self.0.fetch_add(steps, Ordering::Relaxed) + steps > self.1 {
                stop();
            }
        }
    }

    #[test]
    fn a_run_that_is_stopped_says_so_and_the_next_one_is_as_if_it_had_not_been() {
        let mut scene = Scene::default();
        (
            scene.scan.elevation_min_rad,
            scene.scan.elevation_max_rad,
            scene.scan.pulses_per_line,
        ) = (0.1, 0.11, 1);
        let plan = Plan::new(SceneFile::new(scene).unwrap(), Target::Map).unwrap();
        // Bits, for what is not known is no number, and no number is equal to itself.
        let bits = |found: RunResult| found.map.unwrap().v_mean_m_s.mapv(f64::to_bits);
        let whole = bits(run(&plan, &Silent).unwrap());
        for steps in [0, 4, 12] {
            let observer = Impatient(AtomicU64::new(0), steps);
            let stopped = stoppable(|| run(&plan, &observer));
            assert!(
                matches!(stopped, Err(Error::Stopped)),
                "after {steps} steps"
            );
        }
        let patient = Impatient(AtomicU64::new(0), u64::MAX);
        assert_eq!(bits(stoppable(|| run(&plan, &patient)).unwrap()), whole);
    }
}
