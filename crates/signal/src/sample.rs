//! The two kinds of samples that a receiver delivers: the current, or both its quadratures.
//!
//! Check: the tests of `heterodyne`; the real current is the baseband at the
//! intermediate frequency.

use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};

use ndarray::LinalgScalar;
use num_complex::{Complex, ComplexFloat};
use rand::{Rng, RngExt};
use rand_distr::{Distribution, Gamma, StandardNormal};

use crate::Error;
use crate::noise::NoiseScratch;
use crate::receiver::Receiver;
use crate::record::Detector;

/// `f64`: the measured current `i(t_k) = sqrt(2) Re{s(t_k) exp(j 2 pi f_c t_k)} + i_N`, (12).
/// `Complex<f64>`: the baseband signal `s(t_k)` with circular noise of the detector band about zero
/// frequency, as a receiver with two quadratures delivers it.
///
/// The real current is `sqrt(2) Re{(s + n) exp(j 2 pi f_c t)}`, so the mean square of the complex
/// noise is (13), and the signal-to-noise ratio is (14), too. `White` noise fills `-F_s/2` to
/// `F_s/2` with the density of the band.
///
/// Its methods take types of this crate that are not public, so that no other type can implement it.
pub trait Sample: Copy + Default + Send + Sync + LinalgScalar + ComplexFloat<Real = f64> {
    /// Whether samples of this kind hold the band of the receiver.
    #[doc(hidden)]
    fn check_band(receiver: &Receiver) -> Result<(), Error>;

    /// The samples of an envelope, without noise.
    #[doc(hidden)]
    fn receive(detector: &Detector, envelope_a: &[Complex<f64>], out_a: &mut [Self]);

    /// Adds the noise of one record.
    #[doc(hidden)]
    fn add_noise<R: Rng + ?Sized>(
        from: &Detector,
        rng: &mut R,
        scratch: &mut NoiseScratch,
        out_a: &mut [Self],
    );

    /// Covariance of the samples `m` and `n` without noise, from that of the envelope.
    #[doc(hidden)]
    fn covariance_a2(detector: &Detector, m: usize, n: usize, envelope_a2: Complex<f64>) -> Self;

    /// Covariance of the noise at each lag below `lags`.
    #[doc(hidden)]
    fn noise_covariance_a2(detector: &Detector, lags: usize) -> Vec<f64>;

    /// The number times a real one.
    #[doc(hidden)]
    fn scaled(self, factor: f64) -> Self;

    /// A normal number of mean square 1; circular if it is complex.
    #[doc(hidden)]
    fn normal<R: Rng + ?Sized>(rng: &mut R) -> Self;

    /// Root of the sum of the squares of `numbers` normal numbers.
    #[doc(hidden)]
    fn root_of_squares<R: Rng + ?Sized>(numbers: usize, rng: &mut R) -> Self;

    /// Real numbers that the sample consists of.
    #[doc(hidden)]
    fn for_each_part(&mut self, act: impl FnMut(&mut f64));
}

impl Sample for f64 {
    fn check_band(receiver: &Receiver) -> Result<(), Error> {
        receiver.validate_band()
    }

    fn receive(detector: &Detector, envelope_a: &[Complex<f64>], out_a: &mut [Self]) {
        for ((out, s), carrier) in out_a.iter_mut().zip(envelope_a).zip(&detector.carrier) {
            *out = SQRT_2 * (s.re * carrier.re - s.im * carrier.im);
        }
    }

    fn add_noise<R: Rng + ?Sized>(
        from: &Detector,
        rng: &mut R,
        scratch: &mut NoiseScratch,
        out_a: &mut [Self],
    ) {
        from.noise.add_to(rng, scratch, out_a);
    }

    fn covariance_a2(detector: &Detector, m: usize, n: usize, envelope_a2: Complex<f64>) -> Self {
        (envelope_a2 * detector.carrier[m] * detector.carrier[n].conj()).re
    }

    fn noise_covariance_a2(detector: &Detector, lags: usize) -> Vec<f64> {
        detector.noise.covariance_a2(lags)
    }

    fn scaled(self, factor: f64) -> Self {
        self * factor
    }

    fn normal<R: Rng + ?Sized>(rng: &mut R) -> Self {
        rng.sample(StandardNormal)
    }

    fn root_of_squares<R: Rng + ?Sized>(numbers: usize, rng: &mut R) -> Self {
        (2.0 * gamma(0.5 * numbers as f64, rng)).sqrt()
    }

    fn for_each_part(&mut self, mut act: impl FnMut(&mut f64)) {
        act(self);
    }
}

impl Sample for Complex<f64> {
    fn check_band(_: &Receiver) -> Result<(), Error> {
        Ok(())
    }

    fn receive(_: &Detector, envelope_a: &[Self], out_a: &mut [Self]) {
        out_a.copy_from_slice(envelope_a);
    }

    fn add_noise<R: Rng + ?Sized>(
        from: &Detector,
        rng: &mut R,
        scratch: &mut NoiseScratch,
        out_a: &mut [Self],
    ) {
        from.baseband_noise.add_to(rng, scratch, out_a);
    }

    fn covariance_a2(_: &Detector, _: usize, _: usize, envelope_a2: Self) -> Self {
        envelope_a2
    }

    fn noise_covariance_a2(detector: &Detector, lags: usize) -> Vec<f64> {
        detector.baseband_noise.covariance_a2(lags)
    }

    fn scaled(self, factor: f64) -> Self {
        self * factor
    }

    fn normal<R: Rng + ?Sized>(rng: &mut R) -> Self {
        let re: f64 = rng.sample(StandardNormal);
        let im: f64 = rng.sample(StandardNormal);
        Self::new(re, im) * FRAC_1_SQRT_2
    }

    fn root_of_squares<R: Rng + ?Sized>(numbers: usize, rng: &mut R) -> Self {
        Self::from(gamma(numbers as f64, rng).sqrt())
    }

    fn for_each_part(&mut self, mut act: impl FnMut(&mut f64)) {
        act(&mut self.re);
        act(&mut self.im);
    }
}

/// A gamma-distributed number of a positive shape and scale 1.
fn gamma<R: Rng + ?Sized>(shape: f64, rng: &mut R) -> f64 {
    Gamma::new(shape, 1.0).map_or(f64::NAN, |gamma| gamma.sample(rng))
}
