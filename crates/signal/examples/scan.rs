//! A scan past a vortex with a measured pulse through hazy turbulent air into a converter of 8
//! bits; streamed.
//!
//! The pulse is a table of power and phase against time, as an oscilloscope writes it; each pulse
//! meets a turbulence of its own; the phase of the complex baseband after 20 ns, averaged over the
//! pulses of a line, shows the wind.
//!
//! `cargo run --release -p wakescope-signal --example scan`

#![allow(clippy::print_stdout)] // the table is what the example is for

use std::f64::consts::PI;

use num_complex::Complex;
use wakescope_signal::digitise::Digitiser;
use wakescope_signal::efficiency::LayerEfficiency;
use wakescope_signal::sampled::SampledPulse;
use wakescope_signal::scan::{PulseKey, pulse_generator};
use wakescope_signal::{
    Error, LayerLimits, LineOfSight, Medium, Pulse, RangeFilter, Receiver, Record,
    SPEED_OF_LIGHT_M_S, Scan, Shot, Simulator,
};

const LINES: usize = 9;
const PULSES: usize = 1600;
const SAMPLES: usize = 200;
const FIRST_M: f64 = 360.0;
/// Samples averaged for one velocity.
const GATE: std::ops::Range<usize> = 60..76;

const RECEIVER: Receiver = Receiver {
    quantum_efficiency: 0.8,
    ..Receiver::table2()
};

/// A pulse with a fast rise and a slow fall, every 4 ns, in any unit; its frequency
/// rises by 20 kHz/ns.
fn measured_pulse() -> Result<Pulse, Error> {
    let time_s: Vec<f64> = (0..200).map(|i| f64::from(i) * 4e-9).collect();
    let centroid_s = 1.8e-7;
    let amplitude: Vec<Complex<f64>> = time_s
        .iter()
        .map(|t| {
            let modulus = t / 6e-8 * (-0.5 * t / 6e-8).exp();
            Complex::from_polar(modulus, PI * 2e13 * (t - centroid_s).powi(2))
        })
        .collect();
    Ok(SampledPulse::new(&time_s, &amplitude, 300e-6)?
        .centred()
        .into())
}

/// Radial velocity past a vortex of 450 m^2/s at 400 m, on a line that passes its axis
/// at `distance_m`.
fn wind_m_s(distance_m: f64, range_m: f64) -> f64 {
    let square = (range_m - 400.0).powi(2) + distance_m * distance_m + 2.35 * 2.35;
    450.0 * distance_m / (2.0 * PI * square)
}

fn main() -> Result<(), Error> {
    let pulse = measured_pulse()?;
    let record = Record {
        time_of_first_sample_s: 2.0 * FIRST_M / SPEED_OF_LIGHT_M_S,
        samples: SAMPLES,
    };
    let simulator = Simulator::new(&pulse, RECEIVER, record)?;

    let (sample_rate_hz, wavelength_m) = (RECEIVER.sample_rate_hz, RECEIVER.wavelength_m);
    let thickness_m = pulse.layer_thickness_m(LayerLimits {
        sample_rate_hz,
        wavelength_m,
        max_gradient_per_s: 3.0,
    })?;
    let haze = Medium::new(
        vec![0.0, 300.0, 700.0],
        vec![8e-7, 5e-7, 2e-7],
        vec![5e-4, 3e-4, 1e-4],
    )?;
    let distances_m: Vec<f64> = (0..LINES).map(|i| 5.0 * (i as f64 - 4.0)).collect();
    let mut lines = Vec::new();
    for distance_m in &distances_m {
        let first_range_m = 200.0;
        let layers = (400.0 / thickness_m) as usize;
        let ranges_m = (0..layers).map(|l| first_range_m + l as f64 * thickness_m);
        let mut line = LineOfSight {
            first_range_m,
            layer_thickness_m: thickness_m,
            radial_velocity_m_s: ranges_m.map(|r| wind_m_s(*distance_m, r)).collect(),
            weight_per_m: Vec::new(),
        };
        haze.weigh(&mut line, PI * 0.05 * 0.05)?;
        lines.push(line);
    }
    // Four realisations stand for the hundreds that optics would give.
    let realisations = [
        [0.012, 0.004],
        [0.008, 0.009],
        [0.015, 0.002],
        [0.006, 0.005],
    ];
    let efficiency = LayerEfficiency::new(&[100.0, 700.0], &realisations, &lines[0])?;

    let scan = Scan {
        simulator: &simulator,
        lines: LINES,
        pulses_per_line: PULSES,
        shot: |key: PulseKey| Shot {
            efficiency: Some(efficiency.of_pulse(key.line * PULSES + key.pulse)),
            ..Shot::from(&lines[key.line])
        },
        generator: |key| pulse_generator(2024, key),
        digitiser: Some(Digitiser::new(
            8,
            4.0 * RECEIVER.noise_variance_a2().sqrt(),
        )?),
    };
    // One complex number per line is all that is kept. Noise of 50 MHz is uncorrelated at a lag of
    // 5 samples, 20 ns.
    let mut lags = [Complex::<f64>::ZERO; LINES];
    let clipped = scan.for_each::<Complex<f64>, Error>(|key, baseband| {
        lags[key.line] += GATE
            .map(|k| baseband[k + 5] * baseband[k].conj())
            .sum::<Complex<f64>>();
        Ok(())
    })?;

    // What the gate sees: its samples, and those 5 later, weighted alike.
    let window = vec![1.0; GATE.len() + 5];
    let filter = RangeFilter::gate(&pulse, &window, RECEIVER.sample_rate_hz, thickness_m)?;
    let middle_s =
        simulator.time_s(GATE.start) + 0.5 * window.len() as f64 / RECEIVER.sample_rate_hz;
    let range_m = 0.5 * SPEED_OF_LIGHT_M_S * middle_s;
    let mut mean_efficiency = vec![0.0; lines[0].layers()];
    for pulse in 0..realisations.len() {
        let own = efficiency.of_pulse(pulse);
        mean_efficiency
            .iter_mut()
            .zip(own)
            .for_each(|(mean, e)| *mean += e / realisations.len() as f64);
    }
    let velocity_m_s = |lag: Complex<f64>| {
        -lag.arg() * RECEIVER.wavelength_m * RECEIVER.sample_rate_hz / (20.0 * PI)
    };
    println!(
        "Velocities at {range_m:.1} m [m/s], {PULSES} pulses per line. Near air returns more, and at any moment it returns"
    );
    println!(
        "light that was sent later: its rising frequency lowers what is measured below what the gate sees."
    );
    println!("distance [m]  v_gate  expected of pulse pair  pulse pair");
    for ((distance_m, lag), line) in distances_m.iter().zip(lags).zip(&lines) {
        let seen = filter.at_range(range_m, |r| wind_m_s(*distance_m, r));
        let covariance = simulator.covariance_a2(Shot {
            efficiency: Some(&mean_efficiency),
            ..Shot::from(line)
        })?;
        let expected = velocity_m_s(GATE.map(|k| covariance[(k + 5, k)]).sum());
        println!(
            "{distance_m:12.1}  {seen:6.2}  {expected:22.2}  {:10.2}",
            velocity_m_s(lag)
        );
    }
    println!(
        "{} of {} parts of samples clipped",
        clipped.total(),
        2 * scan.records() * SAMPLES
    );
    Ok(())
}
