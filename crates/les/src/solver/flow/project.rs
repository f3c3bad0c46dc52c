//! The projection of a stage, repeated on the velocity where the pressure alone cannot hold the
//! correction.
//!
//! The pressure of a wave of `k` cells is `k^2` times as large as that of a single cell, so that
//! its last digit leaves divergence through the gradient: 1e-16 times the square of length over
//! finest cell, relative to the right side. A velocity that was corrected once has hardly any
//! divergence left, and the last digit of the pressure that takes out the rest is nothing.
//!
//! Check: divergence right after the start on strongly stretched meshes and flat cells; steps in a
//! long domain.

use super::{Flow, Solved, add, correct};
use crate::error::{Error, PressureFailure};
use crate::solver::aligned::Aligned;
use crate::solver::pressure::{accept_round_off, norm};
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
    /// If the residual of the pressure equation, which is the divergence of the new velocity, does
    /// not reach the tolerance, neither relative to what was to be corrected nor to the velocity
    /// over the cell.
    pub(super) fn project(&mut self, stage_s: f64) -> Result<Solved, Error> {
        self.set_poisson_source(stage_s)?;
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
                let remaining = self.reproject(stage_s, tolerance * size)?;
                // A step that hardly changes the flow has so little to correct that round-off of
                // the velocity exceeds that fraction of it.
                if remaining > tolerance * size && self.measure_divergence()? > tolerance {
                    return solved;
                }
                Ok(Solved {
                    residual: remaining / size,
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

    /// Writes the source of the Poisson equation, the weighted divergence of `predicted` over
    /// `stage_s`, to `phi`.
    pub(super) fn set_poisson_source(&mut self, stage_s: f64) -> Result<(), Error> {
        self.layout
            .slabs
            .halos(&mut [&mut self.predicted[2]], self.divergence.reach)?;
        let predicted = self.predicted.each_ref().map(|field| &field[..]);
        self.divergence
            .apply(predicted, 1.0 / stage_s, &mut self.phi);
        Ok(())
    }

    /// Projects the velocity again until the norm of its weighted divergence over `stage_s` is at
    /// most `target`, or falls no more; returns that norm. The corrections of the pressure are
    /// added to `phi`.
    pub(super) fn reproject(&mut self, stage_s: f64, target: f64) -> Result<f64, Error> {
        let mut divergence = Aligned::zeros(self.layout.shape.len());
        let mut last_norm = f64::INFINITY;
        for _ in 0..=MAX_REPETITIONS {
            self.divergence.apply(
                self.state.velocity.each_ref().map(|field| &field[..]),
                1.0 / stage_s,
                &mut divergence,
            );
            let current_norm = norm(&self.layout.slabs, &divergence)?;
            if current_norm <= target || current_norm > GAIN * last_norm {
                return Ok(current_norm);
            }
            last_norm = current_norm;
            let tolerance = self.settings.pressure_tolerance.max(REPETITION_TOLERANCE);
            accept_round_off(self.pressure_solver.solve(&mut divergence, tolerance))?;
            // The solver has replaced the divergence by the pressure.
            let phi = &divergence;
            std::mem::swap(&mut self.predicted, &mut self.state.velocity);
            self.correct(stage_s, phi)?;
            add(&mut self.phi, phi, self.layout.shape);
        }
        Ok(last_norm)
    }

    /// `velocity = predicted - stage_s grad(phi)`.
    fn correct(&mut self, stage_s: f64, phi: &[f64]) -> Result<(), Error> {
        let predicted = self.predicted.each_ref().map(|field| &field[..]);
        let mut velocity = self.state.velocity.each_mut().map(|field| &mut field[..]);
        let planes = correct(&self.ops, predicted, phi, stage_s, &mut velocity);
        self.layout.slabs.halos(&mut velocity, WHOLE)?;
        let planes = self.layout.slabs.planes(planes)?;
        self.state.energy = 0.0;
        self.state.courant_per_s = 0.0;
        for [energy, courant_per_s] in planes {
            self.state.energy += energy;
            if courant_per_s > self.state.courant_per_s {
                self.state.courant_per_s = courant_per_s;
            }
        }
        Ok(())
    }
}
