//! A scan past a vortex with a measured pulse through hazy turbulent air into a converter of 8
//! bits; streamed.
//!
//! The pulse is a table of power and phase against time, as an oscilloscope writes it; each pulse
//! has a realisation of the turbulence; the phase of the complex baseband after 20 ns, averaged over
//! the pulses of a line, gives the wind.
//!
//! `cargo run --release -p wakescope-signal --example scan`

#![allow(clippy::print_stdout)] // the table is what the example is for

use std::f64::consts::PI;

use num_complex::Complex;
use wakescope_signal::digitise::Digitiser;
use wakescope_signal::efficiency::LayerEfficiency;
use wakescope_signal::scan::{PulseKey, pulse_generator};
use wakescope_signal::{
    Error, LineOfSight, Medium, Pulse, RangeFilter, Receiver, Record, SPEED_OF_LIGHT_M_S, Scan,
    Shot, Simulator,
};

const LINES: usize = 9;
const PULSES: usize = 1600;
const SAMPLES: usize = 200;
const FIRST_M: f64 = 360.0;
/// Samples averaged for one velocity.
const GATE: std::ops::Range<usize> = 60..76;
/// Lag of the pulse pair in samples, 20 ns: noise of 50 MHz is uncorrelated there.
const LAG: usize = 5;

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
    Ok(Pulse::from_envelope(&time_s, &amplitude, 300e-6)?.centred())
}

/// Radial velocity past a vortex of 450 m^2/s at 400 m, on a line that passes its axis
/// at `distance_m`.
fn wind_m_s(distance_m: f64, range_m: f64) -> f64 {
    let square = (range_m - 400.0).powi(2) + distance_m * distance_m + 2.35 * 2.35;
    450.0 * distance_m / (2.0 * PI * square)
}

/// Lines of sight through haze, each past the vortex at one of the distances.
fn lines_of_sight(distances_m: &[f64], thickness_m: f64) -> Result<Vec<LineOfSight>, Error> {
    let haze = Medium::new(
        vec![0.0, 300.0, 700.0],
        vec![8e-7, 5e-7, 2e-7],
        vec![5e-4, 3e-4, 1e-4],
    )?;
    let first_range_m = 200.0;
    let layers = (400.0 / thickness_m) as usize;
    let mut lines = Vec::new();
    for distance_m in distances_m {
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
    Ok(lines)
}

/// Mean over the realisations of the efficiency of each layer.
fn mean_efficiency(efficiency: &LayerEfficiency) -> Vec<f64> {
    let realisations = efficiency.realisations();
    let mut mean = vec![0.0; efficiency.of_pulse(0).len()];
    for realisation in 0..realisations {
        for (mean, e) in mean.iter_mut().zip(efficiency.of_pulse(realisation)) {
            *mean += e / realisations as f64;
        }
    }
    mean
}

/// Velocity of a covariance at the lag of the pulse pair.
fn velocity_m_s(covariance: Complex<f64>) -> f64 {
    let lag_s = LAG as f64 / RECEIVER.sample_rate_hz;
    -covariance.arg() * RECEIVER.wavelength_m / (4.0 * PI * lag_s)
}

fn main() -> Result<(), Error> {
    let pulse = measured_pulse()?;
    let record = Record {
        time_of_first_sample_s: 2.0 * FIRST_M / SPEED_OF_LIGHT_M_S,
        samples: SAMPLES,
    };
    let simulator = Simulator::new(&pulse, RECEIVER, record)?;
    let thickness_m = pulse.layer_thickness_m(RECEIVER.layer_limits(3.0))?;
    let distances_m: Vec<f64> = (0..LINES).map(|i| 5.0 * (i as f64 - 4.0)).collect();
    let lines = lines_of_sight(&distances_m, thickness_m)?;
    // Four realisations; a Monte Carlo of the optics gives hundreds.
    let realisations = [
        [0.012, 0.004],
        [0.008, 0.009],
        [0.015, 0.002],
        [0.006, 0.005],
    ];
    let efficiency = LayerEfficiency::new(&[100.0, 700.0], &realisations, &lines[0])?;
    let full_scale_a = 4.0 * RECEIVER.noise_variance_a2().sqrt();
    let scan = Scan {
        simulator: &simulator,
        lines: LINES,
        pulses_per_line: PULSES,
        shot: |key: PulseKey| Shot {
            efficiency: Some(efficiency.of_pulse(key.line * PULSES + key.pulse)),
            ..Shot::from(&lines[key.line])
        },
        generator: |key| pulse_generator(2024, key),
        digitiser: Some(Digitiser::new(8, full_scale_a)?),
    };
    // Only one complex number per line is stored.
    let mut sums = [Complex::<f64>::ZERO; LINES];
    let clipped = scan.for_each::<Complex<f64>, Error>(|key, baseband| {
        sums[key.line] += GATE
            .map(|k| baseband[k + LAG] * baseband[k].conj())
            .sum::<Complex<f64>>();
        Ok(())
    })?;

    // The samples of the gate, and those one lag later, with equal weights.
    let window = vec![1.0; GATE.len() + LAG];
    let filter = RangeFilter::gate(&pulse, &window, RECEIVER.sample_rate_hz, thickness_m)?;
    let half_s = 0.5 * window.len() as f64 / RECEIVER.sample_rate_hz;
    let range_m = 0.5 * SPEED_OF_LIGHT_M_S * (simulator.time_s(GATE.start) + half_s);
    let mean_efficiency = mean_efficiency(&efficiency);
    println!(
        "Velocities at {range_m:.1} m [m/s], {PULSES} pulses per line. The echo of near air is"
    );
    println!(
        "stronger and, at any moment, of light that was sent later: the rising frequency lowers"
    );
    println!("the measured velocity below v_gate.");
    println!("distance [m]  v_gate  expected of pulse pair  pulse pair");
    for ((distance_m, sum), line) in distances_m.iter().zip(sums).zip(&lines) {
        let gate_m_s = filter.at_range(range_m, |r| wind_m_s(*distance_m, r));
        let covariance = simulator.covariance_a2(Shot {
            efficiency: Some(&mean_efficiency),
            ..Shot::from(line)
        })?;
        let expected_m_s = velocity_m_s(GATE.map(|k| covariance[(k + LAG, k)]).sum());
        let found_m_s = velocity_m_s(sum);
        println!("{distance_m:12.1}  {gate_m_s:6.2}  {expected_m_s:22.2}  {found_m_s:10.2}");
    }
    println!(
        "{clipped} of {} parts of samples clipped",
        2 * scan.records() * SAMPLES
    );
    Ok(())
}
