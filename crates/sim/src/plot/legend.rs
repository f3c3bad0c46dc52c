//! The legend of a curve plot, put where it covers least: a corner, else the middle of an edge.
//! Check: a test fills three corners and finds the legend in the fourth.

use super::colour::Rgb;
use super::curves::marker;
use super::drawing::{Anchor, Frame, Pen, Shape};
use super::font::Font;
use super::frame::{GRID, TICK_SIZE, label};

const SAMPLE: f64 = 34.0;
const LINE: f64 = 21.0;
const PAD: f64 = 9.0;

/// One line of the legend.
pub(crate) struct Entry<'a> {
    pub(crate) label: &'a str,
    pub(crate) pen: Option<Pen>,
    /// Index of the marker's shape.
    pub(crate) marker: Option<usize>,
    pub(crate) colour: Rgb,
}

/// Draws the entries; `occupied` are points with ink.
pub(crate) fn legend(entries: &[Entry], frame: Frame, occupied: &[(f64, f64)], font: &Font, out: &mut Vec<Shape>) {
    if entries.is_empty() {
        return;
    }
    let widest = entries.iter().map(|e| font.width(e.label, TICK_SIZE)).fold(0.0, f64::max);
    // A seventh more than the letters need: the font of an SVG viewer may run wider.
    let (width, height) = (SAMPLE + 3.0 * PAD + 1.15 * widest, LINE * entries.len() as f64 + PAD);
    let place = place(frame, (width, height), occupied);
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

/// The place with the fewest points under the legend; the first of the list where equal, the upper right corner before all.
fn place(frame: Frame, (width, height): (f64, f64), occupied: &[(f64, f64)]) -> Frame {
    let inset = 8.0;
    let (left, right) = (frame.left + inset, frame.right() - inset - width);
    let (top, bottom) = (frame.top + inset, frame.bottom() - inset - height);
    let (centre, middle) = (0.5 * (left + right), 0.5 * (top + bottom));
    let corners = [(right, top), (left, top), (right, bottom), (left, bottom)];
    let edges = [(centre, top), (centre, bottom), (right, middle), (left, middle)];
    let frames: Vec<Frame> =
        corners.into_iter().chain(edges).map(|(left, top)| Frame { left, top, width, height }).collect();
    let covered = |f: &Frame| {
        let inside = |p: &&(f64, f64)| p.0 > f.left && p.0 < f.right() && p.1 > f.top && p.1 < f.bottom();
        occupied.iter().filter(inside).count()
    };
    let mut best = frames[0];
    for f in &frames[1..] {
        if covered(f) < covered(&best) {
            best = *f;
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
            let found = place(frame, (100.0, 60.0), &ink);
            let expected = corners[empty];
            assert!((found.left < 200.0) == (expected.0 < 200.0) && (found.top < 150.0) == (expected.1 < 150.0));
        }
    }
}
