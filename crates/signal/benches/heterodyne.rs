//! Cost of a record: 1000 samples at 200 ns, by layer thickness, beside the literal sum. Throughput is in samples.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use num_complex::Complex;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use wakescope_signal::{
    Error, GaussianPulse, LineOfSight, NoiseModel, PlanckConvention, PulseDuration, Receiver, Record,
    SPEED_OF_LIGHT_M_S, Scratch, Simulator, literal_envelope,
};

const SAMPLES: usize = 1000;

fn simulator(noise: NoiseModel) -> Result<Simulator, Error> {
    let receiver = Receiver {
        wavelength_m: 1.55e-6,
        sample_rate_hz: 250e6,
        intermediate_frequency_hz: 80e6,
        bandwidth_hz: 50e6,
        quantum_efficiency: 1.0,
        local_oscillator_w: 1e-3,
        planck: PlanckConvention::H,
        noise,
    };
    let pulse = GaussianPulse::new(PulseDuration::FullWidthHalfMaximum(200e-9), 150e-6)?;
    Simulator::new(pulse, receiver, Record { time_of_first_sample_s: 1.0e-6, samples: SAMPLES })
}

/// A line that covers the record and the pulse around it, `parts` layers per sample: 225 `parts` scatterers in the sum.
fn line(parts: usize) -> LineOfSight {
    let layer_thickness_m = SPEED_OF_LIGHT_M_S / (2.0 * 250e6 * parts as f64);
    let layers = (SAMPLES + 260) * parts;
    LineOfSight {
        first_range_m: 80.0,
        layer_thickness_m,
        radial_velocity_m_s: (0..layers).map(|l| 5.0 * (0.01 * l as f64).sin()).collect(),
        weight_per_m: vec![1e-16; layers],
    }
}

fn heterodyne(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("heterodyne");
    group.throughput(Throughput::Elements(SAMPLES as u64));
    group.sample_size(30);
    let mut scratch = Scratch::default();
    let mut current_a = vec![0.0; SAMPLES];
    let mut envelope_a = vec![Complex::ZERO; SAMPLES];
    let bare = simulator(NoiseModel::None).expect("valid settings");
    let noisy = simulator(NoiseModel::BandLimited).expect("valid settings");
    for parts in [1, 3, 6] {
        let line = line(parts);
        let speckle = vec![Complex::new(0.6, -0.8); line.layers()];
        group.bench_function(format!("envelope, {} scatterers", 225 * parts), |bench| {
            bench.iter(|| bare.envelope_of_speckle_into(&line, &speckle, &mut scratch, &mut envelope_a));
        });
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        group.bench_function(format!("record with noise, {} scatterers", 225 * parts), |bench| {
            bench.iter(|| noisy.record_into(&line, &mut rng, &mut scratch, &mut current_a));
        });
    }
    let line = line(1);
    let speckle = vec![Complex::new(0.6, -0.8); line.layers()];
    group.sample_size(10);
    group.bench_function("literal, 225 scatterers", |bench| {
        bench.iter(|| black_box(literal_envelope(&bare, &line, &speckle)));
    });
    group.finish();
}

criterion_group!(benches, heterodyne);
criterion_main!(benches);
