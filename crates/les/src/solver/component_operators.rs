//! The momentum equation of one velocity component, row by row: convection, viscosity, pressure
//! gradient.
//!
//! Convection of component `a` along direction `b` is `(f_a m_b)^-1 sum_n G_n S^n u_a`, where `G_n`
//! is the flux through face `n` of `b`, weighted with the mass of the cells along `a` and brought
//! to the faces of `a` (`b = a`: the flux itself over `f_a`). Weighting before interpolating is
//! what conserves mass, momentum and energy on a stretched mesh (Vasilyev 2000).
//!
//! Check: energy and momentum made by the discrete convection, order on stretched meshes (tests of
//! `flow`).

use super::layout::{Layout, Shape};
use super::operators_1d::DIFFERENCE;
use super::row_operator::RowOperator;
use super::rows::HALO;
use super::transport::{Stencil, Transport};
use multiversion::multiversion;

/// The operators of one component.
#[derive(Debug, Clone)]
pub(crate) struct ComponentOperators {
    /// Memory axis of the component.
    pub(super) axis: usize,
    pub(super) shape: Shape,
    pub(super) periodic: [bool; 3],
    pub(super) thin: [bool; 3],
    /// Weighted flux along `axis` at its faces from the cells.
    pub(super) flux_mean: RowOperator,
    /// Mass of the cells along `axis` where all are equal and the direction is periodic.
    pub(super) equal_mass: Option<f64>,
    pub(super) transport: [Transport; 3],
    /// `1/m_b` at the cells of each axis.
    pub(super) inverse_cell_mass: [Vec<f64>; 3],
    /// `1/f` at the faces of `axis`, zero at a wall.
    pub(super) inverse_face_mass: Vec<f64>,
    /// `1/h` at the faces of `axis` \[1/m\]; zero where the flow cannot vary.
    pub(super) inverse_metric: Vec<f64>,
    /// Mass of the control volume of this component along each axis.
    pub(super) mass: [Vec<f64>; 3],
    /// Laplacian along each axis, and the source from moving walls; none along an axis of equal
    /// periodic cells.
    pub(super) laplacian: [RowOperator; 3],
    wall_source: [Vec<f64>; 3],
    gradient: RowOperator,
}

/// The staggered difference of fourth order, twice: coefficients of the points at distance 1, 2, 3.
const SECOND_DIFFERENCE: [f64; 3] = [
    DIFFERENCE[2] * DIFFERENCE[2] - 2.0 * DIFFERENCE[2] * DIFFERENCE[3],
    2.0 * DIFFERENCE[2] * DIFFERENCE[3],
    DIFFERENCE[3] * DIFFERENCE[3],
];

/// Rows that a task reuses.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    pub(super) padded: [Vec<f64>; 2],
    pub(super) flux: [Vec<f64>; 2],
    pub(super) fluxes: FluxCache,
    pub(crate) convection: Vec<f64>,
    pub(crate) explicit: Vec<f64>,
    pub(crate) implicit: Vec<f64>,
    pub(crate) model: Vec<f64>,
    pub(crate) pressure: Vec<f64>,
}

impl Scratch {
    pub(crate) fn new(n: usize) -> Self {
        Self {
            padded: std::array::from_fn(|_| vec![0.0; n + 2 * HALO]),
            flux: std::array::from_fn(|_| vec![0.0; n]),
            fluxes: FluxCache::default(),
            convection: vec![0.0; n],
            explicit: vec![0.0; n],
            implicit: vec![0.0; n],
            model: vec![0.0; n],
            pressure: vec![0.0; n],
        }
    }
}

impl ComponentOperators {
    pub(crate) fn new(layout: &Layout, axis: usize) -> Self {
        let line = &layout.line;
        let faces = layout.shape.n[axis];
        let own = &line[axis];
        let mut inverse_face_mass = inverses(&own.face_mass_m[..faces]);
        inverse_face_mass[..own.first_face()].fill(0.0);
        let inverse_metric = if own.is_thin() {
            vec![0.0]
        } else {
            inverses(&own.face_metric_m[..faces])
        };
        Self {
            axis,
            shape: layout.shape,
            periodic: std::array::from_fn(|b| line[b].is_periodic()),
            thin: std::array::from_fn(|b| line[b].is_thin()),
            flux_mean: RowOperator::new(layout, axis, own.flux_mean()),
            equal_mass: own.is_fourier().then(|| own.cell_mass_m[0]),
            transport: std::array::from_fn(|b| transport_along(layout, axis, b)),
            inverse_cell_mass: std::array::from_fn(|b| inverses(&line[b].cell_mass_m)),
            inverse_face_mass,
            inverse_metric,
            mass: std::array::from_fn(|b| {
                if b == axis {
                    own.face_mass_m[..faces].to_vec()
                } else {
                    line[b].cell_mass_m.clone()
                }
            }),
            laplacian: std::array::from_fn(|b| laplacian_along(layout, axis, b)),
            wall_source: std::array::from_fn(|b| wall_source_along(layout, axis, b)),
            gradient: RowOperator::new(layout, axis, own.gradient()),
        }
    }

    /// Mass of the control volumes of row `(j, k)` as a factor common to the row and the factors
    /// along axis 0.
    pub(crate) fn row_mass(&self, j: usize, k: usize) -> (f64, &[f64]) {
        (self.mass[1][j] * self.mass[2][k], &self.mass[0])
    }

    /// Whether row `(j, k)` lies on a wall, where this component is zero.
    pub(crate) fn is_wall_row(&self, j: usize, k: usize) -> bool {
        match self.axis {
            1 => self.inverse_face_mass[j] == 0.0,
            2 => self.inverse_face_mass[k] == 0.0,
            _ => false,
        }
    }

    /// A velocity along axis 0 is zero at the wall that the row begins with.
    pub(crate) fn hold_at_wall(&self, row: &mut [f64]) {
        if self.axis == 0 && self.inverse_face_mass[0] == 0.0 {
            row[0] = 0.0;
        }
    }
}

fn inverses(values: &[f64]) -> Vec<f64> {
    values.iter().map(|value| 1.0 / value).collect()
}

/// Transport of the component along `component` by the fluxes along `axis`.
fn transport_along(layout: &Layout, component: usize, axis: usize) -> Transport {
    let stencil = Stencil::for_lines(&layout.line);
    if axis == component {
        layout.line[axis].transport_of_faces(stencil)
    } else {
        layout.line[axis].transport_of_cells(stencil)
    }
}

/// Laplacian of the component along `component` along `axis`.
fn laplacian_along(layout: &Layout, component: usize, axis: usize) -> RowOperator {
    let line = &layout.line[axis];
    let rows = if axis == component {
        line.laplacian_at_faces()
    } else {
        line.laplacian_at_cells().0
    };
    let mut laplacian = RowOperator::new(layout, axis, rows);
    if line.is_fourier() {
        let per_h2 = line.cell_mass_m[0].powi(-2);
        laplacian.even = Some(SECOND_DIFFERENCE.map(|c| c * per_h2));
    }
    laplacian
}

/// What moving walls add to this Laplacian; empty along an axis of equal periodic cells.
fn wall_source_along(layout: &Layout, component: usize, axis: usize) -> Vec<f64> {
    let line = &layout.line[axis];
    if line.is_fourier() {
        Vec::new()
    } else if axis == component {
        vec![0.0; layout.shape.n[axis]]
    } else {
        layout.wall_source(axis, component, &line.laplacian_at_cells().1)
    }
}

/// Adds the Laplacian of the component along `axis` to the row `at` \[1/(m s)\].
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn add_laplacian_row(
    ops: &ComponentOperators,
    field: &[f64],
    axis: usize,
    at: [usize; 2],
    out: &mut [f64],
    padded: &mut [f64],
) {
    ops.laplacian[axis].add(out, field, at, padded);
    let sources = &ops.wall_source[axis];
    if axis == 0 {
        for (out, source) in out.iter_mut().zip(sources) {
            *out += source;
        }
    } else if let Some(source) = sources.get(at[axis - 1]).filter(|source| **source != 0.0) {
        for out in out.iter_mut() {
            *out += source;
        }
    }
}

/// Gradient of a field at the centres for row `(j, k)` of the component.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn gradient_row(
    ops: &ComponentOperators,
    field: &[f64],
    j: usize,
    k: usize,
    out: &mut [f64],
    padded: &mut [f64],
) {
    out.fill(0.0);
    ops.gradient.add(out, field, [j, k], padded);
}

impl Scratch {
    /// Laplacians of one row: those along the implicit axes into `self.implicit`, the others into
    /// `self.explicit`.
    pub(crate) fn laplacians(
        &mut self,
        ops: &ComponentOperators,
        field: &[f64],
        implicit: [bool; 3],
        j: usize,
        k: usize,
    ) {
        self.implicit.fill(0.0);
        self.explicit.fill(0.0);
        for axis in 0..3 {
            if !ops.thin[axis] {
                let out = if implicit[axis] {
                    &mut self.implicit
                } else {
                    &mut self.explicit
                };
                add_laplacian_row(ops, field, axis, [j, k], out, &mut self.padded[0]);
            }
        }
    }

    /// Gradient of one row into `self.pressure`.
    pub(crate) fn gradient(&mut self, ops: &ComponentOperators, field: &[f64], j: usize, k: usize) {
        gradient_row(ops, field, j, k, &mut self.pressure, &mut self.padded[0]);
    }
}

/// Fluxes along one axis that act on one row.
pub(super) const SLOTS: usize = 4;

/// Fluxes along the axes 1 and 2 of one component of one velocity field: each acts on four rows and
/// is computed once, as long as rows are asked for in the order of memory.
#[derive(Debug, Default)]
pub(super) struct FluxCache {
    /// For each axis the last four rows of each place across it.
    pub(super) values: [Vec<f64>; 2],
    /// Offset in the field of each row that is cached, `usize::MAX` of none.
    pub(super) offsets: [Vec<usize>; 2],
}

impl FluxCache {
    /// Room on a mesh of `n` cells.
    #[inline(always)]
    pub(super) fn fit(&mut self, n: [usize; 3]) {
        for (axis, places) in [SLOTS, SLOTS * n[1]].into_iter().enumerate() {
            self.offsets[axis].resize(places, usize::MAX);
            self.values[axis].resize(places * n[0], 0.0);
        }
    }
}
