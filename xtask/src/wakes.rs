//! Simulated wakes read from their files. Figures share one, which is run once for a profile and continued where it was
//! interrupted, or lies in a folder that was named.

use crate::Failure;
use crate::figures::Context;
use std::path::Path;
use std::sync::Mutex;
use wakescope_sim::flow::{self, Begin, CaseFile, FinishedWake, Unwatched, WakePreset};

/// Ages of the cross-planes that are kept, for pictures that move.
const SERIES_EVERY: f64 = 0.1;
/// Two figures must not run the same wake at the same time.
static RUNNING: Mutex<()> = Mutex::new(());

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
    let folder = context.stages.join(format!("wake-{}", file.hash));
    let done = folder.join("done");
    {
        let _running = RUNNING.lock().map_err(|_| Failure::new("another figure failed".into()))?;
        if !done.exists() {
            let begin = if folder.join("flow.checkpoint").exists() { Begin::Restart } else { Begin::Overwrite };
            flow::run(&file, &folder, begin, &mut Unwatched)?;
            std::fs::write(&done, &file.hash)?;
        }
    }
    Ok(FinishedWake::read(&folder)?)
}
