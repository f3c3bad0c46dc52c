//! Fits a vortex pair to a map of radial velocities of one's own: no other crate of wakescope is needed.
//!
//! `cargo run --release --example vortex_map -p wakescope-estimate [FILE]` reads `elevation_rad,range_m,velocity_m_s`
//! per line (a full grid, lines by increasing elevation, ranges running fastest; NaN where there is none) and prints
//! both vortices with their standard deviations, and what they would do to an aircraft that follows. Without a file it makes a noisy map itself.

#![allow(clippy::print_stdout)]

use std::error::Error;

use ndarray::Array2;
use wakescope_estimate::vortex_fit::{
    Follower, LiftSlope, MapFitOptions, Parameter, RangeKernel, VelocityMap, Wake, WakeModel, fit_map,
};

/// Axes and velocities of a map.
struct Map {
    elevation_rad: Vec<f64>,
    range_m: Vec<f64>,
    velocity_m_s: Array2<f64>,
}

fn main() -> Result<(), Box<dyn Error>> {
    // What an instrument's data sheet says: a 200 ns pulse, windows of 64 samples at 250 MHz.
    let (pulse_sigma_s, window, period_s) = (120.1e-9, [1.0; 64], 4e-9);
    let model = WakeModel::default();
    let kernel = RangeKernel::gaussian_gate(pulse_sigma_s, &window, period_s, 1.2)?;
    let map = match std::env::args().nth(1) {
        Some(path) => read(&path)?,
        None => made_up(&model)?,
    };
    let view = VelocityMap {
        elevation_rad: &map.elevation_rad,
        range_m: &map.range_m,
        velocity_m_s: map.velocity_m_s.view(),
        standard_deviation_m_s: None,
    };
    let fit = fit_map(&view, &model, &kernel, &MapFitOptions::default())?;
    println!("vortex,circulation_m2_s,std,gamma_5_15_m2_s,std,lateral_position_m,std,height_m,std,core_radius_m,std");
    let means = fit.wake.mean_circulations_5_15_m2_s(model.profile, fit.covariance.view());
    for ((name, vortex, [circulation, lateral, height, core]), mean) in [
        (
            "left",
            fit.wake.left,
            [Parameter::LeftCirculation, Parameter::LeftLateral, Parameter::LeftHeight, Parameter::LeftCore],
        ),
        (
            "right",
            fit.wake.right,
            [Parameter::RightCirculation, Parameter::RightLateral, Parameter::RightHeight, Parameter::RightCore],
        ),
    ]
    .into_iter()
    .zip(means)
    {
        println!(
            "{name},{:.1},{:.1},{:.1},{:.1},{:.2},{:.2},{:.2},{:.2},{:.2},{:.2}",
            vortex.circulation_m2_s,
            fit.standard_deviation(circulation),
            mean.0,
            mean.1,
            vortex.lateral_position_m,
            fit.standard_deviation(lateral),
            vortex.height_m,
            fit.standard_deviation(height),
            vortex.core_radius_m,
            fit.standard_deviation(core),
        );
    }
    println!(
        "# wind {:.2} m/s; residual {:.2} m/s; {} of {} velocities are outliers; {:.0} % explained",
        fit.wake.lateral_wind_m_s,
        fit.residual_scale,
        fit.outliers,
        fit.used,
        100.0 * fit.explained_fraction
    );
    let follower = Follower { span_m: 34.0, aspect_ratio: 9.4, speed_m_s: 70.0, slope: LiftSlope::Span };
    let at_m = (fit.wake.right.lateral_position_m, fit.wake.right.height_m);
    println!(
        "# rolling-moment coefficient of a wing of 34 m in the right vortex: {:.3} (slope of the lift 2 pi A/(A + 2))",
        follower.rolling_moment(&model, &fit.wake, at_m)?
    );
    Ok(())
}

fn read(path: &str) -> Result<Map, Box<dyn Error>> {
    let mut map = Map { elevation_rad: vec![], range_m: vec![], velocity_m_s: Array2::zeros((0, 0)) };
    let mut velocities = vec![];
    for line in
        std::fs::read_to_string(path)?.lines().filter(|l| l.starts_with(|c: char| c.is_ascii_digit() || c == '-'))
    {
        let numbers: Vec<f64> = line.split(',').map(|field| field.trim().parse()).collect::<Result<_, _>>()?;
        let [elevation_rad, range_m, velocity_m_s] = numbers[..] else {
            return Err(format!("\"{line}\": three numbers are needed").into());
        };
        if map.elevation_rad.last() != Some(&elevation_rad) {
            map.elevation_rad.push(elevation_rad);
        }
        if map.elevation_rad.len() == 1 {
            map.range_m.push(range_m);
        }
        velocities.push(velocity_m_s);
    }
    map.velocity_m_s = Array2::from_shape_vec((map.elevation_rad.len(), map.range_m.len()), velocities)?;
    Ok(map)
}

/// A wake of 500 m^2/s in a cross wind, with errors of about 1 m/s.
fn made_up(model: &WakeModel) -> Result<Map, Box<dyn Error>> {
    let wake = Wake::from_array(&[500.0, 500.0, 376.5, 47.0, 423.5, 47.0, 2.35, 2.35, 2.0, 0.0]);
    let elevation_rad: Vec<f64> = (0..93).map(|i| 2.5e-3 * f64::from(i)).collect();
    let range_m: Vec<f64> = (0..40).map(|i| 296.0 + 6.0 * f64::from(i)).collect();
    let mut place = 0.0_f64;
    let velocity_m_s = Array2::from_shape_fn((93, 40), |(line, gate)| {
        // the mean over the gate, roughly, and a number between -1.5 and 1.5
        let seen = (-60..=60).map(|i| {
            let weight = (-(f64::from(i) / 24.0).powi(2)).exp() / (24.0 * std::f64::consts::PI.sqrt());
            weight * model.radial_velocity_m_s(&wake, range_m[gate] + f64::from(i), elevation_rad[line])
        });
        place += 1.0;
        let disturbance = (place * 12.9898).sin() * 43_758.545;
        seen.sum::<f64>() + 3.0 * (disturbance - disturbance.floor() - 0.5)
    });
    Ok(Map { elevation_rad, range_m, velocity_m_s })
}
