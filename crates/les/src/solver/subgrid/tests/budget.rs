//! Energy, bits, and directions in which nothing varies.

use super::*;

fn sine(n: usize, amplitude: f64) -> Direction {
    Direction::periodic(n, 0.0, 1.0).stretched(Spread::Sine.by(amplitude))
}

fn between(n: usize, low: Wall, high: Wall, mapping: Mapping) -> Direction {
    Direction::between(n, 0.0, 1.0, low, high).stretched(mapping)
}

/// Meshes of every kind of end, stretching and thickness.
fn meshes() -> Vec<[Direction; 3]> {
    let moving = Wall::NoSlip {
        velocity_m_s: [0.7, -0.4, 0.0],
    };
    let tanh = Spread::TanhBoth.by(1.5);
    let low = Spread::TanhLow.by(1.0);
    vec![
        [sine(10, 0.5), sine(11, 0.4), sine(9, 0.3)],
        [
            sine(9, 0.3),
            between(8, Wall::Slip, Wall::Slip, Mapping::default()),
            between(17, Wall::AT_REST, moving, tanh.clone()),
        ],
        [
            between(16, Wall::AT_REST, Wall::AT_REST, tanh.clone()),
            between(13, Wall::AT_REST, Wall::Slip, low.clone()),
            between(12, Wall::Slip, Wall::AT_REST, Spread::TanhHigh.by(1.0)),
        ],
        [
            sine(4, 0.0),
            Direction::thin(0.2),
            between(16, Wall::AT_REST, Wall::AT_REST, tanh.clone()),
        ],
        [
            Direction::thin(0.3),
            between(14, Wall::Slip, Wall::AT_REST, low),
            sine(12, 0.2),
        ],
        [
            sine(13, 0.2),
            between(16, Wall::AT_REST, Wall::AT_REST, tanh),
            Direction::between(1, 0.0, 0.1, Wall::Slip, Wall::Slip),
        ],
    ]
}

/// Mass of a place along each axis: of a face along the axes in `at_faces`.
fn mass(layout: &Layout, index: [usize; 3], at_faces: &[usize]) -> f64 {
    (0..3)
        .map(|axis| {
            let line = &layout.line[axis];
            if at_faces.contains(&axis) {
                line.face_mass_m[index[axis]]
            } else {
                line.cell_mass_m[index[axis]]
            }
        })
        .product()
}

/// Work of the stress on the flow `probe` and minus its contraction with the strain of `probe`,
/// both over the sum of moduli.
fn work_and_contraction(flow: &Modelled, probe: &[Vec<f64>; 3]) -> (f64, f64) {
    let layout = &flow.layout;
    let mut work = 0.0;
    let mut contraction = 0.0;
    let mut moduli = 0.0;
    for (component, force) in flow.acceleration().iter().enumerate() {
        for (place, force) in force.iter().enumerate() {
            work += mass(layout, flow.index(place), &[component]) * force * probe[component][place];
        }
    }
    for (([a, b], stress), strain) in PAIRS
        .into_iter()
        .zip(flow.plain_stress())
        .zip(strain(layout, probe))
    {
        for (place, (stress, strain)) in stress.iter().zip(&strain).enumerate() {
            let at_faces = if a == b { vec![] } else { vec![a, b] };
            let twice = if a == b { 1.0 } else { 2.0 };
            let term = twice * mass(layout, flow.index(place), &at_faces) * stress * strain;
            contraction -= term;
            moduli += term.abs();
        }
    }
    (work / moduli, contraction / moduli)
}

#[test]
fn the_work_of_the_stress_on_any_flow_is_minus_its_contraction_with_the_strain_of_that_flow() {
    for directions in meshes() {
        for model in MODELS {
            let flow = Modelled::new(directions.clone(), model, waves(0.3, 4.0));
            let probe = faces(&flow.mesh, &flow.layout, waves(1.7, 3.0));
            let (work, contraction) = work_and_contraction(&flow, &probe);
            assert!(
                (work - contraction).abs() < 1e-14,
                "{model:?}, {directions:?}: {work} against {contraction}"
            );
            // A lost factor would show only if there is something to lose.
            assert!(contraction.abs() > 1e-4, "{contraction}");
        }
    }
}

#[test]
fn on_the_whole_every_model_takes_energy_from_the_flow() {
    let multiscale = |order| SubgridModel::MultiscaleWale {
        constant: 0.8,
        order,
    };
    for seed in 0..3 {
        for directions in meshes() {
            for model in MODELS.into_iter().chain((1..=4).map(multiscale)) {
                let flow = Modelled::new(directions.clone(), model, waves(f64::from(seed), 5.0));
                let (work, _) = work_and_contraction(&flow, &flow.velocity);
                assert!(work < 0.0, "{model:?}, {directions:?}: {work}");
            }
        }
    }
}

#[test]
fn the_stress_has_the_same_bits_with_one_two_and_seven_threads() {
    let directions = || {
        [
            sine(10, 0.5),
            sine(11, 0.4),
            between(16, Wall::AT_REST, Wall::Slip, Mapping::default()),
        ]
    };
    for model in MODELS {
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| {
                let flow = Modelled::new(directions(), model, waves(0.9, 4.0));
                (
                    flow.acceleration(),
                    flow.model.viscosity_m2_s.to_vec(),
                    flow.model.largest[0],
                )
            })
        };
        let expected = run(1);
        assert!(expected.2 > 0.0);
        assert_eq!(run(2), expected);
        assert_eq!(run(7), expected);
    }
}

#[test]
fn a_flow_that_does_not_vary_in_a_direction_has_the_same_bits_with_one_cell_there_as_with_four() {
    let tanh = Spread::TanhBoth.by(1.5);
    for axis in 0..3 {
        for model in MODELS {
            let run = |cells: usize| {
                let across = if axis == 2 { 0 } else { 2 };
                let mut velocity_m_s = [0.3, -0.7, 0.5];
                velocity_m_s[across] = 0.0;
                let mut directions = [sine(9, 0.4), sine(8, 0.0), sine(10, 0.2)];
                directions[across] = between(
                    17,
                    Wall::AT_REST,
                    Wall::NoSlip { velocity_m_s },
                    tanh.clone(),
                );
                directions[axis] = Direction::periodic(cells, 0.0, 0.125 * cells as f64);
                let waves = waves(0.4, 4.0);
                let flow = Modelled::new(directions, model, |mut at_m| {
                    at_m[axis] = 0.0;
                    waves(at_m)
                });
                let acceleration = flow.acceleration();
                let first: Vec<usize> = (0..flow.layout.shape.len())
                    .filter(|&place| flow.index(place)[axis] == 0)
                    .collect();
                let of = |field: &[f64]| {
                    first
                        .iter()
                        .map(|&place| field[place])
                        .collect::<Vec<f64>>()
                };
                (
                    acceleration.map(|field| of(&field)),
                    of(&flow.model.viscosity_m2_s),
                )
            };
            assert_eq!(run(1), run(4), "{model:?}, axis {axis}");
            assert!(run(1).1.iter().any(|nu| *nu > 0.0));
        }
    }
}
