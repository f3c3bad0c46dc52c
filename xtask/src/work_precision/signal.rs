//! Error against run time of the simulated signal: layer thickness, the fast sum against the literal one, numbers of pulses.
//!
//! All on one line of sight through the core of a vortex, the steepest of the chapter's scene.

use super::{Row, few};
use crate::cost::fastest;
use fixtures::failure::Failure;
use fixtures::{ENERGY_J, receiver};
use wakescope_les::{CirculationProfile, Ground, Motion, VortexPair, Wind};
use wakescope_signal::literal::literal_envelope;
use wakescope_signal::scan::{PulseKey, pulse_generator};
use wakescope_signal::{
    GaussianPulse, LineOfSight, NoiseModel, PulseDuration, Record, SPEED_OF_LIGHT_M_S, Scratch, Simulator,
};

const SEED: u64 = 1;
const FIRST_M: f64 = 340.0;
/// Thickness of the thickest layers, c T_s / 2 \[m\].
const SAMPLE_M: f64 = 0.5 * SPEED_OF_LIGHT_M_S / 250e6;
const COVARIANCE: [&str; 2] = ["covariance of the samples, relative, worst", "layers of 7.5 cm"];

/// All measurements; few and coarse ones if `quick`.
pub(super) fn rows(quick: bool) -> Result<Vec<Row>, Failure> {
    let mut rows = Vec::new();
    for (case, pulse_s) in [("layers, 200 ns", 200e-9), ("layers, 400 ns", 400e-9)] {
        rows.extend(layers(case, pulse_s, quick)?);
    }
    rows.extend(sums()?);
    rows.extend(pulses(quick)?);
    Ok(rows)
}

fn simulator(pulse_s: f64, noise: NoiseModel, samples: usize) -> Result<Simulator, Failure> {
    let pulse = GaussianPulse::new(PulseDuration::FullWidthHalfMaximum(pulse_s), ENERGY_J)?;
    let record = Record { time_of_first_sample_s: 2.0 * FIRST_M / SPEED_OF_LIGHT_M_S, samples };
    Ok(Simulator::new(pulse, receiver(noise), record)?)
}

/// The line at 2 m over the centre of the nearer vortex, with `parts` layers for each sample, 0 dB.
fn line(simulator: &Simulator, samples: usize, parts: usize) -> Result<LineOfSight, Failure> {
    let wind = VortexPair {
        circulation_m2_s: 500.0,
        spacing_m: 47.0,
        core_radius_m: 2.35,
        lateral_position_m: 400.0,
        height_m: 47.0,
        ground: Ground::Image,
        profile: CirculationProfile::Algebraic,
        motion: Motion::Frozen,
    }
    .wind()?;
    let (sin, cos) = (49.0_f64 / 376.5).atan().sin_cos();
    let thickness_m = SAMPLE_M / parts as f64;
    let before = 256 * parts;
    let layers = samples * parts + 2 * before;
    let first_range_m = FIRST_M - before as f64 * thickness_m;
    let at_m = |l: usize| first_range_m + l as f64 * thickness_m;
    let points_m: Vec<[f64; 3]> = (0..layers).map(|l| [0.0, at_m(l) * cos, at_m(l) * sin]).collect();
    let mut wind_m_s = vec![[0.0; 3]; layers];
    wind.velocity_into(&points_m, 0.0, &mut wind_m_s)?;
    let weight_per_m = simulator.receiver().slowly_varying_snr(ENERGY_J, 1.0).recip();
    Ok(LineOfSight {
        first_range_m,
        layer_thickness_m: thickness_m,
        radial_velocity_m_s: wind_m_s.iter().map(|u| u[1] * cos + u[2] * sin).collect(),
        weight_per_m: vec![weight_per_m; layers],
    })
}

/// What layers of that thickness do to the covariance of a gate in the core, and what a record of 300 samples costs with them.
fn layers(case: &'static str, pulse_s: f64, quick: bool) -> Result<Vec<Row>, Failure> {
    const GATE: usize = 128;
    const LONG: usize = 300;
    let records = if quick { 4 } else { 40 };
    let (gate, long) = (simulator(pulse_s, NoiseModel::None, GATE)?, simulator(pulse_s, NoiseModel::None, LONG)?);
    let exact = gate.covariance_a2(&line(&gate, GATE, 8)?)?;
    let largest = exact.iter().map(|value| value.norm()).fold(0.0, f64::max);
    let mut rows = Vec::new();
    for &parts in few(&[1, 2, 3, 4, 6], quick) {
        let found = gate.covariance_a2(&line(&gate, GATE, parts)?)?;
        let error = (&found - &exact).iter().map(|value| value.norm()).fold(0.0, f64::max) / largest;
        let air = line(&long, LONG, parts)?;
        let ((), cost) = fastest(|| {
            let (mut scratch, mut out_a) = (Scratch::default(), vec![0.0; LONG]);
            for pulse in 0..records {
                let mut rng = pulse_generator(SEED, PulseKey { line: 0, pulse });
                long.record_into(&air, &mut rng, &mut scratch, &mut out_a)?;
            }
            Ok(())
        })?;
        let knob = ("layers for each sample", parts as f64);
        rows.push(Row::new(case, "record of 300 samples", knob, (error, 0.0), COVARIANCE, cost.per(records)));
    }
    Ok(rows)
}

/// The fast sum with phasors against the sum as it is written.
fn sums() -> Result<Vec<Row>, Failure> {
    const SAMPLES: usize = 300;
    let simulator = simulator(200e-9, NoiseModel::None, SAMPLES)?;
    let mut rows = Vec::new();
    for parts in [1, 3] {
        let air = line(&simulator, SAMPLES, parts)?;
        // any amplitudes of order one serve: those of turning phases need no generator
        let speckle: Vec<num_complex::Complex<f64>> =
            (0..air.layers()).map(|l| num_complex::Complex::from_polar(1.0, 2.4 * (l * l) as f64)).collect();
        let (literal_a, literal_cost): (Vec<num_complex::Complex<f64>>, _) =
            fastest(|| Ok(literal_envelope(&simulator, &air, &speckle)?))?;
        const TIMES: usize = 20;
        let (fast_a, fast_cost): (Vec<num_complex::Complex<f64>>, _) = fastest(|| {
            let (mut scratch, mut out_a) = (Scratch::default(), vec![num_complex::Complex::<f64>::default(); SAMPLES]);
            for _ in 0..TIMES {
                simulator.envelope_of_speckle_into(&air, &speckle, &mut scratch, &mut out_a)?;
            }
            Ok(out_a)
        })?;
        let largest = literal_a.iter().map(|value| value.norm()).fold(0.0, f64::max);
        let error = literal_a.iter().zip(&fast_a).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max) / largest;
        for (method, cost) in [("literal sum", literal_cost), ("phasors", fast_cost.per(TIMES))] {
            let words = ["envelope, relative, worst: difference of the two", "each other"];
            let knob = ("layers for each sample", parts as f64);
            rows.push(Row::new("sum over layers", method, knob, (error, 0.0), words, cost));
        }
    }
    Ok(rows)
}

/// Mean power of so many pulses against its expectation, for each kind of noise.
fn pulses(quick: bool) -> Result<Vec<Row>, Failure> {
    const SAMPLES: usize = 300;
    let mut rows = Vec::new();
    for (method, noise) in
        [("no noise", NoiseModel::None), ("band noise", NoiseModel::BandLimited), ("white noise", NoiseModel::White)]
    {
        let simulator = simulator(200e-9, noise, SAMPLES)?;
        let air = line(&simulator, SAMPLES, 3)?;
        let mut expected_a2 = vec![0.0; SAMPLES];
        simulator.mean_power_into(&air, &mut Scratch::default(), &mut expected_a2)?;
        let noise_a2 = match noise {
            NoiseModel::None => 0.0,
            NoiseModel::BandLimited => simulator.receiver().noise_variance_a2(),
            // the same density up to half the sampling rate
            NoiseModel::White => 0.5 * 250e6 * simulator.receiver().noise_density_a2_hz(),
        };
        let expected_a2 = expected_a2.iter().sum::<f64>() / SAMPLES as f64 + noise_a2;
        for &count in few(&[100, 400, 1600, 6400], quick) {
            let ([power_a2, square_a4], cost) = fastest(|| {
                let (mut scratch, mut out_a) = (Scratch::default(), vec![0.0; SAMPLES]);
                let mut sums = [0.0; 2];
                for pulse in 0..count {
                    let mut rng = pulse_generator(SEED, PulseKey { line: 1, pulse });
                    simulator.record_into(&air, &mut rng, &mut scratch, &mut out_a)?;
                    let power_a2 = out_a.iter().map(|a| a * a).sum::<f64>() / SAMPLES as f64;
                    sums = [sums[0] + power_a2, sums[1] + power_a2 * power_a2];
                }
                Ok(sums.map(|sum| sum / count as f64))
            })?;
            let scatter_a2 = ((square_a4 - power_a2 * power_a2) / count as f64).sqrt();
            let error = ((power_a2 / expected_a2 - 1.0).abs(), scatter_a2 / expected_a2);
            let words = ["mean power, relative", "expected power of signal and noise"];
            rows.push(Row::new("mean power", method, ("pulses", count as f64), error, words, cost));
        }
    }
    Ok(rows)
}
