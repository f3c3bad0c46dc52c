//! Every estimator of the crate as it is tried on windows of 64 real samples: its name, its statistic, its settings.

use crate::failure::Failure;
use fixtures::{WINDOW, sampling};
use std::sync::Arc;
use wakescope_estimate::{
    Correlogram, Estimator, Refinement, SignalKind, SpectralPeak, Statistic, Weighting,
    bound::{GradientModel, Noise, WindowModel},
    estimators::{
        AutoregressivePeak, AutoregressivePole, CaponPeak, FirstMoment, GradientLikelihood, LagWindowPeak, PulsePair,
        Unbiased, likelihood_tapers,
    },
    models::OrderChoice,
};
use wakescope_signal::NoiseModel;

/// Gradients \[1/s\] among which velocity and gradient are sought together.
pub(crate) const GRADIENTS_PER_S: [f64; 5] = [-0.4, -0.2, 0.0, 0.2, 0.4];

/// An estimator and which of the statistics it takes.
pub(crate) struct Method {
    pub(crate) name: &'static str,
    pub(crate) statistic: usize,
    /// One for each number of windows that are accumulated; most are the same for all.
    pub(crate) estimators: Vec<Arc<dyn Estimator + Send>>,
}

/// Estimators, and the statistics that they share.
pub(crate) struct Methods {
    pub(crate) statistics: Vec<Box<dyn Statistic<f64>>>,
    pub(crate) methods: Vec<Method>,
    /// How many windows are accumulated.
    counts: Vec<usize>,
}

/// What the likelihoods know of the signal.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Known {
    pub(crate) noise: NoiseModel,
    /// Half-width of |f|^2 at 1/e \[s\].
    pub(crate) sigma_s: f64,
    pub(crate) snr: f64,
}

impl Known {
    /// The noise in the words of the estimators.
    pub(crate) fn estimate_noise(&self) -> Noise {
        match self.noise {
            NoiseModel::BandLimited => Noise::Band { floor: 0.0 },
            _ => Noise::White,
        }
    }
}

impl Methods {
    fn with(mut self, name: &'static str, statistic: usize, estimator: impl Estimator + Send + 'static) -> Self {
        let one: Arc<dyn Estimator + Send> = Arc::new(estimator);
        self.methods.push(Method { name, statistic, estimators: vec![one; self.counts.len()] });
        self
    }

    /// CA whose order is chosen for the number of windows.
    fn with_chosen_order(mut self, name: &'static str, model: &AutoregressivePeak) -> Self {
        let chosen = |&windows: &usize| -> Arc<dyn Estimator + Send> {
            Arc::new(model.clone().choosing(OrderChoice::DescriptionLength { samples: (WINDOW * windows) as f64 }))
        };
        let estimators = self.counts.iter().map(chosen).collect();
        self.methods.push(Method { name, statistic: 0, estimators });
        self
    }

    fn with_statistic(mut self, statistic: impl Statistic<f64> + 'static) -> Self {
        self.statistics.push(Box::new(statistic));
        self
    }

    /// Every estimator of the crate for means of those numbers of windows; those of one window alone, such as Burg's,
    /// are not among them.
    pub(crate) fn all(known: &Known, counts: &[usize]) -> Result<Self, Failure> {
        let (s, kind, refinement) = (sampling()?, SignalKind::Real, Refinement::Parabola);
        let plain = Correlogram::<f64>::new(Weighting::Rectangular, WINDOW)?;
        let weights = plain.lag_weights();
        let gaussian = Correlogram::<f64>::new(Weighting::default(), WINDOW)?;
        let model = WindowModel::gaussian_pulse(&s, WINDOW, known.sigma_s, Noise::White)?;
        let tapered = Correlogram::<f64>::with_tapers(likelihood_tapers(&model, known.snr)?)?;
        let wind = GradientModel::new(&s, WINDOW, known.sigma_s, known.estimate_noise())?;
        let uniform = GradientLikelihood::<f64>::new(&wind, known.snr, &[0.0], 1024)?;
        let sheared = GradientLikelihood::<f64>::new(&wind, known.snr, &GRADIENTS_PER_S, 1024)?;
        let peak = |padded| SpectralPeak::new(&s, kind, WINDOW, padded, refinement);
        let weighted = |of: &Correlogram<f64>| peak(1024)?.with_lag_weights(&of.lag_weights());
        let (of_gaussian, of_tapers) = (weighted(&gaussian)?, weighted(&tapered)?);
        let model_of = |order| AutoregressivePeak::new(&s, kind, WINDOW, order, 2048, refinement);
        Ok(Self { statistics: Vec::new(), methods: Vec::new(), counts: counts.to_vec() }
            .with_statistic(plain)
            .with_statistic(gaussian)
            .with_statistic(tapered)
            .with_statistic(uniform.statistic)
            .with_statistic(sheared.statistic)
            .with("PA, no interpolation", 0, SpectralPeak::new(&s, kind, WINDOW, WINDOW, Refinement::None)?)
            .with("PA", 0, peak(1024)?)
            .with("PA, Gaussian window", 1, of_gaussian)
            .with("CA, AR(16)", 0, model_of(16)?)
            .with_chosen_order("CA, order by MDL", &model_of(16)?)
            .with("CA, unbiased AR(16)", 0, Unbiased::new(model_of(16)?, kind, &weights)?)
            .with("AR(16), pole", 0, AutoregressivePole::new(&s, kind, WINDOW, 16, 1024, refinement)?)
            .with("Capon(16)", 0, CaponPeak::new(&s, kind, WINDOW, 16, 2048, refinement)?)
            .with("CA-BT, 16 lags", 0, LagWindowPeak::new(&s, kind, WINDOW, 16, 1024, refinement)?)
            .with("first moment", 0, FirstMoment::new(&s, kind, WINDOW, 512, 3.5)?)
            .with("pulse pair", 0, PulsePair::new(&s, kind, WINDOW)?)
            .with("likelihood, tapers", 2, of_tapers)
            .with("likelihood", 3, uniform.estimator)
            .with("likelihood with gradient", 4, sheared.estimator))
    }
}
