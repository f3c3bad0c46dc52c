//! Wind across stares: as stated, or from the `wind.csv` of another scan.
//!
//! Check: `wind` in the tests of the program.

use super::windows::Window;
use crate::Error;
use crate::io::UtcTime;
use crate::io::csv_input::TextTable;
use std::path::Path;

/// Wind across beams of which the direction shows none.
#[derive(Debug, Clone, PartialEq)]
pub struct CrossWind {
    /// Middle of its window, if it has a date.
    time: Option<UtcTime>,
    height_m: f64,
    /// East and north, m/s.
    wind_m_s: [f64; 2],
}

impl CrossWind {
    /// One wind, east and north, m/s, for all times and heights.
    #[must_use]
    pub fn uniform(wind_m_s: [f64; 2]) -> Self {
        Self {
            time: None,
            height_m: 0.0,
            wind_m_s,
        }
    }

    /// The winds of a `wind.csv`.
    ///
    /// # Errors
    /// A table that cannot be read, without the columns of a wind, or without a row that has one.
    pub fn read(path: &Path) -> Result<Vec<Self>, Error> {
        let table = TextTable::read(path)?;
        let column = |name: &str| {
            let reason =
                format!("it has no column {name}: a wind.csv of `wakescope wind` is needed");
            table.column(name).ok_or_else(|| Error::input(path, reason))
        };
        let height = column("height_m")?;
        let east = column("east_m_s")?;
        let north = column("north_m_s")?;
        let start = column("start_utc")?;
        let end = column("end_utc")?;
        let mut known = Vec::new();
        for row in 0..table.rows.len() {
            let wind_m_s = [table.number(row, east), table.number(row, north)];
            let height_m = table.number(row, height);
            if !(wind_m_s[0] + wind_m_s[1] + height_m).is_finite() {
                continue;
            }
            let first = UtcTime::parse(&table.rows[row][start]);
            let last = UtcTime::parse(&table.rows[row][end]);
            let time = first
                .zip(last)
                .map(|(first, last)| first.after_s(0.5 * last.seconds_since(first)));
            known.push(Self {
                time,
                height_m,
                wind_m_s,
            });
        }
        match known.is_empty() {
            false => Ok(known),
            true => Err(Error::input(
                path,
                "it has no row with an east and a north wind",
            )),
        }
    }
}

/// The wind of a window at a height, east, north, up, m/s: of some winds that of the nearest window, there of the nearest height.
pub(super) fn nearest_m_s(
    known: &[CrossWind],
    window: &Window,
    reference: Option<UtcTime>,
    height_m: f64,
) -> Option<[f64; 3]> {
    let middle_s = 0.5 * (window.start_s + window.end_s);
    let middle = reference.map(|date| date.after_s(middle_s));
    let away = |wind: &CrossWind| {
        let both = wind.time.zip(middle);
        let away_s = both.map_or(0.0, |(a, b)| a.seconds_since(b).abs());
        (away_s, (wind.height_m - height_m).abs())
    };
    let nearest = known.iter().min_by(|a, b| {
        let a = away(a);
        let b = away(b);
        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
    let [east_m_s, north_m_s] = nearest?.wind_m_s;
    Some([east_m_s, north_m_s, 0.0])
}
