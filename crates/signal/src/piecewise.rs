//! A complex function of time made of cubic pieces between knots, zero outside: a sampled envelope.
//!
//! Check: a spline through a cubic with vanishing curvature at its ends is that cubic; moments are
//! those of closed forms.

use std::f64::consts::PI;

use num_complex::Complex;

/// Abscissae on (0, 1) and weights of the 5-point Gauss-Legendre rule, exact for `t^2 |f|^2`
/// of cubic pieces.
const GAUSS: [(f64, f64); 5] = [
    (0.046_910_077_030_668, 0.118_463_442_528_094_54),
    (0.230_765_344_947_158_45, 0.239_314_335_249_683_23),
    (0.5, 0.284_444_444_444_444_44),
    (0.769_234_655_052_841_6, 0.239_314_335_249_683_23),
    (0.953_089_922_969_332, 0.118_463_442_528_094_54),
];

/// Knots this evenly spaced, in fractions of a step, are found without a search.
const EVEN: f64 = 1e-9;

/// Integrals of an envelope over time: of `|f|^2` and of its spectrum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Moments {
    /// Integral of `|f|^2`.
    pub(crate) energy: f64,
    /// Mean time, weighted with `|f|^2`.
    pub(crate) mean_s: f64,
    /// Mean square time.
    pub(crate) square_s2: f64,
    /// Mean frequency of the spectrum.
    pub(crate) mean_hz: f64,
    /// Mean square frequency.
    pub(crate) square_hz2: f64,
}

/// Cubic pieces `c0 + c1 u + c2 u^2 + c3 u^3`, `u` from 0 to 1 in each interval.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Piecewise {
    knots_s: Vec<f64>,
    even: bool,
    pieces: Vec<[Complex<f64>; 4]>,
}

impl Piecewise {
    /// The cubic spline through the values, without curvature at both ends. The knots increase;
    /// there are as many values, two or more.
    pub(crate) fn spline(knots_s: Vec<f64>, values: &[Complex<f64>]) -> Self {
        let curvature = natural_curvature(&knots_s, values);
        let mut pieces = Vec::with_capacity(values.len() - 1);
        for i in 0..values.len() - 1 {
            let square = (knots_s[i + 1] - knots_s[i]).powi(2);
            let a = curvature[i] * square;
            let b = curvature[i + 1] * square;
            pieces.push([
                values[i],
                values[i + 1] - values[i] - (a * 2.0 + b) / 6.0,
                a * 0.5,
                (b - a) / 6.0,
            ]);
        }
        Self {
            even: is_even(&knots_s),
            knots_s,
            pieces,
        }
    }

    /// First and last knot \[s\].
    pub(crate) fn support_s(&self) -> (f64, f64) {
        (self.knots_s[0], self.knots_s[self.knots_s.len() - 1])
    }

    /// The value at a time; zero outside the knots.
    pub(crate) fn value(&self, time_s: f64) -> Complex<f64> {
        let (first, last) = self.support_s();
        if !(time_s >= first && time_s <= last) {
            return Complex::ZERO;
        }
        let end = self.pieces.len() - 1;
        let index = if self.even {
            ((time_s - first) / (last - first) * self.pieces.len() as f64) as usize
        } else {
            self.knots_s
                .partition_point(|knot| *knot <= time_s)
                .saturating_sub(1)
        };
        let index = index.min(end);
        let start = self.knots_s[index];
        let u = (time_s - start) / (self.knots_s[index + 1] - start);
        piece_value(&self.pieces[index], u)
    }

    /// Multiplies the function.
    pub(crate) fn scale(&mut self, factor: f64) {
        for coefficient in self.pieces.iter_mut().flatten() {
            *coefficient *= factor;
        }
    }

    /// Moves the function to later times.
    pub(crate) fn shift(&mut self, delay_s: f64) {
        for knot in &mut self.knots_s {
            *knot += delay_s;
        }
    }

    /// Energy of each piece.
    fn energies(&self) -> Vec<f64> {
        let mut energies = Vec::with_capacity(self.pieces.len());
        for (piece, knots) in self.pieces.iter().zip(self.knots_s.windows(2)) {
            let powers = GAUSS
                .iter()
                .map(|&(u, weight)| weight * piece_value(piece, u).norm_sqr());
            energies.push((knots[1] - knots[0]) * powers.sum::<f64>());
        }
        energies
    }

    /// Drops pieces from both ends with at most the fraction `lost` of the energy on each side.
    pub(crate) fn trim(&mut self, lost: f64) {
        let energies = self.energies();
        let limit = lost * energies.iter().sum::<f64>();
        let front = count_up_to(energies.iter(), limit);
        let back = count_up_to(energies.iter().rev(), limit);
        if front + back < self.pieces.len() {
            self.pieces = self.pieces[front..self.pieces.len() - back].to_vec();
            self.knots_s = self.knots_s[front..self.knots_s.len() - back].to_vec();
        }
    }

    /// The integrals of the function; the means are not numbers if it has no energy.
    pub(crate) fn moments(&self) -> Moments {
        let mut energy = 0.0;
        let mut mean_s = 0.0;
        let mut square_s2 = 0.0;
        let mut mean_hz = 0.0;
        let mut square_hz2 = 0.0;
        for (piece, knots) in self.pieces.iter().zip(self.knots_s.windows(2)) {
            let step_s = knots[1] - knots[0];
            let [_, c1, c2, c3] = *piece;
            for (u, weight) in GAUSS {
                let time_s = knots[0] + u * step_s;
                let weight = weight * step_s;
                let f = piece_value(piece, u);
                let slope = (c1 + (c2 * 2.0 + c3 * (3.0 * u)) * u) / (2.0 * PI * step_s);
                let power = weight * f.norm_sqr();
                energy += power;
                mean_s += power * time_s;
                square_s2 += power * time_s * time_s;
                mean_hz += weight * (f.conj() * slope).im;
                square_hz2 += weight * slope.norm_sqr();
            }
        }
        Moments {
            energy,
            mean_s: mean_s / energy,
            square_s2: square_s2 / energy,
            mean_hz: mean_hz / energy,
            square_hz2: square_hz2 / energy,
        }
    }
}

/// Value of a piece at the fraction `u` of its length.
fn piece_value([c0, c1, c2, c3]: &[Complex<f64>; 4], u: f64) -> Complex<f64> {
    c0 + (c1 + (c2 + c3 * u) * u) * u
}

/// Number of leading energies whose sum is at most `limit`.
fn count_up_to<'a>(energies: impl Iterator<Item = &'a f64>, limit: f64) -> usize {
    let mut sum = 0.0;
    energies
        .take_while(|energy| {
            sum += **energy;
            sum <= limit
        })
        .count()
}

/// Whether the knots are evenly spaced.
fn is_even(knots_s: &[f64]) -> bool {
    let step_s = (knots_s[knots_s.len() - 1] - knots_s[0]) / (knots_s.len() - 1) as f64;
    let mut largest_s = 0.0_f64;
    for (i, knot) in knots_s.iter().enumerate() {
        let deviation_s = (knot - knots_s[0] - i as f64 * step_s).abs();
        largest_s = largest_s.max(deviation_s);
    }
    largest_s <= EVEN * step_s
}

/// Second derivatives of the natural cubic spline at its knots (Thomas algorithm; the system is
/// diagonally dominant).
fn natural_curvature(knots_s: &[f64], values: &[Complex<f64>]) -> Vec<Complex<f64>> {
    let count = values.len();
    let mut curvature = vec![Complex::ZERO; count];
    let mut upper = vec![0.0; count];
    for i in 1..count - 1 {
        let before = knots_s[i] - knots_s[i - 1];
        let after = knots_s[i + 1] - knots_s[i];
        let bend = (values[i + 1] - values[i]) / after - (values[i] - values[i - 1]) / before;
        let pivot = 2.0 * (before + after) - before * upper[i - 1];
        upper[i] = after / pivot;
        curvature[i] = (bend * 6.0 - curvature[i - 1] * before) / pivot;
    }
    for i in (1..count - 1).rev() {
        let next = curvature[i + 1];
        curvature[i] -= next * upper[i];
    }
    curvature
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn a_spline_through_a_cubic_without_end_curvature_is_that_cubic() {
        // x^3 - 3 x^2 on [1, 1 + 2]: second derivative 6 x - 6 vanishes at x = 1; mirror it to
        // get a second end.
        let cubic = |x: f64| Complex::new((x - 1.0).powi(3) - 2.0 * x, 3.0 * x);
        let knots = vec![0.0, 0.1, 0.35, 0.7, 1.0];
        let values: Vec<_> = knots.iter().map(|x| cubic(*x)).collect();
        let curvature = natural_curvature(&knots, &values);
        let spline = Piecewise::spline(knots, &values);
        // Natural at x = 1 is right, at x = 0 it is wrong by 6; the error dies out by 3.7 per knot.
        assert!((spline.value(0.9) - cubic(0.9)).norm() < 0.02);
        assert_relative_eq!(curvature[3].re, 6.0 * (0.7 - 1.0), epsilon = 0.5);
        let straight = Piecewise::spline(
            vec![0.0, 0.3, 1.0],
            &[0.0, 0.6, 2.0].map(|x| Complex::new(x, -x)),
        );
        assert!((straight.value(0.8) - Complex::new(1.6, -1.6)).norm() < 1e-15);
    }

    #[test]
    fn a_spline_converges_with_the_fourth_power_of_the_step() {
        let f = |t: f64| Complex::from_polar((-t * t).exp(), 2.0 * t);
        let error = |points: usize| {
            let knots: Vec<f64> = (0..points)
                .map(|i| -6.0 + 12.0 * i as f64 / (points - 1) as f64)
                .collect();
            let values: Vec<_> = knots.iter().map(|t| f(*t)).collect();
            let spline = Piecewise::spline(knots, &values);
            (0..997)
                .map(|i| f64::from(i) / 166.1 - 3.0)
                .map(|t| (spline.value(t) - f(t)).norm())
                .fold(0.0, f64::max)
        };
        let order = (error(61) / error(121)).log2();
        assert!((order - 4.0).abs() < 0.3, "{order}");
    }

    #[test]
    fn moments_are_those_of_a_chirped_gaussian() {
        let sigma = 1.3;
        let chirp = 0.4;
        let offset = 0.7;
        let delay = 0.5;
        let f = |t: f64| {
            let x = t - delay;
            Complex::from_polar(
                (-0.5 * (x / sigma).powi(2)).exp(),
                PI * chirp * x * x + 2.0 * PI * offset * x,
            )
        };
        let knots: Vec<f64> = (0..4001).map(|i| -10.0 + f64::from(i) / 200.0).collect();
        let values: Vec<_> = knots.iter().map(|t| f(*t)).collect();
        let moments = Piecewise::spline(knots, &values).moments();
        let variance = 0.5 * sigma * sigma;
        assert_relative_eq!(moments.energy, PI.sqrt() * sigma, max_relative = 1e-6);
        assert_relative_eq!(moments.mean_s, delay, max_relative = 1e-6);
        assert_relative_eq!(
            moments.square_s2,
            variance + delay * delay,
            max_relative = 1e-6
        );
        assert_relative_eq!(moments.mean_hz, offset, max_relative = 1e-6);
        let spread = 1.0 / (8.0 * PI * PI * sigma * sigma) + chirp * chirp * variance;
        assert_relative_eq!(
            moments.square_hz2,
            spread + offset * offset,
            max_relative = 1e-6
        );
    }

    #[test]
    fn trimming_keeps_the_energy_but_the_part_given_up() {
        let knots: Vec<f64> = (0..=200).map(|i| f64::from(i) * 0.1).collect();
        let values: Vec<_> = knots
            .iter()
            .map(|t| Complex::new((-0.5 * (t - 10.0).powi(2)).exp(), 0.0))
            .collect();
        let whole = Piecewise::spline(knots, &values);
        let mut cut = whole.clone();
        cut.trim(1e-6);
        let (first, last) = cut.support_s();
        // erfc(x)/2 = 1e-6 at x = 3.36.
        assert!(
            (10.0 - first - 3.4).abs() < 0.11 && (last - 10.0 - 3.4).abs() < 0.11,
            "{first} {last}"
        );
        assert_relative_eq!(
            cut.moments().energy,
            whole.moments().energy,
            max_relative = 2e-6
        );
    }
}
