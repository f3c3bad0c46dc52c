//! Checks of what is left where a domain is much longer than its cells are high: the residual of
//! both solvers against one that is computed without their operator.

use std::f64::consts::PI;

use super::super::mesh::{Direction, Mesh, Spread, Wall};
use super::*;
use crate::error::{Error, PressureFailure};
use crate::solver::layout::Layout;
use apply::Operator;
use solver::PressureSolver;

fn slip(cells: usize, length_m: f64) -> Direction {
    Direction::between(cells, 0.0, length_m, Wall::Slip, Wall::Slip)
}

fn layout([x, y, z]: [Direction; 3]) -> Layout {
    Layout::new(&Mesh::new(x, y, z).unwrap())
}

/// A balanced right side from a divergence at the places of the cells, as fractions of the three
/// lengths.
fn right_side(layout: &Layout, divergence: impl Fn([f64; 3]) -> f64) -> Vec<f64> {
    let n = layout.shape.n;
    let fraction =
        |p: usize| std::array::from_fn(|b| (layout.shape.index(p)[b] as f64 + 0.5) / n[b] as f64);
    let mut g: Vec<f64> = (0..layout.shape.len())
        .map(|p| divergence(fraction(p)))
        .collect();
    let operator = Operator::new(layout);
    tests::weigh(&operator, &mut g);
    let mut balanced = g.clone();
    operator.copy_balanced(&g, &mut balanced, 0.0).unwrap();
    balanced
}

/// Waves as long as the domain, and some shorter.
fn long_waves(layout: &Layout) -> Vec<f64> {
    right_side(layout, |at| {
        let [a, b, c] = at.map(|s| (PI * s).cos());
        a + b + c + a * b * c + (2.0 * PI * at[2]).cos() * (3.0 * at[0]).sin()
    })
}

/// Values without any order.
fn rough(layout: &Layout) -> Vec<f64> {
    right_side(layout, |at| {
        (12345.6 * at[0] + 2345.6 * at[1] + 5432.1 * at[2]).sin()
    })
}

/// Relative residual by the gradients and divergences of the three directions, one after the other.
fn residual_by_parts(layout: &Layout, g: &[f64], phi: &[f64]) -> f64 {
    let n = layout.shape.n;
    let mut left: Vec<f64> = g.iter().map(|g| -g).collect();
    for (b, stride) in [1, n[0], n[0] * n[1]].into_iter().enumerate() {
        let line = &layout.line[b];
        let gradient = line.gradient();
        let divergence = line.stored_divergence();
        for (p, left) in left.iter_mut().enumerate() {
            let at = layout.shape.index(p);
            let first = p - at[b] * stride;
            let across: f64 = (0..3)
                .filter(|&d| d != b)
                .map(|d| layout.line[d].cell_mass_m[at[d]])
                .product();
            let slope = |face: usize| {
                let own = phi[p];
                gradient[face]
                    .iter()
                    .map(|&(i, c)| c * (phi[first + i * stride] - own))
                    .sum::<f64>()
            };
            let sum: f64 = divergence[at[b]]
                .iter()
                .map(|&(face, c)| c * slope(face))
                .sum();
            *left += across * sum;
        }
    }
    let norm = |field: &[f64]| field.iter().map(|value| value * value).sum::<f64>().sqrt();
    norm(&left) / norm(g)
}

/// Meshes with the ratio of their longest side to their finest cell from 1e2 to 1e7.
fn meshes() -> Vec<(String, Layout)> {
    let mut meshes = Vec::new();
    for wall in [Wall::Slip, Wall::AT_REST] {
        for length_m in [1.0, 1e2, 1e3, 1e4, 1e5] {
            let walls = |length_m| Direction::between(64, 0.0, length_m, wall, wall);
            let plane = [Direction::thin(1.0), walls(length_m), walls(1.0)];
            meshes.push((
                format!("{wall:?}, {length_m:e} times longer than high"),
                layout(plane),
            ));
        }
    }
    let flat = |y: f64, z: f64| [Direction::periodic(16, 0.0, 2.0), slip(64, y), slip(64, z)];
    meshes.push((
        "cells 1e4 times wider than high".into(),
        layout(flat(1e4, 1.0)),
    ));
    meshes.push((
        "cells 1e4 times higher than wide".into(),
        layout(flat(1.0, 1e4)),
    ));
    meshes.push((
        "long along x".into(),
        layout([
            Direction::periodic(16, 0.0, 2e4),
            slip(24, 6.0),
            slip(20, 3.0),
        ]),
    ));
    let sinh = slip(48, 6.0).stretched(Spread::SinhMiddle.by(5.0));
    let tanh = Direction::between(60, 0.0, 3.0, Wall::AT_REST, Wall::Slip)
        .stretched(Spread::TanhLow.by(5.0));
    meshes.push((
        "sinh 5 x tanh 5".into(),
        layout([Direction::periodic(16, 0.0, 2.0), sinh, tanh]),
    ));
    meshes
}

#[test]
fn every_solve_meets_the_tolerance_or_says_that_round_off_forbids_it() {
    let mut met = 0;
    let mut refused = 0;
    for (name, layout) in meshes() {
        for (kind, g) in [("long", long_waves(&layout)), ("rough", rough(&layout))] {
            for method in [PressureMethod::Direct, PressureMethod::Multigrid] {
                let about = format!("{name}, {kind} waves, {method:?}");
                let mut solver = PressureSolver::new(&layout, method);
                let mut phi = g.clone();
                let found = solver.solve(&mut phi, 1e-10);
                let residual = residual_by_parts(&layout, &g, &phi);
                match found {
                    Ok(solved) => {
                        met += 1;
                        assert!(
                            solved.residual <= 1e-10 && residual <= 2e-10,
                            "{about}: {residual:e} {solved:?}"
                        );
                    }
                    Err(Error::PressureNotSolved {
                        reason: PressureFailure::RoundOff { attainable },
                        iterations,
                        history,
                        ..
                    }) => {
                        refused += 1;
                        let last = history.last().copied().unwrap();
                        assert!(
                            iterations.max(history.len()) < 40,
                            "{about}: {iterations}, {history:?}"
                        );
                        assert!(
                            (0.3..3.0).contains(&(residual / last)),
                            "{about}: {residual:e}, told {last:e}"
                        );
                        assert!(
                            residual < 4.0 * attainable,
                            "{about}: {residual:e} of {attainable:e}"
                        );
                        // What is said to be attainable can be had.
                        let possible = (4.0 * attainable).min(0.5);
                        let solved = solver.solve(&mut g.clone(), possible);
                        assert!(solved.is_ok(), "{about}: {solved:?} at {possible:e}");
                    }
                    Err(other) => panic!("{about}: {other}"),
                }
            }
        }
    }
    assert!(met > 20 && refused > 10, "{met} met, {refused} refused");
}

#[test]
fn waves_along_one_direction_alone_leave_round_off_however_long_they_are() {
    for length_m in [1e2, 1e5] {
        let layout = layout([Direction::thin(1.0), slip(64, length_m), slip(64, 1.0)]);
        let along = layout.axis_of(1);
        let g = right_side(&layout, |at| (PI * at[along]).cos());
        let mut phi = g.clone();
        let solved = PressureSolver::new(&layout, PressureMethod::Direct)
            .solve(&mut phi, 1e-10)
            .unwrap();
        assert!(
            residual_by_parts(&layout, &g, &phi) < 1e-10,
            "{length_m:e}: {solved:?}"
        );
    }
}

/// Prints the table of the book with `cargo test -p wakescope-les --lib an_iteration_of_multigrid
/// -- --nocapture`.
/// Meshes with odd sizes, strong stretching and flat cells.
fn demanding_meshes() -> [(&'static str, [Direction; 3]); 8] {
    let sinh = |cells, strength| slip(cells, 6.0).stretched(Spread::SinhMiddle.by(strength));
    let ground = |cells, strength| {
        let wall = Direction::between(cells, 0.0, 3.0, Wall::AT_REST, Wall::Slip);
        wall.stretched(Spread::TanhLow.by(strength))
    };
    let waves = |cells, length_m| Direction::periodic(cells, 0.0, length_m);
    [
        (
            "sinh 5 x tanh 5",
            [waves(16, 2.0), sinh(96, 5.0), ground(120, 5.0)],
        ),
        (
            "sinh 5 x tanh 5",
            [waves(32, 2.0), sinh(128, 5.0), ground(96, 5.0)],
        ),
        (
            "sinh 3 x tanh 3",
            [waves(13, 2.0), sinh(127, 3.0), ground(131, 3.0)],
        ),
        (
            "equal cells",
            [waves(13, 2.0), slip(127, 6.0), slip(131, 3.0)],
        ),
        (
            "uniform x tanh 2, a plane",
            [Direction::thin(1.0), slip(384, 6.0), ground(384, 2.0)],
        ),
        (
            "cells 1e4 wide",
            [waves(16, 2.0), slip(64, 1e4), slip(64, 1.0)],
        ),
        (
            "cells 1e4 high",
            [waves(16, 2.0), slip(64, 1.0), slip(64, 1e4)],
        ),
        (
            "cells 1e4 long",
            [waves(16, 2e4), slip(64, 6.0), slip(64, 3.0)],
        ),
    ]
}

#[test]
fn an_iteration_of_multigrid_gains_a_factor_of_ten_on_odd_sizes_strong_stretching_and_flat_cells() {
    println!("| mesh | right side | tolerance | iterations | factor |");
    for (name, mesh) in demanding_meshes() {
        let is_flat = name.starts_with("cells");
        let layout = layout(mesh);
        let about = format!("{name}, {:?}", layout.shape.n);
        let sides = [
            ("eddies", tests::turbulent_right_side(&layout), 1e-6),
            ("rough", rough(&layout), 1e-6),
            ("long waves", long_waves(&layout), 1e-10),
        ];
        for (kind, g, tolerance) in sides {
            match PressureSolver::new(&layout, PressureMethod::Multigrid)
                .solve(&mut g.clone(), tolerance)
            {
                Ok(solved) => {
                    let n = solved.iterations;
                    let factor = solved.factor.unwrap();
                    println!("| {about} | {kind} | {tolerance:.0e} | {n} | {factor:.3} |");
                    assert!(factor <= 0.1, "{about}, {kind}: {solved:?}");
                }
                Err(Error::PressureNotSolved {
                    reason: PressureFailure::RoundOff { .. },
                    iterations,
                    ..
                }) if is_flat && kind == "long waves" => {
                    println!(
                        "| {about} | {kind} | {tolerance:.0e} | {iterations} | at round-off |"
                    );
                    assert!(iterations <= 20, "{about}, {kind}: {iterations}");
                }
                Err(other) => panic!("{about}, {kind}: {other}"),
            }
        }
    }
}

#[test]
fn a_right_side_that_is_not_finite_is_called_so() {
    let layout = layout([Direction::periodic(8, 0.0, 1.0), slip(8, 1.0), slip(8, 1.0)]);
    for method in [PressureMethod::Direct, PressureMethod::Multigrid] {
        let mut field = rough(&layout);
        field[77] = f64::NAN;
        match PressureSolver::new(&layout, method).solve(&mut field, 1e-6) {
            Err(Error::PressureNotSolved {
                reason: PressureFailure::NotFinite,
                ..
            }) => {}
            other => panic!("{method:?}: {other:?}"),
        }
    }
}
