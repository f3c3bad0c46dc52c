//! The report of a run as one HTML page that opens from disk: findings, figures, claims, run times; pictures inside, no script, nothing
//! fetched.
//!
//! Check: every text is escaped, the page names nothing outside itself, verdicts are marked by colour and by word.

use crate::claim::{Claim, Kind};
use crate::cost::machine;
use crate::figures::context::{Context, Rendered};
use crate::figures::{Figure, filled};
use crate::statistics::{Verdict, two_digits};
use fixtures::failure::Failure;
use wakescope_sim::plot::escape;

/// What run times are of: figures have no stages of their own.
pub(super) const STAGE: &str = "total";

/// Figures with what they gave.
type Done<'a> = [(&'a Figure, Rendered)];

/// What stands before the figures: a heading, whether of the chapter's claims, and how they came out.
const FINDINGS: [(&str, bool, Verdict); 4] = [
    (
        "What the chapter says and this run does not find",
        true,
        Verdict::Fail,
    ),
    (
        "What the chapter says and this run does not decide",
        true,
        Verdict::Open,
    ),
    ("The program's own claims that fail", false, Verdict::Fail),
    (
        "The program's own claims that this run does not decide",
        false,
        Verdict::Open,
    ),
];

/// The page.
///
/// # Errors
/// A row with another number of cells than its header, a picture that is not an `<svg>` element, two figures of one id.
pub(super) fn html(context: &Context, done: &Done<'_>, run_s: f64) -> Result<String, Failure> {
    let parts = [
        include_str!("report.css").into(),
        escape(&found(context, done, run_s)),
        findings(done),
        links(done),
        figures(done)?,
        claims(done)?,
        timings(done)?,
        origin(context),
    ];
    filled(include_str!("report.html"), &parts)
        .ok_or_else(|| Failure::new("the page lacks parts".into()))
}

/// The claims that do not hold and those that are open, list by list.
fn findings(done: &Done<'_>) -> String {
    let mut findings = String::new();
    let mut class = "finding first";
    for (heading, of_chapter, verdict) in FINDINGS {
        let mut list = String::new();
        for (_, rendered) in done {
            for claim in &rendered.claims {
                let is_of_chapter = claim.kind() == Kind::Chapter;
                if claim.verdict == verdict && is_of_chapter == of_chapter {
                    list += &finding(class, claim, rendered.took_s[1]);
                }
            }
        }
        if !list.is_empty() {
            findings += &format!("<h2>{heading}</h2>\n{list}");
            class = "finding";
        }
    }
    findings
}

/// Links to all figures and tables.
fn links(done: &Done<'_>) -> String {
    let mut links = String::new();
    for (figure, _) in done {
        links += &link(figure.id, &figure.heading());
    }
    links + &link("claims", "All claims") + &link("timings", "Run times")
}

fn link(id: &str, name: &str) -> String {
    format!("<li><a href=\"#{id}\">{}</a></li>\n", escape(name))
}

/// All figures.
///
/// # Errors
/// Fails if two have one id, or one is not as [`entry`] needs it.
fn figures(done: &Done<'_>) -> Result<String, Failure> {
    let mut figures = String::new();
    let mut ids = Vec::new();
    for (figure, rendered) in done {
        if ids.contains(&figure.id) {
            return Err(Failure::new(format!(
                "two figures of the report are called '{}'",
                figure.id
            )));
        }
        ids.push(figure.id);
        figures += &entry(figure, rendered)?;
    }
    Ok(figures)
}

/// Program, seed, profile and machine, and the command that makes the report again.
fn origin(context: &Context) -> String {
    let profile = context.profile.name();
    let seed = context.seed;
    let command = format!("cargo xtask reproduce-figs --profile {profile} --seed {seed}");
    let items = [
        ("version", wakescope_sim::PROGRAM.into()),
        ("seed", seed.to_string()),
        ("profile", profile.into()),
        ("machine", machine()),
        ("command", command),
    ];
    let mut list = String::new();
    for (name, value) in items {
        list += &format!("<dt>{name}</dt><dd>{}</dd>\n", escape(&value));
    }
    list
}

/// Of a list of claims how many hold, do not, are open.
pub(super) fn counted(kind: Kind, claims: &[&Claim]) -> String {
    let mut holds = 0;
    let mut fails = 0;
    let mut open = 0;
    for claim in claims.iter().filter(|claim| claim.kind() == kind) {
        match claim.verdict {
            Verdict::Pass => holds += 1,
            Verdict::Fail => fails += 1,
            Verdict::Open => open += 1,
        }
    }
    let all = holds + fails + open;
    format!("{all} claims: {holds} hold, {fails} do not, {open} are open")
}

/// How many claims hold, what the figures say in words, and what it took.
fn found(context: &Context, done: &Done<'_>, run_s: f64) -> String {
    let claims: Vec<&Claim> = done.iter().flat_map(|(_, r)| &r.claims).collect();
    let core_s: f64 = done.iter().map(|(_, r)| r.took_s[1]).sum();
    let mut words: Vec<&str> = done.iter().map(|(_, r)| r.words.as_str()).collect();
    words.retain(|words| !words.is_empty());
    format!(
        "The chapter's {}; the program's own {} (profile {}). {} {} figures and tables took {core_s:.0} s of processor time; this \
         run, with those that it found in the cache, {run_s:.0} s.",
        counted(Kind::Chapter, &claims),
        counted(Kind::Own, &claims),
        context.profile.name(),
        words.join(" "),
        done.len()
    )
}

/// A claim that does not hold or is not decided, and why.
fn finding(class: &str, claim: &Claim, core_s: f64) -> String {
    let Claim {
        id,
        figure,
        statement,
        expected,
        measured,
        decided_by,
        ..
    } = claim;
    let said = if claim.kind() == Kind::Chapter {
        format!("{} ", claim.source())
    } else {
        String::new()
    };
    let decided = match decided_by.as_str() {
        "" => String::new(),
        by => format!(" Would decide: {by}; the figure took {core_s:.0} s of processor time."),
    };
    let [id, figure, statement] = [id, figure, statement].map(|text| escape(text));
    let reason = escape(&format!(
        "{said}Expected: {expected}. Measured: {measured}.{decided}"
    ));
    format!(
        "<div class=\"{class}\"><p><a href=\"#{figure}\">{id}</a> {statement}</p><p class=\"reason\">{reason}</p></div>\n"
    )
}

/// A figure, or a table with its rows.
fn entry(figure: &Figure, rendered: &Rendered) -> Result<String, Failure> {
    let id = figure.id;
    let mut marks = String::new();
    for mark in &rendered.marks {
        marks += &format!("<span class=\"mark\">{}</span>", escape(mark));
    }
    let content = if let Some(svg) = rendered.file("svg") {
        picture(id, &String::from_utf8_lossy(svg))?
    } else if let Some(csv) = rendered.file("csv") {
        rows_of(id, &String::from_utf8_lossy(csv))?
    } else {
        String::new()
    };
    let heading = escape(&figure.heading());
    let caption = escape(&rendered.caption);
    Ok(format!(
        "<figure id=\"{id}\">\n<h3>{heading}{marks}</h3>\n{content}<figcaption>{caption}</figcaption>\n</figure>\n"
    ))
}

/// A picture that is one element without script.
fn picture(id: &str, svg: &str) -> Result<String, Failure> {
    if svg.starts_with("<svg") && !svg.contains("<script") {
        return Ok(svg.to_owned());
    }
    let start: String = svg.chars().take(20).collect();
    Err(Failure::new(format!(
        "picture of {id} = {start}: one <svg> element without script"
    )))
}

/// The rows of a table.
fn rows_of(id: &str, csv: &str) -> Result<String, Failure> {
    let mut lines = csv.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<&str> = lines
        .next()
        .map_or(Vec::new(), |line| line.split(',').collect());
    let mut rows = Vec::new();
    for line in lines {
        rows.push(line.split(',').map(five_digits).collect());
    }
    table(id, &header, &rows)
}

/// A cell; if it is a number, rounded to five digits.
fn five_digits(cell: &str) -> String {
    let Ok(number) = cell.parse::<f64>() else {
        return cell.to_owned();
    };
    let Ok(rounded) = format!("{number:.4e}").parse::<f64>() else {
        return cell.to_owned();
    };
    if rounded.abs() < 1e-3 && rounded != 0.0 {
        format!("{rounded:e}")
    } else {
        rounded.to_string()
    }
}

fn claims(done: &Done<'_>) -> Result<String, Failure> {
    let mut rows = Vec::new();
    for (_, rendered) in done {
        rows.extend(rendered.claims.iter().map(claim_row));
    }
    let header = [
        "id",
        "list",
        "statement",
        "expected",
        "measured",
        "standard error",
        "verdict",
    ];
    table("claims", &header, &rows)
}

fn claim_row(claim: &Claim) -> Vec<String> {
    let error = if claim.standard_error.is_nan() {
        String::new()
    } else {
        two_digits(claim.standard_error)
    };
    vec![
        claim.id.clone(),
        claim.kind().name().to_owned(),
        claim.statement.clone(),
        claim.expected.clone(),
        claim.measured.clone(),
        error,
        claim.verdict.name().to_owned(),
    ]
}

fn timings(done: &Done<'_>) -> Result<String, Failure> {
    let mut rows = Vec::new();
    for (figure, rendered) in done {
        let [wall_s, core_s] = rendered.took_s.map(|time_s| format!("{time_s:.1}"));
        rows.push(vec![
            figure.title.to_owned(),
            STAGE.to_owned(),
            wall_s,
            core_s,
        ]);
    }
    let header = [
        "figure",
        "stage",
        "wall-clock time [s]",
        "processor time [s]",
    ];
    table("timings", &header, &rows)
}

/// A table; on a narrow screen each row becomes a block of named cells. The words of verdicts are coloured.
fn table(name: &str, header: &[&str], rows: &[Vec<String>]) -> Result<String, Failure> {
    let header: Vec<String> = header.iter().map(|column| escape(column)).collect();
    let mut names = String::new();
    for column in &header {
        names += &format!("<th>{column}</th>");
    }
    let mut out =
        format!("<div class=\"scroll\"><table>\n<thead><tr>{names}</tr></thead>\n<tbody>\n");
    for row in rows {
        if row.len() != header.len() {
            return Err(Failure::new(format!(
                "table {name}: {} cells under {} names",
                row.len(),
                header.len()
            )));
        }
        out += "<tr>";
        for (cell, column) in row.iter().zip(&header) {
            let is_verdict = ["pass", "fail", "open"].contains(&cell.as_str());
            let class = if is_verdict {
                format!(" class=\"{cell}\"")
            } else {
                String::new()
            };
            out += &format!("<td{class} data-label=\"{column}\">{}</td>", escape(cell));
        }
        out += "</tr>\n";
    }
    Ok(out + "</tbody></table></div>\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::profile::Profile;

    const WILD: &str = "<script>alert('x & \"y\"')</script>";

    /// A figure and a table, all of whose texts are wild.
    fn page(change: impl Fn(&mut Vec<(&Figure, Rendered)>)) -> Result<String, Failure> {
        let make: fn(&Context) -> Result<Rendered, Failure> = |_| Ok(Rendered::default());
        let figure = |id| Figure {
            id,
            number: 1,
            title: WILD,
            make,
        };
        let (drawn, listed) = (figure("fig01"), figure("tab01"));
        let claim = |id: &str| Claim {
            statement: WILD.into(),
            expected: WILD.into(),
            figure: WILD.into(),
            ..Claim::exact(id, WILD.into(), false).open(WILD)
        };
        let rendered = |extension: &str, bytes: &str| Rendered {
            files: vec![(extension.into(), bytes.as_bytes().to_vec())],
            caption: WILD.into(),
            values: Vec::new(),
            marks: vec![WILD.into()],
            words: WILD.into(),
            claims: vec![claim(WILD)],
            took_s: [1.0, 2.0],
        };
        let picture = "<svg xmlns=\"http://www.w3.org/2000/svg\"></svg>\n";
        let rows = format!("# head\n{WILD}\n{WILD}\n");
        let mut done = vec![
            (&drawn, rendered("svg", picture)),
            (&listed, rendered("csv", &rows)),
        ];
        change(&mut done);
        let (stages, anew, wake, analytic) = (".".into(), false, None, false);
        html(
            &Context {
                profile: Profile::Quick,
                seed: 1,
                stages,
                anew,
                wake,
                analytic,
            },
            &done,
            1.0,
        )
    }

    #[test]
    fn every_text_is_escaped_and_nothing_is_fetched() {
        let page = page(|_| {}).unwrap();
        assert!(!page.contains("<script"), "{page}");
        // Of both: words; link, heading, caption, mark; title of the run times; of the claims six in the finding, four in
        // the table; names and two cells of the table of rows.
        assert_eq!(
            page.matches("&lt;script&gt;").count(),
            2 * (1 + 4 + 1 + 6 + 4) + 3
        );
        assert!(page.contains("<td class=\"open\" data-label="));
        // What does not hold stands before the figures, and an empty list has no heading.
        assert!(page.find("class=\"finding first\"").unwrap() < page.find("<figure").unwrap());
        assert!(!page.contains(FINDINGS[0].0) && page.contains(FINDINGS[3].0));
        for outside in ["src=", "url(", "@import", "<link", "href=\"http"] {
            assert!(!page.contains(outside), "{outside}");
        }
        assert_eq!(
            page.matches("<figure").count(),
            page.matches("</figure>").count()
        );
    }

    #[test]
    fn broken_reports_are_refused() {
        let uneven = page(|done| done[1].1.files[0].1.extend(b"a,b\n"));
        assert!(
            uneven
                .unwrap_err()
                .to_string()
                .contains("2 cells under 1 names")
        );
        let twice = page(|done| done.push(done[0].clone()));
        assert!(twice.unwrap_err().to_string().contains("two figures"));
        let foreign = page(|done| done[0].1.files[0].1 = b"<script>".to_vec());
        assert!(foreign.unwrap_err().to_string().contains("without script"));
    }
}
