//! Control of the time step, and what is said of a flow that fails.

use super::flow::Flow;
use super::mesh::Mesh;
use super::settings::{FlowSettings, TimeStep};
use crate::error::{Error, Place};

/// Largest symbol of the Laplacian times the square of the spacing.
pub(super) const LAPLACIAN_SYMBOL: f64 = 49.0 / 9.0;
/// Share of the explicit viscous limit beyond which a direction is taken implicitly.
const IMPLICIT_SHARE: f64 = 0.1;
/// Largest share of the explicit viscous limit that a variable time step may use.
const EXPLICIT_SHARE: f64 = 0.5;
/// Largest product of a variable step and the second of the decay rates of implicit axes. The factored increments take
/// `(d1 + d2)/((1 + d1/2) (1 + d2/2))` of a wave that is stiff along two axes: a ninth here, less and less beyond.
const STIFF_DECAY: f64 = 64.0;
/// Product of the step and the largest decay rate beyond which Crank-Nicolson turns the sign of the shortest waves for hundreds of steps.
const RINGING_DECAY: f64 = 400.0;
/// The same beyond which the mean of the viscous powers at both ends of a step is not that of the step.
const RESOLVED_DECAY: f64 = 4.0;
/// Largest growth of the time step from one step to the next.
const LARGEST_GROWTH: f64 = 1.1;

/// Lengths of the cells along each direction \[m\].
pub(super) fn metrics(mesh: &Mesh) -> [Vec<f64>; 3] {
    mesh.directions().each_ref().map(|d| (0..d.cells).map(|i| d.at(i as f64 + 0.5).1).collect())
}

/// Largest decay rate of the viscous term along x, y, z \[1/s\]; zero along a direction of one cell.
pub(super) fn viscous_rates_per_s(mesh: &Mesh, viscosity_m2_s: f64) -> [f64; 3] {
    metrics(mesh).map(|metric_m| {
        let least_m = metric_m.iter().copied().fold(f64::INFINITY, f64::min);
        if metric_m.len() > 1 { LAPLACIAN_SYMBOL * viscosity_m2_s / least_m.powi(2) } else { 0.0 }
    })
}

/// Along which of x, y, z viscosity is implicit in a flow whose largest `sum |u_i|/h_i` is `courant_per_s` at first.
pub(super) fn implicit_axes(mesh: &Mesh, settings: &FlowSettings, courant_per_s: f64) -> [bool; 3] {
    let step_s = settings.time_step.step_s(courant_per_s);
    viscous_rates_per_s(mesh, settings.viscosity_m2_s).map(|rate_per_s| step_s * rate_per_s > IMPLICIT_SHARE)
}

/// The two largest decay rates of viscosity along implicit axes \[1/s\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stiffness([f64; 2]);

impl Stiffness {
    /// From the rates along all axes and whether viscosity is implicit there.
    pub(super) fn new(rates_per_s: [f64; 3], implicit: [bool; 3]) -> Self {
        let mut rates_per_s: [f64; 3] = std::array::from_fn(|a| if implicit[a] { rates_per_s[a] } else { 0.0 });
        rates_per_s.sort_by(|a, b| b.total_cmp(a));
        Self([rates_per_s[0], rates_per_s[1]])
    }

    /// Longest step in which waves that are short along two axes decay well \[s\].
    pub(super) fn longest_s(self) -> f64 {
        STIFF_DECAY / self.0[1]
    }

    /// Whether the viscous powers at both ends of a step of `step_s` tell what viscosity does in it.
    pub(super) fn is_resolved(self, step_s: f64) -> bool {
        step_s * self.0[0] <= RESOLVED_DECAY
    }

    /// What steps of `step_s` do to the shortest waves, if it is not what viscosity does.
    pub(super) fn note(self, step_s: f64, damped_steps: u64) -> Option<String> {
        let [first, second] = self.0.map(|rate| step_s * rate / LAPLACIAN_SYMBOL);
        if step_s > (1.0 + 1e-9) * self.longest_s() {
            return Some(format!(
                "the step is too long for viscosity along two directions (nu dt/h^2 = {first:.3e} and {second:.3e}): short waves \
                 hardly decay; take steps of at most {:.3e} s",
                self.longest_s()
            ));
        }
        (damped_steps == 0 && first * LAPLACIAN_SYMBOL > RINGING_DECAY).then(|| {
            format!(
                "Crank-Nicolson keeps the shortest waves of a sudden start for many steps (nu dt/h^2 = {first:.3e}): \
                 time.damped_steps = 4 takes them out"
            )
        })
    }
}

impl Flow {
    /// How stiff viscosity is along the implicit axes.
    pub(super) fn stiffness(&self) -> Stiffness {
        Stiffness::new(self.viscous_per_s, self.state.implicit)
    }

    /// Length of the next step \[s\].
    pub(super) fn next_step_s(&self) -> f64 {
        match self.settings.time_step {
            TimeStep::Fixed { step_s } => step_s,
            TimeStep::Courant { .. } => {
                let mut step_s = self.settings.time_step.step_s(self.state.courant_per_s);
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
        }
    }

    pub(super) fn explicit_viscous_rate_per_s(&self) -> f64 {
        (0..3).filter(|&axis| !self.state.implicit[axis]).map(|axis| self.viscous_per_s[axis]).sum()
    }

    pub(super) fn refuse_courant(&self, courant: f64, step_s: f64) -> Result<(), Error> {
        let explicit = step_s * self.explicit_viscous_rate_per_s();
        if courant <= self.settings.scheme.default_courant() && explicit <= EXPLICIT_SHARE {
            return Ok(());
        }
        let stability = self.stability()?;
        let Some(limit) = stability.refused(self.judged_step_s(&stability, step_s)) else { return Ok(()) };
        let (_, axis, place) = self.first_largest(|axis, place| self.state.velocity[axis][place].abs())?;
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
        let ranks = self.layout.slabs.all_gather(best.to_vec())?;
        let [value, axis, place] = ranks.as_chunks::<3>().0.iter().fold(none, |best, next| larger(best, *next));
        Ok(if value > 0.0 { (value, axis as usize, place as usize) } else { (0.0, 0, 0) })
    }

    /// Whether a velocity is not finite, and the first such place.
    pub(super) fn first_not_finite(&self) -> Result<(bool, usize, usize), Error> {
        let not_finite = |axis: usize, place: usize| f64::from(u8::from(!self.state.velocity[axis][place].is_finite()));
        self.first_largest(not_finite).map(|(found, axis, place)| (found > 0.0, axis, place))
    }

    pub(super) fn diverged(&self, axis: usize, place: usize, field: &'static str) -> Error {
        let place = self.place(axis, place);
        Error::Diverged { field, step: self.state.step, time_s: self.state.time_s, place }
    }

    /// Component and cell of a memory axis and a place in a whole field.
    pub(super) fn place(&self, axis: usize, place: usize) -> Place {
        let mut cell = [0; 3];
        for (axis, index) in self.layout.shape.index(place).into_iter().enumerate() {
            cell[self.layout.direction[axis]] = index;
        }
        let position_m = std::array::from_fn(|d| self.mesh.directions()[d].at(cell[d] as f64 + 0.5).0);
        Place { component: ["u", "v", "w"][self.layout.direction[axis]], cell, position_m }
    }
}
