//! The staggered mesh: three directions, each uniform or stretched by a mapping with analytic metrics.
//!
//! A direction of `n` cells maps the index coordinate `xi` in `[0, n]` to the position; faces lie at whole `xi`, centres at
//! halves. Its metric `h = dx/dxi` is taken from the formula of the mapping, at faces and at centres, never from
//! differences of positions: the schemes are of fourth order in `xi`, and so they are in space.
//!
//! Check: metrics against finite differences of the positions; refusal of folds and of jumps between neighbouring cells.

use std::fmt;
use std::sync::Arc;

use crate::Error;

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
            Self::Custom(_) => write!(f, "Custom"),
        }
    }
}

impl Mapping {
    /// Position and derivative at `s`, both as fractions of the length.
    fn at(&self, s: f64) -> (f64, f64) {
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
            Self::Custom(ref map) => map(s),
        }
    }

    /// The parameter of the formula, if it has one.
    fn parameter(&self) -> Option<(&'static str, f64)> {
        match *self {
            Self::Uniform | Self::Custom(_) => None,
            Self::Sine { amplitude } => Some(("amplitude", amplitude)),
            Self::TanhLow { strength }
            | Self::TanhHigh { strength }
            | Self::TanhBoth { strength }
            | Self::SinhMiddle { strength } => Some(("strength", strength)),
        }
    }
}

/// What bounds a direction at one of its ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Wall {
    /// A frictionless plane.
    Slip,
    /// A wall to which the fluid sticks; it may move along itself.
    NoSlip {
        /// Velocity of the wall `(u, v, w)` \[m/s\]; its component normal to the wall must be zero.
        velocity_m_s: [f64; 3],
    },
}

impl Wall {
    /// A wall at rest.
    pub const AT_REST: Self = Self::NoSlip { velocity_m_s: [0.0; 3] };
}

/// The two ends of one direction of the flow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Ends {
    /// The flow repeats itself.
    Periodic,
    /// Planes at both ends.
    Walls {
        /// At the low end.
        low: Wall,
        /// At the high end.
        high: Wall,
    },
}

/// One direction of the mesh.
#[derive(Debug, Clone)]
pub struct Direction {
    /// Number of cells: 1 (the flow does not vary), or at least 4; at least 16 between two no-slip walls, 12 with one.
    pub cells: usize,
    /// Position of the low end \[m\].
    pub low_m: f64,
    /// Position of the high end \[m\].
    pub high_m: f64,
    /// How the cells are spread.
    pub mapping: Mapping,
    /// What lies at the two ends.
    pub ends: Ends,
}

impl Direction {
    /// Equal cells from `low_m` to `high_m` \[m\], periodic.
    pub fn periodic(cells: usize, low_m: f64, high_m: f64) -> Self {
        Self { cells, low_m, high_m, mapping: Mapping::Uniform, ends: Ends::Periodic }
    }

    /// Equal cells from `low_m` to `high_m` \[m\] between two planes.
    pub fn between(cells: usize, low_m: f64, high_m: f64, low: Wall, high: Wall) -> Self {
        Self { cells, low_m, high_m, mapping: Mapping::Uniform, ends: Ends::Walls { low, high } }
    }

    /// One cell of the given length \[m\] in which nothing varies: the third direction of a plane flow.
    pub fn thin(length_m: f64) -> Self {
        Self::periodic(1, 0.0, length_m)
    }

    /// The same with another spread of the cells.
    pub fn stretched(self, mapping: Mapping) -> Self {
        Self { mapping, ..self }
    }

    /// Length \[m\].
    pub fn length_m(&self) -> f64 {
        self.high_m - self.low_m
    }

    /// Position \[m\] and metric `dx/dxi` \[m\] at the index coordinate `xi`.
    pub(crate) fn at(&self, xi: f64) -> (f64, f64) {
        let (x, slope) = self.mapping.at(xi / self.cells as f64);
        (self.low_m + self.length_m() * x, self.length_m() * slope / self.cells as f64)
    }

    /// Refuses what the schemes cannot take: too few cells, folds, jumps, walls that blow.
    pub(crate) fn check(&self, axis: usize) -> Result<(), Error> {
        let name = AXIS_NAMES[axis];
        let bad = |what: &'static str, value: f64, allowed: &'static str| Error::BadDirection {
            axis: name,
            what,
            value,
            allowed,
        };
        if !(self.low_m.is_finite() && self.high_m.is_finite() && self.length_m() > 0.0) {
            return Err(bad("high_m - low_m", self.length_m(), "finite and positive"));
        }
        if let Some((what, value)) = self.mapping.parameter() {
            let sine = matches!(self.mapping, Mapping::Sine { .. });
            let fine = if sine { value.abs() < 1.0 } else { value > 0.0 && value <= 20.0 };
            if !fine {
                return Err(bad(what, value, if sine { "between -1 and 1" } else { "above 0 and at most 20" }));
            }
        }
        self.check_cells(axis)?;
        self.check_spacing(name)
    }

    fn check_cells(&self, axis: usize) -> Result<(), Error> {
        let name = AXIS_NAMES[axis];
        let walls = match self.ends {
            Ends::Periodic => [None, None],
            Ends::Walls { low, high } => [Some(low), Some(high)],
        };
        let sticking = walls.iter().flatten().filter(|w| matches!(w, Wall::NoSlip { .. })).count();
        for velocity in walls.iter().flatten().filter_map(|w| match w {
            Wall::NoSlip { velocity_m_s } => Some(velocity_m_s),
            Wall::Slip => None,
        }) {
            if !velocity.iter().all(|v| v.is_finite()) || velocity[axis] != 0.0 {
                let allowed = "finite, and zero across the wall: the fluid cannot flow through it";
                return Err(Error::BadDirection {
                    axis: name,
                    what: "velocity of the wall across itself",
                    value: velocity[axis],
                    allowed,
                });
            }
        }
        let (least, allowed) = match sticking {
            0 => (4, "1, or at least 4"),
            1 => (12, "at least 12 with a no-slip wall"),
            _ => (16, "at least 16 between two no-slip walls"),
        };
        if self.cells < least && !(self.cells == 1 && sticking == 0) {
            return Err(Error::BadDirection { axis: name, what: "cells", value: self.cells as f64, allowed });
        }
        Ok(())
    }

    fn check_spacing(&self, name: &'static str) -> Result<(), Error> {
        let metric: Vec<f64> = (0..=2 * self.cells).map(|i| self.at(0.5 * i as f64).1).collect();
        if let Some(index) = metric.iter().position(|h| !(h.is_finite() && *h > 0.0)) {
            return Err(Error::BadDirection {
                axis: name,
                what: "metric dx/dxi",
                value: metric[index],
                allowed: "finite and positive in every cell: the mapping must not fold",
            });
        }
        let centres: Vec<f64> = metric.iter().skip(1).step_by(2).copied().collect();
        let ratio = |i: usize| (centres[i + 1] / centres[i]).max(centres[i] / centres[i + 1]);
        let worst = (0..centres.len().saturating_sub(1)).max_by(|&a, &b| ratio(a).total_cmp(&ratio(b)));
        match worst {
            Some(index) if ratio(index) > MAX_NEIGHBOUR_RATIO => {
                Err(Error::StretchTooAbrupt { axis: name, index, ratio: ratio(index), allowed: MAX_NEIGHBOUR_RATIO })
            }
            _ => Ok(()),
        }
    }
}

/// Largest ratio of neighbouring cells.
const MAX_NEIGHBOUR_RATIO: f64 = 1.5;

/// Names of the three directions in messages and files.
pub(crate) const AXIS_NAMES: [&str; 3] = ["x", "y", "z"];

/// A mesh of three directions: x along the flight, y across it, z up.
#[derive(Debug, Clone)]
pub struct Mesh {
    directions: [Direction; 3],
}

impl Mesh {
    /// # Errors
    /// [`Error::BadDirection`] or [`Error::StretchTooAbrupt`] for a direction that the schemes cannot take.
    pub fn new(x: Direction, y: Direction, z: Direction) -> Result<Self, Error> {
        let directions = [x, y, z];
        for (axis, direction) in directions.iter().enumerate() {
            direction.check(axis)?;
        }
        Ok(Self { directions })
    }

    /// The three directions x, y, z.
    pub fn directions(&self) -> &[Direction; 3] {
        &self.directions
    }

    /// Cells in x, y, z.
    pub fn cells(&self) -> [usize; 3] {
        std::array::from_fn(|axis| self.directions[axis].cells)
    }

    /// Positions of the cell centres of direction `axis` (0, 1, 2 for x, y, z) \[m\].
    pub fn centre_m(&self, axis: usize) -> Vec<f64> {
        let direction = &self.directions[axis];
        (0..direction.cells).map(|i| direction.at(i as f64 + 0.5).0).collect()
    }

    /// Positions of the `n + 1` faces of direction `axis` \[m\].
    pub fn face_m(&self, axis: usize) -> Vec<f64> {
        let direction = &self.directions[axis];
        (0..=direction.cells).map(|i| direction.at(i as f64).0).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all() -> Vec<Mapping> {
        let custom: MappingFn = Arc::new(|s| (0.5 * (s + s * s), 0.5 + s));
        vec![
            Mapping::Uniform,
            Mapping::Sine { amplitude: 0.7 },
            Mapping::TanhLow { strength: 1.5 },
            Mapping::TanhHigh { strength: 2.5 },
            Mapping::TanhBoth { strength: 2.0 },
            Mapping::SinhMiddle { strength: 3.0 },
            Mapping::Custom(custom),
        ]
    }

    #[test]
    fn every_mapping_spans_its_direction_and_its_metric_is_its_derivative() {
        for mapping in all() {
            let direction = Direction::periodic(40, -2.0, 3.0).stretched(mapping);
            assert!((direction.at(0.0).0 + 2.0).abs() < 1e-14 && (direction.at(40.0).0 - 3.0).abs() < 1e-14);
            for i in 1..40 {
                let xi = f64::from(i);
                let slope = (direction.at(xi + 1e-5).0 - direction.at(xi - 1e-5).0) / 2e-5;
                let metric = direction.at(xi).1;
                assert!((slope / metric - 1.0).abs() < 1e-8, "{direction:?} at {xi}: {slope} against {metric}");
            }
        }
    }

    #[test]
    fn folds_jumps_and_too_few_cells_are_refused() {
        let fold: MappingFn = Arc::new(|s| (2.0 * s * s - s, 4.0 * s - 1.0));
        let refused = |d: Direction| Mesh::new(Direction::thin(1.0), d, Direction::thin(1.0)).unwrap_err().to_string();
        let message = refused(Direction::periodic(8, 0.0, 1.0).stretched(Mapping::Custom(fold)));
        assert!(message.contains("metric"), "{message}");
        let message = refused(Direction::periodic(8, 0.0, 1.0).stretched(Mapping::TanhLow { strength: 4.0 }));
        assert!(message.contains("differ by a factor"), "{message}");
        assert!(refused(Direction::periodic(3, 0.0, 1.0)).contains("at least 4"));
        assert!(refused(Direction::between(15, 0.0, 1.0, Wall::AT_REST, Wall::AT_REST)).contains("at least 16"));
        assert!(refused(Direction::periodic(8, 1.0, 1.0)).contains("positive"));
        assert!(refused(Direction::periodic(8, 0.0, 1.0).stretched(Mapping::Sine { amplitude: 1.0 })).contains("-1"));
        let blowing = Wall::NoSlip { velocity_m_s: [0.0, 0.1, 0.0] };
        assert!(refused(Direction::between(32, 0.0, 1.0, blowing, Wall::Slip)).contains("across"));
    }
}
