//! A field cut into independent pencils of lines.

use super::super::layout::Shape;

/// Neighbouring lines along one axis: one row piece for each index of that axis.
#[derive(Debug)]
pub(crate) struct Pencil<'a> {
    /// Index of the lines along the other of axes 1 and 2.
    pub(crate) other: usize,
    /// First index along axis 0.
    pub(crate) start: usize,
    /// The pieces, all of the same length.
    pub(crate) rows: Vec<&'a mut [f64]>,
}

/// Cuts `field` into pencils of at most `widest` lines along `axis` (1 or 2), in an order and with
/// widths that depend on the shape alone.
pub(crate) fn pencils(
    field: &mut [f64],
    shape: Shape,
    axis: usize,
    widest: usize,
) -> Vec<Pencil<'_>> {
    let [n0, n1, _] = shape.n;
    let (along, others) = if axis == 1 {
        (n1, shape.n[2])
    } else {
        (shape.n[2], n1)
    };
    let width = width(n0, others).min(widest);
    let pieces = n0.div_ceil(width);
    let mut pencils: Vec<Pencil<'_>> = (0..others * pieces)
        .map(|b| Pencil {
            other: b / pieces,
            start: b % pieces * width,
            rows: Vec::with_capacity(along),
        })
        .collect();
    for (r, row) in field.chunks_mut(n0).enumerate() {
        let other = if axis == 1 { r / n1 } else { r % n1 };
        for (piece, pencil) in row.chunks_mut(width).zip(&mut pencils[other * pieces..]) {
            pencil.rows.push(piece);
        }
    }
    pencils
}

/// Cuts `field` into groups of `width` places of axis 0: one piece for each row, in the order of
/// the rows.
pub(crate) fn columns(field: &mut [f64], shape: Shape, width: usize) -> Vec<Vec<&mut [f64]>> {
    let n0 = shape.n[0];
    let mut groups: Vec<Vec<&mut [f64]>> = Vec::new();
    groups.resize_with(n0.div_ceil(width), || Vec::with_capacity(shape.len() / n0));
    for row in field.chunks_mut(n0) {
        for (group, piece) in groups.iter_mut().zip(row.chunks_mut(width)) {
            group.push(piece);
        }
    }
    groups
}

/// Pencils that keep all cores of a large machine busy.
const ENOUGH: usize = 64;
/// Widths are multiples of this: the tile of the matrix product.
const STEP: usize = super::gemm::COLUMNS;

/// Width of the pencils: whole rows, unless there are few.
fn width(n0: usize, others: usize) -> usize {
    if others >= ENOUGH {
        return n0;
    }
    (n0 * others)
        .div_ceil(ENOUGH)
        .next_multiple_of(STEP)
        .min(n0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bundles_hold_every_value_once_in_its_place() {
        for n in [[70, 3, 5], [4, 1, 9], [33, 80, 2], [1, 1, 1]] {
            let shape = Shape::whole(n);
            let mut field: Vec<f64> = (0..shape.len()).map(|i| i as f64).collect();
            for axis in [1, 2] {
                let mut seen = 0;
                for pencil in pencils(&mut field, shape, axis, usize::MAX) {
                    assert_eq!(pencil.rows.len(), n[axis]);
                    for (i, row) in pencil.rows.iter().enumerate() {
                        let (j, k) = if axis == 1 {
                            (i, pencil.other)
                        } else {
                            (pencil.other, i)
                        };
                        assert_eq!(row[0], ((k * n[1] + j) * n[0] + pencil.start) as f64);
                        seen += row.len();
                    }
                }
                assert_eq!(seen, shape.len());
            }
        }
    }
}
