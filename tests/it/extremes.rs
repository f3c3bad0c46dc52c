//! Stiff and extreme cases of every crate: each ends as it must, with a number within bounds or a refusal in stated words.

use wakescope_tests::extreme::rows;

/// The cases of one crate that take no more than a few seconds; `cargo xtask stability` runs the others, too.
fn all_end_as_they_must(part: &str) {
    let rows = rows(|of, case| of == part && !case.long);
    assert!(!rows.is_empty(), "no cases of {part}");
    let missed: Vec<String> = rows
        .iter()
        .filter(|row| !row.ended.passes)
        .map(|row| {
            format!(
                "{}: {}, expected {}",
                row.case.name, row.ended.outcome, row.case.expected
            )
        })
        .collect();
    assert!(missed.is_empty(), "{}", missed.join("\n"));
}

#[test]
fn extreme_flows_end_as_they_must() {
    all_end_as_they_must("les");
}

#[test]
fn extreme_optics_end_as_they_must() {
    all_end_as_they_must("optics");
}

#[test]
fn extreme_signals_end_as_they_must() {
    all_end_as_they_must("signal");
}

#[test]
fn extreme_estimates_end_as_they_must() {
    all_end_as_they_must("estimate");
}

#[test]
fn extreme_scenes_end_as_they_must() {
    all_end_as_they_must("sim");
}
