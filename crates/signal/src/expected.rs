//! Expected values over pulses, without random numbers: mean power, signal-to-noise ratio (14) and
//! covariance of the samples.
//!
//! Check: closed forms of the covariance in a uniform wind and a linear gradient; the mean square
//! of the simulator's own responses to each layer.

use multiversion::multiversion;
use ndarray::Array2;
use num_complex::Complex;

use crate::error::{check_length, check_overflow};
use crate::{Error, Scratch, Shot, Simulator};

impl Simulator {
    /// Writes the mean power `E|s(t_k)|^2` of the discrete sum \[A^2\]: what many pulses average
    /// to. It is also the mean square of the signal part of [`Simulator::record_into`].
    ///
    /// # Errors
    /// As [`Simulator::record_into`].
    pub fn mean_power_into<'a>(
        &self,
        shot: impl Into<Shot<'a>>,
        scratch: &mut Scratch,
        out_a2: &mut [f64],
    ) -> Result<(), Error> {
        let shot = shot.into();
        check_length("out_a2", out_a2.len(), self.record().samples)?;
        shot.validate()?;
        self.illuminate(shot.line, &[], scratch)?;
        let gain = self.amplitude_gain_a_sqrt_s(shot.line).powi(2);
        for (k, out) in out_a2.iter_mut().enumerate() {
            let lit = scratch
                .window
                .amplitudes_at(self.pulse(), shot.line.layer_thickness_m, k);
            let powers = lit
                .amplitudes()
                .filter(|(layer, _)| !shot.line.is_masked(*layer))
                .map(|(layer, f)| f.norm_sqr() * shot.weight_per_m(layer));
            *out = gain * powers.sum::<f64>();
        }
        check_overflow("out_a2", out_a2.iter().map(|power| power.is_finite()))
    }

    /// Writes the signal-to-noise ratio of each sample, (14), corrected: mean signal power over the
    /// noise power in the detector band.
    ///
    /// # Errors
    /// As [`Simulator::record_into`].
    pub fn snr_into<'a>(
        &self,
        shot: impl Into<Shot<'a>>,
        scratch: &mut Scratch,
        out: &mut [f64],
    ) -> Result<(), Error> {
        self.mean_power_into(shot, scratch, out)?;
        let noise_a2 = self.receiver().snr_noise_a2();
        for power in out {
            *power /= noise_a2;
        }
        Ok(())
    }

    /// The covariance `E{s(t_m) s*(t_n)}` of the samples of the envelope, without noise \[A^2\];
    /// row m, column n, Hermitian.
    ///
    /// With the covariance of the noise it gives the bound of any estimator for any profile of
    /// velocity and return along the line. Takes about `samples^2/2` times the number of lit
    /// layers products.
    ///
    /// # Errors
    /// As [`Simulator::record_into`].
    pub fn covariance_a2<'a>(
        &self,
        shot: impl Into<Shot<'a>>,
    ) -> Result<Array2<Complex<f64>>, Error> {
        let shot = shot.into();
        shot.validate()?;
        let line = shot.line;
        let samples = self.record().samples;
        let mut scratch = Scratch::default();
        self.illuminate(line, &[], &mut scratch)?;
        let gain = self.amplitude_gain_a_sqrt_s(line);
        let mut responses = Vec::with_capacity(samples);
        for k in 0..samples {
            let lit = scratch
                .window
                .amplitudes_at(self.pulse(), line.layer_thickness_m, k);
            let mut response = Response::new(lit.first, lit.re.len());
            for (layer, envelope) in lit.amplitudes() {
                if line.is_masked(layer) {
                    response.push(Complex::ZERO);
                    continue;
                }
                let phase_rad =
                    self.phase_rate_rad_s(line.radial_velocity_m_s[layer]) * self.time_s(k);
                let amplitude = gain * shot.weight_per_m(layer).sqrt();
                response.push(envelope * Complex::cis(phase_rad) * amplitude);
            }
            responses.push(response);
        }
        let mut covariance = Array2::zeros((samples, samples));
        for (m, row) in responses.iter().enumerate() {
            for (n, column) in responses[..=m].iter().enumerate() {
                let start = row.first.max(column.first);
                let sum = sum_of_products(row.from(start), column.from(start));
                covariance[(m, n)] = sum;
                covariance[(n, m)] = sum.conj();
            }
        }
        check_overflow(
            "covariance_a2",
            covariance.iter().map(|c: &Complex<f64>| c.is_finite()),
        )?;
        Ok(covariance)
    }
}

/// Response of a sample to each layer that is lit, `A`, in parts.
struct Response {
    /// First of these layers.
    first: usize,
    re: Vec<f64>,
    im: Vec<f64>,
}

impl Response {
    fn new(first: usize, layers: usize) -> Self {
        Self {
            first,
            re: Vec::with_capacity(layers),
            im: Vec::with_capacity(layers),
        }
    }

    fn push(&mut self, value: Complex<f64>) {
        self.re.push(value.re);
        self.im.push(value.im);
    }

    /// Real and imaginary parts from a layer on; empty if no layer is lit there.
    fn from(&self, layer: usize) -> [&[f64]; 2] {
        let skipped = layer - self.first;
        [&self.re, &self.im].map(|part| part.get(skipped..).unwrap_or(&[]))
    }
}

/// Numbers that are summed side by side.
const LANES: usize = 8;

/// Sum of `a b*` over the layers of both, in lanes: it compiles to vectors, and has the same bits
/// on any processor.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn sum_of_products(a: [&[f64]; 2], b: [&[f64]; 2]) -> Complex<f64> {
    let layers = a[0].len().min(b[0].len());
    let [a_re, a_im] = a.map(|part| part[..layers].as_chunks::<LANES>());
    let [b_re, b_im] = b.map(|part| part[..layers].as_chunks::<LANES>());
    let mut re = [0.0; LANES];
    let mut im = [0.0; LANES];
    for (((a_re, a_im), b_re), b_im) in a_re.0.iter().zip(a_im.0).zip(b_re.0).zip(b_im.0) {
        for lane in 0..LANES {
            re[lane] += a_re[lane] * b_re[lane] + a_im[lane] * b_im[lane];
            im[lane] += a_im[lane] * b_re[lane] - a_re[lane] * b_im[lane];
        }
    }
    for lane in 0..a_re.1.len() {
        re[lane] += a_re.1[lane] * b_re.1[lane] + a_im.1[lane] * b_im.1[lane];
        im[lane] += a_im.1[lane] * b_re.1[lane] - a_re.1[lane] * b_im.1[lane];
    }
    Complex::new(re.iter().sum(), im.iter().sum())
}
