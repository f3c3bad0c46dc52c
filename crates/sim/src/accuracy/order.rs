//! The order of an error, and the errors themselves, from runs at three spacings whose ratios need not be equal.
//!
//! With an error `C(t) h^p` the differences of neighbours have one shape in time, and `(h_3^p - h_2^p)/(h_2^p - h_1^p)` is the ratio of
//! their norms (Richardson). Check: series of known order; series that come to no limit.

/// Least and largest order that is believed.
const BELIEVED: [f64; 2] = [1.0, 6.0];
/// Least cosine between the differences of neighbours that counts as one shape.
const ALIKE: f64 = 0.8;
/// Relative difference that is rounding and the residual of the pressure.
const ROUNDING: f64 = 1e-9;

/// The order, infinite where all are the same and none where they do not converge, and the error of each, relative to the root mean
/// square of the first; `series` from the finest spacing on, at the same times. Without an order the finest is off by its difference
/// from the next one, the others by theirs from the finest besides.
pub(super) fn errors(spacings: &[f64], series: &[&[f64]]) -> (Option<f64>, Vec<f64>) {
    let count = series.iter().map(|own| own.len()).min().unwrap_or(0);
    let times: Vec<usize> = (0..count).filter(|t| series.iter().all(|own| own[*t].is_finite())).collect();
    let product = |a: &dyn Fn(usize) -> f64, b: &dyn Fn(usize) -> f64| times.iter().map(|t| a(*t) * b(*t)).sum::<f64>();
    let apart = |a: usize, b: usize| move |t: usize| series[b][t] - series[a][t];
    let scale = product(&|t| series[0][t], &|t| series[0][t]).sqrt();
    let distance = |a: usize, b: usize| product(&apart(a, b), &apart(a, b)).sqrt() / scale;
    if series.len() < 2 || times.is_empty() {
        return (None, vec![f64::NAN; series.len()]);
    }
    let finest = distance(0, 1);
    let off: Vec<f64> = (0..series.len()).map(|i| finest + if i == 0 { 0.0 } else { distance(0, i) }).collect();
    let [h1, h2, h3] = *spacings else { return (None, off) };
    if off.iter().all(|error| *error < ROUNDING) {
        return (Some(f64::INFINITY), off);
    }
    let cosine = product(&apart(0, 1), &apart(1, 2)) / (finest * distance(1, 2) * scale * scale);
    let ratio = |p: f64| (h3.powf(p) - h2.powf(p)) / (h2.powf(p) - h1.powf(p));
    let (found, [mut low, mut high]) = (distance(1, 2) / finest, BELIEVED);
    // What is no number converges as little.
    if !(cosine >= ALIKE && found >= ratio(low) && found <= ratio(high)) {
        return (None, off);
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        *(if ratio(middle) < found { &mut low } else { &mut high }) = middle;
    }
    let of = |h: f64| finest * h.powf(low) / (h2.powf(low) - h1.powf(low));
    (Some(low), spacings.iter().map(|h| of(*h)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPACINGS: [f64; 3] = [1.0, 1.47, 2.06];

    fn found(of: impl Fn(f64, f64) -> f64) -> (Option<f64>, Vec<f64>) {
        let series = SPACINGS.map(|h| (0..9).map(|t| of(f64::from(t), h)).collect::<Vec<f64>>());
        errors(&SPACINGS, &series.each_ref().map(Vec::as_slice))
    }

    #[test]
    fn orders_and_errors_of_power_laws_are_found() {
        for p in [1.2, 2.0, 4.0] {
            let (order, errors) = found(|t, h| (1.0 + 0.01 * t * h.powf(p)) * (-0.1 * t).exp());
            assert!((order.unwrap() / p - 1.0).abs() < 1e-9, "{order:?} {p}");
            let (mut off, mut all) = (0.0, 0.0);
            for t in 0..9 {
                let (t, decay) = (f64::from(t), (-0.2 * f64::from(t)).exp());
                off += (0.01 * t * SPACINGS[1].powf(p)).powi(2) * decay;
                all += (1.0 + 0.01 * t).powi(2) * decay;
            }
            assert!((errors[1] / (off / all).sqrt() - 1.0).abs() < 1e-9, "{errors:?}");
        }
    }

    #[test]
    fn what_comes_to_no_limit_has_no_order_and_the_difference_from_the_finest() {
        let constant = |at: [f64; 3]| move |_: f64, h: f64| at[SPACINGS.iter().position(|own| *own == h).unwrap()];
        // Back and forth; hardly less from mesh to mesh; faster than any scheme.
        for at in [[1.0, 1.02, 1.0], [1.0, 1.02, 1.021], [1.0, 1.0001, 1.02]] {
            let (order, errors) = found(constant(at));
            assert!(order.is_none() && (errors[0] - (at[1] - 1.0)).abs() < 1e-12, "{at:?} {order:?} {errors:?}");
            assert!((errors[2] - (at[1] - 1.0) - (at[2] - 1.0)).abs() < 1e-12, "{errors:?}");
        }
        // Of other shapes in time.
        assert_eq!(found(|t, h| if h > 2.0 { 1.0 + 0.01 * t } else { 1.0 + 0.001 * h * (3.0 * t).sin() }).0, None);
        assert_eq!(found(|t, _| 1.0 + t).0, Some(f64::INFINITY));
        let (order, errors) = super::errors(&SPACINGS[..1], &[&[1.0]]);
        assert!(order.is_none() && errors[0].is_nan());
    }
}
