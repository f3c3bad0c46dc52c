//! Extreme cases of the simulated signal.

use super::extreme::Extreme;
use crate::failure::Failure;
use fixtures::{ENERGY_J, receiver};
use num_complex::Complex;
use std::f64::consts::PI;
use wakescope_signal::scan::{PulseKey, pulse_generator};
use wakescope_signal::{
    GaussianPulse, LayerLimits, LineOfSight, NoiseModel, Pulse, PulseDuration, RangeFilter, Receiver, Record,
    SPEED_OF_LIGHT_M_S, Scratch, Shot, Simulator,
};

type Number = Result<f64, Failure>;

/// Range step of one sample at 250 MHz \[m\].
const STEP_M: f64 = 0.5 * SPEED_OF_LIGHT_M_S / 250e6;

/// One case a row.
#[rustfmt::skip]
pub(super) fn cases() -> Vec<Extreme> {
    use Extreme as E;
    const COVARIANCE: &str = "covariance against the closed form, relative, worst lag";
    vec![
        E::at_most("pulse much longer than the gate", "10 us, gate 256 ns", COVARIANCE, 2e-4, || covariance(1e-5)),
        E::at_most("pulse much shorter than the gate", "1 ns, gate 256 ns", COVARIANCE, 2e-4, || covariance(1e-9)),
        E::at_most("pulse average over kilometres", "10 us in waves of 188 m", "velocity against the closed form, m/s", 1e-3, || pulse_average(1e-5)),
        E::at_most("pulse average of a point", "1 ns in waves of 188 m", "velocity against the closed form, m/s", 1e-3, || pulse_average(1e-9)),
        E::refused("layers too thick for the pulse", "0.6 m, 1 ns", "layer_thickness_m", || Ok(record(&simulator(1e-9, NoiseModel::None, 16)?, &line(|_| 1.0, 1e-9), 1)?[0])),
        E::refused("pulse without duration", "0 s", "must be", || Ok(simulator(0.0, NoiseModel::None, 16)?.time_s(0))),
        E::refused("pulse of NaN duration", "NaN s", "must be", || Ok(simulator(f64::NAN, NoiseModel::None, 16)?.time_s(0))),
        E::refused("record without samples", "0 samples", "samples", || Ok(simulator(2e-7, NoiseModel::None, 0)?.time_s(0))),
        E::between("velocity beyond Nyquist, 63 m/s", "folds at 62.0 m/s", "velocity of the tone, m/s", (60.85, 61.15), || folded(63.0)),
        E::between("velocity far beyond Nyquist, 100 m/s", "folds at 62.0 m/s", "velocity of the tone, m/s", (23.85, 24.15), || folded(100.0)),
        E::at_most("SNR -60 dB", "signal and noise beside their sum", "samples that are not the sum, relative", 1e-14, || additive(-60.0)),
        E::at_most("SNR +100 dB", "signal and noise beside their sum", "samples that are not the sum, relative", 1e-14, || additive(100.0)),
        E::at_most("returns of 1e-200", "weight 1e-200 per m", "amplitude over its root, relative", 1e-9, || scaled(1e-200)),
        E::at_most("returns of 1e200", "weight 1e200 per m", "amplitude over its root, relative", 1e-9, || scaled(1e200)),
        E::refused("returns beyond all numbers", "1e200 W of local light, weight 1e200 per m", "overflows", overflow),
        E::at_most("air that returns nothing", "weight 0, no noise", "largest current, A", 0.0, || Ok(largest(&record(&simulator(2e-7, NoiseModel::None, 64)?, &line(|_| 5.0, 0.0), 1)?))),
        E::at_most("line that leaves the flow", "wind NaN beyond 420 m", "largest current 75 m later, A", 0.0, leaves),
        E::refused("efficiency NaN", "one layer", "efficiency[4]", || with_efficiency(f64::NAN)),
        E::refused("negative efficiency", "one layer", "efficiency[4]", || with_efficiency(-0.1)),
        E::refused("weight NaN", "weight_per_m of all layers", "weight_per_m", || Ok(record(&simulator(2e-7, NoiseModel::None, 16)?, &line(|_| 5.0, f64::NAN), 1)?[0])),
        E::refused("bandwidth beyond Nyquist", "400 MHz at 250 MHz", "band", wide_band),
    ]
}

fn pulse(duration_s: f64) -> Result<GaussianPulse, Failure> {
    Ok(GaussianPulse::new(PulseDuration::FullWidthHalfMaximum(duration_s), ENERGY_J)?)
}

/// Records that begin at 400 m.
fn simulator(duration_s: f64, noise: NoiseModel, samples: usize) -> Result<Simulator, Failure> {
    simulator_at(400.0, duration_s, noise, samples)
}

fn simulator_at(first_m: f64, duration_s: f64, noise: NoiseModel, samples: usize) -> Result<Simulator, Failure> {
    let record = Record { time_of_first_sample_s: 2.0 * first_m / SPEED_OF_LIGHT_M_S, samples };
    Ok(Simulator::new(pulse(duration_s)?, receiver(noise), record)?)
}

/// Layers of a sample's thickness from 300 to 560 m.
fn line(velocity_m_s: impl Fn(f64) -> f64, weight_per_m: f64) -> LineOfSight {
    line_between(300.0, 560.0, STEP_M, velocity_m_s, weight_per_m)
}

fn line_between(
    first_m: f64,
    last_m: f64,
    thickness_m: f64,
    velocity_m_s: impl Fn(f64) -> f64,
    weight_per_m: f64,
) -> LineOfSight {
    let layers = ((last_m - first_m) / thickness_m) as usize;
    LineOfSight {
        first_range_m: first_m,
        layer_thickness_m: thickness_m,
        radial_velocity_m_s: (0..layers).map(|l| velocity_m_s(first_m + l as f64 * thickness_m)).collect(),
        weight_per_m: vec![weight_per_m; layers],
    }
}

fn record(simulator: &Simulator, line: &LineOfSight, pulse: usize) -> Result<Vec<f64>, Failure> {
    let mut out = vec![0.0; simulator.record().samples];
    simulator.record_into(
        line,
        &mut pulse_generator(1, PulseKey { line: 0, pulse }),
        &mut Scratch::default(),
        &mut out,
    )?;
    Ok(out)
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most, x| if x.is_nan() { *x } else { most.max(x.abs()) })
}

/// In a uniform wind the covariance is that of the pulse with the Doppler phase.
fn covariance(duration_s: f64) -> Number {
    const WIND_M_S: f64 = 4.0;
    let (pulse, far_m) = (pulse(duration_s)?, 8000.0);
    let receiver = receiver(NoiseModel::None);
    let limits = LayerLimits {
        sample_rate_hz: receiver.sample_rate_hz,
        wavelength_m: receiver.wavelength_m,
        max_gradient_per_s: 0.0,
    };
    let thickness_m = Pulse::from(pulse).layer_thickness_m(limits)?.max(0.02);
    let reach_m = 4.0 * pulse.sigma_m();
    let air = line_between(far_m - reach_m, far_m + reach_m + 40.0, thickness_m, |_| WIND_M_S, 5e-17);
    let found = simulator_at(far_m, duration_s, NoiseModel::None, 16)?.covariance_a2(&air)?;
    let power_a2 = receiver.heterodyne_gain_a2_w() * ENERGY_J * 5e-17 * 0.5 * SPEED_OF_LIGHT_M_S;
    let of = |lag: usize| {
        let tau_s = lag as f64 / receiver.sample_rate_hz;
        let modulus = (-(tau_s / pulse.sigma_s()).powi(2) / 4.0).exp();
        let expected = Complex::from_polar(modulus, -4.0 * PI * WIND_M_S * tau_s / receiver.wavelength_m);
        (found[(lag, 0)] / power_a2 - expected).norm()
    };
    Ok(largest(&[0, 1, 5, 15].map(of)))
}

/// A Gaussian pulse sees waves of the wind weakened by its transform.
fn pulse_average(duration_s: f64) -> Number {
    let pulse = pulse(duration_s)?;
    let seen = RangeFilter::pulse(pulse, 0.02)?.at_range(8000.0, |r| 5.0 * ((r - 8000.0) / 30.0).cos());
    Ok((seen - 5.0 * (-(pulse.sigma_m() / 60.0).powi(2)).exp()).abs())
}

/// Velocity at which a point target of that speed shows its tone.
fn folded(velocity_m_s: f64) -> Number {
    let target = line_between(404.0, 404.7, STEP_M, |_| velocity_m_s, 5e-17);
    let current = record(&simulator_at(404.0 - 128.0 * STEP_M, 1e-6, NoiseModel::None, 256)?, &target, 3)?;
    let wavelength_m = receiver(NoiseModel::None).wavelength_m;
    let power = |velocity_m_s: f64| {
        let frequency = (80e6 - 2.0 * velocity_m_s / wavelength_m) / 250e6;
        let term = |(k, i): (usize, &f64)| i * Complex::cis(-2.0 * PI * frequency * k as f64);
        current.iter().enumerate().map(term).sum::<Complex<f64>>().norm_sqr()
    };
    let grid = (-348..=620).map(|i| 0.1 * f64::from(i));
    Ok(grid.max_by(|a, b| power(*a).total_cmp(&power(*b))).unwrap_or(f64::NAN))
}

fn additive(snr_db: f64) -> Number {
    let (noisy, bare) = (simulator(2e-7, NoiseModel::BandLimited, 64)?, simulator(2e-7, NoiseModel::None, 64)?);
    let unit = noisy.receiver().slowly_varying_snr(ENERGY_J, 1.0);
    let air = line(|_| 5.0, 10f64.powf(0.1 * snr_db) / unit);
    let (sum, signal) = (record(&noisy, &air, 5)?, record(&bare, &air, 5)?);
    let noise = record(&noisy, &line(|_| 5.0, 0.0), 5)?;
    let rest: Vec<f64> = (0..64).map(|k| sum[k] - noise[k] - signal[k]).collect();
    Ok(largest(&rest) / largest(&sum))
}

fn scaled(weight_per_m: f64) -> Number {
    let simulator = simulator(2e-7, NoiseModel::None, 32)?;
    let (unit, found) =
        (record(&simulator, &line(|_| 5.0, 1.0), 7)?, record(&simulator, &line(|_| 5.0, weight_per_m), 7)?);
    let of = |(found, unit): (&f64, &f64)| found / (unit * weight_per_m.sqrt()) - 1.0;
    Ok(largest(&found.iter().zip(&unit).map(of).collect::<Vec<_>>()))
}

fn overflow() -> Number {
    let strong = Receiver { local_oscillator_w: 1e200, ..receiver(NoiseModel::None) };
    let simulator = Simulator::new(pulse(2e-7)?, strong, *simulator(2e-7, NoiseModel::None, 32)?.record())?;
    let mut power_a2 = [0.0; 32];
    simulator.mean_power_into(&line(|_| 5.0, 1e200), &mut Scratch::default(), &mut power_a2)?;
    Ok(power_a2[0])
}

/// 3.72 sigma, 67 m, beyond the end of the flow nothing returns.
fn leaves() -> Number {
    let air = line(|r| if r > 420.0 { f64::NAN } else { 5.0 }, 5e-17);
    let current = record(&simulator(2e-7, NoiseModel::None, 250)?, &air, 2)?;
    let silent = ((495.0 - 400.0) / STEP_M).ceil() as usize;
    if largest(&current[..30]) == 0.0 {
        return Err(Failure::new("nothing returns from the flow itself".into()));
    }
    Ok(largest(&current[silent..]))
}

fn with_efficiency(value: f64) -> Number {
    let (simulator, air) = (simulator(2e-7, NoiseModel::None, 8)?, line(|_| 5.0, 5e-17));
    let mut efficiency = vec![1.0; air.layers()];
    efficiency[4] = value;
    let shot = Shot { efficiency: Some(&efficiency), ..Shot::from(&air) };
    let mut out = [0.0; 8];
    let mut rng = pulse_generator(1, PulseKey { line: 0, pulse: 0 });
    simulator.record_into(shot, &mut rng, &mut Scratch::default(), &mut out)?;
    Ok(out[0])
}

fn wide_band() -> Number {
    let wide = Receiver { bandwidth_hz: 400e6, ..receiver(NoiseModel::BandLimited) };
    Ok(Simulator::new(pulse(2e-7)?, wide, *simulator(2e-7, NoiseModel::None, 8)?.record())?.time_s(0))
}
