//! Numbers as people read them: three digits, with a prefix of the unit or a power of ten.
//!
//! Check: prefixes join without a gap, and no digit is lost.

use crate::quantities::rounded;

/// A number in three digits with a prefix of its unit.
pub(super) fn si(value: f64, unit: &str) -> String {
    const PREFIXES: [&str; 9] = ["G", "M", "k", "", "m", "u", "n", "p", "f"];
    let sizes = (-15..=9).rev().step_by(3).map(|power| 10f64.powi(power));
    // 999.6 is 1.00 of the next prefix.
    match sizes
        .zip(PREFIXES)
        .find(|(size, _)| value.abs() >= 0.9995 * size)
    {
        Some((size, prefix)) if value.is_finite() => {
            format!("{} {prefix}{unit}", digits(value / size))
        }
        _ => format!("{} {unit}", scientific(value)),
    }
}

/// Three digits of a number from 1 to 1000, without zeros behind the point.
fn digits(value: f64) -> String {
    let places = if value.abs() >= 99.95 {
        0
    } else {
        1 + usize::from(value.abs() < 9.995)
    };
    let text = format!("{value:.places$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// Three digits and a power of ten, as few of them as it takes.
pub(super) fn scientific(value: f64) -> String {
    format!("{:e}", rounded(value, 2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prefixes_join_without_a_gap() {
        for (value, expected) in [
            (150e-6, "150 um"),
            (9.996e-4, "1 mm"),
            (9.994e-4, "999 um"),
            (299_792.0, "300 km"),
            (0.3204, "320 mm"),
            (2.206e6, "2.21 Mm"),
            (10.0, "10 m"),
            (0.0, "0e0 m"),
            (1e-20, "1e-20 m"),
            (f64::INFINITY, "inf m"),
        ] {
            assert_eq!(si(value, "m"), expected);
        }
        assert_eq!(scientific(1.234_56e-7), "1.23e-7");
    }
}
