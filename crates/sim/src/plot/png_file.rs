//! A drawing as PNG: shapes and letters are filled with smooth edges; the provenance is in iTXt chunks. Several drawings one after
//! the other are an animated PNG (APNG), which browsers play and other readers show as its first picture.
//! Check: single pixels of a drawn area, a clipped line and an image; chunks and frames are read back.

use super::colour::Rgb;
use super::drawing::{Drawing, INK, Shape, Text};
use super::font::Font;
use crate::Error;
use crate::io::Provenance;
use tiny_skia::{
    Color, FillRule, FilterQuality, IntSize, LineJoin, Mask, Paint, Path, PathBuilder, Pixmap,
    PixmapPaint, Stroke, StrokeDash, Transform,
};

/// Pixels per drawing unit.
pub(crate) const SCALE: f64 = 1.2;
/// The font is light: its letters are stroked by this part of their size to read well in small print.
const EMBOLDEN: f64 = 0.022;

/// The pixels of a drawing, none of them transparent.
pub(crate) fn paint(drawing: &Drawing) -> Result<Pixmap, Error> {
    let [width, height] =
        [drawing.width, drawing.height].map(|length| (length * SCALE).round() as u32);
    let mut pixmap = Pixmap::new(width, height).ok_or_else(|| {
        Error::value(
            "picture size",
            format!("{width} x {height}"),
            "1 to 32767 pixels each",
        )
    })?;
    pixmap.fill(Color::WHITE);
    let mut painter = Painter {
        pixmap,
        font: Font::load()?,
        mask: None,
    };
    painter.shapes(&drawing.shapes);
    Ok(painter.pixmap)
}

/// Pixels, row by row from the top: red, green, blue, times the opacity, and the opacity.
pub(crate) fn pixels(width: u32, height: u32, rgba: Vec<u8>) -> Result<Pixmap, Error> {
    let size = IntSize::from_wh(width, height);
    size.and_then(|size| Pixmap::from_vec(rgba, size))
        .ok_or_else(|| {
            Error::value(
                "embedded picture",
                format!("{width} x {height}"),
                "4 bytes a pixel, at least one pixel",
            )
        })
}

struct Painter {
    pixmap: Pixmap,
    font: Font,
    mask: Option<Mask>,
}

impl Painter {
    fn shapes(&mut self, shapes: &[Shape]) {
        for shape in shapes {
            match shape {
                Shape::Line {
                    points,
                    colour,
                    width,
                    dash,
                } => {
                    let dash = StrokeDash::new(dash.iter().map(|d| *d as f32).collect(), 0.0);
                    let stroke = Stroke {
                        width: *width as f32,
                        line_join: LineJoin::Round,
                        dash,
                        ..Stroke::default()
                    };
                    self.stroke(path(points), *colour, &stroke);
                }
                Shape::Area {
                    points,
                    fill,
                    opacity,
                } => self.fill(path(points), *fill, *opacity),
                Shape::Text(text) => self.text(text),
                Shape::Image { frame, pixels } => {
                    let [width, height] = [pixels.width(), pixels.height()].map(f64::from);
                    let fit = Transform::from_scale(
                        (frame.width / width) as f32,
                        (frame.height / height) as f32,
                    )
                    .post_translate(frame.left as f32, frame.top as f32)
                    .post_concat(scale());
                    let how = PixmapPaint {
                        quality: FilterQuality::Bilinear,
                        ..PixmapPaint::default()
                    };
                    self.pixmap
                        .draw_pixmap(0, 0, pixels.as_ref(), &how, fit, self.mask.as_ref());
                }
                Shape::Clip { frame, shapes } => {
                    let mut mask = Mask::new(self.pixmap.width(), self.pixmap.height());
                    if let (Some(mask), Some(path)) = (&mut mask, path(&frame.outline())) {
                        mask.fill_path(&path, FillRule::Winding, true, scale());
                    }
                    let outer = std::mem::replace(&mut self.mask, mask);
                    self.shapes(shapes);
                    self.mask = outer;
                }
            }
        }
    }

    fn text(&mut self, text: &Text) {
        let back = -0.5 * f64::from(text.anchor as u8) * self.font.width(&text.text, text.size);
        let turn = if text.upward { -90.0 } else { 0.0 };
        let place = Transform::from_rotate(turn).post_translate(text.at.0 as f32, text.at.1 as f32);
        let outline = self.font.outline(&text.text, text.size);
        let path = outline.and_then(|path| path.transform(place.pre_translate(back as f32, 0.0)));
        self.fill(path.clone(), INK, 1.0);
        let part = if text.bold { 2.5 * EMBOLDEN } else { EMBOLDEN };
        self.stroke(
            path,
            INK,
            &Stroke {
                width: (part * text.size) as f32,
                ..Stroke::default()
            },
        );
    }

    fn fill(&mut self, path: Option<Path>, colour: Rgb, opacity: f64) {
        if let Some(path) = path {
            self.pixmap.fill_path(
                &path,
                &ink(colour, opacity),
                FillRule::Winding,
                scale(),
                self.mask.as_ref(),
            );
        }
    }

    fn stroke(&mut self, path: Option<Path>, colour: Rgb, stroke: &Stroke) {
        if let Some(path) = path {
            self.pixmap.stroke_path(
                &path,
                &ink(colour, 1.0),
                stroke,
                scale(),
                self.mask.as_ref(),
            );
        }
    }
}

fn scale() -> Transform {
    Transform::from_scale(SCALE as f32, SCALE as f32)
}

fn ink([r, g, b]: Rgb, opacity: f64) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color_rgba8(r, g, b, (255.0 * opacity).round() as u8);
    paint
}

fn path(points: &[(f64, f64)]) -> Option<Path> {
    let mut builder = PathBuilder::with_capacity(points.len(), points.len());
    for (i, (x, y)) in points.iter().enumerate() {
        let x = *x as f32;
        let y = *y as f32;
        if i == 0 {
            builder.move_to(x, y)
        } else {
            builder.line_to(x, y)
        }
    }
    builder.finish()
}

fn refused(error: png::EncodingError) -> Error {
    Error::unsupported("PNG", error)
}

/// PNG bytes of one picture, APNG bytes of several, with the provenance in iTXt chunks where it is given.
pub(crate) fn encode(
    pictures: impl IntoIterator<Item = Result<Pixmap, Error>, IntoIter: ExactSizeIterator>,
    frame_s: f64,
    provenance: Option<&Provenance>,
) -> Result<Vec<u8>, Error> {
    let mut pictures = pictures.into_iter();
    let count = pictures.len();
    let first = pictures
        .next()
        .ok_or_else(|| Error::value("figures", 0, "at least one"))??;
    let size = (first.width(), first.height());
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, size.0, size.1);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Balanced);
    if count > 1 {
        encoder.set_animated(count as u32, 0).map_err(refused)?;
        encoder
            .set_frame_delay((1000.0 * frame_s).round() as u16, 1000)
            .map_err(refused)?;
    }
    for (key, text) in provenance.map(Provenance::entries).into_iter().flatten() {
        encoder.add_itxt_chunk(key.into(), text).map_err(refused)?;
    }
    let mut writer = encoder.write_header().map_err(refused)?;
    for picture in std::iter::once(Ok(first)).chain(pictures) {
        let picture = picture?;
        if (picture.width(), picture.height()) != size {
            let value = format!("{} x {}", picture.width(), picture.height());
            return Err(Error::value("size of a figure", value, "that of the first"));
        }
        writer
            .write_image_data(&picture.take_demultiplied())
            .map_err(refused)?;
    }
    writer.finish().map_err(refused)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::provenance::example;
    use crate::plot::drawing::Frame;
    use crate::plot::{Axis, CurvePlot, Figure, Series, Style, apng};

    fn pixel(picture: &Pixmap, x: f64, y: f64) -> [u8; 3] {
        let at = picture
            .pixel((x * SCALE) as u32, (y * SCALE) as u32)
            .unwrap();
        [at.red(), at.green(), at.blue()]
    }

    #[test]
    fn areas_lines_and_images_land_where_they_should() {
        let frame = Frame {
            left: 50.0,
            top: 10.0,
            width: 20.0,
            height: 20.0,
        };
        // Upper row red, lower row blue.
        let rgba = [
            [255, 0, 0, 255],
            [255, 0, 0, 255],
            [0, 0, 255, 255],
            [0, 0, 255, 255],
        ]
        .concat();
        let picture = Frame {
            left: 10.0,
            top: 40.0,
            width: 20.0,
            height: 20.0,
        };
        let drawing = Drawing {
            width: 100.0,
            height: 80.0,
            shapes: vec![
                Shape::area(
                    [(0.0, 0.0), (20.0, 0.0), (20.0, 20.0), (0.0, 20.0)],
                    [0, 128, 0],
                ),
                Shape::Clip {
                    frame,
                    shapes: vec![Shape::line([(30.0, 20.0), (90.0, 20.0)], [0, 0, 0], 4.0)],
                },
                Shape::Image {
                    frame: picture,
                    pixels: pixels(2, 2, rgba).unwrap(),
                },
            ],
        };
        let raster = paint(&drawing).unwrap();
        assert_eq!((raster.width(), raster.height()), (120, 96));
        assert_eq!(pixel(&raster, 10.0, 10.0), [0, 128, 0]);
        assert_eq!(pixel(&raster, 30.0, 10.0), [255, 255, 255]);
        assert_eq!(pixel(&raster, 60.0, 20.0), [0, 0, 0]);
        assert_eq!(
            pixel(&raster, 40.0, 20.0),
            [255, 255, 255],
            "cut by the clip frame"
        );
        let top = pixel(&raster, 20.0, 43.0);
        let bottom = pixel(&raster, 20.0, 57.0);
        assert!(top[0] > 200 && bottom[2] > 200, "{top:?} {bottom:?}");
    }

    #[test]
    fn provenance_is_in_the_chunks_and_the_bytes_do_not_change() {
        let drawing = Drawing {
            width: 30.0,
            height: 20.0,
            shapes: vec![],
        };
        let png_bytes = || encode([paint(&drawing)], 0.0, Some(&example())).unwrap();
        let bytes = png_bytes();
        assert_eq!(bytes, png_bytes());
        let reader = png::Decoder::new(std::io::Cursor::new(&bytes))
            .read_info()
            .unwrap();
        let chunks: Vec<(String, String)> = reader
            .info()
            .utf8_text
            .iter()
            .map(|c| (c.keyword.clone(), c.get_text().unwrap()))
            .collect();
        let expected = example().entries().map(|(k, t)| (k.to_owned(), t));
        assert_eq!(chunks, expected);
    }

    #[test]
    fn an_impossible_size_is_an_error() {
        let drawing = Drawing {
            width: 0.0,
            height: 20.0,
            shapes: vec![],
        };
        assert!(matches!(paint(&drawing), Err(Error::Value { .. })));
    }

    fn figure(slope: f64, width: f64) -> Figure {
        let line = Series::new("", Style::Line, [(0.0, 0.0), (1.0, slope)]);
        let mut figure =
            Figure::stacked([CurvePlot::new("", Axis::linear("t"), Axis::linear("q")).with(line)]);
        figure.width = width;
        figure
    }

    #[test]
    fn all_pictures_are_read_back_with_their_times() {
        let bytes = apng(
            &[figure(1.0, 300.0), figure(2.0, 300.0), figure(5.0, 300.0)],
            0.25,
            &example(),
        )
        .unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes))
            .read_info()
            .unwrap();
        assert_eq!(reader.info().animation_control.unwrap().num_frames, 3);
        let mut pixels = vec![0; 4 * reader.info().width as usize * reader.info().height as usize];
        let mut sums = Vec::new();
        for _ in 0..3 {
            let size = reader.next_frame(&mut pixels).unwrap().buffer_size();
            let frame = reader.info().frame_control.unwrap();
            assert_eq!((frame.delay_num, frame.delay_den), (250, 1000));
            sums.push(pixels[..size].iter().map(|p| u64::from(*p)).sum::<u64>());
        }
        assert!(sums[0] != sums[1] && sums[1] != sums[2]);
    }

    #[test]
    fn no_pictures_pictures_of_two_sizes_and_impossible_times_are_refused() {
        let one = || figure(1.0, 300.0);
        assert!(apng(&[], 0.1, &example()).is_err());
        assert!(apng(&[one(), figure(1.0, 400.0)], 0.1, &example()).is_err());
        for time_s in [0.0, -1.0, f64::NAN, 1e3] {
            assert!(apng(&[one()], time_s, &example()).is_err());
        }
    }
}
