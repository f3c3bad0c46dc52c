//! The staggered mesh: three directions, each uniform or stretched by a mapping with analytic
//! metrics.
//!
//! A direction of `n` cells maps the index coordinate `xi` in `[0, n]` to the position; faces lie
//! at whole `xi`, centres at halves. Its metric `h = dx/dxi` is taken from the formula of the
//! mapping, at faces and at centres, never from differences of positions: the schemes are of fourth
//! order in `xi`, and so they are in space.
//!
//! Check: each mapping spans its direction, metrics against finite differences of the positions;
//! refusal of folds and of jumps between neighbouring cells.

use crate::Error;
pub(crate) use crate::winds::axis::AXIS_NAMES;
use crate::winds::axis::{self, jump_at};
use std::fmt;
use std::sync::Arc;

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
    pub const AT_REST: Self = Self::NoSlip {
        velocity_m_s: [0.0; 3],
    };
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

impl Ends {
    /// The planes at the two ends; none of a periodic direction.
    pub(crate) fn walls(self) -> Vec<Wall> {
        match self {
            Self::Periodic => Vec::new(),
            Self::Walls { low, high } => vec![low, high],
        }
    }

    /// Whether the fluid sticks at the low and at the high end.
    pub(crate) fn no_slip(self) -> [bool; 2] {
        match self {
            Self::Periodic => [false; 2],
            Self::Walls { low, high } => {
                [low, high].map(|wall| matches!(wall, Wall::NoSlip { .. }))
            }
        }
    }
}

/// One direction of the mesh.
#[derive(Debug, Clone)]
pub struct Direction {
    /// Number of cells: 1 (the flow does not vary), or at least 4; at least 16 between two no-slip
    /// walls, 12 with one.
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
        Self {
            cells,
            low_m,
            high_m,
            mapping: Mapping::default(),
            ends: Ends::Periodic,
        }
    }

    /// Equal cells from `low_m` to `high_m` \[m\] between two planes.
    pub fn between(cells: usize, low_m: f64, high_m: f64, low: Wall, high: Wall) -> Self {
        Self {
            cells,
            low_m,
            high_m,
            mapping: Mapping::default(),
            ends: Ends::Walls { low, high },
        }
    }

    /// One cell of the given length \[m\] in which nothing varies: the third direction of a plane
    /// flow.
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
        (
            self.low_m + self.length_m() * x,
            self.length_m() * slope / self.cells as f64,
        )
    }

    /// Refuses what the schemes cannot take: too few cells, folds, jumps, walls that blow.
    pub(crate) fn check(&self, axis: usize) -> Result<(), Error> {
        let length_m = self.length_m();
        if !(self.low_m.is_finite() && self.high_m.is_finite() && length_m > 0.0) {
            let allowed = "finite and positive";
            return Err(refused(axis, "high_m - low_m", length_m, allowed));
        }
        self.check_mapping(axis)?;
        self.check_cells(axis)?;
        self.check_spacing(axis)?;
        if self.ends == Ends::Periodic && !self.mapping.is_periodic() {
            let what = "metric dx/dxi at its high end over that at its low end";
            let ratio = self.at(self.cells as f64).1 / self.at(0.0).1;
            let allowed = "1, with the same growth on both sides: a periodic direction takes equal cells, a sine or a cluster";
            return Err(refused(axis, what, ratio, allowed));
        }
        Ok(())
    }

    fn check_mapping(&self, axis: usize) -> Result<(), Error> {
        let Mapping {
            spread,
            strength,
            place,
            ..
        } = self.mapping;
        match spread {
            Spread::Uniform => Ok(()),
            Spread::Sine if strength.abs() < 1.0 => Ok(()),
            Spread::Sine => Err(refused(axis, "amplitude", strength, "between -1 and 1")),
            _ if !(strength > 0.0 && strength <= 20.0) => {
                let allowed = "above 0 and at most 20";
                Err(refused(axis, "strength", strength, allowed))
            }
            Spread::Cluster if !(0.0..=1.0).contains(&place) => {
                let allowed = "a fraction of the length, 0 to 1";
                Err(refused(axis, "place", place, allowed))
            }
            _ => Ok(()),
        }
    }

    fn check_cells(&self, axis: usize) -> Result<(), Error> {
        for wall in self.ends.walls() {
            let Wall::NoSlip {
                velocity_m_s: velocity,
            } = wall
            else {
                continue;
            };
            if !velocity.iter().all(|v| v.is_finite()) || velocity[axis] != 0.0 {
                let allowed = "finite, and zero across the wall: the fluid cannot flow through it";
                return Err(refused(
                    axis,
                    "velocity of the wall across itself",
                    velocity[axis],
                    allowed,
                ));
            }
        }
        let sticking = self
            .ends
            .no_slip()
            .into_iter()
            .filter(|sticks| *sticks)
            .count();
        let (least, allowed) = match sticking {
            0 => (4, "1, or at least 4"),
            1 => (12, "at least 12 with a no-slip wall"),
            _ => (16, "at least 16 between two no-slip walls"),
        };
        if self.cells < least && !(self.cells == 1 && sticking == 0) {
            return Err(refused(axis, "cells", self.cells as f64, allowed));
        }
        Ok(())
    }

    fn check_spacing(&self, axis: usize) -> Result<(), Error> {
        let metric: Vec<f64> = (0..=2 * self.cells)
            .map(|i| self.at(0.5 * i as f64).1)
            .collect();
        if let Some(folded) = metric.iter().find(|h| !(h.is_finite() && **h > 0.0)) {
            let allowed = "finite and positive in every cell: the mapping must not fold";
            return Err(refused(axis, "metric dx/dxi", *folded, allowed));
        }
        // The largest ratio of neighbouring cells, whose metrics at the centres have odd places;
        // of equal ones the last.
        let mut largest = 0.0;
        let mut index = 0;
        for i in 0..self.cells.saturating_sub(1) {
            let below = metric[2 * i + 1];
            let above = metric[2 * i + 3];
            let ratio = (above / below).max(below / above);
            if ratio >= largest {
                largest = ratio;
                index = i;
            }
        }
        if largest > MAX_NEIGHBOUR_RATIO {
            return Err(refused(axis, jump_at(index), largest, "at most 1.5"));
        }
        Ok(())
    }
}

/// What is wrong with direction `axis` (0, 1, 2 for x, y, z).
pub(crate) fn refused(
    axis: usize,
    what: impl Into<String>,
    value: f64,
    allowed: &'static str,
) -> Error {
    axis::refused(AXIS_NAMES[axis], what, value, allowed)
}

/// Largest ratio of neighbouring cells.
const MAX_NEIGHBOUR_RATIO: f64 = 1.5;

/// A mesh of three directions: x along the flight, y across it, z up.
#[derive(Debug, Clone)]
pub struct Mesh {
    directions: [Direction; 3],
}

impl Mesh {
    /// The mesh of three directions.
    ///
    /// # Errors
    /// [`Error::BadDirection`] for a direction that the schemes cannot take.
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
        (0..direction.cells)
            .map(|i| direction.at(i as f64 + 0.5).0)
            .collect()
    }

    /// Positions of the `n + 1` faces of direction `axis` \[m\].
    pub fn face_m(&self, axis: usize) -> Vec<f64> {
        let direction = &self.directions[axis];
        (0..=direction.cells)
            .map(|i| direction.at(i as f64).0)
            .collect()
    }
}

/// Position and its derivative, both for a direction scaled to length 1: `s -> (x, dx/ds)` with
/// `x(0) = 0`, `x(1) = 1`.
pub type MappingFn = Arc<dyn Fn(f64) -> (f64, f64) + Send + Sync>;

/// A formula that spreads the cells of a direction: it maps `s` in `[0, 1]` to the fraction of the
/// length, with a strength `a`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Spread {
    /// Equal cells.
    #[default]
    Uniform,
    /// `x = s + a sin(2 pi s)/(2 pi)`, for periodic directions; `|a| < 1`: cells vary between
    /// `1 - |a|` and `1 + |a|` times the mean.
    Sine,
    /// Fine cells at the low end: `x = 1 + tanh(a (s - 1))/tanh(a)`, `a > 0`.
    TanhLow,
    /// Fine cells at the high end: `x = tanh(a s)/tanh(a)`, `a > 0`.
    TanhHigh,
    /// Fine cells at both ends: `x = (1 + tanh(a (2 s - 1))/tanh(a))/2`, `a > 0`.
    TanhBoth,
    /// Fine cells in the middle: `x = (1 + sinh(a (2 s - 1))/sinh(a))/2`, `a > 0`.
    SinhMiddle,
    /// Fine cells about a place of a periodic direction:
    /// `tan(pi (x - place)) = exp(-a) tan(pi (s - s_place))`, `a > 0`. The finest cell is `exp(-a)`
    /// times the mean, the widest, half a period away, `exp(a)` times.
    Cluster,
}

impl Spread {
    /// The mapping of this strength.
    pub fn by(self, strength: f64) -> Mapping {
        Mapping {
            spread: self,
            strength,
            place: 0.5,
            custom: None,
        }
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
        let Self {
            spread,
            strength,
            place,
            custom,
        } = self;
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
            None => matches!(
                self.spread,
                Spread::Uniform | Spread::Sine | Spread::Cluster
            ),
        }
    }
}

/// Square of the hyperbolic secant.
fn sech2(t: f64) -> f64 {
    1.0 / t.cosh().powi(2)
}

/// `tan(pi x) = exp(-a) tan(pi t)`, continued over all periods, and its derivative; `-a` gives the
/// inverse.
fn cluster(a: f64, t: f64) -> (f64, f64) {
    use std::f64::consts::PI;
    let beta = (-a).exp();
    let period = t.round();
    let (sin, cos) = (PI * (t - period)).sin_cos();
    let x = period + (beta * sin).atan2(cos) / PI;
    (x, beta / (cos * cos + (beta * sin).powi(2)))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    fn all() -> Vec<Mapping> {
        let custom: MappingFn = Arc::new(|s| (0.5 * (s + s * s), 0.5 + s));
        vec![
            Mapping::default(),
            Spread::Sine.by(0.7),
            Spread::TanhLow.by(1.5),
            Spread::TanhHigh.by(2.5),
            Spread::TanhBoth.by(2.0),
            Spread::SinhMiddle.by(3.0),
            Mapping {
                place: 0.5,
                ..Spread::Cluster.by(0.8)
            },
            Mapping {
                place: 0.15,
                ..Spread::Cluster.by(1.2)
            },
            Mapping {
                custom: Some(custom),
                ..Mapping::default()
            },
        ]
    }

    #[test]
    fn every_mapping_spans_its_direction_and_its_metric_is_its_derivative() {
        for mapping in all() {
            let direction = Direction::periodic(40, -2.0, 3.0).stretched(mapping);
            assert!(
                (direction.at(0.0).0 + 2.0).abs() < 1e-14
                    && (direction.at(40.0).0 - 3.0).abs() < 1e-14
            );
            for i in 1..40 {
                let xi = f64::from(i);
                let slope = (direction.at(xi + 1e-5).0 - direction.at(xi - 1e-5).0) / 2e-5;
                let metric = direction.at(xi).1;
                assert!(
                    (slope / metric - 1.0).abs() < 1e-8,
                    "{direction:?} at {xi}: {slope} against {metric}"
                );
            }
        }
    }

    #[test]
    fn a_cluster_is_finest_at_its_place_and_repeats_itself() {
        for (strength, place) in [(0.5, 0.5), (1.0, 0.2), (1.5, 0.0), (0.7, 0.93)] {
            let direction = Direction::periodic(200, 0.0, 1.0).stretched(Mapping {
                place,
                ..Spread::Cluster.by(strength)
            });
            direction.check(1).unwrap();
            let finest = (0..200).min_by(|&i, &j| {
                let h = |i: usize| direction.at(i as f64 + 0.5).1;
                h(i).total_cmp(&h(j))
            });
            let (x, h) = direction.at(finest.unwrap() as f64 + 0.5);
            let apart = (x - place - (x - place).round()).abs();
            assert!(apart <= h, "{strength} at {place}: finest at {x}");
            assert!(
                (h * 200.0 / (-strength).exp() - 1.0).abs() < 0.01,
                "{strength} at {place}: {h}"
            );
            for xi in [0.0, 0.5, 3.0, 77.5] {
                let a = direction.at(xi);
                let b = direction.at(xi + 200.0);
                assert!(
                    (a.0 + 1.0 - b.0).abs() < 1e-13 && (a.1 / b.1 - 1.0).abs() < 1e-12,
                    "{a:?} {b:?}"
                );
            }
        }
    }

    #[test]
    fn folds_jumps_and_too_few_cells_are_refused() {
        let fold: MappingFn = Arc::new(|s| (2.0 * s * s - s, 4.0 * s - 1.0));
        let refused = |d: Direction| {
            Mesh::new(Direction::thin(1.0), d, Direction::thin(1.0))
                .unwrap_err()
                .to_string()
        };
        let message = refused(Direction::periodic(8, 0.0, 1.0).stretched(Mapping {
            custom: Some(fold),
            ..Mapping::default()
        }));
        assert!(message.contains("metric"), "{message}");
        let message = refused(Direction::periodic(8, 0.0, 1.0).stretched(Spread::TanhLow.by(4.0)));
        assert!(message.contains("differ by a factor"), "{message}");
        let message = refused(Direction::periodic(64, 0.0, 1.0).stretched(Spread::TanhLow.by(1.0)));
        assert!(message.contains("periodic direction takes"), "{message}");
        let cluster = |strength, place| {
            Direction::periodic(64, 0.0, 1.0).stretched(Mapping {
                place,
                ..Spread::Cluster.by(strength)
            })
        };
        assert!(refused(cluster(1.0, 1.5)).contains("place = 1.5"));
        assert!(refused(cluster(0.0, 0.5)).contains("above 0"));
        assert!(refused(Direction::periodic(3, 0.0, 1.0)).contains("at least 4"));
        assert!(
            refused(Direction::between(
                15,
                0.0,
                1.0,
                Wall::AT_REST,
                Wall::AT_REST
            ))
            .contains("at least 16")
        );
        assert!(refused(Direction::periodic(8, 1.0, 1.0)).contains("positive"));
        assert!(
            refused(Direction::periodic(8, 0.0, 1.0).stretched(Spread::Sine.by(1.0)))
                .contains("-1")
        );
        let blowing = Wall::NoSlip {
            velocity_m_s: [0.0, 0.1, 0.0],
        };
        assert!(refused(Direction::between(32, 0.0, 1.0, blowing, Wall::Slip)).contains("across"));
    }
}
