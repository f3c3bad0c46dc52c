//! Distributions of a plan, and the numbers of the scrambled Sobol sequence that are put into them.
//!
//! The sequence is Owen-scrambled by hashing (Burley 2020, "Practical hash-based Owen scrambling"), each point on its own, so that
//! flights do not depend on each other. An aligned block of 2^k points has one in each of 2^k strata of every dimension.
//!
//! Check: stored numbers of the sequence to the bit and of the distributions to 1e-9 (`tests/reference/dataset`); strata of blocks.

use crate::keys::{Kind, Problem};
use crate::sweep::SceneKey;
use statrs::distribution::{Continuous, ContinuousCDF, Normal};
use toml::Value;

/// Half a step of the sequence, whose numbers are multiples of 2^-24: no distribution is evaluated at 0.
const HALF_STEP: f64 = 1.0 / (1 << 25) as f64;
/// Standard deviations from the mean beyond which the probabilities of a normal law are no normal numbers of f64.
const FARTHEST: f64 = 37.0;
/// Dimensions of the sequence.
pub(super) const DIMENSIONS: usize = sobol_burley::NUM_DIMENSIONS as usize;
/// Points of one sequence: later ones repeat these.
pub(super) const MOST_POINTS: usize = 1 << 16;

/// What a distribution may look like, for messages.
const FORMS: &str = "a distribution such as { uniform = [-6.0, 6.0] }, { log_uniform = [1e-5, 1e-2] }, { normal = [0.0, 15.0, -45.0, 45.0] } \
                     (mean, standard deviation, least, most), { choice = [17.0, 30.0], weights = [3.0, 1.0] }, or an expression in \
                     quotation marks";

/// The number of the sequence of a seed at a point and a dimension, within (0, 1).
pub(super) fn uniform(point: usize, dimension: usize, seed: u32) -> f64 {
    f64::from(sobol_burley::sample(point as u32, dimension as u32, seed)) + HALF_STEP
}

/// How the values of a key are distributed.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Distribution {
    /// Equally likely between two bounds.
    Uniform { least: f64, most: f64 },
    /// The logarithm is equally likely between those of two bounds.
    LogUniform { least: f64, most: f64 },
    /// Normal, cut off at two bounds.
    Normal {
        mean: f64,
        standard_deviation: f64,
        least: f64,
        most: f64,
    },
    /// One of some values.
    Choice {
        values: Vec<Value>,
        weights: Vec<f64>,
    },
}

impl Distribution {
    /// Reads the distribution of a key.
    ///
    /// # Errors
    /// What is wrong with its bounds or weights, with an example; a value that the key cannot have.
    pub(super) fn read(name: &str, key: &SceneKey, value: &Value) -> Result<Self, Problem> {
        let refused = |allowed: &str| Problem::new(name, value.to_string(), allowed);
        let table = value.as_table().ok_or_else(|| refused(FORMS))?;
        let form = table.keys().find(|form| *form != "weights");
        let Some(form) =
            form.filter(|_| table.len() == 1 + usize::from(table.contains_key("weights")))
        else {
            return Err(refused(FORMS));
        };
        let list = table[form].as_array().ok_or_else(|| refused(FORMS))?;
        if form == "choice" {
            return Self::choice(name, key, list, table.get("weights"))
                .map_err(|allowed| refused(&allowed));
        }
        if table.contains_key("weights") {
            return Err(refused("weights only beside a choice"));
        }
        if key.kind != Kind::Number {
            return Err(refused(
                "a choice such as { choice = [1, 2] }: the key does not hold any number",
            ));
        }
        let numbers: Option<Vec<f64>> = list.iter().map(number).collect();
        let numbers = numbers.ok_or_else(|| refused(FORMS))?;
        if numbers.iter().any(|number| !number.is_finite()) {
            return Err(refused("finite numbers, e.g. { uniform = [-6.0, 6.0] }"));
        }
        match (form.as_str(), &numbers[..]) {
            ("uniform", &[least, most]) if least < most => Ok(Self::Uniform { least, most }),
            ("uniform", [_, _]) => Err(refused(
                "bounds of which the first is smaller, e.g. { uniform = [-6.0, 6.0] }",
            )),
            ("log_uniform", &[least, most]) if 0.0 < least && least < most => {
                Ok(Self::LogUniform { least, most })
            }
            ("log_uniform", [_, _]) => Err(refused(
                "bounds above 0 of which the first is smaller, e.g. { log_uniform = [1e-5, 1e-2] }",
            )),
            ("normal", &[mean, standard_deviation, least, most])
                if standard_deviation > 0.0 && least < most =>
            {
                let off = (least - mean).max(mean - most) / standard_deviation;
                if off > FARTHEST {
                    return Err(refused(&format!(
                        "bounds of which one is within {FARTHEST} standard deviations of the mean, e.g. {{ normal = [0.0, 15.0, -45.0, 45.0] }}"
                    )));
                }
                Ok(Self::Normal {
                    mean,
                    standard_deviation,
                    least,
                    most,
                })
            }
            ("normal", [_, _, _, _]) => Err(refused(
                "mean, a standard deviation above 0, least and most with least < most, e.g. { normal = [0.0, 15.0, -45.0, 45.0] }",
            )),
            _ => Err(refused(FORMS)),
        }
    }

    /// Reads a choice.
    fn choice(
        name: &str,
        key: &SceneKey,
        list: &[Value],
        weights: Option<&Value>,
    ) -> Result<Self, String> {
        if list.is_empty() {
            return Err("at least one value, e.g. { choice = [17.0, 30.0] }".into());
        }
        let mut values = Vec::with_capacity(list.len());
        for one in list {
            let text = one.as_str().map_or_else(|| one.to_string(), str::to_owned);
            let value = key.read(&text).map_err(|problem| {
                format!(
                    "a choice of {}: {name} is {}",
                    problem.allowed, problem.value
                )
            })?;
            if number(&value).is_some_and(|number| !number.is_finite()) {
                return Err("finite numbers, e.g. { choice = [17.0, 30.0] }".into());
            }
            values.push(value);
        }
        let allowed = "as many weights as values, none below 0 and not all 0, e.g. { choice = [17.0, 30.0], weights = [3.0, 1.0] }";
        let weights = match weights {
            None => vec![1.0; values.len()],
            Some(weights) => {
                let weights = weights.as_array().ok_or(allowed)?;
                let weights: Option<Vec<f64>> = weights.iter().map(number).collect();
                weights.ok_or(allowed)?
            }
        };
        if weights.len() != values.len() || !are_weights(&weights) {
            return Err(allowed.into());
        }
        Ok(Self::Choice { values, weights })
    }

    /// The value at a number of (0, 1).
    pub(super) fn value(&self, u: f64) -> Value {
        match self {
            Self::Uniform { least, most } => Value::Float(least + (most - least) * u),
            Self::LogUniform { least, most } => Value::Float(least * (most / least).powf(u)),
            Self::Normal {
                mean,
                standard_deviation,
                least,
                most,
            } => Value::Float(cut_normal([*mean, *standard_deviation], [*least, *most], u)),
            Self::Choice { values, weights } => values[chosen(weights, u)].clone(),
        }
    }

    /// Which of several values a choice has taken; `None` for numbers.
    pub(super) fn index_of(&self, value: &Value) -> Option<usize> {
        match self {
            Self::Choice { values, .. } => values.iter().position(|one| one == value),
            _ => None,
        }
    }

    /// Its values at the ends.
    pub(super) fn ends(&self) -> Vec<Value> {
        match self {
            Self::Choice { values, weights } => {
                let likely = values
                    .iter()
                    .zip(weights)
                    .filter(|(_, weight)| **weight > 0.0);
                likely.map(|(value, _)| value.clone()).collect()
            }
            _ => [HALF_STEP, 1.0 - HALF_STEP].map(|u| self.value(u)).into(),
        }
    }
}

/// Whether numbers can be weights: none negative or infinite, not all 0.
pub(super) fn are_weights(weights: &[f64]) -> bool {
    let sum: f64 = weights.iter().sum();
    weights.iter().all(|weight| *weight >= 0.0) && sum > 0.0 && sum.is_finite()
}

/// The first index whose cumulated weight exceeds the fraction u of their sum.
pub(super) fn chosen(weights: &[f64], u: f64) -> usize {
    let total: f64 = weights.iter().sum();
    let mut below = 0.0;
    for (index, weight) in weights.iter().enumerate() {
        below += weight;
        if u * total < below {
            return index;
        }
    }
    weights.len().saturating_sub(1)
}

/// The value below which a normal variable is that lies between two bounds, with probability u.
fn cut_normal([mean, standard_deviation]: [f64; 2], [least, most]: [f64; 2], u: f64) -> f64 {
    if least > mean {
        // Probabilities of the upper tail round to 1, those of its mirror image do not.
        return -cut_normal([-mean, standard_deviation], [-most, -least], 1.0 - u);
    }
    let Ok(normal) = Normal::new(mean, standard_deviation) else {
        return mean;
    };
    let low = normal.cdf(least);
    let high = normal.cdf(most);
    let below = low + u * (high - low);
    let first = normal.inverse_cdf(below);
    // One step of Newton: the inverse of the library has 11 digits.
    let last = first - (normal.cdf(first) - below) / normal.pdf(first);
    last.clamp(least, most)
}

fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Float(number) => Some(*number),
        Value::Integer(number) => Some(*number as f64),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::csv_input::TextTable;
    use std::path::PathBuf;

    fn reference(name: &str) -> TextTable {
        let folder =
            PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../tests/reference/dataset");
        TextTable::read(&folder.join(name)).unwrap()
    }

    #[test]
    fn numbers_of_the_sequence_are_the_stored_ones_to_the_bit() {
        let table = reference("sobol.csv");
        for row in &table.rows {
            let whole = |i: usize| row[i].parse::<u32>().unwrap();
            let wanted: f32 = row[3].parse().unwrap();
            let found = sobol_burley::sample(whole(1), whole(2), whole(0));
            assert_eq!(found.to_bits(), wanted.to_bits(), "{row:?}");
            let u = uniform(whole(1) as usize, whole(2) as usize, whole(0));
            assert_eq!(u, f64::from(wanted) + 2f64.powi(-25));
        }
        assert!(table.rows.len() > 100);
    }

    #[test]
    fn values_of_distributions_are_the_stored_ones() {
        let table = reference("draws.csv");
        let number_key = crate::sweep::resolve("flow.height_m", "").unwrap();
        let word_key = crate::sweep::resolve("estimator.weighting", "").unwrap();
        let whole_key = crate::sweep::resolve("scan.pulses_per_line", "").unwrap();
        for row in &table.rows {
            let json: serde_json::Value = serde_json::from_str(&row[0]).unwrap();
            let written = Value::try_from(&json).unwrap();
            let is_word = row[0].contains("gaussian");
            let is_whole = row[0].contains("[1, 2");
            let key = match (is_word, is_whole) {
                (true, _) => &word_key,
                (_, true) => &whole_key,
                _ => &number_key,
            };
            let distribution = Distribution::read("key", key, &written).unwrap();
            let found = distribution.value(row[1].parse::<f64>().unwrap() + HALF_STEP);
            if is_word {
                assert_eq!(found.as_str(), Some(row[2].as_str()), "{row:?}");
                continue;
            }
            let found = number(&found).unwrap();
            let wanted: f64 = row[2].parse().unwrap();
            assert!(
                (found - wanted).abs() <= 1e-9 * wanted.abs(),
                "{row:?} {found:?}"
            );
        }
        assert!(table.rows.len() > 100);
    }

    #[test]
    fn values_in_a_tail_are_those_of_the_law_and_mirror_each_other() {
        let key = crate::sweep::resolve("flow.height_m", "").unwrap();
        let read = |text: &str| {
            let table: toml::Table = toml::from_str(&format!("x = {text}")).unwrap();
            Distribution::read("key", &key, &table["x"]).unwrap()
        };
        for (low, high) in [(6.0, 8.0), (9.0, 12.0), (30.0, 40.0), (36.9, 60.0)] {
            let upper = read(&format!(
                "{{ normal = [1.0, 1.0, {:?}, {:?}] }}",
                1.0 + low,
                1.0 + high
            ));
            let lower = read(&format!(
                "{{ normal = [-1.0, 1.0, {:?}, {:?}] }}",
                -1.0 - high,
                -1.0 - low
            ));
            let mut before = 0.0;
            for step in 0..64 {
                let u = (f64::from(step) + 0.5) / 64.0;
                let drawn = number(&upper.value(u)).unwrap();
                assert_eq!(number(&lower.value(1.0 - u)), Some(-drawn));
                let value = drawn - 1.0;
                let is_within = (low..=high).contains(&value);
                assert!(is_within && value > before, "{low} {u}: {value}");
                // Far out the law is nearly exponential: the probability beyond x is exp(-x^2/2)/x (1 - 1/x^2 ...).
                let beyond =
                    |x: f64| (-0.5 * (x * x - low * low)).exp() / x * (1.0 - 1.0 / (x * x));
                let expected = (beyond(low) - beyond(value)) / (beyond(low) - beyond(high));
                assert!((expected - u).abs() < 0.01, "{low} {u}: {expected}");
                before = value;
            }
        }
    }

    #[test]
    fn an_aligned_block_has_one_point_in_each_stratum_of_every_dimension() {
        for dimension in [0, 1, 2, 17, 255] {
            for first in [0, 64, 65_472] {
                let mut strata = [false; 64];
                for point in first..first + 64 {
                    strata[(64.0 * uniform(point, dimension, 7)) as usize] = true;
                }
                assert!(strata.iter().all(|hit| *hit), "{dimension} {first}");
            }
        }
    }

    #[test]
    fn distributions_that_cannot_be_are_refused_with_an_example() {
        let key = crate::sweep::resolve("flow.height_m", "").unwrap();
        let whole = crate::sweep::resolve("scan.pulses_per_line", "").unwrap();
        for (text, wanted) in [
            ("{ uniform = [2.0, 1.0] }", "first is smaller"),
            ("{ uniform = [1.0, inf] }", "finite"),
            ("{ uniform = [1.0] }", "a distribution such as"),
            ("{ log_uniform = [0.0, 1.0] }", "above 0"),
            (
                "{ normal = [0.0, 0.0, -1.0, 1.0] }",
                "standard deviation above 0",
            ),
            ("{ normal = [0.0, 1.0, 1.0, 1.0] }", "least < most"),
            (
                "{ normal = [0.0, 1.0, 38.0, 40.0] }",
                "within 37 standard deviations",
            ),
            (
                "{ normal = [0.0, 1.0, -90.0, -38.0] }",
                "within 37 standard deviations",
            ),
            ("{ choice = [] }", "at least one value"),
            ("{ choice = [\"a\"] }", "a number"),
            (
                "{ choice = [1.0, 2.0], weights = [1.0] }",
                "as many weights",
            ),
            ("{ choice = [1.0, 2.0], weights = [0.0, 0.0] }", "not all 0"),
            (
                "{ choice = [1.0, 2.0], weights = [-1.0, 2.0] }",
                "none below 0",
            ),
            (
                "{ uniform = [1.0, 2.0], weights = [1.0] }",
                "only beside a choice",
            ),
            (
                "{ uniform = [1.0, 2.0], choice = [1.0] }",
                "a distribution such as",
            ),
            ("{ poisson = [1.0, 2.0] }", "a distribution such as"),
            ("3.0", "a distribution such as"),
        ] {
            let table: toml::Table = toml::from_str(&format!("x = {text}")).unwrap();
            let problem = Distribution::read("flow.height_m", &key, &table["x"]).unwrap_err();
            assert!(problem.allowed.contains(wanted), "{text}: {problem}");
        }
        let table: toml::Table = toml::from_str("x = { uniform = [1.0, 8.0] }").unwrap();
        let problem = Distribution::read("scan.pulses_per_line", &whole, &table["x"]).unwrap_err();
        assert!(problem.allowed.contains("choice"), "{problem}");
    }
}
