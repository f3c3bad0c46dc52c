//! The frame of a panel: box, grid, ticks, labels and title.
//! Check: by eye, and through the tests of the panels.

use super::axis::Scale;
use super::colour::Rgb;
use super::drawing::{Anchor, Frame, Pen, Shape, Text};
use super::font::Font;

pub(crate) const INK: Rgb = [38, 38, 38];
pub(crate) const GRID: Rgb = [226, 226, 226];
const FAINT_GRID: Rgb = [240, 240, 240];

pub(crate) const TITLE_SIZE: f64 = 17.0;
pub(crate) const LABEL_SIZE: f64 = 16.0;
pub(crate) const TICK_SIZE: f64 = 14.0;

const TICK_LENGTH: f64 = 5.0;
/// Labelled ticks are about this far apart.
const GAP: (f64, f64) = (84.0, 48.0);

/// Room around the box of a panel, the same for all panels so that stacked ones line up.
pub(crate) const LEFT: f64 = 88.0;
pub(crate) const BOTTOM: f64 = 58.0;

/// Room above the box: for the title where there is one.
pub(crate) fn top_room(title: &str) -> f64 {
    if title.is_empty() { 12.0 } else { 34.0 }
}

/// Axes and title of one panel.
pub(crate) struct Decor<'a> {
    pub(crate) frame: Frame,
    pub(crate) x: Scale,
    pub(crate) y: Scale,
    pub(crate) x_label: &'a str,
    pub(crate) y_label: &'a str,
    pub(crate) title: &'a str,
}

impl Decor<'_> {
    /// Grid, which the content is drawn over.
    pub(crate) fn grid(&self, out: &mut Vec<Shape>) {
        let f = &self.frame;
        let mut line =
            |from, to, colour| out.push(Shape::Line { points: vec![from, to], pen: Pen::solid(colour, 1.0) });
        for value in self.x.minor_ticks() {
            let x = self.x.place(value);
            line((x, f.top), (x, f.bottom()), FAINT_GRID);
        }
        for value in self.y.minor_ticks() {
            let y = self.y.place(value);
            line((f.left, y), (f.right(), y), FAINT_GRID);
        }
        for tick in self.x.ticks(GAP.0) {
            let x = self.x.place(tick.value);
            line((x, f.top), (x, f.bottom()), GRID);
        }
        for tick in self.y.ticks(GAP.1) {
            let y = self.y.place(tick.value);
            line((f.left, y), (f.right(), y), GRID);
        }
    }

    /// Box, ticks, labels and title.
    pub(crate) fn axes(&self, font: &Font, out: &mut Vec<Shape>) {
        let f = &self.frame;
        let mut outline = f.corners();
        outline.push((f.left, f.top));
        outline.push((f.right(), f.top));
        out.push(Shape::Line { points: outline, pen: Pen::solid(INK, 1.2) });
        for tick in self.x.ticks(GAP.0) {
            let x = self.x.place(tick.value);
            out.push(tick_mark((x, f.bottom()), (0.0, TICK_LENGTH)));
            out.push(label((x, f.bottom() + TICK_LENGTH + TICK_SIZE), tick.label, TICK_SIZE, Anchor::Middle));
        }
        let mut widest: f64 = 0.0;
        for tick in self.y.ticks(GAP.1) {
            let y = self.y.place(tick.value);
            widest = widest.max(font.width(&tick.label, TICK_SIZE));
            out.push(tick_mark((f.left, y), (-TICK_LENGTH, 0.0)));
            out.push(label((f.left - TICK_LENGTH - 4.0, y + 0.36 * TICK_SIZE), tick.label, TICK_SIZE, Anchor::End));
        }
        let middle = (f.left + f.width / 2.0, f.top + f.height / 2.0);
        out.push(label((middle.0, f.bottom() + BOTTOM - 14.0), self.x_label.into(), LABEL_SIZE, Anchor::Middle));
        let at = (f.left - TICK_LENGTH - widest - 18.0, middle.1);
        out.push(upward(at, self.y_label));
        out.push(Shape::Text(Text {
            at: (middle.0, f.top - 11.0),
            text: self.title.into(),
            size: TITLE_SIZE,
            anchor: Anchor::Middle,
            upward: false,
            colour: INK,
            bold: true,
        }));
    }
}

pub(crate) fn tick_mark(from: (f64, f64), by: (f64, f64)) -> Shape {
    Shape::Line { points: vec![from, (from.0 + by.0, from.1 + by.1)], pen: Pen::solid(INK, 1.2) }
}

pub(crate) fn label(at: (f64, f64), text: String, size: f64, anchor: Anchor) -> Shape {
    Shape::Text(Text { at, text, size, anchor, upward: false, colour: INK, bold: false })
}

/// An axis label that reads upward, centred on the point.
pub(crate) fn upward(at: (f64, f64), text: &str) -> Shape {
    Shape::Text(Text {
        at,
        text: text.into(),
        size: LABEL_SIZE,
        anchor: Anchor::Middle,
        upward: true,
        colour: INK,
        bold: false,
    })
}
