//! The dense kernel behind the bundled LAPACK symbols: Hermitian Jacobi rotations.
//!
//! Real and complex alike, for orders up to a few hundred. Check: residuals of the routines in `lapack`, on singular, tiny, empty
//! and padded matrices.

use ndarray_linalg::Scalar;

/// Sweeps after which the rotations have converged for any matrix met in practice (8 are usual).
const SWEEPS: usize = 60;

/// Eigenvalues, increasing, and eigenvectors of a Hermitian matrix given as a full square, order x order.
///
/// Cyclic Jacobi rotations (Golub and Van Loan, section 8.5). The vectors are the columns of the result.
/// Returns `None` if the matrix is not finite or the rotations do not converge.
pub(crate) fn jacobi<T: Scalar<Real = f64>>(
    mut a: Vec<T>,
    order: usize,
) -> Option<(Vec<f64>, Vec<T>)> {
    let mut v = vec![T::zero(); order * order];
    for k in 0..order {
        v[k * (order + 1)] = T::one();
    }
    let mut sweeps = 0;
    let mut rotated = true;
    while rotated {
        if sweeps == SWEEPS {
            return None;
        }
        sweeps += 1;
        rotated = false;
        for q in 1..order {
            for p in 0..q {
                rotated |= rotate(&mut a, &mut v, order, p, q)?;
            }
        }
    }
    let diagonal: Vec<f64> = (0..order).map(|k| a[k * (order + 1)].re()).collect();
    if diagonal.iter().any(|value| !value.is_finite()) {
        return None;
    }
    let mut increasing: Vec<usize> = (0..order).collect();
    increasing.sort_by(|&i, &j| diagonal[i].total_cmp(&diagonal[j]));
    let mut values = Vec::with_capacity(order);
    let mut vectors = Vec::with_capacity(order * order);
    for k in increasing {
        values.push(diagonal[k]);
        vectors.extend_from_slice(&v[k * order..(k + 1) * order]);
    }
    Some((values, vectors))
}

/// One rotation of columns p < q that annihilates a_pq; `Some(false)` if that element is negligible, `None` if it is not finite.
fn rotate<T: Scalar<Real = f64>>(
    a: &mut [T],
    v: &mut [T],
    order: usize,
    p: usize,
    q: usize,
) -> Option<bool> {
    let pp = p + p * order;
    let pq = p + q * order;
    let qp = q + p * order;
    let qq = q + q * order;
    let off = a[pq];
    let size = off.abs();
    if !size.is_finite() {
        return None;
    }
    let app = a[pp].re();
    let aqq = a[qq].re();
    // negligible: it cannot change either diagonal element any more
    if size <= f64::EPSILON * 0.25 * (app.abs() * aqq.abs()).sqrt() || size < f64::MIN_POSITIVE {
        return Some(false);
    }
    let phase = off.mul_real(size.recip());
    let theta = (aqq - app) / (2.0 * size);
    let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
    let c = t.hypot(1.0).recip();
    let s = t * c;
    // columns p and q of A and V times [[c, s phase], [-s conj(phase), c]]
    let up = phase.mul_real(s);
    let down = phase.conj().mul_real(s);
    for matrix in [&mut *a, &mut *v] {
        let (before, from_q) = matrix.split_at_mut(q * order);
        for (x, y) in before[p * order..(p + 1) * order]
            .iter_mut()
            .zip(&mut from_q[..order])
        {
            let new_x = x.mul_real(c) - *y * down;
            *y = *x * up + y.mul_real(c);
            *x = new_x;
        }
    }
    // rows p and q of A times the adjoint: A stays Hermitian
    for k in 0..order {
        // one after the other would differ where k is p or q
        let kp = a[k + p * order].conj();
        let kq = a[k + q * order].conj();
        a[p + k * order] = kp;
        a[q + k * order] = kq;
    }
    a[pq] = T::zero();
    a[qp] = T::zero();
    a[pp] = T::from_real(app - t * size);
    a[qq] = T::from_real(aqq + t * size);
    Some(true)
}
