//! `cargo xtask left-out`: what a scene does not pay for, and what a crate does not pull in.
//!
//! A scene that has everything is run whole and without one thing at a time, each run a process of its own with one thread; the crates behind
//! each of ours, alone and with its features, are counted by cargo and, if asked, compiled from nothing.

use crate::process::{call, children_cpu_s, output, program, run_scene};
use crate::workspace::root;
use fixtures::failure::{Failure, Outcome};
use serde::Deserialize;
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use toml::{Table, Value};

/// Options of the task.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// The program to run, instead of the release build.
    #[arg(long, value_name = "FILE")]
    program: Option<PathBuf>,
    /// Compile each crate with its features from nothing, too, which takes long.
    #[arg(long)]
    compile: bool,
    /// Store both tables in the book.
    #[arg(long)]
    store: bool,
}

/// The scene that has everything, and what is taken out.
#[derive(Deserialize)]
struct Scenes {
    whole: Table,
    without: Vec<Without>,
    package: Vec<Package>,
}

/// What is taken out of the scene, and by which keys: a word with dots and its value; the text "absent" takes the key out.
#[derive(Deserialize)]
struct Without {
    name: String,
    keys: Table,
}

/// A crate with some of its features and without the default ones.
#[derive(Deserialize)]
struct Package {
    name: String,
    features: String,
    gives: String,
}

pub(crate) fn run(options: &Options) -> Outcome {
    let Scenes {
        whole,
        without,
        package,
    } = toml::from_str(include_str!("left_out.toml"))?;
    let (program, folder) = (program(options.program.as_deref())?, tempfile::tempdir()?);
    let folder = folder.path();
    let mut text = String::from(
        "| the scene | processor time [s] | memory [MB] | files [MB] |\n|---|---|---|---|\n",
    );
    for Without { name, keys } in &without {
        let mut scene = whole.clone();
        keys.iter()
            .try_for_each(|(key, value)| set(&mut scene, key, value))?;
        let run = run_scene(&program, folder, &toml::to_string(&scene)?)?;
        let sizes = std::fs::read_dir(folder.join("out"))?.map(|file| Ok(file?.metadata()?.len()));
        let bytes = sizes.sum::<std::io::Result<u64>>()? as f64;
        let name = if keys.is_empty() {
            name.clone()
        } else {
            format!("without {name}")
        };
        let _ = writeln!(
            text,
            "| {name} | {:.2} | {:.1} | {:.2} |",
            run.cpu_s,
            run.peak_bytes / 1e6,
            bytes / 1e6
        );
    }
    let heads = if options.compile {
        " processor time of compiling [s] | program [MB] |"
    } else {
        ""
    };
    let lines = if options.compile { "---|---|" } else { "" };
    let _ = writeln!(
        text,
        "\n| crate | features | gives | crates compiled |{heads}\n|---|---|---|---|{lines}"
    );
    for Package {
        name,
        features,
        gives,
    } in &package
    {
        let named = if features.is_empty() {
            "none"
        } else {
            features
        };
        let _ = write!(
            text,
            "| `{name}` | {named} | {gives} | {} |",
            crates(name, features)?
        );
        if options.compile {
            let (seconds, bytes) = compiled(name, features, &folder.join("target"))?;
            let size = bytes.map_or("none".into(), |bytes| format!("{:.1}", bytes / 1e6));
            let _ = write!(text, " {seconds:.0} | {size} |");
        }
        text.push('\n');
    }
    print!("{text}");
    if options.store {
        wakescope_sim::io::write_atomic(
            &root().join("docs/src/left-out-results.md"),
            text.as_bytes(),
        )?;
    }
    Ok(())
}

/// Sets a key by its word with dots, or takes it out.
fn set(scene: &mut Table, key: &str, value: &Value) -> Outcome {
    let Some((table, rest)) = key.split_once('.') else {
        match value.as_str() {
            Some("absent") => scene.remove(key),
            _ => scene.insert(key.into(), value.clone()),
        };
        return Ok(());
    };
    let inner = scene
        .entry(table)
        .or_insert_with(|| Value::Table(Table::new()));
    set(
        inner
            .as_table_mut()
            .ok_or_else(|| Failure::new(format!("{table} is no table")))?,
        rest,
        value,
    )
}

/// Processor time of compiling a crate and all that it needs from nothing, s, and the size of its program, bytes.
fn compiled(package: &str, features: &str, target: &Path) -> Result<(f64, Option<f64>), Failure> {
    if target.exists() {
        std::fs::remove_dir_all(target)?;
    }
    let before_s = children_cpu_s();
    let words = [
        "build",
        "--release",
        "--quiet",
        "--package",
        package,
        "--no-default-features",
        "--features",
        features,
    ];
    call(
        Command::new(env!("CARGO"))
            .args(words)
            .env("CARGO_TARGET_DIR", target),
    )?;
    let program = std::fs::metadata(target.join("release/wakescope")).ok();
    Ok((
        children_cpu_s() - before_s,
        program.map(|file| file.len() as f64),
    ))
}

/// How many crates cargo compiles for a library, itself among them, without those that only build it.
fn crates(package: &str, features: &str) -> Result<usize, Failure> {
    let of = [
        "tree",
        "--edges=normal",
        "--prefix=none",
        "--no-default-features",
        "--package",
        package,
        "--features",
    ];
    let text = output(Command::new(env!("CARGO")).args(of).arg(features))?;
    let names: BTreeSet<&str> = text
        .lines()
        .filter_map(|line| line.split(" (").next())
        .collect();
    Ok(names.iter().filter(|name| !name.is_empty()).count())
}

#[cfg(test)]
mod tests {
    use super::*;
    use wakescope_sim::plan::{Plan, Target};
    use wakescope_sim::scene::SceneFile;

    #[test]
    fn every_scene_of_the_list_passes_the_check() {
        let Scenes { whole, without, .. } = toml::from_str(include_str!("left_out.toml")).unwrap();
        for Without { name, keys } in &without {
            let mut scene = whole.clone();
            keys.iter()
                .try_for_each(|(key, value)| set(&mut scene, key, value))
                .unwrap();
            let text = toml::to_string(&scene).unwrap();
            let read = SceneFile::parse(&text, Path::new("scene.toml")).unwrap();
            let plan = Plan::new(read, Target::Run);
            assert!(plan.is_ok(), "{name}: {:?}", plan.err());
        }
    }
}
