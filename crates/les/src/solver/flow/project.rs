//! The projection of a stage, repeated on the velocity where the pressure alone cannot hold the correction.
//!
//! The pressure of a wave of `k` cells is `k^2` times as large as that of a single cell, so that its last digit leaves
//! divergence through the gradient: 1e-16 times the square of length over finest cell, relative to the right side. A velocity
//! that was corrected once has hardly any divergence left, and the last digit of the pressure that takes out the rest is
//! nothing.
//!
//! Check: divergence right after the start on strongly stretched meshes and flat cells; steps in a long domain.

use super::{Flow, Solved, add, correct};
use crate::error::{Error, PressureFailure};
use crate::solver::aligned::Aligned;
use crate::solver::pressure::{norm, unless_stalled};
use crate::solver::slabs::WHOLE;

/// Most repetitions.
const MAX_REPETITIONS: usize = 4;
/// A projection that leaves more than this part of the divergence before it has reached round-off.
const GAIN: f64 = 0.5;
/// Tolerance of the solves of a repetition: each leaves that part of what was left.
const REPETITION_TOLERANCE: f64 = 1e-6;

impl Flow {
    /// Projects `predicted` to the new velocity; `phi` is left in the work array.
    ///
    /// # Errors
    /// If the residual of the pressure equation, which is the divergence of the new velocity, does not reach the tolerance,
    /// neither relative to what was to be corrected nor to the velocity over the cell.
    pub(super) fn project(&mut self, stage_s: f64) -> Result<Solved, Error> {
        self.take_divergence(stage_s)?;
        let tolerance = self.settings.pressure_tolerance;
        let solved = self.pressure_solver.solve(&mut self.phi, tolerance);
        let phi = std::mem::take(&mut self.phi);
        let corrected = self.correct(stage_s, &phi);
        self.phi = phi;
        corrected?;
        let Err(Error::PressureNotSolved {
            reason,
            iterations,
            history,
            ..
        }) = &solved
        else {
            return solved;
        };
        match reason {
            PressureFailure::RoundOff { .. } => {
                let mut right = Aligned::zeros(self.layout.shape.len());
                self.divergence.apply(
                    self.predicted.each_ref().map(|field| &field[..]),
                    1.0 / stage_s,
                    &mut right,
                );
                let size = norm(&self.layout.slabs, &right)?;
                let left = self.repeat(stage_s, tolerance * size)?;
                // A step that hardly changes the flow has so little to correct that round-off of the velocity is more than the
                // tolerance's share of it.
                if left > tolerance * size && self.measure_divergence()? > tolerance {
                    return solved;
                }
                Ok(Solved {
                    residual: left / size,
                    iterations: (*iterations).max(history.len()),
                    factor: None,
                })
            }
            // The step names the place where the velocity is not finite.
            PressureFailure::NotFinite => Ok(Solved {
                residual: f64::NAN,
                iterations: 0,
                factor: None,
            }),
            PressureFailure::Stalled => solved,
        }
    }

    /// The weighted divergence of `predicted` over `stage_s` into `phi`.
    pub(super) fn take_divergence(&mut self, stage_s: f64) -> Result<(), Error> {
        self.layout
            .slabs
            .halos(&mut [&mut self.predicted[2]], self.divergence.reach)?;
        let predicted = self.predicted.each_ref().map(|field| &field[..]);
        self.divergence
            .apply(predicted, 1.0 / stage_s, &mut self.phi);
        Ok(())
    }

    /// Projects the velocity again till the norm of its weighted divergence over `stage_s` is at most `enough`, or falls no
    /// more; returns that norm. What the pressure adds goes to `phi`.
    pub(super) fn repeat(&mut self, stage_s: f64, enough: f64) -> Result<f64, Error> {
        let mut rest = Aligned::zeros(self.layout.shape.len());
        let mut last = f64::INFINITY;
        for _ in 0..=MAX_REPETITIONS {
            self.divergence.apply(
                self.state.velocity.each_ref().map(|field| &field[..]),
                1.0 / stage_s,
                &mut rest,
            );
            let size = norm(&self.layout.slabs, &rest)?;
            if size <= enough || size > GAIN * last {
                return Ok(size);
            }
            last = size;
            let tolerance = self.settings.pressure_tolerance.max(REPETITION_TOLERANCE);
            unless_stalled(self.pressure_solver.solve(&mut rest, tolerance))?;
            std::mem::swap(&mut self.predicted, &mut self.state.velocity);
            self.correct(stage_s, &rest)?;
            add(&mut self.phi, &rest, self.layout.shape);
        }
        Ok(last)
    }

    /// `velocity = predicted - stage_s grad(phi)`.
    fn correct(&mut self, stage_s: f64, phi: &[f64]) -> Result<(), Error> {
        let predicted = self.predicted.each_ref().map(|field| &field[..]);
        let mut velocity = self.state.velocity.each_mut().map(|field| &mut field[..]);
        let planes = correct(&self.ops, predicted, phi, stage_s, &mut velocity);
        self.layout.slabs.halos(&mut velocity, WHOLE)?;
        let planes = self.layout.slabs.planes(planes)?;
        self.state.energy = planes.iter().fold(0.0, |sum, plane| sum + plane[0]);
        self.state.courant_per_s =
            planes.iter().fold(
                0.0,
                |most, plane| if plane[1] > most { plane[1] } else { most },
            );
        Ok(())
    }
}
