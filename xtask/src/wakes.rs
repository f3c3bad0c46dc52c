//! Simulated wakes read from their files. Figures share one, which is run once for a profile and continued where it was
//! interrupted, or lies in a folder that was named. A wake is kept as long as its case and the code that computes it.

use crate::Failure;
use crate::cause::cause;
use crate::figures::context::Context;
use crate::workspace::root;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use wakescope_sim::flow::{self, Begin, CaseFile, FinishedWake, Unwatched, WakePreset};

/// Ages of the cross-planes that are kept, for pictures that move.
const SERIES_EVERY: f64 = 0.1;
/// What computes and writes a wake.
const COMPUTED_BY: [&str; 3] = ["crates/les", "crates/sim/src/flow", "crates/sim/src/io"];
/// Folders of the wakes that this process has made: two figures must not run the same one at the same time, nor twice.
static MADE: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// The wake that was named, or that of the profile.
pub(crate) fn of(context: &Context) -> Result<FinishedWake, Failure> {
    if let Some(folder) = &context.wake {
        return Ok(FinishedWake::read(folder)?);
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
            // From its last good checkpoint, or anew where there is none.
            flow::run(&file, &folder, Begin::Restart, &mut Unwatched)?;
            std::fs::write(&done, &file.hash)?;
        }
        made.insert(folder.clone());
    }
    Ok(FinishedWake::read(&folder)?)
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
