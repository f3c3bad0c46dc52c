//! Checks that concern all solvers: residuals on the meshes of the table, null space, threads.

use super::super::layout::{Layout, Shape};
use super::super::mesh::{Direction, Mapping, Mesh, Spread, Wall};
use super::*;
use crate::error::{Error, PressureFailure};
use apply::Operator;
use rayon::prelude::*;

/// 2-norm of the residual over that of the right side `g`.
fn relative_residual(operator: &Operator, g: &[f64], phi: &[f64]) -> Result<f64, Error> {
    let left = operator.residual_norm(g, phi)?;
    let size = norm(&operator.slabs, g)?;
    Ok(if size > 0.0 { left / size } else { 0.0 })
}

/// Multiplies each value by the mass of its cell.
pub(super) fn weigh(operator: &Operator, field: &mut [f64]) {
    operator.each_mass(field, 1.0, |value, mass| *value *= mass);
}

/// The weighted divergence of a flow with eddies of all sizes and one per cent of noise at the grid
/// scale: what the time step asks the solvers for.
pub(super) fn turbulent_right_side(layout: &Layout) -> Vec<f64> {
    let shape = layout.shape;
    let n = shape.n;
    let mut g = vec![0.0; shape.len()];
    for b in 0..3 {
        let divergence = layout.line[b].stored_divergence();
        let velocity = eddies(shape, b);
        let mass = |d: usize, i: usize| {
            if d == b {
                1.0
            } else {
                layout.line[d].cell_mass_m[i]
            }
        };
        g.par_chunks_mut(n[0]).enumerate().for_each(|(r, row)| {
            let j = r % n[1];
            let k = r / n[1];
            for (i, g) in row.iter_mut().enumerate() {
                let at = [i, j, k];
                let stride = [1, n[0], n[0] * n[1]][b];
                let line = (k * n[1] + j) * n[0] + i - at[b] * stride;
                let sum: f64 = divergence[at[b]]
                    .iter()
                    .map(|&(face, c)| c * velocity[line + face * stride])
                    .sum();
                *g += mass(0, i) * mass(1, j) * mass(2, k) * sum;
            }
        });
    }
    g
}

/// Velocity along axis `b`: five octaves of `k^-5/3`, and noise.
fn eddies(shape: Shape, b: usize) -> Vec<f64> {
    use std::f64::consts::TAU;
    let n = shape.n;
    let wave = |d: usize, octave: usize| -> Vec<f64> {
        let k = f64::from(1 << octave);
        let angle = |i: usize| {
            TAU * k * i as f64 / n[d] as f64 + 1.7 * (b + octave) as f64 + 0.9 * d as f64
        };
        (0..n[d])
            .map(|i| k.powf(-1.0 / 9.0) * angle(i).sin())
            .collect()
    };
    let waves: Vec<[Vec<f64>; 3]> = (0..5)
        .map(|octave| std::array::from_fn(|d| wave(d, octave)))
        .collect();
    let mut velocity = vec![0.0; shape.len()];
    velocity
        .par_chunks_mut(n[0])
        .enumerate()
        .for_each(|(r, row)| {
            let j = r % n[1];
            let k = r / n[1];
            for (i, velocity) in row.iter_mut().enumerate() {
                let hash =
                    (i * 73_856_093 + j * 19_349_663 + k * 83_492_791 + b * 2_654_435) % 1_000_003;
                let eddies: f64 = waves.iter().map(|[x, y, z]| x[i] * y[j] * z[k]).sum();
                *velocity = eddies + 0.01 * (hash as f64 / 500_001.5 - 1.0);
            }
        });
    velocity
}

/// Equal cells, periodic.
fn waves(n: usize) -> Direction {
    Direction::periodic(n, 0.0, 2.0)
}

fn slip(n: usize) -> Direction {
    Direction::between(n, -3.0, 3.0, Wall::Slip, Wall::Slip)
}

/// No-slip below, slip above.
fn ground(n: usize) -> Direction {
    Direction::between(n, 0.0, 3.0, Wall::AT_REST, Wall::Slip)
}

fn closed(n: usize) -> Direction {
    Direction::between(n, 0.0, 2.0, Wall::AT_REST, Wall::AT_REST)
}

fn sinh(strength: f64) -> Mapping {
    Spread::SinhMiddle.by(strength)
}

fn tanh(strength: f64) -> Mapping {
    Spread::TanhLow.by(strength)
}

/// Name, directions and largest residual.
type NamedMesh = (&'static str, [Direction; 3], f64);

/// Meshes of all kinds with the residual that one solve may leave.
fn meshes() -> Vec<NamedMesh> {
    let sine = || Spread::Sine.by(0.6);
    let mut meshes = vec![
        ("uniform", [waves(32), slip(48), ground(40)], 1e-12),
        (
            "aspect 144",
            [
                waves(32),
                slip(64).stretched(sinh(3.0)),
                ground(48).stretched(tanh(3.0)),
            ],
            1e-12,
        ),
        (
            "aspect 1e4",
            [
                waves(32),
                slip(128).stretched(sinh(5.0)),
                ground(96).stretched(tanh(5.0)),
            ],
            1e-11,
        ),
        (
            "prime",
            [
                waves(97),
                slip(61).stretched(sinh(3.0)),
                ground(53).stretched(tanh(3.0)),
            ],
            1e-12,
        ),
        ("all periodic", [waves(16), waves(12), waves(10)], 1e-12),
        (
            "all periodic and stretched",
            [
                waves(17).stretched(sine()),
                waves(19).stretched(sine()),
                waves(23).stretched(sine()),
            ],
            1e-12,
        ),
        (
            "closed box",
            [
                closed(20),
                closed(17),
                closed(24).stretched(Spread::TanhBoth.by(2.0)),
            ],
            1e-12,
        ),
        (
            "long axis 1",
            [slip(12), ground(60).stretched(tanh(2.0)), slip(20)],
            1e-12,
        ),
    ];
    meshes.extend(meshes_of_extreme_sizes());
    meshes.extend(meshes_with_thin_directions());
    meshes
}

fn meshes_of_extreme_sizes() -> Vec<NamedMesh> {
    vec![
        ("smallest", [waves(4), slip(4), ground(12)], 1e-12),
        (
            "nanometres",
            [
                Direction::periodic(16, 0.0, 2e-9),
                Direction::between(16, 0.0, 1e-9, Wall::Slip, Wall::Slip),
                Direction::periodic(16, 0.0, 3e-9),
            ],
            1e-12,
        ),
    ]
}

fn meshes_with_thin_directions() -> Vec<NamedMesh> {
    let thin = || Direction::thin(1.0);
    vec![
        (
            "one cell in x, y long",
            [thin(), waves(48), ground(40).stretched(tanh(3.0))],
            1e-12,
        ),
        (
            "one cell in x, z long",
            [thin(), slip(40), closed(64)],
            1e-12,
        ),
        ("one cell in y", [waves(36), thin(), ground(32)], 1e-12),
        ("one cell in z", [closed(24), slip(32), thin()], 1e-12),
        (
            "one cell in z, periodic",
            [waves(24), waves(33), thin()],
            1e-12,
        ),
        ("cells in x only", [closed(40), thin(), thin()], 1e-12),
        ("cells in z only", [thin(), thin(), ground(40)], 1e-12),
        ("one cell", [thin(), thin(), thin()], 1e-12),
    ]
}

fn layout([x, y, z]: [Direction; 3]) -> Layout {
    Layout::new(&Mesh::new(x, y, z).unwrap())
}

fn mean_of(layout: &Layout, phi: &[f64]) -> f64 {
    let operator = Operator::new(layout);
    let mut weighted = phi.to_vec();
    weigh(&operator, &mut weighted);
    weighted.iter().sum::<f64>()
        / weighted
            .iter()
            .map(|value| value.abs())
            .sum::<f64>()
            .max(f64::MIN_POSITIVE)
}

#[test]
fn the_direct_solver_leaves_round_off_on_every_mesh() {
    for (name, directions, allowed) in meshes() {
        let layout = layout(directions);
        let operator = Operator::new(&layout);
        let mut solver = PressureSolver::new(&layout, PressureMethod::Direct);
        let g = turbulent_right_side(&layout);
        let mut phi = g.clone();
        solver.solve(&mut phi, 1e-6).unwrap();
        let residual = relative_residual(&operator, &g, &phi).unwrap();
        assert!(residual <= allowed, "{name}: residual {residual:e}");
        let moduli: f64 = g.iter().map(|g| g.abs()).sum();
        assert!(kernel::sum(&g).abs() <= 1e-14 * moduli, "{name}");
        let mean = mean_of(&layout, &phi);
        assert!(mean.abs() <= 1e-13, "{name}: mean {mean:e}");
    }
}

#[test]
fn the_operator_is_symmetric_and_ignores_constants() {
    for (name, directions, _) in meshes() {
        let layout = layout(directions);
        if layout.shape.len() > 50_000 {
            continue;
        }
        let operator = Operator::new(&layout);
        let apply = |phi: &[f64]| {
            let mut out = vec![0.0; phi.len()];
            operator.residual(&vec![0.0; phi.len()], phi, &mut out);
            out
        };
        let wave = |f: f64| {
            (0..layout.shape.len())
                .map(|p| (p as f64 * f).sin())
                .collect::<Vec<f64>>()
        };
        let a = wave(0.7);
        let b = wave(1.3);
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let ab = dot(&a, &apply(&b));
        let ba = dot(&b, &apply(&a));
        let aa = dot(&a, &apply(&a));
        assert!(
            (ab - ba).abs() <= 1e-12 * aa.abs(),
            "{name}: {ab} against {ba}"
        );
        let flat = apply(&vec![1.0; a.len()])
            .iter()
            .fold(0.0_f64, |m, v| m.max(v.abs()));
        let rough = apply(&a).iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        assert!(flat <= 1e-13 * rough, "{name}: {flat:e} of {rough:e}");
    }
}

#[test]
fn the_operator_is_the_divergence_of_the_gradient() {
    let layout = layout([
        waves(8).stretched(Spread::Sine.by(0.4)),
        slip(7),
        ground(13).stretched(tanh(1.0)),
    ]);
    let [n0, n1, n2] = layout.shape.n;
    let phi: Vec<f64> = (0..layout.shape.len())
        .map(|p| (p as f64 * 0.37).sin())
        .collect();
    let mut expected = vec![0.0; phi.len()];
    for (b, stride) in [1, n0, n0 * n1].into_iter().enumerate() {
        let gradient = layout.line[b].gradient();
        let divergence = layout.line[b].stored_divergence();
        for (p, expected) in expected.iter_mut().enumerate() {
            let at = layout.shape.index(p);
            let first = p - at[b] * stride;
            let slope = |face: usize| {
                gradient[face]
                    .iter()
                    .map(|(i, c)| c * phi[first + i * stride])
                    .sum::<f64>()
            };
            let sum: f64 = divergence[at[b]]
                .iter()
                .map(|&(face, c)| c * slope(face))
                .sum();
            *expected += sum * mass_of(&layout, at) / layout.line[b].cell_mass_m[at[b]];
        }
    }
    assert_eq!(n0 * n1 * n2, expected.len());
    let mut found = vec![0.0; phi.len()];
    Operator::new(&layout).residual(&vec![0.0; phi.len()], &phi, &mut found);
    let largest = expected.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    for (a, b) in found.iter().zip(&expected) {
        assert!((a - b).abs() < 1e-14 * largest, "{a} {b}");
    }
}

fn mass_of(layout: &Layout, at: [usize; 3]) -> f64 {
    (0..3).map(|b| layout.line[b].cell_mass_m[at[b]]).product()
}

#[test]
fn refinement_reaches_what_one_solve_does_not_and_says_where_it_ends() {
    let layout = layout([
        waves(16),
        slip(64).stretched(sinh(5.0)),
        ground(64).stretched(tanh(5.0)),
    ]);
    let mut solver = PressureSolver::new(&layout, PressureMethod::Direct);
    let operator = Operator::new(&layout);
    let g = turbulent_right_side(&layout);
    let mut once = g.clone();
    solver.solve(&mut once, 1e-6).unwrap();
    let once = relative_residual(&operator, &g, &once).unwrap();
    let mut phi = g.clone();
    let solved = solver.solve(&mut phi, 0.5 * once).unwrap();
    let refined = relative_residual(&operator, &g, &phi).unwrap();
    assert!(
        refined < 0.5 * once && (solved.residual / refined - 1.0).abs() < 0.2,
        "{once:e} {refined:e}"
    );
    match solver.solve(&mut g.clone(), 1e-17).unwrap_err() {
        Error::PressureNotSolved {
            history, tolerance, ..
        } => {
            assert!(history.len() > 1 && tolerance == 1e-17, "{history:?}");
        }
        other => panic!("{other}"),
    }
}

#[test]
fn what_no_pressure_balances_is_removed() {
    for directions in [
        [waves(16), slip(12), ground(14)],
        [slip(8), ground(40), closed(20)],
        [waves(8), waves(6), waves(5)],
    ] {
        let layout = layout(directions);
        let operator = Operator::new(&layout);
        let mut solver = PressureSolver::new(&layout, PressureMethod::Direct);
        let balanced = turbulent_right_side(&layout);
        let mut mass = vec![1.0; balanced.len()];
        weigh(&operator, &mut mass);
        let moduli: f64 = balanced.iter().map(|g| g.abs()).sum();
        let excess = 0.1 * moduli / mass.iter().sum::<f64>();
        let mut phi: Vec<f64> = balanced
            .iter()
            .zip(&mass)
            .map(|(g, m)| g + excess * m)
            .collect();
        let mut copy = phi.clone();
        operator.copy_balanced(&phi, &mut copy, 1e-8).unwrap();
        let left = copy.iter().sum::<f64>() / moduli;
        let removed = phi
            .iter()
            .zip(&copy)
            .map(|(phi, copy)| phi - copy)
            .sum::<f64>()
            / moduli;
        assert!(
            left.abs() < 1e-12 && (removed - 0.1).abs() < 1e-12,
            "{left:e} {removed}"
        );
        solver.solve(&mut phi, 1e-6).unwrap();
        let residual = relative_residual(&operator, &balanced, &phi).unwrap();
        assert!(residual < 1e-12, "{residual:e}");
    }
}

/// The field that `method` finds with a number of threads.
fn with_threads(layout: &Layout, method: PressureMethod, threads: usize) -> Vec<f64> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap();
    pool.install(|| {
        let mut phi = turbulent_right_side(layout);
        PressureSolver::new(layout, method)
            .solve(&mut phi, 1e-8)
            .unwrap();
        phi
    })
}

#[test]
fn every_number_of_threads_gives_the_same_bits() {
    for directions in [
        [waves(24), slip(20), ground(37).stretched(tanh(3.0))],
        [waves(40), Direction::thin(1.0), ground(32)],
        [closed(18), ground(40), waves(9)],
    ] {
        let layout = layout(directions);
        for method in [PressureMethod::Direct, PressureMethod::Multigrid] {
            let reference = with_threads(&layout, method, 1);
            for threads in [2, 7] {
                assert!(
                    with_threads(&layout, method, threads) == reference,
                    "{method:?}, {threads} threads"
                );
            }
        }
    }
}

#[test]
fn a_scale_of_the_mesh_scales_the_solution() {
    let scaled = |size: f64, method: PressureMethod| {
        let d = |n: usize, length: f64| {
            Direction::between(n, 0.0, size * length, Wall::AT_REST, Wall::Slip)
        };
        let layout = layout([
            Direction::periodic(16, 0.0, size),
            d(20, 1.0),
            d(24, 2.0).stretched(tanh(3.0)),
        ]);
        let mut phi = turbulent_right_side(&layout);
        PressureSolver::new(&layout, method)
            .solve(&mut phi, 1e-8)
            .unwrap();
        phi
    };
    for method in [PressureMethod::Direct, PressureMethod::Multigrid] {
        let reference = scaled(1.0, method);
        let largest = reference.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        for size in [1e-9, 1e9] {
            // The right side is a flux, in m^2 times the velocity; phi then grows with the length.
            for (a, b) in scaled(size, method).iter().zip(&reference) {
                assert!(
                    (a / size - b).abs() < 1e-12 * largest,
                    "{method:?} {size:e}"
                );
            }
        }
    }
}

#[test]
fn tolerances_that_make_no_sense_are_refused() {
    let layout = layout([waves(8), waves(8), waves(8)]);
    let mut solver = PressureSolver::new(&layout, PressureMethod::Auto);
    for tolerance in [0.0, 1.0, f64::NAN] {
        assert!(
            solver
                .solve(&mut [0.0; 512], tolerance)
                .unwrap_err()
                .to_string()
                .contains("tolerance")
        );
    }
    let mut still = [0.0; 512];
    solver.solve(&mut still, 1e-16).unwrap();
    assert!(still.iter().all(|phi| *phi == 0.0));
}

#[test]
fn multigrid_agrees_with_the_direct_solver_and_converges_as_fast_on_every_mesh() {
    for (name, directions, _) in meshes() {
        let layout = layout(directions);
        let operator = Operator::new(&layout);
        let g = turbulent_right_side(&layout);
        let mut multigrid = PressureSolver::new(&layout, PressureMethod::Multigrid);
        let mut phi = g.clone();
        let solved = multigrid.solve(&mut phi, 1e-6).unwrap();
        let factor = solved.factor.unwrap_or(0.0);
        let residual = relative_residual(&operator, &g, &phi).unwrap();
        let found = format!(
            "{name}: {} iterations, factor {factor:.3}, residual {residual:.1e}",
            solved.iterations
        );
        assert!(
            residual <= 1e-6 && (solved.residual - residual).abs() <= 1e-6 * residual + 1e-14,
            "{found}"
        );
        assert!(solved.iterations <= 6 && factor <= 0.1, "{found}");
        let mut phi = g.clone();
        multigrid.solve(&mut phi, 1e-10).unwrap();
        let mean = mean_of(&layout, &phi);
        assert!(mean.abs() <= 1e-12, "{name}: mean {mean:e}");
        let mut exact = g;
        PressureSolver::new(&layout, PressureMethod::Direct)
            .solve(&mut exact, 1e-6)
            .unwrap();
        let largest = exact.iter().fold(0.0_f64, |m, phi| m.max(phi.abs()));
        let apart = exact
            .iter()
            .zip(&phi)
            .fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
        assert!(
            apart <= 3e-10 * largest,
            "{name}: the fields differ by {apart:e} of {largest:e}"
        );
    }
}

#[test]
fn multigrid_that_cannot_reach_the_tolerance_tells_its_history() {
    let layout = layout([waves(16), slip(20), ground(24).stretched(tanh(3.0))]);
    match PressureSolver::new(&layout, PressureMethod::Multigrid)
        .solve(&mut turbulent_right_side(&layout), 1e-17)
        .unwrap_err()
    {
        Error::PressureNotSolved {
            iterations,
            history,
            method,
            ..
        } => {
            assert_eq!(method, "multigrid");
            let least = history.iter().copied().fold(1.0, f64::min);
            assert!(
                iterations > 10 && history.len() > 1 && least < 1e-13,
                "{iterations}, {history:?}"
            );
        }
        other => panic!("{other}"),
    }
    let mut field = turbulent_right_side(&layout);
    field[77] = f64::NAN;
    let refused = PressureSolver::new(&layout, PressureMethod::Multigrid)
        .solve(&mut field, 1e-6)
        .unwrap_err();
    assert!(
        matches!(
            refused,
            Error::PressureNotSolved {
                reason: PressureFailure::NotFinite,
                ..
            }
        ),
        "{refused}"
    );
}
