//! Control of the time step, and what is said of a flow that fails.

use super::flow::Flow;
use super::settings::{TimeStep, ViscousTreatment};
use crate::Error;

/// Largest symbol of the Laplacian times the square of the spacing.
const LAPLACIAN_SYMBOL: f64 = 49.0 / 9.0;
/// Share of the explicit viscous limit beyond which a direction is taken implicitly.
const IMPLICIT_SHARE: f64 = 0.1;
/// Largest share of the explicit viscous limit that a variable time step may use.
const EXPLICIT_SHARE: f64 = 0.5;
/// Largest growth of the time step from one step to the next.
const LARGEST_GROWTH: f64 = 1.1;

impl Flow {
    /// Length of the next step \[s\].
    pub(super) fn next_step_s(&self) -> f64 {
        match self.settings.time_step {
            TimeStep::Fixed { step_s } => step_s,
            TimeStep::Courant { courant, longest_s } => {
                let mut step_s = longest_s.min(courant / self.state.courant_per_s);
                let explicit = self.explicit_viscous_rate_per_s();
                if explicit > 0.0 {
                    step_s = step_s.min(EXPLICIT_SHARE / explicit);
                }
                if self.state.last_step_s > 0.0 {
                    step_s = step_s.min(LARGEST_GROWTH * self.state.last_step_s);
                }
                step_s
            }
        }
    }

    /// Largest decay rate of the viscous term along one memory axis \[1/s\].
    pub(super) fn viscous_rate_per_s(&self, axis: usize) -> f64 {
        let line = &self.layout.line[axis];
        if line.is_thin() {
            return 0.0;
        }
        let least_m = line.cell_metric_m.iter().copied().fold(f64::INFINITY, f64::min);
        LAPLACIAN_SYMBOL * self.settings.viscosity_m2_s / least_m.powi(2)
    }

    pub(super) fn explicit_viscous_rate_per_s(&self) -> f64 {
        (0..3).filter(|&axis| !self.state.implicit[axis]).map(|axis| self.viscous_rate_per_s(axis)).sum()
    }

    pub(super) fn choose_implicit(&self) -> [bool; 3] {
        if self.settings.viscosity_m2_s == 0.0 {
            return [false; 3];
        }
        match self.settings.viscous {
            ViscousTreatment::Implicit(directions) => self.layout.direction.map(|d| directions[d]),
            ViscousTreatment::Auto => {
                let step_s = match self.settings.time_step {
                    TimeStep::Fixed { step_s } => step_s,
                    TimeStep::Courant { courant, longest_s } => longest_s.min(courant / self.state.courant_per_s),
                };
                std::array::from_fn(|axis| step_s * self.viscous_rate_per_s(axis) > IMPLICIT_SHARE)
            }
        }
    }

    pub(super) fn refuse_courant(&self, courant: f64, step_s: f64) -> Result<(), Error> {
        let limit = self.settings.scheme.largest_courant();
        if courant <= limit {
            return Ok(());
        }
        let mut worst = (0, 0, 0.0);
        for (axis, field) in self.state.velocity.iter().enumerate() {
            for (place, value) in field.iter().enumerate() {
                if value.abs() > worst.2 {
                    worst = (axis, place, value.abs());
                }
            }
        }
        let (axis, place, _) = worst;
        Err(Error::CourantTooLarge {
            step: self.state.step + 1,
            step_s,
            time_s: self.state.time_s,
            courant,
            limit,
            component: self.component_name(axis),
            cell: self.cell(place),
            position_m: self.position_m(place),
        })
    }

    pub(super) fn diverged(&self, axis: usize, field: &'static str) -> Error {
        let place = self.state.velocity[axis].iter().position(|v| !v.is_finite()).unwrap_or(0);
        Error::Diverged {
            field,
            step: self.state.step,
            time_s: self.state.time_s,
            component: self.component_name(axis),
            cell: self.cell(place),
            position_m: self.position_m(place),
        }
    }

    pub(super) fn component_name(&self, axis: usize) -> &'static str {
        ["u", "v", "w"][self.layout.direction[axis]]
    }

    /// Indices along x, y, z of a place in memory.
    pub(super) fn cell(&self, place: usize) -> [usize; 3] {
        let mut cell = [0; 3];
        for (axis, index) in self.layout.shape.index(place).into_iter().enumerate() {
            cell[self.layout.direction[axis]] = index;
        }
        cell
    }

    pub(super) fn position_m(&self, place: usize) -> [f64; 3] {
        let cell = self.cell(place);
        std::array::from_fn(|d| self.mesh.directions()[d].at(cell[d] as f64 + 0.5).0)
    }
}
