//! Kernels on rows of memory axis 0. They are inlined into functions that are compiled for several
//! instruction sets; products and sums are kept apart, so that each version gives the same bits.
//!
//! Check: the places of a shape (tests of `shape`).

use super::operators_1d::Taps;
use super::transport::{MEAN, Stencil};

/// Some rows of an array, cut to `n` values. Closures given to `map` or `from_fn` stay calls in
/// functions that are compiled for several instruction sets.
macro_rules! cut_rows {
    ($rows:expr, $n:expr, $($place:literal)+) => { [$(&$rows[$place][..$n]),+] };
}

/// The parts of a row from some places on.
macro_rules! from_places {
    ($row:expr, $($place:expr),+) => { [$(&$row[$place..]),+] };
}

pub(crate) use {cut_rows, from_places};

/// Values before and after a padded row.
pub(crate) const HALO: usize = 4;

/// A banded operator along axis 0: for each offset one coefficient per column.
#[derive(Debug, Clone, Default)]
pub(crate) struct Columns {
    bands: Vec<(usize, Vec<f64>)>,
}

impl Columns {
    /// The operator with the rows `rows`, whose taps are at most [`HALO`] away, in the periodic
    /// sense if `periodic`.
    pub(crate) fn new(rows: &[Taps], periodic: bool) -> Self {
        let n = rows.len();
        let mut bands = vec![vec![0.0; n]; 2 * HALO + 1];
        for (i, row) in rows.iter().enumerate() {
            for &(index, c) in row {
                // A wrapped tap belongs to the offset that the padded row shows it at.
                let band = if periodic {
                    (index + HALO + n - i) % n
                } else {
                    (index + HALO).wrapping_sub(i)
                };
                if let Some(coefficients) = bands.get_mut(band) {
                    coefficients[i] += c;
                }
            }
        }
        let mut used = Vec::new();
        for (offset, band) in bands.into_iter().enumerate() {
            if band.iter().any(|c| *c != 0.0) {
                used.push((offset, band));
            }
        }
        Self { bands: used }
    }

    /// `out += self padded`.
    #[inline(always)]
    pub(crate) fn add(&self, out: &mut [f64], padded: &[f64]) {
        let mut bands = self.bands.as_slice();
        while let [a, b, c, d, rest @ ..] = bands {
            add_products(
                out,
                [&a.1, &b.1, &c.1, &d.1],
                from_places!(padded, a.0, b.0, c.0, d.0),
            );
            bands = rest;
        }
        for (offset, coefficient) in bands {
            let values = &padded[*offset..];
            for ((out, c), x) in out.iter_mut().zip(coefficient).zip(values) {
                *out += c * x;
            }
        }
    }

    /// Sums of squares of the `n` rows.
    pub(crate) fn squares(&self, n: usize) -> Vec<f64> {
        let mut squares = Vec::with_capacity(n);
        for i in 0..n {
            squares.push(self.bands.iter().map(|band| band.1[i] * band.1[i]).sum());
        }
        squares
    }

    /// `out -= mass self (padded - own)`, `own` being the middle of `padded`: nothing at all for a
    /// constant if the rows sum to zero. The operations are fused, on every machine.
    #[inline(always)]
    pub(crate) fn subtract_differences(
        &self,
        out: &mut [f64],
        mass: f64,
        own: &[f64],
        padded: &[f64],
    ) {
        let n = out.len();
        let own = &own[..n];
        for (offset, coefficient) in self.bands.iter().filter(|band| band.0 != HALO) {
            let c = &coefficient[..n];
            let x = &padded[*offset..offset + n];
            for i in 0..n {
                out[i] = (-mass * c[i]).mul_add(x[i] - own[i], out[i]);
            }
        }
    }
}

#[inline(always)]
fn add_products(out: &mut [f64], c: [&[f64]; 4], x: [&[f64]; 4]) {
    let n = out.len();
    let [c0, c1, c2, c3] = cut_rows!(c, n, 0 1 2 3);
    let [x0, x1, x2, x3] = cut_rows!(x, n, 0 1 2 3);
    for i in 0..n {
        out[i] += (c0[i] * x0[i] + c1[i] * x1[i]) + (c2[i] * x2[i] + c3[i] * x3[i]);
    }
}

/// Copies `row` between its halos: wrapped if `periodic`, else zero.
#[inline(always)]
pub(crate) fn pad(padded: &mut [f64], row: &[f64], periodic: bool) {
    let n = row.len();
    padded[HALO..HALO + n].copy_from_slice(row);
    wrap(padded, n, periodic);
}

/// Fills the halos of a padded row of `n` values.
#[inline(always)]
pub(crate) fn wrap(padded: &mut [f64], n: usize, periodic: bool) {
    if periodic && n >= HALO {
        padded.copy_within(n..n + HALO, 0);
        padded.copy_within(HALO..2 * HALO, HALO + n);
    } else if periodic {
        for h in 0..HALO {
            // One value is its own neighbour on both sides.
            padded[HALO - 1 - h] = padded[HALO + n - 1 - h % n];
            padded[HALO + n + h] = padded[HALO + h % n];
        }
    } else {
        padded[..HALO].fill(0.0);
        padded[HALO + n..HALO + n + HALO].fill(0.0);
    }
}

/// `out += scale sum c row` over the taps of an operator across rows.
#[inline(always)]
pub(crate) fn add_across(
    out: &mut [f64],
    field: &[f64],
    scale: f64,
    mut taps: &[(usize, f64)],
    starts: RowOffsets,
) {
    let n = out.len();
    while let [a, b, c, d, rest @ ..] = taps {
        let x0 = &field[starts.start(a.0)..][..n];
        let x1 = &field[starts.start(b.0)..][..n];
        let x2 = &field[starts.start(c.0)..][..n];
        let x3 = &field[starts.start(d.0)..][..n];
        let [a, b, c, d] = [scale * a.1, scale * b.1, scale * c.1, scale * d.1];
        for i in 0..n {
            out[i] += (a * x0[i] + b * x1[i]) + (c * x2[i] + d * x3[i]);
        }
        taps = rest;
    }
    for tap in taps {
        let c = scale * tap.1;
        for (out, x) in out.iter_mut().zip(&field[starts.start(tap.0)..][..n]) {
            *out += c * x;
        }
    }
}

/// The rows of indices `first` to `first + N`, which are taken round a period of `count`.
#[inline(always)]
pub(crate) fn rows_from<const N: usize>(
    field: &[f64],
    n: usize,
    starts: RowOffsets,
    first: usize,
    count: usize,
) -> [&[f64]; N] {
    let mut rows: [&[f64]; N] = [&[]; N];
    for (offset, row) in rows.iter_mut().enumerate() {
        *row = &field[starts.start(round(first + offset, count))..][..n];
    }
    rows
}

/// An index within a period of `count`, from which it is not far.
#[inline(always)]
pub(crate) fn round(mut index: usize, count: usize) -> usize {
    while index >= count {
        index -= count;
    }
    index
}

/// `out += scale transport`, by the formula of the interior: fluxes `g` at -1, 0, 1, 2 and values
/// `q` at -3 to 3.
#[inline(always)]
pub(crate) fn add_transport(
    out: &mut [f64],
    scale: f64,
    stencil: Stencil,
    g: &[&[f64]; 4],
    q: &[&[f64]; 7],
) {
    let n = out.len();
    let [g0, g1, g2, g3] = cut_rows!(g, n, 0 1 2 3);
    let [q0, q1, q2, q4, q5, q6] = cut_rows!(q, n, 0 1 2 4 5 6);
    let a = scale * stencil.near[0];
    let b = scale * stencil.near[1];
    let c = scale * stencil.near[2];
    let d = scale * stencil.far[0];
    let e = scale * stencil.far[1];
    let f = scale * stencil.far[2];
    if stencil.is_plain() {
        for i in 0..n {
            out[i] += b * (g2[i] * q4[i] - g1[i] * q2[i]) + f * (g3[i] * q6[i] - g0[i] * q0[i]);
        }
        return;
    }
    for i in 0..n {
        let after = [
            a * q2[i] + (b * q4[i] + c * q5[i]),
            d * q4[i] + (e * q5[i] + f * q6[i]),
        ];
        let before = [
            a * q4[i] + (b * q2[i] + c * q1[i]),
            d * q2[i] + (e * q1[i] + f * q0[i]),
        ];
        out[i] += (g2[i] * after[0] - g1[i] * before[0]) + (g3[i] * after[1] - g0[i] * before[1]);
    }
}

/// `out += sum_d c_d (q_d + q_-d - 2 q)` of the values at -3 to 3: nothing at all for a constant.
#[inline(always)]
pub(crate) fn add_even(out: &mut [f64], c: [f64; 3], q: &[&[f64]; 7]) {
    let n = out.len();
    let [q0, q1, q2, q3, q4, q5, q6] = cut_rows!(q, n, 0 1 2 3 4 5 6);
    for i in 0..n {
        let own = q3[i];
        let near = (q2[i] - own) + (q4[i] - own);
        let middle = (q1[i] - own) + (q5[i] - own);
        let far = (q0[i] - own) + (q6[i] - own);
        out[i] += c[0] * near + (c[1] * middle + c[2] * far);
    }
}

/// `out = scale` times the fourth-order mean of the values at -2 to 1: a constant stays itself.
#[inline(always)]
pub(crate) fn even_mean(out: &mut [f64], scale: f64, q: &[&[f64]; 4]) {
    let n = out.len();
    let [q0, q1, q2, q3] = cut_rows!(q, n, 0 1 2 3);
    let far = -MEAN[0];
    for i in 0..n {
        let low = q1[i];
        let high = q2[i];
        out[i] = scale * (0.5 * (low + high) + far * ((low - q0[i]) + (high - q3[i])));
    }
}

/// `out += scale g q`.
#[inline(always)]
pub(crate) fn add_product(out: &mut [f64], scale: f64, g: &[f64], q: &[f64]) {
    for ((out, g), q) in out.iter_mut().zip(g).zip(q) {
        *out += scale * g * q;
    }
}

/// Where the rows of some index begin in an array: numbers that are copied, not closures, which
/// would stay calls in functions that are compiled for several instruction sets.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RowOffsets {
    /// That of index 0 in an array that goes on downwards.
    pub(crate) first: usize,
    pub(crate) step: usize,
    /// Index below which rows lie `round` further.
    pub(crate) lowest: usize,
    pub(crate) round: usize,
}

impl RowOffsets {
    /// Rows of `step` values, of which that of index `lowest` is the first.
    #[inline(always)]
    pub(crate) fn every(step: usize, lowest: usize) -> Self {
        Self {
            first: 0_usize.wrapping_sub(lowest * step),
            step,
            lowest: 0,
            round: 0,
        }
    }

    /// Where the row of index `i` begins.
    #[inline(always)]
    pub(crate) fn start(self, i: usize) -> usize {
        let start = self.first.wrapping_add(i * self.step);
        if i < self.lowest {
            start.wrapping_add(self.round)
        } else {
            start
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_apply_the_rows_with_and_without_wrapping() {
        for (n, periodic) in [(9, true), (5, true), (4, true), (9, false)] {
            let index = |i: usize, o: isize| (i as isize + o).rem_euclid(n as isize) as usize;
            let rows: Vec<Taps> = (0..n)
                .map(|i| {
                    (-2..=2)
                        .map(|o| (index(i, o), (i as f64) + 0.1 * o as f64))
                        .collect::<Taps>()
                })
                .map(|row| {
                    if periodic {
                        row
                    } else {
                        row.into_iter().take(1).filter(|t| t.0 + 2 < n).collect()
                    }
                })
                .collect();
            let x: Vec<f64> = (0..n).map(|i| ((3 * i) as f64).cos()).collect();
            let mut padded = vec![0.0; n + 2 * HALO];
            pad(&mut padded, &x, periodic);
            let mut out = vec![0.0; n];
            Columns::new(&rows, periodic).add(&mut out, &padded);
            for (i, row) in rows.iter().enumerate() {
                let reachable = |j: usize| periodic || j.abs_diff(i) <= HALO;
                let expected: f64 = row
                    .iter()
                    .filter(|t| reachable(t.0))
                    .map(|&(j, c)| c * x[j])
                    .sum();
                assert!((out[i] - expected).abs() < 1e-14, "n = {n}, row {i}");
            }
        }
    }
}
