//! The analytic vortex pair against closed forms, conservation and an independent integration of its path.

use std::f64::consts::PI;

use approx::{assert_abs_diff_eq, assert_relative_eq};
use wakescope_les::analysis::{circulation_m2_s, mean_circulation_5_15_m2_s};
use wakescope_les::winds::Aircraft;
use wakescope_les::{CirculationProfile, Error, Ground, Motion, VortexPair, Wind};

fn heavy() -> VortexPair {
    VortexPair {
        circulation_m2_s: 500.0,
        spacing_m: 47.0,
        core_radius_m: 2.35,
        lateral_position_m: 400.0,
        height_m: 47.0,
        ground: Ground::Image,
        profile: CirculationProfile::Algebraic,
        motion: Motion::Frozen,
    }
}

fn velocity(pair: VortexPair, y_m: f64, z_m: f64, time_s: f64) -> [f64; 3] {
    let mut out = [[0.0; 3]];
    let wind = pair.wind().unwrap();
    wind.velocity_into(&[[0.0, y_m, z_m]], time_s, &mut out)
        .unwrap();
    out[0]
}

/// Points spread over the scene, in the cores too.
fn scattered() -> impl Iterator<Item = (f64, f64)> {
    (0..2000).map(|i| {
        let i = f64::from(i);
        (
            340.0 + 120.0 * (0.618_033_988_75 * i).fract(),
            100.0 * (0.754_877_666_2 * i).fract(),
        )
    })
}

#[test]
fn no_air_crosses_the_ground() {
    for profile in [CirculationProfile::Algebraic, CirculationProfile::LambOseen] {
        let pair = VortexPair {
            profile,
            height_m: 12.3,
            ..heavy()
        };
        for (y_m, _) in scattered() {
            assert_eq!(velocity(pair, y_m, 0.0, 0.0)[2], 0.0);
        }
    }
    let free = VortexPair {
        ground: Ground::None,
        ..heavy()
    };
    assert!(velocity(free, 400.0, 0.0, 0.0)[2] < -0.5);
}

#[test]
fn the_flow_is_free_of_divergence() {
    for profile in [CirculationProfile::Algebraic, CirculationProfile::LambOseen] {
        let pair = VortexPair { profile, ..heavy() };
        let h = 1e-4;
        for (y, z) in scattered() {
            let dv = velocity(pair, y + h, z, 0.0)[1] - velocity(pair, y - h, z, 0.0)[1];
            let dw = velocity(pair, y, z + h, 0.0)[2] - velocity(pair, y, z - h, 0.0)[2];
            assert_abs_diff_eq!((dv + dw) / (2.0 * h), 0.0, epsilon = 2e-7);
        }
    }
}

#[test]
fn the_pair_moves_the_air_between_its_vortices_down_and_the_air_beside_it_up() {
    assert!(velocity(heavy(), 400.0, 47.0, 0.0)[2] < 0.0);
    assert!(velocity(heavy(), 340.0, 47.0, 0.0)[2] > 0.0);
    assert!(velocity(heavy(), 460.0, 47.0, 0.0)[2] > 0.0);
}

#[test]
fn a_vortex_is_carried_down_by_the_other_at_v0() {
    let pair = VortexPair {
        ground: Ground::None,
        core_radius_m: 1e-3,
        ..heavy()
    };
    let descent = velocity(pair, 400.0 - 23.5, 47.0, 0.0);
    assert_relative_eq!(descent[2], -500.0 / (2.0 * PI * 47.0), max_relative = 1e-8);
    assert_relative_eq!(pair.descent_speed_m_s(), -descent[2], max_relative = 1e-8);
    assert_abs_diff_eq!(descent[1], 0.0);
}

#[test]
fn circulation_on_circles_about_one_vortex_is_its_profile() {
    // The other vortex is so far that it adds nothing to a circle that does not enclose it beyond its vorticity tail.
    let pair = VortexPair {
        spacing_m: 1e7,
        lateral_position_m: 5e6,
        ground: Ground::None,
        ..heavy()
    };
    let wind = pair.wind().unwrap();
    for radius_m in [0.5, 2.35, 5.0, 15.0] {
        let found = circulation_m2_s(&wind, [0.0, 47.0], radius_m, 0.0, 64).unwrap();
        let profile = 500.0 * radius_m * radius_m / (radius_m * radius_m + 2.35 * 2.35);
        assert_relative_eq!(found, -profile, max_relative = 1e-9);
        let right = circulation_m2_s(&wind, [1e7, 47.0], radius_m, 0.0, 64).unwrap();
        assert_relative_eq!(right, profile, max_relative = 1e-7);
    }
}

#[test]
fn gamma_5_15_agrees_between_closed_form_quadrature_and_circles() {
    for profile in [CirculationProfile::Algebraic, CirculationProfile::LambOseen] {
        let pair = VortexPair {
            profile,
            spacing_m: 1e7,
            lateral_position_m: 5e6,
            ground: Ground::None,
            ..heavy()
        };
        let wind = pair.wind().unwrap();
        let circles = mean_circulation_5_15_m2_s(&wind, [0.0, 47.0], 0.0, 64).unwrap();
        assert_relative_eq!(-circles, pair.circulation_5_15_m2_s(), max_relative = 1e-9);
    }
    // 1 - 0.235 (atan(15/2.35) - atan(5/2.35)), evaluated apart.
    let expected = 500.0 * (1.0 - 0.235 * (1.415_392_874_166 - 1.131_435_439_510));
    assert_relative_eq!(
        heavy().circulation_5_15_m2_s(),
        expected,
        max_relative = 1e-6
    );
}

#[test]
fn path_over_the_ground_follows_the_independent_integration() {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../tests/reference/les/vortex_pair_inviscid_ground_h1.csv"
    );
    let text = std::fs::read_to_string(path).unwrap();
    let pair = VortexPair {
        motion: Motion::Inviscid,
        ..heavy()
    };
    let mut rows = 0;
    for line in text.lines().filter(|l| !l.starts_with('#')) {
        let row: Vec<f64> = line.split(',').map(|x| x.trim().parse().unwrap()).collect();
        let [left, right] = pair.vortices(pair.time_s(row[0]));
        let half = 0.5 * (right.lateral_position_m - left.lateral_position_m) / pair.spacing_m;
        assert_abs_diff_eq!(half, row[1], epsilon = 2e-9);
        assert_abs_diff_eq!(left.height_m / pair.spacing_m, row[2], epsilon = 2e-9);
        assert_abs_diff_eq!(
            0.5 * (left.lateral_position_m + right.lateral_position_m),
            400.0,
            epsilon = 1e-10
        );
        rows += 1;
    }
    assert_eq!(rows, 61);
}

#[test]
fn path_keeps_its_invariant_and_obeys_the_velocity_of_the_other_vortices() {
    let pair = VortexPair {
        motion: Motion::Inviscid,
        core_radius_m: 1e-3,
        height_m: 80.0,
        ..heavy()
    };
    let invariant = 4.0 / (47.0 * 47.0) + 1.0 / (80.0 * 80.0);
    for step in -20..400 {
        let time_s = 2.0 * f64::from(step);
        let [left, now] = pair.vortices(time_s);
        let half = 0.5 * (now.lateral_position_m - left.lateral_position_m);
        let kept = 1.0 / (half * half) + 1.0 / (now.height_m * now.height_m);
        assert_relative_eq!(kept, invariant, max_relative = 1e-12);
        // At its own centre a vortex of any core size induces nothing, so the flow there carries it.
        let flow = velocity(pair, now.lateral_position_m, now.height_m, time_s);
        let [_, ahead] = pair.vortices(time_s + 1e-3);
        let [_, behind] = pair.vortices(time_s - 1e-3);
        let speed_y = (ahead.lateral_position_m - behind.lateral_position_m) / 2e-3;
        let speed_z = (ahead.height_m - behind.height_m) / 2e-3;
        assert_abs_diff_eq!(speed_y, flow[1], epsilon = 1e-6);
        assert_abs_diff_eq!(speed_z, flow[2], epsilon = 1e-6);
    }
}

#[test]
fn without_a_ground_the_pair_descends_straight_at_v0() {
    let pair = VortexPair {
        motion: Motion::Inviscid,
        ground: Ground::None,
        ..heavy()
    };
    let [left, _] = pair.vortices(pair.time_s(3.0));
    assert_relative_eq!(left.height_m, 47.0 - 3.0 * 47.0, max_relative = 1e-12);
    assert_eq!(left.lateral_position_m, 376.5);
    assert_relative_eq!(
        pair.time_s(3.0) * pair.descent_speed_m_s() / pair.spacing_m,
        3.0,
        max_relative = 1e-15
    );
}

/// The bound of the gradient of a pair over the largest that a search about a core and towards the other one finds.
fn bound_over_largest(pair: VortexPair) -> f64 {
    let bound = pair.wind().unwrap().max_gradient_per_s(0.0);
    let core_y_m = pair.lateral_position_m - 0.5 * pair.spacing_m;
    let mut largest = 0.0_f64;
    let h = 1e-4;
    for i in 0..120 {
        for j in 0..120 {
            let (y, z) = (
                core_y_m - 6.5 + 0.1 * f64::from(i),
                pair.height_m - 6.0 + 0.1 * f64::from(j),
            );
            let (up, down) = (velocity(pair, y, z + h, 0.0), velocity(pair, y, z - h, 0.0));
            let (east, west) = (velocity(pair, y + h, z, 0.0), velocity(pair, y - h, z, 0.0));
            let stretch = (east[1] - west[1]) / (2.0 * h);
            let shear = (up[1] - down[1] + east[2] - west[2]) / (4.0 * h);
            largest = largest.max(stretch.hypot(shear));
        }
    }
    bound / largest
}

#[test]
fn gradient_bound_holds_everywhere_and_is_at_most_six_percent_too_large_where_cores_are_far_apart()
{
    for profile in [CirculationProfile::Algebraic, CirculationProfile::LambOseen] {
        let ratio = bound_over_largest(VortexPair { profile, ..heavy() });
        assert!((1.0..1.06).contains(&ratio), "{profile:?}: {ratio}");
    }
}

#[test]
fn gradient_bound_of_a_close_pair_holds_and_is_the_looser_the_closer_it_is() {
    // Spacings of 12, 9 and 6 core radii.
    for (spacing_m, least, most) in [(28.0, 1.05, 1.1), (21.0, 1.1, 1.16), (14.0, 1.2, 1.26)] {
        for profile in [CirculationProfile::Algebraic, CirculationProfile::LambOseen] {
            let ratio = bound_over_largest(VortexPair {
                profile,
                spacing_m,
                ..heavy()
            });
            assert!(
                (least..most).contains(&ratio),
                "{spacing_m} m, {profile:?}: {ratio}"
            );
        }
    }
}

#[test]
fn a_pair_without_circulation_is_calm_and_stays_where_it_is() {
    let pair = VortexPair {
        circulation_m2_s: 0.0,
        motion: Motion::Inviscid,
        ..heavy()
    };
    assert_eq!(velocity(pair, 380.0, 40.0, 100.0), [0.0, 0.0, 0.0]);
    assert_relative_eq!(pair.vortices(100.0)[0].height_m, 47.0, max_relative = 1e-14);
    assert_eq!(pair.wind().unwrap().max_gradient_per_s(0.0), 0.0);
}

#[test]
fn lift_equals_weight_for_a_heavy_aircraft() {
    let aircraft = Aircraft {
        mass_kg: 250_000.0,
        speed_m_s: 75.0,
        span_m: 60.0,
        air_density_kg_m3: 1.225,
    };
    let (gamma, b0) = (
        aircraft.circulation_m2_s().unwrap(),
        aircraft.spacing_m().unwrap(),
    );
    assert_relative_eq!(b0, 47.123_889_803_8, max_relative = 1e-11);
    assert_relative_eq!(
        1.225 * 75.0 * b0 * gamma,
        250_000.0 * 9.806_65,
        max_relative = 1e-14
    );
    assert!((400.0..600.0).contains(&gamma));
}

#[test]
fn values_that_make_no_vortex_are_refused_by_name() {
    let refused = |pair: VortexPair| match pair.wind() {
        Err(Error::OutOfRange { field, .. }) => field,
        other => panic!("{other:?}"),
    };
    assert_eq!(
        refused(VortexPair {
            circulation_m2_s: -1.0,
            ..heavy()
        }),
        "circulation_m2_s"
    );
    assert_eq!(
        refused(VortexPair {
            spacing_m: 0.0,
            ..heavy()
        }),
        "spacing_m"
    );
    assert_eq!(
        refused(VortexPair {
            core_radius_m: f64::NAN,
            ..heavy()
        }),
        "core_radius_m"
    );
    assert_eq!(
        refused(VortexPair {
            height_m: -5.0,
            ..heavy()
        }),
        "height_m"
    );
    assert_eq!(
        refused(VortexPair {
            lateral_position_m: f64::INFINITY,
            ..heavy()
        }),
        "lateral_position_m"
    );
    let wind = heavy().wind().unwrap();
    let wrong = wind.velocity_into(&[[0.0; 3]; 2], 0.0, &mut [[0.0; 3]; 1]);
    assert_eq!(wrong, Err(Error::LengthMismatch { points: 2, out: 1 }));
    let circulation =
        |radius_m, samples| circulation_m2_s(&wind, [0.0, 0.0], radius_m, 0.0, samples);
    assert!(matches!(
        circulation(-1.0, 64),
        Err(Error::OutOfRange {
            field: "radius_m",
            ..
        })
    ));
    assert!(matches!(
        circulation(1.0, 2),
        Err(Error::OutOfRange {
            field: "samples",
            ..
        })
    ));
}
