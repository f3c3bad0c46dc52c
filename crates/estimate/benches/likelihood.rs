//! Time of one evaluation of the likelihood of a scan with its gradient, and of the Fisher information.

#![allow(clippy::unwrap_used, missing_docs)]

use criterion::{Criterion, criterion_group, criterion_main};
use ndarray::Array2;
use wakescope_estimate::vortex_fit::{
    FreeParameters, Powers, ScanModel, ScanSetup, ScanSignals, Wake, WakeModel,
};
use wakescope_estimate::{Sampling, SignalKind, bound::Noise};

/// 185 lines of 1000 real samples at 250 MHz: 281 to 881 m.
fn likelihood(criterion: &mut Criterion) {
    let wake = Wake::from_array(&[
        500.0, 500.0, 376.5, 47.0, 423.5, 47.0, 2.35, 2.35, 0.0, 0.0, 0.0,
    ]);
    let setup = ScanSetup {
        sampling: Sampling::new(250e6, 80e6, 1.55e-6, (55e6, 105e6)).unwrap(),
        kind: SignalKind::Real,
        noise: Noise::Band { floor: 0.0 },
        pulse_sigma_s: 120.1e-9,
        wake: WakeModel::default(),
        elevation_rad: (0..185).map(|i| 1.25e-3 * f64::from(i)).collect(),
        first_sample_time_s: 1.875e-6,
        record_samples: 1000,
    };
    let model = ScanModel::new(&setup, |_, _| 1.0, &wake).unwrap();
    let records = Array2::from_shape_fn((185, 1000), |(i, k)| {
        ((1 + i * 1000 + k) as f64 * 12.9898).sin()
    });
    let signals = ScanSignals::new(&model, records.view(), 0.5).unwrap();
    let mut group = criterion.benchmark_group("vortex fit");
    group.sample_size(10);
    group.bench_function(
        "likelihood of 185 lines of 1000 samples with its gradient",
        |b| {
            b.iter(|| {
                model
                    .log_likelihood(&signals, &wake, Powers::default())
                    .unwrap()
            });
        },
    );
    let free = FreeParameters::common_circulation();
    group.bench_function("information of every eighth of these lines", |b| {
        b.iter(|| {
            model
                .information(&wake, Powers::default(), &free, true, 8)
                .unwrap()
        });
    });
    group.finish();
}

criterion_group!(benches, likelihood);
criterion_main!(benches);
