//! The vortex pair near the ground in space against an independent code in the same box with the same noise formula
//! (`tests/reference/les/wake_3d_*.csv`): coarse and medium mesh, without and with the multiscale model.

use super::runs::*;
use crate::wakes::mean;
use serde::Deserialize;
use std::f64::consts::TAU;
use std::path::Path;
use wakescope_les::analysis::decay::amplitude_growth;
use wakescope_sim::flow::table as read_table;

const END: f64 = 5.0;
/// The flow is laminar until here.
const LAMINAR: f64 = 2.2;

/// What one mesh must keep.
#[derive(Deserialize)]
struct Bars {
    file: String,
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

#[derive(Deserialize)]
struct Meshes {
    coarse: Bars,
    medium: Bars,
}

fn meshes() -> Result<Meshes, Failure> {
    Ok(toml::from_str(include_str!("bars.toml"))?)
}

/// Columns of the stored rows, left and right.
const GAMMA: [usize; 2] = [1, 2];
const Y: [usize; 2] = [3, 5];
const Z: [usize; 2] = [4, 6];
const ENERGY: usize = 11;
const ENSTROPHY: usize = 12;
const ENERGY_3D: usize = 13;
const MODES: [(usize, usize); 2] = [(2, 19), (3, 20)];
const SIDES: [&str; 2] = ["left", "right"];

/// 24 x 128 x 80 cells; also the multiscale model up to the end of the laminar phase, which it must leave alone.
pub(super) fn show_coarse() -> Result<Shown, Failure> {
    let bars = meshes()?.coarse;
    let flow = run(WakePreset::Coarse, Subgrid::None {}, END, |_| {})?;
    let mut shown = show(&flow, &bars)?;
    let modelled = run(WakePreset::Coarse, MULTISCALE, LAMINAR, |_| {})?;
    shown.checks.extend(laminar(
        "multiscale: ",
        &modelled,
        &numbers(&bars.file)?,
        &bars,
    )?);
    let mut off = 0.0_f64;
    for side in SIDES.map(|side| format!("gamma_ratio_{side}")) {
        off = off.max(worst(
            &modelled.curve(&side)?,
            &flow.curve(&side)?,
            [0.0, LAMINAR],
            apart,
        ));
    }
    shown
        .checks
        .push(Claim::at_most("multiscale: Γ against no model", off, 0.005));
    Ok(shown)
}

/// 48 x 240 x 128 cells.
pub(super) fn show_medium() -> Result<Shown, Failure> {
    show(
        &run(WakePreset::Medium, Subgrid::None {}, END, |_| {})?,
        &meshes()?.medium,
    )
}

/// A finished run of the flow of either preset on its own or a finer mesh, instead of one made here.
pub(super) fn show_files(folder: &Path) -> Result<Shown, Failure> {
    let wake = FinishedWake::read(folder)?;
    let f = &wake.flow;
    let like = |preset: WakePreset| {
        let pair = preset.flow();
        f.reynolds == pair.reynolds
            && f.core_radius == pair.core_radius
            && f.perturbation == pair.perturbation
            && f.size == pair.size
            && f.cells
                .iter()
                .zip(pair.cells)
                .all(|(has, least)| *has >= least)
    };
    let Meshes { coarse, medium } = meshes()?;
    let found = [(WakePreset::Medium, medium), (WakePreset::Coarse, coarse)]
        .into_iter()
        .find(|of| like(of.0));
    let found = found.ok_or_else(|| {
        Failure::new(format!(
            "{}: no stored run is of this flow",
            folder.display()
        ))
    })?;
    show(&wake, &found.1)
}

fn show(flow: &FinishedWake, bars: &Bars) -> Result<Shown, Failure> {
    let stored = numbers(&bars.file)?;
    let plane = run(WakePreset::Coarse, Subgrid::None {}, END, |of| {
        *of = flow.flow.clone();
        plane(of);
    })?;
    let mut checks = laminar("", flow, &stored, bars)?;
    checks.extend(turbulent(flow, &plane, &stored, bars)?);
    Ok(Shown {
        checks,
        table: table(flow)?,
        figure: figure(flow, &plane, &stored)?,
    })
}

fn laminar(
    name: &str,
    flow: &FinishedWake,
    stored: &[Vec<f64>],
    bars: &Bars,
) -> Result<Vec<Claim>, Failure> {
    let off = |column: &str, place: usize, range, difference: fn(f64, f64) -> f64| {
        Ok::<f64, Failure>(worst(
            &flow.curve(column)?,
            &stored_curve(stored, place),
            range,
            difference,
        ))
    };
    let (mut position, mut gamma) = (0.0_f64, 0.0_f64);
    for (side, name) in SIDES.iter().enumerate() {
        position = position.max(off(&format!("y_{name}"), Y[side], [0.0, 2.0], apart)?);
        position = position.max(off(&format!("z_{name}"), Z[side], [0.0, 2.0], apart)?);
        gamma = gamma.max(off(
            &format!("gamma_ratio_{name}"),
            GAMMA[side],
            [0.0, LAMINAR],
            apart,
        )?);
    }
    let [budget, dissipation] = step_errors(flow)?;
    let of_logarithm = |a: f64, b: f64| (a / b).ln().abs();
    let check = |what: &str, measured: f64, bar: f64| {
        Claim::at_most(&format!("{name}{what}"), measured, bar)
    };
    let mut checks = vec![
        check("y, z to 2", position, bars.position),
        check("Γ ratio to 2.2", gamma, bars.gamma),
        check(
            "energy to 2.2, relative",
            off("energy", ENERGY, [0.1, LAMINAR], relative)?,
            bars.energy,
        ),
        check("energy budget of a step, relative", budget, 0.005),
        check("2 nu Z against viscous power, relative", dissipation, 0.005),
        check(
            "ln E_3d, 0.5 to 2.2",
            off("energy_3d", ENERGY_3D, [0.5, LAMINAR], of_logarithm)?,
            bars.log_energy_3d,
        ),
    ];
    for (mode, column) in MODES {
        let measured = amplitude_growth(&flow.curve(&format!("energy_mode_{mode}"))?, 1.0, 2.0);
        let reference = amplitude_growth(&stored_curve(stored, column), 1.0, 2.0);
        checks.push(Claim::relative(
            &format!("{name}growth of mode {mode}, 1 to 2"),
            measured,
            reference,
            bars.growth,
        ));
    }
    Ok(checks)
}

/// Largest relative errors of the energy budget of a step, and of the dissipation of a record by its vorticity, from tau = 0.1 on.
fn step_errors(wake: &FinishedWake) -> Result<[f64; 2], Failure> {
    let steps = read_table(&wake.folder.join("steps.csv"))?;
    let column = |name: &str| {
        steps
            .get(name)
            .ok_or_else(|| Failure::new(format!("steps.csv has no column {name}")))
    };
    let (time, step) = (column("time_s")?, column("step_s")?);
    let (rate, residual) = (
        column("energy_rate_m5_s3")?,
        column("energy_residual_m5_s3")?,
    );
    let viscous = column("viscous_power_m5_s3")?;
    let (unit_s, power_unit) = (
        wake.scales.time_unit_s(),
        wake.scales.spacing_m.powi(2) * wake.scales.descent_speed_m_s().powi(3),
    );
    let late = |i: &usize| time[*i] - step[*i] > 0.1 * unit_s && residual[*i].is_finite();
    // What the powers leave of the rate, over what they give.
    let budget = (0..time.len())
        .filter(late)
        .map(|i| (residual[i] / (rate[i] - residual[i])).abs())
        .fold(0.0, f64::max);
    let mut dissipation = 0.0_f64;
    for (tau, enstrophy) in wake.curve("enstrophy")?.into_iter().filter(|p| p.0 > 0.1) {
        // The step that begins with the record reports the power there.
        let begins = |i: &usize| (time[*i] - step[*i] - tau * unit_s).abs() < 1e-6 * unit_s;
        if let Some(i) = (0..time.len()).find(begins) {
            let measured = 2.0 * TAU / wake.flow.reynolds * wake.flow.size[0] * enstrophy;
            dissipation = dissipation.max((-viscous[i] / power_unit / measured - 1.0).abs());
        }
    }
    Ok([budget, dissipation])
}

fn turbulent(
    flow: &FinishedWake,
    plane: &FinishedWake,
    stored: &[Vec<f64>],
    bars: &Bars,
) -> Result<Vec<Claim>, Failure> {
    let mean_onset = |[left, right]: [Curve; 2]| {
        let [a, b] = [left, right].map(|curve| onset(&curve).unwrap_or(f64::NAN));
        0.5 * (a + b)
    };
    let gamma = mean(flow, "gamma_ratio", 1.0)?;
    let mut checks = vec![Claim::within(
        "onset of the fast decay",
        mean_onset([
            flow.curve("gamma_ratio_left")?,
            flow.curve("gamma_ratio_right")?,
        ]),
        mean_onset(GAMMA.map(|column| stored_curve(stored, column))),
        bars.onset,
    )];
    for (tau, reference, bar) in bars.late {
        checks.push(Claim::within(
            &format!("Γ ratio at {tau}"),
            value_at(&gamma, tau),
            reference,
            bar,
        ));
    }
    let (ratio, ratio_bar) = bars.ratio_to_plane;
    let of_plane = value_at(&mean(plane, "gamma_ratio", 1.0)?, END);
    checks.push(Claim::within(
        "3-D over 2-D Γ at 5",
        value_at(&gamma, END) / of_plane,
        ratio,
        ratio_bar,
    ));
    let (last, last_bar) = bars.last_energy;
    checks.push(Claim::within(
        "energy at 5",
        value_at(&flow.curve("energy")?, END),
        last,
        last_bar,
    ));
    let enstrophy = flow.curve("enstrophy")?;
    let late = enstrophy.iter().filter(|p| p.0 > LAMINAR);
    let peak = late.fold((0.0, 0.0), |best, p| if p.1 > best.1 { *p } else { best });
    let middle = |[low, high]: [f64; 2]| (0.5 * (low + high), 0.5 * (high - low));
    let (value, value_bar) = middle(bars.peak);
    let (tau, tau_bar) = middle(bars.peak_tau);
    checks.push(Claim::within(
        "second enstrophy peak",
        peak.1,
        value,
        value_bar,
    ));
    // Records are 0.05 apart.
    checks.push(Claim::within("its tau", peak.0, tau, tau_bar + 0.025));
    Ok(checks)
}

/// The columns of the table, the circulations over those at the start.
fn table(flow: &FinishedWake) -> Result<Table, Failure> {
    let names = [
        "tau gamma_ratio_left gamma_ratio_right y_left z_left y_right z_right energy enstrophy energy_3d gamma_opposite_left",
        "gamma_opposite_right secondary_y_left secondary_z_left secondary_y_right secondary_z_right wall_units",
    ];
    let mut table = Table::new();
    for name in names.iter().flat_map(|names| names.split(' ')) {
        table = table.float(
            &name.replace("gamma_ratio", "gamma_5_15"),
            flow.column(name)?.iter().copied(),
        );
    }
    Ok(table)
}

fn figure(
    flow: &FinishedWake,
    plane: &FinishedWake,
    stored: &[Vec<f64>],
) -> Result<Figure, Failure> {
    let path = |y: Curve, z: Curve| -> Curve {
        y.into_iter()
            .zip(z)
            .map(|(y, z)| (y.1.abs(), z.1))
            .collect()
    };
    let known = |column| stored_curve(stored, column);
    let mut decay = CurvePlot::new(
        "Circulation",
        Axis::linear("tau"),
        Axis::linear("Gamma_5-15 / initial").between(0.3, 1.02),
    );
    let mut paths = CurvePlot::new("Paths", Axis::linear("|y| / b₀"), Axis::linear("z / b₀"));
    for (side, name) in SIDES.iter().enumerate() {
        let of = |what: &str| flow.curve(&format!("{what}_{name}"));
        decay = decay
            .with(Series::new(name, Style::Line, of("gamma_ratio")?))
            .with(Series::new(
                &format!("independent code, {name}"),
                Style::Markers,
                known(GAMMA[side]),
            ));
        paths = paths.with(Series::new(name, Style::Line, path(of("y")?, of("z")?)));
    }
    let decay = decay.with(Series::new(
        "plane flow",
        Style::Dash,
        plane.curve("gamma_ratio_right")?,
    ));
    let paths = paths.with(Series::new(
        "independent code, right",
        Style::Markers,
        path(known(Y[1]), known(Z[1])),
    ));
    let waves = CurvePlot::new(
        "Energy along x",
        Axis::linear("tau"),
        Axis::log("E_3d [b₀² V₀²]"),
    )
    .with(Series::new(
        "this solver",
        Style::Line,
        flow.curve("energy_3d")?,
    ))
    .with(Series::new(
        "independent code",
        Style::Markers,
        known(ENERGY_3D),
    ));
    let clipped = |curve: Curve| {
        curve
            .into_iter()
            .map(|p| (p.0, p.1.min(1100.0)))
            .collect::<Curve>()
    };
    let enstrophy = CurvePlot::new(
        "Enstrophy",
        Axis::linear("tau"),
        Axis::linear("Z [V₀²]").between(0.0, 1100.0),
    )
    .with(Series::new(
        "this solver",
        Style::Line,
        clipped(flow.curve("enstrophy")?),
    ))
    .with(Series::new(
        "independent code",
        Style::Markers,
        clipped(known(ENSTROPHY)),
    ));
    Ok(Figure::stacked([decay, paths, waves, enstrophy]))
}
