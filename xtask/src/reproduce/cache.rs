//! The cache of figures: content in, content out.
//!
//! The key is the SHA-256 of this very program, the profile and the seed, so that any change of any
//! crate makes new figures; the value is a folder with the figure's files and one TOML index. What
//! cannot be read is drawn anew.

use crate::figures::{Claim, Profile, Rendered, Verdict};
use crate::workspace::root;
use crate::{Failure, Outcome};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::path::PathBuf;
use wakescope_sim::export::FileGroup;

/// Figures made by one state of the program, for one profile and seed.
pub(super) struct Cache {
    folder: PathBuf,
}

#[derive(Serialize, Deserialize)]
struct Index {
    caption: String,
    marks: Vec<String>,
    extensions: Vec<String>,
    claims: Vec<StoredClaim>,
    timings: Vec<(String, f64)>,
}

#[derive(Serialize, Deserialize)]
struct StoredClaim {
    id: String,
    figure: String,
    statement: String,
    expected: String,
    measured: String,
    standard_error: f64,
    verdict: String,
}

impl Cache {
    pub(super) fn new(profile: Profile, seed: u64) -> Result<Self, Failure> {
        let program = std::fs::read(std::env::current_exe()?)?;
        let mut hash = Sha256::new();
        hash.update(&program);
        hash.update(profile.name());
        hash.update(seed.to_le_bytes());
        let key: String = hash.finalize().iter().take(12).map(|b| format!("{b:02x}")).collect();
        Ok(Self { folder: root().join("target/figures-cache").join(key) })
    }

    /// Folder for what several figures share.
    pub(super) fn stages(&self) -> PathBuf {
        self.folder.join("stages")
    }

    /// The figure, if it was made before and can be read.
    pub(super) fn load(&self, id: &str) -> Option<Rendered> {
        let folder = self.folder.join(id);
        let index: Index = toml::from_str(&std::fs::read_to_string(folder.join("index.toml")).ok()?).ok()?;
        let file = |e: &String| Some((e.clone(), std::fs::read(folder.join(format!("{id}.{e}"))).ok()?));
        Some(Rendered {
            files: index.extensions.iter().map(file).collect::<Option<_>>()?,
            caption: index.caption,
            marks: index.marks,
            claims: index.claims.into_iter().map(restore).collect::<Option<_>>()?,
            timings: index.timings,
        })
    }

    pub(super) fn store(&self, id: &str, rendered: &Rendered) -> Outcome {
        let mut group = FileGroup::new(&self.folder.join(id));
        for (extension, bytes) in &rendered.files {
            group.add(&format!("{id}.{extension}"), bytes.clone())?;
        }
        let index = Index {
            caption: rendered.caption.clone(),
            marks: rendered.marks.clone(),
            extensions: rendered.files.iter().map(|(e, _)| e.clone()).collect(),
            claims: rendered.claims.iter().map(keep).collect(),
            timings: rendered.timings.clone(),
        };
        group.add("index.toml", toml::to_string(&index)?)?;
        group.commit()?;
        Ok(())
    }
}

fn keep(claim: &Claim) -> StoredClaim {
    let Claim { id, figure, statement, expected, measured, standard_error, verdict } = claim.clone();
    StoredClaim { id, figure, statement, expected, measured, standard_error, verdict: verdict.name().into() }
}

fn restore(claim: StoredClaim) -> Option<Claim> {
    let StoredClaim { id, figure, statement, expected, measured, standard_error, verdict } = claim;
    let verdict = Verdict::ALL.into_iter().find(|v| v.name() == verdict)?;
    Some(Claim { id, figure, statement, expected, measured, standard_error, verdict })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_stored_comes_back_and_damage_is_no_hit() {
        let temp = tempfile::tempdir().unwrap();
        let cache = Cache { folder: temp.path().to_owned() };
        let mut rendered = Rendered { caption: "a caption".into(), ..Rendered::default() };
        rendered.csv("a\n1\n".into());
        rendered
            .claims
            .push(Claim { standard_error: 0.25, ..Claim::exact("F0", "fig00", "statement", "1", "2".into(), false) });
        rendered.timings.push(("total".into(), 1.5));
        assert!(cache.load("fig00").is_none());
        cache.store("fig00", &rendered).unwrap();
        assert_eq!(cache.load("fig00"), Some(rendered));
        std::fs::remove_file(temp.path().join("fig00/fig00.csv")).unwrap();
        assert!(cache.load("fig00").is_none());
    }
}
