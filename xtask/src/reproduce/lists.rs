//! The three lists of claims: what the chapter says, in its words; checks that cannot fail; all others, which are the program's own.
//!
//! Check: every entry is a claim of some figure.

use crate::claim::{LIST, Listed};

/// Which list a claim is on.
#[derive(Clone, Copy)]
pub(super) enum Kind {
    Chapter(&'static str, &'static Listed),
    Own,
    /// Arithmetic, copies, geometry: counted nowhere.
    Check,
}

impl Kind {
    pub(super) fn of(id: &str) -> Self {
        match LIST.iter().find(|listed| listed.id == id) {
            Some(listed @ Listed { quote: Some(quote), .. }) => Self::Chapter(quote, listed),
            Some(Listed { check: true, .. }) => Self::Check,
            _ => Self::Own,
        }
    }

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Chapter(..) => "chapter",
            Self::Own => "own",
            Self::Check => "check",
        }
    }

    /// The sentence and its case, or what else the claim comes from.
    pub(super) fn source(self) -> String {
        match self {
            Self::Chapter(quote, listed) => format!("\"{quote}\" Judged at: {}.", listed.case),
            Self::Own => "of this program".into(),
            Self::Check => "arithmetic, a copy or geometry: cannot fail unless the program is wrong".into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workspace::root;

    #[test]
    fn every_entry_is_a_claim_of_a_figure() {
        let folder = std::fs::read_dir(root().join("xtask/src/figures")).unwrap();
        let code: String = folder.map(|file| std::fs::read_to_string(file.unwrap().path()).unwrap()).collect();
        for Listed { id, .. } in LIST.iter() {
            assert!(code.contains(&format!("\"{id}\"")), "no figure claims {id}");
        }
        assert_eq!(LIST.iter().filter(|listed| listed.quote.is_some()).count(), 19);
        // And every claim of a figure is on the list.
        let is_claim = |word: &&str| {
            let number = word.strip_prefix("CP").or(word.strip_prefix('F')).or(word.strip_prefix('T')).unwrap_or("");
            number.starts_with(|c: char| c.is_ascii_digit()) && number.len() < 4
        };
        for id in code.split('"').filter(is_claim) {
            assert!(LIST.iter().any(|listed| listed.id == id), "{id} is not in claims.toml");
        }
        let kinds = ["F13", "F5", "F18a"].map(|id| Kind::of(id).name());
        assert_eq!(kinds, ["chapter", "check", "own"]);
    }
}
