//! A slanted path through Cn2 over height (Hufnagel-Valley 5/7), beams out of line by 5 urad, until the error is 2 %.
//!
//! `cargo run --release -p wakescope-optics --example slanted_path -- [elevation_deg] [tilt_rad] [relative_error]`

#![allow(clippy::print_stdout)]

use std::ops::ControlFlow;
use wakescope_optics::air::hufnagel_valley_m_m23;
use wakescope_optics::monte_carlo::Sampling;
use wakescope_optics::plan::Case;
use wakescope_optics::theory::{bistatic_efficiency, free_space_efficiency_misaligned};
use wakescope_optics::{Cn2Path, Misalignment, MonteCarlo, Stop, Telescope, Turbulence};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let mut next = |default: f64| arguments.next().map_or(Ok(default), |a| a.parse::<f64>());
    let (elevation_deg, tilt_rad, relative_error) = (next(30.0)?, next(5e-6)?, next(0.02)?);

    let law = |height_m: f64| hufnagel_valley_m_m23(height_m, 21.0, 1.7e-14);
    let cn2 = Cn2Path::from_law(law, 2.0, elevation_deg.to_radians());
    let turbulence = Turbulence {
        cn2,
        ..Turbulence::none()
    };
    let (telescope, misalignment) = (
        Telescope::table2(),
        Misalignment {
            tilt_rad: [tilt_rad, 0.0],
            ..Misalignment::NONE
        },
    );

    let range_m = vec![500.0, 1000.0, 2000.0];
    let case = Case {
        telescope,
        misalignment,
        turbulence: turbulence.clone(),
        realisations: 400,
    };
    let plan = case.plan(&range_m)?;
    let run = MonteCarlo {
        misalignment,
        turbulence: turbulence.clone(),
        grid: plan.grid,
        layers: plan.layers,
        range_m: range_m.clone(),
        sampling: Sampling::Antithetic,
        ..MonteCarlo::table2(0.0, 1)?
    };
    let stop = Stop {
        realisations: 4000,
        relative_standard_error: Some(relative_error),
    };
    let found = run.run_in::<f32>(stop, |_| ControlFlow::Continue(()))?;
    println!(
        "{} realisations on {} x {} points",
        found.realisations, run.grid.nx, run.grid.ny
    );
    println!("  R/m  free space  independent paths  one path out and back");
    for (i, &range_m) in range_m.iter().enumerate() {
        let free = free_space_efficiency_misaligned(&telescope, &misalignment, range_m)?;
        let bistatic = bistatic_efficiency(&telescope, &misalignment, &turbulence, range_m)?;
        let (mean, error) = (found.monostatic.mean[i], found.monostatic.standard_error[i]);
        println!("{range_m:6.0} {free:10.6} {bistatic:18.6}  {mean:.6} +- {error:.6}");
    }
    Ok(())
}
