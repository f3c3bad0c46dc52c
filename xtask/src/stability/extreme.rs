//! A stiff or extreme case: what is asked, what it must come to, and what it came to.

use crate::failure::Failure;
use crate::statistics::Verdict;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

/// What a case must come to.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Expected {
    /// A number from the first to the second, ends included.
    Between(f64, f64),
    /// An error whose message holds these words.
    Refused(&'static str),
}

impl std::fmt::Display for Expected {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Between(low, high) if low == high => write!(f, "{}", number(*low)),
            Self::Between(low, high) if *low == 0.0 => write!(f, "at most {}", number(*high)),
            Self::Between(low, high) => write!(f, "{} to {}", number(*low), number(*high)),
            Self::Refused(words) => write!(f, "refused: \"{words}\""),
        }
    }
}

/// Few digits, with an exponent only where it is needed.
fn number(x: f64) -> String {
    let size = x.abs();
    if x == 0.0 || (1e-3..1e6).contains(&size) {
        format!("{}", (x * 1e6).round() / 1e6)
    } else {
        format!("{x:.1e}").replace(".0e", "e")
    }
}

/// One case; what it computes is a number, or the message of an error.
pub(super) struct Extreme {
    pub(super) name: &'static str,
    /// What is asked, with its numbers.
    pub(super) input: &'static str,
    /// What the number of the outcome is.
    pub(super) quantity: &'static str,
    pub(super) expected: Expected,
    /// Takes more than a few seconds: left out of the quick profile.
    pub(super) long: bool,
    pub(super) compute: fn() -> Result<f64, Failure>,
}

impl Extreme {
    /// A case whose number must lie between two.
    pub(super) const fn between(
        name: &'static str,
        input: &'static str,
        quantity: &'static str,
        (low, high): (f64, f64),
        compute: fn() -> Result<f64, Failure>,
    ) -> Self {
        Self { name, input, quantity, expected: Expected::Between(low, high), long: false, compute }
    }

    /// A case whose number, an error or a share, must lie between nothing and a bar.
    pub(super) const fn at_most(
        name: &'static str,
        input: &'static str,
        quantity: &'static str,
        bar: f64,
        compute: fn() -> Result<f64, Failure>,
    ) -> Self {
        Self::between(name, input, quantity, (0.0, bar), compute)
    }

    /// A case that must be refused with these words in the message; the number is what was computed instead.
    pub(super) const fn refused(
        name: &'static str,
        input: &'static str,
        words: &'static str,
        compute: fn() -> Result<f64, Failure>,
    ) -> Self {
        Self { name, input, quantity: "a message", expected: Expected::Refused(words), long: false, compute }
    }

    /// The same for the longer profiles alone.
    pub(super) const fn long(self) -> Self {
        Self { long: true, ..self }
    }

    /// Runs the case; a panic is an outcome, and never the expected one.
    pub(super) fn run(&self) -> Ended {
        let start = Instant::now();
        let found = catch_unwind(AssertUnwindSafe(self.compute));
        let (outcome, verdict, used) = match (found, &self.expected) {
            (Err(_), _) => ("panicked".into(), Verdict::Fail, f64::NAN),
            (Ok(Ok(x)), Expected::Between(low, high)) => {
                let (middle, half) = if *low == 0.0 { (0.0, *high) } else { (0.5 * (low + high), 0.5 * (high - low)) };
                let away = (x - middle).abs();
                let used = if away == 0.0 { 0.0 } else { away / half };
                (number(x), Verdict::of((*low..=*high).contains(&x)), used)
            }
            (Ok(Ok(x)), Expected::Refused(_)) => (format!("accepted: {}", number(x)), Verdict::Fail, f64::NAN),
            (Ok(Err(error)), expected) => {
                let message = error.to_string();
                let wanted = matches!(expected, Expected::Refused(words) if message.contains(words));
                (format!("refused: {message}"), Verdict::of(wanted), f64::NAN)
            }
        };
        Ended { outcome, verdict, used, took_s: start.elapsed().as_secs_f64() }
    }
}

/// How a case ended.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Ended {
    /// The number, the message, or that it panicked.
    pub(super) outcome: String,
    pub(super) verdict: Verdict,
    /// Share of what is allowed that the number takes, 1 at the bar; NaN where the case is refused.
    pub(super) used: f64,
    /// Wall-clock time \[s\]; no verdict depends on it.
    pub(super) took_s: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_refusals_and_panics_are_told_apart() {
        let number: fn() -> Result<f64, Failure> = || Ok(2.0);
        let refusal: fn() -> Result<f64, Failure> = || Err(Failure::new("x_m = NaN: must be finite".into()));
        let panic: fn() -> Result<f64, Failure> = || panic!("a test of what panics");
        let of = |case: Extreme| (case.run().verdict, case.run().used);
        assert_eq!(of(Extreme::at_most("", "", "", 2.0, number)), (Verdict::Pass, 1.0));
        assert_eq!(of(Extreme::at_most("", "", "", 1.9, number)).0, Verdict::Fail);
        assert_eq!(of(Extreme::between("", "", "", (1.0, 5.0), number)), (Verdict::Pass, 0.5));
        assert_eq!(of(Extreme::at_most("", "", "", 1.0, || Ok(f64::NAN))).0, Verdict::Fail);
        assert_eq!(of(Extreme::refused("", "", "x_m", refusal)).0, Verdict::Pass);
        assert_eq!(of(Extreme::refused("", "", "y_m", refusal)).0, Verdict::Fail);
        assert_eq!(of(Extreme::refused("", "", "x_m", number)).0, Verdict::Fail);
        assert_eq!(of(Extreme::at_most("", "", "", 2.0, refusal)).0, Verdict::Fail);
        assert_eq!(of(Extreme::at_most("", "", "", 2.0, panic)).0, Verdict::Fail);
        assert_eq!(Extreme::at_most("", "", "", 2.0, panic).run().outcome, "panicked");
    }
}
