//! Statements about results, measured: those of the chapter about its figures, tolerances of stored curves.

use crate::statistics::{Bar, Estimate, Verdict};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;
use std::sync::LazyLock;

/// A statement, measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Claim {
    /// A number of its own, such as F7a.
    pub(crate) id: String,
    /// What it is about: a figure; empty where the task says it.
    pub(crate) figure: String,
    pub(crate) statement: String,
    pub(crate) expected: String,
    pub(crate) measured: String,
    /// What else was measured.
    pub(crate) beside: String,
    /// How many of its conditions hold, where it has several.
    pub(crate) tally: String,
    /// NaN where the measurement is deterministic.
    pub(crate) standard_error: f64,
    pub(crate) verdict: Verdict,
    /// What would decide it where it is open.
    pub(crate) decided_by: String,
}

/// A part of a statement: its name, what was found in a unit, and where it must lie.
#[derive(Debug, Clone)]
pub(crate) struct Part {
    name: String,
    pub(crate) found: Estimate,
    unit: &'static str,
    pub(crate) bar: Bar,
}

impl Part {
    pub(crate) fn new(
        name: impl Into<String>,
        found: Estimate,
        unit: &'static str,
        bar: Bar,
    ) -> Self {
        Self {
            name: name.into(),
            found,
            unit,
            bar,
        }
    }
}

/// The name, if there is one, and the number.
impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.name.is_empty() {
            write!(f, "{}: ", self.name)?;
        }
        write!(f, "{}{}", self.found.words(), self.unit)
    }
}

/// Which of the three lists a claim is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// What the chapter says, in its words.
    Chapter,
    Own,
    /// Arithmetic, copies, geometry: counted nowhere.
    Check,
}

impl Kind {
    pub(crate) fn name(self) -> &'static str {
        ["chapter", "own", "check"][self as usize]
    }
}

/// What the list says of a claim.
#[derive(Deserialize)]
struct Listed {
    id: String,
    statement: String,
    /// Absent where it depends on the run.
    #[serde(default)]
    expected: String,
    /// Whether it cannot fail unless the program is wrong.
    #[serde(default)]
    check: bool,
    /// The chapter's sentence, word for word; none of the program's own claims.
    quote: Option<String>,
    /// What the measured value of the chapter's is.
    #[serde(default)]
    label: String,
    /// Where the chapter's is judged, and what of that it does not say.
    #[serde(default)]
    case: String,
    /// Why the verdict may say little about the chapter.
    #[serde(default)]
    reservation: String,
}

/// All captions and claims of figures.
#[derive(Default, Deserialize)]
pub(crate) struct List {
    /// By the name of the figure.
    pub(crate) caption: BTreeMap<String, String>,
    claim: Vec<Listed>,
}

/// The list; the tests read it.
pub(crate) static LIST: LazyLock<List> =
    LazyLock::new(|| toml::from_str(include_str!("claims.toml")).unwrap_or_default());

impl Claim {
    /// A claim of the list that a computation without random numbers decides.
    pub(crate) fn exact(id: &str, measured: String, pass: bool) -> Self {
        let claim = Self {
            id: id.into(),
            figure: String::new(),
            statement: String::new(),
            expected: String::new(),
            measured,
            beside: String::new(),
            tally: String::new(),
            standard_error: f64::NAN,
            verdict: Verdict::of(pass),
            decided_by: String::new(),
        };
        let Some(Listed {
            statement,
            expected,
            ..
        }) = claim.listed()
        else {
            return claim;
        };
        Self {
            statement: statement.clone(),
            expected: expected.clone(),
            ..claim
        }
    }

    /// A claim of the list whose parts must all hold by the rule of statistics; those that do not are told first.
    pub(crate) fn judged(id: &str, parts: &[Part]) -> Self {
        let mut judged = Vec::new();
        let mut standard_error = 0.0_f64;
        // Of nothing, no sample decides anything.
        let mut times = if parts.is_empty() { f64::INFINITY } else { 0.0 };
        for part in parts {
            let verdict = part.bar.verdict_among(&part.found, parts.len());
            if verdict == Verdict::Open {
                times = times.max(part.bar.times_the_data(&part.found));
            }
            standard_error = standard_error.max(part.found.standard_error);
            judged.push((verdict, part.to_string()));
        }
        judged.sort_by_key(|(verdict, _)| std::cmp::Reverse(*verdict));
        let verdict = judged
            .first()
            .map_or(Verdict::Open, |(verdict, _)| *verdict);
        let hold = judged.iter().filter(|(v, _)| *v == Verdict::Pass).count();
        let tally = match parts.len() {
            0 | 1 => String::new(),
            all => format!("{hold} of {all} conditions hold"),
        };
        let measured: Vec<String> = judged.into_iter().map(|(_, words)| words).collect();
        let claim = Self {
            verdict,
            standard_error,
            tally,
            ..Self::exact(id, measured.join("; "), false)
        };
        if verdict != Verdict::Open {
            return claim;
        }
        if times < 100.0 {
            claim.open(&format!("about {times:.1} times the data"))
        } else {
            claim.open("no sample in reach")
        }
    }

    /// The same of one part, which needs no name.
    pub(crate) fn judged_alone(id: &str, found: Estimate, unit: &'static str, bar: Bar) -> Self {
        Self::judged(id, &[Part::new("", found, unit, bar)])
    }

    /// The claim, which fails if a fit failed, with their number beside it.
    pub(crate) fn of_fits(self, failures: usize, words: &str) -> Self {
        let verdict = if failures > 0 {
            Verdict::Fail
        } else {
            self.verdict
        };
        Self { verdict, ..self }.beside(words)
    }

    fn listed(&self) -> Option<&'static Listed> {
        LIST.claim.iter().find(|listed| listed.id == self.id)
    }

    pub(crate) fn kind(&self) -> Kind {
        match self.listed() {
            Some(Listed { quote: Some(_), .. }) => Kind::Chapter,
            Some(Listed { check: true, .. }) => Kind::Check,
            _ => Kind::Own,
        }
    }

    /// The sentence of the chapter, word for word; none of the program's own claims.
    pub(crate) fn quote(&self) -> Option<&'static str> {
        self.listed()?.quote.as_deref()
    }

    /// Where the statement of the chapter is judged, and what of that the chapter does not say.
    pub(crate) fn case(&self) -> &'static str {
        self.listed().map_or("", |listed| listed.case.as_str())
    }

    /// What of the chapter's is measured.
    pub(crate) fn label(&self) -> &'static str {
        self.listed().map_or("", |listed| listed.label.as_str())
    }

    /// Why the verdict may say little about the chapter; mostly nothing.
    pub(crate) fn reservation(&self) -> &'static str {
        self.listed()
            .map_or("", |listed| listed.reservation.as_str())
    }

    /// What was measured in one phrase: of several parts the one that decides.
    pub(crate) fn value(&self) -> String {
        let decisive = self.measured.split("; ").next().unwrap_or("");
        match self.label() {
            "" => decisive.into(),
            label => format!("{label}: {decisive}"),
        }
    }

    /// Everything that was measured.
    pub(crate) fn all_measured(&self) -> String {
        if self.beside.is_empty() {
            return self.measured.clone();
        }
        format!("{} ({})", self.measured, self.beside)
    }

    /// The sentence and its case, or what else the claim comes from.
    pub(crate) fn source(&self) -> String {
        match (self.kind(), self.quote()) {
            (_, Some(quote)) => format!("\"{quote}\" Judged at: {}.", self.case()),
            (Kind::Check, _) => {
                "arithmetic, a copy or geometry: cannot fail unless the program is wrong".into()
            }
            _ => "of this program".into(),
        }
    }

    /// The claim with what is expected of it in this run.
    pub(crate) fn expecting(self, expected: String) -> Self {
        Self { expected, ..self }
    }

    /// The claim as one that this run does not decide.
    pub(crate) fn open(self, decided_by: &str) -> Self {
        Self {
            verdict: Verdict::Open,
            decided_by: decided_by.into(),
            ..self
        }
    }

    /// The claim with what else was measured.
    pub(crate) fn beside(self, words: &str) -> Self {
        Self {
            beside: words.into(),
            ..self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workspace::root;

    #[test]
    fn a_claim_of_parts_holds_if_all_do_and_tells_first_what_does_not() {
        let part = |name: &str, value: f64| {
            Part::new(name, Estimate::stated(value, 0.1), " m/s", Bar::Below(1.0))
        };
        let of = |values: &[f64]| {
            Claim::judged(
                "F8",
                &values.iter().map(|v| part("p", *v)).collect::<Vec<_>>(),
            )
        };
        assert_eq!(
            [of(&[0.5, 0.6]).verdict, of(&[0.5, 1.1]).verdict],
            [Verdict::Pass, Verdict::Open]
        );
        let claim = of(&[0.5, 1.1, 2.0]);
        assert_eq!(
            (claim.verdict, claim.decided_by.as_str()),
            (Verdict::Fail, "")
        );
        assert_eq!(
            claim.measured,
            "p: 2.00 ± 0.10 m/s; p: 1.10 ± 0.10 m/s; p: 0.50 ± 0.10 m/s"
        );
        assert_eq!(claim.tally, "1 of 3 conditions hold");
        assert_eq!(of(&[0.9]).tally, "");
        assert_eq!(of(&[0.9]).decided_by, "about 3.8 times the data");
        assert_eq!(of(&[f64::NAN]).decided_by, "no sample in reach");
        assert_eq!(
            (of(&[]).verdict, of(&[]).decided_by.as_str()),
            (Verdict::Open, "no sample in reach")
        );
    }

    #[test]
    fn every_entry_is_a_claim_of_a_figure() {
        let folder = std::fs::read_dir(root().join("xtask/src/figures")).unwrap();
        let code: String = folder
            .map(|file| std::fs::read_to_string(file.unwrap().path()).unwrap())
            .collect();
        for Listed { id, .. } in &LIST.claim {
            assert!(code.contains(&format!("\"{id}\"")), "no figure claims {id}");
        }
        let is_quoted = |listed: &&Listed| listed.quote.is_some();
        assert_eq!(LIST.claim.iter().filter(is_quoted).count(), 19);
        let is_labelled = |listed: &Listed| listed.quote.is_some() != listed.label.is_empty();
        assert!(LIST.claim.iter().all(is_labelled));
        // And every claim of a figure is on the list.
        let is_claim = |word: &&str| {
            let number = word
                .strip_prefix("CP")
                .or(word.strip_prefix('F'))
                .or(word.strip_prefix('T'))
                .unwrap_or("");
            number.starts_with(|c: char| c.is_ascii_digit()) && number.len() < 4
        };
        for id in code.split('"').filter(is_claim) {
            assert!(
                LIST.claim.iter().any(|listed| listed.id == id),
                "{id} is not in claims.toml"
            );
        }
        let kinds =
            ["F13", "F5", "F18a"].map(|id| Claim::exact(id, String::new(), true).kind().name());
        assert_eq!(kinds, ["chapter", "check", "own"]);
    }
}
