//! Control of the time step, and what is said of a flow that fails.

use super::flow::Flow;
use super::settings::TimeStep;
use super::stiffness::Stiffness;
use crate::error::{Error, Place};

/// Largest fraction of the explicit viscous limit that a variable time step may use.
const EXPLICIT_FRACTION: f64 = 0.5;
/// Largest growth of the time step from one step to the next.
const LARGEST_GROWTH: f64 = 1.1;

/// What [`larger`] begins with; values are `[value, axis, place]`.
const NO_VALUE: [f64; 3] = [0.0, f64::INFINITY, 0.0];

/// The larger of two values `[value, axis, place]`; of equal ones the one that comes first.
fn larger(best: [f64; 3], next: [f64; 3]) -> [f64; 3] {
    let is_before = next[0] == best[0] && next[1..] < best[1..];
    if next[0] > best[0] || is_before {
        next
    } else {
        best
    }
}

impl Flow {
    /// How stiff viscosity is along the implicit axes.
    pub(super) fn stiffness(&self) -> Stiffness {
        Stiffness::new(self.viscous_per_s, self.state.implicit)
    }

    /// Length of the next step \[s\].
    pub(super) fn next_step_s(&self) -> f64 {
        let mut step_s = self.settings.time_step.step_s(self.state.courant_per_s);
        if matches!(self.settings.time_step, TimeStep::Fixed { .. }) {
            return step_s;
        }
        let explicit = self.explicit_viscous_rate_per_s();
        if explicit > 0.0 {
            step_s = step_s.min(EXPLICIT_FRACTION / explicit);
        }
        step_s = step_s.min(self.stiffness().longest_s());
        if self.state.last_step_s > 0.0 {
            step_s = step_s.min(LARGEST_GROWTH * self.state.last_step_s);
        }
        step_s
    }

    pub(super) fn explicit_viscous_rate_per_s(&self) -> f64 {
        (0..3)
            .filter(|&axis| !self.state.implicit[axis])
            .map(|axis| self.viscous_per_s[axis])
            .sum()
    }

    pub(super) fn check_courant(&self, courant: f64, step_s: f64) -> Result<(), Error> {
        let explicit = step_s * self.explicit_viscous_rate_per_s();
        if courant <= self.settings.scheme.default_courant() && explicit <= EXPLICIT_FRACTION {
            return Ok(());
        }
        let stability = self.stability()?;
        let Some(limit) = stability.refused(self.judged_step_s(&stability, step_s)) else {
            return Ok(());
        };
        let (_, axis, place) =
            self.first_largest(|axis, place| self.state.velocity[axis][place].abs())?;
        Err(Error::CourantTooLarge {
            step: self.state.step + 1,
            step_s,
            time_s: self.state.time_s,
            courant,
            limit,
            place: self.place(axis, place),
        })
    }

    /// The largest positive value at the places that the ranks own, with the memory axis of the
    /// component and the place in the whole field of the first that has it.
    pub(super) fn first_largest(
        &self,
        value_at: impl Fn(usize, usize) -> f64,
    ) -> Result<(f64, usize, usize), Error> {
        let shape = self.layout.shape;
        let own = shape.own_range();
        // Place in the whole field of the first value that is owned.
        let first = shape.own().start * shape.plane();
        let mut own_largest = NO_VALUE;
        for axis in 0..3 {
            for place in own.clone() {
                let whole_place = place - own.start + first;
                let next = [value_at(axis, place), axis as f64, whole_place as f64];
                own_largest = larger(own_largest, next);
            }
        }
        let of_ranks = self.layout.slabs.all_gather(own_largest.to_vec())?;
        let mut largest = NO_VALUE;
        for next in of_ranks.as_chunks::<3>().0 {
            largest = larger(largest, *next);
        }
        let [value, axis, place] = largest;
        Ok(if value > 0.0 {
            (value, axis as usize, place as usize)
        } else {
            (0.0, 0, 0)
        })
    }

    /// Whether a velocity is not finite, and the first such place.
    pub(super) fn first_not_finite(&self) -> Result<(bool, usize, usize), Error> {
        let (found, axis, place) = self.first_largest(|axis, place| {
            f64::from(u8::from(!self.state.velocity[axis][place].is_finite()))
        })?;
        Ok((found > 0.0, axis, place))
    }

    pub(super) fn diverged(&self, axis: usize, place: usize, field: &'static str) -> Error {
        let place = self.place(axis, place);
        Error::Diverged {
            field,
            step: self.state.step,
            time_s: self.state.time_s,
            place,
        }
    }

    /// Component and cell of a memory axis and a place in a whole field.
    pub(super) fn place(&self, axis: usize, place: usize) -> Place {
        let mut cell = [0; 3];
        for (axis, index) in self.layout.shape.index(place).into_iter().enumerate() {
            cell[self.layout.direction[axis]] = index;
        }
        let position_m =
            std::array::from_fn(|d| self.mesh.directions()[d].at(cell[d] as f64 + 0.5).0);
        Place {
            component: ["u", "v", "w"][self.layout.direction[axis]],
            cell,
            position_m,
        }
    }
}
