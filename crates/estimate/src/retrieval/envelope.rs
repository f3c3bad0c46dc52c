//! Velocity envelopes (Koepp, Rahm, Smalikho 2004): the fastest air on each line from its spectrum, and the circulation that it tells.
//!
//! On a line that passes a core at the distance r the fastest air is that of the tangent point, 2 pi r V its circulation. But the
//! outermost velocity V_T where a spectrum falls through a threshold T also holds the width of the spectrum and the signal-to-noise ratio:
//!
//! ```text
//! P(v) = 1 + SNR v_B integral w(x) (kappa / sqrt(pi)) exp(-kappa^2 (v - v_R(x))^2) dx,   v_B = lambda B_w / 2,
//! kappa = 4 pi sigma_p / lambda,  sigma_p = sigma sigma_h / sqrt(sigma^2 + sigma_h^2);  calm air: V_T = sqrt(ln(S / (T - 1))) / kappa
//! ```
//!
//! So three numbers are reported: the raw one, that less the width in calm air, and the inverted one, for which each line's circulation is
//! the one that makes the expected V_T the measured one. The first two are tens of per cent wrong. Check: the errors of an
//! independent program; synthetic spectra.

use ndarray::ArrayView3;
use std::f64::consts::PI;

use crate::Measured;
use crate::error::{Error, length, positive};
use crate::estimators::tails::bisected;
use crate::retrieval::Side;
use crate::vortex_fit::map_fit::data::{nearest_index, validate_axes};
use crate::vortex_fit::{Vortex, Wake, WakeModel};
use crate::window::SPEED_OF_LIGHT_M_S;

/// Distances from the core of the lines that are used \[m\].
const OFF_M: (f64, f64) = (5.0, 15.0);
/// Air that is integrated over: standard deviations of the gate to each side, and the number of steps.
const REACH: f64 = 3.5;
const STEPS: i32 = 140;
/// Circulations that are tried \[m^2/s\] apart, how many, and halvings between two.
const STEP_M2_S: f64 = 50.0;
const STEPS_UP: i32 = 40;
const HALVINGS: usize = 20;

/// What spectra are made of: a Gaussian pulse through a Gaussian window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpectralShape {
    /// Half-width at 1/e of a line in uniform wind, 1/kappa \[m/s\].
    pub width_m_s: f64,
    /// Width of the band of the noise, lambda B_w / 2 \[m/s\].
    pub band_m_s: f64,
    /// Standard deviation of the weight of the air along the line \[m\].
    pub gate_std_m: f64,
}

impl SpectralShape {
    /// Of a pulse exp(-t^2 / (2 sigma^2)) and a window of `window_sigma_s` \[s\] alike.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for numbers that are not positive.
    pub fn gaussian(
        pulse_sigma_s: f64,
        window_sigma_s: f64,
        wavelength_m: f64,
        bandwidth_hz: f64,
    ) -> Result<Self, Error> {
        positive("pulse_sigma_s", pulse_sigma_s)?;
        positive("window_sigma_s", window_sigma_s)?;
        positive("wavelength_m", wavelength_m)?;
        positive("bandwidth_hz", bandwidth_hz)?;
        let both_s = pulse_sigma_s.hypot(window_sigma_s);
        Ok(Self {
            width_m_s: wavelength_m * both_s / (4.0 * PI * pulse_sigma_s * window_sigma_s),
            band_m_s: 0.5 * wavelength_m * bandwidth_hz,
            gate_std_m: 0.5 * SPEED_OF_LIGHT_M_S * both_s / 2.0_f64.sqrt(),
        })
    }

    /// Half-width of the spectrum of calm air at a threshold \[m/s\]; nothing if its peak is below.
    #[must_use]
    pub fn calm_width_m_s(&self, snr: f64, threshold: f64) -> Option<f64> {
        let peak = snr * self.band_m_s / (self.width_m_s * PI.sqrt());
        let square = (peak / (threshold - 1.0)).ln();
        (square > 0.0).then(|| self.width_m_s * square.sqrt())
    }

    /// Expected power over the noise at a velocity, given the velocities of the air with their weights.
    fn power(&self, air: &[(f64, f64)], snr: f64, velocity_m_s: f64) -> f64 {
        let lines = air.iter().map(|(weight, air_m_s)| {
            weight * (-((velocity_m_s - air_m_s) / self.width_m_s).powi(2)).exp()
        });
        1.0 + snr * self.band_m_s / (self.width_m_s * PI.sqrt()) * lines.sum::<f64>()
    }

    /// Outermost velocity \[m/s\] in the direction of `sign` where the expected spectrum of a line of sight falls through the threshold;
    /// nothing if it is nowhere above.
    #[must_use]
    pub fn expected_envelope_m_s(
        &self,
        (model, wake): (&WakeModel, &Wake),
        (range_m, elevation_rad): (f64, f64),
        (snr, threshold): (f64, f64),
        sign: f64,
    ) -> Option<f64> {
        let air: Vec<(f64, f64)> = (-STEPS / 2..=STEPS / 2)
            .map(|i| {
                let away = 2.0 * REACH * f64::from(i) / f64::from(STEPS);
                let at_m = range_m + away * self.gate_std_m;
                (
                    (-0.5 * away * away).exp(),
                    sign * model.radial_velocity_m_s(wake, at_m, elevation_rad),
                )
            })
            .collect();
        let sum: f64 = air.iter().map(|(weight, _)| weight).sum();
        let air: Vec<(f64, f64)> = air
            .into_iter()
            .map(|(weight, v)| (weight / sum, v))
            .collect();
        let fastest = air
            .iter()
            .fold(f64::NEG_INFINITY, |most, (_, v)| most.max(*v));
        let slowest = air
            .iter()
            .fold(f64::INFINITY, |least, (_, v)| least.min(*v));
        // inwards in small steps to the first velocity that is above, then between the two
        let step = 0.1 * self.width_m_s;
        let from = fastest + 6.0 * self.width_m_s;
        let count = ((from - slowest) / step).ceil() as i32;
        let above = (0..=count)
            .map(|i| from - f64::from(i) * step)
            .find(|v| self.power(&air, snr, *v) >= threshold)?;
        let [outermost, _] = bisected(above, above + step, HALVINGS, |v| {
            self.power(&air, snr, v) >= threshold
        });
        Some(sign * outermost)
    }
}

/// Spectra of a scan.
#[derive(Debug, Clone, Copy)]
pub struct ScanSpectra<'a> {
    /// Elevation of the lines \[rad\], increasing.
    pub elevation_rad: &'a [f64],
    /// Ranges of the gates \[m\], increasing.
    pub range_m: &'a [f64],
    /// Velocities of the cells \[m/s\], increasing, positive away from the lidar.
    pub velocity_m_s: &'a [f64],
    /// Power over the mean of the noise \[line, gate, velocity\].
    pub power: ArrayView3<'a, f64>,
    /// Signal-to-noise ratio in the band.
    pub snr: f64,
}

/// Circulation of a vortex over radii of 5 to 15 m from the envelopes of the lines that pass it there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EnvelopeResult {
    /// Which vortex.
    pub side: Side,
    /// Mean of 2 pi r V_T \[m^2/s\], V_T against the wind: as it is, tens of per cent too large.
    pub raw_m2_s: f64,
    /// The same less the width of the spectrum of calm air \[m^2/s\]: too small.
    pub narrowed_m2_s: f64,
    /// The circulation \[m^2/s\] whose expected envelopes are the measured ones, with the standard deviation of the mean over lines.
    pub inverted_m2_s: Measured,
    /// Lines used.
    pub lines: usize,
    /// Lines left out, whose envelope meets the end of the band or which are nowhere above the threshold.
    pub left_out: usize,
}

/// Circulations of both vortices by velocity envelopes; `about` tells where they are, how large their cores are and what the wind is.
/// `threshold` is a power over the noise; [`cell_threshold`](crate::estimators::cell_threshold()) has the one for a rate of false alarms.
///
/// # Errors
/// [`Error::Length`], [`Error::OutOfRange`] for impossible input.
pub fn velocity_envelopes(
    spectra: &ScanSpectra<'_>,
    shape: &SpectralShape,
    model: &WakeModel,
    about: &Wake,
    threshold: f64,
) -> Result<[EnvelopeResult; 2], Error> {
    let (lines, gates, cells) = spectra.power.dim();
    length("lines of power", spectra.elevation_rad.len(), lines)?;
    length("gates of power", spectra.range_m.len(), gates)?;
    length("velocities of power", spectra.velocity_m_s.len(), cells)?;
    validate_axes(spectra.elevation_rad, spectra.range_m)?;
    crate::error::increasing("velocity_m_s", spectra.velocity_m_s)?;
    positive("snr", spectra.snr)?;
    positive("threshold - 1", threshold - 1.0)?;
    about.validate()?;
    Ok(Side::BOTH.map(|side| {
        let envelopes = Envelopes {
            spectra,
            shape,
            model,
            about,
            side,
            threshold,
        };
        envelopes.result()
    }))
}

/// Spectra of a scan with the vortex whose envelopes they show.
struct Envelopes<'a, 's> {
    spectra: &'a ScanSpectra<'s>,
    shape: &'a SpectralShape,
    model: &'a WakeModel,
    /// The wake that the vortex is part of.
    about: &'a Wake,
    side: Side,
    threshold: f64,
}

impl Envelopes<'_, '_> {
    /// The circulation of the vortex from all lines that pass it at the radii that are used.
    fn result(&self) -> EnvelopeResult {
        let spectra = self.spectra;
        let position_m = self.vortex().place_m();
        let (range_m, elevation_rad) = self.model.range_and_elevation(position_m);
        let gate = nearest_index(spectra.range_m, range_m);
        let mut circulations_m2_s = vec![];
        let mut left_out = 0;
        for (line, elevation) in spectra.elevation_rad.iter().enumerate() {
            let off_m = range_m * (elevation - elevation_rad).sin();
            let Some(gate) = gate.filter(|_| (OFF_M.0..=OFF_M.1).contains(&off_m.abs())) else {
                continue;
            };
            match self.circulations_m2_s(line, gate, off_m) {
                Some(of_line) => circulations_m2_s.push(of_line),
                None => left_out += 1,
            }
        }
        let count = circulations_m2_s.len() as f64;
        let [raw_m2_s, narrowed_m2_s, value] = [0, 1, 2].map(|method| {
            let of_method = circulations_m2_s.iter().map(|of_line| of_line[method]);
            of_method.sum::<f64>() / count
        });
        let squares: f64 = circulations_m2_s
            .iter()
            .map(|[_, _, inverted_m2_s]| (inverted_m2_s - value).powi(2))
            .sum();
        EnvelopeResult {
            side: self.side,
            raw_m2_s,
            narrowed_m2_s,
            inverted_m2_s: Measured {
                value,
                std: (squares / (count - 1.0) / count).sqrt(),
            },
            lines: circulations_m2_s.len(),
            left_out,
        }
    }

    /// Raw, narrowed and inverted circulation from a line that passes the centre `off_m` above it; nothing without an envelope or if no
    /// circulation has this one.
    fn circulations_m2_s(&self, line: usize, gate: usize, off_m: f64) -> Option<[f64; 3]> {
        let spectra = self.spectra;
        // above a left vortex the air goes away
        let sense = if self.side == Side::Left { -1.0 } else { 1.0 };
        let sign = -sense * off_m.signum();
        let power = spectra.power.slice(ndarray::s![line, gate, ..]);
        let envelope = measured(spectra.velocity_m_s, power, self.threshold, sign)?;
        let place = (spectra.range_m[gate], spectra.elevation_rad[line]);
        let height_m = self.model.position_m(place.0, place.1).1;
        let wind = self.about.wind_at_m_s(height_m) * place.1.cos();
        let speed = sign * (envelope - wind);
        // upwards: very fast air is so spread out that nothing of it is above the threshold
        let step = (1..=STEPS_UP)
            .find(|step| self.is_faster(STEP_M2_S * f64::from(*step), place, sign, envelope))?;
        let [low, high] = [step - 1, step].map(|step| STEP_M2_S * f64::from(step));
        let [found, _] = bisected(low, high, HALVINGS, |circulation_m2_s| {
            !self.is_faster(circulation_m2_s, place, sign, envelope)
        });
        let calm = self.shape.calm_width_m_s(spectra.snr, self.threshold);
        let share = self.model.profile.mean_5_15(self.vortex().core_radius_m).0;
        Some([
            2.0 * PI * off_m.abs() * speed,
            2.0 * PI * off_m.abs() * (speed - calm.unwrap_or(0.0)),
            share * found,
        ])
    }

    /// Whether the expected envelope of a vortex of that circulation lies beyond the measured one, at a range and an elevation.
    fn is_faster(
        &self,
        circulation_m2_s: f64,
        place: (f64, f64),
        sign: f64,
        envelope: f64,
    ) -> bool {
        let vortex = Vortex {
            circulation_m2_s,
            ..*self.vortex()
        };
        let mut wake = *self.about;
        match self.side {
            Side::Left => wake.left = vortex,
            Side::Right => wake.right = vortex,
        }
        let expected = self.shape.expected_envelope_m_s(
            (self.model, &wake),
            place,
            (self.spectra.snr, self.threshold),
            sign,
        );
        expected.is_some_and(|v| sign * v > sign * envelope)
    }

    fn vortex(&self) -> &Vortex {
        match self.side {
            Side::Left => &self.about.left,
            Side::Right => &self.about.right,
        }
    }
}

/// Outermost velocity where a measured spectrum falls through the threshold; nothing at the end of the band or nowhere above.
fn measured(
    velocity_m_s: &[f64],
    power: ndarray::ArrayView1<'_, f64>,
    threshold: f64,
    sign: f64,
) -> Option<f64> {
    let last = velocity_m_s.len().checked_sub(1)?;
    let inner = (0..=last)
        .map(|i| if sign > 0.0 { last - i } else { i })
        .find(|i| power[*i] >= threshold)?;
    let outer = if sign > 0.0 {
        inner.checked_add(1).filter(|i| *i <= last)
    } else {
        inner.checked_sub(1)
    }?;
    let part = (power[inner] - threshold) / (power[inner] - power[outer]);
    Some(velocity_m_s[inner] + part * (velocity_m_s[outer] - velocity_m_s[inner]))
}
