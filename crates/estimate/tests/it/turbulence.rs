//! The closed forms of turbulence against tables of an independent quadrature.

use approx::assert_relative_eq;
use wakescope_estimate::turbulence::VonKarman;

/// Rows of a table under `tests/reference/air`.
fn table(name: &str) -> Vec<Vec<f64>> {
    let path = format!(
        "{}/../../tests/reference/air/{name}",
        env!("CARGO_MANIFEST_DIR")
    );
    let text = std::fs::read_to_string(path).unwrap();
    text.lines()
        .filter(|line| !line.starts_with('#'))
        .skip(1)
        .map(|line| line.split(',').map(|v| v.parse().unwrap()).collect())
        .collect()
}

fn turbulence(row: &[f64]) -> VonKarman {
    VonKarman::new(row[0], row[1], 1.5).unwrap()
}

#[test]
fn structure_functions_are_those_of_the_table() {
    let rows = table("structure_functions.csv");
    assert!(rows.len() > 150);
    for row in rows {
        let air = turbulence(&row);
        let (along, across) = air.structure_functions_m2_s2(row[2]);
        assert_relative_eq!(along, row[3], max_relative = 1e-8);
        assert_relative_eq!(across, row[4], max_relative = 1e-8);
    }
}

#[test]
fn spectra_and_variances_are_those_of_the_table() {
    let rows = table("spectra.csv");
    assert!(rows.len() > 100);
    for row in rows {
        let air = turbulence(&row);
        let found = [
            air.energy_m3_s2(row[2]),
            air.longitudinal_spectrum_m3_s2(row[2]),
            air.transverse_spectrum_m3_s2(row[2]),
            air.variance_m2_s2(),
        ];
        for (found, expected) in found.into_iter().zip(&row[3..]) {
            assert_relative_eq!(found, *expected, max_relative = 1e-8);
        }
    }
}

#[test]
fn far_below_the_outer_scale_the_structure_functions_are_those_of_the_inertial_range() {
    let air = VonKarman::new(5e-4, 1e4, 1.5).unwrap();
    let inertial = 1.9727 * (5e-4_f64 * 0.01).powf(2.0 / 3.0);
    let (along, across) = air.structure_functions_m2_s2(0.01);
    assert_relative_eq!(along, inertial, max_relative = 1e-3);
    assert_relative_eq!(across, 4.0 / 3.0 * inertial, max_relative = 1e-3);
}

#[test]
fn variance_and_integral_scale_have_their_constants() {
    let air = VonKarman::new(5e-4, 100.0, 1.5).unwrap();
    let scale = (5e-4_f64 * 100.0).powf(2.0 / 3.0);
    assert_relative_eq!(air.variance_m2_s2(), 1.0325 * scale, max_relative = 1e-4);
    assert_relative_eq!(air.integral_scale_m(), 74.68, max_relative = 1e-4);
    let (along, across) = air.covariances_m2_s2(0.0);
    assert_relative_eq!(along, air.variance_m2_s2(), max_relative = 1e-12);
    assert_relative_eq!(across, air.variance_m2_s2(), max_relative = 1e-12);
}

#[test]
fn turbulence_without_a_positive_strength_is_refused() {
    assert!(VonKarman::new(0.0, 100.0, 1.5).is_err());
    assert!(VonKarman::new(5e-4, f64::NAN, 1.5).is_err());
    assert!(VonKarman::new(5e-4, 100.0, -1.5).is_err());
}
