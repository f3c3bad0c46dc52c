//! The lid-driven cavity at Re 1000 against Ghia, Ghia and Shin (1982) and Botella and Peyret (1998).

use super::shown::Shown;
use crate::claim::Claim;
use crate::profile::Profile;
use crate::references::{numbers, parabola_vertex};
use fixtures::failure::Failure;
use wakescope_les::cases;
use wakescope_sim::io::Table;
use wakescope_sim::plot::{Axis, CurvePlot, Figure, Series, Style};

/// Extrema of Botella and Peyret: velocity along the lid's direction on the vertical centre line, and across on the other.
const U_MIN: (f64, f64) = (0.1717, -0.388_569_8);
const V_MAX: (f64, f64) = (0.1578, 0.376_944_7);
const V_MIN: (f64, f64) = (0.9092, -0.527_077_1);

pub(super) fn show(profile: Profile) -> Result<Shown, Failure> {
    let (cells, end_s) = if profile == Profile::Quick { (48, 40.0) } else { (128, 60.0) };
    let (mut flow, _) = cases::lid_driven_cavity(cells, 1.5, 1000.0)?.start()?;
    while flow.time_s() < end_s {
        flow.step_towards(end_s)?;
    }
    let (centre_y, centre_z) = (flow.mesh().centre_m(1), flow.mesh().centre_m(2));
    let (v, w) = (flow.face_velocity_m_s(1), flow.face_velocity_m_s(2));
    // The mesh is symmetric: face `cells/2` lies at 0.5.
    let column: Vec<(f64, f64)> = (0..cells).map(|k| (centre_z[k], v[k * cells + cells / 2])).collect();
    let row: Vec<(f64, f64)> = (0..cells).map(|j| (centre_y[j], w[cells / 2 * cells + j])).collect();
    let share = if profile == Profile::Quick { 0.05 } else { 0.002 };
    let (u_min, v_max, v_min) = (extremum(&column, -1.0), extremum(&row, 1.0), extremum(&row, -1.0));
    let mut checks = Vec::new();
    for (name, found, expected) in [("least u", u_min, U_MIN), ("largest v", v_max, V_MAX), ("least v", v_min, V_MIN)] {
        checks.push(Claim::relative(name, found.1, expected.1, share));
        checks.push(Claim::relative(&format!("place of the {name}"), found.0, expected.0, 2.0 * share));
    }
    let stored = numbers("ghia_cavity_u.csv")?;
    let ghia: Vec<(f64, f64)> = stored.iter().map(|r| (r[0], r[3])).collect();
    let table = Table::new()
        .float("position_m", column.iter().map(|p| p.0))
        .float("u_on_vertical_m_s", column.iter().map(|p| p.1))
        .float("v_on_horizontal_m_s", row.iter().map(|p| p.1));
    let plot = CurvePlot::new("Centre lines", Axis::linear("position [m]"), Axis::linear("velocity [m/s]"))
        .with(Series::new("u, vertical line", Style::Line, column))
        .with(Series::new("v, horizontal line", Style::Dash, row))
        .with(Series::new("u, Ghia et al.", Style::Markers, ghia))
        .with(Series::new("extrema, Botella and Peyret", Style::Markers, [U_MIN, V_MAX, V_MIN]));
    Ok(Shown { checks, table, figure: Figure::stacked([plot]) })
}

fn extremum(points: &[(f64, f64)], sign: f64) -> (f64, f64) {
    let best =
        (1..points.len() - 1).max_by(|&a, &b| (sign * points[a].1).total_cmp(&(sign * points[b].1))).unwrap_or(1);
    parabola_vertex([points[best - 1], points[best], points[best + 1]])
}
