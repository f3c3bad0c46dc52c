//! The mean spectrum of the region of each gate, over the density of noise.
//!
//! Check: the highest density of a spectrum is where the velocity of its gate is.

use super::lines::ScanLines;
use crate::Error;
use crate::io::OutputError;
use crate::measure::map_estimator::{MapEstimator, places_of};
use crate::plan::Plan;
use ndarray::ArrayView2;
use wakescope_estimate::map::PolarPoint;
use wakescope_estimate::spectrum::LagSpectrum;
use wakescope_estimate::window::Sample;
use wakescope_estimate::{Scan, Scratch, SignalKind};

/// Spectra \[line, gate, velocity\] of all scans.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectra {
    /// Velocity of each frequency in the band, m/s, positive away from the lidar, increasing.
    pub velocity_m_s: Vec<f64>,
    /// Range of each gate, m.
    pub range_m: Vec<f64>,
    /// Elevation of each line of all scans, rad.
    pub elevation_rad: Vec<f64>,
    /// Time of each line, s.
    pub time_s: Vec<f64>,
    /// Density over that of the scene's noise, or over the mean in the band without noise.
    pub density: Vec<f32>,
}

impl Spectra {
    /// Of the lines and the densities of each scan.
    pub(super) fn of(plan: &Plan, scans: &[(&ScanLines, &[f32])]) -> Result<Self, Error> {
        let of_gate = GateSpectra::new(plan, plan.scene().signal_kind())?;
        let lines = || scans.iter().map(|(lines, _)| lines);
        let elevation_rad = lines()
            .flat_map(|lines| lines.elevation_rad.iter().copied())
            .collect();
        let time_s = lines()
            .flat_map(|lines| lines.time_s.iter().copied())
            .collect();
        let density = scans
            .iter()
            .flat_map(|(_, density)| density.iter().copied())
            .collect();
        Ok(of_gate.spectra(plan, [elevation_rad, time_s], density))
    }

    /// Of the samples of one realisation of a scene whose lines rise, pulse by pulse; `layer_snr` holds range, m, and expected
    /// signal-to-noise ratio of the layers.
    ///
    /// # Errors
    /// A method whose numbers are no correlogram of the whole window; what the estimators refuse.
    pub(crate) fn of_samples<S: Sample>(
        plan: &Plan,
        layer_snr: &[(f64, f64)],
        pulse_elevation_rad: &[f64],
        samples: ArrayView2<'_, S>,
    ) -> Result<Self, Error> {
        let (g, places) = (&plan.geometry, places_of(plan, pulse_elevation_rad)?);
        let estimator = MapEstimator::<S>::new(plan, layer_snr, &places)?;
        let mut sums = estimator.sums(places, None)?;
        sums.add(0, samples)?;
        let (scan, of_gate, mut density) =
            (sums.finish(), GateSpectra::new(plan, S::KIND)?, Vec::new());
        for &elevation_rad in &g.elevation_rad {
            for &range_m in &g.gate_range_m {
                let (point, radius_m) = (
                    PolarPoint::at_elevation(range_m, elevation_rad),
                    estimator.radius.at_m(range_m)?,
                );
                density.extend(of_gate.density(
                    &scan,
                    point,
                    radius_m,
                    estimator.tools.noise.density_a2,
                )?);
            }
        }
        Ok(of_gate.spectra(
            plan,
            [g.elevation_rad.clone(), g.line_time_s.clone()],
            density,
        ))
    }
}

/// Makes the spectra of gates.
pub(super) struct GateSpectra {
    spectrum: LagSpectrum,
    /// Places of the frequencies in the band, by increasing velocity.
    bins: Vec<usize>,
    velocity_m_s: Vec<f64>,
}

impl GateSpectra {
    /// For the windows of a scene.
    ///
    /// # Errors
    /// A method whose numbers are no correlogram of the whole window.
    pub(super) fn new(plan: &Plan, kind: SignalKind) -> Result<Self, Error> {
        let scene = plan.scene();
        // Models of windows without weighting take the first lags alone.
        let e = &scene.estimator;
        if e.few_lags().is_some() {
            let reason =
                "--spectra needs the correlogram of the whole window, which this estimator.method does not make".into();
            return Err(Error::Key {
                key: "estimator.method",
                reason,
            });
        }
        let (sampling, padded) = (scene.sampling()?, e.padded_samples);
        let spectrum = LagSpectrum::new(kind, e.window_samples, padded)?;
        let (low_m_s, high_m_s) = sampling.velocity_limits_m_s();
        let of_bin = |bin: usize| {
            let frequency_hz = bin as f64 * sampling.sample_rate_hz / padded as f64;
            // Complex signals have negative frequencies in the upper half; a real one is known by its lower half.
            let folded = kind == SignalKind::Complex && 2 * bin > padded;
            sampling.velocity_m_s(if folded {
                frequency_hz - sampling.sample_rate_hz
            } else {
                frequency_hz
            })
        };
        let last = if kind == SignalKind::Complex {
            padded
        } else {
            padded / 2 + 1
        };
        let mut bins: Vec<(usize, f64)> = (0..last)
            .map(|bin| (bin, of_bin(bin)))
            .filter(|(_, v)| (low_m_s..=high_m_s).contains(v))
            .collect();
        bins.sort_by(|a, b| a.1.total_cmp(&b.1));
        let (bins, velocity_m_s) = bins.into_iter().unzip();
        Ok(Self {
            spectrum,
            bins,
            velocity_m_s,
        })
    }

    /// Those of lines at elevations, rad, and times, s, with these densities.
    fn spectra(
        self,
        plan: &Plan,
        [elevation_rad, time_s]: [Vec<f64>; 2],
        density: Vec<f32>,
    ) -> Spectra {
        let (velocity_m_s, range_m) = (self.velocity_m_s, plan.geometry.gate_range_m.clone());
        Spectra {
            velocity_m_s,
            range_m,
            elevation_rad,
            time_s,
            density,
        }
    }

    /// Refuses more spectra than a file holds.
    pub(super) fn fit_a_file(&self, plan: &Plan) -> Result<(), Error> {
        let bytes = 4
            * self.bins.len()
            * plan.geometry.gate_range_m.len()
            * plan.geometry.elevation_rad.len();
        if bytes > MOST_BYTES {
            let reason = format!(
                "--spectra makes {bytes} bytes, at most {MOST_BYTES}: larger estimator.gate_step_samples or smaller \
                 estimator.padded_samples make fewer"
            );
            return Err(OutputError::unsupported("spectra.nc", reason).into());
        }
        Ok(())
    }

    /// Numbers of a spectrum.
    pub(super) fn len(&self) -> usize {
        self.bins.len()
    }

    /// The spectrum of the region of a point.
    pub(super) fn density(
        &self,
        scan: &Scan,
        point: PolarPoint,
        radius_m: f64,
        noise_a2: f64,
    ) -> Result<Vec<f32>, Error> {
        let mut mean = vec![0.0; scan.statistic_len()];
        scan.region_mean(point, radius_m, &mut mean)?;
        let mut scratch = Scratch::new();
        let density = self.spectrum.density(&mean, &mut scratch)?;
        let in_band = || self.bins.iter().map(|bin| density[*bin]);
        let unit = match noise_a2.is_finite() {
            true => noise_a2 / scan.scale().powi(2),
            false => in_band().sum::<f64>() / self.bins.len() as f64,
        };
        Ok(in_band().map(|density| (density / unit) as f32).collect())
    }
}

/// Most bytes of a file of spectra.
const MOST_BYTES: usize = 256 << 20;
