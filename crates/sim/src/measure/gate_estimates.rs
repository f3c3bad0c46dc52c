//! What is known of one gate: an estimate held against the noise of its scene, and the sums of those of several maps.
//!
//! A scan of records is one map of its own, the realisations of a scene are several: both have their flags, ratios and widths here.
//! Check: maps of simulated records have the same bits whether they come from memory or from a file.

use wakescope_estimate::map::MapPoint;

/// An estimate of one gate, and what the noise of the scene gives there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct GateEstimate {
    pub(crate) found: MapPoint,
    /// Mean power in the band, A^2; NaN without a velocity.
    pub(crate) power_a2: f64,
    /// Signal-to-noise ratio of a signal of that velocity over the excess of its power over that of the noise, both over the power of the
    /// noise.
    pub(crate) gain: f64,
    /// Density of the peak over what the scene's noise exceeds with the rate of false alarms; NaN without a test.
    pub(crate) detection_ratio: f64,
    /// Standard deviation of the power of noise in the band over its mean.
    pub(crate) deviation: f64,
}

impl GateEstimate {
    /// Whether it is flagged by itself, or does not stand out of so many times the scene's noise.
    fn is_flagged(&self, noise_factor: f64) -> bool {
        let is_seen = self.detection_ratio.is_nan() || self.detection_ratio > noise_factor;
        !(self.found.estimate.is_good() && is_seen)
    }
}

/// Sums over the estimates of one gate in several maps.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct GateSums {
    /// Windows accumulated, and independent windows that they are worth: the same in all maps, a matter of geometry.
    pub(crate) level: f64,
    pub(crate) n_eff: f64,
    maps: f64,
    /// Maps whose estimate is flagged, and those with a velocity.
    flagged: f64,
    pub(crate) count: f64,
    deviation: f64,
    /// Sum and number of the finite values: power in the band, its gain, quality, resolution.
    sums: [[f64; 2]; 4],
    /// Number, sum and sum of squares of the spreads that are known and not flagged, m^2/s^2.
    spreads: [f64; 3],
}

impl GateSums {
    /// Adds the estimate of a map, held against so many times the scene's noise; returns whether it is flagged.
    pub(crate) fn add(&mut self, gate: &GateEstimate, noise_factor: f64) -> bool {
        let is_flagged = gate.is_flagged(noise_factor);
        let e = &gate.found.estimate;
        (self.level, self.n_eff, self.deviation) =
            (gate.found.level as f64, gate.found.n_eff, gate.deviation);
        self.maps += 1.0;
        self.flagged += f64::from(u8::from(is_flagged));
        self.count += f64::from(u8::from(e.velocity_m_s.is_finite()));
        let values = [gate.power_a2, gate.gain, e.quality, e.resolution_m2_s2];
        for (sums, value) in self
            .sums
            .iter_mut()
            .zip(values)
            .filter(|(_, value)| value.is_finite())
        {
            *sums = [sums[0] + value, sums[1] + 1.0];
        }
        let spread = e.spread_m2_s2;
        if spread.is_finite() && !is_flagged {
            self.spreads
                .iter_mut()
                .zip([1.0, spread, spread * spread])
                .for_each(|(sum, term)| *sum += term);
        }
        is_flagged
    }

    /// Part of the maps whose estimate is flagged.
    pub(crate) fn flagged(&self) -> f64 {
        self.flagged / self.maps.max(1.0)
    }

    /// Means of power in the band, A^2, gain, quality and resolution, m^2/s^2; NaN where no value is finite.
    fn means(&self) -> [f64; 4] {
        self.sums
            .map(|[sum, n]| if n > 0.0 { sum / n } else { f64::NAN })
    }

    /// Mean quality.
    pub(crate) fn quality(&self) -> f64 {
        self.means()[2]
    }

    /// Signal-to-noise ratio, dB, against so many times the scene's noise of power `noise_a2`, A^2; NaN where the excess is below twice
    /// its standard deviation.
    pub(crate) fn snr_db(&self, noise_a2: f64, noise_factor: f64) -> f64 {
        let [power_a2, gain, ..] = self.means();
        let excess = power_a2 / noise_a2 / noise_factor - 1.0;
        let is_seen = excess > 2.0 * self.deviation / self.count.sqrt();
        if is_seen {
            10.0 * (excess * gain).log10()
        } else {
            f64::NAN
        }
    }

    /// Spectral width, m/s; NaN where it does not stand out of its standard error or of what the shape of the floor beneath it may add, a part
    /// of the variance of a line that was measured for all methods, and where the signal-to-noise ratio that tells this is not known.
    pub(crate) fn width_m_s(&self, noise_a2: f64, noise_factor: f64) -> f64 {
        let [count, sum, squares] = self.spreads;
        // what only some of the estimates show is not the mean of all
        if count <= 0.9 * (self.maps - self.flagged) {
            return f64::NAN;
        }
        let spread = sum / count;
        let variance = (squares / count - spread * spread).max(0.0) / (count - 1.0).max(1.0);
        let snr_db = if noise_a2.is_nan() {
            f64::INFINITY
        } else {
            self.snr_db(noise_a2, noise_factor)
        };
        let least = self.means()[3] * (0.05 + 0.12 / 10f64.powf(0.1 * snr_db));
        // A comparison that an unknown ratio fails: `max` would leave it out.
        if spread > least && spread > 2.0 * variance.sqrt() {
            spread.sqrt()
        } else {
            f64::NAN
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wakescope_estimate::GateVelocity;
    use wakescope_estimate::estimators::Quality;

    /// Sums of three maps with so much power over that of noise, a spread of 4 m^2/s^2 and a line of 1 m^2/s^2.
    fn sums(power: f64) -> GateSums {
        let none = GateVelocity::none(Quality::Good);
        let estimate = GateVelocity {
            velocity_m_s: 1.0,
            spread_m2_s2: 4.0,
            resolution_m2_s2: 1.0,
            ..none
        };
        let found = MapPoint {
            estimate,
            level: 9,
            left_out: 0,
            n_eff: 3.0,
        };
        let gate = GateEstimate {
            found,
            power_a2: power,
            gain: 1.0,
            detection_ratio: f64::NAN,
            deviation: 0.1,
        };
        let mut sums = GateSums::default();
        for _ in 0..3 {
            assert!(!sums.add(&gate, 1.0));
        }
        sums
    }

    #[test]
    fn a_width_is_told_where_the_ratio_is_known_that_says_what_the_floor_adds() {
        let strong = sums(2.0);
        let weak = sums(1.05);
        assert!(
            strong.snr_db(1.0, 1.0).abs() < 1e-12
                && (strong.width_m_s(1.0, 1.0) - 2.0).abs() < 1e-12
        );
        assert!(weak.snr_db(1.0, 1.0).is_nan() && weak.width_m_s(1.0, 1.0).is_nan());
        // without noise there is no floor
        assert!((weak.width_m_s(f64::NAN, 1.0) - 2.0).abs() < 1e-12);
    }
}
