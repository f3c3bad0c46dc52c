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
        let (_, axis, place) = self.first_largest(|axis, place| self.state.velocity[axis][place].abs())?;
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

    /// The largest positive value at the places that the ranks own, with memory axis of the component and place in the whole
    /// field of the first that has it.
    pub(super) fn first_largest(&self, of: impl Fn(usize, usize) -> f64) -> Result<(f64, usize, usize), Error> {
        let shape = self.layout.shape;
        let (own, first) = (shape.own_places(), shape.own().start * shape.plane());
        let larger = |best: [f64; 3], next: [f64; 3]| {
            let is_before = next[0] == best[0] && next[1..] < best[1..];
            if next[0] > best[0] || is_before { next } else { best }
        };
        let none = [0.0, f64::INFINITY, 0.0];
        let of = |axis: usize, place: usize| [of(axis, place), axis as f64, (place - own.start + first) as f64];
        let all = (0..3).flat_map(|axis| own.clone().map(move |place| (axis, place)));
        let best = all.fold(none, |best, (axis, place)| larger(best, of(axis, place)));
        let ranks = self.layout.slabs.together(&best)?;
        let [value, axis, place] = ranks.as_chunks::<3>().0.iter().fold(none, |best, next| larger(best, *next));
        Ok(if value > 0.0 { (value, axis as usize, place as usize) } else { (0.0, 0, 0) })
    }

    /// Whether a velocity is not finite, and the first such place.
    pub(super) fn first_not_finite(&self) -> Result<(bool, usize, usize), Error> {
        let not_finite = |axis: usize, place: usize| f64::from(u8::from(!self.state.velocity[axis][place].is_finite()));
        self.first_largest(not_finite).map(|(found, axis, place)| (found > 0.0, axis, place))
    }

    pub(super) fn diverged(&self, axis: usize, place: usize, field: &'static str) -> Error {
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

    /// Indices along x, y, z of a place in a whole field.
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
