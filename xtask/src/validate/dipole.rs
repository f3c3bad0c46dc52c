//! A dipole against a wall: enstrophy in time against Clercx and Bruneau (2006) and a spectral code, vorticity at the wall.

use super::shown::Shown;
use crate::claim::Claim;
use crate::profile::Profile;
use crate::references::{numbers, parabola_vertex};
use crate::workspace::read;
use fixtures::failure::Failure;
use wakescope_les::cases;
use wakescope_sim::io::Table;
use wakescope_sim::plot::{Axis, CurvePlot, Figure, Series, Style};

pub(super) fn show_625(profile: Profile) -> Result<Shown, Failure> {
    show(625.0, profile)
}

pub(super) fn show_1250(profile: Profile) -> Result<Shown, Failure> {
    show(1250.0, profile)
}

fn show(reynolds: f64, profile: Profile) -> Result<Shown, Failure> {
    let cells = if profile == Profile::Quick { 128 } else { 384 };
    let case = cases::dipole_in_a_box([cells, cells], [1.5; 2], reynolds)?;
    let (mut flow, _) = case.start()?;
    let mut history: Vec<(f64, f64, f64)> = Vec::new();
    let (mut peaks, mut wall) = (Vec::new(), Vec::new());
    while flow.time_s() < case.end_s {
        let (time_s, energy) = (flow.time_s(), flow.kinetic_energy_m5_s2());
        let report = flow.step()?;
        // Between walls at rest the viscous power is twice the viscosity times the enstrophy.
        history.push((time_s, -0.5 * report.viscous_power_m5_s3 * reynolds, energy));
        if let [.., a, b, c] = history[..]
            && b.1 > a.1
            && b.1 > c.1
            && b.0 > 0.2
        {
            peaks.push(parabola_vertex([a, b, c].map(|p| (p.0, p.1))));
            if peaks.len() == 1 {
                wall = wall_vorticity(&flow);
            }
        }
    }
    let (first, second) = literature(reynolds)?;
    let share = if profile == Profile::Quick { 0.1 } else { 0.01 };
    let peak = |i: usize| peaks.get(i).copied().unwrap_or((f64::NAN, f64::NAN));
    let checks = vec![
        Claim::relative("time of the first maximum [s]", peak(0).0, first.0, 0.5 * share),
        Claim::relative("first maximum of the enstrophy", peak(0).1, first.1, share),
        Claim::relative("time of the second maximum [s]", peak(1).0, second.0, 0.5 * share),
        Claim::relative("second maximum of the enstrophy", peak(1).1, second.1, share),
    ];
    let table = Table::new()
        .float("time_s", history.iter().map(|p| p.0))
        .float("enstrophy_m2_s2", history.iter().map(|p| p.1))
        .float("kinetic_energy_m4_s2", history.iter().map(|p| p.2));
    let mut curve = CurvePlot::new("Enstrophy", Axis::linear("time [s]"), Axis::linear("enstrophy")).with(Series::new(
        &format!("{cells} x {cells}"),
        Style::Line,
        history.iter().map(|p| (p.0, p.1)),
    ));
    if reynolds == 625.0 {
        let stored = numbers("dipole_wall_re625_history.csv")?;
        curve = curve.with(Series::new("spectral code", Style::Dash, stored.iter().map(|row| (row[0], row[1]))));
    }
    let curve = curve.with(Series::new("Clercx and Bruneau", Style::Markers, [first, second]));
    let wall = CurvePlot::new("At the wall, first maximum", Axis::linear("y [m]"), Axis::linear("vorticity [1/s]"))
        .with(Series::new("", Style::Line, wall));
    Ok(Shown { checks, table, figure: Figure::stacked([curve, wall]) })
}

/// Time and value of each of the two maxima.
type Maxima = ((f64, f64), (f64, f64));

/// Times and values of the two maxima in the literature.
fn literature(reynolds: f64) -> Result<Maxima, Failure> {
    let text = read("tests/reference/les/dipole_wall_normal.csv")?;
    let rows = text.lines().filter(|line| line.ends_with("C&B2006"));
    let cells = rows.map(|line| line.split(',').filter_map(|cell| cell.trim().parse().ok()).collect::<Vec<f64>>());
    for row in cells {
        if let [found, t1, omega1, t2, omega2] = row[..]
            && found == reynolds
        {
            return Ok(((t1, omega1), (t2, omega2)));
        }
    }
    Err(Failure::new(format!("no row of Reynolds number {reynolds}")))
}

/// Vorticity at the wall that the dipole meets, z = -1, from the slope of the parabola through the wall.
fn wall_vorticity(flow: &wakescope_les::Flow) -> Vec<(f64, f64)> {
    let ny = flow.mesh().cells()[1];
    let (v, z_m) = (flow.face_velocity_m_s(1), flow.mesh().centre_m(2));
    let y_m = flow.mesh().face_m(1);
    let (a, b) = (1.0 + z_m[0], 1.0 + z_m[1]);
    // The vorticity is -dv/dz at the wall, where v is zero.
    let slope = |j: usize| (v[j] * b * b - v[ny + j] * a * a) / (a * b * (b - a));
    (0..ny).map(|j| (y_m[j], -slope(j))).filter(|p| p.0.abs() < 0.6).collect()
}
