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
    let (mut findings, mut figures, mut made) = (String::new(), String::new(), String::new());
    let mut class = "finding first";
    for (heading, of_chapter, verdict) in FINDINGS {
        let here = |c: &&Claim| c.verdict == verdict && (c.kind() == Kind::Chapter) == of_chapter;
        let of = |(_, r): &(_, Rendered)| {
            r.claims
                .iter()
                .filter(here)
                .map(|claim| finding(class, claim, r.took_s[1]))
                .collect::<String>()
        };
        let list: String = done.iter().map(of).collect();
        if !list.is_empty() {
            findings += &format!("<h2>{heading}</h2>\n{list}");
            class = "finding";
        }
    }
    let link = |id: &str, name: &str| format!("<li><a href=\"#{id}\">{}</a></li>\n", escape(name));
    let links: String = done
        .iter()
        .map(|(figure, _)| link(figure.id, &figure.heading()))
        .collect();
    let links = links + &link("claims", "All claims") + &link("timings", "Run times");
    for (place, (figure, rendered)) in done.iter().enumerate() {
        if done[..place]
            .iter()
            .any(|(before, _)| before.id == figure.id)
        {
            return Err(Failure::new(format!(
                "two figures of the report are called '{}'",
                figure.id
            )));
        }
        figures += &entry(figure, rendered)?;
    }
    let (profile, seed) = (context.profile.name(), context.seed);
    for (name, value) in [
        ("version", wakescope_sim::PROGRAM.into()),
        ("seed", seed.to_string()),
        ("profile", profile.into()),
        ("machine", machine()),
        (
            "command",
            format!("cargo xtask reproduce-figs --profile {profile} --seed {seed}"),
        ),
    ] {
        made += &format!("<dt>{name}</dt><dd>{}</dd>\n", escape(&value));
    }
    let found = escape(&found(context, done, run_s));
    let parts = [
        include_str!("report.css").into(),
        found,
        findings,
        links,
        figures,
        claims(done)?,
        timings(done)?,
        made,
    ];
    filled(include_str!("report.html"), &parts)
        .ok_or_else(|| Failure::new("the page lacks parts".into()))
}

/// Of a list of claims how many hold, do not, are open.
pub(super) fn counted(kind: Kind, claims: &[&Claim]) -> String {
    let of: Vec<&&Claim> = claims.iter().filter(|claim| claim.kind() == kind).collect();
    let count = |verdict| of.iter().filter(|claim| claim.verdict == verdict).count();
    let [holds, fails, open] = [Verdict::Pass, Verdict::Fail, Verdict::Open].map(count);
    format!(
        "{} claims: {holds} hold, {fails} do not, {open} are open",
        of.len()
    )
}

/// How many claims hold, what the figures say in words, and what it took.
fn found(context: &Context, done: &Done<'_>, run_s: f64) -> String {
    let claims: Vec<&Claim> = done.iter().flat_map(|(_, r)| &r.claims).collect();
    let core_s: f64 = done.iter().map(|(_, r)| r.took_s[1]).sum();
    let words: Vec<&str> = done
        .iter()
        .map(|(_, r)| r.words.as_str())
        .filter(|words| !words.is_empty())
        .collect();
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
    let Figure { id, .. } = figure;
    let marks: String = rendered
        .marks
        .iter()
        .map(|mark| format!("<span class=\"mark\">{}</span>", escape(mark)))
        .collect();
    let text = |extension: &str| rendered.file(extension).map(String::from_utf8_lossy);
    let shown = match (text("svg"), text("csv")) {
        (Some(svg), _) if svg.starts_with("<svg") && !svg.contains("<script") => svg.into_owned(),
        (Some(svg), _) => {
            let start: String = svg.chars().take(20).collect();
            return Err(Failure::new(format!(
                "picture of {id} = {start}: one <svg> element without script"
            )));
        }
        (None, Some(csv)) => {
            let mut rows = csv
                .lines()
                .filter(|line| !line.starts_with('#'))
                .map(|line| line.split(','));
            let header: Vec<&str> = rows.next().into_iter().flatten().collect();
            table(id, &header, rows.map(|row| row.map(five_digits).collect()))?
        }
        (None, None) => String::new(),
    };
    let (heading, caption) = (escape(&figure.heading()), escape(&rendered.caption));
    Ok(format!(
        "<figure id=\"{id}\">\n<h3>{heading}{marks}</h3>\n{shown}<figcaption>{caption}</figcaption>\n</figure>\n"
    ))
}

/// A cell; if it is a number, rounded to five digits.
fn five_digits(cell: &str) -> String {
    let rounded = cell
        .parse::<f64>()
        .ok()
        .and_then(|x| format!("{x:.4e}").parse::<f64>().ok());
    rounded.map_or_else(
        || cell.to_owned(),
        |x| {
            if x.abs() < 1e-3 && x != 0.0 {
                format!("{x:e}")
            } else {
                x.to_string()
            }
        },
    )
}

fn claims(done: &Done<'_>) -> Result<String, Failure> {
    let row = |c: &Claim| {
        let error = if c.standard_error.is_nan() {
            String::new()
        } else {
            two_digits(c.standard_error)
        };
        let (list, verdict) = (c.kind().name().to_owned(), c.verdict.name().to_owned());
        vec![
            c.id.clone(),
            list,
            c.statement.clone(),
            c.expected.clone(),
            c.measured.clone(),
            error,
            verdict,
        ]
    };
    let header = [
        "id",
        "list",
        "statement",
        "expected",
        "measured",
        "standard error",
        "verdict",
    ];
    table(
        "claims",
        &header,
        done.iter().flat_map(|(_, r)| r.claims.iter().map(row)),
    )
}

fn timings(done: &Done<'_>) -> Result<String, Failure> {
    let row = |(figure, rendered): &(&Figure, Rendered)| {
        let [wall_s, core_s] = rendered.took_s.map(|time_s| format!("{time_s:.1}"));
        vec![figure.title.to_owned(), STAGE.to_owned(), wall_s, core_s]
    };
    let header = [
        "figure",
        "stage",
        "wall-clock time [s]",
        "processor time [s]",
    ];
    table("timings", &header, done.iter().map(row))
}

/// A table; on a narrow screen each row becomes a block of named cells. The words of verdicts are coloured.
fn table(
    name: &str,
    header: &[&str],
    rows: impl Iterator<Item = Vec<String>>,
) -> Result<String, Failure> {
    let header: Vec<String> = header.iter().map(|column| escape(column)).collect();
    let names: String = header
        .iter()
        .map(|column| format!("<th>{column}</th>"))
        .collect();
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
        let cell = |(cell, column): (&String, &String)| {
            let is_verdict = ["pass", "fail", "open"].contains(&cell.as_str());
            let class = if is_verdict {
                format!(" class=\"{cell}\"")
            } else {
                String::new()
            };
            format!("<td{class} data-label=\"{column}\">{}</td>", escape(cell))
        };
        out += &format!(
            "<tr>{}</tr>\n",
            row.iter().zip(&header).map(cell).collect::<String>()
        );
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
