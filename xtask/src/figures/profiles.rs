//! Errors of one method about the vortices: inside, outside against range, and along the lines of sight that pass a core. Figures 13, 14
//! and 25.
//!
//! Outside the error changes with the signal-to-noise ratio along the line: a straight line in range, each gate with the weight of its
//! estimates, which is taken away.

use super::context::*;
use super::study::{INSIDE_M, METHODS, OUTSIDE_M, Study, Zone};
use wakescope_sim::measure::cell_average::CellAverage;

/// Lines of sight count that pass a centre within this distance, m.
const CORE_M: f64 = 4.0;
/// Ranges from the centre that are kept, m.
const REACH_M: f64 = 42.0;

/// The errors of one method in one case.
pub(super) struct Profiles {
    pub(super) method: &'static str,
    /// Reference of the signal-to-noise ratio.
    pub(super) name: &'static str,
    pub(super) pulse_s: f64,
    /// Mean ratio at the vortices, dB.
    pub(super) snr_db: f64,
    pub(super) inside: Zone,
    pub(super) outside: Zone,
    /// Gate by gate, outside.
    evolution: Vec<Zone>,
    /// Range from the centre, m, increasing, and the errors there, both vortices together.
    across: Vec<(f64, Zone)>,
}

impl Profiles {
    /// From a map, with the mean ratio at the vortices.
    pub(super) fn of(method: &'static str, name: &'static str, snr_db: f64, study: &Study) -> Self {
        let map = &study.map;
        let gate_m = map.range_m[1] - map.range_m[0];
        let bins = (REACH_M / gate_m) as i64;
        let cores = study.cores_polar();
        let middle_m = cores.iter().map(|c| c.0).sum::<f64>() / cores.len() as f64;
        let mut across = Vec::new();
        for bin in -bins..=bins {
            let mut cells = Vec::new();
            for &(core_m, elevation_rad) in &cores {
                // Beyond the middle the line comes near the other vortex.
                let inwards_m = bin as f64 * gate_m * (middle_m - core_m).signum();
                if inwards_m > (middle_m - core_m).abs() {
                    continue;
                }
                let gate = ((core_m - map.range_m[0]) / gate_m).round() as i64 + bin;
                if gate < 0 || gate as usize >= map.range_m.len() {
                    continue;
                }
                for (line, line_rad) in map.elevation_rad.iter().enumerate() {
                    if ((line_rad - elevation_rad) * core_m).abs() < CORE_M {
                        cells.push((line, gate as usize));
                    }
                }
            }
            across.push((bin as f64 * gate_m, study.zone(&cells)));
        }
        let mut evolution = Vec::new();
        for gate in 0..map.range_m.len() {
            let cells = study.cells(|d, j| d > OUTSIDE_M && j == gate);
            if !cells.is_empty() {
                evolution.push(study.zone(&cells));
            }
        }
        Self {
            method,
            name,
            pulse_s: study.plan.scene().pulse_width_s(),
            snr_db,
            inside: study.zone(&study.cells(|d, _| d < INSIDE_M)),
            outside: study.zone(&study.cells(|d, _| d > OUTSIDE_M)),
            evolution,
            across,
        }
    }

    pub(super) fn title(&self) -> String {
        format!(
            "{} {:.1} dB, {:.0} ns",
            self.name,
            self.snr_db,
            1e9 * self.pulse_s
        )
    }

    /// The error at a mean range less what it is outside there, without one batch, m/s.
    pub(super) fn excess_m_s(&self, zone: &Zone, without: Option<usize>) -> f64 {
        let mut outside = Vec::new();
        for gate in &self.evolution {
            let (_, estimates) = gate.sums(without);
            if estimates > 0.0 {
                outside.push([gate.range_m, gate.rms_m_s(without), estimates]);
            }
        }
        zone.rms_m_s(without) - on_line(&outside, zone.range_m)
    }

    /// The same along the lines that pass a core.
    pub(super) fn across_m_s(&self, without: Option<usize>) -> Vec<(f64, f64)> {
        self.across
            .iter()
            .map(|(range_m, zone)| (*range_m, self.excess_m_s(zone, without)))
            .collect()
    }

    /// Its mean within [`INSIDE_M`] of a centre along those lines.
    pub(super) fn near_core_m_s(&self, without: Option<usize>) -> f64 {
        let mut near = Vec::new();
        for (range_m, value) in self.across_m_s(without) {
            if range_m.abs() <= INSIDE_M {
                near.push(value);
            }
        }
        near.iter().sum::<f64>() / near.len() as f64
    }

    /// The batches of the zones of a named case that claims are about.
    pub(super) fn regions(&self, case: &str) -> [Table; 2] {
        let case = format!("{}; {case}", self.method);
        [
            self.inside.batches(&case, "inside", f64::NAN),
            self.outside.batches(&case, "outside", f64::NAN),
        ]
    }

    /// The batches of the zones of a named case gate by gate.
    pub(super) fn gates(&self, case: &str) -> Vec<Table> {
        let case = format!("{}; {case}", self.method);
        let mut zones = Vec::new();
        for zone in &self.evolution {
            zones.push(zone.batches(&case, "evolution", zone.range_m));
        }
        for (range_m, zone) in &self.across {
            zones.push(zone.batches(&case, "across", *range_m));
        }
        zones
    }

    /// How far it is from another method on the same signals in a number that both have.
    pub(super) fn less(&self, other: &Self, of: fn(&Self, Option<usize>) -> f64) -> Estimate {
        Estimate::of(self.inside.of_batch.len(), |without| {
            of(self, without) - of(other, without)
        })
    }
}

/// Where the straight line of least squares through some points (x, y, weight) is at `x`.
fn on_line(points: &[[f64; 3]], x: f64) -> f64 {
    let weight = weighted_sum(points, |_| 1.0);
    let mean_x = weighted_sum(points, |p| p[0]) / weight;
    let mean_y = weighted_sum(points, |p| p[1]) / weight;
    let covariance = weighted_sum(points, |p| (p[0] - mean_x) * (p[1] - mean_y));
    let variance = weighted_sum(points, |p| (p[0] - mean_x).powi(2));
    mean_y + covariance / variance * (x - mean_x)
}

/// Sum of a function of points (x, y, weight), each with its weight.
fn weighted_sum(points: &[[f64; 3]], function: impl Fn(&[f64; 3]) -> f64) -> f64 {
    points.iter().map(|p| p[2] * function(p)).sum()
}

/// Mean signal-to-noise ratio of the scene at the vortices, dB; the same for all methods on the same signals.
pub(super) fn snr_db(study: &Study) -> Result<f64, Failure> {
    let scanner = wakescope_sim::measure::scan::Scanner::new(&study.plan, &Silent)?;
    let mut near = Vec::new();
    for (range_m, snr) in scanner.layer_snr() {
        if (350.0..450.0).contains(&range_m) {
            near.push(snr);
        }
    }
    Ok(10.0 * (near.iter().sum::<f64>() / near.len() as f64).log10())
}

/// Place and value of the largest number inside a vortex.
pub(super) fn peak(across: &[(f64, f64)]) -> (usize, f64) {
    let mut inside = Vec::new();
    for (index, (range_m, value)) in across.iter().enumerate() {
        if range_m.abs() <= INSIDE_M {
            inside.push((index, *value));
        }
    }
    let largest = inside.into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
    largest.unwrap_or((0, f64::NAN))
}

/// Full width at half of the peak, m; straight lines between the gates. NaN where it does not fall that far.
pub(super) fn width_m(across: &[(f64, f64)]) -> f64 {
    let (top, value) = peak(across);
    let half = 0.5 * value;
    let mut before = across[..=top].to_vec();
    before.reverse();
    fall_to(half, &across[top..]) - fall_to(half, &before)
}

/// Where a curve first falls below a level, on the straight line between its points; NaN if it does not.
fn fall_to(level: f64, curve: &[(f64, f64)]) -> f64 {
    for pair in curve.windows(2) {
        let from = pair[0];
        let to = pair[1];
        if to.1 < level {
            return from.0 + (to.0 - from.0) * (from.1 - level) / (from.1 - to.1);
        }
    }
    f64::NAN
}

/// CA less each PA in a number of theirs, case by case, in the order of [`METHODS`].
pub(super) fn parts(
    all: &[Profiles],
    unit: &'static str,
    number: fn(&Profiles, Option<usize>) -> f64,
) -> Vec<Part> {
    let mut parts = Vec::new();
    for case in all.chunks(METHODS.len()) {
        let [pas @ .., ca] = case else {
            continue;
        };
        for pa in pas {
            let name = format!("{:.0} ns, CA less {}", 1e9 * pa.pulse_s, pa.method);
            let bar = Bar::Less(NO_DIFFERENCE * number(pa, None).abs());
            parts.push(Part::new(name, ca.less(pa, number), unit, bar));
        }
    }
    parts
}

/// The error of CA relative to that of each PA, case by case, inside and outside.
pub(super) fn comparison(all: &[Profiles]) -> Vec<Comparison> {
    let mut comparison = Vec::new();
    for case in all.chunks(METHODS.len()) {
        let [pas @ .., ca] = case else {
            continue;
        };
        for pa in pas {
            comparison.push(Comparison {
                snr_db: pa.snr_db,
                pulse: format!("{:.0} ns", 1e9 * pa.pulse_s),
                against: match pa.method {
                    "PA" => "PA, unweighted".into(),
                    _ => "PA, Gaussian weighting".into(),
                },
                inside: ca.inside.over(&pa.inside),
                outside: ca.outside.over(&pa.outside),
            });
        }
    }
    comparison
}

/// All profiles as one table.
pub(super) fn table(all: &[Profiles]) -> Table {
    let mut rows: Vec<(&Profiles, f64, &Zone)> = Vec::new();
    for p in all {
        for (range_m, zone) in &p.across {
            rows.push((p, *range_m, zone));
        }
    }
    let averages: Vec<&CellAverage> = rows.iter().map(|(.., zone)| &zone.average).collect();
    Table::new()
        .text("method", column(&rows, |(p, ..)| p.method))
        .float("pulse_s", column(&rows, |(p, ..)| p.pulse_s))
        .text("snr_reference", column(&rows, |(p, ..)| p.name))
        .float("snr_db", column(&rows, |(p, ..)| p.snr_db))
        .float(
            "range_from_centre_m",
            column(&rows, |(_, range_m, _)| *range_m),
        )
        .float("bias_m_s", column(&averages, |a| a.bias_m_s))
        .float("std_m_s", column(&averages, |a| a.std_m_s))
        .float("rms_m_s", column(&averages, |a| a.rms_m_s))
        .float(
            "standard_error_m_s",
            column(&rows, |(.., zone)| zone.rms().standard_error),
        )
        .float(
            "rms_less_evolution_m_s",
            column(&rows, |(p, _, zone)| p.excess_m_s(zone, None)),
        )
}

/// Curves of some profiles, less their evolution with range.
pub(super) fn plot(title: &str, profiles: &[Profiles]) -> CurvePlot {
    let x = Axis::linear("range from the vortex centre [m]");
    let y = Axis::linear("error above that outside [m/s]");
    let mut plot = CurvePlot::new(title, x, y);
    for (place, p) in profiles.iter().enumerate() {
        let style = [Style::Line, Style::Dash, Style::DashDot][place % METHODS.len()];
        let label = format!("{}, {:.0} ns", p.method, 1e9 * p.pulse_s);
        let mut points = Vec::new();
        for (range_m, zone) in &p.across {
            let excess = Estimate {
                value: p.excess_m_s(zone, None),
                ..zone.rms()
            };
            points.push((*range_m, excess));
        }
        plot = plot.with(banded(&label, style, points).in_colour(place));
    }
    plot
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peak_and_width_of_a_bell_are_sought_at_the_vortex() {
        // A Gaussian of height 2 and standard deviation 8 m, and a higher one far out.
        let bell = |r: f64, height: f64, at: f64| height * (-0.5 * ((r - at) / 8.0).powi(2)).exp();
        let across: Vec<(f64, f64)> = (-20..=20)
            .map(|k| 3.0 * f64::from(k))
            .map(|r| (r, bell(r, 2.0, 0.0) + bell(r, 3.0, 60.0)))
            .collect();
        assert!((peak(&across).1 - 2.0).abs() < 1e-3);
        assert!(
            (width_m(&across) - 8.0 * 2.354_82).abs() < 0.3,
            "{}",
            width_m(&across)
        );
        let level: Vec<(f64, f64)> = across.iter().map(|p| (p.0, 1.0)).collect();
        assert!(width_m(&level).is_nan());
    }

    #[test]
    fn the_evolution_is_a_straight_line() {
        let points = [[1.0, 3.0, 5.0], [2.0, 5.0, 1.0], [4.0, 9.0, 2.0]];
        assert!((on_line(&points, 3.0) - 7.0).abs() < 1e-12);
        // What weighs nothing does not count.
        let weightless = [&points[..], &[[3.0, 100.0, 0.0]]].concat();
        assert!((on_line(&weightless, 3.0) - 7.0).abs() < 1e-12);
    }
}
