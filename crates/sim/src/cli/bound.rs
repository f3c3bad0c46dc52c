//! `wakescope bound`: the Cramer-Rao bound for a scene.

use super::{Cli, load, say};
use crate::io::Existing;
use crate::io::own::refuse_foreign;
use crate::plan::{Plan, Target};
use crate::setup::progress::Silent;
use crate::{Error, measure::bound, write};
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Words of `wakescope bound`.
#[derive(Debug, Args)]
pub(super) struct BoundWords {
    /// The scene.
    scene: PathBuf,
    /// File for the whole table, as CSV.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Replace the file although this program did not write it, or it was changed since.
    #[arg(long)]
    overwrite: bool,
    /// Compute even if the forecast of the memory is more than the machine has.
    #[arg(long)]
    allow_large: bool,
}

pub(super) fn bound(words: &BoundWords, cli: &Cli) -> Result<(), Error> {
    let plan = Plan::new(load(&words.scene, cli)?, Target::Map)?;
    if !words.allow_large {
        plan.bound_fits()?;
    }
    if let Some(path) = &words.out {
        let existing = if words.overwrite { Existing::Any } else { Existing::Own };
        let name = path.file_name().and_then(|name| name.to_str());
        refuse_foreign(path.parent().unwrap_or(Path::new("")), name, existing)?;
    }
    let found = bound::bound(&plan, &Silent)?;
    let mut text = found.text();
    if let Some(path) = &words.out {
        crate::io::write_atomic(path, found.table().to_csv(&write::provenance(&plan))?)?;
        text += &format!("wrote {}\n", path.display());
    }
    let points = |points: &[bound::BoundPoint]| -> Vec<serde_json::Value> {
        let object = |p: &bound::BoundPoint| {
            json!({
                "range_m": p.range_m, "snr_db": p.snr_db, "bound_window_m_s": p.window_m_s, "level": p.level,
                "n_eff": p.n_eff, "bound_region_m_s": p.region_m_s,
            })
        };
        points.iter().map(object).collect()
    };
    let object = json!({
        "version": crate::VERSION, "scene_hash": plan.scene.hash, "by_snr": points(&found.by_snr),
        "by_range": points(&found.by_range), "files": words.out.as_ref().map(|out| out.to_string_lossy()),
    });
    say(cli.json, &object, &text)
}
