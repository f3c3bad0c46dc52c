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
            text => product(text).filter(|(_, powers)| *powers == self.powers()).map(|(factor, _)| factor),
        };
        factor.ok_or_else(|| {
            match self {
                Self::Length => "a unit of length is needed, such as m, km or cm",
                Self::Time => "a unit of time is needed: s, ms, us, ns, minutes, hours or days",
                Self::Velocity => "a unit of velocity is needed, such as m s-1, cm s-1, km/h or knots",
            }
            .to_owned()
        })
    }
}

/// The factor of a product of units in SI, and its powers of length and time.
fn product(text: &str) -> Option<(f64, [i32; 2])> {
    let spaced = text.replace("**", "^").replace('/', " / ").replace(['.', '*', '_'], " ");
    let (mut factor, mut powers, mut sign) = (1.0_f64, [0; 2], 1);
    for word in spaced.split_whitespace() {
        if word == "/" || word == "per" {
            sign = -1;
            continue;
        }
        let end = word.find(|c: char| !c.is_alphabetic()).unwrap_or(word.len());
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

/// One unit in SI, and its powers.
fn base(word: &str) -> Option<(f64, [i32; 2])> {
    let lower = word.to_lowercase();
    let (length, time) = (|factor: f64| Some((factor, [1, 0])), |factor: f64| Some((factor, [0, 1])));
    let prefixed = |unit: &str| -> Option<f64> {
        let prefixes = [("", 1.0), ("kilo", 1e3), ("centi", 1e-2), ("milli", 1e-3), ("micro", 1e-6), ("nano", 1e-9)];
        let prefix = lower.trim_end_matches('s').strip_suffix(unit)?;
        prefixes.into_iter().find(|(name, _)| *name == prefix).map(|(_, factor)| factor)
    };
    match lower.as_str() {
        "m" => length(1.0),
        "km" => length(1e3),
        "cm" => length(1e-2),
        "mm" => length(1e-3),
        "s" | "sec" | "secs" => time(1.0),
        "ms" => time(1e-3),
        "us" | "µs" => time(1e-6),
        "ns" => time(1e-9),
        "min" | "mins" | "minute" | "minutes" => time(60.0),
        "h" | "hr" | "hrs" | "hour" | "hours" => time(3600.0),
        "d" | "day" | "days" => time(86_400.0),
        "kn" | "kt" | "kts" | "knot" | "knots" => Some((1852.0 / 3600.0, [1, -1])),
        _ => match prefixed("meter").or_else(|| prefixed("metre")) {
            Some(factor) => length(factor),
            None => prefixed("second").and_then(time),
        },
    }
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
        for text in
            ["m s-1", "m/s", "m s^-1", "m.s-1", "meters per second", "metre second-1", "m s**-1", "", "m_s-1", "ms-1"]
        {
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
        for (text, expected) in
            [("m", 1.0), ("km", 1e3), ("Kilometers", 1e3), ("cm", 0.01), ("mm", 1e-3), ("metre", 1.0)]
        {
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
