//! Free-space efficiency against the stored curves and the known optimum.

use crate::oracle::hankel::free_space_efficiency_hankel;
use crate::reference::reference;
use wakescope_optics::theory::{
    self, free_space_efficiency, free_space_efficiency_misaligned, untruncated_efficiency,
};
use wakescope_optics::{Focus, Misalignment, RadiusDefinition, Telescope};

fn table2_with(radius_definition: RadiusDefinition) -> Telescope {
    Telescope {
        radius_definition,
        ..Telescope::table2()
    }
}

#[test]
fn pupil_overlap_reproduces_the_free_space_curve_to_1e_9() {
    let rows = reference("eta_freespace_table2.csv");
    assert!(rows.len() > 70);
    for (column, definition) in [
        (1, RadiusDefinition::Intensity),
        (3, RadiusDefinition::Field),
    ] {
        let telescope = table2_with(definition);
        for row in &rows {
            let eta = free_space_efficiency(&telescope, row[0]).unwrap();
            assert!(
                (eta / row[column] - 1.0).abs() < 1e-9,
                "{} m: {eta} {}",
                row[0],
                row[column]
            );
            // With unit power after the aperture.
            let antenna = eta / telescope.transmitted_fraction().powi(2);
            assert!(
                (antenna / row[column + 1] - 1.0).abs() < 1e-9,
                "{} m",
                row[0]
            );
        }
    }
}

/// (O5) knows range and focus by 1/R - 1/F alone, and its sign not at all: the stored curve of a
/// collimated beam is that of any focus.
#[test]
fn any_focus_has_the_stored_curve_at_its_distance_from_the_focus() {
    let mut compared = 0;
    for focus_m in [150.0, 600.0, -400.0] {
        let telescope = Telescope {
            focus: Focus::At(focus_m),
            ..Telescope::table2()
        };
        for row in &reference("eta_freespace_table2.csv") {
            for curvature_per_m in [1.0 / row[0], -1.0 / row[0]] {
                let range_m = 1.0 / (curvature_per_m + 1.0 / focus_m);
                if !(20.0..5000.0).contains(&range_m) {
                    continue;
                }
                let eta = free_space_efficiency(&telescope, range_m).unwrap();
                assert!(
                    (eta / row[1] - 1.0).abs() < 1e-9,
                    "{focus_m} {range_m} m: {eta} {}",
                    row[1]
                );
                compared += 1;
            }
        }
    }
    assert!(compared > 150, "{compared}");
}

#[test]
fn hankel_quadrature_agrees_with_the_free_space_curve() {
    for row in reference("eta_freespace_table2.csv") {
        let eta = free_space_efficiency_hankel(&Telescope::table2(), row[0]);
        assert!(
            (eta / row[1] - 1.0).abs() < 1e-7,
            "{} m: {eta} {}",
            row[0],
            row[1]
        );
    }
}

#[test]
fn two_quadratures_agree_for_obscured_focused_and_uniform_beams() {
    for (beam_radius_m, obscuration_radius_m, focus, range_m) in [
        (0.03, 0.015, Focus::At(600.0), 400.0),
        (0.02, 0.03, Focus::At(-900.0), 1500.0),
        (f64::INFINITY, 0.02, Focus::Collimated, 2000.0),
        (f64::INFINITY, 0.0, Focus::At(500.0), 500.0),
        (0.004, 0.0, Focus::Collimated, 100.0),
    ] {
        let t = Telescope {
            beam_radius_m,
            obscuration_radius_m,
            focus,
            ..Telescope::table2()
        };
        let overlap = free_space_efficiency(&t, range_m).unwrap();
        let hankel = free_space_efficiency_hankel(&t, range_m);
        assert!(
            (hankel / overlap - 1.0).abs() < 3e-6,
            "{t:?}: {hankel} {overlap}"
        );
    }
}

#[test]
fn closed_form_and_wide_aperture_quadrature_agree_with_the_untruncated_curve() {
    let rows = reference("eta_untruncated_analytic.csv");
    let foci = [Focus::Collimated, Focus::At(1000.0), Focus::At(200.0)];
    for (column, focus) in foci.into_iter().enumerate() {
        let telescope = Telescope {
            focus,
            ..Telescope::table2()
        };
        // Six 1/e radii: truncation is below the last bit. A_R scales out.
        let wide = Telescope {
            aperture_radius_m: 0.18,
            ..telescope
        };
        for (i, row) in rows.iter().enumerate() {
            let eta = untruncated_efficiency(&telescope, row[0]).unwrap();
            assert!((eta / row[column + 1] - 1.0).abs() < 1e-12, "{} m", row[0]);
            if i % 16 == 15 {
                let eta = free_space_efficiency(&wide, row[0]).unwrap() * 12.96;
                assert!(
                    (eta / row[column + 1] - 1.0).abs() < 1e-9,
                    "{} m: {eta}",
                    row[0]
                );
            }
        }
    }
}

#[test]
fn best_focused_matched_pair_is_0_401179_at_1_76334() {
    let eta = |ratio: f64| {
        let s = 0.05 / ratio;
        let t = Telescope {
            beam_radius_m: s,
            focus: Focus::At(700.0),
            ..Telescope::table2()
        };
        free_space_efficiency(&t, 700.0).unwrap()
    };
    // Golden-section search for the maximum.
    let (mut low, mut high) = (1.2, 2.4);
    let ratio = 0.5 * (5f64.sqrt() - 1.0);
    for _ in 0..40 {
        let (x1, x2) = (high - ratio * (high - low), low + ratio * (high - low));
        if eta(x1) < eta(x2) {
            low = x1;
        } else {
            high = x2;
        }
    }
    let best = 0.5 * (low + high);
    assert!((best - 1.76334).abs() < 2e-5, "{best}");
    assert!((eta(best) - 0.401179).abs() < 5e-7, "{}", eta(best));
}

#[test]
fn displaced_untruncated_beams_lose_exp_of_half_the_squared_displacement() {
    let t = Telescope {
        aperture_radius_m: 0.3,
        ..Telescope::table2()
    };
    let range_m = 800.0;
    let k = t.wavenumber_rad_m();
    let width2 = 0.03f64.powi(2) + (range_m / (k * 0.03)).powi(2);
    let misalignment = Misalignment {
        offset_m: [0.02, 0.0],
        tilt_rad: [1e-5, 2e-5],
    };
    let d2 = (0.02f64 + 0.008).powi(2) + 0.016f64.powi(2);
    let aligned = free_space_efficiency(&t, range_m).unwrap();
    let displaced = free_space_efficiency_misaligned(&t, &misalignment, range_m).unwrap();
    let expected = (-d2 / (2.0 * width2)).exp();
    assert!((displaced / aligned / expected - 1.0).abs() < 1e-9);
}

#[test]
fn uniform_beam_is_the_limit_of_wide_gaussians() {
    let uniform = Telescope {
        beam_radius_m: f64::INFINITY,
        ..Telescope::table2()
    };
    let wide = Telescope {
        beam_radius_m: 1e4,
        ..uniform
    };
    let exact = free_space_efficiency(&uniform, 900.0).unwrap();
    let limit = free_space_efficiency(&wide, 900.0).unwrap() / wide.transmitted_fraction().powi(2);
    assert!((limit / exact - 1.0).abs() < 1e-9, "{limit} {exact}");
}

#[test]
fn bad_range_is_an_error_that_names_it() {
    for range_m in [0.0, -5.0, f64::NAN, f64::INFINITY] {
        let error = free_space_efficiency(&Telescope::table2(), range_m).unwrap_err();
        assert!(error.to_string().contains("range_m"), "{error}");
    }
}

#[test]
fn forecast_of_a_quadrature_grows_no_faster_than_the_fresnel_number() {
    // Ten times the Fresnel number, ten times the nodes: not a hundred times the time.
    let at = |range_m| theory::quadrature_cost_s(&Telescope::table2(), 0, range_m);
    assert!(at(1.0) / at(10.0) < 11.0 && at(1.0) > at(10.0) && at(10.0) > at(1000.0));
    // An obscured aperture has more pieces, and the more the larger its obscuration is.
    let obscured = |radius_m| {
        theory::quadrature_cost_s(
            &Telescope {
                obscuration_radius_m: radius_m,
                ..Telescope::table2()
            },
            0,
            100.0,
        )
    };
    assert!(obscured(0.02) > obscured(0.01) && obscured(0.01) > 2.0 * at(100.0));
    let far = theory::fresnel_number(&Telescope::table2(), 1000.0);
    assert!((far - 2.5e-3 / (1000.0 * 1.55e-6)).abs() < 1e-12);
}
