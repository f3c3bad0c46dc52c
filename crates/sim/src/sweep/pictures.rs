//! Pictures of a sweep: every result against each key that is a number, and the front of precision against resolution.
//!
//! Check: by eye; a test of the program compares the names of the files.

use super::pareto::{Objective, Place, Sense, front};
use super::results::{RESULTS, standard_error_of};
use super::stored::{Definition, Holds};
use super::tables::Row;
use crate::Error;
use crate::io::FileGroup;
use crate::plot::{Axis, CurvePlot, Figure, Series, Style};

/// Panels of a picture: title, axis, results with their names in the legend.
const PANELS: [(&str, &str, &[(&str, &str)]); 6] = [
    ("Signal-to-noise ratio in the middle of the scan", "SNR [dB]", &[("snr_db", "")]),
    ("Error outside the vortices", "error [m/s]", &[("rms_outside_m_s", "rms"), ("bound_m_s", "bound")]),
    ("Error inside the vortices", "error [m/s]", &[("rms_inside_m_s", "rms")]),
    ("Estimates outside that are spread over the band", "fraction", &[("bad_fraction", "bad")]),
    ("Range resolution", "full width at half maximum [m]", &[("resolution_m", "")]),
    (
        "Error of the circulation",
        "error [m^{2}/s]",
        &[("circulation_rms_m2_s", "map"), ("circulation_bound_m2_s", "bound")],
    ),
];

/// Curves of a panel that a legend can tell apart; more are drawn as points alone.
const MOST_CURVES: usize = 6;

/// Name of the picture of the front.
const FRONT: &str = "front";

fn stem(key: &str) -> String {
    format!("results_{}", key.replace('.', "_"))
}

fn drawn(definition: &Definition) -> impl Iterator<Item = (usize, &str)> {
    let keys = definition.keys.iter().enumerate();
    keys.filter(|(_, (_, holds))| *holds != Holds::Texts).map(|(place, (name, _))| (place, name.as_str()))
}

/// Names of the files.
pub(super) fn names(definition: &Definition) -> Vec<String> {
    let stems = drawn(definition).map(|(_, name)| stem(name)).chain([FRONT.to_owned()]);
    stems.flat_map(|stem| [format!("{stem}.svg"), format!("{stem}.png")]).collect()
}

/// Adds the pictures to the files of a sweep.
pub(super) fn add(files: &mut FileGroup, definition: &Definition, rows: &[Row]) -> Result<(), Error> {
    let mut put = |stem: &str, figure: &Figure| -> Result<(), Error> {
        files.add(&format!("{stem}.svg"), figure.svg(&definition.origin)?)?;
        Ok(files.add(&format!("{stem}.png"), figure.png(&definition.origin)?)?)
    };
    for (place, name) in drawn(definition) {
        let panels = PANELS.map(|panel| against(definition, rows, (place, name), &panel));
        let mut figure = Figure::stacked(panels.into_iter().flatten());
        (figure.columns, figure.width) = (2, 1240.0);
        put(&stem(name), &figure)?;
    }
    put(FRONT, &Figure::stacked([of_front(rows)]))
}

/// A panel of results against a key; none where no case has any.
fn against(
    definition: &Definition,
    rows: &[Row],
    (place, key): (usize, &str),
    (title, label, results): &(&str, &str, &[(&str, &str)]),
) -> Option<CurvePlot> {
    let curves = curves(definition, rows, place);
    let x: Vec<f64> = rows.iter().map(|row| row.key(place)).filter(|x| x.is_finite()).collect();
    let (low, high) = x.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(*x), high.max(*x)));
    let axis = if low > 0.0 && high >= 8.0 * low { Axis::log(key) } else { Axis::linear(key) };
    let mut plot = CurvePlot::new(title, axis, Axis::linear(label));
    let (mut colour, mut any) = (0, false);
    for (curve, members) in &curves {
        for (result, word) in results.iter() {
            let columns = RESULTS.iter().map(|(name, ..)| *name);
            let error = standard_error_of(result, columns);
            let mut points: Vec<(f64, f64, f64)> = members
                .iter()
                .map(|row| (row.key(place), row.result(result), error.map_or(0.0, |error| row.result(error))))
                .filter(|(x, y, _)| x.is_finite() && y.is_finite())
                .collect();
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            any |= !points.is_empty();
            let xy = || points.iter().map(|(x, y, _)| (*x, *y));
            if curves.len() <= MOST_CURVES && points.len() > 1 {
                let style = if error.is_some() { Style::Line } else { Style::Dash };
                plot = plot.with(Series::new("", style, xy()).in_colour(colour));
            }
            let label = [curve.as_str(), word].into_iter().filter(|w| !w.is_empty()).collect::<Vec<_>>().join(", ");
            let bars: Vec<f64> =
                points.iter().map(|(_, _, error)| if error.is_finite() { *error } else { 0.0 }).collect();
            plot = plot.with(Series::new(&label, Style::Markers, xy()).with_band(&bars).in_colour(colour));
            colour += 1;
        }
    }
    any.then_some(plot)
}

/// Cases that differ in one key alone belong to one curve; all to one without a name where there are too many.
fn curves<'r>(definition: &Definition, rows: &'r [Row], place: usize) -> Vec<(String, Vec<&'r Row>)> {
    let mut curves: Vec<(String, Vec<&Row>)> = Vec::new();
    for row in rows {
        let others = definition.keys.iter().zip(&row.keys).enumerate().filter(|(i, _)| *i != place);
        let short = |name: &str| name.rsplit('.').next().unwrap_or_default().to_owned();
        let label: Vec<String> = others.map(|(_, ((name, _), value))| format!("{} {value}", short(name))).collect();
        let label = label.join(", ");
        match curves.iter_mut().find(|(known, _)| *known == label) {
            Some((_, members)) => members.push(row),
            None => curves.push((label, vec![row])),
        }
    }
    if curves.len() <= MOST_CURVES { curves } else { vec![(String::new(), rows.iter().collect())] }
}

/// Precision against resolution, with the front.
fn of_front(rows: &[Row]) -> CurvePlot {
    let column = |name: &str| rows.iter().map(|row| row.result(name)).collect::<Vec<_>>();
    let (resolution_m, std_m_s, error_m_s) =
        (column("resolution_m"), column("std_m_s"), column("std_standard_error_m_s"));
    let precision = Objective { sense: Sense::Min, values: std_m_s.clone(), standard_errors: error_m_s.clone() };
    let places = front(&[Objective::exact(Sense::Min, resolution_m.clone()), precision]);
    let all = || resolution_m.iter().copied().zip(std_m_s.iter().copied());
    let mut best: Vec<(f64, f64)> = all().zip(&places).filter(|(_, p)| **p != Place::Off).map(|(xy, _)| xy).collect();
    best.sort_by(|a, b| a.0.total_cmp(&b.0));
    let bars: Vec<f64> = error_m_s.iter().map(|error| if error.is_finite() { *error } else { 0.0 }).collect();
    let axes = (Axis::linear("full width at half maximum in range [m]"), Axis::linear("standard deviation [m/s]"));
    CurvePlot::new("Precision against resolution", axes.0, axes.1)
        .with(Series::new("front", Style::Line, best))
        .with(Series::new("cases", Style::Markers, all()).with_band(&bars))
}
