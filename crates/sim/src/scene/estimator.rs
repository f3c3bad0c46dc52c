//! From signals to velocities: the estimator of a scene, its method with its own keys, and what all methods share.

use crate::keys::{Checker, Keys, Limit, Limited, join};
use serde::{Deserialize, Serialize};

section! {
    /// From signals to velocities.
    Estimator {
        /// Samples N of a window.
        window_samples: usize = 64 => 4..=65_536,
        /// Weighting h of the window, (29).
        weighting: Weighting = Weighting::Gaussian,
        /// Samples between windows that are accumulated.
        window_step_samples: usize = 1 => 1..=1_000_000,
        /// Samples between gates of the map.
        gate_step_samples: usize = 5 => 1..=1_000_000,
        /// Points of the zero-padded spectrum; `window_samples` for the literal (29).
        padded_samples: usize = 1024 => 1..=1 << 22,
        /// How the peak is refined between the points of the spectrum.
        refinement: Refinement = Refinement::Parabola,
        /// Radius of the circular region of accumulation, m.
        radius_m: f64 = 2.0 => 0.0..=1e5,
        /// Which correlogram the estimator is given.
        correlogram: CorrelogramForm = CorrelogramForm::Biased,
        /// Whether the lines of a region are shifted to the velocity of its centre before they are added, by a first map.
        follow_wind: bool = false,
        /// Probability that noise alone passes for a signal at a gate; estimates whose peak is not above what noise reaches
        /// that often are flagged. 0: no test.
        false_alarm: f64 = 0.01,
        /// Which estimator, with the keys that are its own.
        method: Method = Method::PeriodogramAccumulation {} => Keys,
        /// How the radius depends on range.
        radius: RegionRadius = RegionRadius::Fixed {} => Keys,
    }
}

/// Which estimator makes the map, with the keys that only it has.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Method {
    /// Mean periodogram of the pulses of one line at one range, no region.
    Periodogram {},
    /// PA: mean periodogram of all windows of the region (Table 3).
    PeriodogramAccumulation {},
    /// CA: peak of the autoregressive spectrum of the mean correlogram (Table 3).
    Autoregressive(ModelOrder),
    /// Pole of the same model that is nearest to the unit circle.
    AutoregressivePole(ModelOrder),
    /// Peak of Capon's spectrum of the mean correlogram.
    Capon(ModelOrder),
    /// Peak of the transform of the mean correlogram times a Hann window of lags.
    LagWindow(LagWindow),
    /// Phase of the first lag.
    PulsePair {},
    /// Mean of the main peak of the spectrum.
    FirstMoment(FirstMoment),
    /// Maximum likelihood of the velocity for the known pulse, by tapers.
    Likelihood(Likelihood),
    /// Maximum likelihood of velocity and gradient along the line of sight.
    GradientLikelihood(GradientLikelihood),
}

section! {
    /// The order of autoregressive models and of Capon's filter.
    #[derive(Copy)]
    ModelOrder {
        /// The order; the largest one if it is chosen.
        order: usize = 16 => 1..=65_535,
        /// How the order is found.
        order_choice: OrderChoice = OrderChoice::Fixed,
    }
}

section! {
    /// The window of lags.
    #[derive(Copy)]
    LagWindow {
        /// Lag at which it falls to 0.
        lag_window_lags: usize = 16 => 1..=65_535,
    }
}

section! {
    /// The first moment of a peak.
    #[derive(Copy)]
    FirstMoment {
        /// Half width of the part of the spectrum that is averaged, in its standard deviations.
        moment_reach: f64 = 3.5 => 0.1..=100.0,
    }
}

section! {
    /// The likelihood of the velocity.
    #[derive(Copy)]
    Likelihood {
        /// Signal-to-noise ratio for which it is planned, dB; the scene's own if absent.
        #[serde(skip_serializing_if = "Option::is_none")]
        likelihood_snr_db: Option<f64> = None => -100.0..=100.0,
    }
}

section! {
    /// The likelihood of velocity and gradient.
    #[derive(Copy)]
    GradientLikelihood {
        /// Signal-to-noise ratio for which it is planned, dB; the scene's own if absent.
        #[serde(skip_serializing_if = "Option::is_none")]
        likelihood_snr_db: Option<f64> = None => -100.0..=100.0,
        /// Gradients reach from minus to plus this, 1/s.
        gradient_max_per_s: f64 = 0.6 => 1e-6..=1e3,
        /// How many there are; odd, so that 0 is among them.
        gradients: usize = 7 => 1..=999,
    }
}

impl Limited for Method {
    fn check_limits(&self, at: &str, c: &mut Checker<'_>) {
        match self {
            Self::Periodogram {} | Self::PeriodogramAccumulation {} | Self::PulsePair {} => {}
            Self::Autoregressive(model) | Self::AutoregressivePole(model) | Self::Capon(model) => {
                model.check_limits(at, c)
            }
            Self::LagWindow(own) => own.check_limits(at, c),
            Self::FirstMoment(own) => own.check_limits(at, c),
            Self::Likelihood(own) => own.check_limits(at, c),
            Self::GradientLikelihood(own) => own.check_limits(at, c),
        }
    }
}

impl Method {
    /// Whether tapers of its own take the place of the weighting of the windows.
    pub(crate) fn has_own_tapers(&self) -> bool {
        matches!(self, Self::Likelihood(_) | Self::GradientLikelihood(_))
    }

    /// The order of the model that the method fits, if it fits one.
    pub fn order(&self) -> Option<ModelOrder> {
        match self {
            Self::Autoregressive(model) | Self::AutoregressivePole(model) | Self::Capon(model) => Some(*model),
            _ => None,
        }
    }

    /// Signal-to-noise ratio for which a likelihood is planned, dB, if the scene states one.
    pub fn likelihood_snr_db(&self) -> Option<f64> {
        match self {
            Self::Likelihood(Likelihood { likelihood_snr_db })
            | Self::GradientLikelihood(GradientLikelihood { likelihood_snr_db, .. }) => *likelihood_snr_db,
            _ => None,
        }
    }
}

/// How the order of a model is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OrderChoice {
    /// It is `order`.
    Fixed,
    /// Akaike's criterion.
    Aic,
    /// Rissanen's minimum description length.
    Mdl,
}

/// Which correlogram.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CorrelogramForm {
    /// Divided by the number of samples: positive semi-definite.
    Biased,
    /// Divided by the number of products; often no model of it exists.
    Unbiased,
}

/// How the radius of the region depends on range.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum RegionRadius {
    /// `radius_m` at every range.
    Fixed {},
    /// Straight lines between the points of a table; beyond its ends as at the ends.
    OfRange {
        /// Ranges, m, increasing.
        range_m: Vec<f64>,
        /// Radius at each, m.
        radius_m: Vec<f64>,
    },
    /// The smallest for which the bound on the velocity reaches a standard deviation.
    Target {
        /// That standard deviation, m/s.
        standard_deviation_m_s: f64,
        /// Largest radius, m.
        largest_m: f64,
    },
}

impl Limited for RegionRadius {
    fn check_limits(&self, at: &str, c: &mut Checker<'_>) {
        if let Self::Target { standard_deviation_m_s, largest_m } = self {
            (1e-6..=1e3).hold(&join(at, "standard_deviation_m_s"), standard_deviation_m_s, c);
            (1e-3..=1e5).hold(&join(at, "largest_m"), largest_m, c);
        }
    }
}

/// Weighting of the samples of a window.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Weighting {
    /// Gaussian, as the chapter's default.
    Gaussian,
    /// All samples alike.
    Rectangular,
    /// Hann.
    Hann,
}

/// How a spectral peak is refined between the points of the spectrum.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Refinement {
    /// Parabola through the logarithms of three points.
    Parabola,
    /// Maximum of the exact spectrum, where the estimator is a spectrum; else as the parabola.
    Exact,
    /// None: the velocity of the highest point.
    None,
}
