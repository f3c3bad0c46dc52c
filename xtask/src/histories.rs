//! `cargo xtask histories`: what the book says of the wakes at the chapter's Reynolds number, from the histories that it keeps.
//!
//! Check: the tables of the book are those that are printed.

use crate::workspace::root;
use fixtures::failure::{Failure, Outcome};
use std::collections::HashMap;
use wakescope_les::analysis::decay::{knee, onset, value_at};
use wakescope_sim::flow::table;

/// Heading of a column, and the history without its beginning and end.
type Column = (&'static str, &'static str);
const MESHES: [(&str, &[Column]); 2] = [
    (
        "32 x 160 x 96 cells",
        &[
            ("1 %", "1"),
            ("0.3 %", "0.3"),
            ("0.1 %", "0.1"),
            ("0.03 %", "0.03"),
        ],
    ),
    (
        "64 x 256 x 144 cells",
        &[
            ("1 %", "1_fine"),
            ("0.3 %", "0.3_fine"),
            ("0.3 %, 80 x 320 x 180", "0.3_finer"),
            ("0.1 %", "0.1_fine"),
            ("0.03 %", "0.03_fine"),
        ],
    ),
];

/// Prints the tables.
///
/// # Errors
/// A history that cannot be read or lacks a column.
pub(crate) fn run() -> Outcome {
    for (mesh, columns) in MESHES {
        println!("{mesh}:\n{}", rows(columns)?);
    }
    Ok(())
}

/// When the fast decay begins, what is left at the end and how far the vortices swing back, at each noise on the finer of the meshes.
///
/// # Errors
/// As [`run`].
pub(crate) fn by_noise() -> Result<String, Failure> {
    let (mesh, columns) = MESHES[1];
    let told = columns.iter().map(|(heading, name)| {
        let run = Run::read(name)?;
        let begins = knee(&run.mean).map_or("never".into(), |tau| format!("{tau:.2}"));
        Ok(format!(
            "{heading}: {begins}, {:.2}, {:.2}",
            value_at(&run.mean, 5.0),
            run.swing_back
        ))
    });
    let told = told.collect::<Result<Vec<_>, Failure>>()?;
    let what = "where lines meet, what is left, how far in b₀ they swing back, by the noise, which is free";
    Ok(format!("at 2e4 on {mesh}, {what}: {}", told.join("; ")))
}

fn rows(columns: &[Column]) -> Result<String, Failure> {
    let runs = columns
        .iter()
        .map(|(_, name)| Run::read(name))
        .collect::<Result<Vec<_>, _>>()?;
    let headings: Vec<&str> = columns.iter().map(|column| column.0).collect();
    let mut text = format!(
        "| noise, of V₀ | {} |\n|---|{}\n",
        headings.join(" | "),
        "---|".repeat(runs.len())
    );
    let mut row = |name: &str, cell: &dyn Fn(&Run) -> String| {
        let cells: Vec<String> = runs.iter().map(cell).collect();
        text += &format!("| {name} | {} |\n", cells.join(" | "));
    };
    for (tau, name) in [
        (2.0, "Γ₅₋₁₅ over its start at τ = 2 (left, right)"),
        (3.0, "at 3"),
        (4.0, "at 4"),
        (5.0, "at 5"),
    ] {
        row(name, &|run| {
            run.sides
                .each_ref()
                .map(|side| format!("{:.3}", value_at(side, tau)))
                .join(", ")
        });
    }
    let age = |tau: Option<f64>| tau.map_or("never".into(), |tau| format!("{tau:.2}"));
    row("early and steepest line of Γ meet at τ", &|run| {
        age(knee(&run.mean))
    });
    row("loss exceeds three times the early one at τ", &|run| {
        age(onset(&run.mean))
    });
    row("the vortices swing back by, b₀", &|run| {
        format!("{:.2}", run.swing_back)
    });
    Ok(text)
}

/// What is read off a history.
struct Run {
    /// Circulation of the left and the right vortex over that at the start, against tau.
    sides: [Vec<(f64, f64)>; 2],
    mean: Vec<(f64, f64)>,
    /// From the widest place inwards, in spacings.
    swing_back: f64,
}

impl Run {
    fn read(name: &str) -> Result<Self, Failure> {
        let columns = table(&root().join(format!("docs/src/histories/wake_2e4_noise_{name}.csv")))?;
        let tau = column(&columns, "tau")?;
        let [gl, gr] = [
            column(&columns, "gamma_5_15_left")?,
            column(&columns, "gamma_5_15_right")?,
        ];
        let [yl, yr] = [column(&columns, "y_left")?, column(&columns, "y_right")?];
        let against = |values: Vec<f64>| tau.iter().copied().zip(values).collect::<Vec<_>>();
        let sides =
            [gl, gr].map(|gamma| against(gamma.iter().map(|value| value / gamma[0]).collect()));
        let mean = sides[0]
            .iter()
            .zip(&sides[1])
            .map(|(left, right)| (left.0, 0.5 * (left.1 + right.1)))
            .collect();
        let [(_, widest), (_, inner)] = swing(&against(
            yl.iter().zip(yr).map(|(l, r)| 0.5 * (r - l)).collect(),
        ));
        Ok(Self {
            sides,
            mean,
            swing_back: widest - inner,
        })
    }
}

/// The widest place of a path `y` until `tau = 3`, and the innermost after it.
pub(crate) fn swing(y: &[(f64, f64)]) -> [(f64, f64); 2] {
    let widest = y
        .iter()
        .filter(|p| p.0 < 3.0)
        .fold((0.0, 0.0), |m, p| if p.1 > m.1 { *p } else { m });
    let inner = y
        .iter()
        .filter(|p| p.0 > widest.0)
        .fold((0.0, f64::INFINITY), |m, p| if p.1 < m.1 { *p } else { m });
    [widest, inner]
}

fn column<'a>(columns: &'a HashMap<String, Vec<f64>>, name: &str) -> Result<&'a [f64], Failure> {
    let found = columns.get(name).filter(|values| !values.is_empty());
    found
        .map(Vec::as_slice)
        .ok_or_else(|| Failure::new(format!("a history has no column {name}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_book_has_what_its_histories_tell() {
        let page = std::fs::read_to_string(root().join("docs/src/validation-flow.md")).unwrap();
        for (mesh, columns) in MESHES {
            let text = rows(columns).unwrap();
            assert!(
                page.contains(&text),
                "docs/src/validation-flow.md lacks, for {mesh},\n{text}"
            );
        }
    }
}
