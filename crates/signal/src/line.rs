//! What a line of sight shows to the receiver: radial velocity and return of each thin layer of air, and how thin a layer
//! must be.
//!
//! Check: the thickness divides the range step of one sample and obeys the rule of the steepest gradient.

use crate::error::{check, check_length, check_positive};
use crate::{Error, Receiver, SPEED_OF_LIGHT_M_S};

/// The air along one line of sight, cut into layers of equal thickness.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LineOfSight {
    /// Range of the centre of the first layer \[m\].
    pub first_range_m: f64,
    /// Thickness of each layer, `DeltaR` \[m\]; layer `l` is centred on `first_range_m + l layer_thickness_m`.
    pub layer_thickness_m: f64,
    /// Radial velocity of each layer \[m/s\], positive away from the lidar. NaN: no scatterers there (masked).
    pub radial_velocity_m_s: Vec<f64>,
    /// Return of each layer per metre of range, `K^2 beta A_R eta_s/R^2` \[1/m\], (9): `beta` in 1/(m sr) times the solid
    /// angle `A_R/R^2` in sr, the round-trip transmission and the efficiency. Finite and not negative.
    pub weight_per_m: Vec<f64>,
}

/// What to do where a line of sight leaves the domain in which the wind is known, marked by NaN velocities.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum OutsideDomain {
    /// Refuse the line.
    #[default]
    Error,
    /// Take this radial velocity \[m/s\].
    Constant(f64),
    /// No scatterers there: nothing returns.
    Mask,
}

/// Layers that move too fast for the detector band.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeyondBand {
    /// Number of such layers.
    pub layers: usize,
    /// Range of the fastest \[m\].
    pub range_m: f64,
    /// Its radial velocity \[m/s\].
    pub radial_velocity_m_s: f64,
    /// The largest velocity of the band \[m/s\].
    pub limit_m_s: f64,
    /// The velocity that the sampled current shows for the fastest layer \[m/s\], folded if beyond 0 or `F_s/2`.
    pub folded_m_s: f64,
}

impl LineOfSight {
    /// Which layers return frequencies outside the detector band; `None` if all lie in it. Such returns are simulated as
    /// they are (the band limits the noise only), but estimators that search the band do not find them.
    pub fn beyond_band(&self, receiver: &Receiver) -> Option<BeyondBand> {
        let limit_m_s = receiver.band_velocity_m_s();
        let fast = |v: &f64| v.abs() > limit_m_s;
        let layers = self.radial_velocity_m_s.iter().filter(|v| fast(v)).count();
        let by_speed = |a: &(usize, &f64), b: &(usize, &f64)| a.1.abs().total_cmp(&b.1.abs());
        let (index, velocity) =
            self.radial_velocity_m_s.iter().enumerate().filter(|(_, v)| fast(v)).max_by(by_speed)?;
        let (range_m, folded_m_s) = (self.range_m(index), receiver.folded_velocity_m_s(*velocity));
        Some(BeyondBand { layers, range_m, radial_velocity_m_s: *velocity, limit_m_s, folded_m_s })
    }

    /// Applies a policy to the layers whose velocity is NaN, and says how many there are.
    ///
    /// [`Simulator`](crate::Simulator) takes NaN as [`OutsideDomain::Mask`] does. Parts of a line that are to be treated
    /// differently (below the ground: masked; beyond a mesh: constant) are set one after the other.
    ///
    /// # Errors
    /// [`Error::NoWind`] with the first such layer if the policy is `Error`; [`Error::OutOfRange`] for a constant that is
    /// not finite.
    pub fn resolve_outside(&mut self, policy: OutsideDomain) -> Result<usize, Error> {
        let outside = self.radial_velocity_m_s.iter().filter(|v| v.is_nan()).count();
        match policy {
            OutsideDomain::Error => match self.radial_velocity_m_s.iter().position(|v| v.is_nan()) {
                Some(index) => return Err(Error::NoWind { index, range_m: self.range_m(index) }),
                None => return Ok(0),
            },
            OutsideDomain::Constant(velocity_m_s) => {
                check("constant radial_velocity_m_s", velocity_m_s, "finite", |_| true)?;
                self.radial_velocity_m_s.iter_mut().filter(|v| v.is_nan()).for_each(|v| *v = velocity_m_s);
            }
            OutsideDomain::Mask => {}
        }
        Ok(outside)
    }

    /// Says what is wrong with the line, if anything.
    ///
    /// # Errors
    /// [`Error::Empty`] without layers; [`Error::LengthMismatch`] if velocities and weights differ in number;
    /// [`Error::OutOfRange`], [`Error::ElementOutOfRange`] for values that are not allowed (an infinite velocity, a
    /// weight that is negative or not finite).
    pub fn validate(&self) -> Result<(), Error> {
        check("first_range_m", self.first_range_m, "finite", |_| true)?;
        check_positive("layer_thickness_m", self.layer_thickness_m)?;
        if self.radial_velocity_m_s.is_empty() {
            return Err(Error::Empty { field: "radial_velocity_m_s" });
        }
        check_length("weight_per_m", self.weight_per_m.len(), self.radial_velocity_m_s.len())?;
        let refuse = |field, allowed, list: &[f64], bad: &dyn Fn(f64) -> bool| match list.iter().position(|&v| bad(v)) {
            Some(index) => Err(Error::ElementOutOfRange { field, index, value: list[index], allowed }),
            None => Ok(()),
        };
        refuse(
            "radial_velocity_m_s",
            "finite, or NaN where there are no scatterers",
            &self.radial_velocity_m_s,
            &|v| v.is_infinite(),
        )?;
        refuse("weight_per_m", "finite and not negative", &self.weight_per_m, &|w| !(w.is_finite() && w >= 0.0))
    }

    /// Number of layers.
    pub fn layers(&self) -> usize {
        self.radial_velocity_m_s.len()
    }

    /// Range of the centre of layer `index` \[m\].
    pub fn range_m(&self, index: usize) -> f64 {
        self.first_range_m + index as f64 * self.layer_thickness_m
    }
}

/// Thickness of the layers \[m\] for a given sampling and a flow whose radial velocity changes by at most
/// `max_gradient_per_s` along any line: the largest that divides the range step of a sample, `c/(2 F_s)`, and is at most
/// `lambda/(16 sigma g_max)` and `c sigma/2`.
///
/// The second limit makes the scatterers of neighbouring layers overlap in frequency: two layers then drift apart by
/// less than an eighth of a turn while the pulse passes. Thicker layers give errors of up to 15 % inside a vortex core.
/// With the third, the sum over the layers of a pulse is its integral within 1e-4, however short the pulse.
/// The division makes the Gaussian weights repeat from sample to sample, which the fast summation uses.
///
/// # Errors
/// [`Error::OutOfRange`] if a parameter is not positive (the gradient may be zero).
pub fn layer_thickness_m(
    sample_rate_hz: f64,
    wavelength_m: f64,
    sigma_s: f64,
    max_gradient_per_s: f64,
) -> Result<f64, Error> {
    check_positive("sample_rate_hz", sample_rate_hz)?;
    check_positive("wavelength_m", wavelength_m)?;
    check_positive("sigma_s", sigma_s)?;
    check("max_gradient_per_s", max_gradient_per_s, "finite and not negative", |g| g >= 0.0)?;
    let step_m = SPEED_OF_LIGHT_M_S / (2.0 * sample_rate_hz);
    let by_gradient = step_m * 16.0 * sigma_s * max_gradient_per_s / wavelength_m;
    let by_pulse = step_m / (0.5 * SPEED_OF_LIGHT_M_S * sigma_s);
    Ok(step_m / by_gradient.max(by_pulse).ceil().max(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn line() -> LineOfSight {
        LineOfSight {
            first_range_m: 100.0,
            layer_thickness_m: 0.5,
            radial_velocity_m_s: vec![1.0, f64::NAN, 3.0],
            weight_per_m: vec![1e-16; 3],
        }
    }

    #[test]
    fn a_line_that_leaves_the_domain_is_refused_filled_or_masked_by_choice() {
        assert_eq!(line().resolve_outside(OutsideDomain::Error), Err(Error::NoWind { index: 1, range_m: 100.5 }));
        let mut filled = line();
        assert_eq!(filled.resolve_outside(OutsideDomain::Constant(-2.0)), Ok(1));
        assert_eq!(filled.radial_velocity_m_s, [1.0, -2.0, 3.0]);
        assert_eq!(filled.resolve_outside(OutsideDomain::Error), Ok(0));
        let mut masked = line();
        assert_eq!(masked.resolve_outside(OutsideDomain::Mask), Ok(1));
        assert!(masked.radial_velocity_m_s[1].is_nan());
        assert!(matches!(masked.resolve_outside(OutsideDomain::Constant(f64::NAN)), Err(Error::OutOfRange { .. })));
    }

    #[test]
    fn layers_are_no_thicker_than_a_short_pulse() {
        let sigma_s = 0.6e-9;
        let thickness_m = layer_thickness_m(250e6, 1.55e-6, sigma_s, 0.0).unwrap();
        assert!(thickness_m <= 0.5 * SPEED_OF_LIGHT_M_S * sigma_s);
        let per_step = SPEED_OF_LIGHT_M_S / (2.0 * 250e6) / thickness_m;
        assert_relative_eq!(per_step, per_step.round(), max_relative = 1e-12);
    }

    #[test]
    fn layers_obey_the_gradient_of_a_heavy_wake_and_divide_the_range_step() {
        let gradient = 500.0 / (8.0 * std::f64::consts::PI * 2.35 * 2.35);
        for (sigma_s, rule_m) in [(120.112e-9, 0.22), (240.224e-9, 0.11)] {
            let thickness = layer_thickness_m(250e6, 1.55e-6, sigma_s, gradient).unwrap();
            let limit = 1.55e-6 / (16.0 * sigma_s * gradient);
            assert_relative_eq!(limit, rule_m, max_relative = 0.03);
            let parts = SPEED_OF_LIGHT_M_S / (2.0 * 250e6) / thickness;
            assert_relative_eq!(parts, parts.round(), max_relative = 1e-14);
            let coarser = SPEED_OF_LIGHT_M_S / (2.0 * 250e6) / (parts.round() - 1.0);
            assert!(thickness <= limit && coarser > limit);
        }
    }

    #[test]
    fn layers_of_a_uniform_wind_are_as_thick_as_the_range_step() {
        let thickness = layer_thickness_m(250e6, 1.55e-6, 120e-9, 0.0).unwrap();
        assert_relative_eq!(thickness, 0.599_584_916, max_relative = 1e-14);
    }

    #[test]
    fn a_line_may_be_masked_but_not_empty_ragged_or_infinite() {
        assert_eq!(line().validate(), Ok(()));
        assert_eq!(line().range_m(2), 101.0);
        let empty = LineOfSight { radial_velocity_m_s: vec![], weight_per_m: vec![], ..line() };
        assert_eq!(empty.validate(), Err(Error::Empty { field: "radial_velocity_m_s" }));
        let ragged = LineOfSight { weight_per_m: vec![1.0], ..line() };
        assert!(matches!(ragged.validate(), Err(Error::LengthMismatch { found: 1, expected: 3, .. })));
        let infinite = LineOfSight { radial_velocity_m_s: vec![0.0, f64::INFINITY, 0.0], ..line() };
        assert!(matches!(infinite.validate(), Err(Error::ElementOutOfRange { index: 1, .. })));
        for bad in [-1.0, f64::NAN] {
            let negative = LineOfSight { weight_per_m: vec![1.0, 1.0, bad], ..line() };
            assert!(matches!(negative.validate(), Err(Error::ElementOutOfRange { index: 2, .. })));
        }
        let flat = LineOfSight { layer_thickness_m: 0.0, ..line() };
        assert!(matches!(flat.validate(), Err(Error::OutOfRange { field: "layer_thickness_m", .. })));
    }
}
