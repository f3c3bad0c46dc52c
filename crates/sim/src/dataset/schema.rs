//! The arrays of a data set: names, axes, number types and attributes by the CF conventions; coordinates that all flights share.
//!
//! All that has the axis `flight` has chunks of whole flights, so that no file belongs to two units of work.
//!
//! Check: the arrays of the page `dataset.md` in `python/tests/test_dataset.py`.

use super::plan::{DatasetPlan, Flight};
use crate::Error;
use crate::io::data_set::Split;
use crate::io::zarr::Array;
use crate::measure::recorded::GateSpectra;
use crate::plan::Plan;
use serde_json::{Map, Value, json};

/// Step of stored velocities, m/s, and of their standard deviations.
pub(super) const VELOCITY_STEP_M_S: f64 = 0.005;
const DEVIATION_STEP_M_S: f64 = 0.002;
/// Step of stored ratios in dB, and of qualities.
const RATIO_STEP: f64 = 0.01;
/// Step and first level of stored spectra, dB.
const SPECTRUM_DB: [f64; 2] = [0.25, -12.0];
/// The code of missing packed numbers.
const MISSING: i32 = -32_768;

/// Lines, gates, times and velocities that all flights share.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Shape {
    pub(crate) scans: usize,
    pub(crate) elevation_deg: Vec<f64>,
    pub(crate) azimuth_deg: Vec<f64>,
    pub(crate) range_m: Vec<f64>,
    /// Time of the middle of each line from the first pulse of the flight, s \[scan, line\].
    pub(crate) line_time_s: Vec<f64>,
    /// Velocities of the frequencies of a spectrum, m/s; none without spectra.
    pub(crate) bin_velocity_m_s: Vec<f64>,
}

impl Shape {
    /// The shape of a planned flight.
    ///
    /// # Errors
    /// Sweeps that differ in their lines; spectra that the method of estimation does not make.
    pub(super) fn new(plan: &Plan, has_spectra: bool) -> Result<Self, Error> {
        let g = &plan.geometry;
        let scans = g.schedule.sweeps.len().max(1);
        let lines = g.schedule.lines.len() / scans;
        let mut elevation_deg = Vec::with_capacity(lines);
        let mut azimuth_deg = Vec::with_capacity(lines);
        for line in 0..g.schedule.lines.len() {
            let beam = g.schedule.middle(line);
            let [elevation, azimuth] = [beam.elevation_rad, beam.azimuth_rad].map(f64::to_degrees);
            if line < lines {
                elevation_deg.push(elevation);
                azimuth_deg.push(azimuth);
                continue;
            }
            let of_first = line % lines;
            let is_same = g.schedule.lines[line].sweep == line / lines
                && (elevation - elevation_deg[of_first]).abs() < 1e-6
                && (azimuth - azimuth_deg[of_first]).abs() < 1e-6;
            if !is_same {
                let reason = "all sweeps of a data set have the same lines: one kind of sweep, with scan.head.direction = \"same\"";
                return Err(Error::Key {
                    key: "scan.pattern",
                    reason: reason.into(),
                });
            }
        }
        let bin_velocity_m_s = match has_spectra {
            true => spectra(plan)?.velocity_m_s().to_vec(),
            false => Vec::new(),
        };
        Ok(Self {
            scans,
            elevation_deg,
            azimuth_deg,
            range_m: g.gate_range_m.clone(),
            line_time_s: g.line_time_s.clone(),
            bin_velocity_m_s,
        })
    }

    /// Numbers of one field of a flight.
    pub(super) fn cells(&self) -> usize {
        self.line_time_s.len() * self.range_m.len()
    }
}

/// What makes the spectra of a data set: at the frequencies of a transform of twice the window, which hold all of them.
///
/// # Errors
/// As [`GateSpectra::with_points`].
pub(super) fn spectra(plan: &Plan) -> Result<GateSpectra, Error> {
    let points = 2 * plan.scene().estimator.window_samples;
    GateSpectra::with_points(plan, plan.scene().signal_kind(), points)
}

/// Name of the array of a key that varies.
pub(super) fn name_of_key(path: &str) -> String {
    format!("draw_{}", path.replace('.', "_"))
}

/// Makes arrays along the axes of a data set.
struct Axes<'a> {
    plan: &'a DatasetPlan,
    shape: &'a Shape,
}

impl Axes<'_> {
    /// Length of an axis.
    fn length(&self, axis: &str) -> usize {
        match axis {
            "flight" => self.plan.keys.flights(),
            "scan" => self.shape.scans,
            "line" => self.shape.elevation_deg.len(),
            "gate" => self.shape.range_m.len(),
            "bin" => self.shape.bin_velocity_m_s.len(),
            "height" => self.plan.keys.heights_m.len(),
            // Left and right.
            _ => 2,
        }
    }

    /// An array with a description and units; those along flights have chunks of whole flights, others one chunk.
    fn array(
        &self,
        (name, number): (&str, &str),
        axes: &[&str],
        units: &str,
        long_name: &str,
    ) -> Result<Array, Error> {
        let lengths: Vec<(&str, usize)> =
            axes.iter().map(|axis| (*axis, self.length(axis))).collect();
        let chunk = match (axes.first(), axes.last()) {
            (Some(&"flight"), Some(&"bin")) => 1,
            (Some(&"flight"), _) if axes.len() > 1 || name != "flight" => {
                self.plan.keys.flights_per_chunk
            }
            _ => lengths.first().map_or(1, |(_, length)| *length),
        };
        let array = Array::new(name, number, &lengths, chunk).ok_or_else(|| Error::Key {
            key: "dataset",
            reason: format!("no array {name} of {number}"),
        })?;
        let array = array.with("long_name", long_name);
        Ok(match units {
            "" => array,
            units => array.with("units", units),
        })
    }

    /// A packed array of cells.
    fn cells(&self, name: &str, step: f64, units: &str, long_name: &str) -> Result<Array, Error> {
        let axes = ["flight", "scan", "line", "gate"];
        let array = self.array((name, "int16"), &axes, units, long_name)?;
        Ok(array.packed(step, 0.0, MISSING))
    }

    /// An array of one number of each flight.
    fn of_flights(
        &self,
        (name, number): (&str, &str),
        units: &str,
        long_name: &str,
    ) -> Result<Array, Error> {
        self.array((name, number), &["flight"], units, long_name)
    }

    fn coordinates(&self) -> Result<Vec<Array>, Error> {
        let mut all = vec![
            self.array(("flight", "int32"), &["flight"], "", "number of the flight")?,
            self.array(
                ("scan", "int32"),
                &["scan"],
                "",
                "number of the scan in its flight",
            )?,
            self.array(
                ("vortex", "int32"),
                &["vortex"],
                "",
                "side of the vortex, seen along the flight",
            )?
            .with("flag_values", json!([0, 1]))
            .with("flag_meanings", "left right"),
            self.array(
                ("elevation", "float64"),
                &["line"],
                "degree",
                "elevation of the line of sight",
            )?
            .with("standard_name", "sensor_to_target_elevation_angle"),
            self.array(
                ("azimuth", "float64"),
                &["line"],
                "degree",
                "azimuth of the line of sight, clockwise from north",
            )?
            .with("standard_name", "sensor_to_target_azimuth_angle"),
            self.array(
                ("range", "float64"),
                &["gate"],
                "m",
                "range of the centre of the gate",
            )?,
            self.array(
                ("line_time", "float64"),
                &["scan", "line"],
                "s",
                "time of the middle of the line from the first pulse of the flight",
            )?,
            self.array(
                ("height", "float64"),
                &["height"],
                "m",
                "height above the ground",
            )?
            .with("standard_name", "height"),
        ];
        if self.plan.keys.spectra {
            let long_name = "radial velocity of the frequency, positive away from the lidar";
            all.push(self.array(("bin_velocity", "float64"), &["bin"], "m s-1", long_name)?);
        }
        Ok(all)
    }

    fn measured(&self) -> Result<Vec<Array>, Error> {
        let others =
            "velocity_standard_deviation signal_to_noise_ratio spectral_width quality flag";
        let standard_name = "radial_velocity_of_scatterers_away_from_instrument";
        Ok(vec![
            self.cells(
                "velocity",
                VELOCITY_STEP_M_S,
                "m s-1",
                "estimated radial velocity, positive away from the lidar",
            )?
            .with("standard_name", standard_name)
            .with("ancillary_variables", others),
            self.cells(
                "velocity_standard_deviation",
                DEVIATION_STEP_M_S,
                "m s-1",
                "Cramer-Rao bound at the estimated signal-to-noise ratio",
            )?,
            self.cells(
                "signal_to_noise_ratio",
                RATIO_STEP,
                "dB",
                "signal-to-noise ratio in the detector band",
            )?,
            self.cells(
                "spectral_width",
                VELOCITY_STEP_M_S,
                "m s-1",
                "spectral width of air and pulse",
            )?,
            self.cells(
                "quality",
                RATIO_STEP,
                "1",
                "density of the peak over the mean density in the band",
            )?,
            self.array(
                ("flag", "uint8"),
                &["flight", "scan", "line", "gate"],
                "",
                "whether the estimate is flagged",
            )?
            .with("flag_values", json!([0, 1]))
            .with("flag_meanings", "good flagged"),
        ])
    }

    fn of_cells(&self) -> Result<Vec<Array>, Error> {
        let standard_name = "radial_velocity_of_scatterers_away_from_instrument";
        let mut all = vec![
            self.cells(
                "true_velocity",
                VELOCITY_STEP_M_S,
                "m s-1",
                "radial velocity of the air weighted with pulse and window",
            )?
            .with("standard_name", standard_name),
            self.cells(
                "point_velocity",
                VELOCITY_STEP_M_S,
                "m s-1",
                "radial velocity of the air at the centre of the gate",
            )?
            .with("standard_name", standard_name),
        ];
        if self.plan.keys.spectra {
            let axes = ["flight", "scan", "line", "gate", "bin"];
            let long_name = "mean spectral density of the gate over that of the noise";
            let spectrum = self.array(("spectrum", "uint8"), &axes, "dB", long_name)?;
            all.push(spectrum.packed(SPECTRUM_DB[0], SPECTRUM_DB[1], 0));
        }
        Ok(all)
    }

    fn flights(&self) -> Result<Vec<Array>, Error> {
        let mut all = vec![
            self.of_flights(("site", "uint16"), "", "number of the site")?,
            self.of_flights(("split", "uint8"), "", "split of the data set")?
                .with("flag_values", json!([0, 1, 2, 3]))
                .with("flag_meanings", Split::ALL.map(Split::name).join(" ")),
            self.of_flights(("has_wake", "uint8"), "", "whether an aircraft passes")?,
            self.of_flights(("seed", "int64"), "", "seed of the scene")?,
            self.of_flights(
                ("scene_hash", "uint64"),
                "",
                "first 64 bits of the SHA-256 of the scene",
            )?,
            self.of_flights(
                ("dissipation", "float64"),
                "m2 s-3",
                "dissipation rate of the turbulence",
            )?,
            self.of_flights(
                ("outer_scale", "float64"),
                "m",
                "outer scale of the turbulence",
            )?,
            self.of_flights(
                ("snr_middle", "float64"),
                "dB",
                "signal-to-noise ratio of one pulse in the band in the middle of the scan",
            )?,
            self.of_flights(
                ("spacing", "float64"),
                "m",
                "distance between the vortices at their release",
            )?,
        ];
        for (key, _) in &self.plan.drawn.keys {
            let name = name_of_key(&key.path);
            let long_name = "value of the key that varies; of names their number";
            let array = self.of_flights((&name, "float64"), "", long_name)?;
            all.push(array.with("key", key.path.as_str()));
        }
        let heights = ["flight", "height"];
        all.push(self.array(
            ("wind_x", "float64"),
            &heights,
            "m s-1",
            "true mean wind along x, the direction of the flight",
        )?);
        all.push(self.array(
            ("wind_y", "float64"),
            &heights,
            "m s-1",
            "true mean wind along y, to the right of the flight",
        )?);
        Ok(all)
    }

    fn vortices(&self) -> Result<Vec<Array>, Error> {
        let of_scans = ["flight", "scan"];
        let axes = ["flight", "scan", "vortex"];
        let passes = "when the line of sight passes it";
        Ok(vec![
            self.array(("wake_age", "float64"), &of_scans, "1", "age of the wake in t V0/b0 when the scan begins")?,
            self.array(("vortex_y", "float64"), &axes, "m", &format!("lateral position of the vortex {passes}"))?,
            self.array(("vortex_z", "float64"), &axes, "m", &format!("height of the vortex {passes}"))?,
            self.array(("circulation", "float64"), &axes, "m2 s-1", &format!("circulation of the vortex {passes}, positive"))?,
            self.array(("circulation_5_15", "float64"), &axes, "m2 s-1", "its mean over radii of 5 to 15 m")?,
            self.array(("core_radius", "float64"), &axes, "m", "core radius of the vortex")?,
            self.array(("passing_time", "float64"), &axes, "s", "time from the first pulse of the flight at which the line of sight passes the vortex")?,
            self.array(("in_view", "uint8"), &axes, "", "whether the centre is within the first and the last gate and line")?,
        ])
    }
}

/// All arrays of a data set, `ready` last.
///
/// # Errors
/// None; the number types are known.
pub(super) fn arrays(plan: &DatasetPlan, shape: &Shape) -> Result<Vec<Array>, Error> {
    let axes = Axes { plan, shape };
    let mut all = axes.coordinates()?;
    all.extend(axes.measured()?);
    all.extend(axes.of_cells()?);
    all.extend(axes.flights()?);
    all.extend(axes.vortices()?);
    all.push(axes.of_flights(("ready", "uint8"), "", "1 where the flight is there")?);
    Ok(all)
}

/// Values of the coordinates, by the names of their arrays.
pub(super) fn coordinates(plan: &DatasetPlan, shape: &Shape) -> Vec<(&'static str, Vec<f64>)> {
    let count = |length: usize| (0..length).map(|index| index as f64).collect();
    let mut all = vec![
        ("flight", count(plan.keys.flights())),
        ("scan", count(shape.scans)),
        ("vortex", count(2)),
        ("elevation", shape.elevation_deg.clone()),
        ("azimuth", shape.azimuth_deg.clone()),
        ("range", shape.range_m.clone()),
        ("line_time", shape.line_time_s.clone()),
        ("height", plan.keys.heights_m.clone()),
    ];
    if plan.keys.spectra {
        all.push(("bin_velocity", shape.bin_velocity_m_s.clone()));
    }
    all
}

/// Attributes of the group.
pub(super) fn attributes(plan: &DatasetPlan) -> Map<String, Value> {
    let mut all = Map::new();
    for (name, text) in [
        ("Conventions", "CF-1.11"),
        ("title", &plan.keys.title),
        ("institution", &plan.keys.creator),
        (
            "source",
            "simulated Doppler lidar scans of aircraft wake vortices",
        ),
        ("plan", &plan.text),
        ("plan_hash", &plan.hash),
        ("licence", &plan.keys.licence),
        ("program", crate::PROGRAM),
    ] {
        all.insert(name.into(), json!(text));
    }
    all.insert("seed".into(), json!(plan.keys.seed));
    all
}

/// Refuses a flight whose arrays would have another shape than those of the others.
///
/// # Errors
/// [`Error::Flight`] with its keys.
pub(super) fn refuse_other_shape(
    plan: &DatasetPlan,
    flight: &Flight,
    [own, first]: [&Shape; 2],
) -> Result<(), Error> {
    if own == first {
        return Ok(());
    }
    let reason = "its lines, gates, times of lines or velocities of spectra are not those of the other flights, whose arrays it shares: \
                  keys that change them cannot vary";
    Err(Error::Flight {
        flight: flight.number,
        site: flight.site,
        keys: plan.drawn.described(&flight.values),
        others: 0,
        source: Box::new(Error::input(plan.path(), reason)),
    })
}
