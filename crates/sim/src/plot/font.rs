//! The compiled-in font (Ubuntu Light): width of a text and outlines of its letters.
//! Check: widths add up, and a raised part is narrower than the same letters on the line.

use super::drawing::{Text, runs};
use crate::io::{OutputError, OutputResult};
use tiny_skia::{Path, PathBuilder, Transform};
use ttf_parser::{Face, GlyphId, OutlineBuilder};

/// Letters of the font, in any size.
pub(crate) struct Font {
    face: Face<'static>,
}

impl Font {
    pub(crate) fn load() -> OutputResult<Self> {
        let face = Face::parse(epaint_default_fonts::UBUNTU_LIGHT, 0).map_err(|e| OutputError::encode("font", e))?;
        Ok(Self { face })
    }

    /// Width of a text of that size in drawing units.
    pub(crate) fn width(&self, text: &str, size: f64) -> f64 {
        runs(text).iter().map(|r| size * r.scale() * r.text.chars().map(|c| self.advance(c)).sum::<f64>()).sum()
    }

    /// Outlines of a text whose first letter starts at the origin of `place`, in drawing units.
    pub(crate) fn outline(&self, text: &Text, place: Transform) -> Option<Path> {
        let mut builder = PathBuilder::new();
        let mut x = 0.0;
        for run in runs(&text.text) {
            let size = text.size * run.scale();
            for c in run.text.chars() {
                let scale = (size / f64::from(self.face.units_per_em())) as f32;
                let mut pen = GlyphPen { out: &mut builder, scale, at: (x as f32, (-text.size * run.rise()) as f32) };
                self.face.outline_glyph(self.glyph(c), &mut pen);
                x += size * self.advance(c);
            }
        }
        builder.finish()?.transform(place)
    }

    fn glyph(&self, c: char) -> GlyphId {
        // Glyph 0 is the font's sign for "no such letter".
        self.face.glyph_index(c).unwrap_or(GlyphId(0))
    }

    fn advance(&self, c: char) -> f64 {
        let units = self.face.glyph_hor_advance(self.glyph(c)).unwrap_or(0);
        f64::from(units) / f64::from(self.face.units_per_em())
    }
}

/// Turns font units (y up) into drawing units (y down).
struct GlyphPen<'a> {
    out: &'a mut PathBuilder,
    scale: f32,
    at: (f32, f32),
}

impl GlyphPen<'_> {
    fn place(&self, x: f32, y: f32) -> (f32, f32) {
        (self.at.0 + self.scale * x, self.at.1 - self.scale * y)
    }
}

impl OutlineBuilder for GlyphPen<'_> {
    fn move_to(&mut self, x: f32, y: f32) {
        let p = self.place(x, y);
        self.out.move_to(p.0, p.1);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let p = self.place(x, y);
        self.out.line_to(p.0, p.1);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let (c, p) = (self.place(x1, y1), self.place(x, y));
        self.out.quad_to(c.0, c.1, p.0, p.1);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let (c, d, p) = (self.place(x1, y1), self.place(x2, y2), self.place(x, y));
        self.out.cubic_to(c.0, c.1, d.0, d.1, p.0, p.1);
    }

    fn close(&mut self) {
        self.out.close();
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
        approx::assert_relative_eq!(font.width("abc", 20.0), 2.0 * font.width("abc", 10.0), max_relative = 1e-12);
        assert!(font.width("10^{12}", 10.0) < font.width("1012", 10.0));
    }

    #[test]
    fn letters_of_the_labels_are_in_the_font() {
        let font = Font::load().unwrap();
        for c in "τρσηλθφβΓ°·×−±≤≥µ²³".chars() {
            assert_ne!(font.glyph(c), GlyphId(0), "{c}");
        }
    }
}
