//! The inner loop of the heterodyne sum: one sample from the rotating phasors of all layers that the pulse lights.
//!
//! The loops are compiled for several instruction sets and the best is chosen at run time. Products and sums are kept
//! apart (no fused operation) and lanes are fixed, so every version gives the same bits.
//!
//! Check: the tests of `heterodyne` against the literal sum.

use multiversion::multiversion;

use crate::window::Lit;

/// Sums that run side by side: two AVX-512 registers, four AVX2, eight SSE2.
const LANES: usize = 16;

/// Phasors of the layers, real and imaginary parts apart, and their rotation in one sampling interval.
#[derive(Debug, Default)]
pub(crate) struct Phasors {
    pub(crate) re: Vec<f64>,
    pub(crate) im: Vec<f64>,
    pub(crate) rotation_re: Vec<f64>,
    pub(crate) rotation_im: Vec<f64>,
}

impl Phasors {
    pub(crate) fn resize(&mut self, layers: usize) {
        for part in [&mut self.re, &mut self.im, &mut self.rotation_re, &mut self.rotation_im] {
            part.resize(layers, 0.0);
        }
    }

    /// `sum_l envelope[l - first] phasor[l]` over the layers of `envelope`, then rotates these phasors by one sampling
    /// interval.
    pub(crate) fn sum_and_rotate(&mut self, first: usize, envelope: Lit<'_>) -> (f64, f64) {
        let window = first..first + envelope.re.len();
        let (re, im) = (&mut self.re[window.clone()], &mut self.im[window.clone()]);
        let (rotation_re, rotation_im) = (&self.rotation_re[window.clone()], &self.rotation_im[window]);
        if envelope.im.is_empty() {
            sum_and_rotate(envelope.re, re, im, rotation_re, rotation_im)
        } else {
            sum_complex_and_rotate(envelope.re, envelope.im, re, im, rotation_re, rotation_im)
        }
    }
}

#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn sum_and_rotate(
    envelope: &[f64],
    re: &mut [f64],
    im: &mut [f64],
    rotation_re: &[f64],
    rotation_im: &[f64],
) -> (f64, f64) {
    let (mut sum_re, mut sum_im) = ([0.0; LANES], [0.0; LANES]);
    let (envelope, envelope_rest) = envelope.as_chunks::<LANES>();
    let (re, re_rest) = re.as_chunks_mut::<LANES>();
    let (im, im_rest) = im.as_chunks_mut::<LANES>();
    let (rotation_re, rotation_re_rest) = rotation_re.as_chunks::<LANES>();
    let (rotation_im, rotation_im_rest) = rotation_im.as_chunks::<LANES>();
    let state = re.iter_mut().zip(im).zip(rotation_re.iter().zip(rotation_im));
    for (weight, ((re, im), (rotation_re, rotation_im))) in envelope.iter().zip(state) {
        for i in 0..LANES {
            let (x, y) = (re[i], im[i]);
            sum_re[i] += weight[i] * x;
            sum_im[i] += weight[i] * y;
            re[i] = x * rotation_re[i] - y * rotation_im[i];
            im[i] = x * rotation_im[i] + y * rotation_re[i];
        }
    }
    let mut total = (sum_re.iter().sum::<f64>(), sum_im.iter().sum::<f64>());
    let state = re_rest.iter_mut().zip(im_rest).zip(rotation_re_rest.iter().zip(rotation_im_rest));
    for (&weight, ((re, im), (&rotation_re, &rotation_im))) in envelope_rest.iter().zip(state) {
        let (x, y) = (*re, *im);
        total.0 += weight * x;
        total.1 += weight * y;
        *re = x * rotation_re - y * rotation_im;
        *im = x * rotation_im + y * rotation_re;
    }
    total
}

/// The same for an envelope with real part `weight_re` and imaginary part `weight_im`.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn sum_complex_and_rotate(
    weight_re: &[f64],
    weight_im: &[f64],
    re: &mut [f64],
    im: &mut [f64],
    rotation_re: &[f64],
    rotation_im: &[f64],
) -> (f64, f64) {
    let (mut sum_re, mut sum_im) = ([0.0; LANES], [0.0; LANES]);
    let (weight_re, weight_re_rest) = weight_re.as_chunks::<LANES>();
    let (weight_im, weight_im_rest) = weight_im.as_chunks::<LANES>();
    let (re, re_rest) = re.as_chunks_mut::<LANES>();
    let (im, im_rest) = im.as_chunks_mut::<LANES>();
    let (rotation_re, rotation_re_rest) = rotation_re.as_chunks::<LANES>();
    let (rotation_im, rotation_im_rest) = rotation_im.as_chunks::<LANES>();
    let state = re.iter_mut().zip(im).zip(rotation_re.iter().zip(rotation_im));
    for ((a, b), ((re, im), (rotation_re, rotation_im))) in weight_re.iter().zip(weight_im).zip(state) {
        for i in 0..LANES {
            let (x, y) = (re[i], im[i]);
            sum_re[i] += a[i] * x - b[i] * y;
            sum_im[i] += a[i] * y + b[i] * x;
            re[i] = x * rotation_re[i] - y * rotation_im[i];
            im[i] = x * rotation_im[i] + y * rotation_re[i];
        }
    }
    let mut total = (sum_re.iter().sum::<f64>(), sum_im.iter().sum::<f64>());
    let state = re_rest.iter_mut().zip(im_rest).zip(rotation_re_rest.iter().zip(rotation_im_rest));
    for ((&a, &b), ((re, im), (&rotation_re, &rotation_im))) in weight_re_rest.iter().zip(weight_im_rest).zip(state) {
        let (x, y) = (*re, *im);
        total.0 += a * x - b * y;
        total.1 += a * y + b * x;
        *re = x * rotation_re - y * rotation_im;
        *im = x * rotation_im + y * rotation_re;
    }
    total
}
