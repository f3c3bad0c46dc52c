//! What a key may hold, in words: the kind of value, its unit, names that are near.

use super::key::{Key, Kind, join};

/// Longest piece of a file that a message repeats, in characters.
const LONGEST_QUOTE: usize = 60;

/// Endings of names and their units, longer ones first.
const UNITS: &str = include_str!("units.csv");

/// The unit of a key by its name.
pub(crate) fn unit_of(key: &str) -> Option<&'static str> {
    UNITS
        .lines()
        .filter_map(|line| line.split_once(','))
        .find(|(end, _)| key.ends_with(end))
        .map(|(_, unit)| unit)
}

/// " in m", or nothing where the name has no unit.
fn in_unit(key: &str) -> String {
    unit_of(key)
        .map(|unit| format!(" in {unit}"))
        .unwrap_or_default()
}

/// The kind of value that a key of this name takes, in place of what is written.
pub(super) fn wanted(key: &str, kind: &Kind, written: &str) -> String {
    match kind {
        Kind::Number => format!("a number{}", in_unit(key)),
        Kind::Whole { largest } if *largest < u64::from(u32::MAX) => {
            format!("a whole number from 0 to {largest}")
        }
        Kind::Whole { .. } => "a whole number that is not negative".into(),
        Kind::Switch => "true or false".into(),
        Kind::Text => "a text in quotation marks".into(),
        Kind::Choice(names) => one_of(names, written),
        Kind::List { of, len } => {
            let many = len.map(|len| format!("{len} ")).unwrap_or_default();
            match &**of {
                Kind::Number => format!("a list of {many}numbers{}", in_unit(key)),
                Kind::Whole { .. } => {
                    format!("a list of {many}whole numbers that are not negative")
                }
                Kind::Choice(names) => format!("a list of {many}names out of {}", list(names)),
                _ => format!("a list of {many}values"),
            }
        }
        Kind::Table(_) | Kind::Tagged { .. } => "a table".into(),
    }
}

/// `one of "a", "b"`, with the one that may have been meant by what is written.
pub(crate) fn one_of(names: &[&str], written: &str) -> String {
    let hint =
        near(written, names.iter().copied()).map(|name| format!("; did you mean \"{name}\"?"));
    format!("one of {}{}", list(names), hint.unwrap_or_default())
}

fn list(names: &[&str]) -> String {
    names
        .iter()
        .map(|name| format!("\"{name}\""))
        .collect::<Vec<_>>()
        .join(", ")
}

/// The name that is nearest to a word, if it is near enough to be meant: by letters that must be put in, taken out, changed or
/// swapped with their neighbour to get from one to the other.
pub(crate) fn near<'a>(word: &str, names: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let word: String = word
        .chars()
        .take(LONGEST_QUOTE)
        .map(|c| c.to_ascii_lowercase())
        .collect();
    let far = (word.chars().count() / 3).max(1);
    let distances = names.map(|name| (strsim::osa_distance(&word, name), name));
    distances
        .filter(|(d, _)| *d <= far)
        .min_by_key(|(d, _)| *d)
        .map(|(_, name)| name)
}

/// A piece of a file, on one line and not too long.
pub(super) fn quote(text: &str) -> String {
    let line = text.trim().lines().next().unwrap_or_default();
    let short: String = line
        .chars()
        .filter(|c| !c.is_control())
        .take(LONGEST_QUOTE)
        .collect();
    if short.len() < text.trim().len() {
        format!("{short}...")
    } else {
        short
    }
}

/// Path of the first table, from the one at `path` on, that has a key of this name.
pub(super) fn table_with(keys: &[Key], name: &str, path: &str) -> Option<String> {
    if keys.iter().any(|key| key.name == name) {
        return Some(path.to_owned());
    }
    keys.iter().find_map(|key| match &key.kind {
        Kind::Table(inner) => table_with(inner, name, &join(path, key.name)),
        Kind::Tagged { kinds, .. } => kinds
            .iter()
            .find_map(|(_, k)| table_with(k, name, &join(path, key.name))),
        _ => None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_come_from_the_end_of_the_name() {
        let number = |key| wanted(key, &Kind::Number, "");
        assert_eq!(number("energy_j"), "a number in J");
        assert_eq!(number("circulation_m2_s"), "a number in m^2/s");
        assert_eq!(number("backscatter_per_m_sr"), "a number in 1/(m sr)");
        assert_eq!(number("radial_velocity_m_s"), "a number in m/s");
        assert_eq!(number("quantum_efficiency"), "a number");
    }

    #[test]
    fn slips_of_the_finger_are_near_and_other_words_are_not() {
        let names = ["wavelength_m", "pulse_repetition_hz"];
        assert_eq!(
            near("wavelenght_m", names.into_iter()),
            Some("wavelength_m")
        );
        assert_eq!(near("Wavelength", names.into_iter()), Some("wavelength_m"));
        assert_eq!(near("colour", names.into_iter()), None);
        assert_eq!(near("", names.into_iter()), None);
    }

    #[test]
    fn quotes_are_short_and_on_one_line() {
        assert_eq!(quote("150e-6"), "150e-6");
        assert_eq!(quote("[\n1.0,\n]"), "[...");
        assert_eq!(quote(&"x".repeat(100_000)).len(), 63);
    }
}
