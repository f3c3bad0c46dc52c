//! Settings of a flow: the same case on three meshes, and with steps half and twice as long, compared in memory.
//!
//! The error of a metric is the root mean square over the output times, relative to that of the metric. With an error `C(t) h^p` the
//! differences of neighbouring spacings have one shape in time, and `(h_3^p - h_2^p)/(h_2^p - h_1^p)` is the ratio of their norms
//! (Richardson 1911). Where no order is found, the reference is the finest run.

use super::keys::CELLS;
use super::metrics::Metric;
use super::{Report, Request, Row, Setting};
use crate::Error;
use crate::flow::CaseFile;
use crate::flow::trial::{History, history_of};
use crate::io::csv::float_text;
use crate::progress::{Observer, Stage};
use std::time::Instant;
use wakescope_estimate::Measured;

/// Lengths of the cells over those of the case.
const MESHES: [f64; 3] = [1.0, 1.5, 2.0];
/// Lengths of shorter and of longer steps over those of the case.
const STEPS: [f64; 2] = [0.5, 2.0];
/// Metrics in the order of a history.
const METRICS: [Metric; 4] = [
    Metric::Energy,
    Metric::Dissipation,
    Metric::Circulation,
    Metric::Height,
];
/// Smallest and largest order that is accepted.
const ORDERS: [f64; 2] = [1.0, 6.0];
/// Smallest cosine between the differences of neighbours that counts as one shape in time.
const SAME_SHAPE: f64 = 0.8;
/// Relative difference that is rounding and the residual of the pressure.
const ROUNDING: f64 = 1e-9;

/// A run with other cells or steps.
struct FlowTrial {
    /// Length of its cells or steps over that of the case.
    spacing: f64,
    history: Result<History, Error>,
    run_s: f64,
}

impl FlowTrial {
    /// Runs a case; only the given one has to be possible.
    ///
    /// # Errors
    /// What the given case refuses.
    fn run(file: &CaseFile, spacing: f64, observer: &dyn Observer) -> Result<Self, Error> {
        let begun = Instant::now();
        let history = history_of(file, observer);
        let run_s = begun.elapsed().as_secs_f64();
        observer.advance(1);
        match history {
            Err(error) if spacing == 1.0 => Err(error),
            history => Ok(Self {
                spacing,
                history,
                run_s,
            }),
        }
    }

    /// The row of a value of a setting with this run, without shifts.
    fn row(&self, value: f64, label: String) -> Row {
        match &self.history {
            Ok(_) => Row::new(value, label, self.run_s),
            Err(error) => Row::refused(value, label, error),
        }
    }

    fn series(&self, metric: Metric) -> Option<&[f64]> {
        let history = self.history.as_ref().ok()?;
        let index = METRICS.iter().position(|own| *own == metric)?;
        Some(&history[index])
    }
}

impl Report {
    /// Errors and run time of the case of a flow.
    ///
    /// # Errors
    /// What the case refuses, too few cells for three meshes; metrics that it does not have.
    pub fn of_case(
        file: &CaseFile,
        request: &Request,
        observer: &dyn Observer,
    ) -> Result<Self, Error> {
        // What no case has is refused before anything is run.
        request.select("case", &METRICS)?;
        let meshes = meshes(file)?;
        observer.begin(Stage::Cases, (MESHES.len() + STEPS.len()) as u64);
        let mut on_meshes = Vec::new();
        for (spacing, mesh) in &meshes {
            on_meshes.push(FlowTrial::run(mesh, *spacing, observer)?);
        }
        let given = &on_meshes[0];
        let mut available = METRICS.to_vec();
        available.retain(|metric| {
            let values = given.series(*metric).unwrap_or_default();
            values.iter().any(|x| x.is_finite() && *x != 0.0)
        });
        let mut report = Self {
            subject: "case",
            provenance: file.provenance(),
            within: request.within,
            realisations: None,
            metrics: request.select("case", &available)?,
            settings: Vec::new(),
            notes: Vec::new(),
        };
        let (_, key, given_step) = file.with_longer_steps(1.0)?;
        let [shorter, longer] = STEPS;
        let (shorter_file, _, shorter_step) = file.with_longer_steps(shorter)?;
        let (longer_file, _, longer_step) = file.with_longer_steps(longer)?;
        let short = FlowTrial::run(&shorter_file, shorter, observer)?;
        let long = FlowTrial::run(&longer_file, longer, observer)?;
        observer.end();
        let mut rows = Vec::with_capacity(meshes.len());
        for ((_, mesh), trial) in meshes.iter().zip(&on_meshes) {
            let cells = mesh.content.case.cells();
            let [nx, ny, nz] = cells;
            let label = format!("{nx} x {ny} x {nz}");
            rows.push((trial.row(count(cells), label), trial));
        }
        report.add(CELLS, count(file.content.case.cells()), rows);
        let mut rows = Vec::with_capacity(1 + STEPS.len());
        for (value, trial) in [
            (shorter_step, &short),
            (given_step, given),
            (longer_step, &long),
        ] {
            rows.push((trial.row(value, float_text(value)), trial));
        }
        report.add(key, given_step, rows);
        Ok(report)
    }

    /// Adds a setting from the rows of its values and their runs, the finest first, and a note on
    /// the order of its errors.
    fn add(&mut self, key: &'static str, given: f64, entries: Vec<(Row, &FlowTrial)>) {
        let (mut rows, trials): (Vec<Row>, Vec<&FlowTrial>) = entries.into_iter().unzip();
        let mut spacings = Vec::new();
        for trial in &trials {
            if trial.history.is_ok() {
                spacings.push(trial.spacing);
            }
        }
        let mut orders = Vec::new();
        for metric in &self.metrics {
            let known = trials.iter().filter_map(|trial| trial.series(*metric));
            let (order, errors) = richardson(&spacings, &known.collect::<Vec<_>>());
            let order = match order {
                None => "does not converge".into(),
                Some(order) if order.is_finite() => format!("{order:.2}"),
                Some(_) => "no error".into(),
            };
            orders.push(format!("{} {order}", metric.name()));
            let usable = rows.iter_mut().filter(|row| row.refused.is_none());
            for (row, error) in usable.zip(errors) {
                row.shifts.push((*metric, Measured::exact(error)));
            }
        }
        let orders = orders.join(", ");
        self.notes
            .push(format!("order of the error by {key}: {orders}"));
        self.settings.push(Setting { key, given, rows });
    }
}

fn count(cells: [usize; 3]) -> f64 {
    cells.iter().map(|n| *n as f64).product()
}

/// The case and the same on coarser meshes, with the length of their cells over that of its own.
///
/// # Errors
/// Too few cells for coarser meshes.
fn meshes(file: &CaseFile) -> Result<Vec<(f64, CaseFile)>, Error> {
    let whole = file.content.case.cells();
    let directions = whole.iter().filter(|n| **n > 1).count().max(1) as f64;
    let mut meshes = vec![(MESHES[0], file.clone())];
    for ratio in &MESHES[1..] {
        let coarser = file.coarser(*ratio);
        let cells = coarser.content.case.cells();
        let spacing = (count(whole) / count(cells)).powf(1.0 / directions);
        if meshes.iter().any(|(finer, _)| spacing <= *finer) {
            return Err(file.refuse_cells(
                "enough for three meshes, the coarsest of half as many along each direction".into(),
            ));
        }
        meshes.push((spacing, coarser));
    }
    Ok(meshes)
}

/// Order of the errors, infinite where all series are the same and none where they do not converge, and the error of each relative
/// to the root mean square of the first; `series` from the finest spacing on, at the same times. Without an order the error of the finest
/// is its difference from the next, those of the others their differences from the finest besides.
fn richardson(spacings: &[f64], series: &[&[f64]]) -> (Option<f64>, Vec<f64>) {
    let count = series.iter().map(|own| own.len()).min().unwrap_or(0);
    // At the times that all of them have.
    let mut common = vec![Vec::new(); series.len()];
    for time in 0..count {
        if series.iter().all(|own| own[time].is_finite()) {
            for (values, own) in common.iter_mut().zip(series) {
                values.push(own[time]);
            }
        }
    }
    if series.len() < 2 || common[0].is_empty() {
        return (None, vec![f64::NAN; series.len()]);
    }
    let scale = norm(&common[0]);
    let first = difference(&common[1], &common[0]);
    let mut from_finest = vec![norm(&first) / scale];
    for other in &common[1..] {
        from_finest.push(from_finest[0] + norm(&difference(other, &common[0])) / scale);
    }
    let [h1, h2, h3] = *spacings else {
        return (None, from_finest);
    };
    if from_finest.iter().all(|error| *error < ROUNDING) {
        return (Some(f64::INFINITY), from_finest);
    }
    let second = difference(&common[2], &common[1]);
    let cosine = product(&first, &second) / (norm(&first) * norm(&second));
    let measured = norm(&second) / norm(&first);
    let [mut low, mut high] = ORDERS;
    // A ratio or cosine that is not a number does not converge either.
    let converges = cosine >= SAME_SHAPE
        && measured >= error_ratio([h1, h2, h3], low)
        && measured <= error_ratio([h1, h2, h3], high);
    if !converges {
        return (None, from_finest);
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if error_ratio([h1, h2, h3], middle) < measured {
            low = middle;
        } else {
            high = middle;
        }
    }
    let mut errors = Vec::with_capacity(spacings.len());
    for h in spacings {
        errors.push(from_finest[0] * h.powf(low) / (h2.powf(low) - h1.powf(low)));
    }
    (Some(low), errors)
}

/// Difference between the second and third solution over that between the first and second, for an order of the errors.
fn error_ratio([h1, h2, h3]: [f64; 3], order: f64) -> f64 {
    (h3.powf(order) - h2.powf(order)) / (h2.powf(order) - h1.powf(order))
}

fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn norm(a: &[f64]) -> f64 {
    product(a, a).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Silent;
    use crate::flow::plane_vortices_for_tests;
    use std::f64::consts::PI;
    use std::path::Path;

    fn case(text: &str) -> CaseFile {
        CaseFile::parse(text, Path::new("c.toml")).unwrap()
    }

    fn request(of: &[Metric]) -> Request {
        Request {
            within: 0.05,
            of: of.to_vec(),
        }
    }

    /// Air that two plates slow down.
    const PLATES: &str = "[case]\nkind = \"free\"\nviscosity_m2_s = 0.05\n[case.x]\ncells = 1\n[case.y]\ncells = 1\n\
        [case.z]\ncells = 32\nlow_m = 0.0\nhigh_m = 1.0\nlow_end = \"no_slip\"\nhigh_end = \"no_slip\"\n[case.initial]\n\
        kind = \"uniform\"\nvelocity_m_s = [0.0, 1.0, 0.0]\n[time]\nend_s = 2.0\nstep_s = 0.005\n";

    #[test]
    fn the_errors_of_decaying_vortices_match_those_from_the_closed_form() {
        let field = plane_vortices_for_tests::folder();
        let own = plane_vortices_for_tests::case(
            &field,
            32,
            0.005,
            "[time]\nend_s = 1.0\nlongest_step_s = 0.005\n",
        );
        let found = Report::of_case(&own, &request(&[]), &Silent).unwrap();
        assert_eq!(found.metrics, [Metric::Energy, Metric::Dissipation]);
        // Energy exp(-16 pi^2 nu t)/4, of which 16 pi^2 nu is lost in a time.
        let rate = 16.0 * PI * PI * 0.005;
        for (row, ratio) in found.settings[0].rows.iter().zip(MESHES) {
            let file = match ratio {
                1.0 => own.clone(),
                ratio => own.coarser(ratio),
            };
            let history = history_of(&file, &Silent).unwrap();
            for (index, amplitude) in [0.25, 0.25 * rate].into_iter().enumerate() {
                let mut squares = 0.0;
                let mut all = 0.0;
                for (i, value) in history[index].iter().enumerate() {
                    let exact = amplitude * (-rate * (i + 1) as f64 / 16.0).exp();
                    if value.is_finite() {
                        squares += (value - exact).powi(2);
                        all += exact.powi(2);
                    }
                }
                let closed = f64::sqrt(squares / all);
                let error = row.shift(METRICS[index]).unwrap().bound();
                assert!(
                    closed > 1e-7 && (error / closed - 1.0).abs() < 0.15,
                    "{ratio} {index} {error} {closed}"
                );
            }
        }
        // Convection and gradients are of fourth order.
        let (_, orders) = found.notes[0].split_once(": ").unwrap();
        for text in orders.split(", ") {
            let (_, order) = text.split_once(' ').unwrap();
            assert!(
                (order.parse::<f64>().unwrap() - 4.0).abs() < 0.3,
                "{orders}"
            );
        }
        assert!(found.is_reached());
        let cells = found.settings[0].rows.iter().map(|row| row.label.as_str());
        assert_eq!(
            cells.collect::<Vec<_>>(),
            ["1 x 32 x 32", "1 x 22 x 22", "1 x 16 x 16"]
        );
    }

    #[test]
    fn flows_that_do_not_converge_have_the_difference_of_the_finest_as_error() {
        let turbulent =
            case("[case]\nkind = \"vortex_pair\"\ncells = [8, 32, 20]\nperturbation = 0.1\n");
        let found = Report::of_case(&turbulent, &request(&[]), &Silent).unwrap();
        let errors: Vec<f64> = found.settings[0].rows[..2]
            .iter()
            .map(|row| row.shift(Metric::Dissipation).unwrap().bound())
            .collect();
        assert!((errors[1] / errors[0] - 2.0).abs() < 1e-12, "{errors:?}");
        let note = &found.notes[0];
        assert!(note.contains("dissipation does not converge"), "{note}");
    }

    #[test]
    fn too_few_cells_and_metrics_that_a_case_has_not_are_refused() {
        let refused = |text: &str, of: &[Metric]| {
            let error = Report::of_case(&case(text), &request(of), &Silent);
            error.unwrap_err().to_string()
        };
        let few = refused("[case]\nkind = \"vortex_pair\"\ncells = [1, 6, 6]\n", &[]);
        assert!(
            few.starts_with("c.toml:3: case.cells = [1, 6, 6] is not allowed: "),
            "{few}"
        );
        let none = refused(PLATES, &[Metric::Height]);
        assert!(
            none.contains(
                "--of: height is not a metric of this case, which has: energy, dissipation"
            ),
            "{none}"
        );
        // Of air at rest nothing is assessed, so that nothing could be within the error.
        let none = refused(&PLATES.replace("[0.0, 1.0, 0.0]", "[0.0, 0.0, 0.0]"), &[]);
        assert!(none.contains("--of: this case has no metric"), "{none}");
    }

    #[test]
    fn steps_that_the_scheme_refuses_are_rows_with_the_reason() {
        let text = "[case]\nkind = \"vortex_pair\"\ncells = [1, 32, 32]\n[time]\nend_s = 0.2\nscheme = \"runge_kutta3\"\n\
            courant = 0.9\nlongest_step_s = 10.0\n";
        let found = Report::of_case(&case(text), &request(&[]), &Silent).unwrap();
        let steps = &found.settings[1];
        assert_eq!((steps.key, steps.given), ("time.courant", 0.9));
        let row = &steps.rows[2];
        assert!(
            row.refused.is_some() && row.run_s.is_nan() && row.shifts.is_empty(),
            "{row:?}"
        );
        assert!(
            found.text().contains("time.courant = 1.8 is refused: "),
            "{}",
            found.text()
        );
    }
}

#[cfg(test)]
mod order_tests {
    use super::*;

    const SPACINGS: [f64; 3] = [1.0, 1.47, 2.06];

    fn found(of: impl Fn(f64, f64) -> f64) -> (Option<f64>, Vec<f64>) {
        let series = SPACINGS.map(|h| (0..9).map(|t| of(f64::from(t), h)).collect::<Vec<f64>>());
        richardson(&SPACINGS, &series.each_ref().map(Vec::as_slice))
    }

    #[test]
    fn orders_and_errors_of_power_laws_are_found() {
        for p in [1.2, 2.0, 4.0] {
            let (order, errors) = found(|t, h| (1.0 + 0.01 * t * h.powf(p)) * (-0.1 * t).exp());
            assert!((order.unwrap() / p - 1.0).abs() < 1e-9, "{order:?} {p}");
            let mut off = 0.0;
            let mut all = 0.0;
            for t in 0..9 {
                let (t, decay) = (f64::from(t), (-0.2 * f64::from(t)).exp());
                off += (0.01 * t * SPACINGS[1].powf(p)).powi(2) * decay;
                all += (1.0 + 0.01 * t).powi(2) * decay;
            }
            assert!(
                (errors[1] / (off / all).sqrt() - 1.0).abs() < 1e-9,
                "{errors:?}"
            );
        }
    }

    #[test]
    fn what_comes_to_no_limit_has_no_order_and_the_difference_from_the_finest() {
        let constant = |at: [f64; 3]| {
            move |_: f64, h: f64| at[SPACINGS.iter().position(|own| *own == h).unwrap()]
        };
        // Back and forth; hardly less from mesh to mesh; faster than any scheme.
        for at in [[1.0, 1.02, 1.0], [1.0, 1.02, 1.021], [1.0, 1.0001, 1.02]] {
            let (order, errors) = found(constant(at));
            assert!(
                order.is_none() && (errors[0] - (at[1] - 1.0)).abs() < 1e-12,
                "{at:?} {order:?} {errors:?}"
            );
            assert!(
                (errors[2] - (at[1] - 1.0) - (at[2] - 1.0)).abs() < 1e-12,
                "{errors:?}"
            );
        }
        // Of other shapes in time.
        assert_eq!(
            found(|t, h| if h > 2.0 {
                1.0 + 0.01 * t
            } else {
                1.0 + 0.001 * h * (3.0 * t).sin()
            })
            .0,
            None
        );
        assert_eq!(found(|t, _| 1.0 + t).0, Some(f64::INFINITY));
        let (order, errors) = super::richardson(&SPACINGS[..1], &[&[1.0]]);
        assert!(order.is_none() && errors[0].is_nan());
    }
}
