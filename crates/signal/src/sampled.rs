//! A pulse whose envelope was measured or computed at sample times, of any shape, real or complex.
//!
//! A cubic spline joins the samples, at any times: its error is of order `(step/scale)^4`, 3e-6 of
//! the peak for a Gaussian with five samples in `sigma`. It is scaled to unit energy, and cut where
//! less than 1e-7 of the energy is lost.
//!
//! Check: a sampled Gaussian is the Gaussian, from fine and coarse samples, evenly spaced or not.

use num_complex::Complex;

use crate::Error;
use crate::Pulse;
use crate::error::{check, check_amounts, check_increasing, check_length, check_positive};
use crate::piecewise::Piecewise;

/// Energy cut off at each end, as a fraction of the whole.
const CUT_ENERGY: f64 = 0.5e-7;

/// Pulses of any sampled shape.
impl Pulse {
    /// A pulse from its complex envelope at increasing times \[s\]; zero before the first and
    /// after the last sample. The unit of the amplitude does not matter: the envelope is scaled
    /// to unit energy.
    ///
    /// Time 0 is the moment from which ranges are counted, `R = c t/2`; see
    /// [`Pulse::centred`]. A positive frequency of the envelope, `exp(+j 2 pi nu t)`, raises
    /// the intermediate frequency.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for fewer than two samples or an energy that is not positive;
    /// [`Error::LengthMismatch`]; [`Error::ElementOutOfRange`] for a value that is not finite,
    /// times that do not increase, or an amplitude that is zero everywhere.
    pub fn from_envelope(
        time_s: &[f64],
        amplitude: &[Complex<f64>],
        energy_j: f64,
    ) -> Result<Self, Error> {
        check_positive("energy_j", energy_j)?;
        let largest = check_samples(time_s, amplitude)?;
        // Scaled before squaring, so that amplitudes of any size have an energy.
        let values: Vec<_> = amplitude.iter().map(|a| a / largest).collect();
        let mut envelope = Piecewise::spline(time_s.to_vec(), &values);
        envelope.trim(CUT_ENERGY);
        let energy = envelope.moments().energy;
        check(
            "integral of the power, s",
            energy,
            "finite and positive",
            |e| e > 0.0,
        )?;
        envelope.scale(energy.sqrt().recip());
        let is_real = amplitude.iter().all(|a| a.im == 0.0);
        Ok(Self::sampled(envelope, energy_j, is_real))
    }

    /// A pulse from its power at increasing times \[s\], as a photodiode measures it, without
    /// phase; any unit.
    ///
    /// # Errors
    /// As [`Pulse::from_envelope`]; [`Error::ElementOutOfRange`] for a negative power.
    pub fn from_power(time_s: &[f64], power: &[f64], energy_j: f64) -> Result<Self, Error> {
        check_length("power", power.len(), time_s.len())?;
        check_amounts("power", power)?;
        let amplitude: Vec<_> = power.iter().map(|p| Complex::new(p.sqrt(), 0.0)).collect();
        Self::from_envelope(time_s, &amplitude, energy_j)
    }

    /// A pulse from its power, any unit, and its phase \[rad\] at increasing times \[s\].
    ///
    /// # Errors
    /// As [`Pulse::from_power`]; [`Error::ElementOutOfRange`] for a phase that is not finite.
    pub fn from_power_and_phase(
        time_s: &[f64],
        power: &[f64],
        phase_rad: &[f64],
        energy_j: f64,
    ) -> Result<Self, Error> {
        check_length("power", power.len(), time_s.len())?;
        check_length("phase_rad", phase_rad.len(), time_s.len())?;
        check_amounts("power", power)?;
        let mut amplitude = Vec::with_capacity(power.len());
        for (index, (power, phase_rad)) in power.iter().zip(phase_rad).enumerate() {
            if !phase_rad.is_finite() {
                return Err(Error::ElementOutOfRange {
                    field: "phase_rad",
                    index,
                    value: *phase_rad,
                    allowed: "finite",
                });
            }
            amplitude.push(Complex::from_polar(power.sqrt(), *phase_rad));
        }
        Self::from_envelope(time_s, &amplitude, energy_j)
    }
}

/// The largest modulus, if the samples are an envelope.
fn check_samples(time_s: &[f64], amplitude: &[Complex<f64>]) -> Result<f64, Error> {
    check(
        "samples of the envelope",
        time_s.len() as f64,
        "2 or more",
        |n| n >= 2.0,
    )?;
    check_length("amplitude", amplitude.len(), time_s.len())?;
    check_increasing("time_s", time_s, "later than the time before")?;
    if let Some((index, a)) = amplitude.iter().enumerate().find(|(_, a)| !a.is_finite()) {
        return Err(Error::ElementOutOfRange {
            field: "amplitude",
            index,
            value: if a.re.is_finite() { a.im } else { a.re },
            allowed: "finite",
        });
    }
    let largest = amplitude
        .iter()
        .fold(0.0_f64, |m, a| m.max(a.re.abs()).max(a.im.abs()));
    if largest == 0.0 {
        return Err(Error::ElementOutOfRange {
            field: "amplitude",
            index: 0,
            value: 0.0,
            allowed: "not all zero",
        });
    }
    Ok(largest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::GaussianPulse;
    use approx::assert_relative_eq;

    fn gaussian() -> GaussianPulse {
        GaussianPulse::table2()
    }

    /// Largest difference from the Gaussian, in parts of its peak, of the spline through its
    /// samples at `times`.
    fn error_of(times: &[f64]) -> f64 {
        let amplitude: Vec<_> = times
            .iter()
            .map(|t| Complex::new(3e4 * gaussian().envelope_per_sqrt_s(*t), 0.0))
            .collect();
        let pulse = Pulse::from_envelope(times, &amplitude, 150e-6).unwrap();
        let peak = gaussian().envelope_per_sqrt_s(0.0);
        (0..2000)
            .map(|i| (f64::from(i) - 1000.3) * 0.4e-9)
            .map(|t| {
                (pulse.envelope_per_sqrt_s(t) - gaussian().envelope_per_sqrt_s(t)).norm() / peak
            })
            .fold(0.0, f64::max)
    }

    fn even(step_s: f64) -> Vec<f64> {
        let half = (700e-9 / step_s) as i32;
        (-half..=half).map(|i| f64::from(i) * step_s).collect()
    }

    #[test]
    fn a_sampled_gaussian_is_the_gaussian_at_any_sampling() {
        assert!(error_of(&even(1e-9)) < 1e-7);
        assert!(error_of(&even(24e-9)) < 2e-5);
        let uneven: Vec<f64> = even(10e-9)
            .iter()
            .map(|t| t + 4e-9 * (t * 3e7).sin())
            .collect();
        assert!(error_of(&uneven) < 2e-5);
    }

    #[test]
    fn moments_and_support_of_a_sampled_gaussian_are_its_own() {
        let times = even(5e-9);
        let power: Vec<f64> = times
            .iter()
            .map(|t| gaussian().intensity_per_s(*t))
            .collect();
        let late: Vec<f64> = times.iter().map(|t| t + 3e-6).collect();
        let pulse = Pulse::from_power(&late, &power, 1e-4).unwrap();
        assert_relative_eq!(pulse.mean_time_s(), 3e-6, max_relative = 1e-9);
        let centred = pulse.centred();
        assert!(centred.mean_time_s().abs() < 1e-15);
        assert_relative_eq!(centred.sigma_s(), gaussian().sigma_s(), max_relative = 5e-6);
        let (first, last) = centred.support_s();
        assert!(first < -3.7 * gaussian().sigma_s() && last > 3.7 * gaussian().sigma_s());
        assert!(first > -4.0 * gaussian().sigma_s() && last < 4.0 * gaussian().sigma_s());
    }

    #[test]
    fn amplitudes_of_any_size_give_the_same_pulse() {
        let times = even(10e-9);
        let of_size = |size: f64| {
            let amplitude: Vec<_> = times
                .iter()
                .map(|t| Complex::new(size * (-0.5 * (t / 1e-7).powi(2)).exp(), 0.0))
                .collect();
            Pulse::from_envelope(&times, &amplitude, 1e-4).unwrap()
        };
        for size in [1e-200, 1e200] {
            let found = of_size(size).envelope_per_sqrt_s(3e-8);
            let expected = of_size(1.0).envelope_per_sqrt_s(3e-8);
            assert_relative_eq!(found.re, expected.re, max_relative = 1e-13);
        }
    }

    #[test]
    fn samples_that_are_no_pulse_are_refused() {
        let one = Complex::new(1.0, 0.0);
        let make = |times: &[f64], values: &[Complex<f64>]| {
            Pulse::from_envelope(times, values, 1e-4).map(|_| ())
        };
        assert!(matches!(
            make(&[0.0], &[one]),
            Err(Error::OutOfRange { .. })
        ));
        assert!(matches!(
            make(&[0.0, 1e-8], &[one]),
            Err(Error::LengthMismatch { .. })
        ));
        for (times, index) in [([0.0, 1e-8, 1e-8], 2), ([0.0, f64::NAN, 1.0], 1)] {
            let error = make(&times, &[one; 3]);
            assert!(
                matches!(error, Err(Error::ElementOutOfRange { field: "time_s", index: i, .. }) if i == index)
            );
        }
        let silent = make(&[0.0, 1e-8], &[Complex::ZERO; 2]);
        assert!(matches!(
            silent,
            Err(Error::ElementOutOfRange {
                field: "amplitude",
                ..
            })
        ));
        let broken = make(&[0.0, 1e-8], &[one, Complex::new(0.0, f64::NAN)]);
        assert!(matches!(
            broken,
            Err(Error::ElementOutOfRange {
                field: "amplitude",
                index: 1,
                ..
            })
        ));
        let negative = Pulse::from_power(&[0.0, 1e-8], &[1.0, -1.0], 1e-4);
        assert!(matches!(
            negative,
            Err(Error::ElementOutOfRange {
                field: "power",
                index: 1,
                ..
            })
        ));
    }
}
