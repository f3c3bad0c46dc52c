//! Growth of Tollmien-Schlichting waves at Re 7500, alpha 1, against linear theory.

use super::shown::Shown;
use crate::claim::Claim;
use crate::profile::Profile;
use crate::references::numbers;
use fixtures::failure::Failure;
use std::f64::consts::TAU;
use wakescope_les::Flow;
use wakescope_les::analysis::decay::value_at;
use wakescope_les::cases::TollmienSchlichting;
use wakescope_sim::io::Table;
use wakescope_sim::plot::{Axis, CurvePlot, Figure, Series, Style};

/// The wave is followed from here, when what is not the wave has died, to the end.
const FROM_S: f64 = 5.0;
const TO_S: f64 = 25.0;

pub(super) fn show(profile: Profile) -> Result<Shown, Failure> {
    let stored = numbers("orr_sommerfeld.csv")?;
    let expected = stored.first().and_then(|row| row.get(3)).copied().unwrap_or(f64::NAN);
    let coarse = amplitudes([64, 128], 0.01)?;
    let mut checks = vec![Claim::relative("growth rate on 64 x 128 [1/s]", rate(&coarse), expected, 0.01)];
    let mut plot = CurvePlot::new("Amplitude of the wave", Axis::linear("time [s]"), Axis::linear("ln a/a(5 s)"))
        .with(Series::new("linear theory", Style::Line, [(FROM_S, 0.0), (TO_S, expected * (TO_S - FROM_S))]))
        .with(Series::new("64 x 128", Style::Markers, coarse.iter().copied().step_by(10)));
    let mut table =
        Table::new().float("time_s", coarse.iter().map(|p| p.0)).float("log_amplitude_64", coarse.iter().map(|p| p.1));
    if profile != Profile::Quick {
        let fine = amplitudes([128, 256], 0.005)?;
        checks.push(Claim::relative("growth rate on 128 x 256 [1/s]", rate(&fine), expected, 0.002));
        let every: Vec<(f64, f64)> = fine.into_iter().skip(1).step_by(2).collect();
        table = table.float("log_amplitude_128", coarse.iter().map(|p| value_at(&every, p.0)));
        plot = plot.with(Series::new("128 x 256", Style::Dash, every));
    }
    Ok(Shown { checks, table, figure: Figure::stacked([plot]) })
}

/// Least-squares slope.
fn rate(points: &[(f64, f64)]) -> f64 {
    let count = points.len() as f64;
    let (t, a) = points.iter().fold((0.0, 0.0), |s, p| (s.0 + p.0 / count, s.1 + p.1 / count));
    let (above, below) = points.iter().fold((0.0, 0.0), |s, p| (s.0 + (p.0 - t) * (p.1 - a), s.1 + (p.0 - t).powi(2)));
    above / below
}

/// Logarithm of the amplitude against time.
fn amplitudes(cells: [usize; 2], step_s: f64) -> Result<Vec<(f64, f64)>, Failure> {
    let case = TollmienSchlichting::new(7500.0, 1.0)?.case(cells, 1.8, 1e-4, step_s)?;
    let (mut flow, _) = case.start()?;
    let (steps, every) = ((TO_S / step_s).round() as usize, (0.1 / step_s).round() as usize);
    let mut points = Vec::new();
    for step in 1..=steps {
        flow.step()?;
        if step % every == 0 && flow.time_s() > FROM_S - 0.5 * step_s {
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
            (sum.0 + w[k * nx + i] * phase.cos(), sum.1 + w[k * nx + i] * phase.sin())
        });
        0.5 * (face_m[k + 1] - face_m[k - 1]) * (cos * cos + sin * sin)
    };
    (1..nz).map(row).sum()
}
