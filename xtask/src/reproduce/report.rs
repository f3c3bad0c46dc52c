//! The report of a run as one HTML page that opens from disk: what does not hold, figures, the comparison of the two
//! accumulations, the chapter's statements, the program's own checks, run times; pictures inside, no script, nothing fetched.
//!
//! Check: every text is escaped, the page names nothing outside itself, verdicts are marked by colour and by word.

mod elements;

use crate::claim::{Claim, Kind};
use crate::cost::machine;
use crate::figures::context::{Comparison, Context, Rendered};
use crate::figures::{Figure, filled};
use crate::profile::Profile;
use crate::statistics::{Bar, Estimate, NO_DIFFERENCE, Verdict};
use elements::{
    badge, drawing, folded, table, table_of_csv, thumbnail_of_csv, thumbnail_of_drawing, typeset,
};
use fixtures::failure::Failure;
use std::borrow::Cow;
use std::fmt;
use wakescope_sim::plot::escape;

/// What run times are of: figures have no stages of their own.
pub(super) const STAGE: &str = "total";

/// Figures with what they gave.
type Done<'a> = [(&'a Figure, Rendered)];

/// The page.
///
/// # Errors
/// A row with another number of cells than its header, a picture that is not an `<svg>` element, two figures of one id.
pub(super) fn html(context: &Context, done: &Done<'_>, run_s: f64) -> Result<String, Failure> {
    let claims: Vec<&Claim> = done.iter().flat_map(|(_, r)| &r.claims).collect();
    let sections = [
        include_str!("report.css").into(),
        numbers(done.len(), &claims, context.profile, run_s),
        shortfalls(&claims, context.profile),
        thumbnails(done)?,
        comparison(done)?,
        statements(&claims)?,
        figures(done)?,
        checks(&claims)?,
        timings(done)?,
        origin(context),
    ];
    filled(include_str!("report.html"), &sections)
        .ok_or_else(|| Failure::new("the page lacks parts".into()))
}

/// How claims of a kind came out.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
pub(super) struct Count {
    pub(super) holds: usize,
    pub(super) fails: usize,
    pub(super) open: usize,
}

impl Count {
    pub(super) fn new<'c>(claims: impl IntoIterator<Item = &'c Claim>, kind: Kind) -> Self {
        let mut count = Self::default();
        for claim in claims {
            if claim.kind() != kind {
                continue;
            }
            match claim.verdict {
                Verdict::Pass => count.holds += 1,
                Verdict::Fail => count.fails += 1,
                Verdict::Open => count.open += 1,
            }
        }
        count
    }

    pub(super) fn all(self) -> usize {
        self.holds + self.fails + self.open
    }
}

impl fmt::Display for Count {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { holds, fails, open } = self;
        write!(
            f,
            "{holds} of {} hold, {fails} fail, {open} open",
            self.all()
        )
    }
}

/// A time in minutes and seconds.
pub(super) fn duration(time_s: f64) -> String {
    let whole_s = time_s.round() as u64;
    match (whole_s / 3600, whole_s / 60 % 60, whole_s % 60) {
        (0, 0, seconds) => format!("{seconds} s"),
        (0, minutes, seconds) => format!("{minutes} min {seconds} s"),
        (hours, minutes, _) => format!("{hours} h {minutes} min"),
    }
}

/// The numbers at the head of the page.
fn numbers(figures: usize, claims: &[&Claim], profile: Profile, run_s: f64) -> String {
    let of_chapter = Count::new(claims.iter().copied(), Kind::Chapter);
    let numbers = [
        ("", figures.to_string(), "figures and tables drawn".into()),
        (
            "pass",
            of_chapter.holds.to_string(),
            format!("of {} statements reproduced", of_chapter.all()),
        ),
        (
            "fail",
            of_chapter.fails.to_string(),
            format!("not reproduced; {} open", of_chapter.open),
        ),
        (
            "",
            duration(run_s),
            format!("run time, profile {}", profile.name()),
        ),
    ];
    let mut list = String::new();
    for (class, number, name) in numbers {
        list += &format!("<li class=\"{class}\"><b>{number}</b> <span>{name}</span></li>\n");
    }
    list
}

/// The statements that do not hold and those that are open, each with a link to its row.
fn shortfalls(claims: &[&Claim], profile: Profile) -> String {
    let more_data = match profile {
        Profile::Quick => " (<code>--profile standard</code>, tens of minutes, has more data)",
        Profile::Standard | Profile::Full => "",
    };
    let lists = [
        (Verdict::Fail, "Not reproduced", ""),
        (Verdict::Open, "Open", more_data),
    ];
    let mut paragraphs = String::new();
    for (verdict, name, note) in lists {
        let mut links = Vec::new();
        for claim in claims {
            if claim.kind() == Kind::Chapter && claim.verdict == verdict {
                let id = escape(&claim.id);
                let label = typeset(claim.label());
                links.push(format!("<a href=\"#{id}\">{label}</a>"));
            }
        }
        if !links.is_empty() {
            let links = links.join("; ");
            paragraphs += &format!("<p><b>{name}</b>{note}: {links}.</p>\n");
        }
    }
    paragraphs
}

/// The table of a figure as CSV.
fn csv_of(rendered: &Rendered) -> Cow<'_, str> {
    String::from_utf8_lossy(rendered.file("csv").unwrap_or_default())
}

/// A small picture of each figure, which leads to it.
fn thumbnails(done: &Done<'_>) -> Result<String, Failure> {
    let mut list = String::new();
    for (figure, rendered) in done {
        let id = figure.id;
        let small = match rendered.file("svg") {
            Some(svg) => thumbnail_of_drawing(id, std::str::from_utf8(svg)?, figure.row)?,
            None => thumbnail_of_csv(&csv_of(rendered)),
        };
        let number = escape(&figure.numbered());
        let title = typeset(figure.title);
        list += &format!(
            "<li><a href=\"#{id}\">{small}<span><b>{number}</b> {title}</span></a></li>\n"
        );
    }
    Ok(list)
}

/// All figures, or their tables where they have no picture, with their captions.
///
/// # Errors
/// Fails if two have one id, or a picture is not as [`drawing`] needs it.
fn figures(done: &Done<'_>) -> Result<String, Failure> {
    let mut figures = String::new();
    let mut ids = Vec::new();
    for (figure, rendered) in done {
        let id = figure.id;
        if ids.contains(&id) {
            return Err(Failure::new(format!(
                "two figures of the report are called '{id}'"
            )));
        }
        ids.push(id);
        let mut marks = String::new();
        for mark in &rendered.marks {
            marks += &format!(" <span class=\"mark\">{}</span>", escape(mark));
        }
        let heading = figure.heading();
        let content = match rendered.file("svg") {
            Some(svg) => drawing(id, std::str::from_utf8(svg)?, &heading)?,
            None => table_of_csv(id, &csv_of(rendered))?,
        };
        figures += &format!(
            "<figure id=\"{id}\">\n<h3>{}{marks}</h3>\n{content}<figcaption>{}</figcaption>\n</figure>\n",
            typeset(&heading),
            typeset(&rendered.caption)
        );
    }
    Ok(figures)
}

/// What the comparison of the accumulations compares, and how its verdicts are made.
const COMPARED: &str = "Correlogram accumulation (CA) averages autocorrelations and fits an autoregressive model to them; \
    periodogram accumulation (PA) averages periodograms, of windows that are unweighted or have the Gaussian weighting. \
    Numbers are the root mean square error of CA relative to that of PA on the same signals, less 1, with 95 % intervals: \
    the early wake, one pulse a line, noise limited to the band, no refractive turbulence. Yes: the interval is below 0; \
    no: it is above -3 %; otherwise open. The chapter's statement on figure 13 subtracts the error outside first; where CA \
    has the smaller error outside as well, less of its lead is left.";

/// Whether correlogram accumulation has the smaller error.
fn lead(region: &Estimate) -> Verdict {
    Bar::Less(NO_DIFFERENCE).verdict(region)
}

/// Whether correlogram accumulation has the smaller error, case by case from the weakest signal to the strongest; nothing
/// where no figure compares it.
fn comparison(done: &Done<'_>) -> Result<String, Failure> {
    let mut cases = Vec::new();
    for (figure, rendered) in done {
        for case in &rendered.comparison {
            cases.push((*figure, case));
        }
    }
    if cases.is_empty() {
        return Ok(String::new());
    }
    cases.sort_by(|(_, a), (_, b)| a.snr_db.total_cmp(&b.snr_db));
    let mut rows = Vec::new();
    for (figure, case) in &cases {
        let mut row = vec![
            decibels(case.snr_db),
            typeset(&case.pulse),
            typeset(&case.against),
        ];
        for region in [&case.inside, &case.outside] {
            let verdict = lead(region);
            let word = match verdict {
                Verdict::Pass => "yes",
                Verdict::Fail => "no",
                Verdict::Open => "open",
            };
            row.push(format!(
                "<span class=\"value\">{}</span> {}",
                typeset(&interval_percent(region)),
                badge(verdict.name(), word)
            ));
        }
        row.push(link(figure.id));
        rows.push(row);
    }
    let header = [
        "SNR",
        "Pulse",
        "Against",
        "Inside the vortices",
        "Outside",
        "Figure",
    ];
    Ok(format!(
        "<h2>Does correlogram accumulation win?</h2>\n<p>{}</p>\n{}<p class=\"soft\">{}</p>\n",
        scope(cases.iter().map(|(_, case)| *case)),
        table("comparison", &header, &rows)?,
        typeset(COMPARED)
    ))
}

/// In how many cases of each signal-to-noise ratio correlogram accumulation has the smaller error inside.
fn scope<'c>(cases: impl Iterator<Item = &'c Comparison>) -> String {
    let mut counts: Vec<(String, u32, u32)> = Vec::new();
    for case in cases {
        let snr = decibels(case.snr_db);
        if counts.last().is_none_or(|(last, ..)| *last != snr) {
            counts.push((snr, 0, 0));
        }
        if let Some((_, leads, all)) = counts.last_mut() {
            *leads += u32::from(lead(&case.inside) == Verdict::Pass);
            *all += 1;
        }
    }
    let mut parts = Vec::new();
    for (snr, leads, all) in counts {
        parts.push(format!("at {snr} in {leads} of {all} cases"));
    }
    format!(
        "Inside the vortices it has the smaller error {}.",
        parts.join(", ")
    )
}

/// A ratio in decibels, in print.
fn decibels(ratio_db: f64) -> String {
    typeset(&format!("{ratio_db:.1} dB"))
}

/// A fraction in percent with its 95 % interval.
fn interval_percent(fraction: &Estimate) -> String {
    let percent = fraction.times(100.0);
    let half = percent.half_width();
    format!(
        "{:+.0} % ({:+.0} to {:+.0})",
        percent.value,
        percent.value - half,
        percent.value + half
    )
}

/// The word for a verdict on a statement of the chapter.
fn outcome(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Pass => "reproduced",
        Verdict::Fail => "not reproduced",
        Verdict::Open => "open",
    }
}

/// What the numbers of the statements are.
const STATEMENTS: &str = "± is one standard error; verdicts use 95 % intervals, some two standard errors to either side. The \
    physical signal-to-noise ratio follows from Table 2; that of the chapter is a factor of 2π (8 dB) higher, because it \
    computes the energy of a photon with ħ in place of h. Statements are judged at the chapter's ratio.";

/// The statements of the chapter, one a row.
fn statements(claims: &[&Claim]) -> Result<String, Failure> {
    let mut rows = Vec::new();
    for claim in claims {
        let Some(quote) = claim.quote() else {
            continue;
        };
        let statement = format!(
            "<q id=\"{}\">{}</q>\n{}",
            escape(&claim.id),
            typeset(quote),
            folded("How it is judged", &details(claim), false)
        );
        rows.push(vec![
            statement,
            badge(claim.verdict.name(), outcome(claim.verdict)) + &small(claim.reservation()),
            typeset(&claim.value()) + &remark(claim),
            link(&claim.figure),
        ]);
    }
    if rows.is_empty() {
        return Ok(String::new());
    }
    let header = ["The chapter", "Verdict", "This run", "Figure"];
    Ok(format!(
        "<h2>What the chapter says</h2>\n<p class=\"soft\">{STATEMENTS}</p>\n{}",
        table("statements", &header, &rows)?
    ))
}

/// A remark in small letters, if there is one.
fn small(text: &str) -> String {
    if text.is_empty() {
        return String::new();
    }
    format!("<small>{}</small>", typeset(text))
}

/// How many conditions of a statement that is not reproduced hold, and what decides an open one.
fn remark(claim: &Claim) -> String {
    match claim.verdict {
        Verdict::Pass => String::new(),
        Verdict::Fail => small(&claim.tally),
        Verdict::Open => {
            let decides = format!(
                "The 95 % interval includes the limit; {} would decide.",
                claim.decided_by
            );
            small(&claim.tally) + &small(&decides)
        }
    }
}

/// A link to a figure by its id.
fn link(id: &str) -> String {
    let number = id.trim_start_matches("fig").trim_start_matches("tab");
    let kind = if id.starts_with("tab") {
        "Table"
    } else {
        "Figure"
    };
    let id = escape(id);
    format!(
        "<a href=\"#{id}\">{kind} {}</a>",
        escape(number.trim_start_matches('0'))
    )
}

/// How a claim is judged, what is expected, everything that was measured, and what would decide it.
fn details(claim: &Claim) -> String {
    let mut items = Vec::new();
    if claim.kind() == Kind::Chapter {
        items.push(("Judged", vec![claim.statement.clone()]));
        items.push(("At", vec![claim.case().to_owned()]));
    }
    items.push(("Expected", vec![claim.expected.clone()]));
    items.push(("Measured", listed(&claim.measured)));
    if !claim.beside.is_empty() {
        items.push(("Also", listed(&claim.beside)));
    }
    if !claim.decided_by.is_empty() {
        items.push(("Decided by", vec![claim.decided_by.clone()]));
    }
    let mut list = format!("<dl>\n<dt>Number</dt><dd>{}</dd>\n", escape(&claim.id));
    for (name, texts) in items {
        list += &format!("<dt>{name}</dt>");
        for text in texts {
            list += &format!("<dd>{}</dd>", typeset(&text));
        }
        list += "\n";
    }
    list + "</dl>\n"
}

/// The parts of a text.
fn listed(text: &str) -> Vec<String> {
    text.split("; ").map(String::from).collect()
}

/// The program's own checks, unfolded where one fails.
fn checks(claims: &[&Claim]) -> Result<String, Failure> {
    let mut rows = Vec::new();
    let mut fails = false;
    for claim in claims {
        if claim.kind() == Kind::Chapter {
            continue;
        }
        fails |= claim.verdict == Verdict::Fail;
        let statement = format!(
            "{}\n{}",
            typeset(&claim.statement),
            folded("Details", &details(claim), false)
        );
        rows.push(vec![
            statement,
            badge(claim.verdict.name(), claim.verdict.name()),
            typeset(&claim.value()),
            link(&claim.figure),
        ]);
    }
    let count = Count::new(claims.iter().copied(), Kind::Own);
    let identities = rows.len() - count.all();
    let header = ["Check", "Verdict", "This run", "Figure"];
    Ok(folded(
        &format!("{count}; {identities} more of arithmetic, copies and geometry"),
        &table("statements", &header, &rows)?,
        fails,
    ))
}

fn timings(done: &Done<'_>) -> Result<String, Failure> {
    let mut rows = Vec::new();
    let mut all_s = 0.0;
    for (figure, rendered) in done {
        let [wall_s, core_s] = rendered.took_s;
        all_s += core_s;
        rows.push(vec![
            link(figure.id),
            typeset(figure.title),
            format!("{wall_s:.1}"),
            format!("{core_s:.1}"),
        ]);
    }
    let header = [
        "Figure",
        "Title",
        "Wall-clock time [s]",
        "Processor time [s]",
    ];
    let summary = format!("{} of processor time in all", duration(all_s));
    Ok(folded(&summary, &table("timings", &header, &rows)?, false))
}

/// Program, seed, profile and machine, and the command that makes the report again.
fn origin(context: &Context) -> String {
    let profile = context.profile.name();
    let seed = context.seed;
    let command = format!("cargo xtask reproduce-figs --profile {profile} --seed {seed}");
    let items = [
        ("Version", wakescope_sim::PROGRAM.into()),
        ("Seed", seed.to_string()),
        ("Profile", profile.into()),
        ("Machine", machine()),
        ("Command", command),
    ];
    let mut list = String::new();
    for (name, value) in items {
        list += &format!("<dt>{name}</dt><dd>{}</dd>\n", escape(&value));
    }
    list
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
            quick_core_s: 0.0,
            row: (0, 1),
            make,
        };
        let drawn = figure("fig01");
        let listed = figure("tab01");
        let claim = |id: &str| Claim {
            statement: WILD.into(),
            expected: WILD.into(),
            figure: WILD.into(),
            ..Claim::exact(id, WILD.into(), false).open(WILD)
        };
        let difference = Estimate::mean(&[0.0, 0.1]);
        let comparison = Comparison {
            snr_db: 0.0,
            pulse: WILD.into(),
            against: WILD.into(),
            inside: difference,
            outside: difference,
        };
        let rendered = |extension: &str, bytes: &str| Rendered {
            files: vec![(extension.into(), bytes.as_bytes().to_vec())],
            caption: WILD.into(),
            values: Vec::new(),
            marks: vec![WILD.into()],
            comparison: vec![comparison.clone()],
            claims: vec![claim(WILD), claim("F13")],
            took_s: [1.0, 2.0],
        };
        let picture = "<svg viewBox=\"0 0 2 1\"></svg>\n";
        let rows = format!("# head\n{WILD}\n{WILD}\n");
        let mut done = vec![
            (&drawn, rendered("svg", picture)),
            (&listed, rendered("csv", &rows)),
        ];
        change(&mut done);
        let stages = ".".into();
        let anew = false;
        let wake = None;
        let analytic = false;
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
        // Of each figure: title of the thumbnail, heading, caption, mark, title of the run time; label of the picture.
        let of_figures = 2 * 5 + 1;
        // Of both claims statement, expected, measured, decided by, value and link, which has the figure twice; the number
        // of the one that is not of the chapter, and what decides the other one once more.
        let of_claims = 2 * (2 * 7 + 2);
        let of_comparison = 2 * 2;
        // Of the table a name, which phones show beside the cell, and a cell; both in the thumbnail.
        let of_table = 3 + 2;
        assert_eq!(
            page.matches("&lt;script&gt;").count(),
            of_figures + of_claims + of_comparison + of_table
        );
        assert!(page.contains("<span class=\"badge open\">open</span>"));
        // Thumbnails stand before the figures that they lead to.
        assert!(page.find("href=\"#fig01\"").unwrap() < page.find("<figure").unwrap());
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
