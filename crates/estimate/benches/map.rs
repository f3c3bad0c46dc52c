//! Time of a map of 200 x 200 points, its parts apart, on the threads of the default pool.

#![allow(clippy::unwrap_used, missing_docs)]

use criterion::{Criterion, criterion_group, criterion_main};
use ndarray::Array2;
use wakescope_estimate::{Gates, PeriodogramPlan, Sampling, map::*};

fn map(criterion: &mut Criterion) {
    let sampling = Sampling::new(250e6, 80e6, 1.55e-6, (55e6, 105e6)).unwrap();
    let gates = Gates::new(64, 1, 2e-6).unwrap();
    let plan = PeriodogramPlan::<f64>::new(&sampling, 64).unwrap();
    // 200 lines of sight of 200 windows; deterministic rubbish in place of noise
    let records = Array2::from_shape_fn((200, 263), |(ray, n)| {
        let x = (ray as f64 * 78.233 + n as f64 * 12.9898).sin() * 43_758.545;
        x - x.floor() - 0.5 + (2.0106 * n as f64 + ray as f64).cos()
    });
    let elevation_rad: Vec<f64> = (0..200).map(|i| i as f64 * 1.25e-3).collect();
    let new = || {
        Scan::new(
            &plan.statistic,
            &sampling,
            &gates,
            &elevation_rad,
            records.view(),
        )
        .unwrap()
    };
    let scan = new();
    let points = polar_points(&elevation_rad, &scan.geometry().gate_ranges_m());
    let mut group = criterion.benchmark_group("map of 200 x 200 points");
    group.sample_size(20);
    group.bench_function("statistics of all windows", |b| b.iter(new));
    let mut mean = vec![0.0; 64];
    group.bench_function("region means alone, rho = 2 m", |b| {
        b.iter(|| {
            points
                .iter()
                .map(|point| scan.region_mean(*point, 2.0, &mut mean).unwrap())
                .sum::<usize>()
        });
    });
    let radius = Radius::Fixed { radius_m: 2.0 };
    group.bench_function("means and velocities, rho = 2 m", |b| {
        b.iter(|| scan.map(&points, &radius, None, &plan.estimator).unwrap());
    });
    group.finish();
}

criterion_group!(benches, map);
criterion_main!(benches);
