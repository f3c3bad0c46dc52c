//! The legend of a curve plot, put where it covers least: a corner, the middle of an edge, else anywhere. Where no place is
//! free the plot makes room above its curves.
//! Check: tests fill all places but one and find the legend there.

use super::drawing::{Anchor, Frame, Shape};
use super::font::Font;
use super::frame::{GRID, HALF_HEIGHT, TICK_SIZE};
use super::series::{Series, marker};

const SAMPLE: f64 = 34.0;
const LINE: f64 = 21.0;
const PAD: f64 = 9.0;
/// Between legend and frame.
pub(crate) const INSET: f64 = 8.0;
/// Half of the largest marker.
const REACH: f64 = 6.5;
/// Steps of the places that are tried along each side.
const GRID_PLACES: u8 = 12;

/// Room that the named series need, which come with the indices of their colours.
pub(crate) fn size(series: &[(usize, &Series)], font: &Font) -> (f64, f64) {
    let widest = series.iter().map(|(_, s)| font.width(&s.label, TICK_SIZE)).fold(0.0, f64::max);
    // A seventh more than the letters need: the font of an SVG viewer may run wider.
    (SAMPLE + 3.0 * PAD + 1.15 * widest, LINE * series.len() as f64 + PAD)
}

/// Draws samples and names of the series into their place.
pub(crate) fn legend(series: &[(usize, &Series)], place: Frame, out: &mut Vec<Shape>) {
    out.push(Shape::Area { points: place.outline(), fill: [255, 255, 255], opacity: 0.88 });
    out.push(Shape::line(place.outline(), GRID, 1.0));
    for (row, (colour, series)) in series.iter().enumerate() {
        let (x, y) = (place.left + PAD, place.top + 0.5 * PAD + LINE * (row as f64 + 0.5));
        if series.style.has_line() {
            out.push(Shape::Line { points: vec![(x, y), (x + SAMPLE, y)], pen: series.pen(*colour) });
        }
        if series.style.has_markers() {
            out.push(marker((x + SAMPLE / 2.0, y), *colour));
        }
        out.push(Shape::text((x + SAMPLE + PAD, y + HALF_HEIGHT), &series.label, TICK_SIZE, Anchor::Start));
    }
}

/// The place with the fewest points under the legend, and how many these are. Of equal ones it is the first: the corners
/// from the upper right on, the middles of the edges, then all over the frame.
pub(crate) fn place(frame: Frame, (width, height): (f64, f64), occupied: &[(f64, f64)]) -> (Frame, usize) {
    let corners = [(1.0, 0.0), (0.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
    let edges = [(0.5, 0.0), (0.5, 1.0), (1.0, 0.5), (0.0, 0.5)];
    let part = |step: u8| f64::from(step) / f64::from(GRID_PLACES);
    let all = (0..=GRID_PLACES).flat_map(|row| (0..=GRID_PLACES).map(move |column| (1.0 - part(column), part(row))));
    let places = corners.into_iter().chain(edges).chain(all).map(|(across, down)| Frame {
        left: frame.left + INSET + across * (frame.width - 2.0 * INSET - width),
        top: frame.top + INSET + down * (frame.height - 2.0 * INSET - height),
        width,
        height,
    });
    // Markers and the width of lines reach beyond their points.
    let covered = |f: &Frame| {
        let inside = |p: &&(f64, f64)| {
            p.0 > f.left - REACH && p.0 < f.right() + REACH && p.1 > f.top - REACH && p.1 < f.bottom() + REACH
        };
        occupied.iter().filter(inside).count()
    };
    let counted = places.map(|place| (place, covered(&place)));
    counted.min_by_key(|(_, count)| *count).unwrap_or((frame, 0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_legend_goes_to_the_empty_corner() {
        let frame = Frame { left: 0.0, top: 0.0, width: 400.0, height: 300.0 };
        let corners = [(390.0, 10.0), (10.0, 10.0), (390.0, 290.0), (10.0, 290.0)];
        for empty in 0..4 {
            let ink: Vec<(f64, f64)> =
                corners.iter().enumerate().filter(|(i, _)| *i != empty).map(|(_, p)| *p).collect();
            let (found, covered) = place(frame, (100.0, 60.0), &ink);
            assert_eq!(covered, 0);
            let expected = corners[empty];
            assert!((found.left < 200.0) == (expected.0 < 200.0) && (found.top < 150.0) == (expected.1 < 150.0));
        }
    }

    #[test]
    fn the_only_free_place_is_found_away_from_corners_and_edges() {
        let frame = Frame { left: 0.0, top: 0.0, width: 400.0, height: 300.0 };
        let grid = (0..=80).flat_map(|i| (0..=60).map(move |j| (5.0 * f64::from(i), 5.0 * f64::from(j))));
        // A hole off the middle, a little larger than the legend.
        let ink: Vec<(f64, f64)> =
            grid.filter(|(x, y)| !(70.0..=210.0).contains(x) || !(60.0..=150.0).contains(y)).collect();
        let (found, covered) = place(frame, (80.0, 40.0), &ink);
        assert_eq!(covered, 0, "{found:?}");
        assert!(found.left > 70.0 && found.right() < 210.0 && found.top > 60.0 && found.bottom() < 150.0);
        let (_, covered) = place(frame, (200.0, 100.0), &ink);
        assert!(covered > 0, "too large for the hole");
    }
}
