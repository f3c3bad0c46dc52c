//! The velocity that a pulsed lidar can at best report: the radial velocity weighted by the pulse,
//! (28), corrected, or by the pulse and the window of the spectral analysis together.
//!
//! `v_pulse(R)` weights the air at range `rho` by `|f(2 (R - rho)/c)|^2 2/c`. A window of N samples
//! is longer: the range of sample n is `c t_n/2`, so `v_gate(R)` weights the air by the mean of
//! these weights with `h_n^2`. The range of a window is `R = c (t_p + N T_s/2)/2`, `t_p` the time
//! of its first sample; its samples are then centred half a sample, `c T_s/4`, before R.
//!
//! Check: a constant is preserved to round-off, and so is a linear profile (at `c T_s/4` before R
//! for a gate); the discrete weights agree with a fine quadrature.

use std::ops::Range;

use multiversion::multiversion;

use crate::error::{check, check_any, check_each, check_length, check_positive};
use crate::{Error, Pulse, SPEED_OF_LIGHT_M_S};

/// Ranges are rounded to this fraction of a layer, so that equal positions between layers share
/// their weights whatever the rounding of the range.
const STEPS_PER_LAYER: f64 = (1_u64 << 24) as f64;

/// Halvings of an interval, which exhaust double precision.
const HALVINGS: usize = 60;

/// Ranges whose sums are formed side by side.
const LANES: usize = 16;

/// Smallest fraction of the weight on air with a known velocity.
const LEAST_KNOWN_WEIGHT: f64 = 0.5;

/// Weights of the air about a range, for profiles on layers of one thickness.
#[derive(Debug, Clone)]
pub struct RangeFilter {
    pulse: Pulse,
    layer_thickness_m: f64,
    /// Times of the samples about `2 R/c` \[s\] and their weights, which sum to 1.
    taps: Vec<(f64, f64)>,
    /// Weights for a range at the centre of a layer.
    centred: LayerWeights,
}

/// Weights of consecutive layers about a layer; they sum to 1.
#[derive(Debug, Clone, Default)]
struct LayerWeights {
    /// Index of the first layer from the central one.
    first: i64,
    weights: Vec<f64>,
}

impl LayerWeights {
    /// Writes the means about some layers of a profile; `is_known`: no velocity is NaN.
    fn apply_into(
        &self,
        layers: &[i64],
        radial_velocity_m_s: &[f64],
        is_known: bool,
        out_m_s: &mut [f64],
    ) {
        let mut side_by_side = 0..0;
        let covered = self.covered(layers, radial_velocity_m_s.len());
        // Fewer ranges, which may lie far apart, are not worth the memory.
        if let Some(stride) = equal_stride(layers)
            && is_known
            && covered.len() >= LANES
        {
            let first = layers[covered.start] + self.first;
            let profile = &radial_velocity_m_s[first as usize..];
            self.means(profile, stride, &mut out_m_s[covered.clone()]);
            side_by_side = covered;
        }
        for (index, layer) in layers.iter().enumerate() {
            if !side_by_side.contains(&index) {
                let first = layer.saturating_add(self.first);
                out_m_s[index] = mean_of_profile(&self.weights, first, radial_velocity_m_s);
            }
        }
    }

    /// Which of some increasing layers have all their weights on a profile of this length.
    fn covered(&self, layers: &[i64], length: usize) -> Range<usize> {
        let last = length as i64 - self.weights.len() as i64;
        let first_of = |layer: &i64| layer.saturating_add(self.first);
        let start = layers.partition_point(|layer| first_of(layer) < 0);
        let end = layers.partition_point(|layer| first_of(layer) <= last);
        start..end.max(start)
    }

    /// Means of a profile from its start, and from 1, 2, .. `stride` layers farther on, each in the
    /// order of its layers.
    fn means(&self, profile: &[f64], stride: usize, out_m_s: &mut [f64]) {
        // Layers of one place between two ranges lie side by side.
        let columns = out_m_s.len().next_multiple_of(LANES) + self.weights.len() / stride;
        let mut phases = vec![0.0; stride * columns];
        for (column, part) in profile.chunks(stride).take(columns).enumerate() {
            for (phase, velocity_m_s) in part.iter().enumerate() {
                phases[phase * columns + column] = *velocity_m_s;
            }
        }
        sums_of_phases(&self.weights, &phases, stride, out_m_s);
        let known: f64 = self.weights.iter().sum();
        for mean in out_m_s {
            *mean /= known;
        }
    }
}

/// The distance between layers that are equally spaced and increase.
fn equal_stride(layers: &[i64]) -> Option<usize> {
    let stride = layers.get(1)?.checked_sub(layers[0])?;
    let is_equal = layers
        .windows(2)
        .all(|pair| pair[0].checked_add(stride) == Some(pair[1]));
    usize::try_from(stride)
        .ok()
        .filter(|stride| is_equal && *stride > 0)
}

/// Weighted sums of `phases` \[layer modulo `stride`, layer over `stride`\].
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn sums_of_phases(weights: &[f64], phases: &[f64], stride: usize, out: &mut [f64]) {
    let columns = phases.len() / stride;
    for (chunk, out) in out.chunks_mut(LANES).enumerate() {
        let mut sums = [0.0; LANES];
        let mut phase = 0;
        let mut column = chunk * LANES;
        for weight in weights {
            let here = &phases[phase * columns + column..][..LANES];
            for i in 0..LANES {
                sums[i] += weight * here[i];
            }
            phase += 1;
            if phase == stride {
                phase = 0;
                column += 1;
            }
        }
        out.copy_from_slice(&sums[..out.len()]);
    }
}

impl RangeFilter {
    /// Weights of the pulse alone: `v_pulse`, (28), corrected.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if the thickness is not positive, or thicker than `c sigma/2` or than
    /// [`Pulse::max_layer_thickness_m`].
    pub fn pulse(pulse: impl Into<Pulse>, layer_thickness_m: f64) -> Result<Self, Error> {
        Self::new(pulse.into(), vec![(0.0, 1.0)], layer_thickness_m)
    }

    /// Weights of the pulse and of an analysis window with the coefficients `window`,
    /// `h_n`: `v_gate`.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] as [`RangeFilter::pulse`], or for a bad sampling rate;
    /// [`Error::Empty`] without coefficients; [`Error::ElementOutOfRange`] if one is not finite,
    /// or all are zero.
    pub fn gate(
        pulse: impl Into<Pulse>,
        window: &[f64],
        sample_rate_hz: f64,
        layer_thickness_m: f64,
    ) -> Result<Self, Error> {
        check_positive("sample_rate_hz", sample_rate_hz)?;
        check_any("window", window.len())?;
        check_each("window", window, "finite", f64::is_finite)?;
        let largest = window
            .iter()
            .fold(0.0_f64, |largest, h| largest.max(h.abs()));
        check_each("window", &window[..1], "not all zero", |_| largest > 0.0)?;
        let half = 0.5 * window.len() as f64;
        let squares = window.iter().map(|h| (h / largest) * (h / largest));
        let sum: f64 = squares.clone().sum();
        let taps = squares
            .enumerate()
            .map(|(n, square)| ((n as f64 - half) / sample_rate_hz, square / sum))
            .collect();
        Self::new(pulse.into(), taps, layer_thickness_m)
    }

    fn new(pulse: Pulse, taps: Vec<(f64, f64)>, layer_thickness_m: f64) -> Result<Self, Error> {
        check_positive("layer_thickness_m", layer_thickness_m)?;
        let length_m = pulse.sigma_m();
        let thickest_m = length_m.min(pulse.max_layer_thickness_m());
        let allowed = "at most c sigma/2 (less for a pulse with steep edges) and above 1e-7 of it";
        check("layer_thickness_m", layer_thickness_m, allowed, |t| {
            t <= thickest_m && t > 1e-7 * length_m
        })?;
        let mut filter = Self {
            pulse,
            layer_thickness_m,
            taps,
            centred: LayerWeights::default(),
        };
        filter.centred = filter.layer_weights(0.0);
        Ok(filter)
    }

    /// Weight of the air at `offset_m` beyond the range in question \[1/m\]; integrates to 1.
    pub fn weight_per_m(&self, offset_m: f64) -> f64 {
        self.taps
            .iter()
            .map(|&(time_s, weight)| {
                let sample_m = 0.5 * SPEED_OF_LIGHT_M_S * time_s;
                weight * self.pulse.range_weight_per_m(sample_m - offset_m)
            })
            .sum()
    }

    /// Standard deviation of the weights in range \[m\]: that of the pulse and that of the window,
    /// squared and added.
    pub fn standard_deviation_m(&self) -> f64 {
        let variance_s2 = self.mean_power_of_time(2) - self.mean_power_of_time(1).powi(2);
        let window_m = 0.5 * SPEED_OF_LIGHT_M_S * variance_s2.max(0.0).sqrt();
        window_m.hypot(self.pulse.sigma_m() * std::f64::consts::FRAC_1_SQRT_2)
    }

    /// Mean over the taps of a power of their time.
    fn mean_power_of_time(&self, power: i32) -> f64 {
        self.taps
            .iter()
            .map(|&(time_s, weight)| weight * time_s.powi(power))
            .sum()
    }

    /// Full width of the weights at half their maximum \[m\], between the outermost ranges that
    /// have half of it: the range resolution.
    pub fn full_width_half_maximum_m(&self) -> f64 {
        let (first_m, last_m) = self.reach_m();
        let length_m = last_m - first_m;
        let step_m = self.search_step_m(length_m);
        let steps = (length_m / step_m).ceil() as usize;
        let weights: Vec<f64> = (0..=steps)
            .map(|i| self.weight_per_m(first_m + i as f64 * step_m))
            .collect();
        let top = weights
            .iter()
            .enumerate()
            .max_by(|a, b| a.1.total_cmp(b.1))
            .map_or(0, |(i, _)| i);
        let top_m = first_m + top as f64 * step_m;
        let half = 0.5 * self.largest_weight_per_m(top_m - step_m, top_m + step_m);
        let first = weights.iter().position(|w| *w >= half).unwrap_or(top);
        let last = weights.iter().rposition(|w| *w >= half).unwrap_or(top);
        let near_m = first_m + first as f64 * step_m;
        let far_m = first_m + last as f64 * step_m;
        self.crossing_m(half, far_m + step_m, far_m)
            - self.crossing_m(half, near_m - step_m, near_m)
    }

    /// Step \[m\] of a search over the weights, which are `length_m` long: at most half a sample,
    /// so that the peaks of single samples are found.
    fn search_step_m(&self, length_m: f64) -> f64 {
        let apart_m = sample_m(self.taps.get(1)) - sample_m(self.taps.first());
        let fine_m = if apart_m > 0.0 {
            0.5 * apart_m
        } else {
            length_m
        };
        fine_m
            .min(0.125 * self.pulse.sigma_m())
            .max(5e-5 * length_m)
    }

    /// Largest weight \[1/m\] between two offsets about one maximum.
    fn largest_weight_per_m(&self, mut low_m: f64, mut high_m: f64) -> f64 {
        for _ in 0..HALVINGS {
            let third_m = (high_m - low_m) / 3.0;
            let a_m = low_m + third_m;
            let b_m = high_m - third_m;
            if self.weight_per_m(a_m) < self.weight_per_m(b_m) {
                low_m = a_m;
            } else {
                high_m = b_m;
            }
        }
        self.weight_per_m(0.5 * (low_m + high_m))
    }

    /// Offset \[m\] between `outside_m` and `inside_m` at which the weight crosses `level_per_m`.
    fn crossing_m(&self, level_per_m: f64, mut outside_m: f64, mut inside_m: f64) -> f64 {
        for _ in 0..HALVINGS {
            let middle_m = 0.5 * (outside_m + inside_m);
            if self.weight_per_m(middle_m) < level_per_m {
                outside_m = middle_m;
            } else {
                inside_m = middle_m;
            }
        }
        inside_m
    }

    /// Filtered velocity \[m/s\] at `range_m` of a profile given by a function of range \[m\],
    /// evaluated at the layer thickness apart. Where the function is NaN there are no scatterers;
    /// see [`RangeFilter::apply_into`].
    pub fn at_range(&self, range_m: f64, radial_velocity_m_s: impl Fn(f64) -> f64) -> f64 {
        let LayerWeights { first, weights } = &self.centred;
        let velocities_m_s = (0..weights.len()).map(|i| {
            let offset_m = (first + i as i64) as f64 * self.layer_thickness_m;
            radial_velocity_m_s(range_m + offset_m)
        });
        weighted_mean(weights, velocities_m_s)
    }

    /// Writes the filtered velocity at each of `range_m` of a profile on layers whose centres are
    /// `first_range_m`, `first_range_m + layer_thickness_m` and so on.
    ///
    /// Layers with the velocity NaN (masked), and the air beyond both ends of the profile, return
    /// nothing: the weights of the others are scaled up to 1. Where less than half of the weight
    /// remains, the result is NaN.
    ///
    /// Fastest if the ranges lie on centres of layers, or all at the same position between two.
    ///
    /// # Errors
    /// [`Error::LengthMismatch`] if `out_m_s` does not have one element per range; [`Error::Empty`]
    /// for an empty profile; [`Error::OutOfRange`] for a first range, [`Error::ElementOutOfRange`]
    /// for a range that is not finite.
    pub fn apply_into(
        &self,
        first_range_m: f64,
        radial_velocity_m_s: &[f64],
        range_m: &[f64],
        out_m_s: &mut [f64],
    ) -> Result<(), Error> {
        check("first_range_m", first_range_m, "finite", |_| true)?;
        check_length("out_m_s", out_m_s.len(), range_m.len())?;
        check_any("radial_velocity_m_s", radial_velocity_m_s.len())?;
        let is_known = !radial_velocity_m_s.iter().any(|v| v.is_nan());
        let mut nearest_layers = Vec::with_capacity(range_m.len());
        let mut fractions = Vec::with_capacity(range_m.len());
        for (index, &range_m) in range_m.iter().enumerate() {
            if !range_m.is_finite() {
                return Err(Error::ElementOutOfRange {
                    field: "range_m",
                    index,
                    value: range_m,
                    allowed: "finite",
                });
            }
            let position = (range_m - first_range_m) / self.layer_thickness_m;
            let nearest = position.round();
            nearest_layers.push(nearest as i64);
            fractions.push(((position - nearest) * STEPS_PER_LAYER).round() / STEPS_PER_LAYER);
        }
        let mut start = 0;
        for alike in fractions.chunk_by(|a, b| a == b) {
            let shifted;
            let mut weights = &self.centred;
            if alike[0] != 0.0 {
                shifted = self.layer_weights(alike[0]);
                weights = &shifted;
            }
            let here = start..start + alike.len();
            let layers = &nearest_layers[here.clone()];
            weights.apply_into(layers, radial_velocity_m_s, is_known, &mut out_m_s[here]);
            start += alike.len();
        }
        Ok(())
    }

    /// Offsets \[m\] beyond a range between which the weights are not negligible.
    fn reach_m(&self) -> (f64, f64) {
        let (near_m, far_m) = self.pulse.weight_reach_m();
        (
            sample_m(self.taps.first()) + near_m,
            sample_m(self.taps.last()) + far_m,
        )
    }

    /// Weights for a range that lies a fraction of a layer beyond the centre of one.
    fn layer_weights(&self, fraction: f64) -> LayerWeights {
        let (first_m, last_m) = self.reach_m();
        let first = (first_m / self.layer_thickness_m) as i64 - 1;
        let last = (last_m / self.layer_thickness_m) as i64 + 1;
        let mut weights: Vec<f64> = (first..=last)
            .map(|l| self.weight_per_m((l as f64 - fraction) * self.layer_thickness_m))
            .collect();
        let sum: f64 = weights.iter().sum();
        for weight in &mut weights {
            *weight /= sum;
        }
        LayerWeights { first, weights }
    }
}

/// Offset \[m\] of the range of a sample.
fn sample_m(tap: Option<&(f64, f64)>) -> f64 {
    0.5 * SPEED_OF_LIGHT_M_S * tap.map_or(0.0, |&(time_s, _)| time_s)
}

/// Mean of the part of a profile that the weights cover; the first weight belongs to layer `first`,
/// which may be negative.
fn mean_of_profile(weights: &[f64], first: i64, radial_velocity_m_s: &[f64]) -> f64 {
    let layers = radial_velocity_m_s.len() as i64;
    let start = first.clamp(0, layers);
    let end = first
        .saturating_add(weights.len() as i64)
        .clamp(start, layers);
    if start == end {
        return f64::NAN;
    }
    let covered = &weights[(start - first) as usize..(end - first) as usize];
    let profile = &radial_velocity_m_s[start as usize..end as usize];
    weighted_mean(covered, profile.iter().copied())
}

/// Weighted mean of the velocities that are numbers; NaN if they carry too little of the weight.
fn weighted_mean(weights: &[f64], velocities_m_s: impl Iterator<Item = f64>) -> f64 {
    let mut sum = 0.0;
    let mut known = 0.0;
    for (weight, velocity) in weights.iter().zip(velocities_m_s) {
        if !velocity.is_nan() {
            sum += weight * velocity;
            known += weight;
        }
    }
    if known < LEAST_KNOWN_WEIGHT {
        f64::NAN
    } else {
        sum / known
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::GaussianPulse;
    use approx::{assert_abs_diff_eq, assert_relative_eq};

    const STEP_M: f64 = SPEED_OF_LIGHT_M_S / 500e6;

    fn pulse() -> GaussianPulse {
        GaussianPulse::table2()
    }

    fn hann(n: usize) -> Vec<f64> {
        (0..n)
            .map(|i| {
                (std::f64::consts::PI * (i as f64 + 0.5) / n as f64)
                    .sin()
                    .powi(2)
            })
            .collect()
    }

    fn filters() -> [(RangeFilter, f64); 3] {
        let gate =
            |window: &[f64]| RangeFilter::gate(pulse(), window, 250e6, STEP_M / 3.0).unwrap();
        // The samples of a gate are centred half a sample before its range.
        [
            (RangeFilter::pulse(pulse(), STEP_M / 3.0).unwrap(), 0.0),
            (gate(&[1.0; 64]), -0.5 * STEP_M),
            (gate(&hann(64)), -0.5 * STEP_M),
        ]
    }

    #[test]
    fn a_constant_is_kept_to_round_off_even_at_the_ends_and_beside_a_mask() {
        for (filter, _) in filters() {
            let mut profile = vec![3.7; 2000];
            profile[700..720].fill(f64::NAN);
            let ranges: Vec<f64> = (0..400).map(|i| 105.0 + 0.973 * f64::from(i)).collect();
            let mut out = vec![0.0; ranges.len()];
            filter
                .apply_into(100.0, &profile, &ranges, &mut out)
                .unwrap();
            let worst = out.iter().map(|v| (v - 3.7).abs()).fold(0.0, f64::max);
            assert!(
                worst < 1e-13 && out.iter().all(|v| v.is_finite()),
                "{worst}"
            );
        }
    }

    #[test]
    fn a_linear_profile_is_kept_on_and_between_layers() {
        for (filter, shift_m) in filters() {
            let thickness = STEP_M / 3.0;
            let profile: Vec<f64> = (0..9000)
                .map(|l| 0.02 * (f64::from(l) * thickness - 900.0))
                .collect();
            let ranges = [700.0, 700.1, 812.345, 900.0 + 17.0 * thickness];
            let mut out = [0.0; 4];
            filter.apply_into(0.0, &profile, &ranges, &mut out).unwrap();
            for (range, v) in ranges.iter().zip(out) {
                assert_abs_diff_eq!(v, 0.02 * (range + shift_m - 900.0), epsilon = 1e-9);
                let from_function = filter.at_range(*range, |rho| 0.02 * (rho - 900.0));
                assert_abs_diff_eq!(v, from_function, epsilon = 1e-9);
            }
        }
    }

    #[test]
    fn a_parabola_rises_by_half_the_squared_length_of_the_pulse() {
        // The second moment of |f(2 x/c)|^2 2/c is (c sigma/2)^2/2: fails if the Jacobian or a
        // factor 2 were wrong.
        let filter = RangeFilter::pulse(pulse(), 0.2).unwrap();
        let at_centre = filter.at_range(500.0, |rho| (rho - 500.0).powi(2));
        assert_relative_eq!(
            at_centre,
            0.5 * pulse().sigma_m().powi(2),
            max_relative = 1e-12
        );
    }

    #[test]
    fn a_gate_adds_the_variance_of_its_window() {
        let filter = RangeFilter::gate(pulse(), &[1.0; 64], 250e6, 0.2).unwrap();
        let centre = 500.0 - 0.5 * STEP_M;
        let spread = filter.at_range(500.0, |rho| (rho - centre).powi(2));
        let window = STEP_M * STEP_M * (64.0 * 64.0 - 1.0) / 12.0;
        assert_relative_eq!(
            spread,
            0.5 * pulse().sigma_m().powi(2) + window,
            max_relative = 1e-12
        );
    }

    #[test]
    fn means_side_by_side_have_the_bits_of_single_ones() {
        let profile: Vec<f64> = (0..1500).map(|i| (0.37 * f64::from(i)).sin()).collect();
        for (filter, _) in filters() {
            for stride in [1, 2, 7, 20] {
                let first_range_m = 200.0;
                let range_m: Vec<f64> = (0..1500)
                    .step_by(stride)
                    .map(|layer| first_range_m + f64::from(layer) * filter.layer_thickness_m)
                    .collect();
                let mut together = vec![0.0; range_m.len()];
                filter
                    .apply_into(first_range_m, &profile, &range_m, &mut together)
                    .unwrap();
                for (range_m, mean) in range_m.iter().zip(&together) {
                    let mut alone = [0.0];
                    filter
                        .apply_into(first_range_m, &profile, &[*range_m], &mut alone)
                        .unwrap();
                    assert_eq!(mean.to_bits(), alone[0].to_bits(), "{stride} {range_m}");
                }
            }
        }
    }

    #[test]
    fn weights_integrate_to_one_per_metre() {
        for (filter, _) in filters() {
            let sum: f64 = (-6000..6000)
                .map(|i| 0.05 * filter.weight_per_m(0.05 * f64::from(i)))
                .sum();
            assert_relative_eq!(sum, 1.0, max_relative = 1e-12);
        }
    }

    #[test]
    fn ranges_that_see_too_little_air_are_not_numbers() {
        let filter = RangeFilter::pulse(pulse(), 0.5).unwrap();
        let mut out = [0.0; 4];
        filter
            .apply_into(100.0, &[1.0; 1000], &[20.0, 90.0, 110.0, 1e18], &mut out)
            .unwrap();
        assert!(out[0].is_nan() && out[1].is_nan() && out[3].is_nan());
        assert_abs_diff_eq!(out[2], 1.0, epsilon = 1e-14);
        filter
            .apply_into(100.0, &[f64::NAN; 1000], &[300.0; 4], &mut out)
            .unwrap();
        assert!(out.iter().all(|v| v.is_nan()));
    }

    #[test]
    fn input_that_makes_no_filter_is_refused() {
        for thickness_m in [0.0, 1000.0, 1e-9] {
            let filter = RangeFilter::pulse(pulse(), thickness_m);
            assert!(
                matches!(
                    filter,
                    Err(Error::OutOfRange {
                        field: "layer_thickness_m",
                        ..
                    })
                ),
                "{thickness_m}"
            );
        }
        let gate = |window: &[f64]| RangeFilter::gate(pulse(), window, 250e6, 0.5);
        assert!(matches!(gate(&[]), Err(Error::Empty { .. })));
        assert!(matches!(
            gate(&[0.0; 3]),
            Err(Error::ElementOutOfRange { .. })
        ));
        assert!(matches!(
            gate(&[1.0, f64::NAN]),
            Err(Error::ElementOutOfRange { index: 1, .. })
        ));
        let filter = RangeFilter::pulse(pulse(), 0.5).unwrap();
        let apply = |profile: &[f64], range_m: f64, out: &mut [f64]| {
            filter.apply_into(0.0, profile, &[range_m], out)
        };
        assert!(matches!(
            apply(&[], 1.0, &mut [0.0]),
            Err(Error::Empty {
                field: "radial_velocity_m_s"
            })
        ));
        assert!(matches!(
            apply(&[1.0], 1.0, &mut [0.0; 2]),
            Err(Error::LengthMismatch {
                field: "out_m_s",
                ..
            })
        ));
        let refused = apply(&[1.0], f64::NAN, &mut [0.0]);
        assert!(matches!(
            refused,
            Err(Error::ElementOutOfRange {
                field: "range_m",
                index: 0,
                ..
            })
        ));
    }
}
