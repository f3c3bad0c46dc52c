//! Which samples are no measurements: not finite, fill values, and those that dwarf all others.
//!
//! A window that holds one is left out. What is left is scaled by a power of two, so that amplitudes of 1e-200 and 1e200
//! keep their velocity to the last bit. Check: windows without such a sample keep every bit of a record without it.

use crate::window::{Gates, Sample};

/// Binary orders of magnitude without a sample above which the larger samples are no signal, if they are the fewer ones.
///
/// 2^20 in amplitude are 120 dB in power: more than lies between the noise of a detector and a hard target.
const GAP: usize = 20;

/// Values that stand for a sample that was not taken: -9999, and the fill value of NetCDF's floats and doubles. One part of a complex
/// sample is enough.
pub const FILL_VALUES: [f64; 2] = [-9999.0, 15.0 * (1_u128 << 119) as f64];

/// How many samples there are of each binary order of magnitude: it tells which are outsized where the samples of a scan come
/// piece by piece.
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
    /// Counts a sample by the size of its largest part; 0 and what is not finite are none.
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
        let (mut above, mut last, mut limit) = (0, None, f64::INFINITY);
        for (order, count) in self
            .counts
            .iter()
            .enumerate()
            .rev()
            .filter(|(_, count)| **count > 0)
        {
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

    /// The largest sample below `limit`; 0 if there is none.
    #[must_use]
    pub fn largest_below(&self, limit: f64) -> f64 {
        self.largest
            .iter()
            .copied()
            .filter(|size| *size < limit)
            .fold(0.0, f64::max)
    }
}

/// Tells measured samples from missing ones.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rule {
    fill: &'static [f64],
    /// Samples of this size and above are missing.
    limit: f64,
}

impl Rule {
    /// Only samples that are not finite are missing.
    pub(crate) const NOT_FINITE: Self = Self {
        fill: &[],
        limit: f64::INFINITY,
    };

    /// For a set of samples: [`FILL_VALUES`] are missing, and those that dwarf the others ([`SampleSizes::outsized`]).
    pub(crate) fn of<S: Sample>(samples: impl Iterator<Item = S>) -> Self {
        let filled = Self {
            fill: &FILL_VALUES,
            limit: f64::INFINITY,
        };
        let mut sizes = SampleSizes::default();
        samples
            .filter(|sample| filled.is_measured(*sample))
            .for_each(|sample| sizes.add(sample.largest_part()));
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
        let measured = samples.filter(|sample| self.is_measured(*sample));
        let largest = measured.fold(0.0_f64, |largest, sample| {
            largest.max(sample.largest_part())
        });
        // clamped so that the scale and its inverse are both normal numbers
        (largest > 0.0).then(|| largest.log2().floor().clamp(-1000.0, 1000.0).exp2())
    }
}

/// Which windows of a ray hold a missing sample; `None` if no one does.
pub(crate) fn invalid_windows<S: Sample>(
    samples: impl Iterator<Item = S>,
    rule: &Rule,
    gates: &Gates,
    count: usize,
) -> Option<Vec<bool>> {
    let missing = samples
        .enumerate()
        .filter(|(_, sample)| !rule.is_measured(*sample));
    let bad: Vec<usize> = missing.map(|(index, _)| index).collect();
    let invalid = |gate: usize| {
        let start = gate * gates.step_samples;
        let next = bad.partition_point(|index| *index < start);
        bad.get(next)
            .is_some_and(|index| *index < start + gates.window_samples)
    };
    (!bad.is_empty()).then(|| (0..count).map(invalid).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_complex::Complex;

    fn measured(samples: &[f64]) -> Vec<bool> {
        let rule = Rule::of(samples.iter().copied());
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
    fn what_a_detector_can_see_is_measured() {
        // 100 dB between noise and target, and amplitudes without any scale
        assert_eq!(measured(&[1.0, 1e5, -2.0]), [true; 3]);
        assert_eq!(measured(&[1e200, -3e200, 0.0]), [true; 3]);
        // the larger ones are the more: the small ones are residues of rounding
        assert_eq!(measured(&[1e-17, 1.0, -1.0, 0.5]), [true; 4]);
        assert_eq!(measured(&[0.0, 5.0]), [true; 2]);
        let all = Rule::NOT_FINITE;
        assert!(all.is_measured(1e308) && !all.is_measured(f64::NAN));
    }

    #[test]
    fn scale_is_a_power_of_two_next_to_the_largest_sample() {
        fn scale<S: Sample>(samples: &[S]) -> f64 {
            Rule::of(samples.iter().copied())
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
