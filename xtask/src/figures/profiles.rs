//! Errors along the lines of sight that pass a core, against the range from its centre: figures 13 and 14.

use super::study::{INSIDE_M, Study};
use crate::Failure;
use wakescope_sim::io::Table;
use wakescope_sim::measure::cell_average::CellAverage;
use wakescope_sim::plot::{Axis, CurvePlot, Series, Style};

/// Lines of sight count that pass a centre within this distance, m.
const CORE_M: f64 = 4.0;
/// Ranges from the centre that are kept, m; those beyond the second number are the edges.
const REACH_M: f64 = 42.0;
const EDGE_M: f64 = 32.0;

/// The profile of one method.
pub(super) struct Profiles {
    pub(super) method: &'static str,
    /// Reference of the signal-to-noise ratio.
    pub(super) name: &'static str,
    pub(super) pulse_s: f64,
    /// Mean ratio at the vortices, dB.
    pub(super) snr_db: f64,
    pub(super) gate_m: f64,
    /// Range from the centre, m, increasing, and the errors there, both vortices together.
    pub(super) range_m: Vec<f64>,
    pub(super) errors: Vec<CellAverage>,
    /// Over all cells inside the vortices.
    pub(super) inside: CellAverage,
}

impl Profiles {
    pub(super) fn of(method: &'static str, name: &'static str, study: &Study) -> Result<Self, Failure> {
        let map = &study.map;
        let gate_m = map.range_m[1] - map.range_m[0];
        let bins = (REACH_M / gate_m) as i64;
        let mut range_m = Vec::new();
        let mut errors = Vec::new();
        let cores = study.cores_polar();
        let middle_m = cores.iter().map(|c| c.0).sum::<f64>() / cores.len() as f64;
        for bin in -bins..=bins {
            let mut cells = Vec::new();
            for &(core_m, elevation_rad) in &cores {
                // Beyond the middle the line comes near the other vortex.
                let inwards_m = bin as f64 * gate_m * (middle_m - core_m).signum();
                if inwards_m > (middle_m - core_m).abs() {
                    continue;
                }
                let lines = map.elevation_rad.iter().enumerate();
                let near = lines.filter(|(_, el)| ((*el - elevation_rad) * core_m).abs() < CORE_M).map(|(i, _)| i);
                let place = ((core_m - map.range_m[0]) / gate_m).round() as i64 + bin;
                if place >= 0 && (place as usize) < map.range_m.len() {
                    cells.extend(near.map(|i| (i, place as usize)));
                }
            }
            range_m.push(bin as f64 * gate_m);
            errors.push(study.over_profile(&cells));
        }
        Ok(Self {
            method,
            name,
            pulse_s: study.plan.scene.scene.pulse_width_s(),
            snr_db: snr_db(study)?,
            gate_m,
            range_m,
            errors,
            inside: study.over(|d| d < INSIDE_M),
        })
    }

    /// Batches of the same scene as one.
    pub(super) fn joined(batches: &[Self]) -> Result<Self, Failure> {
        let first = batches.first().ok_or_else(|| Failure::new("no batch of scans".into()))?;
        let errors =
            (0..first.errors.len()).map(|k| CellAverage::joined(batches.iter().map(|b| b.errors[k]))).collect();
        let inside = CellAverage::joined(batches.iter().map(|b| b.inside));
        Ok(Self { range_m: first.range_m.clone(), errors, inside, ..*first })
    }

    pub(super) fn title(&self) -> String {
        format!("{} {:.1} dB, {:.0} ns", self.name, self.snr_db, 1e9 * self.pulse_s)
    }
}

/// Mean signal-to-noise ratio of the scene at the vortices, dB.
fn snr_db(study: &Study) -> Result<f64, Failure> {
    let scanner = wakescope_sim::measure::scan::Scanner::new(&study.plan, &wakescope_sim::measure::progress::Silent)?;
    let near: Vec<f64> =
        scanner.layer_snr().into_iter().filter(|(r, _)| (350.0..450.0).contains(r)).map(|(_, snr)| snr).collect();
    Ok(10.0 * (near.iter().sum::<f64>() / near.len() as f64).log10())
}

/// Median error at the edges: the mean evolution without a vortex, m/s.
pub(super) fn edge_level(p: &Profiles) -> f64 {
    let mut edge: Vec<f64> =
        p.range_m.iter().zip(&p.errors).filter(|(r, _)| r.abs() > EDGE_M).map(|(_, e)| e.rms_m_s).collect();
    edge.retain(|e| e.is_finite());
    edge.sort_by(f64::total_cmp);
    edge.get(edge.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Largest error above the edges and its standard error, m/s.
pub(super) fn peak(p: &Profiles) -> (f64, f64) {
    let top = p.errors.iter().max_by(|a, b| a.rms_m_s.total_cmp(&b.rms_m_s));
    top.map_or((f64::NAN, f64::NAN), |t| (t.rms_m_s - edge_level(p), t.standard_error_m_s))
}

/// Full width at half maximum of the error above the edges, m; straight lines between the gates.
pub(super) fn width_m(p: &Profiles) -> f64 {
    let level = edge_level(p);
    let half = 0.5 * peak(p).0;
    let above: Vec<f64> = p.errors.iter().map(|e| e.rms_m_s - level - half).collect();
    let crossing = |k: usize| p.range_m[k] + p.gate_m * above[k] / (above[k] - above[k + 1]);
    let crossings: Vec<f64> =
        (0..above.len() - 1).filter(|&k| (above[k] < 0.0) != (above[k + 1] < 0.0)).map(crossing).collect();
    match (crossings.first(), crossings.last()) {
        (Some(first), Some(last)) if crossings.len() > 1 => last - first,
        _ => f64::NAN,
    }
}

/// All profiles as one table.
pub(super) fn table(all: &[&Profiles]) -> Table {
    let rows: Vec<(&Profiles, usize)> = all.iter().flat_map(|&p| (0..p.range_m.len()).map(move |k| (p, k))).collect();
    let of = |get: fn(&CellAverage) -> f64| rows.iter().map(move |(p, k)| get(&p.errors[*k])).collect::<Vec<_>>();
    Table::new()
        .text("method", rows.iter().map(|(p, _)| p.method))
        .float("pulse_s", rows.iter().map(|(p, _)| p.pulse_s))
        .text("snr_reference", rows.iter().map(|(p, _)| p.name))
        .float("snr_db", rows.iter().map(|(p, _)| p.snr_db))
        .float("range_from_centre_m", rows.iter().map(|(p, k)| p.range_m[*k]))
        .float("bias_m_s", of(|a| a.bias_m_s))
        .float("std_m_s", of(|a| a.std_m_s))
        .float("rms_m_s", of(|a| a.rms_m_s))
        .float("standard_error_m_s", of(|a| a.standard_error_m_s))
        .float("rms_above_edges_m_s", rows.iter().map(|(p, k)| p.errors[*k].rms_m_s - edge_level(p)))
}

/// Curves of some profiles, less their level at the edges.
pub(super) fn plot(title: &str, profiles: &[&Profiles]) -> CurvePlot {
    let mut plot = CurvePlot::new(title, Axis::linear("range from the vortex centre [m]"), Axis::linear("error [m/s]"));
    let styles = [Style::Line, Style::DashDot, Style::Dash, Style::Dot];
    plot.series = profiles
        .iter()
        .zip(styles)
        .map(|(p, style)| {
            let level = edge_level(p);
            let points = p.range_m.iter().copied().zip(p.errors.iter().map(|e| e.rms_m_s - level));
            let band: Vec<f64> = p.errors.iter().map(|e| e.standard_error_m_s).collect();
            Series::new(&format!("{}, {:.0} ns", p.method, 1e9 * p.pulse_s), style, points).with_band(&band)
        })
        .collect();
    plot
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A Gaussian of height 2 and standard deviation 8 m on a level of 0.5.
    fn bell() -> Profiles {
        let range_m: Vec<f64> = (-14..=14).map(|k| 3.0 * f64::from(k)).collect();
        let average = |r: &f64| CellAverage {
            bias_m_s: 0.0,
            bias_standard_error_m_s: 0.0,
            std_m_s: 0.0,
            std_standard_error_m_s: 0.0,
            rms_m_s: 0.5 + 2.0 * (-0.5 * (r / 8.0).powi(2)).exp(),
            standard_error_m_s: 0.1,
        };
        let errors: Vec<CellAverage> = range_m.iter().map(average).collect();
        let inside = errors[14];
        Profiles { method: "PA", name: "fixed", pulse_s: 2e-7, snr_db: 0.0, gate_m: 3.0, range_m, errors, inside }
    }

    #[test]
    fn peak_and_width_of_a_bell_on_a_level() {
        let p = bell();
        assert!((edge_level(&p) - 0.5).abs() < 1e-3);
        assert!((peak(&p).0 - 2.0).abs() < 1e-3);
        assert!((width_m(&p) - 8.0 * 2.354_82).abs() < 0.3, "{}", width_m(&p));
    }
}
