//! Winds in three dimensions against tables of independent origin, and against closed forms on meshes.

use wakescope_les::winds::{
    AlongFlight, Edges, Linear, Series, Side, Sum, VolumeComponent, VolumeSnapshot, VortexLine,
    VortexLines,
};
use wakescope_les::{CirculationProfile, Ground, Motion, VortexPair, Wind};

/// Rows of a table as numbers; what is none is NaN.
fn rows(name: &str) -> (Vec<String>, Vec<Vec<f64>>) {
    let path = format!(
        "{}/../../tests/reference/scans/{name}.csv",
        env!("CARGO_MANIFEST_DIR")
    );
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let header = lines
        .next()
        .unwrap()
        .split(',')
        .map(str::to_owned)
        .collect();
    let number = |cell: &str| match cell {
        "true" => 1.0,
        "false" => 0.0,
        cell => cell.parse().unwrap_or(f64::NAN),
    };
    (
        header,
        lines
            .map(|line| line.split(',').map(number).collect())
            .collect(),
    )
}

fn each(name: &str, mut check: impl FnMut(&dyn Fn(&str) -> f64)) {
    let (header, rows) = rows(name);
    assert!(rows.len() > 5, "{name}");
    for row in rows {
        check(&|column: &str| {
            row[header
                .iter()
                .position(|h| h == column)
                .unwrap_or_else(|| panic!("{column}"))]
        });
    }
}

fn at(wind: &dyn Wind, point_m: [f64; 3], time_s: f64) -> [f64; 3] {
    let mut out = [[0.0; 3]];
    wind.velocity_into(&[point_m], time_s, &mut out).unwrap();
    out[0]
}

fn near(found: [f64; 3], expected: [f64; 3]) {
    for (f, e) in found.iter().zip(expected) {
        assert!(
            (f - e).abs() < 1e-9 * e.abs().max(1.0),
            "{found:?} {expected:?}"
        );
    }
}

fn line(
    nodes_m: Vec<[f64; 3]>,
    endless: bool,
    circulation_m2_s: f64,
    core_radius_m: f64,
) -> VortexLine {
    VortexLine {
        nodes_m,
        endless,
        circulation_m2_s,
        core_radius_m,
        axial_deficit_m_s: 0.0,
    }
}

#[test]
fn lines_and_segments_of_any_axis_have_the_velocities_of_the_table() {
    each("vortex_lines", |row| {
        let xyz = |names: [&str; 3]| names.map(row);
        let (c, t) = (xyz(["c_x_m", "c_y_m", "c_z_m"]), xyz(["t_x", "t_y", "t_z"]));
        let half_m = 0.5 * row("segment_length_m");
        let end = |sign: f64| std::array::from_fn(|d| c[d] + sign * half_m * t[d]);
        let wind = |endless: bool| {
            let nodes_m = vec![end(-1.0), end(1.0)];
            VortexLines::new(
                vec![line(nodes_m, endless, row("gamma_m2_s"), row("rc_m"))],
                Ground::None,
            )
            .unwrap()
        };
        let point_m = xyz(["x_m", "y_m", "z_m"]);
        near(
            at(&wind(true), point_m, 0.0),
            xyz(["line_u_m_s", "line_v_m_s", "line_w_m_s"]),
        );
        near(
            at(&wind(false), point_m, 0.0),
            xyz(["segment_u_m_s", "segment_v_m_s", "segment_w_m_s"]),
        );
    });
}

#[test]
fn a_pair_on_a_glide_path_seen_along_the_flight_is_that_of_the_table() {
    each("axial_pair", |row| {
        let (sin, cos) = row("glide_rad").sin_cos();
        let vortex = |y_m: f64, sign: f64| {
            let z_m = row("z0_m");
            line(
                vec![[0.0, y_m, z_m], [cos, y_m, z_m - sin]],
                true,
                sign * row("gamma_m2_s"),
                row("rc_m"),
            )
        };
        let half_m = 0.5 * row("b0_m");
        let ground = if row("images") == 1.0 {
            Ground::Image
        } else {
            Ground::None
        };
        let wind =
            VortexLines::new(vec![vortex(-half_m, -1.0), vortex(half_m, 1.0)], ground).unwrap();
        let ((sin_az, cos_az), (sin_el, cos_el)) =
            (row("azimuth_rad").sin_cos(), row("elevation_rad").sin_cos());
        let e = [cos_el * cos_az, cos_el * sin_az, sin_el];
        let from_m = ["lidar_x_m", "lidar_y_m", "lidar_z_m"].map(row);
        let seen = |range_m: f64| {
            let v = at(
                &wind,
                std::array::from_fn(|d| from_m[d] + range_m * e[d]),
                0.0,
            );
            v[0] * e[0] + v[1] * e[1] + v[2] * e[2]
        };
        let point = seen(row("range_m"));
        assert!((point - row("point_m_s")).abs() < 1e-9, "{point}");
        // (28) by the trapezoidal rule, which converges at once for a Gaussian: sigma of |f|^2 in range.
        let sigma_m = 0.5 * 299_792_458.0 * 200e-9 / (2.0 * 2f64.ln().sqrt());
        let step_m = 0.05 * sigma_m;
        let weighted: f64 = (-140..=140)
            .map(|i| f64::from(i) * step_m)
            .map(|x| (-(x / sigma_m).powi(2)).exp() * seen(row("range_m") + x))
            .sum();
        let pulse = weighted * step_m / (sigma_m * std::f64::consts::PI.sqrt());
        assert!(
            (pulse - row("pulse_m_s")).abs() < 1e-9,
            "{pulse} {}",
            row("pulse_m_s")
        );
    });
}

fn pair(motion: Motion) -> VortexPair {
    VortexPair {
        circulation_m2_s: 500.0,
        spacing_m: 47.0,
        core_radius_m: 2.35,
        lateral_position_m: 400.0,
        height_m: 47.0,
        ground: Ground::Image,
        profile: CirculationProfile::Algebraic,
        motion,
    }
}

#[test]
fn a_line_along_the_flight_is_the_vortex_of_the_pair_and_a_long_segment_tends_to_it() {
    let frozen = pair(Motion::Frozen);
    let reference = frozen.wind().unwrap();
    let of = |half_length_m: f64, endless: bool| {
        let vortex = |y_m: f64, sign: f64| {
            line(
                vec![[-half_length_m, y_m, 47.0], [half_length_m, y_m, 47.0]],
                endless,
                sign * 500.0,
                2.35,
            )
        };
        VortexLines::new(vec![vortex(376.5, -1.0), vortex(423.5, 1.0)], Ground::Image).unwrap()
    };
    for point_m in [[3.0, 377.0, 48.0], [-200.0, 401.0, 0.0], [0.0, 430.0, 44.0]] {
        near(
            at(&of(1.0, true), point_m, 0.0),
            at(&reference, point_m, 0.0),
        );
    }
    let point_m = [0.0, 425.0, 48.0];
    let error = |half_length_m: f64| {
        let (a, b) = (
            at(&of(half_length_m, false), point_m, 0.0),
            at(&reference, point_m, 0.0),
        );
        (a[2] - b[2]).abs()
    };
    let order = (error(1e3) / error(2e3)).log2();
    // What the ends of one vortex lack falls with the square; that of a pair and its images cancels but for the fourth power.
    assert!((order - 4.0).abs() < 0.1, "{order}");
    let (lines, own) = (
        of(1.0, true).max_gradient_per_s(0.0),
        reference.max_gradient_per_s(0.0),
    );
    assert!(
        lines >= 500.0 / (8.0 * std::f64::consts::PI * 2.35 * 2.35) && lines < 1.1 * own,
        "{lines} {own}"
    );
}

#[test]
fn the_wake_is_as_old_as_the_table_says_and_absent_before_the_aircraft() {
    each("age_along_flight", |row| {
        let wake = pair(Motion::Inviscid);
        let wind =
            AlongFlight::new(wake, row("aircraft_speed_m_s"), row("aircraft_x_at_t0_m")).unwrap();
        let (x_m, time_s) = (row("x_m"), row("time_s"));
        assert!((wind.age_s(x_m, time_s) - row("age_s")).abs() < 1e-9);
        let point = [x_m, 424.0, 45.0];
        let expected = at(&wake.wind().unwrap(), point, row("age_s"));
        let expected = if row("has_wake") == 1.0 {
            expected
        } else {
            [0.0; 3]
        };
        near(at(&wind, point, time_s), expected);
        let ahead = row("aircraft_x_at_t0_m") + row("aircraft_speed_m_s") * time_s + 1.0;
        assert_eq!(at(&wind, [ahead, 424.0, 45.0], time_s), [0.0; 3]);
    });
}

const OPEN: Edges = Edges::Bounded {
    low: Side::Open,
    high: Side::Open,
};

/// Nodes that widen to the sides, moved by a part of a cell.
fn nodes(from: f64, to: f64, count: usize, shift: f64) -> Vec<f64> {
    (0..count)
        .map(|i| {
            let s = (i as f64 + shift) / (count - 1) as f64;
            from + (to - from) * (s + 0.03 * (std::f64::consts::TAU * s).sin())
        })
        .collect()
}

/// A wind on staggered nodes: u half a cell before, v and w likewise in their directions.
fn staggered(count: usize, velocity: impl Fn([f64; 3]) -> [f64; 3]) -> VolumeSnapshot {
    let component = |c: usize| {
        let shift = |d: usize| if c == d { -0.5 } else { 0.0 };
        let nodes_m = [
            nodes(-90.0, 90.0, count, shift(0)),
            nodes(300.0, 480.0, count, shift(1)),
            nodes(0.0, 110.0, count, shift(2)),
        ];
        let [xs, ys, zs] = nodes_m.clone();
        let values = zs
            .iter()
            .flat_map(|&z| ys.iter().map(move |&y| (y, z)))
            .flat_map(|(y, z)| xs.iter().map(move |&x| [x, y, z]))
            .map(|p| velocity(p)[c])
            .collect();
        VolumeComponent { nodes_m, values }
    };
    VolumeSnapshot::new(&[component(0), component(1), component(2)], [OPEN; 3]).unwrap()
}

#[test]
fn linear_fields_are_exact_in_place_and_time_on_staggered_stretched_meshes() {
    each("linear_field", |row| {
        let triple = |names: [&str; 3]| names.map(row);
        let wind = Linear {
            velocity_m_s: triple(["u0_m_s", "v0_m_s", "w0_m_s"]),
            gradient_per_s: [
                triple(["g_xx_per_s", "g_xy_per_s", "g_xz_per_s"]),
                triple(["g_yx_per_s", "g_yy_per_s", "g_yz_per_s"]),
                triple(["g_zx_per_s", "g_zy_per_s", "g_zz_per_s"]),
            ],
            acceleration_m_s2: triple(["du_dt_m_s2", "dv_dt_m_s2", "dw_dt_m_s2"]),
        };
        let (point, time_s) = (triple(["x_m", "y_m", "z_m"]), row("time_s"));
        let expected = triple(["u_m_s", "v_m_s", "w_m_s"]);
        near(at(&wind, point, time_s), expected);
        let series = Series::read(vec![0.0, 4.0, 10.0], 0.0, move |i| {
            Ok(staggered(9, |p| at(&wind, p, [0.0, 4.0, 10.0][i])))
        })
        .unwrap();
        near(at(&series, point, time_s), expected);
    });
}

#[test]
fn a_sampled_field_converges_with_the_third_power_and_is_unknown_outside() {
    let wave = |[x, y, z]: [f64; 3]| {
        let (a, b, c) = (0.05 * x, 0.04 * y, 0.06 * z);
        [
            a.sin() * b.cos() * c.cos(),
            a.cos() * b.sin(),
            (a + b).cos() * c.sin(),
        ]
    };
    let error = |count: usize| {
        let field = staggered(count, wave);
        let mut worst = 0.0_f64;
        for i in 0..400 {
            let part = |step: f64| (f64::from(i) * step).fract();
            let p = [
                -60.0 + 120.0 * part(0.618),
                330.0 + 120.0 * part(0.7548),
                15.0 + 80.0 * part(0.5698),
            ];
            let (found, expected) = (at(&field, p, 0.0), wave(p));
            worst = found
                .iter()
                .zip(expected)
                .map(|(f, e)| (f - e).abs())
                .fold(worst, f64::max);
        }
        worst
    };
    let (coarse, fine) = (error(25), error(49));
    let order = (coarse / fine).log2();
    assert!(order > 2.7 && fine < 2e-3, "{order} {coarse} {fine}");
    let field = staggered(9, wave);
    assert!(at(&field, [200.0, 400.0, 50.0], 0.0)[0].is_nan());
}

/// What the air carries at a place.
fn carried(wind: &dyn Wind, point: [f64; 3], time_s: f64) -> f64 {
    let mut out = [0.0];
    wind.scalar_into(&[point], time_s, &mut out).unwrap();
    out[0]
}

#[test]
fn a_linear_scalar_is_exact_in_place_and_time_flat_at_walls_and_the_first_of_a_sum() {
    let amount =
        |[x, y, z]: [f64; 3], time_s: f64| 2.0 + 0.01 * x - 0.003 * y + 0.02 * z + 0.1 * time_s;
    let scalar = |of: &dyn Fn([f64; 3]) -> f64| {
        let nodes_m = [
            nodes(-90.0, 90.0, 7, 0.0),
            nodes(300.0, 480.0, 8, 0.0),
            nodes(5.0, 115.0, 9, 0.0),
        ];
        let [xs, ys, zs] = nodes_m.clone();
        let rows = zs.iter().flat_map(|&z| ys.iter().map(move |&y| (y, z)));
        let values = rows
            .flat_map(|(y, z)| xs.iter().map(move |&x| [x, y, z]))
            .map(of)
            .collect();
        VolumeComponent { nodes_m, values }
    };
    let series = move |offset: f64| {
        Series::read(vec![0.0, 4.0, 10.0], 0.0, move |i| {
            staggered(9, |_| [1.0; 3]).with_scalar(
                &scalar(&|p| offset + amount(p, [0.0, 4.0, 10.0][i])),
                [OPEN; 3],
            )
        })
        .unwrap()
    };
    let point = [12.0, 377.0, 41.0];
    assert!((carried(&series(0.0), point, 5.5) - amount(point, 5.5)).abs() < 1e-12);
    assert!(carried(&series(0.0), [200.0, 377.0, 41.0], 5.5).is_nan());
    assert!(
        carried(&staggered(9, |_| [1.0; 3]), point, 0.0).is_nan()
            && carried(&Sum::default(), point, 0.0).is_nan()
    );
    let sum = Sum {
        winds: vec![
            Box::<Sum>::default(),
            Box::new(series(3.0)),
            Box::new(series(0.0)),
        ],
    };
    assert!((carried(&sum, point, 5.5) - amount(point, 5.5) - 3.0).abs() < 1e-12);
    // Below the lowest node, 5 m up, a wall mirrors it, with or without friction; the velocity sticks to one of them.
    for low in [
        Side::SlipWall { position_m: 0.0 },
        Side::NoSlipWall {
            position_m: 0.0,
            velocity_m_s: [0.0; 3],
        },
    ] {
        let edges = [
            OPEN,
            OPEN,
            Edges::Bounded {
                low,
                high: Side::Open,
            },
        ];
        let walled = staggered(9, |_| [1.0; 3])
            .with_scalar(&scalar(&|[_, y, _]| y), edges)
            .unwrap();
        let near_wall = [12.0, 377.0, 1.0];
        assert!(
            (carried(&walled, near_wall, 0.0) - 377.0).abs() < 1e-10,
            "{low:?}"
        );
    }
}

#[test]
fn a_series_reads_each_field_once_and_keeps_two() {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};
    let read = Arc::new(AtomicUsize::new(0));
    let counter = Arc::clone(&read);
    let times_s: Vec<f64> = (0..12).map(f64::from).collect();
    let series = Series::read(times_s, 0.0, move |i| {
        counter.fetch_add(1, Ordering::Relaxed);
        Ok(staggered(4, |_| [i as f64; 3]))
    })
    .unwrap();
    for step in 0..220 {
        let time_s = 0.05 * f64::from(step);
        let found = at(&series, [0.0, 400.0, 50.0], time_s)[1];
        assert!((found - time_s).abs() < 1e-12, "{time_s} {found}");
    }
    assert_eq!(read.load(Ordering::Relaxed), 12);
    let mut out = [[0.0; 3]];
    assert!(series.velocity_into(&[[0.0; 3]], 11.5, &mut out).is_err());
}
