//! A drawing as PNG: shapes and letters are filled with smooth edges; the provenance is in iTXt chunks.
//! Check: single pixels of a drawn area, a clipped line and an image; the chunks are read back.

use super::drawing::{Anchor, Drawing, Frame, Pen, Raster, Shape, Text};
use super::font::Font;
use crate::io::{OutputError, OutputResult, Provenance};
use tiny_skia::{
    Color, FillRule, FilterQuality, IntSize, LineJoin, Mask, Paint, Path, PathBuilder, Pixmap, PixmapPaint, Stroke,
    StrokeDash, Transform,
};

/// Pixels per drawing unit.
pub(crate) const SCALE: f64 = 1.2;
/// The font is light: its letters are stroked by this part of their size to read well in small print.
const EMBOLDEN: f64 = 0.022;

/// The whole file.
pub(crate) fn png_bytes(drawing: &Drawing, provenance: &Provenance) -> OutputResult<Vec<u8>> {
    encode(&paint(drawing)?, Some(provenance))
}

/// The pixels of a drawing.
pub(crate) fn paint(drawing: &Drawing) -> OutputResult<Raster> {
    let (width, height) = ((drawing.width * SCALE).round() as u32, (drawing.height * SCALE).round() as u32);
    let refuse = || OutputError::value("picture size", format!("{width} x {height}"), "1 to 32767 pixels each");
    let mut pixmap = Pixmap::new(width, height).ok_or_else(refuse)?;
    pixmap.fill(Color::WHITE);
    let mut painter = Painter { pixmap, font: Font::load()?, mask: None };
    painter.shapes(&drawing.shapes)?;
    Ok(Raster { width, height, rgba: painter.pixmap.take_demultiplied() })
}

struct Painter {
    pixmap: Pixmap,
    font: Font,
    mask: Option<Mask>,
}

impl Painter {
    fn shapes(&mut self, shapes: &[Shape]) -> OutputResult<()> {
        for shape in shapes {
            match shape {
                Shape::Line { points, pen } => self.line(points, pen),
                Shape::Area { points, fill, opacity } => {
                    if let Some(path) = polygon(points, true) {
                        self.fill(&path, *fill, *opacity);
                    }
                }
                Shape::Text(text) => self.text(text),
                Shape::Image { frame, raster } => self.image(frame, raster)?,
                Shape::Clip { frame, shapes } => {
                    let outer = self.mask.take();
                    self.mask = self.clip(frame);
                    self.shapes(shapes)?;
                    self.mask = outer;
                }
            }
        }
        Ok(())
    }

    fn clip(&self, frame: &Frame) -> Option<Mask> {
        let mut mask = Mask::new(self.pixmap.width(), self.pixmap.height())?;
        let path = polygon(&frame.corners(), true)?;
        mask.fill_path(&path, FillRule::Winding, true, scale());
        Some(mask)
    }

    fn line(&mut self, points: &[(f64, f64)], pen: &Pen) {
        let Some(path) = polygon(points, false) else { return };
        let lengths = pen.dash.iter().map(|d| *d as f32).collect();
        let stroke = Stroke {
            width: pen.width as f32,
            line_join: LineJoin::Round,
            dash: StrokeDash::new(lengths, 0.0),
            ..Stroke::default()
        };
        self.pixmap.stroke_path(&path, &paint_of(pen.colour, 1.0), &stroke, scale(), self.mask.as_ref());
    }

    fn fill(&mut self, path: &Path, colour: [u8; 3], opacity: f64) {
        self.pixmap.fill_path(path, &paint_of(colour, opacity), FillRule::Winding, scale(), self.mask.as_ref());
    }

    fn text(&mut self, text: &Text) {
        let width = self.font.width(&text.text, text.size) as f32;
        let back = match text.anchor {
            Anchor::Start => 0.0,
            Anchor::Middle => -width / 2.0,
            Anchor::End => -width,
        };
        let (x, y) = (text.at.0 as f32, text.at.1 as f32);
        let turn = if text.upward { -90.0 } else { 0.0 };
        let place = Transform::from_rotate(turn).post_translate(x, y).pre_translate(back, 0.0);
        let Some(path) = self.font.outline(text, place) else { return };
        self.fill(&path, text.colour, 1.0);
        let part = if text.bold { 2.5 * EMBOLDEN } else { EMBOLDEN };
        let stroke = Stroke { width: (part * text.size) as f32, ..Stroke::default() };
        self.pixmap.stroke_path(&path, &paint_of(text.colour, 1.0), &stroke, scale(), self.mask.as_ref());
    }

    fn image(&mut self, frame: &Frame, raster: &Raster) -> OutputResult<()> {
        let size = IntSize::from_wh(raster.width, raster.height);
        let premultiplied = raster.rgba.chunks_exact(4).flat_map(|p| {
            let c = tiny_skia::ColorU8::from_rgba(p[0], p[1], p[2], p[3]).premultiply();
            [c.red(), c.green(), c.blue(), c.alpha()]
        });
        let pixels = size.and_then(|s| Pixmap::from_vec(premultiplied.collect(), s)).ok_or_else(|| {
            OutputError::value("embedded picture", raster.rgba.len(), "4 bytes a pixel, at least one pixel")
        })?;
        let fit = Transform::from_scale(
            (frame.width / f64::from(raster.width)) as f32,
            (frame.height / f64::from(raster.height)) as f32,
        )
        .post_translate(frame.left as f32, frame.top as f32)
        .post_concat(scale());
        let how = PixmapPaint { quality: FilterQuality::Bilinear, ..PixmapPaint::default() };
        self.pixmap.draw_pixmap(0, 0, pixels.as_ref(), &how, fit, self.mask.as_ref());
        Ok(())
    }
}

fn scale() -> Transform {
    Transform::from_scale(SCALE as f32, SCALE as f32)
}

fn paint_of(c: [u8; 3], opacity: f64) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color_rgba8(c[0], c[1], c[2], (255.0 * opacity).round() as u8);
    paint
}

fn polygon(points: &[(f64, f64)], closed: bool) -> Option<Path> {
    let mut builder = PathBuilder::with_capacity(points.len() + 1, points.len());
    for (i, (x, y)) in points.iter().enumerate() {
        let (x, y) = (*x as f32, *y as f32);
        if i == 0 { builder.move_to(x, y) } else { builder.line_to(x, y) }
    }
    if closed {
        builder.close();
    }
    builder.finish()
}

/// PNG bytes of a raster, with the provenance in iTXt chunks where it is given.
pub(crate) fn encode(raster: &Raster, provenance: Option<&Provenance>) -> OutputResult<Vec<u8>> {
    let refuse = |e: png::EncodingError| OutputError::encode("PNG", e);
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, raster.width, raster.height);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Best);
    for (key, text) in provenance.map(Provenance::entries).into_iter().flatten() {
        encoder.add_itxt_chunk(key.into(), text).map_err(refuse)?;
    }
    let mut writer = encoder.write_header().map_err(refuse)?;
    writer.write_image_data(&raster.rgba).map_err(refuse)?;
    writer.finish().map_err(refuse)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::provenance::example;

    fn pixel(raster: &Raster, x: f64, y: f64) -> [u8; 3] {
        let (i, j) = ((x * SCALE) as u32, (y * SCALE) as u32);
        let at = 4 * (j * raster.width + i) as usize;
        [raster.rgba[at], raster.rgba[at + 1], raster.rgba[at + 2]]
    }

    #[test]
    fn areas_lines_and_images_land_where_they_should() {
        let frame = Frame { left: 50.0, top: 10.0, width: 20.0, height: 20.0 };
        // Upper row red, lower row blue.
        let rgba = [[255, 0, 0, 255], [255, 0, 0, 255], [0, 0, 255, 255], [0, 0, 255, 255]].concat();
        let picture = Frame { left: 10.0, top: 40.0, width: 20.0, height: 20.0 };
        let black = Pen::solid([0, 0, 0], 4.0);
        let drawing = Drawing {
            width: 100.0,
            height: 80.0,
            shapes: vec![
                Shape::Area {
                    points: vec![(0.0, 0.0), (20.0, 0.0), (20.0, 20.0), (0.0, 20.0)],
                    fill: [0, 128, 0],
                    opacity: 1.0,
                },
                Shape::Clip {
                    frame,
                    shapes: vec![Shape::Line { points: vec![(30.0, 20.0), (90.0, 20.0)], pen: black }],
                },
                Shape::Image { frame: picture, raster: Raster { width: 2, height: 2, rgba } },
            ],
        };
        let raster = paint(&drawing).unwrap();
        assert_eq!((raster.width, raster.height), (120, 96));
        assert_eq!(pixel(&raster, 10.0, 10.0), [0, 128, 0]);
        assert_eq!(pixel(&raster, 30.0, 10.0), [255, 255, 255]);
        assert_eq!(pixel(&raster, 60.0, 20.0), [0, 0, 0]);
        assert_eq!(pixel(&raster, 40.0, 20.0), [255, 255, 255], "cut by the clip frame");
        let (top, bottom) = (pixel(&raster, 20.0, 43.0), pixel(&raster, 20.0, 57.0));
        assert!(top[0] > 200 && bottom[2] > 200, "{top:?} {bottom:?}");
    }

    #[test]
    fn provenance_is_in_the_chunks_and_the_bytes_do_not_change() {
        let drawing = Drawing { width: 30.0, height: 20.0, shapes: vec![] };
        let bytes = png_bytes(&drawing, &example()).unwrap();
        assert_eq!(bytes, png_bytes(&drawing, &example()).unwrap());
        let reader = png::Decoder::new(bytes.as_slice()).read_info().unwrap();
        let chunks: Vec<(String, String)> =
            reader.info().utf8_text.iter().map(|c| (c.keyword.clone(), c.get_text().unwrap())).collect();
        let expected = example().entries().map(|(k, t)| (k.to_owned(), t));
        assert_eq!(chunks, expected);
    }

    #[test]
    fn an_impossible_size_is_an_error() {
        let drawing = Drawing { width: 0.0, height: 20.0, shapes: vec![] };
        assert!(matches!(paint(&drawing), Err(OutputError::Value { .. })));
    }
}
