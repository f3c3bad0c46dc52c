//! What the program says: the message of each bad input, errors as JSON, a standard output that cannot be written.

use super::cli::{SMALL, names};
use super::wakescope;
use std::fs;
use std::path::Path;
use std::process::Command;

/// Bytes from pairs of hexadecimal digits and texts in quotation marks.
fn bytes_of(words: &str) -> Vec<u8> {
    let mut bytes = Vec::new();
    for (i, part) in words.split('"').enumerate() {
        if i % 2 == 1 {
            bytes.extend(part.as_bytes());
        } else {
            let digits: Vec<u8> = part.bytes().filter(|b| !b.is_ascii_whitespace()).collect();
            let pairs = digits
                .chunks(2)
                .map(|pair| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap());
            bytes.extend(pairs);
        }
    }
    bytes
}

/// Each file begins with `# COMMAND is refused:` and the lines of the message, where FILE is its own name.
#[test]
fn every_bad_input_gives_its_message_and_exit_code_2() {
    let bad = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/bad-input");
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    let described: toml::Table = fs::read_to_string(bad.join("netcdf.toml"))
        .unwrap()
        .parse()
        .unwrap();
    for file in described["file"].as_array().unwrap() {
        let word = |key: &str| file[key].as_str().unwrap();
        fs::write(folder.join(word("name")), bytes_of(word("bytes"))).unwrap();
    }
    let mut count = 0;
    for name in names(&bad).iter().filter(|name| *name != "netcdf.toml") {
        let text = fs::read_to_string(bad.join(name)).unwrap();
        fs::write(folder.join(name), &text).unwrap();
        let mut head = text.lines().map_while(|line| line.strip_prefix("# "));
        let command = head
            .next()
            .and_then(|line| line.strip_suffix(" is refused:"))
            .unwrap();
        let wanted: Vec<String> = head.map(|line| line.replace("FILE", name)).collect();
        let mut words = vec![command, name];
        words.extend(if command == "check" {
            &[][..]
        } else {
            &["--out", "o"]
        });
        let out = wakescope(folder, &words);
        assert_eq!(
            String::from_utf8(out.stderr).unwrap(),
            format!("error: {}\n", wanted.join("\n")),
            "{name}"
        );
        assert_eq!(out.status.code(), Some(2), "{name}");
        assert!(
            out.stdout.is_empty() && !folder.join("o").exists(),
            "{name}"
        );
        count += 1;
    }
    assert!(count >= 60, "{count}");
}

#[cfg(unix)]
#[test]
fn devices_pipes_and_folders_are_no_scenes_and_no_planes() {
    let temp = tempfile::tempdir().unwrap();
    let made = Command::new("mkfifo")
        .arg("pipe")
        .current_dir(temp.path())
        .status()
        .unwrap();
    assert!(made.success());
    fs::create_dir(temp.path().join("folder")).unwrap();
    for (name, reason) in [
        ("/dev/zero", "a device or a pipe"),
        ("pipe", "a device or a pipe"),
        ("folder", "it is a folder"),
    ] {
        for command in ["check", "flow", "wake"] {
            let out = wakescope(
                temp.path(),
                &[
                    &[command, name][..],
                    &["--out", "o"][..usize::from(command != "check") * 2],
                ]
                .concat(),
            );
            let message = String::from_utf8(out.stderr).unwrap();
            assert!(
                out.status.code() == Some(2) && message.contains(reason),
                "{command} {name}: {message}"
            );
        }
        let initial = format!(
            "[case]\nkind = \"free\"\ninitial = {{ kind = \"netcdf\", path = \"{name}\" }}\n[time]\nend_s = 1.0\n"
        );
        fs::write(temp.path().join("c.toml"), initial).unwrap();
        let out = wakescope(temp.path(), &["flow", "c.toml", "--out", "o"]);
        let message = String::from_utf8(out.stderr).unwrap();
        assert!(
            out.status.code() == Some(2) && message.contains(reason),
            "{name}: {message}"
        );
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_an_error_and_a_closed_pipe_is_none() {
    let temp = tempfile::tempdir().unwrap();
    fs::write(temp.path().join("s.toml"), SMALL).unwrap();
    let to = |words: &[&str], stdout: std::process::Stdio| {
        Command::new(env!("CARGO_BIN_EXE_wakescope"))
            .args(words)
            .current_dir(temp.path())
            .stdout(stdout)
            .output()
            .unwrap()
    };
    for words in [
        &["check", "s.toml"][..],
        &["check", "s.toml", "--json"],
        &["wake", "--print"],
        &["flow", "--example", "free"],
        &[
            "efficiency",
            "s.toml",
            "--out",
            "o",
            "--quiet",
            "--overwrite",
        ],
        &["--help"],
        &["--version"],
    ] {
        let full = to(
            words,
            fs::OpenOptions::new()
                .write(true)
                .open("/dev/full")
                .unwrap()
                .into(),
        );
        assert_eq!(full.status.code(), Some(2), "{words:?}");
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        assert_eq!(to(words, writer.into()).status.code(), Some(0), "{words:?}");
    }
    let full = to(
        &[
            "efficiency",
            "s.toml",
            "--out",
            "o",
            "--quiet",
            "--overwrite",
        ],
        fs::OpenOptions::new()
            .write(true)
            .open("/dev/full")
            .unwrap()
            .into(),
    );
    let message = String::from_utf8(full.stderr).unwrap();
    assert!(
        message.contains("cannot write to standard output")
            && message.contains("files of this command are in place")
    );
    assert!(names(&temp.path().join("o")).contains(&"profile.csv".to_owned()));
}

#[test]
fn a_quiet_check_of_a_good_scene_says_nothing() {
    let temp = tempfile::tempdir().unwrap();
    fs::write(temp.path().join("s.toml"), SMALL).unwrap();
    let out = wakescope(temp.path(), &["--quiet", "check", "s.toml"]);
    assert!(
        out.status.success() && out.stdout.is_empty() && out.stderr.is_empty(),
        "{out:?}"
    );
    let out = wakescope(temp.path(), &["--quiet", "check", "s.toml", "--json"]);
    assert!(
        serde_json::from_slice::<serde_json::Value>(&out.stdout).is_ok(),
        "what was asked for"
    );
}

#[test]
fn errors_are_json_where_json_was_asked_for() {
    let temp = tempfile::tempdir().unwrap();
    fs::write(
        temp.path().join("s.toml"),
        "[pulse]\nenergy_j = \"much\"\n[scan]\nrealisations = -1\n",
    )
    .unwrap();
    fs::write(temp.path().join("broken.toml"), "[pulse\n").unwrap();
    fs::write(
        temp.path().join("p.toml"),
        "[flow]\nkind = \"simulated\"\nplanes = \"none.nc\"\n",
    )
    .unwrap();
    let error = |words: &[&str]| {
        let out = wakescope(temp.path(), &[words, &["--json"]].concat());
        assert!(
            out.status.code() == Some(2) && out.stdout.is_empty(),
            "{out:?}"
        );
        serde_json::from_slice::<serde_json::Value>(&out.stderr).unwrap()
    };
    let found = error(&["check", "s.toml"]);
    let wanted = serde_json::json!([
        { "file": "s.toml", "line": 2, "key": "pulse.energy_j", "value": "\"much\"", "allowed": "a number in J, e.g. 150e-6" },
        {
            "file": "s.toml", "line": 4, "key": "scan.realisations", "value": "-1",
            "allowed": "a whole number that is not negative, e.g. 4",
        },
    ]);
    assert_eq!(found["problems"], wanted);
    assert_eq!(found["error"].as_str().unwrap().lines().count(), 2);
    assert_eq!(error(&["check", "broken.toml"])["problems"][0]["line"], 1);
    assert_eq!(
        error(&["check", "p.toml"])["problems"][0]["key"],
        "flow.planes"
    );
    assert_eq!(
        error(&["check", "none.toml"])["problems"][0]["file"],
        "none.toml"
    );
    assert_eq!(
        error(&["wake", "none.toml", "--out", "o"])["problems"][0]["file"],
        "none.toml"
    );
    let seed = error(&["check", "s.toml", "--seed", "18446744073709551615"]);
    assert!(seed["error"].as_str().unwrap().contains("--seed"), "{seed}");
    assert!(
        error(&["chek"])["error"]
            .as_str()
            .unwrap()
            .contains("check")
    );
}
