//! The hierarchy of meshes of the two directions that multigrid treats, and what carries fields between them.
//!
//! Each coarse mesh has the second-order operator `K u = sum of links times differences` with the masses of the fourth-order one:
//! then the two have the same eigenvectors of long wavelength, and eigenvalues within a factor 1.37 everywhere; on the finest
//! mesh the links serve the lines' own problems. Coarse cells
//! are pairs; of an odd number the last stays alone. Lengths are in units of the mean cell, so that single precision holds
//! any mesh.
//!
//! Check: interpolation of constants and of straight lines, masses, colours.

use super::super::super::operators_1d::{Operators1d, Taps};

/// One direction of one mesh.
#[derive(Debug, Clone)]
pub(crate) struct Axis {
    /// Mass of each cell.
    pub(crate) mass: Vec<f64>,
    /// Inverse distance of cell `i` to cell `i + 1`; the last is the link to cell 0 of a periodic direction, or zero.
    pub(crate) link: Vec<f64>,
    /// Position of each cell.
    centre: Vec<f64>,
    /// Distance after which the positions repeat.
    period: Option<f64>,
}

/// Interpolation to one fine cell: two coarse cells and their weights.
pub(crate) type Weights = [(usize, f32); 2];

/// Cells that are not coarsened further.
const COARSEST: usize = 3;

impl Axis {
    /// The finest mesh, in units of `unit_m` \[m\].
    pub(crate) fn new(line: &Operators1d, unit_m: f64) -> Self {
        let n = line.cells;
        let distance: Vec<f64> = line.face_mass_m[1..].iter().map(|f| f / unit_m).collect();
        let mut centre = vec![0.0; n];
        for i in 1..n {
            centre[i] = centre[i - 1] + distance[i - 1];
        }
        let period = (line.is_periodic() && n > 1).then(|| distance.iter().sum());
        let mass = line.cell_mass_m.iter().map(|mass| mass / unit_m).collect();
        Self::of(mass, centre, period)
    }

    fn of(mass: Vec<f64>, centre: Vec<f64>, period: Option<f64>) -> Self {
        let n = mass.len();
        let mut link: Vec<f64> = centre.windows(2).map(|x| 1.0 / (x[1] - x[0])).collect();
        let mut wrap = period.map_or(0.0, |period| 1.0 / (centre[0] + period - centre[n - 1]));
        if n == 2 {
            // Both links join the same two cells.
            link[0] += wrap;
            wrap = 0.0;
        }
        link.push(wrap);
        Self { mass, link, centre, period }
    }

    /// Number of cells.
    pub(crate) fn len(&self) -> usize {
        self.mass.len()
    }

    /// The cells linked to each cell and the links.
    pub(crate) fn couplings(&self) -> Vec<Taps> {
        let last = self.len() - 1;
        let before = |i: usize| if i > 0 { (i - 1, self.link[i - 1]) } else { (last, self.link[last]) };
        let behind = |i: usize| if i < last { (i + 1, self.link[i]) } else { (0, self.link[last]) };
        (0..=last).map(|i| [before(i), behind(i)].into_iter().filter(|tap| tap.1 != 0.0).collect()).collect()
    }

    /// Whether the last cell is linked to the first.
    pub(crate) fn wraps(&self) -> bool {
        self.link[self.len() - 1] != 0.0
    }

    /// Whether it can be coarsened.
    pub(crate) fn is_fine(&self) -> bool {
        self.len() > COARSEST
    }

    /// The mesh of pairs, and the interpolation from it; the same mesh where it is as coarse as can be.
    pub(crate) fn coarsened(&self) -> (Self, Vec<Weights>) {
        if !self.is_fine() {
            return (self.clone(), (0..self.len()).map(|i| [(i, 1.0), (i, 0.0)]).collect());
        }
        let pair = |i: usize| 2 * i..(2 * i + 2).min(self.len());
        let coarse = self.len().div_ceil(2);
        let mass: Vec<f64> = (0..coarse).map(|i| self.mass[pair(i)].iter().sum()).collect();
        let sum = |i: usize| pair(i).map(|c| self.centre[c]).sum::<f64>();
        let centre: Vec<f64> = (0..coarse).map(|i| sum(i) / pair(i).len() as f64).collect();
        let weights = (0..self.len()).map(|i| self.weights(i, &centre)).collect();
        (Self::of(mass, centre, self.period), weights)
    }

    /// Linear interpolation at fine cell `i` between coarse cells at `centre`; constant beyond the outermost of them.
    fn weights(&self, i: usize, centre: &[f64]) -> Weights {
        let (own, last) = (i / 2, centre.len() - 1);
        let x = self.centre[i];
        let period = self.period.unwrap_or(0.0);
        let (other, position) = match (x >= centre[own], self.period) {
            (true, _) if own < last => (own + 1, centre[own + 1]),
            (true, Some(_)) => (0, centre[0] + period),
            (false, _) if own > 0 => (own - 1, centre[own - 1]),
            (false, Some(_)) => (last, centre[last] - period),
            (_, None) => (own, x + 1.0),
        };
        let share = if other == own { 0.0 } else { (x - centre[own]) / (position - centre[own]) };
        [(own, (1.0 - share) as f32), (other, share as f32)]
    }
}

/// Lines of one direction in the order of their relaxation: no two neighbours in one group.
pub(crate) fn colours(axis: &Axis) -> Vec<Vec<usize>> {
    let n = axis.len();
    // The last of an odd number of periodic lines touches the first.
    let alone = axis.wraps() && n % 2 == 1;
    let end = n - usize::from(alone);
    let mut colours = vec![(0..end).step_by(2).collect(), (1..end).step_by(2).collect()];
    if alone {
        colours.push(vec![n - 1]);
    }
    colours.retain(|colour: &Vec<usize>| !colour.is_empty());
    colours
}

#[cfg(test)]
mod tests {
    use super::super::super::super::mesh::{Direction, Mapping, Wall};
    use super::*;

    fn lines() -> Vec<Operators1d> {
        let walls = |n| Direction::between(n, 0.0, 4.0, Wall::AT_REST, Wall::Slip);
        [
            walls(24),
            walls(37).stretched(Mapping::TanhLow { strength: 3.0 }),
            Direction::periodic(19, 0.0, 4.0).stretched(Mapping::Sine { amplitude: 0.5 }),
        ]
        .iter()
        .map(Operators1d::new)
        .collect()
    }

    #[test]
    fn interpolation_keeps_constants_and_straight_lines_and_coarse_meshes_keep_the_mass() {
        for line in lines() {
            let mut axis = Axis::new(&line, 0.5);
            while axis.is_fine() {
                let (coarse, weights) = axis.coarsened();
                let sum = |axis: &Axis| axis.mass.iter().sum::<f64>();
                assert!((sum(&coarse) / sum(&axis) - 1.0).abs() < 1e-14);
                for (i, [a, b]) in weights.iter().enumerate() {
                    assert!((a.1 + b.1 - 1.0).abs() < 1e-6 && a.1 > 0.3 && b.1 >= 0.0, "{i}: {a:?} {b:?}");
                    let between = a.0.abs_diff(b.0) == 1;
                    if between {
                        let x = f64::from(a.1) * coarse.centre[a.0] + f64::from(b.1) * coarse.centre[b.0];
                        assert!((x - axis.centre[i]).abs() < 1e-5, "{i}: {x} {}", axis.centre[i]);
                    }
                }
                axis = coarse;
            }
            assert!(axis.len() == 2 || axis.len() == 3);
        }
    }

    #[test]
    fn lines_of_one_colour_never_touch() {
        for line in lines() {
            let mut axis = Axis::new(&line, 0.5);
            loop {
                let n = axis.len();
                let colours = colours(&axis);
                assert_eq!(colours.iter().map(Vec::len).sum::<usize>(), n);
                for (a, b) in (0..n).map(|i| (i, (i + 1) % n)).filter(|&(i, _)| axis.link[i] != 0.0) {
                    assert!(colours.iter().all(|colour| !(colour.contains(&a) && colour.contains(&b))));
                }
                if !axis.is_fine() {
                    break;
                }
                axis = axis.coarsened().0;
            }
        }
    }
}
