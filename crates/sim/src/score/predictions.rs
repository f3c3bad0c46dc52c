//! Predictions: a CSV table with a row for each predicted vortex, or one with side `none` for a scan in which nothing was found.
//!
//! | column | content |
//! |---|---|
//! | `flight`, `scan` | numbers of the store, from 0 |
//! | `side` | `left`, `right`, `any` or empty, `none` |
//! | `y_m`, `z_m`, `gamma_5_15_m2_s` | place and circulation, positive for the vortex of that side |
//! | `y_std_m`, `z_std_m`, `gamma_5_15_std_m2_s` | standard deviations, if they are known |
//! | `score` | the larger, the surer of a wake; the highest of a scan counts; optional |
//!
//! Other columns are ignored. Check: each kind of bad input is refused with its row and column.

use super::truth::{Truth, VortexValues};
use super::{Quantity, ScoreOptions};
use crate::Error;
use crate::detection::ScanDetection;
use crate::io::Table;
use crate::io::csv_input::TextTable;
use crate::keys::one_of;
use std::collections::BTreeMap;
use std::path::Path;
use wakescope_estimate::Measured;
use wakescope_estimate::retrieval::{ScanResult, Side};
use wakescope_estimate::vortex_fit::WakeModel;

/// Most vortices that may be predicted for a scan: all of their assignments are tried.
pub const MOST_VORTICES: usize = 100;

/// A predicted vortex.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PredictedVortex {
    /// Which of the two; none if the method does not say.
    pub side: Option<Side>,
    /// Place and strength.
    pub values: VortexValues,
    /// Their standard deviations; NaN where none is stated.
    pub deviations: VortexValues,
}

/// What is predicted of a scan.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PredictedScan {
    /// The vortices, in the order of the rows.
    pub vortices: Vec<PredictedVortex>,
    /// Highest score of the rows, if one states any.
    pub score: Option<f64>,
}

impl PredictedVortex {
    /// None where the place or the circulation is not known. Deviations that are not positive are not known.
    fn new(side: Side, [y_m, z_m, gamma_5_15_m2_s]: [Measured; 3]) -> Option<Self> {
        let all = [y_m, z_m, gamma_5_15_m2_s];
        let are_known = all.iter().all(|measured| measured.value.is_finite());
        let is_known = |std: f64| std > 0.0 && std.is_finite();
        are_known.then(|| Self {
            side: Some(side),
            values: from_array(all.map(|measured| measured.value)),
            deviations: from_array(all.map(|measured| match is_known(measured.std) {
                true => measured.std,
                false => f64::NAN,
            })),
        })
    }
}

impl PredictedScan {
    /// The vortices of a retrieval. The score is the excess of its statistic over the threshold.
    #[must_use]
    pub fn from_retrieval(result: &ScanResult) -> Self {
        let vortices = result.vortices.iter().filter_map(|vortex| {
            let circulation = vortex.circulation_5_15_m2_s;
            let values = [vortex.lateral_position_m, vortex.height_m, circulation];
            PredictedVortex::new(vortex.side, values)
        });
        Self {
            vortices: vortices.collect(),
            score: Some(result.statistic - result.threshold).filter(|score| score.is_finite()),
        }
    }

    /// The best trial wake of a test, if it finds one. The score is the excess of its statistic over the threshold, in scales of the
    /// law of empty scans. Trial wakes lie on a grid, whose step says nothing of their places.
    #[must_use]
    pub fn from_detection(found: &ScanDetection, model: &WakeModel) -> Self {
        let mut vortices = Vec::new();
        let wake = found.statistic.wake;
        for (side, vortex) in Side::BOTH.into_iter().zip([wake.left, wake.right]) {
            if !found.is_wake() || vortex.circulation_m2_s <= 0.0 {
                continue;
            }
            let (share, _) = model.profile.mean_5_15(vortex.core_radius_m);
            let at = [vortex.lateral_position_m, vortex.height_m];
            let [y, z] = at.map(|value| Measured {
                value,
                std: f64::NAN,
            });
            let circulation = Measured {
                value: share * vortex.circulation_m2_s,
                std: share * found.statistic.circulation_std_m2_s,
            };
            vortices.extend(PredictedVortex::new(side, [y, z, circulation]));
        }
        let excess = (found.statistic.value - found.threshold) / found.gumbel.1;
        Self {
            vortices,
            score: Some(excess).filter(|score| score.is_finite()),
        }
    }
}

/// The table that [`Predictions::parse`] reads, of scans by flight and number.
#[must_use]
pub fn prediction_table(scans: &[(usize, usize, PredictedScan)]) -> Table {
    let mut rows: Vec<(usize, usize, Option<&PredictedVortex>, f64)> = Vec::new();
    for (flight, scan, found) in scans {
        let score = found.score.unwrap_or(f64::NAN);
        for vortex in &found.vortices {
            rows.push((*flight, *scan, Some(vortex), score));
        }
        if found.vortices.is_empty() {
            rows.push((*flight, *scan, None, score));
        }
    }
    let mut table = Table::new()
        .int("flight", rows.iter().map(|row| row.0 as i64))
        .int("scan", rows.iter().map(|row| row.1 as i64))
        .text("side", rows.iter().map(|row| side_name(row.2)));
    for quantity in Quantity::ALL {
        let values = rows
            .iter()
            .map(|row| known(row.2.map(|vortex| &vortex.values), quantity));
        let deviations = rows
            .iter()
            .map(|row| known(row.2.map(|vortex| &vortex.deviations), quantity));
        table = table
            .float(quantity.name(), values)
            .float(quantity.deviation_name(), deviations);
    }
    table.float("score", rows.iter().map(|row| row.3))
}

/// The side of a vortex, or of none, as rows have it.
fn side_name(vortex: Option<&PredictedVortex>) -> &'static str {
    match vortex.map(|vortex| vortex.side) {
        None => "none",
        Some(None) => "any",
        Some(Some(Side::Left)) => "left",
        Some(Some(Side::Right)) => "right",
    }
}

/// A quantity of a vortex; NaN of none.
fn known(values: Option<&VortexValues>, quantity: Quantity) -> f64 {
    values.map_or(f64::NAN, |values| values.value(quantity))
}

/// Predictions of the scans of some splits.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Predictions {
    /// By flight and scan.
    pub(super) scans: BTreeMap<(usize, usize), PredictedScan>,
    /// Rows of other splits, which were left out.
    pub other_splits: usize,
    /// Rows of flights that are not ready, which were left out.
    pub not_ready: usize,
    /// Scans without a row, taken for scans in which nothing was found.
    pub missing: usize,
}

impl Predictions {
    /// Reads the text of a file at `path` for the splits that are scored.
    ///
    /// # Errors
    /// With row and column: a column that is missing or there twice, text or an infinity for a number, a vortex without a place or a
    /// circulation, a deviation that is not positive, an unknown side, a flight or scan that the data set does not have, `none`
    /// beside a vortex, more than [`MOST_VORTICES`]; a scan without a row.
    pub fn parse(
        text: &str,
        path: &Path,
        truth: &Truth,
        options: &ScoreOptions,
    ) -> Result<Self, Error> {
        Self::read(text, truth, options).map_err(|reason| Error::input(path, reason))
    }

    fn read(text: &str, truth: &Truth, options: &ScoreOptions) -> Result<Self, String> {
        let table = TextTable::parse(text)?;
        let columns = Columns::find(&table)?;
        let mut predictions = Self::default();
        let mut nothing: BTreeMap<(usize, usize), usize> = BTreeMap::new();
        for index in 0..table.rows.len() {
            let key = columns.scan(index, truth)?;
            let claim = columns.claim(index)?;
            match &truth.flights[key.0] {
                Some(flight) if options.splits.contains(&flight.split) => {}
                Some(_) => {
                    predictions.other_splits += 1;
                    continue;
                }
                None => {
                    predictions.not_ready += 1;
                    continue;
                }
            }
            let scan = predictions.scans.entry(key).or_default();
            if let Some(score) = columns.score(index)? {
                scan.score = Some(scan.score.map_or(score, |other| other.max(score)));
            }
            match claim {
                Some(vortex) => scan.vortices.push(vortex),
                None => {
                    nothing.entry(key).or_insert(index);
                }
            }
            if scan.vortices.len() > MOST_VORTICES {
                let allowed = format!("at most {MOST_VORTICES} vortices of one scan");
                return Err(columns.refusal(index, "side", &allowed));
            }
            if let (false, Some(first)) = (scan.vortices.is_empty(), nothing.get(&key)) {
                let allowed = "a scan with a vortex in another row has no row with side none";
                return Err(columns.refusal(*first, "side", allowed));
            }
        }
        predictions.add_missing(truth, options)?;
        Ok(predictions)
    }

    /// Adds the scans without a row, or refuses the first of them.
    fn add_missing(&mut self, truth: &Truth, options: &ScoreOptions) -> Result<(), String> {
        for (number, flight) in truth.flights.iter().enumerate() {
            let split = flight.as_ref().map(|flight| flight.split);
            if !split.is_some_and(|split| options.splits.contains(&split)) {
                continue;
            }
            for scan in 0..truth.scans_per_flight {
                if self.scans.contains_key(&(number, scan)) {
                    continue;
                }
                if !options.missing_is_none {
                    return Err(format!(
                        "scan {scan} of flight {number} has no row: a row with side none says that nothing was found, \
                         --missing-is-none that no row says so"
                    ));
                }
                self.scans.insert((number, scan), PredictedScan::default());
                self.missing += 1;
            }
        }
        Ok(())
    }
}

/// A table with the indices of the columns of predictions.
struct Columns<'t> {
    table: &'t TextTable,
    flight: usize,
    scan: usize,
    side: usize,
    values: [usize; 3],
    deviations: [Option<usize>; 3],
    score: Option<usize>,
}

impl<'t> Columns<'t> {
    fn find(table: &'t TextTable) -> Result<Self, String> {
        let mut values = [0; 3];
        let mut deviations = [None; 3];
        for (index, quantity) in Quantity::ALL.into_iter().enumerate() {
            values[index] = needed(table, quantity.name())?;
            deviations[index] = single(table, quantity.deviation_name())?;
        }
        Ok(Self {
            table,
            flight: needed(table, "flight")?,
            scan: needed(table, "scan")?,
            side: needed(table, "side")?,
            values,
            deviations,
            score: single(table, "score")?,
        })
    }
}

/// The index of a column that predictions must have.
fn needed(table: &TextTable, name: &str) -> Result<usize, String> {
    single(table, name)?.ok_or_else(|| {
        let names = "flight, scan, side, y_m, z_m and gamma_5_15_m2_s";
        format!("it has no column {name}: predictions have {names}")
    })
}

/// The index of a column that predictions may have once.
fn single(table: &TextTable, name: &str) -> Result<Option<usize>, String> {
    match table.columns_of(name) {
        0 | 1 => Ok(table.column(name)),
        count => Err(format!(
            "it has {count} columns {name}: predictions have one of that name"
        )),
    }
}

impl Columns<'_> {
    fn cell(&self, row: usize, column: usize) -> &str {
        self.table.rows[row][column].trim()
    }

    /// What is wrong with the cell of a column.
    fn refusal(&self, row: usize, column: &str, allowed: &str) -> String {
        let index = self.table.column(column);
        let value = index.map_or("", |index| self.cell(row, index));
        format!("row {}, column {column} = {value:?}: {allowed}", row + 1)
    }

    /// A number; NaN where the cell is empty or `nan`.
    fn number(&self, row: usize, column: usize) -> Result<f64, String> {
        let cell = self.cell(row, column);
        let value = self.table.number(row, column);
        if value.is_finite() || cell.is_empty() || cell.eq_ignore_ascii_case("nan") {
            return Ok(value);
        }
        Err(self.refusal(row, &self.table.header[column], "must be a finite number"))
    }

    /// A whole number below a limit.
    fn index(&self, row: usize, column: usize, count: usize, of: &str) -> Result<usize, String> {
        let value = self.number(row, column)?;
        if value.fract() == 0.0 && (0.0..count as f64).contains(&value) {
            return Ok(value as usize);
        }
        let last = count.saturating_sub(1);
        let allowed = format!("there are {of} 0 to {last}");
        Err(self.refusal(row, &self.table.header[column], &allowed))
    }

    /// Flight and scan.
    fn scan(&self, row: usize, truth: &Truth) -> Result<(usize, usize), String> {
        let flight = self.index(row, self.flight, truth.flights.len(), "flights")?;
        let scan = self.index(row, self.scan, truth.scans_per_flight, "scans")?;
        Ok((flight, scan))
    }

    fn score(&self, row: usize) -> Result<Option<f64>, String> {
        let score = self.score.map(|column| self.number(row, column));
        Ok(score.transpose()?.filter(|score| !score.is_nan()))
    }

    /// The vortex of the row; none where nothing was found.
    fn claim(&self, row: usize) -> Result<Option<PredictedVortex>, String> {
        let side = match self.cell(row, self.side) {
            "none" => return Ok(None),
            "left" => Some(Side::Left),
            "right" => Some(Side::Right),
            "" | "any" => None,
            _ => {
                let names = ["left", "right", "any", "none"];
                let allowed = one_of(&names, self.cell(row, self.side));
                return Err(self.refusal(row, "side", &allowed));
            }
        };
        let mut values = [0.0; 3];
        let mut deviations = [f64::NAN; 3];
        for (index, quantity) in Quantity::ALL.into_iter().enumerate() {
            values[index] = self.number(row, self.values[index])?;
            if values[index].is_nan() {
                let allowed =
                    "a vortex has a place and a circulation; side none says that nothing was found";
                return Err(self.refusal(row, quantity.name(), allowed));
            }
            if let Some(column) = self.deviations[index] {
                deviations[index] = self.number(row, column)?;
                if deviations[index] <= 0.0 {
                    let allowed = "must be above 0, or empty where it is not known";
                    return Err(self.refusal(row, quantity.deviation_name(), allowed));
                }
            }
        }
        Ok(Some(PredictedVortex {
            side,
            values: from_array(values),
            deviations: from_array(deviations),
        }))
    }
}

/// In the order of [`Quantity::ALL`].
fn from_array([y_m, z_m, gamma_5_15_m2_s]: [f64; 3]) -> VortexValues {
    VortexValues {
        y_m,
        z_m,
        gamma_5_15_m2_s,
    }
}

#[cfg(test)]
mod tests {
    use super::super::truth::{TrueFlight, TrueScan};
    use super::*;
    use crate::io::data_set::Split;

    fn truth() -> Truth {
        let scan = TrueScan {
            age_tau: f64::NAN,
            vortices: Vec::new(),
        };
        let flight = |split| TrueFlight {
            split,
            site: 0,
            snr_db: 0.0,
            dissipation_m2_s3: 1e-3,
            spacing_m: 40.0,
            scans: vec![scan.clone(); 2],
        };
        Truth {
            flights: vec![
                Some(flight(Split::Train)),
                Some(flight(Split::TestHome)),
                None,
            ],
            scans_per_flight: 2,
        }
    }

    const HEADER: &str = "flight,scan,side,y_m,z_m,gamma_5_15_m2_s,y_std_m,score,note";

    fn parse(rows: &str, missing_is_none: bool) -> Result<Predictions, String> {
        let options = ScoreOptions {
            missing_is_none,
            ..ScoreOptions::default()
        };
        Predictions::read(&format!("{HEADER}\n{rows}"), &truth(), &options)
    }

    #[test]
    fn rows_are_read_and_those_of_other_flights_counted() {
        let rows = "1,0,left,1.5,50,300,2.5,0.25,x\n1,0,,2,60,200,,0.75,\n1,1,none,,,,,-1,\n0,0,any,1,2,3,,,\n2,1,none,,,,,,\n";
        let read = parse(rows, false).unwrap();
        let scan = &read.scans[&(1, 0)];
        assert_eq!((scan.vortices.len(), scan.score), (2, Some(0.75)));
        assert_eq!(scan.vortices[0].side, Some(Side::Left));
        assert_eq!(scan.vortices[0].deviations.y_m, 2.5);
        assert!(scan.vortices[0].deviations.z_m.is_nan() && scan.vortices[1].side.is_none());
        assert_eq!(read.scans[&(1, 1)].score, Some(-1.0));
        assert_eq!((read.other_splits, read.not_ready, read.missing), (1, 1, 0));
        let read = parse("1,0,none,,,,,,\n", true).unwrap();
        assert_eq!((read.scans.len(), read.missing), (2, 1));
    }

    #[test]
    fn bad_rows_are_refused_with_row_and_column() {
        let good = "1,1,none,,,,,,\n";
        for (row, message) in [
            (
                "1,0,left,x,50,300,,,",
                "row 2, column y_m = \"x\": must be a finite number",
            ),
            (
                "1,0,left,1,inf,300,,,",
                "row 2, column z_m = \"inf\": must be a finite number",
            ),
            (
                "1,0,left,1,,300,,,",
                "row 2, column z_m = \"\": a vortex has a place",
            ),
            (
                "1,0,left,1,50,,,,",
                "row 2, column gamma_5_15_m2_s = \"\": a vortex has a place",
            ),
            (
                "1,0,left,1,50,300,0,,",
                "row 2, column y_std_m = \"0\": must be above 0",
            ),
            (
                "1,0,left,1,50,300,,inf,",
                "row 2, column score = \"inf\": must be a finite number",
            ),
            ("1,0,port,1,50,300,,,", "row 2, column side = \"port\": "),
            (
                "3,0,none,,,,,,",
                "row 2, column flight = \"3\": there are flights 0 to 2",
            ),
            (
                "-1,0,none,,,,,,",
                "row 2, column flight = \"-1\": there are flights 0 to 2",
            ),
            (
                "1,2,none,,,,,,",
                "row 2, column scan = \"2\": there are scans 0 to 1",
            ),
            (
                "1,0.5,none,,,,,,",
                "row 2, column scan = \"0.5\": there are scans 0 to 1",
            ),
            (
                ",0,none,,,,,,",
                "row 2, column flight = \"\": there are flights 0 to 2",
            ),
            (
                "1,1,left,1,50,300,,,",
                "row 1, column side = \"none\": a scan with a vortex",
            ),
            ("0,1,none,,,,,,", "scan 0 of flight 1 has no row"),
        ] {
            let refused = parse(&format!("{good}{row}\n"), false).unwrap_err();
            assert!(refused.starts_with(message), "{row}: {refused}");
        }
        let many = "1,0,left,1,50,300,,,\n".repeat(MOST_VORTICES + 1);
        let refused = parse(&many, true).unwrap_err();
        assert!(refused.contains("at most 100 vortices"), "{refused}");
    }

    #[test]
    fn what_is_written_is_read_again() {
        let known = Measured {
            value: 1.5,
            std: 0.25,
        };
        let unknown = Measured {
            value: 50.0,
            std: 0.0,
        };
        let vortex = PredictedVortex::new(Side::Right, [known, unknown, known]).unwrap();
        assert!(vortex.deviations.z_m.is_nan() && vortex.deviations.y_m == 0.25);
        let missing = Measured {
            value: f64::NAN,
            std: 1.0,
        };
        assert_eq!(
            PredictedVortex::new(Side::Left, [known, known, missing]),
            None
        );
        let without_side = PredictedVortex {
            side: None,
            ..vortex
        };
        let found = PredictedScan {
            vortices: vec![vortex, without_side],
            score: Some(-2.5),
        };
        let scans = [(1, 0, found.clone()), (1, 1, PredictedScan::default())];
        let origin = crate::io::Provenance::new("", "", 1);
        let text = prediction_table(&scans).to_csv(&origin).unwrap();
        let read = Predictions::read(&text, &truth(), &ScoreOptions::default()).unwrap();
        // Numbers that are not known do not compare.
        assert_eq!(format!("{:?}", read.scans[&(1, 0)]), format!("{found:?}"));
        assert_eq!(read.scans[&(1, 1)], PredictedScan::default());
    }

    #[test]
    fn a_column_that_is_there_twice_is_named() {
        for (name, other) in [
            ("y_m", "y_m"),
            ("gamma_5_15_m2_s", "Gamma_5_15_m2_s"),
            ("y_std_m", "y_std_m"),
            ("score", "score"),
        ] {
            let text = format!("{HEADER},{other}\n1,0,none,,,,,,,\n1,1,none,,,,,,,\n");
            let refused = Predictions::read(&text, &truth(), &ScoreOptions::default());
            let wanted = format!("it has 2 columns {name}: ");
            let refused = refused.unwrap_err();
            assert!(refused.starts_with(&wanted), "{refused}");
        }
        // Those that are not read may be there twice.
        let text = format!("{HEADER},note\n1,0,none,,,,,,,\n1,1,none,,,,,,,\n");
        let read = Predictions::read(&text, &truth(), &ScoreOptions::default());
        assert_eq!(read.unwrap().scans.len(), 2);
    }

    #[test]
    fn a_column_that_is_missing_is_named() {
        for name in ["flight", "scan", "side", "y_m", "z_m", "gamma_5_15_m2_s"] {
            let text = format!("{}\n", HEADER.replacen(name, "other", 1));
            let refused = Predictions::read(&text, &truth(), &ScoreOptions::default());
            let refused = refused.unwrap_err();
            assert!(
                refused.starts_with(&format!("it has no column {name}:")),
                "{refused}"
            );
        }
    }
}
