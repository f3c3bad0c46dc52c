//! The report of a run as one HTML page that opens from disk: pictures inside, no script, nothing fetched.
//! Check: every text is escaped, the page names nothing outside itself, verdicts are marked by colour and by word.

use fixtures::failure::Failure;
use wakescope_sim::plot::escape;

/// A table of the page; on a narrow screen each row becomes a block of named cells.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct HtmlTable {
    /// Column names.
    pub(super) header: Vec<String>,
    /// Cells, row by row, as many as columns. The words `pass`, `fail` and `open` are coloured.
    pub(super) rows: Vec<Vec<String>>,
}

/// A statement that does not hold, or is not decided, for the beginning of the page.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Finding {
    /// Short name, such as `F9b`.
    pub(super) name: String,
    /// The entry that shows it.
    pub(super) entry: String,
    /// What is stated.
    pub(super) statement: String,
    /// Why it does not hold: what was expected and what was found.
    pub(super) reason: String,
}

/// A figure or table of the report.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct ReportEntry {
    /// Short name and link target, such as `fig04`.
    pub(super) id: String,
    /// What it is called.
    pub(super) title: String,
    /// What is shown and how it was made.
    pub(super) caption: String,
    /// The picture as SVG text; the scene's metadata may be in it.
    pub(super) svg: Option<String>,
    /// A table, for entries that are one.
    pub(super) table: Option<HtmlTable>,
    /// Short notes shown as labels beside the name, such as `analytic pair`.
    pub(super) marks: Vec<String>,
}

/// The whole page.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Report {
    /// Title of the page.
    pub(super) title: String,
    /// What was found, in a sentence or two.
    pub(super) found: String,
    /// Headings and what stands below them: what fails, what is not decided. Empty lists are left out.
    pub(super) findings: Vec<(String, Vec<Finding>)>,
    /// Name and value of what holds for the whole run: version, seed, machine, profile, command.
    pub(super) facts: Vec<(String, String)>,
    /// Figures and tables in order.
    pub(super) entries: Vec<ReportEntry>,
    /// Claims and their verdicts.
    pub(super) claims: HtmlTable,
    /// Run time of each stage.
    pub(super) timings: HtmlTable,
}

const STYLE: &str = "\
:root{color-scheme:light}
body{font:16px/1.5 system-ui,'Segoe UI','Helvetica Neue',Arial,sans-serif;color:#222;background:#fff;max-width:1040px;margin:0 auto;padding:24px 20px 80px}
h1{font-size:28px;line-height:1.25;margin:8px 0 4px}h2{font-size:21px;margin:44px 0 10px;border-bottom:1px solid #ddd;padding-bottom:4px}
h3{font-size:17px;margin:0 0 6px}.found{font-size:18px;margin:14px 0}
.finding{margin:10px 0;padding:8px 14px;border-left:4px solid #b8ab73;background:#faf8f0}.finding.first{border-color:#b03a00;background:#fdf3ee}
.finding p{margin:2px 0}.reason{color:#444;font-size:14.5px;overflow-wrap:anywhere}
nav ul{columns:2;font-size:14.5px;padding-left:22px;margin:14px 0}a{color:#0063a6}
dl{display:grid;grid-template-columns:max-content 1fr;gap:2px 18px;font-size:14px;margin:14px 0}dt{color:#666}dd{margin:0;overflow-wrap:anywhere}
figure{margin:26px 0;padding:16px;border:1px solid #e3e3e3;border-radius:6px;background:#fff}
figure svg{display:block;width:100%;height:auto}figcaption{font-size:14.5px;color:#333;margin-top:10px;white-space:pre-line;overflow-wrap:anywhere}
.mark{display:inline-block;font-size:12px;font-weight:normal;background:#eef3f8;border:1px solid #cbd9e6;border-radius:10px;padding:1px 9px;margin-left:8px;vertical-align:2px}
.scroll{overflow-x:auto}table{border-collapse:collapse;font-size:14px;width:100%}
th,td{border-bottom:1px solid #e6e6e6;padding:5px 10px;text-align:left;vertical-align:top;overflow-wrap:anywhere}th{background:#f6f6f6;font-weight:600}
td.pass{color:#00643f;font-weight:600}td.fail{color:#b03a00;font-weight:600}td.open{color:#6b5a00;font-weight:600}
@media (max-width:700px){body{padding:12px 12px 60px}h1{font-size:23px}nav ul{columns:1}dl{grid-template-columns:1fr}dt{margin-top:6px}
figure{padding:8px;margin:18px 0}thead{display:none}tr{display:block;border-bottom:2px solid #ccc;padding:6px 0}
td{display:flex;gap:10px;border:0;padding:2px 4px}td::before{content:attr(data-label);flex:0 0 7.5em;color:#666;font-weight:normal}}
@media print{body{max-width:none;padding:0;font-size:10.5pt}nav{display:none}a{color:inherit;text-decoration:none}
figure,.finding,tr{break-inside:avoid}h2,h3{break-after:avoid}figure{border:0;padding:0}figure svg{max-height:22cm}thead{display:table-header-group}table{font-size:8.5pt}}
";

impl Report {
    /// The page.
    ///
    /// # Errors
    /// A row with another number of cells than its header, a picture that is not an `<svg>` element, two entries of one id.
    pub(super) fn to_html(&self) -> Result<String, Failure> {
        let title = escape(&self.title);
        let mut out = format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width\">\n<title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n"
        );
        out += &format!("<p class=\"found\">{}</p>\n", escape(&self.found));
        for (place, (heading, list)) in self.findings.iter().filter(|(_, list)| !list.is_empty()).enumerate() {
            let class = if place == 0 { "finding first" } else { "finding" };
            out += &format!("<h2>{}</h2>\n", escape(heading));
            for finding in list {
                let Finding { name, entry, statement, reason } = finding;
                out += &format!(
                    "<div class=\"{class}\"><p><a href=\"#{}\">{}</a> {}</p><p class=\"reason\">{}</p></div>\n",
                    escape(entry),
                    escape(name),
                    escape(statement),
                    escape(reason)
                );
            }
        }
        out += "<h2>Figures and tables</h2>\n<nav><ul>\n";
        for entry in &self.entries {
            out += &format!("<li><a href=\"#{}\">{}</a></li>\n", escape(&entry.id), escape(&entry.title));
        }
        out +=
            "<li><a href=\"#claims\">All claims</a></li>\n<li><a href=\"#timings\">Run times</a></li>\n</ul></nav>\n";
        for (i, entry) in self.entries.iter().enumerate() {
            if self.entries[..i].iter().any(|e| e.id == entry.id) {
                return Err(Failure::new(format!("two entries of the report are called '{}'", entry.id)));
            }
            push_entry(entry, &mut out)?;
        }
        out += "<h2 id=\"claims\">All claims</h2>\n";
        push_table("claims", &self.claims, &mut out)?;
        out += "<h2 id=\"timings\">Run times</h2>\n";
        push_table("timings", &self.timings, &mut out)?;
        out += "<h2>How it was made</h2>\n<dl>\n";
        for (name, value) in &self.facts {
            out += &format!("<dt>{}</dt><dd>{}</dd>\n", escape(name), escape(value));
        }
        out += "</dl>\n";
        out += "</body>\n</html>\n";
        Ok(out)
    }
}

fn push_entry(entry: &ReportEntry, out: &mut String) -> Result<(), Failure> {
    let id = escape(&entry.id);
    *out += &format!("<figure id=\"{id}\">\n<h3>{}", escape(&entry.title));
    for mark in &entry.marks {
        *out += &format!("<span class=\"mark\">{}</span>", escape(mark));
    }
    *out += "</h3>\n";
    if let Some(svg) = &entry.svg {
        if !svg.starts_with("<svg") || svg.contains("<script") {
            let start: String = svg.chars().take(20).collect();
            return Err(Failure::new(format!("picture of {id} = {start}: one <svg> element without script")));
        }
        *out += svg;
    }
    if let Some(table) = &entry.table {
        push_table(&entry.id, table, out)?;
    }
    *out += &format!("<figcaption>{}</figcaption>\n</figure>\n", escape(&entry.caption));
    Ok(())
}

fn push_table(name: &str, table: &HtmlTable, out: &mut String) -> Result<(), Failure> {
    *out += "<div class=\"scroll\"><table>\n<thead><tr>";
    for column in &table.header {
        *out += &format!("<th>{}</th>", escape(column));
    }
    *out += "</tr></thead>\n<tbody>\n";
    for row in &table.rows {
        if row.len() != table.header.len() {
            return Err(Failure::new(format!("table {name}: {} cells under {} names", row.len(), table.header.len())));
        }
        *out += "<tr>";
        for (cell, column) in row.iter().zip(&table.header) {
            let class = match cell.as_str() {
                "pass" | "fail" | "open" => format!(" class=\"{cell}\""),
                _ => String::new(),
            };
            *out += &format!("<td{class} data-label=\"{}\">{}</td>", escape(column), escape(cell));
        }
        *out += "</tr>\n";
    }
    *out += "</tbody></table></div>\n";
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const WILD: &str = "<script>alert('x & \"y\"')</script>";

    fn report() -> Report {
        let row = |cell: &str| HtmlTable { header: vec![WILD.into()], rows: vec![vec![cell.into()]] };
        Report {
            title: WILD.into(),
            found: WILD.into(),
            findings: vec![
                ("fails".into(), vec![Finding { name: WILD.into(), statement: WILD.into(), ..Finding::default() }]),
                ("nothing".into(), Vec::new()),
            ],
            facts: vec![(WILD.into(), WILD.into())],
            entries: vec![ReportEntry {
                id: "fig01".into(),
                title: WILD.into(),
                caption: WILD.into(),
                svg: Some("<svg xmlns=\"http://www.w3.org/2000/svg\"></svg>\n".into()),
                table: Some(row(WILD)),
                marks: vec![WILD.into()],
            }],
            claims: row("open"),
            timings: row(WILD),
        }
    }

    #[test]
    fn every_text_is_escaped_and_nothing_is_fetched() {
        let page = report().to_html().unwrap();
        assert!(!page.contains("<script"), "{page}");
        assert_eq!(page.matches("&lt;script&gt;").count(), 19);
        assert!(page.contains("<td class=\"open\" data-label="));
        // What does not hold stands before the figures, and an empty list has no heading.
        assert!(
            page.find("class=\"finding first\"").unwrap() < page.find("<figure").unwrap() && !page.contains("nothing")
        );
        for outside in ["src=", "url(", "@import", "<link", "href=\"http"] {
            assert!(!page.contains(outside), "{outside}");
        }
        assert_eq!(page.matches("<figure").count(), page.matches("</figure>").count());
    }

    #[test]
    fn broken_reports_are_refused() {
        let mut uneven = report();
        uneven.claims.rows.push(vec![]);
        assert!(uneven.to_html().is_err());
        let mut twice = report();
        twice.entries.push(twice.entries[0].clone());
        assert!(twice.to_html().unwrap_err().to_string().contains("two entries"));
        let mut foreign = report();
        foreign.entries[0].svg = Some("<script>".into());
        assert!(foreign.to_html().unwrap_err().to_string().contains("without script"));
    }
}
