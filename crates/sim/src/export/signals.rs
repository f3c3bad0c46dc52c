//! Raw signals at the border to files, and their table.
//! Check: the tests compare the table with the array.

use super::csv::Table;
use super::error::{OutputError, OutputResult, increasing, same_length};
use ndarray::Array2;

/// The signals of a scan, pulse by pulse.
#[derive(Debug, Clone, PartialEq)]
pub struct RawSignals {
    /// Current of the detector `[pulse, sample]`, A.
    pub current_a: Array2<f64>,
    /// Second quadrature of a complex baseband signal, whose first is `current_a`.
    pub quadrature_a: Option<Array2<f64>>,
    /// Elevation of each pulse, rad.
    pub elevation_rad: Vec<f64>,
    /// Time of each sample after the middle of the pulse left, s; increasing.
    pub time_s: Vec<f64>,
    /// Pulses of one line of sight, which stand together.
    pub pulses_per_line: usize,
}

impl RawSignals {
    /// Checks the shapes.
    ///
    /// # Errors
    /// Lengths that do not match, times that do not increase, values that are not finite.
    pub fn check(&self) -> OutputResult<()> {
        increasing("time_s", &self.time_s)?;
        same_length("current_a", self.current_a.ncols(), "time_s", self.time_s.len())?;
        same_length("current_a", self.current_a.nrows(), "elevation_rad", self.elevation_rad.len())?;
        if let Some(quadrature) = &self.quadrature_a {
            same_length("quadrature_a", quadrature.nrows(), "elevation_rad", self.elevation_rad.len())?;
            same_length("quadrature_a", quadrature.ncols(), "time_s", self.time_s.len())?;
        }
        match self.current_a.iter().chain(self.quadrature_a.iter().flatten()).find(|a| !a.is_finite()) {
            Some(bad) => Err(OutputError::value("current_a", bad, "must be finite")),
            None => Ok(()),
        }
    }

    /// The first pulse of each line as a long table; the NetCDF file holds all pulses.
    ///
    /// # Errors
    /// As [`RawSignals::check`].
    pub fn table(&self) -> OutputResult<Table> {
        self.check()?;
        let rays: Vec<usize> = (0..self.current_a.nrows()).step_by(self.pulses_per_line.max(1)).collect();
        let samples = self.time_s.len();
        let cells = || rays.iter().flat_map(|&ray| (0..samples).map(move |k| (ray, k)));
        let table = Table::new()
            .int("ray", cells().map(|(ray, _)| ray as i64))
            .float("time_s", cells().map(|(_, k)| self.time_s[k]))
            .float("current_a", cells().map(|(ray, k)| self.current_a[[ray, k]]));
        Ok(match &self.quadrature_a {
            Some(quadrature) => table.float("quadrature_a", cells().map(|(ray, k)| quadrature[[ray, k]])),
            None => table,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_holds_the_first_pulse_of_each_line() {
        let signals = RawSignals {
            current_a: Array2::from_shape_fn((4, 3), |(i, k)| (10 * i + k) as f64),
            quadrature_a: None,
            elevation_rad: vec![0.0, 0.0, 0.1, 0.1],
            time_s: vec![1e-6, 2e-6, 3e-6],
            pulses_per_line: 2,
        };
        let table = signals.table().unwrap();
        let current = &table.columns()[2].1;
        assert_eq!(*current, crate::export::csv::Column::Float(vec![0.0, 1.0, 2.0, 20.0, 21.0, 22.0]));
        assert!(RawSignals { time_s: vec![1.0], ..signals }.check().is_err());
    }
}
