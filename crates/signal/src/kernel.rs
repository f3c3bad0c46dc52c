//! The inner loop of the heterodyne sum: one sample from the rotating phasors of all layers that
//! the pulse lights.
//!
//! The loop is compiled for several instruction sets and the best is chosen at run time.
//! Products and sums are separate operations (none is fused) and lanes are fixed, so every
//! version gives the same bits.
//!
//! Check: the tests of `heterodyne` against the literal sum.

use multiversion::multiversion;

use crate::window::Lit;

/// Sums that run side by side: two AVX-512 registers, four AVX2, eight SSE2.
const LANES: usize = 16;

/// Phasors of the layers, real and imaginary parts apart, and their rotation in one
/// sampling interval.
#[derive(Debug, Default)]
pub(crate) struct Phasors {
    pub(crate) re: Vec<f64>,
    pub(crate) im: Vec<f64>,
    pub(crate) rotation_re: Vec<f64>,
    pub(crate) rotation_im: Vec<f64>,
}

impl Phasors {
    pub(crate) fn resize(&mut self, layers: usize) {
        for part in [
            &mut self.re,
            &mut self.im,
            &mut self.rotation_re,
            &mut self.rotation_im,
        ] {
            part.resize(layers, 0.0);
        }
    }

    /// `sum_l envelope[l - first] phasor[l]` over the layers of `envelope`, then rotates these
    /// phasors by one sampling interval.
    pub(crate) fn sum_and_rotate(&mut self, envelope: Lit<'_>) -> (f64, f64) {
        let window = envelope.first..envelope.first + envelope.re.len();
        sum_and_rotate(
            envelope,
            &mut self.re[window.clone()],
            &mut self.im[window.clone()],
            &self.rotation_re[window.clone()],
            &self.rotation_im[window],
        )
    }
}

#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn sum_and_rotate(
    envelope: Lit<'_>,
    re: &mut [f64],
    im: &mut [f64],
    rotation_re: &[f64],
    rotation_im: &[f64],
) -> (f64, f64) {
    if envelope.im.is_empty() {
        sum::<false>(envelope.re, envelope.re, re, im, rotation_re, rotation_im)
    } else {
        sum::<true>(envelope.re, envelope.im, re, im, rotation_re, rotation_im)
    }
}

/// The sum for an envelope with the parts `a` and `b`; `b` counts if it is `COMPLEX`.
#[inline(always)]
fn sum<const COMPLEX: bool>(
    a: &[f64],
    b: &[f64],
    re: &mut [f64],
    im: &mut [f64],
    rotation_re: &[f64],
    rotation_im: &[f64],
) -> (f64, f64) {
    let (a, a_rest) = a.as_chunks::<LANES>();
    let (b, b_rest) = b.as_chunks::<LANES>();
    let (re, re_rest) = re.as_chunks_mut::<LANES>();
    let (im, im_rest) = im.as_chunks_mut::<LANES>();
    let (rotation_re, rotation_re_rest) = rotation_re.as_chunks::<LANES>();
    let (rotation_im, rotation_im_rest) = rotation_im.as_chunks::<LANES>();
    let mut sums = [[0.0; LANES]; 2];
    let layers = re
        .iter_mut()
        .zip(im)
        .zip(rotation_re.iter().zip(rotation_im));
    for ((a, b), ((re, im), (rotation_re, rotation_im))) in a.iter().zip(b).zip(layers) {
        add::<COMPLEX, LANES>(a, b, re, im, rotation_re, rotation_im, &mut sums);
    }
    let mut total = sums.map(|lanes| [lanes.iter().sum::<f64>()]);
    let layers = re_rest
        .iter_mut()
        .zip(im_rest)
        .zip(rotation_re_rest.iter().zip(rotation_im_rest));
    for ((a, b), ((re, im), (rotation_re, rotation_im))) in a_rest.iter().zip(b_rest).zip(layers) {
        add::<COMPLEX, 1>(
            &[*a],
            &[*b],
            std::array::from_mut(re),
            std::array::from_mut(im),
            &[*rotation_re],
            &[*rotation_im],
            &mut total,
        );
    }
    (total[0][0], total[1][0])
}

/// Adds envelope times phasor of `N` layers, each to a sum of its own, and rotates the phasors.
#[inline(always)]
fn add<const COMPLEX: bool, const N: usize>(
    a: &[f64; N],
    b: &[f64; N],
    re: &mut [f64; N],
    im: &mut [f64; N],
    rotation_re: &[f64; N],
    rotation_im: &[f64; N],
    [sum_re, sum_im]: &mut [[f64; N]; 2],
) {
    for i in 0..N {
        let x = re[i];
        let y = im[i];
        sum_re[i] += if COMPLEX {
            a[i] * x - b[i] * y
        } else {
            a[i] * x
        };
        sum_im[i] += if COMPLEX {
            a[i] * y + b[i] * x
        } else {
            a[i] * y
        };
        re[i] = x * rotation_re[i] - y * rotation_im[i];
        im[i] = x * rotation_im[i] + y * rotation_re[i];
    }
}
