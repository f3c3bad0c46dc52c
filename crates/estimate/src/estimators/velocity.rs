//! Velocity of one gate with its width, SNR, quality and flag: what every estimator returns.
//!
//! Check: zero, constant and out-of-band signals are flagged, never silently 0 m/s; width and SNR of simulated wind
//! (in the tests of the estimators).
//!
//! A velocity beyond the unambiguous interval folds before any estimator sees it: it reads the one whose beat frequency has the same samples
//! (63 m/s reads 61.0 m/s at 250 MHz, 80 MHz, 1.55 um).

/// Quality flag of a velocity estimate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Quality {
    /// A peak inside the band.
    Good,
    /// Nothing in the band: zero power, or less than the sidelobes of a constant. Velocity is NaN.
    NoSignal,
    /// The peak is on an edge of the band, or the density in the band can be sidelobes of a line
    /// outside. The velocity is that of the highest density in the band and should not be used.
    OutOfBand,
    /// Samples or spectrum are not finite. Velocity is NaN.
    Invalid,
    /// No valid window in the region. Velocity is NaN.
    Empty,
}

/// Velocity estimate of one gate or map point.
///
/// User-supplied estimators fill in the quantities that they estimate and take the rest from [`GateVelocity::none`]:
/// `GateVelocity { velocity_m_s, flag: Quality::Good, ..GateVelocity::none(Quality::Good) }`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GateVelocity {
    /// Radial velocity, positive away from the lidar \[m/s\]; NaN where `flag` is that of no velocity.
    pub velocity_m_s: f64,
    /// Mean power inside the detector band, signal and noise, in signal units squared.
    ///
    /// Linear in the statistic, so that its mean over windows is unbiased: over the power that the expected statistic of
    /// noise gives, less one, it is the signal-to-noise ratio at any level.
    /// Not in a unit of its own: it overflows to infinity or vanishes where the square of the samples does.
    pub power: f64,
    /// Density of the peak over the mean density in the band; 1 for a flat spectrum.
    pub quality: f64,
    /// Highest density in the band of a spectrum that is linear in the statistic, in signal units squared, for the test
    /// against noise; NaN where unknown.
    ///
    /// It is the peak itself, but for models, which take that of their lags under a Hann window
    /// ([`model_lag_weights`](crate::estimators::model_lag_weights)). [`NoiseTest`](crate::estimators::NoiseTest) has the level that noise
    /// alone reaches.
    pub detection: f64,
    /// Variance of the velocities that the main peak stands for \[m^2/s^2\]: that of the Gaussian spectrum whose peak is as wide at half
    /// height above the floor, through the weights that the method gives its lags. Below 0 where the peak is narrower than that of a line,
    /// so that means of it are not pulled up by noise; NaN where the method does not show it.
    pub spread_m2_s2: f64,
    /// The same of the peak of a line \[m^2/s^2\]: what the method itself adds, and what was taken off; NaN where it shows no width.
    pub resolution_m2_s2: f64,
    /// Signal power over noise power in the detector band; the noise is the mean density away from the main peak.
    ///
    /// 0 where the band holds no more than that, NaN where unknown. Noise alone has a highest peak too, so that the ratio of weak
    /// signals is biased high: use it where the peak exceeds noise, or use `power`. The sidelobes of an unweighted
    /// window count as noise, so that above 5 dB it is biased low; a Gaussian weighting is good to 20 dB.
    pub snr: f64,
    /// Quality flag.
    pub flag: Quality,
}

impl GateVelocity {
    /// An estimate without velocity, for the given reason.
    #[must_use]
    pub fn none(flag: Quality) -> Self {
        Self {
            velocity_m_s: f64::NAN,
            power: 0.0,
            quality: f64::NAN,
            detection: f64::NAN,
            spread_m2_s2: f64::NAN,
            resolution_m2_s2: f64::NAN,
            snr: f64::NAN,
            flag,
        }
    }

    /// Standard deviation of the velocities that the main peak stands for \[m/s\]: the root of their variance; 0 where the peak is no
    /// wider than that of a line.
    #[must_use]
    pub fn width_m_s(&self) -> f64 {
        if self.spread_m2_s2 < 0.0 {
            0.0
        } else {
            self.spread_m2_s2.sqrt()
        }
    }

    /// Multiplies the quantities in units of power.
    pub(crate) fn scale_power(&mut self, factor: f64) {
        self.power *= factor;
        self.detection *= factor;
    }

    /// Whether the flag is [`Quality::Good`].
    #[must_use]
    pub fn is_good(&self) -> bool {
        self.flag == Quality::Good
    }

    /// Whether the peak exceeds noise: the flag is good and the detection above `threshold`.
    ///
    /// That is [`NoiseTest::threshold`](crate::estimators::NoiseTest::threshold) times the density of the noise: the detection in the
    /// mean statistic of noise.
    #[must_use]
    pub fn exceeds(&self, threshold: f64) -> bool {
        self.is_good() && self.detection > threshold
    }
}

/// How the peak is placed between the frequencies of the grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Refinement {
    /// Parabola through the logarithm of the highest bin and its neighbours.
    #[default]
    Parabola,
    /// Not at all: the frequency of the highest bin, as (30) is printed.
    None,
}
