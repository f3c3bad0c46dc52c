//! `wakescope bound`: the Cramer-Rao bound for a scene.

use super::{Cli, load, say, with_threads};
use crate::plan::{Plan, Target};
use crate::progress::Silent;
use crate::{Error, bound, write};
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

/// Words of `wakescope bound`.
#[derive(Debug, Args)]
pub(super) struct BoundWords {
    /// The scene.
    scene: PathBuf,
    /// File for the whole table, as CSV.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

pub(super) fn bound(words: &BoundWords, cli: &Cli) -> Result<(), Error> {
    let plan = Plan::new(load(&words.scene, cli)?, Target::Map)?;
    let found = with_threads(cli, || bound::bound(&plan, &Silent))??;
    let mut text = found.text();
    if let Some(path) = &words.out {
        crate::export::write_atomic(path, found.table().to_csv(&write::provenance(&plan))?)?;
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
        "by_range": points(&found.by_range), "files": words.out,
    });
    say(cli, &object, &text)
}
