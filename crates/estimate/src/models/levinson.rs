//! Reflection and prediction coefficients of a real correlogram, fast: Schur's recursion with one division per order.
//!
//! Schur's recursion (Kailath 1986) carries two vectors instead of the inner products of Levinson's, so nothing waits
//! for a sum; the coefficients follow from the reflections by Levinson's update. Check: the complex Levinson
//! recursion in `autoregressive`, the Yule-Walker equations, and a stored window.

/// Solves the Yule-Walker equations of order `order` for a correlogram with more lags than that, lag 0 above 0; `work` grows to 4 p numbers.
/// Returns the coefficients a_1 .. a_p, the reflection coefficients k_1 .. k_p and the prediction error of the last order.
///
/// A reflection coefficient on or outside the unit circle stops the recursion; its size is the error.
pub(crate) fn reflect<'w>(
    correlogram: &[f64],
    order: usize,
    work: &'w mut Vec<f64>,
) -> Result<(&'w [f64], &'w [f64], f64), f64> {
    work.clear();
    work.extend_from_slice(&correlogram[1..=order]);
    work.extend_from_slice(&correlogram[..order]);
    work.resize(4 * order, 0.0);
    let (vectors, results) = work.split_at_mut(2 * order);
    let (ahead, behind) = vectors.split_at_mut(order);
    let (coefficients, reflection) = results.split_at_mut(order);
    for stage in 0..order {
        let k = -ahead[stage] / behind[0];
        if k.is_nan() || k.abs() >= 1.0 {
            return Err(k.abs());
        }
        reflection[stage] = k;
        for (ahead, behind) in ahead[stage..].iter_mut().zip(behind.iter_mut()) {
            let u = *ahead;
            let v = *behind;
            *ahead = u + k * v;
            *behind = v + k * u;
        }
        step_up(&mut coefficients[..=stage], k);
    }
    Ok((coefficients, reflection, behind[0]))
}

/// Levinson's update of the coefficients by one order; the last element is new.
fn step_up(coefficients: &mut [f64], k: f64) {
    let Some((last, old)) = coefficients.split_last_mut() else {
        return;
    };
    *last = k;
    let (low, high) = old.split_at_mut(old.len() / 2);
    let (middle, high) = if high.len() > low.len() {
        high.split_at_mut(1)
    } else {
        high.split_at_mut(0)
    };
    for a in middle {
        *a += k * *a;
    }
    for (a, b) in low.iter_mut().zip(high.iter_mut().rev()) {
        let x = *a;
        let y = *b;
        *a = x + k * y;
        *b = y + k * x;
    }
}
