//! A point target: one thin layer that returns the pulse, at a known speed.

use fixtures::{ENERGY_J, WINDOW, receiver, sampling};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;
use wakescope_estimate::{
    Correlogram, Estimator, Sampling, Scratch, SignalKind, SpectralPeak, Statistic, Weighting,
    bound::{Noise, WindowModel},
    spectrum::unweighted_lags,
    window::SPEED_OF_LIGHT_M_S,
};
use wakescope_signal::{GaussianPulse, LineOfSight, NoiseModel, Record, Simulator};

const SPEED_M_S: f64 = 3.0;
const SNR_DB: f64 = 20.0;
/// Pulses averaged for one estimate.
const PULSES: usize = 20;
/// Estimates.
const TRIALS: usize = 400;

struct Target {
    simulator: Simulator,
    line: LineOfSight,
    snr: f64,
}

/// A layer in the middle of the window whose return, averaged over the window, is [`SNR_DB`] above the noise.
fn target() -> Target {
    let receiver = receiver(NoiseModel::White);
    let pulse = GaussianPulse::of_full_width(200e-9, ENERGY_J).unwrap();
    let first_s = 2.0 * 400.0 / SPEED_OF_LIGHT_M_S;
    let record = Record {
        time_of_first_sample_s: first_s,
        samples: WINDOW,
    };
    let simulator = Simulator::new(pulse, receiver, record).unwrap();
    let middle_m = 400.0 + 0.5 * SPEED_OF_LIGHT_M_S * (WINDOW - 1) as f64 / 2.0 / 250e6;
    let mut line = LineOfSight {
        first_range_m: middle_m,
        layer_thickness_m: 0.3,
        radial_velocity_m_s: vec![SPEED_M_S],
        weight_per_m: vec![1.0],
    };
    let mut snr = vec![0.0; WINDOW];
    simulator
        .snr_into(&line, &mut Default::default(), &mut snr)
        .unwrap();
    let mean = snr.iter().sum::<f64>() / WINDOW as f64;
    let wanted = 10f64.powf(0.1 * SNR_DB);
    line.weight_per_m[0] = wanted / mean;
    Target {
        simulator,
        line,
        snr: wanted,
    }
}

/// Estimates from [`PULSES`] pulses each.
fn estimates_m_s(target: &Target, sampling: &Sampling) -> Vec<f64> {
    let statistic = Correlogram::<f64>::new(Weighting::default(), WINDOW).unwrap();
    let peak = SpectralPeak::new(
        sampling,
        SignalKind::Real,
        &unweighted_lags(statistic.lags()),
        1024,
        Default::default(),
    )
    .unwrap();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
    let (mut scratch, mut records) = (Scratch::new(), Default::default());
    let mut out = vec![0.0; statistic.statistic_len()];
    (0..TRIALS)
        .map(|_| {
            let mut mean = vec![0.0; statistic.statistic_len()];
            for _ in 0..PULSES {
                let mut current_a = vec![0.0; WINDOW];
                target
                    .simulator
                    .record_into(&target.line, &mut rng, &mut records, &mut current_a)
                    .unwrap();
                // To order one: the statistic is quadratic in currents of microamperes.
                current_a.iter_mut().for_each(|a| *a *= 1e6);
                statistic.evaluate(&current_a, &mut scratch, &mut out);
                mean.iter_mut()
                    .zip(&out)
                    .for_each(|(m, o)| *m += o / PULSES as f64);
            }
            peak.estimate(&mean, &mut scratch).velocity_m_s
        })
        .collect()
}

#[test]
fn point_target_at_3_m_s_comes_out_within_twice_the_cramer_rao_bound() {
    let target = target();
    let sampling = sampling().unwrap();
    let amplitude: Vec<f64> = (0..WINDOW)
        .map(|k| {
            let t_s =
                target.simulator.time_s(k) - 2.0 * target.line.first_range_m / SPEED_OF_LIGHT_M_S;
            target.simulator.pulse().envelope_per_sqrt_s(t_s).re
        })
        .collect();
    let bound_m_s = WindowModel::point_target(&sampling, &amplitude, Noise::White)
        .unwrap()
        .bound_m_s(SPEED_M_S, target.snr, SignalKind::Real, PULSES as f64)
        .unwrap();

    let estimates = estimates_m_s(&target, &sampling);
    let n = estimates.len() as f64;
    let mean = estimates.iter().sum::<f64>() / n;
    let std = (estimates.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
    assert!(
        (mean - SPEED_M_S).abs() < 2.0 * bound_m_s,
        "mean {mean} m/s, bound {bound_m_s} m/s"
    );
    assert!(
        std < 2.0 * bound_m_s,
        "standard deviation {std} m/s, bound {bound_m_s} m/s"
    );
    // No estimator without bias is better than the bound; the margin is three standard errors of std.
    assert!(
        std * (1.0 + 3.0 / (2.0 * n).sqrt()) > bound_m_s,
        "standard deviation {std} m/s below the bound {bound_m_s} m/s"
    );
}
