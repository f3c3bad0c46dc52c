//! Cost of one solve of the pressure equation, beside the bare memory pass and the Fourier transforms it cannot do without.
//!
//! The numbers to read are the throughputs: cells per second. `WAKESCOPE_BENCH_THREADS` sets the threads (1 by default).

use std::hint::black_box;

use criterion::{BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main, measurement::WallTime};
use realfft::RealFftPlanner;
use wakescope_les::solver::{PressureEquation, PressureMethod};
use wakescope_les::{Direction, Error, Mapping, Mesh, Wall};

/// Periodic in x, slip planes in y, a no-slip wall below and a slip plane above in z.
fn mesh([nx, ny, nz]: [usize; 3], strength: Option<f64>) -> Result<Mesh, Error> {
    let x = Direction::periodic(nx, 0.0, 2.0);
    let y = if ny == 1 { Direction::thin(1.0) } else { Direction::between(ny, -3.0, 3.0, Wall::Slip, Wall::Slip) };
    let z = Direction::between(nz, 0.0, 3.0, Wall::AT_REST, Wall::Slip);
    match strength {
        None => Mesh::new(x, y, z),
        Some(strength) if ny == 1 => Mesh::new(x, y, z.stretched(Mapping::TanhLow { strength })),
        Some(strength) => {
            Mesh::new(x, y.stretched(Mapping::SinhMiddle { strength }), z.stretched(Mapping::TanhLow { strength }))
        }
    }
}

/// Divergence with large scales and noise.
fn right_side(equation: &PressureEquation, cells: [usize; 3]) -> Result<Vec<f64>, Error> {
    let mut state = 1_u64;
    let mut right: Vec<f64> = (0..cells.iter().product())
        .map(|p| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let noise = (state >> 40) as f64 / f64::from(1 << 24) - 0.5;
            (p as f64 * 0.01).sin() + noise
        })
        .collect();
    equation.weigh(&mut right)?;
    Ok(right)
}

fn solve(
    group: &mut BenchmarkGroup<'_, WallTime>,
    cells: [usize; 3],
    strength: Option<f64>,
    (method, tolerance): (PressureMethod, f64),
) -> Result<(), Error> {
    let mut equation = PressureEquation::new(&mesh(cells, strength)?, method);
    let right = right_side(&equation, cells)?;
    let mut field = right.clone();
    let name = format!("{method:?} to {tolerance:.0e}, {cells:?} stretched by {:.0}", strength.unwrap_or(0.0));
    group.throughput(Throughput::Elements(right.len() as u64));
    group.bench_function(name, |bench| {
        bench.iter(|| {
            field.copy_from_slice(&right);
            black_box(equation.solve(&mut field, tolerance).map_or(f64::NAN, |solved| solved.imbalance))
        });
    });
    Ok(())
}

fn floors(group: &mut BenchmarkGroup<'_, WallTime>, [nx, ny, nz]: [usize; 3]) {
    let mut field = vec![1.0_f64; nx * ny * nz];
    group.throughput(Throughput::Elements(field.len() as u64));
    group.bench_function("floor: one pass over the field", |bench| {
        bench.iter(|| {
            for value in &mut *black_box(&mut field) {
                *value = 0.5 * *value + 0.5;
            }
        });
    });
    let mut planner = RealFftPlanner::<f64>::new();
    let (forward, inverse) = (planner.plan_fft_forward(nx), planner.plan_fft_inverse(nx));
    let (mut modes, mut scratch) = (forward.make_output_vec(), forward.make_scratch_vec());
    let mut back = inverse.make_scratch_vec();
    group.bench_function("floor: Fourier transform of the rows there and back", |bench| {
        bench.iter(|| {
            for row in black_box(&mut field).chunks_mut(nx) {
                let there = forward.process_with_scratch(row, &mut modes, &mut scratch).is_ok();
                let back = inverse.process_with_scratch(&mut modes, row, &mut back).is_ok();
                black_box(there && back);
            }
        });
    });
}

/// Sizes and strengths of the stretching.
const MESHES: [([usize; 3], Option<f64>); 5] = [
    ([64, 128, 96], None),
    ([64, 128, 96], Some(3.0)),
    ([128, 128, 128], Some(3.0)),
    ([97, 61, 53], Some(3.0)),
    ([384, 1, 384], Some(2.0)),
];

fn all(c: &mut Criterion) {
    let threads = std::env::var("WAKESCOPE_BENCH_THREADS").ok().and_then(|n| n.parse().ok()).unwrap_or(1);
    let built = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global();
    assert!(built.is_ok(), "{built:?}");
    let mut group = c.benchmark_group("pressure");
    group.sample_size(10);
    floors(&mut group, MESHES[0].0);
    for (cells, strength) in MESHES {
        for method in [(PressureMethod::Direct, 1e-6), (PressureMethod::Multigrid, 1e-6)] {
            let done = solve(&mut group, cells, strength, method);
            assert!(done.is_ok(), "the mesh {cells:?} was refused: {done:?}");
        }
    }
    group.finish();
}

criterion_group!(benches, all);
criterion_main!(benches);
