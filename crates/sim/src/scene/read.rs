//! Reading a scene file, with errors that name the key, the value, what is allowed and the line.

use super::{Problem, Scene};
use std::fmt;
use std::path::{Path, PathBuf};
use toml::de::{DeTable, DeValue};

/// A problem of a scene and the line where the file states it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Located {
    /// What is wrong.
    pub problem: Problem,
    /// Line of the key in the file, from 1; `None` where the value is a default.
    pub line: Option<usize>,
}

/// Why a scene file was refused.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The file cannot be read.
    #[error("cannot read the scene {}: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The text is no scene: broken TOML, an unknown key, a value of the wrong type.
    #[error("{}:{line}: {message}", path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// What is wrong and what is allowed.
        message: String,
    },
    /// Values out of their limits.
    #[error("{}", list(path, problems))]
    Invalid {
        /// The file.
        path: PathBuf,
        /// All of them, in the order of the scene's sections.
        problems: Vec<Located>,
    },
}

fn list(path: &Path, problems: &[Located]) -> String {
    let lines: Vec<String> = problems
        .iter()
        .map(|p| match p.line {
            Some(line) => format!("{}:{line}: {}", path.display(), p.problem),
            None => format!("{}: {} (a default)", path.display(), p.problem),
        })
        .collect();
    lines.join("\n")
}

/// A valid scene, with what names it.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneFile {
    /// The scene.
    pub scene: Scene,
    /// The scene as TOML, every default written out.
    pub toml: String,
    /// First 16 hexadecimal digits of the SHA-256 of `toml`.
    pub hash: String,
    /// Folder to which names of files in the scene are relative.
    pub folder: PathBuf,
    /// The file and its text, by which problems that a plan finds are given their lines; empty for a scene made in memory.
    origin: (PathBuf, String),
}

impl SceneFile {
    /// Reads and checks a scene file.
    ///
    /// # Errors
    /// [`SceneError`] names the file, the line, the key, the value and what is allowed.
    pub fn read(path: &Path) -> Result<Self, SceneError> {
        let text =
            std::fs::read_to_string(path).map_err(|source| SceneError::Unreadable { path: path.to_owned(), source })?;
        Self::parse(&text, path)
    }

    /// Checks the text of a scene file; `path` serves the error messages, and its folder is where files of the scene
    /// are looked for.
    ///
    /// # Errors
    /// As [`SceneFile::read`].
    pub fn parse(text: &str, path: &Path) -> Result<Self, SceneError> {
        let scene: Scene = toml::from_str(text).map_err(|e| malformed(text, path, &e))?;
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        let origin = (path.to_owned(), text.to_owned());
        Ok(Self { folder, origin, ..Self::new(scene).map_err(|problems| invalid(text, path, problems))? })
    }

    /// Checks a scene that was made in memory; its files are relative to the working folder.
    ///
    /// # Errors
    /// All problems of the scene.
    pub fn new(scene: Scene) -> Result<Self, Vec<Problem>> {
        let problems = scene.problems();
        if !problems.is_empty() {
            return Err(problems);
        }
        let toml = scene.to_toml();
        let hash = super::hash_of(&toml);
        Ok(Self { scene, toml, hash, folder: PathBuf::new(), origin: (PathBuf::from("scene"), String::new()) })
    }

    /// Problems that only a plan could find, with the lines of the file that this scene was read from.
    pub(crate) fn located(&self, problems: Vec<Problem>) -> SceneError {
        invalid(&self.origin.1, &self.origin.0, problems)
    }

    /// The same scene with the folder and the lines of the file that `other` was read from.
    #[cfg(feature = "cli")]
    pub(crate) fn from_the_file_of(self, other: Self) -> Self {
        Self { folder: other.folder, origin: other.origin, ..self }
    }
}

/// Problems with the lines where the text states their keys.
pub(crate) fn invalid(text: &str, path: &Path, problems: Vec<Problem>) -> SceneError {
    let document = DeTable::parse(text).ok();
    let locate = |problem: Problem| {
        let line = document.as_ref().and_then(|d| find(d.get_ref(), &problem.key)).map(|at| line_of(text, at));
        Located { problem, line }
    };
    SceneError::Invalid { path: path.to_owned(), problems: problems.into_iter().map(locate).collect() }
}

/// What the parser of TOML refused, with its line.
pub(crate) fn malformed(text: &str, path: &Path, error: &toml::de::Error) -> SceneError {
    let message = error.message().replace('\n', " ");
    let span = error.span().unwrap_or(0..0);
    // In a section that is chosen by a tag, the parser knows only where the section begins.
    let at = quoted(&message).filter(|_| message.starts_with("unknown field")).and_then(|key| {
        let document = DeTable::parse(text).ok()?;
        find_under(document.get_ref(), key, &span)
    });
    SceneError::Malformed { path: path.to_owned(), line: line_of(text, at.unwrap_or(span.start)), message }
}

/// The first word between backticks.
fn quoted(message: &str) -> Option<&str> {
    message.split('`').nth(1)
}

fn line_of(text: &str, offset: usize) -> usize {
    text.bytes().take(offset).filter(|&b| b == b'\n').count() + 1
}

/// Offset of the key with this path.
fn find(table: &DeTable<'_>, path: &str) -> Option<usize> {
    let (head, rest) = path.split_once('.').map_or((path, None), |(h, r)| (h, Some(r)));
    let (key, value) = table.iter().find(|(k, _)| k.get_ref() == head)?;
    match (rest, value.get_ref()) {
        (None, _) => Some(key.span().start),
        (Some(rest), DeValue::Table(inner)) => find(inner, rest),
        (Some(_), _) => None,
    }
}

/// Offset of a key of this name at or behind the start of `span`, in any table.
fn find_under(table: &DeTable<'_>, name: &str, span: &std::ops::Range<usize>) -> Option<usize> {
    let mut found = None;
    for (key, value) in table.iter() {
        let here = (key.get_ref() == name && key.span().start >= span.start).then(|| key.span().start);
        let inner = match value.get_ref() {
            DeValue::Table(inner) => find_under(inner, name, span),
            _ => None,
        };
        found = [found, here, inner].into_iter().flatten().min();
    }
    found
}

impl fmt::Display for Located {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.problem.fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(text: &str) -> String {
        SceneFile::parse(text, Path::new("s.toml")).unwrap_err().to_string()
    }

    #[test]
    fn limits_are_reported_with_key_value_range_and_line() {
        let text = "seed = 3\n[scan]\nrange_min_m = 300.0\nrealisations = 0\n";
        assert_eq!(message(text), "s.toml:4: scan.realisations = 0 is not allowed: a whole number from 1 to 1000000");
    }

    #[test]
    fn unknown_keys_are_refused_where_they_stand() {
        let text = "[laser]\nwavelength_m = 1.5e-6\nwavelenght_m = 1.5e-6\n";
        let m = message(text);
        assert!(m.starts_with("s.toml:3: unknown field `wavelenght_m`"), "{m}");
        assert!(m.contains("pulse_repetition_hz"), "allowed keys are listed: {m}");
    }

    #[test]
    fn unknown_keys_are_found_in_tagged_sections_too() {
        for (text, line) in [
            ("seed = 1\n[flow]\nkind = \"vortex_pair\"\nspacing_m = 40.0\ncore_m = 1.0\n", 5),
            ("[flow]\nkind = \"calm\"\nspacing_m = 40.0\n", 3),
            ("[detector.snr]\nreference = \"physical\"\nsnr_db = 0.0\n", 3),
            ("[atmosphere.turbulence]\nkind = \"none\"\ncn2 = 1e-14\n", 3),
        ] {
            let m = message(text);
            assert!(m.starts_with(&format!("s.toml:{line}: unknown field")), "{m}");
        }
    }

    #[test]
    fn nan_and_wrong_types_are_errors() {
        assert!(message("[pulse]\nenergy_j = nan\n").contains("s.toml:2: pulse.energy_j = NaN"));
        assert!(message("[pulse]\nenergy_j = \"much\"\n").starts_with("s.toml:2: "));
        assert!(message("[pulse\n").starts_with("s.toml:1: "));
    }

    #[test]
    fn equal_scenes_have_equal_hashes() {
        let hash = |text: &str| SceneFile::parse(text, Path::new("s")).unwrap().hash;
        assert_eq!(hash(""), hash("[laser]\nwavelength_m = 1.55e-6 # as the default\n"));
        assert_ne!(hash(""), hash("seed = 2\n"));
    }
}
