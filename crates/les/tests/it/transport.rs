//! Pairs that decay and move, against tables of an independent program in `tests/reference/air`.

use approx::{assert_abs_diff_eq, assert_relative_eq};
use wakescope_les::winds::decay::{self, DecayLaw};
use wakescope_les::winds::{Eddies, Linear, Mode, Transport, TransportedPair};
use wakescope_les::{CirculationProfile, Error, Ground, Motion, VortexPair, Wind};

/// Rows of a table without its head.
fn rows(name: &str) -> Vec<Vec<String>> {
    let path = format!(
        "{}/../../tests/reference/air/{name}.csv",
        env!("CARGO_MANIFEST_DIR")
    );
    let text = std::fs::read_to_string(path).unwrap();
    let lines = text.lines().filter(|line| !line.starts_with('#')).skip(1);
    lines
        .map(|line| line.split(',').map(str::to_owned).collect())
        .collect()
}

fn numbers(row: &[String]) -> Vec<f64> {
    row.iter().map(|cell| cell.parse().unwrap()).collect()
}

/// A pair whose units of length, velocity and time are 1.
fn unit_pair(height_m: f64, ground: Ground) -> VortexPair {
    VortexPair {
        circulation_m2_s: std::f64::consts::TAU,
        spacing_m: 1.0,
        core_radius_m: 0.05,
        lateral_position_m: 0.0,
        height_m,
        ground,
        profile: CirculationProfile::Algebraic,
        motion: Motion::Frozen,
    }
}

const NEITHER: Transport = Transport {
    law: DecayLaw::TwoPhase {
        slow: 0.0,
        fast: 0.0,
    },
    lifetime_tau: 1.0,
    n_star: 0.0,
    rebound: false,
};

/// Wind over height of the table of paths: a logarithm, at most 0.3.
struct Logarithmic;

impl Wind for Logarithmic {
    fn velocity_into(
        &self,
        points_m: &[[f64; 3]],
        _time_s: f64,
        out_m_s: &mut [[f64; 3]],
    ) -> Result<(), Error> {
        for (point_m, out) in points_m.iter().zip(out_m_s) {
            let lateral_m_s = 0.3 * (1.0 + point_m[2] / 0.01).ln() / 101_f64.ln();
            *out = [0.0, lateral_m_s, 0.0];
        }
        Ok(())
    }

    fn max_gradient_per_s(&self, _time_s: f64) -> f64 {
        f64::NAN
    }
}

#[test]
fn lifetimes_and_final_descents_are_those_of_the_table() {
    for row in rows("lifetime") {
        let row = numbers(&row);
        let (eps_star, n_star) = (row[0], row[1]);
        let lifetime_tau = decay::lifetime(eps_star, n_star).unwrap();
        assert_relative_eq!(
            decay::sarpkaya_lifetime(eps_star).unwrap(),
            row[2],
            max_relative = 1e-6
        );
        assert_relative_eq!(lifetime_tau, row[3], max_relative = 1e-6);
        let of_cocip = decay::holzaepfel_final_descent(eps_star, n_star);
        assert_relative_eq!(of_cocip, row[4], max_relative = 1e-6);
        let transport = Transport {
            law: DecayLaw::SARPKAYA,
            lifetime_tau,
            n_star,
            rebound: false,
        };
        let pair = unit_pair(0.0, Ground::None);
        let path = TransportedPair::new(pair, transport, None, None, 40.0).unwrap();
        let [left, right] = path.primary_vortices(40.0).unwrap();
        assert_relative_eq!(-left.height_m, row[6], max_relative = 1e-3);
        assert_eq!(left.height_m, right.height_m);
    }
}

#[test]
fn descent_speed_and_circulation_of_both_laws_are_those_of_the_table() {
    let rows = rows("decay");
    let mut compared = 0;
    for case in rows.chunk_by(|a, b| a[..3] == b[..3]) {
        let law = match case[0][0].as_str() {
            "sarpkaya" => DecayLaw::SARPKAYA,
            _ => DecayLaw::TWO_PHASE,
        };
        let first = numbers(&case[0][1..]);
        let (eps_star, n_star) = (first[0], first[1]);
        let transport = Transport {
            law,
            lifetime_tau: decay::lifetime(eps_star, n_star).unwrap(),
            n_star,
            rebound: false,
        };
        let pair = unit_pair(0.0, Ground::None);
        let path = TransportedPair::new(pair, transport, None, None, 11.0).unwrap();
        let depth = |tau: f64| -path.primary_vortices(tau).unwrap()[1].height_m;
        for row in case {
            let row = numbers(&row[1..]);
            let tau = row[2];
            assert_abs_diff_eq!(depth(tau), row[3], epsilon = 1e-4);
            let speed = (depth(tau + 1e-3) - depth(tau - 1e-3)) / 2e-3;
            assert_abs_diff_eq!(speed, row[4], epsilon = 1e-4);
            let ratio =
                path.primary_vortices(tau).unwrap()[1].circulation_m2_s / pair.circulation_m2_s;
            assert_relative_eq!(ratio, row[5], max_relative = 1e-6);
            compared += 1;
        }
    }
    assert_eq!(compared, 330);
}

#[test]
fn centres_over_the_ground_are_those_of_the_table_to_tau_5() {
    let rows = rows("ground");
    for case in rows.chunk_by(|a, b| a[0] == b[0]) {
        let first = numbers(&case[0][1..]);
        let carrier: Option<&dyn Wind> = (first[1] != 0.0).then_some(&Logarithmic);
        let transport = Transport {
            rebound: case[0][0] != "inviscid",
            ..NEITHER
        };
        let pair = unit_pair(first[0], Ground::Image);
        let path = TransportedPair::new(pair, transport, carrier, None, 5.0).unwrap();
        for row in case {
            let row = numbers(&row[1..]);
            let found = path.vortices(row[2]).unwrap();
            let born = if row[7].is_nan() { 2 } else { 4 };
            assert_eq!(found.len(), born, "{} {}", case[0][0], row[2]);
            for (vortex, place) in found.iter().zip(row[3..].chunks(2)) {
                assert_abs_diff_eq!(vortex.lateral_position_m, place[0], epsilon = 1e-6);
                assert_abs_diff_eq!(vortex.height_m, place[1], epsilon = 1e-6);
            }
        }
    }
}

#[test]
fn between_stored_times_the_path_is_that_of_its_velocities() {
    let transport = Transport {
        rebound: true,
        ..NEITHER
    };
    let path = |last_tau: f64| {
        TransportedPair::new(
            unit_pair(1.0, Ground::Image),
            transport,
            None,
            None,
            last_tau,
        )
        .unwrap()
    };
    let whole = path(3.0);
    // A path that ends at a time has it as a stored one.
    for tau in [0.777, 0.951, 1.003, 1.237, 2.471] {
        let ending = path(tau).vortices(tau).unwrap();
        for (a, b) in whole.vortices(tau).unwrap().iter().zip(&ending) {
            assert_abs_diff_eq!(a.lateral_position_m, b.lateral_position_m, epsilon = 1e-6);
            assert_abs_diff_eq!(a.height_m, b.height_m, epsilon = 1e-6);
        }
    }
}

#[test]
fn a_transported_pair_without_decay_makes_the_wind_of_the_inviscid_one() {
    let pair = VortexPair {
        motion: Motion::Inviscid,
        ground: Ground::None,
        ..unit_pair(3.0, Ground::None)
    };
    let path = TransportedPair::new(pair, NEITHER, None, None, 2.0).unwrap();
    let points_m = [[0.0, 0.3, 2.0], [5.0, -0.6, 1.4]];
    let mut found = [[0.0; 3]; 2];
    let mut expected = [[0.0; 3]; 2];
    path.velocity_into(&points_m, 1.5, &mut found).unwrap();
    pair.velocity_into(&points_m, 1.5, &mut expected).unwrap();
    for (a, b) in found.as_flattened().iter().zip(expected.as_flattened()) {
        assert_abs_diff_eq!(a, b, epsilon = 1e-9);
    }
    let bound = pair.max_gradient_per_s(1.5);
    assert_relative_eq!(path.max_gradient_per_s(1.5), bound, max_relative = 1e-9);
}

#[test]
fn a_uniform_wind_carries_the_pair_and_decay_speaks_for_each_vortex() {
    let transport = Transport {
        rebound: true,
        lifetime_tau: 9.0,
        law: DecayLaw::TWO_PHASE,
        n_star: 0.3,
    };
    let pair = unit_pair(1.5, Ground::Image);
    let wind = Linear::uniform([7.0, 0.25, 0.0]).unwrap();
    let still = TransportedPair::new(pair, transport, None, None, 4.0).unwrap();
    let carried = TransportedPair::new(pair, transport, Some(&wind), None, 4.0).unwrap();
    for tau in [1.0, 2.5, 4.0] {
        let moved = carried.vortices(tau).unwrap();
        for (a, b) in moved.iter().zip(still.vortices(tau).unwrap()) {
            let shift_m = a.lateral_position_m - b.lateral_position_m;
            assert_abs_diff_eq!(shift_m, 0.25 * tau, epsilon = 1e-9);
            assert_abs_diff_eq!(a.height_m, b.height_m, epsilon = 1e-9);
        }
    }
    // The slow phase ends 1.5 after the birth, then the circulation falls by 0.26 per tau.
    let birth_tau = still.birth_s()[1];
    let ratio = |tau: f64| -still.primary_vortices(tau).unwrap()[0].circulation_m2_s;
    let rate = (ratio(3.95) / ratio(3.85)).ln() / -0.1;
    assert!(birth_tau + 1.5 < 3.85, "{birth_tau}");
    assert_abs_diff_eq!(rate, 0.26, epsilon = 1e-9);
}

#[test]
fn long_eddies_move_all_vortices_as_the_integral_of_their_velocity_and_short_ones_do_not() {
    let wave = |wavenumber_rad_m: f64| Mode {
        wavenumber_rad_m: [wavenumber_rad_m, 0.0, 0.0],
        real_m_s: [0.0, 0.3, -0.1],
        frequency_rad_s: 0.7,
        ..Mode::default()
    };
    let both = Eddies::new(vec![wave(1e-3), wave(3.5)]).unwrap();
    // Waves longer than two spacings have fewer than pi radians a spacing.
    let long = both.longer_than(2.0).unwrap();
    assert_eq!(long.modes(), [wave(1e-3)]);
    let pair = unit_pair(5.0, Ground::None);
    let still = TransportedPair::new(pair, NEITHER, None, None, 4.0).unwrap();
    let moved = TransportedPair::new(pair, NEITHER, None, Some(&long), 4.0).unwrap();
    for tau in [0.5, 2.0, 4.0] {
        let integral = f64::sin(0.7 * tau) / 0.7;
        let there = moved.primary_vortices(tau).unwrap();
        for (a, b) in there.iter().zip(still.primary_vortices(tau).unwrap()) {
            let shift_m = a.lateral_position_m - b.lateral_position_m;
            assert_abs_diff_eq!(shift_m, 0.3 * integral, epsilon = 1e-9);
            let risen_m = a.height_m - b.height_m;
            assert_abs_diff_eq!(risen_m, -0.1 * integral, epsilon = 1e-9);
        }
    }
    let none = Eddies::new(Vec::new()).unwrap();
    assert!(none.longer_than(0.0).is_err());
}

#[test]
fn wrong_numbers_and_times_off_the_path_are_refused() {
    let pair = unit_pair(1.0, Ground::Image);
    let field = |pair: VortexPair, transport: Transport| match TransportedPair::new(
        pair, transport, None, None, 1.0,
    )
    .err()
    {
        Some(Error::OutOfRange { field, .. }) => field,
        other => panic!("{other:?}"),
    };
    let negative = Transport {
        n_star: -1.0,
        ..NEITHER
    };
    let dead = Transport {
        lifetime_tau: 0.0,
        ..NEITHER
    };
    let still = VortexPair {
        circulation_m2_s: 0.0,
        ..pair
    };
    assert_eq!(field(pair, negative), "n_star");
    assert_eq!(field(pair, dead), "lifetime_tau");
    assert_eq!(field(still, NEITHER), "circulation_m2_s");
    let path = TransportedPair::new(pair, NEITHER, None, None, 1.0).unwrap();
    for time_s in [-0.01, 1.01, f64::NAN] {
        assert!(path.vortices(time_s).is_err(), "{time_s}");
    }
    assert_eq!(path.last_time_s(), 1.0);
}
