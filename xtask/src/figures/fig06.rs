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
    out.values = vec![
        format!("{:?}", wake.fields_tau),
        wake.words(),
        REPEATS.to_string(),
    ];
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

/// Energies of waves along the flight.
struct Waves {
    /// Against tau, by wave.
    energies: Vec<Vec<(f64, f64)>>,
}

impl Waves {
    /// The energy of all of them at an age.
    fn energy(&self, tau: f64) -> f64 {
        self.energies.iter().map(|curve| value_at(curve, tau)).sum()
    }
}

/// Waves of 0.2 to 0.6 spacings together: their growth, half the slope of the logarithm of their energy, and their share of all waves.
fn short_waves(wake: &FinishedWake) -> Result<Claim, Failure> {
    let shortest = wake.flow.size[0] / 0.2;
    let longest = wake.flow.size[0] / 0.6;
    let mut modes = Vec::new();
    let mut short = Waves {
        energies: Vec::new(),
    };
    let mut others = Waves {
        energies: Vec::new(),
    };
    for mode in 1..=8 {
        let energy = wake.curve(&format!("energy_mode_{mode}"))?;
        if (longest..=shortest).contains(&f64::from(mode)) {
            modes.push(mode);
            short.energies.push(energy);
        } else {
            others.energies.push(energy);
        }
    }
    let share = |tau: f64| short.energy(tau) / (short.energy(tau) + others.energy(tau));
    let rate = 0.5 * (short.energy(2.0) / short.energy(1.0)).ln();
    let first = modes.first().copied().unwrap_or(0);
    let last = modes.last().copied().unwrap_or(0);
    let measured = format!(
        "modes {first} to {last} of the box, all together, grow at {rate:.2} per tau from 1 to 2; of the energy of modes 1 to 8 they hold \
         {:.2} at tau = 0, {:.2} at 1 and {:.2} at 2",
        share(0.0),
        share(1.0),
        share(2.0)
    );
    let claim = Claim::exact("F6b", measured, rate > 1.0 && share(2.0) > 0.75);
    let is_resolved = wake.flow.cells[0] as f64 / f64::from(last.max(1)) >= 4.0;
    Ok(if is_resolved {
        claim
    } else {
        claim.open("a mesh of four cells a wave along the flight")
    })
}
