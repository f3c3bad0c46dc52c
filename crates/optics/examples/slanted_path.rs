//! A slanted path through turbulence that weakens with height, beams that miss each other by 20 microradians, ended at an error
//! of 2 %.
//!
//! `cargo run --release -p wakescope-optics --example slanted_path`

#![allow(clippy::print_stdout)]

use std::ops::ControlFlow;
use wakescope_optics::{Cn2Path, Misalignment, MonteCarlo, Stop, Turbulence};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let cn2 = Cn2Path::Heights {
        height_m: vec![0.0, 50.0, 500.0],
        cn2_m_m23: vec![1e-13, 1e-14, 1e-15],
        telescope_height_m: 2.0,
        elevation_rad: 0.1,
    };
    let chapter = MonteCarlo::chapter(1e-13, 1)?;
    let run = MonteCarlo {
        turbulence: Turbulence { cn2: cn2.validated()?, ..chapter.turbulence.clone() },
        misalignment: Misalignment { tilt_rad: [2e-5, 0.0], ..Misalignment::NONE },
        ..chapter
    };
    let stop = Stop { realisations: 1000, relative_standard_error: Some(0.02) };
    let found = run.run::<f32>(stop, |_| ControlFlow::Continue(()))?;
    println!("{} realisations", found.realisations);
    for (range_m, mean) in found.monostatic.range_m.iter().zip(&found.monostatic.mean) {
        println!("{range_m:5.0} m: {mean:.4}");
    }
    Ok(())
}
