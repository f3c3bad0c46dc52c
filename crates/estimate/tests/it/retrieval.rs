//! Fits of scans against references of independent origin.

use crate::fixtures::normal;
use ndarray::Array2;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use wakescope_estimate::retrieval::*;
use wakescope_estimate::vortex_fit::*;

/// A stored scan, noisy and exact.
fn stored(text: &str) -> (ScanMap, Array2<f64>) {
    let number = |cell: &str| if cell.is_empty() { f64::NAN } else { cell.parse().unwrap() };
    let rows: Vec<Vec<f64>> = text
        .lines()
        .filter(|line| !line.starts_with('#'))
        .skip(1)
        .map(|line| line.split(',').map(number).collect())
        .collect();
    let mut elevation_rad: Vec<f64> = rows.iter().map(|row| row[1]).collect();
    let gates = elevation_rad.iter().take_while(|e| **e == elevation_rad[0]).count();
    elevation_rad = elevation_rad.into_iter().step_by(gates).collect();
    let column = |i: usize| {
        Array2::from_shape_vec((elevation_rad.len(), gates), rows.iter().map(|row| row[i]).collect()).unwrap()
    };
    let map = ScanMap {
        time_s: column(2).column(0).to_vec(),
        range_m: column(0).row(0).to_vec(),
        velocity_m_s: column(3),
        sigma_m_s: Some(column(4)),
        fold_m_s: None,
        elevation_rad: elevation_rad.clone(),
    };
    (map, column(5))
}

#[test]
fn explore() {
    let maps = [
        (include_str!("../../../../tests/reference/estimate/map_a.csv"), 0.0),
        (include_str!("../../../../tests/reference/estimate/map_b.csv"), 15.0),
        (include_str!("../../../../tests/reference/estimate/map_c.csv"), 10.0),
        (include_str!("../../../../tests/reference/estimate/map_one.csv"), 0.0),
        (include_str!("../../../../tests/reference/estimate/map_noise.csv"), 0.0),
    ];
    for (text, std_m) in maps {
        let (mut map, exact) = stored(text);
        for exactly in [false, true] {
            if exactly {
                map.velocity_m_s = exact.clone();
            }
            for movement in [Movement::Frozen, Movement::Auto] {
                let gate = if std_m > 0.0 { Gate::Gaussian { std_m } } else { Gate::Point };
                let options = RetrievalOptions { gate, movement, ..Default::default() };
                let start = std::time::Instant::now();
                let found = fit_scan(&map, &options).unwrap();
                println!("exact {exactly} {movement:?} {:?}", start.elapsed());
                if let Some(wake) = found.wake {
                    for (i, p) in wake.to_array().iter().enumerate() {
                        print!("{p:.5} +- {:.5}; ", found.covariance[[i, i]].sqrt());
                    }
                }
                println!(
                    "\n{:.3} T {:.1} used {} rejected {} {:?} {} tops",
                    found.chi2_per_dof,
                    found.statistic,
                    found.cells_used,
                    found.cells_rejected,
                    found.flags,
                    found.tops.len()
                );
            }
        }
    }
}
