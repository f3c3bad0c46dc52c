//! What other programs need for the same work: the tables of `docs/peers`, measured by hand, their times scaled to this machine.

use super::{Found, Row, physics};
use crate::cost::Cost;
use crate::workspace::root;
use fixtures::failure::Failure;
use wakescope_sim::io::csv_input::TextTable;

/// Rows of all tables of other programs, the times multiplied by what the kernel takes here over what it took there.
pub(super) fn rows() -> Result<Vec<Row>, Failure> {
    let kernel_s = physics::kernel_s()?;
    let mut paths = Vec::new();
    for entry in std::fs::read_dir(root().join("docs/peers"))? {
        let path = entry?.path();
        if path.extension().is_some_and(|e| e == "csv") {
            paths.push(path);
        }
    }
    paths.sort();
    let mut rows = Vec::new();
    for path in paths {
        let name = path.display();
        let table = TextTable::read(&path)?;
        let there_s = kernel_of(&table)
            .ok_or_else(|| Failure::new(format!("{name}: its head has no kernel_s")))?;
        for cells in &table.rows {
            let row = row(cells, kernel_s / there_s)
                .ok_or_else(|| Failure::new(format!("{name}: not a row: {}", cells.join(","))))?;
            rows.push(row);
        }
    }
    Ok(rows)
}

/// Run time of the kernel on the machine of a table \[s\].
fn kernel_of(table: &TextTable) -> Option<f64> {
    let mut lines = table.comment.lines();
    let value = lines.find_map(|line| line.trim().strip_prefix("kernel_s = "))?;
    value.parse().ok()
}

/// `panel,method,version,value,error,standard_error,cpu_s`.
fn row(cells: &[String], scale: f64) -> Option<Row> {
    let [case, method, version, numbers @ ..] = cells else {
        return None;
    };
    let numbers: Vec<f64> = numbers
        .iter()
        .map(|n| n.parse().ok())
        .collect::<Option<_>>()?;
    let &[value, error, standard_error, cpu_s] = &numbers[..] else {
        return None;
    };
    let cost = Cost {
        cpu_s: cpu_s * scale,
        wall_s: f64::NAN,
        peak_mem_bytes: f64::NAN,
    };
    let found = Found {
        error,
        standard_error,
        cost,
        set_up_s: f64::NAN,
    };
    (!version.is_empty()).then(|| Row {
        version: version.clone(),
        ..Row::new([case, method, ""], value, found)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_keeps_its_commas_and_its_time_is_scaled() {
        let row = |line: &str| {
            let head = "panel,method,version,value,error,standard_error,cpu_s";
            row(
                TextTable::parse(&format!("{head}\n{line}"))
                    .ok()?
                    .rows
                    .first()?,
                0.5,
            )
        };
        let found = row("\"0 dB, white\",\"numpy, PA\",2.4.6,128,0.15,0.02,4e-6").unwrap();
        assert_eq!(
            (found.case.as_str(), found.method.as_str()),
            ("0 dB, white", "numpy, PA")
        );
        assert_eq!(
            (found.version.as_str(), found.value, found.found.cost.cpu_s),
            ("2.4.6", 128.0, 2e-6)
        );
        assert!(row("a,b,c").is_none() && row("screens,numpy,,128,0.15,0.02,4e-6").is_none());
    }
}
