//! Figure 6: surfaces of equal vorticity of the wake, and an animation of a cross-plane.

use super::context::*;
use crate::wakes;
use wakescope_sim::flow::REPEATS;
use wakescope_sim::plot::apng;

const FRAME_S: f64 = 0.15;

/// Columns of the table besides the energies of the waves along the flight.
const COLUMNS: [&str; 5] = [
    "tau",
    "energy",
    "energy_3d",
    "secondary_gamma_left",
    "secondary_gamma_right",
];

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let wake = wakes::whole(context)?;
    let origin = context.provenance_of_formula(&wake.file.toml);
    let mut names: Vec<String> = COLUMNS.map(String::from).to_vec();
    for mode in 0..=8 {
        names.push(format!("energy_mode_{mode}"));
    }
    let mut table = Table::new();
    for name in &names {
        table = table.float(name, wake.column(name)?.iter().copied());
    }
    let figure = wake.surfaces_figure()?.ok_or_else(|| Failure::new(
            "the wake has no fields as NetCDF: put `fields = [\"netcdf\"]` below `[output]` of its case and run it again".into(),
        ))?;
    let mut out = Rendered::new(&table, &figure, &origin)?;
    let animation = apng(&wake.frames()?, FRAME_S, &origin)?;
    out.files.push(("apng".into(), animation));
    let ages: Vec<String> = wake.fields_tau.iter().map(f64::to_string).collect();
    out.values = vec![ages.join(", "), wake.words(), REPEATS.to_string()];
    out.claims = vec![secondary(&wake)?, short_waves(&wake)?];
    Ok(out)
}

fn secondary(wake: &FinishedWake) -> Result<Claim, Failure> {
    let left = strongest_secondary(wake, "left")?;
    let right = strongest_secondary(wake, "right")?;
    let measured = format!(
        "until tau = 2: {:.2} Γ₀ at tau = {:.2} (left), {:.2} Γ₀ at {:.2} (right)",
        left.1, left.0, right.1, right.0
    );
    let pass = left.1 > 0.05 && right.1 > 0.05;
    Ok(Claim::exact("F6a", measured, pass))
}

/// Age and circulation of the strongest secondary vortex of a side until tau = 2.
fn strongest_secondary(wake: &FinishedWake, side: &str) -> Result<(f64, f64), Failure> {
    let tau = wake.column("tau")?;
    let gamma = wake.column(&format!("secondary_gamma_{side}"))?;
    let mut strongest = (f64::NAN, 0.0);
    for (&tau, gamma) in tau.iter().zip(gamma) {
        if tau <= 2.0 && gamma.abs() > strongest.1 && gamma.is_finite() {
            strongest = (tau, gamma.abs());
        }
    }
    Ok(strongest)
}

/// The energy of several waves together at an age, from that of each against tau.
fn energy_at(waves: &[Vec<(f64, f64)>], tau: f64) -> f64 {
    waves.iter().map(|curve| value_at(curve, tau)).sum()
}

/// Fraction of the energy of short waves in that of all waves at an age.
fn short_fraction(short: &[Vec<(f64, f64)>], others: &[Vec<(f64, f64)>], tau: f64) -> f64 {
    let short = energy_at(short, tau);
    short / (short + energy_at(others, tau))
}

/// Waves of 0.2 to 0.6 spacings together: their growth, half the slope of the logarithm of their energy, and their share of all waves.
fn short_waves(wake: &FinishedWake) -> Result<Claim, Failure> {
    let shortest = wake.flow.size[0] / 0.2;
    let longest = wake.flow.size[0] / 0.6;
    let mut modes = Vec::new();
    let mut short = Vec::new();
    let mut others = Vec::new();
    for mode in 1..=8 {
        let energy = wake.curve(&format!("energy_mode_{mode}"))?;
        if (longest..=shortest).contains(&f64::from(mode)) {
            modes.push(mode);
            short.push(energy);
        } else {
            others.push(energy);
        }
    }
    let [at_start, at_1, at_2] = [0.0, 1.0, 2.0].map(|tau| short_fraction(&short, &others, tau));
    let rate = 0.5 * (energy_at(&short, 2.0) / energy_at(&short, 1.0)).ln();
    let first = modes.first().copied().unwrap_or(0);
    let last = modes.last().copied().unwrap_or(0);
    let measured = format!(
        "waves of 0.2 to 0.6 b₀ (modes {first} to {last} of the box) grow at {rate:.2} per tau from 1 to 2; their fraction of the energy of \
         all waves is {at_start:.2} at tau = 0, {at_1:.2} at 1 and {at_2:.2} at 2"
    );
    let claim = Claim::exact("F6b", measured, rate > 1.0 && at_2 > 0.75);
    let is_resolved = wake.flow.cells[0] as f64 / f64::from(last.max(1)) >= 4.0;
    Ok(if is_resolved {
        claim
    } else {
        claim.open("a mesh of four cells a wave along the flight")
    })
}
