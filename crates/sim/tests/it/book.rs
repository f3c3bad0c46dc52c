//! What the book, the README and the crates' READMEs show and name: commands, scenes, options and keys are those of the program.

use super::wakescope;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Tables at the top of a scene.
const SECTIONS: [&str; 12] = [
    "laser",
    "pulse",
    "detector",
    "telescope",
    "atmosphere",
    "flow",
    "scan",
    "estimator",
    "retrieval",
    "outputs",
    "site",
    "added_flows",
];
/// Options of cargo, of its tests and of other programs that pages name.
const OF_OTHERS: [&str; 22] = [
    "--all-targets",
    "--bench",
    "--bin",
    "--bind-to",
    "--example",
    "--features",
    "--ignored",
    "--include-ignored",
    "--lib",
    "--locked",
    "--map-by",
    "--mca",
    "--no-default-features",
    "--no-fail-fast",
    "--nocapture",
    "--package",
    "--path",
    "--release",
    "--test",
    "--workspace",
    "--all-features",
    "--doc",
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Name and text of each page.
fn pages() -> Vec<(String, String)> {
    let mut paths = vec![root().join("README.md")];
    let crates = ["optics", "les", "signal", "estimate", "sim"];
    paths.extend(crates.map(|name| root().join("crates").join(name).join("README.md")));
    for folder in ["docs/src", "docs/src/theory"] {
        let entries = std::fs::read_dir(root().join(folder))
            .unwrap()
            .map(|entry| entry.unwrap().path());
        paths.extend(entries.filter(|path| path.extension().is_some_and(|end| end == "md")));
    }
    paths.sort();
    paths
        .iter()
        .map(|path| {
            (
                path.display().to_string(),
                std::fs::read_to_string(path).unwrap(),
            )
        })
        .collect()
}

/// Blocks of a kind in a page.
fn blocks<'t>(page: &'t str, kind: &str) -> Vec<&'t str> {
    let begin = format!("```{kind}\n");
    page.split(begin.as_str())
        .skip(1)
        .filter_map(|rest| rest.split_once("```"))
        .map(|(block, _)| block)
        .collect()
}

/// Words between single backticks outside of blocks.
fn spans(page: &str) -> Vec<&str> {
    let prose = page.split("```").step_by(2);
    prose
        .flat_map(|part| part.split('`').skip(1).step_by(2))
        .collect()
}

/// Lines of the program in a page: all its blocks, without comments and redirections, 1 for what the shell knows.
fn command_lines(page: &str) -> Vec<Vec<String>> {
    let lines = page.split("```").skip(1).step_by(2).flat_map(str::lines);
    // Reports begin with the program and its version.
    let report = concat!("wakescope ", env!("CARGO_PKG_VERSION"), ":");
    let commands = lines
        .filter(|line| line.starts_with("wakescope ") && !line.starts_with(report))
        .filter(|line| !line.contains('['));
    let number = |part: &str| {
        if part.starts_with('$') {
            "1".to_owned()
        } else {
            part.to_owned()
        }
    };
    let word = |word: &str| {
        word.split('/')
            .map(number)
            .collect::<Vec<String>>()
            .join("/")
    };
    commands
        .map(|line| {
            line.split(['#', '>'])
                .next()
                .unwrap()
                .split_whitespace()
                .skip(1)
                .map(word)
                .collect()
        })
        .collect()
}

#[test]
fn commands_of_the_readme_and_the_tutorials_print_what_the_pages_show() {
    for (name, least) in [
        ("README.md", 3),
        ("docs/src/tutorial-cfradial.md", 4),
        ("docs/src/tutorial-signals.md", 4),
        ("docs/src/airport.md", 5),
    ] {
        let page = std::fs::read_to_string(root().join(name)).unwrap();
        let temp = tempfile::tempdir().unwrap();
        write_scenes(&page, temp.path());
        let lines = blocks(&page, "sh").into_iter().flat_map(str::lines);
        let commands: Vec<&str> = lines.filter(|line| !line.starts_with("cargo ")).collect();
        assert!(commands.len() >= least, "{name}: {commands:?}");
        let mut printed = String::new();
        for command in commands {
            let command = command.split('#').next().unwrap();
            let words: Vec<&str> = command.split_whitespace().collect();
            assert_eq!(words[0], "wakescope", "{name}: {command}");
            let out = wakescope(temp.path(), &words[1..]);
            let complaint = String::from_utf8_lossy(&out.stderr);
            assert!(out.status.success(), "{name}: {command}: {complaint}");
            printed += &String::from_utf8_lossy(&out.stdout);
        }
        let mut texts = blocks(&page, "text");
        let wind_page = std::fs::read_to_string(root().join("docs/src/wind.md")).unwrap();
        if name.ends_with("airport.md") {
            texts.extend(blocks(&wind_page, "text"));
        }
        let shown: Vec<&str> = texts
            .into_iter()
            .flat_map(str::lines)
            .filter(|line| !line.starts_with("wakescope "))
            .collect();
        assert!(!shown.is_empty(), "{name}");
        for line in shown {
            assert!(printed.contains(line), "{name}: {line}\nnot in\n{printed}");
        }
        if name.ends_with("airport.md") {
            check_winds(&page, temp.path());
        }
    }
}

/// Writes the scenes of a page, each with its name in its first line, into a folder.
fn write_scenes(page: &str, folder: &Path) {
    for block in blocks(page, "toml") {
        let first = block.lines().next().unwrap();
        let file = first.strip_prefix("# ").unwrap();
        std::fs::write(folder.join(file), block).unwrap();
    }
}

/// Rows of a table that the program wrote, by the names of their columns.
fn rows(path: &Path) -> Vec<BTreeMap<String, f64>> {
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let cells = |line: &str| -> BTreeMap<String, f64> {
        let values = line.split(',').map(|cell| cell.parse().unwrap_or(f64::NAN));
        names
            .iter()
            .map(|name| name.to_string())
            .zip(values)
            .collect()
    };
    lines.map(cells).collect()
}

/// The table of winds of the page has the numbers of the files.
fn check_winds(page: &str, folder: &Path) {
    let found = rows(&folder.join("air/wind.csv"));
    let truth = rows(&folder.join("cone/wind.csv"));
    let mut lines = Vec::new();
    for (row, truth) in found.iter().zip(&truth) {
        let wind = |name: &str| {
            let value = row[&format!("{name}_m_s")];
            let std = row[&format!("{name}_std_m_s")];
            let exact = truth[&format!("{name}_true_m_s")];
            format!("{value:.2} ± {std:.2}, {exact:.2}")
        };
        lines.push(format!(
            "| {:.1} | {} | {} | {:.3}, {:.3} to {:.3} |",
            row["height_m"],
            wind("east"),
            wind("north"),
            row["edr_m23_s"],
            row["edr_low_m23_s"],
            row["edr_high_m23_s"],
        ));
    }
    let is_number = |line: &&str| line.starts_with("| ") && line.contains('±');
    let shown: Vec<&str> = page.lines().filter(is_number).collect();
    assert!(shown.len() >= 2);
    for line in shown {
        assert!(
            lines.iter().any(|own| own == line),
            "{line}\nnot in\n{lines:#?}"
        );
    }
}

/// The chapter's figures are drawn by the task of continuous integration that judges them.
#[test]
fn commands_of_the_gallery_make_its_pictures() {
    let page = std::fs::read_to_string(root().join("docs/src/gallery.md")).unwrap();
    let temp = tempfile::tempdir().unwrap();
    let airport = std::fs::read_to_string(root().join("docs/src/airport.md")).unwrap();
    write_scenes(&airport, temp.path());
    for line in page.lines().filter(|line| line.starts_with("wakescope ")) {
        let words: Vec<&str> = line.split_whitespace().skip(1).collect();
        let out = wakescope(temp.path(), &[&words[..], &["--quiet"]].concat());
        let complaint = String::from_utf8_lossy(&out.stderr);
        assert!(out.status.success(), "{line}: {complaint}");
    }
    let mut pictures = 0;
    for rest in page.split("](gallery/").skip(1) {
        let (name, _) = rest.split_once(')').unwrap();
        if !name.starts_with("fig") {
            assert!(temp.path().join(name).is_file(), "{name}");
            pictures += 1;
        }
    }
    assert!(pictures >= 11, "{pictures}");
}

/// With `--help` at its end a line is parsed and nothing runs.
#[test]
fn lines_of_the_program_that_pages_show_are_understood() {
    let temp = tempfile::tempdir().unwrap();
    let mut count = 0;
    for (name, page) in pages() {
        for line in command_lines(&page.replace("\\\n", " ")) {
            let words: Vec<&str> = line.iter().map(String::as_str).chain(["--help"]).collect();
            let out = wakescope(temp.path(), &words);
            assert!(
                out.status.success(),
                "{name}: {line:?}: {}",
                String::from_utf8_lossy(&out.stderr)
            );
            count += 1;
        }
    }
    assert!(count > 25, "{count}");
    let wrong = wakescope(
        temp.path(),
        &["retrieve", "map.nc", "--no-such-option", "--help"],
    );
    assert!(!wrong.status.success());
}

/// Files that a block names need not lie beside it.
#[test]
fn scenes_and_cases_that_pages_show_are_good() {
    let temp = tempfile::tempdir().unwrap();
    let mut count = 0;
    for (name, page) in pages() {
        for block in blocks(&page, "toml") {
            std::fs::write(temp.path().join("shown.toml"), block).unwrap();
            let words: &[&str] = match (block.contains("[case]"), block.contains("[flight]")) {
                (true, _) => &["wake", "shown.toml", "--check", "--quiet"],
                (_, true) => &["dataset", "shown.toml", "--check", "--quiet"],
                _ => &["check", "shown.toml", "--quiet"],
            };
            let out = wakescope(temp.path(), words);
            let told = String::from_utf8_lossy(&out.stderr);
            let is_file_missing = told.contains("neither a file nor the beginning of files")
                && (block.contains("planes = ") || block.contains("files = "));
            assert!(
                out.status.success() || is_file_missing,
                "{name}: {block}\n{told}"
            );
            count += 1;
        }
    }
    assert!(count >= 10, "{count}");
}

#[test]
fn options_that_pages_name_exist() {
    let temp = tempfile::tempdir().unwrap();
    let help = |words: &[&str]| String::from_utf8(wakescope(temp.path(), words).stdout).unwrap();
    let commands = [
        "init",
        "accuracy",
        "check",
        "run",
        "efficiency",
        "signal",
        "map",
        "estimate",
        "retrieve",
        "detect",
        "wind",
        "sweep",
        "score",
        "bound",
        "budget",
        "flow",
        "wake",
    ];
    let mut known: String = commands
        .iter()
        .map(|command| help(&[command, "--help"]))
        .collect();
    let mut folders = vec![root().join("xtask/src")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            match path.is_dir() {
                true => folders.push(path),
                // a field of its words is an option of that name
                false => known += &std::fs::read_to_string(&path).unwrap().replace('_', "-"),
            }
        }
    }
    let is_end = |c: char| !(c.is_ascii_alphanumeric() || c == '-');
    let known: BTreeSet<&str> = known.split(is_end).collect();
    let mut missing = Vec::new();
    for (name, page) in pages() {
        for span in spans(&page) {
            for word in span
                .split(is_end)
                .filter(|word| word.len() > 3 && word.starts_with("--"))
            {
                if !known.contains(word)
                    && !known.contains(&word[2..])
                    && !OF_OTHERS.contains(&word)
                {
                    missing.push(format!("{name}: {word}"));
                }
            }
        }
    }
    assert!(missing.is_empty(), "{missing:#?}");
}

#[test]
fn keys_that_pages_name_exist() {
    let temp = tempfile::tempdir().unwrap();
    let is_key = |span: &&str| {
        let parts: Vec<&str> = span.split('.').collect();
        let is_name = |part: &&str| {
            !part.is_empty()
                && part
                    .chars()
                    .all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_')
        };
        parts.len() > 1 && SECTIONS.contains(&parts[0]) && parts.iter().all(is_name)
    };
    let files = [
        "csv",
        "nc",
        "toml",
        "json",
        "svg",
        "png",
        "md",
        "rs",
        "hpl",
        "checkpoint",
        "previous",
    ];
    let mut keys: BTreeSet<(String, String)> = BTreeSet::new();
    for (name, page) in pages() {
        let named = spans(&page)
            .into_iter()
            .filter(is_key)
            .filter(|key| !files.iter().any(|end| key.ends_with(&format!(".{end}"))));
        keys.extend(named.map(|key| (key.to_string(), name.clone())));
    }
    assert!(keys.len() > 20, "{}", keys.len());
    let mut unknown = Vec::new();
    for (key, page) in keys {
        std::fs::write(temp.path().join("shown.toml"), format!("{key} = \"?\"\n")).unwrap();
        let out = wakescope(temp.path(), &["check", "shown.toml", "--quiet"]);
        if String::from_utf8_lossy(&out.stderr).contains("no such key") {
            unknown.push(format!("{page}: {key}"));
        }
    }
    assert!(unknown.is_empty(), "{unknown:#?}");
}
