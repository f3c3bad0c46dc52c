//! Winds from beams: tables of linear winds of independent origin, and the closed forms of the errors of noise.

use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};
use wakescope_estimate::wind_profile::{fit_wind, swing};

/// Rows of a table: the name of the case, and numbers by their columns.
fn rows(name: &str) -> Vec<(String, impl Fn(&str) -> f64)> {
    let path = format!(
        "{}/../../tests/reference/scans/{name}.csv",
        env!("CARGO_MANIFEST_DIR")
    );
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<String> = lines
        .next()
        .unwrap()
        .split(',')
        .map(str::to_owned)
        .collect();
    lines
        .map(|line| {
            let (header, cells) = (
                header.clone(),
                line.split(',').map(str::to_owned).collect::<Vec<_>>(),
            );
            let case = cells[0].clone();
            (case, move |column: &str| {
                cells[header.iter().position(|h| h == column).unwrap()]
                    .parse()
                    .unwrap()
            })
        })
        .collect()
}

fn direction(azimuth_rad: f64, elevation_rad: f64) -> [f64; 3] {
    let ((sin, cos), (sin_el, cos_el)) = (azimuth_rad.sin_cos(), elevation_rad.sin_cos());
    [cos_el * cos, cos_el * sin, sin_el]
}

#[test]
fn a_sine_fit_of_linear_winds_gives_what_the_table_says() {
    let beams = rows("vad_beams");
    let harmonics = rows("vad_harmonics");
    assert!(harmonics.len() > 20);
    for (case, row) in harmonics {
        let own: Vec<_> = beams
            .iter()
            .filter(|beam| {
                let (name, of) = beam;
                *name == case
                    && ["elevation_rad", "range_m"]
                        .iter()
                        .all(|key| of(key) == row(key))
            })
            .collect();
        assert_eq!(own.len(), 12);
        let directions: Vec<[f64; 3]> = own
            .iter()
            .map(|(_, of)| direction(of("azimuth_rad"), of("elevation_rad")))
            .collect();
        let seen: Vec<f64> = own
            .iter()
            .map(|(_, of)| of("radial_velocity_m_s"))
            .collect();
        let fit = fit_wind(&directions, &seen).unwrap().unwrap();
        let expected = ["vad_u_m_s", "vad_v_m_s", "vad_w_m_s"].map(&row);
        for (found, expected) in fit.velocity_m_s.iter().zip(expected) {
            assert!(
                (found - expected).abs() < 1e-9 * expected.abs().max(1.0),
                "{case} {found} {expected}"
            );
        }
        // What is left are the second harmonics: half of the sum of their squares, over twelve beams of which three are spent.
        let second = 0.5 * (row("a2_m_s").powi(2) + row("b2_m_s").powi(2));
        assert!(
            (fit.residual_m_s.powi(2) - second * 12.0 / 9.0).abs() < 1e-9,
            "{case}"
        );
    }
}

#[test]
fn beam_swinging_of_linear_winds_gives_what_the_table_says() {
    for (case, row) in rows("dbs") {
        let beams = ["north_m_s", "east_m_s", "south_m_s", "west_m_s"].map(&row);
        let found = swing(row("elevation_rad"), beams).unwrap();
        for (found, expected) in found
            .iter()
            .zip(["u_m_s", "v_m_s", "w_from_four_m_s"].map(&row))
        {
            assert!(
                (found - expected).abs() < 1e-9 * expected.abs().max(1.0),
                "{case} {found} {expected}"
            );
        }
    }
    assert!(swing(0.0, [1.0; 4]).is_err() && swing(f64::NAN, [1.0; 4]).is_err());
}

/// Errors of white noise: `sigma sqrt(2/N)/cos` of u and v, `sigma/(sqrt(N) sin)` of w; of four beams `sigma/(sqrt(2) cos)` and
/// `sigma/(2 sin)`.
#[test]
fn errors_of_noise_are_those_of_the_closed_forms_within_three_standard_errors() {
    const TRIALS: usize = 4000;
    let (elevation_rad, sigma, wind) = (1.1f64, 0.7, [6.0, -3.0, 0.2]);
    let (sin, cos) = elevation_rad.sin_cos();
    let dot = |a: [f64; 3]| a[0] * wind[0] + a[1] * wind[1] + a[2] * wind[2];
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    for beams in [4usize, 24] {
        let turn = |k: usize| std::f64::consts::TAU * k as f64 / beams as f64;
        let directions: Vec<[f64; 3]> = (0..beams)
            .map(|k| direction(turn(k), elevation_rad))
            .collect();
        let n = beams as f64;
        let expected = [
            sigma * (2.0 / n).sqrt() / cos,
            sigma * (2.0 / n).sqrt() / cos,
            sigma / (n.sqrt() * sin),
        ];
        let mut squares = [[0.0; 3]; 2];
        let mut residual = 0.0;
        for _ in 0..TRIALS {
            let seen: Vec<f64> = directions
                .iter()
                .map(|e| dot(*e) + sigma * normal())
                .collect();
            let fit = fit_wind(&directions, &seen).unwrap().unwrap();
            for d in 0..3 {
                squares[0][d] += (fit.velocity_m_s[d] - wind[d]).powi(2) / TRIALS as f64;
                assert!(
                    (sigma * fit.unit_covariance[d][d].sqrt() / expected[d] - 1.0).abs() < 1e-9
                );
            }
            residual += fit.residual_m_s.powi(2) / TRIALS as f64;
            if let [north, east, south, west] = seen[..] {
                let found = swing(elevation_rad, [north, east, south, west]).unwrap();
                for d in 0..3 {
                    squares[1][d] += (found[d] - wind[d]).powi(2) / TRIALS as f64;
                }
            }
        }
        let three = 3.0 * (2.0 / TRIALS as f64).sqrt();
        for (d, expected) in expected.iter().enumerate() {
            assert!(
                (squares[0][d] / expected.powi(2) - 1.0).abs() < three,
                "{beams} {d} {squares:?}"
            );
            assert!(
                beams > 4 || (squares[1][d] / expected.powi(2) - 1.0).abs() < three,
                "{d} {squares:?}"
            );
        }
        assert!(
            (residual / sigma.powi(2) - 1.0).abs() < three * (n / (n - 3.0)).sqrt(),
            "{residual}"
        );
    }
}

#[test]
fn beams_without_velocity_are_left_out_and_a_plane_of_beams_gives_no_wind() {
    let wind = [4.0, -2.0, 0.5];
    let directions: Vec<[f64; 3]> = (0..8).map(|k| direction(f64::from(k) * 0.7, 1.0)).collect();
    let mut seen: Vec<f64> = directions
        .iter()
        .map(|e| e[0] * wind[0] + e[1] * wind[1] + e[2] * wind[2])
        .collect();
    (seen[1], seen[6]) = (f64::NAN, f64::NAN);
    let fit = fit_wind(&directions, &seen).unwrap().unwrap();
    assert!(
        fit.beams == 6
            && fit
                .velocity_m_s
                .iter()
                .zip(wind)
                .all(|(a, b)| (a - b).abs() < 1e-12)
    );
    let plane: Vec<[f64; 3]> = (0..8).map(|k| direction(0.3, f64::from(k) * 0.1)).collect();
    assert_eq!(fit_wind(&plane, &[1.0; 8]).unwrap(), None);
    assert_eq!(fit_wind(&directions[..2], &seen[..2]).unwrap(), None);
    assert!(fit_wind(&directions, &seen[..3]).is_err());
}
