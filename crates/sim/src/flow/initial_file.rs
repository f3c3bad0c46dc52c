//! An initial field from a classic NetCDF file, on axes of its own.
//!
//! The file has variables `u`, `v`, `w`, each over three dimensions with a coordinate variable for each, in m/s and m or the units
//! that attributes name; they
//! are found by their names or the attribute `axis`, or else are taken to be z, y, x, the last fastest. Along each direction the values are brought to the faces or centres of the mesh by
//! the cubic through the four nearest nodes, which gives a value at its own node back exactly; periodic directions wrap.
//!
//! Check: a field written by a run reads back to the same values; a smooth field on another mesh with fourth order.

use crate::Error;
use crate::io::netcdf_dimensions::{X, Y, Z};
use crate::io::netcdf_input::{NetcdfFile, open};
use std::ops::Range;
use std::path::Path;
use wakescope_les::solver::Ends;
use wakescope_les::{Direction, Mesh};

/// Largest distance from the last node of a period to the first of the next one, over the largest distance of two nodes.
const MOST_OPEN: f64 = 1.5;

/// A node of the target takes its value from these nodes of the source.
type Taps = Vec<(usize, f64)>;

/// Velocities along x, y, z at the low faces of the cells of `mesh`, `[z][y][x]` \[m/s\].
///
/// # Errors
/// A file that cannot be read, without the variables, or that does not cover the mesh.
pub(super) fn read(path: &Path, mesh: &Mesh) -> Result<[Vec<f64>; 3], Error> {
    let file = open(path)?;
    components(&file, mesh).map_err(|reason| file.refuse(reason))
}

fn components(file: &NetcdfFile, mesh: &Mesh) -> Result<[Vec<f64>; 3], String> {
    let u_m_s = velocity(file, mesh, 0)?;
    let v_m_s = velocity(file, mesh, 1)?;
    let w_m_s = velocity(file, mesh, 2)?;
    Ok([u_m_s, v_m_s, w_m_s])
}

/// One component, brought to the faces of the mesh.
fn velocity(file: &NetcdfFile, mesh: &Mesh, axis: usize) -> Result<Vec<f64>, String> {
    let name = ["u", "v", "w"][axis];
    let dims = axes(file, name)?;
    let mut values = file.velocities(name, &dims, None)?;
    // Values of the directions that are done, which are those of the mesh.
    let mut inner = 1;
    // x is the fastest: direction 0 is the last dimension.
    for (direction, dim) in dims.iter().rev().enumerate() {
        let coordinate_m = file.coordinate_m(dim)?;
        let target_m = if direction == axis {
            mesh.face_m(direction)
        } else {
            mesh.centre_m(direction)
        };
        let along = &mesh.directions()[direction];
        let letter = ["x", "y", "z"][direction];
        let taps = taps(&coordinate_m, &target_m[..along.cells], along)
            .map_err(|e| format!("{letter} of {name}: {e}"))?;
        let count: usize = values.len() / coordinate_m.len().max(1);
        if count * coordinate_m.len() != values.len() {
            return Err(format!("{name} is not of the size of its dimensions"));
        }
        values = apply(&taps, &values, inner, coordinate_m.len());
        inner *= along.cells;
    }
    match values.iter().position(|v| !v.is_finite()) {
        Some(place) => Err(format!(
            "{name} is missing or not finite at the mesh's face {place}"
        )),
        None => Ok(values),
    }
}

/// The dimensions of a component along z, y, x: by what they are for, or three of any name in this order.
fn axes(file: &NetcdfFile, name: &str) -> Result<[String; 3], String> {
    file.roles(name, [Z, Y, X]).or_else(|reason| {
        let mut dims = Vec::new();
        for dim in file.dims(name).unwrap_or_default() {
            // Names that say something else must not be taken for what they are not.
            if dim.starts_with(['x', 'y', 'z', 'X', 'Y', 'Z']) {
                return Err(reason);
            }
            dims.push(dim.to_owned());
        }
        dims.try_into().map_err(|_| reason)
    })
}

/// Sums along one direction: `[slower][n][inner]` becomes `[slower][taps][inner]`.
fn apply(taps: &[Taps], values: &[f64], inner: usize, n: usize) -> Vec<f64> {
    let mut out = Vec::with_capacity(values.len() / n * taps.len());
    for block in values.chunks_exact(n * inner) {
        for row in taps {
            let start = out.len();
            out.resize(start + inner, 0.0);
            for &(node, weight) in row {
                for (out, value) in out[start..]
                    .iter_mut()
                    .zip(&block[node * inner..(node + 1) * inner])
                {
                    *out += weight * value;
                }
            }
        }
    }
    out
}

/// The cubic through the four source nodes nearest to each target.
fn taps(source_m: &[f64], target_m: &[f64], along: &Direction) -> Result<Vec<Taps>, String> {
    let n = source_m.len();
    if n == 1 {
        return Ok(vec![vec![(0, 1.0)]; target_m.len()]);
    }
    if !source_m.windows(2).all(|w| w[1] > w[0]) {
        return Err("the coordinates must increase".into());
    }
    let periodic = along.ends == Ends::Periodic;
    let period_m = along.length_m();
    let slack_m = source_m[1] - source_m[0];
    let last_m = source_m[n - 1];
    if periodic && last_m - source_m[0] > period_m * (1.0 - 1e-9) {
        return Err(format!(
            "{n} nodes span {} m: a period of {period_m} m has no node twice",
            last_m - source_m[0]
        ));
    }
    if periodic {
        check_closes(source_m, period_m)?;
    }
    let count = n.min(4);
    let mut all = Vec::with_capacity(target_m.len());
    for target_m in target_m {
        let x_m = if periodic {
            source_m[0] + (target_m - source_m[0]).rem_euclid(period_m)
        } else {
            *target_m
        };
        let outside = x_m < source_m[0] - slack_m || x_m > last_m + (last_m - source_m[n - 2]);
        if !periodic && outside {
            return Err(format!(
                "{x_m} m of the mesh is not covered by {} to {last_m} m",
                source_m[0]
            ));
        }
        let below = source_m.partition_point(|&s| s <= x_m) as isize - 1;
        let first = if periodic {
            below - 1
        } else {
            (below - 1).clamp(0, (n - count) as isize)
        };
        all.push(cubic(
            source_m,
            period_m,
            first..first + count as isize,
            x_m,
        ));
    }
    Ok(all)
}

/// Refuses two or more nodes that leave a part of a period uncovered, across which the cubic would not be that of the field.
fn check_closes(source_m: &[f64], period_m: f64) -> Result<(), String> {
    let (Some(first_m), Some(last_m)) = (source_m.first(), source_m.last()) else {
        return Ok(());
    };
    let distances = source_m.windows(2).map(|pair| pair[1] - pair[0]);
    let largest_m = distances.fold(0.0, f64::max);
    let gap_m = period_m - (last_m - first_m);
    match gap_m > MOST_OPEN * largest_m {
        true => Err(format!(
            "the period of {period_m} m of the mesh is not covered by {first_m} to {last_m} m: from the last node to the first of the \
             next period are {gap_m} m, at most {} m are allowed, {MOST_OPEN} times the largest distance of two nodes",
            MOST_OPEN * largest_m
        )),
        false => Ok(()),
    }
}

/// Weights at a position of the polynomial through some nodes, which go on with the period (Lagrange).
fn cubic(source_m: &[f64], period_m: f64, nodes: Range<isize>, x_m: f64) -> Taps {
    let n = source_m.len() as isize;
    let mut nodes_m = Vec::with_capacity(nodes.len());
    for node in nodes.clone() {
        let turns = node.div_euclid(n) as f64;
        nodes_m.push(source_m[node.rem_euclid(n) as usize] + period_m * turns);
    }
    let mut taps = Vec::with_capacity(nodes_m.len());
    for (i, node) in nodes.enumerate() {
        let mut weight = 1.0;
        for (j, other_m) in nodes_m.iter().enumerate() {
            if i != j {
                weight *= (x_m - other_m) / (nodes_m[i] - other_m);
            }
        }
        if weight != 0.0 {
            taps.push((node.rem_euclid(n) as usize, weight));
        }
    }
    taps
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cubics_come_back_exactly_and_nodes_keep_their_values() {
        let cubic = |x: f64| 1.0 - x + 2.0 * x * x - 0.7 * x.powi(3);
        let source_m = [0.0, 0.1, 0.25, 0.5, 0.8, 1.0];
        let bounded = Direction::between(
            8,
            0.0,
            1.0,
            wakescope_les::Wall::Slip,
            wakescope_les::Wall::Slip,
        );
        let target_m = [0.0, 0.05, 0.3, 0.5, 0.99, 1.0];
        for (row, x) in taps(&source_m, &target_m, &bounded)
            .unwrap()
            .iter()
            .zip(target_m)
        {
            let found: f64 = row.iter().map(|&(i, w)| w * cubic(source_m[i])).sum();
            assert!((found - cubic(x)).abs() < 1e-14, "{x}");
            if source_m.contains(&x) {
                assert_eq!(row.len(), 1, "{x} is a node");
            }
        }
    }

    #[test]
    fn periodic_directions_wrap_with_fourth_order() {
        let along = Direction::periodic(8, 0.0, 1.0);
        let error = |n: usize| {
            let source_m: Vec<f64> = (0..n).map(|i| (i as f64 + 0.5) / n as f64).collect();
            let target_m: Vec<f64> = (0..100).map(|i| 0.01 * f64::from(i)).collect();
            let wave = |x: f64| (std::f64::consts::TAU * x).sin();
            let taps = taps(&source_m, &target_m, &along).unwrap();
            let found = taps
                .iter()
                .map(|row| row.iter().map(|&(i, w)| w * wave(source_m[i])).sum::<f64>());
            found
                .zip(&target_m)
                .map(|(f, x)| (f - wave(*x)).abs())
                .fold(0.0, f64::max)
        };
        assert!((error(16) / error(32)).log2() > 3.7);
    }

    #[test]
    fn a_source_that_does_not_cover_the_mesh_is_refused() {
        let bounded = Direction::between(
            8,
            0.0,
            1.0,
            wakescope_les::Wall::Slip,
            wakescope_les::Wall::Slip,
        );
        assert!(
            taps(&[0.0, 0.2, 0.4], &[0.7], &bounded)
                .unwrap_err()
                .contains("0.7")
        );
        assert!(
            taps(&[0.0, 0.2, 0.1], &[0.1], &bounded)
                .unwrap_err()
                .contains("increase")
        );
        assert!(
            taps(&[0.0, 0.5, 1.0], &[0.1], &Direction::periodic(8, 0.0, 1.0))
                .unwrap_err()
                .contains("twice")
        );
        // A file of half a period, one whose closing cell is twice the others, and one where it is a little wider.
        let along = Direction::periodic(8, 0.0, 200.0);
        let half_m: Vec<f64> = (0..50).map(|i| 1.0 + 2.0 * f64::from(i)).collect();
        let refused = taps(&half_m, &[150.0], &along).unwrap_err();
        assert!(refused.contains("not covered by 1 to 99 m"), "{refused}");
        assert!(refused.contains("102 m, at most 3 m"), "{refused}");
        let along = Direction::periodic(8, 0.0, 8.0);
        assert!(taps(&[0.0, 2.0, 4.0], &[1.0], &along).is_err());
        assert!(taps(&[0.0, 2.5, 5.0], &[1.0], &along).is_ok());
    }
}
