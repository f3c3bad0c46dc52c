//! Statements about results, measured: those of the chapter about its figures, bars of flows, tolerances of stored curves.

use serde::{Deserialize, Serialize};
use std::fmt;

/// Share of a level below which two levels do not differ.
pub(crate) const NO_DIFFERENCE: f64 = 0.05;

/// How a claim came out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Verdict {
    Pass,
    Fail,
    /// The uncertainty, or the resolution of the profile, does not allow a verdict.
    NotResolved,
}

impl Verdict {
    /// Pass or fail.
    pub(crate) fn of(pass: bool) -> Self {
        if pass { Self::Pass } else { Self::Fail }
    }

    /// Of differences, each a share of the level with its standard error, of which `limit` are trusted: pass if all are
    /// above their errors, fail if one is surely below [`NO_DIFFERENCE`].
    pub(crate) fn of_differences(shares: &[(f64, f64)], limit: f64) -> Self {
        let all = shares.iter().all(|(share, error)| *share > limit * error);
        let none = shares.iter().any(|(share, error)| share + limit * error < NO_DIFFERENCE);
        match (all, none) {
            (true, _) => Self::Pass,
            (_, true) => Self::Fail,
            _ => Self::NotResolved,
        }
    }

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Fail => "fail",
            Self::NotResolved => "not_resolved",
        }
    }
}

/// A statement, measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Claim {
    /// A number of its own, such as F7a; a flow's bar has none.
    pub(crate) id: String,
    /// What it is about: a figure; empty where the task says it.
    pub(crate) figure: String,
    pub(crate) statement: String,
    pub(crate) expected: String,
    pub(crate) measured: String,
    /// NaN where the measurement is deterministic.
    pub(crate) standard_error: f64,
    pub(crate) verdict: Verdict,
}

impl Claim {
    /// A claim that a computation without random numbers decides.
    pub(crate) fn exact(id: &str, figure: &str, statement: &str, expected: &str, measured: String, pass: bool) -> Self {
        Self {
            id: id.into(),
            figure: figure.into(),
            statement: statement.into(),
            expected: expected.into(),
            measured,
            standard_error: f64::NAN,
            verdict: Verdict::of(pass),
        }
    }

    /// A quantity that may be `allowed` from its reference, in its own unit; what is not a number passes no bar.
    pub(crate) fn within(quantity: &str, measured: f64, reference: f64, allowed: f64) -> Self {
        let expected = format!("{} ± {allowed:.2e}", number(reference));
        Self::exact("", "", quantity, &expected, number(measured), (measured - reference).abs() <= allowed)
    }

    /// Within `share` of the reference.
    pub(crate) fn relative(quantity: &str, measured: f64, reference: f64, share: f64) -> Self {
        Self::within(quantity, measured, reference, share * reference.abs())
    }

    /// At least `reference`.
    pub(crate) fn at_least(quantity: &str, measured: f64, reference: f64) -> Self {
        let expected = format!("at least {}", number(reference));
        Self::exact("", "", quantity, &expected, number(measured), measured >= reference)
    }

    /// At most `reference`.
    pub(crate) fn at_most(quantity: &str, measured: f64, reference: f64) -> Self {
        let expected = format!("at most {}", number(reference));
        Self::exact("", "", quantity, &expected, number(measured), measured <= reference)
    }

    pub(crate) fn passes(&self) -> bool {
        self.verdict == Verdict::Pass
    }
}

/// An error as it is told: two digits.
pub(crate) fn two_digits(error: f64) -> String {
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
    if error.is_finite() && error > 0.0 { (1.0 - error.log10().floor()).clamp(0.0, 12.0) as usize } else { 3 }
}

/// Six digits after the point, or of a small number.
fn number(x: f64) -> String {
    if x == 0.0 || x.abs() >= 1e-3 { format!("{x:.6}") } else { format!("{x:.6e}") }
}

impl fmt::Display for Claim {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { id, statement, expected, measured, .. } = self;
        write!(f, "{:<12} {id:<4} {statement}: expected {expected}, measured {measured}", self.verdict.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_digits_of_their_error() {
        let found = [with_error(12.3456, 0.0321), with_error(-1.0, 4.56), with_error(1234.5, 67.0), two_digits(0.2)];
        assert_eq!(found, ["12.346 ± 0.032", "-1.0 ± 4.6", "1234 ± 67", "0.20"]);
        assert_eq!(with_error(0.5, f64::NAN), "0.500 ± unknown");
        assert_eq!(with_error(f64::NAN, 0.1), "not known");
    }

    #[test]
    fn bars_hold_their_ends_and_nothing_that_is_no_number() {
        assert!(Claim::relative("q", 1.01, 1.0, 0.0101).passes() && !Claim::relative("q", 1.02, 1.0, 0.01).passes());
        assert!(Claim::at_least("q", 2.0, 2.0).passes() && !Claim::at_least("q", 1.9, 2.0).passes());
        assert!(Claim::at_most("q", 2.0, 2.0).passes() && !Claim::at_most("q", 2.1, 2.0).passes());
        for claim in [Claim::within("q", f64::NAN, 0.0, 1.0), Claim::at_least("q", f64::NAN, 0.0)] {
            assert!(!claim.passes() && claim.measured == "NaN");
        }
        assert_eq!(
            Claim::at_most("q", 2e-9, 0.5).to_string(),
            "pass              q: expected at most 0.500000, measured 2.000000e-9"
        );
    }

    #[test]
    fn differences_decide_only_beyond_their_errors() {
        let of = |shares: &[(f64, f64)]| Verdict::of_differences(shares, 2.0);
        let large = (0.5, 0.1);
        assert_eq!(
            [of(&[large, (0.03, 0.01)]), of(&[large, (-0.5, 0.1)]), of(&[large, (0.01, 0.015)])],
            [Verdict::Pass, Verdict::Fail, Verdict::Fail]
        );
        let unsure = [(0.1, 0.1), (0.0, 0.03), (f64::NAN, 0.1), (0.1, f64::NAN)];
        assert!(unsure.iter().all(|share| of(&[large, *share]) == Verdict::NotResolved));
    }
}
