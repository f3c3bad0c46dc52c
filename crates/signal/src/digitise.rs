//! The analogue-to-digital converter: rounding to a number of bits, and saturation.
//!
//! Check: the error of rounding has the variance `step^2/12`, a full-scale tone the ratio
//! `6.02 bits + 1.76` dB; what lies beyond full scale is clipped and counted.

use crate::error::{check, check_positive};
use crate::{Error, Sample};

/// A converter with `2^bits` codes, from `-2^(bits-1)` to `2^(bits-1) - 1`; code 0 is no current.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Digitiser {
    step_a: f64,
    /// Codes of either sign.
    half: f64,
}

impl Digitiser {
    /// A converter of `bits` for currents from `-full_scale_a` to `full_scale_a`.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] unless there are 1 to 32 bits and the full scale is
    /// finite and positive.
    pub fn new(bits: u32, full_scale_a: f64) -> Result<Self, Error> {
        check("bits", f64::from(bits), "1 to 32", |b| {
            (1.0..=32.0).contains(&b)
        })?;
        check_positive("full_scale_a", full_scale_a)?;
        check(
            "full_scale_a",
            full_scale_a,
            "large enough for its steps to be normal numbers",
            |s| (s / 2f64.powi(31)).is_normal(),
        )?;
        let levels = f64::from(bits).exp2();
        Ok(Self {
            step_a: 2.0 * full_scale_a / levels,
            half: 0.5 * levels,
        })
    }

    /// Current from one code to the next \[A\], `2 full_scale/2^bits`.
    pub fn step_a(&self) -> f64 {
        self.step_a
    }

    /// Replaces each current by that of its code, and returns how many were clipped, being beyond
    /// full scale. Complex samples have a converter for each part.
    ///
    /// # Errors
    /// [`Error::ElementOutOfRange`] with the first sample that is NaN; then nothing was changed.
    pub fn digitise<T: Sample>(&self, samples_a: &mut [T]) -> Result<u64, Error> {
        let mut bad = None;
        for (index, sample) in samples_a.iter_mut().enumerate() {
            sample.for_each_part(|part| {
                if part.is_nan() {
                    bad = bad.or(Some((index, *part)));
                }
            });
        }
        if let Some((index, value)) = bad {
            return Err(Error::ElementOutOfRange {
                field: "samples_a",
                index,
                value,
                allowed: "a number",
            });
        }
        let mut clipped = 0;
        for sample in samples_a {
            sample.for_each_part(|part| {
                // Before and after saturation.
                let code = (*part / self.step_a).round_ties_even();
                let kept = code.clamp(-self.half, self.half - 1.0);
                clipped += u64::from(code != kept);
                *part = kept * self.step_a;
            });
        }
        Ok(clipped)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use num_complex::Complex;

    #[test]
    fn a_full_scale_tone_has_6_db_per_bit() {
        for bits in [8, 10, 12, 14] {
            let digitiser = Digitiser::new(bits, 2e-3).unwrap();
            let amplitude_a = 2e-3 - 2.0 * digitiser.step_a();
            let tone: Vec<f64> = (0..100_000)
                .map(|k| amplitude_a * (0.737_123 * f64::from(k)).sin())
                .collect();
            let mut digital = tone.clone();
            assert_eq!(digitiser.digitise(&mut digital).unwrap(), 0);
            let error: f64 = tone
                .iter()
                .zip(&digital)
                .map(|(a, b)| (a - b).powi(2))
                .sum::<f64>()
                / 1e5;
            assert_relative_eq!(
                error,
                digitiser.step_a().powi(2) / 12.0,
                max_relative = 0.03
            );
            let ratio_db = 10.0 * (0.5 * amplitude_a * amplitude_a / error).log10();
            assert!(
                (ratio_db - (6.02 * f64::from(bits) + 1.76)).abs() < 0.3,
                "{bits} bits: {ratio_db} dB"
            );
        }
    }

    #[test]
    fn what_lies_beyond_full_scale_is_clipped_and_counted() {
        let digitiser = Digitiser::new(3, 4.0).unwrap();
        let mut samples = [
            -9.0, -4.4, -4.6, -4.0, -0.4, 0.0, 0.6, 2.5, 3.0, 3.4, 3.6, 1e300,
        ];
        let clipped = digitiser.digitise(&mut samples).unwrap();
        assert_eq!(
            samples,
            [
                -4.0, -4.0, -4.0, -4.0, 0.0, 0.0, 1.0, 2.0, 3.0, 3.0, 3.0, 3.0
            ]
        );
        assert_eq!(clipped, 4);
        let mut others = [f64::INFINITY, -2.2];
        digitiser.digitise(&mut others).unwrap();
        assert_eq!(others, [3.0, -2.0]);
        let mut pair = [Complex::new(9.0, -1.2)];
        assert_eq!(digitiser.digitise(&mut pair).unwrap(), 1);
        assert_eq!(pair[0], Complex::new(3.0, -1.0));
    }

    #[test]
    fn one_bit_keeps_the_sign() {
        let digitiser = Digitiser::new(1, 1.0).unwrap();
        let mut samples = [-0.9, 0.2, -0.6];
        digitiser.digitise(&mut samples).unwrap();
        assert_eq!(samples, [-1.0, 0.0, -1.0]);
    }

    #[test]
    fn what_is_no_converter_or_no_sample_is_refused() {
        for (bits, scale) in [(0, 1.0), (33, 1.0), (8, 0.0), (8, f64::NAN), (8, 1e-305)] {
            assert!(matches!(
                Digitiser::new(bits, scale),
                Err(Error::OutOfRange { .. })
            ));
        }
        let digitiser = Digitiser::new(8, 1.0).unwrap();
        let mut samples = [0.123, f64::NAN];
        assert!(matches!(
            digitiser.digitise(&mut samples),
            Err(Error::ElementOutOfRange { index: 1, .. })
        ));
        assert_eq!(samples[0], 0.123);
        let complex = digitiser.digitise(&mut [Complex::new(0.0, f64::NAN)]);
        assert!(matches!(
            complex,
            Err(Error::ElementOutOfRange { index: 0, .. })
        ));
    }
}
