//! The commands of the tutorials, as a reader types them.

use super::wakescope;
use std::path::Path;

/// Blocks of a kind in a page.
fn blocks<'t>(page: &'t str, kind: &str) -> Vec<&'t str> {
    let begin = format!("```{kind}\n");
    page.split(begin.as_str()).skip(1).filter_map(|rest| rest.split_once("```")).map(|(block, _)| block).collect()
}

#[test]
fn commands_of_the_tutorials_run() {
    for name in ["tutorial-cfradial.md", "tutorial-signals.md"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/src").join(name);
        let page = std::fs::read_to_string(path).unwrap();
        let temp = tempfile::tempdir().unwrap();
        for block in blocks(&page, "toml") {
            let file = block.lines().next().and_then(|line| line.strip_prefix("# ")).unwrap();
            std::fs::write(temp.path().join(file), block).unwrap();
        }
        let commands: Vec<&str> = blocks(&page, "sh").iter().flat_map(|block| block.lines()).collect();
        assert!(commands.len() >= 4, "{name}: {commands:?}");
        for command in commands {
            let words: Vec<&str> = command.split_whitespace().collect();
            assert_eq!(words[0], "wakescope", "{name}: {command}");
            let out = wakescope(temp.path(), &[&words[1..], &["--quiet"]].concat());
            assert!(out.status.success(), "{name}: {command}: {}", String::from_utf8_lossy(&out.stderr));
        }
    }
}
