//! The discrete conservation laws, exact solutions and orders of the time step.

use super::super::mesh::{Direction, Mapping, Mesh, Wall};
use super::super::settings::{FlowSettings, TimeScheme, TimeStep};
use super::*;

fn fixed(viscosity_m2_s: f64, step_s: f64) -> FlowSettings {
    FlowSettings::new(viscosity_m2_s, TimeStep::Fixed { step_s })
}

/// A smooth field without symmetries, to be projected.
fn rough(at_m: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = at_m;
    let wave = |a: f64, b: f64, c: f64, d: f64| (a * x + b * y + c * z + d).sin();
    [
        wave(6.0, 11.0, 7.0, 0.3) + wave(19.0, 3.0, 13.0, 1.0),
        wave(7.0, 5.0, 12.0, 0.9) + wave(3.0, 17.0, 5.0, 2.0),
        wave(11.0, 6.0, 9.0, 1.9) + wave(5.0, 8.0, 15.0, 3.0),
    ]
}

/// Convection of every component of the present field, and what it makes of energy and momentum over sums of moduli.
fn production(flow: &Flow) -> (f64, [f64; 3]) {
    let shape = flow.layout.shape;
    let mut scratch = Scratch::new(shape.n[0]);
    let velocity = flow.state.velocity.each_ref().map(Vec::as_slice);
    let (mut energy, mut energy_moduli) = (0.0, 0.0);
    let mut momentum = [0.0; 3];
    for axis in 0..3 {
        let (mut sum, mut moduli) = (0.0, 0.0);
        for k in 0..shape.n[2] {
            for j in 0..shape.n[1] {
                let ops = &flow.ops[axis];
                if ops.is_wall_row(j, k) {
                    continue;
                }
                scratch.convection(ops, velocity, j, k);
                let (across, along) = ops.row_mass(j, k);
                let own = &velocity[axis][shape.row(j, k)];
                for ((c, m), u) in scratch.convection.iter().zip(along).zip(own) {
                    let force = across * m * c;
                    (energy, energy_moduli) = (energy + force * u, energy_moduli + (force * u).abs());
                    (sum, moduli) = (sum + force, moduli + force.abs());
                }
            }
        }
        momentum[axis] = sum / moduli.max(f64::MIN_POSITIVE);
    }
    (energy / energy_moduli, momentum)
}

#[test]
fn convection_makes_no_energy_and_no_momentum_on_stretched_meshes_with_and_without_walls() {
    let sine = |n, a| Direction::periodic(n, 0.0, 1.0).stretched(Mapping::Sine { amplitude: a });
    let walls = |n, low, high, mapping| Direction::between(n, 0.0, 1.0, low, high).stretched(mapping);
    let tanh = Mapping::TanhBoth { strength: 1.2 };
    let meshes = [
        [sine(16, 0.5), sine(14, 0.4), sine(15, 0.3)],
        [
            sine(12, 0.3),
            walls(15, Wall::Slip, Wall::Slip, tanh.clone()),
            walls(18, Wall::AT_REST, Wall::AT_REST, tanh.clone()),
        ],
        [
            walls(17, Wall::AT_REST, Wall::Slip, Mapping::TanhLow { strength: 1.0 }),
            sine(11, 0.0),
            walls(16, Wall::AT_REST, Wall::AT_REST, Mapping::Uniform),
        ],
        [
            walls(16, Wall::AT_REST, Wall::AT_REST, tanh.clone()),
            walls(16, Wall::AT_REST, Wall::AT_REST, tanh),
            Direction::thin(0.5),
        ],
    ];
    for mesh in meshes {
        let periodic: Vec<bool> = mesh.iter().map(|d| d.ends == Ends::Periodic).collect();
        let [x, y, z] = mesh;
        let (flow, report) = Flow::new(Mesh::new(x, y, z).unwrap(), fixed(1e-3, 1e-3), rough).unwrap();
        assert!(report.kinetic_energy_m5_s2 < report.given_energy_m5_s2);
        let (energy, momentum) = production(&flow);
        assert!(energy.abs() < 1e-14, "energy {energy}");
        for axis in 0..3 {
            // Momentum along a direction between walls is not conserved: the walls push.
            if periodic[flow.layout.direction[axis]] {
                assert!(momentum[axis].abs() < 1e-12, "momentum {momentum:?}");
            }
        }
    }
}

/// The decaying Taylor-Green vortices of a plane, an exact solution.
fn taylor_green(at: (f64, f64), t: f64, nu: f64) -> (f64, f64) {
    use std::f64::consts::TAU;
    let decay = (-2.0 * nu * TAU * TAU * t).exp();
    let (a, b) = (TAU * at.0, TAU * at.1);
    (1.0 + a.sin() * b.cos() * decay, -a.cos() * b.sin() * decay)
}

fn taylor_green_error(n: usize, steps: usize, scheme: TimeScheme) -> f64 {
    let (nu, end) = (0.01, 0.1);
    let stretched = |a| Direction::periodic(n, 0.0, 1.0).stretched(Mapping::Sine { amplitude: a });
    let mesh = Mesh::new(Direction::thin(1.0), stretched(0.4), stretched(-0.3)).unwrap();
    let mut settings = fixed(nu, end / steps as f64);
    settings.scheme = scheme;
    // At rest on average along y: the vortices move with speed 1 there.
    let initial = |at: [f64; 3]| {
        let (v, w) = taylor_green((at[1], at[2]), 0.0, nu);
        [0.0, v - 1.0, w]
    };
    let (mut flow, _) = Flow::new(mesh, settings, initial).unwrap();
    for _ in 0..steps {
        flow.step().unwrap();
    }
    let mut worst = 0.0_f64;
    let axis = flow.layout.axis_of(1);
    for (place, value) in flow.state.velocity[axis].iter().enumerate() {
        let cell = flow.cell(place);
        let y = flow.mesh.directions()[1].at(cell[1] as f64).0;
        let z = flow.mesh.directions()[2].at(cell[2] as f64 + 0.5).0;
        worst = worst.max((value - taylor_green((y, z), end, nu).0 + 1.0).abs());
    }
    worst
}

#[test]
fn taylor_green_vortices_on_a_mesh_stretched_both_ways_converge_with_fourth_order() {
    let coarse = taylor_green_error(48, 100, TimeScheme::RungeKutta3);
    let fine = taylor_green_error(96, 200, TimeScheme::RungeKutta3);
    let order = (coarse / fine).log2();
    assert!(order > 3.9, "errors {coarse}, {fine}: order {order}");
}

#[test]
#[ignore]
fn tmp_timing() {
    let n = 64;
    let case = super::super::cases::taylor_green_3d(n, 1600.0).unwrap();
    let mut flow = Flow::at_rest(case.mesh.clone(), case.settings.clone()).unwrap();
    for a in 0..3 {
        for (i, v) in flow.state.velocity[a].iter_mut().enumerate() {
            *v = ((i * i % 977) as f64 * 0.01).sin();
        }
    }
    let cells = (n * n * n) as f64;
    let time = |name: &str, f: &mut dyn FnMut()| {
        f();
        let mut best = f64::INFINITY;
        for _ in 0..5 {
            let t = std::time::Instant::now();
            f();
            best = best.min(t.elapsed().as_secs_f64());
        }
        println!("{name}: {:.4} us/cell", best * 1e6 / cells);
    };
    time("momentum explicit", &mut || {
        flow.momentum(&Stage { fraction: 1.0, new: 1.5, old: -0.5 }, 1e-3, false);
    });
    let star = flow.work.star.clone();
    let phi = star[0].clone();
    time("divergence", &mut || {
        flow.divergence.apply(star.each_ref().map(Vec::as_slice), 1.0, &mut flow.work.phi);
    });
    time("correct", &mut || {
        correct(
            &flow.ops,
            &flow.layout,
            star.each_ref().map(Vec::as_slice),
            &phi,
            1e-3,
            flow.state.velocity.each_mut().map(Vec::as_mut_slice),
        );
    });
    time("pressure update", &mut || flow.update_pressure());
    flow.state.implicit = [false, false, true];
    time("lines z", &mut || flow.solve_lines(1e-4));
    flow.line_solvers.clear();
    flow.state.implicit = [false, true, false];
    time("lines y", &mut || flow.solve_lines(1e-4));
    flow.line_solvers.clear();
    flow.state.implicit = [true, false, false];
    time("lines x", &mut || flow.solve_lines(1e-4));
}
