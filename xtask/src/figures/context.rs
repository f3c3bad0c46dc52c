//! What every figure takes, and what it gives.

use crate::workspace::provenance;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use wakescope_sim::io::Provenance;

// What nearly every figure is made of.
pub(super) use crate::claim::Claim;
pub(super) use crate::profile::Profile;
pub(super) use crate::statistics::{BATCHES, Bar, Estimate, Verdict};
pub(super) use fixtures::failure::Failure;
pub(super) use wakescope_sim::io::Table;
pub(super) use wakescope_sim::plan::{Plan, Target};
pub(super) use wakescope_sim::plot::{Axis, CurvePlot, Figure, MapPlot, Series, Style};
pub(super) use wakescope_sim::scene::{Scene, SceneFile};

/// What a figure may depend on.
#[derive(Debug, Clone)]
pub(crate) struct Context {
    pub(crate) profile: Profile,
    pub(crate) seed: u64,
    /// Folder for runs that several figures share, and whether they are made anew.
    pub(crate) stages: PathBuf,
    pub(crate) anew: bool,
    /// Folder of a wake that is to be shown instead of that of the profile.
    pub(crate) wake: Option<PathBuf>,
    /// Whether figures 10 to 14 look at the analytic pair instead of the simulated wake.
    pub(crate) analytic: bool,
}

impl Context {
    /// The scene of a figure as a checked file, with this run's seed.
    pub(crate) fn scene_file(&self, mut scene: Scene) -> Result<SceneFile, Failure> {
        scene.seed = self.seed;
        SceneFile::new(scene)
            .map_err(|problems| Failure::new(problems.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")))
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

/// What a figure gives.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Rendered {
    /// Extension and content of each file.
    #[serde(skip)]
    pub(crate) files: Vec<(String, Vec<u8>)>,
    /// What is drawn, for the report.
    pub(crate) caption: String,
    /// Short notes beside the name, such as what is not the real thing.
    pub(crate) marks: Vec<String>,
    /// What it comes to, for the head of the report; mostly nothing.
    pub(crate) words: String,
    /// Claims measured on the data of the run.
    pub(crate) claims: Vec<Claim>,
    /// Stage, wall-clock time and processor time, s.
    pub(crate) timings: Vec<(String, [f64; 2])>,
}

impl Rendered {
    /// A table as CSV, and the picture as SVG and PNG.
    pub(crate) fn new(table: &Table, figure: &Figure, origin: &Provenance) -> Result<Self, Failure> {
        let mut out = Self::of_table(table, origin)?;
        let (svg, png) = figure.svg_and_png(origin)?;
        out.files.push(("svg".into(), svg.into_bytes()));
        out.files.push(("png".into(), png));
        Ok(out)
    }

    /// A table as CSV.
    pub(crate) fn of_table(table: &Table, origin: &Provenance) -> Result<Self, Failure> {
        Ok(Self { files: vec![("csv".into(), table.to_csv(origin)?.into_bytes())], ..Self::default() })
    }

    /// One more table, as `figNN.` and the name.
    pub(crate) fn add(&mut self, name: &str, table: &Table, origin: &Provenance) -> Result<(), Failure> {
        self.files.push((name.into(), table.to_csv(origin)?.into_bytes()));
        Ok(())
    }

    pub(crate) fn file(&self, extension: &str) -> Option<&[u8]> {
        self.files.iter().find(|(e, _)| e == extension).map(|(_, bytes)| bytes.as_slice())
    }
}

/// A table of numbers, row by row.
pub(super) fn numbers_table<const N: usize>(names: [&str; N], rows: &[[f64; N]]) -> Table {
    let columns = names.into_iter().enumerate();
    columns.fold(Table::new(), |table, (k, name)| table.float(name, rows.iter().map(|row| row[k])))
}
