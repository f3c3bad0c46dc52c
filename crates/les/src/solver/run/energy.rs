//! The energy that a flow may have: nothing but a force or a moving wall can give it any.
//!
//! Pressure, convection and boundaries at rest do no work, viscosity and subgrid stresses take energy away. So the energy may
//! not exceed the lowest that it had, but for what a force did since: by Cauchy and Schwarz `d sqrt(E)/dt <= |f| sqrt(M/2)`, with
//! `M` the volume. Walls of speed `U` can bring the fluid to that speed on top of its own, `sqrt(M/2) U` more in `sqrt(E)`. What
//! is beyond comes from the numbers: the state is not to be kept.
//!
//! Check: growing flows are stopped; forced, dragged and decaying ones are not.

use super::super::flow::Flow;
use super::super::mesh::Wall;
use super::super::settings::TimeScheme;
use crate::error::{EnergyGrowth, Error};

/// Share of the energy by which a flow may exceed what it may have. A stable step errs by much less; where errors of the time
/// step have added this much the solution is theirs.
pub(super) const SHARE: f64 = 0.01;
/// Below this share of the largest energy of the run the energy is round-off.
const ROUND_OFF: f64 = 1e-24;
/// A pressure tolerance above this may itself feed energy.
pub(super) const LOOSE: f64 = 1e-6;

/// The bound on the energy as a run goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct EnergyBound {
    /// What the flow may have without walls that move \[m^5/s^2\].
    pub(super) bound_m5_s2: f64,
    /// Largest energy so far \[m^5/s^2\].
    pub(super) largest_m5_s2: f64,
}

impl EnergyBound {
    pub(super) fn new(flow: &Flow) -> Self {
        let energy = flow.kinetic_energy_m5_s2();
        Self { bound_m5_s2: energy, largest_m5_s2: energy }
    }

    /// Takes a step of `step_s` that brought `energy_before` to the present energy.
    ///
    /// # Errors
    /// [`Error::EnergyGrew`] if the energy is more than the flow may have.
    pub(super) fn pass(&mut self, flow: &Flow, energy_before: f64, step_s: f64) -> Result<(), Error> {
        let energy = flow.kinetic_energy_m5_s2();
        let [force, wall] = sources(flow);
        let forced = (self.bound_m5_s2.sqrt() + step_s * force).powi(2);
        let allowed = (forced.sqrt() + wall).powi(2);
        if energy > (1.0 + SHARE) * allowed {
            return Err(grew(flow, allowed, (energy / energy_before).ln() / step_s)?);
        }
        self.largest_m5_s2 = self.largest_m5_s2.max(energy);
        self.bound_m5_s2 = energy.min(forced).max(ROUND_OFF * self.largest_m5_s2);
        Ok(())
    }
}

/// What the force adds to `sqrt(E)` in a second, and what walls that move add once.
fn sources(flow: &Flow) -> [f64; 2] {
    let volume_m3: f64 = flow.layout.line.iter().map(|line| line.cell_mass_m.iter().sum::<f64>()).product();
    let length = |v: [f64; 3]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
    let walls = flow.mesh().directions().iter().flat_map(|d| d.ends.walls());
    let fastest_m_s = walls.fold(0.0, |fastest: f64, wall| match wall {
        Wall::Slip => fastest,
        Wall::NoSlip { velocity_m_s } => fastest.max(length(velocity_m_s)),
    });
    [length(flow.settings().force_m_s2), fastest_m_s].map(|v| v * (0.5 * volume_m3).sqrt())
}

fn grew(flow: &Flow, allowed_m5_s2: f64, rate_per_s: f64) -> Result<Error, Error> {
    let (axis, place) = flow.strongest_short_wave()?;
    Ok(Error::EnergyGrew(Box::new(EnergyGrowth {
        step: flow.steps(),
        time_s: flow.time_s(),
        energy_m5_s2: flow.kinetic_energy_m5_s2(),
        allowed_m5_s2,
        rate_per_s,
        place: flow.place(axis, place),
        cause: cause(flow)?,
    })))
}

/// The likeliest cause, and what to do.
fn cause(flow: &Flow) -> Result<String, Error> {
    let settings = flow.settings();
    let step_s = flow.state.last_step_s;
    let decay = step_s * flow.explicit_viscous_rate_per_s();
    if decay > settings.scheme.largest_decay() {
        return Ok(format!(
            "viscosity is explicit with {decay:.2} per step, stable up to {}: shorten the step or take it implicitly",
            settings.scheme.largest_decay()
        ));
    }
    let stability = flow.stability()?;
    if let Some(growth) = stability.undamped(flow.judged_step_s(&stability, step_s)) {
        let remedy =
            if settings.scheme == TimeScheme::AdamsBashforth2 { "take Runge-Kutta" } else { "shorten the step" };
        return Ok(format!("{growth}: {remedy}"));
    }
    if let Some(note) = flow.stiffness().note(step_s, settings.damped_steps) {
        return Ok(note);
    }
    let tolerance = settings.pressure_tolerance;
    if tolerance > LOOSE {
        return Ok(format!(
            "the pressure tolerance {tolerance:e} leaves divergence, which feeds energy: take 1e-8 or less"
        ));
    }
    Ok("the time step is too long for this flow: shorten it".into())
}
