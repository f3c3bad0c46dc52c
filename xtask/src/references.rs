//! Stored numbers of flows, and what is read off a few of them.

use crate::workspace::read;
use fixtures::failure::Failure;

/// Numbers of a reference file without its comments, row by row.
pub(crate) fn numbers(file: &str) -> Result<Vec<Vec<f64>>, Failure> {
    let text = read(&format!("tests/reference/les/{file}"))?;
    let rows = text.lines().filter(|line| !line.starts_with('#'));
    let parse = |line: &str| line.split(',').map(|cell| cell.trim().parse().ok()).collect::<Option<Vec<f64>>>();
    Ok(rows.filter_map(parse).collect())
}

/// The extremum of the parabola through three points.
pub(crate) fn parabola_vertex([a, b, c]: [(f64, f64); 3]) -> (f64, f64) {
    let (left, right) = ((b.1 - a.1) / (b.0 - a.0), (c.1 - b.1) / (c.0 - b.0));
    let bend = (right - left) / (c.0 - a.0);
    let x = 0.5 * (a.0 + b.0) - left / (2.0 * bend);
    (x, a.1 + left * (x - a.0) + bend * (x - a.0) * (x - b.0))
}

#[cfg(test)]
mod tests {
    use super::parabola_vertex;

    #[test]
    fn the_vertex_of_a_parabola_is_found_from_uneven_points() {
        let (x, y) = parabola_vertex([0.0, 1.0, 4.0].map(|x: f64| (x, 3.0 - 2.0 * (x - 1.5).powi(2))));
        assert!((x - 1.5).abs() < 1e-12 && (y - 3.0).abs() < 1e-12);
    }
}
