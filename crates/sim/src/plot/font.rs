//! The compiled-in font (Ubuntu Light): width of a text and outlines of its letters.
//! Check: widths add up, and a raised part is narrower than the same letters on the line.

use super::drawing::{letter_size, runs};
use crate::Error;
use tiny_skia::{Path, PathBuilder, Transform};
use ttf_parser::{Face, GlyphId, OutlineBuilder};

/// Letters of the font, in any size.
pub(crate) struct Font {
    face: Face<'static>,
}

impl Font {
    pub(crate) fn load() -> Result<Self, Error> {
        let face = Face::parse(epaint_default_fonts::UBUNTU_LIGHT, 0)
            .map_err(|e| Error::unsupported("font", e))?;
        Ok(Self { face })
    }

    /// Width of a text of that size in drawing units.
    pub(crate) fn width(&self, text: &str, size: f64) -> f64 {
        self.letters(text, size).map(|(_, width, ..)| width).sum()
    }

    /// Outlines of a text that begins at the origin.
    pub(crate) fn outline(&self, text: &str, size: f64) -> Option<Path> {
        let mut out = PathBuilder::new();
        let mut x = 0.0;
        for (glyph, width, scale, rise) in self.letters(text, size) {
            let mut pen = Pen(PathBuilder::new());
            self.face.outline_glyph(glyph, &mut pen);
            // The font's y is upward.
            let place = Transform::from_row(
                scale as f32,
                0.0,
                0.0,
                -scale as f32,
                x as f32,
                -rise as f32,
            );
            if let Some(path) = pen.0.finish().and_then(|path| path.transform(place)) {
                out.push_path(&path);
            }
            x += width;
        }
        out.finish()
    }

    /// Each letter: glyph, width, drawing units for one of the font, height of its base line.
    fn letters(&self, text: &str, size: f64) -> impl Iterator<Item = (GlyphId, f64, f64, f64)> {
        runs(text).into_iter().flat_map(move |(part, rise)| {
            let scale = size * letter_size(rise) / f64::from(self.face.units_per_em());
            part.chars().map(move |c| {
                // Glyph 0 is the font's sign for "no such letter".
                let glyph = self.face.glyph_index(c).unwrap_or(GlyphId(0));
                let advance = self.face.glyph_hor_advance(glyph).unwrap_or(0);
                (glyph, scale * f64::from(advance), scale, size * rise)
            })
        })
    }
}

struct Pen(PathBuilder);

impl OutlineBuilder for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        self.0.move_to(x, y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.0.line_to(x, y);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.0.quad_to(x1, y1, x, y);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.0.cubic_to(x1, y1, x2, y2, x, y);
    }

    fn close(&mut self) {
        self.0.close();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widths_add_up_and_raised_letters_are_narrower() {
        let font = Font::load().unwrap();
        let sum = font.width("abc", 10.0) + font.width("12", 10.0);
        approx::assert_relative_eq!(font.width("abc12", 10.0), sum, max_relative = 1e-12);
        approx::assert_relative_eq!(
            font.width("abc", 20.0),
            2.0 * font.width("abc", 10.0),
            max_relative = 1e-12
        );
        assert!(font.width("10^{12}", 10.0) < font.width("1012", 10.0));
    }

    #[test]
    fn letters_of_the_labels_are_in_the_font() {
        let font = Font::load().unwrap();
        for c in "τρσηλθφβΓ°·×−±≤≥µ²³".chars() {
            assert!(
                font.face
                    .glyph_index(c)
                    .is_some_and(|glyph| glyph != GlyphId(0)),
                "{c}"
            );
        }
    }
}
