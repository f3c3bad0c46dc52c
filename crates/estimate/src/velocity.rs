//! Velocity of one gate with its power, quality and flag: what every estimator returns.
//!
//! Check: zero, constant and out-of-band signals are flagged, never silently 0 m/s (in the tests of the estimators).
//!
//! A velocity beyond the unambiguous interval folds before any estimator sees it:
//! [`Sampling::folded_velocity_m_s`](crate::Sampling::folded_velocity_m_s) tells what it reads.

/// What a velocity estimate is worth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Quality {
    /// A peak inside the band.
    Good,
    /// Nothing in the band: zero power, or less than the sidelobes of a constant. Velocity is NaN.
    NoSignal,
    /// The peak sits on an edge of the band, or what the band holds can be sidelobes of a line
    /// outside. The velocity is that of the highest density in the band and should not be used.
    OutOfBand,
    /// Samples or spectrum are not finite. Velocity is NaN.
    Invalid,
    /// No valid window in the region. Velocity is NaN.
    Empty,
}

/// Velocity estimate of one gate or map point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GateVelocity {
    /// Radial velocity, positive away from the lidar \[m/s\]; NaN where `flag` says that there is none.
    pub velocity_m_s: f64,
    /// Mean power inside the detector band, signal and noise, in signal units squared.
    ///
    /// Not in a unit of its own: it overflows to infinity or vanishes where the square of the samples does.
    pub power: f64,
    /// Density of the peak over the mean density in the band; 1 for a flat spectrum.
    pub quality: f64,
    /// What the estimate is worth.
    pub flag: Quality,
}

impl GateVelocity {
    /// An estimate without velocity, for the stated reason.
    #[must_use]
    pub fn none(flag: Quality) -> Self {
        Self { velocity_m_s: f64::NAN, power: 0.0, quality: f64::NAN, flag }
    }

    /// Whether the flag is [`Quality::Good`].
    #[must_use]
    pub fn is_good(&self) -> bool {
        self.flag == Quality::Good
    }
}

/// How the peak is placed between the frequencies of the grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum Refinement {
    /// Not at all: the frequency of the highest bin, as (30) is printed.
    None,
    /// Parabola through the logarithm of the highest bin and its neighbours.
    #[default]
    Parabola,
    /// Maximum of the exact spectrum, by Newton steps from the parabola, to round-off.
    Exact,
}
