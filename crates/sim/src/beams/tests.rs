//! Beams against tables of independent origin.

use super::path::{self, Angles, Stop, SweepMode};
use super::schedule::{Mount, Schedule};
use super::{Direction, Head};
use crate::io::csv_input::TextTable;
use wakescope_les::winds::Linear;
use wakescope_les::{CirculationProfile, Ground, Motion, VortexPair, Wind};

/// The rows of a table by the names of their columns.
fn rows(name: &str) -> Vec<impl Fn(&str) -> f64> {
    let path = format!(
        "{}/../../tests/reference/scans/{name}.csv",
        env!("CARGO_MANIFEST_DIR")
    );
    let table = TextTable::read(std::path::Path::new(&path)).unwrap();
    let count = table.rows.len();
    assert!(count > 2, "{name}");
    (0..count)
        .map(|row| {
            let table = table.clone();
            move |column: &str| {
                let at = table.column(column).unwrap_or_else(|| panic!("{column}"));
                // Names of cases count as numbers.
                let value = table.number(row, at);
                let name = || {
                    table.rows[row][at]
                        .bytes()
                        .fold(0.0, |sum, b| 3.0 * sum + f64::from(b))
                };
                if value.is_nan() { name() } else { value }
            }
        })
        .collect()
}

fn near(found: f64, expected: f64) {
    assert!(
        (found - expected).abs() < 1e-9 * expected.abs().max(1.0),
        "{found} {expected}"
    );
}

const HERE: Mount = Mount {
    position_m: [0.0; 3],
    velocity_m_s: [0.0; 3],
    reference_rad: (0.0, 0.0),
};

fn head(rate_rad_s: f64, acceleration_rad_s2: f64) -> Head {
    Head {
        rate_rad_s,
        acceleration_rad_s2,
        dead_time_s: 0.0,
    }
}

#[test]
fn directions_and_what_a_moving_lidar_sees_are_those_of_the_table() {
    for row in rows("directions") {
        let direction = Direction::new(
            row("azimuth_rad") - row("flow_azimuth_rad"),
            row("elevation_rad"),
        );
        let xyz = |names: [&str; 3]| names.map(&row);
        for (found, expected) in direction.0.iter().zip(xyz(["e_x", "e_y", "e_z"])) {
            near(*found, expected);
        }
        let from_m = xyz(["lidar_x_m", "lidar_y_m", "lidar_z_m"]);
        let place_m = direction.at_range_m(from_m, row("range_m"));
        for (found, expected) in place_m.iter().zip(xyz(["x_m", "y_m", "z_m"])) {
            near(*found, expected);
        }
        let wind_m_s = xyz(["wind_u_m_s", "wind_v_m_s", "wind_w_m_s"]);
        let lidar_m_s = xyz(["lidar_u_m_s", "lidar_v_m_s", "lidar_w_m_s"]);
        near(
            direction.radial_velocity_m_s(wind_m_s, lidar_m_s),
            row("radial_velocity_m_s"),
        );
    }
    assert_eq!(
        Direction::new(std::f64::consts::FRAC_PI_2, 0.3).0,
        [0.0, 0.3f64.cos(), 0.3f64.sin()]
    );
}

#[test]
fn a_lidar_that_flies_sees_its_own_speed() {
    let pair = VortexPair {
        circulation_m2_s: 500.0,
        spacing_m: 47.0,
        core_radius_m: 2.35,
        lateral_position_m: 0.0,
        height_m: 47.0,
        ground: Ground::None,
        profile: CirculationProfile::Algebraic,
        motion: Motion::Frozen,
    };
    let wind = pair.wind().unwrap();
    for row in rows("airborne") {
        let xyz = |names: [&str; 3]| names.map(&row);
        let mount = Mount {
            position_m: xyz(["start_x_m", "start_y_m", "start_z_m"]),
            velocity_m_s: xyz(["u_m_s", "v_m_s", "w_m_s"]),
            ..HERE
        };
        let stop = Stop {
            time_s: Some(row("time_s")),
            pulses: Some(1),
            ..Stop::new(
                SweepMode::Pointing,
                [row("azimuth_rad"), row("elevation_rad")],
            )
        };
        let jumping = head(f64::INFINITY, f64::INFINITY);
        let scan = Schedule::new(&[stop], 1.0 / 400.0, 1, &jumping, mount).unwrap();
        let beam = scan.beam(0, 0.0);
        near(beam.position_m[0], -1500.0 + 70.0 * row("time_s"));
        let mut v = [[0.0; 3]];
        wind.velocity_into(&[beam.at_range_m(row("range_m"))], beam.time_s, &mut v)
            .unwrap();
        near(
            beam.direction.radial_velocity_m_s(v[0], [0.0; 3]),
            row("radial_wind_m_s"),
        );
        near(
            beam.direction.radial_velocity_m_s(v[0], beam.velocity_m_s),
            row("radial_velocity_seen_m_s"),
        );
    }
}

#[test]
fn the_plane_of_a_line_crosses_a_line_along_x_where_its_beam_would_meet_it() {
    let mount = Mount {
        position_m: [30.0, 120.0, 5.0],
        velocity_m_s: [2.0, -20.0, 0.5],
        reference_rad: (0.4, 0.0),
    };
    let jumping = head(f64::INFINITY, f64::INFINITY);
    for (azimuth_rad, y_m) in [(1.9, 520.0), (1.1, 300.0), (4.9, -400.0)] {
        let stop = Stop {
            time_s: Some(3.0),
            ..Stop::new(SweepMode::Rhi, [azimuth_rad, 0.1])
        };
        let scan = Schedule::new(&[stop], 0.01, 5, &jumping, mount).unwrap();
        let crossing = scan.crossing(0, (y_m, 47.0));
        let beam = scan.middle(0);
        let towards = Direction::new(azimuth_rad - 0.4, crossing.elevation_rad);
        let place_m = towards.at_range_m(beam.position_m, crossing.range_m);
        for (found, expected) in place_m.into_iter().zip([crossing.x_m, y_m, 47.0]) {
            near(found, expected);
        }
        // It is ahead of the lidar.
        assert!(crossing.elevation_rad.cos() > 0.0);
    }
    let along = Stop::new(SweepMode::Rhi, [0.4, 0.1]);
    let scan = Schedule::new(&[along], 0.01, 5, &jumping, mount).unwrap();
    assert!(!scan.crossing(0, (520.0, 47.0)).range_m.is_finite());
}

#[test]
fn the_head_takes_the_time_of_the_table() {
    for row in rows("head_motion") {
        let head = head(row("speed_rad_s"), row("acceleration_rad_s2"));
        near(head.time_s(row("angle_rad")), row("time_s"));
    }
    let jumps = head(f64::INFINITY, f64::INFINITY);
    assert_eq!((jumps.time_s(1.0), jumps.turn_round_s()), (0.0, 0.0));
}

/// The stops of sweeps one after the other.
fn numbered<const N: usize>(sweeps: [Vec<Stop>; N]) -> Vec<Stop> {
    let sweeps = sweeps.into_iter().enumerate();
    sweeps
        .flat_map(|(sweep, stops)| stops.into_iter().map(move |stop| Stop { sweep, ..stop }))
        .collect()
}

#[test]
fn sweeps_back_and_forth_have_the_pulses_of_the_table() {
    for row in rows("back_and_forth") {
        let head = head(row("rate_rad_s"), row("acceleration_rad_s2"));
        let up = path::rhi(1.0, row("low_rad"), row("high_rad"), 1.0, true);
        let mut down = up.clone();
        path::reverse(&mut down);
        let stops = numbered([up.clone(), down, up]);
        let pulses = row("pulses_per_line") as usize;
        let scan = Schedule::new(&stops, 1.0 / row("prf_hz"), pulses, &head, HERE).unwrap();
        let sweep = row("sweep") as usize;
        let lines: Vec<usize> = (0..scan.lines.len())
            .filter(|line| scan.lines[*line].sweep == sweep)
            .collect();
        assert_eq!(lines.len() as f64, row("lines_per_sweep"));
        let line = lines[row("line") as usize];
        let beam = scan.beam(line, row("pulse") - scan.lines[line].tick);
        near(beam.time_s, row("time_s"));
        near(beam.elevation_rad, row("elevation_rad"));
        assert_eq!(beam.azimuth_rad, 1.0);
    }
}

/// Mean and standard deviation over the pulses of a line that turns about a direction.
fn smeared(
    wind: &dyn Wind,
    [centre, rate]: [Angles; 2],
    (pulses, prf_hz): (usize, f64),
    (mount, range_m): (Mount, f64),
) -> (f64, f64) {
    let half = 0.5 * (pulses as f64 - 1.0) / prf_hz;
    let from: Angles = std::array::from_fn(|d| centre[d] - rate[d] * half);
    let speed = rate[0].abs().max(rate[1].abs());
    let long = 2.0 * pulses as f64 / prf_hz;
    let to: Angles = std::array::from_fn(|d| from[d] + rate[d] * long);
    let sweep = Stop {
        to_rad: Some(to),
        ..Stop::new(SweepMode::Sector, from)
    };
    let head = head(speed, f64::INFINITY);
    let scan = Schedule::new(&[sweep], 1.0 / prf_hz, pulses, &head, mount).unwrap();
    let seen: Vec<f64> = (0..pulses)
        .map(|pulse| {
            let beam = scan.beam(0, pulse as f64);
            let mut v = [[0.0; 3]];
            wind.velocity_into(&[beam.at_range_m(range_m)], 0.0, &mut v)
                .unwrap();
            beam.direction.radial_velocity_m_s(v[0], beam.velocity_m_s)
        })
        .collect();
    let mean = seen.iter().sum::<f64>() / pulses as f64;
    (
        mean,
        (seen.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / pulses as f64).sqrt(),
    )
}

#[test]
fn smear_of_uniform_linear_and_vortex_winds_is_that_of_the_tables() {
    for row in rows("smear_uniform") {
        let wind = Linear::uniform([row("wind_x_m_s"), 0.0, 0.0]).unwrap();
        let angles = [
            [row("centre_azimuth_rad"), row("elevation_rad")],
            [row("azimuth_rate_rad_s"), 0.0],
        ];
        let (mean, spread) = smeared(
            &wind,
            angles,
            (row("pulses") as usize, row("prf_hz")),
            (HERE, 100.0),
        );
        near(mean, row("mean_m_s"));
        near(spread, row("spread_m_s"));
    }
    let winds = rows("vad_harmonics");
    for row in rows("smear_linear") {
        let of = winds
            .iter()
            .find(|wind| wind("case") == row("case"))
            .unwrap();
        let triple = |names: [&str; 3]| names.map(of);
        let wind = Linear {
            velocity_m_s: triple(["u0_m_s", "v0_m_s", "w0_m_s"]),
            gradient_per_s: [
                triple(["g_xx_per_s", "g_xy_per_s", "g_xz_per_s"]),
                triple(["g_yx_per_s", "g_yy_per_s", "g_yz_per_s"]),
                triple(["g_zx_per_s", "g_zy_per_s", "g_zz_per_s"]),
            ],
            acceleration_m_s2: [0.0; 3],
        };
        let angles = [
            [std::f64::consts::FRAC_PI_2, row("centre_elevation_rad")],
            [0.0, row("elevation_rate_rad_s")],
        ];
        let timing = (row("pulses") as usize, row("prf_hz"));
        let (mean, spread) = smeared(&wind, angles, timing, (HERE, row("range_m")));
        near(mean, row("mean_m_s"));
        near(spread, row("spread_m_s"));
    }
    for row in rows("smear_vortex") {
        let pair = wakescope_les::VortexPair {
            circulation_m2_s: row("gamma_m2_s"),
            spacing_m: row("b0_m"),
            core_radius_m: row("rc_m"),
            lateral_position_m: row("y0_m"),
            height_m: row("z0_m"),
            ground: Ground::Image,
            profile: wakescope_les::CirculationProfile::Algebraic,
            motion: wakescope_les::Motion::Frozen,
        };
        let wind = pair.wind().unwrap();
        let pulses = row("pulses") as usize;
        let prf_hz = 400.0;
        let rate = row("width_rad") / pulses as f64 * prf_hz;
        let angles = [
            [std::f64::consts::FRAC_PI_2, row("elevation_rad")],
            [0.0, rate],
        ];
        let (mean, _) = smeared(&wind, angles, (pulses, prf_hz), (HERE, row("range_m")));
        near(mean, row("mean_of_pulses_m_s"));
        let (point, _) = smeared(&wind, angles, (1, prf_hz), (HERE, row("range_m")));
        near(point, row("point_m_s"));
    }
}

#[test]
fn each_kind_of_scan_has_its_lines_in_order() {
    let ppi = path::ppi(
        0.1,
        0.0,
        std::f64::consts::TAU,
        std::f64::consts::TAU / 8.0,
        false,
    );
    assert_eq!(
        (ppi.len(), ppi[0].mode),
        (8, SweepMode::AzimuthSurveillance),
        "no line twice"
    );
    let sector = path::ppi(0.1, 0.2, 0.6, 0.1, false);
    assert_eq!(
        (sector.len(), sector[0].mode, sector[0].angles_rad),
        (5, SweepMode::Sector, [0.2, 0.1])
    );
    let rows = path::raster(1.0, &[0.0, 0.1], [-0.1, 0.1, 0.1], false);
    let ends = |sweep: &[Stop]| (sweep[0].angles_rad[0], sweep[2].angles_rad[0]);
    let first = ends(&rows[0]);
    let second = ends(&rows[1]);
    assert!(
        first.0 < first.1 && second.0 > second.1,
        "{first:?} {second:?}"
    );
    let cycles = numbered([path::dbs(1.0), path::dbs(1.0)]);
    let dbs = Schedule::new(&cycles, 1e-3, 100, &head(1.0, f64::INFINITY), HERE).unwrap();
    assert_eq!(dbs.lines.len(), 10);
    // A quarter turn at 1 rad/s between slanted beams: 1571 periods after the 100 pulses of the first.
    assert_eq!(dbs.lines[1].tick, 1671.0);
    assert_eq!(
        dbs.middle(1).direction.0[0],
        0.0,
        "east is across the flight, to the bit"
    );
    let groups: std::collections::HashSet<usize> =
        dbs.lines.iter().map(|line| line.group).collect();
    assert_eq!(groups.len(), 10, "beams apart share no air");
    assert!(dbs.revisit_s().unwrap() > 6.0 && !dbs.is_plane());
}

#[test]
fn stops_that_the_head_cannot_reach_are_named() {
    let stop = |time_s: f64, azimuth_rad: f64| Stop {
        time_s: Some(time_s),
        ..Stop::new(SweepMode::Sector, [azimuth_rad, 0.1])
    };
    let head = head(1.0, f64::INFINITY);
    let scan = |stops: &[Stop]| Schedule::new(stops, 0.01, 50, &head, HERE);
    assert_eq!(
        scan(&[stop(0.0, 0.0), stop(1.0, 0.5)]).unwrap().lines[1].tick,
        100.0
    );
    let (row, reason) = scan(&[stop(0.0, 0.0), stop(0.2, 0.0)]).unwrap_err();
    assert!(
        row == 1 && reason.contains("the end of the line before"),
        "{reason}"
    );
    let (row, reason) = scan(&[stop(0.0, 0.0), stop(0.8, 0.5)]).unwrap_err();
    assert!(
        row == 1 && reason.contains("the head needs 0.500 s"),
        "{reason}"
    );
}
