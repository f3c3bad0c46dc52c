//! Phase screens: Fourier synthesis with a random frequency shift and randomised subharmonics.
//!
//! psi(r) = Re sum over kappa of c sqrt(Phi_psi(kappa)) dkappa exp(j kappa.r), (18) corrected:
//! Phi_psi = 2 pi k^2 dz Phi_n, c complex normal with unit variance in each part; the imaginary
//! part is a second screen. All frequencies of a synthesis are shifted by the same random part s of
//! a cell, kappa = kappa_m + s (Paulson, Wu and Davis 2019), so that the expected spectrum has no
//! gaps, and the amplitude is that of the SHIFTED frequency. Frequencies beyond Nyquist are folded
//! back where the spectrum has an inner scale that the grid resolves: D is then right at every
//! separation between grid points.
//!
//! Check: [`ScreenGenerator::expected_structure_m53`] is the exact ensemble mean of the scheme,
//! from its own discrete spectrum; it stays within 0.1 % of quadrature of the continuous spectrum.

use crate::Error;
use crate::air::spectrum::Spectrum;
use crate::error::check_length;
use crate::quadrature::GaussLegendre;
use crate::screens::grid::{Fft2, Grid, Work};
use crate::screens::kernel::{self, Real};
use crate::screens::low_frequency::{LowFrequencies, unit};
use rand::Rng;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;
use rustfft::num_complex::Complex;
use std::f64::consts::PI;
use std::sync::Arc;

/// Frequencies of up to this index take their amplitude at the shifted frequency; beyond, the
/// mean over the cell.
const EXACT: usize = 24;

/// Generator of phase screens for one grid and spectrum. Screens have unit k^2 Cn2 dz: they are
/// multiplied by sqrt(k^2 Cn2 dz) of the layer.
pub struct ScreenGenerator<T: Real> {
    grid: Grid,
    spectrum: Arc<dyn Spectrum>,
    fft: Fft2<T>,
    /// Amplitude of each frequency, `[kx][ky]`.
    amplitude: Vec<T>,
    /// Folded part of the spectrum per cell for the exact frequencies, `[kx][ky]`.
    folded: Vec<f64>,
    low: LowFrequencies<T>,
    delta_rad_m: [f64; 2],
    exact: [usize; 2],
    /// Sign of the phase of the frequency shift: 1; a test sets it to -1 and verifies that the
    /// bistatic test detects it.
    pub(crate) shift_sign: f64,
}

/// Random stream of one screen: xoshiro256++ seeded by a hash of the run's seed, the realisation
/// and the screen.
pub fn stream(seed: u64, realisation: u64, screen: u64) -> Xoshiro256PlusPlus {
    let mut state = seed;
    for word in [realisation, screen] {
        // One round of splitmix64 for each word.
        state = state
            .wrapping_add(0x9e37_79b9_7f4a_7c15)
            .wrapping_add(word.wrapping_mul(0xd1b5_4a32_d192_ed03));
        state = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        state = (state ^ (state >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        state ^= state >> 31;
    }
    Xoshiro256PlusPlus::seed_from_u64(state)
}

impl<T: Real> ScreenGenerator<T> {
    /// Plans the synthesis for a grid and a spectrum.
    ///
    /// # Errors
    /// As [`Grid::validated`].
    pub fn new(grid: Grid, spectrum: Arc<dyn Spectrum>) -> Result<Self, Error> {
        let grid = grid.validated()?;
        let delta_rad_m = [
            2.0 * PI / (grid.nx as f64 * grid.dx_m),
            2.0 * PI / (grid.ny as f64 * grid.dy_m),
        ];
        let exact = [grid.nx, grid.ny].map(|n| EXACT.min((n - 1) / 2));
        let low = LowFrequencies::new([grid.nx, grid.ny], [grid.dx_m, grid.dy_m], &*spectrum);
        let mut generator = Self {
            fft: Fft2::new(&grid),
            amplitude: vec![T::zero(); grid.points()],
            folded: vec![0.0; grid.points()],
            grid,
            spectrum,
            low,
            delta_rad_m,
            exact,
            shift_sign: 1.0,
        };
        generator.plan_amplitudes();
        Ok(generator)
    }

    /// Whether frequencies beyond Nyquist are folded back: the inner scale is at least 2 grid
    /// spacings. Otherwise the spectrum is cut at Nyquist and the expected structure function is
    /// too small at small separations.
    pub fn folds(&self) -> bool {
        // kappa_m = 5.92/l0 for (17); kappa_m <= 2.96/dx is l0 >= 2 dx.
        self.spectrum.inner_wavenumber_rad_m() * self.grid.largest_spacing_m() <= 2.97
    }

    /// Buffers for [`ScreenGenerator::fill_pair`].
    pub fn work(&self) -> Work<T> {
        self.fft.work()
    }

    /// Phi_psi of the spectrum at a frequency, for unit k^2 Cn2 dz \[rad^2 m^2\].
    fn phase_density(&self, kx: f64, ky: f64) -> f64 {
        2.0 * PI * self.spectrum.density_per_cn2(kx.hypot(ky))
    }

    /// Part of the spectrum that folds onto this frequency from beyond Nyquist.
    fn folded_density(&self, kx: f64, ky: f64) -> f64 {
        if !self.folds() {
            return 0.0;
        }
        let px = 2.0 * PI / self.grid.dx_m;
        let py = 2.0 * PI / self.grid.dy_m;
        let mut sum = 0.0;
        for i in -1..=1 {
            for j in -1..=1 {
                if i != 0 || j != 0 {
                    sum += self.phase_density(kx + f64::from(i) * px, ky + f64::from(j) * py);
                }
            }
        }
        sum
    }

    /// Computes `amplitude` and `folded`.
    fn plan_amplitudes(&mut self) {
        let [nx, ny] = [self.grid.nx, self.grid.ny];
        let [dx, dy] = self.delta_rad_m;
        let area = dx * dy;
        let rule = GaussLegendre::new(2);
        for ix in 0..nx {
            let mx = Grid::frequency_index(nx, ix);
            for iy in 0..ny {
                let my = Grid::frequency_index(ny, iy);
                let at = ix * ny + iy;
                // The spectrum depends on the absolute values alone: one quadrant is enough.
                let jx = ix.min(nx - ix);
                let jy = iy.min(ny - iy);
                if jx != ix || jy != iy {
                    self.amplitude[at] = self.amplitude[jx * ny + jy];
                    self.folded[at] = self.folded[jx * ny + jy];
                    continue;
                }
                self.folded[at] = self.folded_density(mx * dx, my * dy);
                if mx.abs() <= 1.0 && my.abs() <= 1.0 {
                    continue;
                }
                let mut mean = 0.0;
                for (kx, wx) in rule.mapped((mx - 0.5) * dx, (mx + 0.5) * dx) {
                    for (ky, wy) in rule.mapped((my - 0.5) * dy, (my + 0.5) * dy) {
                        mean += wx * wy * self.phase_density(kx, ky);
                    }
                }
                self.amplitude[at] = T::of((mean + self.folded[at] * area).sqrt());
            }
        }
    }

    /// Amplitudes of row `ix`, those of small frequencies taken at the shifted frequency.
    fn shifted_row(&self, ix: usize, shift: [f64; 2], row: &mut [T]) {
        let ny = self.grid.ny;
        row.copy_from_slice(&self.amplitude[ix * ny..(ix + 1) * ny]);
        let mx = Grid::frequency_index(self.grid.nx, ix);
        if mx.abs() > self.exact[0] as f64 {
            return;
        }
        let [dx, dy] = self.delta_rad_m;
        let kx = (mx + shift[0]) * dx;
        let last = self.exact[1];
        for iy in (0..=last).chain(ny - last..ny) {
            let my = Grid::frequency_index(ny, iy);
            if mx.abs() > 1.0 || my.abs() > 1.0 {
                let density =
                    self.phase_density(kx, (my + shift[1]) * dy) + self.folded[ix * ny + iy];
                row[iy] = T::of((density * dx * dy).sqrt());
            }
        }
    }

    /// Draws two uncorrelated screens (unit k^2 Cn2 dz, `[y][x]`, rad) from one synthesis.
    ///
    /// They share the random shift of the frequencies: given that, they are independent.
    ///
    /// # Errors
    /// [`Error::Length`] if a screen does not have the size of the grid.
    pub fn fill_pair(
        &self,
        rng: &mut impl Rng,
        work: &mut Work<T>,
        first: &mut [T],
        second: &mut [T],
    ) -> Result<(), Error> {
        check_length("first", first.len(), self.grid.points())?;
        check_length("second", second.len(), self.grid.points())?;
        let [nx, ny] = [self.grid.nx, self.grid.ny];
        let shift = [unit(rng) - 0.5, unit(rng) - 0.5];
        let low = self.low.draw(&*self.spectrum, self.shift_sign, rng);
        let mut radius = vec![0; ny];
        let mut angle = vec![0; ny];
        let mut amplitude = vec![T::zero(); ny];
        Fft2::transposing(&self.fft.inverse_y, work, |ix, block| {
            for (i, line) in block.chunks_exact_mut(ny).enumerate() {
                for (u, v) in radius.iter_mut().zip(&mut angle) {
                    let word = rng.next_u64();
                    *u = (word >> 32) as u32;
                    *v = word as u32;
                }
                self.shifted_row(ix + i, shift, &mut amplitude);
                kernel::normals(&radius, &angle, &amplitude, line);
            }
        });
        let ramp: Vec<Complex<T>> = (0..nx).map(|x| self.shift_phase(shift[0], nx, x)).collect();
        let Work { field, scratch, .. } = work;
        self.fft.inverse_x(field, scratch, |y, block| {
            for (i, line) in block.chunks_exact(nx).enumerate() {
                let y = y + i;
                let factor = self.shift_phase(shift[1], ny, y);
                let coefficients = self.low.row(&low, y);
                let span = y * nx..(y + 1) * nx;
                kernel::finish_screen(
                    line,
                    factor,
                    &ramp,
                    &self.low.basis[0],
                    &coefficients,
                    &mut first[span.clone()],
                    &mut second[span],
                );
            }
        });
        Ok(())
    }

    /// Phase factor at point `i` of `n` that a shift of all frequencies by `shift` cells causes.
    fn shift_phase(&self, shift: f64, n: usize, i: usize) -> Complex<T> {
        kernel::narrow(Complex::cis(
            self.shift_sign * 2.0 * PI * shift * i as f64 / n as f64,
        ))
    }

    /// Expected structure function of these screens at a separation of whole grid points (x, y),
    /// per unit k^2 Cn2 dz [m^(5/3)]: the exact ensemble mean over coefficients and frequencies, no
    /// random numbers.
    pub fn expected_structure_m53(&self, steps_x: usize, steps_y: usize) -> f64 {
        let [nx, ny] = [self.grid.nx, self.grid.ny];
        let [dx, dy] = self.delta_rad_m;
        let r = [
            steps_x as f64 * self.grid.dx_m,
            steps_y as f64 * self.grid.dy_m,
        ];
        // Mean of a cosine over a shift spread evenly over one cell.
        let blur = sinc(0.5 * dx * r[0]) * sinc(0.5 * dy * r[1]);
        let rule = GaussLegendre::new(5);
        let mut sum = 0.0;
        for ix in 0..nx {
            let mx = Grid::frequency_index(nx, ix);
            for iy in 0..ny {
                let my = Grid::frequency_index(ny, iy);
                let at = ix * ny + iy;
                let flat = 1.0 - (mx * dx * r[0] + my * dy * r[1]).cos() * blur;
                if mx.abs() <= 1.0 && my.abs() <= 1.0 {
                    continue;
                }
                if mx.abs() <= self.exact[0] as f64 && my.abs() <= self.exact[1] as f64 {
                    let corner = [(mx - 0.5) * dx, (my - 0.5) * dy];
                    sum += self.cell_integral(&rule, corner, [dx, dy], r)
                        + self.folded[at] * dx * dy * flat;
                } else {
                    sum += self.amplitude[at].wide().powi(2) * flat;
                }
            }
        }
        for cell in &self.low.cells {
            // The last cells touch the origin, where the spectrum may be singular:
            // finer towards it.
            sum += self.graded_integral(&rule, cell.corner_rad_m, cell.size_rad_m, r);
        }
        2.0 * sum
    }

    /// Fraction of the structure function that these screens miss at one grid spacing along x. It
    /// depends little on the width of the grid.
    ///
    /// # Errors
    /// As [`structure_function_m53`](crate::air::structure::structure_function_m53).
    pub fn missing_at_one_spacing(&self) -> Result<f64, Error> {
        let exact = crate::air::structure::structure_function_m53(&*self.spectrum, self.grid.dx_m)?;
        Ok(1.0 - self.expected_structure_m53(1, 0) / exact)
    }

    /// Integral of Phi_psi (1 - cos(kappa.r)) over a cell, without cancellation.
    fn cell_integral(
        &self,
        rule: &GaussLegendre,
        corner: [f64; 2],
        size: [f64; 2],
        r: [f64; 2],
    ) -> f64 {
        let mut sum = 0.0;
        for (kx, wx) in rule.mapped(corner[0], corner[0] + size[0]) {
            for (ky, wy) in rule.mapped(corner[1], corner[1] + size[1]) {
                let half = 0.5 * (kx * r[0] + ky * r[1]);
                sum += wx * wy * self.phase_density(kx, ky) * 2.0 * half.sin().powi(2);
            }
        }
        sum
    }

    /// As `cell_integral`, with cells that touch the origin halved towards it.
    fn graded_integral(
        &self,
        rule: &GaussLegendre,
        corner: [f64; 2],
        size: [f64; 2],
        r: [f64; 2],
    ) -> f64 {
        let touches =
            [0, 1].map(|a| corner[a] * (corner[a] + size[a]) <= 1e-12 * size[a] * size[a]);
        if touches != [true, true] {
            return self.cell_integral(rule, corner, size, r);
        }
        // Halve towards the origin: three quarters are smooth, the last one is cut again.
        let mut corner = corner;
        let mut size = size;
        let mut sum = 0.0;
        for _ in 0..30 {
            let half = size.map(|s| 0.5 * s);
            let mut next = corner;
            for i in 0..4 {
                let sub = [
                    corner[0] + half[0] * f64::from(i & 1),
                    corner[1] + half[1] * f64::from(i >> 1),
                ];
                let at_origin =
                    [0, 1].map(|a| sub[a].abs().min((sub[a] + half[a]).abs()) < 1e-9 * half[a]);
                if at_origin == [true, true] {
                    next = sub;
                } else {
                    sum += self.cell_integral(rule, sub, half, r);
                }
            }
            corner = next;
            size = half;
        }
        sum + self.cell_integral(rule, corner, size, r)
    }
}

/// sin(x)/x.
fn sinc(x: f64) -> f64 {
    if x.abs() < 1e-8 { 1.0 } else { x.sin() / x }
}
