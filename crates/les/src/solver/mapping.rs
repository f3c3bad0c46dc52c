//! The formulas that spread the cells of a direction.
//!
//! Check: each spans its direction, and its metric is its derivative (tests of `mesh`).

use std::fmt;
use std::sync::Arc;

/// Position and its derivative, both for a direction scaled to length 1: `s -> (x, dx/ds)` with `x(0) = 0`, `x(1) = 1`.
pub type MappingFn = Arc<dyn Fn(f64) -> (f64, f64) + Send + Sync>;

/// How the cells of one direction are spread. All formulas map `s` in `[0, 1]` to the fraction of the length.
#[derive(Clone, Default)]
pub enum Mapping {
    /// Equal cells.
    #[default]
    Uniform,
    /// `x = s + a sin(2 pi s)/(2 pi)`, for periodic directions; `|a| < 1`.
    Sine {
        /// Amplitude `a`: cells vary between `1 - |a|` and `1 + |a|` times the mean.
        amplitude: f64,
    },
    /// Fine cells at the low end: `x = 1 + tanh(a (s - 1))/tanh(a)`.
    TanhLow {
        /// Strength `a > 0`.
        strength: f64,
    },
    /// Fine cells at the high end: `x = tanh(a s)/tanh(a)`.
    TanhHigh {
        /// Strength `a > 0`.
        strength: f64,
    },
    /// Fine cells at both ends: `x = (1 + tanh(a (2 s - 1))/tanh(a))/2`.
    TanhBoth {
        /// Strength `a > 0`.
        strength: f64,
    },
    /// Fine cells in the middle: `x = (1 + sinh(a (2 s - 1))/sinh(a))/2`.
    SinhMiddle {
        /// Strength `a > 0`.
        strength: f64,
    },
    /// Fine cells about a place of a periodic direction: `tan(pi (x - place)) = exp(-a) tan(pi (s - s_place))`. The finest cell
    /// is `exp(-a)` times the mean, the widest, half a period away, `exp(a)` times.
    Cluster {
        /// Strength `a > 0`.
        strength: f64,
        /// Where, as a fraction of the length.
        place: f64,
    },
    /// Any other mapping, with its derivative.
    Custom(MappingFn),
}

impl fmt::Debug for Mapping {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Uniform => write!(f, "Uniform"),
            Self::Sine { amplitude } => write!(f, "Sine({amplitude})"),
            Self::TanhLow { strength } => write!(f, "TanhLow({strength})"),
            Self::TanhHigh { strength } => write!(f, "TanhHigh({strength})"),
            Self::TanhBoth { strength } => write!(f, "TanhBoth({strength})"),
            Self::SinhMiddle { strength } => write!(f, "SinhMiddle({strength})"),
            Self::Cluster { strength, place } => write!(f, "Cluster({strength} at {place})"),
            Self::Custom(_) => write!(f, "Custom"),
        }
    }
}

impl Mapping {
    /// Position and derivative at `s`, both as fractions of the length.
    pub(super) fn at(&self, s: f64) -> (f64, f64) {
        use std::f64::consts::TAU;
        let sech2 = |t: f64| 1.0 / t.cosh().powi(2);
        match *self {
            Self::Uniform => (s, 1.0),
            Self::Sine { amplitude: a } => (s + a * (TAU * s).sin() / TAU, 1.0 + a * (TAU * s).cos()),
            Self::TanhLow { strength: a } => {
                let t = a * (s - 1.0);
                (1.0 + t.tanh() / a.tanh(), a * sech2(t) / a.tanh())
            }
            Self::TanhHigh { strength: a } => ((a * s).tanh() / a.tanh(), a * sech2(a * s) / a.tanh()),
            Self::TanhBoth { strength: a } => {
                let t = a * (2.0 * s - 1.0);
                (0.5 * (1.0 + t.tanh() / a.tanh()), a * sech2(t) / a.tanh())
            }
            Self::SinhMiddle { strength: a } => {
                let t = a * (2.0 * s - 1.0);
                (0.5 * (1.0 + t.sinh() / a.sinh()), a * t.cosh() / a.sinh())
            }
            Self::Cluster { strength: a, place } => {
                let (x, slope) = cluster(a, s - cluster(-a, place).0);
                (x + place, slope)
            }
            Self::Custom(ref map) => map(s),
        }
    }

    /// The parameter of the formula, if it has one.
    pub(super) fn parameter(&self) -> Option<(&'static str, f64)> {
        match *self {
            Self::Uniform | Self::Custom(_) => None,
            Self::Sine { amplitude } => Some(("amplitude", amplitude)),
            Self::TanhLow { strength }
            | Self::TanhHigh { strength }
            | Self::TanhBoth { strength }
            | Self::SinhMiddle { strength }
            | Self::Cluster { strength, .. } => Some(("strength", strength)),
        }
    }

    /// Whether the spread repeats itself smoothly from one period to the next.
    pub(super) fn is_periodic(&self) -> bool {
        match self {
            Self::Uniform | Self::Sine { .. } | Self::Cluster { .. } => true,
            Self::Custom(map) => (map(1.0).1 / map(0.0).1 - 1.0).abs() < 1e-9,
            _ => false,
        }
    }
}

/// `tan(pi x) = exp(-a) tan(pi t)`, continued over all periods, and its derivative; `-a` gives the inverse.
fn cluster(a: f64, t: f64) -> (f64, f64) {
    use std::f64::consts::PI;
    let beta = (-a).exp();
    let period = t.round();
    let (sin, cos) = (PI * (t - period)).sin_cos();
    let x = period + (beta * sin).atan2(cos) / PI;
    (x, beta / (cos * cos + (beta * sin).powi(2)))
}
