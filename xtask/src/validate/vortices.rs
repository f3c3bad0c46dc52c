//! The vortices of Taylor and Green at Re 1600: direct simulation against a stored one, and the subgrid models.

use super::shown::Shown;
use crate::claim::Claim;
use crate::profile::Profile;
use crate::references::numbers;
use fixtures::failure::Failure;
use std::f64::consts::PI;
use wakescope_les::analysis::decay::value_at;
use wakescope_les::{SubgridModel, cases};
use wakescope_sim::io::Table;
use wakescope_sim::plot::{Axis, CurvePlot, Figure, Series, Style};

const REYNOLDS: f64 = 1600.0;
const END_S: f64 = 10.0;
const EVERY_S: f64 = 0.1;
/// One more than the times that are compared.
const OUTPUTS: usize = (END_S / EVERY_S) as usize + 1;

/// Run on the coarse mesh; the second constant of WALE is the one that many programs use where a flow turns turbulent.
const MODELS: [(&str, SubgridModel); 4] = [
    ("no model", SubgridModel::None),
    ("WALE 0.5", SubgridModel::WALE),
    ("WALE 0.325", SubgridModel::Wale { constant: 0.325 }),
    ("multiscale WALE", SubgridModel::MULTISCALE_WALE),
];

pub(super) fn show(profile: Profile) -> Result<Shown, Failure> {
    let stored: Vec<(f64, f64)> = numbers("tgv_re1600_dns.csv")?.iter().map(|r| (r[0], r[2])).collect();
    let peak = stored.iter().map(|p| p.1).fold(0.0, f64::max);
    let (fine, coarse) = if profile == Profile::Quick { (64, 32) } else { (128, 64) };
    let mut plot = CurvePlot::new("Loss of energy, Re 1600", Axis::linear("time [s]"), Axis::linear("-dE/dt [m²/s³]"))
        .with(Series::new("stored simulation, 512^3", Style::Line, stored.iter().copied().filter(|p| p.0 <= END_S)));
    let mut table = Table::new().float("time_s", (1..OUTPUTS).map(|i| EVERY_S * i as f64));
    let mut errors = Vec::new();
    let fine_models = [MODELS[0], MODELS[3]].map(|model| (fine, model));
    for (cells, (name, model)) in fine_models.into_iter().chain(MODELS.map(|model| (coarse, model))) {
        let curve = dissipation(cells, model)?;
        errors.push(error(&curve, &stored, peak));
        table = table.float(&format!("dissipation_{cells}_{}", name.replace(' ', "_")), curve.iter().map(|p| p.1));
        let style = if cells == fine { Style::Dash } else { Style::DashDot };
        plot = plot.with(Series::new(&format!("{cells}^3, {name}"), style, curve));
    }
    let bar = if profile == Profile::Quick { 0.1 } else { 0.02 };
    let mut checks = vec![
        Claim::at_most(&format!("{fine}^3, no model: rms error over peak"), errors[0], bar),
        Claim::at_most(&format!("{fine}^3, multiscale: rms error over peak"), errors[1], bar),
    ];
    for (i, (name, _)) in MODELS.iter().enumerate().skip(1) {
        checks.push(Claim::at_most(&format!("{coarse}^3: {name} against no model"), errors[2 + i], errors[2]));
    }
    checks.push(Claim::at_most(&format!("{coarse}^3: multiscale against WALE 0.5"), errors[5], errors[3]));
    checks.push(Claim::at_most(&format!("{coarse}^3: multiscale against WALE 0.325"), errors[5], errors[4]));
    Ok(Shown { checks, table, figure: Figure::stacked([plot]) })
}

fn error(curve: &[(f64, f64)], stored: &[(f64, f64)], peak: f64) -> f64 {
    let squares: f64 = curve.iter().map(|p| (p.1 - value_at(stored, p.0)).powi(2)).sum();
    (squares / curve.len() as f64).sqrt() / peak
}

/// Loss of energy per volume and time, by central differences of the energy, of the eighth of the box that symmetry leaves.
fn dissipation(cells: usize, model: SubgridModel) -> Result<Vec<(f64, f64)>, Failure> {
    let mut case = cases::taylor_green_eighth(cells / 2, REYNOLDS)?;
    case.settings.subgrid = model;
    let (mut flow, _) = case.start()?;
    let volume = PI.powi(3);
    let mut energy = vec![flow.kinetic_energy_m5_s2() / volume];
    for output in 1..=OUTPUTS {
        let until_s = EVERY_S * output as f64;
        while flow.time_s() < until_s {
            flow.step_towards(until_s)?;
        }
        energy.push(flow.kinetic_energy_m5_s2() / volume);
    }
    let slope = |i: usize| (energy[i - 1] - energy[i + 1]) / (2.0 * EVERY_S);
    Ok((1..OUTPUTS).map(|i| (EVERY_S * i as f64, slope(i))).collect())
}
