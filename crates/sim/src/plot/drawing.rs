//! A picture as a list of shapes in drawing units (pixels at scale 1, y downward), which both file formats draw.
//! Check: text with raised and lowered parts is split in the tests; the formats' tests do the rest.

use super::colour::Rgb;
use tiny_skia::Pixmap;

pub(crate) const INK: Rgb = [38, 38, 38];

/// Axis-aligned box: left, top, width, height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Frame {
    pub(crate) left: f64,
    pub(crate) top: f64,
    pub(crate) width: f64,
    pub(crate) height: f64,
}

impl Frame {
    pub(crate) fn right(&self) -> f64 {
        self.left + self.width
    }

    pub(crate) fn bottom(&self) -> f64 {
        self.top + self.height
    }

    /// A line from the top to the bottom.
    pub(crate) fn vertical(&self, x: f64) -> [(f64, f64); 2] {
        [(x, self.top), (x, self.bottom())]
    }

    /// A line from the left to the right.
    pub(crate) fn horizontal(&self, y: f64) -> [(f64, f64); 2] {
        [(self.left, y), (self.right(), y)]
    }

    /// Once round and along the first side again, so that a line along it has its joint at every corner.
    pub(crate) fn outline(&self) -> Vec<(f64, f64)> {
        let l = self.left;
        let t = self.top;
        let r = self.right();
        let b = self.bottom();
        vec![(l, t), (r, t), (r, b), (l, b), (l, t), (r, t)]
    }
}

/// Where in a text its point is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

/// A line of text; `^{...}` raises and `_{...}` lowers a part of it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Text {
    /// Anchor point on the base line.
    pub(crate) at: (f64, f64),
    pub(crate) text: String,
    pub(crate) size: f64,
    pub(crate) anchor: Anchor,
    /// Turned to read upward.
    pub(crate) upward: bool,
    pub(crate) bold: bool,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Shape {
    Line {
        points: Vec<(f64, f64)>,
        colour: Rgb,
        width: f64,
        /// On and off lengths in drawing units; empty = solid.
        dash: &'static [f64],
    },
    Area {
        points: Vec<(f64, f64)>,
        fill: Rgb,
        opacity: f64,
    },
    Text(Text),
    Image {
        frame: Frame,
        pixels: Pixmap,
    },
    /// Shapes of which only the part inside the frame is visible.
    Clip {
        frame: Frame,
        shapes: Vec<Shape>,
    },
}

impl Shape {
    /// A solid line.
    pub(crate) fn line(points: impl Into<Vec<(f64, f64)>>, colour: Rgb, width: f64) -> Self {
        Self::Line {
            points: points.into(),
            colour,
            width,
            dash: &[],
        }
    }

    /// An area that hides what lies behind.
    pub(crate) fn area(points: impl Into<Vec<(f64, f64)>>, fill: Rgb) -> Self {
        Self::Area {
            points: points.into(),
            fill,
            opacity: 1.0,
        }
    }

    pub(crate) fn text(at: (f64, f64), text: &str, size: f64, anchor: Anchor) -> Self {
        Self::Text(Text {
            at,
            text: text.into(),
            size,
            anchor,
            upward: false,
            bold: false,
        })
    }
}

/// The whole picture.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Drawing {
    pub(crate) width: f64,
    pub(crate) height: f64,
    pub(crate) shapes: Vec<Shape>,
}

/// Parts of a text, each with the height of its base line above that of the text, in sizes of the text: `^{...}` and `_{...}` are
/// raised and lowered; a brace that is never closed is plain text.
pub(crate) fn runs(text: &str) -> Vec<(&str, f64)> {
    let mut out = Vec::new();
    let mut rest = text;
    while let Some((start, end)) = marked(rest) {
        let rise = if rest[start..].starts_with('^') {
            0.36
        } else {
            -0.18
        };
        out.push((&rest[..start], 0.0));
        out.push((&rest[start + 2..end], rise));
        rest = &rest[end + 1..];
    }
    out.push((rest, 0.0));
    out.retain(|(part, _)| !part.is_empty());
    out
}

/// Size of the letters of a part with that height, in sizes of the text.
pub(crate) fn letter_size(rise: f64) -> f64 {
    if rise == 0.0 { 1.0 } else { 0.72 }
}

/// Where the first marked part of a text begins, and where its closing brace is.
fn marked(text: &str) -> Option<(usize, usize)> {
    let starts = ["^{", "_{"].map(|mark| text.find(mark));
    let start = starts.into_iter().flatten().min()?;
    Some((start, start + text[start..].find('}')?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn raised_and_lowered_parts_are_split() {
        assert_eq!(
            runs("Γ_{5-15} [m^{2}/s] v_mean"),
            [
                ("Γ", 0.0),
                ("5-15", -0.18),
                (" [m", 0.0),
                ("2", 0.36),
                ("/s] v_mean", 0.0)
            ]
        );
        assert_eq!(runs("a^{b"), [("a^{b", 0.0)]);
        assert!(runs("").is_empty());
    }
}
