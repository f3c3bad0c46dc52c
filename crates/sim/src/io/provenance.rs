//! Where a file comes from: program version, scene, seed. Written into every output, whatever its format.
//! There is no creation time, so that the same run gives the same bytes.
//! Check: each writer's test finds scene, hash, seed and version in its bytes.

use sha2::{Digest, Sha256};

/// Origin of a result, enough to make it again.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Provenance {
    /// Name and version of the program, such as `wakescope 0.1.0`.
    pub program: String,
    /// The scene that was run, as TOML text with all defaults written down.
    pub scene_toml: String,
    /// Hash of the canonical scene (hexadecimal).
    pub scene_hash: String,
    /// Seed of all random streams. Written as text: classic NetCDF has no 64-bit integer.
    pub seed: u64,
}

impl Provenance {
    /// Of this program.
    pub fn new(scene_toml: &str, scene_hash: &str, seed: u64) -> Self {
        Self {
            program: crate::PROGRAM.into(),
            scene_toml: scene_toml.into(),
            scene_hash: scene_hash.into(),
            seed,
        }
    }

    /// The scene with every default written out, as a file that this program knows for its own: running it again gives the same files.
    pub fn scene_file(&self) -> String {
        format!(
            "# {}, scene {}\n{}",
            self.program, self.scene_hash, self.scene_toml
        )
    }

    /// The entries as (key, text), in the order in which every writer puts them.
    pub fn entries(&self) -> [(&'static str, String); 4] {
        [
            ("source", self.program.clone()),
            ("seed", self.seed.to_string()),
            ("scene_hash", self.scene_hash.clone()),
            ("scene", self.scene_toml.clone()),
        ]
    }

    /// The entries as comment lines `# key: value` that end with a line feed; the scene follows its key line by line, indented.
    pub fn comment_lines(&self) -> String {
        let [source, seed, hash, (_, scene)] = self.entries();
        let mut text = String::new();
        // A comment must stay one line for every reader of the table.
        for (key, value) in [source, seed, hash] {
            text += &format!("# {key}: {}\n", value.replace(['\n', '\r'], " "));
        }
        text += "# scene:\n";
        for line in scene.lines() {
            let comment = format!("#   {}", line.replace('\r', " "));
            text += comment.trim_end();
            text.push('\n');
        }
        text
    }
}

/// The short name of a text: the first 16 hexadecimal digits of its SHA-256.
pub fn hash_of(text: &str) -> String {
    Sha256::digest(text.as_bytes())
        .iter()
        .take(8)
        .map(|b| format!("{b:02x}"))
        .collect()
}

#[cfg(test)]
pub(crate) fn example() -> Provenance {
    Provenance {
        program: "wakescope 0.1.0".into(),
        scene_toml: "seed = 18446744073709551615\n\n[laser]\nname = \"<a & b>\"\n".into(),
        scene_hash: "00ff".into(),
        seed: u64::MAX,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_of_the_scene_is_a_comment() {
        let text = example().comment_lines();
        assert!(
            text.lines()
                .all(|l| l.starts_with('#') && l == l.trim_end()),
            "{text}"
        );
        assert!(text.contains("# seed: 18446744073709551615\n"));
        assert!(text.contains("#   [laser]\n"));
        assert!(text.ends_with('\n'));
    }
}
