//! The three lists of claims: what the chapter says, in its words; checks that cannot fail; all others, which are the program's own.
//!
//! Check: every entry is a claim of some figure.

use serde::Deserialize;
use std::sync::LazyLock;

#[derive(Deserialize)]
struct Chapter {
    claim: Vec<Said>,
}

/// A claim of the chapter.
#[derive(Deserialize)]
pub(super) struct Said {
    id: String,
    /// Its sentence, word for word.
    quote: String,
    /// Where it is judged, and what of that the chapter does not say.
    case: String,
}

/// Which list a claim is on.
#[derive(Clone, Copy)]
pub(super) enum Kind {
    Chapter(&'static Said),
    Own,
    /// Arithmetic, copies, geometry: counted nowhere.
    Check,
}

impl Kind {
    pub(super) fn of(id: &str) -> Self {
        match CHAPTER.claim.iter().find(|said| said.id == id) {
            Some(said) => Self::Chapter(said),
            None if CHECKS.contains(&id) => Self::Check,
            None => Self::Own,
        }
    }

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Chapter(_) => "chapter",
            Self::Own => "own",
            Self::Check => "check",
        }
    }

    /// The sentence and its case, or what else the claim comes from.
    pub(super) fn source(self) -> String {
        match self {
            Self::Chapter(said) => format!("\"{}\" Judged at: {}.", said.quote, said.case),
            Self::Own => "of this program".into(),
            Self::Check => "arithmetic, a copy or geometry: cannot fail unless the program is wrong".into(),
        }
    }
}

const CHECKS: [&str; 8] = ["T1", "T2", "F1a", "F1b", "F5", "F9a", "F12c", "F21a"];

/// What the chapter says; the test reads it.
static CHAPTER: LazyLock<Chapter> =
    LazyLock::new(|| toml::from_str(include_str!("chapter.toml")).unwrap_or(Chapter { claim: Vec::new() }));

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workspace::root;

    #[test]
    fn every_entry_is_a_claim_of_a_figure() {
        let folder = std::fs::read_dir(root().join("xtask/src/figures")).unwrap();
        let code: String = folder.map(|file| std::fs::read_to_string(file.unwrap().path()).unwrap()).collect();
        for id in CHAPTER.claim.iter().map(|said| said.id.as_str()).chain(CHECKS) {
            assert!(code.contains(&format!("\"{id}\"")), "no figure claims {id}");
        }
        assert_eq!(CHAPTER.claim.len(), 19);
        let kinds = ["F13", "F5", "F18a"].map(|id| Kind::of(id).name());
        assert_eq!(kinds, ["chapter", "check", "own"]);
    }
}
