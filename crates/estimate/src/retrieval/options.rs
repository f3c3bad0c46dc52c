//! How a scan is retrieved.

use crate::error::{Error, not_negative, positive};
use crate::retrieval::ScanTurbulence;
use crate::vortex_fit::{
    CorePrior, FreeParameters, Loss, MapFitOptions, RangeKernel, Secondary, Vortex, Wake,
    WakeModel, WindFit,
};

/// What a velocity of the map is of the air about its range.
#[derive(Debug, Clone, PartialEq)]
pub enum Gate {
    /// The velocity at the point itself.
    Point,
    /// The mean with a Gaussian weight of that standard deviation: sigma_R = (c/2) sqrt((sigma^2 + sigma_h^2)/2) for a Gaussian
    /// pulse and window.
    Gaussian {
        /// Standard deviation of the weight along the line \[m\].
        std_m: f64,
    },
    /// The mean with any other weight.
    Kernel(RangeKernel),
}

/// Gates resolve the vortices of a pair if their standard deviation is less than this fraction of
/// the spacing, or of the typical one \[m\].
const SHORT: f64 = 0.4;
const TYPICAL_M: f64 = 45.0;

impl Gate {
    /// Whether the weight is short enough to distinguish a pair of that spacing \[m\] from one vortex,
    /// and its circulation from its spacing.
    #[must_use]
    pub fn resolves(&self, spacing_m: f64) -> bool {
        self.std_m() < SHORT * spacing_m.min(TYPICAL_M)
    }

    /// Standard deviation of the weight along the line \[m\].
    #[must_use]
    pub fn std_m(&self) -> f64 {
        match self {
            Self::Point => 0.0,
            Self::Gaussian { std_m } => *std_m,
            Self::Kernel(kernel) => kernel.width_m(),
        }
    }

    /// Refuses a weight that is wider than the scan: it shows nothing of a wake, and has more points than any memory.
    pub(crate) fn validate(&self, range_m: &[f64]) -> Result<(), Error> {
        let std_m = self.std_m();
        not_negative("std_m of the gate", std_m)?;
        let length_m = range_m
            .last()
            .zip(range_m.first())
            .map_or(0.0, |(last, first)| last - first);
        let allowed = "at most the distance from the first to the last range of the scan";
        let error = Error::OutOfRange {
            field: "std_m of the gate",
            value: std_m,
            allowed,
        };
        if std_m > length_m { Err(error) } else { Ok(()) }
    }
}

/// Correlated velocities beside the noise of each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Turbulence {
    /// C = deviation^2 exp(-distance / length).
    Exponential {
        /// Standard deviation of the correlated part \[m/s\].
        deviation_m_s: f64,
        /// Distance after which the correlation has fallen to 1/e \[m\].
        length_m: f64,
    },
    /// Isotropic turbulence with the spectrum of von Karman, as a scan showed it.
    VonKarman(ScanTurbulence),
    /// As [`Turbulence::VonKarman`], found in the scan itself.
    OfScan,
}

impl Turbulence {
    pub(crate) fn validate(&self) -> Result<(), Error> {
        let Self::Exponential {
            deviation_m_s,
            length_m,
        } = *self
        else {
            return Ok(());
        };
        positive("deviation_m_s of the turbulence", deviation_m_s)?;
        positive("length_m of the turbulence", length_m)
    }
}

/// Whether vortices move while a scan lasts, each with the velocity that the other one, the images and the wind give it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Movement {
    /// They stand still in scans of less than 2 s and move in longer ones, unless the other is better by 9 in chi-square: the times of a
    /// file need not be those of the air (averaged scans, frozen simulations), and short scans hardly show which. Where no pair is found
    /// that moves, one that stands still is looked for from the beginning.
    Auto,
    /// They move.
    #[cfg_attr(feature = "clap", value(name = "yes"))]
    Moving,
    /// They stand still.
    #[cfg_attr(feature = "clap", value(name = "no"))]
    Frozen,
}

/// Options of [`fit_scan`](crate::retrieval::fit_scan).
#[derive(Debug, Clone, PartialEq)]
pub struct RetrievalOptions {
    /// Profile, images, place of the lidar.
    pub model: WakeModel,
    /// Whether the cores may as well have the other profile: what its fit finds, by its likelihood, is part of the deviations.
    pub other_profile: bool,
    /// Whether pairs with other spacings, which long gates do not tell apart, are part of the deviations, too.
    pub other_spacings: bool,
    /// What a velocity is of the air about its range.
    pub gate: Gate,
    /// What may change.
    pub free: FreeParameters,
    /// Core radius \[m\] that fixed cores keep and free ones start from; 4.5 % of the spacing if absent.
    pub core_radius_m: Option<f64>,
    /// What is known of free cores.
    pub core_prior: Option<CorePrior>,
    /// What residuals cost.
    pub loss: Loss,
    /// Whether secondary vortices are fitted.
    pub secondary: Secondary,
    /// Correlated velocities to be whitened.
    pub turbulence: Option<Turbulence>,
    /// Whether the vortices move while the scan lasts.
    pub movement: Movement,
    /// Least statistic (see [`ScanResult::statistic`](crate::retrieval::ScanResult::statistic)) of a wake.
    pub threshold: f64,
    /// Least statistic of a pair that is fitted to what an estimator shows: of [`MapFitOptions::least_statistic`], or nothing where a test
    /// has found the wake.
    pub threshold_of_estimates: f64,
    /// A wake to start from beside the blind search, such as the prediction of a track.
    pub start: Option<Wake>,
}

impl RetrievalOptions {
    /// [`RetrievalOptions::threshold`] unless set: one empty scan in a thousand in white noise, on grids of some thousand velocities. The
    /// largest statistic of 300 such scans was 18. In turbulence that is not whitened it says nothing.
    pub const DEFAULT_THRESHOLD: f64 = 22.0;
    /// Vortices are taken to stand still in scans that are shorter \[s\] and to move in others, if the other is not better by
    /// [`MOVES`](Self::MOVES) in chi-square: whatever is true of them, chance alone brings it once in 700 scans at most, where both models
    /// are about as far apart.
    pub const SHORT_S: f64 = 2.0;
    /// See [`SHORT_S`](Self::SHORT_S).
    pub const MOVES: f64 = 9.0;

    pub(crate) fn validate(&self) -> Result<(), Error> {
        self.turbulence
            .map_or(Ok(()), |turbulence| turbulence.validate())?;
        if let Loss::Cauchy { width } = self.loss {
            positive("width of the loss", width)?;
        }
        self.core_radius_m
            .map_or(Ok(()), |core| positive("core_radius_m", core))?;
        self.model
            .secondary
            .iter()
            .flatten()
            .try_for_each(Vortex::validate)?;
        self.start.map_or(Ok(()), |wake| wake.validate())?;
        not_negative("threshold", self.threshold)
    }
}

impl Default for RetrievalOptions {
    /// Algebraic cores that may as well be others, points, all parameters, the loss of Cauchy, the sandwich, moving vortices if that fits.
    fn default() -> Self {
        Self {
            model: WakeModel::default(),
            other_profile: true,
            other_spacings: true,
            gate: Gate::Point,
            free: FreeParameters {
                wind: WindFit::LogLinear,
                ..FreeParameters::default()
            },
            core_radius_m: None,
            core_prior: None,
            loss: Loss::Cauchy { width: 2.385 },
            secondary: Secondary::Auto,
            turbulence: None,
            movement: Movement::Auto,
            threshold: Self::DEFAULT_THRESHOLD,
            threshold_of_estimates: MapFitOptions::default().least_statistic,
            start: None,
        }
    }
}
