//! The report of a run: one page with all figures, claims and run times.

use crate::Failure;
use crate::claim::{Claim, Verdict, two_digits};
use crate::cost::machine;
use crate::figures::Figure;
use crate::figures::context::{Context, Rendered};
use wakescope_sim::plot::html::HtmlTable;
use wakescope_sim::plot::{Finding, Report, ReportEntry};

/// The page as HTML.
pub(super) fn html(context: &Context, done: &[(&Figure, Rendered)], run_s: f64) -> Result<String, Failure> {
    let of = |verdict: Verdict| done.iter().flat_map(|(_, r)| &r.claims).filter(move |c| c.verdict == verdict);
    let findings = |verdict: Verdict| of(verdict).map(finding).collect();
    let report = Report {
        title: "wakescope: figures and claims".into(),
        found: found(context, done, run_s),
        findings: vec![
            ("Claims that fail".into(), findings(Verdict::Fail)),
            ("Claims that this run does not decide".into(), findings(Verdict::NotResolved)),
        ],
        facts: facts(context),
        entries: done.iter().map(|(figure, rendered)| entry(figure, rendered)).collect(),
        claims: claims(done),
        timings: timings(done),
    };
    Ok(report.to_html()?)
}

/// How many claims hold, and what it took.
fn found(context: &Context, done: &[(&Figure, Rendered)], run_s: f64) -> String {
    let count = |verdict| done.iter().flat_map(|(_, r)| &r.claims).filter(|c| c.verdict == verdict).count();
    let [holds, fails, open] = [Verdict::Pass, Verdict::Fail, Verdict::NotResolved].map(count);
    let core_s: f64 = done.iter().flat_map(|(_, r)| &r.timings).map(|(_, [_, core_s])| core_s).sum();
    format!(
        "{holds} of {} claims hold, {fails} fail, {open} are not decided with the profile {}. {} figures and tables took \
         {core_s:.0} s of processor time; this run, with those that it found in the cache, {run_s:.0} s.",
        holds + fails + open,
        context.profile_name(),
        done.len()
    )
}

fn finding(claim: &Claim) -> Finding {
    Finding {
        name: claim.id.clone(),
        entry: claim.figure.clone(),
        statement: claim.statement.clone(),
        reason: format!("Expected: {}. Measured: {}.", claim.expected, claim.measured),
    }
}

fn facts(context: &Context) -> Vec<(String, String)> {
    let fact = |name: &str, value: String| (name.to_owned(), value);
    vec![
        fact("version", wakescope_sim::PROGRAM.into()),
        fact("seed", context.seed.to_string()),
        fact("profile", context.profile_name().into()),
        fact("machine", machine()),
        fact(
            "command",
            format!("cargo xtask reproduce-figs --profile {} --seed {}", context.profile_name(), context.seed),
        ),
    ]
}

fn entry(figure: &Figure, rendered: &Rendered) -> ReportEntry {
    let svg = rendered.file("svg").map(|bytes| String::from_utf8_lossy(bytes).into_owned());
    // A table shows its own rows; a figure's rows are in its file.
    let table = match (&svg, rendered.file("csv")) {
        (None, Some(csv)) => Some(table_of_csv(&String::from_utf8_lossy(csv))),
        _ => None,
    };
    ReportEntry {
        id: figure.id.into(),
        title: figure.heading(),
        caption: rendered.caption.clone(),
        svg,
        table,
        marks: rendered.marks.clone(),
    }
}

/// The rows of a table whose cells hold no commas.
fn table_of_csv(csv: &str) -> HtmlTable {
    let mut rows =
        csv.lines().filter(|l| !l.starts_with('#')).map(|l| l.split(',').map(str::to_owned).collect::<Vec<_>>());
    HtmlTable { header: rows.next().unwrap_or_default(), rows: rows.collect() }
}

fn words(list: &[&str]) -> Vec<String> {
    list.iter().map(|&w| w.to_owned()).collect()
}

fn claims(done: &[(&Figure, Rendered)]) -> HtmlTable {
    let row = |c: &Claim| {
        let error = if c.standard_error.is_nan() { String::new() } else { two_digits(c.standard_error) };
        vec![c.id.clone(), c.statement.clone(), c.expected.clone(), c.measured.clone(), error, c.verdict.name().into()]
    };
    HtmlTable {
        header: words(&["id", "statement", "expected", "measured", "standard error", "verdict"]),
        rows: done.iter().flat_map(|(_, r)| r.claims.iter().map(row)).collect(),
    }
}

fn timings(done: &[(&Figure, Rendered)]) -> HtmlTable {
    let row = |title: &str, (stage, [wall_s, core_s]): &(String, [f64; 2])| {
        vec![title.to_owned(), stage.clone(), format!("{wall_s:.1}"), format!("{core_s:.1}")]
    };
    HtmlTable {
        header: words(&["figure", "stage", "wall-clock time [s]", "processor time [s]"]),
        rows: done.iter().flat_map(|(f, r)| r.timings.iter().map(|t| row(f.title, t))).collect(),
    }
}
