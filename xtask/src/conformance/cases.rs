//! The table of the conformance set: which scans, from which parts of scenes, in which files.
//! Check: the numbers of the cases are 1 to 32, each once.

use fixtures::failure::Failure;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;
use toml::{Table, Value};
use wakescope_sim::SceneFile;

/// The table.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Cases {
    scene: Table,
    /// Patterns of lines of sight: the keys of a scene, and `lines` that no pattern of scenes has.
    pattern: BTreeMap<String, Table>,
    air: BTreeMap<String, Table>,
    /// The scans, in the order of their cases.
    pub(super) scan: Vec<ScanCase>,
}

/// Lines of sight of a list.
#[derive(Debug, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
enum Lines {
    /// Directions (azimuth, elevation), one after the other, again and again.
    Turns {
        mode: String,
        turns: usize,
        beams_deg: Vec<[f64; 2]>,
    },
    /// From an elevation over the zenith to the same elevation on the other side.
    OverTheTop {
        mode: String,
        azimuth_deg: f64,
        elevation_deg: f64,
        step_deg: f64,
    },
}

/// A scan of the set.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ScanCase {
    /// Numbers of the cases by the names of their files; `N` in a name stands for the number of the turn, from 1.
    pub(super) files: BTreeMap<String, u32>,
    pattern: String,
    air: String,
    /// Signal-to-noise ratio of simulated signals, dB; absent: velocities of the air itself.
    pub(super) snr_db: Option<f64>,
    /// Nyquist velocity of each sweep, m/s, beyond which velocities are folded.
    #[serde(default)]
    pub(super) nyquist_m_s: Vec<f64>,
    /// Blocks of cells without a velocity.
    #[serde(default)]
    pub(super) missing: Vec<Block>,
    /// A file that is cut short.
    pub(super) cut: Option<Cut>,
}

/// First and last ray and gate of a block of cells.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Block {
    pub(super) rays: [usize; 2],
    pub(super) gates: [usize; 2],
}

/// Where a file ends too early.
#[derive(Debug, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum Cut {
    /// After this fraction of the bytes of a file.
    Bytes { of: String, kept: f64 },
    /// In the middle of a ray, counted from 0, of a HALO file.
    Ray { of: String, ray: usize },
}

impl Cases {
    /// The table of the repository.
    pub(super) fn read() -> Result<Self, Failure> {
        Ok(toml::from_str(include_str!("cases.toml"))?)
    }

    /// The scene of a scan; a list of its lines is written to a folder that exists.
    pub(super) fn scene(&self, case: &ScanCase, folder: &Path) -> Result<SceneFile, Failure> {
        let mut pattern = entry(&self.pattern, &case.pattern)?.clone();
        let air = entry(&self.air, &case.air)?;
        let lines = pattern.remove("lines");
        let mut scene = self.scene.clone();
        lay_over(&mut scene, &pattern);
        lay_over(&mut scene, air);
        if let Some(snr_db) = case.snr_db {
            lay_over(
                &mut scene,
                &toml::from_str(&format!("detector.snr.snr_db = {snr_db:?}"))?,
            );
        }
        if let Some(lines) = lines {
            let lines: Lines = lines.try_into()?;
            let name = format!("{}.csv", case.pattern);
            std::fs::write(folder.join(&name), lines.list())?;
            let list = format!("scan.pattern = {{ kind = \"list\", file = {name:?} }}");
            lay_over(&mut scene, &toml::from_str(&list)?);
        }
        let text = scene.to_string();
        Ok(SceneFile::parse(&text, &folder.join("scene.toml"))?)
    }
}

/// The part of that name.
fn entry<'p>(parts: &'p BTreeMap<String, Table>, name: &str) -> Result<&'p Table, Failure> {
    let part = parts.get(name);
    part.ok_or_else(|| Failure::new(format!("cases.toml has no {name}")))
}

/// Lays a table over another: its keys take the place of those of the other, tables are joined.
fn lay_over(table: &mut Table, other: &Table) {
    for (key, value) in other {
        match (table.get_mut(key), value) {
            (Some(Value::Table(below)), Value::Table(above)) => lay_over(below, above),
            _ => {
                table.insert(key.clone(), value.clone());
            }
        }
    }
}

impl Lines {
    /// The list that a scene reads.
    fn list(&self) -> String {
        let (Self::Turns { mode, .. } | Self::OverTheTop { mode, .. }) = self;
        let mut out = String::from("azimuth_deg,elevation_deg,sweep,mode\n");
        for [azimuth_deg, elevation_deg] in self.directions_deg() {
            // Writing to a text cannot fail.
            let _ = writeln!(out, "{azimuth_deg:?},{elevation_deg:?},0,{mode}");
        }
        out
    }

    /// Azimuth and elevation of each line, degrees.
    fn directions_deg(&self) -> Vec<[f64; 2]> {
        match self {
            Self::Turns {
                turns, beams_deg, ..
            } => beams_deg.repeat(*turns),
            Self::OverTheTop {
                azimuth_deg,
                elevation_deg,
                step_deg,
                ..
            } => {
                let steps = ((180.0 - 2.0 * elevation_deg) / step_deg).round() as usize;
                let mut out = Vec::with_capacity(steps + 1);
                for step in 0..=steps {
                    let from_first_deg = elevation_deg + step as f64 * step_deg;
                    out.push(if from_first_deg <= 90.0 {
                        [*azimuth_deg, from_first_deg]
                    } else {
                        [azimuth_deg + 180.0, 180.0 - from_first_deg]
                    });
                }
                out
            }
        }
    }
}
