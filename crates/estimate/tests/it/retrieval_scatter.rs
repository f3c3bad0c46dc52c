//! Scatter, stated errors and statistics of fits over many scans; minutes, on request.

use super::retrieval_cases::*;
use crate::fixtures::normal;
use ndarray::Array2;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use wakescope_estimate::retrieval::*;

#[test]
#[ignore = "minutes: scatter over 100 scans of each reference"]
fn scatter_over_many_scans() {
    let cases = ["a", "b", "c", "a"].map(case);
    let names = ["a", "b", "c", "a, 5 % outliers"];
    for (n, (name, case)) in names.into_iter().zip(&cases).enumerate() {
        // cores are hardly resolved in b: more scans tell more
        let scans = if n == 1 { 200 } else { 100 };
        let scatter = if n == 3 {
            Scatter::of(case, scans, with_outliers)
        } else {
            Scatter::of(case, scans, white)
        };
        let (told, holds) = scatter.told(name, &case.bound, (1.1, 0.15));
        println!("{told}");
        assert!(holds);
    }
}

#[test]
#[ignore = "minutes: scatter over 100 scans with turbulence"]
fn scatter_in_turbulence() {
    let mut case = thinned(case("a"));
    case.map.sigma_m_s.as_mut().unwrap().fill(0.3);
    let factor = turbulence_factor(&case.map, 1.2, 25.0);
    let draw = |case: &Case, rng: &mut Xoshiro256PlusPlus| {
        let numbers: Vec<f64> = factor.iter().map(|_| normal(rng)).collect();
        let mut velocity = white(case, rng);
        for (v, row) in velocity.iter_mut().zip(&factor) {
            *v += row.iter().zip(&numbers).map(|(l, x)| l * x).sum::<f64>();
        }
        velocity
    };
    let sandwich = Scatter::of(&case, 100, draw);
    println!(
        "{}",
        sandwich
            .told("sandwich", &case.bound, (f64::INFINITY, 0.2))
            .0
    );
    case.options.turbulence = Some(Turbulence::Exponential {
        deviation_m_s: 1.2,
        length_m: 25.0,
    });
    let whitened = Scatter::of(&case, 100, draw);
    let (told, holds) = whitened.told("whitened", &case.bound, (f64::INFINITY, 0.2));
    println!("{told}");
    // a few scans without whitening end at another top: circulations alone are held to it
    for i in 0..2 {
        let (_, std, stated) = sandwich.numbers(i);
        assert!(
            (stated / std - 1.0).abs() < 0.2 + 3.0 / 200.0_f64.sqrt(),
            "{i}: {stated} {std}"
        );
        assert!(whitened.numbers(i).1 < 0.6 * std, "{i}: {std}");
    }
    assert!(holds);
}

/// Statistics of scans that hold a wind only.
pub(crate) fn empty_statistics(
    scans: u64,
    turbulence: Option<&[Vec<f64>]>,
    options: &RetrievalOptions,
) -> Vec<f64> {
    let mut case = thinned(case("a"));
    let (elevation_rad, range_m) = (case.map.elevation_rad.clone(), case.map.range_m.clone());
    case.exact = Array2::from_shape_fn(case.exact.dim(), |(line, gate)| {
        (2.0 + 0.02 * range_m[gate] * elevation_rad[line].sin()) * elevation_rad[line].cos()
    });
    let statistic = |seed| {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(5000 + seed);
        let mut velocity_m_s = white(&case, &mut rng);
        if let Some(factor) = turbulence {
            let numbers: Vec<f64> = factor.iter().map(|_| normal(&mut rng)).collect();
            for (v, row) in velocity_m_s.iter_mut().zip(factor) {
                *v += row.iter().zip(&numbers).map(|(l, x)| l * x).sum::<f64>();
            }
        }
        let found = fit_scan(
            &ScanMap {
                velocity_m_s,
                ..case.map.clone()
            },
            Velocities::Means,
            options,
        )
        .unwrap();
        if found.vortices.is_empty() {
            -found.statistic
        } else {
            found.statistic
        }
    };
    let mut statistics: Vec<f64> = (0..scans).map(statistic).collect();
    statistics.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
    statistics
}

#[test]
#[ignore = "minutes: statistics of 300 empty scans"]
fn statistics_of_empty_scans() {
    let white = empty_statistics(300, None, &RetrievalOptions::default());
    println!("white {:.1?}", &white[200..]);
    let factor = turbulence_factor(&thinned(case("a")).map, 0.8, 25.0);
    let correlated = empty_statistics(60, Some(&factor), &RetrievalOptions::default());
    println!("turbulent {correlated:.1?}");
    let turbulence = Some(Turbulence::Exponential {
        deviation_m_s: 0.8,
        length_m: 25.0,
    });
    let whitened = empty_statistics(
        60,
        Some(&factor),
        &RetrievalOptions {
            turbulence,
            ..Default::default()
        },
    );
    println!("whitened {whitened:.1?}");
    // none that is positive is a wake: these are negative
    assert!(
        white
            .iter()
            .chain(&whitened)
            .all(|statistic| *statistic <= 0.0)
    );
    assert!(
        correlated
            .iter()
            .filter(|statistic| **statistic > 0.0)
            .count()
            <= 3
    );
}
