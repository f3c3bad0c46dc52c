//! Inner loops of the pressure solvers on plain slices, compiled for several instruction sets.
//!
//! Sums run in eight fixed lanes, so that every instruction set gives the same bits.

use multiversion::multiversion;

/// Partial sums of a reduction.
const LANES: usize = 8;

/// Sum of eight lanes in a fixed order.
fn total(lanes: [f64; LANES]) -> f64 {
    ((lanes[0] + lanes[4]) + (lanes[2] + lanes[6]))
        + ((lanes[1] + lanes[5]) + (lanes[3] + lanes[7]))
}

/// `sum a b`.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sum = [0.0; LANES];
    for (a, b) in a.chunks(LANES).zip(b.chunks(LANES)) {
        for ((sum, a), b) in sum.iter_mut().zip(a).zip(b) {
            *sum += a * b;
        }
    }
    total(sum)
}

/// `sum a a`, `sum b b` and `sum a b`.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn three_dots(a: &[f64], b: &[f64]) -> [f64; 3] {
    let mut sums = [[0.0; LANES]; 3];
    let (a, a_rest) = a.as_chunks::<LANES>();
    let (b, b_rest) = b.as_chunks::<LANES>();
    for (a, b) in a.iter().zip(b) {
        for l in 0..LANES {
            sums[0][l] += a[l] * a[l];
            sums[1][l] += b[l] * b[l];
            sums[2][l] += a[l] * b[l];
        }
    }
    for (l, (a, b)) in a_rest.iter().zip(b_rest).enumerate() {
        sums[0][l] += a * a;
        sums[1][l] += b * b;
        sums[2][l] += a * b;
    }
    sums.map(total)
}

/// `(a, b) = (c a - s b, s a + c b)`.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn rotate(a: &mut [f64], b: &mut [f64], c: f64, s: f64) {
    for (a, b) in a.iter_mut().zip(b) {
        (*a, *b) = (c * *a - s * *b, s * *a + c * *b);
    }
}

/// Sum of the values.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn sum(values: &[f64]) -> f64 {
    let mut sum = [0.0; LANES];
    for values in values.chunks(LANES) {
        for (sum, value) in sum.iter_mut().zip(values) {
            *sum += value;
        }
    }
    total(sum)
}

/// `values *= scale / (shift + shifts)`, and zero where the divisor is.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn divide(values: &mut [f64], shift: f64, shifts: &[f64], scale: f64) {
    for (value, other) in values.iter_mut().zip(shifts) {
        let divisor = shift + other;
        *value = if divisor == 0.0 {
            0.0
        } else {
            *value * (scale / divisor)
        };
    }
}
