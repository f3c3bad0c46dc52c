//! The inner loops: exp(j psi), normal numbers, transfer function, absorber, intensity - each
//! written once for f32 and f64, vectorised by the compiler for several instruction sets and
//! chosen at run time.
//!
//! No operation is fused or reassociated, so that every instruction set gives the same bits. Check:
//! sine and cosine against the standard library within two units in the last place of 1; moments
//! and distribution of the normal numbers.

// The constants have the digits they were computed with; f32 rounds some of them.
#![allow(clippy::excessive_precision)]

use multiversion::multiversion;
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftNum, FftPlanner};
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

/// Points handled at a time by the kernels that need temporaries.
const BLOCK: usize = 64;
/// Independent partial sums of a reduction.
const LANES: usize = 16;
/// Order of the polynomials which carry the low frequencies of a screen.
pub(crate) const LOW_ORDER: usize = 16;

/// Number type of the wave-optics code: `f32` or `f64`.
pub trait Real: FftNum + Default + PartialOrd {
    /// The nearest number of this type.
    fn of(value: f64) -> Self;
    /// The number as f64.
    fn wide(self) -> f64;
    /// The forward and the inverse Fourier transform of a length; of each type by itself, so that
    /// the planner is compiled with this crate and not again by each program that names the type.
    fn transforms(length: usize) -> [Arc<dyn Fft<Self>>; 2];
    /// The nearest number of this type.
    #[doc(hidden)]
    fn of_i32(value: i32) -> Self;
    /// Square root; 0 below 0.
    #[doc(hidden)]
    fn root(self) -> Self;
    /// Sine and cosine.
    #[doc(hidden)]
    fn sin_cos(self) -> (Self, Self);
    /// Sine and cosine of `self` + `quadrant` pi/2 for |self| <= pi/4.
    #[doc(hidden)]
    fn sin_cos_of_quadrant(self, quadrant: u32) -> (Self, Self);
    /// -2 ln(self) for 0 < self <= 1.
    #[doc(hidden)]
    fn minus_two_ln(self) -> Self;
}

/// field *= exp(j scale phase).
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn multiply_cis<T: Real>(field: &mut [Complex<T>], phase: &[T], scale: T) {
    let mut sin = [T::zero(); BLOCK];
    let mut cos = [T::zero(); BLOCK];
    for (field, phase) in field.chunks_mut(BLOCK).zip(phase.chunks(BLOCK)) {
        for ((s, c), &p) in sin.iter_mut().zip(&mut cos).zip(phase) {
            (*s, *c) = (p * scale).sin_cos();
        }
        for ((e, &s), &c) in field.iter_mut().zip(&sin).zip(&cos) {
            *e = Complex::new(e.re * c - e.im * s, e.re * s + e.im * c);
        }
    }
}

/// out = amplitude (a + j b) with a, b standard normal, from two random 32-bit words each (Box
/// and Muller 1958).
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn normals<T: Real>(
    radius: &[u32],
    angle: &[u32],
    amplitude: &[T],
    out: &mut [Complex<T>],
) {
    let mut a = [T::zero(); BLOCK];
    let mut b = [T::zero(); BLOCK];
    let words = radius.chunks(BLOCK).zip(angle.chunks(BLOCK));
    let outs = amplitude.chunks(BLOCK).zip(out.chunks_mut(BLOCK));
    for ((radius, angle), (amplitude, out)) in words.zip(outs) {
        let words = radius.iter().zip(angle).zip(amplitude);
        for (((&u, &v), &amplitude), (a, b)) in words.zip(a.iter_mut().zip(&mut b)) {
            let unit = (T::of_i32((u >> 1) as i32) + T::of(0.5)) * T::of(1.0 / 2_147_483_648.0);
            let r = unit.minus_two_ln().root() * amplitude;
            let part =
                T::of_i32((v & 0x3fff_ffff) as i32) * T::of(1.0 / 1_073_741_824.0) - T::of(0.5);
            let (s, c) = (part * T::of(FRAC_PI_2)).sin_cos_of_quadrant(v >> 30);
            (*a, *b) = (r * c, r * s);
        }
        for ((o, &a), &b) in out.iter_mut().zip(&a).zip(&b) {
            *o = Complex::new(a, b);
        }
    }
}

/// row *= factor * other.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn multiply_scaled<T: Real>(
    row: &mut [Complex<T>],
    factor: Complex<T>,
    other: &[Complex<T>],
) {
    for (e, h) in row.iter_mut().zip(other) {
        let w = Complex::new(
            factor.re * h.re - factor.im * h.im,
            factor.re * h.im + factor.im * h.re,
        );
        *e = Complex::new(e.re * w.re - e.im * w.im, e.re * w.im + e.im * w.re);
    }
}

/// row *= factor * window, and the sum of |row|^2 after it.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn absorb<T: Real>(row: &mut [Complex<T>], factor: T, window: &[T]) -> f64 {
    let mut sum = [T::zero(); LANES];
    for (row, window) in row.chunks_mut(LANES).zip(window.chunks(LANES)) {
        for ((e, &w), sum) in row.iter_mut().zip(window).zip(&mut sum) {
            let w = w * factor;
            let damped = Complex::new(e.re * w, e.im * w);
            *sum = *sum + (damped.re * damped.re + damped.im * damped.im);
            *e = damped;
        }
    }
    sum.iter().map(|s| s.wide()).sum()
}

/// out = |row|^2.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn intensity<T: Real>(row: &[Complex<T>], out: &mut [T]) {
    for (e, o) in row.iter().zip(out) {
        *o = e.re * e.re + e.im * e.im;
    }
}

/// Sum of a b.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn dot<T: Real>(a: &[T], b: &[T]) -> f64 {
    let mut sum = [T::zero(); LANES];
    for (a, b) in a.chunks(LANES).zip(b.chunks(LANES)) {
        for ((&a, &b), sum) in a.iter().zip(b).zip(&mut sum) {
            *sum = *sum + a * b;
        }
    }
    sum.iter().map(|s| s.wide()).sum()
}

/// Writes the real and the imaginary part of row * factor * ramp + low frequencies into two rows.
/// `factor` and `ramp` are the linear phase of the frequency shift. The low frequencies are the sum
/// of the polynomials `basis`, each sampled along the row, times the `coefficients` of either part.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn finish_screen<T: Real>(
    row: &[Complex<T>],
    factor: Complex<T>,
    ramp: &[Complex<T>],
    basis: &[Vec<T>],
    coefficients: &[[T; 2]; LOW_ORDER],
    first: &mut [T],
    second: &mut [T],
) {
    for start in (0..row.len()).step_by(BLOCK) {
        let end = (start + BLOCK).min(row.len());
        let mut re = [T::zero(); BLOCK];
        let mut im = [T::zero(); BLOCK];
        for (polynomial, &[cre, cim]) in basis.iter().zip(coefficients) {
            for ((&p, re), im) in polynomial[start..end].iter().zip(&mut re).zip(&mut im) {
                *re = *re + cre * p;
                *im = *im + cim * p;
            }
        }
        let values = row[start..end].iter().zip(&ramp[start..end]);
        let sums = re.iter().zip(&im);
        let outs = first[start..end].iter_mut().zip(&mut second[start..end]);
        for (((e, p), (&re, &im)), (a, b)) in values.zip(sums).zip(outs) {
            let w = Complex::new(
                p.re * factor.re - p.im * factor.im,
                p.re * factor.im + p.im * factor.re,
            );
            *a = e.re * w.re - e.im * w.im + re;
            *b = e.re * w.im + e.im * w.re + im;
        }
    }
}

macro_rules! scalar {
    ($real:ident, $bits:ident, $mantissa:expr, $sqrt_half:expr, $one_exp:expr, $pi_half:expr, $sin:expr, $cos:expr, $log:expr) => {
        impl Real for $real {
            #[inline(always)]
            fn of_i32(value: i32) -> Self {
                value as $real
            }

            #[inline(always)]
            fn root(self) -> Self {
                self.max(0.0).sqrt()
            }

            #[inline(always)]
            fn sin_cos(self) -> (Self, Self) {
                const PI_HALF: [$real; 3] = $pi_half;
                /// Adding 1.5 2^mantissa rounds to an integer, which is then in the lowest bits.
                const ROUND: $real = 1.5 * (1u64 << $mantissa) as $real;
                let rounded = self * (1.0 / std::$real::consts::FRAC_PI_2) + ROUND;
                let n = rounded - ROUND;
                let r = ((self - n * PI_HALF[0]) - n * PI_HALF[1]) - n * PI_HALF[2];
                r.sin_cos_of_quadrant((rounded.to_bits() & 3) as u32)
            }

            #[inline(always)]
            fn sin_cos_of_quadrant(self, quadrant: u32) -> (Self, Self) {
                const SIGN: u32 = $bits::BITS - 2;
                let t = self * self;
                let quadrant = $bits::from(quadrant);
                let s = (self + self * t * polynomial(&$sin, t)).to_bits();
                let c = (1.0 - 0.5 * t + t * t * polynomial(&$cos, t)).to_bits();
                let swap = (quadrant & 1).wrapping_neg();
                let sin = (s & !swap) | (c & swap);
                let cos = (c & !swap) | (s & swap);
                (
                    $real::from_bits(sin ^ ((quadrant & 2) << SIGN)),
                    $real::from_bits(cos ^ ((quadrant.wrapping_add(1) & 2) << SIGN)),
                )
            }

            #[inline(always)]
            fn minus_two_ln(self) -> Self {
                const BIAS: $bits = ($one_exp as $bits) << $mantissa;
                // self = m 2^e with m from sqrt(1/2) to sqrt(2); integers below 2^mantissa turn
                // into numbers by their bits.
                let bits = self.to_bits();
                let exponent = (bits.wrapping_sub($sqrt_half).wrapping_add(BIAS)) >> $mantissa;
                let m =
                    $real::from_bits(bits.wrapping_sub(exponent << $mantissa).wrapping_add(BIAS));
                let integer = (1u64 << $mantissa) as $real;
                let exponent =
                    $real::from_bits(integer.to_bits() | exponent) - integer - $one_exp as $real;
                let t = (m - 1.0) / (m + 1.0);
                let ln_m = 2.0 * t * polynomial(&$log, t * t);
                -2.0 * (ln_m + exponent * std::$real::consts::LN_2)
            }

            fn of(value: f64) -> Self {
                value as $real
            }
            fn wide(self) -> f64 {
                f64::from(self)
            }

            fn transforms(length: usize) -> [Arc<dyn Fft<Self>>; 2] {
                let mut planner = FftPlanner::new();
                [
                    planner.plan_fft_forward(length),
                    planner.plan_fft_inverse(length),
                ]
            }
        }
    };
}

/// The nearest number of the number type `T`.
pub(crate) fn narrow<T: Real>(value: Complex<f64>) -> Complex<T> {
    Complex::new(T::of(value.re), T::of(value.im))
}

/// Sum of coefficient\[i\] t^i.
#[inline(always)]
fn polynomial<T: Real>(coefficient: &[T], t: T) -> T {
    let mut sum = coefficient[coefficient.len() - 1];
    let mut i = coefficient.len() - 1;
    while i > 0 {
        i -= 1;
        sum = sum * t + coefficient[i];
    }
    sum
}

// pi/2 in three parts whose first two are exact in products with the integers that occur;
// near-minimax polynomials (Chebyshev interpolation in r^2) of (sin r - r)/r^3 and (cos r - 1 +
// r^2/2)/r^4; series of artanh.
scalar!(
    f32,
    u32,
    23,
    0x3f35_04f3_u32,
    127,
    [1.5703125, 0.0004837512969970703125, 7.5497899549e-8],
    [-0.166_666_645_4, 0.008_332_724_73, -0.000_195_828_558_5],
    [0.041_666_664_54, -0.001_388_827_945, 0.000_024_542_896_34],
    [1.0, 1.0 / 3.0, 0.2, 1.0 / 7.0, 1.0 / 9.0]
);
scalar!(
    f64,
    u64,
    52,
    0x3fe6_a09e_667f_3bcd_u64,
    1023,
    [
        1.570796326734125614166,
        6.077100503593460545382e-11,
        2.912732056093356158e-20
    ],
    [
        -0.16666666666666664,
        0.0083333333333307006,
        -0.00019841269836387346,
        2.7557315911911159e-6,
        -2.5051092507061382e-8,
        1.5915323212271173e-10
    ],
    [
        0.041666666666666665,
        -0.0013888888888887242,
        2.4801587298533455e-5,
        -2.755731715246704e-7,
        2.0876121658871156e-9,
        -1.1380876948169574e-11
    ],
    [
        1.0,
        1.0 / 3.0,
        1.0 / 5.0,
        1.0 / 7.0,
        1.0 / 9.0,
        1.0 / 11.0,
        1.0 / 13.0,
        1.0 / 15.0,
        1.0 / 17.0,
        1.0 / 19.0
    ]
);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_and_cosine_agree_with_the_standard_library() {
        for i in 0..200_000 {
            let x = (f64::from(i) - 1e5) * 0.003_171_3;
            let (s, c) = Real::sin_cos(x);
            assert!(
                (s - x.sin()).abs() < 3e-16 && (c - x.cos()).abs() < 3e-16,
                "{x}"
            );
            let y = x as f32;
            let (s, c) = Real::sin_cos(y);
            let wide = f64::from(y);
            assert!(
                (f64::from(s) - wide.sin()).abs() < 1.5e-7
                    && (f64::from(c) - wide.cos()).abs() < 1.5e-7,
                "{y}"
            );
        }
    }

    #[test]
    fn logarithm_agrees_with_the_standard_library() {
        for i in 1..100_000u32 {
            let u = f64::from(i) / 1e5;
            let exact = -2.0 * u.ln();
            assert!((u.minus_two_ln() - exact).abs() < 1e-15 * exact.max(1.0));
            let single = f64::from((u as f32).minus_two_ln());
            assert!((single + 2.0 * f64::from(u as f32).ln()).abs() < 3e-7 * exact.max(1.0));
        }
        assert_eq!(1f32.minus_two_ln(), 0.0);
    }

    #[test]
    fn normal_numbers_have_the_moments_of_a_unit_normal() {
        use rand::Rng;
        use rand_xoshiro::rand_core::SeedableRng;
        let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(7);
        const N: usize = 200_000;
        let words: Vec<(u32, u32)> = (0..N).map(|_| (rng.next_u32(), rng.next_u32())).collect();
        let (radius, angle): (Vec<_>, Vec<_>) = words.into_iter().unzip();
        let mut out = vec![Complex::<f64>::default(); N];
        normals(&radius, &angle, &vec![1.0; N], &mut out);
        let mut single = vec![Complex::<f32>::default(); N];
        normals(&radius, &angle, &vec![1.0; N], &mut single);
        for (a, b) in out.iter().zip(&single) {
            assert!((a.re - f64::from(b.re)).abs() < 1e-5 && (a.im - f64::from(b.im)).abs() < 1e-5);
        }
        let mean =
            |f: &dyn Fn(f64, f64) -> f64| out.iter().map(|c| f(c.re, c.im)).sum::<f64>() / N as f64;
        // Standard errors: 1, sqrt 2, sqrt 96 over sqrt N; z below 4.
        let scale = 4.0 / (N as f64).sqrt();
        assert!(
            mean(&|a, _| a).abs() < scale
                && mean(&|_, b| b).abs() < scale
                && mean(&|a, b| a * b).abs() < scale
        );
        assert!((mean(&|a, _| a * a) - 1.0).abs() < scale * 2f64.sqrt());
        assert!((mean(&|_, b| b * b) - 1.0).abs() < scale * 2f64.sqrt());
        assert!((mean(&|a, _| a.powi(4)) - 3.0).abs() < scale * 96f64.sqrt());
        assert!((mean(&|a, b| a * a * b * b) - 1.0).abs() < scale * 8f64.sqrt());
    }
}
