//! Cost of turbulence along a line of sight, per sample: 512 modes, lines of 1000 samples.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use wakescope_les::winds::{Eddies, SampledLine, isotropic_modes};
use wakescope_les::{Error, Wind};

const SAMPLES: usize = 1000;

/// A field with the default keys of a scene.
fn field() -> Result<Eddies, Error> {
    let outer_scale_m = 100.0;
    let band_rad_m = [0.1 / outer_scale_m, std::f64::consts::TAU / 2.0];
    let energy = |k: f64| {
        let x2 = (k * outer_scale_m).powi(2);
        x2 * x2 / (1.0 + x2).powf(17.0 / 6.0)
    };
    let uniforms = |n: usize| [0.1, 0.2, 0.3].map(|start| (start + 0.618 * n as f64).fract());
    Eddies::new(isotropic_modes(
        band_rad_m,
        512,
        [0.3, 0.6],
        energy,
        uniforms,
    )?)
}

fn bench_line(c: &mut Criterion, name: &str, field: &Eddies, samples: usize) {
    let mut group = c.benchmark_group("eddies");
    group.throughput(Throughput::Elements(samples as u64));
    let mut out_m_s = vec![0.0; samples];
    group.bench_function(BenchmarkId::new(name, samples), |bench| {
        bench.iter(|| {
            let line = SampledLine {
                origin_m: [0.0, 100.0, 2.0],
                direction: [0.0, 0.995, 0.0998],
                step_m: 0.6,
            };
            let result = field.along_line_into(black_box(&line), 0, 1.0, &mut out_m_s);
            black_box((result, out_m_s[samples - 1]))
        });
    });
    group.finish();
}

fn benches(c: &mut Criterion) {
    let Ok(field) = field() else {
        return;
    };
    let all = field.clone().summed_at_each_sample();
    bench_line(c, "levels", &field, SAMPLES);
    bench_line(c, "levels", &field, 400);
    bench_line(c, "all", &all, SAMPLES);
    bench_line(
        c,
        "levels over a blocking ground",
        &field.clone().blocked(),
        SAMPLES,
    );
    bench_line(c, "all over a blocking ground", &all.blocked(), SAMPLES);
}

criterion_group!(eddies, benches);
criterion_main!(eddies);
