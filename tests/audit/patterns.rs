//! Scans in three dimensions: directions and places (G1), what a moving lidar sees (G2), the winds of VAD and DBS, their files.

use super::air::velocity_m_s;
use super::draw;
use super::draw_air;
use super::eddies::Eddies;
use super::fields;
use super::ledger::Ledger;
use super::program::Bench;
use super::random::Random;
use super::scene::Scene;
use std::f64::consts::{FRAC_PI_2, PI};

/// Azimuth and elevation of each line.
fn lines(s: &Scene) -> Vec<(f64, f64)> {
    let f = |key: &str| s.f(&format!("scan.pattern.{key}"));
    match s.s("scan.pattern.kind").as_str() {
        "ppi" => {
            let (low, high, step) = (
                f("azimuth_min_rad"),
                f("azimuth_max_rad"),
                f("azimuth_step_rad"),
            );
            let count = ((high - low) / step + 1e-9).floor() as usize + 1;
            let sweep = |e: f64| (0..count).map(move |i| (low + i as f64 * step, e));
            s.list("scan.pattern.elevations_rad")
                .into_iter()
                .flat_map(sweep)
                .collect()
        }
        "vad" => {
            let beams = f("beams");
            (0..beams as usize)
                .map(|i| (2.0 * PI * i as f64 / beams, f("elevation_rad")))
                .collect()
        }
        "dbs" => (0..4)
            .map(|i| (FRAC_PI_2 * f64::from(i), f("elevation_rad")))
            .chain([(f64::NAN, FRAC_PI_2)])
            .collect(),
        "axial" => {
            let ahead = flight_rad(s)
                + if s.s("scan.pattern.towards") == "minus_x" {
                    PI
                } else {
                    0.0
                };
            let elevations = steps(s, "scan.elevation");
            let row = |(i, e): (usize, f64)| {
                let mut row: Vec<_> = steps(s, "scan.pattern.azimuth")
                    .into_iter()
                    .map(|beside| (ahead + beside, e))
                    .collect();
                if i % 2 == 1 {
                    row.reverse();
                }
                row
            };
            elevations.into_iter().enumerate().flat_map(row).collect()
        }
        _ => vec![(s.f("scan.azimuth_rad"), f("elevation_rad")); f("lines") as usize],
    }
}

/// From the lowest to the highest value of three keys.
fn steps(s: &Scene, stem: &str) -> Vec<f64> {
    let [low, high, step] = ["min", "max", "step"].map(|end| s.f(&format!("{stem}_{end}_rad")));
    (0..=((high - low) / step + 1e-9).floor() as usize)
        .map(|i| low + i as f64 * step)
        .collect()
}

/// Lines of a list, which are written to `l.csv`.
fn listed(r: &mut Random, bench: &Bench) -> Vec<(f64, f64)> {
    let lines: Vec<_> = (0..r.whole(2, 8))
        .map(|_| (r.between(0.0, 6.2), r.between(0.05, 1.5)))
        .collect();
    let rows: String = lines
        .iter()
        .map(|(azimuth, elevation)| format!("{azimuth:?},{elevation:?}\n"))
        .collect();
    bench.write("l.csv", &format!("azimuth_rad,elevation_rad\n{rows}"));
    lines
}

pub(crate) fn hold(r: &mut Random, bench: &Bench, ledger: &mut Ledger) {
    let mut s = Scene::default();
    s.set("seed", r.whole(1, 1_000_000))
        .set("outputs.svg", false)
        .set("outputs.png", false)
        .set("outputs.flow", false);
    s.set("outputs.profile_points", 2)
        .set("scan.pulses_per_line", r.whole(1, 4))
        .set("scan.realisations", 2);
    s.number("scan.range_min_m", 100.0)
        .number("scan.range_max_m", 220.0)
        .number("scan.lidar_height_m", 20.0);
    s.set("estimator.gate_step_samples", 25);
    draw::fixed_ratio(&mut s, 15.0);
    s.word("flow.kind", "linear").set(
        "flow.velocity_m_s",
        format!(
            "[{:?}, {:?}, 0.2]",
            r.between(-4.0, 4.0),
            r.between(-4.0, 4.0)
        ),
    );
    for key in ["gradient_u_per_s", "gradient_v_per_s", "gradient_w_per_s"] {
        let mut g = || r.between(-5e-3, 5e-3);
        let list = format!("[{:?}, {:?}, {:?}]", g(), g(), g());
        s.set(&format!("flow.{key}"), list);
    }
    if r.chance(0.25) {
        draw_air::add(&mut s, &[("eddies", draw_air::eddies(r, false))]);
    }
    let kind = r.pick(&["ppi", "vad", "dbs", "stare", "axial", "list"]);
    s.word("scan.pattern.kind", kind);
    match kind {
        "ppi" => s
            .set("scan.pattern.elevations_rad", "[0.05, 0.2]")
            .number("scan.pattern.azimuth_min_rad", 1.4)
            .number("scan.pattern.azimuth_max_rad", 1.6)
            .number("scan.pattern.azimuth_step_rad", 0.02),
        "vad" => s
            .number("scan.pattern.elevation_rad", r.between(0.6, 1.3))
            .set("scan.pattern.beams", r.whole(4, 12)),
        "dbs" => s.number("scan.pattern.elevation_rad", r.between(0.9, 1.3)),
        "axial" => s
            .number("scan.elevation_min_rad", 0.06)
            .number("scan.elevation_max_rad", 0.2)
            .number("scan.elevation_step_rad", 0.06)
            .number("scan.pattern.azimuth_min_rad", -0.04)
            .number("scan.pattern.azimuth_max_rad", 0.03)
            .number("scan.pattern.azimuth_step_rad", 0.02)
            .word("scan.pattern.towards", r.pick(&["plus_x", "minus_x"])),
        "list" => s.word("scan.pattern.file", "l.csv"),
        _ => s
            .number("scan.pattern.elevation_rad", r.between(0.05, 1.2))
            .set("scan.pattern.lines", 5),
    };
    s.number("site.latitude_deg", r.between(-60.0, 60.0))
        .number("site.longitude_deg", r.between(-170.0, 170.0));
    let lines = if kind == "list" {
        listed(r, bench)
    } else {
        lines(&s)
    };
    let (place, flies) = (
        r.chance(0.5),
        ["ppi", "stare", "list"].contains(&kind) && r.chance(0.5),
    );
    if place {
        s.number("scan.lidar.x_m", r.between(-3000.0, 3000.0))
            .number("scan.lidar.y_m", r.between(-800.0, 800.0));
    }
    if flies {
        s.set(
            "scan.lidar.velocity_m_s",
            format!("[70.0, {:?}, 1.0]", r.between(-8.0, 8.0)),
        );
        s.number("scan.lidar.flight_azimuth_rad", r.between(0.0, 3.0));
    }
    // The same wind from a file.
    let is_stored = !place && !flies && r.chance(0.5);
    bench.write(
        "s.toml",
        &if is_stored {
            fields::stored(r, bench, &s)
        } else {
            s.clone()
        }
        .text(),
    );
    if !bench.run(&["check", "s.toml"]).is_good
        || bench
            .must(ledger, &["run", "s.toml", "--out", "o"])
            .is_none()
    {
        return;
    }
    hold_map(ledger, bench, &s, &lines);
    if ["vad", "dbs"].contains(&kind) {
        hold_wind(ledger, bench, &s);
    } else {
        hold_places(ledger, bench, &s);
    }
}

/// North and east of a place of the flow, m.
fn geographic(s: &Scene, p: [f64; 2]) -> [f64; 2] {
    let (sin, cos) = flight_rad(s).sin_cos();
    [p[0] * cos - p[1] * sin, p[0] * sin + p[1] * cos]
}

/// The azimuth of +x; north where nothing else is said.
fn flight_rad(s: &Scene) -> f64 {
    let stated = s.f("scan.lidar.flight_azimuth_rad");
    if stated.is_finite() { stated } else { 0.0 }
}

/// Time of a line and place of the lidar then.
fn lidar(s: &Scene, line: usize) -> (f64, [f64; 3]) {
    let t = super::geometry::line_time_s(s, line);
    let v = s.list("scan.lidar.velocity_m_s");
    let at = [
        s.f("scan.lidar.x_m"),
        s.f("scan.lidar.y_m"),
        s.f("scan.lidar_height_m"),
    ];
    (t, std::array::from_fn(|i| at[i] + v[i] * t))
}

fn hold_map(ledger: &mut Ledger, bench: &Bench, s: &Scene, lines: &[(f64, f64)]) {
    let map = bench.csv(ledger, "o/map.csv");
    let f = |name: &str| map.f(name);
    let gates = map.len() / lines.len();
    ledger.equal(
        "map.csv: rows of a pattern",
        map.len() as f64,
        (gates * lines.len()) as f64,
        0.0,
    );
    let (azimuth, elevation, range, time) = (
        f("azimuth_rad"),
        f("elevation_rad"),
        f("range_m"),
        f("time_s"),
    );
    let (places, exact, pulse) = (
        [f("x_m"), f("y_m"), f("z_m")],
        f("v_exact_m_s"),
        f("v_pulse_m_s"),
    );
    let v = s.list("scan.lidar.velocity_m_s");
    let turbulent_m_s = Eddies::of(s).map_or(0.0, |eddies| 6.0 * eddies.deviation_m_s());
    for row in 0..map.len() {
        let (line, gate) = (row / gates, row % gates);
        let (az, el) = lines[line];
        let apart = if az.is_nan() {
            0.0
        } else {
            (azimuth[row] - az + PI).rem_euclid(2.0 * PI) - PI
        };
        ledger.equal("map.csv: azimuth_rad, of a pattern", apart, 0.0, 1e-9);
        ledger.equal(
            "map.csv: elevation_rad, of a pattern",
            elevation[row],
            el,
            1e-9,
        );
        let (t, p) = lidar(s, line);
        ledger.equal("map.csv: time_s, of a pattern", time[row], t, 1e-9);
        let from_x = if az.is_nan() { 0.0 } else { az - flight_rad(s) };
        let e = [el.cos() * from_x.cos(), el.cos() * from_x.sin(), el.sin()];
        let at: [f64; 3] = std::array::from_fn(|i| p[i] + range[gate] * e[i]);
        for (i, name) in ["x_m", "y_m", "z_m"].iter().enumerate() {
            ledger.equal(
                &format!("map.csv: {name}, of a pattern"),
                places[i][row],
                at[i],
                1e-6,
            );
        }
        let u = velocity_m_s(s, at, t);
        let right: f64 = (0..3).map(|i| e[i] * (u[i] - v[i])).sum();
        ledger.equal(
            "map.csv: v_exact_m_s, of a pattern",
            exact[row],
            right,
            1e-7 + turbulent_m_s,
        );
        // A linear wind is its own mean.
        ledger.equal(
            "map.csv: v_pulse_m_s, of a pattern",
            pulse[row],
            right,
            1e-6 + turbulent_m_s,
        );
        ledger.equal("map.csv: x_m", places[0][row], at[0], 1e-6);
    }
}

/// wind.csv: the wind of the beams against that of a linear wind, within the errors that it states, and the wind itself.
fn hold_wind(ledger: &mut Ledger, bench: &Bench, s: &Scene) {
    let table = bench.csv(ledger, "o/wind.csv");
    let range = bench.csv(ledger, "o/map.csv").f("range_m");
    let sin = s.f("scan.pattern.elevation_rad").sin();
    let row = |key: &str| s.list(&format!("flow.{key}"));
    let g = [
        row("gradient_u_per_s"),
        row("gradient_v_per_s"),
        row("gradient_w_per_s"),
    ];
    let (t, p) = lidar(s, 0);
    let here = velocity_m_s(s, p, t);
    for i in 0..table.len() {
        let f = |name: &str| table.f(name)[i];
        let r = range[i];
        ledger.equal("wind.csv: height_m", f("height_m"), r * sin, 1e-6);
        let above = velocity_m_s(s, [p[0], p[1], p[2] + r * sin], t);
        let [north, east] = geographic(s, [above[0], above[1]]);
        for (name, right) in [("east", east), ("north", north), ("up", above[2])] {
            let name = format!("{name}_true_m_s");
            ledger.equal(&format!("wind.csv: {name}"), f(&name), right, 1e-6);
        }
        // The harmonics of Browning and Wexler.
        let u = here[0] + r * sin * (g[0][2] + g[2][0]);
        let v = here[1] + r * sin * (g[1][2] + g[2][1]);
        let [north, east] = geographic(s, [u, v]);
        for (name, right) in [("east", east), ("north", north)] {
            let std = f(&format!("{name}_std_m_s"));
            let name = format!("{name}_m_s");
            ledger.equal(
                &format!("wind.csv: {name}"),
                f(&name),
                right,
                0.1 + 5.0 * std,
            );
        }
    }
}

/// Latitude, longitude and drift of map.nc.
fn hold_places(ledger: &mut Ledger, bench: &Bench, s: &Scene) {
    let mut nc = bench.netcdf(ledger, "o/map.nc");
    let (site, earth_m) = (s.f("site.latitude_deg"), 6_371_000.0);
    let (latitude, longitude) = (nc.f("latitude"), nc.f("longitude"));
    for i in 0..latitude.len() {
        let (_, p) = lidar(s, i);
        let [north, east] = geographic(s, [p[0], p[1]]);
        let right = (north / earth_m).to_degrees();
        ledger.equal(
            "map.nc: latitude, of the telescope",
            latitude[i],
            site + right,
            5e-3 * right.abs() + 1e-6,
        );
        let right = (east / (earth_m * site.to_radians().cos())).to_degrees();
        let apart = longitude[i] - s.f("site.longitude_deg");
        ledger.equal(
            "map.nc: longitude, of the telescope",
            apart,
            right,
            5e-3 * right.abs() + 1e-6,
        );
    }
    let v = s.list("scan.lidar.velocity_m_s");
    let (heading, drift) = (nc.f("heading"), nc.f("drift"));
    if v[0] != 0.0 && !heading.is_empty() {
        let track = (flight_rad(s) + v[1].atan2(v[0])).to_degrees();
        let apart = (heading[0] + drift[0] - track + 180.0).rem_euclid(360.0) - 180.0;
        ledger.equal("map.nc: heading and drift make the track", apart, 0.0, 1e-3);
        let [north, east] = geographic(s, [v[0], v[1]]);
        for (name, right) in [
            ("northward_velocity", north),
            ("eastward_velocity", east),
            ("vertical_velocity", v[2]),
        ] {
            let found = nc.f(name).first().copied().unwrap_or(f64::NAN);
            ledger.equal(&format!("map.nc: {name}"), found, right, 1e-4);
        }
    }
}
