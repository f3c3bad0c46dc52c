//! The mean spectrum of the region of each gate, over the density of noise.
//!
//! Check: the highest density of a spectrum is where the velocity of its gate is.

use super::lines::ScanLines;
use crate::Error;
use crate::io::Spectra;
use crate::measure::map_estimator::{MapEstimator, windows_at};
use crate::plan::Plan;
use ndarray::ArrayView2;
use wakescope_estimate::map::PolarPoint;
use wakescope_estimate::spectrum::LagSpectrum;
use wakescope_estimate::window::Sample;
use wakescope_estimate::{Scan, Scratch, SignalKind};

/// Spectra of the lines of all scans, from the densities of each scan.
pub(super) fn spectra_of_scans(
    plan: &Plan,
    scans: &[(&ScanLines, &[f32])],
) -> Result<Spectra, Error> {
    let spectra = GateSpectra::new(plan, plan.scene().signal_kind())?;
    let mut elevation_rad = Vec::new();
    let mut time_s = Vec::new();
    let mut density = Vec::new();
    for (lines, of_scan) in scans {
        elevation_rad.extend(&lines.elevation_rad);
        time_s.extend(&lines.time_s);
        density.extend_from_slice(of_scan);
    }
    Ok(spectra.of_lines(plan, elevation_rad, time_s, density))
}

/// Spectra of the samples of one realisation of a scene whose lines rise, pulse by pulse; `layer_snr` holds range, m, and expected
/// signal-to-noise ratio of the layers.
///
/// # Errors
/// Fails if the numbers of the method are no correlogram of the whole window or the estimators refuse the scene.
pub(crate) fn spectra_of_samples<S: Sample>(
    plan: &Plan,
    layer_snr: &[(f64, f64)],
    pulse_elevation_rad: &[f64],
    samples: ArrayView2<'_, S>,
) -> Result<Spectra, Error> {
    let g = &plan.geometry;
    let windows = windows_at(plan, pulse_elevation_rad)?;
    let estimator = MapEstimator::<S>::new(plan, layer_snr, &windows)?;
    let mut sums = estimator.sums(windows, None)?;
    sums.add(0, samples)?;
    let scan = sums.finish();
    let spectra = GateSpectra::new(plan, S::KIND)?;
    let noise_a2 = estimator.tools.noise.density_a2;
    let mut density = Vec::new();
    for &elevation_rad in &g.elevation_rad {
        for &range_m in &g.gate_range_m {
            let point = PolarPoint::at_elevation(range_m, elevation_rad);
            let radius_m = estimator.radius.at_m(range_m)?;
            density.extend(spectra.density(&scan, point, radius_m, noise_a2)?);
        }
    }
    Ok(spectra.of_lines(
        plan,
        g.elevation_rad.clone(),
        g.line_time_s.clone(),
        density,
    ))
}

/// Makes the spectra of gates.
pub(crate) struct GateSpectra {
    spectrum: LagSpectrum,
    /// Indices of the frequencies in the band, by increasing velocity.
    bins: Vec<usize>,
    velocity_m_s: Vec<f64>,
}

impl GateSpectra {
    /// For the windows of a scene.
    ///
    /// # Errors
    /// Fails if the numbers of the method are no correlogram of the whole window.
    pub(super) fn new(plan: &Plan, kind: SignalKind) -> Result<Self, Error> {
        Self::with_points(plan, kind, plan.scene().estimator.padded_samples)
    }

    /// The same with another number of points of the transform.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub(crate) fn with_points(plan: &Plan, kind: SignalKind, padded: usize) -> Result<Self, Error> {
        let scene = plan.scene();
        // Models of windows without weighting take the first lags alone.
        let e = &scene.estimator;
        if e.few_lags().is_some() {
            let reason =
                "spectra need the correlogram of the whole window, which this estimator.method does not make".into();
            return Err(Error::Key {
                key: "estimator.method",
                reason,
            });
        }
        let sampling = scene.sampling()?;
        let spectrum = LagSpectrum::new(kind, e.window_samples, padded)?;
        let (low_m_s, high_m_s) = sampling.velocity_limits_m_s();
        let last = if kind == SignalKind::Complex {
            padded
        } else {
            padded / 2 + 1
        };
        let mut in_band = Vec::new();
        for bin in 0..last {
            let mut frequency_hz = bin as f64 * sampling.sample_rate_hz / padded as f64;
            // Complex signals have negative frequencies in the upper half; a real one is known by its lower half.
            if kind == SignalKind::Complex && 2 * bin > padded {
                frequency_hz -= sampling.sample_rate_hz;
            }
            let velocity_m_s = sampling.velocity_m_s(frequency_hz);
            if (low_m_s..=high_m_s).contains(&velocity_m_s) {
                in_band.push((bin, velocity_m_s));
            }
        }
        in_band.sort_by(|a, b| a.1.total_cmp(&b.1));
        let (bins, velocity_m_s) = in_band.into_iter().unzip();
        Ok(Self {
            spectrum,
            bins,
            velocity_m_s,
        })
    }

    /// Spectra of lines at elevations, rad, and times, s, with these densities.
    fn of_lines(
        self,
        plan: &Plan,
        elevation_rad: Vec<f64>,
        time_s: Vec<f64>,
        density: Vec<f32>,
    ) -> Spectra {
        Spectra {
            velocity_m_s: self.velocity_m_s,
            range_m: plan.geometry.gate_range_m.clone(),
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
            return Err(Error::unsupported("spectra.nc", reason));
        }
        Ok(())
    }

    /// Velocity of each frequency of a spectrum, m/s, increasing.
    pub(crate) fn velocity_m_s(&self) -> &[f64] {
        &self.velocity_m_s
    }

    /// Numbers of a spectrum.
    pub(super) fn len(&self) -> usize {
        self.bins.len()
    }

    /// The spectrum of the region of a point.
    pub(crate) fn density(
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
        let unit = if noise_a2.is_finite() {
            noise_a2 / scan.scale().powi(2)
        } else {
            let in_band = self.bins.iter().map(|bin| density[*bin]);
            in_band.sum::<f64>() / self.bins.len() as f64
        };
        let mut out = Vec::with_capacity(self.bins.len());
        for bin in &self.bins {
            out.push((density[*bin] / unit) as f32);
        }
        Ok(out)
    }
}

/// Most bytes of a file of spectra.
const MOST_BYTES: usize = 256 << 20;
