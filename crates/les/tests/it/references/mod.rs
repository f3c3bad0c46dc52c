//! Flows with known answers against the literature, other codes and theory: the table of the book's page `validation-flow`.
//!
//! The short ones run with all tests. The others are ignored; on a machine with time
//! `cargo test --release -p wakescope-les --test it references -- --ignored` runs them.

mod plane_flows;
mod turbulence;
mod wakes;

use std::path::Path;

use wakescope_les::analysis::decay::value_at;

/// A quantity against another.
type Curve = Vec<(f64, f64)>;

/// Numbers of a stored table, row by row, and `NaN` for cells that are no numbers; comments and the header are skipped.
fn stored(name: &str) -> Vec<Vec<f64>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/reference/les");
    let text = std::fs::read_to_string(folder.join(name)).unwrap();
    let mut rows = Vec::new();
    for line in text.lines().filter(|line| !line.starts_with('#')) {
        let cells: Vec<Option<f64>> = line
            .split(',')
            .map(|cell| cell.trim().parse().ok())
            .collect();
        if cells.first().is_some_and(Option::is_some) {
            rows.push(
                cells
                    .into_iter()
                    .map(|cell| cell.unwrap_or(f64::NAN))
                    .collect(),
            );
        }
    }
    assert!(!rows.is_empty(), "{name}");
    rows
}

/// A column of stored rows against the first one.
fn stored_curve(rows: &[Vec<f64>], column: usize) -> Curve {
    rows.iter().map(|row| (row[0], row[column])).collect()
}

/// Largest difference of `found` from `expected` at the times of `expected` from `range[0]` to `range[1]`; NaN if one is NaN.
fn largest_difference(
    found: &[(f64, f64)],
    expected: &[(f64, f64)],
    range: [f64; 2],
    difference: fn(f64, f64) -> f64,
) -> f64 {
    let mut largest = 0.0;
    for (time, value) in expected {
        if *time < range[0] - 1e-9 || *time > range[1] + 1e-9 {
            continue;
        }
        let difference = difference(value_at(found, *time), *value);
        if difference > largest || difference.is_nan() {
            largest = difference;
        }
    }
    largest
}

fn absolute(a: f64, b: f64) -> f64 {
    (a - b).abs()
}

fn relative(a: f64, b: f64) -> f64 {
    (a / b - 1.0).abs()
}

/// Fails unless `found` is at most `bar`.
fn assert_at_most(name: &str, found: f64, bar: f64) {
    eprintln!("{name}: {found} (at most {bar})");
    assert!(found <= bar, "{name}: {found}, at most {bar}");
}

/// Fails unless `found` is at least `bar`.
fn assert_at_least(name: &str, found: f64, bar: f64) {
    eprintln!("{name}: {found} (at least {bar})");
    assert!(found >= bar, "{name}: {found}, at least {bar}");
}

/// Fails unless `found` is within `bar` of `expected`.
fn assert_within(name: &str, found: f64, expected: f64, bar: f64) {
    eprintln!("{name}: {found} ({expected} within {bar})");
    let difference = (found - expected).abs();
    assert!(
        difference <= bar,
        "{name}: {found}, not {expected} within {bar}"
    );
}

/// Fails unless `found` is within the fraction `bar` of `expected`.
fn assert_relative(name: &str, found: f64, expected: f64, bar: f64) {
    assert_within(name, found, expected, bar * expected.abs());
}

/// The extremum of the parabola through three points.
fn parabola_vertex([a, b, c]: [(f64, f64); 3]) -> (f64, f64) {
    let left = (b.1 - a.1) / (b.0 - a.0);
    let right = (c.1 - b.1) / (c.0 - b.0);
    let bend = (right - left) / (c.0 - a.0);
    let x = 0.5 * (a.0 + b.0) - left / (2.0 * bend);
    let y = a.1 + left * (x - a.0) + bend * (x - a.0) * (x - b.0);
    (x, y)
}

#[test]
fn the_vertex_of_a_parabola_is_found_from_uneven_points() {
    let points = [0.0, 1.0, 4.0].map(|x: f64| (x, 3.0 - 2.0 * (x - 1.5).powi(2)));
    let (x, y) = parabola_vertex(points);
    assert!((x - 1.5).abs() < 1e-12 && (y - 3.0).abs() < 1e-12);
}
