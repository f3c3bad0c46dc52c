//! What the velocities of a map tell of a wake at best, to first order in the fluctuations of its spectra.
//!
//! A velocity v of a map is the highest place of the mean spectrum P of a region, so near its expectation w it is `v - w = -P'(w) / P''(w)`, the latter in the mean.
//! P' is quadratic in the baseband z of the lines of the region, z^H A z with A_pq = j k T (p - q) W_pq exp(j k w T (p - q)) conjugated,
//! k = 4 pi / lambda, W the tapers. Lines are independent and Gaussian with the covariance R, thus
//!
//! ```text
//! cov(v_a, v_b) = sum over lines of tr(A_a R A_b R) / (P_a'' P_b''),    dv/d theta = -(dP'/d theta) / P''
//! ```
//!
//! with shares of regions in A. The information on the wake is J^T C^-1 J (generalised least squares; no linear estimate knows more),
//! with a diagonal of C alone for weights the sandwich. The logarithm of P''/P at the same place is the width of the spectrum, taken
//! along on request. Real samples are seen as complex ones of the band at a quarter of their rate: what changes is some tenths of a
//! per cent. Check: one window of uniform wind against its Cramer-Rao bound; lines far apart.

use super::banded::Banded;
use fixtures::WINDOW;
use fixtures::failure::Failure;
use ndarray::{Array1, Array2, ArrayView2};
use num_complex::Complex;
use rayon::prelude::*;
use std::f64::consts::{PI, SQRT_2};
use wakescope_estimate::Sampling;
use wakescope_estimate::bound::{Noise, WindowModel};
use wakescope_estimate::estimators::likelihood_tapers;
use wakescope_estimate::vortex_fit::{PARAMETERS, ScanSetup, Wake};
use wakescope_estimate::window::SPEED_OF_LIGHT_M_S;

type C64 = Complex<f64>;

/// Thickness of the layers of air \[m\]: the rule of the signal model at 500 m^2/s and cores of 2.35 m.
const LAYER_M: f64 = 0.25;
/// Lines whose forms are held at a time.
const AT_ONCE: usize = 4;
/// Velocities are rounded: part of their variance that is independent.
const ROUNDING: f64 = 1e-4;
/// Times its variance, a number tells nothing.
const USELESS: f64 = 1e12;
/// Places of the spectrum among which the highest is sought.
const PLACES: usize = 512;

/// What is measured in each cell of a map: its velocity, and the logarithm of the relative curvature of its spectrum.
const KINDS: usize = 2;

/// How a map is made.
pub(super) struct MapSetting<'a> {
    /// Wake, lines, and real samples as they are recorded.
    pub(super) scan: &'a ScanSetup,
    /// Half-width of |f|^2 at 1/e \[s\].
    pub(super) sigma_s: f64,
    pub(super) snr: f64,
    /// Of the regions \[m\].
    pub(super) radius_m: f64,
    /// A multiple of 4 samples apart.
    pub(super) range_m: &'a [f64],
}

/// First-order slopes and covariance of a map.
pub(super) struct MapBound {
    /// By cell and kind: lines, then gates, then kinds.
    slopes: Vec<[f64; PARAMETERS]>,
    covariance: Banded,
}

/// The grid of the complex samples of a map.
struct Grid<'a> {
    of: &'a MapSetting<'a>,
    period_s: f64,
    first_s: f64,
    window: usize,
    samples: usize,
    /// Samples from one gate to the next.
    step: usize,
    /// Tapers summed, \[window, window\].
    tapers: Array2<f64>,
    /// Covariance of the noise by lag.
    noise: Vec<f64>,
}

/// Signals of one line.
struct Line {
    /// Lower factor of the covariance of its samples.
    factor: Array2<C64>,
    /// Correlogram of each gate and its derivatives: \[gate\]\[number\]\[lag\].
    lags: Vec<Vec<Vec<C64>>>,
}

/// One cell in the mean.
struct Cell {
    velocity_m_s: f64,
    level: f64,
    curvature: f64,
    slopes: [[f64; PARAMETERS]; KINDS],
    /// Lines of the region with their shares.
    shares: Vec<(usize, f64)>,
}

impl MapBound {
    pub(super) fn new(setting: &MapSetting<'_>, wake: &Wake) -> Result<Self, Failure> {
        let grid = Grid::new(setting)?;
        let lines = setting
            .scan
            .elevation_rad
            .par_iter()
            .map(|&elevation_rad| Line::new(&grid, wake, elevation_rad));
        let lines: Vec<Line> = lines.collect::<Option<_>>().ok_or_else(|| {
            Failure::new("the covariance of a line is not positive definite".to_owned())
        })?;
        let gates = setting.range_m.len();
        let cells: Vec<Cell> = (0..lines.len() * gates)
            .map(|i| Cell::new(&grid, &lines, (i / gates, i % gates)))
            .collect();
        let away = |(i, cell): (usize, &Cell)| {
            cell.shares
                .iter()
                .map(move |(line, _)| line.abs_diff(i / gates))
                .max()
        };
        let reach = cells.iter().enumerate().filter_map(away);
        // two regions share a line if they are up to twice their reach apart
        let lines_apart = 2 * reach.max().unwrap_or(0);
        let order = cells.len() * KINDS;
        let mut covariance = Banded::zeros(order, (lines_apart + 1) * gates * KINDS - 1);
        let numbers: Vec<usize> = (0..lines.len()).collect();
        for some in numbers.chunks(AT_ONCE) {
            let parts: Vec<_> = some
                .par_iter()
                .map(|&line| covariance_of_line(&grid, (&lines[line], line), &cells))
                .collect();
            for (places, part) in parts {
                for (a, &i) in places.iter().enumerate() {
                    for (b, &j) in places[..=a].iter().enumerate() {
                        *covariance.at(i, j) += part[[a, b]];
                    }
                }
            }
        }
        for i in 0..order {
            *covariance.at(i, i) *= 1.0 + ROUNDING;
        }
        Ok(Self {
            slopes: cells.iter().flat_map(|cell| cell.slopes).collect(),
            covariance,
        })
    }

    /// Standard deviation of the first of some free numbers, each of which moves some parameters: with the best weights, those of the
    /// covariance, and with weights of the variances alone; with the widths of the spectra or without.
    pub(super) fn deviations(&self, groups: &[Vec<usize>], widths: bool) -> Option<[f64; 2]> {
        let mut covariance = self.covariance.clone();
        if !widths {
            // what varies so much tells nothing
            (1..self.slopes.len())
                .step_by(KINDS)
                .for_each(|i| *covariance.at(i, i) *= USELESS);
        }
        let slope = |group: &Vec<usize>| {
            self.slopes
                .iter()
                .map(|of| group.iter().map(|&place| of[place]).sum())
                .collect()
        };
        let slopes: Vec<Array1<f64>> = groups.iter().map(slope).collect();
        let weighted: Vec<_> = slopes
            .iter()
            .map(|slopes| slopes / &covariance.diagonal())
            .collect();
        let about: Vec<_> = weighted
            .iter()
            .map(|x| covariance.times(x.view()))
            .collect();
        let bread = inverse(&products(&weighted, &slopes))?;
        let sandwich = bread.dot(&products(&weighted, &about)).dot(&bread);
        let factor = covariance.factor()?;
        let white: Vec<_> = slopes
            .into_iter()
            .map(|slopes| factor.forward(slopes))
            .collect();
        Some(
            [inverse(&products(&white, &white))?, sandwich]
                .map(|variances| variances[[0, 0]].sqrt()),
        )
    }
}

/// The scalar products of all columns of one matrix with all of another.
fn products(a: &[Array1<f64>], b: &[Array1<f64>]) -> Array2<f64> {
    Array2::from_shape_fn((a.len(), b.len()), |(i, j)| a[i].dot(&b[j]))
}

/// Inverse of a small positive definite matrix.
fn inverse(a: &Array2<f64>) -> Option<Array2<f64>> {
    let mut band = Banded::zeros(a.nrows(), a.nrows());
    a.indexed_iter()
        .filter(|((i, j), _)| j <= i)
        .for_each(|((i, j), value)| *band.at(i, j) = *value);
    let factor = band.factor()?;
    let unit = Array2::<f64>::eye(a.nrows());
    let columns: Vec<Array1<f64>> = unit
        .rows()
        .into_iter()
        .map(|row| factor.forward(row.to_owned()))
        .collect();
    Some(products(&columns, &columns))
}

impl<'a> Grid<'a> {
    fn new(setting: &'a MapSetting<'a>) -> Result<Self, Failure> {
        let (period_s, window) = (4.0 * setting.scan.sampling.period_s(), WINDOW / 4);
        let gap_m = setting
            .range_m
            .windows(2)
            .next()
            .map_or(0.0, |pair| pair[1] - pair[0]);
        let step = 2.0 * gap_m / SPEED_OF_LIGHT_M_S / period_s;
        if (step - step.round()).abs() > 1e-6 {
            return Err(Failure::new(
                "the bound of a map wants gates of a multiple of 4 samples".into(),
            ));
        }
        let step = step.round() as usize;
        let band_hz = setting.scan.sampling.band_hz.1 - setting.scan.sampling.band_hz.0;
        let baseband = Sampling::baseband(
            period_s.recip(),
            setting.scan.sampling.wavelength_m,
            band_hz,
        )?;
        let model = WindowModel::gaussian_pulse(&baseband, window, setting.sigma_s, Noise::White)?;
        let mut tapers = Array2::zeros((window, window));
        for taper in likelihood_tapers(&model, setting.snr)? {
            tapers.indexed_iter_mut().for_each(|((p, q), w)| {
                *w += taper.factor * taper.weights[p] * taper.weights[q];
            });
        }
        let samples = window + (setting.range_m.len() - 1) * step;
        let noise = |lag: usize| match (setting.scan.noise, lag) {
            (Noise::White, 0) => (band_hz * period_s).recip(),
            (Noise::White, _) => 0.0,
            (_, 0) => 1.0,
            (_, lag) => {
                let turns = PI * band_hz * period_s * lag as f64;
                turns.sin() / turns
            }
        };
        let first_s =
            2.0 * setting.range_m[0] / SPEED_OF_LIGHT_M_S - 0.5 * window as f64 * period_s;
        let noise = (0..samples).map(noise).collect();
        Ok(Self {
            of: setting,
            period_s,
            first_s,
            window,
            samples,
            step,
            tapers,
            noise,
        })
    }

    /// Phase per velocity of a lag, k T m \[rad s/m\].
    fn turn(&self, lag: f64) -> f64 {
        4.0 * PI / self.of.scan.sampling.wavelength_m * self.period_s * lag
    }

    /// Mean correlogram of a gate of a line with that covariance, lags from 0 on.
    fn lags(&self, covariance: ArrayView2<'_, C64>, gate: usize) -> Vec<C64> {
        let first = gate * self.step;
        let one = |lag: usize| {
            (0..self.window - lag)
                .map(|q| covariance[[first + q + lag, first + q]] * self.tapers[[q + lag, q]])
                .sum()
        };
        (0..self.window).map(one).collect()
    }
}

impl Line {
    fn new(grid: &Grid<'_>, wake: &Wake, elevation_rad: f64) -> Option<Self> {
        let setting = grid.of;
        let reach_m = 0.5 * SPEED_OF_LIGHT_M_S * 4.0 * setting.sigma_s;
        let length_m =
            0.5 * SPEED_OF_LIGHT_M_S * grid.samples as f64 * grid.period_s + 2.0 * reach_m;
        let layers = (length_m / LAYER_M).ceil() as usize;
        let at_m = |layer: usize| {
            0.5 * SPEED_OF_LIGHT_M_S * grid.first_s - reach_m + (layer as f64 + 0.5) * LAYER_M
        };
        let winds: Vec<(f64, [f64; PARAMETERS])> = (0..layers)
            .map(|layer| setting.scan.wake.gradient(wake, at_m(layer), elevation_rad))
            .collect();
        let middle = 0.5 * grid.samples as f64;
        let seen = |(k, layer): (usize, usize)| {
            let time_s =
                grid.first_s + k as f64 * grid.period_s - 2.0 * at_m(layer) / SPEED_OF_LIGHT_M_S;
            let power =
                setting.snr * LAYER_M * 2.0 / SPEED_OF_LIGHT_M_S / (PI.sqrt() * setting.sigma_s);
            let phase = -grid.turn(k as f64 - middle) * winds[layer].0;
            C64::from_polar(
                power.sqrt() * (-0.5 * (time_s / setting.sigma_s).powi(2)).exp(),
                phase,
            )
        };
        let seen = Array2::from_shape_fn((grid.samples, layers), seen);
        let adjoint = seen.t().mapv(|s| s.conj());
        // B diag(weight) B^H
        let summed = |weight: &dyn Fn(usize) -> f64| {
            let mut weighted = seen.clone();
            for (layer, mut column) in weighted.columns_mut().into_iter().enumerate() {
                column *= C64::from(weight(layer));
            }
            weighted.dot(&adjoint)
        };
        let mut covariance = summed(&|_| 1.0);
        covariance
            .indexed_iter_mut()
            .for_each(|((p, q), c)| *c += grid.noise[p.abs_diff(q)]);
        let mut numbers = vec![covariance.clone()];
        for place in 0..PARAMETERS {
            let mut slope = summed(&|layer| winds[layer].1[place]);
            slope.indexed_iter_mut().for_each(|((p, q), s)| {
                *s *= C64::new(0.0, -grid.turn(p as f64 - q as f64));
            });
            numbers.push(slope);
        }
        let gate = |gate: usize| -> Vec<Vec<C64>> {
            numbers.iter().map(|x| grid.lags(x.view(), gate)).collect()
        };
        // a factor of noise that fills its band alone: a part of 1e-9 outside of it
        covariance
            .diag_mut()
            .iter_mut()
            .for_each(|c| *c *= 1.0 + 1e-9);
        Some(Self {
            lags: (0..setting.range_m.len()).map(gate).collect(),
            factor: cholesky(covariance)?,
        })
    }
}

impl Cell {
    fn new(grid: &Grid<'_>, lines: &[Line], (line, gate): (usize, usize)) -> Self {
        let setting = grid.of;
        let shares = shares(setting, line, setting.range_m[gate]);
        let numbers = lines[line].lags[gate].len();
        let mut lags = vec![vec![C64::ZERO; grid.window]; numbers];
        for &(other, share) in &shares {
            for (sum, one) in lags.iter_mut().zip(&lines[other].lags[gate]) {
                sum.iter_mut()
                    .zip(one)
                    .for_each(|(sum, one)| *sum += share * one);
            }
        }
        // spectrum and its first and second derivatives by velocity
        let spectrum = |lags: &[C64], velocity_m_s: f64| -> [f64; 3] {
            let mut sums = [lags[0].re, 0.0, 0.0];
            for (m, lag) in lags.iter().enumerate().skip(1) {
                let turn = grid.turn(m as f64);
                let turned = 2.0 * lag * C64::cis(turn * velocity_m_s);
                sums[0] += turned.re;
                sums[1] -= turn * turned.im;
                sums[2] -= turn * turn * turned.re;
            }
            sums
        };
        let band_hz = setting.scan.sampling.band_hz.1 - setting.scan.sampling.band_hz.0;
        let fastest_m_s = 0.25 * setting.scan.sampling.wavelength_m * band_hz;
        let place = |i: usize| fastest_m_s * (2.0 * i as f64 / PLACES as f64 - 1.0);
        let highest =
            |a: &f64, b: &f64| spectrum(&lags[0], *a)[0].total_cmp(&spectrum(&lags[0], *b)[0]);
        let mut velocity_m_s = (0..PLACES).map(place).max_by(highest).unwrap_or(0.0);
        for _ in 0..8 {
            let [_, first, second] = spectrum(&lags[0], velocity_m_s);
            velocity_m_s -= if second < 0.0 {
                (first / second).clamp(-0.1, 0.1)
            } else {
                0.0
            };
        }
        let [level, _, curvature] = spectrum(&lags[0], velocity_m_s);
        let mut slopes = [[0.0; PARAMETERS]; KINDS];
        for place in 0..PARAMETERS {
            let [of_level, of_slope, of_curvature] = spectrum(&lags[place + 1], velocity_m_s);
            slopes[0][place] = -of_slope / curvature;
            slopes[1][place] = of_curvature / curvature - of_level / level;
        }
        Self {
            velocity_m_s,
            level,
            curvature,
            slopes,
            shares,
        }
    }
}

/// Lines of a region with their shares: the windows of each chord over those of all.
fn shares(setting: &MapSetting<'_>, line: usize, range_m: f64) -> Vec<(usize, f64)> {
    let sample_m = 0.5 * SPEED_OF_LIGHT_M_S * setting.scan.sampling.period_s();
    let windows = |other: usize| {
        let away_m =
            range_m * (setting.scan.elevation_rad[other] - setting.scan.elevation_rad[line]).abs();
        let chord_m2 = setting.radius_m * setting.radius_m - away_m * away_m;
        if chord_m2 >= 0.0 || other == line {
            2.0 * (chord_m2.max(0.0).sqrt() / sample_m).floor() + 1.0
        } else {
            0.0
        }
    };
    let all: Vec<(usize, f64)> = (0..setting.scan.elevation_rad.len())
        .map(|other| (other, windows(other)))
        .filter(|(_, n)| *n > 0.0)
        .collect();
    let sum: f64 = all.iter().map(|(_, n)| n).sum();
    all.into_iter().map(|(other, n)| (other, n / sum)).collect()
}

/// Places of the numbers of a map that see a line, and what the line adds to their covariance.
fn covariance_of_line(
    grid: &Grid<'_>,
    (line, number): (&Line, usize),
    cells: &[Cell],
) -> (Vec<usize>, Array2<f64>) {
    let (gates, n) = (grid.of.range_m.len(), grid.samples);
    let share = |cell: &Cell| {
        cell.shares
            .iter()
            .find(|(other, _)| *other == number)
            .map(|(_, share)| *share)
    };
    let seen: Vec<_> = cells
        .iter()
        .enumerate()
        .filter_map(|(i, cell)| Some((i, cell, share(cell)?)))
        .collect();
    let mut forms = Array2::zeros((seen.len() * KINDS, n * n));
    let mut places = Vec::with_capacity(seen.len() * KINDS);
    for (row, (i, cell, share)) in seen.into_iter().enumerate() {
        let first = i % gates * grid.step;
        for kind in 0..KINDS {
            let form = |p: usize, q: usize| {
                let turn = grid.turn(p as f64 - q as f64);
                let weight = match kind {
                    0 => C64::new(0.0, -turn / cell.curvature),
                    _ => C64::new(-turn * turn / cell.curvature - cell.level.recip(), 0.0),
                };
                // conjugated: the correlogram sums z_p z_q^*, the form z_p^* z_q
                (weight * C64::cis(turn * cell.velocity_m_s)).conj() * (share * grid.tapers[[p, q]])
            };
            let form = Array2::from_shape_fn((grid.window, grid.window), |(p, q)| form(p, q));
            let mut out = forms.row_mut(row * KINDS + kind);
            if let Some(out) = out.as_slice_mut() {
                whiten(&line.factor, form.view(), first, out);
            }
            places.push(i * KINDS + kind);
        }
    }
    let covariance = forms.dot(&forms.t());
    (places, covariance)
}

/// L^H A L of a Hermitian A that stands at row `first`, as real numbers whose scalar product is the trace of a product.
fn whiten(factor: &Array2<C64>, form: ArrayView2<'_, C64>, first: usize, out: &mut [f64]) {
    let (n, m) = (factor.nrows(), form.nrows());
    // no row of L reaches beyond its diagonal
    let columns = first + m;
    let part = factor.slice(ndarray::s![first..first + m, ..columns]);
    let half = form.dot(&part);
    for a in 0..columns {
        for b in 0..=a {
            let sum: C64 = (0..m).map(|p| part[[p, a]].conj() * half[[p, b]]).sum();
            if a == b {
                out[a * n + a] = sum.re;
            } else {
                (out[a * n + b], out[b * n + a]) = (SQRT_2 * sum.re, SQRT_2 * sum.im);
            }
        }
    }
}

/// Lower factor of a Hermitian matrix; nothing unless it is positive definite.
fn cholesky(mut a: Array2<C64>) -> Option<Array2<C64>> {
    let n = a.nrows();
    for j in 0..n {
        for i in j..n {
            let sum: C64 = (0..j).map(|k| a[[i, k]] * a[[j, k]].conj()).sum();
            a[[i, j]] -= sum;
        }
        // the root of a pivot that is not positive is no number, or zero
        let root = a[[j, j]].re.sqrt();
        if root.is_nan() || root == 0.0 {
            return None;
        }
        (j..n).for_each(|i| a[[i, j]] /= root);
        (0..j).for_each(|i| a[[i, j]] = C64::ZERO);
    }
    Some(a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use fixtures::sampling;
    use wakescope_estimate::SignalKind;
    use wakescope_estimate::vortex_fit::{PulseShape, WakeModel};

    const SIGMA_S: f64 = 120.112e-9;
    const WIND: [[usize; 1]; 1] = [[8]];

    fn calm() -> Wake {
        Wake::from_array(&[0.0, 0.0, 376.5, 45.0, 423.5, 49.0, 2.0, 2.7, 3.0, 0.0])
    }

    fn deviation(noise: Noise, radius_m: f64, elevation_rad: &[f64], range_m: &[f64]) -> [f64; 2] {
        let scan = ScanSetup {
            sampling: sampling().unwrap(),
            kind: SignalKind::Real,
            noise,
            pulse: PulseShape::gaussian(SIGMA_S).unwrap(),
            wake: WakeModel::default(),
            elevation_rad: elevation_rad.to_vec(),
            first_sample_time_s: 0.0,
            record_samples: 0,
        };
        let setting = MapSetting {
            scan: &scan,
            sigma_s: SIGMA_S,
            snr: 2.0,
            radius_m,
            range_m,
        };
        let groups: Vec<Vec<usize>> = WIND.iter().map(|g| g.to_vec()).collect();
        MapBound::new(&setting, &calm())
            .unwrap()
            .deviations(&groups, false)
            .unwrap()
    }

    /// In white noise the highest place of the spectrum with those tapers is the likelihood's own, and one line of elevation 0 the wind itself.
    #[test]
    fn one_window_of_wind_has_its_cramer_rao_bound() {
        let found = deviation(Noise::White, 0.0, &[0.0], &[400.0]);
        let baseband = Sampling::baseband(62.5e6, 1.55e-6, 50e6).unwrap();
        let model =
            WindowModel::gaussian_pulse(&baseband, WINDOW / 4, SIGMA_S, Noise::White).unwrap();
        let bound_m_s = model.bound_m_s(3.0, 2.0, SignalKind::Complex, 1.0).unwrap();
        for deviation in found {
            assert!(
                (deviation / bound_m_s - 1.0).abs() < 2e-3,
                "{deviation} {bound_m_s}"
            );
        }
    }

    /// Lines of their own: four lines halve the deviation of one. Regions that hold all lines: four cells say the same four times.
    #[test]
    fn lines_count_once_whether_regions_share_them_or_not() {
        let lines = [0.0, 1e-3, 2e-3, 3e-3];
        let one = deviation(Noise::White, 0.0, &lines[..1], &[400.0])[0];
        for radius_m in [0.0, 50.0] {
            for deviation in deviation(Noise::White, radius_m, &lines, &[400.0]) {
                assert!(
                    (2.0 * deviation / one - 1.0).abs() < 2e-3,
                    "{radius_m} {deviation} {one}"
                );
            }
        }
    }

    /// Gates that overlap by half: correlated, so that two are worth less than two, and more than one.
    #[test]
    fn gates_that_overlap_are_correlated() {
        let sample_m = 0.5 * SPEED_OF_LIGHT_M_S * 4e-9;
        let band = Noise::Band { floor: 0.0 };
        let of = |range_m: &[f64]| deviation(band, 0.0, &[0.0], range_m)[0];
        let (one, two, apart) = (
            of(&[400.0]),
            of(&[400.0, 400.0 + 32.0 * sample_m]),
            of(&[400.0, 400.0 + 400.0 * sample_m]),
        );
        assert!((apart / one - 0.5_f64.sqrt()).abs() < 1e-6, "{one} {apart}");
        assert!(
            two < 0.95 * one && two > 1.05 * apart,
            "{one} {two} {apart}"
        );
    }
}
