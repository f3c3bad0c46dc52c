//! Propagation through one layer (16): screen phase, transfer function, absorbing border.
//!
//! E(z + dz) = F^-1 { exp(-j pi lambda dz f^2) F \[E exp(j psi)\] }, f in CYCLES per metre. The
//! transfer function is a product of one factor per axis and is applied in the transposed layout.
//! Check: width and Gouy phase of a Gaussian beam, conserved power, a step forth and back.

use crate::Error;
use crate::error::{check_length, finite, positive, within};
use crate::screens::grid::{Fft2, Grid, Work};
use crate::screens::kernel::{self, Real};
use rustfft::num_complex::Complex;
use std::f64::consts::PI;

/// Transfer function of one distance on one grid.
pub struct Transfer<T: Real> {
    x: Vec<Complex<T>>,
    y: Vec<Complex<T>>,
}

/// Propagates fields on one grid at one wavelength.
pub struct Propagator<T: Real> {
    grid: Grid,
    wavelength_m: f64,
    fft: Fft2<T>,
    window: [Vec<T>; 2],
}

impl<T: Real> Propagator<T> {
    /// Plans the steps on a grid.
    ///
    /// # Errors
    /// As [`Grid::validated`], and for a wavelength that is not positive.
    pub fn new(grid: Grid, wavelength_m: f64) -> Result<Self, Error> {
        let grid = grid.validated()?;
        positive("wavelength_m", wavelength_m)?;
        Ok(Self {
            fft: Fft2::new(&grid),
            window: [grid.nx, grid.ny].map(window),
            grid,
            wavelength_m,
        })
    }

    /// The grid.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Buffers for [`Propagator::step`].
    pub fn work(&self) -> Work<T> {
        self.fft.work()
    }

    /// Number of equal steps into which `distance_m` must be cut so that each is sampled: N
    /// dx^2/lambda at most.
    pub fn pieces(&self, distance_m: f64) -> usize {
        (distance_m.abs() / self.grid.largest_step_m(self.wavelength_m) - 1e-9)
            .ceil()
            .max(1.0) as usize
    }

    /// Transfer function of `distance_m` (negative: backwards).
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a distance beyond N dx^2/lambda: see [`Propagator::pieces`].
    pub fn transfer(&self, distance_m: f64) -> Result<Transfer<T>, Error> {
        finite("distance_m", distance_m)?;
        let one_step = self.pieces(distance_m) == 1;
        within(
            "distance_m",
            distance_m,
            one_step,
            "at most N dx^2 / lambda in one step: cut the step",
        )?;
        let Grid { nx, ny, dx_m, dy_m } = self.grid;
        // The inverse transform of rustfft is not normalised.
        let scale = 1.0 / (nx * ny) as f64;
        Ok(Transfer {
            x: self.transfer_along(nx, dx_m, distance_m, scale),
            y: self.transfer_along(ny, dy_m, distance_m, 1.0),
        })
    }

    /// `scale` exp(-j pi lambda dz f^2) at the `n` frequencies f of one axis.
    fn transfer_along(
        &self,
        n: usize,
        spacing_m: f64,
        distance_m: f64,
        scale: f64,
    ) -> Vec<Complex<T>> {
        let mut factors = Vec::with_capacity(n);
        for i in 0..n {
            let frequency_per_m = Grid::frequency_index(n, i) / (n as f64 * spacing_m);
            let phase_rad =
                -PI * self.wavelength_m * distance_m * frequency_per_m * frequency_per_m;
            factors.push(kernel::narrow(Complex::cis(phase_rad) * scale));
        }
        factors
    }

    /// One step: field `[y][x]` times exp(j scale screen), over the distance of `transfer`, times
    /// the absorbing border. `screen` is the phase screen and its scale. Returns the remaining
    /// power, the integral of |E|^2 over the grid.
    ///
    /// # Errors
    /// [`Error::Length`] if field or screen do not have the size of the grid.
    pub fn step(
        &self,
        field: &mut [Complex<T>],
        screen: Option<(&[T], T)>,
        transfer: &Transfer<T>,
        work: &mut Work<T>,
    ) -> Result<f64, Error> {
        self.transform_with_screen(field, screen, work)?;
        let [power] = self.transform_back([field], [transfer], work);
        Ok(power)
    }

    /// Two steps of different length from the same field: `tap` gets the field at the distance of
    /// `transfers[0]`, `field` becomes that at the distance of `transfers[1]`. A quarter cheaper
    /// than two steps. Returns both powers.
    ///
    /// # Errors
    /// As [`Propagator::step`].
    pub fn step_with_tap(
        &self,
        field: &mut [Complex<T>],
        tap: &mut [Complex<T>],
        screen: Option<(&[T], T)>,
        transfers: [&Transfer<T>; 2],
        work: &mut Work<T>,
    ) -> Result<[f64; 2], Error> {
        check_length("tap", tap.len(), self.grid.points())?;
        self.transform_with_screen(field, screen, work)?;
        Ok(self.transform_back([tap, field], transfers, work))
    }

    /// Multiplies the field with the screen and transforms it along x into the transposed buffer.
    fn transform_with_screen(
        &self,
        field: &[Complex<T>],
        screen: Option<(&[T], T)>,
        work: &mut Work<T>,
    ) -> Result<(), Error> {
        check_length("field", field.len(), self.grid.points())?;
        if let Some((phase, _)) = screen {
            check_length("screen", phase.len(), self.grid.points())?;
        }
        Fft2::transposing(&self.fft.forward_x, work, |row, block| {
            let points = row * self.grid.nx..row * self.grid.nx + block.len();
            block.copy_from_slice(&field[points.clone()]);
            if let Some((phase, scale)) = screen {
                kernel::multiply_cis(block, &phase[points], scale);
            }
        });
        Ok(())
    }

    /// Applies transfer functions, inverse transforms and absorbing border; returns the remaining
    /// powers.
    fn transform_back<const N: usize>(
        &self,
        mut fields: [&mut [Complex<T>]; N],
        transfers: [&Transfer<T>; N],
        work: &mut Work<T>,
    ) -> [f64; N] {
        let Grid { nx, ny, dx_m, dy_m } = self.grid;
        let outs = fields.each_mut().map(|field| &mut **field);
        self.fft.filter_y(work, outs, |which, kx, block| {
            for (i, line) in block.chunks_exact_mut(ny).enumerate() {
                kernel::multiply_scaled(line, transfers[which].x[kx + i], &transfers[which].y);
            }
        });
        fields.map(|field| {
            let mut power = 0.0;
            self.fft.inverse_x(field, &mut work.scratch, |y, block| {
                for (i, line) in block.chunks_exact_mut(nx).enumerate() {
                    power += kernel::absorb(line, self.window[1][y + i], &self.window[0]);
                }
            });
            power * dx_m * dy_m
        })
    }
}

/// Super-Gaussian window: 1 inside, 0.9 at 0.9 of the half width, 0 at the border.
fn window<T: Real>(n: usize) -> Vec<T> {
    let half = 0.5 * n as f64;
    (0..n)
        .map(|i| T::of((-((i as f64 + 0.5 - half).abs() / (0.95 * half)).powi(40)).exp()))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gaussian(grid: &Grid, s: f64) -> Vec<Complex<f64>> {
        let mut field = Vec::new();
        for iy in 0..grid.ny {
            for ix in 0..grid.nx {
                let x = Grid::offset_m(grid.nx, grid.dx_m, ix);
                let y = Grid::offset_m(grid.ny, grid.dy_m, iy);
                field.push(Complex::new((-(x * x + y * y) / (2.0 * s * s)).exp(), 0.0));
            }
        }
        field
    }

    /// Relative error of the field after 600 m against the closed form, phase (Gouy's too) and
    /// width included.
    fn gaussian_error(grid: Grid) -> f64 {
        let lambda = 1.55e-6;
        let s = 0.02;
        let z = 600.0;
        let propagator = Propagator::<f64>::new(grid, lambda).unwrap();
        let mut work = propagator.work();
        let mut field = gaussian(&grid, s);
        let pieces = propagator.pieces(z);
        let transfer = propagator.transfer(z / pieces as f64).unwrap();
        for _ in 0..pieces {
            propagator
                .step(&mut field, None, &transfer, &mut work)
                .unwrap();
        }
        let q = Complex::new(1.0, z / (2.0 * PI / lambda * s * s));
        let mut worst = 0f64;
        for iy in 0..grid.ny {
            for ix in 0..grid.nx {
                let x = Grid::offset_m(grid.nx, grid.dx_m, ix);
                let y = Grid::offset_m(grid.ny, grid.dy_m, iy);
                let exact = (-Complex::from((x * x + y * y) / (2.0 * s * s)) / q).exp() / q;
                worst = worst.max((field[iy * grid.nx + ix] - exact).norm());
            }
        }
        worst
    }

    #[test]
    fn gaussian_beam_keeps_width_and_phase_on_any_grid() {
        for (nx, ny, dx_m, dy_m) in [
            (256, 256, 2e-3, 2e-3),
            (192, 256, 2e-3, 1.5e-3),
            (251, 243, 2e-3, 2e-3),
        ] {
            let error = gaussian_error(Grid { nx, ny, dx_m, dy_m });
            assert!(error < 1e-9, "{nx} {ny}: {error}");
        }
    }

    #[test]
    fn step_forth_and_back_returns_the_field_and_keeps_the_power() {
        let grid = Grid::square(128, 2e-3).unwrap();
        let propagator = Propagator::<f64>::new(grid, 1.55e-6).unwrap();
        let mut work = propagator.work();
        let start = gaussian(&grid, 0.015);
        let power: f64 = start.iter().map(|e| e.norm_sqr()).sum::<f64>() * 4e-6;
        let mut field = start.clone();
        let there = propagator.transfer(150.0).unwrap();
        let left = propagator
            .step(&mut field, None, &there, &mut work)
            .unwrap();
        assert!((left / power - 1.0).abs() < 1e-12);
        let back = propagator.transfer(-150.0).unwrap();
        propagator.step(&mut field, None, &back, &mut work).unwrap();
        for (a, b) in field.iter().zip(&start) {
            assert!((a - b).norm() < 1e-9);
        }
    }

    #[test]
    fn step_beyond_the_sampling_limit_is_refused_and_cut() {
        let grid = Grid::table2();
        let propagator = Propagator::<f32>::new(grid, 1.55e-6).unwrap();
        assert!((grid.largest_step_m(1.55e-6) - 1321.3).abs() < 0.1);
        assert_eq!(
            crate::error::refused(propagator.transfer(3000.0)),
            "distance_m"
        );
        assert_eq!(propagator.pieces(3000.0), 3);
        assert_eq!(propagator.pieces(1321.2), 1);
    }
}
