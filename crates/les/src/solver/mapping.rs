//! The formulas that spread the cells of a direction.
//!
//! Check: each spans its direction, and its metric is its derivative (tests of `mesh`).

use std::fmt;
use std::sync::Arc;

/// Position and its derivative, both for a direction scaled to length 1: `s -> (x, dx/ds)` with `x(0) = 0`, `x(1) = 1`.
pub type MappingFn = Arc<dyn Fn(f64) -> (f64, f64) + Send + Sync>;

/// A formula that spreads the cells of a direction: it maps `s` in `[0, 1]` to the fraction of the length, with a strength `a`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Spread {
    /// Equal cells.
    #[default]
    Uniform,
    /// `x = s + a sin(2 pi s)/(2 pi)`, for periodic directions; `|a| < 1`: cells vary between `1 - |a|` and `1 + |a|` times the
    /// mean.
    Sine,
    /// Fine cells at the low end: `x = 1 + tanh(a (s - 1))/tanh(a)`, `a > 0`.
    TanhLow,
    /// Fine cells at the high end: `x = tanh(a s)/tanh(a)`, `a > 0`.
    TanhHigh,
    /// Fine cells at both ends: `x = (1 + tanh(a (2 s - 1))/tanh(a))/2`, `a > 0`.
    TanhBoth,
    /// Fine cells in the middle: `x = (1 + sinh(a (2 s - 1))/sinh(a))/2`, `a > 0`.
    SinhMiddle,
    /// Fine cells about a place of a periodic direction: `tan(pi (x - place)) = exp(-a) tan(pi (s - s_place))`, `a > 0`. The finest
    /// cell is `exp(-a)` times the mean, the widest, half a period away, `exp(a)` times.
    Cluster,
}

impl Spread {
    /// The mapping of this strength.
    pub fn by(self, strength: f64) -> Mapping {
        Mapping { spread: self, strength, place: 0.5, custom: None }
    }
}

/// How the cells of one direction are spread.
#[derive(Clone, Default)]
pub struct Mapping {
    /// The formula.
    pub spread: Spread,
    /// Its strength `a`; equal cells have none.
    pub strength: f64,
    /// Where a cluster is finest, as a fraction of the length.
    pub place: f64,
    /// Any other mapping, with its derivative, in place of the formula.
    pub custom: Option<MappingFn>,
}

impl fmt::Debug for Mapping {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { spread, strength, place, custom } = self;
        match spread {
            _ if custom.is_some() => write!(f, "Custom"),
            Spread::Uniform => write!(f, "Uniform"),
            Spread::Cluster => write!(f, "Cluster({strength} at {place})"),
            _ => write!(f, "{spread:?}({strength})"),
        }
    }
}

impl Mapping {
    /// Position and derivative at `s`, both as fractions of the length.
    pub(super) fn at(&self, s: f64) -> (f64, f64) {
        use std::f64::consts::TAU;
        let sech2 = |t: f64| 1.0 / t.cosh().powi(2);
        if let Some(map) = &self.custom {
            return map(s);
        }
        let a = self.strength;
        match self.spread {
            Spread::Uniform => (s, 1.0),
            Spread::Sine => (s + a * (TAU * s).sin() / TAU, 1.0 + a * (TAU * s).cos()),
            Spread::TanhLow => {
                let t = a * (s - 1.0);
                (1.0 + t.tanh() / a.tanh(), a * sech2(t) / a.tanh())
            }
            Spread::TanhHigh => ((a * s).tanh() / a.tanh(), a * sech2(a * s) / a.tanh()),
            Spread::TanhBoth => {
                let t = a * (2.0 * s - 1.0);
                (0.5 * (1.0 + t.tanh() / a.tanh()), a * sech2(t) / a.tanh())
            }
            Spread::SinhMiddle => {
                let t = a * (2.0 * s - 1.0);
                (0.5 * (1.0 + t.sinh() / a.sinh()), a * t.cosh() / a.sinh())
            }
            Spread::Cluster => {
                let (x, slope) = cluster(a, s - cluster(-a, self.place).0);
                (x + self.place, slope)
            }
        }
    }

    /// Whether the spread repeats itself smoothly from one period to the next.
    pub(super) fn is_periodic(&self) -> bool {
        match &self.custom {
            Some(map) => (map(1.0).1 / map(0.0).1 - 1.0).abs() < 1e-9,
            None => matches!(self.spread, Spread::Uniform | Spread::Sine | Spread::Cluster),
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
