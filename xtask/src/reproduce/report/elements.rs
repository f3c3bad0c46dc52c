//! Elements of the page: signs as in print, badges, tables, pictures and their thumbnails.

use fixtures::failure::Failure;
use wakescope_sim::plot::escape;

/// What stands in sources, and how it is printed.
const SIGNS: [(&str, &str); 9] = [
    ("$\\tau \\approx 2.8$", "τ ≈ 2.8"),
    ("C_n^2 .", "C<sub>n</sub>²."),
    ("C_n²", "C<sub>n</sub>²"),
    ("m^(-2/3)", "m<sup>−2/3</sup>"),
    ("r_c", "r<sub>c</sub>"),
    ("m^3", "m³"),
    ("tau", "τ"),
    (" -", " −"),
    ("(-", "(−"),
];

/// A text with the signs of print in place of those of sources.
pub(super) fn typeset(text: &str) -> String {
    let mut printed = escape(text);
    for (source, sign) in SIGNS {
        printed = printed.replace(source, sign);
    }
    match printed.strip_prefix('-') {
        Some(positive) => format!("−{positive}"),
        None => printed,
    }
}

/// A word on the colour of its class.
pub(super) fn badge(class: &str, word: &str) -> String {
    format!("<span class=\"badge {class}\">{}</span>", escape(word))
}

/// What can be unfolded below a summary.
pub(super) fn folded(summary: &str, content: &str, is_open: bool) -> String {
    let open = if is_open { " open" } else { "" };
    format!("<details{open}>\n<summary>{summary}</summary>\n{content}</details>\n")
}

/// A table of cells that are HTML; on a narrow screen each row becomes a block of named cells.
///
/// # Errors
/// Fails if a row has another number of cells than the header.
pub(super) fn table(name: &str, header: &[&str], rows: &[Vec<String>]) -> Result<String, Failure> {
    let header: Vec<String> = header.iter().map(|column| typeset(column)).collect();
    let mut names = String::new();
    for column in &header {
        names += &format!("<th scope=\"col\">{column}</th>");
    }
    let mut body = String::new();
    for row in rows {
        if row.len() != header.len() {
            return Err(Failure::new(format!(
                "table {name}: {} cells under {} names",
                row.len(),
                header.len()
            )));
        }
        body += "<tr>";
        for (cell, column) in row.iter().zip(&header) {
            body += &format!("<td data-label=\"{column}\"><div>{cell}</div></td>");
        }
        body += "</tr>\n";
    }
    Ok(format!(
        "<table class=\"{name}\">\n<thead><tr>{names}</tr></thead>\n<tbody>\n{body}</tbody></table>\n"
    ))
}

/// Units of names, and in print.
const UNITS: [(&str, &str); 5] = [
    ("_m", " [m]"),
    ("_s", " [s]"),
    ("_j", " [J]"),
    ("_hz", " [Hz]"),
    ("_rad", " [rad]"),
];

/// A name with its unit as in print: `delay_s` is "delay \[s\]".
fn column_name(name: &str) -> String {
    for (suffix, unit) in UNITS {
        if let Some(quantity) = name.strip_suffix(suffix) {
            return quantity.replace('_', " ") + unit;
        }
    }
    name.replace('_', " ")
}

/// Names and rows of a table from its CSV, numbers rounded to five digits.
fn rows_of(csv: &str) -> (Vec<String>, Vec<Vec<String>>) {
    let mut lines = csv.lines().filter(|line| !line.starts_with('#'));
    let names = lines.next().unwrap_or("").split(',');
    let names = names.map(column_name).collect();
    let mut rows = Vec::new();
    for line in lines {
        rows.push(line.split(',').map(five_digits).collect());
    }
    (names, rows)
}

/// A number rounded to five digits, or a name.
fn five_digits(cell: &str) -> String {
    let Ok(number) = cell.parse::<f64>() else {
        return column_name(cell);
    };
    let Ok(rounded) = format!("{number:.4e}").parse::<f64>() else {
        return cell.to_owned();
    };
    if rounded.abs() < 1e-3 && rounded != 0.0 {
        power_of_ten(&format!("{rounded:e}"))
    } else {
        rounded.to_string()
    }
}

/// A number such as 1.5e-6 as a multiple of a power of ten.
fn power_of_ten(number: &str) -> String {
    const RAISED: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let Some((factor, exponent)) = number.split_once('e') else {
        return number.into();
    };
    let mut printed = format!("{factor} · 10");
    for digit in exponent.chars() {
        let raised = digit.to_digit(10).map(|digit| RAISED[digit as usize]);
        printed.push(raised.unwrap_or('⁻'));
    }
    printed
}

/// The rows of a CSV file as a table.
pub(super) fn table_of_csv(id: &str, csv: &str) -> Result<String, Failure> {
    let (names, rows) = rows_of(csv);
    let header: Vec<&str> = names.iter().map(String::as_str).collect();
    let mut cells = Vec::new();
    for row in rows {
        cells.push(row.iter().map(|cell| typeset(cell)).collect());
    }
    table(id, &header, &cells)
}

/// Width and height of a thumbnail.
const THUMBNAIL_SIZE: [f64; 2] = [320.0, 200.0];
/// Rows of a table that its thumbnail shows, and of each of its columns the start and the most letters.
const THUMBNAIL_ROWS: usize = 5;
const THUMBNAIL_COLUMNS: [(u32, usize); 2] = [(10, 23), (222, 11)];

/// The first cells of a CSV file as a small picture.
pub(super) fn thumbnail_of_csv(csv: &str) -> String {
    let (names, rows) = rows_of(csv);
    let mut text = String::new();
    let lines = std::iter::once(&names).chain(&rows).take(THUMBNAIL_ROWS);
    for (line, cells) in lines.enumerate() {
        for (cell, (x, letters)) in cells.iter().zip(THUMBNAIL_COLUMNS) {
            let shown: String = cell.chars().take(letters).collect();
            let y = 26 + 40 * line;
            text += &format!("<text x=\"{x}\" y=\"{y}\">{}</text>", escape(&shown));
        }
    }
    format!("<svg viewBox=\"0 0 320 200\" aria-hidden=\"true\" class=\"cells\">{text}</svg>")
}

/// The view box of an SVG file and what is drawn in it.
///
/// # Errors
/// Fails unless it is one `<svg>` element with a view box and without script.
fn view_box_and_content<'s>(id: &str, svg: &'s str) -> Result<(&'s str, &'s str), Failure> {
    let (head, content) = svg
        .strip_prefix("<svg ")
        .and_then(|rest| rest.trim_end().strip_suffix("</svg>"))
        .and_then(|rest| rest.split_once('>'))
        .unwrap_or_default();
    let view_box = head
        .split_once("viewBox=\"")
        .and_then(|(_, rest)| rest.split_once('"'))
        .map_or("", |(view_box, _)| view_box);
    if view_box.is_empty() || content.contains("<script") {
        let start: String = svg.chars().take(20).collect();
        return Err(Failure::new(format!(
            "picture of {id} = {start}: one <svg> element with a viewBox and without script"
        )));
    }
    Ok((view_box, content))
}

/// The drawing of an SVG file, which a thumbnail can show again, with a text in its place for those who cannot see it.
///
/// # Errors
/// As [`view_box_and_content`].
pub(super) fn drawing(id: &str, svg: &str, alternative: &str) -> Result<String, Failure> {
    let (view_box, content) = view_box_and_content(id, svg)?;
    Ok(format!(
        "<svg viewBox=\"{view_box}\" role=\"img\" aria-label=\"{}\" font-family=\"Ubuntu, 'Segoe UI', Arial, sans-serif\"><g id=\"picture-{id}\">{content}</g></svg>\n",
        escape(alternative)
    ))
}

/// A row of the panels of a drawing, of `rows`, once more and small; the link about it has the words.
///
/// # Errors
/// As [`view_box_and_content`].
pub(super) fn thumbnail_of_drawing(
    id: &str,
    svg: &str,
    (row, rows): (u32, u32),
) -> Result<String, Failure> {
    let (view_box, _) = view_box_and_content(id, svg)?;
    let size: Vec<f64> = view_box.split(' ').flat_map(str::parse).collect();
    let [left, top, width, all_height] = size[..] else {
        return Ok(String::new());
    };
    let height = all_height / f64::from(rows);
    let top = top + f64::from(row) * height;
    // As large as fits, and cut at its own border, beyond which the other rows are.
    let scale = (THUMBNAIL_SIZE[0] / width).min(THUMBNAIL_SIZE[1] / height);
    let [shown_width, shown_height] = [scale * width, scale * height];
    let x = 0.5 * (THUMBNAIL_SIZE[0] - shown_width);
    let y = 0.5 * (THUMBNAIL_SIZE[1] - shown_height);
    Ok(format!(
        "<svg viewBox=\"0 0 320 200\" aria-hidden=\"true\"><svg x=\"{x}\" y=\"{y}\" width=\"{shown_width}\" height=\"{shown_height}\" \
         viewBox=\"{left} {top} {width} {height}\"><use href=\"#picture-{id}\"/></svg></svg>"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signs_are_those_of_print() {
        assert_eq!(
            typeset("-CA - PA: (-0.12) m/s at tau = 2, C_n² = 10⁻¹³ m^(-2/3) < 1"),
            "−CA − PA: (−0.12) m/s at τ = 2, C<sub>n</sub>² = 10⁻¹³ m<sup>−2/3</sup> &lt; 1"
        );
        assert_eq!(
            ["delay_chapter_s", "range_m", "leader"].map(column_name),
            ["delay chapter [s]", "range [m]", "leader"]
        );
        assert_eq!(
            ["0.00000155", "400.0", "1234567"].map(five_digits),
            ["1.55 · 10⁻⁶", "400", "1234600"]
        );
    }

    #[test]
    fn a_picture_is_shown_twice_and_written_once() {
        let svg = "<svg width=\"2\" viewBox=\"0 0 2 1\"><rect/></svg>\n";
        let full = drawing("fig01", svg, "a <b>").unwrap();
        assert!(full.contains("<g id=\"picture-fig01\"><rect/></g>"));
        assert!(full.contains("aria-label=\"a &lt;b&gt;\""));
        let thumbnail = thumbnail_of_drawing("fig01", svg, (0, 1)).unwrap();
        assert!(thumbnail.contains("viewBox=\"0 0 2 1\"") && !thumbnail.contains("<rect"));
        let lower = thumbnail_of_drawing("fig01", svg, (1, 2)).unwrap();
        assert!(lower.contains("viewBox=\"0 0.5 2 0.5\""), "{lower}");
        assert!(drawing("fig01", "<svg><script></svg>", "").is_err());
    }

    #[test]
    fn uneven_tables_are_refused() {
        let error = table_of_csv("t", "a\na,b\n").unwrap_err().to_string();
        assert!(error.contains("2 cells under 1 names"), "{error}");
    }
}
