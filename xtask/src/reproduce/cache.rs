//! The cache of figures: cause in, content out.
//!
//! The key is what a figure depends on: profile, seed, which flow it looks at, all code, the stored numbers, and the versions of what is
//! used. The value is a folder with the figure's files and one TOML index. What cannot be read is drawn anew.

use crate::cause::cause;
use crate::figures::context::{Context, Rendered};
use crate::workspace::root;
use fixtures::failure::{Failure, Outcome};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// What figures come from.
const DRAWN_BY: [&str; 6] = [
    "crates",
    "xtask",
    "tests/curves",
    "tests/extreme",
    "tests/reference",
    "Cargo.lock",
];

/// Where one figure is kept.
pub(super) struct Place {
    id: &'static str,
    folder: PathBuf,
}

#[derive(Serialize, Deserialize)]
struct Index {
    extensions: Vec<String>,
    rendered: Rendered,
}

impl Place {
    pub(super) fn new(id: &'static str, context: &Context) -> Result<Self, Failure> {
        let seed = context.seed.to_string();
        let flow = if context.analytic { "analytic" } else { "" };
        let parameters = [id, context.profile.name(), &seed, flow];
        let key = cause(&root(), &parameters, &DRAWN_BY)?;
        Ok(Self {
            id,
            folder: Context::cache().join(format!("{id}-{key}")),
        })
    }

    /// The figure, if it was made before and can be read.
    pub(super) fn load(&self) -> Option<Rendered> {
        let text = std::fs::read_to_string(self.folder.join("index.toml")).ok()?;
        let index: Index = toml::from_str(&text).ok()?;
        let mut files = Vec::new();
        for extension in index.extensions {
            let path = self.folder.join(format!("{}.{extension}", self.id));
            files.push((extension, std::fs::read(path).ok()?));
        }
        Some(Rendered {
            files,
            ..index.rendered
        })
    }

    pub(super) fn store(&self, rendered: &Rendered) -> Outcome {
        let mut group = rendered.files_in(&self.folder, self.id)?;
        let extensions = rendered
            .files
            .iter()
            .map(|(extension, _)| extension.clone());
        let index = Index {
            extensions: extensions.collect(),
            rendered: rendered.clone(),
        };
        group.add("index.toml", toml::to_string(&index)?)?;
        group.commit()?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::claim::Claim;

    #[test]
    fn what_is_stored_comes_back_and_damage_is_no_hit() {
        let temp = tempfile::tempdir().unwrap();
        let place = Place {
            id: "fig00",
            folder: temp.path().to_owned(),
        };
        let mut rendered = Rendered {
            caption: "a caption".into(),
            ..Rendered::default()
        };
        rendered.files.push(("csv".into(), b"a\n1\n".to_vec()));
        rendered.claims.push(Claim {
            standard_error: 0.25,
            ..Claim::exact("F5", "2".into(), false)
        });
        rendered.took_s = [1.5, 2.5];
        assert!(place.load().is_none());
        place.store(&rendered).unwrap();
        assert_eq!(place.load(), Some(rendered));
        std::fs::remove_file(temp.path().join("fig00.csv")).unwrap();
        assert!(place.load().is_none());
    }
}
