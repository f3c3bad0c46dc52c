//! The legend of a curve plot, put where it covers least: a corner, the middle of an edge, else anywhere. Where no place is
//! free the plot makes room above its curves.
//! Check: tests fill all places but one and find the legend there.

use super::colour::Rgb;
use super::drawing::{Anchor, Frame, Pen, Shape};
use super::font::Font;
use super::frame::{GRID, TICK_SIZE, label};
use super::marker::marker;

const SAMPLE: f64 = 34.0;
const LINE: f64 = 21.0;
const PAD: f64 = 9.0;
/// Between legend and frame.
pub(crate) const INSET: f64 = 8.0;
/// Half of the largest marker.
const REACH: f64 = 6.5;
/// Steps of the places that are tried along each side.
const GRID_PLACES: usize = 12;

/// One line of the legend.
pub(crate) struct Entry<'a> {
    pub(crate) label: &'a str,
    pub(crate) pen: Option<Pen>,
    /// Index of the marker's shape.
    pub(crate) marker: Option<usize>,
    pub(crate) colour: Rgb,
}

/// Room that the entries need.
pub(crate) fn size(entries: &[Entry], font: &Font) -> (f64, f64) {
    let widest = entries.iter().map(|e| font.width(e.label, TICK_SIZE)).fold(0.0, f64::max);
    // A seventh more than the letters need: the font of an SVG viewer may run wider.
    (SAMPLE + 3.0 * PAD + 1.15 * widest, LINE * entries.len() as f64 + PAD)
}

/// Draws the entries; `occupied` are points with ink.
pub(crate) fn legend(entries: &[Entry], frame: Frame, occupied: &[(f64, f64)], font: &Font, out: &mut Vec<Shape>) {
    if entries.is_empty() {
        return;
    }
    let (place, _) = place(frame, size(entries, font), occupied);
    out.push(Shape::Area { points: place.corners(), fill: [255, 255, 255], opacity: 0.88 });
    let mut outline = place.corners();
    outline.push(outline[0]);
    out.push(Shape::Line { points: outline, pen: Pen::solid(GRID, 1.0) });
    for (i, entry) in entries.iter().enumerate() {
        let y = place.top + 0.5 * PAD + LINE * (i as f64 + 0.5);
        let x = place.left + PAD;
        if let Some(pen) = entry.pen {
            out.push(Shape::Line { points: vec![(x, y), (x + SAMPLE, y)], pen });
        }
        if let Some(index) = entry.marker {
            out.push(Shape::Area { points: marker((x + SAMPLE / 2.0, y), index), fill: entry.colour, opacity: 1.0 });
        }
        out.push(label((x + SAMPLE + PAD, y + 0.36 * TICK_SIZE), entry.label.into(), TICK_SIZE, Anchor::Start));
    }
}

/// The place with the fewest points under the legend, and how many these are. Of equal ones it is the first: the corners
/// from the upper right on, the middles of the edges, then all over the frame.
pub(crate) fn place(frame: Frame, (width, height): (f64, f64), occupied: &[(f64, f64)]) -> (Frame, usize) {
    let (left, right) = (frame.left + INSET, frame.right() - INSET - width);
    let (top, bottom) = (frame.top + INSET, frame.bottom() - INSET - height);
    let (centre, middle) = (0.5 * (left + right), 0.5 * (top + bottom));
    let corners = [(right, top), (left, top), (right, bottom), (left, bottom)];
    let edges = [(centre, top), (centre, bottom), (right, middle), (left, middle)];
    let part = |from: f64, to: f64, i: usize| from + (to - from) * i as f64 / GRID_PLACES as f64;
    let all = (0..=GRID_PLACES)
        .flat_map(|row| (0..=GRID_PLACES).map(move |column| (row, column)))
        .map(|(row, column)| (part(right, left, column), part(top, bottom, row)));
    // Markers and the width of lines reach beyond their points.
    let covered = |f: &Frame| {
        let inside = |p: &&(f64, f64)| {
            p.0 > f.left - REACH && p.0 < f.right() + REACH && p.1 > f.top - REACH && p.1 < f.bottom() + REACH
        };
        occupied.iter().filter(inside).count()
    };
    let mut best = (Frame { left: right, top, width, height }, usize::MAX);
    for (left, top) in corners.into_iter().chain(edges).chain(all) {
        let frame = Frame { left, top, width, height };
        let count = covered(&frame);
        if count < best.1 {
            best = (frame, count);
        }
        if count == 0 {
            break;
        }
    }
    best
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
