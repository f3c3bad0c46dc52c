//! Rolling moments against a table of independent origin.

use wakescope_estimate::vortex_fit::{Follower, LiftSlope, Wake, WakeModel};

#[test]
fn rolling_moments_are_those_of_the_stored_table() {
    let table = include_str!("../../../../tests/reference/estimate/rmc.csv");
    let mut count = 0;
    for row in table.lines().filter(|line| !line.starts_with('#')).skip(1) {
        let numbers: Vec<f64> = row.split(',').map(|cell| cell.parse().unwrap()).collect();
        let [
            circulation,
            speed_m_s,
            span_m,
            aspect_ratio,
            core_m,
            offset_m,
            span,
            semispan,
            displaced,
        ] = numbers[..]
        else {
            panic!("{row}");
        };
        // the other vortex has no strength, and the ground no images
        let wake = Wake::from_array(&[
            0.0,
            circulation,
            -50.0,
            80.0,
            0.0,
            100.0,
            1.0,
            core_m,
            0.0,
            0.0,
            0.0,
        ]);
        let model = WakeModel {
            images: false,
            ..WakeModel::default()
        };
        let of = |slope, y_m| {
            let follower = Follower {
                span_m,
                aspect_ratio,
                speed_m_s,
                slope,
            };
            follower
                .rolling_moment(&model, &wake, (y_m, 100.0))
                .unwrap()
        };
        for (found, expected) in [
            (of(LiftSlope::Span, 0.0), span),
            (of(LiftSlope::Semispan, 0.0), semispan),
            (of(LiftSlope::Span, offset_m), displaced),
            (of(LiftSlope::Span, -offset_m), displaced),
        ] {
            assert!((found - expected).abs() < 2e-8, "{row}: {found} {expected}");
        }
        count += 1;
    }
    assert!(count > 10);
}

#[test]
fn images_and_both_vortices_add_up_and_impossible_aircraft_are_refused() {
    let pair = Wake::from_array(&[
        400.0, 400.0, 350.0, 30.0, 390.0, 30.0, 2.0, 2.0, 0.0, 0.0, 0.0,
    ]);
    let follower = Follower {
        span_m: 34.0,
        aspect_ratio: 9.4,
        speed_m_s: 70.0,
        slope: LiftSlope::Span,
    };
    let at = |y_m| {
        follower
            .rolling_moment(&WakeModel::default(), &pair, (y_m, 30.0))
            .unwrap()
    };
    // midway between equal vortices nothing rolls; on either side the moments are opposite
    assert!(at(370.0).abs() < 1e-15 && (at(360.0) + at(380.0)).abs() < 1e-14 && at(390.0) > 0.1);
    let stopped = Follower {
        speed_m_s: 0.0,
        ..follower
    };
    assert!(
        stopped
            .rolling_moment(&WakeModel::default(), &pair, (0.0, 30.0))
            .is_err()
    );
}
