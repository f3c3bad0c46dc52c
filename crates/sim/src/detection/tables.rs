//! What detection writes: a row for each scan, and the curves of its geometry and background.

use super::{FoundShare, Power, ScanDetection};
use crate::io::Table;
use crate::io::scans::ReadScan;

/// The table of scans, with the time of the first line of each. A vortex that the best wake lacks has no place.
#[must_use]
pub fn scan_table(scans: &[ReadScan], found: &[ScanDetection]) -> Table {
    let time_s = |scan: &ReadScan| scan.map.time_s.iter().copied().fold(f64::NAN, f64::min);
    let column = |get: &dyn Fn(&ScanDetection) -> f64| found.iter().map(get).collect::<Vec<_>>();
    let side = |get: &dyn Fn(&ScanDetection) -> (f64, f64)| {
        found
            .iter()
            .map(|f| {
                Some(get(f))
                    .filter(|(c, _)| *c > 0.0)
                    .map_or(f64::NAN, |(_, x)| x)
            })
            .collect::<Vec<_>>()
    };
    let left = |f: &ScanDetection| f.statistic.wake.left;
    let right = |f: &ScanDetection| f.statistic.wake.right;
    Table::new()
        .text("file", scans.iter().map(ReadScan::file_name))
        .int("sweep", scans.iter().map(|scan| scan.sweep as i64))
        .float("time_s", scans.iter().map(time_s))
        .int("wake", found.iter().map(|f| i64::from(f.is_wake())))
        .float("statistic", column(&|f| f.statistic.value))
        .float("threshold", column(&|f| f.threshold))
        .float("false_alarm", column(&|f| f.false_alarm))
        .float(
            "gamma_m2_s",
            column(&|f| left(f).circulation_m2_s.max(right(f).circulation_m2_s)),
        )
        .float(
            "gamma_std_m2_s",
            column(&|f| f.statistic.circulation_std_m2_s),
        )
        .float(
            "y_left_m",
            side(&|f| (left(f).circulation_m2_s, left(f).lateral_position_m)),
        )
        .float(
            "z_left_m",
            side(&|f| (left(f).circulation_m2_s, left(f).height_m)),
        )
        .float(
            "y_right_m",
            side(&|f| (right(f).circulation_m2_s, right(f).lateral_position_m)),
        )
        .float(
            "z_right_m",
            side(&|f| (right(f).circulation_m2_s, right(f).height_m)),
        )
        .float(
            "chi2_per_dof_wind",
            column(&|f| f.statistic.wind_chi2_per_dof),
        )
        .float(
            "chi2_per_dof_wake",
            column(&|f| f.statistic.wake_chi2_per_dof),
        )
        .int("velocities", found.iter().map(|f| f.velocities as i64))
        .int("outliers", found.iter().map(|f| f.outliers as i64))
        .float(
            "assumed_sigma_m_s",
            column(&|f| f.assumed_sigma_m_s.unwrap_or(f64::NAN)),
        )
        .float(
            "correlation_along",
            column(&|f| f.statistic.neighbour_correlation.0),
        )
        .float(
            "correlation_across",
            column(&|f| f.statistic.neighbour_correlation.1),
        )
        .float("gumbel_mu", column(&|f| f.gumbel.0))
        .float("gumbel_beta", column(&|f| f.gumbel.1))
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
