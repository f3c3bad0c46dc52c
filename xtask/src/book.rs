//! `cargo xtask book`: the book as a static site, with the documentation of the crates in its folder `api`.
//!
//! Tables that a command makes are not stored: the commands run here, and a copy of the pages gets
//! their results.

use crate::process::{call, program};
use crate::profile::Profile;
use crate::workspace::{built, root};
use crate::{audit, column_tables, key_tables, left_out, work_precision};
use fixtures::failure::Outcome;
use std::path::Path;
use std::process::Command;
use walkdir::WalkDir;

/// Packages without documentation for users: tasks and tests.
const PRIVATE_PACKAGES: [&str; 3] = ["xtask", "fixtures", "wakescope-tests"];

/// Files beside the pages that this task makes.
pub(crate) const RESULTS: [&str; 7] = [
    KEYS,
    COLUMNS,
    AUDIT,
    LEFT_OUT,
    WORK_PRECISION,
    WORK_PRECISION_CSV,
    WORK_PRECISION_SVG,
];
const KEYS: &str = "keys-tables.md";
const COLUMNS: &str = "columns-table.md";
const AUDIT: &str = "audit-results.md";
const LEFT_OUT: &str = "left-out-results.md";
const WORK_PRECISION: &str = "work-precision-results.md";
const WORK_PRECISION_CSV: &str = "images/work_precision.csv";
const WORK_PRECISION_SVG: &str = "images/work_precision.svg";

/// Folder of the pictures that commands of the gallery make.
pub(crate) const GALLERY: &str = "gallery/";

/// Builds both into `target/book`.
///
/// # Errors
/// Fails if mdBook is not installed, a command of a page fails, or one of the two cannot be built.
pub(crate) fn run() -> Outcome {
    let book = root().join("target/book");
    let copy = root().join("target/book-pages");
    copy_folder(&root().join("docs"), &copy)?;
    write_results(&copy.join("src"))?;
    draw_gallery(&copy.join("src"))?;
    // First, since mdBook empties the folder.
    let mut mdbook = Command::new("mdbook");
    mdbook.arg("build").arg(&copy).arg("--dest-dir").arg(&book);
    call(&mut mdbook)?;
    let mut doc = Command::new(env!("CARGO"));
    doc.args(["doc", "--workspace", "--no-deps"]);
    for package in PRIVATE_PACKAGES {
        doc.args(["--exclude", package]);
    }
    call(&mut doc)?;
    copy_folder(&built().join("doc"), &book.join("api"))?;
    println!("target/book/index.html");
    Ok(())
}

/// Runs the commands whose results pages include.
fn write_results(pages: &Path) -> Outcome {
    std::fs::write(pages.join(KEYS), key_tables::page()?)?;
    std::fs::write(pages.join(COLUMNS), column_tables::page()?)?;
    std::fs::write(pages.join(AUDIT), audit::page()?)?;
    std::fs::write(pages.join(LEFT_OUT), left_out::page()?)?;
    let rows = work_precision::measure(None, Profile::Full)?;
    let origin = work_precision::provenance_of_run(false);
    let csv = work_precision::table(&rows).to_csv(&origin)?;
    let svg = work_precision::picture(&rows).svg(&origin)?;
    std::fs::write(pages.join(WORK_PRECISION), work_precision::text(&rows))?;
    std::fs::write(pages.join(WORK_PRECISION_CSV), csv)?;
    std::fs::write(pages.join(WORK_PRECISION_SVG), svg)?;
    Ok(())
}

/// Runs the commands of the gallery in the folder of its pictures.
fn draw_gallery(pages: &Path) -> Outcome {
    let folder = pages.join(GALLERY);
    std::fs::create_dir_all(&folder)?;
    let wakescope = program(None)?;
    write_scenes(&std::fs::read_to_string(pages.join("airport.md"))?, &folder)?;
    let page = std::fs::read_to_string(pages.join("gallery.md"))?;
    for line in page.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let (mut command, arguments) = match words.as_slice() {
            ["wakescope", arguments @ ..] => (Command::new(&wakescope), arguments),
            ["cargo", "xtask", arguments @ ..] => {
                (Command::new(std::env::current_exe()?), arguments)
            }
            _ => continue,
        };
        command.args(arguments).current_dir(&folder);
        call(&mut command)?;
    }
    for entry in std::fs::read_dir(root().join("target/figures"))? {
        let path = entry?.path();
        if let Some(name) = path.file_name()
            && path.extension().is_some_and(|end| end == "svg")
        {
            std::fs::copy(&path, folder.join(name))?;
        }
    }
    Ok(())
}

/// Writes the scenes of a page, each with its name in its first line, into a folder.
fn write_scenes(page: &str, folder: &Path) -> Outcome {
    for rest in page.split("```toml\n# ").skip(1) {
        if let Some((block, _)) = rest.split_once("```")
            && let Some((name, scene)) = block.split_once('\n')
        {
            std::fs::write(folder.join(name), scene)?;
        }
    }
    Ok(())
}

/// Copies a folder with all that it holds; the copy has nothing else.
fn copy_folder(from: &Path, to: &Path) -> Outcome {
    if to.exists() {
        std::fs::remove_dir_all(to)?;
    }
    for entry in WalkDir::new(from) {
        let entry = entry?;
        let path = entry.path();
        let copy = to.join(path.strip_prefix(from)?);
        if entry.file_type().is_dir() {
            std::fs::create_dir_all(copy)?;
        } else {
            std::fs::copy(path, copy)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_copied_folder_has_the_files_of_the_original_and_no_others() {
        let temp = tempfile::tempdir().unwrap();
        let from = temp.path().join("from");
        let to = temp.path().join("to");
        std::fs::create_dir_all(from.join("inner")).unwrap();
        std::fs::write(from.join("inner/a.md"), "text").unwrap();
        std::fs::create_dir_all(&to).unwrap();
        std::fs::write(to.join("old.md"), "old").unwrap();
        copy_folder(&from, &to).unwrap();
        assert_eq!(
            std::fs::read_to_string(to.join("inner/a.md")).unwrap(),
            "text"
        );
        assert!(!to.join("old.md").exists());
    }
}
