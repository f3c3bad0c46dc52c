//! Scans of a data set: the cells of its flights as maps for a retrieval, without their truth.
//!
//! Check: the velocities of a store that is written and read; flagged cells are missing.

use super::{ReadScan, ScanFormat};
use crate::Error;
use crate::io::data_set::DataSet;
use ndarray::{Array2, Array3, ArrayD, Axis, Ix4};
use wakescope_estimate::retrieval::ScanMap;

/// The lines of a data set, which all of its flights share, in the order of their elevations.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredLines {
    /// Their indices in the arrays.
    order: Vec<usize>,
    elevation_rad: Vec<f64>,
    azimuth_rad: f64,
    range_m: Vec<f64>,
    /// \[scan, line\] from the first pulse of a flight, s, in the order of the arrays.
    time_s: ArrayD<f64>,
}

impl StoredLines {
    /// Reads the lines of a data set.
    ///
    /// # Errors
    /// Arrays that are missing; coordinates that are not finite numbers, as those of absent chunks.
    pub fn read(data_set: &DataSet) -> Result<Self, Error> {
        let elevation_deg = coordinate(data_set, "elevation")?;
        let mut order: Vec<usize> = (0..elevation_deg.len()).collect();
        order.sort_by(|a, b| elevation_deg[*a].total_cmp(&elevation_deg[*b]));
        let elevations = order.iter().map(|line| elevation_deg[*line].to_radians());
        let azimuth_deg = coordinate(data_set, "azimuth")?;
        Ok(Self {
            elevation_rad: elevations.collect(),
            azimuth_rad: azimuth_deg.first().map_or(f64::NAN, |deg| deg.to_radians()),
            range_m: coordinate(data_set, "range")?.iter().copied().collect(),
            time_s: coordinate(data_set, "line_time")?,
            order,
        })
    }

    /// The scans of a ready flight, without the velocities that a format takes for noise. Their sweeps are the numbers of the scans
    /// in it.
    ///
    /// # Errors
    /// Chunks that are missing or damaged, with their path; arrays without the axes of cells.
    pub fn scans_of_flight(
        &self,
        data_set: &DataSet,
        flight: usize,
        format: &ScanFormat,
    ) -> Result<Vec<ReadScan>, Error> {
        let velocity_m_s = cells(data_set, "velocity", flight)?;
        let sigma_m_s = cells(data_set, "velocity_standard_deviation", flight)?;
        let mut is_missing = cells(data_set, "flag", flight)?.mapv(|flag| flag == 1.0);
        if format.min_snr_db.is_some() {
            let ratio_db = cells(data_set, "signal_to_noise_ratio", flight)?;
            is_missing.zip_mut_with(&ratio_db, |is_missing, ratio_db| {
                *is_missing |= format.is_noise(*ratio_db);
            });
        }
        let mut scans = Vec::with_capacity(data_set.scans_per_flight);
        for scan in 0..data_set.scans_per_flight {
            let mut velocity_m_s = self.scan_of(&velocity_m_s, scan);
            let sigma_m_s = self.scan_of(&sigma_m_s, scan);
            let is_missing = self.scan_of(&is_missing, scan);
            for (at, velocity_m_s) in velocity_m_s.indexed_iter_mut() {
                if is_missing[at] || sigma_m_s[at].is_nan() {
                    *velocity_m_s = f64::NAN;
                }
            }
            let times_s = self.order.iter().map(|line| self.time_s[[scan, *line]]);
            let map = ScanMap {
                elevation_rad: self.elevation_rad.clone(),
                time_s: times_s.collect(),
                range_m: self.range_m.clone(),
                velocity_m_s,
                sigma_m_s: Some(sigma_m_s),
                fold_m_s: None,
            };
            scans.push(ReadScan {
                azimuth_rad: Some(self.azimuth_rad),
                is_own: true,
                ..ReadScan::new(&data_set.store.root, scan, map)
            });
        }
        Ok(scans)
    }

    /// The cells \[line, gate\] of a scan, by elevation.
    fn scan_of<T: Copy>(&self, flight: &Array3<T>, scan: usize) -> Array2<T> {
        flight
            .index_axis(Axis(0), scan)
            .select(Axis(0), &self.order)
    }
}

/// A coordinate that all flights share.
fn coordinate(data_set: &DataSet, name: &str) -> Result<ArrayD<f64>, Error> {
    let array = data_set.store.array(name)?;
    let values = data_set.store.values(name, 0..array.shape[0])?;
    if values.iter().all(|value| value.is_finite()) {
        return Ok(values);
    }
    let path = data_set.store.chunk_path(array, 0);
    let reason = "this chunk of the store is missing, or holds no numbers";
    Err(Error::input(&path, reason))
}

/// The cells \[scan, line, gate\] of a flight.
fn cells(data_set: &DataSet, name: &str, flight: usize) -> Result<Array3<f64>, Error> {
    let values = data_set.values(name, flight..flight + 1)?;
    let cells = values.into_dimensionality::<Ix4>().map_err(|_| {
        let reason = format!("its array \"{name}\" is not one of cells");
        Error::input(&data_set.store.root, reason)
    })?;
    Ok(cells.index_axis_move(Axis(0), 0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::zarr::{Array, METADATA, Writer, compressed, group_json, json_text};
    use serde_json::Map;
    use std::path::Path;

    const AXES: [(&str, usize); 4] = [("flight", 2), ("scan", 2), ("line", 3), ("gate", 2)];

    /// A store of two flights, one a chunk, of which the first is ready.
    fn store(folder: &Path) {
        let writer = Writer::new(&folder.join("scans.zarr")).unwrap();
        let packed = |name: &str, step: f64| {
            let array = Array::new(name, "int16", &AXES, 1).unwrap();
            array.packed(step, 0.0, -32_768)
        };
        let whole = |name: &str, axes| Array::new(name, "uint8", axes, 1).unwrap();
        let float = |name: &str, axes: &[(&str, usize)]| {
            Array::new(name, "float64", axes, axes[0].1).unwrap()
        };
        let mut velocity_m_s: Vec<f64> = (0..12).map(|cell| 0.5 * f64::from(cell)).collect();
        velocity_m_s[7] = f64::NAN;
        let mut flagged = vec![0.0; 12];
        flagged[10] = 1.0;
        let ages = Array::new("wake_age", "float64", &AXES[..2], 1).unwrap();
        let all = [
            (packed("velocity", 0.005), velocity_m_s),
            (packed("velocity_standard_deviation", 0.002), vec![0.25; 12]),
            (whole("flag", &AXES), flagged),
            (
                packed("signal_to_noise_ratio", 0.01),
                (0..12).map(f64::from).collect(),
            ),
            (float("elevation", &AXES[2..3]), vec![10.0, 9.0, 8.0]),
            (float("azimuth", &AXES[2..3]), vec![90.0; 3]),
            (float("range", &AXES[3..]), vec![300.0, 305.0]),
            (
                float("line_time", &AXES[1..3]),
                vec![0.0, 1.0, 2.0, 5.0, 6.0, 7.0],
            ),
            (ages, vec![1.0, 2.0]),
            (whole("split", &AXES[..1]), vec![3.0]),
            (whole("ready", &AXES[..1]), vec![1.0]),
        ];
        for (array, values) in &all {
            let mut bytes = Vec::new();
            array.pack(values.iter().copied(), &mut bytes);
            writer
                .put(&array.chunk_key(0), &compressed(&bytes))
                .unwrap();
        }
        let arrays = all.map(|(array, _)| array);
        let text = json_text(&group_json(&Map::new(), &arrays));
        writer.put(METADATA, text.as_bytes()).unwrap();
    }

    #[test]
    fn cells_come_back_by_elevation_and_flagged_ones_are_missing() {
        let temp = tempfile::tempdir().unwrap();
        store(temp.path());
        let data_set = DataSet::open(temp.path()).unwrap();
        let lines = StoredLines::read(&data_set).unwrap();
        let scans = lines
            .scans_of_flight(&data_set, 0, &ScanFormat::default())
            .unwrap();
        assert_eq!((scans.len(), scans[1].sweep), (2, 1));
        let map = &scans[1].map;
        assert!(map.elevation_rad.is_sorted() && map.validate().is_ok());
        assert_eq!(map.time_s, [7.0, 6.0, 5.0]);
        let found: Vec<String> = map.velocity_m_s.iter().map(|v| format!("{v:.1}")).collect();
        assert_eq!(found, ["NaN", "5.5", "4.0", "4.5", "3.0", "NaN"]);
        assert!((map.sigma_m_s.as_ref().unwrap()[[1, 1]] - 0.25).abs() < 1e-12);
        assert!((scans[0].azimuth_rad.unwrap() - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
    }

    #[test]
    fn cells_of_a_low_signal_to_noise_ratio_are_missing_where_a_least_one_is_given() {
        let temp = tempfile::tempdir().unwrap();
        store(temp.path());
        let data_set = DataSet::open(temp.path()).unwrap();
        let lines = StoredLines::read(&data_set).unwrap();
        let format = ScanFormat {
            min_snr_db: Some(8.5),
            ..ScanFormat::default()
        };
        let scans = lines.scans_of_flight(&data_set, 0, &format).unwrap();
        assert!(scans[0].map.velocity_m_s.iter().all(|v| v.is_nan()));
        let map = &scans[1].map;
        let are_missing: Vec<bool> = map.velocity_m_s.iter().map(|v| v.is_nan()).collect();
        assert_eq!(are_missing, [true, false, true, false, true, true]);
    }

    #[test]
    fn chunks_that_are_missing_are_refused_with_their_path() {
        let temp = tempfile::tempdir().unwrap();
        store(temp.path());
        let root = temp.path().join("scans.zarr");
        std::fs::remove_file(root.join("flag/c/0/0/0/0")).unwrap();
        let data_set = DataSet::open(temp.path()).unwrap();
        let lines = StoredLines::read(&data_set).unwrap();
        let refused = lines
            .scans_of_flight(&data_set, 0, &ScanFormat::default())
            .unwrap_err()
            .to_string();
        assert!(
            refused.contains("flag/c/0/0/0/0: this chunk of the store is missing"),
            "{refused}"
        );
        std::fs::remove_file(root.join("range/c/0")).unwrap();
        let refused = StoredLines::read(&data_set).unwrap_err().to_string();
        assert!(refused.contains("range/c/0"), "{refused}");
    }
}
