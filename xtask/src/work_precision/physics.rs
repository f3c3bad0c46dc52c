//! Error against run time of optics, flow and signal: layers, grid and realisations of the phase screens; mesh, step, scheme and pressure
//! solve of the flow; layers of air.

use super::{Knob, Row, few};
use crate::cost::{Cost, fastest};
use crate::validate::flows::vortex_error;
use fixtures::failure::Failure;
use fixtures::{ENERGY_J, pair::PairCase, receiver};
use std::ops::ControlFlow;
use wakescope_les::solver::PressureMethod;
use wakescope_les::{TimeScheme, Wind, cases};
use wakescope_optics::air::StructureTable;
use wakescope_optics::monte_carlo::{EfficiencyEstimate, Sampling};
use wakescope_optics::{Grid, Layers, Misalignment, MonteCarlo, Stop, Telescope, Turbulence, theory};
use wakescope_signal::scan::{PulseKey, pulse_generator};
use wakescope_signal::{
    GaussianPulse, LineOfSight, NoiseModel, PulseDuration, Record, SPEED_OF_LIGHT_M_S, Scratch, Simulator,
};

pub(super) const SEED: u64 = 1;
const CN2_M_M23: f64 = 1e-13;
const RANGE_M: f64 = 1000.0;

fn screens(layers: usize, grid: Grid) -> Result<MonteCarlo, Failure> {
    let layers = Layers::equal(layers, RANGE_M)?;
    Ok(MonteCarlo { layers, range_m: vec![RANGE_M], grid, ..MonteCarlo::table2(CN2_M_M23, SEED)? })
}

fn efficiency(screens: &MonteCarlo, realisations: usize, double: bool) -> Result<EfficiencyEstimate, Failure> {
    let (stop, go) = (Stop::after(realisations), |_| ControlFlow::Continue(()));
    Ok(if double { screens.run_in::<f64>(stop, go)? } else { screens.run_in::<f32>(stop, go)? })
}

/// What a finite number of screens does to the exact bistatic efficiency, the grid to that of free space before it is corrected, and
/// the number of realisations to the standard error of the monostatic one.
pub(super) fn optics(quick: bool) -> Result<Vec<Row>, Failure> {
    let (telescope, turbulence, none) = (Telescope::table2(), Turbulence::table2(CN2_M_M23)?, Misalignment::NONE);
    let table = StructureTable::new(&*turbulence.spectrum);
    let continuous = theory::bistatic_efficiency_with(&telescope, &none, &turbulence.cn2, &table, RANGE_M)?;
    let knob = Knob::new([
        "layers",
        "mid-layer screens",
        "atmosphere.turbulence.layers",
        "bistatic efficiency, relative",
        "exact theory of the continuous path",
    ]);
    let mut rows = knob.rows(quick, &[1.0, 2.0, 5.0, 10.0, 20.0], |count| {
        let layers = Layers::equal(count as usize, RANGE_M)?.screens_to(RANGE_M, &turbulence.cn2)?;
        let exact = theory::bistatic_efficiency_screens(&telescope, &none, &layers, &table, RANGE_M)?;
        let cost = fastest(|| efficiency(&screens(count as usize, Grid::table2())?, 2, false))?.1;
        Ok((((exact / continuous - 1.0).abs(), 0.0), cost))
    })?;
    let exact = theory::free_space_efficiency(&telescope, RANGE_M)?;
    for (method, double) in [("f32", false), ("f64", true)] {
        let knob = Knob::new([
            "grid",
            method,
            "atmosphere.turbulence.grid_points",
            "free-space efficiency, relative, uncorrected",
            "exact theory",
        ]);
        rows.extend(knob.rows(quick, &[128.0, 256.0, 512.0, 1024.0], |points| {
            let screens = screens(10, Grid::square(points as usize, 1.024 / points)?)?;
            let free =
                || Ok(if double { screens.grid_free_space::<f64>()? } else { screens.grid_free_space::<f32>()? });
            let (found, cost) = fastest(free)?;
            Ok((((found[0] / exact - 1.0).abs(), 0.0), cost))
        })?);
    }
    let ways = [
        ("independent, f32", Sampling::Independent, false),
        ("antithetic, f32", Sampling::Antithetic, false),
        ("independent, f64", Sampling::Independent, true),
    ];
    for &(method, sampling, double) in few(&ways, quick) {
        let knob = Knob::new([
            "realisations",
            method,
            "atmosphere.turbulence.realisations",
            "relative standard error, monostatic",
            "itself",
        ]);
        rows.extend(knob.rows(quick, &[32.0, 128.0, 512.0], |count| {
            let screens = MonteCarlo { sampling, ..screens(5, Grid::square(256, 4e-3)?)? };
            let (found, cost) = fastest(|| efficiency(&screens, count as usize, double))?;
            let error = found.monostatic.standard_error[0] / found.monostatic.mean[0];
            // A standard deviation of so many independent samples.
            Ok(((error, error / (2.0 * (found.independent_samples.max(2) - 1) as f64).sqrt()), cost))
        })?);
    }
    Ok(rows)
}

/// Plane vortices by mesh and by step with either scheme, and what an unfinished pressure solve costs and leaves.
pub(super) fn les(quick: bool) -> Result<Vec<Row>, Failure> {
    const VISCOSITY_M2_S: f64 = 0.01;
    const END_S: f64 = 0.25;
    let vortices = |cells: f64, steps: f64, scheme: TimeScheme| -> Result<(f64, Cost), Failure> {
        let mut case = cases::taylor_green_plane(cells as usize, [0.5, -0.4], VISCOSITY_M2_S, END_S / steps)?;
        case.settings.scheme = scheme;
        // A step beyond the limit of the scheme is refused, which is a result: no number.
        fastest(|| Ok(vortex_error(&case, steps as usize, VISCOSITY_M2_S).unwrap_or(f64::NAN)))
    };
    let mut rows = Vec::new();
    for (method, scheme) in
        [("Adams-Bashforth 2", TimeScheme::AdamsBashforth2), ("Runge-Kutta 3", TimeScheme::RungeKutta3)]
    {
        let knob = Knob::new([
            "plane vortices, grid",
            method,
            "cells",
            "largest velocity error over the largest velocity; no number beyond the limit of the scheme",
            "exact solution",
        ]);
        let exact = |(error, cost): (f64, Cost)| ((error, 0.0), cost);
        rows.extend(knob.rows(quick, &[32.0, 64.0, 128.0, 192.0], |cells| {
            Ok(exact(vortices(cells, (0.625 * cells).floor(), scheme)?))
        })?);
        let knob = Knob { case: "plane vortices, step", knob: "steps", ..knob };
        rows.extend(knob.rows(quick, &[16.0, 32.0, 64.0, 128.0], |steps| Ok(exact(vortices(64.0, steps, scheme)?)))?);
    }
    for (method, pressure) in [("direct", PressureMethod::Direct), ("multigrid", PressureMethod::Multigrid)] {
        let knob = Knob::new([
            "pressure",
            method,
            "tolerance",
            "divergence over the largest velocity per cell",
            "none: what the solve leaves",
        ]);
        rows.extend(knob.rows(quick, &[1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12], |tolerance| {
            let mut case = cases::taylor_green_3d(32, 1600.0)?;
            (case.settings.pressure, case.settings.pressure_tolerance) = (pressure, tolerance);
            let (divergence, cost) = fastest(|| {
                let mut flow = case.start()?.0;
                for _ in 0..10 {
                    flow.step()?;
                }
                Ok(flow.relative_divergence())
            })?;
            Ok(((divergence, 0.0), cost))
        })?);
    }
    Ok(rows)
}

const FIRST_M: f64 = 340.0;

fn simulator(pulse_s: f64, samples: usize) -> Result<Simulator, Failure> {
    let pulse = GaussianPulse::new(PulseDuration::FullWidthHalfMaximum(pulse_s), ENERGY_J)?;
    let record = Record { time_of_first_sample_s: 2.0 * FIRST_M / SPEED_OF_LIGHT_M_S, samples };
    Ok(Simulator::new(pulse, receiver(NoiseModel::None), record)?)
}

/// The line at 2 m over the centre of the nearer vortex of the figures' pair, with `parts` layers for each sample, 0 dB.
fn line(simulator: &Simulator, samples: usize, parts: usize) -> Result<LineOfSight, Failure> {
    let wind = PairCase::FIGURES.even().wind()?;
    let (sin, cos) = (49.0_f64 / 376.5).atan().sin_cos();
    let thickness_m = 0.5 * SPEED_OF_LIGHT_M_S / simulator.receiver().sample_rate_hz / parts as f64;
    let before = 256 * parts;
    let layers = samples * parts + 2 * before;
    let first_range_m = FIRST_M - before as f64 * thickness_m;
    let at_m = |l: usize| first_range_m + l as f64 * thickness_m;
    let points_m: Vec<[f64; 3]> = (0..layers).map(|l| [0.0, at_m(l) * cos, at_m(l) * sin]).collect();
    let mut wind_m_s = vec![[0.0; 3]; layers];
    wind.velocity_into(&points_m, 0.0, &mut wind_m_s)?;
    Ok(LineOfSight {
        first_range_m,
        layer_thickness_m: thickness_m,
        radial_velocity_m_s: wind_m_s.iter().map(|u| u[1] * cos + u[2] * sin).collect(),
        weight_per_m: vec![simulator.receiver().slowly_varying_snr(ENERGY_J, 1.0).recip(); layers],
    })
}

/// What the thickness of layers does to the covariance of a gate in a core, and costs a record.
pub(super) fn signal(quick: bool) -> Result<Vec<Row>, Failure> {
    const GATE: usize = 128;
    const SAMPLES: usize = 300;
    let records = if quick { 4 } else { 40 };
    let mut rows = Vec::new();
    for (case, pulse_s) in [("layers, 200 ns", 200e-9), ("layers, 400 ns", 400e-9)] {
        let knob = Knob::new([
            case,
            "record of 300 samples",
            "layers for each sample",
            "covariance of the samples, relative, worst",
            "layers of 7.5 cm",
        ]);
        let (gate, long) = (simulator(pulse_s, GATE)?, simulator(pulse_s, SAMPLES)?);
        let exact = gate.covariance_a2(&line(&gate, GATE, 8)?)?;
        let largest = exact.iter().map(|value| value.norm()).fold(0.0, f64::max);
        rows.extend(knob.rows(quick, &[1.0, 2.0, 3.0, 4.0, 6.0], |parts| {
            let found = gate.covariance_a2(&line(&gate, GATE, parts as usize)?)?;
            let error = (&found - &exact).iter().map(|value| value.norm()).fold(0.0, f64::max) / largest;
            let air = line(&long, SAMPLES, parts as usize)?;
            let ((), cost) = fastest(|| {
                let (mut scratch, mut out_a) = (Scratch::default(), vec![0.0; SAMPLES]);
                for pulse in 0..records {
                    let mut rng = pulse_generator(SEED, PulseKey { line: 0, pulse });
                    long.record_into(&air, &mut rng, &mut scratch, &mut out_a)?;
                }
                Ok(())
            })?;
            Ok(((error, 0.0), cost.per(records)))
        })?);
    }
    Ok(rows)
}
