//! Turbulent channel flow at Re_tau 178 against Moser, Kim and Mansour (1999): the longest of the cases.

use super::shown::Shown;
use crate::claim::Claim;
use crate::profile::Profile;
use crate::references::numbers;
use fixtures::failure::Failure;
use wakescope_les::analysis::decay::value_at;
use wakescope_les::{SubgridModel, cases};
use wakescope_sim::io::Table;
use wakescope_sim::plot::{Axis, CurvePlot, Figure, Series, Style};

const REYNOLDS_TAU: f64 = 178.12;
/// Averages are taken from here on, in half heights over friction velocity.
const FROM_S: f64 = 10.0;
const TO_S: f64 = 20.0;

pub(super) fn show(_: Profile) -> Result<Shown, Failure> {
    let cells = [48, 48, 64];
    let mut case = cases::channel(cells, 1.8, REYNOLDS_TAU)?;
    case.settings.subgrid = SubgridModel::MULTISCALE_WALE;
    let (mut flow, _) = case.start()?;
    let per_plane = cells[0] * cells[1];
    let mut mean = vec![0.0; cells[2]];
    let (mut samples, mut next_s) = (0.0, FROM_S);
    while flow.time_s() < TO_S {
        flow.step()?;
        if flow.time_s() >= next_s {
            for (sum, plane) in mean.iter_mut().zip(flow.face_velocity_m_s(0).chunks(per_plane)) {
                *sum += plane.iter().sum::<f64>() / per_plane as f64;
            }
            samples += 1.0;
            next_s += 0.02;
        }
    }
    let half = cells[2] / 2;
    let z_m = flow.mesh().centre_m(2);
    let at = |k: usize| 0.5 * (mean[k] + mean[cells[2] - 1 - k]) / samples;
    let profile: Vec<(f64, f64)> = (0..half).map(|k| ((1.0 + z_m[k]) * REYNOLDS_TAU, at(k))).collect();
    let stored: Vec<(f64, f64)> = numbers("channel_retau180_mean.csv")?.iter().map(|r| (r[0], r[1])).collect();
    let worst = stored.iter().map(|p| (value_at(&profile, p.0) / p.1 - 1.0).abs()).fold(0.0, f64::max);
    let checks = vec![Claim::at_most("largest error of the mean velocity, relative", worst, 0.05)];
    let table = Table::new()
        .float("z_plus", profile.iter().map(|p| p.0))
        .float("mean_velocity_plus", profile.iter().map(|p| p.1));
    let plot = CurvePlot::new("Mean velocity, Re_tau 178", Axis::log("z+"), Axis::linear("U+"))
        .with(Series::new("48 x 48 x 64, multiscale model", Style::Line, profile))
        .with(Series::new("Moser, Kim and Mansour", Style::Markers, stored));
    Ok(Shown { checks, table, figure: Figure::stacked([plot]) })
}
