//! Error against run time of optics, flow and signal: phase screens, free-space propagation, bistatic efficiency; vortices of Taylor and
//! Green, pressure solve; layers of air.

use super::{Found, Row, few, settings};
use crate::cost::{fastest, measured};
use crate::profile::Profile;
use crate::workspace::numbers;
use fixtures::failure::Failure;
use fixtures::pair::{PairCase, line_of_sight};
use fixtures::{ENERGY_J, receiver};
use num_complex::Complex;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;
use std::f64::consts::TAU;
use std::sync::Arc;
use wakescope_les::solver::{PressureMethod, TimeStep};
use wakescope_les::{TimeScheme, cases};
use wakescope_optics::air::{StructureTable, structure_function_m53};
use wakescope_optics::screens::{Real, ScreenGenerator};
use wakescope_optics::{Grid, Layers, Misalignment, MonteCarlo, Telescope, Turbulence, theory};
use wakescope_signal::scan::{PulseKey, pulse_generator};
use wakescope_signal::{
    GaussianPulse, LineOfSight, NoiseModel, Record, SPEED_OF_LIGHT_M_S, Scratch, Simulator,
};

pub(super) const SEED: u64 = 1;
const CN2_M_M23: f64 = 1e-13;
const RANGE_M: f64 = 1000.0;

/// Screens, propagation and efficiency, and what layers of finite thickness do to it.
pub(super) fn optics(profile: Profile) -> Result<Vec<Row>, Failure> {
    let mut rows = phase_screens::<f32>("f32, one of a pair")?;
    rows.extend(phase_screens::<f64>("f64, one of a pair")?);
    rows.extend(free_space::<f32>("f32, ten steps")?);
    rows.extend(free_space::<f64>("f64, ten steps")?);
    rows.extend(bistatic(profile)?);
    Ok(rows)
}

/// The expected structure function against quadrature: its worst error from two spacings to half the grid.
fn phase_screens<T: Real>(method: &'static str) -> Result<Vec<Row>, Failure> {
    let knob = ["phase screens", method, "points a side"];
    let spectrum = Turbulence::table2(CN2_M_M23)?.spectrum;
    settings(knob, &[128.0, 256.0, 512.0], |points| {
        let points = points as usize;
        let (generator, set_up) = measured(|| {
            let grid = Grid::square(points, 2e-3)?;
            Ok(ScreenGenerator::<T>::new(grid, Arc::clone(&spectrum))?)
        })?;
        let mut worst = 0.0_f64;
        for steps in [2, 4, 8, 16, 32, 64, 128, 256] {
            if steps > points / 2 {
                break;
            }
            let exact = structure_function_m53(&*spectrum, steps as f64 * 2e-3)?;
            worst = worst.max((generator.expected_structure_m53(steps, 0) / exact - 1.0).abs());
        }
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(SEED);
        let mut work = generator.work();
        let mut first = vec![T::zero(); points * points];
        let mut second = first.clone();
        let ((), cost) =
            fastest(|| Ok(generator.fill_pair(&mut rng, &mut work, &mut first, &mut second)?))?;
        Ok(Found {
            set_up_s: set_up.cpu_s,
            ..Found::exact(worst, cost.scaled(0.5))
        })
    })
}

/// Table 2's beam in ten steps, before what its grid does is taken off.
fn free_space<T: Real>(method: &'static str) -> Result<Vec<Row>, Failure> {
    let exact = theory::free_space_efficiency(&Telescope::table2(), RANGE_M)?;
    let knob = ["free-space propagation", method, "points a side"];
    settings(knob, &[128.0, 256.0, 512.0, 1024.0], |points| {
        let screens = screens(10, Grid::square(points as usize, 1.024 / points)?)?;
        let (found, cost) = fastest(|| Ok(screens.grid_free_space::<T>()?))?;
        Ok(Found::exact((found[0] / exact - 1.0).abs(), cost))
    })
}

/// The bias of five layers by exact theory and the standard error of a mean, which falls from that of one run; the time is that of a
/// realisation, the difference of a long and a short run, so that the set-up stands apart.
fn bistatic(profile: Profile) -> Result<Vec<Row>, Failure> {
    let few = profile.choose(20, 40, 40);
    let many = profile.choose(100, 200, 800);
    let bias = layers_bias(5)?;
    let (_, short_cost) = measured(|| Ok(screens(5, Grid::square(256, 4e-3)?)?.run(few)?))?;
    let (long, long_cost) = measured(|| Ok(screens(5, Grid::square(256, 4e-3)?)?.run(many)?))?;
    let one = long_cost.less(short_cost).scaled(1.0 / (many - few) as f64);
    let found = long
        .bistatic
        .ok_or_else(|| Failure::new("the run gave no bistatic efficiency".into()))?;
    let deviation = found.standard_error[0] / found.mean[0] * (many as f64).sqrt();
    let set_up_s = (short_cost.cpu_s - few as f64 * one.cpu_s).max(0.0);
    let knob = [
        "bistatic efficiency",
        "5 layers, 256 points",
        "realisations",
    ];
    settings(knob, &DRAWN_REALISATIONS, |count| {
        let noise = deviation / count.sqrt();
        let error = bias.hypot(noise);
        let standard_error = noise * noise / error / (2.0 * many as f64).sqrt();
        Ok(Found {
            error,
            standard_error,
            cost: one.scaled(count),
            set_up_s,
        })
    })
}

/// As in the table of other programs.
const DRAWN_REALISATIONS: [f64; 6] = [50.0, 200.0, 800.0, 3200.0, 12800.0, 51200.0];

/// What a finite number of screens in the middles of their layers does to the bistatic efficiency, relative, by exact theory.
pub(super) fn layers_bias(count: usize) -> Result<f64, Failure> {
    let telescope = Telescope::table2();
    let turbulence = Turbulence::table2(CN2_M_M23)?;
    let none = Misalignment::NONE;
    let table = StructureTable::new(&*turbulence.spectrum);
    let continuous =
        theory::bistatic_efficiency_with(&telescope, &none, &turbulence.cn2, &table, RANGE_M)?;
    let layers = Layers::equal(count, RANGE_M)?.screens_to(RANGE_M, &turbulence.cn2)?;
    let discrete =
        theory::bistatic_efficiency_screens(&telescope, &none, &layers, &table, RANGE_M)?;
    Ok((discrete / continuous - 1.0).abs())
}

fn screens(layers: usize, grid: Grid) -> Result<MonteCarlo, Failure> {
    let layers = Layers::equal(layers, RANGE_M)?;
    Ok(MonteCarlo {
        layers,
        range_m: vec![RANGE_M],
        grid,
        ..MonteCarlo::table2(CN2_M_M23, SEED)?
    })
}

/// Vortices that become turbulent, and what an unfinished pressure solve costs and leaves.
pub(super) fn les(profile: Profile) -> Result<Vec<Row>, Failure> {
    let mut rows = taylor_green(profile)?;
    for (method, pressure) in [
        ("direct", PressureMethod::Direct),
        ("multigrid", PressureMethod::Multigrid),
    ] {
        let knob = ["pressure", method, "tolerance"];
        rows.extend(settings(
            knob,
            few(&[1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12], profile),
            |tolerance| {
                let mut case = cases::taylor_green_3d(32, 1600.0)?;
                case.settings.pressure = pressure;
                case.settings.pressure_tolerance = tolerance;
                let (divergence, cost) = fastest(|| {
                    let mut flow = case.start()?.0;
                    for _ in 0..10 {
                        flow.step()?;
                    }
                    Ok(flow.relative_divergence())
                })?;
                Ok(Found::exact(divergence, cost))
            },
        )?);
    }
    Ok(rows)
}

/// Energy is compared over so long to either side \[s\].
const APART_S: f64 = 0.2;

/// The rate at which energy is lost, from output to output.
fn lost_energy(energy: &[f64]) -> Vec<f64> {
    energy
        .windows(3)
        .map(|e| (e[0] - e[2]) / (2.0 * APART_S))
        .collect()
}

/// The rate at which the vortices lose energy until t = 10, root mean square error over the peak.
fn taylor_green(profile: Profile) -> Result<Vec<Row>, Failure> {
    let stored = numbers("tgv_re200_fourier96.csv")?;
    let reference: Vec<f64> = stored.iter().step_by(2).map(|row| row[1]).collect();
    let exact = lost_energy(&reference);
    let peak = exact.iter().copied().fold(0.0, f64::max);
    // Steps that divide the outputs, at a Courant number of about one half.
    const CELLS: [f64; 7] = [12.0, 16.0, 24.0, 32.0, 48.0, 64.0, 96.0];
    let cells = &CELLS[..profile.choose(3, 5, 7)];
    let knob = [
        "Taylor-Green vortices, Re 200",
        "Runge-Kutta 3",
        "cells a side",
    ];
    settings(knob, cells, |cells| {
        let substeps = (cells / 24.0).ceil();
        let mut case = cases::taylor_green_3d(cells as usize, 200.0)?;
        case.settings.scheme = TimeScheme::RungeKutta3;
        case.settings.time_step = TimeStep::Fixed {
            step_s: APART_S / substeps,
        };
        let (flow, set_up) = measured(|| Ok(case.start()?.0))?;
        drop(flow);
        let (energy, cost) = fastest(|| {
            let mut flow = case.start()?.0;
            let mut energy = vec![flow.kinetic_energy_m5_s2() / TAU.powi(3)];
            for output in 1..=50 {
                flow.run_to(APART_S * f64::from(output))?;
                energy.push(flow.kinetic_energy_m5_s2() / TAU.powi(3));
            }
            Ok(energy)
        })?;
        let lost = lost_energy(&energy);
        let squares = lost.iter().zip(&exact).map(|(a, b)| (a - b).powi(2));
        let error = (squares.sum::<f64>() / exact.len() as f64).sqrt() / peak;
        Ok(Found {
            set_up_s: set_up.cpu_s,
            ..Found::exact(error, cost.less(set_up))
        })
    })
}

const FIRST_M: f64 = 340.0;

fn simulator(pulse_s: f64, samples: usize) -> Result<Simulator, Failure> {
    let pulse = GaussianPulse::of_full_width(pulse_s, ENERGY_J)?;
    let record = Record {
        time_of_first_sample_s: 2.0 * FIRST_M / SPEED_OF_LIGHT_M_S,
        samples,
    };
    Ok(Simulator::new(pulse, receiver(NoiseModel::None), record)?)
}

/// The line at 2 m over the centre of the nearer vortex of the figures' pair, with `parts` layers for each sample, 0 dB.
fn line(simulator: &Simulator, samples: usize, parts: usize) -> Result<LineOfSight, Failure> {
    let thickness_m = 0.5 * SPEED_OF_LIGHT_M_S / simulator.receiver().sample_rate_hz / parts as f64;
    let before = 256 * parts;
    let weight_per_m = simulator
        .receiver()
        .slowly_varying_snr(ENERGY_J, 1.0)
        .recip();
    let layers = (FIRST_M - before as f64 * thickness_m, thickness_m);
    let wind = PairCase::FIGURES.even().wind()?;
    Ok(line_of_sight(
        &wind,
        (49.0_f64 / 376.5).atan(),
        layers,
        weight_per_m,
        samples * parts + 2 * before,
    )?)
}

/// What the thickness of layers does to the covariance of a gate in a core, and costs a record.
pub(super) fn signal(profile: Profile) -> Result<Vec<Row>, Failure> {
    const GATE: usize = 128;
    const SAMPLES: usize = 300;
    let records = profile.choose(4, 4, 40);
    let mut rows = Vec::new();
    for (case, pulse_s) in [("records, 200 ns", 200e-9), ("records, 400 ns", 400e-9)] {
        let knob = [case, "record of 300 samples", "layers for each sample"];
        let gate = simulator(pulse_s, GATE)?;
        let long = simulator(pulse_s, SAMPLES)?;
        let exact = gate.covariance_a2(&line(&gate, GATE, 8)?)?;
        let largest = exact.iter().map(|value| value.norm()).fold(0.0, f64::max);
        rows.extend(settings(
            knob,
            few(&[1.0, 2.0, 3.0, 4.0, 6.0], profile),
            |parts| {
                let found = gate.covariance_a2(&line(&gate, GATE, parts as usize)?)?;
                let error = (&found - &exact)
                    .iter()
                    .map(|value| value.norm())
                    .fold(0.0, f64::max)
                    / largest;
                let air = line(&long, SAMPLES, parts as usize)?;
                let ((), cost) = fastest(|| {
                    let mut scratch = Scratch::default();
                    let mut out_a = vec![0.0; SAMPLES];
                    for pulse in 0..records {
                        let mut rng = pulse_generator(SEED, PulseKey { line: 0, pulse });
                        long.record_into(&air, &mut rng, &mut scratch, &mut out_a)?;
                    }
                    Ok(())
                })?;
                Ok(Found::exact(error, cost.scaled(1.0 / records as f64)))
            },
        )?);
    }
    Ok(rows)
}

/// How often the kernel is timed: single times scatter by a third, and every time of another machine is scaled by it.
const KERNEL_RUNS: usize = 20;

/// Processor time of the lines of twenty transforms of 512 x 512 points \[s\]: by it times of another machine are scaled to this one.
pub(super) fn kernel_s() -> Result<f64, Failure> {
    let [fft, _] = f64::transforms(512);
    let mut field = vec![Complex::new(1.0, 0.0); 512 * 512];
    let mut scratch = vec![Complex::default(); 512];
    let both_ways = 2 * 20;
    let mut least_s = f64::INFINITY;
    for _ in 0..KERNEL_RUNS {
        let ((), cost) = fastest(|| {
            field.fill(Complex::new(1.0, 0.0));
            for _ in 0..both_ways {
                fft.process_with_scratch(&mut field, &mut scratch);
            }
            Ok(())
        })?;
        least_s = least_s.min(cost.cpu_s);
    }
    Ok(least_s)
}
