//! The transverse grid and its two-dimensional Fourier transform with one transpose.
//!
//! Fields are row-major, `[y][x]`; spectra and the transposed fields `[x][y]`. A transform of the
//! rows followed by a transposed store leaves the other axis contiguous, so that a forward and an
//! inverse transform cost two transposes together. Check: against the direct sum, for odd and
//! prime sizes too.

use crate::Error;
use crate::error::{positive, within};
use crate::screens::kernel::Real;
use rustfft::Fft;
use rustfft::num_complex::Complex;
use std::sync::Arc;

/// Rows transformed at a time before they are stored transposed: one cache line of f32 numbers.
const ROWS: usize = 8;

/// Rectangular transverse grid; the optical axis is at point (nx/2, ny/2).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Points along x.
    pub nx: usize,
    /// Points along y.
    pub ny: usize,
    /// Spacing along x \[m\].
    pub dx_m: f64,
    /// Spacing along y \[m\].
    pub dy_m: f64,
}

impl Grid {
    /// A square grid of n x n points.
    ///
    /// # Errors
    /// As [`Grid::validated`].
    pub fn square(n: usize, spacing_m: f64) -> Result<Self, Error> {
        Self {
            nx: n,
            ny: n,
            dx_m: spacing_m,
            dy_m: spacing_m,
        }
        .validated()
    }

    /// The chapter's grid, 512 x 512 points of 2 mm.
    pub fn table2() -> Self {
        Self {
            nx: 512,
            ny: 512,
            dx_m: 2e-3,
            dy_m: 2e-3,
        }
    }

    /// The grid itself when every field is allowed.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for fewer than 16 points along an axis, or a spacing that
    /// is not positive.
    pub fn validated(self) -> Result<Self, Error> {
        for (field, n) in [("nx", self.nx), ("ny", self.ny)] {
            within(
                field,
                n as f64,
                (16..=1 << 15).contains(&n),
                "16 to 32768 points",
            )?;
        }
        positive("dx_m", self.dx_m)?;
        positive("dy_m", self.dy_m)?;
        Ok(self)
    }

    /// Number of points.
    pub fn points(&self) -> usize {
        self.nx * self.ny
    }

    /// Larger of the two spacings \[m\].
    pub(crate) fn largest_spacing_m(&self) -> f64 {
        self.dx_m.max(self.dy_m)
    }

    /// Shorter side \[m\].
    pub fn smallest_width_m(&self) -> f64 {
        (self.nx as f64 * self.dx_m).min(self.ny as f64 * self.dy_m)
    }

    /// Largest step for which the transfer function of (16) is sampled: N dx^2 / lambda \[m\].
    pub fn largest_step_m(&self, wavelength_m: f64) -> f64 {
        let x = self.nx as f64 * self.dx_m.powi(2);
        let y = self.ny as f64 * self.dy_m.powi(2);
        x.min(y) / wavelength_m
    }

    /// Distance of point i of n from the axis \[m\].
    pub(crate) fn offset_m(n: usize, spacing_m: f64, i: usize) -> f64 {
        (i as f64 - (n / 2) as f64) * spacing_m
    }

    /// Signed index of frequency i of n.
    pub(crate) fn frequency_index(n: usize, i: usize) -> f64 {
        if i < n.div_ceil(2) {
            i as f64
        } else {
            i as f64 - n as f64
        }
    }
}

/// Buffers of steps or of screens on one grid, reused from one to the next.
pub struct Work<T> {
    /// A field between the transforms along its axes, transposed.
    pub(crate) field: Vec<Complex<T>>,
    /// A block of rows, which stays in the fastest cache.
    block: Vec<Complex<T>>,
    /// The spectrum of a block.
    spectrum: Vec<Complex<T>>,
    /// Scratch space of a transform of one row.
    pub(crate) scratch: Vec<Complex<T>>,
}

/// Fourier transforms along either axis of one grid, planned once.
pub(crate) struct Fft2<T: Real> {
    pub(crate) forward_x: Arc<dyn Fft<T>>,
    pub(crate) forward_y: Arc<dyn Fft<T>>,
    pub(crate) inverse_x: Arc<dyn Fft<T>>,
    pub(crate) inverse_y: Arc<dyn Fft<T>>,
}

impl<T: Real> Fft2<T> {
    pub(crate) fn new(grid: &Grid) -> Self {
        let [[forward_x, inverse_x], [forward_y, inverse_y]] =
            [grid.nx, grid.ny].map(T::transforms);
        Self {
            forward_x,
            forward_y,
            inverse_x,
            inverse_y,
        }
    }

    pub(crate) fn work(&self) -> Work<T> {
        let plans = [
            &self.forward_x,
            &self.forward_y,
            &self.inverse_x,
            &self.inverse_y,
        ];
        let block = plans
            .iter()
            .map(|plan| ROWS * plan.len())
            .max()
            .unwrap_or(0);
        let scratch = plans
            .iter()
            .map(|plan| plan.get_inplace_scratch_len())
            .max()
            .unwrap_or(0);
        Work {
            field: vec![Complex::default(); self.forward_x.len() * self.forward_y.len()],
            block: vec![Complex::default(); block],
            spectrum: vec![Complex::default(); block],
            scratch: vec![Complex::default(); scratch],
        }
    }

    /// Transforms rows of the length of `plan` and stores them transposed in the field of `work`.
    /// `fill` writes each block of rows; its first argument is the index of the first row of the
    /// block.
    pub(crate) fn transposing(
        plan: &Arc<dyn Fft<T>>,
        work: &mut Work<T>,
        mut fill: impl FnMut(usize, &mut [Complex<T>]),
    ) {
        let Work {
            field,
            block,
            scratch,
            ..
        } = work;
        let count = field.len() / plan.len();
        for first in (0..count).step_by(ROWS) {
            let block = &mut block[..ROWS.min(count - first) * plan.len()];
            fill(first, block);
            transform(plan, block, scratch);
            store_transposed(field, plan.len(), first, block);
        }
    }

    /// Filters the field of `work` along y into each of the fields `outs`: rows `[kx][y]` are
    /// transformed forward along y; `filter` changes the spectrum `[kx][ky]` of each block; the
    /// inverse along y is stored transposed, `[y]\[kx\]`. The arguments of `filter` are the index
    /// of the output, the index of the first row of the block, and the block.
    pub(crate) fn filter_y<const N: usize>(
        &self,
        work: &mut Work<T>,
        mut outs: [&mut [Complex<T>]; N],
        mut filter: impl FnMut(usize, usize, &mut [Complex<T>]),
    ) {
        let Work {
            field,
            block,
            spectrum,
            scratch,
        } = work;
        let length = self.forward_y.len();
        for (index, rows) in field.chunks(ROWS * length).enumerate() {
            let first = index * ROWS;
            let points = ..rows.len();
            spectrum[points].copy_from_slice(rows);
            transform(&self.forward_y, &mut spectrum[points], scratch);
            for (which, out) in outs.iter_mut().enumerate() {
                // The last filter needs no copy.
                if which + 1 < N {
                    block[points].copy_from_slice(&spectrum[points]);
                } else {
                    std::mem::swap(block, spectrum);
                }
                let block = &mut block[points];
                filter(which, first, block);
                transform(&self.inverse_y, block, scratch);
                store_transposed(out, length, first, block);
            }
        }
    }

    /// Transforms rows `[y]\[kx\]` by the inverse along x, then calls `after` with the index of the
    /// first row of each block and the block. `scratch` is that of [`Work`].
    pub(crate) fn inverse_x(
        &self,
        field: &mut [Complex<T>],
        scratch: &mut [Complex<T>],
        mut after: impl FnMut(usize, &mut [Complex<T>]),
    ) {
        for (block_index, block) in field.chunks_mut(ROWS * self.inverse_x.len()).enumerate() {
            transform(&self.inverse_x, block, scratch);
            after(block_index * ROWS, block);
        }
    }
}

/// Stores a block of rows of `length` points, of which the first is row `first`, as
/// columns of `out`.
fn store_transposed<T: Real>(
    out: &mut [Complex<T>],
    length: usize,
    first: usize,
    block: &[Complex<T>],
) {
    let count = out.len() / length;
    let height = block.len() / length;
    for (i, column) in out.chunks_exact_mut(count).enumerate() {
        for (b, value) in column[first..first + height].iter_mut().enumerate() {
            *value = block[b * length + i];
        }
    }
}

/// Transforms the rows of a block with a buffer that is large enough for all transforms.
fn transform<T: Real>(plan: &Arc<dyn Fft<T>>, block: &mut [Complex<T>], inner: &mut [Complex<T>]) {
    plan.process_with_scratch(block, &mut inner[..plan.get_inplace_scratch_len()]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_dimensional_transform_is_the_direct_sum_for_odd_sizes() {
        let grid = Grid {
            nx: 17,
            ny: 23,
            dx_m: 1.0,
            dy_m: 1.0,
        };
        let fft = Fft2::<f64>::new(&grid);
        let mut work = fft.work();
        let field: Vec<Complex<f64>> = (0..grid.points())
            .map(|i| Complex::new((i as f64 * 0.7).sin(), (i as f64 * 1.3).cos()))
            .collect();
        Fft2::transposing(&fft.forward_x, &mut work, |first, block| {
            block.copy_from_slice(&field[first * 17..first * 17 + block.len()]);
        });
        let mut found = Complex::default();
        let kx = 5usize;
        let ky = 3usize;
        let mut out = field.clone();
        fft.filter_y(&mut work, [&mut out[..]], |_, first, block| {
            if (first..first + block.len() / 23).contains(&kx) {
                found = block[(kx - first) * 23 + ky];
            }
        });
        let mut exact = Complex::default();
        for y in 0..23 {
            for x in 0..17 {
                let phase = -2.0
                    * std::f64::consts::PI
                    * (kx as f64 * x as f64 / 17.0 + ky as f64 * y as f64 / 23.0);
                exact += field[y * 17 + x] * Complex::from_polar(1.0, phase);
            }
        }
        assert!((found - exact).norm() < 1e-11);
        fft.inverse_x(&mut out, &mut work.scratch, |_, _| {});
        for (o, f) in out.iter().zip(&field) {
            assert!((o / 391.0 - f).norm() < 1e-13);
        }
    }

    #[test]
    fn grids_too_small_or_without_spacing_are_refused() {
        for (bad, field) in [
            (Grid::square(1, 1e-3), "nx"),
            (Grid::square(512, 0.0), "dx_m"),
            (Grid::square(512, f64::NAN), "dx_m"),
        ] {
            assert_eq!(crate::error::refused(bad), field);
        }
    }
}
