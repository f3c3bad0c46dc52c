//! The one rule by which numbers with chance in them decide claims: independent batches, at least eight, Student's factor, 95 %.
//!
//! A number comes from all batches, its standard error from leaving out one at a time, whatever function of the data it is. Where
//! signals are shared it is the difference that is estimated. What the interval does not decide is open.
//! Check: the factors are those of tables; intervals cover the truth as often as they say.

use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Batches below which nothing is decided, and the most into which scans are put: more make Student's factor smaller, to no end.
pub(crate) const BATCHES: usize = 8;
pub(crate) const MOST_BATCHES: usize = 24;
/// Share of a level below which two levels do not differ.
pub(crate) const NO_DIFFERENCE: f64 = 0.03;

/// How a claim came out; of parts that must all hold it is the largest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Verdict {
    Pass,
    /// The uncertainty, or the resolution of the profile, does not allow a verdict.
    Open,
    Fail,
}

impl Verdict {
    /// Pass or fail.
    pub(crate) fn of(pass: bool) -> Self {
        if pass { Self::Pass } else { Self::Fail }
    }

    pub(crate) fn name(self) -> &'static str {
        ["pass", "open", "fail"][self as usize]
    }
}

/// A number with its standard error and the degrees of freedom of that.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Estimate {
    pub(crate) value: f64,
    pub(crate) standard_error: f64,
    pub(crate) freedom: f64,
}

impl Estimate {
    /// Of a function of the data: from all batches, and without one of them.
    pub(crate) fn of(batches: usize, function: impl Fn(Option<usize>) -> f64) -> Self {
        let n = batches as f64;
        let without: Vec<f64> = (0..batches).map(|batch| function(Some(batch))).collect();
        let mean = without.iter().sum::<f64>() / n;
        let squares: f64 = without.iter().map(|x| (x - mean).powi(2)).sum();
        Self {
            value: function(None),
            standard_error: ((n - 1.0) / n * squares).sqrt(),
            freedom: n - 1.0,
        }
    }

    /// The mean of independent numbers.
    pub(crate) fn mean(of: &[f64]) -> Self {
        Self::of(of.len(), |without| mean(of, without))
    }

    /// Their standard deviation.
    pub(crate) fn deviation(of: &[f64]) -> f64 {
        Self::mean(of).standard_error * (of.len() as f64).sqrt()
    }

    /// A number of many parts whose error is known from their law.
    pub(crate) fn stated(value: f64, standard_error: f64) -> Self {
        Self {
            value,
            standard_error,
            freedom: f64::INFINITY,
        }
    }

    /// The same in another unit.
    pub(crate) fn times(self, factor: f64) -> Self {
        Self {
            value: factor * self.value,
            standard_error: factor.abs() * self.standard_error,
            ..self
        }
    }

    /// Half of the interval that holds the truth with 95 %.
    pub(crate) fn half_width(&self) -> f64 {
        self.half_width_of(1)
    }

    /// The same where so many numbers must hold theirs together.
    pub(crate) fn half_width_of(&self, places: usize) -> f64 {
        student(1.0 - 0.05 / places as f64, self.freedom) * self.standard_error
    }

    pub(crate) fn words(&self) -> String {
        with_error(self.value, self.standard_error)
    }

    /// Both ends of an interval about the value.
    fn interval(&self, half_width: f64) -> (f64, f64) {
        (self.value - half_width, self.value + half_width)
    }
}

/// The mean of some numbers without one of them.
pub(crate) fn mean(numbers: &[f64], without: Option<usize>) -> f64 {
    let mut retained = numbers.to_vec();
    if let Some(index) = without.filter(|index| *index < numbers.len()) {
        retained.remove(index);
    }
    retained.iter().sum::<f64>() / retained.len() as f64
}

/// Where a number must lie.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Bar {
    Below(f64),
    Above(f64),
    Between(f64, f64),
    /// Below zero; what is surely above minus this is no difference.
    Less(f64),
}

impl Bar {
    pub(crate) fn verdict(self, of: &Estimate) -> Verdict {
        self.verdict_among(of, 1)
    }

    /// The same where so many numbers must all hold: each by its own interval, for all holding by chance is rarer than one; that one of
    /// them fails by chance is not, so it fails by the interval of all.
    pub(crate) fn verdict_among(self, of: &Estimate, parts: usize) -> Verdict {
        let (low, high) = of.interval(of.half_width());
        let (lowest, highest) = of.interval(of.half_width_of(parts));
        let (holds, fails) = match self {
            Self::Below(bar) => (high < bar, lowest > bar),
            Self::Above(bar) => (low > bar, highest < bar),
            Self::Between(least, most) => {
                (low > least && high < most, highest < least || lowest > most)
            }
            Self::Less(trifle) => (high < 0.0, lowest > -trifle),
        };
        match (of.freedom + 1.5 > BATCHES as f64, holds, fails) {
            (true, true, _) => Verdict::Pass,
            (true, _, true) => Verdict::Fail,
            _ => Verdict::Open,
        }
    }

    /// How many times the data would decide, if the number stays.
    pub(crate) fn times_the_data(self, of: &Estimate) -> f64 {
        let value = of.value;
        let reach = match self {
            Self::Below(bar) | Self::Above(bar) => (value - bar).abs(),
            Self::Between(least, most) => (value - least).abs().min((value - most).abs()),
            Self::Less(trifle) => value.abs().max((value + trifle).abs()),
        };
        let times = (of.half_width() / reach).powi(2);
        if times.is_nan() {
            f64::INFINITY
        } else {
            times.max(BATCHES as f64 / (of.freedom + 1.0))
        }
    }
}

/// An error as it is told: two digits.
fn two_digits(error: f64) -> String {
    format!("{error:.*}", decimals(error))
}

/// A value with as many decimals as its standard error has in two digits, and the error.
pub(crate) fn with_error(value: f64, error: f64) -> String {
    match (value.is_finite(), error.is_finite()) {
        (true, true) => format!("{value:.*} ± {}", decimals(error), two_digits(error)),
        (true, false) => format!("{value:.3} ± unknown"),
        (false, _) => "not known".into(),
    }
}

/// Decimals of a number of two digits; of what is zero or no number, three.
fn decimals(error: f64) -> usize {
    if error.is_finite() && error > 0.0 {
        (1.0 - error.log10().floor()).clamp(0.0, 12.0) as usize
    } else {
        3
    }
}

/// Student's factor of a two-sided interval.
fn student(confidence: f64, freedom: f64) -> f64 {
    StudentsT::new(0.0, 1.0, freedom.clamp(1.0, 1e4))
        .map_or(f64::NAN, |law| law.inverse_cdf(0.5 + 0.5 * confidence))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::{Rng, SeedableRng};

    #[test]
    fn numbers_have_the_digits_of_their_error() {
        let found = [
            with_error(12.3456, 0.0321),
            with_error(-1.0, 4.56),
            with_error(1234.5, 67.0),
            two_digits(0.2),
        ];
        assert_eq!(found, ["12.346 ± 0.032", "-1.0 ± 4.6", "1234 ± 67", "0.20"]);
        assert_eq!(with_error(0.5, f64::NAN), "0.500 ± unknown");
        assert_eq!(with_error(f64::NAN, 0.1), "not known");
    }

    #[test]
    fn factors_are_those_of_tables() {
        let tables = [
            (0.95, 1.0, 12.706),
            (0.95, 7.0, 2.3646),
            (0.95, 30.0, 2.0423),
            (0.99, 7.0, 3.4995),
        ];
        for (confidence, freedom, factor) in tables {
            assert!(
                (student(confidence, freedom) / factor - 1.0).abs() < 2e-4,
                "{confidence} {freedom}"
            );
        }
        assert!((student(0.95, f64::INFINITY) - 1.96).abs() < 1e-3);
    }

    #[test]
    fn intervals_of_a_ratio_of_eight_batches_cover_it() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
        // squares of normal numbers: skew, as mean square errors are
        let mut square = || {
            let mut uniform = || ((rng.next_u64() >> 11) as f64 + 0.5) / (1_u64 << 53) as f64;
            -2.0 * uniform().ln() * (std::f64::consts::TAU * uniform()).cos().powi(2)
        };
        let trials = 2000;
        let covered = (0..trials).filter(|_| {
            let mut batch = || (0..60).map(|_| square()).sum::<f64>() / 60.0;
            let (a, b): (Vec<f64>, Vec<f64>) =
                (0..BATCHES).map(|_| (2.0 * batch(), batch())).unzip();
            let ratio = Estimate::of(BATCHES, |without| mean(&a, without) / mean(&b, without));
            (ratio.value - 2.0).abs() < ratio.half_width()
        });
        let share = covered.count() as f64 / f64::from(trials);
        assert!(
            (share - 0.95).abs() < 3.0 * (0.95_f64 * 0.05 / f64::from(trials)).sqrt() + 0.005,
            "{share}"
        );
    }

    #[test]
    fn bars_decide_beyond_the_interval_only_and_with_eight_batches() {
        let of = |value: f64, standard_error: f64, freedom: f64| Estimate {
            value,
            standard_error,
            freedom,
        };
        let cases = [
            (Bar::Less(0.03), of(-0.3, 0.1, 7.0), Verdict::Pass),
            (Bar::Less(0.03), of(-0.3, 0.1, 6.0), Verdict::Open),
            (Bar::Less(0.03), of(-0.2, 0.1, 7.0), Verdict::Open),
            (Bar::Less(0.03), of(-0.01, 0.008, 7.0), Verdict::Fail),
            (Bar::Below(1.0), of(0.9, 0.03, 7.0), Verdict::Pass),
            (Bar::Above(1.0), of(0.9, 0.03, 7.0), Verdict::Fail),
            (Bar::Between(-0.1, 0.1), of(0.0, 0.05, 7.0), Verdict::Open),
            (Bar::Between(-0.1, 0.1), of(0.0, 0.04, 7.0), Verdict::Pass),
            (Bar::Between(-0.1, 0.1), of(0.5, 0.04, 7.0), Verdict::Fail),
            (Bar::Below(1.0), of(f64::NAN, 0.03, 7.0), Verdict::Open),
        ];
        for (bar, estimate, verdict) in cases {
            assert_eq!(bar.verdict(&estimate), verdict, "{bar:?} {estimate:?}");
        }
        // Of four that must hold together one fails beyond the interval of all, and holds beyond its own.
        let [fails, holds] = [of(1.09, 0.03, 7.0), of(0.92, 0.03, 7.0)]
            .map(|e| Bar::Below(1.0).verdict_among(&e, 4));
        assert_eq!([fails, holds], [Verdict::Open, Verdict::Pass]);
        // Four times the data halve the interval.
        let estimate = of(0.9, 0.1, 7.0);
        let needed = Bar::Below(1.0).times_the_data(&estimate);
        assert!((needed - 2.3646_f64.powi(2)).abs() < 1e-2, "{needed}");
        assert_eq!(Bar::Below(1.0).times_the_data(&of(0.0, 1e-9, 1.0)), 4.0);
    }
}
