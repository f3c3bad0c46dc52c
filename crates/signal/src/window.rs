//! Which layers the pulse lights at each sample, and with what amplitude.
//!
//! The range that sample k sees is `c t_k/2`; the sum (15) is centred on the layer nearest to it (corrected: the chapter
//! centres it on R = 0) and reaches `L_c` layers to each side.
//!
//! Check: the energy outside the sum is below 1e-6 of the whole.

use crate::error::check;
use crate::{Error, GaussianPulse, LineOfSight, SPEED_OF_LIGHT_M_S};

/// Half-length of the sum in units of `sigma` (Frehlich 1997): outside lies `erfc(3.72)` = 1.4e-7 of the energy.
const HALF_LENGTH_SIGMAS: f64 = 3.72;

/// Largest half-length of the sum, in layers: a bound on memory, far beyond any useful layer thickness.
const MAX_HALF_LENGTH: f64 = 1e7;

/// Layers per sample may differ from a whole number by this much over the whole record, in layers, before the
/// amplitudes are computed anew for each sample.
const ALIGNMENT_TOLERANCE: f64 = 1e-6;

/// Number of layers summed to each side of the nearest one, `L_c = ceil(3.72 sigma c/(2 DeltaR))` (corrected: the
/// chapter's form is dimensionally wrong).
pub(crate) fn half_length(pulse: &GaussianPulse, layer_thickness_m: f64) -> Result<usize, Error> {
    let layers = (HALF_LENGTH_SIGMAS * pulse.sigma_m() / layer_thickness_m).ceil();
    check("layer_thickness_m", layer_thickness_m, "at least 4e-7 of the length of the pulse in range", |_| {
        layers <= MAX_HALF_LENGTH
    })?;
    Ok(layers as usize)
}

/// The lit layers of each sample of a record, and the amplitudes `f(t_k - 2 R_l/c)` \[s^-1/2\] of the present sample.
#[derive(Debug, Default)]
pub(crate) struct Window {
    layers: usize,
    half_length: usize,
    /// Position of the first sample's range, in layers from the first layer.
    start: f64,
    /// Layers per sampling interval.
    step: f64,
    /// Whole number of layers per sample, if it is one over the whole record.
    aligned_step: Option<i64>,
    /// Amplitudes of the layers from `-half_length` to `half_length` about the nearest one.
    amplitude: Vec<f64>,
}

impl Window {
    /// Prepares the window for a record of `samples` samples.
    pub(crate) fn prepare(
        &mut self,
        pulse: &GaussianPulse,
        line: &LineOfSight,
        first_time_s: f64,
        interval_s: f64,
        samples: usize,
    ) -> Result<(), Error> {
        let thickness_m = line.layer_thickness_m;
        self.layers = line.layers();
        self.half_length = half_length(pulse, thickness_m)?;
        self.start = (0.5 * SPEED_OF_LIGHT_M_S * first_time_s - line.first_range_m) / thickness_m;
        self.step = 0.5 * SPEED_OF_LIGHT_M_S * interval_s / thickness_m;
        let whole = self.step.round();
        let aligned = (self.step - whole).abs() * samples as f64 <= ALIGNMENT_TOLERANCE;
        self.aligned_step = aligned.then_some(whole as i64);
        self.amplitude.resize(2 * self.half_length + 1, 0.0);
        if aligned {
            self.fill_amplitudes(pulse, thickness_m, self.start - self.start.round());
        }
        Ok(())
    }

    /// Amplitudes for a sample whose range lies `offset` layers beyond the centre of the nearest layer.
    fn fill_amplitudes(&mut self, pulse: &GaussianPulse, thickness_m: f64, offset: f64) {
        let layer_s = 2.0 * thickness_m / SPEED_OF_LIGHT_M_S;
        let half = self.half_length as f64;
        for (j, amplitude) in self.amplitude.iter_mut().enumerate() {
            *amplitude = pulse.envelope_per_sqrt_s((offset + half - j as f64) * layer_s);
        }
    }

    /// Index of the layer nearest to the range of sample `k`, which may lie outside the line.
    fn centre(&self, k: usize) -> i64 {
        match self.aligned_step {
            Some(step) => (self.start.round() as i64).saturating_add((k as i64).saturating_mul(step)),
            None => (self.start + k as f64 * self.step).round() as i64,
        }
    }

    /// Layers lit at sample `k` as `(first, one past the last)`, both within the line.
    pub(crate) fn layers_at(&self, k: usize) -> (usize, usize) {
        let (centre, half) = (self.centre(k), self.half_length as i64);
        let clip = |l: i64| l.clamp(0, self.layers as i64) as usize;
        let first = clip(centre.saturating_sub(half));
        (first, clip(centre.saturating_add(half + 1)).max(first))
    }

    /// Amplitudes of the layers of [`Window::layers_at`].
    pub(crate) fn amplitudes_at(&mut self, pulse: &GaussianPulse, thickness_m: f64, k: usize) -> &[f64] {
        if self.aligned_step.is_none() {
            let position = self.start + k as f64 * self.step;
            self.fill_amplitudes(pulse, thickness_m, position - position.round());
        }
        let (first, end) = self.layers_at(k);
        if first == end {
            return &[];
        }
        let shift = (first as i64 - (self.centre(k) - self.half_length as i64)) as usize;
        &self.amplitude[shift..shift + (end - first)]
    }
}
