//! Direct solution of the pressure equation.
//!
//! The fourth-order operator is a sum of products of the directions' operators, so the eigenvectors
//! of one direction reduce it to a family of problems of one dimension less, exactly. Axis 0 and
//! one of the other two are transformed; what remains along the third is solved by a banded
//! factorisation, or divided where that axis is periodic and transformed as well. Of two bounded
//! axes the longer is factorised, because a transform costs work in proportion to its length.
//!
//! Every step treats planes or lines one by one and no sum crosses them: the result has the same
//! bits for any number of threads. The field is transformed in place.
//!
//! The residual is round-off times the condition of the mesh: about 1e-13 for rough right sides on
//! most meshes, but 1e-16 times the square of the ratio of length and finest cell for long waves.
//! Every solve measures its own, and solves again for what it leaves while that is above the
//! tolerance.
//!
//! Check: residuals on all kinds of meshes, null space, refinement, equal bits for any number of
//! threads.

use rayon::prelude::*;

use super::super::layout::{Layout, Shape};
use super::banded_cholesky::{BandedCholesky, Scratch};
use super::kernel;
use super::lines::pencils;
use super::method::Method;
use super::transform::{LineTransform, RowTransform, TransformDirection, Work};
use crate::Error;
use crate::solver::slabs::Slabs;

/// The direct solver of one mesh.
#[derive(Debug)]
pub(crate) struct Direct {
    slabs: Slabs,
    rows: RowTransform,
    /// The transforms along the axes 1 and 2; none along that of the banded operator.
    along: [Option<LineTransform>; 2],
    /// The axis that is not transformed, and its banded operator.
    band: Option<(usize, BandedCholesky)>,
    /// Eigenvalues of the three axes; empty for the factorised one.
    value: [Vec<f64>; 3],
    /// Factor of the transforms, with the sign of the right side.
    scale: f64,
}

/// Planes from which a transform of both axes of a plane at a time keeps the cores busy.
const ENOUGH_PLANES: usize = 8;

impl Direct {
    /// Factorises the mesh.
    pub(crate) fn new(layout: &Layout) -> Self {
        let (rows, values, factor) = RowTransform::new(&layout.line[0]);
        let band = banded_axis(layout)
            .and_then(|axis| Some((axis, BandedCholesky::new(&layout.line[axis])?)));
        let mut along = [None, None];
        let mut value = [values, Vec::new(), Vec::new()];
        for axis in [1, 2] {
            if band.as_ref().is_none_or(|(banded, _)| *banded != axis) {
                let (transform, values) = LineTransform::new(&layout.line[axis]);
                along[axis - 1] = Some(transform);
                value[axis] = values;
            }
        }
        Self {
            slabs: layout.slabs.clone(),
            rows,
            along,
            band,
            value,
            scale: -factor,
        }
    }

    /// What is done along the axes 1 and 2 of the places from `first` on of axis 0.
    fn lines_once(&self, field: &mut [f64], shape: Shape, first: usize) {
        if !self.by_planes() {
            self.lines(TransformDirection::Forward, 0, field, shape);
        }
        match (&self.band, &self.along[1]) {
            (Some((axis, band)), _) => {
                // Nothing is transformed where axis 2 is that of the band.
                self.lines(TransformDirection::Forward, 1, field, shape);
                self.banded(*axis, band, field, shape, first);
                self.lines(TransformDirection::Inverse, 1, field, shape);
            }
            (None, Some(transform)) => self.divide(transform, field, shape, first),
            (None, None) => {}
        }
        if !self.by_planes() {
            self.lines(TransformDirection::Inverse, 0, field, shape);
        }
    }

    /// Whether axes 0 and 1 are transformed together, plane by plane.
    fn by_planes(&self) -> bool {
        self.slabs.shape.n[2] >= ENOUGH_PLANES
    }

    /// Transforms along axis 0, and along axis 1 where that is done plane by plane.
    fn rows(&self, direction: TransformDirection, field: &mut [f64]) {
        let [n0, n1, n2] = self.slabs.shape.n;
        let rows = if self.by_planes() {
            n1
        } else {
            (n1 * n2).div_ceil(64).next_multiple_of(6)
        };
        field
            .par_chunks_mut(n0 * rows)
            .for_each_init(Work::default, |work, slab| {
                if direction == TransformDirection::Forward {
                    self.rows.apply(direction, slab, work);
                }
                if let (true, Some(axis)) = (self.by_planes(), &self.along[0]) {
                    let mut rows: Vec<&mut [f64]> = slab.chunks_mut(n0).collect();
                    axis.apply(direction, &mut rows, work);
                }
                if direction == TransformDirection::Inverse {
                    self.rows.apply(direction, slab, work);
                }
            });
    }

    /// Transforms along axis `which + 1` if it is transformed.
    fn lines(&self, direction: TransformDirection, which: usize, field: &mut [f64], shape: Shape) {
        let Some(transform) = &self.along[which] else {
            return;
        };
        let mut pencils = pencils(field, shape, which + 1, usize::MAX);
        let each = pencils.par_iter_mut();
        each.for_each_init(Work::default, |work, pencil| {
            transform.apply(direction, &mut pencil.rows, work)
        });
    }

    /// Solves for the coefficients of the eigenvectors of the other axes along the factorised one.
    fn banded(
        &self,
        axis: usize,
        band: &BandedCholesky,
        field: &mut [f64],
        shape: Shape,
        first: usize,
    ) {
        let along = &self.value[0][first..first + shape.n[0]];
        let other = &self.value[3 - axis];
        pencils(field, shape, axis, usize::MAX)
            .par_iter_mut()
            .for_each_init(Scratch::default, |scratch, pencil| {
                let width = pencil.rows.first().map_or(0, |row| row.len());
                let shifts = &along[pencil.start..pencil.start + width];
                band.solve(
                    &mut pencil.rows,
                    other[pencil.other],
                    shifts,
                    self.scale,
                    scratch,
                );
            });
    }

    /// Divides the coefficients of the eigenvectors of all axes by their values, pencil by pencil
    /// between the transforms along axis 2.
    fn divide(&self, transform: &LineTransform, field: &mut [f64], shape: Shape, first: usize) {
        let value = &self.value;
        pencils(field, shape, 2, usize::MAX)
            .par_iter_mut()
            .for_each_init(Work::default, |work, pencil| {
                let along = &value[0][first + pencil.start..];
                transform.apply(TransformDirection::Forward, &mut pencil.rows, work);
                for (row, own) in pencil.rows.iter_mut().zip(&value[2]) {
                    kernel::divide(row, value[1][pencil.other] + own, along, self.scale);
                }
                transform.apply(TransformDirection::Inverse, &mut pencil.rows, work);
            });
    }
}

impl Method for Direct {
    fn name(&self) -> &'static str {
        "direct solver"
    }

    fn solve(&self, own: &mut [f64], _: f64, _: f64) -> Result<usize, Error> {
        self.rows(TransformDirection::Forward, own);
        self.slabs.transposed(own, 1, |field, shape, first| {
            self.lines_once(field, shape, first)
        })?;
        self.rows(TransformDirection::Inverse, own);
        Ok(0)
    }
}

/// Axes that the direct solver treats by products with a dense matrix, axis 0 apart.
pub(crate) fn dense_axes(layout: &Layout) -> Vec<usize> {
    let banded = banded_axis(layout);
    [1, 2]
        .into_iter()
        .filter(|axis| Some(*axis) != banded)
        .collect()
}

/// The axis that is factorised: the longer of the bounded ones, axis 2 if they are about equal.
fn banded_axis(layout: &Layout) -> Option<usize> {
    let [bounded_1, bounded_2] =
        [1, 2].map(|axis| !layout.line[axis].is_periodic() && !layout.line[axis].is_thin());
    match (bounded_1, bounded_2) {
        (true, true) if 3 * layout.shape.n[1] > 4 * layout.shape.n[2] => Some(1),
        (_, true) => Some(2),
        (true, false) => Some(1),
        (false, false) => None,
    }
}
