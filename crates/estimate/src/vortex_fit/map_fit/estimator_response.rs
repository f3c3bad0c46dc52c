//! The map that an estimator shows of a wake in the mean of very many pulses.
//!
//! The air at range R + x adds to the expected correlogram of the gate at R
//!
//! ```text
//! W_m(x) exp(j 2 pi f(v_R(R + x)) m T_s),   W_m(x) = sum over tapers a, n of a h(n+m) h(n) f(t_(n+m) - 2x/c) f(t_n - 2x/c)
//! ```
//!
//! with t_n counted from the middle of the window, f(v) from (30) and f(t) the pulse; noise adds its own lags, real
//! samples keep the real part. The correlograms of a region's lines are added, and the estimator itself phasors the sum
//! into a velocity. So whatever it makes of the skewed and broad spectra of a core is part of what is expected of it:
//! nothing is taken for a mean. Left out is the extent of a region along the line, short against a gate. Check:
//! uniform wind; a wide line shows the mean over the gate; the correlogram of signals summed over layers; simulated scans.

use multiversion::multiversion;
use ndarray::Array2;
use std::f64::consts::TAU;

use crate::bound::Noise;
use crate::error::{Error, length, not_negative, positive};
use crate::estimators::Estimator;
use crate::linalg::dot;
use crate::parallel::{map_each, map_indexed};
use crate::spectrum::{Correlogram, Taper};
use crate::vortex_fit::map_fit::cells::scaled;
use crate::vortex_fit::wake::motion::Motion;
use crate::vortex_fit::wake::pair::Ray;
use crate::vortex_fit::wake::pulse::{envelope_at, reach_s};
use crate::vortex_fit::wake::wake_map::region;
use crate::vortex_fit::{RangeKernel, Wake, WakeModel};
use crate::window::{SPEED_OF_LIGHT_M_S, Sample, Sampling, Scratch, SignalKind};

/// Air nodes are at most this far apart \[m\]: half of a small core.
const NODE_M: f64 = 1.25;
/// And at most this part of the pulse's length, c sigma / 2.
const NODE_OVER_PULSE: f64 = 0.25;

/// Nodes at both ends of a gate that together see less than this part of its power are left out.
const LEFT_OUT: f64 = 1e-5;

/// Powers that come before their sum reaches `least`.
fn below<'p>(powers: impl Iterator<Item = &'p f64>, least: f64) -> usize {
    let sums = powers.scan(0.0, |sum, power| {
        *sum += power;
        Some(*sum)
    });
    sums.take_while(|sum| *sum < least).count()
}

/// How the velocities of a map were estimated: correlogram, estimator, pulse, noise and regions.
pub struct EstimatorResponse<'a> {
    estimator: &'a dyn Estimator,
    kind: SignalKind,
    tapers: Vec<Taper>,
    sampling: Sampling,
    /// Half-width of the power of the pulse at 1/e \[s\].
    pulse_sigma_s: f64,
    /// Lags of the noise over the power of the signal.
    noise: Vec<f64>,
    /// Radius of the region at a range \[m\].
    radius_m: Box<dyn Fn(f64) -> f64 + Send + Sync + 'a>,
    /// Elevation \[rad\] and time \[s\] of the lines, if the vortices move meanwhile.
    line_times: Vec<(f64, f64)>,
}

impl<'a> EstimatorResponse<'a> {
    /// Of a map that `estimator` made of the correlograms `statistic`, accumulated over regions of radius `radius_m`
    /// \[m\] (0: each line for itself), with a backscatter that changes little along a gate. `pulse_sigma_s` is the
    /// half-width of the power of the Gaussian pulse at 1/e \[s\], `snr` the signal-to-noise ratio in the detector band.
    ///
    /// # Errors
    /// [`Error::Length`] if statistic and estimator do not match; [`Error::OutOfRange`], [`Error::Band`] for impossible
    /// numbers.
    pub fn new<S: Sample>(
        statistic: &Correlogram<S>,
        estimator: &'a dyn Estimator,
        sampling: &Sampling,
        pulse_sigma_s: f64,
        (noise, snr): (Noise, f64),
        radius_m: f64,
    ) -> Result<Self, Error> {
        sampling.validate_for(S::KIND)?;
        noise.validate()?;
        positive("pulse_sigma_s", pulse_sigma_s)?;
        positive("snr", snr)?;
        let lags = statistic.lags();
        length(
            "statistic",
            estimator.statistic_len(),
            S::KIND.lag_numbers(lags),
        )?;
        not_negative("radius_m", radius_m)?;
        let in_band = Noise::Band { floor: 0.0 }
            .covariance(sampling, 0.0, S::KIND)
            .re;
        let numbers = statistic
            .lag_weights()
            .into_iter()
            .enumerate()
            .flat_map(|(m, weight)| {
                let lag = noise.covariance(sampling, m as f64, S::KIND) * (weight / in_band / snr);
                [lag.re, lag.im].into_iter().take(S::KIND.lag_numbers(1))
            });
        Ok(Self {
            estimator,
            kind: S::KIND,
            tapers: statistic.tapers().to_vec(),
            sampling: *sampling,
            pulse_sigma_s,
            noise: numbers.collect(),
            radius_m: Box::new(move |_| radius_m),
            line_times: Vec::new(),
        })
    }

    /// The same with regions whose radius \[m\] depends on the range \[m\].
    #[must_use]
    pub fn with_radius(self, radius_m: impl Fn(f64) -> f64 + Send + Sync + 'a) -> Self {
        Self {
            radius_m: Box::new(radius_m),
            ..self
        }
    }

    /// The same with vortices that move while the lines, at `elevation_rad` \[rad\], are measured: `seconds` \[s\] after the time that the
    /// wake is given for. A line that is none of these sees it as it is then.
    #[must_use]
    pub fn moving(self, elevation_rad: &[f64], seconds: &[f64]) -> Self {
        let elevations = elevation_rad.iter().copied();
        Self {
            line_times: elevations.zip(seconds.iter().copied()).collect(),
            ..self
        }
    }

    /// The map \[line, gate\] of velocities \[m/s\] at `elevation_rad` \[rad\] and `range_m` \[m\], both increasing;
    /// NaN where the estimator finds none.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for an impossible wake or axis.
    pub fn map(
        &self,
        model: &WakeModel,
        wake: &Wake,
        elevation_rad: &[f64],
        range_m: &[f64],
    ) -> Result<Array2<f64>, Error> {
        wake.validate()?;
        crate::vortex_fit::map_fit::data::validate_axes(elevation_rad, range_m)?;
        Ok(self
            .prepared(model, (elevation_rad, range_m), 1.0)?
            .velocities(model, wake))
    }

    /// Least radius of the regions at those ranges \[m\].
    pub(crate) fn least_radius_m(&self, range_m: &[f64]) -> f64 {
        range_m
            .iter()
            .map(|range_m| (self.radius_m)(*range_m))
            .fold(f64::INFINITY, f64::min)
    }

    /// The weights of the air on nodes that fit the gates of those elevations and ranges, `coarser` times as far apart as maps need.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if the weights have no power.
    pub(crate) fn prepared<'r>(
        &'r self,
        model: &'r WakeModel,
        (elevation_rad, range_m): (&'r [f64], &'r [f64]),
        coarser: f64,
    ) -> Result<Prepared<'r>, Error> {
        let spacing_m = self.node_spacing_m(range_m, coarser);
        let lags = self.tapers[0].weights.len();
        let numbers = self.kind.lag_numbers(lags);
        let half_s = 0.5 * lags as f64 * self.sampling.period_s();
        let reach = (0.5 * SPEED_OF_LIGHT_M_S * (half_s + reach_s(self.pulse_sigma_s)) / spacing_m)
            .ceil() as i64;
        let mut weights = Vec::with_capacity((2 * reach + 1) as usize * numbers);
        for node in -reach..=reach {
            let away_s = 2.0 * node as f64 * spacing_m / SPEED_OF_LIGHT_M_S;
            for weight in self.node_weights(away_s) {
                weights.extend(std::iter::repeat_n(weight, numbers / lags));
            }
        }
        let powers: Vec<f64> = weights.iter().step_by(numbers).copied().collect();
        let power: f64 = powers.iter().sum();
        let least = 0.5 * LEFT_OUT * power;
        let before = below(powers.iter(), least);
        let after = below(powers.iter().rev(), least);
        weights.truncate((powers.len() - after) * numbers);
        weights.drain(..before * numbers);
        weights.iter_mut().for_each(|weight| *weight /= power);
        let size = (elevation_rad.len(), range_m.len());
        let regions = Array2::from_shape_fn(size, |(line, gate)| {
            let radius_m = (self.radius_m)(range_m[gate]);
            region(elevation_rad, line, range_m[gate], radius_m).collect()
        });
        let of_lag_0: Vec<f64> = weights.iter().step_by(numbers).copied().collect();
        let kernel = RangeKernel::new(
            (before as f64 - reach as f64) * spacing_m,
            spacing_m,
            &of_lag_0,
        )?;
        let seconds = elevation_rad
            .iter()
            .map(|elevation_rad| self.seconds_after(*elevation_rad))
            .collect();
        Ok(Prepared {
            response: self,
            model,
            elevation_rad,
            range_m,
            kernel,
            numbers,
            weights,
            regions,
            seconds,
        })
    }

    /// Time \[s\] of the line at an elevation after that of the wake; 0 for a line without a time.
    fn seconds_after(&self, elevation_rad: f64) -> f64 {
        let mut lines = self.line_times.iter();
        let line = lines.find(|(elevation, _)| *elevation == elevation_rad);
        line.map_or(0.0, |(_, seconds)| *seconds)
    }

    /// Distance of nodes of the air \[m\]: gates at those ranges fall on them unless they are so close that this would take many more.
    fn node_spacing_m(&self, range_m: &[f64], coarser: f64) -> f64 {
        let gaps_m = range_m.windows(2).map(|pair| pair[1] - pair[0]);
        let gap_m = gaps_m.fold(f64::INFINITY, f64::min);
        let of_pulse_m = NODE_OVER_PULSE * 0.5 * SPEED_OF_LIGHT_M_S * self.pulse_sigma_s;
        let widest_m = coarser * NODE_M.min(of_pulse_m);
        if gap_m.is_finite() && gap_m > 0.25 * widest_m {
            gap_m / (gap_m / widest_m).ceil()
        } else {
            widest_m
        }
    }

    /// Weights of each lag for the air whose echo comes `away_s` \[s\] after that of the middle of the gate.
    fn node_weights(&self, away_s: f64) -> Vec<f64> {
        let lags = self.tapers[0].weights.len();
        let period_s = self.sampling.period_s();
        let half_s = 0.5 * lags as f64 * period_s;
        let pulse: Vec<f64> = (0..lags)
            .map(|n| envelope_at(self.pulse_sigma_s, n as f64 * period_s - half_s - away_s))
            .collect();
        let mut tapered: Vec<Vec<f64>> = Vec::new();
        for taper in &self.tapers {
            tapered.push(scaled(&taper.weights, &pulse));
        }
        let mut weights = Vec::with_capacity(lags);
        for m in 0..lags {
            let terms = self.tapers.iter().zip(&tapered);
            let terms = terms.map(|(taper, g)| taper.factor * dot(&g[m..], &g[..lags - m]));
            weights.push(terms.sum());
        }
        weights
    }
}

/// Width of the correlation of speckle over that of the weight of a gate.
const SPECKLE_OVER_GATE: f64 = 0.84;

/// A response at the places of a map, with its weights on nodes.
pub(crate) struct Prepared<'r> {
    pub(crate) response: &'r EstimatorResponse<'r>,
    pub(crate) model: &'r WakeModel,
    elevation_rad: &'r [f64],
    range_m: &'r [f64],
    /// The mean over a gate, which a wide line would show.
    pub(crate) kernel: RangeKernel,
    /// Numbers of one correlogram.
    numbers: usize,
    /// \[node, number\]
    weights: Vec<f64>,
    /// Lines of the region of each place \[line, gate\] with their shares.
    regions: Array2<Vec<(usize, f64)>>,
    /// Time of each line after that of the wake \[s\].
    seconds: Vec<f64>,
}

impl Prepared<'_> {
    /// The wake when each line is measured.
    fn wakes(&self, model: &WakeModel, wake: &Wake) -> Vec<Wake> {
        let motion = Motion::new(model, wake);
        self.seconds
            .iter()
            .map(|seconds| motion.wake_after(wake, *seconds))
            .collect()
    }

    /// The map of a wake by a model.
    pub(crate) fn velocities(&self, model: &WakeModel, wake: &Wake) -> Array2<f64> {
        let lines = self.elevation_rad.len();
        let gates = self.range_m.len();
        let wakes = self.wakes(model, wake);
        let correlograms = map_indexed(lines, Vec::new, |phasors, line| {
            self.line(
                (model, &wakes[line]),
                Ray::new(self.elevation_rad[line]),
                phasors,
            )
        });
        let rows = map_indexed(
            lines,
            || (Scratch::new(), vec![0.0; self.numbers]),
            |(scratch, mean), line| {
                let mut row = Vec::with_capacity(gates);
                for gate in 0..gates {
                    self.accumulate(&correlograms, [line, gate], mean);
                    row.push(self.response.estimator.estimate(mean, scratch).velocity_m_s);
                }
                row
            },
        );
        Array2::from_shape_fn((lines, gates), |(line, gate)| rows[line][gate])
    }

    /// The map of a list of parameters.
    pub(crate) fn velocities_of(&self, p: &[f64]) -> Array2<f64> {
        let (model, wake) = self.model.with(p);
        self.velocities(&model, &wake)
    }

    /// Mean correlogram of the region of a place \[line, gate\], with noise, from the correlograms of the lines.
    fn accumulate(&self, correlograms: &[Vec<f64>], place: [usize; 2], mean: &mut [f64]) {
        mean.copy_from_slice(&self.response.noise);
        for &(other, share) in &self.regions[place] {
            let lags = &correlograms[other][place[1] * self.numbers..][..self.numbers];
            mean.iter_mut()
                .zip(lags)
                .for_each(|(sum, lag)| *sum += share * lag);
        }
    }

    /// Correlation of the noise of two gates in uniform wind: exp(-d²/(4 w²)), the square of the correlation of their speckle, with w = 0.84 widths of
    /// a gate, as peaks of spectra had it at 10 dB with the default pulse and window.
    pub(crate) fn noise_correlation_of_gates(&self, [a, b]: [usize; 2]) -> f64 {
        let width_m = SPECKLE_OVER_GATE * self.kernel.width_m();
        let apart = (self.range_m[a] - self.range_m[b]) / width_m;
        (-0.25 * apart * apart).exp()
    }

    /// Correlation of the noise of the regions of two places \[line, gate\], by the shares of the lines that both have.
    pub(crate) fn noise_correlation_of_lines(&self, [a, b]: [[usize; 2]; 2]) -> f64 {
        let [mut both, mut of_a, mut of_b] = [0.0; 3];
        for (line, share) in &self.regions[a] {
            of_a += share * share;
            let others = &self.regions[b];
            let other = others.iter().find(|(other, _)| other == line);
            both += share * other.map_or(0.0, |(_, share)| *share);
        }
        for (_, share) in &self.regions[b] {
            of_b += share * share;
        }
        both / (of_a * of_b).sqrt().max(f64::MIN_POSITIVE)
    }

    /// Variance of the velocities \[m^2/s^2\] of the air that each place of the map sees.
    pub(crate) fn variances(&self, wake: &Wake) -> Array2<f64> {
        let lines = self.elevation_rad.len();
        let gates = self.range_m.len();
        let nearest_m = self.range_m.first().copied().unwrap_or(0.0);
        let wakes = self.wakes(self.model, wake);
        let moments = map_each(lines, |line| {
            let velocities = self.velocities_on(
                (self.model, &wakes[line]),
                Ray::new(self.elevation_rad[line]),
            );
            let mut moments: Vec<[f64; 2]> = Vec::with_capacity(gates);
            for range_m in self.range_m {
                let (index, part) = self.kernel.place(range_m - nearest_m);
                let index = index + usize::from(part >= 0.5);
                let weights = self.weights.iter().step_by(self.numbers);
                let mut mean = 0.0;
                let mut square = 0.0;
                for (w, v) in weights.zip(&velocities[index..]) {
                    mean += w * v;
                    square += w * v * v;
                }
                moments.push([mean, square]);
            }
            moments
        });
        Array2::from_shape_fn((lines, gates), |(line, gate)| {
            let [mean, square] = self.regions[[line, gate]].iter().fold(
                [0.0, 0.0],
                |[mean, square], &(other, share)| {
                    let [m, s] = moments[other][gate];
                    [mean + share * m, square + share * s]
                },
            );
            (square - mean * mean).max(0.0)
        })
    }

    /// Velocities of the air at the nodes of a line that its gates see.
    fn velocities_on(&self, (model, wake): (&WakeModel, &Wake), ray: Ray) -> Vec<f64> {
        let mut velocities = [Vec::new()];
        model.along(
            wake,
            &self.kernel.points_m(self.range_m).collect::<Vec<f64>>(),
            ray,
            &mut velocities,
        );
        let [velocities] = velocities;
        velocities
    }

    /// Expected correlograms of the signal at all gates of a line, of power 1.
    fn line(&self, air: (&WakeModel, &Wake), ray: Ray, phasors: &mut Vec<f64>) -> Vec<f64> {
        let sampling = &self.response.sampling;
        let nearest_m = self.range_m.first().copied().unwrap_or(0.0);
        let velocities = self.velocities_on(air, ray).into_iter();
        let turns: Vec<(f64, f64)> = velocities
            .map(|v| (TAU * (sampling.frequency_hz(v) * sampling.period_s())).sin_cos())
            .collect();
        phasors.resize(turns.len() * self.numbers, 0.0);
        fill_powers(phasors, &turns, self.response.kind);
        let mut lags = vec![0.0; self.range_m.len() * self.numbers];
        for (range_m, lags) in self.range_m.iter().zip(lags.chunks_exact_mut(self.numbers)) {
            let (index, part) = self.kernel.place(range_m - nearest_m);
            // ranges between two nodes see something of both
            for (shift, share) in [(0, 1.0 - part), (1, part)] {
                if share > 1e-6 {
                    let seen = &phasors[(index + shift) * self.numbers..];
                    add_seen(lags, &self.weights, seen, share);
                }
            }
        }
        lags
    }
}

/// Points whose powers are taken side by side.
const LANES: usize = 8;

/// Powers 0, 1, ... of unit phasors, given as sine and cosine: a row for each.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn fill_powers(phasors: &mut [f64], turns: &[(f64, f64)], kind: SignalKind) {
    let count = phasors.len() / turns.len().max(1);
    let parts = kind.lag_numbers(1);
    for (rows, turns) in phasors.chunks_mut(LANES * count).zip(turns.chunks(LANES)) {
        let mut sin = [0.0; LANES];
        let mut cos = [1.0; LANES];
        for (lane, turn) in turns.iter().enumerate() {
            (sin[lane], cos[lane]) = *turn;
        }
        let mut re = [1.0; LANES];
        let mut im = [0.0; LANES];
        for number in (0..count).step_by(parts) {
            for lane in 0..turns.len() {
                rows[lane * count + number] = re[lane];
                if parts == 2 {
                    rows[lane * count + number + 1] = im[lane];
                }
            }
            for lane in 0..LANES {
                let x = re[lane];
                let y = im[lane];
                re[lane] = x * cos[lane] - y * sin[lane];
                im[lane] = y * cos[lane] + x * sin[lane];
            }
        }
    }
}

/// lags += share weights phasors, summed over nodes; all three have rows of the length of `lags`.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn add_seen(lags: &mut [f64], weights: &[f64], phasors: &[f64], share: f64) {
    let count = lags.len();
    // two nodes at a time: the sums are loaded and stored half as often
    let pairs = weights.chunks_exact(2 * count);
    let nodes = phasors.chunks_exact(2 * count);
    let last = weights.len() / (2 * count) * 2 * count;
    for (weights, phasors) in pairs.zip(nodes) {
        let (w, x) = weights.split_at(count);
        let (t, u) = phasors.split_at(count);
        for i in 0..count {
            lags[i] += share * (w[i] * t[i] + x[i] * u[i]);
        }
    }
    for ((lag, weight), turn) in lags.iter_mut().zip(&weights[last..]).zip(&phasors[last..]) {
        *lag += share * weight * turn;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimators::{FirstMoment, PulsePair, Refinement, SpectralPeak};
    use crate::spectrum::unweighted_lags;
    use crate::window::Weighting;

    const SIGMA_S: f64 = 120.112e-9;
    const RANGES_M: [f64; 3] = [372.0, 377.7, 400.0];
    const LINES_RAD: [f64; 3] = [0.112, 0.115, 0.1175];

    fn sampling() -> Sampling {
        Sampling::new(250e6, 80e6, 1.55e-6, (55e6, 105e6)).unwrap()
    }

    fn wake() -> Wake {
        Wake::from_array(&[
            480.0, 520.0, 376.5, 45.0, 423.5, 49.0, 2.0, 2.7, 1.3, 0.02, 0.0,
        ])
    }

    fn response<'a>(
        statistic: &Correlogram<f64>,
        estimator: &'a dyn Estimator,
        noise: (Noise, f64),
        radius_m: f64,
    ) -> EstimatorResponse<'a> {
        EstimatorResponse::new(statistic, estimator, &sampling(), SIGMA_S, noise, radius_m).unwrap()
    }

    /// Regions of one line share no noise, regions of all lines share all of it.
    #[test]
    fn noise_is_shared_by_regions_with_common_lines_and_by_close_gates() {
        let statistic = Correlogram::<f64>::new(Weighting::default(), 64).unwrap();
        let moment = FirstMoment::new(
            &sampling(),
            SignalKind::Real,
            &unweighted_lags(64),
            1024,
            3.5,
        )
        .unwrap();
        let model = WakeModel::default();
        for (radius_m, shared) in [(0.0, 0.0), (100.0, 1.0)] {
            let shown = response(&statistic, &moment, (Noise::White, 2.0), radius_m);
            let prepared = shown
                .prepared(&model, (&LINES_RAD, &RANGES_M), 1.0)
                .unwrap();
            let of_lines = prepared.noise_correlation_of_lines([[0, 1], [1, 1]]);
            // shares of lines fall a little with their distance
            assert!((of_lines - shared).abs() < 1e-6, "{radius_m}: {of_lines}");
            let own = prepared.noise_correlation_of_lines([[1, 1], [1, 1]]);
            assert!((own - 1.0).abs() < 1e-12, "{radius_m}: {own}");
            assert_eq!(prepared.noise_correlation_of_gates([1, 1]), 1.0);
            let apart = (RANGES_M[1] - RANGES_M[0]) / prepared.kernel.width_m();
            let of_gates = prepared.noise_correlation_of_gates([0, 1]);
            let expected = (-apart * apart / (4.0 * 0.84 * 0.84)).exp();
            assert!((of_gates - expected).abs() < 1e-12, "{of_gates} {expected}");
        }
    }

    #[test]
    fn uniform_wind_is_shown_as_it_is() {
        let calm = Wake::from_array(&[0.0, 0.0, 376.5, 45.0, 423.5, 49.0, 2.0, 2.7, 6.0, 0.0, 0.0]);
        let statistic = Correlogram::<f64>::new(Weighting::default(), 64).unwrap();
        let peak = SpectralPeak::new(
            &sampling(),
            SignalKind::Real,
            &unweighted_lags(64),
            1024,
            Refinement::Parabola,
        )
        .unwrap();
        let shown = response(&statistic, &peak, (Noise::White, 1.0), 2.0)
            .map(&WakeModel::default(), &calm, &LINES_RAD, &RANGES_M)
            .unwrap();
        for ((line, _), velocity) in shown.indexed_iter() {
            assert!(
                (velocity - 6.0 * LINES_RAD[line].cos()).abs() < 0.01,
                "{shown}"
            );
        }
    }

    /// The phase of lag 1 is that of the mean velocity but for the third moment, which is small in a weak wake.
    #[test]
    fn a_pulse_pair_of_complex_samples_shows_the_mean_over_the_gate() {
        let sampling = Sampling::baseband(250e6, 1.55e-6, 50e6).unwrap();
        let statistic =
            Correlogram::<num_complex::Complex<f64>>::new(Weighting::Rectangular, 64).unwrap();
        let pair = PulsePair::new(&sampling, SignalKind::Complex, &unweighted_lags(64)).unwrap();
        let response = EstimatorResponse::new(
            &statistic,
            &pair,
            &sampling,
            SIGMA_S,
            (Noise::White, 10.0),
            2.0,
        )
        .unwrap();
        let weak = Wake::from_array(&[
            96.0, 104.0, 376.5, 45.0, 423.5, 49.0, 2.0, 2.7, 1.3, 0.02, 0.0,
        ]);
        let shown = response
            .map(&WakeModel::default(), &weak, &LINES_RAD, &RANGES_M)
            .unwrap();
        let kernel = RangeKernel::gaussian_gate(SIGMA_S, &[1.0; 64], 4e-9, 0.5).unwrap();
        let means = WakeModel::default()
            .map(&weak, &kernel, &LINES_RAD, &RANGES_M, 2.0)
            .unwrap();
        for (shown, mean) in shown.iter().zip(&means) {
            // a window has one pair less than samples
            assert!((shown - mean).abs() < 0.01, "{shown} {mean}");
        }
        assert!(
            means.iter().any(|v| (v - means[[0, 0]]).abs() > 0.2),
            "{means}"
        );
    }

    /// Covariance of real samples summed over layers of 5 cm, its correlogram pair by pair, the lines of a region added.
    #[test]
    fn velocities_are_those_of_the_mean_correlogram_of_thin_layers() {
        let (model, sampling) = (WakeModel::default(), sampling());
        let statistic = Correlogram::<f64>::new(Weighting::default(), 64).unwrap();
        let moment =
            FirstMoment::new(&sampling, SignalKind::Real, &unweighted_lags(64), 1024, 3.5).unwrap();
        let peak = SpectralPeak::new(
            &sampling,
            SignalKind::Real,
            &unweighted_lags(64),
            1024,
            Refinement::Parabola,
        )
        .unwrap();
        let (snr, radius_m) = (2.0, 1.5);
        let h = &statistic.tapers()[0].weights;
        let correlogram = |line: usize, range_m: f64| -> Vec<f64> {
            let mut sum = vec![0.0; 64];
            for layer in -1600..1600 {
                let away_m = f64::from(layer) * 0.05;
                let velocity =
                    model.radial_velocity_m_s(&wake(), range_m + away_m, LINES_RAD[line]);
                let seen: Vec<f64> = (0..64)
                    .map(|n| (f64::from(n) - 32.0) * 4e-9 - 2.0 * away_m / SPEED_OF_LIGHT_M_S)
                    .map(|t_s| {
                        (-0.5 * (t_s / SIGMA_S).powi(2)).exp()
                            / (std::f64::consts::PI.sqrt() * SIGMA_S).sqrt()
                    })
                    .collect();
                for m in 0..64 {
                    let turn = TAU * sampling.frequency_hz(velocity) * m as f64 * 4e-9;
                    let pairs: f64 = (0..64 - m)
                        .map(|n| h[n] * h[n + m] * seen[n] * seen[n + m])
                        .sum();
                    sum[m] += pairs * turn.cos() * 0.05 * 2.0 / SPEED_OF_LIGHT_M_S;
                }
            }
            for (m, sum) in sum.iter_mut().enumerate() {
                let pairs: f64 = (0..64 - m).map(|n| h[n] * h[n + m]).sum();
                *sum += pairs
                    * Noise::White
                        .covariance(&sampling, m as f64, SignalKind::Real)
                        .re
                    / 0.2
                    / snr;
            }
            sum
        };
        for (name, estimator) in [("first moment", &moment as &dyn Estimator), ("peak", &peak)] {
            let shown = response(&statistic, estimator, (Noise::White, snr), radius_m)
                .map(&model, &wake(), &LINES_RAD, &RANGES_M)
                .unwrap();
            // ranges between nodes
            let close = [RANGES_M[0], RANGES_M[1], RANGES_M[1] + 1e-9, RANGES_M[2]];
            let between = response(&statistic, estimator, (Noise::White, snr), radius_m)
                .map(&model, &wake(), &LINES_RAD, &close)
                .unwrap();
            for (gate, place) in [(0, 0), (1, 1), (1, 2), (2, 3)] {
                assert!(
                    (between[[1, place]] - shown[[1, gate]]).abs() < 0.02,
                    "{name} {between} {shown}"
                );
            }
            for (gate, &range_m) in RANGES_M.iter().enumerate() {
                // the other lines are 1.1 and 0.93 m away at 372 m
                let chord = |line: usize| {
                    (radius_m.powi(2) - (range_m * (LINES_RAD[line] - 0.115)).powi(2)).sqrt()
                };
                let mut mean = vec![0.0; 64];
                for line in 0..3 {
                    let one = correlogram(line, range_m);
                    mean.iter_mut()
                        .zip(one)
                        .for_each(|(mean, one)| *mean += chord(line) * one);
                }
                let expected = estimator.estimate(&mean, &mut Scratch::new()).velocity_m_s;
                assert!(
                    (shown[[1, gate]] - expected).abs() < 0.01,
                    "{name} {range_m} {} {expected}",
                    shown[[1, gate]]
                );
            }
        }
    }

    #[test]
    fn what_does_not_match_is_refused() {
        let statistic = Correlogram::<f64>::new(Weighting::default(), 64).unwrap();
        let peak = SpectralPeak::new(
            &sampling(),
            SignalKind::Real,
            &unweighted_lags(64),
            1024,
            Refinement::Parabola,
        )
        .unwrap();
        let short = SpectralPeak::new(
            &sampling(),
            SignalKind::Real,
            &unweighted_lags(32),
            1024,
            Refinement::Parabola,
        )
        .unwrap();
        let new = |estimator: &SpectralPeak, snr, radius_m| {
            let noise = (Noise::White, snr);
            EstimatorResponse::new(&statistic, estimator, &sampling(), SIGMA_S, noise, radius_m)
                .map(|_| ())
        };
        assert!(matches!(new(&short, 1.0, 2.0), Err(Error::Length { .. })));
        assert!(matches!(
            new(&peak, 0.0, 2.0),
            Err(Error::OutOfRange { field: "snr", .. })
        ));
        assert!(matches!(
            new(&peak, 1.0, f64::NAN),
            Err(Error::OutOfRange {
                field: "radius_m",
                ..
            })
        ));
        let noise = (Noise::White, 1.0);
        assert!(matches!(
            EstimatorResponse::new(&statistic, &peak, &sampling(), 0.0, noise, 2.0),
            Err(Error::OutOfRange {
                field: "pulse_sigma_s",
                ..
            })
        ));
        let response = response(&statistic, &peak, noise, 2.0);
        let map = response.map(&WakeModel::default(), &wake(), &LINES_RAD, &[400.0, 390.0]);
        assert!(matches!(
            map,
            Err(Error::OutOfRange {
                field: "range_m",
                ..
            })
        ));
    }
}
