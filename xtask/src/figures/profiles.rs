//! Errors of one method about the vortices: inside, outside against range, and along the lines of sight that pass a core. Figures 13, 14
//! and 25.
//!
//! Outside the error changes with the signal-to-noise ratio along the line: a straight line in range, each gate with the weight of its
//! estimates, which is taken away.

use super::context::*;
use super::study::{INSIDE_M, METHODS, OUTSIDE_M, Study, Zone, batches};
use crate::statistics::NO_DIFFERENCE;
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
                let lines = map.elevation_rad.iter().enumerate();
                let near = lines
                    .filter(|(_, el)| ((*el - elevation_rad) * core_m).abs() < CORE_M)
                    .map(|(i, _)| i);
                let place = ((core_m - map.range_m[0]) / gate_m).round() as i64 + bin;
                if place >= 0 && (place as usize) < map.range_m.len() {
                    cells.extend(near.map(|i| (i, place as usize)));
                }
            }
            across.push((bin as f64 * gate_m, study.zone(&cells)));
        }
        let gates =
            (0..map.range_m.len()).map(|gate| study.cells(|d, j| d > OUTSIDE_M && j == gate));
        Self {
            method,
            name,
            pulse_s: study.plan.scene.content.pulse_width_s(),
            snr_db,
            inside: study.zone(&study.cells(|d, _| d < INSIDE_M)),
            outside: study.zone(&study.cells(|d, _| d > OUTSIDE_M)),
            evolution: gates
                .filter(|cells| !cells.is_empty())
                .map(|cells| study.zone(&cells))
                .collect(),
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
        let gates = self
            .evolution
            .iter()
            .map(|gate| [gate.range_m, gate.rms_m_s(without), gate.sums(without).1]);
        let outside = gates.filter(|[.., estimates]| *estimates > 0.0);
        zone.rms_m_s(without) - on_line(outside, zone.range_m)
    }

    /// The same along the lines that pass a core.
    pub(super) fn across_m_s(&self, without: Option<usize>) -> Vec<(f64, f64)> {
        self.across
            .iter()
            .map(|(range_m, zone)| (*range_m, self.excess_m_s(zone, without)))
            .collect()
    }

    /// How far it is from another method on the same signals in a number that both have.
    pub(super) fn less(&self, other: &Self, of: fn(&Self, Option<usize>) -> f64) -> Estimate {
        Estimate::of(self.inside.of_batch.len(), |without| {
            of(self, without) - of(other, without)
        })
    }
}

/// Where the straight line of least squares through some points (x, y, weight) is at `x`.
fn on_line(points: impl Iterator<Item = [f64; 3]> + Clone, x: f64) -> f64 {
    let sum = |of: &dyn Fn([f64; 3]) -> f64| points.clone().map(|p| p[2] * of(p)).sum::<f64>();
    let weight = sum(&|_| 1.0);
    let [mean_x, mean_y] = [0, 1].map(|k| sum(&|p| p[k]) / weight);
    let slope = sum(&|p| (p[0] - mean_x) * (p[1] - mean_y)) / sum(&|p| (p[0] - mean_x).powi(2));
    mean_y + slope * (x - mean_x)
}

/// Mean signal-to-noise ratio of the scene at the vortices, dB; the same for all methods on the same signals.
pub(super) fn snr_db(study: &Study) -> Result<f64, Failure> {
    let scanner = wakescope_sim::measure::scan::Scanner::new(&study.plan, &Silent)?;
    let near: Vec<f64> = scanner
        .layer_snr()
        .into_iter()
        .filter(|(r, _)| (350.0..450.0).contains(r))
        .map(|(_, snr)| snr)
        .collect();
    Ok(10.0 * (near.iter().sum::<f64>() / near.len() as f64).log10())
}

/// Place and value of the largest number inside a vortex.
pub(super) fn peak(across: &[(f64, f64)]) -> (usize, f64) {
    let inside = across
        .iter()
        .enumerate()
        .filter(|(_, p)| p.0.abs() <= INSIDE_M);
    inside
        .map(|(k, p)| (k, p.1))
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .unwrap_or((0, f64::NAN))
}

/// Full width at half of the peak, m; straight lines between the gates. NaN where it does not fall that far.
pub(super) fn width_m(across: &[(f64, f64)]) -> f64 {
    let (top, value) = peak(across);
    let half = 0.5 * value;
    let crossing = |from: (f64, f64), to: (f64, f64)| {
        from.0 + (to.0 - from.0) * (from.1 - half) / (from.1 - to.1)
    };
    let steps = |mut side: Box<dyn Iterator<Item = &[(f64, f64)]> + '_>, far: usize| {
        side.find(|pair| pair[far].1 < half)
            .map_or(f64::NAN, |pair| crossing(pair[1 - far], pair[far]))
    };
    steps(Box::new(across[top..].windows(2)), 1)
        - steps(Box::new(across[..=top].windows(2).rev()), 0)
}

/// CA less each PA in a number of theirs, case by case, in the order of [`METHODS`].
pub(super) fn parts(
    all: &[Profiles],
    unit: &'static str,
    of: fn(&Profiles, Option<usize>) -> f64,
) -> Vec<Part> {
    let case = |of_case: &[Profiles]| {
        let [pas @ .., ca] = of_case else {
            return Vec::new();
        };
        let part = |pa: &Profiles| {
            let trifle = NO_DIFFERENCE * of(pa, None).abs();
            (
                format!("{}, CA - {}", pa.title(), pa.method),
                ca.less(pa, of),
                unit,
                Bar::Less(trifle),
            )
        };
        pas.iter().map(part).collect()
    };
    all.chunks(METHODS.len()).flat_map(case).collect()
}

/// In which readings a difference is below zero, in which it is not, and which are open, with their numbers.
pub(super) fn told(parts: &[Part]) -> String {
    let of = |verdict, heading: &str| {
        let readings = parts
            .iter()
            .filter(|part| part.3.verdict(&part.1) == verdict);
        let readings =
            readings.map(|(name, found, unit, _)| format!("{name} {}{unit}", found.words()));
        let readings = readings.collect::<Vec<_>>().join("; ");
        if readings.is_empty() {
            readings
        } else {
            format!("{heading}: {readings}")
        }
    };
    let all = [
        of(Verdict::Pass, "yes"),
        of(Verdict::Fail, "no"),
        of(Verdict::Open, "open"),
    ];
    all.into_iter()
        .filter(|told| !told.is_empty())
        .collect::<Vec<_>>()
        .join(". ")
}

/// All profiles as one table.
pub(super) fn table(all: &[Profiles]) -> Table {
    let rows: Vec<(&Profiles, f64, &Zone)> = all
        .iter()
        .flat_map(|p| {
            p.across
                .iter()
                .map(move |(range_m, zone)| (p, *range_m, zone))
        })
        .collect();
    let of = |get: fn(&CellAverage) -> f64| {
        rows.iter()
            .map(move |(_, _, zone)| get(&zone.average))
            .collect::<Vec<_>>()
    };
    Table::new()
        .text("method", rows.iter().map(|(p, ..)| p.method))
        .float("pulse_s", rows.iter().map(|(p, ..)| p.pulse_s))
        .text("snr_reference", rows.iter().map(|(p, ..)| p.name))
        .float("snr_db", rows.iter().map(|(p, ..)| p.snr_db))
        .float(
            "range_from_centre_m",
            rows.iter().map(|(_, range_m, _)| *range_m),
        )
        .float("bias_m_s", of(|a| a.bias_m_s))
        .float("std_m_s", of(|a| a.std_m_s))
        .float("rms_m_s", of(|a| a.rms_m_s))
        .float(
            "standard_error_m_s",
            rows.iter().map(|(.., zone)| zone.rms().standard_error),
        )
        .float(
            "rms_less_evolution_m_s",
            rows.iter().map(|(p, _, zone)| p.excess_m_s(zone, None)),
        )
}

/// All that the claims need: the zones of named cases in their batches, with those gate by gate or without.
pub(super) fn batches_table<'p>(
    all: impl Iterator<Item = (String, &'p Profiles)>,
    with_gates: bool,
) -> Table {
    batches(all.flat_map(|(case, p)| {
        let whole = [
            ("inside", f64::NAN, &p.inside),
            ("outside", f64::NAN, &p.outside),
        ];
        let evolution = p
            .evolution
            .iter()
            .map(|gate| ("evolution", gate.range_m, gate));
        let across = p
            .across
            .iter()
            .map(|(range_m, zone)| ("across", *range_m, zone));
        let gates: Vec<_> = if with_gates {
            evolution.chain(across).collect()
        } else {
            Vec::new()
        };
        let method = p.method;
        let named = move |(zone, place, of)| (format!("{method}; {case}"), zone, place, of);
        whole.into_iter().chain(gates).map(named)
    }))
}

/// Curves of some profiles, less their evolution with range.
pub(super) fn plot(title: &str, profiles: &[Profiles]) -> CurvePlot {
    let [x, y] = [
        "range from the vortex centre [m]",
        "rms less its evolution [m/s]",
    ]
    .map(Axis::linear);
    let mut plot = CurvePlot::new(title, x, y);
    for (place, p) in profiles.iter().enumerate() {
        let style = [Style::Line, Style::Dash, Style::DashDot][place % METHODS.len()];
        let excess = |zone: &Zone| Estimate {
            value: p.excess_m_s(zone, None),
            ..zone.rms()
        };
        let label = format!("{}, {:.0} ns", p.method, 1e9 * p.pulse_s);
        let points = p
            .across
            .iter()
            .map(|(range_m, zone)| (*range_m, excess(zone)));
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
        assert!((on_line(points.into_iter(), 3.0) - 7.0).abs() < 1e-12);
        // What weighs nothing does not count.
        assert!((on_line(points.into_iter().chain([[3.0, 100.0, 0.0]]), 3.0) - 7.0).abs() < 1e-12);
    }
}
