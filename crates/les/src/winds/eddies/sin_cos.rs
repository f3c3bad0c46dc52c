//! Sine and cosine of several angles at once, from multiplications and additions alone: the compiler
//! makes vector instructions of them, and every machine gives the same bits.
//!
//! Reduction by multiples of pi/2 in three parts (Cody and Waite 1980) and the polynomials of
//! fdlibm (Sun Microsystems 1993). Check: the functions of the standard library to two units in
//! the last place.

#![allow(
    clippy::excessive_precision,
    clippy::needless_range_loop,
    reason = "constants as fdlibm publishes them; loops over lanes of several arrays"
)]

/// Angles up to this are reduced with an error below 1e-16 \[rad\].
const LARGEST_RAD: f64 = 1e6;

/// pi/2 in parts of 33 bits.
const HALF_PI: [f64; 3] = [
    1.570_796_326_734_125_614_17,
    6.077_100_506_303_965_976_60e-11,
    2.022_266_248_795_950_631_54e-21,
];
/// Adding it to a number below 2^51 and taking it away rounds to a whole number.
const ROUND: f64 = 6_755_399_441_055_744.0;

const SINE: [f64; 6] = [
    -1.666_666_666_666_663_243_48e-01,
    8.333_333_333_322_489_461_24e-03,
    -1.984_126_982_985_794_931_34e-04,
    2.755_731_370_707_006_767_89e-06,
    -2.505_076_025_340_686_341_95e-08,
    1.589_690_995_211_550_102_21e-10,
];
const COSINE: [f64; 6] = [
    4.166_666_666_666_660_190_37e-02,
    -1.388_888_888_887_410_957_49e-03,
    2.480_158_728_947_672_941_78e-05,
    -2.755_731_435_139_066_330_35e-07,
    2.087_572_321_298_174_827_90e-09,
    -1.135_964_755_778_819_482_65e-11,
];

/// Sine and cosine of each angle \[rad\].
#[inline(always)]
pub(super) fn sin_cos<const N: usize>(angle_rad: &[f64; N]) -> ([f64; N], [f64; N]) {
    let mut sine = [0.0; N];
    let mut cosine = [0.0; N];
    let mut is_small = true;
    for i in 0..N {
        is_small &= angle_rad[i].abs() < LARGEST_RAD;
    }
    if !is_small {
        for i in 0..N {
            (sine[i], cosine[i]) = angle_rad[i].sin_cos();
        }
        return (sine, cosine);
    }
    for i in 0..N {
        let shifted = angle_rad[i] * std::f64::consts::FRAC_2_PI + ROUND;
        let quarters = shifted - ROUND;
        let x = ((angle_rad[i] - quarters * HALF_PI[0]) - quarters * HALF_PI[1])
            - quarters * HALF_PI[2];
        let z = x * x;
        let s = x + x * z * polynomial(&SINE, z);
        let c = 1.0 - (0.5 * z - z * z * polynomial(&COSINE, z));
        // The last two bits of the shifted number count the quarter turns.
        let turn = shifted.to_bits();
        let is_odd = turn & 1 == 1;
        let sine_sign = (turn & 2) << 62;
        let cosine_sign = ((turn + 1) & 2) << 62;
        let (sine_part, cosine_part) = if is_odd { (c, s) } else { (s, c) };
        sine[i] = f64::from_bits(sine_part.to_bits() ^ sine_sign);
        cosine[i] = f64::from_bits(cosine_part.to_bits() ^ cosine_sign);
    }
    (sine, cosine)
}

/// A polynomial in `z` by Horner's rule.
#[inline(always)]
fn polynomial(coefficients: &[f64; 6], z: f64) -> f64 {
    let [a, b, c, d, e, f] = coefficients;
    a + z * (b + z * (c + z * (d + z * (e + z * f))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_those_of_the_standard_library() {
        for i in -200_000..200_000 {
            let angle_rad = [
                0.011_7 * f64::from(i),
                3e-6 * f64::from(i),
                9.1 * f64::from(i),
            ];
            let (sine, cosine) = sin_cos(&angle_rad);
            for (j, angle_rad) in angle_rad.into_iter().enumerate() {
                let (s, c) = angle_rad.sin_cos();
                assert!(
                    (sine[j] - s).abs() < 4e-16,
                    "sin {angle_rad}: {} {s}",
                    sine[j]
                );
                assert!(
                    (cosine[j] - c).abs() < 4e-16,
                    "cos {angle_rad}: {} {c}",
                    cosine[j]
                );
            }
        }
        let (sine, cosine) = sin_cos(&[0.0, f64::NAN]);
        assert_eq!((sine[0], cosine[0]), (0.0, 1.0));
        assert!(sine[1].is_nan() && cosine[1].is_nan());
    }
}
