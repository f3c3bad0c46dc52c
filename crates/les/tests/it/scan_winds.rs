//! Winds in three dimensions against tables of independent origin, and against closed forms on meshes.

use wakescope_les::winds::{
    AlongFlight, Edges, Linear, Series, Side, VolumeComponent, VolumeSnapshot,
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
fn the_wake_is_as_old_as_the_table_says_and_absent_before_the_aircraft() {
    each("age_along_flight", |row| {
        let wake = pair(Motion::Inviscid);
        let wind = AlongFlight::new(
            wake.wind().unwrap(),
            row("aircraft_speed_m_s"),
            row("aircraft_x_at_t0_m"),
        )
        .unwrap();
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
