//! The cache of figures: cause in, content out.
//!
//! The key is what a figure depends on: profile, seed, which flow it looks at, all code, the stored numbers, and the versions of what is
//! used. The value is a folder with the figure's files and one TOML index. What cannot be read is drawn anew.

use crate::cause::cause;
use crate::figures::context::{Context, Rendered};
use crate::workspace::root;
use fixtures::failure::{Failure, Outcome};
use std::path::{Path, PathBuf};
use toml::Table;

/// What figures come from.
const DRAWN_BY: [&str; 6] = [
    "crates",
    "xtask",
    "tests/curves",
    "tests/extreme",
    "tests/reference",
    "Cargo.lock",
];

/// Key of the index that lists the extensions of the files.
const EXTENSIONS: &str = "extensions";

/// The folder in which a figure is kept.
pub(super) fn folder(id: &str, context: &Context) -> Result<PathBuf, Failure> {
    let seed = context.seed.to_string();
    let flow = if context.analytic { "analytic" } else { "" };
    let parameters = [id, context.profile.name(), &seed, flow];
    let key = cause(&root(), &parameters, &DRAWN_BY)?;
    Ok(Context::cache().join(format!("{id}-{key}")))
}

/// The figure in a folder, if it was made before and can be read.
pub(super) fn load(id: &str, folder: &Path) -> Option<Rendered> {
    let text = std::fs::read_to_string(folder.join("index.toml")).ok()?;
    let mut index: Table = toml::from_str(&text).ok()?;
    let extensions: Vec<String> = index.remove(EXTENSIONS)?.try_into().ok()?;
    let mut files = Vec::new();
    for extension in extensions {
        let path = folder.join(format!("{id}.{extension}"));
        files.push((extension, std::fs::read(path).ok()?));
    }
    Some(Rendered {
        files,
        ..index.try_into().ok()?
    })
}

/// Keeps a figure in a folder.
pub(super) fn store(id: &str, folder: &Path, rendered: &Rendered) -> Outcome {
    let mut group = rendered.files_in(folder, id)?;
    let mut extensions = Vec::with_capacity(rendered.files.len());
    for (extension, _) in &rendered.files {
        extensions.push(extension.as_str());
    }
    let mut index = Table::try_from(rendered)?;
    index.insert(EXTENSIONS.into(), extensions.into());
    group.add("index.toml", toml::to_string(&index)?)?;
    group.commit()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::claim::Claim;

    #[test]
    fn what_is_stored_comes_back_and_damage_is_no_hit() {
        let temp = tempfile::tempdir().unwrap();
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
        assert!(load("fig00", temp.path()).is_none());
        store("fig00", temp.path(), &rendered).unwrap();
        assert_eq!(load("fig00", temp.path()), Some(rendered));
        std::fs::remove_file(temp.path().join("fig00.csv")).unwrap();
        assert!(load("fig00", temp.path()).is_none());
    }
}
