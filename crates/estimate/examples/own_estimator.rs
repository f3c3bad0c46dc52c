//! Plugs your own estimator into the accumulation: the noisy one that a textbook would try first.
//!
//! `cargo run --example own_estimator -p wakescope-estimate` maps a synthetic scan with it and with the periodogram, and prints both.
//! Two traits are all that is needed: a [`Statistic`] that turns a window into numbers whose mean makes sense, and an
//! [`Estimator`] that turns the mean into a velocity.

#![allow(clippy::print_stdout)]

use ndarray::Array2;
use num_complex::Complex;
use wakescope_estimate::{
    Error, Estimator, GateVelocity, Gates, PeriodogramPlan, Radius, Sampling, Scan, Scratch,
    Statistic, estimators::Quality, polar_points,
};

/// Lags 1 and 2 of complex windows: the phase of the second is finer, the first says in which turn it is.
struct TwoLags {
    sampling: Sampling,
    window_samples: usize,
}

impl Statistic<Complex<f64>> for TwoLags {
    fn window_samples(&self) -> usize {
        self.window_samples
    }
    fn statistic_len(&self) -> usize {
        4
    }
    fn evaluate(&self, window: &[Complex<f64>], _: &mut Scratch, out: &mut [f64]) {
        for (lag, place) in out.chunks_mut(2).enumerate() {
            let ahead = &window[lag + 1..];
            let sum: Complex<f64> = ahead
                .iter()
                .zip(window)
                .map(|(ahead, behind)| ahead * behind.conj())
                .sum();
            place.copy_from_slice(&[sum.re, sum.im]);
        }
    }
}

impl Estimator for TwoLags {
    fn statistic_len(&self) -> usize {
        4
    }
    fn estimate(&self, mean: &[f64], _: &mut Scratch) -> GateVelocity {
        let (first, second) = (
            Complex::new(mean[0], mean[1]),
            Complex::new(mean[2], mean[3]),
        );
        if first.norm() == 0.0 {
            return GateVelocity::none(Quality::NoSignal);
        }
        let coarse = first.arg();
        let angle = coarse + 0.5 * (second * Complex::from_polar(1.0, -2.0 * coarse)).arg();
        let frequency_hz = angle / std::f64::consts::TAU * self.sampling.sample_rate_hz;
        GateVelocity {
            velocity_m_s: self.sampling.velocity_m_s(frequency_hz),
            power: first.norm(),
            ..GateVelocity::none(Quality::Good)
        }
    }
}

/// Eight lines of sight through a wind that grows by 0.4 m/s from line to line, under a disturbance.
fn made_up(sampling: &Sampling) -> Array2<Complex<f64>> {
    Array2::from_shape_fn((8, 400), |(line, n)| {
        let frequency_hz = sampling.frequency_hz(-2.0 + 0.4 * line as f64);
        let phase_rad = std::f64::consts::TAU * frequency_hz * n as f64 * sampling.period_s();
        let rubbish = (n as f64 * 12.9898 + line as f64 * 78.233).sin() * 43_758.545;
        Complex::from_polar(1.0, phase_rad) + rubbish - rubbish.floor() - 0.5
    })
}

fn main() -> Result<(), Error> {
    // any rate and wavelength: 125 MHz complex samples of a 2 um lidar
    let sampling = Sampling::baseband(125e6, 2.022e-6, 40e6)?;
    let gates = Gates::new(48, 4, 3e-6)?;
    let elevation_rad: Vec<f64> = (0..8).map(|line| 2e-3 * f64::from(line)).collect();
    let records = made_up(&sampling);
    let own = TwoLags {
        sampling,
        window_samples: gates.window_samples,
    };
    let plan = PeriodogramPlan::<Complex<f64>>::new(&sampling, gates.window_samples)?;
    let scans = (
        Scan::new(&own, &sampling, &gates, &elevation_rad, records.view())?,
        Scan::new(
            &plan.statistic,
            &sampling,
            &gates,
            &elevation_rad,
            records.view(),
        )?,
    );
    let range_m = [550.0, 600.0];
    let points = polar_points(&elevation_rad, &range_m);
    let radius = Radius::Fixed { radius_m: 2.0 };
    let maps = (
        scans.0.map(&points, &radius, None, &own)?,
        scans.1.map(&points, &radius, None, &plan.estimator)?,
    );
    println!("elevation_rad,range_m,level,own_m_s,periodogram_m_s");
    for (index, (own, other)) in maps.0.iter().zip(&maps.1).enumerate() {
        println!(
            "{:.3},{:.0},{},{:.3},{:.3}",
            elevation_rad[index / range_m.len()],
            range_m[index % range_m.len()],
            own.level,
            own.estimate.velocity_m_s,
            other.estimate.velocity_m_s
        );
    }
    Ok(())
}
