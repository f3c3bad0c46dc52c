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

/// Most samples whose amplitudes are stored for layers thicker than a sample.
const MOST_SAMPLES_PER_LAYER: f64 = 16.0;

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

/// Samples after which a whole number of layers has passed, and that number: several layers a sample
/// or several samples a layer; `None` if no such number holds over the whole record.
fn period(layers_per_sample: f64, samples: usize) -> Option<(usize, i64)> {
    let tolerance = ALIGNMENT_TOLERANCE / samples as f64;
    let layers = layers_per_sample.round();
    if (layers_per_sample - layers).abs() <= tolerance {
        return Some((1, layers as i64));
    }
    let samples_per_layer = layers_per_sample.recip().round();
    let is_whole = (layers_per_sample - samples_per_layer.recip()).abs() <= tolerance;
    (is_whole && samples_per_layer <= MOST_SAMPLES_PER_LAYER)
        .then_some((samples_per_layer as usize, 1))
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
    /// Samples after which a whole number of layers has passed, and that number, if they are so over
    /// the whole record.
    period: Option<(usize, i64)>,
    /// Layers nearest to the samples of the first period.
    nearest: Vec<i64>,
    /// Layers of [`lit_layers`].
    lit: usize,
    /// Real parts of the amplitudes of the layers from `-near` to `far` about the nearest one, and
    /// imaginary parts unless the envelope is real; for each sample of a period.
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
        self.period = period(self.step, record.samples);
        turns.clone_into(&mut self.turns);
        self.lit = lit_layers(self.near, self.far);
        let samples = self.period.map_or(1, |(samples, _)| samples);
        let real = pulse.is_real() && turns.is_empty();
        self.re.resize(samples * self.lit, 0.0);
        self.im
            .resize(if real { 0 } else { samples * self.lit }, 0.0);
        self.nearest.clear();
        if self.period.is_some() {
            for sample in 0..samples {
                let position = self.start + sample as f64 * self.step;
                let nearest = position.round();
                self.nearest.push(nearest as i64);
                self.fill_amplitudes(pulse, thickness_m, sample, position - nearest);
            }
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

    /// Amplitudes for a sample of a period whose range lies `offset` layers beyond the centre of
    /// the nearest layer.
    fn fill_amplitudes(&mut self, pulse: &Pulse, thickness_m: f64, sample: usize, offset: f64) {
        let layer_s = 2.0 * thickness_m / SPEED_OF_LIGHT_M_S;
        let near = self.near as f64;
        let here = sample * self.lit..(sample + 1) * self.lit;
        if self.im.is_empty() {
            for (j, re) in self.re[here].iter_mut().enumerate() {
                let time_s = (offset + near - j as f64) * layer_s;
                *re = pulse.envelope_per_sqrt_s(time_s).re;
            }
            return;
        }
        let parts = self.re[here.clone()].iter_mut().zip(&mut self.im[here]);
        for (j, (re, im)) in parts.enumerate() {
            let time_s = (offset + near - j as f64) * layer_s;
            let turn = self.turns.get(j).copied().unwrap_or(Complex::ONE);
            let amplitude = pulse.envelope_per_sqrt_s(time_s) * turn;
            *re = amplitude.re;
            *im = amplitude.im;
        }
    }

    /// Index of the layer nearest to the range of sample `k`, which may lie outside the line.
    fn centre(&self, k: usize) -> i64 {
        let Some((samples, layers)) = self.period else {
            return (self.start + k as f64 * self.step).round() as i64;
        };
        let passed = ((k / samples) as i64).saturating_mul(layers);
        self.nearest[k % samples].saturating_add(passed)
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
        if self.period.is_none() {
            let position = self.start + k as f64 * self.step;
            self.fill_amplitudes(pulse, thickness_m, 0, position - position.round());
        }
        let (first, end) = self.layers_at(k);
        if first == end {
            return Lit {
                first,
                re: &[],
                im: &[],
            };
        }
        let sample = self.period.map_or(0, |(samples, _)| k % samples);
        let shift = sample * self.lit + (first as i64 - (self.centre(k) - self.near)) as usize;
        let lit = shift..shift + (end - first);
        Lit {
            first,
            re: &self.re[lit.clone()],
            im: self.im.get(lit).unwrap_or(&[]),
        }
    }
}
