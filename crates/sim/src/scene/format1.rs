//! Scenes of format 1, which had the keys of all methods and of the Gaussian pulse side by side: what to write instead.

use super::SceneError;
use crate::keys::{Document, Problem};

/// Keys of format 1 and the tables that have them now.
const MOVED: [(&str, &str, &str); 10] = [
    ("estimator", "method", "method"),
    ("estimator", "order", "method"),
    ("estimator", "order_choice", "method"),
    ("estimator", "lag_window_lags", "method"),
    ("estimator", "moment_reach", "method"),
    ("estimator", "likelihood_snr_db", "method"),
    ("estimator", "gradient_max_per_s", "method"),
    ("estimator", "gradients", "method"),
    ("pulse", "duration_s", "shape"),
    ("pulse", "definition", "shape"),
];

/// Refuses a text of format 1: one that says so, or that states no format and keys where format 1 had them.
///
/// # Errors
/// The first key of each section with all that stands for them now, and the line of the format.
pub(super) fn refuse(document: &Document<'_>) -> Result<(), SceneError> {
    let format = document.written("format");
    if format.as_deref().is_some_and(|format| format != "1") {
        return Ok(());
    }
    let mut problems = Vec::new();
    for section in ["estimator", "pulse"] {
        let stated: Vec<(&str, &str, String, String)> = MOVED
            .iter()
            .filter(|(of, ..)| *of == section)
            .filter_map(|(_, name, table)| {
                let key = format!("{section}.{name}");
                // The method of format 2 is a table.
                let is_old = *name != "method" || document.value(&key).is_some_and(|value| value.is_str());
                document.written(&key).filter(|_| is_old).map(|value| (*name, *table, key, value))
            })
            .collect();
        let Some((_, table, key, value)) = stated.first() else { continue };
        let line = |(name, _, _, value): &(&str, &str, String, String)| {
            format!("{} = {value}", if *name == "method" { "kind" } else { name })
        };
        let old: Vec<String> = stated.iter().map(|(name, _, _, value)| format!("{name} = {value}")).collect();
        let new: Vec<String> = stated.iter().map(line).collect();
        let allowed = format!(
            "this is format 1: [{section}] {} -> [{section}.{table}] {}, with format = 2",
            old.join(", "),
            new.join(", ")
        );
        problems.push(Problem { key: key.clone(), value: value.clone(), allowed });
    }
    if let (Some(value), true) = (format, problems.is_empty()) {
        let allowed = "2, the format of this program; nothing else of this file changes".into();
        problems.push(Problem { key: "format".into(), value, allowed });
    }
    if problems.is_empty() { Ok(()) } else { Err(document.located(problems)) }
}

#[cfg(test)]
mod tests {
    use super::super::SceneFile;
    use std::path::Path;

    fn message(text: &str) -> String {
        SceneFile::parse(text, Path::new("s.toml")).unwrap_err().to_string()
    }

    #[test]
    fn a_scene_of_format_1_is_told_what_to_write() {
        let old = "format = 1\n[pulse]\nduration_s = 400e-9\n[estimator]\nmethod = \"capon\"\norder = 16\n";
        assert_eq!(
            message(old).lines().collect::<Vec<_>>(),
            [
                "s.toml:3: pulse.duration_s = 400e-9 is not allowed: this is format 1: [pulse] duration_s = 400e-9 -> \
                 [pulse.shape] duration_s = 400e-9, with format = 2",
                "s.toml:5: estimator.method = \"capon\" is not allowed: this is format 1: [estimator] method = \"capon\", \
                 order = 16 -> [estimator.method] kind = \"capon\", order = 16, with format = 2",
            ]
        );
        assert_eq!(
            message("format = 1\n"),
            "s.toml:1: format = 1 is not allowed: 2, the format of this program; nothing else of this file changes"
        );
        assert!(message("[estimator]\norder = 8\n").contains("-> [estimator.method] order = 8, with format = 2"));
        let new = "format = 2\n[pulse.shape]\nduration_s = 400e-9\n[estimator.method]\nkind = \"capon\"\norder = 16\n";
        assert!(SceneFile::parse(new, Path::new("s.toml")).is_ok());
    }
}
