//! Which files this program wrote: every one of them says so at a place that its format has for it, and a file of
//! somebody else, or one that was edited since, is not replaced unless the user asks for it.
//! Check: each format is recognised from its own writer; other files of the same names are not.

use super::error::{OutputError, OutputResult};
use super::hpl::SYSTEM_ID;
use super::provenance::hash_of;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// The word at the beginning of [`crate::PROGRAM`].
const NAME: &str = "wakescope ";
/// Every writer puts the provenance before the data.
const HEAD_BYTES: u64 = 1 << 16;

/// What may be replaced by an output of the same name.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Existing {
    /// Files that this program wrote and nobody changed.
    #[default]
    Own,
    /// Any file.
    Any,
}

impl Existing {
    /// Any file for one who asked for that.
    pub fn with_overwrite(overwrite: bool) -> Self {
        if overwrite { Self::Any } else { Self::Own }
    }
}

/// Refuses names in a folder that cannot be written: a folder of that name is in the way, or a file that this program
/// did not write.
///
/// # Errors
/// [`OutputError::Foreign`] or [`OutputError::Io`], with the path.
pub fn refuse_foreign<'a>(
    folder: &Path,
    names: impl IntoIterator<Item = &'a str>,
    existing: Existing,
) -> OutputResult<()> {
    for name in names {
        let path = folder.join(name);
        let Ok(kind) = path.symlink_metadata() else {
            continue;
        };
        if path.is_dir() {
            let source = std::io::Error::new(
                std::io::ErrorKind::IsADirectory,
                "a folder of that name is in the way",
            );
            return Err(OutputError::Io {
                action: "write",
                path,
                source,
            });
        }
        if existing == Existing::Own && !(kind.is_file() && is_own(&path)) {
            return Err(OutputError::Foreign { path });
        }
    }
    Ok(())
}

/// Whether this program wrote that file, and a scene or case was not edited since. A file that cannot be read is not its own.
pub fn is_own(path: &Path) -> bool {
    let extension = path
        .extension()
        .and_then(|e| e.to_str())
        .unwrap_or_default();
    if extension == "toml" {
        return std::fs::read_to_string(path).is_ok_and(|text| is_own_toml(&text));
    }
    let mut head = Vec::new();
    let read = File::open(path).and_then(|file| file.take(HEAD_BYTES).read_to_end(&mut head));
    let name = path
        .file_name()
        .and_then(|n| n.to_str())
        .unwrap_or_default();
    read.is_ok() && is_own_head(name, extension, &head)
}

/// A scene or case with all defaults: the first line has the hash of the rest.
fn is_own_toml(text: &str) -> bool {
    let Some((first, rest)) = text.split_once('\n') else {
        return false;
    };
    let stated = first
        .strip_prefix("# ")
        .filter(|line| line.starts_with(NAME))
        .and_then(|line| line.rsplit(' ').next());
    stated == Some(hash_of(rest).as_str())
}

fn is_own_head(name: &str, extension: &str, head: &[u8]) -> bool {
    let begins = |with: &str| head.starts_with(with.as_bytes());
    match extension {
        "csv" => begins(&format!("# source: {NAME}")),
        "hpl" => begins(&format!("Filename:\t{name}\r\n{SYSTEM_ID}\r\n")),
        "nc" => begins("CDF") && has_source(head),
        "png" | "apng" => head.starts_with(b"\x89PNG") && has_source(head),
        "svg" => begins("<svg") && has_source(head),
        "json" => begins("{") && has_source(head),
        "txt" => begins(NAME),
        "vtr" | "pvd" => begins("<") && has_source(head),
        _ => false,
    }
}

/// Whether the text after the word `source` begins with the program's name; formats put a few bytes between the two.
fn has_source(head: &[u8]) -> bool {
    let Some(at) = find(head, "source") else {
        return false;
    };
    let after = &head[at..head.len().min(at + 40)];
    find(after, NAME).is_some()
}

fn find(bytes: &[u8], text: &str) -> Option<usize> {
    bytes
        .windows(text.len())
        .position(|window| window == text.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::super::{provenance::example, samples, tables};
    use super::*;

    fn written(folder: &Path) -> Vec<String> {
        let (origin, map) = (example(), samples::map());
        let mut files: Vec<(String, Vec<u8>)> = vec![
            (
                "map.csv".into(),
                tables::map_table(&map)
                    .unwrap()
                    .to_csv(&origin)
                    .unwrap()
                    .into_bytes(),
            ),
            (
                "halo.hpl".into(),
                super::super::hpl::hpl_bytes(&map, 0, "halo.hpl").unwrap(),
            ),
            (
                "scene.toml".into(),
                format!(
                    "# {}, scene {}\nseed = 1\n",
                    crate::PROGRAM,
                    hash_of("seed = 1\n")
                )
                .into_bytes(),
            ),
        ];
        files.push((
            "map.nc".into(),
            super::super::cfradial::cfradial_bytes(&map, &origin).unwrap(),
        ));
        #[cfg(feature = "plots")]
        {
            let figure =
                crate::plot::Figure::stacked([
                    crate::plot::MapPlot::new(&map, 0, "v_exact").unwrap()
                ]);
            files.push(("map.png".into(), figure.png(&origin).unwrap()));
            files.push(("map.svg".into(), figure.svg(&origin).unwrap().into_bytes()));
        }
        #[cfg(feature = "vtk")]
        files.extend([
            (
                "plane.vtr".into(),
                super::super::vtr::plane_bytes(&samples::planes(), 0, &origin).unwrap(),
            ),
            (
                "plane.pvd".into(),
                super::super::vtr::pvd_bytes([(2.5, "plane.vtr")], &origin),
            ),
        ]);
        for (name, bytes) in &files {
            std::fs::write(folder.join(name), bytes).unwrap();
        }
        files.into_iter().map(|(name, _)| name).collect()
    }

    #[test]
    fn files_of_every_writer_are_known_and_others_of_the_same_names_are_not() {
        let temp = tempfile::tempdir().unwrap();
        let names = written(temp.path());
        let refused =
            |existing| refuse_foreign(temp.path(), names.iter().map(String::as_str), existing);
        refused(Existing::Own).unwrap();
        for name in &names {
            let path = temp.path().join(name);
            let own = std::fs::read(&path).unwrap();
            // What a user may have there: another file of that kind, with or without the word in it.
            let mut other = own.clone();
            let from = find(&other, "source").unwrap_or(0);
            match find(&other[from..], NAME).map(|at| from + at) {
                Some(at) => other[at..at + NAME.len()].copy_from_slice(b"somebodys "),
                None => other[find(&own, SYSTEM_ID).unwrap() + SYSTEM_ID.len() - 1] = b'7',
            }
            for foreign in [
                other,
                b"# notes on wakescope 0.1.0\nmine\n".to_vec(),
                Vec::new(),
            ] {
                std::fs::write(&path, foreign).unwrap();
                let error = refused(Existing::Own).unwrap_err();
                assert!(
                    matches!(&error, OutputError::Foreign { path: found } if *found == path),
                    "{error}"
                );
                assert!(error.to_string().contains("--overwrite"), "{error}");
                refused(Existing::Any).unwrap();
            }
            std::fs::write(&path, own).unwrap();
        }
    }

    #[test]
    fn an_edited_scene_is_its_editors() {
        let text = format!(
            "# {}, scene {}\nseed = 1\n",
            crate::PROGRAM,
            hash_of("seed = 1\n")
        );
        assert!(is_own_toml(&text));
        assert!(!is_own_toml(&text.replace("seed = 1", "seed = 2")));
        assert!(
            !is_own_toml(crate::scene::TABLE2_TOML),
            "what init writes is there to be edited"
        );
    }
}
