//! Flows at the edge of what can be asked for: each must work, or be refused with a sentence that says why.

use std::f64::consts::TAU;

use wakescope_les::solver::PressureMethod;
use wakescope_les::{
    Direction, Error, Flow, FlowSettings, Mesh, Place, Spread, SubgridModel, TimeScheme, TimeStep,
    Wall, cases,
};

/// A flow without symmetries between a no-slip wall and a slip wall, all lengths in `length` and velocities in `speed`.
fn layered(length: f64, speed: f64, change: impl Fn(&mut FlowSettings)) -> Flow {
    let mesh = Mesh::new(
        Direction::periodic(6, 0.0, length),
        Direction::periodic(8, -0.5 * length, 0.5 * length).stretched(Spread::Sine.by(0.2)),
        Direction::between(13, 0.0, length, Wall::AT_REST, Wall::Slip)
            .stretched(Spread::TanhLow.by(1.0)),
    )
    .unwrap();
    let mut settings = FlowSettings::new(
        2e-3 * length * speed,
        TimeStep::Fixed {
            step_s: 0.01 * length / speed,
        },
    );
    settings.force_m_s2 = [0.1 * speed * speed / length, 0.0, 0.0];
    change(&mut settings);
    let wave = |a: f64| (TAU * a).sin();
    let field = move |at_m: [f64; 3]| {
        let [x, y, z] = at_m.map(|a| a / length);
        [
            wave(y + 0.1) * z,
            wave(x + 2.0 * y) * z + 0.2,
            0.3 * wave(x - y) * z,
        ]
        .map(|v| speed * v)
    };
    Flow::new(mesh, settings, field).unwrap().0
}

fn steps(mut flow: Flow, count: usize) -> Flow {
    for _ in 0..count {
        flow.step().unwrap();
    }
    flow
}

fn bits(flow: &Flow) -> Vec<u64> {
    let fields = [0, 1, 2].map(|d| flow.face_velocity_m_s(d));
    fields
        .iter()
        .flatten()
        .chain(&flow.pressure_m2_s2())
        .map(|v| v.to_bits())
        .collect()
}

fn schemes() -> [TimeScheme; 2] {
    [TimeScheme::AdamsBashforth2, TimeScheme::RungeKutta3]
}

fn models() -> [SubgridModel; 4] {
    [
        SubgridModel::None,
        SubgridModel::SMAGORINSKY,
        SubgridModel::WALE,
        SubgridModel::MULTISCALE_WALE,
    ]
}

#[test]
fn results_are_the_same_in_all_units_from_nanometres_to_gigametres() {
    for (scheme, subgrid) in schemes().into_iter().flat_map(|s| models().map(|m| (s, m))) {
        let change =
            |settings: &mut FlowSettings| (settings.scheme, settings.subgrid) = (scheme, subgrid);
        let run = |length: f64, speed: f64| steps(layered(length, speed, change), 5);
        let plain = run(1.0, 1.0);
        for (length, speed) in [
            (1e-9, 1.0),
            (1e9, 1.0),
            (1.0, 1e-9),
            (1.0, 1e9),
            (1e-9, 1e-9),
            (1e9, 1e9),
            (1e-9, 1e9),
        ] {
            let scaled = run(length, speed);
            let energy = scaled.kinetic_energy_m5_s2() / (speed * speed * length.powi(3));
            assert!(
                (energy / plain.kinetic_energy_m5_s2() - 1.0).abs() < 1e-12,
                "{length} {speed} {subgrid:?}: energy"
            );
            for d in 0..3 {
                let (a, b) = (plain.face_velocity_m_s(d), scaled.face_velocity_m_s(d));
                let worst = a
                    .iter()
                    .zip(&b)
                    .map(|(a, b)| (a - b / speed).abs())
                    .fold(0.0, f64::max);
                assert!(
                    worst < 1e-12,
                    "{length} m, {speed} m/s, {subgrid:?}, component {d}: {worst}"
                );
            }
        }
    }
}

#[test]
fn fields_have_the_same_bits_on_one_two_and_seven_threads() {
    for (scheme, subgrid) in schemes().into_iter().flat_map(|s| models().map(|m| (s, m))) {
        // Viscosity that is explicit along all directions, and implicit.
        for viscosity_m2_s in [1e-6, 0.1] {
            let run = |threads: usize| {
                let pool = rayon::ThreadPoolBuilder::new()
                    .num_threads(threads)
                    .build()
                    .unwrap();
                let change = |settings: &mut FlowSettings| {
                    (settings.scheme, settings.subgrid) = (scheme, subgrid);
                    settings.viscosity_m2_s = viscosity_m2_s;
                    settings.time_step = TimeStep::Courant {
                        courant: 0.3,
                        longest_s: 0.02,
                    };
                };
                pool.install(|| {
                    let flow = steps(layered(1.0, 1.0, change), 4);
                    (
                        bits(&flow),
                        flow.time_s(),
                        flow.kinetic_energy_m5_s2(),
                        flow.relative_divergence(),
                    )
                })
            };
            let one = run(1);
            assert!(
                one == run(2) && one == run(7),
                "{scheme:?}, {subgrid:?}, viscosity {viscosity_m2_s}"
            );
        }
    }
}

#[test]
fn flat_domains_and_single_cells_run() {
    let wide = |n| Direction::periodic(n, 0.0, 1.0);
    let flat = Direction::between(12, 0.0, 1e-3, Wall::AT_REST, Wall::Slip);
    let narrow = Direction::periodic(7, 0.0, 1e-3);
    let slip = Direction::between(1, 0.0, 1.0, Wall::Slip, Wall::Slip);
    let meshes = [
        (Direction::thin(1.0), wide(8), flat.clone()),
        (wide(5), wide(8), flat),
        (wide(5), narrow, wide(11)),
        (Direction::thin(1e-6), wide(7), wide(13)),
        (wide(9), Direction::thin(1e3), wide(4)),
        (wide(9), wide(11), Direction::thin(1.0)),
        (wide(9), wide(11), slip),
        (Direction::thin(1.0), Direction::thin(1.0), wide(16)),
        (wide(16), Direction::thin(1.0), Direction::thin(1.0)),
        (
            Direction::thin(1.0),
            Direction::thin(1.0),
            Direction::thin(1.0),
        ),
    ];
    for (x, y, z) in meshes {
        let mesh = Mesh::new(x, y, z).unwrap();
        let cells = mesh.cells();
        let settings = FlowSettings::new(
            1e-4,
            TimeStep::Courant {
                courant: 0.3,
                longest_s: 0.01,
            },
        );
        let field = |[x, y, z]: [f64; 3]| {
            [
                1.0 + (TAU * y).sin(),
                (TAU * x).cos(),
                (TAU * (x + y)).sin() + 0.1 * z,
            ]
        };
        let (flow, given_m5_s2) = Flow::new(mesh, settings, field).unwrap();
        assert!(
            flow.kinetic_energy_m5_s2() <= given_m5_s2 * (1.0 + 1e-12),
            "{cells:?}"
        );
        let start_m5_s2 = flow.kinetic_energy_m5_s2();
        let flow = steps(flow, 5);
        assert!(
            flow.kinetic_energy_m5_s2() <= start_m5_s2 * (1.0 + 0.01),
            "{cells:?}"
        );
        assert!(
            flow.relative_divergence() < 1e-9,
            "{cells:?}: divergence {}",
            flow.relative_divergence()
        );
    }
}

#[test]
fn divergence_after_the_start_is_round_off_on_stretched_meshes_flat_cells_and_long_domains() {
    let slip = |n, length| Direction::between(n, 0.0, length, Wall::Slip, Wall::Slip);
    let sinh = slip(64, 6.0).stretched(Spread::SinhMiddle.by(5.0));
    let tanh = Direction::between(64, 0.0, 3.0, Wall::AT_REST, Wall::Slip)
        .stretched(Spread::TanhLow.by(5.0));
    let sticky = Direction::between(48, 0.0, 1.0, Wall::AT_REST, Wall::AT_REST);
    let meshes = [
        (
            "sinh 5 x tanh 5",
            [Direction::periodic(8, 0.0, 2.0), sinh, tanh],
        ),
        (
            "cells of aspect 1e4",
            [
                Direction::periodic(8, 0.0, 2.0),
                slip(32, 1e4),
                slip(32, 1.0),
            ],
        ),
        (
            "1e5 times longer than high",
            [Direction::thin(1.0), slip(64, 1e5), sticky],
        ),
        (
            "long and periodic",
            [
                Direction::thin(1.0),
                Direction::periodic(64, 0.0, 1e4),
                slip(48, 1.0),
            ],
        ),
    ];
    for (name, [x, y, z]) in meshes {
        for pressure in [PressureMethod::Direct, PressureMethod::Multigrid] {
            let length_m = y.length_m();
            let height_m = z.length_m();
            let field = move |[x, y, z]: [f64; 3]| {
                let (s, c) = (TAU * y / length_m + 0.3).sin_cos();
                let (sz, cz) = (TAU * z / height_m + 0.5).sin_cos();
                [
                    0.2 * s * cz,
                    c * sz + 0.3 * (5.0 * s).cos() * cz,
                    s * cz + 0.1 * (TAU * x).sin(),
                ]
            };
            let mesh = Mesh::new(x.clone(), y.clone(), z.clone()).unwrap();
            let time_step = TimeStep::Courant {
                courant: 0.3,
                longest_s: 1e-3,
            };
            let settings = FlowSettings {
                pressure,
                ..FlowSettings::new(1e-4, time_step)
            };
            let (flow, _) = Flow::new(mesh, settings, field).unwrap();
            let start = flow.relative_divergence();
            assert!(
                start < 1e-14,
                "{name}, {pressure:?}: {start:e} at the start"
            );
            let flow = steps(flow, 3);
            let then = flow.relative_divergence();
            assert!(
                then < 1e-10,
                "{name}, {pressure:?}: {then:e} after three steps"
            );
        }
    }
}

#[test]
fn steps_far_beyond_the_explicit_viscous_limit_decay_without_overshoot() {
    // nu dt/h^2 is 1e4 in the widest cells and more at the plates.
    let number = 1e4;
    let cells = 16;
    let step_s = 0.01;
    let nu = number * (2.0 / cells as f64).powi(2) / step_s;
    let layer = steps(
        cases::Plates {
            cells,
            strength: 1.0,
            viscosity_m2_s: nu,
            step_s,
        }
        .decaying_layer()
        .unwrap()
        .start()
        .unwrap()
        .0,
        50,
    );
    let speeds = layer.face_velocity_m_s(0);
    assert!(speeds.iter().all(|u| u.abs() <= 1.0 + 1e-9), "{speeds:?}");
    let (mut plate, _) = cases::Plates {
        cells,
        strength: 1.0,
        viscosity_m2_s: nu,
        step_s,
    }
    .rayleigh_plate()
    .unwrap()
    .start()
    .unwrap();
    let mut last = f64::INFINITY;
    for step in 0..60 {
        plate.step().unwrap();
        let u = plate.face_velocity_m_s(0);
        let z_m = plate.mesh().centre_m(2);
        let error = u
            .iter()
            .zip(z_m.iter().flat_map(|z| [z; 8]))
            .map(|(u, z)| (u - 0.5 * (1.0 - z)).abs());
        let error = error.fold(0.0, f64::max);
        // Crank and Nicolson's oscillation of the vortex sheet: it neither grows nor stays.
        assert!(
            error < 4.0 && error <= last * (1.0 + 1e-9),
            "step {step}: {error} after {last}"
        );
        last = error;
    }
}

/// Mean of u^2 in a square duct after some steps, from a uniform stream along it.
fn duct(number: f64, count: usize) -> f64 {
    let cells = 16;
    let wall = || Direction::between(cells, 0.0, 1.0, Wall::AT_REST, Wall::AT_REST);
    let mesh = Mesh::new(Direction::thin(1.0), wall(), wall()).unwrap();
    let nu = number / (cells as f64).powi(2);
    let settings = FlowSettings::new(nu, TimeStep::Fixed { step_s: 1.0 });
    let (flow, _) = Flow::new(mesh, settings, |_| [1.0, 0.0, 0.0]).unwrap();
    let flow = steps(flow, count);
    flow.face_velocity_m_s(0).iter().map(|u| u * u).sum::<f64>() / (cells * cells) as f64
}

#[test]
fn waves_that_are_stiff_along_two_directions_hardly_decay_and_resolved_ones_follow_the_series() {
    // Nothing should be left after one viscous time; the step has tens of them.
    for number in [1e3, 1e4] {
        let left = duct(number, 4);
        assert!(left > 0.01, "nu dt/h^2 = {number}: {left}");
    }
    let resolved = duct(1.0, 24);
    assert!((resolved / 0.0162 - 1.0).abs() < 0.01, "{resolved}");
}

#[test]
fn a_moving_wall_keeps_couettes_flow_with_stiff_steps() {
    let lid = Wall::NoSlip {
        velocity_m_s: [0.0, 1.0, 0.0],
    };
    let z = Direction::between(16, 0.0, 1.0, Wall::AT_REST, lid);
    let mesh = Mesh::new(Direction::thin(1.0), Direction::periodic(16, 0.0, 1.0), z).unwrap();
    let settings = FlowSettings::new(100.0, TimeStep::Fixed { step_s: 1e-3 });
    let (flow, _) = Flow::new(mesh, settings, |[_, _, z]| [0.0, z, 0.0]).unwrap();
    let flow = steps(flow, 4);
    let z_m = flow.mesh().centre_m(2);
    assert!(
        flow.face_velocity_m_s(1)
            .iter()
            .enumerate()
            .all(|(i, v)| (v - z_m[i / 16]).abs() < 1e-9)
    );
}

#[test]
fn a_creeping_cavity_comes_to_rest_at_the_default_step() {
    let energy = |reynolds: f64, step_s: Option<f64>| {
        let mut case = cases::lid_driven_cavity(24, 0.0, reynolds).unwrap();
        if let Some(step_s) = step_s {
            case.settings.time_step = TimeStep::Fixed { step_s };
        }
        let (mut flow, _) = case.start().unwrap();
        // Six viscous times.
        while flow.time_s() < 6.0 * reynolds {
            flow.step().unwrap();
        }
        flow.kinetic_energy_m5_s2()
    };
    for reynolds in [0.1, 0.01] {
        let steady = energy(reynolds, Some(1e-3 * reynolds));
        let found = energy(reynolds, None);
        assert!(
            (found / steady - 1.0).abs() < 1e-3,
            "Re {reynolds}: {found} for {steady}"
        );
    }
}

#[test]
fn an_inviscid_flow_between_slip_walls_loses_energy_with_the_third_power_of_the_step_alone() {
    let drift = |scheme: TimeScheme, step_s: f64| {
        let slip = Direction::between(12, 0.0, 0.5, Wall::Slip, Wall::Slip);
        let mesh = Mesh::new(
            Direction::thin(1.0),
            Direction::periodic(12, 0.0, 1.0),
            slip,
        )
        .unwrap();
        let field = |[_, y, z]: [f64; 3]| {
            let stream = |a: f64, b: f64| ((TAU * a * y).sin(), (TAU * a * y).cos(), TAU * b * z);
            let ((s1, c1, z1), (s2, c2, z2)) = (stream(1.0, 1.0), stream(2.0, 2.0));
            [
                0.0,
                s1 * z1.cos() + c2 * z2.cos() + 0.3 * z1.cos(),
                -c1 * z1.sin() + s2 * z2.sin(),
            ]
        };
        let settings = FlowSettings {
            scheme,
            ..FlowSettings::new(0.0, TimeStep::Fixed { step_s })
        };
        let (flow, _) = Flow::new(mesh, settings, field).unwrap();
        let start_m5_s2 = flow.kinetic_energy_m5_s2();
        let flow = steps(flow, (0.5 / step_s).round() as usize);
        (flow.kinetic_energy_m5_s2() / start_m5_s2 - 1.0).abs()
    };
    for scheme in schemes() {
        let (coarse, fine) = (drift(scheme, 0.005), drift(scheme, 0.0025));
        let slope = (coarse / fine).log2();
        assert!(
            (slope - 3.0).abs() < 0.3,
            "{scheme:?}: drifts {coarse:e}, {fine:e}: slope {slope}"
        );
    }
}

#[test]
fn an_inviscid_flow_cannot_stick_to_a_wall() {
    let wall = Direction::between(16, 0.0, 1.0, Wall::AT_REST, Wall::Slip);
    let mesh = Mesh::new(Direction::thin(1.0), Direction::periodic(8, 0.0, 1.0), wall).unwrap();
    let settings = FlowSettings::new(0.0, TimeStep::Fixed { step_s: 0.01 });
    let message = Flow::new(mesh, settings, |_| [0.0; 3])
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("slip wall") && message.contains('z'),
        "{message}"
    );
}

#[test]
fn an_impulsive_start_through_and_along_walls_reports_what_the_projection_removes() {
    let box_mesh = |n| {
        let wall = || Direction::between(n, 0.0, 1.0, Wall::AT_REST, Wall::AT_REST);
        Mesh::new(Direction::thin(1.0), wall(), wall()).unwrap()
    };
    let settings = FlowSettings::new(
        1e-2,
        TimeStep::Courant {
            courant: 0.3,
            longest_s: 0.01,
        },
    );
    // A uniform wind blows against the walls: all of it is a gradient, so nothing is left.
    let (still, given_m5_s2) =
        Flow::new(box_mesh(16), settings.clone(), |_| [0.0, 1.0, 0.5]).unwrap();
    assert!(given_m5_s2 > 0.5);
    let left_m5_s2 = still.kinetic_energy_m5_s2();
    assert!(left_m5_s2 < 1e-20, "{left_m5_s2}");
    steps(still, 3);
    // Solid rotation slips along all four walls and blows through them in part.
    let (flow, given_m5_s2) =
        Flow::new(box_mesh(16), settings, |[_, y, z]| [0.0, 0.5 - z, y - 0.5]).unwrap();
    let start_m5_s2 = flow.kinetic_energy_m5_s2();
    assert!(start_m5_s2 < given_m5_s2, "{start_m5_s2} {given_m5_s2}");
    let flow = steps(flow, 20);
    assert!(flow.kinetic_energy_m5_s2() < start_m5_s2);
    assert!(flow.relative_divergence() < 1e-9);
}

#[test]
fn numbers_that_are_not_finite_are_refused_with_their_place() {
    let thin = || Direction::thin(1.0);
    let start = |value: f64, component: usize| {
        let mesh = Mesh::new(
            thin(),
            Direction::periodic(8, 0.0, 1.0),
            Direction::periodic(8, 0.0, 1.0),
        )
        .unwrap();
        let settings = FlowSettings::new(1e-3, TimeStep::Fixed { step_s: 0.01 });
        let field = move |[_, y, z]: [f64; 3]| {
            let mut velocity = [0.0; 3];
            if y > 0.35 && y < 0.45 && z > 0.6 && z < 0.7 {
                velocity[component] = value;
            }
            velocity
        };
        Flow::new(mesh, settings, field).unwrap_err()
    };
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let Error::Diverged {
            step: 0,
            place:
                Place {
                    component: "u",
                    cell,
                    position_m,
                },
            ..
        } = start(value, 0)
        else {
            panic!("{}", start(value, 0));
        };
        assert_eq!(cell, [0, 3, 5]);
        assert!(
            (position_m[1] - 0.4375).abs() < 1e-12 && (position_m[2] - 0.6875).abs() < 1e-12,
            "{position_m:?}"
        );
    }
    for bad in [f64::NAN, f64::INFINITY, -1.0] {
        let mesh = || Mesh::new(thin(), thin(), Direction::periodic(8, 0.0, 1.0)).unwrap();
        let refused = |settings| Flow::new(mesh(), settings, |_| [0.0; 3]).unwrap_err();
        let fixed = TimeStep::Fixed { step_s: 0.01 };
        assert!(matches!(
            refused(FlowSettings::new(bad, fixed)),
            Error::OutOfRange {
                field: "viscosity_m2_s",
                ..
            }
        ));
        let step = FlowSettings::new(0.1, TimeStep::Fixed { step_s: bad });
        assert!(matches!(
            refused(step),
            Error::OutOfRange {
                field: "step_s",
                ..
            }
        ));
        let courant = FlowSettings::new(
            0.1,
            TimeStep::Courant {
                courant: bad,
                longest_s: 1.0,
            },
        );
        assert!(matches!(
            refused(courant),
            Error::OutOfRange {
                field: "courant",
                ..
            }
        ));
        let edge = Mesh::new(thin(), thin(), Direction::periodic(8, 0.0, bad));
        assert!(matches!(edge, Err(Error::BadDirection { axis: "z", .. })));
    }
}

#[test]
fn a_fluid_at_rest_stays_at_rest() {
    for time_step in [
        TimeStep::Fixed { step_s: 0.1 },
        TimeStep::Courant {
            courant: 0.3,
            longest_s: 0.1,
        },
    ] {
        let wall = Direction::between(16, 0.0, 1.0, Wall::AT_REST, Wall::AT_REST);
        let mesh = Mesh::new(
            Direction::periodic(4, 0.0, 1.0),
            Direction::periodic(4, 0.0, 1.0),
            wall,
        )
        .unwrap();
        let (flow, _) = Flow::new(mesh, FlowSettings::new(1e-3, time_step), |_| [0.0; 3]).unwrap();
        let flow = steps(flow, 3);
        assert_eq!(
            (flow.kinetic_energy_m5_s2(), flow.relative_divergence()),
            (0.0, 0.0)
        );
        assert!((flow.time_s() - 0.3).abs() < 1e-15);
    }
}

#[test]
fn a_courant_number_above_the_limit_is_refused_with_place_and_component() {
    let mesh = || {
        let wide = || Direction::periodic(8, 0.0, 1.0);
        Mesh::new(wide(), wide(), wide()).unwrap()
    };
    for scheme in [TimeScheme::AdamsBashforth2, TimeScheme::RungeKutta3] {
        let start = |courant: f64| {
            let mut settings = FlowSettings::new(
                1e-3,
                TimeStep::Fixed {
                    step_s: courant / 8.0,
                },
            );
            settings.scheme = scheme;
            Flow::new(mesh(), settings, |_| [0.0, 0.0, 1.0]).unwrap().0
        };
        let Err(Error::CourantTooLarge {
            step: 1,
            place: Place { component: "w", .. },
            courant,
            limit,
            ..
        }) = start(1.5).step()
        else {
            panic!("{scheme:?}")
        };
        assert!(
            (courant - 1.5).abs() < 1e-9 && limit > 0.4 && limit < 1.2,
            "{limit}"
        );
        steps(start(0.999 * limit), 1);
        assert!(
            matches!(
                start(1.001 * limit).step(),
                Err(Error::CourantTooLarge { .. })
            ),
            "{scheme:?}, {limit}"
        );
    }
}

#[test]
fn walls_that_blow_and_meshes_that_fold_or_jump_are_refused_before_anything_is_computed() {
    let refused = |z: Direction| {
        Mesh::new(Direction::thin(1.0), Direction::thin(1.0), z)
            .unwrap_err()
            .to_string()
    };
    let blowing = Wall::NoSlip {
        velocity_m_s: [0.0, 0.0, 0.1],
    };
    let message = refused(Direction::between(16, 0.0, 1.0, blowing, Wall::Slip));
    assert!(
        message.contains("0.1") && message.contains("across"),
        "{message}"
    );
    let steep =
        Direction::between(12, 0.0, 1.0, Wall::Slip, Wall::Slip).stretched(Spread::TanhLow.by(6.0));
    let message = refused(steep);
    assert!(
        message.contains("differ by a factor") && message.contains("node"),
        "{message}"
    );
}
