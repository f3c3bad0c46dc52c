//! The mean wind against stored tables, and its largest gradient against a search.

use approx::assert_relative_eq;
use wakescope_les::Wind;
use wakescope_les::winds::{MeanWind, WindLaw};

const LOGARITHMIC: WindLaw = WindLaw::Logarithmic {
    friction_velocity_m_s: 0.4,
    roughness_m: 0.03,
    displacement_m: 0.0,
};

const POWER: WindLaw = WindLaw::Power {
    speed_m_s: 6.0,
    reference_height_m: 10.0,
    exponent: 0.143,
};

fn table() -> WindLaw {
    WindLaw::Table {
        height_m: vec![2.0, 20.0, 60.0, 150.0],
        speed_m_s: vec![3.0, 6.0, 9.0, 10.0],
        toward_rad: vec![0.3, 0.5, 0.6, 1.2],
    }
}

#[test]
fn profiles_are_those_of_the_table() {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../tests/reference/air/wind_profiles.csv"
    );
    let text = std::fs::read_to_string(path).unwrap();
    let logarithmic = MeanWind::new(LOGARITHMIC, 0.0).unwrap();
    let power = MeanWind::new(POWER, std::f64::consts::FRAC_PI_2).unwrap();
    let table = MeanWind::new(table(), 0.0).unwrap();
    let rows = text.lines().filter(|line| !line.starts_with('#')).skip(1);
    let mut laws = 0;
    for line in rows {
        let row: Vec<f64> = line.split(',').map(|v| v.parse().unwrap()).collect();
        let z_m = row[0];
        if z_m >= logarithmic.linear_below_m() {
            laws += 1;
            assert_relative_eq!(
                logarithmic.velocity_m_s(z_m)[0],
                row[1],
                max_relative = 1e-8
            );
            assert_relative_eq!(power.velocity_m_s(z_m)[1], row[2], max_relative = 1e-8);
        }
        let [x_m_s, y_m_s] = table.velocity_m_s(z_m);
        assert_relative_eq!(x_m_s, row[3], max_relative = 1e-8);
        assert_relative_eq!(y_m_s, row[4], max_relative = 1e-8);
    }
    assert!(laws > 10);
}

#[test]
fn near_the_ground_a_law_is_linear_and_continuous() {
    for law in [LOGARITHMIC, POWER] {
        let wind = MeanWind::new(law, 0.0).unwrap();
        let edge_m_s = wind.velocity_m_s(1.0)[0];
        assert_relative_eq!(
            wind.velocity_m_s(0.25)[0],
            0.25 * edge_m_s,
            max_relative = 1e-14
        );
        assert_relative_eq!(
            wind.velocity_m_s(1.0 - 1e-12)[0],
            edge_m_s,
            max_relative = 1e-11
        );
        assert_eq!(wind.velocity_m_s(0.0), [0.0; 2]);
        assert_eq!(wind.velocity_m_s(-3.0), [0.0; 2]);
    }
    let forest = WindLaw::Logarithmic {
        friction_velocity_m_s: 0.6,
        roughness_m: 0.8,
        displacement_m: 10.0,
    };
    let wind = MeanWind::new(forest, 0.0).unwrap();
    assert_eq!(wind.linear_below_m(), 8.0);
    let expected = 0.6 / 0.4 * (20.0_f64 / 0.8).ln();
    assert_relative_eq!(wind.velocity_m_s(30.0)[0], expected, max_relative = 1e-14);
    assert_eq!(wind.velocity_m_s(10.0), [0.0; 2]);
}

#[test]
fn the_largest_gradient_is_that_of_a_search_over_heights() {
    for law in [LOGARITHMIC, POWER, table()] {
        let wind = MeanWind::new(law, 0.7).unwrap();
        let mut steepest = 0.0_f64;
        for i in 0..40_000 {
            let z_m = 0.005 * f64::from(i) + 0.002;
            let low = wind.velocity_m_s(z_m - 1e-4);
            let high = wind.velocity_m_s(z_m + 1e-4);
            steepest = steepest.max((high[0] - low[0]).hypot(high[1] - low[1]) / 2e-4);
        }
        assert_relative_eq!(
            wind.max_gradient_per_s(0.0),
            0.5 * steepest,
            max_relative = 1e-6
        );
    }
}

#[test]
fn the_friction_velocity_gives_the_speed_at_the_reference_height() {
    let friction_velocity_m_s = MeanWind::friction_velocity_m_s(7.0, 12.0, 0.1, 2.0);
    let law = WindLaw::Logarithmic {
        friction_velocity_m_s,
        roughness_m: 0.1,
        displacement_m: 2.0,
    };
    let wind = MeanWind::new(law, std::f64::consts::PI).unwrap();
    assert_relative_eq!(wind.velocity_m_s(12.0)[0], -7.0, max_relative = 1e-14);
}

#[test]
fn wrong_profiles_are_refused() {
    let with = |height_m: Vec<f64>, speed_m_s: Vec<f64>| {
        let toward_rad = vec![0.0; speed_m_s.len()];
        MeanWind::new(
            WindLaw::Table {
                height_m,
                speed_m_s,
                toward_rad,
            },
            0.0,
        )
    };
    assert!(with(vec![2.0, 1.0], vec![3.0; 2]).is_err());
    assert!(with(vec![1.0, 2.0], vec![3.0]).is_err());
    assert!(with(vec![1.0], vec![f64::NAN]).is_err());
    assert!(with(vec![], vec![]).is_err());
    assert!(with(vec![1.0], vec![3.0]).is_ok());
    let steep = WindLaw::Power {
        speed_m_s: 5.0,
        reference_height_m: 10.0,
        exponent: 1.5,
    };
    assert!(MeanWind::new(steep, 0.0).is_err());
}
