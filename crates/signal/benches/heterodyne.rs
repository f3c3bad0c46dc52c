//! Cost of a record: 1000 samples at 200 ns, by layer thickness and kind of pulse, beside the same
//! sum in its plain form (exponentials over the band, term by term); and of a scan of 185 such
//! lines. Throughput is in samples.

use std::hint::black_box;

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main};
use ndarray::Array2;
use num_complex::Complex;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use wakescope_signal::literal::literal_envelope;
use wakescope_signal::scan::{PulseKey, pulse_generator};
use wakescope_signal::{
    AccumulatedProducts, Error, GaussianPulse, LineOfSight, NoiseModel, Pulse, Receiver, Record,
    SPEED_OF_LIGHT_M_S, Sample, Scan, Scratch, Shot, Simulator,
};

const SAMPLES: usize = 1000;
const LINES: usize = 185;

/// Table 2's pulse with a frequency that rises by 100 kHz/ns.
fn chirped() -> Result<Pulse, Error> {
    let gaussian = GaussianPulse::table2();
    let times: Vec<f64> = (-600..=600).map(|i| f64::from(i) * 1e-9).collect();
    let amplitude: Vec<Complex<f64>> = times
        .iter()
        .map(|t| {
            let phase = std::f64::consts::PI * 1e14 * t * t;
            Complex::from_polar(gaussian.envelope_per_sqrt_s(*t), phase)
        })
        .collect();
    Pulse::from_envelope(&times, &amplitude, gaussian.energy_j())
}

fn simulator(
    noise: NoiseModel,
    pulse: impl Into<Pulse>,
    samples: usize,
) -> Result<Simulator, Error> {
    let receiver = Receiver {
        noise,
        ..Receiver::table2()
    };
    Simulator::new(
        pulse,
        receiver,
        Record {
            time_of_first_sample_s: 1.0e-6,
            samples,
        },
    )
}

/// A line that covers the record and the pulse around it, `parts` layers per sample: 225 `parts`
/// scatterers in the sum.
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
    let bare =
        simulator(NoiseModel::None, GaussianPulse::table2(), SAMPLES).expect("valid settings");
    let noisy = simulator(NoiseModel::BandLimited, GaussianPulse::table2(), SAMPLES)
        .expect("valid settings");
    for parts in [1, 3, 6] {
        let line = line(parts);
        let speckle = vec![Complex::new(0.6, -0.8); line.layers()];
        group.bench_function(format!("envelope, {} scatterers", 225 * parts), |bench| {
            bench.iter(|| {
                bare.envelope_of_speckle_into(&line, &speckle, &mut scratch, &mut envelope_a)
            });
        });
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        group.bench_function(
            format!("record with noise, {} scatterers", 225 * parts),
            |bench| {
                bench.iter(|| noisy.record_into(&line, &mut rng, &mut scratch, &mut current_a));
            },
        );
    }
    let line = line(1);
    let speckle = vec![Complex::new(0.6, -0.8); line.layers()];
    let chirped = chirped()
        .and_then(|pulse| simulator(NoiseModel::None, pulse, SAMPLES))
        .expect("valid settings");
    group.bench_function("envelope of a chirped pulse, 225 scatterers", |bench| {
        bench.iter(|| {
            chirped.envelope_of_speckle_into(&line, &speckle, &mut scratch, &mut envelope_a)
        });
    });
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    group.bench_function("baseband with noise, 225 scatterers", |bench| {
        bench.iter(|| noisy.record_into(&line, &mut rng, &mut scratch, &mut envelope_a));
    });
    group.sample_size(10);
    group.bench_function("plain form, 225 scatterers", |bench| {
        bench.iter(|| black_box(literal_envelope(&bare, &line, &speckle)));
    });
    group.finish();
}

/// Runs `f` with one thread.
fn on_one_thread<T: Send>(f: impl FnOnce() -> T + Send) -> T {
    #[cfg(feature = "rayon")]
    {
        rayon::ThreadPoolBuilder::new()
            .num_threads(1)
            .build()
            .expect("a thread")
            .install(f)
    }
    #[cfg(not(feature = "rayon"))]
    {
        f()
    }
}

fn scan(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("scan");
    group.throughput(Throughput::Elements((LINES * SAMPLES) as u64));
    group.sample_size(10);
    let noisy = simulator(NoiseModel::BandLimited, GaussianPulse::table2(), SAMPLES)
        .expect("valid settings");
    for parts in [1, 3] {
        let lines = vec![line(parts); LINES];
        let scan = Scan {
            simulator: &noisy,
            lines: LINES,
            pulses_per_line: 1,
            shot: |key: PulseKey| Shot::from(&lines[key.line]),
            generator: |key| pulse_generator(1, key),
            digitiser: None,
        };
        let run = || {
            scan.for_each::<f64, Error>(|_, record| {
                black_box(record);
                Ok(())
            })
        };
        let name = format!(
            "185 lines with speckle and noise, {} scatterers",
            225 * parts
        );
        group.bench_function(format!("{name}, one thread"), |bench| {
            on_one_thread(|| bench.iter(run))
        });
        group.bench_function(format!("{name}, all threads"), |bench| bench.iter(run));
    }
    group.finish();
}

/// The products of 4000 pulses up to the lag 63, what is prepared once a line, and a record: from
/// these follows how many pulses of a line make the products the cheaper.
fn products(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("accumulated products");
    group.sample_size(10);
    for samples in [100, 200, 401, 800] {
        let noise = NoiseModel::BandLimited;
        let simulator = simulator(noise, GaussianPulse::table2(), samples).expect("valid settings");
        let line = line(1);
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        let mut scratch = Scratch::default();
        let mut record_a = vec![0.0; samples];
        group.bench_function(format!("record of {samples} samples"), |bench| {
            bench.iter(|| simulator.record_into(&line, &mut rng, &mut scratch, &mut record_a));
        });
        let real = format!("{samples} real samples");
        let complex = format!("{samples} complex samples");
        prepare_and_draw::<f64>(&mut group, &real, &simulator, &line);
        prepare_and_draw::<Complex<f64>>(&mut group, &complex, &simulator, &line);
    }
    group.finish();
}

fn prepare_and_draw<T: Sample>(
    group: &mut BenchmarkGroup<'_, WallTime>,
    samples: &str,
    simulator: &Simulator,
    line: &LineOfSight,
) {
    group.bench_function(format!("prepare a line, {samples}"), |bench| {
        bench.iter(|| AccumulatedProducts::<T>::new(simulator, line));
    });
    let products = AccumulatedProducts::<T>::new(simulator, line).expect("a covariance");
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut drawn_a2 = Array2::zeros((products.samples(), 64));
    group.bench_function(format!("draw a line, {samples}"), |bench| {
        bench.iter(|| products.draw_into(4000, &mut rng, &mut drawn_a2));
    });
}

criterion_group!(benches, heterodyne, scan, products);
criterion_main!(benches);
