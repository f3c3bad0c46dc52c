//! Vortices in the axial vorticity of a cross-plane: centroids about a guess, strongest places,
//! sums over sides.
//!
//! The centroid is that of the vorticity of one sign within a circle about itself, found by
//! iteration. The rim of the circle counts with the share of the cell that it covers, so that the
//! centroid moves smoothly over the mesh.
//!
//! Check: a Gaussian vortex off the nodes of a stretched mesh, across the period, beside another
//! one.

/// Iterations of a centroid at most; each gains a digit or more where the vortex is smaller than
/// the circle.
const ITERATIONS: usize = 60;

/// The edges along x, seen in a cross-plane: their positions and the lengths about them. The axial
/// vorticity there is `[z][y]` \[1/s\].
#[derive(Debug, Clone)]
pub(super) struct EdgeGrid {
    /// Positions of the faces along y and z \[m\].
    pub(super) y_m: Vec<f64>,
    pub(super) z_m: Vec<f64>,
    /// Lengths about them \[m\].
    pub(super) y_length_m: Vec<f64>,
    pub(super) z_length_m: Vec<f64>,
    /// Width of the box if it is periodic \[m\].
    pub(super) period_m: Option<f64>,
}

/// A vortex found in a plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Core {
    /// `(y, z)` \[m\].
    pub(super) centre_m: [f64; 2],
    /// Vorticity of its sign within the circle \[m^2/s\].
    pub(super) circulation_m2_s: f64,
}

impl EdgeGrid {
    /// Distance along y from `from_m` to `to_m`, the shorter way round.
    pub(super) fn lateral_m(&self, from_m: f64, to_m: f64) -> f64 {
        match self.period_m {
            Some(period_m) => (to_m - from_m) - period_m * ((to_m - from_m) / period_m).round(),
            None => to_m - from_m,
        }
    }

    /// The vortex of the given sign about `guess_m`; none where there is no such vorticity.
    pub(super) fn core(
        &self,
        vorticity_per_s: &[f64],
        guess_m: [f64; 2],
        sign: f64,
        radius_m: f64,
    ) -> Option<Core> {
        let mut core = self.moments(vorticity_per_s, guess_m, sign, radius_m)?;
        for _ in 0..ITERATIONS {
            let next = self.moments(vorticity_per_s, core.centre_m, sign, radius_m)?;
            let moved_m =
                (next.centre_m[0] - core.centre_m[0]).hypot(next.centre_m[1] - core.centre_m[1]);
            core = next;
            if moved_m < 1e-9 * radius_m {
                break;
            }
        }
        Some(core)
    }

    /// Centroid and circulation within the circle about `centre_m`.
    fn moments(
        &self,
        vorticity_per_s: &[f64],
        centre_m: [f64; 2],
        sign: f64,
        radius_m: f64,
    ) -> Option<Core> {
        let ny = self.y_m.len();
        let mut sum = 0.0;
        let mut y_sum = 0.0;
        let mut z_sum = 0.0;
        for (k, (z_m, z_length_m)) in self.z_m.iter().zip(&self.z_length_m).enumerate() {
            let dz_m = z_m - centre_m[1];
            if dz_m.abs() > radius_m + z_length_m {
                continue;
            }
            let row = &vorticity_per_s[k * ny..(k + 1) * ny];
            for (j, (value, y_length_m)) in row.iter().zip(&self.y_length_m).enumerate() {
                let value = sign * value;
                if value <= 0.0 {
                    continue;
                }
                let dy_m = self.lateral_m(centre_m[0], self.y_m[j]);
                if dy_m.abs() > radius_m + y_length_m {
                    continue;
                }
                let area_m2 = y_length_m * z_length_m;
                let covered =
                    ((radius_m - dy_m.hypot(dz_m)) / area_m2.sqrt() + 0.5).clamp(0.0, 1.0);
                let weight = covered * area_m2 * value;
                sum += weight;
                y_sum += weight * dy_m;
                z_sum += weight * dz_m;
            }
        }
        (sum > 0.0).then(|| Core {
            centre_m: [centre_m[0] + y_sum / sum, centre_m[1] + z_sum / sum],
            circulation_m2_s: sign * sum,
        })
    }

    /// The place of the strongest vorticity of the given sign where `is_in(y, z)` \[m\].
    pub(super) fn strongest_m(
        &self,
        vorticity_per_s: &[f64],
        sign: f64,
        is_in: impl Fn(f64, f64) -> bool,
    ) -> Option<[f64; 2]> {
        let mut best = (0.0, None);
        for (at_m, value, _) in self.edges(vorticity_per_s) {
            if sign * value > best.0 && is_in(at_m[0], at_m[1]) {
                best = (sign * value, Some(at_m));
            }
        }
        best.1
    }

    /// Vorticity of the given sign where `is_in(y, z)`, summed \[m^2/s\].
    pub(super) fn circulation_m2_s(
        &self,
        vorticity_per_s: &[f64],
        sign: f64,
        is_in: impl Fn(f64, f64) -> bool,
    ) -> f64 {
        let inside = self
            .edges(vorticity_per_s)
            .filter(|(at_m, value, _)| sign * value > 0.0 && is_in(at_m[0], at_m[1]));
        inside.map(|(_, value, area_m2)| value * area_m2).sum()
    }

    /// Position, vorticity and area of all edges.
    fn edges(&self, vorticity_per_s: &[f64]) -> impl Iterator<Item = ([f64; 2], f64, f64)> {
        let ny = self.y_m.len();
        let places = vorticity_per_s.iter().enumerate();
        places.map(move |(place, value)| {
            let j = place % ny;
            let k = place / ny;
            let area_m2 = self.y_length_m[j] * self.z_length_m[k];
            ([self.y_m[j], self.z_m[k]], *value, area_m2)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RADIUS_M: f64 = 0.25;

    fn axes() -> EdgeGrid {
        let y_m: Vec<f64> = (0..100).map(|j| -1.5 + 0.03 * f64::from(j)).collect();
        let z_m: Vec<f64> = (0..=60)
            .map(|k| 2.0 * (f64::from(k) / 60.0).powf(1.3))
            .collect();
        let middle = |k: usize| 0.5 * (z_m[k.min(59)] + z_m[(k + 1).min(60)]);
        let z_length_m = (0..=60)
            .map(|k: usize| middle(k) - if k == 0 { 0.0 } else { middle(k - 1) })
            .collect();
        EdgeGrid {
            y_length_m: vec![0.03; 100],
            y_m,
            z_m,
            z_length_m,
            period_m: Some(3.0),
        }
    }

    fn plane(axes: &EdgeGrid, vortices: &[(f64, f64, f64)]) -> Vec<f64> {
        let at = |y: f64, z: f64| {
            let one = |&(sign, y0, z0): &(f64, f64, f64)| {
                let dy = (y - y0) - 3.0 * ((y - y0) / 3.0).round();
                sign * (-(dy * dy + (z - z0) * (z - z0)) / 0.01).exp()
                    / (std::f64::consts::PI * 0.01)
            };
            vortices.iter().map(one).sum()
        };
        axes.z_m
            .iter()
            .flat_map(|z| axes.y_m.iter().map(move |y| (*y, *z)))
            .map(|(y, z)| at(y, z))
            .collect()
    }

    #[test]
    fn vortices_off_the_nodes_are_found_within_a_hundredth_of_a_cell_and_across_the_period() {
        let axes = axes();
        let within = 1.0 - (-RADIUS_M * RADIUS_M / 0.01_f64).exp();
        for (y, z) in [(0.011, 0.9), (-0.777, 0.61), (1.497, 1.203)] {
            let plane = plane(&axes, &[(1.0, y, z), (-0.8, y - 0.5, z)]);
            let core = axes
                .core(&plane, [y + 0.06, z - 0.05], 1.0, RADIUS_M)
                .unwrap();
            let off_m = (core.centre_m[0] - y).hypot(core.centre_m[1] - z);
            assert!(off_m < 3e-4, "{off_m} from ({y}, {z})");
            assert!(
                (core.circulation_m2_s / within - 1.0).abs() < 2e-3,
                "{}",
                core.circulation_m2_s
            );
            let other = axes.core(&plane, [y - 0.45, z], -1.0, RADIUS_M).unwrap();
            assert!(
                (axes.lateral_m(y - 0.5, other.centre_m[0])).abs() < 3e-4,
                "{:?}",
                other.centre_m
            );
            assert!(
                (other.circulation_m2_s / within + 0.8).abs() < 2e-3,
                "it keeps its sign"
            );
        }
    }

    #[test]
    fn sums_and_strongest_places_keep_to_their_side_and_sign() {
        let axes = axes();
        let plane = plane(
            &axes,
            &[(1.0, -0.6, 0.8), (-0.5, 0.3, 0.7), (2.0, 0.9, 1.1)],
        );
        let right = |y: f64, z: f64| y > 0.0 && z > 0.15;
        assert!((axes.circulation_m2_s(&plane, -1.0, right) + 0.5).abs() < 1e-3);
        assert!((axes.circulation_m2_s(&plane, 1.0, |y, _| y < 0.2) - 1.0).abs() < 1e-3);
        let strongest = axes.strongest_m(&plane, -1.0, right).unwrap();
        assert!(
            (strongest[0] - 0.3).abs() < 0.02 && (strongest[1] - 0.7).abs() < 0.03,
            "{strongest:?}"
        );
        assert!(
            axes.strongest_m(&plane, -1.0, |y, _| y < -1.4).is_none()
                || axes.strongest_m(&plane, 1.0, right).is_some()
        );
        assert!(axes.core(&[0.0; 6100], [0.0, 1.0], 1.0, 0.2).is_none());
    }
}
