//! What every figure takes, and what it gives.

use crate::workspace::{provenance, root};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use wakescope_sim::io::{FileGroup, Provenance};

// What figures are made of.
pub(super) use crate::claim::{Claim, Part};
pub(super) use crate::profile::Profile;
pub(super) use crate::statistics::{BATCHES, Bar, Estimate, NO_DIFFERENCE, mean};
pub(super) use fixtures::failure::Failure;
pub(super) use ndarray::Array2;
pub(super) use wakescope_les::analysis::decay::value_at;
pub(super) use wakescope_sim::Silent;
pub(super) use wakescope_sim::flow::FinishedWake;
pub(super) use wakescope_sim::io::Table;
pub(super) use wakescope_sim::plan::{Plan, Target};
pub(super) use wakescope_sim::plot::{Axis, CurvePlot, Figure, MapPlot, Series, Style};
pub(super) use wakescope_sim::scene::{Scene, SceneFile, SnrReference};

/// What a figure may depend on, as options of a task.
#[derive(Debug, Clone, clap::Args)]
pub(crate) struct Context {
    /// Resolution and sample counts.
    #[arg(long, value_enum, default_value_t = Profile::Quick)]
    pub(crate) profile: Profile,
    /// Seed of every random number.
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u64).range(..=i64::MAX as u64))]
    pub(crate) seed: u64,
    /// Draw everything anew.
    #[arg(long = "no-cache")]
    pub(crate) anew: bool,
    /// Folder of a finished `wakescope wake` that figures 6 to 14 show, instead of the run of the profile.
    #[arg(long, value_name = "DIR")]
    pub(crate) wake: Option<PathBuf>,
    /// Figures 10 to 14 on the analytic pair instead of the simulated wake.
    #[arg(long)]
    pub(crate) analytic: bool,
    /// Folder for runs that several figures share.
    #[arg(skip = Context::cache().join("stages"))]
    pub(crate) stages: PathBuf,
}

impl Context {
    /// Folder of the figures and of the stages that several share.
    pub(crate) fn cache() -> PathBuf {
        root().join("target/figures-cache")
    }

    /// The scene of a figure as a checked file, with this run's seed.
    pub(crate) fn scene_file(&self, mut scene: Scene) -> Result<SceneFile, Failure> {
        scene.seed = self.seed;
        SceneFile::new(scene).map_err(|problems| {
            Failure::new(
                problems
                    .iter()
                    .map(ToString::to_string)
                    .collect::<Vec<_>>()
                    .join("; "),
            )
        })
    }

    /// Provenance of what belongs to no scene: the tables over all figures.
    pub(crate) fn provenance_of_run(&self) -> Provenance {
        self.provenance_of_formula(&format!("profile = \"{}\"\n", self.profile.name()))
    }

    /// Provenance of a figure that follows from formulas and the parameters given as TOML.
    pub(crate) fn provenance_of_formula(&self, parameters: &str) -> Provenance {
        provenance(parameters, self.seed)
    }
}

/// The error of correlogram accumulation relative to that of one periodogram accumulation on the same signals.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Comparison {
    /// Signal-to-noise ratio at the vortices, dB.
    pub(crate) snr_db: f64,
    /// Duration of the pulse, in print.
    pub(crate) pulse: String,
    /// The periodogram accumulation.
    pub(crate) against: String,
    /// The error of correlogram accumulation over that of periodogram accumulation, less one.
    pub(crate) inside: Estimate,
    pub(crate) outside: Estimate,
}

/// What a figure gives.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Rendered {
    /// Extension and content of each file.
    #[serde(skip)]
    pub(crate) files: Vec<(String, Vec<u8>)>,
    /// What is drawn, for the report, which makes it of the caption of the list and the values in their order.
    pub(crate) caption: String,
    #[serde(skip)]
    pub(crate) values: Vec<String>,
    /// Short notes beside the name, such as what is not the real thing.
    pub(crate) marks: Vec<String>,
    /// Errors of correlogram and periodogram accumulation side by side, for the table of the report; mostly nothing.
    pub(crate) comparison: Vec<Comparison>,
    /// Claims measured on the data of the run.
    pub(crate) claims: Vec<Claim>,
    /// Wall-clock time and processor time that it took, s.
    pub(crate) took_s: [f64; 2],
}

impl Rendered {
    /// A table as CSV, and the picture as SVG and PNG.
    pub(crate) fn new(
        table: &Table,
        figure: &Figure,
        origin: &Provenance,
    ) -> Result<Self, Failure> {
        let mut out = Self::of_table(table, origin)?;
        let (svg, png) = figure.svg_and_png(origin)?;
        out.files.push(("svg".into(), svg.into_bytes()));
        out.files.push(("png".into(), png));
        Ok(out)
    }

    /// A table as CSV.
    pub(crate) fn of_table(table: &Table, origin: &Provenance) -> Result<Self, Failure> {
        Ok(Self {
            files: vec![("csv".into(), table.to_csv(origin)?.into_bytes())],
            ..Self::default()
        })
    }

    /// One more table, as `figNN.` and the name.
    pub(crate) fn add(
        &mut self,
        name: &str,
        table: &Table,
        origin: &Provenance,
    ) -> Result<(), Failure> {
        self.files
            .push((name.into(), table.to_csv(origin)?.into_bytes()));
        Ok(())
    }

    /// Its files, to be written into a folder.
    pub(crate) fn files_in(&self, folder: &Path, id: &str) -> Result<FileGroup, Failure> {
        let mut group = FileGroup::new(folder);
        for (extension, bytes) in &self.files {
            group.add(&format!("{id}.{extension}"), bytes.clone())?;
        }
        Ok(group)
    }

    pub(crate) fn file(&self, extension: &str) -> Option<&[u8]> {
        self.files
            .iter()
            .find(|(e, _)| e == extension)
            .map(|(_, bytes)| bytes.as_slice())
    }
}

/// A value of each row.
pub(crate) fn column<'r, T, V>(rows: &'r [T], value: impl Fn(&'r T) -> V) -> Vec<V> {
    rows.iter().map(value).collect()
}

/// A curve of points with the error of each.
pub(super) fn banded(
    label: &str,
    style: Style,
    points: impl IntoIterator<Item = (f64, Estimate)>,
) -> Series {
    let mut curve = Vec::new();
    let mut errors = Vec::new();
    for (x, y) in points {
        curve.push((x, y.value));
        errors.push(y.standard_error);
    }
    Series::new(label, style, curve).with_band(&errors)
}

/// A table of numbers, row by row, with the names of its columns between spaces.
pub(super) fn numbers_table<const N: usize>(names: &str, rows: &[[f64; N]]) -> Table {
    let mut table = Table::new();
    for (k, name) in names.split(' ').enumerate() {
        table = table.float(name, column(rows, |row| row[k]));
    }
    table
}
