//! Circular regions in a scan: which windows of which lines of sight lie within a distance of a point.
//!
//! Computes the set {k : dist(p, k) <= rho} of Table 3 as one interval of gates (a chord) per line of sight.
//! Check: against the distance of every window; the accumulation levels 11, 43, 169 for 1, 2, 4 m
//! at 400 m with 0.5 m between lines and 0.6 m between windows; both forms of the rays of one scan give the same rays.

use std::ops::Range;

use crate::error::{
    Error, at_least_one, check, finite, increasing, length, not_empty, not_negative, positive,
};
use crate::window::{Gates, Sampling};

/// The line of sight of a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LineOfSight {
    /// Index of a line of the scan.
    Index(usize),
    /// Elevation \[rad\] in a plane scan; it need not be that of a line.
    Elevation(f64),
}

/// A point of a scan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PolarPoint {
    /// Distance from the lidar \[m\].
    pub range_m: f64,
    /// Its line of sight.
    pub line: LineOfSight,
}

impl PolarPoint {
    /// The point at a range \[m\] on the line of sight of index `line`.
    #[must_use]
    pub fn on_line(range_m: f64, line: usize) -> Self {
        Self {
            range_m,
            line: LineOfSight::Index(line),
        }
    }

    /// The point at a range \[m\] and an elevation \[rad\] of a plane scan.
    #[must_use]
    pub fn at_elevation(range_m: f64, elevation_rad: f64) -> Self {
        Self {
            range_m,
            line: LineOfSight::Elevation(elevation_rad),
        }
    }
}

/// All pairs of elevation \[rad\] and range \[m\] of a plane scan, ranges running fastest: a map \[elevation, range\].
#[must_use]
pub fn polar_points(elevation_rad: &[f64], range_m: &[f64]) -> Vec<PolarPoint> {
    let mut points = Vec::with_capacity(elevation_rad.len() * range_m.len());
    for &elevation_rad in elevation_rad {
        for &range_m in range_m {
            points.push(PolarPoint::at_elevation(range_m, elevation_rad));
        }
    }
    points
}

/// Which records (rays) belong to each line of sight: listed, which needs memory for each ray, or one line after the other.
#[derive(Debug, Clone)]
pub(crate) struct Rays {
    /// Position of the first ray of each line, and one behind the last of all.
    bounds: Vec<usize>,
    /// The ray at each position, increasing within a line; none where the rays are in the order of the lines.
    listed: Option<Vec<usize>>,
}

impl Rays {
    /// One line after the other: the first ray of each, and one behind the last of all.
    pub(crate) fn in_order(bounds: Vec<usize>) -> Self {
        Self {
            bounds,
            listed: None,
        }
    }

    /// The different elevations \[rad\], increasing, and the rays of each.
    pub(crate) fn grouped(elevation_rad: &[f64]) -> (Vec<f64>, Self) {
        let mut order: Vec<usize> = (0..elevation_rad.len()).collect();
        order.sort_by(|&a, &b| {
            elevation_rad[a]
                .total_cmp(&elevation_rad[b])
                .then(a.cmp(&b))
        });
        let mut lines = Vec::new();
        let mut bounds = Vec::new();
        for (position, &ray) in order.iter().enumerate() {
            if lines.last() != Some(&elevation_rad[ray]) {
                lines.push(elevation_rad[ray]);
                bounds.push(position);
            }
        }
        bounds.push(order.len());
        (
            lines,
            Self {
                bounds,
                listed: Some(order),
            },
        )
    }

    /// Positions of the rays of a line; empty for a line that does not exist.
    fn positions(&self, line: usize) -> Range<usize> {
        match self.bounds.get(line..line + 2) {
            Some(bounds) => bounds[0]..bounds[1],
            None => 0..0,
        }
    }

    /// Number of rays of a line.
    pub(crate) fn count(&self, line: usize) -> usize {
        self.positions(line).len()
    }

    /// The rays of a line that are in `range`, increasing.
    pub(crate) fn within(
        &self,
        line: usize,
        range: &Range<usize>,
    ) -> impl Iterator<Item = usize> + '_ {
        let positions = self.positions(line);
        let listed = self.listed.as_deref();
        let within = match listed {
            Some(rays) => {
                let of_line = &rays[positions.clone()];
                let first = of_line.partition_point(|ray| *ray < range.start);
                let end = of_line.partition_point(|ray| *ray < range.end);
                positions.start + first..positions.start + end
            }
            None => positions.start.max(range.start)..positions.end.min(range.end),
        };
        within.map(move |position| listed.map_or(position, |rays| rays[position]))
    }
}

/// Refuses an empty list of elevations, and one that is not finite or beyond +-pi.
pub(crate) fn check_angles(elevation_rad: &[f64]) -> Result<(), Error> {
    not_empty("elevation_rad", elevation_rad.len())?;
    for &value in elevation_rad {
        finite("elevation_rad", value)?;
        let is_allowed = value.abs() <= std::f64::consts::PI;
        check("elevation_rad", value, "between -pi and pi", is_allowed)?;
    }
    Ok(())
}

/// Where the windows of a scan are. Rays (pulses) of equal elevation form one line of sight.
#[derive(Debug, Clone)]
pub struct ScanGeometry {
    /// Elevations of the lines of a plane scan; empty otherwise.
    elevation_rad: Vec<f64>,
    /// Direction of each line that is in no plane, and the lines that may share its regions; empty for a plane scan.
    sphere: Vec<([f64; 3], Range<usize>)>,
    /// Greatest distance between the unit vectors of consecutive lines of a group; 0 for a plane scan.
    largest_step: f64,
    pub(crate) rays: Rays,
    first_range_m: f64,
    spacing_m: f64,
    gates: usize,
}

impl ScanGeometry {
    /// Geometry of rays at `elevation_rad`, in any order, with records of `record_samples` samples.
    ///
    /// # Errors
    /// [`Error::Empty`] without rays, [`Error::OutOfRange`] for an angle beyond +-pi, and as [`Gates::count`].
    pub fn new(
        sampling: &Sampling,
        gates: &Gates,
        elevation_rad: &[f64],
        record_samples: usize,
    ) -> Result<Self, Error> {
        check_angles(elevation_rad)?;
        let (lines, rays) = Rays::grouped(elevation_rad);
        Self::with_rays(rays, lines, Vec::new(), sampling, gates, record_samples)
    }

    /// Geometry of lines of sight at `elevation_rad`, increasing, each with `rays_per_line` consecutive records, one
    /// line after the other. It needs no memory for each ray.
    ///
    /// # Errors
    /// As [`ScanGeometry::new`]; [`Error::OutOfRange`] for angles that do not increase or lines without rays.
    pub fn regular(
        sampling: &Sampling,
        gates: &Gates,
        elevation_rad: &[f64],
        rays_per_line: usize,
        record_samples: usize,
    ) -> Result<Self, Error> {
        check_angles(elevation_rad)?;
        increasing("elevation_rad", elevation_rad)?;
        at_least_one("rays_per_line", rays_per_line)?;
        let bounds = (0..=elevation_rad.len())
            .map(|line| line * rays_per_line)
            .collect();
        Self::with_rays(
            Rays::in_order(bounds),
            elevation_rad.to_vec(),
            Vec::new(),
            sampling,
            gates,
            record_samples,
        )
    }

    /// Geometry of lines of sight in any direction: unit vectors, one for each line. Points have the index of their line. Regions hold
    /// the windows within a distance on consecutive lines of the same `group`: those of one sweep, not those of another time. Line `i`
    /// has the rays `first_ray[i] .. first_ray[i + 1]`.
    ///
    /// # Errors
    /// [`Error::Empty`] without lines, [`Error::Length`] for lists that do not match, and as [`Gates::count`].
    pub fn on_sphere(
        sampling: &Sampling,
        gates: &Gates,
        direction: &[[f64; 3]],
        group: &[usize],
        first_ray: &[usize],
        record_samples: usize,
    ) -> Result<Self, Error> {
        let lines = direction.len();
        not_empty("direction", lines)?;
        length("group", lines, group.len())?;
        length("first_ray", lines + 1, first_ray.len())?;
        let mut sphere = Vec::with_capacity(lines);
        for part in group.chunk_by(|a, b| a == b) {
            let start = sphere.len();
            let shared = start..start + part.len();
            for line in shared.clone() {
                sphere.push((direction[line], shared.clone()));
            }
        }
        let rays = Rays::in_order(first_ray.to_vec());
        Self::with_rays(rays, Vec::new(), sphere, sampling, gates, record_samples)
    }

    fn with_rays(
        rays: Rays,
        elevation_rad: Vec<f64>,
        sphere: Vec<([f64; 3], Range<usize>)>,
        sampling: &Sampling,
        gates: &Gates,
        record_samples: usize,
    ) -> Result<Self, Error> {
        sampling.validate()?;
        let mut largest_step: f64 = 0.0;
        for pair in sphere.windows(2) {
            if pair[0].1 == pair[1].1 {
                largest_step = largest_step.max(distance(&pair[0].0, &pair[1].0));
            }
        }
        Ok(Self {
            elevation_rad,
            sphere,
            largest_step,
            rays,
            first_range_m: gates.range_m(0, sampling),
            spacing_m: gates.spacing_m(sampling),
            gates: gates.count(record_samples)?,
        })
    }

    /// Number of lines of sight.
    #[must_use]
    pub fn lines(&self) -> usize {
        self.elevation_rad.len().max(self.sphere.len())
    }

    /// Elevations of the lines of sight of a plane scan \[rad\], increasing, each once; empty for lines in other directions.
    #[must_use]
    pub fn line_elevation_rad(&self) -> &[f64] {
        &self.elevation_rad
    }

    /// All pairs of a line of sight and a range \[m\], ranges running fastest: a map \[line, range\].
    #[must_use]
    pub fn points(&self, range_m: &[f64]) -> Vec<PolarPoint> {
        let mut points = Vec::with_capacity(self.lines() * range_m.len());
        for line in 0..self.lines() {
            for &range_m in range_m {
                points.push(PolarPoint::on_line(range_m, line));
            }
        }
        points
    }

    /// Rays (rows of the records) of a line of sight, increasing.
    pub fn line_rays(&self, line: usize) -> impl Iterator<Item = usize> + '_ {
        self.rays.within(line, &(0..usize::MAX))
    }

    /// Number of windows along a ray.
    #[must_use]
    pub fn gates(&self) -> usize {
        self.gates
    }

    /// Ranges of the window centres \[m\].
    #[must_use]
    pub fn gate_ranges_m(&self) -> Vec<f64> {
        (0..self.gates)
            .map(|gate| self.first_range_m + gate as f64 * self.spacing_m)
            .collect()
    }

    /// Gates whose ranges are from `low_m` to `high_m`, and one more at each end.
    #[must_use]
    pub fn gates_between(&self, low_m: f64, high_m: f64) -> Range<usize> {
        let low = self.gate_at(low_m).floor().max(0.0) as usize;
        let high = self.gate_at(high_m).ceil().max(0.0) as usize;
        let start = low.min(self.gates - 1);
        start..(high + 1).clamp(start + 1, self.gates)
    }

    /// Fractional index of the gate at a range \[m\].
    fn gate_at(&self, range_m: f64) -> f64 {
        (range_m - self.first_range_m) / self.spacing_m
    }

    /// Chords of the disc of radius `radius_m` \[m\] about `point`: lines of sight by increasing
    /// elevation, and the gates of each that lie in it.
    ///
    /// A window on the circle counts as inside (up to a millionth of the gate spacing).
    pub fn chords(
        &self,
        point: PolarPoint,
        radius_m: f64,
    ) -> impl Iterator<Item = (usize, Range<usize>)> + '_ {
        let slack_m = 1e-6 * self.spacing_m;
        let radius_m = radius_m + slack_m;
        let reach = reach_of_disc(radius_m / point.range_m);
        let mut lines = self.lines_near(point, radius_m);
        std::iter::from_fn(move || {
            while let Some(line) = lines.next() {
                let missed = self.lines_that_miss(point.line, line, reach);
                if missed > 0 {
                    lines.start = lines.start.saturating_add(missed - 1).min(lines.end);
                } else if let Some(gates) = self.gates_within(point, radius_m, line) {
                    return Some((line, gates));
                }
            }
            None
        })
    }

    /// The chord of a disc along a line.
    fn gates_within(&self, point: PolarPoint, radius_m: f64, line: usize) -> Option<Range<usize>> {
        let (sin, cos) = self.sin_cos_to(point.line, line);
        let across_m = point.range_m * sin;
        let along_m = point.range_m * cos;
        let half_m = (radius_m * radius_m - across_m * across_m).sqrt();
        // A line that misses the disc: max and min below would leave out the NaN.
        if half_m.is_nan() {
            return None;
        }
        let first = self.gate_at(along_m - half_m).ceil().max(0.0);
        let last = self.gate_at(along_m + half_m).floor();
        let last = last.min(self.gates as f64 - 1.0);
        (first <= last).then_some(first as usize..last as usize + 1)
    }

    /// Lines that may touch the disc; none for a point on a line that the scan does not have.
    fn lines_near(&self, point: PolarPoint, radius_m: f64) -> Range<usize> {
        if let LineOfSight::Index(line) = point.line
            && let Some((_, shared)) = self.sphere.get(line)
        {
            return shared.clone();
        }
        let Some(elevation_rad) = self.elevation_of(point.line) else {
            return 0..0;
        };
        let reach_rad = if radius_m < point.range_m {
            (radius_m / point.range_m).asin()
        } else {
            std::f64::consts::PI
        };
        let lines = &self.elevation_rad;
        let start = lines.partition_point(|line| *line < elevation_rad - reach_rad);
        let end = lines.partition_point(|line| *line <= elevation_rad + reach_rad);
        start..end.max(start)
    }

    /// How many lines from `other` on miss a disc on `line`, for all that is known without their angles: unit vectors of consecutive
    /// lines of a group are at most [`Self::largest_step`] apart. 0 for lines in a plane, of which only those near are looked at.
    fn lines_that_miss(&self, line: LineOfSight, other: usize, reach: f64) -> usize {
        let LineOfSight::Index(line) = line else {
            return 0;
        };
        let Some((direction, _)) = self.sphere.get(line) else {
            return 0;
        };
        let beyond = distance(direction, &self.sphere[other].0) - reach;
        if beyond > 0.0 {
            ((beyond / self.largest_step) as usize).saturating_add(1)
        } else {
            0
        }
    }

    /// Elevation of a line of sight of a plane scan \[rad\].
    fn elevation_of(&self, line: LineOfSight) -> Option<f64> {
        match line {
            LineOfSight::Index(line) => self.elevation_rad.get(line).copied(),
            LineOfSight::Elevation(elevation_rad) => Some(elevation_rad),
        }
    }

    /// Sine and cosine of the angle between a line of sight and the line `other`.
    fn sin_cos_to(&self, line: LineOfSight, other: usize) -> (f64, f64) {
        if let LineOfSight::Index(line) = line
            && let Some((direction, _)) = self.sphere.get(line)
        {
            return sin_cos_between(direction, &self.sphere[other].0);
        }
        let elevation_rad = self.elevation_of(line).unwrap_or(f64::NAN);
        (self.elevation_rad[other] - elevation_rad).sin_cos()
    }

    /// Accumulation level and n_eff of a region when all samples are valid (figure 9), without any signal.
    #[must_use]
    pub fn level(
        &self,
        point: PolarPoint,
        radius_m: f64,
        correlation: &WindowCorrelation,
    ) -> (usize, f64) {
        let mut pairs = 0.0;
        for (line, gates) in self.chords(point, radius_m) {
            pairs += self.rays.count(line) as f64 * correlation.pair_sum(gates.len());
        }
        let level = self.windows(point, radius_m);
        (level, effective(level, pairs))
    }

    /// Windows of a region, when all samples are valid.
    #[must_use]
    pub fn windows(&self, point: PolarPoint, radius_m: f64) -> usize {
        let mut windows = 0;
        for (line, gates) in self.chords(point, radius_m) {
            windows += self.rays.count(line) * gates.len();
        }
        windows
    }

    /// Information of a region when all samples are valid, by each of some curves; 0 without any. A curve holds the information of a
    /// ray whose chord has 1, 2, .. gates; longer chords have the last of it.
    #[must_use]
    pub fn information<const CURVES: usize>(
        &self,
        point: PolarPoint,
        radius_m: f64,
        by_gates: [&[f64]; CURVES],
    ) -> [f64; CURVES] {
        let mut information = [0.0; CURVES];
        for (line, gates) in self.chords(point, radius_m) {
            let rays = self.rays.count(line) as f64;
            for (sum, by_gates) in information.iter_mut().zip(by_gates) {
                let index = gates.len().min(by_gates.len()).wrapping_sub(1);
                *sum += rays * by_gates.get(index).copied().unwrap_or(0.0);
            }
        }
        information
    }

    /// Most gates of a chord of regions of a radius.
    #[must_use]
    pub fn most_gates(&self, radius_m: f64) -> usize {
        ((2.0 * radius_m / self.spacing_m + 1e-5) as usize).min(self.gates - 1) + 1
    }
}

/// Greatest distance between the unit vectors of two lines one of which touches a disc about the other, by the ratio of radius to
/// range; greater by more than rounding, so that none is lost.
fn reach_of_disc(ratio: f64) -> f64 {
    if ratio < 1.0 {
        2.0 * (0.5 * ratio.asin()).sin() + 1e-9
    } else {
        f64::INFINITY
    }
}

/// Distance between two points.
fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b));
    squares.sum::<f64>().sqrt()
}

/// Sine and cosine of the angle between two directions; the sine is not negative.
fn sin_cos_between([a, b, c]: &[f64; 3], [d, e, f]: &[f64; 3]) -> (f64, f64) {
    let cross = [b * f - c * e, c * d - a * f, a * e - b * d];
    (
        cross.iter().map(|x| x * x).sum::<f64>().sqrt(),
        a * d + b * e + c * f,
    )
}

/// (sum n)^2 / sum over pairs of gamma^2; 0 for an empty region.
pub(crate) fn effective(level: usize, pairs: f64) -> f64 {
    if level == 0 {
        0.0
    } else {
        (level as f64).powi(2) / pairs
    }
}

/// Covariance between the windows of one pulse against their distance in gates, of the signal and of the noise: that of their
/// Fourier coefficients at the peak.
#[derive(Debug, Clone, PartialEq)]
pub struct WindowCovariance {
    signal: Vec<f64>,
    noise: Vec<f64>,
}

impl WindowCovariance {
    /// From the weights of a window and the covariances of the samples by their lag, the carrier removed; those of signal and noise
    /// in one unit. Up to `gates` windows, as far apart as either is known to reach.
    ///
    /// # Errors
    /// [`Error::Empty`] without weights.
    pub fn new(
        weights: &[f64],
        step_samples: usize,
        gates: usize,
        signal: impl Fn(usize) -> f64,
        noise: impl Fn(usize) -> f64,
    ) -> Result<Self, Error> {
        not_empty("weights", weights.len())?;
        let mut overlap = Vec::with_capacity(weights.len());
        for d in 0..weights.len() {
            let products = weights[d..].iter().zip(weights).map(|(a, b)| a * b);
            overlap.push(products.sum::<f64>());
        }
        let whole = windowed_covariance(&overlap, 0, &signal);
        let mut of_signal = vec![whole];
        for gate in 1..gates {
            let value = windowed_covariance(&overlap, gate * step_samples, &signal);
            let is_correlated = value.abs() > 1e-8 * whole;
            if !is_correlated {
                break;
            }
            of_signal.push(value);
        }
        let mut of_noise = vec![windowed_covariance(&overlap, 0, &noise)];
        // Band-limited noise is correlated at any distance, but negligibly where windows share no sample.
        for gate in 1..gates {
            if gate * step_samples >= 2 * weights.len() {
                break;
            }
            of_noise.push(windowed_covariance(&overlap, gate * step_samples, &noise));
        }
        Ok(Self {
            signal: of_signal,
            noise: of_noise,
        })
    }

    /// The correlation where the signal is `snr` times what it was given as, or the noise so much less. Without any signal it is that of
    /// noise, which a small ratio says as well.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if the power of the window is not above 0.
    pub fn correlation(&self, snr: f64) -> Result<WindowCorrelation, Error> {
        let noise_factor = snr.recip().min(1e12);
        let noise_gates = if noise_factor > 0.0 {
            self.noise.len()
        } else {
            0
        };
        let mut covariance = Vec::new();
        for gate in 0..self.signal.len().max(noise_gates) {
            let signal = self.signal.get(gate).copied().unwrap_or(0.0);
            let noise = self.noise.get(gate).copied().unwrap_or(0.0);
            covariance.push(signal + noise_factor * noise);
        }
        let power = covariance[0];
        positive("power of the window", power)?;
        for value in &mut covariance {
            *value = (*value / power).abs();
        }
        WindowCorrelation::from_gate_lags(&covariance)
    }
}

/// Covariance of the weighted sums of two windows that begin `shift` samples apart: `overlap` is the correlation of their weights,
/// `covariance` that of the samples by their lag.
fn windowed_covariance(overlap: &[f64], shift: usize, covariance: &dyn Fn(usize) -> f64) -> f64 {
    let reach = overlap.len() as i64 - 1;
    let mut sum = 0.0;
    for d in -reach..=reach {
        let lag = (shift as i64 + d).unsigned_abs() as usize;
        sum += overlap[d.unsigned_abs() as usize] * covariance(lag);
    }
    sum
}

/// Correlation gamma between the windowed signals of one pulse against their distance in gates.
///
/// Their powers have the correlation gamma^2. Windows of different pulses are independent.
#[derive(Debug, Clone, PartialEq)]
pub struct WindowCorrelation {
    squared: Vec<f64>,
}

impl WindowCorrelation {
    /// From gamma for windows 0, 1, 2, ... gates apart; 0 beyond the last. gamma(0) must be 1.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if gamma(0) is not 1 or another is beyond 0 .. 1.
    pub fn from_gate_lags(gamma: &[f64]) -> Result<Self, Error> {
        let first = gamma.first().copied().unwrap_or(f64::NAN);
        check("gamma[0]", first, "1", (first - 1.0).abs() <= 1e-9)?;
        for &value in gamma {
            let is_allowed = (0.0..=1.0 + 1e-9).contains(&value);
            check("gamma", value, "between 0 and 1", is_allowed)?;
        }
        Ok(Self {
            squared: gamma.iter().map(|value| value * value).collect(),
        })
    }

    /// For a Gaussian pulse, |f|^2 ~ exp(-t^2 / sigma^2), in uniform wind with white noise.
    ///
    /// `pulse_sigma_s` is the half-width of |f|^2 at 1/e \[s\]; `noise_to_signal` is F_s/(B SNR), the density of the noise over
    /// the signal power: the ratio of the variances of complex samples, and twice that of real ones, whose signal stands at one of
    /// two frequencies (5 / SNR when the band is a fifth of the rate).
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a pulse or noise that is not positive, and as [`WindowCovariance::new`].
    pub fn gaussian_pulse(
        weights: &[f64],
        gates: &Gates,
        count: usize,
        sample_rate_hz: f64,
        pulse_sigma_s: f64,
        noise_to_signal: f64,
    ) -> Result<Self, Error> {
        positive("pulse_sigma_s", pulse_sigma_s)?;
        positive("sample_rate_hz", sample_rate_hz)?;
        not_negative("noise_to_signal", noise_to_signal)?;
        length("weights", gates.window_samples, weights.len())?;
        WindowCovariance::new(
            weights,
            gates.step_samples,
            count,
            |lag_samples| {
                let lag = lag_samples as f64 / (sample_rate_hz * pulse_sigma_s);
                let is_same_sample = lag_samples == 0;
                let noise = if is_same_sample { noise_to_signal } else { 0.0 };
                (-0.25 * lag * lag).exp() + noise
            },
            |_| 0.0,
        )?
        .correlation(f64::INFINITY)
    }

    /// gamma^2 of two windows of one pulse `gates` apart.
    #[must_use]
    pub fn squared(&self, gates: usize) -> f64 {
        self.squared.get(gates).copied().unwrap_or(0.0)
    }

    /// Sum of gamma^2 over all ordered pairs of `gates` consecutive windows.
    #[must_use]
    pub fn pair_sum(&self, gates: usize) -> f64 {
        let diagonal = gates as f64 * self.squared(0);
        let off: f64 = (1..gates.min(self.squared.len()))
            .map(|k| (gates - k) as f64 * self.squared[k])
            .sum();
        diagonal + 2.0 * off
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::window::Weighting;
    use approx::assert_relative_eq;

    fn sampling() -> Sampling {
        Sampling::new(250e6, 80e6, 1.55e-6, (55e6, 105e6)).unwrap()
    }

    /// Lines 0.5 m apart at 400 m, windows every sample, one window centred on exactly 400 m.
    fn around_400_m() -> (ScanGeometry, PolarPoint) {
        let centre_s = 2.0 * 400.0 / crate::window::SPEED_OF_LIGHT_M_S;
        let gates = Gates::new(64, 1, centre_s - 132.0 / 250e6).unwrap();
        let elevation_rad: Vec<f64> = (0..81).map(|i| (i as f64 - 40.0) * 0.5 / 400.0).collect();
        let geometry = ScanGeometry::new(&sampling(), &gates, &elevation_rad, 264).unwrap();
        let point = PolarPoint::at_elevation(400.0, 0.0);
        (geometry, point)
    }

    #[test]
    fn both_forms_give_the_same_rays() {
        let (_, listed) = Rays::grouped(&[0.1, 0.1, 0.1, 0.2, 0.2, 0.2, 0.3, 0.3, 0.3]);
        let bounds = Rays::in_order(vec![0, 3, 6, 9]);
        for range in [0..9, 2..7, 4..5, 5..5, 8..20] {
            for line in 0..3 {
                let of = |rays: &Rays| rays.within(line, &range).collect::<Vec<_>>();
                assert_eq!(of(&listed), of(&bounds), "{line} {range:?}");
                assert_eq!((listed.count(line), bounds.count(line)), (3, 3));
            }
        }
    }

    #[test]
    fn accumulation_levels_at_400_m_are_11_43_169() {
        let (geometry, point) = around_400_m();
        let alone = WindowCorrelation::from_gate_lags(&[1.0]).unwrap();
        for (radius_m, level) in [(1.0, 11), (2.0, 43), (4.0, 169)] {
            let (found, n_eff) = geometry.level(point, radius_m, &alone);
            assert_eq!(found, level);
            // without correlation every window counts
            assert_relative_eq!(n_eff, level as f64, max_relative = 1e-12);
        }
    }

    #[test]
    fn forty_three_windows_of_nine_pulses_are_worth_seven_and_a_half() {
        let (geometry, point) = around_400_m();
        let gates = Gates::new(64, 1, 0.0).unwrap();
        let weights = Weighting::Rectangular.weights(64).unwrap();
        let sigma_s = 200e-9 / (2.0 * 2.0_f64.ln().sqrt());
        // The noise hardly shows here; that it is right, other windows tell.
        for noise_to_signal in [0.0, 2.5, 25.0] {
            let correlation = WindowCorrelation::gaussian_pulse(
                &weights,
                &gates,
                100,
                250e6,
                sigma_s,
                noise_to_signal,
            )
            .unwrap();
            let (_, n_eff) = geometry.level(point, 2.0, &correlation);
            assert!((n_eff - 7.5).abs() < 0.15, "{n_eff}");
        }
        let identical = WindowCorrelation::from_gate_lags(&[1.0; 20]).unwrap();
        let (_, n_eff) = geometry.level(point, 2.0, &identical);
        assert_relative_eq!(n_eff, 43.0 * 43.0 / 249.0, max_relative = 1e-12);
    }

    #[test]
    fn information_of_a_region_is_the_sum_over_its_rays_of_that_of_their_chords() {
        let (geometry, point) = around_400_m();
        let by_gates: Vec<f64> = (1..=20).map(|gates| f64::from(gates).powf(1.5)).collect();
        let direct: f64 = geometry
            .chords(point, 2.0)
            .map(|(_, gates)| by_gates[gates.len() - 1])
            .sum();
        assert_relative_eq!(
            geometry.information(point, 2.0, [&by_gates])[0],
            direct,
            max_relative = 1e-12
        );
        assert_eq!(
            geometry
                .chords(point, 2.0)
                .map(|(_, gates)| gates.len())
                .max(),
            Some(geometry.most_gates(2.0))
        );
        // Longer chords than are known have what the longest known has.
        assert_relative_eq!(geometry.information(point, 2.0, [&[2.0]])[0], 18.0);
        assert_eq!(geometry.information(point, 2.0, [&[]])[0], 0.0);
    }

    #[test]
    fn regions_on_a_sphere_hold_the_windows_within_the_radius_of_their_group() {
        let gates = Gates::new(64, 3, 0.0).unwrap();
        // A cone of 40 lines, in two turns that do not see each other.
        let cone = |i: u32| {
            let (sin, cos) = (f64::from(i) * 0.02).sin_cos();
            [0.8 * cos, 0.8 * sin, 0.6]
        };
        let direction: Vec<[f64; 3]> = (0..20).chain(0..20).map(cone).collect();
        let group: Vec<usize> = (0..40).map(|i| i / 20).collect();
        let bounds: Vec<usize> = (0..=40).map(|i| 3 * i).collect();
        let geometry =
            ScanGeometry::on_sphere(&sampling(), &gates, &direction, &group, &bounds, 300).unwrap();
        let ranges_m = geometry.gate_ranges_m();
        for (line, gate, radius_m) in [(25, 10, 6.0), (0, 40, 3.0), (39, 70, 0.0)] {
            let at = |line: usize, range_m: f64| direction[line].map(|e| e * range_m);
            let centre = at(line, ranges_m[gate]);
            let mut inside = vec![];
            for other in 0..40 {
                for (k, r_m) in ranges_m.iter().enumerate() {
                    let apart: f64 = at(other, *r_m)
                        .iter()
                        .zip(centre)
                        .map(|(a, b)| (a - b).powi(2))
                        .sum();
                    if group[other] == group[line] && apart.sqrt() <= radius_m + 1e-6 {
                        inside.push((other, k));
                    }
                }
            }
            let point = PolarPoint::on_line(ranges_m[gate], line);
            let found: Vec<_> = geometry
                .chords(point, radius_m)
                .flat_map(|(line, gates)| gates.map(move |gate| (line, gate)))
                .collect();
            assert_eq!(found, inside, "{line} {gate} {radius_m}");
            assert_eq!(
                geometry.line_rays(line).collect::<Vec<_>>(),
                [3 * line, 3 * line + 1, 3 * line + 2]
            );
        }
    }

    #[test]
    fn chords_hold_exactly_the_windows_within_the_radius() {
        let gates = Gates::new(64, 3, 0.0).unwrap();
        let elevation_rad = [0.3, 0.1, -0.2, 0.1, 0.05, 3.0, 1.2];
        let geometry = ScanGeometry::new(&sampling(), &gates, &elevation_rad, 300).unwrap();
        assert_eq!(geometry.line_elevation_rad().len(), 6);
        assert_eq!(geometry.line_rays(2).collect::<Vec<_>>(), [1, 3]);
        let ranges_m = geometry.gate_ranges_m();
        for (range_m, elevation_rad, radius_m) in [
            (50.0, 0.07, 6.3),
            (20.0, 0.2, 25.0),
            (90.0, 0.1, 0.0),
            (ranges_m[5], 0.1, 0.0),
            (500.0, 0.0, 2.0),
        ] {
            let point = PolarPoint::at_elevation(range_m, elevation_rad);
            let mut inside = vec![];
            for (line, angle_rad) in geometry.line_elevation_rad().iter().enumerate() {
                for (gate, r_m) in ranges_m.iter().enumerate() {
                    let (dx_m, dy_m) = (
                        r_m * angle_rad.cos() - range_m * elevation_rad.cos(),
                        r_m * angle_rad.sin() - range_m * elevation_rad.sin(),
                    );
                    if dx_m.hypot(dy_m) <= radius_m + 1e-6 {
                        inside.push((line, gate));
                    }
                }
            }
            let found: Vec<_> = geometry
                .chords(point, radius_m)
                .flat_map(|(line, gates)| gates.map(move |gate| (line, gate)))
                .collect();
            assert_eq!(found, inside, "{point:?} {radius_m}");
        }
    }

    #[test]
    fn pair_sum_is_the_double_sum() {
        let correlation = WindowCorrelation::from_gate_lags(&[1.0, 0.8, 0.5, 0.1]).unwrap();
        for gates in 1..9_usize {
            let direct: f64 = (0..gates)
                .flat_map(|i| (0..gates).map(move |j| i.abs_diff(j)))
                .map(|lag| correlation.squared(lag))
                .sum();
            assert_relative_eq!(correlation.pair_sum(gates), direct, max_relative = 1e-12);
        }
    }

    #[test]
    fn impossible_geometry_and_correlation_are_refused() {
        let gates = Gates::new(64, 1, 0.0).unwrap();
        assert!(ScanGeometry::new(&sampling(), &gates, &[], 100).is_err());
        assert!(ScanGeometry::new(&sampling(), &gates, &[f64::NAN], 100).is_err());
        assert!(ScanGeometry::new(&sampling(), &gates, &[4.0], 100).is_err());
        assert!(ScanGeometry::new(&sampling(), &gates, &[0.0], 63).is_err());
        assert!(WindowCorrelation::from_gate_lags(&[0.5]).is_err());
        assert!(WindowCorrelation::from_gate_lags(&[1.0, f64::NAN]).is_err());
        assert!(WindowCovariance::new(&[], 1, 5, |_| 1.0, |_| 0.0).is_err());
    }
}
