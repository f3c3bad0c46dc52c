//! The two kinds of samples that a receiver delivers: the current, or both its quadratures.
//!
//! Check: the tests of `heterodyne`; the real current is the baseband at the
//! intermediate frequency.

use num_complex::Complex;

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
pub trait Sample: sealed::Received {}

impl Sample for f64 {}
impl Sample for Complex<f64> {}

pub(crate) mod sealed {
    use std::f64::consts::SQRT_2;

    use rand::Rng;

    use super::{Complex, Detector, Error, NoiseScratch, Receiver};

    pub trait Received: Copy + Default + Send + Sync {
        /// Whether samples of this kind hold the band of the receiver.
        fn check_band(receiver: &Receiver) -> Result<(), Error>;

        /// The samples of an envelope, without noise.
        fn receive(detector: &Detector, envelope_a: &[Complex<f64>], out_a: &mut [Self]);

        /// Adds the noise of one record.
        fn add_noise<R: Rng + ?Sized>(
            from: &Detector,
            rng: &mut R,
            scratch: &mut NoiseScratch,
            out_a: &mut [Self],
        );

        /// Real numbers that the sample consists of.
        fn for_each_part(&mut self, act: impl FnMut(&mut f64));
    }

    impl Received for f64 {
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

        fn for_each_part(&mut self, mut act: impl FnMut(&mut f64)) {
            act(self);
        }
    }

    impl Received for Complex<f64> {
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

        fn for_each_part(&mut self, mut act: impl FnMut(&mut f64)) {
            act(&mut self.re);
            act(&mut self.im);
        }
    }
}
