//! What detection writes: a row for each scan, and the curves of its geometry and background.

use super::scan_turbulence::with_turbulence;
use super::{FoundShare, Power, ScanDetection};
use crate::io::Table;
use crate::io::scans::ReadScan;
use wakescope_estimate::vortex_fit::{Vortex, Wake};

/// The table of scans, with the time of the first line of each. A vortex that the best wake lacks has no place.
#[must_use]
pub fn scan_table(scans: &[ReadScan], found: &[ScanDetection]) -> Table {
    let times_s = scans.iter().map(|scan| {
        let times_s = scan.map.time_s.iter().copied();
        times_s.fold(f64::NAN, f64::min)
    });
    let sweeps = scans.iter().map(|scan| scan.sweep as i64);
    let wakes = found.iter().map(|f| i64::from(f.is_wake()));
    let statistics = found.iter().map(|f| f.statistic.value);
    let thresholds = found.iter().map(|f| f.threshold);
    let false_alarms = found.iter().map(|f| f.false_alarm);
    let table = Table::new()
        .text("file", scans.iter().map(ReadScan::file_name))
        .int("sweep", sweeps)
        .float("time_s", times_s)
        .int("wake", wakes)
        .float("statistic", statistics)
        .float("threshold", thresholds)
        .float("false_alarm", false_alarms);
    let table = with_background(with_wakes(table, found), found);
    with_turbulence(table, found.iter().map(|f| f.turbulence))
}

/// Adds the best wake of each scan.
fn with_wakes(table: Table, found: &[ScanDetection]) -> Table {
    let circulations = found.iter().map(|f| {
        let Wake { left, right, .. } = f.statistic.wake;
        left.circulation_m2_s.max(right.circulation_m2_s)
    });
    let lefts: Vec<Vortex> = found.iter().map(|f| f.statistic.wake.left).collect();
    let rights: Vec<Vortex> = found.iter().map(|f| f.statistic.wake.right).collect();
    let deviations = found.iter().map(|f| f.statistic.circulation_std_m2_s);
    table
        .float("gamma_m2_s", circulations)
        .float("gamma_std_m2_s", deviations)
        .float("y_left_m", of_existing(&lefts, |v| v.lateral_position_m))
        .float("z_left_m", of_existing(&lefts, |v| v.height_m))
        .float("y_right_m", of_existing(&rights, |v| v.lateral_position_m))
        .float("z_right_m", of_existing(&rights, |v| v.height_m))
}

/// A coordinate of each vortex, NaN for one without circulation.
fn of_existing(vortices: &[Vortex], coordinate: fn(&Vortex) -> f64) -> Vec<f64> {
    let mut coordinates = Vec::with_capacity(vortices.len());
    for vortex in vortices {
        let exists = vortex.circulation_m2_s > 0.0;
        coordinates.push(if exists { coordinate(vortex) } else { f64::NAN });
    }
    coordinates
}

/// Adds the velocities of each scan, how well wind and wake explain them, and the law of empty scans.
fn with_background(table: Table, found: &[ScanDetection]) -> Table {
    let wind_chi2 = found.iter().map(|f| f.statistic.wind_chi2_per_dof);
    let wake_chi2 = found.iter().map(|f| f.statistic.wake_chi2_per_dof);
    let assumed_sigmas = found
        .iter()
        .map(|f| f.assumed_sigma_m_s.unwrap_or(f64::NAN));
    let velocities = found.iter().map(|f| f.velocities as i64);
    let outliers = found.iter().map(|f| f.outliers as i64);
    let (along, across): (Vec<f64>, Vec<f64>) = found
        .iter()
        .map(|f| f.statistic.neighbour_correlation)
        .unzip();
    let (mu, beta): (Vec<f64>, Vec<f64>) = found.iter().map(|f| f.gumbel).unzip();
    table
        .float("chi2_per_dof_wind", wind_chi2)
        .float("chi2_per_dof_wake", wake_chi2)
        .int("velocities", velocities)
        .int("outliers", outliers)
        .float("assumed_sigma_m_s", assumed_sigmas)
        .float("correlation_along", along)
        .float("correlation_across", across)
        .float("gumbel_mu", mu)
        .float("gumbel_beta", beta)
}

/// Shares of wakes found: `gamma_m2_s,gamma_over_std,false_alarm,threshold,detection,standard_error`, at one rate without its threshold.
#[must_use]
pub fn share_table(power: &Power, shares: &[FoundShare], is_one_rate: bool) -> Table {
    let mut table = Table::new()
        .float("gamma_m2_s", shares.iter().map(|row| row.0))
        .float(
            "gamma_over_std",
            shares.iter().map(|row| row.0 / power.circulation_std_m2_s),
        )
        .float("false_alarm", shares.iter().map(|row| row.1));
    if !is_one_rate {
        table = table.float("threshold", shares.iter().map(|row| row.2));
    }
    table
        .float("detection", shares.iter().map(|row| row.3.value))
        .float("standard_error", shares.iter().map(|row| row.3.std))
}
