//! The layers that the pulse lights at each sample, and their amplitudes.
//!
//! The range of sample k is `c t_k/2`; the sum (15) is centred on the layer nearest to it
//! (corrected: the chapter centres it on R = 0) and reaches over the support of the pulse, `L_c`
//! layers to each side for a Gaussian.
//!
//! Check: the energy outside the sum is below 1e-6 of the whole.

use num_complex::Complex;

use crate::error::check;
use crate::record::Record;
use crate::{Error, LineOfSight, Pulse, SPEED_OF_LIGHT_M_S};

/// Most layers to one side of the nearest one: a bound on memory, far beyond any useful
/// layer thickness.
const MAX_REACH: f64 = 1e7;

/// Layers per sample may differ from a whole number by this much over the whole record, in layers,
/// before the amplitudes are computed anew for each sample.
const ALIGNMENT_TOLERANCE: f64 = 1e-6;

/// Number of layers summed on this side of the nearest one and beyond it. For a Gaussian both are
/// `L_c = ceil(3.72 sigma c/(2 DeltaR))` (corrected: the chapter's form is dimensionally wrong);
/// one may be negative if the envelope lies on one side of time 0.
pub(crate) fn reach(pulse: &Pulse, layer_thickness_m: f64) -> Result<(i64, i64), Error> {
    let (first_s, last_s) = pulse.support_s();
    let near = (0.5 * SPEED_OF_LIGHT_M_S * last_s / layer_thickness_m).ceil();
    let far = (0.5 * SPEED_OF_LIGHT_M_S * -first_s / layer_thickness_m).ceil();
    let allowed = "at least 4e-7 of the length of the pulse in range";
    check("layer_thickness_m", layer_thickness_m, allowed, |_| {
        near.abs().max(far.abs()) <= MAX_REACH
    })?;
    let allowed = "at most max_layer_thickness_m() of the pulse";
    check("layer_thickness_m", layer_thickness_m, allowed, |t| {
        t <= pulse.max_layer_thickness_m()
    })?;
    Ok((near as i64, far as i64))
}

/// Number of layers from the nearest to the farthest of [`reach`].
pub(crate) fn lit_layers(near: i64, far: i64) -> usize {
    (near + far + 1).max(1) as usize
}

/// The lit layers of each sample of a record, and the amplitudes `f(t_k - 2 R_l/c)` \[s^-1/2\] of
/// the present sample.
#[derive(Debug, Default)]
pub(crate) struct Window {
    layers: usize,
    near: i64,
    far: i64,
    /// Position of the first sample's range, in layers from the first layer.
    start: f64,
    /// Layers per sampling interval.
    step: f64,
    /// Whole number of layers per sample, if it is one over the whole record.
    aligned_step: Option<i64>,
    /// Real parts of the amplitudes of the layers from `-near` to `far` about the nearest one, and
    /// imaginary parts unless the envelope is real.
    re: Vec<f64>,
    im: Vec<f64>,
    /// Factors `exp(j phase)` on them, the phase of the laser while it sent the pulse; empty
    /// for a quiet laser.
    turns: Vec<Complex<f64>>,
}

/// Amplitudes of the layers from `first` on: real parts, and imaginary parts unless the
/// envelope is real.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lit<'a> {
    pub(crate) first: usize,
    pub(crate) re: &'a [f64],
    pub(crate) im: &'a [f64],
}

impl Lit<'_> {
    /// The layers and their amplitudes as complex numbers.
    pub(crate) fn amplitudes(&self) -> impl Iterator<Item = (usize, Complex<f64>)> {
        self.re.iter().enumerate().map(|(j, re)| {
            let im = self.im.get(j).copied().unwrap_or(0.0);
            (self.first + j, Complex::new(*re, im))
        })
    }
}

impl Window {
    /// Prepares the window for a record; `turns` are factors of the laser's phase, one for each of
    /// [`lit_layers`], or none.
    pub(crate) fn prepare(
        &mut self,
        pulse: &Pulse,
        line: &LineOfSight,
        turns: &[Complex<f64>],
        record: &Record,
        sample_rate_hz: f64,
    ) -> Result<(), Error> {
        let thickness_m = line.layer_thickness_m;
        self.layers = line.layers();
        (self.near, self.far) = reach(pulse, thickness_m)?;
        self.start = (0.5 * SPEED_OF_LIGHT_M_S * record.time_of_first_sample_s
            - line.first_range_m)
            / thickness_m;
        self.step = 0.5 * SPEED_OF_LIGHT_M_S * (1.0 / sample_rate_hz) / thickness_m;
        let whole = self.step.round();
        let aligned = (self.step - whole).abs() * record.samples as f64 <= ALIGNMENT_TOLERANCE;
        self.aligned_step = aligned.then_some(whole as i64);
        turns.clone_into(&mut self.turns);
        let count = lit_layers(self.near, self.far);
        let real = pulse.is_real() && turns.is_empty();
        self.re.resize(count, 0.0);
        self.im.resize(if real { 0 } else { count }, 0.0);
        if aligned {
            self.fill_amplitudes(pulse, thickness_m, self.start - self.start.round());
        }
        Ok(())
    }

    /// Factor of the laser's phase `time_s` after the middle of the pulse; beyond its support
    /// that of the end.
    pub(crate) fn turn_at(&self, thickness_m: f64, time_s: f64) -> Complex<f64> {
        let layer = self.near as f64 - 0.5 * SPEED_OF_LIGHT_M_S * time_s / thickness_m;
        let index = (layer.round().max(0.0) as usize).min(self.turns.len().saturating_sub(1));
        self.turns.get(index).copied().unwrap_or(Complex::ONE)
    }

    /// Amplitudes for a sample whose range lies `offset` layers beyond the centre of
    /// the nearest layer.
    fn fill_amplitudes(&mut self, pulse: &Pulse, thickness_m: f64, offset: f64) {
        let layer_s = 2.0 * thickness_m / SPEED_OF_LIGHT_M_S;
        let near = self.near as f64;
        if self.im.is_empty() {
            for (j, re) in self.re.iter_mut().enumerate() {
                let time_s = (offset + near - j as f64) * layer_s;
                *re = pulse.envelope_per_sqrt_s(time_s).re;
            }
            return;
        }
        for (j, (re, im)) in self.re.iter_mut().zip(&mut self.im).enumerate() {
            let time_s = (offset + near - j as f64) * layer_s;
            let turn = self.turns.get(j).copied().unwrap_or(Complex::ONE);
            let amplitude = pulse.envelope_per_sqrt_s(time_s) * turn;
            *re = amplitude.re;
            *im = amplitude.im;
        }
    }

    /// Index of the layer nearest to the range of sample `k`, which may lie outside the line.
    fn centre(&self, k: usize) -> i64 {
        match self.aligned_step {
            Some(step) => {
                (self.start.round() as i64).saturating_add((k as i64).saturating_mul(step))
            }
            None => (self.start + k as f64 * self.step).round() as i64,
        }
    }

    /// Layers lit at sample `k` as `(first, one past the last)`, both within the line.
    pub(crate) fn layers_at(&self, k: usize) -> (usize, usize) {
        let centre = self.centre(k);
        let layers = self.layers as i64;
        let first = centre.saturating_sub(self.near).clamp(0, layers) as usize;
        let end = centre.saturating_add(self.far + 1).clamp(0, layers) as usize;
        (first, end.max(first))
    }

    /// Amplitudes of the layers of [`Window::layers_at`].
    pub(crate) fn amplitudes_at(&mut self, pulse: &Pulse, thickness_m: f64, k: usize) -> Lit<'_> {
        if self.aligned_step.is_none() {
            let position = self.start + k as f64 * self.step;
            self.fill_amplitudes(pulse, thickness_m, position - position.round());
        }
        let (first, end) = self.layers_at(k);
        if first == end {
            return Lit {
                first,
                re: &[],
                im: &[],
            };
        }
        let shift = (first as i64 - (self.centre(k) - self.near)) as usize;
        let lit = shift..shift + (end - first);
        Lit {
            first,
            re: &self.re[lit.clone()],
            im: self.im.get(lit).unwrap_or(&[]),
        }
    }
}
