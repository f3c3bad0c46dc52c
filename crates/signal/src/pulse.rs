//! The transmitted pulse of any shape: Gaussian, (7), or sampled; its energy, and the weight that
//! it gives to each range, (28), corrected.
//!
//! Check: `|f|^2` integrates to 1 over time, falls to one half at half the full width at half
//! maximum, and the range weight integrates to 1 over range; a sampled phase spreads the spectrum
//! as the closed form of a chirp says; the advised layers hold the energy of each shape.

use std::f64::consts::PI;

use num_complex::Complex;

use crate::error::check_positive;
use crate::piecewise::{Moments, Piecewise};
use crate::{Error, LayerLimits, SPEED_OF_LIGHT_M_S};

/// Half-length of the sum over a Gaussian in units of `sigma` (Frehlich 1997): outside lies
/// `erfc(3.72)` = 1.4e-7 of the energy.
const HALF_LENGTH_SIGMAS: f64 = 3.72;

/// Largest error of the energy in a sum over layers that a record may have.
const ALLOWED_ENERGY_ERROR: f64 = 5e-3;

/// Largest error of the energy in a sum over layers of the advised thickness.
const ADVISED_ENERGY_ERROR: f64 = 5e-4;

/// A transmitted pulse with the Gaussian envelope (7).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GaussianPulse {
    sigma_s: f64,
    energy_j: f64,
}

impl GaussianPulse {
    /// Table 2's 150 uJ in 200 ns (full width at half maximum), the shorter of the
    /// chapter's two pulses.
    pub fn table2() -> Self {
        Self {
            sigma_s: Self::sigma_of_full_width_s(200e-9),
            energy_j: 150e-6,
        }
    }

    /// A pulse of the given half-width of the power at 1/e, `sigma` of (7), and energy.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if the half-width or the energy is not finite and positive.
    pub fn new(sigma_s: f64, energy_j: f64) -> Result<Self, Error> {
        check_positive("pulse duration_s", sigma_s)?;
        check_positive("energy_j", energy_j)?;
        Ok(Self { sigma_s, energy_j })
    }

    /// A pulse of the given full width at half maximum of the power, the usual "pulse duration", and energy.
    ///
    /// # Errors
    /// As [`GaussianPulse::new`].
    pub fn of_full_width(full_width_s: f64, energy_j: f64) -> Result<Self, Error> {
        Self::new(Self::sigma_of_full_width_s(full_width_s), energy_j)
    }

    /// The 1/e half-width, `sigma` \[s\], of a full width at half maximum `2 sqrt(ln 2) sigma` = 1.665 `sigma`.
    pub fn sigma_of_full_width_s(full_width_s: f64) -> f64 {
        full_width_s / (2.0 * 2.0_f64.ln().sqrt())
    }

    /// The 1/e half-width of the power, `sigma` \[s\].
    pub fn sigma_s(&self) -> f64 {
        self.sigma_s
    }

    /// Energy of the pulse, `E_t` \[J\].
    pub fn energy_j(&self) -> f64 {
        self.energy_j
    }

    /// Length scale of the pulse in range, `c sigma/2` \[m\].
    pub fn sigma_m(&self) -> f64 {
        0.5 * SPEED_OF_LIGHT_M_S * self.sigma_s
    }

    /// Envelope `f(t) = pi^(-1/4) sigma^(-1/2) exp(-t^2/(2 sigma^2))`, (7) \[s^-1/2\].
    pub fn envelope_per_sqrt_s(&self, time_s: f64) -> f64 {
        let ratio = time_s / self.sigma_s;
        (-0.5 * ratio * ratio).exp() / (PI.sqrt() * self.sigma_s).sqrt()
    }

    /// Power `|f(t)|^2` for unit energy \[1/s\]; integrates to 1 over time, (8).
    pub fn intensity_per_s(&self, time_s: f64) -> f64 {
        let ratio = time_s / self.sigma_s;
        (-ratio * ratio).exp() / (PI.sqrt() * self.sigma_s)
    }
}

/// A pulse as it leaves the telescope: envelope `f(t)`, of unit energy, and energy.
///
/// Made from a [`GaussianPulse`] by `into()`, or from samples, as by [`Pulse::from_envelope`].
#[derive(Debug, Clone, PartialEq)]
pub struct Pulse {
    shape: Shape,
    energy_j: f64,
    /// Whether the shape has no imaginary part.
    real: bool,
    moments: Moments,
    support_s: (f64, f64),
    /// Thickest layer of a record, in time `2 DeltaR/c` \[s\], without regard to the phase.
    allowed_s: f64,
    /// Thickest layer of a good record, in time \[s\].
    advised_s: f64,
}

#[derive(Debug, Clone, PartialEq)]
enum Shape {
    Gaussian(GaussianPulse),
    Sampled(Piecewise),
}

impl From<GaussianPulse> for Pulse {
    fn from(pulse: GaussianPulse) -> Self {
        let GaussianPulse { sigma_s, energy_j } = pulse;
        let moments = Moments {
            energy: 1.0,
            mean_s: 0.0,
            square_s2: 0.5 * sigma_s * sigma_s,
            mean_hz: 0.0,
            square_hz2: 1.0 / (8.0 * PI * PI * sigma_s * sigma_s),
        };
        // The sum over a Gaussian in steps d is wrong by 2 exp(-(pi sigma/d)^2): 1e-4 at d = sigma.
        let allowed_s = PI * sigma_s / (2.0 / ALLOWED_ENERGY_ERROR).ln().sqrt();
        let support_s = (-HALF_LENGTH_SIGMAS * sigma_s, HALF_LENGTH_SIGMAS * sigma_s);
        Self {
            shape: Shape::Gaussian(pulse),
            energy_j,
            real: true,
            moments,
            support_s,
            allowed_s,
            advised_s: sigma_s,
        }
    }
}

impl From<&Self> for Pulse {
    fn from(pulse: &Self) -> Self {
        pulse.clone()
    }
}

impl Pulse {
    /// The pulse of an envelope of unit energy.
    pub(crate) fn sampled(envelope: Piecewise, energy_j: f64, is_real: bool) -> Self {
        Self {
            energy_j,
            real: is_real,
            moments: envelope.moments(),
            support_s: envelope.support_s(),
            allowed_s: thickest_layer_s(&envelope, ALLOWED_ENERGY_ERROR),
            advised_s: thickest_layer_s(&envelope, ADVISED_ENERGY_ERROR),
            shape: Shape::Sampled(envelope),
        }
    }

    /// The same pulse, moved in time so that the centroid of its power is at time 0: ranges then
    /// count from its middle, as those of a Gaussian do in any case.
    #[must_use]
    pub fn centred(mut self) -> Self {
        let Shape::Sampled(envelope) = &mut self.shape else {
            return self;
        };
        envelope.shift(-self.moments.mean_s);
        Self::sampled(envelope.clone(), self.energy_j, self.real)
    }

    /// Energy of the pulse, `E_t` \[J\].
    pub fn energy_j(&self) -> f64 {
        self.energy_j
    }

    /// Complex envelope `f(t)`, (7) for a Gaussian \[s^-1/2\]; `|f|^2` integrates to 1, (8).
    pub fn envelope_per_sqrt_s(&self, time_s: f64) -> Complex<f64> {
        match &self.shape {
            Shape::Gaussian(pulse) => Complex::new(pulse.envelope_per_sqrt_s(time_s), 0.0),
            Shape::Sampled(envelope) => envelope.value(time_s),
        }
    }

    /// Power `|f(t)|^2` for unit energy \[1/s\].
    pub fn intensity_per_s(&self, time_s: f64) -> f64 {
        match &self.shape {
            Shape::Gaussian(pulse) => pulse.intensity_per_s(time_s),
            Shape::Sampled(envelope) => envelope.value(time_s).norm_sqr(),
        }
    }

    /// Weight `|f(2 offset/c)|^2 2/c` \[1/m\] of the air `offset_m` before a range, (28),
    /// corrected; integrates to 1 over range.
    pub fn range_weight_per_m(&self, offset_m: f64) -> f64 {
        let per_range = 2.0 / SPEED_OF_LIGHT_M_S;
        self.intensity_per_s(offset_m * per_range) * per_range
    }

    /// First and last time at which the envelope enters the sum (15) \[s\]: at most 2e-7 of the
    /// energy lies outside.
    pub fn support_s(&self) -> (f64, f64) {
        self.support_s
    }

    /// The 1/e half-width `sigma` \[s\] of the Gaussian with the same spread in time: `sqrt 2`
    /// times the standard deviation of `|f|^2`.
    pub fn sigma_s(&self) -> f64 {
        (2.0 * (self.moments.square_s2 - self.moments.mean_s.powi(2)))
            .max(0.0)
            .sqrt()
    }

    /// `sigma` of (7) \[s\], if the power is Gaussian.
    pub(crate) fn gaussian_sigma_s(&self) -> Option<f64> {
        matches!(self.shape, Shape::Gaussian(_)).then(|| self.sigma_s())
    }

    /// Length scale of the pulse in range, `c sigma/2` \[m\].
    pub fn sigma_m(&self) -> f64 {
        0.5 * SPEED_OF_LIGHT_M_S * self.sigma_s()
    }

    /// Centroid of the power \[s\]; ranges count from time 0.
    pub fn mean_time_s(&self) -> f64 {
        self.moments.mean_s
    }

    /// Mean frequency of the envelope \[Hz\]: an estimator that does not correct for it reports the
    /// velocity `-lambda/2` times this frequency in still air.
    pub fn mean_frequency_hz(&self) -> f64 {
        self.moments.mean_hz
    }

    /// Standard deviation of the spectrum `|F(nu)|^2` of the envelope \[Hz\]:
    /// `1/(2 sqrt2 pi sigma)` for a Gaussian.
    pub fn spectral_width_hz(&self) -> f64 {
        (self.moments.square_hz2 - self.mean_frequency_hz().powi(2))
            .max(0.0)
            .sqrt()
    }

    /// Full width at half maximum of the spectrum `|F(nu)|^2` of the envelope \[Hz\]: between its
    /// outermost points at half of its largest value.
    pub fn spectral_full_width_half_maximum_hz(&self) -> f64 {
        if let Shape::Gaussian(_) = self.shape {
            return 2.0 * (2.0 * std::f64::consts::LN_2).sqrt() * self.spectral_width_hz();
        }
        let (first_s, last_s) = self.support_s();
        let length_s = last_s - first_s;
        let reach_hz = 8.0 * self.spectral_width_hz();
        // Sixteen frequencies in the finest structure of the spectrum of a pulse of this length,
        // and eight points in the fastest of its waves.
        let times = (8.0 * reach_hz * length_s).max(2000.0) as u32;
        let mut envelope = Vec::with_capacity(times as usize);
        for i in 0..times {
            let time_s = first_s + length_s * (f64::from(i) + 0.5) / f64::from(times);
            envelope.push((time_s, self.envelope_per_sqrt_s(time_s)));
        }
        let frequencies = (32.0 * reach_hz * length_s).ceil() as u32;
        let step_hz = 2.0 * reach_hz / f64::from(frequencies);
        let mut power = Vec::new();
        for i in 0..=frequencies {
            let hz = self.mean_frequency_hz() - reach_hz + f64::from(i) * step_hz;
            let waves = envelope
                .iter()
                .map(|(time_s, f)| f * Complex::cis(-2.0 * PI * hz * time_s));
            power.push(waves.sum::<Complex<f64>>().norm_sqr());
        }
        let half = 0.5 * power.iter().copied().fold(0.0, f64::max);
        let first = power.iter().position(|p| *p >= half).unwrap_or(0).max(1);
        let last = power.iter().rposition(|p| *p >= half).unwrap_or(0);
        let last = last.min(power.len() - 2);
        // From the neighbour below half on one side to that on the other, less the fractions of
        // these two steps below half.
        let steps = (last - first) as f64 + 2.0;
        let below_first = fraction_below(half, power[first], power[first - 1]);
        let below_last = fraction_below(half, power[last], power[last + 1]);
        step_hz * (steps - below_first - below_last)
    }

    /// Thickness of the layers \[m\] for this pulse: the largest that divides the range step of a
    /// sample, `c/(2 F_s)`, and is at most `lambda/(16 sigma g_max)` and `c sigma/2`, holds the
    /// energy of the pulse within 5e-4, and resolves its phase (`2 DeltaR/c` at most an eighth of
    /// the inverse spectral width).
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if a limit is not positive (the gradient may be zero).
    pub fn layer_thickness_m(&self, limits: LayerLimits) -> Result<f64, Error> {
        let by_gradient_m = limits.thickness_m(self.sigma_s())?;
        if matches!(self.shape, Shape::Gaussian(_)) {
            return Ok(by_gradient_m);
        }
        let step_m = SPEED_OF_LIGHT_M_S / (2.0 * limits.sample_rate_hz);
        let limit_m =
            0.5 * SPEED_OF_LIGHT_M_S * self.advised_s.min(0.125 / self.spectral_width_hz());
        let parts = (step_m / by_gradient_m)
            .round()
            .max((step_m / limit_m).ceil());
        Ok(step_m / parts)
    }

    /// Thickest layer that a record accepts \[m\]: the energy in a sum over layers is then within
    /// 5e-3, and the phase is sampled.
    pub fn max_layer_thickness_m(&self) -> f64 {
        0.5 * SPEED_OF_LIGHT_M_S * self.allowed_s.min(0.25 / self.spectral_width_hz())
    }

    /// Whether the envelope has no imaginary part.
    pub(crate) fn is_real(&self) -> bool {
        self.real
    }

    /// Offsets \[m\] beyond a range between which the weight (28) is not negligible.
    pub(crate) fn weight_reach_m(&self) -> (f64, f64) {
        match &self.shape {
            // |f|^2 is 2e-16 of its peak there.
            Shape::Gaussian(_) => (-6.0 * self.sigma_m(), 6.0 * self.sigma_m()),
            Shape::Sampled(_) => (
                -0.5 * SPEED_OF_LIGHT_M_S * self.support_s.1,
                -0.5 * SPEED_OF_LIGHT_M_S * self.support_s.0,
            ),
        }
    }
}

/// Fraction of a step from `outside` to `inside` below a level between them.
fn fraction_below(level: f64, inside: f64, outside: f64) -> f64 {
    (level - outside) / (inside - outside)
}

/// Largest step \[s\] in which sums over `|f|^2`, wherever they begin, differ from its integral by
/// at most `limit`, and so do those in the next smaller steps.
fn thickest_layer_s(envelope: &Piecewise, limit: f64) -> f64 {
    /// Steps tried for each factor of two.
    const PER_OCTAVE: i32 = 4;
    /// Positions in a step at which a sum begins.
    const STARTS: u32 = 8;
    let (first_s, last_s) = envelope.support_s();
    let mut accurate_steps = 0;
    let mut step_s = last_s - first_s;
    for index in 0..12 * PER_OCTAVE {
        step_s = (last_s - first_s) * (-f64::from(index) / f64::from(PER_OCTAVE)).exp2();
        let is_accurate = (0..STARTS).all(|start| {
            let delay_s = step_s * f64::from(start) / f64::from(STARTS);
            (stepped_energy(envelope, delay_s, step_s) - 1.0).abs() <= limit
        });
        accurate_steps = if is_accurate { accurate_steps + 1 } else { 0 };
        if accurate_steps == PER_OCTAVE {
            return step_s * (f64::from(PER_OCTAVE - 1) / f64::from(PER_OCTAVE)).exp2();
        }
    }
    step_s
}

/// Sum of `|f|^2` times `step_s` over times in steps of `step_s`, from `delay_s` after
/// the first knot.
fn stepped_energy(envelope: &Piecewise, delay_s: f64, step_s: f64) -> f64 {
    let (first_s, last_s) = envelope.support_s();
    let start_s = first_s + delay_s;
    let steps = ((last_s - start_s) / step_s).ceil() as usize;
    let powers = (0..=steps).map(|i| envelope.value(start_s + i as f64 * step_s).norm_sqr());
    step_s * powers.sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn limits(max_gradient_per_s: f64) -> LayerLimits {
        LayerLimits {
            sample_rate_hz: 250e6,
            wavelength_m: 1.55e-6,
            max_gradient_per_s,
        }
    }

    fn gaussian() -> GaussianPulse {
        GaussianPulse::table2()
    }

    /// A rise of 40 ns, a flat top, a long tail.
    fn skewed() -> Pulse {
        let times: Vec<f64> = (0..400).map(|i| f64::from(i) * 2e-9).collect();
        let power: Vec<f64> = times
            .iter()
            .map(|t| (1.0 - (-(t / 4e-8).powi(2)).exp()) * (-(t / 2.5e-7).powi(3)).exp())
            .collect();
        Pulse::from_power(&times, &power, 1e-4).unwrap().centred()
    }

    /// Table 2's pulse, sampled, with a frequency that rises by `chirp_hz_s`.
    fn chirped(chirp_hz_s: f64) -> Pulse {
        let times: Vec<f64> = (-800..=800).map(|i| f64::from(i) * 1e-9).collect();
        let amplitude: Vec<_> = times
            .iter()
            .map(|t| {
                let modulus = gaussian().envelope_per_sqrt_s(*t);
                Complex::from_polar(modulus, PI * chirp_hz_s * t * t)
            })
            .collect();
        Pulse::from_envelope(&times, &amplitude, 1e-4).unwrap()
    }

    /// A flat pulse that rises and falls within one step of its samples.
    fn rectangle(duration_s: f64, step_s: f64) -> Pulse {
        let half = (0.5 * duration_s / step_s).round() as i32;
        let times: Vec<f64> = (-half - 1..=half)
            .map(|i| (f64::from(i) + 0.5) * step_s)
            .collect();
        let mut power = vec![1.0; times.len()];
        power[0] = 0.0;
        power[times.len() - 1] = 0.0;
        Pulse::from_power(&times, &power, 1e-4).unwrap()
    }

    #[test]
    fn power_is_half_its_peak_at_half_the_full_width() {
        let half = gaussian().intensity_per_s(100e-9) / gaussian().intensity_per_s(0.0);
        assert_relative_eq!(half, 0.5, max_relative = 1e-14);
        assert_relative_eq!(gaussian().sigma_s(), 120.112_241e-9, max_relative = 1e-8);
        assert_relative_eq!(
            2.0 * 2.0_f64.ln().sqrt() * gaussian().sigma_s(),
            200e-9,
            max_relative = 1e-15
        );
    }

    #[test]
    fn power_is_one_over_e_at_the_stated_half_width() {
        let pulse = GaussianPulse::new(80e-9, 1.0).unwrap();
        let ratio = pulse.intensity_per_s(-80e-9) / pulse.intensity_per_s(0.0);
        assert_relative_eq!(ratio, (-1.0_f64).exp(), max_relative = 1e-14);
    }

    #[test]
    fn power_integrates_to_one_and_is_the_square_of_the_envelope() {
        let pulse = gaussian();
        let step_s = 10e-9;
        let times = (-200..=200).map(|i| f64::from(i) * step_s);
        let sum: f64 = times
            .clone()
            .map(|t| pulse.intensity_per_s(t) * step_s)
            .sum();
        assert_relative_eq!(sum, 1.0, max_relative = 1e-13);
        for t in times.filter(|t| t.abs() < 1e-6) {
            let squared = pulse.envelope_per_sqrt_s(t).powi(2);
            assert_relative_eq!(squared, pulse.intensity_per_s(t), max_relative = 1e-12);
        }
    }

    #[test]
    fn range_weight_integrates_to_one_and_its_half_width_is_half_the_pulse_length() {
        let pulse = Pulse::from(gaussian());
        let step_m = 1.5;
        let sum: f64 = (-200..=200)
            .map(|i| pulse.range_weight_per_m(f64::from(i) * step_m) * step_m)
            .sum();
        assert_relative_eq!(sum, 1.0, max_relative = 1e-13);
        let half_power_m = 0.5 * SPEED_OF_LIGHT_M_S * 100e-9;
        let ratio = pulse.range_weight_per_m(half_power_m) / pulse.range_weight_per_m(0.0);
        assert_relative_eq!(ratio, 0.5, max_relative = 1e-13);
    }

    #[test]
    fn durations_and_energies_that_are_not_positive_are_refused() {
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let duration = GaussianPulse::of_full_width(bad, 1.0);
            assert!(matches!(
                duration,
                Err(Error::OutOfRange {
                    field: "pulse duration_s",
                    ..
                })
            ));
            let energy = GaussianPulse::new(1e-7, bad);
            assert!(matches!(
                energy,
                Err(Error::OutOfRange {
                    field: "energy_j",
                    ..
                })
            ));
        }
    }

    #[test]
    fn a_chirp_leaves_the_power_alone_and_spreads_the_spectrum() {
        let plain = Pulse::from(gaussian());
        let chirp_hz_s = 2e14;
        let chirped = chirped(chirp_hz_s);
        let sigma_s = gaussian().sigma_s();
        assert!(plain.is_real() && !chirped.is_real());
        for time_s in [-1e-7, 0.0, 3e-8] {
            let modulus = gaussian().envelope_per_sqrt_s(time_s);
            let expected = Complex::from_polar(modulus, PI * chirp_hz_s * time_s * time_s);
            let error = (chirped.envelope_per_sqrt_s(time_s) - expected).norm();
            assert!(error < 1e-6 * plain.envelope_per_sqrt_s(0.0).norm());
            assert_relative_eq!(
                chirped.intensity_per_s(time_s),
                plain.intensity_per_s(time_s),
                max_relative = 1e-5
            );
        }
        let unchirped_hz = 1.0 / (8.0_f64.sqrt() * PI * sigma_s);
        assert_relative_eq!(
            plain.spectral_width_hz(),
            unchirped_hz,
            max_relative = 1e-14
        );
        let expected = unchirped_hz.hypot(chirp_hz_s * sigma_s / 2f64.sqrt());
        assert_relative_eq!(chirped.spectral_width_hz(), expected, max_relative = 1e-4);
    }

    #[test]
    fn the_spectrum_of_samples_is_as_wide_as_that_of_what_they_were_taken_of() {
        for chirp_hz_s in [0.0, 3e13, -1e14] {
            let sigma_s = gaussian().sigma_s();
            let width_hz = (8.0_f64.sqrt() * PI * sigma_s).recip();
            let closed_hz = (8.0 * std::f64::consts::LN_2).sqrt()
                * width_hz.hypot(chirp_hz_s * sigma_s / 2f64.sqrt());
            // What the samples leave out of the energy, 1e-4, has the widest frequencies.
            assert_relative_eq!(
                chirped(chirp_hz_s).spectral_full_width_half_maximum_hz(),
                closed_hz,
                max_relative = 1e-3
            );
        }
        // A rectangle of T, whose tails make its standard deviation say nothing: |sinc|^2 is
        // half at 0.4429/T.
        let flat = rectangle(200e-9, 0.2e-9);
        // The energy cut off at both ends shortens it.
        assert_relative_eq!(
            flat.spectral_full_width_half_maximum_hz(),
            0.885_89 / 200e-9,
            max_relative = 3e-3
        );
        assert!(flat.spectral_width_hz() > 5.0 * flat.spectral_full_width_half_maximum_hz());
    }

    #[test]
    fn a_late_pulse_with_a_chirp_has_a_raised_mean_frequency() {
        let times: Vec<f64> = (-200..=200).map(|i| f64::from(i) * 4e-9).collect();
        let amplitude: Vec<_> = times
            .iter()
            .map(|t| {
                let modulus = gaussian().envelope_per_sqrt_s(t - 5e-8);
                Complex::from_polar(modulus, PI * 1e14 * t * t)
            })
            .collect();
        let late = Pulse::from_envelope(&times, &amplitude, 1e-4).unwrap();
        let found_hz = late.mean_frequency_hz();
        assert_relative_eq!(found_hz, 1e14 * 5e-8, max_relative = 1e-4);
        assert!(chirped(1e14).mean_frequency_hz().abs() < 1.0);
    }

    #[test]
    fn advised_layers_hold_the_energy_of_every_shape() {
        let box_shaped = rectangle(200e-9, 1e-9);
        let short = GaussianPulse::of_full_width(2e-9, 1e-4).unwrap();
        for pulse in [gaussian().into(), short.into(), skewed(), box_shaped] {
            let thickness_m = pulse.layer_thickness_m(limits(0.0)).unwrap();
            assert!(thickness_m <= pulse.max_layer_thickness_m());
            let layer_s = 2.0 * thickness_m / SPEED_OF_LIGHT_M_S;
            let (first_s, last_s) = pulse.support_s();
            for place in [0.0, 0.13, 0.5, 0.77] {
                let steps = ((last_s - first_s) / layer_s) as i32 + 1;
                let sum: f64 = (0..=steps)
                    .map(|i| {
                        layer_s * pulse.intensity_per_s(first_s + (f64::from(i) + place) * layer_s)
                    })
                    .sum();
                assert!((sum - 1.0).abs() < 1e-3, "{sum}");
            }
        }
    }

    #[test]
    fn a_gaussian_needs_the_layers_of_its_sigma_and_a_chirp_thinner_ones() {
        let plain = Pulse::from(gaussian());
        assert_eq!(
            plain.layer_thickness_m(limits(3.6)),
            limits(3.6).thickness_m(gaussian().sigma_s())
        );
        let chirped = chirped(8e14);
        let thickness_m = chirped.layer_thickness_m(limits(0.0)).unwrap();
        assert!(2.0 * thickness_m / SPEED_OF_LIGHT_M_S <= 0.125 / chirped.spectral_width_hz());
        assert!(thickness_m <= chirped.max_layer_thickness_m());
    }

    #[test]
    fn width_of_a_shape_is_that_of_the_gaussian_with_its_spread() {
        let pulse = skewed();
        let step_s = 1e-10;
        let (first_s, last_s) = pulse.support_s();
        let moment = |power: i32| {
            let steps = ((last_s - first_s) / step_s) as i32;
            let at = |i: i32| first_s + f64::from(i) * step_s;
            (0..=steps)
                .map(|i| step_s * at(i).powi(power) * pulse.intensity_per_s(at(i)))
                .sum::<f64>()
        };
        assert_relative_eq!(moment(0), 1.0, max_relative = 1e-5);
        assert!(
            (moment(1) - pulse.mean_time_s()).abs() < 1e-12 && pulse.mean_time_s().abs() < 1e-14
        );
        assert_relative_eq!(
            pulse.sigma_s(),
            (2.0 * moment(2)).sqrt(),
            max_relative = 1e-5
        );
    }
}
