//! Waves of Tollmien and Schlichting on Poiseuille's flow, from the equation of Orr and Sommerfeld.
//!
//! The mode `w = W(z) exp(i(alpha x - omega t))` satisfies
//! `(U - c)(D^2 - alpha^2) W - U'' W = (D^2 - alpha^2)^2 W/(i alpha Re)`, `c = omega/alpha`,
//! `W = W' = 0` at the plates. It is discretised by Chebyshev collocation; the mode is followed
//! from the known one at Re 7500, alpha 1 by inverse iteration.
//!
//! Check: `omega` at Re 7500 and 3000 and at the neutral point against tabulated values.

use num_complex::Complex;

use super::super::mesh::{Direction, Mesh};
use super::super::settings::{FlowSettings, TimeStep};
use super::channel::between_plates;
use super::{Case, Initial};
use crate::error::{Error, check};

type C64 = Complex<f64>;

/// Collocation points less one.
const ORDER: usize = 80;
/// Reynolds number of the mode from which others are followed.
const KNOWN_REYNOLDS: f64 = 7500.0;
/// Its wave number.
const KNOWN_ALPHA: f64 = 1.0;
/// Its frequency, that of the least stable mode.
const KNOWN_OMEGA: C64 = C64::new(0.249_891_536, 0.002_234_977);

/// The least stable mode of plane Poiseuille flow.
#[derive(Debug, Clone)]
pub struct TollmienSchlichting {
    /// Reynolds number of the half height and the centre velocity.
    pub reynolds: f64,
    /// Wave number along x, per half height.
    pub alpha: f64,
    /// Angular frequency; its imaginary part is the growth rate of the amplitude.
    pub omega: Complex<f64>,
    /// `W` at the Chebyshev points `cos(pi j/N)`, scaled so that the largest `|u|` is 1.
    w: Vec<C64>,
    u: Vec<C64>,
}

impl TollmienSchlichting {
    /// The mode at a Reynolds number and a wave number.
    ///
    /// # Errors
    /// Values outside 500 to 1e6 and 0.3 to 2; the mode lost on the way there.
    pub fn new(reynolds: f64, alpha: f64) -> Result<Self, Error> {
        check("reynolds", reynolds, "between 500 and 1e6", |r| {
            (500.0..=1e6).contains(&r)
        })?;
        check("alpha", alpha, "between 0.3 and 2", |a| {
            (0.3..=2.0).contains(&a)
        })?;
        // The mode is followed in small steps of both parameters.
        let reynolds_ratio = reynolds / KNOWN_REYNOLDS;
        let alpha_ratio = alpha / KNOWN_ALPHA;
        let distance = reynolds_ratio.ln().abs().max(alpha_ratio.ln().abs() * 4.0);
        let steps = (distance / 0.05).ceil().max(1.0) as i32;
        let reynolds_factor = reynolds_ratio.powf(1.0 / f64::from(steps));
        let alpha_factor = alpha_ratio.powf(1.0 / f64::from(steps));
        let mut step_reynolds = KNOWN_REYNOLDS;
        let mut step_alpha = KNOWN_ALPHA;
        let mut c = KNOWN_OMEGA / KNOWN_ALPHA;
        let mut w = Vec::new();
        for step in 1..=steps {
            if step == steps {
                step_reynolds = reynolds;
                step_alpha = alpha;
            } else {
                step_reynolds *= reynolds_factor;
                step_alpha *= alpha_factor;
            }
            (c, w) = inverse_iteration(step_reynolds, step_alpha, c)?;
        }
        let mut u = streamwise(&w, alpha);
        let largest = u.iter().map(|u| u.norm()).fold(0.0, f64::max);
        for value in w.iter_mut().chain(&mut u) {
            *value /= largest;
        }
        Ok(Self {
            reynolds,
            alpha,
            omega: c * alpha,
            w,
            u,
        })
    }

    /// Velocities `(u, w)` of the wave at a point and time zero, of amplitude 1.
    pub fn velocity(&self, x: f64, z: f64) -> (f64, f64) {
        let phase = C64::new(0.0, self.alpha * x).exp();
        (
            (interpolate(&self.u, z) * phase).re,
            (interpolate(&self.w, z) * phase).re,
        )
    }

    /// The wave with amplitude `amplitude` on Poiseuille's flow, one wave length long, held up by a
    /// force.
    ///
    /// # Errors
    /// Cells, stretching or step out of range.
    pub fn case(
        self,
        cells: [usize; 2],
        strength: f64,
        amplitude: f64,
        step_s: f64,
    ) -> Result<Case, Error> {
        let length = std::f64::consts::TAU / self.alpha;
        let plates = between_plates(cells[1], strength, [0.0; 2]);
        let mesh = Mesh::new(
            Direction::periodic(cells[0], 0.0, length),
            Direction::thin(1.0),
            plates,
        )?;
        let mut settings = FlowSettings::new(1.0 / self.reynolds, TimeStep::Fixed { step_s });
        settings.force_m_s2 = [2.0 / self.reynolds, 0.0, 0.0];
        Ok(Case {
            mesh,
            settings,
            initial: Initial::Field(Box::new(move |[x, _, z]| {
                let (u, w) = self.velocity(x, z);
                [1.0 - z.powi(2) + amplitude * u, 0.0, amplitude * w]
            })),
            end_s: 60.0,
        })
    }
}

/// Chebyshev points and differentiation matrix.
fn chebyshev() -> (Vec<f64>, Vec<Vec<f64>>) {
    let n = ORDER;
    let z: Vec<f64> = (0..=n)
        .map(|j| (std::f64::consts::PI * j as f64 / n as f64).cos())
        .collect();
    let mut weight = vec![1.0; n + 1];
    weight[0] = 2.0;
    weight[n] = 2.0;
    for odd in weight.iter_mut().skip(1).step_by(2) {
        *odd = -*odd;
    }
    let mut d = vec![vec![0.0; n + 1]; n + 1];
    for i in 0..=n {
        for j in 0..=n {
            if i != j {
                // Differences of cosines without cancellation.
                let half = 0.5 * std::f64::consts::PI / n as f64;
                let difference =
                    -2.0 * (half * (i + j) as f64).sin() * (half * (i as f64 - j as f64)).sin();
                d[i][j] = weight[i] / weight[j] / difference;
            }
        }
        d[i][i] = -d[i].iter().sum::<f64>();
    }
    (z, d)
}

fn product(a: &[Vec<f64>], b: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let n = a.len();
    let mut out = vec![vec![0.0; n]; n];
    for (out, a) in out.iter_mut().zip(a) {
        for (a, b) in a.iter().zip(b) {
            for (out, b) in out.iter_mut().zip(b) {
                *out += a * b;
            }
        }
    }
    out
}

/// The eigenvalue `c` nearest to the guess, and `W`.
fn inverse_iteration(reynolds: f64, alpha: f64, guess: C64) -> Result<(C64, Vec<C64>), Error> {
    let (z, d) = chebyshev();
    let d2 = product(&d, &d);
    let d4 = product(&d2, &d2);
    let n = z.len();
    let a2 = alpha * alpha;
    let viscous = C64::new(0.0, -1.0 / (alpha * reynolds));
    let mut b = vec![vec![C64::ZERO; n]; n];
    let mut shifted = b.clone();
    for i in 0..n {
        for j in 0..n {
            let one = f64::from(u8::from(i == j));
            // Rows 0, 1, n - 2, n - 1 hold W = W' = 0 at the plates.
            let is_boundary = i < 2 || i + 2 >= n;
            let a = if is_boundary {
                let wall = if i < 2 { 0 } else { n - 1 };
                let is_derivative = i == 1 || i + 2 == n;
                C64::from(if is_derivative {
                    d[wall][j]
                } else {
                    f64::from(u8::from(j == wall))
                })
            } else {
                let laplacian = d2[i][j] - a2 * one;
                b[i][j] = C64::from(laplacian);
                let speed = 1.0 - z[i] * z[i];
                C64::from(speed * laplacian + 2.0 * one)
                    - viscous * (d4[i][j] - 2.0 * a2 * d2[i][j] + a2 * a2 * one)
            };
            shifted[i][j] = a - guess * b[i][j];
        }
    }
    let (factors, order) = factorised(shifted);
    let mut w: Vec<C64> = z.iter().map(|z| C64::from((1.0 - z * z).powi(2))).collect();
    let mut c = guess;
    for _ in 0..60 {
        let mut right = Vec::with_capacity(n);
        for row in &b {
            right.push(row.iter().zip(&w).map(|(b, w)| b * w).sum());
        }
        let next = solved(&factors, &order, &right);
        let norm: C64 = next.iter().zip(&w).map(|(x, w)| x * w.conj()).sum();
        let square: f64 = w.iter().map(|w| w.norm_sqr()).sum();
        let found = guess + C64::from(square) / norm;
        let scale = next.iter().map(|x| x.norm()).fold(0.0, f64::max);
        w = next.into_iter().map(|x| x / scale).collect();
        if (found - c).norm() < 1e-13 {
            return Ok((found, w));
        }
        c = found;
    }
    Err(Error::OutOfRange {
        field: "alpha",
        value: alpha,
        allowed: "such that the mode can be followed from alpha 1, Re 7500",
    })
}

/// `u = i D w/alpha` from continuity.
fn streamwise(w: &[C64], alpha: f64) -> Vec<C64> {
    let (_, d) = chebyshev();
    let factor = C64::new(0.0, 1.0 / alpha);
    let mut u = Vec::with_capacity(w.len());
    for row in d {
        let derivative: C64 = row.iter().zip(w).map(|(d, w)| w * *d).sum();
        u.push(factor * derivative);
    }
    u
}

/// Barycentric interpolation from the Chebyshev points.
fn interpolate(values: &[C64], z: f64) -> C64 {
    let n = values.len() - 1;
    let mut above = C64::ZERO;
    let mut below = 0.0;
    for (j, value) in values.iter().enumerate() {
        let node = (std::f64::consts::PI * j as f64 / n as f64).cos();
        if (z - node).abs() < 1e-15 {
            return *value;
        }
        let weight = if j == 0 || j == n { 0.5 } else { 1.0 }
            * if j.is_multiple_of(2) { 1.0 } else { -1.0 }
            / (z - node);
        above += value * weight;
        below += weight;
    }
    above / below
}

/// Factors of a dense complex matrix with partial pivoting, and the order of its rows.
fn factorised(mut rows: Vec<Vec<C64>>) -> (Vec<Vec<C64>>, Vec<usize>) {
    let n = rows.len();
    let mut order: Vec<usize> = (0..n).collect();
    for k in 0..n {
        let best = (k..n)
            .max_by(|&a, &b| rows[a][k].norm().total_cmp(&rows[b][k].norm()))
            .unwrap_or(k);
        rows.swap(k, best);
        order.swap(k, best);
        let (head, tail) = rows.split_at_mut(k + 1);
        let pivot = &head[k];
        for row in tail {
            let factor = row[k] / pivot[k];
            row[k] = factor;
            for (x, p) in row[k + 1..].iter_mut().zip(&pivot[k + 1..]) {
                *x -= factor * p;
            }
        }
    }
    (rows, order)
}

/// Solves with the factors.
fn solved(factors: &[Vec<C64>], order: &[usize], right: &[C64]) -> Vec<C64> {
    let n = right.len();
    let mut x: Vec<C64> = order.iter().map(|&i| right[i]).collect();
    for i in 0..n {
        let sum: C64 = factors[i][..i].iter().zip(&x).map(|(l, x)| l * x).sum();
        x[i] -= sum;
    }
    for i in (0..n).rev() {
        let sum: C64 = factors[i][i + 1..]
            .iter()
            .zip(&x[i + 1..])
            .map(|(u, x)| u * x)
            .sum();
        x[i] = (x[i] - sum) / factors[i][i];
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frequencies_agree_with_tabulated_ones() {
        // Malik, Zang and Hussaini (1985); Orszag (1971): the neutral point; an independent
        // collocation code, good to 1e-7.
        for (reynolds, alpha, re, im, within) in [
            (7500.0, 1.0, 0.249_891_536, 0.002_234_977, 5e-9),
            (5772.22, 1.02056, 0.269_429_611, 0.0, 5e-9),
            (3000.0, 1.0, 0.292_289_126, -0.010_184_469, 2e-7),
        ] {
            let omega = TollmienSchlichting::new(reynolds, alpha).unwrap().omega;
            assert!(
                (omega.re - re).abs() < within && (omega.im - im).abs() < within,
                "{reynolds}: {omega}"
            );
        }
    }

    #[test]
    fn the_wave_is_free_of_divergence_and_sticks_to_the_plates() {
        let mode = TollmienSchlichting::new(7500.0, 1.0).unwrap();
        let h = 1e-5;
        for (x, z) in [(0.3, 0.2), (1.1, -0.93), (2.0, 0.7)] {
            let by_x = (mode.velocity(x + h, z).0 - mode.velocity(x - h, z).0) / (2.0 * h);
            let by_z = (mode.velocity(x, z + h).1 - mode.velocity(x, z - h).1) / (2.0 * h);
            assert!((by_x + by_z).abs() < 1e-7, "{by_x} + {by_z}");
        }
        for z in [-1.0, 1.0] {
            let (u, w) = mode.velocity(0.4, z);
            assert!(u.abs() < 1e-8 && w.abs() < 1e-10);
        }
    }

    #[test]
    fn what_cannot_be_followed_is_refused() {
        assert!(
            TollmienSchlichting::new(10.0, 1.0).is_err()
                && TollmienSchlichting::new(7500.0, f64::NAN).is_err()
        );
    }
}
