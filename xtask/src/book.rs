//! `cargo xtask book`: the book as pages that a server of files can give, with the documentation of the crates in its folder `api`.

use crate::process::call;
use crate::workspace::built;
use fixtures::failure::Outcome;
use std::process::Command;

/// Packages that nobody takes: tasks and tests.
const NOT_FOR_OTHERS: [&str; 3] = ["xtask", "fixtures", "wakescope-tests"];

/// Builds both into `target/book`.
///
/// # Errors
/// Where mdBook is not installed, where one of the two cannot be built, and where files cannot be copied.
pub(crate) fn run() -> Outcome {
    // First, for it empties the folder.
    call(Command::new("mdbook").args(["build", "docs"]))?;
    let without = NOT_FOR_OTHERS.iter().flat_map(|name| ["--exclude", *name]);
    call(
        Command::new(env!("CARGO"))
            .args(["doc", "--workspace", "--no-deps"])
            .args(without),
    )?;
    call(
        Command::new("cp")
            .arg("-r")
            .arg(built().join("doc"))
            .arg("target/book/api"),
    )?;
    println!("target/book/index.html");
    Ok(())
}
