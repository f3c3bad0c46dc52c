//! Matched filter for vortices: how well a vortex at each of many positions explains the velocities of a scan.
//!
//! Circulations and wind enter the velocities linearly. With x the velocities and s_p what an anticlockwise vortex of unit circulation at position p
//! shows, both whitened and without the part that a wind explains, all that least squares need for any combination of vortices at these positions
//! are the products s_p . x and s_p . s_q. The test for a wake ([`wake_detection`](crate::wake_detection)) combines them to pairs of one circulation,
//! the first guess of a fit to pairs with two.
//!
//! Check: the statistic of the test against a direct least-squares fit; wakes at many positions are guessed near enough for a fit.

mod cells;

use ndarray::{Array1, Array2, Axis};

use crate::parallel::map_indexed;
use crate::vortex_fit::wake::log_wind::log_of_height;
use crate::vortex_fit::wake::pair::Ray;
use crate::vortex_fit::wake::range_kernel::LineScratch;
use crate::vortex_fit::{RangeKernel, Wake, WakeModel};

pub(crate) use cells::{Background, Cells};

/// Beyond this many standard deviations of a gate from a vortex the wind varies little along the gate: the velocity at its middle differs from the
/// mean by a hundredth of what is small there.
const FAR_OVER_GATE: f64 = 10.0;
/// A wind whose length without the part of another one is below this fraction, squared, is the other one.
const DEPENDENT: f64 = 1e-12;
/// Winds that are left out of all patterns.
pub(crate) const WINDS: usize = 3;

/// What unit vortices at given positions show in the cells of a scan.
#[derive(Debug, Clone)]
pub(crate) struct MatchedFilter {
    pub(crate) model: WakeModel,
    kernel: RangeKernel,
    pub(crate) cells: Cells,
    pub(crate) background: Background,
    /// Uniform wind, shear and the logarithmic part, white and orthonormal: cells by one to three.
    pub(crate) wind: Array2<f64>,
    /// What an anticlockwise vortex of unit circulation at each position shows, white, without wind: positions by cells.
    pub(crate) shapes: Array2<f64>,
}

impl MatchedFilter {
    /// The filter for vortices of one core radius at some positions (lateral coordinate, height) \[m\], and the products of what they show with
    /// each other.
    pub(crate) fn new(
        model: &WakeModel,
        kernel: RangeKernel,
        cells: Cells,
        background: Background,
        positions_m: &[(f64, f64)],
        core_radius_m: f64,
    ) -> (Self, Array2<f64>) {
        let columns = map_indexed(
            positions_m.len(),
            LineScratch::default,
            |scratch, position| {
                let wake = Wake::of_unit_vortex(positions_m[position], core_radius_m);
                predicted(&wake, &cells, model, &kernel, scratch)
            },
        );
        let size = (cells.cells.len(), columns.len());
        let mut shapes = Array2::from_shape_fn(size, |(cell, position)| columns[position][cell]);
        background.whiten(&mut shapes);
        let wind = wind_basis(&cells, &background);
        remove(&wind, &mut shapes);
        let products = shapes.t().dot(&shapes);
        let shapes = shapes.t().as_standard_layout().into_owned();
        let filter = Self {
            model: *model,
            kernel,
            cells,
            background,
            wind,
            shapes,
        };
        (filter, products)
    }

    /// Numbers by cell, whitened, without the part that a wind explains.
    pub(crate) fn white(&self, mut numbers: Vec<f64>) -> Array1<f64> {
        self.background.whiten_one(&mut numbers);
        let white = Array1::from_vec(numbers);
        let part = self.wind.t().dot(&white);
        white - self.wind.dot(&part)
    }

    /// What the vortices of a wake show in each cell, whitened, without the part that a wind explains.
    pub(crate) fn white_shape(&self, wake: &Wake) -> Array1<f64> {
        let vortices = Wake::calm(wake.left, wake.right);
        let mut scratch = LineScratch::default();
        self.white(predicted(
            &vortices,
            &self.cells,
            &self.model,
            &self.kernel,
            &mut scratch,
        ))
    }
}

/// Velocity of uniform wind, of shear and of a logarithmic part in a cell, each of size 1.
pub(crate) fn wind_velocities(cells: &Cells, index: usize) -> [f64; WINDS] {
    let cell = &cells.cells[index];
    let cos = cells.elevation_rad[cell.line].cos();
    let height_m = cell.place_m.1;
    [cos, cos * height_m, cos * log_of_height(height_m)]
}

/// What a wake shows in each cell \[m/s\].
fn predicted(
    wake: &Wake,
    cells: &Cells,
    model: &WakeModel,
    kernel: &RangeKernel,
    scratch: &mut LineScratch,
) -> Vec<f64> {
    let ranges = &cells.range_m;
    let mean_offset_m = kernel.mean_offset_m();
    let reach_m = FAR_OVER_GATE * kernel.width_m();
    let [one_m, other_m] =
        [&wake.left, &wake.right].map(|vortex| model.range_and_elevation(vortex.place_m()).0);
    let from = ranges.partition_point(|range_m| *range_m < one_m.min(other_m) - reach_m);
    let to = ranges.partition_point(|range_m| *range_m <= one_m.max(other_m) + reach_m);
    let far = (0..from).chain(to..ranges.len());
    let far_m: Vec<f64> = far
        .clone()
        .map(|gate| ranges[gate] + mean_offset_m)
        .collect();
    let mut far_velocities = [Vec::new()];
    let mut map = Array2::zeros((cells.elevation_rad.len(), ranges.len()));
    for (mut line, &elevation_rad) in map.rows_mut().into_iter().zip(&cells.elevation_rad) {
        let ray = Ray::new(elevation_rad);
        kernel.apply(
            (model, wake, ray),
            &ranges[from..to],
            false,
            scratch,
            |gate, velocity, _| line[from + gate] = velocity,
        );
        model.along(wake, &far_m, ray, &mut far_velocities);
        for (gate, velocity) in far.clone().zip(&far_velocities[0]) {
            line[gate] = *velocity;
        }
    }
    cells
        .cells
        .iter()
        .map(|cell| map[[cell.line, cell.gate]])
        .collect()
}

/// Uniform wind, shear and the logarithmic part, white and orthonormal; fewer directions if the scan does not distinguish them.
fn wind_basis(cells: &Cells, background: &Background) -> Array2<f64> {
    let mut wind = Array2::from_shape_fn((cells.cells.len(), WINDS), |(i, direction)| {
        wind_velocities(cells, i)[direction]
    });
    background.whiten(&mut wind);
    let mut basis = Array2::zeros((cells.cells.len(), 0));
    for direction in wind.columns() {
        let mut direction = direction.to_owned().insert_axis(Axis(1));
        let before = direction.iter().map(|x| x * x).sum::<f64>();
        remove(&basis, &mut direction);
        let after = direction.iter().map(|x| x * x).sum::<f64>();
        if after > DEPENDENT * before {
            direction /= after.sqrt();
            // as many rows as the basis has
            let _ = basis.append(Axis(1), direction.view());
        }
    }
    basis
}

/// Removes the part along an orthonormal basis from columns.
fn remove(basis: &Array2<f64>, columns: &mut Array2<f64>) {
    let part = basis.t().dot(columns);
    ndarray::linalg::general_mat_mul(-1.0, basis, &part, 1.0, columns);
}
