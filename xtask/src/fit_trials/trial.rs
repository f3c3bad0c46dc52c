//! Fits to scans of a pair: to the map of the likelihood with tapers, and to all raw signals.

use fixtures::WINDOW;
use fixtures::failure::Failure;
use fixtures::pair::PairScan;
use ndarray::Array2;
use wakescope_estimate::vortex_fit::{
    CorePrior, EstimatorResponse, FreeParameters, MapFit, MapFitOptions, ScanSetup, SignalFit,
    SignalFitOptions, VelocityMap, Wake, fit_map_of_estimator, fit_signals,
};
use wakescope_estimate::{
    Correlogram, Error, Refinement, SignalKind, SpectralPeak,
    bound::{Noise, WindowModel},
    estimators::likelihood_tapers,
    spectrum::unweighted_lags,
};

/// Radius of the regions of the maps \[m\].
pub(crate) const RADIUS_M: f64 = 2.0;

/// One scan of a pair and what fits need of it.
pub(crate) struct FitTrial<'a> {
    pair: &'a PairScan,
    setup: ScanSetup,
    records: Array2<f64>,
    tapered: Correlogram<f64>,
    peak: SpectralPeak,
    velocity_m_s: Array2<f64>,
}

impl<'a> FitTrial<'a> {
    pub(crate) fn new(pair: &'a PairScan, scan: usize) -> Result<Self, Failure> {
        let records = pair.records(scan)?;
        let window =
            WindowModel::gaussian_pulse(&pair.sampling, WINDOW, pair.sigma_s(), Noise::White)?;
        let tapered = Correlogram::with_tapers(likelihood_tapers(&window, pair.snr)?)?;
        let peak = SpectralPeak::new(
            &pair.sampling,
            SignalKind::Real,
            &unweighted_lags(WINDOW),
            1024,
            Refinement::Parabola,
        )?;
        let statistics = pair.statistics(&records, &tapered)?;
        let velocities = pair.velocities(&statistics, &pair.points, RADIUS_M, &peak)?;
        let shape = (pair.elevation_rad.len(), pair.range_m.len());
        let velocity_m_s = Array2::from_shape_vec(shape, velocities)?;
        Ok(Self {
            pair,
            setup: pair.setup()?,
            records,
            tapered,
            peak,
            velocity_m_s,
        })
    }

    /// The fit of the map, with nothing known but what typical cores are.
    pub(crate) fn map(
        &self,
        free: FreeParameters,
        core_prior: Option<CorePrior>,
    ) -> Result<MapFit, Error> {
        let setup = &self.setup;
        let map = VelocityMap {
            elevation_rad: &self.pair.elevation_rad,
            range_m: &self.pair.range_m,
            velocity_m_s: self.velocity_m_s.view(),
            standard_deviation_m_s: None,
        };
        let noise = (setup.noise, self.pair.snr);
        let response = EstimatorResponse::new(
            &self.tapered,
            &self.peak,
            &setup.sampling,
            setup.pulse_sigma_s,
            noise,
            RADIUS_M,
        )?;
        let options = MapFitOptions {
            free,
            core_prior,
            ..Default::default()
        };
        fit_map_of_estimator(&map, &setup.wake, &response, &options)
    }

    /// The fit of all signals from a guess on.
    pub(crate) fn signals(
        &self,
        guess: &Wake,
        options: &SignalFitOptions,
    ) -> Result<SignalFit, Error> {
        fit_signals(
            &self.setup,
            |_, _| self.pair.snr,
            self.records.view(),
            self.pair.noise_power_a2(),
            guess,
            options,
        )
    }
}
