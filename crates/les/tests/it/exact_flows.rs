//! Flows with exact solutions: plates, Taylor and Green's vortices, waves of Tollmien and Schlichting.

use std::f64::consts::{PI, TAU};

use wakescope_les::cases::{self, Case, TollmienSchlichting};
use wakescope_les::{Direction, Flow, FlowSettings, Mapping, Mesh, Spread, TimeScheme, TimeStep};

fn run(case: &Case, steps: usize) -> Flow {
    let (mut flow, _) = case.start().unwrap();
    for _ in 0..steps {
        flow.step().unwrap();
    }
    flow
}

/// Largest error of the velocity along x against a profile over z.
fn profile_error(flow: &Flow, exact: impl Fn(f64) -> f64) -> f64 {
    let [nx, ny, _] = flow.mesh().cells();
    let z_m = flow.mesh().centre_m(2);
    let u = flow.face_velocity_m_s(0);
    u.iter()
        .enumerate()
        .map(|(i, u)| (u - exact(z_m[i / (nx * ny)])).abs())
        .fold(0.0, f64::max)
}

#[test]
fn poiseuilles_parabola_and_couettes_line_are_steady_to_round_off_on_equal_cells() {
    let poiseuille = run(
        &cases::Plates {
            cells: 24,
            strength: 0.0,
            viscosity_m2_s: 0.1,
            step_s: 0.05,
        }
        .poiseuille(1.0)
        .unwrap(),
        200,
    );
    let error = profile_error(&poiseuille, |z| 1.0 - z * z);
    assert!(error < 1e-12, "Poiseuille {error}");
    let couette = run(
        &cases::Plates {
            cells: 24,
            strength: 0.0,
            viscosity_m2_s: 0.1,
            step_s: 0.05,
        }
        .couette(1.0)
        .unwrap(),
        200,
    );
    let error = profile_error(&couette, |z| z);
    assert!(error < 1e-12, "Couette {error}");
}

#[test]
fn plates_drag_a_fluid_at_rest_to_the_steady_profile() {
    let error = |flow: &Flow, exact: fn(f64) -> f64| profile_error(flow, exact);
    let couette = run(
        &cases::Plates {
            cells: 32,
            strength: 1.5,
            viscosity_m2_s: 0.1,
            step_s: 0.2,
        }
        .couette(0.0)
        .unwrap(),
        1000,
    );
    assert!(
        error(&couette, |z| z) < 5e-5,
        "Couette {}",
        error(&couette, |z| z)
    );
    let poiseuille = run(
        &cases::Plates {
            cells: 32,
            strength: 1.5,
            viscosity_m2_s: 0.1,
            step_s: 0.2,
        }
        .poiseuille(0.0)
        .unwrap(),
        1000,
    );
    let found = error(&poiseuille, |z| 1.0 - z * z);
    assert!(found < 5e-5, "Poiseuille {found}");
}

#[test]
fn a_layer_between_plates_decays_with_third_order_in_space_and_second_in_time() {
    let nu = 0.1;
    let error = |cells: usize, step_s: f64| {
        let case = cases::Plates {
            cells,
            strength: 1.5,
            viscosity_m2_s: nu,
            step_s,
        }
        .decaying_layer()
        .unwrap();
        let steps = (2.0 / step_s).round() as usize;
        let flow = run(&case, steps);
        profile_error(&flow, |z| {
            (0.5 * PI * z).cos() * (-nu * PI * PI / 4.0 * 2.0).exp()
        })
    };
    let order = (error(16, 1e-3) / error(32, 1e-3)).log2();
    assert!(order > 2.8, "in space: {order}");
    // The error of the finest mesh is far below those of the long steps.
    let order = (error(128, 0.1) / error(128, 0.05)).log2();
    assert!((order - 2.0).abs() < 0.1, "in time: {order}");
}

#[test]
fn an_impulsively_started_plate_is_followed_at_any_viscous_number() {
    // nu dt/h^2 reaches 1e4 at the wall; the ringing of Crank and Nicolson's scheme must decay, nothing may blow up.
    let plain = cases::Plates {
        cells: 64,
        strength: 2.5,
        viscosity_m2_s: 1.0,
        step_s: 0.01,
    }
    .rayleigh_plate()
    .unwrap();
    // After four viscous times the profile is Couette's: 1 at z = -1, 0 at z = 1.
    let off = |case: &Case, steps: usize| profile_error(&run(case, steps), |z| 0.5 * (1.0 - z));
    // Crank and Nicolson's scheme turns the sign of the stiffest wave in every step and takes off 4/(nu dt k^2) of it: by 3600
    // steps at the 1.2e4 of the cell at the wall to about a third.
    let (early, late) = (off(&plain, 400), off(&plain, 4000));
    assert!(
        early < 1.0 && (0.1..0.7).contains(&(late / early)),
        "{early} {late}"
    );
    let nu = 0.01;
    let flow = run(
        &cases::Plates {
            cells: 96,
            strength: 2.0,
            viscosity_m2_s: nu,
            step_s: 0.002,
        }
        .rayleigh_plate()
        .unwrap(),
        1000,
    );
    let error = profile_error(&flow, |z| erfc((z + 1.0) / (2.0 * (nu * 2.0).sqrt())));
    assert!(error < 2e-3, "{error}");
}

/// Complementary error function by its continued fraction and series, good to 1e-12.
fn erfc(x: f64) -> f64 {
    if x < 2.0 {
        let (mut term, mut sum, mut n) = (x, x, 0.0);
        while term.abs() > 1e-17 {
            n += 1.0;
            term *= -x * x / n;
            sum += term / (2.0 * n + 1.0);
        }
        1.0 - 2.0 / PI.sqrt() * sum
    } else {
        let fraction = (1..200)
            .rev()
            .fold(0.0, |tail, n| 0.5 * f64::from(n) / (x + tail));
        (-x * x).exp() / PI.sqrt() / (x + fraction)
    }
}

fn plane_error(flow: &Flow, nu: f64) -> f64 {
    let (y_m, z_m) = (flow.mesh().face_m(1), flow.mesh().centre_m(2));
    let ny = y_m.len() - 1;
    let exact = |place: usize| {
        cases::taylor_green_plane_exact([0.0, y_m[place % ny], z_m[place / ny]], flow.time_s(), nu)
            [1]
    };
    flow.face_velocity_m_s(1)
        .iter()
        .enumerate()
        .map(|(i, v)| (v - exact(i)).abs())
        .fold(0.0, f64::max)
}

#[test]
fn plane_vortices_converge_with_fourth_order_on_a_mesh_stretched_both_ways() {
    let nu = 0.01;
    let error = |n: usize, step_s: f64, steps: usize| {
        let mut case = cases::taylor_green_plane(n, [0.5, -0.4], nu, step_s).unwrap();
        case.settings.scheme = TimeScheme::RungeKutta3;
        plane_error(&run(&case, steps), nu)
    };
    let order = (error(64, 2e-3, 50) / error(128, 5e-4, 200)).log2();
    assert!(order > 3.9, "order {order}");
}

#[test]
fn plane_vortices_converge_with_fourth_order_on_periodic_directions_refined_about_a_place() {
    let nu = 0.01;
    let error = |n: usize, step_s: f64, steps: usize| {
        let mut case = cases::taylor_green_plane(n, [0.0; 2], nu, step_s).unwrap();
        let cluster = |strength, place| Mapping {
            place,
            ..Spread::Cluster.by(strength)
        };
        let [x, y, z] = case.mesh.directions().clone();
        case.mesh = Mesh::new(
            x,
            y.stretched(cluster(0.5, 0.5)),
            z.stretched(cluster(0.4, 0.15)),
        )
        .unwrap();
        case.settings.scheme = TimeScheme::RungeKutta3;
        plane_error(&run(&case, steps), nu)
    };
    let order = (error(64, 2e-3, 50) / error(128, 5e-4, 200)).log2();
    assert!(order > 3.9, "order {order}");
}

#[test]
fn both_schemes_are_of_second_order_in_time() {
    // Vortices that a mean flow carries along: the convection then has to follow in time.
    let mesh = || {
        Mesh::new(
            Direction::thin(1.0),
            Direction::periodic(32, 0.0, 1.0),
            Direction::periodic(32, 0.0, 1.0),
        )
        .unwrap()
    };
    let velocity = |scheme: TimeScheme, steps: usize, nu: f64| {
        let mut settings = FlowSettings::new(
            nu,
            TimeStep::Fixed {
                step_s: 0.2 / steps as f64,
            },
        );
        settings.scheme = scheme;
        let initial = |at_m: [f64; 3]| {
            let [_, v, w] = cases::taylor_green_plane_exact(at_m, 0.0, nu);
            [0.0, v + 1.0, w + 0.5]
        };
        let (mut flow, _) = Flow::new(mesh(), settings, initial).unwrap();
        for _ in 0..steps {
            flow.step().unwrap();
        }
        flow.face_velocity_m_s(2)
    };
    let distance = |a: &[f64], b: &[f64]| {
        a.iter()
            .zip(b)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max)
    };
    // Explicit and implicit at all these steps.
    for nu in [0.003, 0.1] {
        for scheme in [TimeScheme::AdamsBashforth2, TimeScheme::RungeKutta3] {
            let [coarse, middle, fine] = [40, 80, 160].map(|steps| velocity(scheme, steps, nu));
            let order = (distance(&coarse, &middle) / distance(&middle, &fine)).log2();
            assert!(order > 1.9, "{scheme:?}, viscosity {nu}: order {order}");
        }
    }
}

#[test]
fn without_viscosity_the_energy_error_falls_with_the_cube_of_the_step() {
    // Vortices that a mean flow carries along: their speed of change is steady, so that the error accumulates steadily. (In
    // a flow whose acceleration changes, the energy also differs by an amount of second order that does not accumulate.)
    let drift = |steps: usize| {
        let direction = |a: f64| Direction::periodic(32, 0.0, 1.0).stretched(Spread::Sine.by(a));
        let mesh = Mesh::new(Direction::thin(1.0), direction(0.3), direction(-0.2)).unwrap();
        let settings = FlowSettings::new(
            0.0,
            TimeStep::Fixed {
                step_s: 2.0 / steps as f64,
            },
        );
        let initial = |at_m: [f64; 3]| {
            let [_, v, w] = cases::taylor_green_plane_exact(at_m, 0.0, 0.0);
            [0.0, v + 1.0, w + 0.5]
        };
        let (mut flow, _) = Flow::new(mesh, settings, initial).unwrap();
        let start_m5_s2 = flow.kinetic_energy_m5_s2();
        for _ in 0..steps {
            flow.step().unwrap();
        }
        flow.kinetic_energy_m5_s2() / start_m5_s2 - 1.0
    };
    let (coarse, fine) = (drift(600), drift(1200));
    assert!(coarse > 0.0 && coarse < 1e-2, "{coarse}");
    let order = (coarse / fine).log2();
    assert!((order - 3.0).abs() < 0.2, "order {order}");
}

/// Energy of the first Fourier mode along x of the velocity along z.
fn wave_energy(flow: &Flow) -> f64 {
    let [nx, _, nz] = flow.mesh().cells();
    let w = flow.face_velocity_m_s(2);
    let face_m = flow.mesh().face_m(2);
    (1..nz)
        .map(|k| {
            let (mut cos, mut sin) = (0.0, 0.0);
            for i in 0..nx {
                let phase = TAU * i as f64 / nx as f64;
                cos += w[k * nx + i] * phase.cos();
                sin += w[k * nx + i] * phase.sin();
            }
            0.5 * (face_m[k + 1] - face_m[k - 1]) * (cos * cos + sin * sin)
        })
        .sum()
}

#[test]
fn tollmien_schlichting_waves_grow_at_the_rate_of_linear_theory() {
    let mode = TollmienSchlichting::new(7500.0, 1.0).unwrap();
    let expected = mode.omega.im;
    let case = mode.case([64, 128], 1.8, 1e-4, 0.01).unwrap();
    let (mut flow, _) = case.start().unwrap();
    let mut energies = Vec::new();
    for step in 1..=2500 {
        flow.step().unwrap();
        if step == 500 || step == 2500 {
            energies.push(wave_energy(&flow));
        }
    }
    let rate = 0.5 * (energies[1] / energies[0]).ln() / 20.0;
    assert!(
        (rate / expected - 1.0).abs() < 0.01,
        "rate {rate}, linear theory {expected}"
    );
}

#[test]
fn an_eighth_of_the_taylor_green_vortices_between_planes_of_symmetry_is_the_whole_flow() {
    let energy = |case: Case, share: f64| {
        let mut case = case;
        case.settings.time_step = TimeStep::Fixed { step_s: 0.02 };
        share * run(&case, 100).kinetic_energy_m5_s2()
    };
    let whole = energy(cases::taylor_green_3d(24, 1600.0).unwrap(), 1.0);
    let eighth = energy(cases::taylor_green_eighth(12, 1600.0).unwrap(), 8.0);
    assert!(
        (whole / eighth - 1.0).abs() < 1e-12,
        "{whole} against {eighth}"
    );
}
