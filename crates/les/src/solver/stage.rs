//! The right side of the momentum equation, plane by plane.

use super::layout::Layout;
use super::momentum::{Momentum, Scratch};
use super::projection::weighted_dot;
use super::settings::Stage;
use super::subgrid::Subgrid;

#[derive(Debug, Clone, Copy, Default)]
/// Work done on the fluid per time by each term.
pub(super) struct Powers {
    pub(super) viscous: f64,
    pub(super) subgrid: f64,
    pub(super) force: f64,
}

/// What the planes of the momentum equation read.
pub(super) struct Task<'a> {
    pub(super) layout: &'a Layout,
    pub(super) ops: &'a [Momentum; 3],
    pub(super) velocity: [&'a [f64]; 3],
    pub(super) pressure: &'a [f64],
    pub(super) model: Option<&'a Subgrid>,
    pub(super) viscosity_m2_s: f64,
    pub(super) force_m_s2: [f64; 3],
    pub(super) implicit: [bool; 3],
    pub(super) stage: Stage,
    pub(super) stage_s: f64,
    pub(super) add_velocity: bool,
    pub(super) acceleration_only: bool,
}

impl Task<'_> {
    pub(super) fn plane(
        &self,
        axis: usize,
        k: usize,
        star: &mut [f64],
        history: &mut [f64],
        scratch: &mut Scratch,
    ) -> Powers {
        let shape = self.layout.shape;
        let n = shape.n[0];
        let mut powers = Powers::default();
        for (j, (star, history)) in star.chunks_mut(n).zip(history.chunks_mut(n)).enumerate() {
            if self.ops[axis].is_wall_row(j, k) {
                star.fill(0.0);
                continue;
            }
            self.row(axis, j, k, star, history, scratch, &mut powers);
        }
        powers
    }

    fn row(
        &self,
        axis: usize,
        j: usize,
        k: usize,
        star: &mut [f64],
        history: &mut [f64],
        scratch: &mut Scratch,
        powers: &mut Powers,
    ) {
        let ops = &self.ops[axis];
        let own = &self.velocity[axis][self.layout.shape.row(j, k)];
        let (across, along) = ops.row_mass(j, k);
        scratch.convection(ops, self.velocity, j, k);
        scratch.implicit.fill(0.0);
        scratch.explicit.fill(0.0);
        if self.viscosity_m2_s > 0.0 {
            scratch.laplacians(ops, self.velocity[axis], self.implicit, j, k);
            let work = weighted_dot(own, &scratch.implicit, along) + weighted_dot(own, &scratch.explicit, along);
            powers.viscous += across * self.viscosity_m2_s * work;
        }
        if let Some(model) = self.model {
            scratch.model.fill(0.0);
            model.add_divergence_row(axis, j, k, &mut scratch.model);
            powers.subgrid += across * weighted_dot(own, &scratch.model, along);
        }
        let force = self.force_m_s2[axis];
        if force != 0.0 {
            let momentum: f64 = own.iter().zip(along).map(|(u, mass)| u * mass).sum();
            powers.force += across * force * momentum;
        }
        if !self.acceleration_only {
            scratch.gradient(ops, self.pressure, j, k);
        }
        let new = NewTerms {
            convection: &scratch.convection,
            explicit: &scratch.explicit,
            model: self.model.map(|_| scratch.model.as_slice()),
            nu: self.viscosity_m2_s,
            force,
        };
        if self.acceleration_only {
            new.write(star);
            for (star, implicit) in star.iter_mut().zip(&scratch.implicit) {
                *star += self.viscosity_m2_s * implicit;
            }
        } else {
            self.advance(&new, &scratch.implicit, &scratch.pressure, own, star, history);
        }
        if axis == 0 && self.layout.line[0].first_face() == 1 {
            star[0] = 0.0;
        }
    }

    /// `star = dt (c N + c' N' - grad p + nu L u) [+ u]`, and the history.
    fn advance(
        &self,
        new: &NewTerms<'_>,
        implicit: &[f64],
        pressure: &[f64],
        own: &[f64],
        star: &mut [f64],
        history: &mut [f64],
    ) {
        let Stage { new: weight, old, .. } = self.stage;
        let dt = self.stage_s;
        new.write(star);
        let n = star.len();
        let (implicit, pressure, own, history) = (&implicit[..n], &pressure[..n], &own[..n], &mut history[..n]);
        let keep = if self.add_velocity { 1.0 } else { 0.0 };
        for i in 0..n {
            let term = star[i];
            let total = weight * term + old * history[i] - pressure[i] + new.nu * implicit[i];
            history[i] = term;
            star[i] = dt * total + keep * own[i];
        }
    }
}

/// The terms that are integrated explicitly.
struct NewTerms<'a> {
    convection: &'a [f64],
    explicit: &'a [f64],
    model: Option<&'a [f64]>,
    nu: f64,
    pub(super) force: f64,
}

impl NewTerms<'_> {
    fn write(&self, out: &mut [f64]) {
        let n = out.len();
        let (convection, explicit) = (&self.convection[..n], &self.explicit[..n]);
        for i in 0..n {
            out[i] = self.nu * explicit[i] - convection[i] + self.force;
        }
        if let Some(model) = self.model {
            for (out, model) in out.iter_mut().zip(model) {
                *out += model;
            }
        }
    }
}
