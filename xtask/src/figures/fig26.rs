//! Figure 26: run time and error against the pulses of a line, record by record and with their products drawn at once.

use super::context::*;
use crate::cost::{machine, measured};
use statrs::statistics::{Data, Median};
use std::path::Path;
use wakescope_sim::run::run;
use wakescope_sim::scene::{Accumulation, preset_toml};

/// The lidar, whose lines have thousands of pulses.
const PRESET: &str = "windcube_200s_short";

/// Realisations of each line.
const REALISATIONS: usize = 4;

/// Range of the ratio of both errors that counts as equal.
const EQUAL: Bar = Bar::Between(0.8, 1.25);

/// Errors and run time of one number of pulses.
struct Row {
    accumulation: Accumulation,
    pulses: usize,
    cpu_s: f64,
    /// Absolute errors at the gates of each line and realisation \[m/s\].
    lines_m_s: Vec<Vec<f64>>,
}

impl Row {
    /// Median absolute error \[m/s\], without one of the lines.
    fn median_m_s(&self, without: Option<usize>) -> f64 {
        let mut errors_m_s = Vec::new();
        for (line, of_line_m_s) in self.lines_m_s.iter().enumerate() {
            if Some(line) != without {
                errors_m_s.extend(of_line_m_s);
            }
        }
        Data::new(errors_m_s).median()
    }

    fn median(&self) -> Estimate {
        Estimate::of(self.lines_m_s.len(), |without| self.median_m_s(without))
    }

    /// This error over that of a row of other random numbers.
    fn over(&self, other: &Self) -> Estimate {
        let a = self.median();
        let b = other.median();
        let value = a.value / b.value;
        let relative = (a.standard_error / a.value).hypot(b.standard_error / b.value);
        Estimate {
            value,
            standard_error: value * relative,
            freedom: a.freedom,
        }
    }
}

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let lines = context.profile.choose(8, 16, 66);
    let by_records = context.profile.choose(
        vec![400, 1200],
        vec![100, 400, 1600],
        vec![100, 400, 1600, 4000],
    );
    let drawn = vec![400, 1200, 4000, 40_000];
    let mut rows = Vec::new();
    for pulses in drawn {
        rows.push(row(context, Accumulation::Auto, pulses, lines)?);
    }
    for pulses in by_records {
        rows.push(row(context, Accumulation::Records, pulses, lines)?);
    }
    let parameters =
        format!("preset = \"{PRESET}\"\nlines = {lines}\nrealisations = {REALISATIONS}\n");
    let origin = context.provenance_of_formula(&parameters);
    let mut out = Rendered::new(&table(&rows), &picture(&rows), &origin)?;
    out.values = vec![lines.to_string(), REALISATIONS.to_string(), machine()];
    out.claims = vec![Claim::judged("AP1", &ratios(&rows))];
    Ok(out)
}

/// Runs the lidar with a number of pulses on one thread.
fn row(
    context: &Context,
    accumulation: Accumulation,
    pulses: usize,
    lines: usize,
) -> Result<Row, Failure> {
    let text = preset_toml(PRESET).ok_or_else(|| Failure::new(format!("no preset {PRESET}")))?;
    let mut scene = SceneFile::parse(&text, Path::new(PRESET))?.content;
    let span_rad = scene.scan.elevation_max_rad - scene.scan.elevation_min_rad;
    scene.scan.elevation_step_rad = span_rad / (lines as f64 - 0.5);
    scene.scan.pulses_per_line = pulses;
    scene.scan.realisations = REALISATIONS;
    scene.scan.accumulation = accumulation;
    let plan = Plan::new(context.scene_file(scene)?, Target::Map)?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let (outcome, cost) = measured(|| Ok(pool.install(|| run(&plan, &Silent))?))?;
    let map = outcome
        .map
        .ok_or_else(|| Failure::new("the run has no map".into()))?;
    let mut lines_m_s = Vec::new();
    for scan in &map.scans {
        for errors_m_s in scan.error_m_s.rows() {
            lines_m_s.push(errors_m_s.iter().map(|error| error.abs()).collect());
        }
    }
    Ok(Row {
        accumulation,
        pulses,
        cpu_s: cost.cpu_s,
        lines_m_s,
    })
}

const fn name_of(accumulation: Accumulation) -> &'static str {
    match accumulation {
        Accumulation::Auto => "drawn at once",
        Accumulation::Records => "record by record",
    }
}

fn table(rows: &[Row]) -> Table {
    let errors = column(rows, Row::median);
    Table::new()
        .text("pulses_are", column(rows, |row| name_of(row.accumulation)))
        .int("pulses_per_line", column(rows, |row| row.pulses as i64))
        .float("cpu_s", column(rows, |row| row.cpu_s))
        .float("median_error_m_s", column(&errors, |median| median.value))
        .float(
            "standard_error_m_s",
            column(&errors, |median| median.standard_error),
        )
}

fn picture(rows: &[Row]) -> Figure {
    let mut times = CurvePlot::new(
        "Run time",
        axis_of_pulses(),
        Axis::log("processor time [s]"),
    );
    let mut errors = CurvePlot::new(
        "Error",
        axis_of_pulses(),
        Axis::log("median absolute error [m/s]"),
    );
    for accumulation in [Accumulation::Auto, Accumulation::Records] {
        let name = name_of(accumulation);
        let mut of_times = Vec::new();
        let mut of_errors = Vec::new();
        for row in rows.iter().filter(|row| row.accumulation == accumulation) {
            of_times.push((row.pulses as f64, row.cpu_s));
            of_errors.push((row.pulses as f64, row.median()));
        }
        times = times.with(Series::new(name, Style::LineMarkers, of_times));
        errors = errors.with(banded(name, Style::LineMarkers, of_errors));
    }
    Figure::stacked([times, errors])
}

fn axis_of_pulses() -> Axis {
    Axis::log("pulses a line").between(80.0, 60e3)
}

/// The error of draws over that of records, for each number of pulses with both.
fn ratios(rows: &[Row]) -> Vec<Part> {
    let mut parts = Vec::new();
    for records in rows {
        let drawn = rows
            .iter()
            .find(|row| row.pulses == records.pulses && row.accumulation == Accumulation::Auto);
        if let (Accumulation::Records, Some(drawn)) = (records.accumulation, drawn) {
            let name = format!("{} pulses", records.pulses);
            parts.push(Part::new(name, drawn.over(records), "", EQUAL));
        }
    }
    parts
}
