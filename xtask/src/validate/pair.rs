//! The plane vortex pair above ground at Re 2500: energy and enstrophy against a spectral code.

use super::{Check, Profile, Shown, interpolate, numbers};
use crate::Failure;
use std::f64::consts::TAU;
use wakescope_les::cases::VortexPairCase;
use wakescope_les::{CirculationProfile, TimeStep};
use wakescope_sim::export::Table;
use wakescope_sim::plot::{Axis, CurvePlot, Figure, Series, Style};

const REYNOLDS: f64 = 2500.0;
const END_S: f64 = 3.0;

pub(super) fn show(profile: Profile) -> Result<Shown, Failure> {
    let cells = if profile == Profile::Quick { [1, 192, 96] } else { [1, 384, 192] };
    let pair = VortexPairCase {
        cells,
        size: [1.0, 6.0, 3.0],
        core_radius: 0.12,
        profile: CirculationProfile::LambOseen,
        reynolds: REYNOLDS,
        perturbation: 0.0,
        ..VortexPairCase::default()
    };
    let (mut flow, _) = pair.case(TimeStep::Courant { courant: 0.35, longest_s: 0.01 })?.start()?;
    let viscosity = TAU / REYNOLDS;
    let mut history = Vec::new();
    while flow.time_s() < END_S {
        let (time_s, energy) = (flow.time_s(), flow.kinetic_energy_m5_s2());
        let report = flow.step_towards(END_S)?;
        history.push((time_s, energy, -0.5 * report.viscous_power_m5_s3 / viscosity));
    }
    let stored = numbers("wake_2d_ground_re2500.csv")?;
    let worst = |column: usize, of: fn(&(f64, f64, f64)) -> f64| {
        let curve: Vec<(f64, f64)> = history.iter().map(|p| (p.0, of(p))).collect();
        let rows = stored.iter().filter(|r| r[0] >= 0.1 && r[0] < END_S);
        rows.map(|r| (interpolate(&curve, r[0]) / r[column] - 1.0).abs()).fold(0.0, f64::max)
    };
    let wide = if profile == Profile::Quick { 4.0 } else { 1.0 };
    let checks = vec![
        Check::at_most("largest error of the energy, relative", worst(6, |p| p.1), 0.005 * wide),
        Check::at_most("largest error of the enstrophy, relative", worst(5, |p| p.2), 0.02 * wide),
    ];
    let table = Table::new()
        .float("tau", history.iter().map(|p| p.0))
        .float("energy", history.iter().map(|p| p.1))
        .float("enstrophy", history.iter().map(|p| p.2));
    let points = |column: usize| stored.iter().map(move |r| (r[0], r[column])).collect::<Vec<_>>();
    let energy = CurvePlot::new("Energy", Axis::linear("tau"), Axis::linear("E [b0^2 V0^2]"))
        .with(Series::new("this solver", Style::Line, history.iter().map(|p| (p.0, p.1))))
        .with(Series::new("spectral code", Style::Markers, points(6)));
    let enstrophy =
        CurvePlot::new("Enstrophy", Axis::linear("tau"), Axis::linear("enstrophy [V0^2]").between(0.0, 700.0))
            .with(Series::new("this solver", Style::Line, history.iter().map(|p| (p.0, p.2.min(700.0)))))
            .with(Series::new("spectral code", Style::Markers, points(5)));
    Ok(Shown { checks, table, figure: Figure::stacked([energy, enstrophy]) })
}
