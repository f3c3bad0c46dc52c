//! Derivatives of values at the centres of a direction, taken at its faces.
//!
//! Four values about each face, weighted so that cubics of the position are exact. At a frictionless plane the field is
//! continued by its mirror image, at a no-slip wall the value at the wall is one of the four.
//!
//! Check: cubics, mirror images, periods.

use crate::solver::mesh::{Direction, Ends, Wall};

/// Values used for one derivative.
const TAPS: usize = 4;

/// What a value of the extended line is.
#[derive(Debug, Clone, Copy)]
enum Node {
    Cell(usize),
    Wall(f64),
}

/// Derivative operator of one direction for one velocity component along the walls.
#[derive(Debug, Clone)]
pub(super) struct Slope {
    /// For each face the cells and their weights \[1/m\]; empty where nothing varies.
    pub(super) taps: Vec<Vec<(usize, f64)>>,
    /// For each face what the walls' own velocity adds \[1/s\].
    pub(super) from_walls: Vec<f64>,
}

impl Slope {
    /// The operator for the component `component` (0, 1, 2 for x, y, z), at the faces 0 to `n` (0 to `n - 1` if periodic).
    pub(super) fn new(direction: &Direction, component: usize) -> Self {
        let n = direction.cells;
        let periodic = direction.ends == Ends::Periodic;
        let faces = if periodic { n } else { n + 1 };
        if n == 1 {
            return Self { taps: vec![Vec::new(); faces], from_walls: vec![0.0; faces] };
        }
        let nodes = extended(direction, component);
        let at_face = |face: usize| {
            let at_m = direction.at(face as f64).0;
            let below = nodes.partition_point(|(x_m, _)| *x_m < at_m);
            let first = below.saturating_sub(TAPS / 2).min(nodes.len() - TAPS);
            let used = &nodes[first..first + TAPS];
            let position_m: [f64; TAPS] = std::array::from_fn(|i| used[i].0);
            let mut taps: Vec<(usize, f64)> = Vec::new();
            let mut from_walls = 0.0;
            for ((_, node), weight) in used.iter().zip(derivative_weights(position_m, at_m)) {
                match *node {
                    Node::Wall(value) => from_walls += weight * value,
                    Node::Cell(cell) => match taps.iter_mut().find(|(c, _)| *c == cell) {
                        Some((_, sum)) => *sum += weight,
                        None => taps.push((cell, weight)),
                    },
                }
            }
            (taps, from_walls)
        };
        let (taps, from_walls) = (0..faces).map(at_face).unzip();
        Self { taps, from_walls }
    }
}

/// The centres with what continues them at both ends, in increasing order.
fn extended(direction: &Direction, component: usize) -> Vec<(f64, Node)> {
    let n = direction.cells;
    let centre = |i: usize| direction.at(i as f64 + 0.5).0;
    let mut nodes: Vec<(f64, Node)> = (0..n).map(|i| (centre(i), Node::Cell(i))).collect();
    match direction.ends {
        Ends::Periodic => {
            let length_m = direction.length_m();
            for i in 0..TAPS / 2 {
                nodes.push((centre(i) + length_m, Node::Cell(i)));
                nodes.push((centre(n - 1 - i) - length_m, Node::Cell(n - 1 - i)));
            }
        }
        Ends::Walls { low, high } => {
            for (wall, at_m, cell) in [(low, direction.low_m, 0), (high, direction.high_m, n - 1)] {
                match wall {
                    Wall::NoSlip { velocity_m_s } => nodes.push((at_m, Node::Wall(velocity_m_s[component]))),
                    Wall::Slip => {
                        for i in 0..TAPS / 2 {
                            let cell = if cell == 0 { i } else { cell - i };
                            nodes.push((2.0 * at_m - centre(cell), Node::Cell(cell)));
                        }
                    }
                }
            }
        }
    }
    nodes.sort_by(|a, b| a.0.total_cmp(&b.0));
    nodes
}

/// Weights of the derivative at `at_m` of the cubic through four positions.
fn derivative_weights(position_m: [f64; TAPS], at_m: f64) -> [f64; TAPS] {
    std::array::from_fn(|i| {
        let others = || (0..TAPS).filter(move |j| *j != i);
        let scale: f64 = others().map(|j| position_m[i] - position_m[j]).product();
        let sum: f64 = others()
            .map(|left_out| others().filter(|j| *j != left_out).map(|j| at_m - position_m[j]).product::<f64>())
            .sum();
        sum / scale
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::mesh::Spread;

    fn derive(direction: &Direction, component: usize, field: impl Fn(f64) -> f64) -> Vec<f64> {
        let slope = Slope::new(direction, component);
        let value = |i: usize| field(direction.at(i as f64 + 0.5).0);
        let sum = |taps: &Vec<(usize, f64)>| taps.iter().map(|(i, w)| w * value(*i)).sum::<f64>();
        slope.taps.iter().zip(&slope.from_walls).map(|(taps, wall)| sum(taps) + wall).collect()
    }

    #[test]
    fn cubics_that_meet_a_moving_wall_are_exact_and_mirror_images_flat() {
        let belt = Wall::NoSlip { velocity_m_s: [0.0, 0.7, 0.0] };
        let line = Direction::between(16, 0.0, 2.0, belt, Wall::Slip).stretched(Spread::TanhLow.by(1.5));
        let found = derive(&line, 1, |z| 0.7 + 2.0 * z - 3.0 * z * z + z.powi(3));
        // The last two faces see the mirror image in the plane at the top.
        for (k, slope) in found.iter().enumerate().take(15) {
            let z = line.at(k as f64).0;
            assert!((slope - (2.0 - 6.0 * z + 3.0 * z * z)).abs() < 1e-11, "{k}: {slope}");
        }
        assert!(found[16].abs() < 1e-11, "flat at the plane");
        // Of another component the wall is at rest.
        assert!((derive(&line, 0, |z| 4.0 * z)[0] - 4.0).abs() < 1e-11);
    }

    #[test]
    fn periodic_lines_go_round() {
        let tau = std::f64::consts::TAU;
        let line = Direction::periodic(64, -1.0, 1.0);
        for (j, slope) in derive(&line, 2, |y| (0.5 * tau * y).sin()).iter().enumerate() {
            let exact = 0.5 * tau * (0.5 * tau * line.at(j as f64).0).cos();
            assert!((slope - exact).abs() < 2e-4, "{j}: {slope} for {exact}");
        }
        assert!(derive(&Direction::thin(1.0), 0, |_| 1.0) == [0.0]);
    }
}
