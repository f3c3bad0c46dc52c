//! Convection as it is written, point by point from the tables of `transport`: to be read first,
//! and the oracle of the fast form.
//!
//! Check: `convection` gives the same on every kind of mesh; what the tables meet is checked in
//! `transport`.

use super::layout::Layout;
use super::transport::Stencil;

/// `(u . grad) u_a` \[m/s^2\] at the faces of memory axis `a`, as on the left of the momentum
/// equation: the sum over the directions `b` of `(f_a m_b)^-1 sum_n G_n S^n u_a`, where `m` are the
/// masses of the cells and `f` those of the faces.
///
/// `G_n` is the flux `u_b` through face `n` of direction `b`, weighted with the cells along `a` and
/// brought to the faces of `a`. For `b = a` the flux is `u_a` itself, whose mean the tables hold,
/// and `m_b` is not there. Walls have no row: zero.
pub(crate) fn literal_convection(layout: &Layout, velocity: [&[f64]; 3], a: usize) -> Vec<f64> {
    let shape = layout.shape;
    let stencil = Stencil::for_lines(&layout.line);
    let mean = layout.line[a].flux_mean();
    let tables: [_; 3] = std::array::from_fn(|b| {
        let line = &layout.line[b];
        if b == a {
            line.transport_of_faces(stencil).rows
        } else {
            line.transport_of_cells(stencil).rows
        }
    });
    let mut convection = vec![0.0; shape.len()];
    for (place, convection) in convection.iter_mut().enumerate() {
        let at = shape.index(place);
        if at[a] < layout.line[a].first_face() {
            continue;
        }
        let mut sum = 0.0;
        for b in 0..3 {
            for &(face, value, coefficient) in &tables[b][at[b]] {
                let through = moved(at, b, face);
                let carried = velocity[a][shape.place(moved(at, b, value))];
                if b == a {
                    let flux = velocity[a][shape.place(through)];
                    sum += coefficient * flux * carried;
                } else {
                    let flux: f64 = mean[at[a]]
                        .iter()
                        .map(|tap| tap.1 * velocity[b][shape.place(moved(through, a, tap.0))])
                        .sum();
                    sum += coefficient * flux * carried / layout.line[b].cell_mass_m[at[b]];
                }
            }
        }
        *convection = sum / layout.line[a].face_mass_m[at[a]];
    }
    convection
}

/// The indices `at` with that along `axis` replaced.
fn moved(at: [usize; 3], axis: usize, index: usize) -> [usize; 3] {
    let mut moved = at;
    moved[axis] = index;
    moved
}

#[cfg(test)]
mod tests {
    use super::super::component_operators::{ComponentOperators, Scratch};
    use super::super::mesh::{Direction, Mesh, Spread, Wall};
    use super::*;

    /// Meshes of all kinds: periodic and bounded, equal and stretched, thin, in both orders of
    /// memory.
    fn layouts() -> Vec<Layout> {
        let waves = |n| Direction::periodic(n, 0.0, 1.3);
        let sine = |n| waves(n).stretched(Spread::Sine.by(0.25));
        let slip = |n| Direction::between(n, 0.0, 0.9, Wall::Slip, Wall::Slip);
        let tanh = |strength| Spread::TanhLow.by(strength);
        let ground =
            |n| Direction::between(n, 0.0, 2.0, Wall::AT_REST, Wall::Slip).stretched(tanh(1.5));
        let closed = |n| Direction::between(n, 0.0, 2.0, Wall::AT_REST, Wall::AT_REST);
        let meshes = [
            [waves(8), waves(7), waves(9)],
            [sine(8), waves(4), slip(9)],
            [waves(6), slip(8), ground(18)],
            [ground(17), sine(6), closed(16)],
            [slip(5), closed(18), waves(5)],
            [Direction::thin(1.0), sine(12), ground(18)],
        ];
        let both = |[x, y, z]: [Direction; 3]| {
            let mesh = Mesh::new(x, y, z).unwrap();
            [Layout::new(&mesh), Layout::in_order(&mesh, [2, 1, 0])]
        };
        meshes.into_iter().flat_map(both).collect()
    }

    #[test]
    fn the_fast_convection_is_the_literal_one_on_every_kind_of_mesh() {
        for layout in layouts() {
            let [n0, n1, n2] = layout.shape.n;
            let velocity: [Vec<f64>; 3] = std::array::from_fn(|a| {
                let first = layout.line[a].first_face();
                let index = |p: usize| layout.shape.index(p)[a];
                let rough = |p: usize| ((p * p + 17 * a) as f64 * 0.37).sin() + 0.3;
                (0..layout.shape.len())
                    .map(|p| if index(p) < first { 0.0 } else { rough(p) })
                    .collect()
            });
            let velocity = velocity.each_ref().map(Vec::as_slice);
            for a in 0..3 {
                let literal = literal_convection(&layout, velocity, a);
                let largest = literal
                    .iter()
                    .fold(0.0_f64, |most, value| most.max(value.abs()));
                let ops = ComponentOperators::new(&layout, a);
                let mut scratch = Scratch::new(n0);
                for (j, k) in (0..n2).flat_map(|k| (0..n1).map(move |j| (j, k))) {
                    scratch.convection(&ops, velocity, j, k);
                    let mut fresh = Scratch::new(n0);
                    fresh.convection(&ops, velocity, j, k);
                    assert_eq!(
                        fresh.convection, scratch.convection,
                        "fluxes that were kept are those of row {j} {k}"
                    );
                    for (found, expected) in scratch
                        .convection
                        .iter()
                        .zip(&literal[layout.shape.row(j, k)])
                    {
                        let apart = (found - expected).abs();
                        assert!(
                            apart <= 1e-13 * largest,
                            "{:?}, axis {a}, row {j} {k}: {found} {expected}",
                            layout.shape.n
                        );
                    }
                }
            }
        }
    }
}
