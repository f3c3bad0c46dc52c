//! Missing samples: not finite, fill values, and those that dwarf all others.
//!
//! A window that holds one is skipped. The remaining samples are scaled by a power of two, so that amplitudes of 1e-200 and 1e200
//! have the same velocity to the last bit. Check: windows without such a sample have the same bits as in a record without it.

use crate::window::{Gates, Sample};

/// Binary orders of magnitude without a sample above which the larger samples are no signal, if they are the fewer ones.
///
/// 2^20 in amplitude are 120 dB in power: more than lies between the noise of a detector and a hard target.
const GAP: usize = 20;

/// Values that stand for a sample that was not taken: -9999, and the fill value of NetCDF's floats and doubles. One part of a complex
/// sample is enough.
pub const FILL_VALUES: [f64; 2] = [-9999.0, 15.0 * (1_u128 << 119) as f64];

/// Number of samples of each binary order of magnitude, from which outsized samples are found where those of a scan arrive piece by
/// piece.
#[derive(Debug, Clone)]
pub struct SampleSizes {
    counts: Vec<usize>,
    /// The largest sample of each binary order, as exponents are stored.
    largest: Vec<f64>,
}

impl Default for SampleSizes {
    fn default() -> Self {
        Self {
            counts: vec![0; 2048],
            largest: vec![0.0; 2048],
        }
    }
}

impl SampleSizes {
    /// Counts a sample by the size of its largest part, unless that is 0 or not finite.
    pub fn add(&mut self, size: f64) {
        if size > 0.0 && size.is_finite() {
            let order = (size.to_bits() >> 52) as usize;
            self.counts[order] += 1;
            self.largest[order] = self.largest[order].max(size);
        }
    }

    /// Size from which on samples are missing, infinite if none is: more than 2^20 times larger than the next smaller ones, where they are
    /// less than half of all that are not 0.
    ///
    /// A single 1e308 or an unknown fill value would otherwise outweigh all windows of its region.
    #[must_use]
    pub fn outsized(&self) -> f64 {
        let all: usize = self.counts.iter().sum();
        let mut above = 0;
        let mut last = None;
        let mut limit = f64::INFINITY;
        for (order, &count) in self.counts.iter().enumerate().rev() {
            if count == 0 {
                continue;
            }
            if let Some(last) = last
                && last - order > GAP
                && 2 * above < all
            {
                limit = f64::from_bits((last as u64) << 52);
            }
            above += count;
            last = Some(order);
        }
        limit
    }

    /// Number of samples of the size `limit` of [`SampleSizes::outsized`] and above.
    #[must_use]
    pub fn count_from(&self, limit: f64) -> usize {
        if !limit.is_finite() {
            return 0;
        }
        // The limit is the least size of its binary order.
        let order = (limit.to_bits() >> 52) as usize;
        self.counts.iter().skip(order).sum()
    }

    /// The largest sample below `limit`; 0 if there is none.
    #[must_use]
    pub fn largest_below(&self, limit: f64) -> f64 {
        let mut largest: f64 = 0.0;
        for &size in &self.largest {
            if size < limit {
                largest = largest.max(size);
            }
        }
        largest
    }
}

/// Which samples are missing.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MissingRule {
    fill: &'static [f64],
    /// Samples of this size and above are missing.
    limit: f64,
}

impl MissingRule {
    /// Only samples that are not finite are missing.
    pub(crate) const NOT_FINITE: Self = Self {
        fill: &[],
        limit: f64::INFINITY,
    };

    /// The rule for a set of samples: [`FILL_VALUES`] are missing, and those that dwarf the others ([`SampleSizes::outsized`]).
    pub(crate) fn from_samples<S: Sample>(samples: impl Iterator<Item = S>) -> Self {
        let filled = Self {
            fill: &FILL_VALUES,
            limit: f64::INFINITY,
        };
        let mut sizes = SampleSizes::default();
        for sample in samples {
            if filled.is_measured(sample) {
                sizes.add(sample.largest_part());
            }
        }
        Self {
            limit: sizes.outsized(),
            ..filled
        }
    }

    pub(crate) fn is_measured<S: Sample>(&self, sample: S) -> bool {
        sample.is_finite()
            && sample.largest_part() < self.limit
            && !self.fill.iter().any(|fill| sample.has_part(*fill))
    }

    /// Power of two next to the largest part of the measured samples; `None` if there is none above 0.
    ///
    /// Dividing by it is exact and brings the samples to order one, so that squares neither overflow nor vanish.
    pub(crate) fn binary_scale<S: Sample>(&self, samples: impl Iterator<Item = S>) -> Option<f64> {
        let mut largest: f64 = 0.0;
        for sample in samples {
            if self.is_measured(sample) {
                largest = largest.max(sample.largest_part());
            }
        }
        // clamped so that the scale and its inverse are both normal numbers
        (largest > 0.0).then(|| largest.log2().floor().clamp(-1000.0, 1000.0).exp2())
    }
}

/// Which windows of a ray hold a missing sample; `None` if the ray has none.
pub(crate) fn invalid_windows<S: Sample>(
    samples: impl Iterator<Item = S>,
    rule: &MissingRule,
    gates: &Gates,
    count: usize,
) -> Option<Vec<bool>> {
    let mut missing = Vec::new();
    for (index, sample) in samples.enumerate() {
        if !rule.is_measured(sample) {
            missing.push(index);
        }
    }
    if missing.is_empty() {
        return None;
    }
    let mut invalid = Vec::with_capacity(count);
    for gate in 0..count {
        let start = gate * gates.step_samples;
        let next = missing.partition_point(|index| *index < start);
        let first_missing = missing.get(next);
        invalid.push(first_missing.is_some_and(|index| *index < start + gates.window_samples));
    }
    Some(invalid)
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_complex::Complex;

    fn measured(samples: &[f64]) -> Vec<bool> {
        let rule = MissingRule::from_samples(samples.iter().copied());
        samples
            .iter()
            .map(|sample| rule.is_measured(*sample))
            .collect()
    }

    #[test]
    fn fill_values_and_the_few_that_dwarf_the_others_are_missing() {
        assert_eq!(
            measured(&[0.3, f64::NAN, -0.1, 1e308, 0.0]),
            [true, false, true, false, true]
        );
        assert_eq!(
            measured(&[1.0, -9999.0, 2.0, 9.969_209_968_386_869e36]),
            [true, false, true, false]
        );
        assert_eq!(
            measured(&[1e-6, -9999.0, 9999.0, 1e-6, 2e-6]),
            [true, false, false, true, true]
        );
        // several unlike ones, each far above the next
        assert_eq!(
            measured(&[1e-6, 1e300, 1e30, 3e-6, 1e-6, 2e-6, 1e6]),
            [true, false, false, true, true, true, false]
        );
    }

    #[test]
    fn samples_that_are_taken_for_missing_are_counted() {
        let mut sizes = SampleSizes::default();
        for size in [1e-6, 3e-6, 0.0, 1e-6, 2e-6, 1e20, 3e20, f64::INFINITY] {
            sizes.add(size);
        }
        assert_eq!(sizes.count_from(sizes.outsized()), 2);
        assert_eq!(SampleSizes::default().count_from(f64::INFINITY), 0);
    }

    #[test]
    fn what_a_detector_can_see_is_measured() {
        // 100 dB between noise and target, and amplitudes without any scale
        assert_eq!(measured(&[1.0, 1e5, -2.0]), [true; 3]);
        assert_eq!(measured(&[1e200, -3e200, 0.0]), [true; 3]);
        // the larger ones are the more: the small ones are residues of rounding
        assert_eq!(measured(&[1e-17, 1.0, -1.0, 0.5]), [true; 4]);
        assert_eq!(measured(&[0.0, 5.0]), [true; 2]);
        let all = MissingRule::NOT_FINITE;
        assert!(all.is_measured(1e308) && !all.is_measured(f64::NAN));
    }

    #[test]
    fn scale_is_a_power_of_two_next_to_the_largest_sample() {
        fn scale<S: Sample>(samples: &[S]) -> f64 {
            MissingRule::from_samples(samples.iter().copied())
                .binary_scale(samples.iter().copied())
                .unwrap_or(1.0)
        }
        assert_eq!(scale(&[0.3, -5.0, f64::NAN, 1e300, 2.0]), 4.0);
        assert_eq!(scale(&[Complex::new(0.0, 0.25)]), 0.25);
        assert_eq!(
            scale(&[Complex::new(0.5, -9999.0), Complex::new(1.0, 1.0)]),
            1.0
        );
        assert_eq!(scale(&[0.0]), 1.0);
        assert!(scale(&[1e-320]).recip().is_finite());
    }
}
