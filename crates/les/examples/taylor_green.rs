//! The Taylor-Green vortex: energy and dissipation as it becomes turbulent, and the cost of a step.
//!
//! The flow starts as `u = sin x cos y cos z`, `v = -cos x sin y cos z`, `w = 0` in the periodic box `2 pi` wide. Comparisons
//! with other solvers start from it. After each step a row of a table goes to standard output: the time, the mean kinetic
//! energy per volume (1/8 at the start) and its mean dissipation at the start of the step, by viscosity and subgrid model
//! together. The number of steps and the seconds that a cell and a step need go to standard error.
//!
//! ```text
//! cargo run --release -p wakescope-les --example taylor_green -- --cells 64 --reynolds 1600 --subgrid multiscale_wale
//! ```
//!
//! `RAYON_NUM_THREADS=1` measures one thread.
#![allow(clippy::print_stdout, clippy::print_stderr)]

use std::error::Error;
use std::f64::consts::TAU;
use std::time::Instant;

use wakescope_les::cases::taylor_green_3d;
use wakescope_les::{SubgridModel, TimeScheme, TimeStep};

const USAGE: &str = "\
Options and their defaults:
  --cells 64             cells along each direction
  --reynolds 1600        Reynolds number of unit length and speed
  --scheme runge_kutta3  runge_kutta3 or adams_bashforth2
  --subgrid none         none, smagorinsky, wale or multiscale_wale
  --end 10               end time";

/// Longest step, where the Courant number would allow more.
const LONGEST_STEP_S: f64 = 0.1;

struct Arguments {
    cells: usize,
    reynolds: f64,
    scheme: TimeScheme,
    subgrid: SubgridModel,
    end_s: f64,
}

impl Arguments {
    fn parse(mut words: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut arguments = Self {
            cells: 64,
            reynolds: 1600.0,
            scheme: TimeScheme::RungeKutta3,
            subgrid: SubgridModel::None,
            end_s: 10.0,
        };
        while let Some(name) = words.next() {
            let value = words
                .next()
                .ok_or_else(|| format!("{name} has no value\n{USAGE}"))?;
            match name.as_str() {
                "--cells" => arguments.cells = cells(&name, &value)?,
                "--reynolds" => arguments.reynolds = positive(&name, &value)?,
                "--scheme" => arguments.scheme = scheme(&name, &value)?,
                "--subgrid" => arguments.subgrid = subgrid(&name, &value)?,
                "--end" => arguments.end_s = positive(&name, &value)?,
                _ => return Err(format!("{name} is no option\n{USAGE}")),
            }
        }
        Ok(arguments)
    }
}

fn refused(name: &str, value: &str, allowed: &str) -> String {
    format!("{name} {value} is not allowed: {allowed}")
}

fn cells(name: &str, value: &str) -> Result<usize, String> {
    match value.parse() {
        Ok(cells) if cells > 0 => Ok(cells),
        _ => Err(refused(name, value, "a whole number above 0, e.g. 64")),
    }
}

fn positive(name: &str, value: &str) -> Result<f64, String> {
    match value.parse::<f64>() {
        Ok(number) if number > 0.0 && number.is_finite() => Ok(number),
        _ => Err(refused(name, value, "a finite number above 0, e.g. 10.0")),
    }
}

fn scheme(name: &str, value: &str) -> Result<TimeScheme, String> {
    match value {
        "runge_kutta3" => Ok(TimeScheme::RungeKutta3),
        "adams_bashforth2" => Ok(TimeScheme::AdamsBashforth2),
        _ => Err(refused(name, value, "runge_kutta3 or adams_bashforth2")),
    }
}

fn subgrid(name: &str, value: &str) -> Result<SubgridModel, String> {
    match value {
        "none" => Ok(SubgridModel::None),
        "smagorinsky" => Ok(SubgridModel::SMAGORINSKY),
        "wale" => Ok(SubgridModel::WALE),
        "multiscale_wale" => Ok(SubgridModel::MULTISCALE_WALE),
        _ => {
            let allowed = "none, smagorinsky, wale or multiscale_wale";
            Err(refused(name, value, allowed))
        }
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    if words.iter().any(|word| word == "--help" || word == "-h") {
        println!("{USAGE}");
        return Ok(());
    }
    let arguments = Arguments::parse(words.into_iter())?;
    let mut case = taylor_green_3d(arguments.cells, arguments.reynolds)?;
    case.settings.scheme = arguments.scheme;
    case.settings.subgrid = arguments.subgrid;
    case.settings.time_step = TimeStep::Courant {
        courant: arguments.scheme.default_courant(),
        longest_s: LONGEST_STEP_S,
    };
    let (mut flow, _) = case.start()?;
    let volume_m3 = TAU.powi(3);
    println!("time_s,kinetic_energy_m2_s2,dissipation_m2_s3");
    let mut stepping_s = 0.0;
    while flow.time_s() < arguments.end_s {
        let begun = Instant::now();
        let report = flow.step_towards(arguments.end_s)?;
        stepping_s += begun.elapsed().as_secs_f64();
        let energy = report.kinetic_energy_m5_s2 / volume_m3;
        let power = report.viscous_power_m5_s3 + report.subgrid_power_m5_s3;
        println!("{},{energy},{}", report.time_s, -power / volume_m3);
    }
    let cells = flow.mesh().cells().iter().product::<usize>() as f64;
    let cost_s = stepping_s / (cells * flow.steps() as f64);
    eprintln!("{} steps, {cost_s:.3e} s a cell and step", flow.steps());
    Ok(())
}
