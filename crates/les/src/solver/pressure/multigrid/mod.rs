//! Multigrid for the pressure equation: a check on the direct solver that shares none of its steps but the transform of axis 0.
//!
//! The transform along axis 0 leaves one problem in two dimensions for each mode. There, line relaxation in both directions
//! with the transposed interpolation as restriction converges at the same rate for any stretching; in three dimensions it
//! does not, because errors that are smooth along two strong couplings and rough along a weak third escape all lines. The
//! cycle works in single precision, with the fourth-order operator on the finest mesh and second-order ones on the others, and
//! preconditions flexible conjugate gradients.
//!
//! Modes are solved 16 at a time, each group by one thread from beginning to end, till its share of the tolerance is reached:
//! short waves take two or three iterations. Nothing is summed across groups but the report, in their order, so the result
//! has the same bits for any number of threads. The residual reported is the one of the field in double precision.
//!
//! Check: factor per iteration and count on the meshes of the table, agreement with the direct solver, threads.

mod cycle;
mod grid;
mod krylov;
mod lanes;
mod relax;

use rayon::prelude::*;

use super::super::layout::{Layout, Shape};
use super::super::mesh::AXIS_NAMES;
use super::super::slabs::Slabs;
use super::apply::{Operator, stiffness};
use super::lines::columns;
use super::refine::{Pass, Refinement};
use super::solver::{PressureSolver, Solved, check_request};
use super::transform::{self, RowTransform};
use crate::Error;
use crate::solver::aligned::Aligned;
use cycle::Hierarchy;
use grid::Axis;
use krylov::Plane;
use lanes::{LANES, Wide};

/// Part of the tolerance that is shared in proportion to the right side of each group of modes.
const PROPORTIONAL: f64 = 0.99;

/// The multigrid solver of one mesh.
#[derive(Debug)]
pub(crate) struct Multigrid {
    operator: Operator,
    direction: [usize; 3],
    rows: RowTransform,
    /// Eigenvalue of each mode, in units of the mean cell; groups are filled up with ones.
    mode: Vec<Wide>,
    /// Square of a field's norm over that of its modes.
    weight: Vec<Wide>,
    /// Factor that the transforms leave out, with the sign of the right side.
    scale: f64,
    plane: Plane,
    hierarchy: Hierarchy,
    refinement: Refinement,
}

impl Multigrid {
    /// The hierarchy of meshes of `layout`.
    pub(crate) fn new(layout: &Layout) -> Self {
        let (rows, value, factor) = RowTransform::new(&layout.line[0]);
        let [first, second] = [&layout.line[1], &layout.line[2]];
        let longest = if first.cells > second.cells { first } else { second };
        let unit_m = longest.cell_mass_m.iter().sum::<f64>() / longest.cells as f64;
        let lanes = |at: &dyn Fn(usize) -> f64| -> Vec<Wide> {
            let groups = value.len().div_ceil(LANES);
            let of = |m: usize| if m < value.len() { at(m) } else { 1.0 };
            (0..groups).map(|b| std::array::from_fn(|l| of(b * LANES + l))).collect()
        };
        let mass = &layout.line[0].cell_mass_m;
        let mean_mass = mass.iter().sum::<f64>() / mass.len() as f64;
        let in_units = |line| {
            let rows: Vec<_> = stiffness(line);
            rows.into_iter().map(|row| row.into_iter().map(|(i, c)| (i, c * unit_m)).collect()).collect()
        };
        let plane = Plane {
            stiffness: [in_units(first), in_units(second)],
            mass: [first, second].map(|line| line.cell_mass_m.iter().map(|mass| mass / unit_m).collect()),
        };
        Self {
            operator: Operator::new(layout),
            direction: layout.direction,
            mode: lanes(&|m| value[m] * unit_m * unit_m),
            weight: lanes(&|m| rows.weight(m, mean_mass)),
            rows,
            scale: -factor,
            hierarchy: Hierarchy::new([Axis::new(first, unit_m), Axis::new(second, unit_m)], &plane.stiffness),
            plane,
            refinement: Refinement::default(),
        }
    }

    fn shape(&self) -> Shape {
        self.operator.shape()
    }

    /// Solves for the right side in the planes that are owned, of norm `size`, to about `tolerance`.
    fn pass(&self, own: &mut [f64], size: f64, tolerance: f64) -> Result<Pass, Error> {
        self.transform(own, RowTransform::forward);
        let allowed = (tolerance * size * self.scale).powi(2);
        let slabs = self.operator.slabs();
        let histories: Vec<Vec<f64>> = slabs.turned(own, LANES, |field, shape, first| {
            let mut groups = columns(field, shape, LANES);
            let groups = groups.par_iter_mut().enumerate().map_init(krylov::Work::default, |work, (group, rows)| {
                self.group(first / LANES + group, rows, allowed, tolerance, work)
            });
            groups.collect()
        })?;
        self.transform(own, RowTransform::inverse);
        let histories = together(slabs, histories)?;
        let longest = histories.iter().map(Vec::len).max().unwrap_or(1);
        let total =
            |t: usize| -> f64 { histories.iter().filter_map(|history| history.get(t).or(history.last())).sum::<f64>() };
        let unit = (size * self.scale).abs();
        Ok(Pass((1..longest).map(|t| if unit > 0.0 { total(t).sqrt() / unit } else { 0.0 }).collect()))
    }

    /// Solves one group of modes; returns the squares of its residual's norm.
    fn group(
        &self,
        group: usize,
        rows: &mut [&mut [f64]],
        allowed: f64,
        tolerance: f64,
        work: &mut krylov::Work,
    ) -> Vec<f64> {
        let (mode, weight) = (&self.mode[group], &self.weight[group]);
        let right = work.right(rows.len());
        for (out, row) in right.iter_mut().zip(rows.iter()) {
            *out = [0.0; LANES];
            for (out, value) in out.iter_mut().zip(row.iter()) {
                *out = value * self.scale;
            }
        }
        let constant = mode.iter().position(|lambda| *lambda == 0.0);
        if let Some(l) = constant {
            self.plane.remove_mean(right, l, |mass| mass);
        }
        let squares: f64 =
            right.iter().map(|value| (0..LANES).map(|l| weight[l] * value[l] * value[l]).sum::<f64>()).sum();
        // Most of what is allowed is shared in proportion to the right side, the rest among all modes alike.
        let part = (self.shape().n[0] - group * LANES).min(LANES) as f64 / self.shape().n[0] as f64;
        let share = PROPORTIONAL * tolerance * tolerance * squares + (1.0 - PROPORTIONAL) * part * allowed;
        let history = krylov::solve(&self.plane, &self.hierarchy, (mode, weight), share, work);
        if let Some(l) = constant {
            self.plane.remove_mean(work.solution(), l, |_| 1.0);
        }
        for (value, row) in work.solution().iter().zip(rows.iter_mut()) {
            for (out, value) in row.iter_mut().zip(value) {
                *out = *value;
            }
        }
        history
    }

    /// Transforms the rows, there or back.
    fn transform(&self, field: &mut [f64], apply: impl Fn(&RowTransform, &mut [f64], &mut transform::Work) + Sync) {
        let n0 = self.shape().n[0];
        let rows = (field.len() / n0).div_ceil(64).next_multiple_of(6);
        let slabs = field.par_chunks_mut(rows * n0);
        slabs.for_each_init(transform::Work::default, |work, slab| apply(&self.rows, slab, work));
    }
}

/// The lists of all ranks: each is sent behind its length.
fn together(slabs: &Slabs, own: Vec<Vec<f64>>) -> Result<Vec<Vec<f64>>, Error> {
    let lists: Vec<f64> = own.iter().flat_map(|list| [&[list.len() as f64], &list[..]].concat()).collect();
    let mut all = &*slabs.together(&lists)?;
    let mut found = Vec::new();
    while let [length, rest @ ..] = all {
        let (list, others) = rest.split_at(*length as usize);
        found.push(list.to_vec());
        all = others;
    }
    Ok(found)
}

impl PressureSolver for Multigrid {
    fn solve(&mut self, field: &mut [f64], tolerance: f64) -> Result<Solved, Error> {
        check_request(self.shape(), field, tolerance)?;
        let mut refinement = std::mem::take(&mut self.refinement);
        let own = self.shape().own_places();
        let solved = refinement.run(&self.operator, field, tolerance, "multigrid", |field, size, tolerance| {
            self.pass(&mut field[own.clone()], size, tolerance)
        });
        self.refinement = refinement;
        solved
    }

    fn spare(&mut self) -> &mut Aligned {
        self.refinement.spare()
    }

    fn describe(&self) -> String {
        let [x, y, z] = self.direction.map(|d| AXIS_NAMES[d]);
        format!("multigrid: {x} {}, {} meshes in {y} and {z}", self.rows.name(), self.hierarchy.depth())
    }
}
