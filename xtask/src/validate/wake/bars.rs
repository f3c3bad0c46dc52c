//! The pair in space against the independent code, row by row: coarse and medium mesh, without and with the multiscale model.

use super::history::{COLUMNS, History, PER_TAU, Stored, run, worst};
use crate::claim::Claim;
use crate::profile::Profile;
use crate::validate::shown::Shown;
use fixtures::failure::Failure;
use std::path::Path;
use wakescope_les::SubgridModel;
use wakescope_les::analysis::decay::{amplitude_growth, onset, value_at};
use wakescope_les::cases::VortexPairCase;
use wakescope_sim::flow::FinishedWake;
use wakescope_sim::io::Table;
use wakescope_sim::plot::{Axis, CurvePlot, Figure, Series, Style};

const END: f64 = 5.0;
/// The flow is laminar until here.
const LAMINAR: f64 = 2.2;

/// What one mesh must keep.
struct Bars {
    file: &'static str,
    position: f64,
    gamma: f64,
    energy: f64,
    log_energy_3d: f64,
    growth: f64,
    onset: f64,
    /// Circulation at 3, 4, 5 with what it may be off.
    late: [(f64, f64, f64); 3],
    ratio_to_plane: (f64, f64),
    last_energy: (f64, f64),
    peak: [f64; 2],
    peak_tau: [f64; 2],
}

const COARSE: Bars = Bars {
    file: "wake_3d_ground_re5000_coarse_box4_cans.csv",
    position: 0.02,
    gamma: 0.008,
    energy: 0.005,
    log_energy_3d: 0.7,
    growth: 0.15,
    onset: 0.25,
    late: [(3.0, 0.65, 0.07), (4.0, 0.54, 0.07), (5.0, 0.50, 0.07)],
    ratio_to_plane: (0.68, 0.07),
    last_energy: (4.6, 0.35),
    peak: [700.0, 1100.0],
    peak_tau: [2.8, 3.2],
};

const MEDIUM: Bars = Bars {
    file: "wake_3d_ground_re5000_cans.csv",
    position: 0.01,
    gamma: 0.005,
    energy: 0.003,
    log_energy_3d: 0.35,
    growth: 0.08,
    onset: 0.15,
    late: [(3.0, 0.68, 0.04), (4.0, 0.565, 0.04), (5.0, 0.515, 0.05)],
    ratio_to_plane: (0.70, 0.05),
    last_energy: (4.75, 0.25),
    peak: [800.0, 1000.0],
    peak_tau: [3.0, 3.2],
};

/// 24 x 128 x 80 cells; also the multiscale model up to the end of the laminar phase, which it must leave alone.
pub(crate) fn show_coarse(_: Profile) -> Result<Shown, Failure> {
    let model = VortexPairCase { subgrid: SubgridModel::MULTISCALE_WALE, ..VortexPairCase::coarse() };
    show(VortexPairCase::coarse(), &COARSE, Some(model))
}

/// 48 x 240 x 128 cells.
pub(crate) fn show_medium(_: Profile) -> Result<Shown, Failure> {
    show(VortexPairCase::medium(), &MEDIUM, None)
}

/// A finished run of the flow of either preset on its own or a finer mesh, instead of one made here.
pub(crate) fn show_files(folder: &Path) -> Result<Shown, Failure> {
    let wake = FinishedWake::read(folder)?;
    let f = &wake.flow;
    let like = |pair: &VortexPairCase| {
        f.reynolds == pair.reynolds
            && f.core_radius == pair.core_radius
            && f.perturbation == pair.perturbation
            && f.size == pair.size
            && f.cells.iter().zip(pair.cells).all(|(has, least)| *has >= least)
    };
    let choices = [(VortexPairCase::medium(), &MEDIUM), (VortexPairCase::coarse(), &COARSE)];
    let Some((pair, bars)) = choices.into_iter().find(|(pair, _)| like(pair)) else {
        return Err(Failure::new(format!("{}: no stored run is of this flow", folder.display())));
    };
    let (stored, flow) = (Stored::read(bars.file)?, History::read(&wake)?);
    let plane = run(&VortexPairCase { cells: [1, f.cells[1], f.cells[2]], subgrid: SubgridModel::None, ..pair }, END)?;
    let mut checks = laminar("", &flow, &stored, bars);
    checks.extend(turbulent(&flow, &plane, &stored, bars));
    let figure = figure(&flow, &plane, &stored);
    Ok(Shown { checks, table: table(&flow), figure })
}

fn show(pair: VortexPairCase, bars: &Bars, model: Option<VortexPairCase>) -> Result<Shown, Failure> {
    let stored = Stored::read(bars.file)?;
    let flow = run(&pair, END)?;
    let plane = run(&VortexPairCase { cells: [1, pair.cells[1], pair.cells[2]], ..pair }, END)?;
    let mut checks = laminar("", &flow, &stored, bars);
    checks.extend(turbulent(&flow, &plane, &stored, bars));
    if let Some(model) = model {
        let modelled = run(&model, LAMINAR)?;
        checks.extend(laminar("multiscale: ", &modelled, &stored, bars));
        let apart = |right| worst(&modelled.gamma(right), &flow.gamma(right), [0.0, LAMINAR], |a, b| (a - b).abs());
        checks.push(Claim::at_most("multiscale: Γ against no model", apart(false).max(apart(true)), 0.005));
    }
    let figure = figure(&flow, &plane, &stored);
    Ok(Shown { checks, table: table(&flow), figure })
}

fn laminar(name: &str, flow: &History, stored: &Stored, bars: &Bars) -> Vec<Claim> {
    let apart = |measured: &[(f64, f64)], column: usize, to: f64| {
        worst(measured, &stored.curve(column), [0.0, to], |a, b| (a - b).abs())
    };
    let position = [
        apart(&flow.curve("y_left"), Stored::Y[0], 2.0),
        apart(&flow.curve("y_right"), Stored::Y[1], 2.0),
        apart(&flow.curve("z_left"), Stored::Z[0], 2.0),
        apart(&flow.curve("z_right"), Stored::Z[1], 2.0),
    ];
    let gamma = [false, true].map(|right| apart(&flow.gamma(right), Stored::GAMMA[usize::from(right)], LAMINAR));
    let energy =
        worst(&flow.curve("energy"), &stored.curve(Stored::ENERGY), [0.1, LAMINAR], |a, b| (a / b - 1.0).abs());
    let waves = flow.curve("energy_3d");
    let logarithm = worst(&waves, &stored.curve(Stored::ENERGY_3D), [0.5, LAMINAR], |a, b| (a / b).ln().abs());
    let check = |what: &str, measured: f64, bar: f64| Claim::at_most(&format!("{name}{what}"), measured, bar);
    let mut checks = vec![
        check("y, z to 2", position.into_iter().fold(0.0, f64::max), bars.position),
        check("Γ ratio to 2.2", gamma[0].max(gamma[1]), bars.gamma),
        check("energy to 2.2, relative", energy, bars.energy),
        check("energy budget of a step, relative", flow.budget_error, 0.005),
        check("2 nu Z against viscous power, relative", flow.dissipation_error, 0.005),
        check("ln E_3d, 0.5 to 2.2", logarithm, bars.log_energy_3d),
    ];
    for (mode, column) in [(2, Stored::MODE_2), (3, Stored::MODE_3)] {
        let measured = amplitude_growth(&flow.curve(&format!("energy_mode_{mode}")), 1.0, 2.0);
        let reference = amplitude_growth(&stored.curve(column), 1.0, 2.0);
        checks.push(Claim::relative(&format!("{name}growth of mode {mode}, 1 to 2"), measured, reference, bars.growth));
    }
    checks
}

fn turbulent(flow: &History, plane: &History, stored: &Stored, bars: &Bars) -> Vec<Claim> {
    let mean_onset = |curves: [Vec<(f64, f64)>; 2]| {
        let [a, b] = curves.map(|curve| onset(&curve).unwrap_or(f64::NAN));
        0.5 * (a + b)
    };
    let mut checks = vec![Claim::within(
        "onset of the fast decay",
        mean_onset([flow.gamma(false), flow.gamma(true)]),
        mean_onset(Stored::GAMMA.map(|column| stored.curve(column))),
        bars.onset,
    )];
    for (tau, reference, bar) in bars.late {
        checks.push(Claim::within(&format!("Γ ratio at {tau}"), flow.mean_gamma(tau), reference, bar));
    }
    let (ratio, ratio_bar) = bars.ratio_to_plane;
    checks.push(Claim::within("3-D over 2-D Γ at 5", flow.mean_gamma(END) / plane.mean_gamma(END), ratio, ratio_bar));
    let energy = flow.curve("energy");
    checks.push(Claim::within("energy at 5", value_at(&energy, END), bars.last_energy.0, bars.last_energy.1));
    let enstrophy = flow.curve("enstrophy");
    let late = enstrophy.iter().filter(|p| p.0 > LAMINAR);
    let peak = late.fold((0.0, 0.0), |best, p| if p.1 > best.1 { *p } else { best });
    let middle = |[low, high]: [f64; 2]| (0.5 * (low + high), 0.5 * (high - low));
    let (value, value_bar) = middle(bars.peak);
    let (tau, tau_bar) = middle(bars.peak_tau);
    checks.push(Claim::within("second enstrophy peak", peak.1, value, value_bar));
    checks.push(Claim::within("its tau", peak.0, tau, tau_bar + 0.5 / PER_TAU as f64));
    checks
}

/// The columns of the table, the circulations over those at the start.
fn table(flow: &History) -> Table {
    let names = COLUMNS[..17].iter().map(|column| column.0);
    names.fold(Table::new(), |table, name| match name.strip_prefix("gamma_5_15_") {
        Some(side) => table.float(name, flow.gamma(side == "right").into_iter().map(|p| p.1)),
        None => table.float(name, flow.column(name).iter().copied()),
    })
}

fn figure(flow: &History, plane: &History, stored: &Stored) -> Figure {
    let path = |y: Vec<(f64, f64)>, z: Vec<(f64, f64)>| y.into_iter().zip(z).map(|(y, z)| (y.1.abs(), z.1)).collect();
    let right: Vec<(f64, f64)> = path(flow.curve("y_right"), flow.curve("z_right"));
    let left: Vec<(f64, f64)> = path(flow.curve("y_left"), flow.curve("z_left"));
    let known: Vec<(f64, f64)> = path(stored.curve(Stored::Y[1]), stored.curve(Stored::Z[1]));
    let decay =
        CurvePlot::new("Circulation", Axis::linear("tau"), Axis::linear("Gamma_5-15 / initial").between(0.3, 1.02))
            .with(Series::new("left", Style::Line, flow.gamma(false)))
            .with(Series::new("right", Style::Line, flow.gamma(true)))
            .with(Series::new("plane flow", Style::Dash, plane.gamma(true)))
            .with(Series::new("independent code, left", Style::Markers, stored.curve(Stored::GAMMA[0])))
            .with(Series::new("independent code, right", Style::Markers, stored.curve(Stored::GAMMA[1])));
    let paths = CurvePlot::new("Paths", Axis::linear("|y| / b₀"), Axis::linear("z / b₀"))
        .with(Series::new("left", Style::Line, left))
        .with(Series::new("right", Style::Line, right))
        .with(Series::new("independent code, right", Style::Markers, known));
    let waves = CurvePlot::new("Energy along x", Axis::linear("tau"), Axis::log("E_3d [b₀² V₀²]"))
        .with(Series::new("this solver", Style::Line, flow.curve("energy_3d")))
        .with(Series::new("independent code", Style::Markers, stored.curve(Stored::ENERGY_3D)));
    let clipped = |curve: Vec<(f64, f64)>| curve.into_iter().map(|p| (p.0, p.1.min(1100.0))).collect::<Vec<_>>();
    let enstrophy = CurvePlot::new("Enstrophy", Axis::linear("tau"), Axis::linear("Z [V₀²]").between(0.0, 1100.0))
        .with(Series::new("this solver", Style::Line, clipped(flow.curve("enstrophy"))))
        .with(Series::new("independent code", Style::Markers, clipped(stored.curve(Stored::ENSTROPHY))));
    Figure::stacked([decay, paths, waves, enstrophy])
}
