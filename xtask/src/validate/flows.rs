//! Flows with known answers: order of the scheme, waves on Poiseuille flow, a dipole against a wall, a cavity, the vortices of Taylor
//! and Green, a channel.

use super::runs::*;
use crate::workspace::read;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use wakescope_les::cases::{self, TollmienSchlichting};
use wakescope_les::{Flow, SubgridModel, TimeScheme};

const VISCOSITY_M2_S: f64 = 0.01;

/// Order of the scheme: plane vortices on meshes stretched both ways, and a layer between walls.
pub(super) fn order(profile: Profile) -> Result<Shown, Failure> {
    let sizes: &[usize] = if profile == Profile::Quick {
        &[32, 64, 128]
    } else {
        &[32, 64, 128, 256]
    };
    let inside = sizes
        .iter()
        .map(|&n| Ok((n as f64, vortices(n)?)))
        .collect::<Result<Vec<_>, Failure>>()?;
    let walls = sizes
        .iter()
        .map(|&n| Ok((n as f64, layer(n)?)))
        .collect::<Result<Vec<_>, Failure>>()?;
    let order = |points: &[(f64, f64)]| {
        let last = points.len() - 1;
        (points[last - 1].1 / points[last].1).log2()
    };
    let checks = vec![
        Claim::at_least(
            "order inside, both directions stretched",
            order(&inside),
            3.9,
        ),
        Claim::at_least("order between no-slip walls", order(&walls), 2.8),
    ];
    let table = table_of(
        "cells",
        &[("error_vortices_m_s", &inside), ("error_layer_m_s", &walls)],
    );
    let first = inside[0];
    let slope = |power: i32| {
        sizes
            .iter()
            .map(move |&n| (n as f64, first.1 * (first.0 / n as f64).powi(power)))
    };
    let plot = CurvePlot::new(
        "Largest error",
        Axis::log("cells in each direction"),
        Axis::log("error [m/s]"),
    )
    .with(Series::new(
        "plane vortices, stretched",
        Style::LineMarkers,
        inside.clone(),
    ))
    .with(Series::new(
        "decaying layer between walls",
        Style::LineMarkers,
        walls,
    ))
    .with(Series::new("fourth order", Style::Dash, slope(4)))
    .with(Series::new("third order", Style::Dot, slope(3)));
    Ok(Shown {
        checks,
        table,
        figure: Figure::stacked([plot]),
    })
}

/// Largest error of plane vortices on a mesh stretched both ways.
fn vortices(n: usize) -> Result<f64, Failure> {
    let steps = n * n / 64;
    let mut case = cases::taylor_green_plane(n, [0.5, -0.4], VISCOSITY_M2_S, 0.1 / steps as f64)?;
    case.settings.scheme = TimeScheme::RungeKutta3;
    let mut flow = case.start()?.0;
    for _ in 0..steps {
        flow.step()?;
    }
    let n = flow.mesh().cells()[1];
    let (y_m, z_m) = (flow.mesh().face_m(1), flow.mesh().centre_m(2));
    let exact = |i: usize| {
        cases::taylor_green_plane_exact(
            [0.0, y_m[i % n], z_m[i / n]],
            flow.time_s(),
            VISCOSITY_M2_S,
        )[1]
    };
    Ok(flow
        .face_velocity_m_s(1)
        .iter()
        .enumerate()
        .map(|(i, v)| (v - exact(i)).abs())
        .fold(0.0, f64::max))
}

/// A layer that decays between no-slip walls.
fn layer(n: usize) -> Result<f64, Failure> {
    let (nu, end_s) = (0.1, 1.0);
    let steps = 20 * n;
    let (mut flow, _) = cases::Plates {
        cells: n,
        strength: 1.5,
        viscosity_m2_s: nu,
        step_s: end_s / steps as f64,
    }
    .decaying_layer()?
    .start()?;
    for _ in 0..steps {
        flow.step()?;
    }
    let decay = (-nu * FRAC_PI_2 * FRAC_PI_2 * end_s).exp();
    let errors = flow
        .face_velocity_m_s(0)
        .into_iter()
        .zip(flow.mesh().centre_m(2));
    Ok(errors
        .map(|(u, z)| (u - (FRAC_PI_2 * z).cos() * decay).abs())
        .fold(0.0, f64::max))
}

/// The wave is followed from here, when what is not the wave has died, to the end.
const WAVE_FROM_S: f64 = 5.0;
const WAVE_TO_S: f64 = 25.0;

/// Growth of Tollmien-Schlichting waves at Re 7500, alpha 1, against linear theory.
pub(super) fn waves(profile: Profile) -> Result<Shown, Failure> {
    let stored = numbers("orr_sommerfeld.csv")?;
    let expected = stored
        .first()
        .and_then(|row| row.get(3))
        .copied()
        .unwrap_or(f64::NAN);
    let coarse = amplitudes([64, 128], 0.01)?;
    let mut checks = vec![Claim::relative(
        "growth rate on 64 x 128 [1/s]",
        rate(&coarse),
        expected,
        0.01,
    )];
    let mut plot = CurvePlot::new(
        "Amplitude of the wave",
        Axis::linear("time [s]"),
        Axis::linear("ln a/a(5 s)"),
    )
    .with(Series::new(
        "linear theory",
        Style::Line,
        [
            (WAVE_FROM_S, 0.0),
            (WAVE_TO_S, expected * (WAVE_TO_S - WAVE_FROM_S)),
        ],
    ))
    .with(Series::new(
        "64 x 128",
        Style::Markers,
        coarse.iter().copied().step_by(10),
    ));
    let mut table = table_of("time_s", &[("log_amplitude_64", &coarse)]);
    if profile != Profile::Quick {
        let fine = amplitudes([128, 256], 0.005)?;
        checks.push(Claim::relative(
            "growth rate on 128 x 256 [1/s]",
            rate(&fine),
            expected,
            0.002,
        ));
        let every: Vec<(f64, f64)> = fine.into_iter().skip(1).step_by(2).collect();
        table = table.float(
            "log_amplitude_128",
            coarse.iter().map(|p| value_at(&every, p.0)),
        );
        plot = plot.with(Series::new("128 x 256", Style::Dash, every));
    }
    Ok(Shown {
        checks,
        table,
        figure: Figure::stacked([plot]),
    })
}

/// Least-squares slope.
fn rate(points: &[(f64, f64)]) -> f64 {
    let count = points.len() as f64;
    let (t, a) = points
        .iter()
        .fold((0.0, 0.0), |s, p| (s.0 + p.0 / count, s.1 + p.1 / count));
    let (above, below) = points.iter().fold((0.0, 0.0), |s, p| {
        (s.0 + (p.0 - t) * (p.1 - a), s.1 + (p.0 - t).powi(2))
    });
    above / below
}

/// Logarithm of the amplitude against time.
fn amplitudes(cells: [usize; 2], step_s: f64) -> Result<Vec<(f64, f64)>, Failure> {
    let case = TollmienSchlichting::new(7500.0, 1.0)?.case(cells, 1.8, 1e-4, step_s)?;
    let (mut flow, _) = case.start()?;
    let (steps, every) = (
        (WAVE_TO_S / step_s).round() as usize,
        (0.1 / step_s).round() as usize,
    );
    let mut points = Vec::new();
    for step in 1..=steps {
        flow.step()?;
        if step % every == 0 && flow.time_s() > WAVE_FROM_S - 0.5 * step_s {
            points.push((flow.time_s(), 0.5 * wave_energy(&flow).ln()));
        }
    }
    let first = points.first().map_or(0.0, |p| p.1);
    Ok(points.into_iter().map(|p| (p.0, p.1 - first)).collect())
}

/// Energy of the first Fourier mode along x of the velocity along z.
fn wave_energy(flow: &Flow) -> f64 {
    let [nx, _, nz] = flow.mesh().cells();
    let (w, face_m) = (flow.face_velocity_m_s(2), flow.mesh().face_m(2));
    let row = |k: usize| {
        let (cos, sin) = (0..nx).fold((0.0, 0.0), |sum, i| {
            let phase = TAU * i as f64 / nx as f64;
            (
                sum.0 + w[k * nx + i] * phase.cos(),
                sum.1 + w[k * nx + i] * phase.sin(),
            )
        });
        0.5 * (face_m[k + 1] - face_m[k - 1]) * (cos * cos + sin * sin)
    };
    (1..nz).map(row).sum()
}

/// A dipole against a wall: enstrophy in time against Clercx and Bruneau (2006) and a spectral code, vorticity at the wall.
pub(super) fn dipole(reynolds: f64, profile: Profile) -> Result<Shown, Failure> {
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
    let [first, second] = literature(reynolds)?;
    let share = if profile == Profile::Quick { 0.1 } else { 0.01 };
    let peak = |i: usize| peaks.get(i).copied().unwrap_or((f64::NAN, f64::NAN));
    let checks = vec![
        Claim::relative(
            "time of the first maximum [s]",
            peak(0).0,
            first.0,
            0.5 * share,
        ),
        Claim::relative("first maximum of the enstrophy", peak(0).1, first.1, share),
        Claim::relative(
            "time of the second maximum [s]",
            peak(1).0,
            second.0,
            0.5 * share,
        ),
        Claim::relative(
            "second maximum of the enstrophy",
            peak(1).1,
            second.1,
            share,
        ),
    ];
    let table = Table::new()
        .float("time_s", history.iter().map(|p| p.0))
        .float("enstrophy_m2_s2", history.iter().map(|p| p.1))
        .float("kinetic_energy_m4_s2", history.iter().map(|p| p.2));
    let mut curve = CurvePlot::new(
        "Enstrophy",
        Axis::linear("time [s]"),
        Axis::linear("enstrophy"),
    )
    .with(Series::new(
        &format!("{cells} x {cells}"),
        Style::Line,
        history.iter().map(|p| (p.0, p.1)),
    ));
    if reynolds == 625.0 {
        let stored = numbers("dipole_wall_re625_history.csv")?;
        curve = curve.with(Series::new(
            "spectral code",
            Style::Dash,
            stored.iter().map(|row| (row[0], row[1])),
        ));
    }
    let curve = curve.with(Series::new(
        "Clercx and Bruneau",
        Style::Markers,
        [first, second],
    ));
    let wall = CurvePlot::new(
        "At the wall, first maximum",
        Axis::linear("y [m]"),
        Axis::linear("vorticity [1/s]"),
    )
    .with(Series::new("", Style::Line, wall));
    Ok(Shown {
        checks,
        table,
        figure: Figure::stacked([curve, wall]),
    })
}

/// Times and values of the two maxima in the literature.
fn literature(reynolds: f64) -> Result<[(f64, f64); 2], Failure> {
    let text = read("tests/reference/les/dipole_wall_normal.csv")?;
    let row = text
        .lines()
        .find(|line| line.starts_with(&format!("{reynolds},")) && line.ends_with("C&B2006"));
    let cells = row.map(|line| {
        line.split(',')
            .filter_map(|cell| cell.trim().parse().ok())
            .collect::<Vec<f64>>()
    });
    match cells.as_deref() {
        Some(&[_, t1, omega1, t2, omega2]) => Ok([(t1, omega1), (t2, omega2)]),
        _ => Err(Failure::new(format!(
            "no row of Reynolds number {reynolds}"
        ))),
    }
}

/// Vorticity at the wall that the dipole meets, z = -1, from the slope of the parabola through the wall.
fn wall_vorticity(flow: &Flow) -> Vec<(f64, f64)> {
    let ny = flow.mesh().cells()[1];
    let (v, z_m) = (flow.face_velocity_m_s(1), flow.mesh().centre_m(2));
    let y_m = flow.mesh().face_m(1);
    let (a, b) = (1.0 + z_m[0], 1.0 + z_m[1]);
    // The vorticity is -dv/dz at the wall, where v is zero.
    let slope = |j: usize| (v[j] * b * b - v[ny + j] * a * a) / (a * b * (b - a));
    (0..ny)
        .map(|j| (y_m[j], -slope(j)))
        .filter(|p| p.0.abs() < 0.6)
        .collect()
}

/// Extrema of Botella and Peyret: velocity along the lid's direction on the vertical centre line, and across on the other.
const U_MIN: (f64, f64) = (0.1717, -0.388_569_8);
const V_MAX: (f64, f64) = (0.1578, 0.376_944_7);
const V_MIN: (f64, f64) = (0.9092, -0.527_077_1);

/// The lid-driven cavity at Re 1000 against Ghia, Ghia and Shin (1982) and Botella and Peyret (1998).
pub(super) fn cavity(profile: Profile) -> Result<Shown, Failure> {
    let (cells, end_s) = if profile == Profile::Quick {
        (48, 40.0)
    } else {
        (128, 60.0)
    };
    let (mut flow, _) = cases::lid_driven_cavity(cells, 1.5, 1000.0)?.start()?;
    flow.run_to(end_s)?;
    let (centre_y, centre_z) = (flow.mesh().centre_m(1), flow.mesh().centre_m(2));
    let (v, w) = (flow.face_velocity_m_s(1), flow.face_velocity_m_s(2));
    // The mesh is symmetric: face `cells/2` lies at 0.5.
    let column: Vec<(f64, f64)> = (0..cells)
        .map(|k| (centre_z[k], v[k * cells + cells / 2]))
        .collect();
    let row: Vec<(f64, f64)> = (0..cells)
        .map(|j| (centre_y[j], w[cells / 2 * cells + j]))
        .collect();
    let share = if profile == Profile::Quick {
        0.05
    } else {
        0.002
    };
    let (u_min, v_max, v_min) = (
        extremum(&column, -1.0),
        extremum(&row, 1.0),
        extremum(&row, -1.0),
    );
    let mut checks = Vec::new();
    for (name, found, expected) in [
        ("least u", u_min, U_MIN),
        ("largest v", v_max, V_MAX),
        ("least v", v_min, V_MIN),
    ] {
        checks.push(Claim::relative(name, found.1, expected.1, share));
        checks.push(Claim::relative(
            &format!("place of the {name}"),
            found.0,
            expected.0,
            2.0 * share,
        ));
    }
    let stored = numbers("ghia_cavity_u.csv")?;
    let ghia: Vec<(f64, f64)> = stored.iter().map(|r| (r[0], r[3])).collect();
    let table = table_of(
        "position_m",
        &[
            ("u_on_vertical_m_s", &column),
            ("v_on_horizontal_m_s", &row),
        ],
    );
    let plot = CurvePlot::new(
        "Centre lines",
        Axis::linear("position [m]"),
        Axis::linear("velocity [m/s]"),
    )
    .with(Series::new("u, vertical line", Style::Line, column))
    .with(Series::new("v, horizontal line", Style::Dash, row))
    .with(Series::new("u, Ghia et al.", Style::Markers, ghia))
    .with(Series::new(
        "extrema, Botella and Peyret",
        Style::Markers,
        [U_MIN, V_MAX, V_MIN],
    ));
    Ok(Shown {
        checks,
        table,
        figure: Figure::stacked([plot]),
    })
}

fn extremum(points: &[(f64, f64)], sign: f64) -> (f64, f64) {
    let best = (1..points.len() - 1)
        .max_by(|&a, &b| (sign * points[a].1).total_cmp(&(sign * points[b].1)))
        .unwrap_or(1);
    parabola_vertex([points[best - 1], points[best], points[best + 1]])
}

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

/// The vortices of Taylor and Green at Re 1600: direct simulation against a stored one, and the subgrid models.
pub(super) fn turbulent_vortices(profile: Profile) -> Result<Shown, Failure> {
    let stored: Vec<(f64, f64)> = numbers("tgv_re1600_dns.csv")?
        .iter()
        .map(|r| (r[0], r[2]))
        .collect();
    let peak = stored.iter().map(|p| p.1).fold(0.0, f64::max);
    let (fine, coarse) = if profile == Profile::Quick {
        (64, 32)
    } else {
        (128, 64)
    };
    let mut plot = CurvePlot::new(
        "Loss of energy, Re 1600",
        Axis::linear("time [s]"),
        Axis::linear("-dE/dt [m²/s³]"),
    )
    .with(Series::new(
        "stored simulation, 512^3",
        Style::Line,
        stored.iter().copied().filter(|p| p.0 <= END_S),
    ));
    let mut table = Table::new().float("time_s", (1..OUTPUTS).map(|i| EVERY_S * i as f64));
    let mut errors = Vec::new();
    let fine_models = [MODELS[0], MODELS[3]].map(|model| (fine, model));
    for (cells, (name, model)) in fine_models
        .into_iter()
        .chain(MODELS.map(|model| (coarse, model)))
    {
        let curve = dissipation(cells, model)?;
        errors.push(error(&curve, &stored, peak));
        table = table.float(
            &format!("dissipation_{cells}_{}", name.replace(' ', "_")),
            curve.iter().map(|p| p.1),
        );
        let style = if cells == fine {
            Style::Dash
        } else {
            Style::DashDot
        };
        plot = plot.with(Series::new(&format!("{cells}^3, {name}"), style, curve));
    }
    let bar = if profile == Profile::Quick { 0.1 } else { 0.02 };
    let mut checks = vec![
        Claim::at_most(
            &format!("{fine}^3, no model: rms error over peak"),
            errors[0],
            bar,
        ),
        Claim::at_most(
            &format!("{fine}^3, multiscale: rms error over peak"),
            errors[1],
            bar,
        ),
    ];
    for (i, (name, _)) in MODELS.iter().enumerate().skip(1) {
        checks.push(Claim::at_most(
            &format!("{coarse}^3: {name} against no model"),
            errors[2 + i],
            errors[2],
        ));
    }
    checks.push(Claim::at_most(
        &format!("{coarse}^3: multiscale against WALE 0.5"),
        errors[5],
        errors[3],
    ));
    checks.push(Claim::at_most(
        &format!("{coarse}^3: multiscale against WALE 0.325"),
        errors[5],
        errors[4],
    ));
    Ok(Shown {
        checks,
        table,
        figure: Figure::stacked([plot]),
    })
}

fn error(curve: &[(f64, f64)], stored: &[(f64, f64)], peak: f64) -> f64 {
    let squares: f64 = curve
        .iter()
        .map(|p| (p.1 - value_at(stored, p.0)).powi(2))
        .sum();
    (squares / curve.len() as f64).sqrt() / peak
}

/// Loss of energy per volume and time, by central differences of the energy, of the eighth of the box that symmetry leaves.
fn dissipation(cells: usize, model: SubgridModel) -> Result<Vec<(f64, f64)>, Failure> {
    let mut case = cases::taylor_green_eighth(cells / 2, 1600.0)?;
    case.settings.subgrid = model;
    let (mut flow, _) = case.start()?;
    let volume = PI.powi(3);
    let mut energy = vec![flow.kinetic_energy_m5_s2() / volume];
    for output in 1..=OUTPUTS {
        flow.run_to(EVERY_S * output as f64)?;
        energy.push(flow.kinetic_energy_m5_s2() / volume);
    }
    let slope = |i: usize| (energy[i - 1] - energy[i + 1]) / (2.0 * EVERY_S);
    Ok((1..OUTPUTS)
        .map(|i| (EVERY_S * i as f64, slope(i)))
        .collect())
}

const REYNOLDS_TAU: f64 = 178.12;
/// Averages are taken from here on, in half heights over friction velocity.
const MEAN_FROM_S: f64 = 10.0;
const MEAN_TO_S: f64 = 20.0;

/// Turbulent channel flow at Re_tau 178 against Moser, Kim and Mansour (1999): the longest of the cases.
pub(super) fn channel() -> Result<Shown, Failure> {
    let cells = [48, 48, 64];
    let mut case = cases::channel(cells, 1.8, REYNOLDS_TAU)?;
    case.settings.subgrid = SubgridModel::MULTISCALE_WALE;
    let (mut flow, _) = case.start()?;
    let per_plane = cells[0] * cells[1];
    let mut mean = vec![0.0; cells[2]];
    let (mut samples, mut next_s) = (0.0, MEAN_FROM_S);
    while flow.time_s() < MEAN_TO_S {
        flow.step()?;
        if flow.time_s() >= next_s {
            for (sum, plane) in mean
                .iter_mut()
                .zip(flow.face_velocity_m_s(0).chunks(per_plane))
            {
                *sum += plane.iter().sum::<f64>() / per_plane as f64;
            }
            samples += 1.0;
            next_s += 0.02;
        }
    }
    let half = cells[2] / 2;
    let z_m = flow.mesh().centre_m(2);
    let at = |k: usize| 0.5 * (mean[k] + mean[cells[2] - 1 - k]) / samples;
    let profile: Vec<(f64, f64)> = (0..half)
        .map(|k| ((1.0 + z_m[k]) * REYNOLDS_TAU, at(k)))
        .collect();
    let stored: Vec<(f64, f64)> = numbers("channel_retau180_mean.csv")?
        .iter()
        .map(|r| (r[0], r[1]))
        .collect();
    let worst = stored
        .iter()
        .map(|p| (value_at(&profile, p.0) / p.1 - 1.0).abs())
        .fold(0.0, f64::max);
    let checks = vec![Claim::at_most(
        "largest error of the mean velocity, relative",
        worst,
        0.05,
    )];
    let table = table_of("z_plus", &[("mean_velocity_plus", &profile)]);
    let plot = CurvePlot::new(
        "Mean velocity, Re_tau 178",
        Axis::log("z+"),
        Axis::linear("U+"),
    )
    .with(Series::new(
        "48 x 48 x 64, multiscale model",
        Style::Line,
        profile,
    ))
    .with(Series::new(
        "Moser, Kim and Mansour",
        Style::Markers,
        stored,
    ));
    Ok(Shown {
        checks,
        table,
        figure: Figure::stacked([plot]),
    })
}

/// The extremum of the parabola through three points.
fn parabola_vertex([a, b, c]: [(f64, f64); 3]) -> (f64, f64) {
    let (left, right) = ((b.1 - a.1) / (b.0 - a.0), (c.1 - b.1) / (c.0 - b.0));
    let bend = (right - left) / (c.0 - a.0);
    let x = 0.5 * (a.0 + b.0) - left / (2.0 * bend);
    (x, a.1 + left * (x - a.0) + bend * (x - a.0) * (x - b.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_vertex_of_a_parabola_is_found_from_uneven_points() {
        let (x, y) =
            parabola_vertex([0.0, 1.0, 4.0].map(|x: f64| (x, 3.0 - 2.0 * (x - 1.5).powi(2))));
        assert!((x - 1.5).abs() < 1e-12 && (y - 3.0).abs() < 1e-12);
    }
}
