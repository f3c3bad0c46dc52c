//! The discrete conservation laws, exact solutions and orders of the time step.

use super::super::component_operators::Scratch;
use super::super::mesh::{Direction, Ends, Mapping, Mesh, Spread, Wall};
use super::super::settings::{FlowSettings, TimeStep};
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

/// Convection of every component of the present field, and what it makes of energy and momentum
/// over sums of moduli.
fn production(flow: &Flow) -> (f64, [f64; 3]) {
    let shape = flow.layout.shape;
    let velocity = flow.state.velocity.each_ref().map(|field| &field[..]);
    let mut energy = 0.0;
    let mut energy_moduli = 0.0;
    let mut momentum = [0.0; 3];
    for axis in 0..3 {
        let mut sum = 0.0;
        let mut moduli = 0.0;
        let mut scratch = Scratch::new(shape.n[0]);
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
                    (energy, energy_moduli) =
                        (energy + force * u, energy_moduli + (force * u).abs());
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
    let sine = |n, a| Direction::periodic(n, 0.0, 1.0).stretched(Spread::Sine.by(a));
    let cluster = |n, strength, place| {
        Direction::periodic(n, 0.0, 1.0).stretched(Mapping {
            place,
            ..Spread::Cluster.by(strength)
        })
    };
    let walls =
        |n, low, high, mapping| Direction::between(n, 0.0, 1.0, low, high).stretched(mapping);
    let tanh = Spread::TanhBoth.by(1.2);
    let meshes = [
        [sine(16, 0.5), sine(14, 0.4), sine(15, 0.3)],
        [cluster(16, 0.8, 0.5), cluster(21, 0.6, 0.1), sine(15, 0.3)],
        [
            sine(12, 0.3),
            walls(15, Wall::Slip, Wall::Slip, tanh.clone()),
            walls(18, Wall::AT_REST, Wall::AT_REST, tanh.clone()),
        ],
        [
            walls(17, Wall::AT_REST, Wall::Slip, Spread::TanhLow.by(1.0)),
            sine(11, 0.0),
            walls(16, Wall::AT_REST, Wall::AT_REST, Mapping::default()),
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
        let (flow, given_m5_s2) =
            Flow::new(Mesh::new(x, y, z).unwrap(), fixed(1e-3, 1e-3), rough).unwrap();
        assert!(flow.kinetic_energy_m5_s2() < given_m5_s2);
        let (energy, momentum) = production(&flow);
        assert!(energy.abs() < 1e-14, "energy {energy}");
        for axis in 0..3 {
            // ComponentOperators along a direction between walls is not conserved: the walls push.
            if periodic[flow.layout.direction[axis]] {
                assert!(momentum[axis].abs() < 1e-14, "momentum {momentum:?}");
            }
        }
    }
}

#[test]
fn flows_that_do_not_vary_along_x_are_plane_flows_bit_for_bit() {
    for scheme in [TimeScheme::AdamsBashforth2, TimeScheme::RungeKutta3] {
        let run = |x: Direction| {
            let z = Direction::between(16, 0.0, 1.0, Wall::AT_REST, Wall::AT_REST);
            let y = Direction::periodic(12, 0.0, 1.0).stretched(Spread::Sine.by(0.2));
            let mesh = Mesh::new(x, y, z.stretched(Spread::TanhBoth.by(1.0))).unwrap();
            let mut settings = FlowSettings::new(1e-3, TimeStep::Fixed { step_s: 0.01 });
            settings.scheme = scheme;
            let field = |[_, y, z]: [f64; 3]| {
                [
                    z * (std::f64::consts::TAU * y).cos(),
                    (std::f64::consts::TAU * z).sin(),
                    0.3 * (std::f64::consts::TAU * y).sin(),
                ]
            };
            let initial = crate::solver::cases::Initial::Field(Box::new(field));
            let mut flow = initial.start_in_order([0, 1, 2], mesh, settings).unwrap();
            for _ in 0..4 {
                flow.step().unwrap();
            }
            flow
        };
        let plane = run(Direction::thin(0.7));
        for cells in [4, 8] {
            let deep = run(Direction::periodic(cells, 0.0, 0.7));
            for d in 0..3 {
                let plane = plane.face_velocity_m_s(d);
                let deep = deep.face_velocity_m_s(d);
                for (place, value) in deep.iter().enumerate() {
                    let expected = plane[place / cells];
                    assert!(
                        value.to_bits() == expected.to_bits(),
                        "{scheme:?}, {d}, {place}: {value:e} is not {expected:e}"
                    );
                }
            }
        }
    }
}
