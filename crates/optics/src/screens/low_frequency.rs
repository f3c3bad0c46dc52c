//! Low frequencies of a screen: randomised subharmonics, carried by a polynomial.
//!
//! The frequencies |kx| <= 1.5 dkx, |ky| <= 1.5 dky are not part of the Fourier synthesis. Level by
//! level the central block is cut into 6 x 6 cells of half the spacing, of which the innermost 2 x
//! 2 are cut again (three times finer); the last 2 x 2 stay. Each cell carries one plane wave with
//! a frequency drawn evenly in the cell, so that the expected spectrum is the exact integral (Lane
//! 1992 with the randomisation of Paulson, Wu and Davis 2019). At most 1.5 waves cross the grid: a
//! polynomial of degree 15 in each direction carries their sum to 5e-8.

use crate::air::spectrum::Spectrum;
use crate::quadrature;
use crate::screens::kernel::{LOW_ORDER, Real};
use rand::Rng;
use rustfft::num_complex::Complex;
use std::f64::consts::PI;

/// A cell of the spectral plane: lower corner and size \[rad/m\].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cell {
    pub(crate) corner_rad_m: [f64; 2],
    pub(crate) size_rad_m: [f64; 2],
}

/// Cells, polynomials and points of one grid.
#[derive(Debug)]
pub(crate) struct LowFrequencies<T> {
    pub(crate) cells: Vec<Cell>,
    /// Chebyshev points in index units along x and y.
    point: [[f64; LOW_ORDER]; 2],
    /// Lagrange polynomials of these points, sampled at the grid points along x and y.
    pub(crate) basis: [Vec<Vec<T>>; 2],
    spacing_m: [f64; 2],
    /// Middle of the grid \[m\].
    centre_m: [f64; 2],
}

/// One screen pair's coefficients: complex, because real and imaginary part are two screens.
pub(crate) type LowCoefficients = [[Complex<f64>; LOW_ORDER]; LOW_ORDER];

impl<T: Real> LowFrequencies<T> {
    pub(crate) fn new(size: [usize; 2], spacing_m: [f64; 2], spectrum: &dyn Spectrum) -> Self {
        let delta = [0, 1].map(|a| 2.0 * PI / (size[a] as f64 * spacing_m[a]));
        let point = [0, 1].map(|a| chebyshev(size[a]));
        let basis = [0, 1].map(|a| sampled_basis(&point[a], size[a]));
        let centre_m = [0, 1].map(|a| 0.5 * size[a] as f64 * spacing_m[a]);
        let width = (size[0] as f64 * spacing_m[0]).max(size[1] as f64 * spacing_m[1]);
        Self {
            cells: cells(delta, levels(spectrum, delta, width)),
            point,
            basis,
            spacing_m,
            centre_m,
        }
    }

    /// Draws the waves and sums them at the Chebyshev points, which are the polynomial's
    /// coefficients. `[y]\[x\]`.
    pub(crate) fn draw(
        &self,
        spectrum: &dyn Spectrum,
        shift_sign: f64,
        rng: &mut impl Rng,
    ) -> LowCoefficients {
        let mut sum = [[Complex::default(); LOW_ORDER]; LOW_ORDER];
        for cell in &self.cells {
            let centre = [0, 1].map(|a| cell.corner_rad_m[a] + 0.5 * cell.size_rad_m[a]);
            let shift = [0, 1].map(|a| cell.size_rad_m[a] * (unit(rng) - 0.5));
            let area = cell.size_rad_m[0] * cell.size_rad_m[1];
            let density = 2.0
                * PI
                * spectrum.density_per_cn2((centre[0] + shift[0]).hypot(centre[1] + shift[1]));
            let amplitude = (density * area).sqrt() * normal_pair(rng);
            let kappa = [0, 1].map(|a| centre[a] + shift_sign * shift[a]);
            let wave = [0, 1]
                .map(|a| self.point[a].map(|p| Complex::cis(kappa[a] * (p * self.spacing_m[a]))));
            // Without an outer scale the slowest waves are huge: their value at the centre of the
            // grid is subtracted.
            let piston =
                amplitude * Complex::cis(kappa[0] * self.centre_m[0] + kappa[1] * self.centre_m[1]);
            for (row, y) in sum.iter_mut().zip(wave[1]) {
                let factor = amplitude * y;
                for (value, x) in row.iter_mut().zip(wave[0]) {
                    *value += factor * x - piston;
                }
            }
        }
        sum
    }

    /// Coefficients of the polynomial in x on row `y`.
    pub(crate) fn row(&self, coefficients: &LowCoefficients, y: usize) -> [[T; 2]; LOW_ORDER] {
        let mut sum = [Complex::<f64>::default(); LOW_ORDER];
        for (row, basis) in coefficients.iter().zip(&self.basis[1]) {
            let weight = basis[y].wide();
            for (s, value) in sum.iter_mut().zip(row) {
                *s += value * weight;
            }
        }
        sum.map(|s| [T::of(s.re), T::of(s.im)])
    }
}

/// Evenly distributed on [0, 1).
pub(crate) fn unit(rng: &mut impl Rng) -> f64 {
    (rng.next_u64() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
}

/// Two standard normal numbers (Box and Muller).
pub(crate) fn normal_pair(rng: &mut impl Rng) -> Complex<f64> {
    let radius = (-2.0 * (1.0 - unit(rng)).ln()).sqrt();
    Complex::from_polar(radius, 2.0 * PI * unit(rng))
}

/// Number of levels after which the remaining block adds less than 0.1 % to D over the width of the
/// grid.
fn levels(spectrum: &dyn Spectrum, delta: [f64; 2], width_m: f64) -> usize {
    const DEEPEST: usize = 20;
    let outer = spectrum.outer_wavenumber_rad_m();
    let largest = delta[0].max(delta[1]);
    (1..DEEPEST)
        .find(|&n| {
            let size = largest * 3f64.powi(-(n as i32));
            // kappa^(-11/3): relative contribution of the rest (kappa r)^(1/3); flat below
            // the outer scale.
            size < 0.3 * outer || (size * width_m).cbrt() < 1e-3
        })
        .unwrap_or(DEEPEST)
}

/// Cells of the central block, cut into `levels` levels.
fn cells(delta: [f64; 2], levels: usize) -> Vec<Cell> {
    let mut cells = Vec::new();
    for level in 0..levels {
        let size = delta.map(|d| 0.5 * d * 3f64.powi(-(level as i32)));
        for iy in -3i32..3 {
            for ix in -3i32..3 {
                let inner = (-1..1).contains(&ix) && (-1..1).contains(&iy);
                if !inner || level + 1 == levels {
                    cells.push(Cell {
                        corner_rad_m: [f64::from(ix) * size[0], f64::from(iy) * size[1]],
                        size_rad_m: size,
                    });
                }
            }
        }
    }
    cells
}

/// Chebyshev points on the grid points 0 to `size` - 1.
fn chebyshev(size: usize) -> [f64; LOW_ORDER] {
    let half = 0.5 * (size - 1) as f64;
    std::array::from_fn(|i| half - half * (PI * (i as f64 + 0.5) / LOW_ORDER as f64).cos())
}

/// Lagrange polynomials of the points, sampled at `size` grid points.
fn sampled_basis<T: Real>(point: &[f64; LOW_ORDER], size: usize) -> Vec<Vec<T>> {
    let mut basis = Vec::with_capacity(LOW_ORDER);
    for i in 0..LOW_ORDER {
        let values = (0..size).map(|x| T::of(quadrature::lagrange(point, i, x as f64)));
        basis.push(values.collect());
    }
    basis
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::VonKarman;

    #[test]
    fn cells_tile_the_central_block() {
        for levels in [1, 2, 5] {
            let all = cells([2.0, 3.0], levels);
            let area: f64 = all.iter().map(|c| c.size_rad_m[0] * c.size_rad_m[1]).sum();
            assert!((area - 6.0 * 9.0).abs() < 1e-12, "{levels}: {area}");
        }
    }

    #[test]
    fn polynomial_carries_a_wave_of_the_largest_frequency() {
        let low = LowFrequencies::<f64>::new([64, 48], [1.0, 1.0], &VonKarman::table2());
        let kappa = [1.5 * 2.0 * PI / 64.0, -1.5 * 2.0 * PI / 48.0];
        let mut coefficients = [[Complex::default(); LOW_ORDER]; LOW_ORDER];
        for (row, py) in coefficients.iter_mut().zip(low.point[1]) {
            for (value, px) in row.iter_mut().zip(low.point[0]) {
                *value = Complex::cis(kappa[0] * px + kappa[1] * py);
            }
        }
        for y in 0..48 {
            let row = low.row(&coefficients, y);
            for x in 0..64 {
                let mut sum = Complex::<f64>::default();
                for (c, basis) in row.iter().zip(&low.basis[0]) {
                    sum += Complex::new(c[0], c[1]) * basis[x];
                }
                let exact = Complex::cis(kappa[0] * x as f64 + kappa[1] * y as f64);
                assert!(
                    (sum - exact).norm() < 2e-7,
                    "{x} {y} {}",
                    (sum - exact).norm()
                );
            }
        }
    }
}
