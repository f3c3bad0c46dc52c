//! Limits of a transverse grid, their violations, and a set-up without violations, in numbers that
//! a user can copy.

use std::fmt;

/// A limit on the grid of a Monte Carlo.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Limit {
    /// Spacing: enough points across the aperture, its ring and the beam.
    Aperture,
    /// Spacing: the slope of the wave front by focus and tilt.
    WaveFront,
    /// Spacing: the angles into which turbulence scatters.
    Scatter,
    /// Width: the aperture inside the absorbing border.
    Border,
    /// Width: the beam at the largest range.
    Beam,
    /// Width: the tails of the beam, by diffraction at its edge and by turbulence; beyond
    /// 0.05 a run ends.
    Light,
    /// Points along an axis of a grid that a plan derives.
    Points,
}

impl Limit {
    /// Whether the limit is a largest spacing; the others are smallest widths, or a
    /// number of points.
    pub fn is_spacing(self) -> bool {
        matches!(self, Self::Aperture | Self::WaveFront | Self::Scatter)
    }

    /// What the limit is for.
    pub fn purpose(self) -> &'static str {
        match self {
            Self::Aperture => "to resolve the aperture and the beam",
            Self::WaveFront => "for the slope of the wave front (focus, tilt)",
            Self::Scatter => "for the angles into which turbulence scatters",
            Self::Border => "for the aperture inside the absorbing border",
            Self::Beam => "for the beam at the largest range",
            Self::Light => "so that the border takes less than 0.05 of the light",
            Self::Points => "to resolve and to hold the beam",
        }
    }
}

/// A violated limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Violation {
    /// The limit.
    pub limit: Limit,
    /// Smallest width \[m\] (or number of points), or largest spacing \[m\], that is accepted,
    /// rounded to the safe side.
    pub needed: f64,
    /// Value of the set-up.
    pub found: f64,
}

impl Violation {
    /// The violation of a largest spacing or a smallest width `limit_m` \[m\] by a grid of this
    /// spacing and width, if it is one.
    fn by_grid(limit: Limit, limit_m: f64, spacing_m: f64, width_m: f64) -> Option<Self> {
        if limit.is_spacing() {
            return (spacing_m > limit_m).then(|| Self {
                limit,
                needed: not_above(limit_m),
                found: spacing_m,
            });
        }
        (width_m < limit_m).then(|| Self {
            limit,
            needed: not_below(limit_m),
            found: width_m,
        })
    }
}

/// The limits \[m\], largest spacings and smallest widths, that a grid with this largest spacing and
/// this smallest width violates.
pub(crate) fn violations_of(
    limits_m: &[(Limit, f64)],
    spacing_m: f64,
    width_m: f64,
) -> Vec<Violation> {
    limits_m
        .iter()
        .filter_map(|&(limit, limit_m)| Violation::by_grid(limit, limit_m, spacing_m, width_m))
        .collect()
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            limit,
            needed,
            found,
        } = self;
        let purpose = limit.purpose();
        match limit {
            Limit::Points => write!(
                f,
                "{needed} points along an axis are needed {purpose}, {found} at most"
            ),
            spacing if spacing.is_spacing() => {
                write!(f, "grid spacing [m] {found:.6}, at most {needed} {purpose}")
            }
            _ => write!(f, "grid width [m] {found:.6}, at least {needed} {purpose}"),
        }
    }
}

/// A square grid with equal layers that was examined and accepted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SetUp {
    /// Points along each axis.
    pub points: usize,
    /// Spacing \[m\].
    pub spacing_m: f64,
    /// Equal layers.
    pub layers: usize,
}

/// Text of all violations and of a set-up without any.
pub(crate) fn listed(violations: &[Violation], would_do: Option<&SetUp>) -> String {
    let mut items: Vec<String> = violations.iter().map(Violation::to_string).collect();
    if let Some(SetUp {
        points,
        spacing_m,
        layers,
    }) = would_do
    {
        items.push(format!(
            "{points} x {points} points of {spacing_m} m with {layers} layers would do"
        ));
    }
    items.join("; ")
}

/// The smallest number of four digits that is not below `value`, above 0.
pub(crate) fn not_below(value: f64) -> f64 {
    four_digits(value, 1).unwrap_or(value)
}

/// The largest number of four digits that is not above `value`, above 0.
pub(crate) fn not_above(value: f64) -> f64 {
    four_digits(value, -1).unwrap_or(value)
}

/// `value` to four digits, on its side `direction` (1 above, -1 below); none if it is not finite.
fn four_digits(value: f64, direction: i32) -> Option<f64> {
    let text = format!("{value:.3e}");
    let rounded: f64 = text.parse().ok()?;
    if f64::from(direction) * (rounded - value) >= 0.0 {
        return Some(rounded);
    }
    let (digits, exponent) = text.split_once('e')?;
    let digits: f64 = digits.parse().ok()?;
    let exponent: i32 = exponent.parse().ok()?;
    // Below a power of ten the digits are ten times finer.
    let fine = if direction < 0 && digits == 1.0 { 4 } else { 3 };
    let units = (digits * 10f64.powi(fine)).round() + f64::from(direction);
    format!("{units}e{}", exponent - fine).parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn named_numbers_are_on_the_safe_side_of_the_limit() {
        assert_eq!(not_below(1.604_51), 1.605);
        assert_eq!(not_below(1.604), 1.604);
        assert_eq!(not_below(9.9996), 10.0);
        assert_eq!(not_above(1.998_13e-3), 1.998e-3);
        assert_eq!(not_above(1.0e-3 - 1e-12), 9.999e-4);
        for i in 1..2000 {
            let value = f64::from(i).powf(1.37) * 1e-4;
            assert!(not_below(value) >= value && not_below(value) <= 1.0011 * value);
            assert!(not_above(value) <= value && not_above(value) >= 0.9989 * value);
        }
    }
}
