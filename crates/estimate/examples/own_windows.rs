//! Estimates velocities from your own windows: no other crate of wakescope is needed.
//!
//! `cargo run --example own_windows -p wakescope-estimate [FILE]` reads one record from a text file, one sample per line (real: one
//! number; complex: two), and prints range, velocity, power and flag per gate. Without a file it makes a record itself.

#![allow(clippy::print_stdout)]

use std::error::Error;

use ndarray::Array2;
use num_complex::Complex;
use wakescope_estimate::{
    Gates, PeriodogramPlan, Radius, Sampling, Scan, map::WindowCorrelation, polar_points,
    window::Sample,
};

/// What an instrument's data sheet says: adapt these lines to your own.
fn sampling(complex: bool) -> Result<Sampling, wakescope_estimate::Error> {
    if complex {
        Sampling::baseband(250e6, 1.55e-6, 50e6)
    } else {
        Sampling::new(250e6, 80e6, 1.55e-6, (55e6, 105e6))
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let rows = match std::env::args().nth(1) {
        Some(path) => read(&path)?,
        None => made_up()?,
    };
    if rows.iter().all(|row| row.len() == 1) {
        print(rows.iter().map(|row| row[0]).collect(), &sampling(false)?)
    } else {
        print(
            rows.iter()
                .map(|row| Complex::new(row[0], row[1]))
                .collect(),
            &sampling(true)?,
        )
    }
}

/// Numbers of each line that is not a comment: one or two.
fn read(path: &str) -> Result<Vec<Vec<f64>>, Box<dyn Error>> {
    let mut rows = Vec::new();
    for (index, line) in std::fs::read_to_string(path)?.lines().enumerate() {
        if line.trim().is_empty() || line.starts_with('#') {
            continue;
        }
        let fields = line
            .split(|c: char| c == ',' || c.is_whitespace())
            .filter(|field| !field.is_empty());
        let row: Vec<f64> = fields.map(str::parse).collect::<Result<_, _>>()?;
        if !(1..=2).contains(&row.len()) {
            return Err(format!(
                "line {}: {} numbers, 1 or 2 are needed",
                index + 1,
                row.len()
            )
            .into());
        }
        rows.push(row);
    }
    Ok(rows)
}

/// 1000 real samples: a wind that grows from -5 to 5 m/s along the record, under a disturbance.
fn made_up() -> Result<Vec<Vec<f64>>, wakescope_estimate::Error> {
    let sampling = sampling(false)?;
    let mut phase_rad = 0.0_f64;
    Ok((0..1000)
        .map(|n| {
            let frequency_hz = sampling.frequency_hz(-5.0 + 0.01 * f64::from(n));
            phase_rad += std::f64::consts::TAU * frequency_hz * sampling.period_s();
            let disturbance = (f64::from(n) * 12.9898).sin() * 43_758.545;
            vec![phase_rad.cos() + disturbance - disturbance.floor() - 0.5]
        })
        .collect())
}

/// Velocity in steps of a quarter of a gate, each averaged over 2 m along the line of sight.
fn print<S: Sample>(record: Vec<S>, sampling: &Sampling) -> Result<(), Box<dyn Error>> {
    let gates = Gates::new(64, 1, 0.0)?;
    let plan = PeriodogramPlan::<S>::new(sampling, gates.window_samples)?;
    let records = Array2::from_shape_vec((1, record.len()), record)?;
    let elevation_rad = [0.0];
    let scan = Scan::new(
        &plan.statistic,
        sampling,
        &gates,
        &elevation_rad,
        records.view(),
    )?;
    let range_m: Vec<f64> = scan
        .geometry()
        .gate_ranges_m()
        .into_iter()
        .step_by(16)
        .collect();
    let taper = &plan.statistic.tapers()[0].weights;
    let correlation =
        WindowCorrelation::gaussian_pulse(taper, &gates, 64, sampling.sample_rate_hz, 120e-9, 1.0)?;
    let points = polar_points(&elevation_rad, &range_m);
    let map = scan.map(
        &points,
        &Radius::Fixed { radius_m: 2.0 },
        Some(&correlation),
        &plan.estimator,
    )?;
    println!("range_m,velocity_m_s,power,quality,level,n_eff,flag");
    for (point, found) in points.iter().zip(map) {
        let estimate = found.estimate;
        println!(
            "{:.1},{:.3},{:.3e},{:.1},{},{:.2},{:?}",
            point.range_m,
            estimate.velocity_m_s,
            estimate.power,
            estimate.quality,
            found.level,
            found.n_eff,
            estimate.flag
        );
    }
    Ok(())
}
