//! Uniform gradients against closed forms, laminar flows, the neighbourhood of a wall.

use super::*;

fn slip_box(cells: [usize; 3], h: [f64; 3]) -> [Direction; 3] {
    std::array::from_fn(|d| {
        Direction::between(
            cells[d],
            0.0,
            cells[d] as f64 * h[d],
            Wall::Slip,
            Wall::Slip,
        )
    })
}

/// Whether a cell is so far from all ends that no stencil reaches them.
fn deep(cells: [usize; 3], index: [usize; 3]) -> bool {
    (0..3).all(|d| index[d] >= 6 && index[d] + 6 < cells[d])
}

fn linear(g: [[f64; 3]; 3]) -> impl Fn([f64; 3]) -> [f64; 3] {
    move |x| g.map(|row| row[0] * x[0] + row[1] * x[1] + row[2] * x[2])
}

#[test]
fn the_eddy_viscosity_of_a_uniform_gradient_is_the_closed_form() {
    let cells = [14, 13, 15];
    let h = [0.1, 0.2, 0.05];
    let square = (0.1_f64 * 0.2 * 0.05).powf(2.0 / 3.0);
    let a = 3.0;
    let w = 2.0;
    let cases = [
        // Plane shear: |S| = a, no WALE.
        ([[0.0, a, 0.0], [0.0; 3], [0.0; 3]], a, 0.0),
        // Rotation: no strain; Sd = w^2 diag(-1, -1, 2)/3, Sd:Sd = 2/3 w^4.
        (
            [[0.0, -w, 0.0], [w, 0.0, 0.0], [0.0; 3]],
            0.0,
            (2.0_f64 / 3.0).powf(0.25) * w,
        ),
        // Plane strain: S:S = 2 a^2, |S| = 2 a; Sd = a^2 diag(1, 1, -2)/3, Sd:Sd = 2/3 a^4.
        (
            [[a, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, -a]],
            2.0 * a,
            a * (2.0_f64 / 3.0).powf(1.5) / (2.0_f64.powf(2.5) + (2.0_f64 / 3.0).powf(1.25)),
        ),
        // Rotation about x and shear across it: g = [[0, a, 0], [0, 0, -w], [0, w, 0]], g g = [[0,
        // 0, -a w], [0, -w^2, 0], [0, 0, -w^2]], Sd:Sd = 2/3 w^4 + (a w)^2/2, S:S = a^2/2.
        ([[0.0, a, 0.0], [0.0, 0.0, -w], [0.0, w, 0.0]], a, {
            let d = 2.0 / 3.0 * w.powi(4) + 0.5 * (a * w).powi(2);
            let s = 0.5 * a * a;
            d.powf(1.5) / (s.powf(2.5) + d.powf(1.25))
        }),
    ];
    for (g, smagorinsky, wale) in cases {
        for (model, expected) in [
            (
                SubgridModel::Smagorinsky { constant: 0.2 },
                0.04 * square * smagorinsky,
            ),
            (SubgridModel::Wale { constant: 0.3 }, 0.09 * square * wale),
            (
                SubgridModel::MultiscaleWale {
                    constant: 0.3,
                    order: 2,
                },
                0.09 * square * wale,
            ),
        ] {
            let flow = Modelled::new(slip_box(cells, h), model, linear(g));
            let mut seen = 0;
            for (place, nu) in flow.model.viscosity_m2_s.iter().enumerate() {
                if deep(cells, flow.index(place)) {
                    seen += 1;
                    assert!(
                        (nu - expected).abs() < 1e-12 * (expected + square),
                        "{model:?} {g:?}: {nu}, {expected}"
                    );
                }
            }
            assert!(seen > 0);
        }
    }
}

#[test]
fn the_viscosity_is_cut_where_the_shortest_wave_would_decay_faster_than_the_limit_and_only_there() {
    let cells = [14, 13, 15];
    let h = [0.1, 0.2, 0.05];
    let rotation = linear([[0.0, -2.0, 0.0], [2.0, 0.0, 0.0], [0.0; 3]]);
    let mut flow = Modelled::new(slip_box(cells, h), SubgridModel::WALE, rotation);
    let middle = flow.at([7, 6, 7]);
    let free_m2_s = flow.model.viscosity_m2_s[middle];
    let decay_per_s = free_m2_s * 49.0 / 9.0 * h.iter().map(|h| 1.0 / (h * h)).sum::<f64>();
    for (share, kept) in [(0.25, 0.25), (0.999, 0.999), (1.001, 1.0)] {
        flow.update(share * decay_per_s);
        let found = flow.model.viscosity_m2_s[middle];
        assert!(
            (found / free_m2_s - kept).abs() < 1e-12,
            "{share}: {found} of {free_m2_s}"
        );
        // The corners of the box, where slip walls bend the flow, may have more.
        assert!(flow.model.largest[1] >= decay_per_s * (1.0 - 1e-12));
    }
}

#[test]
fn a_uniform_strain_makes_the_stress_twice_viscosity_times_strain() {
    let cells = [14, 13, 15];
    let h = [0.1, 0.2, 0.05];
    let g = [[1.0, 2.0, -0.5], [0.7, -3.0, 1.1], [-1.3, 0.4, 2.0]];
    let flow = Modelled::new(slip_box(cells, h), SubgridModel::WALE, linear(g));
    let middle = flow.at([7, 6, 7]);
    let nu = flow.model.viscosity_m2_s[middle];
    assert!(nu > 0.0);
    let [xz, yz, zz] = flow.model.across.each_ref().map(|stress| stress[middle]);
    for (found, strain) in [
        (xz, 0.5 * (g[0][2] + g[2][0])),
        (yz, 0.5 * (g[1][2] + g[2][1])),
        (zz, g[2][2]),
    ] {
        assert!(
            (found - 2.0 * nu * strain).abs() < 1e-13 * nu,
            "{found} against {}",
            2.0 * nu * strain
        );
    }
}

#[test]
fn wale_vanishes_in_shear_flows_and_smagorinsky_does_not() {
    let top = Wall::NoSlip {
        velocity_m_s: [2.0, 0.0, 0.0],
    };
    let directions = [
        Direction::periodic(6, 0.0, 1.0),
        Direction::periodic(12, 0.0, 1.0).stretched(Spread::Sine.by(0.5)),
        Direction::between(24, 0.0, 1.0, Wall::AT_REST, top).stretched(Spread::TanhBoth.by(2.0)),
    ];
    // Couette and Poiseuille together.
    let profile = |[_, _, z]: [f64; 3]| [2.0 * z + 3.0 * z * (1.0 - z), 0.0, 0.0];
    for model in MODELS {
        let flow = Modelled::new(directions.clone(), model, profile);
        let largest = flow
            .acceleration()
            .into_iter()
            .flatten()
            .fold(0.0_f64, |most, a| most.max(a.abs()));
        if matches!(model, SubgridModel::Smagorinsky { .. }) {
            assert!(flow.model.largest[0] > 1e-4 && largest > 1e-4);
        } else {
            assert!(
                flow.model.largest[0] < 1e-30,
                "{model:?}: {}",
                flow.model.largest[0]
            );
            assert!(largest < 1e-30, "{model:?}: {largest}");
        }
    }
}

#[test]
fn laminar_shear_has_no_small_scales_right_up_to_the_walls() {
    let top = Wall::NoSlip {
        velocity_m_s: [2.0, -1.0, 0.0],
    };
    let directions = [
        Direction::periodic(6, 0.0, 1.0),
        Direction::periodic(8, 0.0, 1.0),
        Direction::between(24, 0.0, 1.0, Wall::AT_REST, top),
    ];
    for order in 1..=4 {
        let model = SubgridModel::MultiscaleWale {
            constant: 0.8,
            order,
        };
        let small = |field: &dyn Fn([f64; 3]) -> [f64; 3]| {
            let flow = Modelled::new(directions.clone(), model, field);
            let cells = flow.layout.shape.len();
            let small = flow.small().unwrap();
            (0..24)
                .map(|k| {
                    let of_plane = |place: usize| flow.index(place)[2] == k;
                    let values = small.iter().flat_map(|field| {
                        (0..cells).filter(|&p| of_plane(p)).map(|p| field[p].abs())
                    });
                    values.fold(0.0, f64::max)
                })
                .collect::<Vec<f64>>()
        };
        let couette = small(&|[_, _, z]| [2.0 * z, -z, 0.0]);
        assert!(couette.iter().all(|u| *u < 1e-15), "{couette:?}");
        // The parabola has none where the stencil does not meet a wall, but for the first order,
        // which sees its curvature.
        let poiseuille = small(&|[_, _, z]| [2.0 * z + z * (1.0 - z), -z, 0.0]);
        for (k, u) in poiseuille.iter().enumerate().take(24 - order).skip(order) {
            let curvature = if order == 1 {
                0.5 / 24.0_f64.powi(2)
            } else {
                0.0
            };
            assert!(
                (u - curvature).abs() < 1e-15,
                "order {order}, cell {k}: {u}"
            );
        }
    }
}

#[test]
fn wale_grows_with_the_cube_of_the_distance_from_a_wall() {
    let tau = std::f64::consts::TAU;
    let wall = Direction::between(24, 0.0, 0.02, Wall::AT_REST, Wall::Slip);
    let directions = [
        Direction::periodic(16, 0.0, 1.0),
        Direction::periodic(16, 0.0, 1.0),
        wall.stretched(Spread::TanhLow.by(2.5)),
    ];
    // Near the wall u and v grow with z, and w with z^2 so that no fluid is made.
    let field = move |[x, y, z]: [f64; 3]| {
        let a = tau * x;
        let b = tau * y;
        [
            z * (a.sin() + 0.5 * b.sin()),
            z * (b.cos() + 0.7 * a.cos()),
            -0.5 * z * z * tau * (a.cos() - b.sin()),
        ]
    };
    for model in [SubgridModel::WALE, SubgridModel::MULTISCALE_WALE] {
        let flow = Modelled::new(directions.clone(), model, field);
        let z_m = flow.mesh.centre_m(2);
        let h_m = &flow.layout.line[2].cell_metric_m;
        let plane = flow.layout.shape.plane();
        let points: Vec<(f64, f64)> = (0..12)
            .map(|k| {
                let sum: f64 = flow.model.viscosity_m2_s[k * plane..(k + 1) * plane]
                    .iter()
                    .sum();
                // The width of the filter changes too.
                (z_m[k].ln(), (sum / h_m[k].powf(2.0 / 3.0)).ln())
            })
            .collect();
        let slope = slope(&points);
        assert!((slope - 3.0).abs() < 0.1, "slope {slope}: {points:?}");
    }
}

/// Slope of the regression line.
fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let x = points.iter().map(|p| p.0).sum::<f64>() / n;
    let y = points.iter().map(|p| p.1).sum::<f64>() / n;
    let (xy, xx) = points.iter().fold((0.0, 0.0), |s, p| {
        (s.0 + (p.0 - x) * (p.1 - y), s.1 + (p.0 - x).powi(2))
    });
    xy / xx
}
