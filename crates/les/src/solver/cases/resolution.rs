//! Whether a mesh resolves a vortex pair above the ground: cells per core radius, and across the
//! boundary layer.

use std::f64::consts::TAU;

use super::super::mesh::Mesh;
use super::VortexPairCase;
use crate::Error;

/// Least cells per core radius.
const CORE_CELLS: f64 = 2.5;
/// Least cells across a boundary layer.
const LAYER_CELLS: f64 = 3.0;

impl VortexPairCase {
    /// One sentence for each length that the mesh of the case does not resolve: the core radius
    /// along y and z, and the boundary layer under the cores, across no-slip walls across z.
    ///
    /// # Errors
    /// A mesh that [`Mesh::new`] refuses.
    pub fn unresolved_lengths(&self) -> Result<Vec<String>, Error> {
        let mesh = self.mesh(1.0)?;
        let core = [0.5, self.height];
        let mut warnings = Vec::new();
        for (i, axis) in ["y", "z"].into_iter().enumerate() {
            let cells = self.core_radius / cell_width(&mesh.face_m(i + 1), core[i]);
            if cells < CORE_CELLS {
                let what = format!("the core radius along {axis}");
                warnings.push(warning(&what, cells, CORE_CELLS));
            }
        }
        if let Some(cells) = self.layer_cells(&mesh)
            && cells < LAYER_CELLS
        {
            let what = "the boundary layer, across the wall,";
            let text = warning(what, cells, LAYER_CELLS);
            warnings.push(format!("{text}, or a lower Reynolds number"));
        }
        Ok(warnings)
    }

    /// Cells across the boundary layer; `None` without a no-slip wall across z. In the units of the
    /// pair it is `sqrt(nu b0/V0)` thick with `nu = 2 pi b0 V0/reynolds`.
    fn layer_cells(&self, mesh: &Mesh) -> Option<f64> {
        let layer = (TAU / self.reynolds).sqrt();
        let [_, _, z] = mesh.directions();
        let [low, high] = z.ends.no_slip();
        let mut from_low = mesh.face_m(2);
        let mut from_high = from_low.clone();
        from_high.reverse();
        for height in &mut from_low {
            *height -= z.low_m;
        }
        for height in &mut from_high {
            *height = z.high_m - *height;
        }
        let at_low = low.then(|| cells_within(&from_low, layer));
        let at_high = high.then(|| cells_within(&from_high, layer));
        at_low.into_iter().chain(at_high).reduce(f64::min)
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

/// Width of the narrowest cell between `faces` that contains `position`; infinite if none does.
fn cell_width(faces: &[f64], position: f64) -> f64 {
    faces
        .windows(2)
        .filter(|pair| pair[0] <= position && position <= pair[1])
        .map(|pair| pair[1] - pair[0])
        .fold(f64::INFINITY, f64::min)
}

/// Cells, and the fraction of the last one, between a wall and the distance `layer` from it;
/// `from_wall` are the distances of the faces from the wall.
fn cells_within(from_wall: &[f64], layer: f64) -> f64 {
    from_wall
        .windows(2)
        .map(|faces| ((layer - faces[0]) / (faces[1] - faces[0])).clamp(0.0, 1.0))
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn warnings(pair: VortexPairCase) -> Vec<String> {
        pair.unresolved_lengths().unwrap()
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
