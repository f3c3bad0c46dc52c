//! `cargo xtask regress`: what the crates compute now against the curves stored in
//! `tests/reference/`, as a table of name, error, tolerance, run time and verdict.

use crate::workspace::{provenance, root, unless};
use fixtures::failure::{Failure, Outcome};
use std::time::Instant;
use wakescope_sim::plot::{Axis, CurvePlot, Figure, Series, Style};
use wakescope_tests::curves::{ALL, Comparison, Curve};

/// Options of the task.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Compare only the curves whose name contains this.
    #[arg(long, value_name = "WORD")]
    only: Option<String>,
}

/// Compares all curves; on failure draws stored and computed curve over one another.
///
/// # Errors
/// When a curve is out of tolerance or cannot be read or computed.
pub(crate) fn run(options: &Options) -> Outcome {
    let wanted = |c: &&Curve| {
        options
            .only
            .as_ref()
            .is_none_or(|word| c.name.contains(word.as_str()))
    };
    let mut failed = Vec::new();
    for curve in ALL.iter().filter(wanted) {
        let start = Instant::now();
        let compared = curve.compare();
        let time_s = start.elapsed().as_secs_f64();
        let told = match compared {
            Ok(c) if c.is_within(curve) => format!("pass, {}", told(curve, &c)),
            Ok(c) => format!("FAIL, {}; see {}", told(curve, &c), draw(curve, &c)?),
            Err(failure) => format!("ERROR: {failure}"),
        };
        println!("{:<34} {time_s:>7.3} s  {told}", curve.name);
        failed.extend((!told.starts_with("pass")).then_some(curve.name));
    }
    unless("regress: out of tolerance", &failed)
}

fn told(curve: &Curve, c: &Comparison) -> String {
    let (points, error, place) = (c.x.len(), c.worst_error, c.x[c.worst]);
    format!(
        "{points} points, error {error:.3e} of {:.1e} at most, worst at {} = {place}",
        curve.tolerance, curve.x
    )
}

fn draw(curve: &Curve, c: &Comparison) -> Result<String, Failure> {
    let points = |y: &[f64]| {
        c.x.iter()
            .copied()
            .zip(y.iter().copied())
            .collect::<Vec<_>>()
    };
    let plot = CurvePlot::new(curve.name, Axis::linear(curve.x), Axis::linear(curve.y))
        .with(Series::new("stored", Style::Line, points(&c.stored)))
        .with(Series::new("computed", Style::Dash, points(&c.computed)));
    let folder = root().join("target/regress");
    std::fs::create_dir_all(&folder)?;
    let path = folder.join(format!("{}.svg", curve.name.replace('/', "_")));
    let origin = provenance(&format!("curve = \"{}\"\n", curve.name), 0);
    std::fs::write(&path, Figure::stacked([plot]).svg(&origin)?)?;
    Ok(path.display().to_string())
}
