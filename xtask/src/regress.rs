//! `cargo xtask regress`: what the crates compute now against the curves stored in
//! `tests/reference/`, as a table of name, error, tolerance, run time and verdict.

use crate::workspace::{provenance, root, unless};
use fixtures::failure::{Failure, Outcome};
use std::time::Instant;
use wakescope_sim::plot::{Axis, CurvePlot, Figure, Series, Style};
use wakescope_tests::curves::{ALL, Comparison, Curve};

/// Compares all curves; on failure draws stored and computed curve over one another.
///
/// # Errors
/// When a curve is out of tolerance or cannot be read or computed.
pub(crate) fn run(only: Option<&str>) -> Outcome {
    let mut failed = Vec::new();
    for curve in &ALL {
        if only.is_some_and(|word| !curve.name.contains(word)) {
            continue;
        }
        let start = Instant::now();
        let compared = curve.compare();
        let time_s = start.elapsed().as_secs_f64();
        let outcome = match compared {
            Ok(c) if c.is_within(curve) => format!("pass, {}", words(curve, &c)),
            Ok(c) => {
                failed.push(curve.name);
                format!("FAIL, {}; see {}", words(curve, &c), draw(curve, &c)?)
            }
            Err(failure) => {
                failed.push(curve.name);
                format!("ERROR: {failure}")
            }
        };
        println!("{:<34} {time_s:>7.3} s  {outcome}", curve.name);
    }
    unless("regress: out of tolerance", &failed)
}

fn words(curve: &Curve, c: &Comparison) -> String {
    format!(
        "{} points, error {:.3e} of {:.1e} at most, worst at {} = {}",
        c.x.len(),
        c.worst_error,
        curve.tolerance,
        curve.x,
        c.x[c.worst]
    )
}

/// The points of a curve.
fn points(x: &[f64], y: &[f64]) -> Vec<(f64, f64)> {
    x.iter().copied().zip(y.iter().copied()).collect()
}

fn draw(curve: &Curve, c: &Comparison) -> Result<String, Failure> {
    let stored = Series::new("stored", Style::Line, points(&c.x, &c.stored));
    let computed = Series::new("computed", Style::Dash, points(&c.x, &c.computed));
    let plot = CurvePlot::new(curve.name, Axis::linear(curve.x), Axis::linear(curve.y))
        .with(stored)
        .with(computed);
    let folder = root().join("target/regress");
    std::fs::create_dir_all(&folder)?;
    let path = folder.join(format!("{}.svg", curve.name.replace('/', "_")));
    let origin = provenance(&format!("curve = \"{}\"\n", curve.name), 0);
    std::fs::write(&path, Figure::stacked([plot]).svg(&origin)?)?;
    Ok(path.display().to_string())
}
