//! Finds the vortices in your own map of radial velocities: no other crate of wakescope is needed.
//!
//! `cargo run --release --example vortex_map -p wakescope-estimate [FILE]` reads `elevation_rad,range_m,velocity_m_s`
//! per line (a full grid, lines by increasing elevation, ranges running fastest; NaN where there is none) and prints
//! both vortices with their standard deviations, or that there are none, and what they would do to an aircraft that follows. Without
//! a file it makes a noisy map itself.

#![allow(clippy::print_stdout)]

use std::error::Error;

use ndarray::Array2;
use wakescope_estimate::retrieval::{Gate, RetrievalOptions, ScanMap, Velocities, fit_scan};
use wakescope_estimate::vortex_fit::{Follower, LiftSlope, RangeKernel, Wake, WakeModel};

fn main() -> Result<(), Box<dyn Error>> {
    // What an instrument's data sheet says: a 200 ns pulse, windows of 64 samples at 250 MHz.
    let (pulse_sigma_s, window, period_s) = (120.1e-9, [1.0; 64], 4e-9);
    let gate = Gate::Kernel(RangeKernel::gaussian_gate(
        pulse_sigma_s,
        &window,
        period_s,
        1.2,
    )?);
    let options = RetrievalOptions {
        gate,
        ..Default::default()
    };
    let map = match std::env::args().nth(1) {
        Some(path) => read(&path)?,
        None => made_up(&options.model)?,
    };
    let begin = std::time::Instant::now();
    let found = fit_scan(&map, Velocities::Means, &options)?;
    println!(
        "vortex,circulation_m2_s,std,gamma_5_15_m2_s,std,lateral_position_m,std,height_m,std,core_radius_m,std"
    );
    for vortex in &found.vortices {
        print!("{:?}", vortex.side);
        let (circulation, mean) = (vortex.circulation_m2_s, vortex.circulation_5_15_m2_s);
        for number in [
            circulation,
            mean,
            vortex.lateral_position_m,
            vortex.height_m,
        ]
        .into_iter()
        .chain(vortex.core_radius_m)
        {
            print!(",{:.2},{:.2}", number.value, number.std);
        }
        println!();
    }
    println!(
        "# wind {:.2} +- {:.2} m/s; {} of {} velocities are outliers; statistic {:.0}; {:?}; {:.2} s",
        found.lateral_wind_m_s.value,
        found.lateral_wind_m_s.std,
        found.cells_rejected,
        found.cells_used + found.cells_rejected,
        found.statistic,
        found.flags,
        begin.elapsed().as_secs_f64()
    );
    if let Some(wake) = found.wake {
        let follower = Follower {
            span_m: 34.0,
            aspect_ratio: 9.4,
            speed_m_s: 70.0,
            slope: LiftSlope::Span,
        };
        let at_m = (wake.right.lateral_position_m, wake.right.height_m);
        println!(
            "# rolling-moment coefficient of a wing of 34 m in the right vortex: {:.3} (slope of the lift 2 pi A/(A + 2))",
            follower.rolling_moment(&options.model, &wake, at_m)?
        );
    }
    Ok(())
}

fn read(path: &str) -> Result<ScanMap, Box<dyn Error>> {
    let (mut elevations_rad, mut ranges_m, mut velocities) = (vec![], vec![], vec![]);
    for line in std::fs::read_to_string(path)?
        .lines()
        .filter(|l| l.starts_with(|c: char| c.is_ascii_digit() || c == '-'))
    {
        let numbers: Vec<f64> = line
            .split(',')
            .map(|field| field.trim().parse())
            .collect::<Result<_, _>>()?;
        let [elevation_rad, range_m, velocity_m_s] = numbers[..] else {
            return Err(format!("\"{line}\": three numbers are needed").into());
        };
        if elevations_rad.last() != Some(&elevation_rad) {
            elevations_rad.push(elevation_rad);
        }
        if elevations_rad.len() == 1 {
            ranges_m.push(range_m);
        }
        velocities.push(velocity_m_s);
    }
    let velocity_m_s = Array2::from_shape_vec((elevations_rad.len(), ranges_m.len()), velocities)?;
    Ok(scan(elevations_rad, ranges_m, velocity_m_s))
}

/// A map without times of its lines and without deviations, which are then those of the residuals.
fn scan(elevation_rad: Vec<f64>, range_m: Vec<f64>, velocity_m_s: Array2<f64>) -> ScanMap {
    let time_s = vec![f64::NAN; elevation_rad.len()];
    ScanMap {
        elevation_rad,
        time_s,
        range_m,
        velocity_m_s,
        sigma_m_s: None,
        fold_m_s: None,
    }
}

/// A wake of 500 m^2/s in a cross wind, with errors of about 1 m/s.
fn made_up(model: &WakeModel) -> Result<ScanMap, Box<dyn Error>> {
    let wake = Wake::from_array(&[
        500.0, 500.0, 376.5, 47.0, 423.5, 47.0, 2.35, 2.35, 2.0, 0.0, 0.0,
    ]);
    let elevation_rad: Vec<f64> = (0..93).map(|i| 2.5e-3 * f64::from(i)).collect();
    let range_m: Vec<f64> = (0..40).map(|i| 296.0 + 6.0 * f64::from(i)).collect();
    let mut place = 0.0_f64;
    let velocity_m_s = Array2::from_shape_fn((93, 40), |(line, gate)| {
        // the mean over the gate, roughly, and a number between -1.5 and 1.5
        let seen = (-60..=60).map(|i| {
            let weight =
                (-(f64::from(i) / 24.0).powi(2)).exp() / (24.0 * std::f64::consts::PI.sqrt());
            weight
                * model.radial_velocity_m_s(
                    &wake,
                    range_m[gate] + f64::from(i),
                    elevation_rad[line],
                )
        });
        place += 1.0;
        let disturbance = (place * 12.9898).sin() * 43_758.545;
        seen.sum::<f64>() + 3.0 * (disturbance - disturbance.floor() - 0.5)
    });
    Ok(scan(elevation_rad, range_m, velocity_m_s))
}
