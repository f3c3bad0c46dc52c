//! Cost of a pair of unbiased screens on 512 x 512 points (per screen: half of it).

use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use std::sync::Arc;
use wakescope_optics::screens::{Real, ScreenGenerator, stream};
use wakescope_optics::{Grid, VonKarman};

fn pair<T: Real>(c: &mut Criterion, name: &str) {
    let grid = Grid::table2();
    let Ok(generator) = ScreenGenerator::<T>::new(grid, Arc::new(VonKarman::table2())) else {
        return;
    };
    let mut work = generator.work();
    let mut first = vec![T::zero(); grid.points()];
    let mut second = first.clone();
    let mut index = 0;
    c.bench_function(name, |bench| {
        bench.iter(|| {
            index += 1;
            let mut rng = stream(1, index, 0);
            black_box(
                generator
                    .fill_pair(&mut rng, &mut work, &mut first, &mut second)
                    .ok(),
            )
        });
    });
}

fn all(c: &mut Criterion) {
    pair::<f32>(c, "two screens f32 512x512");
    pair::<f64>(c, "two screens f64 512x512");
}

criterion_group!(benches, all);
criterion_main!(benches);
