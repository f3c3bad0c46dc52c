//! Whether a mesh resolves a vortex pair above the ground: cells per core radius, and across the
//! boundary layer.

use std::f64::consts::TAU;

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
}

/// Cells that a mesh has across these lengths.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resolution {
    /// Cells per core radius along y and z, at the core.
    pub core_cells: [f64; 2],
    /// Cells across the boundary layer; `None` without a no-slip wall across z.
    pub layer_cells: Option<f64>,
}

/// Least cells per core radius.
const CORE_CELLS: f64 = 2.5;
/// Least cells across a boundary layer.
const LAYER_CELLS: f64 = 3.0;

impl Resolution {
    /// What `mesh` has.
    pub fn new(mesh: &Mesh, lengths: &VortexLengths) -> Self {
        let core_cells = std::array::from_fn(|i| {
            lengths.core_radius_m / cell_width_m(&mesh.face_m(i + 1), lengths.core_m[i])
        });
        let [_, _, z] = mesh.directions();
        let [low, high] = z.ends.no_slip();
        let mut from_low_m = mesh.face_m(2);
        let mut from_high_m = from_low_m.clone();
        from_high_m.reverse();
        for height_m in &mut from_low_m {
            *height_m -= z.low_m;
        }
        for height_m in &mut from_high_m {
            *height_m = z.high_m - *height_m;
        }
        let at_low = low.then(|| cells_within(&from_low_m, lengths.layer_m));
        let at_high = high.then(|| cells_within(&from_high_m, lengths.layer_m));
        Self {
            core_cells,
            layer_cells: at_low.into_iter().chain(at_high).reduce(f64::min),
        }
    }

    /// One sentence for each length that has too few cells.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        for (axis, cells) in ["y", "z"].into_iter().zip(self.core_cells) {
            if cells < CORE_CELLS {
                let what = format!("the core radius along {axis}");
                warnings.push(warning(&what, cells, CORE_CELLS));
            }
        }
        if let Some(cells) = self.layer_cells
            && cells < LAYER_CELLS
        {
            let what = "the boundary layer, across the wall,";
            let text = warning(what, cells, LAYER_CELLS);
            warnings.push(format!("{text}, or a lower Reynolds number"));
        }
        warnings
    }
}

fn warning(what: &str, cells: f64, least: f64) -> String {
    // Rounded up, and a little more where cells are stretched.
    let more = (10.0 * least / cells + 0.5).ceil() / 10.0;
    format!(
        "{what} has {cells:.2} cells, at least {least} are needed: take {more:.1} times as many cells, a stronger stretching \
         towards it"
    )
}

/// Width of the narrowest cell between `face_m` that contains `at_m` \[m\]; infinite if none does.
fn cell_width_m(face_m: &[f64], at_m: f64) -> f64 {
    face_m
        .windows(2)
        .filter(|faces| faces[0] <= at_m && at_m <= faces[1])
        .map(|faces| faces[1] - faces[0])
        .fold(f64::INFINITY, f64::min)
}

/// Cells, and the fraction of the last one, between a wall and the distance `layer_m` from it;
/// `from_wall_m` are the distances of the faces from the wall.
fn cells_within(from_wall_m: &[f64], layer_m: f64) -> f64 {
    from_wall_m
        .windows(2)
        .map(|faces| ((layer_m - faces[0]) / (faces[1] - faces[0])).clamp(0.0, 1.0))
        .sum()
}

impl VortexLengths {
    /// Those of a vortex pair of the spacing `b0 = unit_m` \[m\] above ground, core and height in
    /// `b0`: the layer is `sqrt(nu b0/V0)` with `nu = 2 pi b0 V0/reynolds`.
    pub fn pair(core_radius: f64, height: f64, reynolds: f64, unit_m: f64) -> Self {
        Self {
            core_radius_m: core_radius * unit_m,
            core_m: [0.5 * unit_m, height * unit_m],
            layer_m: (TAU / reynolds).sqrt() * unit_m,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::VortexPairCase;
    use super::*;

    fn warnings(pair: VortexPairCase) -> Vec<String> {
        let lengths = VortexLengths::pair(pair.core_radius, pair.height, pair.reynolds, 1.0);
        let case = pair.case(VortexPairCase::steps(0.02)).unwrap();
        Resolution::new(&case.mesh, &lengths).warnings()
    }

    #[test]
    fn the_presets_of_a_pair_above_ground_are_resolved_and_a_thin_core_is_not() {
        assert_eq!(warnings(VortexPairCase::coarse()), Vec::<String>::new());
        let thin = warnings(VortexPairCase {
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
