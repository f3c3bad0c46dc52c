//! Time per window: statistic, spectrum and peak, and the direct periodogram beside them.

#![allow(clippy::unwrap_used, missing_docs)]

use criterion::{Criterion, criterion_group, criterion_main};
use num_complex::Complex;
use std::hint::black_box;
use wakescope_estimate::{
    Sampling, Scratch, SignalKind, Weighting, bound::*, estimators::*, models::*, spectrum::*,
};

fn window() -> Vec<f64> {
    let turn = std::f64::consts::TAU * 80e6 / 250e6;
    (0..64)
        .map(|n| (turn * n as f64).cos() + 0.3 * (n as f64 * 12.9898).sin())
        .collect()
}

fn windows(criterion: &mut Criterion) {
    let sampling = Sampling::new(250e6, 80e6, 1.55e-6, (55e6, 105e6)).unwrap();
    let plan = PeriodogramPlan::<f64>::new(&sampling, 64).unwrap();
    let (real, mut scratch) = (window(), Scratch::new());
    let complex: Vec<_> = real.iter().map(|x| Complex::new(*x, 0.5 * x)).collect();
    let mut lags = vec![0.0; 64];
    plan.statistic.evaluate(&real, &mut scratch, &mut lags);
    criterion.bench_function("correlogram, 64 real samples", |b| {
        b.iter(|| {
            plan.statistic
                .evaluate(black_box(&real), &mut scratch, &mut lags)
        });
    });
    let statistic = Correlogram::<Complex<f64>>::new(Weighting::default(), 64).unwrap();
    let mut complex_lags = vec![0.0; 128];
    criterion.bench_function("correlogram, 64 complex samples", |b| {
        b.iter(|| statistic.evaluate(black_box(&complex), &mut scratch, &mut complex_lags));
    });
    criterion.bench_function("spectrum of 1024 points and peak", |b| {
        b.iter(|| plan.estimator.estimate(black_box(&lags), &mut scratch));
    });
    let (mut model, mut work) = (Autoregression::default(), Vec::new());
    criterion.bench_function("Levinson recursion of order 16", |b| {
        b.iter(|| {
            model
                .fit(black_box(&lags), SignalKind::Real, 16, &mut work)
                .unwrap()
        });
    });
    let sliding = ShortCorrelogram::<f64>::new(64, 17).unwrap();
    let record: Vec<f64> = (0..1063)
        .map(|n| (2.0106 * n as f64).cos() + 0.3 * (n as f64 * 12.9898).sin())
        .collect();
    criterion.bench_function("sliding correlogram of 17 lags, 1000 windows", |b| {
        b.iter(|| {
            let mut sum = 0.0;
            sliding.evaluate_record(
                black_box(&record),
                0,
                1,
                &|_| true,
                &mut scratch,
                &mut |_, lags| sum += lags[16],
            );
            sum
        });
    });
    let ca = ModelPeak::new(
        &sampling,
        SignalKind::Real,
        64,
        16,
        2048,
        Refinement::Parabola,
    )
    .unwrap();
    criterion.bench_function("AR(16), spectrum of 2048 points and peak", |b| {
        b.iter(|| ca.estimate(black_box(&lags), &mut scratch));
    });
    let model = WindowModel::gaussian_pulse(&sampling, 64, 120e-9, Noise::White).unwrap();
    let mut tapers = likelihood_tapers(&model, 10.0).unwrap();
    tapers.truncate(4);
    let likelihood = Correlogram::<f64>::with_tapers(tapers).unwrap();
    criterion.bench_function(
        "likelihood of 4 tapers, with the peak of 1024 points",
        |b| {
            b.iter(|| {
                likelihood.evaluate(black_box(&real), &mut scratch, &mut lags);
                plan.estimator.estimate(&lags, &mut scratch)
            });
        },
    );
}

criterion_group!(benches, windows);
criterion_main!(benches);
