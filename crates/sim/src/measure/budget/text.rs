//! A budget as a text and as a table.

use super::Budget;
use crate::io::Table;

impl Budget {
    /// The table `range_m,row,symbol,db`, range after range.
    pub fn table(&self) -> Table {
        let rows = || self.range_m.iter().enumerate().flat_map(|(i, r)| self.rows.iter().map(move |row| (i, *r, row)));
        Table::new()
            .float("range_m", rows().map(|(_, range_m, _)| range_m))
            .text("row", rows().map(|(_, _, row)| row.name))
            .text("symbol", rows().map(|(_, _, row)| row.symbol))
            .float("db", rows().map(|(i, _, row)| row.db[i]))
    }

    /// The table for people, with the limits and the warnings.
    pub fn text(&self) -> String {
        let columns =
            |cells: &mut dyn Iterator<Item = String>| cells.map(|cell| format!("{cell:>11}")).collect::<String>();
        let mut out = format!("power budget, dB; range in m\n{:66}", "");
        out += &(columns(&mut self.range_m.iter().map(f64::to_string)) + "\n");
        for row in &self.rows {
            let cells = columns(&mut row.db.iter().map(|db| format!("{db:.2}")));
            out += &format!("  {:<28}{:<36}{cells}\n", row.name, row.value);
        }
        out += "limits\n";
        for line in &self.limits.lines {
            out += &format!("  {line}\n");
        }
        for warning in &self.warnings {
            out += &format!("warning: {warning}\n");
        }
        out
    }

    /// The signal-to-noise ratio in one line.
    pub fn short(&self) -> String {
        let joined = |cells: Vec<String>| cells.join(", ");
        let ranges = joined(self.range_m.iter().map(f64::to_string).collect());
        let snr = joined(self.snr_db().iter().map(|db| format!("{db:.2}")).collect());
        format!("SNR in the band, one pulse, at {ranges} m: {snr} dB")
    }
}

/// A number in three digits with a prefix of its unit.
pub(super) fn si(value: f64, unit: &str) -> String {
    const PREFIXES: [(f64, &str); 9] = [
        (1e9, "G"),
        (1e6, "M"),
        (1e3, "k"),
        (1.0, ""),
        (1e-3, "m"),
        (1e-6, "u"),
        (1e-9, "n"),
        (1e-12, "p"),
        (1e-15, "f"),
    ];
    // 999.6 is 1.00 of the next prefix.
    match PREFIXES.iter().find(|(size, _)| value.abs() >= 0.9995 * size) {
        Some((size, prefix)) if value.is_finite() => format!("{} {prefix}{unit}", digits(value / size)),
        _ => format!("{} {unit}", scientific(value)),
    }
}

/// Three digits of a number from 1 to 1000, without zeros behind the point.
pub(super) fn digits(value: f64) -> String {
    let places = if value.abs() >= 99.95 { 0 } else { 1 + usize::from(value.abs() < 9.995) };
    let text = format!("{value:.places$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Three digits and a power of ten, as few of them as it takes.
pub(super) fn scientific(value: f64) -> String {
    let rounded: f64 = format!("{value:.2e}").parse().unwrap_or(value);
    format!("{rounded:e}")
}
