//! Cost of one time step, beside a bare pass over the same memory.
//!
//! The numbers to read are the throughputs: cells per second of one step on one core. `WAKESCOPE_BENCH_THREADS` sets the
//! threads (1 by default), so that the speed-up is the ratio of two runs.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use wakescope_les::analysis::WakeScales;
use wakescope_les::cases::{self, Case, VortexPairCase};
use wakescope_les::solver::PressureMethod;
use wakescope_les::{Error, Flow, SubgridModel, TimeScheme, TimeStep};

const MULTISCALE: SubgridModel = SubgridModel::MULTISCALE_WALE;

fn bench_case(c: &mut Criterion, name: &str, case: &Case) -> Result<(), Error> {
    let (mut flow, _) = case.start()?;
    let cells: usize = flow.mesh().cells().iter().product();
    let mut group = c.benchmark_group("step");
    group
        .sample_size(10)
        .throughput(Throughput::Elements(cells as u64));
    group.bench_function(name, |bench| {
        bench.iter(|| black_box(energy_after(&mut flow)))
    });
    group.finish();
    Ok(())
}

fn energy_after(flow: &mut Flow) -> f64 {
    flow.step()
        .map_or(f64::NAN, |report| report.kinetic_energy_m5_s2)
}

fn memory_pass(c: &mut Criterion) {
    let cells = 64 * 64 * 64;
    let mut group = c.benchmark_group("step");
    group.throughput(Throughput::Elements(cells as u64));
    let (from, mut to) = (vec![1.0_f64; 3 * cells], vec![0.0_f64; 3 * cells]);
    group.bench_function("floor: one pass over three fields", |bench| {
        bench.iter(|| {
            for (to, from) in to.iter_mut().zip(black_box(&from)) {
                *to += 0.5 * from;
            }
            black_box(to[0])
        })
    });
    group.finish();
}

fn all(c: &mut Criterion) -> Result<(), Error> {
    let mut vortices = cases::taylor_green_3d(64, 1600.0)?;
    bench_case(c, "Taylor-Green 64^3, no model", &vortices)?;
    vortices.settings.subgrid = MULTISCALE;
    bench_case(c, "Taylor-Green 64^3, multiscale model", &vortices)?;
    let pair = VortexPairCase {
        cells: [48, 96, 64],
        slip_sides: true,
        ..VortexPairCase::coarse()
    };
    let mut wake = pair.case(TimeStep::Fixed { step_s: 1e-3 })?;
    wake.settings.subgrid = MULTISCALE;
    // One pressure solve per step, as in the other flows.
    wake.settings.scheme = TimeScheme::AdamsBashforth2;
    bench_case(c, "pair above ground 48 x 96 x 64, multiscale model", &wake)?;
    wake.settings.pressure = PressureMethod::Multigrid;
    wake.settings.pressure_tolerance = 1e-6;
    bench_case(
        c,
        "pair above ground 48 x 96 x 64, multiscale model, multigrid",
        &wake,
    )?;
    coarse_wake(c)
}

/// A Runge-Kutta step of the coarse wake, and a record of what is measured in it.
fn coarse_wake(c: &mut Criterion) -> Result<(), Error> {
    let pair = VortexPairCase::coarse();
    let mut meter = pair.meter(&WakeScales::REDUCED)?;
    let case = pair.case(VortexPairCase::steps(0.01))?;
    bench_case(c, "coarse wake, Runge-Kutta", &case)?;
    let (flow, _) = case.start()?;
    let cells: usize = flow.mesh().cells().iter().product();
    let mut group = c.benchmark_group("step");
    group
        .sample_size(10)
        .throughput(Throughput::Elements(cells as u64));
    group.bench_function("coarse wake, record", |bench| {
        bench.iter(|| {
            black_box(
                meter
                    .measure(&flow)
                    .map_or(f64::NAN, |record| record.energy_m4_s2),
            )
        })
    });
    group.finish();
    Ok(())
}

fn steps(c: &mut Criterion) {
    let threads = std::env::var("WAKESCOPE_BENCH_THREADS")
        .ok()
        .and_then(|t| t.parse().ok())
        .unwrap_or(1);
    // A second pool cannot be made; the first benchmark decides.
    let _ = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build_global();
    memory_pass(c);
    all(c).expect("the cases are fixed and valid");
}

criterion_group!(benches, steps);
criterion_main!(benches);
