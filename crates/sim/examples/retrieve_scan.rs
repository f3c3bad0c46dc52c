//! Finds the vortices in the scans of a file.
//!
//! `cargo run --release -p wakescope-sim --example retrieve_scan [FILE]`: CfRadial, HALO `.hpl` or CSV, gates of 14.4 m. Without a file
//! it makes a table of a pair itself.

#![allow(clippy::print_stdout)]

use std::error::Error;
use std::path::PathBuf;
use wakescope_estimate::retrieval::{Gate, RetrievalOptions, Velocities, fit_scan};
use wakescope_estimate::vortex_fit::{Wake, WakeModel};
use wakescope_sim::io::scans::{ScanFormat, read};

fn main() -> Result<(), Box<dyn Error>> {
    let stated = std::env::args().nth(1).map(PathBuf::from);
    let std_m = if stated.is_some() { 14.4 } else { 0.0 };
    let path = stated.map_or_else(made_up, Ok)?;
    let (scans, left_out) = read(&path, &ScanFormat::default())?;
    left_out
        .iter()
        .for_each(|text| println!("left out: {text}"));
    let options = RetrievalOptions {
        gate: Gate::Gaussian { std_m },
        ..RetrievalOptions::default()
    };
    for scan in scans {
        let found = fit_scan(&scan.map, Velocities::Means, &options)?;
        println!(
            "sweep {}: statistic {:.1}, {:?}",
            scan.sweep, found.statistic, found.flags
        );
        for vortex in &found.vortices {
            let (mean, y_m, z_m) = (
                vortex.circulation_5_15_m2_s,
                vortex.lateral_position_m,
                vortex.height_m,
            );
            println!(
                "  {:?}: {:.0} +- {:.0} m^2/s at {:.1} m, {:.1} m high",
                vortex.side, mean.value, mean.std, y_m.value, z_m.value
            );
        }
    }
    Ok(())
}

/// A table of point velocities of 400 m^2/s with errors of some 0.3 m/s.
fn made_up() -> Result<PathBuf, Box<dyn Error>> {
    let wake = Wake::from_array(&[
        400.0, 400.0, 376.0, 60.0, 424.0, 60.0, 2.5, 2.5, 1.0, 0.0, 0.0,
    ]);
    let mut text = String::from("range_m,elevation_rad,velocity_m_s,sigma_m_s\n");
    let mut place = 0.5_f64;
    for (line, gate) in (0..60).flat_map(|line| (0..30).map(move |gate| (line, gate))) {
        let (range_m, elevation_rad) =
            (330.0 + 5.0 * f64::from(gate), 0.06 + 3e-3 * f64::from(line));
        place = (place * 997.13 + 0.123).fract();
        let velocity =
            WakeModel::default().radial_velocity_m_s(&wake, range_m, elevation_rad) + place - 0.5;
        text += &format!("{range_m},{elevation_rad},{velocity},0.29\n");
    }
    let path = std::env::temp_dir().join("wakescope-example-scan.csv");
    std::fs::write(&path, text)?;
    Ok(path)
}
