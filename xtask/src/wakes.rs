//! Simulated wakes read from their files. Figures share one, which is run once for a profile and continued where it was
//! interrupted, or lies in a folder that was named. A wake is kept as long as its case and the code that computes it.

use crate::Failure;
use crate::cause::cause;
use crate::figures::context::Context;
use crate::workspace::root;
use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use wakescope_sim::flow::{self, Begin, CaseFile, CaseKind, Unwatched, WakeFlow, WakePreset};

/// Ages of the cross-planes that are kept, for pictures that move.
const SERIES_EVERY: f64 = 0.1;
/// What computes and writes a wake.
const COMPUTED_BY: [&str; 3] = ["crates/les", "crates/sim/src/flow", "crates/sim/src/export"];
/// Folders of the wakes that this process has made: two figures must not run the same one at the same time, nor twice.
static MADE: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// A finished run.
pub(crate) struct Wake {
    /// Where its files are.
    pub(crate) folder: PathBuf,
    /// The flow.
    pub(crate) flow: WakeFlow,
    /// The case as TOML.
    pub(crate) case_toml: String,
    /// Ages of the whole fields, in the order of the files.
    pub(crate) fields_tau: Vec<f64>,
    columns: HashMap<String, Vec<f64>>,
}

impl Wake {
    /// The wake that was named, or that of the profile.
    pub(crate) fn of(context: &Context) -> Result<Self, Failure> {
        if let Some(folder) = &context.wake {
            return Self::read(folder);
        }
        let preset = context.choose(WakePreset::Coarse, WakePreset::Medium, WakePreset::Chapter);
        let mut case = preset.case();
        if let Some(output) = &mut case.wake {
            output.series_tau = Some([0.0, output.end_tau]);
            output.series_every_tau = SERIES_EVERY;
        }
        let file = CaseFile::parse(&toml::to_string(&case)?, Path::new("wake"))?;
        let folder = context.stages.join(format!("wake-{}", cause(&root(), &[&file.hash], &COMPUTED_BY)?));
        let done = folder.join("done");
        {
            let mut made = MADE.lock().map_err(|_| Failure::new("another figure failed".into()))?;
            if context.anew && !made.contains(&folder) && folder.exists() {
                std::fs::remove_dir_all(&folder)?;
            }
            if !done.exists() {
                let begin = if folder.join("flow.checkpoint").exists() { Begin::Restart } else { Begin::Overwrite };
                flow::run(&file, &folder, begin, &mut Unwatched)?;
                std::fs::write(&done, &file.hash)?;
            }
            made.insert(folder.clone());
        }
        Self::from_files(&file, folder)
    }

    /// The finished run in a folder.
    pub(crate) fn read(folder: &Path) -> Result<Self, Failure> {
        let toml = text(&folder.join("case.toml"))?;
        Self::from_files(&CaseFile::parse(&toml, folder)?, folder.to_path_buf())
    }

    fn from_files(file: &CaseFile, folder: PathBuf) -> Result<Self, Failure> {
        let (CaseKind::Wake(flow), Some(output)) = (file.case.case.clone(), &file.case.wake) else {
            return Err(Failure::new(format!("{}: the case is no wake", folder.display())));
        };
        let mut columns = table(&text(&folder.join("wake.csv"))?)?;
        let scaled = folder.join("wake_scaled.csv");
        // Runs of earlier versions have all columns in one file.
        if scaled.exists() {
            columns.extend(table(&text(&scaled)?)?);
        }
        let wake = Self {
            folder,
            flow: *flow,
            case_toml: file.toml.clone(),
            fields_tau: output.fields_tau.clone().unwrap_or_default(),
            columns,
        };
        let reached = wake.column("tau")?.last().copied().unwrap_or(0.0);
        if reached < output.end_tau - 1e-9 {
            let place = wake.folder.display();
            return Err(Failure::new(format!("{place}: the run stands at tau = {reached} of {}", output.end_tau)));
        }
        Ok(wake)
    }

    /// A column of the history.
    pub(crate) fn column(&self, name: &str) -> Result<&[f64], Failure> {
        self.columns
            .get(name)
            .map(Vec::as_slice)
            .ok_or_else(|| Failure::new(format!("the history of the wake has no column {name}")))
    }

    /// A column against `tau`.
    pub(crate) fn curve(&self, name: &str) -> Result<Vec<(f64, f64)>, Failure> {
        Ok(self.column("tau")?.iter().copied().zip(self.column(name)?.iter().copied()).collect())
    }

    /// The run in words, its noise among them.
    pub(crate) fn words(&self) -> String {
        let [x, y, z] = self.flow.cells;
        format!(
            "simulated flow, {x} x {y} x {z} cells, Γ₀/ν = {}, core {} b₀, noise {} V₀",
            self.flow.reynolds, self.flow.core_radius, self.flow.perturbation
        )
    }
}

/// The text of a file of a run.
pub(crate) fn text(path: &Path) -> Result<String, Failure> {
    std::fs::read_to_string(path).map_err(|e| Failure::new(format!("cannot read {}: {e}", path.display())))
}

/// Columns of a table by name; empty places are NaN.
pub(crate) fn table(text: &str) -> Result<HashMap<String, Vec<f64>>, Failure> {
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let names: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let mut columns = vec![Vec::new(); names.len()];
    for line in lines {
        for (column, value) in columns.iter_mut().zip(line.split(',')) {
            let number = if value.is_empty() { Ok(f64::NAN) } else { value.parse() };
            column.push(number.map_err(|_| Failure::new(format!("{value} in the history of the wake is no number")))?);
        }
    }
    Ok(names.into_iter().map(String::from).zip(columns).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_computes_a_wake_is_where_it_is_said_to_be() {
        let of = |places: &[&str]| cause(&root(), &["case"], places);
        assert_ne!(of(&COMPUTED_BY).unwrap(), of(&COMPUTED_BY[..1]).unwrap());
    }
}
