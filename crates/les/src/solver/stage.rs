//! The right side of the momentum equation, plane by plane.

use super::layout::Layout;
use super::momentum::{Momentum, Scratch};
use super::projection::weighted_dot;
use super::settings::Stage;
use super::subgrid::Subgrid;

/// Work done on the fluid per time by each term.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Powers {
    pub(super) viscous: f64,
    pub(super) subgrid: f64,
    pub(super) force: f64,
}

impl Powers {
    pub(super) fn add(&mut self, other: Self) {
        self.viscous += other.viscous;
        self.subgrid += other.subgrid;
        self.force += other.force;
    }
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
}

impl Task<'_> {
    /// `star = dt (c N + c' N' - grad p + nu L u) + keep u` in plane `k` of component `axis`, with the history; returns the work.
    pub(super) fn increments(
        &self,
        [axis, k]: [usize; 2],
        (stage, stage_s, keep): (&Stage, f64, f64),
        star: &mut [f64],
        history: &mut [f64],
        scratch: &mut Scratch,
    ) -> Powers {
        let n = self.layout.shape.n[0];
        let mut powers = Powers::default();
        for (j, (star, history)) in star.chunks_mut(n).zip(history.chunks_mut(n)).enumerate() {
            if self.ops[axis].is_wall_row(j, k) {
                star.fill(0.0);
                continue;
            }
            self.terms([axis, j, k], star, scratch, &mut powers);
            scratch.gradient(&self.ops[axis], self.pressure, j, k);
            let own = &self.velocity[axis][self.layout.shape.row(j, k)];
            let nu = self.viscosity_m2_s;
            let (implicit, pressure, own) = (&scratch.implicit[..n], &scratch.pressure[..n], &own[..n]);
            let (star, history) = (&mut star[..n], &mut history[..n]);
            for i in 0..n {
                let term = star[i];
                let total = stage.new * term + stage.old * history[i] - pressure[i] + nu * implicit[i];
                history[i] = term;
                star[i] = stage_s * total + keep * own[i];
            }
            self.hold_at_wall(axis, star);
        }
        powers
    }

    /// `star = N + nu L u` in plane `k` of component `axis`.
    pub(super) fn accelerations(&self, [axis, k]: [usize; 2], star: &mut [f64], scratch: &mut Scratch) {
        for (j, star) in star.chunks_mut(self.layout.shape.n[0]).enumerate() {
            if self.ops[axis].is_wall_row(j, k) {
                star.fill(0.0);
                continue;
            }
            self.terms([axis, j, k], star, scratch, &mut Powers::default());
            for (star, implicit) in star.iter_mut().zip(&scratch.implicit) {
                *star += self.viscosity_m2_s * implicit;
            }
            self.hold_at_wall(axis, star);
        }
    }

    /// `N`, the terms that are integrated explicitly, of one row into `out`; the Laplacian along the implicit axes into the scratch.
    fn terms(&self, [axis, j, k]: [usize; 3], out: &mut [f64], scratch: &mut Scratch, powers: &mut Powers) {
        let ops = &self.ops[axis];
        let own = &self.velocity[axis][self.layout.shape.row(j, k)];
        let (across, along) = ops.row_mass(j, k);
        scratch.convection(ops, self.velocity, j, k);
        scratch.implicit.fill(0.0);
        scratch.explicit.fill(0.0);
        let nu = self.viscosity_m2_s;
        if nu > 0.0 {
            scratch.laplacians(ops, self.velocity[axis], self.implicit, j, k);
            let work = weighted_dot(own, &scratch.implicit, along) + weighted_dot(own, &scratch.explicit, along);
            powers.viscous += across * nu * work;
        }
        let force = self.force_m_s2[axis];
        if force != 0.0 {
            let momentum: f64 = own.iter().zip(along).map(|(u, mass)| u * mass).sum();
            powers.force += across * force * momentum;
        }
        let n = out.len();
        let (convection, explicit) = (&scratch.convection[..n], &scratch.explicit[..n]);
        for i in 0..n {
            out[i] = nu * explicit[i] - convection[i] + force;
        }
        if let Some(model) = self.model {
            scratch.model.fill(0.0);
            model.add_divergence_row(axis, j, k, &mut scratch.model);
            powers.subgrid += across * weighted_dot(own, &scratch.model, along);
            for (out, model) in out.iter_mut().zip(&scratch.model) {
                *out += model;
            }
        }
    }

    /// A velocity along axis 0 is zero at the wall that the row begins with.
    fn hold_at_wall(&self, axis: usize, row: &mut [f64]) {
        if axis == 0 && self.layout.line[0].first_face() == 1 {
            row[0] = 0.0;
        }
    }
}
