//! A drawing as SVG text: letters stay text, a map is an embedded picture, the provenance is in `<metadata>`.
//! There are no ids, so that one page can hold several pictures.
//! Check: the tests count elements and look for the escapes.

use super::colour::Rgb;
use super::drawing::{Anchor, Drawing, Frame, Shape, Text, letter_size, runs};
use super::png_file::encode;
use crate::Error;
use crate::io::Provenance;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

/// The compiled-in font of the PNG files first, then what systems have.
const FAMILY: &str = "Ubuntu, 'Segoe UI', 'Helvetica Neue', Arial, sans-serif";

/// The whole file.
pub(crate) fn svg_text(drawing: &Drawing, provenance: &Provenance) -> Result<String, Error> {
    let w = number(drawing.width);
    let h = number(drawing.height);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {w} {h}\" font-family=\"{FAMILY}\">\n<metadata>\n"
    );
    for (key, text) in provenance.entries() {
        out += &format!("{key}: {}\n", escape(&text));
    }
    out += &format!("</metadata>\n<rect width=\"{w}\" height=\"{h}\" fill=\"#ffffff\"/>\n");
    for shape in &drawing.shapes {
        out += &element(shape)?;
    }
    Ok(out + "</svg>\n")
}

/// Text that may stand between tags and in attributes.
pub fn escape(text: &str) -> String {
    // XML has no place for other control characters.
    let plain = text.replace(|c: char| c.is_control() && !matches!(c, '\n' | '\t'), " ");
    let signs = [
        ('&', "&amp;"),
        ('<', "&lt;"),
        ('>', "&gt;"),
        ('"', "&quot;"),
        ('\'', "&#39;"),
    ];
    signs
        .into_iter()
        .fold(plain, |text, (sign, name)| text.replace(sign, name))
}

fn element(shape: &Shape) -> Result<String, Error> {
    Ok(match shape {
        Shape::Line {
            points,
            colour,
            width,
            dash,
        } => {
            let points = pairs(points);
            let colour = hex(*colour);
            let width = number(*width);
            let mut dash = dash
                .iter()
                .map(|d| number(*d))
                .collect::<Vec<_>>()
                .join(" ");
            if !dash.is_empty() {
                dash = format!(" stroke-dasharray=\"{dash}\"");
            }
            format!(
                "<polyline points=\"{points}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\" stroke-linejoin=\"round\"{dash}/>\n"
            )
        }
        Shape::Area {
            points,
            fill,
            opacity,
        } => {
            let points = pairs(points);
            let colour = hex(*fill);
            let opacity = number(*opacity);
            format!("<polygon points=\"{points}\" fill=\"{colour}\" fill-opacity=\"{opacity}\"/>\n")
        }
        Shape::Text(text) => text_element(text),
        Shape::Image { frame, pixels } => {
            let place = place(frame);
            let data = STANDARD.encode(encode([Ok(pixels.clone())], 0.0, None)?);
            format!(
                "<image {place} preserveAspectRatio=\"none\" href=\"data:image/png;base64,{data}\"/>\n"
            )
        }
        Shape::Clip { frame, shapes } => {
            // A nested svg element clips to its own box, without an id.
            let corner = [frame.left, frame.top, frame.width, frame.height]
                .map(number)
                .join(" ");
            let inner = shapes
                .iter()
                .map(element)
                .collect::<Result<String, Error>>()?;
            format!(
                "<svg {} viewBox=\"{corner}\" overflow=\"hidden\">\n{inner}</svg>\n",
                place(frame)
            )
        }
    })
}

fn text_element(text: &Text) -> String {
    let x = number(text.at.0);
    let y = number(text.at.1);
    let size = number(text.size);
    let colour = hex(super::drawing::INK);
    let anchor = match text.anchor {
        Anchor::Start => "start",
        Anchor::Middle => "middle",
        Anchor::End => "end",
    };
    let turn = if text.upward { " rotate(-90)" } else { "" };
    let weight = if text.bold {
        " font-weight=\"bold\""
    } else {
        ""
    };
    let mut out = format!(
        "<text transform=\"translate({x} {y}){turn}\" font-size=\"{size}\" text-anchor=\"{anchor}\" fill=\"{colour}\"{weight}>"
    );
    let mut height = 0.0;
    for (part, rise) in runs(&text.text) {
        let shift = number(text.size * (height - rise));
        let size = number(text.size * letter_size(rise));
        height = rise;
        out += &match rise == 0.0 && shift == "0" {
            true => escape(part),
            false => format!(
                "<tspan dy=\"{shift}\" font-size=\"{size}\">{}</tspan>",
                escape(part)
            ),
        };
    }
    out + "</text>\n"
}

fn place(frame: &Frame) -> String {
    let [x, y, w, h] = [frame.left, frame.top, frame.width, frame.height].map(number);
    format!("x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\"")
}

fn pairs(points: &[(f64, f64)]) -> String {
    points
        .iter()
        .map(|p| format!("{},{}", number(p.0), number(p.1)))
        .collect::<Vec<_>>()
        .join(" ")
}

/// At most two decimals: a hundredth of a pixel.
fn number(value: f64) -> String {
    let text = format!("{value:.2}");
    let short = text.trim_end_matches('0').trim_end_matches('.');
    if short == "-0" {
        "0".into()
    } else {
        short.into()
    }
}

fn hex([r, g, b]: Rgb) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::provenance::example;

    #[test]
    fn text_and_metadata_are_escaped() {
        let label = Shape::text((10.0, 10.0), "a<b & \"c\"^{2}", 16.0, Anchor::Start);
        let drawing = Drawing {
            width: 100.0,
            height: 50.0,
            shapes: vec![label],
        };
        let svg = svg_text(&drawing, &example()).unwrap();
        assert!(
            svg.contains(
                "a&lt;b &amp; &quot;c&quot;<tspan dy=\"-5.76\" font-size=\"11.52\">2</tspan>"
            ),
            "{svg}"
        );
        assert!(
            svg.contains("name = &quot;&lt;a &amp; b&gt;&quot;"),
            "{svg}"
        );
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
