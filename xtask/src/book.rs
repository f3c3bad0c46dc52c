//! `cargo xtask book`: the book as pages that a server of files can give, with the documentation of the crates in its folder `api`.

use crate::workspace::{built, root};
use fixtures::failure::{Failure, Outcome};
use std::io::ErrorKind;
use std::path::Path;
use std::process::Command;

/// Packages that nobody takes: tasks and tests.
const NOT_FOR_OTHERS: [&str; 3] = ["xtask", "fixtures", "wakescope-tests"];

/// Builds both into `target/book`.
///
/// # Errors
/// Where mdBook is not installed, where one of the two cannot be built, and where files cannot be copied.
pub(crate) fn run() -> Outcome {
    // First, for it empties the folder.
    call("mdbook", &["build", "docs"])?;
    let without: Vec<&str> = NOT_FOR_OTHERS.iter().flat_map(|name| ["--exclude", *name]).collect();
    call(env!("CARGO"), &[&["doc", "--workspace", "--no-deps"], without.as_slice()].concat())?;
    copy(&built().join("doc"), &root().join("target/book/api"))?;
    println!("target/book/index.html");
    Ok(())
}

fn call(program: &str, words: &[&str]) -> Outcome {
    match Command::new(program).args(words).current_dir(root()).status() {
        Ok(status) if status.success() => Ok(()),
        Ok(_) => Err(Failure::new(format!("{program} {} failed", words.join(" ")))),
        Err(error) if error.kind() == ErrorKind::NotFound => {
            Err(Failure::new(format!("{program} is not installed: `cargo install --locked {program}` does that")))
        }
        Err(error) => Err(Failure::new(format!("cannot run {program}: {error}"))),
    }
}

/// Copies a folder with all that is in it.
fn copy(from: &Path, to: &Path) -> Outcome {
    std::fs::create_dir_all(to)?;
    for entry in std::fs::read_dir(from)? {
        let entry = entry?;
        let target = to.join(entry.file_name());
        match entry.file_type()?.is_dir() {
            true => copy(&entry.path(), &target)?,
            false => drop(std::fs::copy(entry.path(), target)?),
        }
    }
    Ok(())
}
