//! Quadratures, small matrices and special functions, in their plainest form.

/// Integral by Gauss-Legendre rules of eight points on equal panels.
pub(crate) fn integral(from: f64, to: f64, panels: usize, f: impl Fn(f64) -> f64) -> f64 {
    const NODES: [f64; 4] = [
        0.183_434_642_495_649_8,
        0.525_532_409_916_329,
        0.796_666_477_413_626_7,
        0.960_289_856_497_536_3,
    ];
    const WEIGHTS: [f64; 4] = [
        0.362_683_783_378_362,
        0.313_706_645_877_887_3,
        0.222_381_034_453_374_48,
        0.101_228_536_290_376_26,
    ];
    let half = 0.5 * (to - from) / panels as f64;
    let mut sum = 0.0;
    for panel in 0..panels {
        let middle = from + half * (2 * panel + 1) as f64;
        for (node, weight) in NODES.iter().zip(WEIGHTS) {
            sum += weight * (f(middle - half * node) + f(middle + half * node));
        }
    }
    half * sum
}

/// Straight lines between the points of a table, beyond its ends the end values.
pub(crate) fn straight(x: &[f64], y: &[f64], at: f64) -> f64 {
    match x.iter().position(|&known| known >= at) {
        None => y[y.len() - 1],
        Some(0) => y[0],
        Some(i) => y[i - 1] + (y[i] - y[i - 1]) * (at - x[i - 1]) / (x[i] - x[i - 1]),
    }
}

/// A number of a Hermitian matrix; real matrices have no imaginary parts.
pub(crate) type Complex = num_complex::Complex<f64>;

/// tr(R^-1 D R^-1 D) for a Hermitian positive definite R, by its Cholesky factor.
pub(crate) fn information(r: &[Vec<Complex>], d: &[Vec<Complex>]) -> f64 {
    let n = r.len();
    let mut l = vec![vec![Complex::default(); n]; n];
    for j in 0..n {
        for i in j..n {
            let mut sum = r[i][j];
            for k in 0..j {
                sum -= l[i][k] * l[j][k].conj();
            }
            l[i][j] = if i == j {
                Complex::from(sum.re.sqrt())
            } else {
                sum / l[j][j]
            };
        }
    }
    // L^-1 D, column by column; then L^-1 (L^-1 D)^H = L^-1 D L^-H, whose squares sum to the trace.
    let solved = |columns: &dyn Fn(usize, usize) -> Complex| {
        let mut out = vec![vec![Complex::default(); n]; n];
        for column in 0..n {
            for i in 0..n {
                let mut sum = columns(i, column);
                for k in 0..i {
                    sum -= l[i][k] * out[k][column];
                }
                out[i][column] = sum / l[i][i];
            }
        }
        out
    };
    let half = solved(&|i, column| d[i][column]);
    let whole = solved(&|i, column| half[column][i].conj());
    whole.iter().flatten().map(|z| z.norm_sqr()).sum()
}

/// Mean of numbers.
pub(crate) fn average(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Mean of numbers and its standard error, from their scatter.
pub(crate) fn average_and_error(values: &[f64]) -> (f64, f64) {
    let (n, mean) = (values.len() as f64, average(values));
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}
