//! From a key as a user writes it to the key of the scene that it names, and from texts to values of it.
//!
//! A path may omit tables in its middle where only one key fits: `pulse.duration_s` is `pulse.shape.duration_s`.
//! `added_flows.0.lateral_m_s` is a key of the first added flow.
//! Check: every key that can vary is found by its whole path; those that cannot are refused with the reason.

use crate::keys::{Key, Kind, Problem, join, near, one_of};
use crate::scene::SceneFile;
use serde::{Deserialize, Serialize};
use toml::Value;

/// Sections that change no result.
const WITHOUT_RESULT: [&str; 3] = ["format", "outputs", "site"];

/// A key of the scene with what it takes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SceneKey {
    /// As it was written, such as `pulse.duration_s`.
    pub(crate) name: String,
    /// Its path, such as `pulse.shape.duration_s`.
    pub(crate) path: String,
    pub(crate) kind: Kind,
}

fn leaves(keys: &[Key], path: &str, out: &mut Vec<SceneKey>) {
    for key in keys {
        let here = join(path, key.name);
        match &key.kind {
            Kind::Table(inner) => leaves(inner, &here, out),
            Kind::Tagged { tag, kinds } => {
                let names = kinds.iter().map(|(name, _)| *name).collect();
                out.push(SceneKey::at(join(&here, tag), Kind::Choice(names)));
                for (_, inner) in kinds {
                    leaves(inner, &here, out);
                }
            }
            kind => match out.iter_mut().find(|known| known.path == here) {
                // A key of this name in several kinds of the table: reading the scene says whether it has the one in force.
                Some(known) => join_kinds(&mut known.kind, kind),
                None => out.push(SceneKey::at(here, kind.clone())),
            },
        }
    }
}

/// What a key may hold that is of one kind or of another: names of both, or else what can vary.
fn join_kinds(known: &mut Kind, other: &Kind) {
    match (known, other) {
        (Kind::Choice(known), Kind::Choice(names)) => {
            for name in names {
                if !known.contains(name) {
                    known.push(name);
                }
            }
        }
        (known @ Kind::List { .. }, other) => *known = other.clone(),
        _ => {}
    }
}

fn all() -> &'static [SceneKey] {
    static ALL: std::sync::LazyLock<Vec<SceneKey>> = std::sync::LazyLock::new(|| {
        let mut out = Vec::new();
        leaves(SceneFile::keys(), "", &mut out);
        out
    });
    &ALL
}

/// Whether `path` has the tables that `short` names in this order, the first one first, and the same last name.
fn shortens(short: &str, path: &str) -> bool {
    let mut rest = short.split('.').peekable();
    let mut whole = path.split('.');
    let is_begun = rest.next() == whole.next();
    let last = whole.fold("", |_, part| {
        rest.next_if_eq(&part);
        part
    });
    is_begun && rest.next().is_none() && short.ends_with(last)
}

/// The key that a path names; `value` is what it was to be, for the message.
pub(crate) fn resolve(written: &str, value: &str) -> Result<SceneKey, Problem> {
    let refused = |allowed| Problem::new(written, value, allowed);
    let Some((index, key)) = added_flow(written) else {
        let key = varying_key(written).map_err(refused)?;
        return Ok(SceneKey {
            name: written.into(),
            ..key.clone()
        });
    };
    // An added flow has the keys of the first one.
    let flow = varying_key(&format!("flow.{key}")).map_err(refused)?;
    let own = flow.path.split_once('.').map_or("", |(_, own)| own);
    Ok(SceneKey {
        name: written.into(),
        path: format!("added_flows.{index}.{own}"),
        kind: flow.kind.clone(),
    })
}

/// Number and key of an added flow.
fn added_flow(written: &str) -> Option<(usize, &str)> {
    let (index, key) = written.strip_prefix("added_flows.")?.split_once('.')?;
    Some((index.parse().ok()?, key))
}

fn varying_key(written: &str) -> Result<&'static SceneKey, String> {
    let exact = all().iter().find(|key| key.path == written);
    let named: Vec<&SceneKey> = match exact {
        Some(key) => vec![key],
        None => all()
            .iter()
            .filter(|key| shortens(written, &key.path))
            .collect(),
    };
    let key = match named[..] {
        [one] => one,
        [] => return Err(unknown(written)),
        _ => {
            let paths: Vec<&str> = named.iter().map(|key| key.path.as_str()).collect();
            return Err(format!(
                "several keys have this name; one of {} is needed",
                paths.join(", ")
            ));
        }
    };
    let section = key.path.split('.').next().unwrap_or_default();
    if WITHOUT_RESULT.contains(&section) {
        return Err(format!(
            "a key of [{section}] changes no result of a sweep and cannot vary"
        ));
    }
    if let Kind::List { .. } = key.kind {
        return Err("a list cannot vary, only numbers, names and switches".into());
    }
    Ok(key)
}

/// What to write instead of a path that no key has.
fn unknown(written: &str) -> String {
    let paths: Vec<&str> = all().iter().map(|key| key.path.as_str()).collect();
    let mut below = Vec::new();
    for path in &paths {
        below.extend(path.strip_prefix(&format!("{written}.")));
    }
    if !below.is_empty() {
        return format!(
            "this is a table and cannot vary, its keys can: {}",
            below.join(", ")
        );
    }
    let mut meant = near(written, paths.iter().copied());
    if meant.is_none() {
        let name = near(last_part(written), paths.iter().map(|path| last_part(path)));
        let mut paths = paths.iter().copied();
        meant = name.and_then(|name| paths.find(|path| last_part(path) == name));
    }
    let hint = meant
        .map(|path| format!("; did you mean {path}?"))
        .unwrap_or_default();
    let section = first_part(written);
    let mut known = paths.clone();
    known.retain(|path| first_part(path) == section);
    if !known.is_empty() {
        return format!(
            "there is no such key{hint} Known there: {}",
            known.join(", ")
        );
    }
    let mut sections: Vec<&str> = paths.iter().map(|path| first_part(path)).collect();
    sections.dedup();
    format!(
        "there is no such key{hint} Sections: {}",
        sections.join(", ")
    )
}

/// The section of a path.
fn first_part(path: &str) -> &str {
    path.split('.').next().unwrap_or(path)
}

/// The name of a key without its tables.
fn last_part(path: &str) -> &str {
    path.rsplit('.').next().unwrap_or(path)
}

impl SceneKey {
    /// A key by its whole path.
    fn at(path: String, kind: Kind) -> Self {
        Self {
            name: path.clone(),
            path,
            kind,
        }
    }

    /// A text as a value of the key.
    pub(crate) fn read(&self, text: &str) -> Result<Value, Problem> {
        let text = text.trim();
        let word = text.trim_matches('"');
        let value = match &self.kind {
            Kind::Number | Kind::Whole { .. } => {
                text.parse().ok().and_then(|number| self.number(number))
            }
            Kind::Switch => word.parse().ok().map(Value::Boolean),
            Kind::Choice(names) if !names.contains(&word) => None,
            _ => Some(Value::String(word.into())),
        };
        value.ok_or_else(|| self.refused(text))
    }

    /// A number as a value of the key; whole ones may be off by rounding.
    pub(crate) fn of_number(&self, number: f64) -> Result<Value, Problem> {
        self.number(number)
            .ok_or_else(|| self.refused(&format!("{number:?}")))
    }

    fn number(&self, number: f64) -> Option<Value> {
        let whole = number.round();
        match self.kind {
            Kind::Number => Some(Value::Float(number)),
            Kind::Whole { largest } => {
                let is_whole = (number - whole).abs() <= 1e-9 * whole.abs().max(1.0);
                // What is beyond the exact whole numbers of f64 is read as text elsewhere.
                let fits = (0.0..=largest.min(1 << 53) as f64).contains(&whole);
                (is_whole && fits).then_some(Value::Integer(whole as i64))
            }
            _ => None,
        }
    }

    fn refused(&self, value: &str) -> Problem {
        let allowed = match &self.kind {
            Kind::Number => "a number, e.g. 1.5e-6".into(),
            Kind::Whole { .. } => "a whole number from 0, e.g. 16".into(),
            Kind::Choice(names) => one_of(names, value),
            _ => "true or false".into(),
        };
        Problem::new(self.path.clone(), value, allowed)
    }
}

/// What a column of keys holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Holds {
    Numbers,
    #[serde(rename = "whole numbers")]
    WholeNumbers,
    Texts,
}

/// A key that varies.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct VaryingKey {
    #[serde(rename = "key")]
    pub(super) name: String,
    pub(super) holds: Holds,
    /// Whether others determine it.
    pub(super) tied: bool,
}

impl VaryingKey {
    pub(super) fn new(key: &SceneKey, tied: bool) -> Self {
        Self {
            name: key.name.clone(),
            holds: match key.kind {
                Kind::Number => Holds::Numbers,
                Kind::Whole { .. } => Holds::WholeNumbers,
                _ => Holds::Texts,
            },
            tied,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_that_can_vary_is_found_by_its_path_and_unique_ones_by_a_shorter_one() {
        let mut varying = 0;
        for own in all() {
            let is_list = matches!(own.kind, Kind::List { .. });
            match resolve(&own.path, "1") {
                Ok(key) => {
                    assert!(key == *own && !is_list);
                    varying += 1;
                }
                Err(problem) => assert!(
                    is_list || problem.allowed.contains("changes no result"),
                    "{problem}"
                ),
            }
        }
        assert!(varying > 70, "{varying}");
        for (short, path) in [
            ("pulse.duration_s", "pulse.shape.duration_s"),
            ("atmosphere.cn2_m_m23", "atmosphere.turbulence.cn2_m_m23"),
            ("detector.reference", "detector.snr.reference"),
            ("estimator.order", "estimator.method.order"),
            (
                "added_flows.2.dissipation_m2_s3",
                "added_flows.2.dissipation_m2_s3",
            ),
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
            (
                "estimator.kind",
                "one of estimator.method.kind, estimator.radius.kind",
            ),
            ("pulse.shape.power", "a list cannot vary"),
            ("outputs.csv", "changes no result"),
            ("format", "changes no result"),
        ] {
            let problem = resolve(written, "1").unwrap_err();
            assert!(
                problem.key == written && problem.allowed.contains(wanted),
                "{problem}"
            );
        }
    }

    #[test]
    fn values_are_of_the_kind_of_their_key() {
        let value = |key: &str, text: &str| resolve(key, text).unwrap().read(text);
        assert_eq!(
            value("pulse.energy_j", "50e-6").unwrap(),
            Value::Float(50e-6)
        );
        assert_eq!(
            value("telescope.focus_m", "inf").unwrap(),
            Value::Float(f64::INFINITY)
        );
        assert_eq!(
            value("scan.pulses_per_line", "16").unwrap(),
            Value::Integer(16)
        );
        assert_eq!(
            value("scan.pulses_per_line", "31.999999999999996").unwrap(),
            Value::Integer(32)
        );
        assert_eq!(
            value("flow.mirror_y", "true").unwrap(),
            Value::Boolean(true)
        );
        // The height of a pair, not the heights of a mean wind.
        assert_eq!(value("flow.height_m", "60").unwrap(), Value::Float(60.0));
        // The profile of a mean wind, not that of a vortex.
        assert_eq!(
            value("added_flows.0.profile", "power").unwrap(),
            Value::String("power".into())
        );
        assert_eq!(
            value("estimator.method.kind", "\"pulse_pair\"").unwrap(),
            Value::String("pulse_pair".into())
        );
        for (key, text) in [
            ("scan.pulses_per_line", "1.5"),
            ("scan.pulses_per_line", "-1"),
            ("pulse.energy_j", "much"),
            ("pulse.energy_j", ""),
            ("estimator.method.kind", "pulse_par"),
            ("flow.mirror_y", "1"),
            ("added_flows.0.profile", "flat"),
        ] {
            let problem = value(key, text).unwrap_err();
            assert!(
                problem.value == text && !problem.allowed.is_empty(),
                "{problem}"
            );
        }
        assert!(
            value("estimator.method.kind", "pulse_par")
                .unwrap_err()
                .allowed
                .contains("did you mean \"pulse_pair\"?")
        );
    }
}
