//! The vortices of Taylor and Green at Re 1600: direct simulation against a stored one, and the subgrid models.

use super::{Check, Profile, Shown, interpolate, numbers};
use crate::Failure;
use std::f64::consts::TAU;
use wakescope_les::{SubgridModel, cases};
use wakescope_sim::export::Table;
use wakescope_sim::plot::{Axis, CurvePlot, Figure, Series, Style};

const REYNOLDS: f64 = 1600.0;
const END_S: f64 = 10.0;
const EVERY_S: f64 = 0.1;

pub(super) fn show(profile: Profile) -> Result<Shown, Failure> {
    let stored: Vec<(f64, f64)> = numbers("tgv_re1600_dns.csv")?.iter().map(|r| (r[0], r[2])).collect();
    let peak = stored.iter().map(|p| p.1).fold(0.0, f64::max);
    let (fine, coarse) = if profile == Profile::Quick { (48, 32) } else { (128, 64) };
    let models = [
        ("no model", SubgridModel::None),
        ("WALE", SubgridModel::WALE),
        ("multiscale WALE", SubgridModel::MULTISCALE_WALE),
    ];
    let direct = dissipation(fine, SubgridModel::None)?;
    let mut table = Table::new()
        .float("time_s", direct.iter().map(|p| p.0))
        .float("dissipation_direct", direct.iter().map(|p| p.1));
    let mut plot =
        CurvePlot::new("Loss of energy, Re 1600", Axis::linear("time [s]"), Axis::linear("-dE/dt [m^2/s^3]"))
            .with(Series::new("stored simulation, 512^3", Style::Line, stored.iter().copied().filter(|p| p.0 <= END_S)))
            .with(Series::new(&format!("{fine}^3, no model"), Style::Dash, direct.clone()));
    let mut errors = Vec::new();
    for (name, model) in models {
        let curve = dissipation(coarse, model)?;
        errors.push(error(&curve, &stored, peak));
        table = table.float(&format!("dissipation_{}", name.replace(' ', "_")), curve.iter().map(|p| p.1));
        plot = plot.with(Series::new(&format!("{coarse}^3, {name}"), Style::DashDot, curve));
    }
    let bar = if profile == Profile::Quick { 0.25 } else { 0.02 };
    let checks = vec![
        Check::at_most(&format!("{fine}^3: rms error over peak"), error(&direct, &stored, peak), bar),
        Check::at_most(&format!("{coarse}^3: WALE against no model"), errors[1], errors[0]),
        Check::at_most(&format!("{coarse}^3: multiscale against WALE"), errors[2], errors[1]),
    ];
    Ok(Shown { checks, table, figure: Figure::stacked([plot]) })
}

fn error(curve: &[(f64, f64)], stored: &[(f64, f64)], peak: f64) -> f64 {
    let squares: f64 = curve.iter().map(|p| (p.1 - interpolate(stored, p.0)).powi(2)).sum();
    (squares / curve.len() as f64).sqrt() / peak
}

/// Loss of energy per volume and time, by central differences of the energy.
fn dissipation(cells: usize, model: SubgridModel) -> Result<Vec<(f64, f64)>, Failure> {
    let mut case = cases::taylor_green_3d(cells, REYNOLDS)?;
    case.settings.subgrid = model;
    let (mut flow, _) = case.start()?;
    let volume = TAU.powi(3);
    let mut energy = vec![flow.kinetic_energy_m5_s2() / volume];
    for output in 1..=(END_S / EVERY_S).round() as usize {
        let until_s = EVERY_S * output as f64;
        while flow.time_s() < until_s {
            flow.step_towards(until_s)?;
        }
        energy.push(flow.kinetic_energy_m5_s2() / volume);
    }
    let slope = |i: usize| (energy[i - 1] - energy[i + 1]) / (2.0 * EVERY_S);
    Ok((1..energy.len() - 1).map(|i| (EVERY_S * i as f64, slope(i))).collect())
}
