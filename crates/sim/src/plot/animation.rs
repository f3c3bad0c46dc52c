//! Pictures one after the other, as an animated PNG (APNG), which browsers play and other readers show as its first picture.
//! Check: the file is read back frame by frame with its times.

use super::figure::Figure;
use super::png_file::paint;
use crate::io::{OutputError, OutputResult, Provenance};

/// The figures as one animated PNG, each shown for `frame_s` \[s\], over and over.
///
/// # Errors
/// No figures, figures of different sizes, a time that is not between 0.01 s and 60 s, and what [`Figure::png`] finds.
pub fn apng(figures: &[Figure], frame_s: f64, provenance: &Provenance) -> OutputResult<Vec<u8>> {
    if !(0.01..=60.0).contains(&frame_s) {
        return Err(OutputError::value("frame_s", frame_s, "0.01 to 60 s"));
    }
    let Some(first) = figures.first() else {
        return Err(OutputError::value("figures", 0, "at least one"));
    };
    let refuse = |e: png::EncodingError| OutputError::encode("APNG", e);
    let picture = paint(&first.draw()?)?;
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, picture.width, picture.height);
    // Pictures have no transparent parts: their own fill is white.
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Best);
    encoder.set_animated(figures.len() as u32, 0).map_err(refuse)?;
    encoder.set_frame_delay((1000.0 * frame_s).round() as u16, 1000).map_err(refuse)?;
    for (key, text) in provenance.entries() {
        encoder.add_itxt_chunk(key.into(), text).map_err(refuse)?;
    }
    let mut writer = encoder.write_header().map_err(refuse)?;
    for figure in figures {
        let raster = paint(&figure.draw()?)?;
        if (raster.width, raster.height) != (picture.width, picture.height) {
            let value = format!("{} x {}", raster.width, raster.height);
            return Err(OutputError::value("size of a figure", value, "that of the first"));
        }
        let rgb: Vec<u8> = raster.rgba.as_chunks::<4>().0.iter().flat_map(|p| [p[0], p[1], p[2]]).collect();
        writer.write_image_data(&rgb).map_err(refuse)?;
    }
    writer.finish().map_err(refuse)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::provenance::example;
    use crate::plot::{Axis, CurvePlot, Series, Style};

    fn figure(slope: f64, width: f64) -> Figure {
        let line = Series::new("", Style::Line, [(0.0, 0.0), (1.0, slope)]);
        let mut figure = Figure::stacked([CurvePlot::new("", Axis::linear("t"), Axis::linear("q")).with(line)]);
        figure.width = width;
        figure
    }

    #[test]
    fn all_pictures_are_read_back_with_their_times() {
        let bytes = apng(&[figure(1.0, 300.0), figure(2.0, 300.0), figure(5.0, 300.0)], 0.25, &example()).unwrap();
        let mut reader = png::Decoder::new(bytes.as_slice()).read_info().unwrap();
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
