//! Cost of one layer on 512 x 512 points, beside the bare pair of Fourier transforms: the floor
//! below which no layer can go.

use criterion::{Criterion, criterion_group, criterion_main};
use rustfft::num_complex::Complex;
use std::hint::black_box;
use wakescope_optics::Grid;
use wakescope_optics::screens::{Propagator, Real};

const N: usize = 512;

/// Rows, transpose, rows, and back: what any split step needs at least.
fn transform_pair<T: Real>(c: &mut Criterion, name: &str) {
    let [forward, inverse] = T::transforms(N);
    let mut scratch = vec![
        Complex::default();
        forward
            .get_inplace_scratch_len()
            .max(inverse.get_inplace_scratch_len())
    ];
    let mut a = vec![Complex::new(T::of(1.0), T::of(0.0)); N * N];
    let mut b = a.clone();
    let transpose = |from: &[Complex<T>], to: &mut [Complex<T>]| {
        for (block, rows) in from.chunks_exact(8 * N).enumerate() {
            for (i, column) in to.chunks_exact_mut(N).enumerate() {
                for (j, value) in column[8 * block..8 * block + 8].iter_mut().enumerate() {
                    *value = rows[j * N + i];
                }
            }
        }
    };
    c.bench_function(name, |bench| {
        bench.iter(|| {
            forward.process_with_scratch(&mut a, &mut scratch);
            transpose(&a, &mut b);
            forward.process_with_scratch(&mut b, &mut scratch);
            inverse.process_with_scratch(&mut b, &mut scratch);
            transpose(&b, &mut a);
            inverse.process_with_scratch(&mut a, &mut scratch);
            // Keep the numbers finite.
            for value in a.iter_mut().step_by(N) {
                *value = Complex::new(T::of(1.0), T::of(0.0));
            }
            black_box(a[1])
        });
        let scale = T::of(1.0 / (N * N) as f64);
        a.iter_mut().for_each(|v| *v = *v * scale * scale);
    });
}

fn layer<T: Real>(c: &mut Criterion, name: &str) {
    let grid = Grid::table2();
    let Ok(propagator) = Propagator::<T>::new(grid, 1.55e-6) else {
        return;
    };
    let Ok(transfer) = propagator.transfer(150.0) else {
        return;
    };
    let mut work = propagator.work();
    let phase: Vec<T> = (0..grid.points())
        .map(|i| T::of((i as f64 * 0.01).sin() * 7.0))
        .collect();
    let mut field = vec![Complex::new(T::of(1.0), T::of(0.0)); grid.points()];
    c.bench_function(name, |bench| {
        bench.iter(|| {
            field[0] = Complex::new(T::of(1.0), T::of(0.0));
            black_box(
                propagator
                    .step(&mut field, Some((&phase, T::of(1.0))), &transfer, &mut work)
                    .ok(),
            )
        });
    });
}

fn all(c: &mut Criterion) {
    transform_pair::<f32>(c, "transform pair f32 512x512");
    layer::<f32>(c, "layer f32 512x512");
    transform_pair::<f64>(c, "transform pair f64 512x512");
    layer::<f64>(c, "layer f64 512x512");
}

criterion_group!(benches, all);
criterion_main!(benches);
