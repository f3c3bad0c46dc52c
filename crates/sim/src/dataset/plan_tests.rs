use super::super::presets::{PRESETS, TINY};
use super::*;
use std::collections::HashSet;

fn plan(text: &str) -> Result<DatasetPlan, Error> {
    DatasetPlan::parse(text, Path::new("p.toml"), None)
}

/// A small plan with these lines at its beginning, and these tables at its end.
fn with(head: &str, tables: &str) -> String {
    format!(
        "title = \"t\"\nsites = 2\nflights_per_site = 8\nflights_per_chunk = 8\n{head}\n[scene.detector.snr]\nreference = \"fixed\"\nsnr_db = 1.0\n{tables}"
    )
}

fn message(head: &str, tables: &str) -> String {
    let read = plan(&with(head, tables)).and_then(|plan| plan.check());
    read.unwrap_err().to_string()
}

#[test]
fn presets_are_good_plans_and_all_of_their_flights_differ() {
    for (name, text) in PRESETS {
        let plan = plan(text).unwrap();
        plan.check()
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        let flights = plan.keys.flights().min(512);
        let mut hashes = HashSet::new();
        let mut empty = 0;
        for number in 0..flights {
            let flight = plan.flight(number).unwrap();
            assert!(
                hashes.insert(format!("{:?}", flight.values)),
                "{name} {number}"
            );
            assert_eq!(flight.is_empty, flight.scene.content.flow.pair().is_none());
            empty += usize::from(flight.is_empty);
        }
        // Blocks of a site are stratified: one flight at most is off in each.
        let expected = 0.2 * flights as f64;
        assert!((empty as f64 - expected).abs() <= 4.0, "{name}: {empty}");
    }
}

#[test]
fn a_distribution_that_is_appended_moves_no_other() {
    let appended = format!("{TINY}\"flow.core_radius_m\" = {{ uniform = [1.0, 3.0] }}\n");
    let before = plan(TINY).unwrap();
    let after = plan(&appended).unwrap();
    for number in [0, 31, 127] {
        let before = before.flight(number).unwrap();
        let after = after.flight(number).unwrap();
        // Expressions come after all distributions.
        let drawn = before.values.len() - 2;
        assert_eq!(before.values[..drawn], after.values[..drawn]);
        assert_eq!(before.values[drawn..], after.values[drawn + 1..]);
        assert_eq!(before.scene.content.seed, after.scene.content.seed);
    }
}

#[test]
fn expressions_compute_with_keys_of_added_flows() {
    let tables = "[[scene.added_flows]]\nkind = \"calm\"\n[[scene.added_flows]]\nkind = \"eddies\"\n\
                  [flight]\n\"added_flows.1.dissipation_m2_s3\" = { uniform = [1e-3, 1e-2] }\n\
                  \"added_flows.1.outer_scale_m\" = \"50 + 1000*added_flows.1.dissipation_m2_s3\"\n";
    let drawn = plan(&with("", tables)).unwrap();
    drawn.check().unwrap();
    let scene = drawn.flight(1).unwrap().scene;
    let eddies = scene.content.eddies().unwrap();
    let expected_m = 50.0 + 1000.0 * eddies.dissipation_m2_s3;
    assert_eq!(eddies.outer_scale_m, expected_m);
    for (from, wanted) in [
        (
            "added_flows.2",
            "added_flows.2.dissipation_m2_s3 is not a key",
        ),
        (
            "added_flows.0",
            "added_flows.0.dissipation_m2_s3 is not a key",
        ),
    ] {
        let other = tables.replace("*added_flows.1", &format!("*{from}"));
        let refusal = message("", &other);
        assert!(refusal.contains(wanted), "{refusal}");
    }
}

#[test]
fn another_seed_takes_the_place_of_that_of_the_text() {
    let first = plan(TINY).unwrap();
    let other = DatasetPlan::parse(TINY, Path::new("p.toml"), Some(7)).unwrap();
    assert_eq!(other.keys.seed, 7);
    assert_eq!(plan(&other.text).unwrap(), other);
    assert_ne!(
        first.flight(0).unwrap().values,
        other.flight(0).unwrap().values
    );
    let without = TINY.replace("seed = 1\n", "");
    let added = DatasetPlan::parse(&without, Path::new("p.toml"), Some(7)).unwrap();
    assert_eq!(added.flight(3).unwrap(), other.flight(3).unwrap());
}

#[test]
fn rows_are_drawn_as_wholes_by_their_weights() {
    let temp = tempfile::tempdir().unwrap();
    let table = "flow.spacing_m,weight,flow.circulation_m2_s\n30,1,300\n40,0,400\n60,3,600\n";
    std::fs::write(temp.path().join("aircraft.csv"), table).unwrap();
    let rows = "[[flight_rows]]\nfile = \"aircraft.csv\"\nweight = \"weight\"\n";
    let text = with("empty = 0.0", rows).replace("flights_per_site = 8", "flights_per_site = 64");
    let path = temp.path().join("p.toml");
    let plan = DatasetPlan::parse(&text, &path, None).unwrap();
    let mut largest = 0;
    for number in 0..64 {
        let flight = plan.flight(number).unwrap();
        let pair = flight.scene.content.flow.pair().unwrap();
        assert_eq!(pair.circulation_m2_s, 10.0 * pair.spacing_m);
        assert_ne!(pair.spacing_m, 40.0);
        largest += usize::from(pair.spacing_m == 60.0);
    }
    assert_eq!(largest, 48);
    std::fs::write(temp.path().join("bad.csv"), table.replace("60", "x")).unwrap();
    for (from, to, wanted) in [
        (
            "\"aircraft.csv\"",
            "\"bad.csv\"",
            "flow.spacing_m = x is not allowed: a number, e.g. 1.5e-6; it is in row 3 of bad.csv",
        ),
        ("\"aircraft.csv\"", "\"none.csv\"", "can be read"),
        ("\"aircraft.csv\"", "\"../aircraft.csv\"", "plain file name"),
        ("= \"weight\"", "= \"wait\"", "a column of"),
    ] {
        let read = DatasetPlan::parse(&text.replace(from, to), &path, None);
        let message = read.unwrap_err().to_string();
        assert!(message.contains(wanted), "{message}");
    }
}

#[test]
fn keys_that_are_not_allowed_are_refused_with_their_line_and_what_is() {
    for (head, tables, wanted) in [
        (
            "split.foo = 1",
            "",
            "p.toml:5: split.foo = 1 is not allowed: there is no such key; known here: test_away, home",
        ),
        (
            "",
            "[[flight_rows]]\nfile = \"a.csv\"\nfle = \"a.csv\"",
            "did you mean file?; known here: file, weight",
        ),
        (
            "",
            "[[flight_rows]]\nfile = \"a.csv\"\n[[flight_rows]]\nfile = \"b.csv\"",
            "flight_rows is not allowed: at most one [[flight_rows]]: there are 2",
        ),
        (
            "seed = 3",
            "[flight]\n\"seed\" = { uniform = [1.0, 2.0] }",
            "p.toml:10: seed is not allowed: a key that does not set",
        ),
        (
            "",
            "[[scene.added_flows]]\nkind = \"eddies\"\n[flight]\n\"added_flows.1.smallest_m\" = { uniform = [3.0, 4.0] }",
            "p.toml:12: added_flows.1.smallest_m is not allowed: number 0 of added_flows",
        ),
        (
            "",
            "[flight]\n\"added_flows.0.smallest_m\" = \"3\"",
            "added_flows.0.smallest_m is not allowed: a plan with [[scene.added_flows]]",
        ),
        (
            "",
            "[[scene.added_flows]]\nkind = \"eddies\"\n[flight]\n\"added_flows.0.smallest_m\" = { uniform = [1e-4, 1e-3] }",
            "p.toml:12: added_flows[0].smallest_m = ",
        ),
        (
            "colour = 1",
            "",
            "p.toml:5: colour = 1 is not allowed: there is no such key",
        ),
        (
            "sites = 3",
            "",
            "p.toml:5: sites: this is not valid TOML: duplicate key",
        ),
        ("titel = \"t\"", "", "did you mean title?"),
        (
            "empty = 1.5",
            "",
            "p.toml:5: empty = 1.5 is not allowed: a number from 0.0 to 1.0",
        ),
        ("licence = \"all rights\"", "", "an SPDX name"),
        ("heights_m = [10.0, 5.0]", "", "increasing"),
        ("format = 2", "", "format = 2 is not allowed: 1, the format"),
        ("split = { home = 0.3 }", "", "1/2, 1/4, 1/8 or 1/16"),
        ("split = { home = 0.0625 }", "", "whole number of flights"),
        ("split = { test_away = [2] }", "", "from 0 to 1"),
        (
            "",
            "[flight]\n\"pulse.enrgy_j\" = { uniform = [1e-5, 1e-4] }",
            "p.toml:10: pulse.enrgy_j",
        ),
        (
            "",
            "[flight]\n\"pulse.enrgy_j\" = { uniform = [1e-5, 1e-4] }",
            "did you mean pulse.energy_j?",
        ),
        (
            "",
            "[flight]\nseed = { choice = [1, 2] }",
            "the arrays or the seed",
        ),
        (
            "",
            "[flight]\n\"outputs.csv\" = { choice = [true] }",
            "changes no result",
        ),
        (
            "",
            "[flight]\n\"site.name\" = { choice = [\"a\"] }",
            "changes no result",
        ),
        (
            "",
            "[flight]\n\"scan.range_max_m\" = { uniform = [500.0, 520.0] }",
            "all flights share these",
        ),
        (
            "",
            "[site]\n\"scan.pattern.kind\" = { choice = [\"ppi\"] }",
            "all flights share these",
        ),
        (
            "",
            "[flight]\n\"flow.lateral_m_s\" = { uniform = [0.0, 1.0] }",
            "this key is for flow.kind = \"uniform\"",
        ),
        (
            "",
            "[flight]\n\"flow.height_m\" = { uniform = [2.0, 1.0] }",
            "first is smaller",
        ),
        (
            "",
            "[site]\n\"flow.height_m\" = { uniform = [20.0, 30.0] }\n[flight]\n\"flow.height_m\" = \"20\"",
            "each key varies once",
        ),
        (
            "",
            "[flight]\n\"flow.height_m\" = \"flow.spacing_m\"\n\"flow.spacing_m\" = \"40\"",
            "flow.spacing_m is not",
        ),
        (
            "",
            "[flight]\n\"flow.height_m\" = \"2*colour\"",
            "there is no such key",
        ),
        ("", "[flight]\n\"flow.height_m\" = \"2*\"", "at its end"),
        (
            "",
            "[flight]\n\"flow.height_m\" = { uniform = [1e3, 1e5] }",
            "flight 1 of site 0 (flow.height_m = ",
        ),
        (
            "",
            "[flight]\n\"flow.height_m\" = { uniform = [1e3, 1e5] }",
            "p.toml:10: flow.height_m = ",
        ),
        (
            "",
            "[flight]\n\"flow.height_m\" = { uniform = [1e3, 1e5] }",
            "more flights are refused",
        ),
        (
            "",
            "[scene.scan]\nrealisations = 4",
            "1: flights are the realisations",
        ),
        (
            "",
            "[scene.outputs]\ncsv = true",
            "the arrays of the data set are its outputs",
        ),
        ("scene = 3", "", "a table with keys of scenes"),
        (
            "",
            "[scene.flow]\nspacing_m = -1.0",
            "p.toml:10: flow.spacing_m = -1",
        ),
    ] {
        let head_only = head == "scene = 3";
        let refusal = match head_only {
            true => plan("title = \"t\"\nscene = 3\n").unwrap_err().to_string(),
            false => message(head, tables),
        };
        assert!(refusal.contains(wanted), "{head} {tables}: {refusal}");
    }
    let refusal = plan("title = \"t\"\nflights_per_site = 8\n").unwrap_err();
    let wanted = "p.toml:2: flights_per_site = 8 is not allowed: at least flights_per_chunk, which is 16 by default";
    assert!(refusal.to_string().contains(wanted), "{refusal}");
    for flights in ["7", "12", "131072"] {
        let text = with("", "").replace(
            "flights_per_site = 8",
            &format!("flights_per_site = {flights}"),
        );
        let refusal = plan(&text).unwrap_err().to_string();
        assert!(
            refusal.contains("more flights need more sites"),
            "{refusal}"
        );
    }
    let many: String = (0..255)
        .map(|i| format!("\"added_flows.{i}.dissipation_m2_s3\" = {{ uniform = [0.0, 1.0] }}\n"))
        .collect();
    let refusal = message("", &format!("[flight]\n{many}"));
    assert!(refusal.contains("at most 254 distributions"), "{refusal}");
    assert!(
        plan(&with("", "").replace("title = \"t\"\n", ""))
            .unwrap_err()
            .to_string()
            .contains("a title")
    );
}
