//! Interpolation on meshes: exactness, order, boundaries and what happens outside.

use approx::{assert_abs_diff_eq, assert_relative_eq};
use wakescope_les::winds::{Edges, Linear, PlaneMesh, Side};
use wakescope_les::{CirculationProfile, Error, GridSnapshot, Ground, Motion, VortexPair, Wind};

const OPEN: Edges = Edges::Bounded {
    low: Side::Open,
    high: Side::Open,
};

/// Nodes from 0 to `length_m`, dense at 0: the usual hyperbolic stretching.
fn stretched(nodes: usize, length_m: f64, strength: f64) -> Vec<f64> {
    let xi = |i: usize| i as f64 / (nodes - 1) as f64;
    (0..nodes)
        .map(|i| length_m * (strength * xi(i)).sinh() / strength.sinh())
        .collect()
}

fn even(nodes: usize, first_m: f64, last_m: f64) -> Vec<f64> {
    (0..nodes)
        .map(|i| first_m + (last_m - first_m) * i as f64 / (nodes - 1) as f64)
        .collect()
}

fn at(wind: &dyn Wind, y_m: f64, z_m: f64) -> [f64; 3] {
    let mut out = [[0.0; 3]];
    wind.velocity_into(&[[0.0, y_m, z_m]], 0.0, &mut out)
        .unwrap();
    out[0]
}

/// A field given by a function, at the nodes of a mesh.
fn snapshot(mesh: &PlaneMesh, field: impl Fn(f64, f64) -> [f64; 3]) -> GridSnapshot {
    let values: Vec<[f64; 3]> = mesh
        .z_m
        .iter()
        .flat_map(|&z| mesh.y_m.iter().map(move |&y| (y, z)))
        .map(|(y, z)| field(y, z))
        .collect();
    GridSnapshot::new(mesh, &values).unwrap()
}

fn pair() -> VortexPair {
    VortexPair {
        circulation_m2_s: 500.0,
        spacing_m: 47.0,
        core_radius_m: 6.0,
        lateral_position_m: 60.0,
        height_m: 30.0,
        ground: Ground::Image,
        profile: CirculationProfile::Algebraic,
        motion: Motion::Frozen,
    }
}

/// Points over the whole of a mesh of 120 m x 80 m, ends included.
fn scattered() -> impl Iterator<Item = (f64, f64)> {
    (0..3000).map(|i| {
        let i = f64::from(i);
        (
            120.0 * (0.618_033_988_75 * i).fract(),
            80.0 * (0.754_877_666_2 * i).fract(),
        )
    })
}

/// The wind at the nodes of a mesh, in the plane x = 0 at time 0.
fn at_nodes(wind: &dyn Wind, mesh: &PlaneMesh) -> GridSnapshot {
    let points_m: Vec<[f64; 3]> = mesh
        .z_m
        .iter()
        .flat_map(|&z_m| mesh.y_m.iter().map(move |&y_m| [0.0, y_m, z_m]))
        .collect();
    let mut velocity_m_s = vec![[0.0; 3]; points_m.len()];
    wind.velocity_into(&points_m, 0.0, &mut velocity_m_s)
        .unwrap();
    GridSnapshot::new(mesh, &velocity_m_s).unwrap()
}

#[test]
fn linear_fields_are_exact_on_a_strongly_stretched_mesh() {
    let mesh = PlaneMesh {
        y_m: stretched(40, 120.0, 5.0),
        z_m: stretched(30, 80.0, 4.0),
        y_edges: OPEN,
        z_edges: OPEN,
    };
    let field = |y: f64, z: f64| {
        [
            1.0 + 0.3 * y - 0.2 * z,
            -2.0 + 0.1 * y + 0.05 * y * z,
            0.7 * z,
        ]
    };
    let wind = snapshot(&mesh, field);
    for (y, z) in scattered().chain([(0.0, 0.0), (120.0, 80.0), (mesh.y_m[7], mesh.z_m[9])]) {
        for (found, expected) in at(&wind, y, z).iter().zip(field(y, z)) {
            assert_abs_diff_eq!(*found, expected, epsilon = 1e-10);
        }
    }
}

#[test]
fn parabolas_are_exact_on_an_even_mesh_up_to_its_open_ends() {
    let mesh = PlaneMesh {
        y_m: even(13, 0.0, 120.0),
        z_m: even(9, 0.0, 80.0),
        y_edges: OPEN,
        z_edges: OPEN,
    };
    let field = |y: f64, z: f64| [y * y - z * y, 3.0 * z * z, y * y * z * z * 1e-3];
    let wind = snapshot(&mesh, field);
    for (y, z) in scattered() {
        for (found, expected) in at(&wind, y, z).iter().zip(field(y, z)) {
            assert_abs_diff_eq!(*found, expected, epsilon = 1e-7);
        }
    }
}

#[test]
fn a_cubic_misses_by_the_residual_of_the_kernel() {
    let mesh = PlaneMesh {
        y_m: even(13, 0.0, 12.0),
        z_m: even(9, 0.0, 8.0),
        y_edges: OPEN,
        z_edges: OPEN,
    };
    let wind = snapshot(&mesh, |y, _| [y * y * y, 0.0, 0.0]);
    for s in [0.1, 0.25, 0.7] {
        let missed = at(&wind, 5.0 + s, 3.3)[0] - (5.0_f64 + s).powi(3);
        assert_relative_eq!(missed, s * (1.0 - s) * (1.0 - 2.0 * s), max_relative = 1e-9);
    }
}

/// Root-mean-square error of the sampled pair over the mesh, with a slip wall at the ground and open sides.
fn rms_error(nodes: usize, strength: f64) -> f64 {
    let mesh = PlaneMesh {
        y_m: stretched(nodes, 120.0, strength),
        z_m: stretched(nodes, 80.0, strength),
        y_edges: OPEN,
        z_edges: Edges::Bounded {
            low: Side::SlipWall { position_m: 0.0 },
            high: Side::Open,
        },
    };
    let exact = pair().wind().unwrap();
    let sampled = at_nodes(&exact, &mesh);
    let distance = |(y, z)| {
        let (a, b) = (at(&sampled, y, z), at(&exact, y, z));
        (a[1] - b[1]).powi(2) + (a[2] - b[2]).powi(2)
    };
    (scattered().map(distance).sum::<f64>() / scattered().count() as f64).sqrt()
}

#[test]
fn a_sampled_vortex_converges_with_third_order_on_even_and_stretched_meshes() {
    for strength in [1e-6, 2.0] {
        let errors = [161, 321, 641].map(|nodes| rms_error(nodes, strength));
        for pair in errors.windows(2) {
            let order = (pair[0] / pair[1]).log2();
            assert!(
                (2.9..3.4).contains(&order),
                "strength {strength}: {errors:?}"
            );
        }
        assert!(errors[2] < 1e-4, "{errors:?}");
    }
}

#[test]
fn no_air_crosses_a_slip_wall_on_a_node_or_beside_one() {
    for first_m in [0.0, 0.7] {
        let mesh = PlaneMesh {
            y_m: even(60, 0.0, 120.0),
            z_m: even(40, first_m, 80.0),
            y_edges: OPEN,
            z_edges: Edges::Bounded {
                low: Side::SlipWall { position_m: 0.0 },
                high: Side::Open,
            },
        };
        let exact = pair().wind().unwrap();
        let wind = at_nodes(&exact, &mesh);
        for i in 0..100 {
            let y = 1.2 * f64::from(i);
            assert_abs_diff_eq!(at(&wind, y, 0.0)[2], 0.0, epsilon = 1e-14);
            // The velocity along the wall is even, so its image serves as a good neighbour.
            assert_abs_diff_eq!(at(&wind, y, 0.0)[1], at(&exact, y, 0.0)[1], epsilon = 0.02);
        }
    }
}

#[test]
fn air_sticks_to_a_no_slip_wall_and_moves_with_it() {
    let mesh = PlaneMesh {
        y_m: even(8, 0.0, 7.0),
        z_m: even(8, 0.5, 7.5),
        y_edges: OPEN,
        z_edges: Edges::Bounded {
            low: Side::NoSlipWall {
                position_m: 0.0,
                velocity_m_s: [0.0, 2.0, 0.0],
            },
            high: Side::Open,
        },
    };
    let wind = snapshot(&mesh, |_, z| [0.3 * z, 2.0 + 4.0 * z, -z]);
    for z in [0.0, 0.1, 0.49, 0.5, 3.2] {
        for (found, expected) in at(&wind, 3.3, z).iter().zip([0.3 * z, 2.0 + 4.0 * z, -z]) {
            assert_abs_diff_eq!(*found, expected, epsilon = 1e-13);
        }
    }
}

#[test]
fn walls_at_the_high_end_mirror_as_those_at_the_low_end() {
    let field = |z: f64| [(0.4 * z).cos(), (0.3 * z).cos(), (0.5 * z).sin()];
    let mesh = |low: Side, high: Side, z_m: Vec<f64>| PlaneMesh {
        y_m: even(4, 0.0, 3.0),
        z_m,
        y_edges: OPEN,
        z_edges: Edges::Bounded { low, high },
    };
    let wall = Side::SlipWall { position_m: 0.0 };
    let up: Vec<f64> = stretched(12, 6.0, 1.5).iter().map(|z| z + 0.05).collect();
    let down: Vec<f64> = up.iter().rev().map(|z| -z).collect();
    let above = snapshot(&mesh(wall, Side::Open, up), |_, z| field(z));
    let below = snapshot(&mesh(Side::Open, wall, down), |_, z| field(z));
    for i in 0..60 {
        let z = 0.1 * f64::from(i);
        let (a, b) = (at(&above, 1.5, z), at(&below, 1.5, -z));
        assert_abs_diff_eq!(a[0], b[0], epsilon = 1e-13);
        assert_abs_diff_eq!(a[1], b[1], epsilon = 1e-13);
        assert_abs_diff_eq!(a[2], -b[2], epsilon = 1e-13);
    }
}

#[test]
fn a_periodic_mesh_holds_every_point_and_repeats() {
    let nodes = 24;
    let period_m = 10.0;
    let mesh = PlaneMesh {
        y_m: (0..nodes)
            .map(|i| {
                -3.0 + period_m * (f64::from(i) + 0.3 * (0.4 * f64::from(i)).sin())
                    / f64::from(nodes)
            })
            .collect(),
        z_m: even(6, 0.0, 5.0),
        y_edges: Edges::Periodic { period_m },
        z_edges: OPEN,
    };
    let wave = |y: f64| (2.0 * std::f64::consts::PI * y / period_m).sin();
    let wind = snapshot(&mesh, |y, _| [wave(y), 1.0, 0.0]);
    for i in 0..400 {
        let y = -3.0 + 0.025 * f64::from(i);
        let here = at(&wind, y, 2.0);
        assert_abs_diff_eq!(here[0], wave(y), epsilon = 2e-2);
        assert_abs_diff_eq!(here[1], 1.0, epsilon = 1e-14);
        assert_abs_diff_eq!(here[0], at(&wind, y + 30.0, 2.0)[0], epsilon = 1e-12);
        assert_abs_diff_eq!(here[0], at(&wind, y - 50.0, 2.0)[0], epsilon = 1e-12);
    }
}

#[test]
fn points_outside_have_no_velocity() {
    let mesh = PlaneMesh {
        y_m: even(5, 0.0, 4.0),
        z_m: even(5, 1.0, 5.0),
        y_edges: OPEN,
        z_edges: Edges::Bounded {
            low: Side::SlipWall { position_m: 0.4 },
            high: Side::Open,
        },
    };
    let wind = snapshot(&mesh, |_, _| [1.0, 2.0, 0.0]);
    for (y, z) in [
        (-0.01, 2.0),
        (4.01, 2.0),
        (2.0, 0.39),
        (2.0, 5.01),
        (f64::NAN, 2.0),
        (2.0, f64::INFINITY),
    ] {
        assert!(at(&wind, y, z).iter().all(|v| v.is_nan()), "{y} {z}");
    }
    assert_abs_diff_eq!(at(&wind, 2.0, 0.4)[1], 2.0, epsilon = 1e-14);
}

#[test]
fn gradient_of_a_resolved_vortex_is_that_of_its_profile() {
    let mesh = PlaneMesh {
        y_m: even(401, 0.0, 120.0),
        z_m: even(301, 0.0, 80.0),
        y_edges: OPEN,
        z_edges: Edges::Bounded {
            low: Side::SlipWall { position_m: 0.0 },
            high: Side::Open,
        },
    };
    let exact = pair().wind().unwrap();
    let sampled = at_nodes(&exact, &mesh);
    let (found, bound) = (
        sampled.max_gradient_per_s(0.0),
        exact.max_gradient_per_s(0.0),
    );
    let alone = pair().profile.max_line_gradient_per_s(500.0, 6.0);
    assert!(
        found < bound && found > 0.97 * alone,
        "{found}: one vortex {alone}, bound {bound}"
    );
    let calm = at_nodes(&Linear::uniform([3.0, 1.0, 0.0]).unwrap(), &mesh);
    assert_eq!(calm.max_gradient_per_s(0.0), 0.0);
}

#[test]
fn meshes_that_cannot_be_interpolated_are_refused() {
    let good = PlaneMesh {
        y_m: even(6, 0.0, 5.0),
        z_m: even(6, 0.0, 5.0),
        y_edges: OPEN,
        z_edges: OPEN,
    };
    let refused = |mesh: PlaneMesh| {
        let count = mesh.y_m.len() * mesh.z_m.len();
        GridSnapshot::new(&mesh, &vec![[0.0; 3]; count]).unwrap_err()
    };
    let with_y = |y_m: Vec<f64>| {
        refused(PlaneMesh {
            y_m,
            ..good.clone()
        })
    };
    let bad = |error: Error, on: &str, named: &str| {
        assert!(
            matches!(&error, Error::BadDirection { axis, what, .. } if *axis == on && what == named),
            "{error}"
        );
    };
    bad(with_y(vec![0.0, 1.0, 2.0]), "y", "number of nodes");
    bad(with_y(vec![0.0, 1.0, 1.0, 2.0]), "y", "position of node 2");
    bad(
        with_y(vec![0.0, f64::NAN, 1.0, 2.0]),
        "y",
        "position of node 1",
    );
    bad(
        with_y(vec![0.0, 1.0, 2.0, 2.1, 2.2]),
        "y",
        "cells beside node 2 differ by a factor",
    );
    bad(
        with_y(vec![0.0, 1.0, 4.0, 7.0, 10.0]),
        "y",
        "cells beside node 1 differ by a factor",
    );
    bad(
        with_y(vec![0.0, 3.0, 6.0, 9.0, 10.0]),
        "y",
        "cells beside node 3 differ by a factor",
    );
    let with_edges = |z_edges| {
        refused(PlaneMesh {
            z_edges,
            ..good.clone()
        })
    };
    for position_m in [0.1, -1.0, f64::NAN] {
        let low = Side::SlipWall { position_m };
        let error = with_edges(Edges::Bounded {
            low,
            high: Side::Open,
        });
        bad(error, "z", "low wall");
    }
    let short = with_edges(Edges::Periodic { period_m: 5.0 });
    bad(short, "z", "period");
    let counted = GridSnapshot::new(&good, &[[0.0; 3]; 35]);
    assert!(matches!(
        counted,
        Err(Error::OutOfRange {
            field: "number of velocities",
            value: 35.0,
            ..
        })
    ));
    let infinite = GridSnapshot::new(&good, &[[f64::INFINITY; 3]; 36]);
    assert!(matches!(
        infinite,
        Err(Error::OutOfRange {
            field: "velocity_m_s",
            ..
        })
    ));
}
