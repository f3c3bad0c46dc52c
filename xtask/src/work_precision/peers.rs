//! What other programs need for the same work: the tables of `docs/peers`, measured by hand, their times scaled to this machine.

use super::{Found, Knob, Row, physics};
use crate::cost::Cost;
use crate::workspace::{read, root};
use fixtures::failure::Failure;

/// Rows of all tables of other programs, the times multiplied by what the kernel takes here over what it took there.
pub(super) fn rows() -> Result<Vec<Row>, Failure> {
    let kernel_s = physics::kernel_s()?;
    let mut rows = Vec::new();
    let mut files: Vec<_> = std::fs::read_dir(root().join("docs/peers"))?.collect::<Result<_, _>>()?;
    files.sort_by_key(std::fs::DirEntry::path);
    for file in files.iter().filter(|file| file.path().extension().is_some_and(|e| e == "csv")) {
        let name = format!("docs/peers/{}", file.file_name().display());
        let text = read(&name)?;
        let there_s = text.lines().find_map(|line| line.strip_prefix("# kernel_s = ")?.parse::<f64>().ok());
        let there_s = there_s.ok_or_else(|| Failure::new(format!("{name}: its head does not say kernel_s")))?;
        for line in text.lines().filter(|line| !line.starts_with('#')).skip(1) {
            rows.push(row(line, kernel_s / there_s).ok_or_else(|| Failure::new(format!("{name}: not a row: {line}")))?);
        }
    }
    Ok(rows)
}

/// `panel,method,version,value,error,standard_error,cpu_s`; a method with a comma is in quotation marks.
fn row(line: &str, scale: f64) -> Option<Row> {
    let (before, numbers) = line.rsplitn(5, ',').collect::<Vec<_>>().split_last().map(|(b, n)| (*b, n.to_vec()))?;
    let [cpu_s, standard_error, error, value] =
        numbers.iter().map(|n| n.parse::<f64>().ok()).collect::<Option<Vec<_>>>()?[..]
    else {
        return None;
    };
    let (named, version) = before.rsplit_once(',').filter(|(_, version)| !version.is_empty())?;
    let (case, method) = named.split_once(',')?;
    let (case, method) = if case.starts_with('"') { named.split_once("\",")? } else { (case, method) };
    let plain = |text: &str| text.trim_matches('"').to_owned();
    // What is measured, and against what, is as in the rows of this program.
    let knob = Knob { case: plain(case), method: plain(method), knob: "", metric: "", reference: "" };
    let cost = Cost { cpu_s: cpu_s * scale, wall_s: f64::NAN, peak_mem_bytes: f64::NAN };
    let mut row = knob.row(value, Found { error, standard_error, cost, set_up_s: f64::NAN });
    row.version = version.to_owned();
    Some(row)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_keeps_its_commas_and_its_time_is_scaled() {
        let found = row("\"0 dB, white\",\"numpy, PA\",2.4.6,128,0.15,0.02,4e-6", 0.5).unwrap();
        assert_eq!((found.knob.case.as_str(), found.knob.method.as_str()), ("0 dB, white", "numpy, PA"));
        assert_eq!((found.version.as_str(), found.value, found.found.cost.cpu_s), ("2.4.6", 128.0, 2e-6));
        assert!(row("a,b,c", 1.0).is_none() && row("screens,numpy,,128,0.15,0.02,4e-6", 1.0).is_none());
    }
}
