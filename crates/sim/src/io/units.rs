//! Units of lengths, times and velocities as files write them: udunits words, `km`, `cm s-1`, `m/s`, `km per hour`.
//!
//! Check: common spellings, and words that are no such unit.

/// What is measured: powers of length and time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Quantity {
    Length,
    Time,
    Velocity,
}

impl Quantity {
    fn powers(self) -> [i32; 2] {
        match self {
            Self::Length => [1, 0],
            Self::Time => [0, 1],
            Self::Velocity => [1, -1],
        }
    }

    /// SI units in `text`, which names a unit of this quantity; 1 where it is empty.
    ///
    /// # Errors
    /// What is allowed.
    pub(crate) fn si(self, text: &str) -> Result<f64, String> {
        let factor = match text.trim() {
            "" => Some(1.0),
            // Not "per millisecond".
            "ms-1" | "ms^-1" if self == Self::Velocity => Some(1.0),
            text => product(text)
                .filter(|(_, powers)| *powers == self.powers())
                .map(|(factor, _)| factor),
        };
        factor.ok_or_else(|| {
            match self {
                Self::Length => "a unit of length is needed, such as m, km or cm",
                Self::Time => "a unit of time is needed: s, ms, us, ns, minutes, hours or days",
                Self::Velocity => {
                    "a unit of velocity is needed, such as m s-1, cm s-1, km/h or knots"
                }
            }
            .to_owned()
        })
    }
}

/// The factor of a product of units in SI, and its powers of length and time.
fn product(text: &str) -> Option<(f64, [i32; 2])> {
    let spaced = text
        .replace("**", "^")
        .replace('/', " / ")
        .replace(['.', '*', '_'], " ");
    let (mut factor, mut powers, mut sign) = (1.0_f64, [0; 2], 1);
    for word in spaced.split_whitespace() {
        if word == "/" || word == "per" {
            sign = -1;
            continue;
        }
        let end = word
            .find(|c: char| !c.is_alphabetic())
            .unwrap_or(word.len());
        let power = match word[end..].trim_start_matches('^') {
            "" => 1,
            power => power.parse::<i32>().ok().filter(|power| power.abs() < 10)?,
        };
        let (unit, own) = base(&word[..end])?;
        let power = sign * power;
        factor *= unit.powi(power);
        powers = [powers[0] + power * own[0], powers[1] + power * own[1]];
        // A line divides by the unit behind it.
        sign = 1;
    }
    Some((factor, powers))
}

/// Units in SI, with their powers of length and time.
const UNITS: &str = include_str!("units.csv");

/// One unit in SI, and its powers.
fn base(word: &str) -> Option<(f64, [i32; 2])> {
    let lower = word.to_lowercase();
    let row = UNITS
        .lines()
        .find_map(|row| row.split_once(',').filter(|(unit, _)| *unit == lower))?
        .1;
    let (factor, (length, time)) = row
        .split_once(',')
        .and_then(|(factor, powers)| Some((factor, powers.split_once(',')?)))?;
    Some((
        factor.parse().ok()?,
        [length.parse().ok()?, time.parse().ok()?],
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn common_spellings_are_known_and_other_words_are_refused() {
        let close = |quantity: Quantity, text: &str, expected: f64| {
            let found = quantity.si(text).unwrap_or_else(|e| panic!("{text}: {e}"));
            assert!((found / expected - 1.0).abs() < 1e-14, "{text}: {found}");
        };
        for text in [
            "m s-1",
            "m/s",
            "m s^-1",
            "m.s-1",
            "meters per second",
            "metre second-1",
            "m s**-1",
            "",
            "m_s-1",
            "ms-1",
        ] {
            close(Quantity::Velocity, text, 1.0);
        }
        for (text, expected) in [
            ("cm s-1", 0.01),
            ("cm/s", 0.01),
            ("km h-1", 1.0 / 3.6),
            ("km/h", 1.0 / 3.6),
            ("knots", 0.514_444_444_444_444_4),
        ] {
            close(Quantity::Velocity, text, expected);
        }
        for (text, expected) in [
            ("m", 1.0),
            ("km", 1e3),
            ("Kilometers", 1e3),
            ("cm", 0.01),
            ("mm", 1e-3),
            ("metre", 1.0),
        ] {
            close(Quantity::Length, text, expected);
        }
        for (text, expected) in [
            ("days", 86_400.0),
            ("nanoseconds", 1e-9),
            ("milliseconds", 1e-3),
            ("seconds", 1.0),
            ("ms", 1e-3),
            ("hours", 3600.0),
        ] {
            close(Quantity::Time, text, expected);
        }
        for (quantity, text) in [
            (Quantity::Velocity, "m"),
            (Quantity::Velocity, "m s-2"),
            (Quantity::Velocity, "furlongs"),
            (Quantity::Length, "degrees_east"),
            (Quantity::Length, "m s-1"),
            (Quantity::Length, "1"),
            (Quantity::Time, "months"),
            (Quantity::Time, "1e3 s"),
        ] {
            assert!(quantity.si(text).is_err(), "{text}");
        }
    }
}
