//! The report of a run: one page with all figures, claims and run times.

use super::html::{Finding, HtmlTable, Report, ReportEntry};
use super::lists::Kind;
use crate::claim::Claim;
use crate::cost::machine;
use crate::figures::Figure;
use crate::figures::context::{Context, Rendered};
use crate::statistics::{Verdict, two_digits};
use fixtures::failure::Failure;

/// The page as HTML.
pub(super) fn html(context: &Context, done: &[(&Figure, Rendered)], run_s: f64) -> Result<String, Failure> {
    let heads: [(&str, bool, Verdict); 4] = [
        ("What the chapter says and this run does not find", true, Verdict::Fail),
        ("What the chapter says and this run does not decide", true, Verdict::Open),
        ("The program's own claims that fail", false, Verdict::Fail),
        ("The program's own claims that this run does not decide", false, Verdict::Open),
    ];
    let findings = heads.map(|(heading, of_chapter, verdict)| {
        let here = |c: &&Claim| c.verdict == verdict && matches!(Kind::of(&c.id), Kind::Chapter(..)) == of_chapter;
        let of =
            |(_, r): &(_, Rendered)| r.claims.iter().filter(here).map(|c| finding(c, core_s(r))).collect::<Vec<_>>();
        (heading.into(), done.iter().flat_map(of).collect())
    });
    let report = Report {
        title: "wakescope: figures and claims".into(),
        found: found(context, done, run_s),
        findings: findings.into(),
        facts: facts(context),
        entries: done.iter().map(|(figure, rendered)| entry(figure, rendered)).collect(),
        claims: claims(done),
        timings: timings(done),
    };
    report.to_html()
}

/// Of a list of claims how many hold, do not, are open.
pub(super) fn counted(name: &str, claims: &[&Claim]) -> String {
    let of: Vec<&&Claim> = claims.iter().filter(|claim| Kind::of(&claim.id).name() == name).collect();
    let count = |verdict| of.iter().filter(|claim| claim.verdict == verdict).count();
    let [holds, fails, open] = [Verdict::Pass, Verdict::Fail, Verdict::Open].map(count);
    format!("{} claims: {holds} hold, {fails} do not, {open} are open", of.len())
}

/// How many claims hold, what the figures say in words, and what it took.
fn found(context: &Context, done: &[(&Figure, Rendered)], run_s: f64) -> String {
    let claims: Vec<&Claim> = done.iter().flat_map(|(_, r)| &r.claims).collect();
    let core_s: f64 = done.iter().map(|(_, r)| core_s(r)).sum();
    let words: Vec<&str> = done.iter().map(|(_, r)| r.words.as_str()).filter(|words| !words.is_empty()).collect();
    format!(
        "The chapter's {}; the program's own {} (profile {}). {} {} figures and tables took {core_s:.0} s of processor time; this \
         run, with those that it found in the cache, {run_s:.0} s.",
        counted("chapter", &claims),
        counted("own", &claims),
        context.profile_name(),
        words.join(" "),
        done.len()
    )
}

/// Processor time that a figure took, s.
fn core_s(rendered: &Rendered) -> f64 {
    rendered.timings.iter().map(|(_, [_, core_s])| core_s).sum()
}

fn finding(claim: &Claim, core_s: f64) -> Finding {
    let kind = Kind::of(&claim.id);
    let said = if let Kind::Chapter(..) = kind { format!("{} ", kind.source()) } else { String::new() };
    let decided = match claim.decided_by.as_str() {
        "" => String::new(),
        by => format!(" Would decide: {by}; the figure took {core_s:.0} s of processor time."),
    };
    Finding {
        name: claim.id.clone(),
        entry: claim.figure.clone(),
        statement: claim.statement.clone(),
        reason: format!("{said}Expected: {}. Measured: {}.{decided}", claim.expected, claim.measured),
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

/// The rows of a table whose cells hold no commas; its numbers come from four digits at most and are shown with five.
fn table_of_csv(csv: &str) -> HtmlTable {
    let mut rows =
        csv.lines().filter(|l| !l.starts_with('#')).map(|l| l.split(',').map(five_digits).collect::<Vec<_>>());
    HtmlTable { header: rows.next().unwrap_or_default(), rows: rows.collect() }
}

/// A cell; if it is a number, rounded to five digits.
fn five_digits(cell: &str) -> String {
    let rounded = cell.parse::<f64>().ok().and_then(|x| format!("{x:.4e}").parse::<f64>().ok());
    rounded
        .map_or_else(|| cell.to_owned(), |x| if x.abs() < 1e-3 && x != 0.0 { format!("{x:e}") } else { x.to_string() })
}

fn words(list: &[&str]) -> Vec<String> {
    list.iter().map(|&w| w.to_owned()).collect()
}

fn claims(done: &[(&Figure, Rendered)]) -> HtmlTable {
    let row = |c: &Claim| {
        let error = if c.standard_error.is_nan() { String::new() } else { two_digits(c.standard_error) };
        let list = Kind::of(&c.id).name().to_owned();
        let told = [&c.statement, &c.expected, &c.measured, &error].map(String::clone);
        [vec![c.id.clone(), list], told.to_vec(), vec![c.verdict.name().into()]].concat()
    };
    HtmlTable {
        header: words(&["id", "list", "statement", "expected", "measured", "standard error", "verdict"]),
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
