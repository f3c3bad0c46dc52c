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
}
