//! Trials of velocity estimators in a uniform random wind.
//!
//! Every trial has its own velocity, spread evenly over the inner part of the detector band, and independent windows of it:
//! one window of 64 samples per pulse. All estimators see the same windows. The generator is keyed by trial and pulse, so the
//! errors do not depend on the number of threads.

use super::methods::{Known, Methods};
use crate::failure::Failure;
use fixtures::{ENERGY_J, WINDOW, receiver, sampling};
use rayon::prelude::*;
use wakescope_estimate::{Scratch, models::Autoregression, window::SPEED_OF_LIGHT_M_S};
use wakescope_signal::scan::{PulseKey, pulse_generator};
use wakescope_signal::{GaussianPulse, LineOfSight, NoiseModel, PulseDuration, Record, Simulator};

/// Velocities lie within this distance of rest \[m/s\]: the band ends at 19.4.
const FASTEST_M_S: f64 = 14.0;
/// Width of the band \[m/s\], its 50 MHz times half a wavelength: where bad estimates lie.
pub(crate) const BAND_M_S: f64 = 38.75;
/// Name of the estimator that takes a single window.
pub(crate) const BURG: &str = "Burg(16), pole";

/// Where the windows come from.
pub(crate) struct Air {
    simulator: Simulator,
    pulse: GaussianPulse,
    line: LineOfSight,
    scale_a: f64,
    seed: u64,
}

impl Air {
    /// Uniform air seen with a pulse of that full width at half maximum, noise and signal-to-noise ratio.
    pub(crate) fn new(noise: NoiseModel, pulse_s: f64, snr_db: f64, seed: u64) -> Result<Self, Failure> {
        let receiver = receiver(noise);
        let pulse = GaussianPulse::new(PulseDuration::FullWidthHalfMaximum(pulse_s), ENERGY_J)?;
        let sample_m = 0.5 * SPEED_OF_LIGHT_M_S / receiver.sample_rate_hz;
        // five half-widths of the pulse before and after the window
        let reach = (2.5 * pulse.sigma_s() * receiver.sample_rate_hz * 2.0).ceil() as usize;
        let first_m = 400.0;
        let record = Record { time_of_first_sample_s: 2.0 * first_m / SPEED_OF_LIGHT_M_S, samples: WINDOW };
        let layers = WINDOW + 2 * reach;
        let line = LineOfSight {
            first_range_m: first_m - reach as f64 * sample_m,
            layer_thickness_m: sample_m,
            radial_velocity_m_s: vec![0.0; layers],
            weight_per_m: vec![10f64.powf(0.1 * snr_db) / receiver.slowly_varying_snr(ENERGY_J, 1.0); layers],
        };
        let scale_a = receiver.noise_variance_a2().sqrt();
        Ok(Self { simulator: Simulator::new(pulse, receiver, record)?, pulse, line, scale_a, seed })
    }

    /// Half-width of |f|^2 at 1/e \[s\].
    pub(crate) fn sigma_s(&self) -> f64 {
        self.pulse.sigma_s()
    }

    /// One window of a trial, in units of the noise in the band.
    pub(crate) fn window(
        &self,
        line: &LineOfSight,
        trial: usize,
        pulse: usize,
        scratch: &mut wakescope_signal::Scratch,
        out: &mut [f64],
    ) -> Result<(), Failure> {
        let mut rng = pulse_generator(self.seed, PulseKey { line: trial, pulse });
        self.simulator.record_into(line, &mut rng, scratch, out)?;
        out.iter_mut().for_each(|sample| *sample /= self.scale_a);
        Ok(())
    }

    /// The line of sight of one of `trials` trials and its velocity.
    pub(crate) fn line(&self, trial: usize, trials: usize) -> (LineOfSight, f64) {
        let velocity_m_s = FASTEST_M_S * (2.0 * (trial as f64 + 0.5) / trials as f64 - 1.0);
        let layers = self.line.layers();
        (LineOfSight { radial_velocity_m_s: vec![velocity_m_s; layers], ..self.line.clone() }, velocity_m_s)
    }
}

/// Errors of one estimator after accumulating that many pulses \[m/s\]; NaN where it says that it has no velocity.
pub(crate) struct Errors {
    pub(crate) method: &'static str,
    pub(crate) pulses: usize,
    pub(crate) errors_m_s: Vec<f64>,
}

/// Errors of all methods for each of the increasing numbers of pulses; Burg's for one window.
pub(crate) fn errors(air: &Air, known: &Known, pulses: &[usize], trials: usize) -> Result<Vec<Errors>, Failure> {
    let sampling = sampling()?;
    let Methods { statistics, methods, .. } = Methods::all(known, pulses)?;
    let rows: Vec<Vec<f64>> = (0..trials)
        .into_par_iter()
        .map(|trial| -> Result<Vec<f64>, String> {
            let (line, velocity_m_s) = air.line(trial, trials);
            let (mut scratch, mut signal) = (Scratch::new(), wakescope_signal::Scratch::default());
            let mut window = vec![0.0; WINDOW];
            let mut sums: Vec<Vec<f64>> =
                statistics.iter().map(|statistic| vec![0.0; statistic.statistic_len()]).collect();
            let (mut one, mut mean) = (Vec::new(), Vec::new());
            let mut found = Vec::new();
            for pulse in 0..pulses.last().copied().unwrap_or(0) {
                air.window(&line, trial, pulse, &mut signal, &mut window).map_err(|e| e.to_string())?;
                if pulse == 0 {
                    let model = Autoregression::burg(&window, 16).map_err(|e| e.to_string())?;
                    let pole = model.nearest_pole(&sampling).map_err(|e| e.to_string())?;
                    found.push(pole.map_or(f64::NAN, |(f_hz, _)| sampling.velocity_m_s(f_hz) - velocity_m_s));
                }
                for (statistic, sum) in statistics.iter().zip(&mut sums) {
                    one.resize(sum.len(), 0.0);
                    statistic.evaluate(&window, &mut scratch, &mut one);
                    sum.iter_mut().zip(&one).for_each(|(sum, value)| *sum += value);
                }
                if let Some(place) = pulses.iter().position(|&n| n == pulse + 1) {
                    for method in &methods {
                        mean.clear();
                        mean.extend(sums[method.statistic].iter().map(|sum| sum / (pulse + 1) as f64));
                        let estimate = method.estimators[place].estimate(&mean, &mut scratch);
                        let good = estimate.is_good();
                        found.push(if good { estimate.velocity_m_s - velocity_m_s } else { f64::NAN });
                    }
                }
            }
            Ok(found)
        })
        .collect::<Result<_, _>>()
        .map_err(Failure::new)?;
    let named = pulses.iter().flat_map(|&n| methods.iter().map(move |method| (method.name, n)));
    let column = |place: usize| rows.iter().map(|row| row[place]).collect();
    let mut out = vec![Errors { method: BURG, pulses: 1, errors_m_s: column(0) }];
    out.extend(named.enumerate().map(|(k, (method, pulses))| Errors { method, pulses, errors_m_s: column(k + 1) }));
    Ok(out)
}
