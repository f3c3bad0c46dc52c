//! The frame of a panel: box, grid, ticks, labels and title.
//! Check: by eye, and through the tests of the panels.

use super::axis::Scale;
use super::colour::Rgb;
use super::drawing::{Anchor, Frame, INK, Shape, Text};
use super::font::Font;

pub(crate) const GRID: Rgb = [226, 226, 226];
const FAINT_GRID: Rgb = [240, 240, 240];

pub(crate) const TICK_SIZE: f64 = 14.0;
const TITLE_SIZE: f64 = 17.0;
const LABEL_SIZE: f64 = 16.0;
const TICK_LENGTH: f64 = 5.0;
/// Middle of the letters above their base line.
pub(crate) const HALF_HEIGHT: f64 = 0.36 * TICK_SIZE;

/// Room around the box of a panel, the same for all panels so that stacked ones line up.
pub(crate) const LEFT: f64 = 88.0;
pub(crate) const BOTTOM: f64 = 58.0;

/// Room above the box: for the title where there is one.
pub(crate) fn top_room(title: &str) -> f64 {
    if title.is_empty() { 12.0 } else { 34.0 }
}

/// The box of a panel in its cell.
pub(crate) fn inner(cell: Frame, right: f64, title: &str) -> Frame {
    let top = top_room(title);
    Frame {
        left: cell.left + LEFT,
        top: cell.top + top,
        width: cell.width - LEFT - right,
        height: cell.height - top - BOTTOM,
    }
}

/// A side of a box that has an axis.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Side {
    Bottom,
    Left,
    Right,
}

impl Side {
    /// About how far apart labelled ticks are.
    fn gap(self) -> f64 {
        match self {
            Self::Bottom => 84.0,
            Self::Left => 48.0,
            Self::Right => 40.0,
        }
    }
}

/// A panel: its content over the grid, within the box, with axes and title.
pub(crate) fn panel(
    f: &Frame,
    [x, y]: [&Scale<'_>; 2],
    text: &str,
    content: Vec<Shape>,
    font: &Font,
    out: &mut Vec<Shape>,
) {
    for value in x.minor_ticks() {
        out.push(Shape::line(f.vertical(x.place(value)), FAINT_GRID, 1.0));
    }
    for value in y.minor_ticks() {
        out.push(Shape::line(f.horizontal(y.place(value)), FAINT_GRID, 1.0));
    }
    for (value, _) in x.ticks(Side::Bottom.gap()) {
        out.push(Shape::line(f.vertical(x.place(value)), GRID, 1.0));
    }
    for (value, _) in y.ticks(Side::Left.gap()) {
        out.push(Shape::line(f.horizontal(y.place(value)), GRID, 1.0));
    }
    out.push(Shape::Clip {
        frame: *f,
        shapes: content,
    });
    out.push(Shape::line(f.outline(), INK, 1.2));
    axis(Side::Bottom, x, f, font, out);
    axis(Side::Left, y, f, font, out);
    out.push(title(
        (f.left + f.width / 2.0, f.top - 11.0),
        text,
        TITLE_SIZE,
    ));
}

/// Ticks, their labels and the name of an axis at a side of a box.
pub(crate) fn axis(side: Side, scale: &Scale<'_>, f: &Frame, font: &Font, out: &mut Vec<Shape>) {
    let mut widest: f64 = 0.0;
    for (value, name) in scale.ticks(side.gap()) {
        let at = scale.place(value);
        widest = widest.max(font.width(&name, TICK_SIZE));
        let beyond = TICK_LENGTH + 4.0;
        let (from, to, label, anchor) = match side {
            Side::Bottom => (
                (at, f.bottom()),
                (0.0, 1.0),
                (at, f.bottom() + TICK_LENGTH + TICK_SIZE),
                Anchor::Middle,
            ),
            Side::Left => (
                (f.left, at),
                (-1.0, 0.0),
                (f.left - beyond, at + HALF_HEIGHT),
                Anchor::End,
            ),
            Side::Right => (
                (f.right(), at),
                (1.0, 0.0),
                (f.right() + beyond, at + HALF_HEIGHT),
                Anchor::Start,
            ),
        };
        out.push(Shape::line(
            [
                from,
                (from.0 + TICK_LENGTH * to.0, from.1 + TICK_LENGTH * to.1),
            ],
            INK,
            1.2,
        ));
        out.push(Shape::text(label, &name, TICK_SIZE, anchor));
    }
    let middle = (f.left + f.width / 2.0, f.top + f.height / 2.0);
    let beyond = TICK_LENGTH + widest;
    let at = match side {
        Side::Bottom => (middle.0, f.bottom() + BOTTOM - 14.0),
        Side::Left => (f.left - beyond - 18.0, middle.1),
        Side::Right => (f.right() + beyond + 24.0, middle.1),
    };
    let upward = side != Side::Bottom;
    let anchor = Anchor::Middle;
    out.push(Shape::Text(Text {
        at,
        text: scale.label.into(),
        size: LABEL_SIZE,
        anchor,
        upward,
        bold: false,
    }));
}

/// A title, centred on the point.
pub(crate) fn title(at: (f64, f64), text: &str, size: f64) -> Shape {
    Shape::Text(Text {
        at,
        text: text.into(),
        size,
        anchor: Anchor::Middle,
        upward: false,
        bold: true,
    })
}
