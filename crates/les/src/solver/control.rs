//! Control of the time step, and what is said of a flow that fails.

use super::flow::Flow;
use super::settings::TimeStep;
use super::stiffness::Stiffness;
use crate::error::{Error, Place};

/// Largest share of the explicit viscous limit that a variable time step may use.
const EXPLICIT_SHARE: f64 = 0.5;
/// Largest growth of the time step from one step to the next.
const LARGEST_GROWTH: f64 = 1.1;

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
            step_s = step_s.min(EXPLICIT_SHARE / explicit);
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

    pub(super) fn refuse_courant(&self, courant: f64, step_s: f64) -> Result<(), Error> {
        let explicit = step_s * self.explicit_viscous_rate_per_s();
        if courant <= self.settings.scheme.default_courant() && explicit <= EXPLICIT_SHARE {
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

    /// The largest positive value at the places that the ranks own, with memory axis of the component and place in the whole
    /// field of the first that has it.
    pub(super) fn first_largest(
        &self,
        of: impl Fn(usize, usize) -> f64,
    ) -> Result<(f64, usize, usize), Error> {
        let shape = self.layout.shape;
        let (own, first) = (shape.own_places(), shape.own().start * shape.plane());
        let larger = |best: [f64; 3], next: [f64; 3]| {
            let is_before = next[0] == best[0] && next[1..] < best[1..];
            if next[0] > best[0] || is_before {
                next
            } else {
                best
            }
        };
        let none = [0.0, f64::INFINITY, 0.0];
        let of = |axis: usize, place: usize| {
            [
                of(axis, place),
                axis as f64,
                (place - own.start + first) as f64,
            ]
        };
        let all = (0..3).flat_map(|axis| own.clone().map(move |place| (axis, place)));
        let best = all.fold(none, |best, (axis, place)| larger(best, of(axis, place)));
        let ranks = self.layout.slabs.all_gather(best.to_vec())?;
        let [value, axis, place] = ranks
            .as_chunks::<3>()
            .0
            .iter()
            .fold(none, |best, next| larger(best, *next));
        Ok(if value > 0.0 {
            (value, axis as usize, place as usize)
        } else {
            (0.0, 0, 0)
        })
    }

    /// Whether a velocity is not finite, and the first such place.
    pub(super) fn first_not_finite(&self) -> Result<(bool, usize, usize), Error> {
        let not_finite = |axis: usize, place: usize| {
            f64::from(u8::from(!self.state.velocity[axis][place].is_finite()))
        };
        self.first_largest(not_finite)
            .map(|(found, axis, place)| (found > 0.0, axis, place))
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
