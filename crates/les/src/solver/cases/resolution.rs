//! Whether a mesh resolves vortices near a wall: cells per core, and per boundary layer across and along the wall.
//!
//! The bars are what the flows with known answers need. With 3.8 cells along the wall per layer the dipole at Re 2500 comes
//! back 6 % too weak, with 5.1 (or 5.4 at Re 1250) about 1 %.

use super::super::mesh::Mesh;

/// Lengths that a mesh must resolve, in the plane y, z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VortexLengths {
    /// Core radius \[m\].
    pub core_radius_m: f64,
    /// Position (y, z) of the core \[m\].
    pub core_m: [f64; 2],
    /// Thickness of the boundary layer at no-slip walls across z, `sqrt(nu length/speed)` \[m\].
    pub layer_m: f64,
    /// Whether the vortices run straight against the wall, so that the layer rolls up in vortices of its own thickness.
    pub rolls_up: bool,
}

/// Cells that a mesh has across these lengths.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resolution {
    /// Cells per core radius along y and z, at the core.
    pub core_cells: [f64; 2],
    /// Cells across the boundary layer; `None` without a no-slip wall across z.
    pub layer_cells: Option<f64>,
    /// Cells along the wall per thickness of the layer, at the core's y; `None` where it does not roll up.
    pub rolled_cells: Option<f64>,
}

/// Least cells per core radius.
const CORE_CELLS: f64 = 2.5;
/// Least cells across a boundary layer.
const LAYER_CELLS: f64 = 3.0;
/// Least cells along the wall per thickness of a layer that rolls up.
const ROLLED_CELLS: f64 = 5.0;

impl Resolution {
    /// What `mesh` has.
    pub fn new(mesh: &Mesh, lengths: &VortexLengths) -> Self {
        let width_m = |axis: usize, at_m: f64| -> f64 {
            let faces = mesh.face_m(axis);
            let inside = |pair: &&[f64]| pair[0] <= at_m && at_m <= pair[1];
            faces
                .windows(2)
                .filter(inside)
                .map(|pair| pair[1] - pair[0])
                .fold(f64::INFINITY, f64::min)
        };
        let core_cells =
            std::array::from_fn(|i| lengths.core_radius_m / width_m(i + 1, lengths.core_m[i]));
        let [_, _, z] = mesh.directions();
        let [low, high] = z.ends.no_slip();
        // Cells, and the part of the last one, within the layer.
        let within = |from_wall_m: Vec<f64>| -> f64 {
            let part =
                |pair: &[f64]| ((lengths.layer_m - pair[0]) / (pair[1] - pair[0])).clamp(0.0, 1.0);
            from_wall_m.windows(2).map(part).sum()
        };
        let faces = mesh.face_m(2);
        let at_low = low.then(|| within(faces.iter().map(|z_m| z_m - z.low_m).collect()));
        let at_high = high.then(|| within(faces.iter().rev().map(|z_m| z.high_m - z_m).collect()));
        let layer_cells = at_low.into_iter().chain(at_high).reduce(f64::min);
        let rolls = lengths.rolls_up && layer_cells.is_some();
        let rolled_cells = rolls.then(|| lengths.layer_m / width_m(1, lengths.core_m[0]));
        Self {
            core_cells,
            layer_cells,
            rolled_cells,
        }
    }

    /// One sentence for each length that has too few cells.
    pub fn warnings(&self) -> Vec<String> {
        let [y, z] = self.core_cells;
        [
            ("the core radius along y", Some(y), CORE_CELLS),
            ("the core radius along z", Some(z), CORE_CELLS),
            ("the boundary layer, across the wall,", self.layer_cells, LAYER_CELLS),
            ("the boundary layer's thickness along the wall, where it rolls up,", self.rolled_cells, ROLLED_CELLS),
        ]
        .into_iter()
        .filter_map(|(what, cells, least)| Some((what, cells.filter(|cells| *cells < least)?, least)))
        .map(|(what, cells, least)| {
            let other = if what.contains("core") { "" } else { ", or a lower Reynolds number" };
            // Rounded up, and a little more where cells are stretched.
            let more = (10.0 * least / cells + 0.5).ceil() / 10.0;
            format!(
                "{what} has {cells:.2} cells, at least {least} are needed: take {more:.1} times as many cells, a stronger stretching \
                 towards it{other}"
            )
        })
        .collect()
    }
}

impl VortexLengths {
    /// Those of the dipole, in half widths of its box: the core 0.1, the layer `Re^-1/2`.
    pub fn dipole(reynolds: f64) -> Self {
        let radius_m = super::boxes::RADIUS_M;
        Self {
            core_radius_m: radius_m,
            core_m: [radius_m, 0.0],
            layer_m: reynolds.powf(-0.5),
            rolls_up: true,
        }
    }

    /// Those of a vortex pair of the spacing `b0 = unit_m` \[m\] above ground, core and height in `b0`: the layer is
    /// `sqrt(nu b0/V0)` with `nu = 2 pi b0 V0/reynolds`.
    pub fn pair(core_radius: f64, height: f64, reynolds: f64, unit_m: f64) -> Self {
        Self {
            core_radius_m: core_radius * unit_m,
            core_m: [0.5 * unit_m, height * unit_m],
            layer_m: (std::f64::consts::TAU / reynolds).sqrt() * unit_m,
            rolls_up: false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{VortexPairCase, dipole_between_walls};
    use super::*;

    fn dipole(cells: usize, lateral: f64, reynolds: f64) -> Vec<String> {
        let case = dipole_between_walls([cells, cells], [lateral, 1.5], reynolds).unwrap();
        let lengths = VortexLengths::dipole(reynolds);
        Resolution::new(&case.mesh, &lengths).warnings()
    }

    #[test]
    fn a_dipole_is_called_unresolved_where_its_second_collision_is_wrong() {
        assert_eq!(dipole(384, 0.0, 1250.0), Vec::<String>::new());
        assert_eq!(dipole(512, 0.0, 2500.0), Vec::<String>::new());
        let found = dipole(384, 0.0, 2500.0);
        assert!(
            found.len() == 1
                && found[0].contains("along the wall")
                && found[0].contains("3.84 cells"),
            "{found:?}"
        );
        assert_eq!(dipole(384, 0.5, 2500.0), Vec::<String>::new());
        let found = dipole(32, 0.0, 2500.0);
        assert!(
            found.len() == 4 && found[0].contains("core radius along y"),
            "{found:?}"
        );
    }

    #[test]
    fn the_presets_of_a_pair_above_ground_are_resolved_and_a_thin_core_is_not() {
        let found = |pair: VortexPairCase| {
            let lengths = VortexLengths::pair(pair.core_radius, pair.height, pair.reynolds, 1.0);
            Resolution::new(
                &pair.case(VortexPairCase::steps(0.02)).unwrap().mesh,
                &lengths,
            )
            .warnings()
        };
        assert_eq!(found(VortexPairCase::coarse()), Vec::<String>::new());
        let thin = found(VortexPairCase {
            core_radius: 0.05,
            reynolds: 2e4,
            ..VortexPairCase::coarse()
        });
        assert!(
            thin.len() == 3 && thin[2].contains("boundary layer"),
            "{thin:?}"
        );
    }
}
