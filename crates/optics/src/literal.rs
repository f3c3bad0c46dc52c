//! (16) to (19) as they are written: one path, term by term. Read this first; it is also the oracle
//! of the fast walk.
//!
//! ```text
//! field at the telescope -> for each layer: half of it in free space, its screen, the other half -> irradiance -> overlap
//! ```
//!
//! Sums are evaluated as printed (no fast transform), for grids of about 50 points along an axis.
//! The fast form ([`MonteCarlo`](crate::MonteCarlo)) adds fast transforms that serve several
//! ranges, screens with the eddies wider than the grid, many paths, and errors.
//!
//! Check: the fast form, which uses the same field at the telescope and nothing else of this
//! module, agrees to round-off (`fast_walk_is_the_literal_loop_to_round_off`); screens have the
//! structure function of (17) (`literal_screens_have_the_structure_function_of_their_spectrum`).

use crate::air::Spectrum;
use crate::beam::source::aperture_field;
use crate::error::check_length;
use crate::screens::low_frequency::normal_pair;
use crate::{Error, Grid, Misalignment, Telescope};
use rand::Rng;
use rustfft::num_complex::Complex;
use std::f64::consts::PI;

type Field = Vec<Complex<f64>>;

/// One layer of the path.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// Thickness, Delta R' \[m\].
    pub thickness_m: f64,
    /// Phase psi that its air adds, at the points of the grid, `[y][x]` \[rad\].
    pub phase_rad: Vec<f64>,
}

/// A phase screen \[rad\], `[y][x]`, (18), corrected: psi(r) = Re sum of c sqrt(Phi_psi(kappa))
/// dkappa exp(j kappa.r) over the frequencies of the grid, kappa in RADIANS per metre, Phi_psi = 2
/// pi k^2 Cn2 Delta R' Phi_n/Cn2 with Phi_n of (17), c complex normal with unit variance in each
/// part. `cn2_thickness_m13` is Cn2 Delta R' \[m^(1/3)\].
///
/// Eddies wider than the grid are missing:
/// [`ScreenGenerator`](crate::screens::ScreenGenerator) has them.
pub fn phase_screen(
    grid: &Grid,
    spectrum: &dyn Spectrum,
    wavelength_m: f64,
    cn2_thickness_m13: f64,
    rng: &mut impl Rng,
) -> Vec<f64> {
    let k_rad_m = 2.0 * PI / wavelength_m;
    let cell = [
        2.0 * PI / (grid.nx as f64 * grid.dx_m),
        2.0 * PI / (grid.ny as f64 * grid.dy_m),
    ];
    let mut waves = Vec::new();
    for (nx, ny) in frequencies(grid).filter(|f| *f != (0.0, 0.0)) {
        let kappa = [nx * cell[0], ny * cell[1]];
        let density = 2.0
            * PI
            * k_rad_m.powi(2)
            * cn2_thickness_m13
            * spectrum.density_per_cn2(kappa[0].hypot(kappa[1]));
        waves.push((
            kappa,
            normal_pair(rng) * (density * cell[0] * cell[1]).sqrt(),
        ));
    }
    let mut phase_rad = Vec::with_capacity(grid.points());
    for i in 0..grid.points() {
        let x_m = (i % grid.nx) as f64 * grid.dx_m;
        let y_m = (i / grid.nx) as f64 * grid.dy_m;
        let terms = waves
            .iter()
            .map(|(kappa, c)| (c * Complex::cis(kappa[0] * x_m + kappa[1] * y_m)).re);
        phase_rad.push(terms.sum());
    }
    phase_rad
}

/// Irradiance \[1/m^2\] of the telescope's beam at the end of the layers, `[y][x]`, for unit power
/// before truncation: (16), with the screen in the middle of its layer.
///
/// # Errors
/// [`Error`] for an invalid telescope or grid; [`Error::Length`] for a screen that does not have
/// the size of the grid.
pub fn irradiance_per_m2(
    telescope: &Telescope,
    grid: &Grid,
    layers: &[Layer],
) -> Result<Vec<f64>, Error> {
    let telescope = telescope.validated()?;
    let grid = grid.validated()?;
    let mut field = aperture_field(&telescope, &Misalignment::NONE, &grid);
    let mut current_m = 0.0;
    let mut start_m = 0.0;
    for layer in layers {
        check_length("phase_rad", layer.phase_rad.len(), field.len())?;
        let middle_m = start_m + 0.5 * layer.thickness_m;
        field = step(&grid, &field, telescope.wavelength_m, middle_m - current_m);
        for (e, psi) in field.iter_mut().zip(&layer.phase_rad) {
            *e *= Complex::cis(*psi);
        }
        current_m = middle_m;
        start_m += layer.thickness_m;
    }
    let field = step(&grid, &field, telescope.wavelength_m, start_m - current_m);
    Ok(field.iter().map(|e| e.norm_sqr()).collect())
}

/// Efficiency eta_s of one realisation, (19): lambda^2 R^2/A_R times the integral of j_T j_BPLO,
/// the irradiances at `range_m` of the transmitted beam and of the local oscillator. Monostatic:
/// both of one path; bistatic: of two different ones.
pub fn efficiency(
    telescope: &Telescope,
    grid: &Grid,
    range_m: f64,
    sent: &[f64],
    received: &[f64],
) -> f64 {
    let overlap: f64 = sent
        .iter()
        .zip(received)
        .map(|(t, b)| t * b * grid.dx_m * grid.dy_m)
        .sum();
    (telescope.wavelength_m * range_m).powi(2) / telescope.aperture_area_m2() * overlap
}

/// Free space over `distance_m`, (16): F^-1 { exp(-j pi lambda Delta R' f^2) F \[E\] }, f in CYCLES
/// per metre; then the border that takes what would come back from the other side of the grid.
fn step(grid: &Grid, field: &Field, wavelength_m: f64, distance_m: f64) -> Field {
    let mut spectrum = transform(grid, field, -1.0);
    for (value, (nx, ny)) in spectrum.iter_mut().zip(frequencies(grid)) {
        let f2 = (nx / (grid.nx as f64 * grid.dx_m)).powi(2)
            + (ny / (grid.ny as f64 * grid.dy_m)).powi(2);
        *value *= Complex::cis(-PI * wavelength_m * distance_m * f2) / grid.points() as f64;
    }
    let mut field = transform(grid, &spectrum, 1.0);
    for (i, e) in field.iter_mut().enumerate() {
        *e *= border(i % grid.nx, grid.nx) * border(i / grid.nx, grid.ny);
    }
    field
}

/// Factor of the absorbing border at point `i` of `n`.
fn border(i: usize, n: usize) -> f64 {
    (-((2.0 * i as f64 + 1.0 - n as f64).abs() / (0.95 * n as f64)).powi(40)).exp()
}

/// Whole numbers of waves across the grid along x and y of each frequency, in the order
/// of a transform.
fn frequencies(grid: &Grid) -> impl Iterator<Item = (f64, f64)> {
    let Grid { nx, ny, .. } = *grid;
    (0..nx * ny).map(move |i| {
        (
            Grid::frequency_index(nx, i % nx),
            Grid::frequency_index(ny, i / nx),
        )
    })
}

/// Fourier sums along x, then along y, with the factors exp(`sign` 2 pi j m i/n).
fn transform(grid: &Grid, field: &Field, sign: f64) -> Field {
    let Grid { nx, ny, .. } = *grid;
    let mut along_x: Field = vec![Complex::default(); nx * ny];
    for (k, sum) in along_x.iter_mut().enumerate() {
        for x in 0..nx {
            *sum += field[k / nx * nx + x] * wave(sign, k % nx, x, nx);
        }
    }
    let mut along_both: Field = vec![Complex::default(); nx * ny];
    for (k, sum) in along_both.iter_mut().enumerate() {
        for y in 0..ny {
            *sum += along_x[y * nx + k % nx] * wave(sign, k / nx, y, ny);
        }
    }
    along_both
}

/// Wave of frequency `m` at point `i` of `n`, exp(`sign` 2 pi j m i/n).
fn wave(sign: f64, m: usize, i: usize, n: usize) -> Complex<f64> {
    Complex::cis(sign * 2.0 * PI * (m * i % n) as f64 / n as f64)
}
