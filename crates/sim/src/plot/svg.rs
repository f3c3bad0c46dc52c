//! A drawing as SVG text: letters stay text, a map is an embedded picture, the provenance is in `<metadata>`.
//! There are no ids, so that several pictures can stand in one page.
//! Check: the tests count elements and look for the escapes.

use super::drawing::{Anchor, Drawing, Frame, Pen, Raster, Shape, Text, runs};
use super::png_file::encode;
use crate::io::{OutputResult, Provenance};
use std::fmt::Write as _;

/// The compiled-in font of the PNG files first, then what systems have.
const FAMILY: &str = "Ubuntu, 'Segoe UI', 'Helvetica Neue', Arial, sans-serif";

/// The whole file.
pub(crate) fn svg_text(drawing: &Drawing, provenance: &Provenance) -> OutputResult<String> {
    let (w, h) = (number(drawing.width), number(drawing.height));
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {w} {h}\" font-family=\"{FAMILY}\">\n<metadata>\n"
    );
    for (key, text) in provenance.entries() {
        out += &format!("{key}: {}\n", escape(&text));
    }
    out += "</metadata>\n";
    out += &format!("<rect width=\"{w}\" height=\"{h}\" fill=\"#ffffff\"/>\n");
    for shape in &drawing.shapes {
        push_shape(shape, &mut out)?;
    }
    out += "</svg>\n";
    Ok(out)
}

/// Text that may stand between tags and in attributes.
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '&' => out += "&amp;",
            '"' => out += "&quot;",
            '\'' => out += "&#39;",
            // XML has no place for other control characters.
            c if c.is_control() && !matches!(c, '\n' | '\t') => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

fn push_shape(shape: &Shape, out: &mut String) -> OutputResult<()> {
    match shape {
        Shape::Line { points, pen } => {
            let _ = writeln!(out, "<polyline points=\"{}\" {}/>", pairs(points), stroke(pen));
        }
        Shape::Area { points, fill, opacity } => {
            let faint = if *opacity < 1.0 { format!(" fill-opacity=\"{}\"", number(*opacity)) } else { String::new() };
            let _ = writeln!(out, "<polygon points=\"{}\" fill=\"{}\"{faint}/>", pairs(points), hex(*fill));
        }
        Shape::Text(text) => push_text(text, out),
        Shape::Image { frame, raster } => push_image(frame, raster, out)?,
        Shape::Clip { frame, shapes } => {
            // A nested svg element clips to its own box, without an id.
            let (x, y, w, h) = (number(frame.left), number(frame.top), number(frame.width), number(frame.height));
            let _ = writeln!(
                out,
                "<svg x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\" viewBox=\"{x} {y} {w} {h}\" overflow=\"hidden\">"
            );
            for inner in shapes {
                push_shape(inner, out)?;
            }
            *out += "</svg>\n";
        }
    }
    Ok(())
}

fn push_text(text: &Text, out: &mut String) {
    let (x, y) = (number(text.at.0), number(text.at.1));
    let anchor = match text.anchor {
        Anchor::Start => "start",
        Anchor::Middle => "middle",
        Anchor::End => "end",
    };
    let place = if text.upward {
        format!("transform=\"translate({x} {y}) rotate(-90)\"")
    } else {
        format!("x=\"{x}\" y=\"{y}\"")
    };
    let weight = if text.bold { " font-weight=\"bold\"" } else { "" };
    let _ = write!(
        out,
        "<text {place} font-size=\"{}\" text-anchor=\"{anchor}\" fill=\"{}\"{weight}>",
        number(text.size),
        hex(text.colour)
    );
    let mut height = 0.0;
    for run in runs(&text.text) {
        let shift = text.size * (height - run.rise());
        height = run.rise();
        if run.level == 0 && shift == 0.0 {
            *out += &escape(run.text);
        } else {
            let size = number(text.size * run.scale());
            let _ = write!(out, "<tspan dy=\"{}\" font-size=\"{size}\">{}</tspan>", number(shift), escape(run.text));
        }
    }
    *out += "</text>\n";
}

fn push_image(frame: &Frame, raster: &Raster, out: &mut String) -> OutputResult<()> {
    let bytes = encode(raster, None)?;
    let _ = writeln!(
        out,
        "<image x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" preserveAspectRatio=\"none\" href=\"data:image/png;base64,{}\"/>",
        number(frame.left),
        number(frame.top),
        number(frame.width),
        number(frame.height),
        base64(&bytes)
    );
    Ok(())
}

fn stroke(pen: &Pen) -> String {
    let mut out = format!(
        "fill=\"none\" stroke=\"{}\" stroke-width=\"{}\" stroke-linejoin=\"round\"",
        hex(pen.colour),
        number(pen.width)
    );
    if !pen.dash.is_empty() {
        let lengths: Vec<String> = pen.dash.iter().map(|d| number(*d)).collect();
        out += &format!(" stroke-dasharray=\"{}\"", lengths.join(" "));
    }
    out
}

fn pairs(points: &[(f64, f64)]) -> String {
    let texts: Vec<String> = points.iter().map(|p| format!("{},{}", number(p.0), number(p.1))).collect();
    texts.join(" ")
}

/// At most two decimals: a hundredth of a pixel.
fn number(value: f64) -> String {
    let text = format!("{value:.2}");
    let short = text.trim_end_matches('0').trim_end_matches('.');
    if short == "-0" { "0".into() } else { short.into() }
}

fn hex(c: [u8; 3]) -> String {
    format!("#{:02x}{:02x}{:02x}", c[0], c[1], c[2])
}

/// Base64 (RFC 4648) with padding.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let word = (0..3).fold(0_u32, |w, i| w << 8 | u32::from(*group.get(i).unwrap_or(&0)));
        for i in 0..4 {
            let digit = DIGITS[(word >> (18 - 6 * i)) as usize & 63];
            out.push(if i <= group.len() { char::from(digit) } else { '=' });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::provenance::example;

    #[test]
    fn base64_matches_the_vectors_of_rfc_4648() {
        let vectors =
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foob", "Zm9vYg=="), ("foobar", "Zm9vYmFy")];
        for (plain, coded) in vectors {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
    }

    #[test]
    fn text_and_metadata_are_escaped() {
        let label = Text {
            at: (10.0, 10.0),
            text: "a<b & \"c\"^{2}".into(),
            size: 16.0,
            anchor: Anchor::Start,
            upward: false,
            colour: [0, 0, 0],
            bold: false,
        };
        let drawing = Drawing { width: 100.0, height: 50.0, shapes: vec![Shape::Text(label)] };
        let svg = svg_text(&drawing, &example()).unwrap();
        assert!(svg.contains("a&lt;b &amp; &quot;c&quot;<tspan dy=\"-5.76\" font-size=\"11.52\">2</tspan>"), "{svg}");
        assert!(svg.contains("name = &quot;&lt;a &amp; b&gt;&quot;"), "{svg}");
        assert!(svg.contains("seed: 18446744073709551615"));
        assert_eq!(escape("a\u{0}b\u{1b}"), "a b ");
    }

    #[test]
    fn numbers_are_short() {
        assert_eq!(number(1.0), "1");
        assert_eq!(number(-0.001), "0");
        assert_eq!(number(2.345), "2.35");
    }
}
