//! One direction of a mesh: its nodes, what lies at its two ends, and the index coordinate of a
//! position.
//!
//! On a stretched mesh the kernel (27) acts in the index coordinate `xi`, in which the nodes are
//! one apart. Between nodes the position is taken as the M'4 interpolant of the node positions, and
//! `xi` is its inverse (Newton's method on one cubic). So a linear function of the position is
//! reproduced exactly, and on a smoothly stretched mesh the interpolation keeps its third order;
//! the fraction `(x - x_i)/(x_{i+1} - x_i)` would give second order.
//!
//! M'4 (Monaghan 1985) is the cubic convolution kernel of Keys (1981) with a = -1/2: third order,
//! once differentiable.
//!
//! Check: linear functions to round-off on a strongly stretched mesh; order 3 of a sampled vortex;
//! the weights of the kernel sum to 1, give back 1, x and x^2 exactly, and x^3 with the residual
//! `s (1 - s)(1 - 2 s)`.

use crate::Error;

/// What lies beyond one end of a direction.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum Side {
    /// Nothing is known: the mesh ends at its last node. The stencil of the last cell is completed
    /// by the parabola through the last three nodes (Keys 1981), which keeps third order.
    #[default]
    Open,
    /// A frictionless wall: the image has the opposite velocity across the wall and the same along
    /// it.
    SlipWall {
        /// Position of the wall \[m\], at the last node or beyond it by less than a cell.
        position_m: f64,
    },
    /// A wall at rest or moving along itself, to which the air sticks: all components are odd about
    /// the wall's velocity.
    NoSlipWall {
        /// Position of the wall \[m\], at the last node or beyond it by less than a cell.
        position_m: f64,
        /// Velocity of the wall `(u, v, w)` \[m/s\].
        velocity_m_s: [f64; 3],
    },
}

/// The two ends of one direction of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Edges {
    /// The flow repeats itself; the mesh then holds every point.
    Periodic {
        /// Length after which it does \[m\], longer than the distance from the first to the last
        /// node.
        period_m: f64,
    },
    /// Two ends of their own.
    Bounded {
        /// End at the first node.
        low: Side,
        /// End at the last node.
        high: Side,
    },
}

/// Names of the three directions in messages and files.
pub(crate) const AXIS_NAMES: [&str; 3] = ["x", "y", "z"];

/// Nodes beyond each end that the stencil may need.
pub(crate) const GHOSTS: usize = 2;

/// Largest ratio of neighbouring cells: up to 5 the slopes at the nodes are at most 3 times that of
/// the cell, which makes the interpolated position monotone (Fritsch and Carlson 1980).
const MAX_CELL_RATIO: f64 = 5.0;

/// Largest ratio of the second cell to the first at an open end: from 3 on the slope of the
/// parabola turns round.
const MAX_OPEN_RATIO: f64 = 2.5;

/// Where the value of a ghost node comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Ghost {
    /// The value of an interior node.
    Copy(usize),
    /// The image of an interior node in a wall.
    Image(usize, Side),
    /// The parabola through three interior nodes, `3 a - 3 b + c`.
    Parabola([usize; 3]),
}

/// One direction of a mesh with its ghost nodes.
#[derive(Debug, Clone)]
pub(crate) struct Axis {
    name: &'static str,
    /// Positions of all nodes, ghosts included.
    pub(crate) position_m: Vec<f64>,
    /// Range of positions that the mesh holds; unbounded if periodic.
    span_m: Option<(f64, f64)>,
    period_m: Option<f64>,
    /// Last padded cell that may hold a point; at an open end there is none beyond the last node.
    last_cell: usize,
    /// Sources of the ghosts: below from the nearest outwards, then above likewise.
    pub(crate) ghosts: [[Ghost; GHOSTS]; 2],
}

impl Axis {
    pub(crate) fn new(name: &'static str, node_m: &[f64], edges: Edges) -> Result<Self, Error> {
        let nodes = node_m.len();
        if nodes < 4 {
            return Err(refused(name, "number of nodes", nodes as f64, "at least 4"));
        }
        check_increasing(name, node_m)?;
        let axis = match edges {
            Edges::Periodic { period_m } => Self::periodic(name, node_m, period_m)?,
            Edges::Bounded { low, high } => Self::bounded(name, node_m, low, high)?,
        };
        axis.check_stretch(edges)?;
        Ok(axis)
    }

    fn periodic(name: &'static str, node_m: &[f64], period_m: f64) -> Result<Self, Error> {
        let nodes = node_m.len();
        if !(period_m.is_finite() && period_m > node_m[nodes - 1] - node_m[0]) {
            let allowed = "longer than the mesh from first to last node";
            return Err(refused(name, "period", period_m, allowed));
        }
        let below = [node_m[nodes - 1] - period_m, node_m[nodes - 2] - period_m];
        let above = [node_m[0] + period_m, node_m[1] + period_m];
        Ok(Self {
            name,
            position_m: padded_positions_m(below, node_m, above),
            span_m: None,
            period_m: Some(period_m),
            last_cell: nodes + 1,
            ghosts: [
                [Ghost::Copy(nodes - 1), Ghost::Copy(nodes - 2)],
                [Ghost::Copy(0), Ghost::Copy(1)],
            ],
        })
    }

    fn bounded(name: &'static str, node_m: &[f64], low: Side, high: Side) -> Result<Self, Error> {
        let (low_ghosts, low_m) = bounded_end(name, node_m, low, false)?;
        let (high_ghosts, high_m) = bounded_end(name, node_m, high, true)?;
        let [below_m, above_m] = [low_ghosts, high_ghosts].map(|ghosts| ghosts.map(|(_, m)| m));
        Ok(Self {
            name,
            position_m: padded_positions_m(below_m, node_m, above_m),
            span_m: Some((low_m, high_m)),
            period_m: None,
            last_cell: node_m.len() + usize::from(high != Side::Open),
            ghosts: [low_ghosts, high_ghosts].map(|ghosts| ghosts.map(|(ghost, _)| ghost)),
        })
    }

    /// Fails if neighbouring cells differ by more than the inversion of the index coordinate
    /// allows.
    fn check_stretch(&self, edges: Edges) -> Result<(), Error> {
        let (low_is_open, high_is_open) = match edges {
            Edges::Periodic { .. } => (false, false),
            Edges::Bounded { low, high } => (low == Side::Open, high == Side::Open),
        };
        let first = if low_is_open { GHOSTS } else { 1 };
        for i in first..self.last_cell {
            let below_m = self.cell_m(i);
            let above_m = self.cell_m(i + 1);
            let ratio = below_m.max(above_m) / below_m.min(above_m);
            if ratio > MAX_CELL_RATIO {
                return Err(self.ratio_refused(i + 1, ratio, "at most 5"));
            }
        }
        let allowed = "at most 2.5 towards an open end";
        if low_is_open {
            let ratio = self.cell_m(GHOSTS + 1) / self.cell_m(GHOSTS);
            if ratio > MAX_OPEN_RATIO {
                return Err(self.ratio_refused(GHOSTS + 1, ratio, allowed));
            }
        }
        if high_is_open {
            let ratio = self.cell_m(self.last_cell - 1) / self.cell_m(self.last_cell);
            if ratio > MAX_OPEN_RATIO {
                return Err(self.ratio_refused(self.last_cell, ratio, allowed));
            }
        }
        Ok(())
    }

    /// Width of the cell above a padded node \[m\].
    fn cell_m(&self, padded_node: usize) -> f64 {
        self.position_m[padded_node + 1] - self.position_m[padded_node]
    }

    /// The error for the ratio of the cells beside a padded node.
    fn ratio_refused(&self, padded_node: usize, ratio: f64, allowed: &'static str) -> Error {
        let index = padded_node.saturating_sub(GHOSTS).min(self.nodes() - 1);
        refused(self.name, jump_at(index), ratio, allowed)
    }

    /// Number of nodes without ghosts.
    pub(crate) fn nodes(&self) -> usize {
        self.position_m.len() - 2 * GHOSTS
    }

    /// Padded indices of the cells between nodes, with the cell that closes a period.
    pub(crate) fn cells(&self) -> std::ops::Range<usize> {
        GHOSTS..GHOSTS + self.nodes() - usize::from(self.period_m.is_none())
    }

    /// Index (in the padded nodes) of the first node of the four-point stencil of `x_m`, and the
    /// four weights; `None` outside the mesh or for NaN.
    pub(crate) fn stencil(&self, x_m: f64) -> Option<(usize, [f64; 4])> {
        let node_m = &self.position_m[GHOSTS..GHOSTS + self.nodes()];
        let x_m = match (self.span_m, self.period_m) {
            (Some((low_m, high_m)), _) if low_m <= x_m && x_m <= high_m => x_m,
            (None, Some(period_m)) if x_m.is_finite() => {
                node_m[0] + (x_m - node_m[0]).rem_euclid(period_m)
            }
            _ => return None,
        };
        let cell = (node_m.partition_point(|&p| p <= x_m) + 1).min(self.last_cell);
        let nodes = [cell - 1, cell, cell + 1, cell + 2].map(|i| self.position_m[i]);
        Some((cell - 1, m4_prime_weights(fraction(nodes, x_m))))
    }
}

/// Fraction `s` in the index coordinate of the point `x_m` between the two middle nodes: the root
/// of the M'4 interpolant of the four positions, by Newton's method within the bracket.
fn fraction(nodes_m: [f64; 4], x_m: f64) -> f64 {
    let width_m = nodes_m[2] - nodes_m[1];
    let target = (x_m - nodes_m[1]) / width_m;
    // In units of the cell: the position is s (m0 + s (c2 + s c3)) with end slopes m0 and m1.
    let m0 = 0.5 * (nodes_m[2] - nodes_m[0]) / width_m;
    let m1 = 0.5 * (nodes_m[3] - nodes_m[1]) / width_m;
    let c2 = 3.0 - 2.0 * m0 - m1;
    let c3 = m0 + m1 - 2.0;
    let mut low = 0.0;
    let mut high = 1.0;
    let mut s = target.clamp(0.0, 1.0);
    for _ in 0..60 {
        let excess = s * (m0 + s * (c2 + s * c3)) - target;
        if excess > 0.0 {
            high = s;
        } else {
            low = s;
        }
        let slope = m0 + s * (2.0 * c2 + 3.0 * s * c3);
        let newton = s - excess / slope;
        let next = if newton >= low && newton <= high {
            newton
        } else {
            0.5 * (low + high)
        };
        if (next - s).abs() <= 2.0 * f64::EPSILON {
            return next;
        }
        s = next;
    }
    s
}

/// Fails unless the positions are finite and strictly increasing.
fn check_increasing(axis: &'static str, node_m: &[f64]) -> Result<(), Error> {
    for (index, &value_m) in node_m.iter().enumerate() {
        if !value_m.is_finite() || (index > 0 && value_m <= node_m[index - 1]) {
            let what = format!("position of node {index}");
            let allowed = "finite and above that of the node before";
            return Err(refused(axis, what, value_m, allowed));
        }
    }
    Ok(())
}

/// Positions of all nodes in increasing order; the ghosts are given nearest first.
fn padded_positions_m(below_m: [f64; GHOSTS], node_m: &[f64], above_m: [f64; GHOSTS]) -> Vec<f64> {
    let mut position_m = vec![below_m[1], below_m[0]];
    position_m.extend_from_slice(node_m);
    position_m.extend_from_slice(&above_m);
    position_m
}

/// What a jump from one cell to the next is called.
pub(crate) fn jump_at(index: usize) -> String {
    format!("cells beside node {index} differ by a factor")
}

/// A direction that cannot be taken.
pub(crate) fn refused(
    axis: &'static str,
    what: impl Into<String>,
    value: f64,
    allowed: &'static str,
) -> Error {
    Error::BadDirection {
        axis,
        what: what.into(),
        value,
        allowed,
    }
}

/// The ghosts beyond one bounded end of a direction with their positions, the nearest first, and the
/// position of the end \[m\].
fn bounded_end(
    axis: &'static str,
    node_m: &[f64],
    side: Side,
    is_high: bool,
) -> Result<([(Ghost, f64); GHOSTS], f64), Error> {
    // The three nodes nearest to this end, nearest first.
    let last = node_m.len() - 1;
    let near = if is_high {
        [last, last - 1, last - 2]
    } else {
        [0, 1, 2]
    };
    let near_m = near.map(|node| node_m[node]);
    let wall_m = match side {
        Side::Open => {
            // Beyond the last node only the cell next to it is completed, by its first ghost.
            let first_m = 3.0 * near_m[0] - 3.0 * near_m[1] + near_m[2];
            let ghosts_m = [first_m, 2.0 * first_m - near_m[0]];
            return Ok((
                ghosts_m.map(|ghost_m| (Ghost::Parabola(near), ghost_m)),
                near_m[0],
            ));
        }
        Side::SlipWall { position_m } | Side::NoSlipWall { position_m, .. } => position_m,
    };
    let gap_m = if is_high {
        wall_m - near_m[0]
    } else {
        near_m[0] - wall_m
    };
    let cell_m = (near_m[1] - near_m[0]).abs();
    if !(0.0..cell_m).contains(&gap_m) {
        let wall = if is_high { "high wall" } else { "low wall" };
        let allowed = "at the last node or less than a cell beyond it";
        return Err(refused(axis, wall, wall_m, allowed));
    }
    // A wall on the last node mirrors the next ones; a wall beyond it mirrors that node too.
    let mirrored = if gap_m == 0.0 { [1, 2] } else { [0, 1] };
    let ghosts = mirrored.map(|i| (Ghost::Image(near[i], side), 2.0 * wall_m - near_m[i]));
    Ok((ghosts, wall_m))
}

/// The kernel `W` of (27) at `x` cells from its node; zero beyond two cells.
///
/// ```
/// assert_eq!(wakescope_les::winds::m4_prime(0.0), 1.0);
/// assert_eq!(wakescope_les::winds::m4_prime(0.5), 0.5625);
/// ```
pub fn m4_prime(x: f64) -> f64 {
    let a = x.abs();
    if a <= 1.0 {
        1.0 + a * a * (1.5 * a - 2.5)
    } else if a <= 2.0 {
        0.5 * (2.0 - a) * (2.0 - a) * (1.0 - a)
    } else {
        0.0
    }
}

/// Weights of the nodes -1, 0, 1, 2 for a point at the fraction `s` (0 to 1) between nodes 0 and 1,
/// from (27).
pub fn m4_prime_weights(s: f64) -> [f64; 4] {
    let t = 1.0 - s;
    [
        -0.5 * s * t * t,
        1.0 + s * s * (1.5 * s - 2.5),
        1.0 + t * t * (1.5 * t - 2.5),
        -0.5 * t * s * s,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::{assert_abs_diff_eq, assert_relative_eq};

    #[test]
    fn kernel_and_weights_are_those_of_the_reference() {
        let path = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../tests/reference/signal/m4prime_kernel.csv"
        );
        let text = std::fs::read_to_string(path).unwrap();
        let mut rows = (0, 0);
        for line in text
            .lines()
            .filter(|l| !l.starts_with('#') && !l.starts_with('x'))
        {
            let row: Vec<Option<f64>> = line.split(',').map(|v| v.trim().parse().ok()).collect();
            let x = row[0].unwrap();
            let w = row[1].unwrap();
            assert_abs_diff_eq!(m4_prime(x), w, epsilon = 1e-15);
            assert_abs_diff_eq!(m4_prime(-x), w, epsilon = 1e-15);
            rows.0 += 1;
            if let [Some(a), Some(b), Some(c), Some(d)] = row[2..6] {
                for (found, expected) in m4_prime_weights(x).iter().zip([a, b, c, d]) {
                    assert_abs_diff_eq!(*found, expected, epsilon = 1e-15);
                }
                rows.1 += 1;
            }
        }
        assert!(rows.0 > 20 && rows.1 > 9, "{rows:?}");
    }

    #[test]
    fn weights_give_back_parabolas_and_miss_cubics_by_the_known_residual() {
        for step in 0..=100 {
            let s = 0.01 * f64::from(step);
            let moment = |power: i32| {
                m4_prime_weights(s)
                    .iter()
                    .zip([-1.0_f64, 0.0, 1.0, 2.0])
                    .map(|(w, node)| w * node.powi(power))
                    .sum::<f64>()
            };
            for power in 0..3 {
                assert_abs_diff_eq!(moment(power), s.powi(power), epsilon = 1e-15);
            }
            let residual = s * (1.0 - s) * (1.0 - 2.0 * s);
            assert_abs_diff_eq!(moment(3) - s.powi(3), residual, epsilon = 2e-15);
        }
    }

    #[test]
    fn weights_are_the_kernel_at_the_four_distances() {
        let s = 0.37;
        for (w, distance) in m4_prime_weights(s)
            .iter()
            .zip([1.0 + s, s, 1.0 - s, 2.0 - s])
        {
            assert_relative_eq!(*w, m4_prime(distance), max_relative = 1e-13);
        }
    }

    #[test]
    fn kernel_ends_at_two_cells_and_dips_to_minus_two_27ths() {
        assert_eq!(
            (m4_prime(1.0), m4_prime(2.0), m4_prime(2.5)),
            (0.0, 0.0, 0.0)
        );
        assert_relative_eq!(m4_prime(4.0 / 3.0), -2.0 / 27.0, max_relative = 1e-14);
    }
}
