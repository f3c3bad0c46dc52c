//! `cargo xtask left-out`: what a scene does not pay for, and what a crate does not pull in.
//!
//! A scene that has everything is run whole and without one thing at a time, each run a process of
//! its own with one thread; the crates behind each of ours, alone and with its features, are counted
//! by cargo and, if requested, compiled from nothing.

use crate::process::{call, children_cpu_s, output, program, run_scene};
use fixtures::failure::{Failure, Outcome};
use serde::Deserialize;
use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;
use toml::{Table, Value};

/// The scene that has everything, and what is taken out.
#[derive(Deserialize)]
struct Scenes {
    whole: Table,
    without: Vec<Without>,
    package: Vec<Package>,
}

/// What is taken out of the scene, and by which keys: their names with dots and their values; the text "absent" removes the key.
#[derive(Deserialize)]
struct Without {
    name: String,
    keys: Table,
}

impl Without {
    /// The scene without it.
    fn scene(&self, whole: &Table) -> Result<Table, Failure> {
        let mut scene = whole.clone();
        for (key, value) in &self.keys {
            set(&mut scene, key, value)?;
        }
        Ok(scene)
    }
}

/// A crate with some of its features and without the default ones.
#[derive(Deserialize)]
struct Package {
    name: String,
    features: String,
    gives: String,
}

/// Prints both tables.
///
/// # Errors
/// Fails if a scene does not run or a crate does not compile.
pub(crate) fn run(given: Option<&Path>, compile: bool) -> Outcome {
    print!("{}", tables(given, compile)?);
    Ok(())
}

/// Both tables for the page of the book, with the costs of compiling.
///
/// # Errors
/// As [`run`].
pub(crate) fn page() -> Result<String, Failure> {
    tables(None, true)
}

fn tables(given: Option<&Path>, compile: bool) -> Result<String, Failure> {
    let scenes: Scenes = toml::from_str(include_str!("left_out.toml"))?;
    let program = program(given)?;
    let folder = tempfile::tempdir()?;
    let mut text = scene_table(&scenes, &program, folder.path())?;
    text.push('\n');
    if compile {
        text += &compile_table(&scenes.package, &folder.path().join("target"))?;
    } else {
        text += &package_table(&scenes.package)?;
    }
    Ok(text)
}

/// What each scene costs.
fn scene_table(scenes: &Scenes, program: &Path, folder: &Path) -> Result<String, Failure> {
    let mut text = String::from(
        "| the scene | processor time [s] | memory [MB] | files [MB] |\n|---|---|---|---|\n",
    );
    for without in &scenes.without {
        let scene = without.scene(&scenes.whole)?;
        let run = run_scene(program, folder, &toml::to_string(&scene)?)?;
        let mut bytes = 0;
        for file in std::fs::read_dir(folder.join("out"))? {
            bytes += file?.metadata()?.len();
        }
        let prefix = if without.keys.is_empty() {
            ""
        } else {
            "without "
        };
        text += &format!(
            "| {prefix}{} | {:.2} | {:.1} | {:.2} |\n",
            without.name,
            run.cpu_s,
            run.peak_bytes / 1e6,
            bytes as f64 / 1e6
        );
    }
    Ok(text)
}

/// How many crates are behind each package.
fn package_table(packages: &[Package]) -> Result<String, Failure> {
    let mut text =
        String::from("| crate | features | gives | crates compiled |\n|---|---|---|---|\n");
    for package in packages {
        text += &format!("{}\n", package.row()?);
    }
    Ok(text)
}

/// The same with what compiling costs.
fn compile_table(packages: &[Package], target: &Path) -> Result<String, Failure> {
    let mut text = String::from(
        "| crate | features | gives | crates compiled | processor time of compiling [s] | program [MB] |\n|---|---|---|---|---|---|\n",
    );
    for package in packages {
        let cpu_s = package.compile(target)?;
        // A library leaves no program.
        let size = match std::fs::metadata(target.join("release/wakescope")) {
            Ok(file) => format!("{:.1}", file.len() as f64 / 1e6),
            Err(_) => "none".into(),
        };
        text += &format!("{} {cpu_s:.0} | {size} |\n", package.row()?);
    }
    Ok(text)
}

impl Package {
    /// The row of the table that needs no compiling.
    fn row(&self) -> Result<String, Failure> {
        let features = if self.features.is_empty() {
            "none"
        } else {
            &self.features
        };
        Ok(format!(
            "| `{}` | {features} | {} | {} |",
            self.name,
            self.gives,
            self.crates()?
        ))
    }

    /// Compiles the crate and all that it needs from nothing and returns the processor time \[s\].
    fn compile(&self, target: &Path) -> Result<f64, Failure> {
        if target.exists() {
            std::fs::remove_dir_all(target)?;
        }
        let before_s = children_cpu_s();
        let mut build = Command::new(env!("CARGO"));
        build.args(["build", "--release", "--quiet", "--no-default-features"]);
        build.args(["--package", &self.name, "--features", &self.features]);
        call(build.env("CARGO_TARGET_DIR", target))?;
        Ok(children_cpu_s() - before_s)
    }

    /// How many crates cargo compiles for the library, itself among them, without those that only build it.
    fn crates(&self) -> Result<usize, Failure> {
        let mut tree = Command::new(env!("CARGO"));
        tree.args([
            "tree",
            "--edges=normal",
            "--prefix=none",
            "--no-default-features",
        ]);
        tree.args(["--package", &self.name, "--features", &self.features]);
        let text = output(&mut tree)?;
        let mut names = BTreeSet::new();
        for line in text.lines() {
            let name = line.split(" (").next().unwrap_or(line);
            if !name.is_empty() {
                names.insert(name);
            }
        }
        Ok(names.len())
    }
}

/// Sets a key by its name with dots, or removes it.
fn set(scene: &mut Table, key: &str, value: &Value) -> Outcome {
    let Some((table, rest)) = key.split_once('.') else {
        if value.as_str() == Some("absent") {
            scene.remove(key);
        } else {
            scene.insert(key.into(), value.clone());
        }
        return Ok(());
    };
    let inner = scene
        .entry(table)
        .or_insert_with(|| Value::Table(Table::new()));
    let inner = inner
        .as_table_mut()
        .ok_or_else(|| Failure::new(format!("{table} is no table")))?;
    set(inner, rest, value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use wakescope_sim::plan::{Plan, Target};
    use wakescope_sim::scene::SceneFile;

    #[test]
    fn every_scene_of_the_list_passes_the_check() {
        let scenes: Scenes = toml::from_str(include_str!("left_out.toml")).unwrap();
        for without in &scenes.without {
            let scene = without.scene(&scenes.whole).unwrap();
            let text = toml::to_string(&scene).unwrap();
            let read = SceneFile::parse(&text, Path::new("scene.toml")).unwrap();
            let plan = Plan::new(read, Target::Run);
            assert!(plan.is_ok(), "{}: {:?}", without.name, plan.err());
        }
    }
}
