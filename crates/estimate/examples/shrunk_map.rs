//! A noisy map drawn towards a guess: a right guess takes the noise away, a wrong one is corrected by the data.
//!
//! `cargo run -p wakescope-estimate --example shrunk_map`

#![allow(clippy::print_stdout)]

use ndarray::Array2;
use wakescope_estimate::Error;
use wakescope_estimate::map::{ShrinkageOptions, shrink_to_guess};

fn main() -> Result<(), Error> {
    // A vortex in 64 lines of 64 gates, 1 m apart, and noise of 1 m/s that differs from gate to gate.
    let vortex = |at: f64| {
        Array2::from_shape_fn((64, 64), |(i, _)| {
            40.0 * (i as f64 - at) / (9.0 + (i as f64 - at).powi(2))
        })
    };
    let hash = |i: usize, j: usize, of: f64| {
        ((12.9898 * i as f64 + 78.233 * j as f64 + of).sin() * 43_758.545).fract()
    };
    let noise = |of: f64| Array2::from_shape_fn((64, 64), |(i, j)| 1.73 * hash(i, j, of));
    let truth = vortex(32.0);
    let (measured, half_difference) = (&truth + &noise(0.0), noise(1.0));
    let options = ShrinkageOptions::for_map(1.0, 1.0, 2.0, 2.0)?;
    let rms = |map: &Array2<f64>| {
        (map - &truth)
            .mapv(|e| e * e)
            .mean()
            .unwrap_or(f64::NAN)
            .sqrt()
    };
    println!("measured: {:.2} m/s", rms(&measured));
    for (name, guess) in [
        ("at its place", truth.clone()),
        ("12 m beside it", vortex(44.0)),
        ("rest", 0.0 * &truth),
    ] {
        let shrunk = shrink_to_guess(
            measured.view(),
            half_difference.view(),
            guess.view(),
            guess.view(),
            &options,
        )?;
        println!(
            "drawn to a vortex {name}: {:.2} m/s",
            rms(&shrunk.velocity_m_s)
        );
    }
    Ok(())
}
