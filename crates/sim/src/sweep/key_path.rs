//! From a key as a user writes it to the key of the scene that it names, and from texts to values of it.
//!
//! A path may leave out tables in its middle where only one key fits: `pulse.duration_s` is `pulse.shape.duration_s`.
//! Check: every key that can vary is found by its whole path; those that cannot are refused with the reason.

use crate::keys::{Key, Kind, Problem, join, near, one_of};
use crate::scene::SceneFile;
use toml::Value;

/// Sections that change no result.
const WITHOUT_RESULT: [&str; 3] = ["format", "outputs", "site"];

/// What a key takes that can vary.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Takes {
    Number,
    Whole { largest: u64 },
    Switch,
    Text,
    Choice(Vec<&'static str>),
}

/// A key of the scene that can vary.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct SceneKey {
    /// Its path, such as `pulse.shape.duration_s`.
    pub(super) path: String,
    pub(super) takes: Takes,
}

/// A path and what it takes; none for lists and tables, which cannot vary.
type Leaf = (String, Option<Takes>);

fn leaves(keys: &[Key], path: &str, out: &mut Vec<Leaf>) {
    for key in keys {
        let here = join(path, key.name);
        let takes = match &key.kind {
            Kind::Table(inner) => {
                leaves(inner, &here, out);
                continue;
            }
            Kind::Tagged { tag, kinds } => {
                out.push((join(&here, tag), Some(Takes::Choice(kinds.iter().map(|(name, _)| *name).collect()))));
                kinds.iter().for_each(|(_, inner)| leaves(inner, &here, out));
                continue;
            }
            Kind::Number => Some(Takes::Number),
            Kind::Whole { largest } => Some(Takes::Whole { largest: *largest }),
            Kind::Switch => Some(Takes::Switch),
            Kind::Text => Some(Takes::Text),
            Kind::Choice(names) => Some(Takes::Choice(names.to_vec())),
            Kind::List { .. } => None,
        };
        if !out.iter().any(|(known, _)| *known == here) {
            out.push((here, takes));
        }
    }
}

fn all() -> &'static [Leaf] {
    static ALL: std::sync::LazyLock<Vec<Leaf>> = std::sync::LazyLock::new(|| {
        let mut out = Vec::new();
        leaves(SceneFile::keys(), "", &mut out);
        out
    });
    &ALL
}

/// Whether the tables that `short` names stand in this order in `path`, the first first, before the same last name.
fn shortens(short: &str, path: &str) -> bool {
    let (mut rest, mut whole) = (short.split('.').peekable(), path.split('.'));
    if rest.next() != whole.next() {
        return false;
    }
    let mut last = "";
    for part in whole {
        rest.next_if_eq(&part);
        last = part;
    }
    rest.next().is_none() && short.ends_with(last)
}

/// The key that a path names; `value` is what it was to be, for the message.
pub(super) fn resolve(written: &str, value: &str) -> Result<SceneKey, Problem> {
    let refuse = |allowed: String| Problem { key: written.into(), value: value.into(), allowed };
    let exact = all().iter().find(|(path, _)| path == written);
    let short: Vec<&Leaf> = match exact {
        Some(leaf) => vec![leaf],
        None => all().iter().filter(|(path, _)| shortens(written, path)).collect(),
    };
    let (path, takes) = match short[..] {
        [one] => one,
        [] => return Err(refuse(unknown(written))),
        _ => {
            let paths: Vec<&str> = short.iter().map(|(path, _)| path.as_str()).collect();
            return Err(refuse(format!("several keys have this name; one of {} is needed", paths.join(", "))));
        }
    };
    let section = path.split('.').next().unwrap_or_default();
    if WITHOUT_RESULT.contains(&section) {
        return Err(refuse(format!("a key of [{section}] changes no result of a sweep and cannot vary")));
    }
    let takes = takes.clone().ok_or_else(|| refuse("a list cannot vary, only numbers, names and switches".into()))?;
    Ok(SceneKey { path: path.clone(), takes })
}

/// What to write instead of a path that no key has.
fn unknown(written: &str) -> String {
    let below: Vec<&str> = all().iter().filter_map(|(path, _)| path.strip_prefix(&format!("{written}."))).collect();
    if !below.is_empty() {
        return format!("this is a table and cannot vary, its keys can: {}", below.join(", "));
    }
    let name = |path: &'static str| path.rsplit('.').next().unwrap_or(path);
    let paths = || all().iter().map(|(path, _)| path.as_str());
    let last = written.rsplit('.').next().unwrap_or(written);
    let meant = near(written, paths())
        .or_else(|| near(last, paths().map(name)).and_then(|meant| paths().find(|path| name(path) == meant)));
    let section = written.split('.').next().unwrap_or(written);
    let known: Vec<&str> = paths().filter(|path| path.split('.').next() == Some(section)).collect();
    let hint = meant.map(|path| format!("; did you mean {path}?")).unwrap_or_default();
    match known.is_empty() {
        true => {
            let mut sections: Vec<&str> = paths().filter_map(|path| path.split('.').next()).collect();
            sections.dedup();
            format!("there is no such key{hint} Sections: {}", sections.join(", "))
        }
        false => format!("there is no such key{hint} Known there: {}", known.join(", ")),
    }
}

impl SceneKey {
    /// A text as a value of the key.
    pub(super) fn read(&self, text: &str) -> Result<Value, Problem> {
        let unquoted = text.trim().trim_matches('"');
        let read = match &self.takes {
            Takes::Number | Takes::Whole { .. } => match text.trim().parse() {
                Ok(number) => {
                    let as_written = |problem| Problem { value: text.trim().into(), ..problem };
                    return self.of_number(number).map_err(as_written);
                }
                Err(_) => None,
            },
            Takes::Switch => unquoted.parse().ok().map(Value::Boolean),
            Takes::Text => Some(Value::String(unquoted.into())),
            Takes::Choice(names) => names.contains(&unquoted).then(|| Value::String(unquoted.into())),
        };
        read.ok_or_else(|| self.refused(text.trim()))
    }

    /// A number as a value of the key; whole ones may be off by rounding.
    pub(super) fn of_number(&self, number: f64) -> Result<Value, Problem> {
        let whole = number.round();
        match self.takes {
            Takes::Number => Ok(Value::Float(number)),
            Takes::Whole { largest } if (number - whole).abs() <= 1e-9 * whole.abs().max(1.0) && whole >= 0.0 => {
                // What is beyond the exact whole numbers of f64 is read as text elsewhere.
                (whole <= largest.min(1 << 53) as f64).then_some(Value::Integer(whole as i64))
            }
            .ok_or_else(|| self.refused(&format!("{number:?}"))),
            _ => Err(self.refused(&format!("{number:?}"))),
        }
    }

    /// Whether ranges of numbers make sense.
    pub(super) fn is_numeric(&self) -> bool {
        matches!(self.takes, Takes::Number | Takes::Whole { .. })
    }

    fn refused(&self, value: &str) -> Problem {
        let allowed = match &self.takes {
            Takes::Number => "a number, e.g. 1.5e-6".into(),
            Takes::Whole { .. } => "a whole number from 0, e.g. 16".into(),
            Takes::Switch => "true or false".into(),
            Takes::Text => "a text".into(),
            Takes::Choice(names) => {
                let hint = near(value, names.iter().copied()).map(|name| format!("; did you mean \"{name}\"?"));
                one_of(names) + &hint.unwrap_or_default()
            }
        };
        Problem { key: self.path.clone(), value: value.into(), allowed }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_that_can_vary_is_found_by_its_path_and_unique_ones_by_a_shorter_one() {
        let mut varying = 0;
        for (path, takes) in all() {
            match resolve(path, "1") {
                Ok(key) => {
                    assert_eq!((&key.path, Some(&key.takes)), (path, takes.as_ref()));
                    varying += 1;
                }
                Err(problem) => assert!(takes.is_none() || problem.allowed.contains("changes no result"), "{problem}"),
            }
        }
        assert!(varying > 70, "{varying}");
        for (short, path) in [
            ("pulse.duration_s", "pulse.shape.duration_s"),
            ("atmosphere.cn2_m_m23", "atmosphere.turbulence.cn2_m_m23"),
            ("detector.reference", "detector.snr.reference"),
            ("estimator.order", "estimator.method.order"),
        ] {
            assert_eq!(resolve(short, "1").unwrap().path, path);
        }
    }

    #[test]
    fn keys_that_do_not_exist_or_cannot_vary_say_what_would_do() {
        for (written, wanted) in [
            ("pulse.enrgy_j", "did you mean pulse.energy_j?"),
            ("energy_j", "did you mean pulse.energy_j?"),
            ("pulse", "its keys can: energy_j"),
            ("colour", "Sections: "),
            ("estimator.kind", "one of estimator.method.kind, estimator.radius.kind"),
            ("pulse.shape.power", "a list cannot vary"),
            ("outputs.csv", "changes no result"),
            ("format", "changes no result"),
        ] {
            let problem = resolve(written, "1").unwrap_err();
            assert!(problem.key == written && problem.allowed.contains(wanted), "{problem}");
        }
    }

    #[test]
    fn values_are_of_the_kind_of_their_key() {
        let value = |key: &str, text: &str| resolve(key, text).unwrap().read(text);
        assert_eq!(value("pulse.energy_j", "50e-6").unwrap(), Value::Float(50e-6));
        assert_eq!(value("telescope.focus_m", "inf").unwrap(), Value::Float(f64::INFINITY));
        assert_eq!(value("scan.pulses_per_line", "16").unwrap(), Value::Integer(16));
        assert_eq!(value("scan.pulses_per_line", "31.999999999999996").unwrap(), Value::Integer(32));
        assert_eq!(value("estimator.follow_wind", "true").unwrap(), Value::Boolean(true));
        assert_eq!(value("estimator.method.kind", "\"capon\"").unwrap(), Value::String("capon".into()));
        for (key, text) in [
            ("scan.pulses_per_line", "1.5"),
            ("scan.pulses_per_line", "-1"),
            ("pulse.energy_j", "much"),
            ("pulse.energy_j", ""),
            ("estimator.method.kind", "carpon"),
            ("estimator.follow_wind", "1"),
        ] {
            let problem = value(key, text).unwrap_err();
            assert!(problem.value == text && !problem.allowed.is_empty(), "{problem}");
        }
        assert!(value("estimator.method.kind", "carpon").unwrap_err().allowed.contains("did you mean \"capon\"?"));
    }
}
