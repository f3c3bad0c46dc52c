//! Aerosol and refractive turbulence of a scene.

use super::{Aerosol, Cn2Profile};
use crate::keys::{ABOVE_ZERO_OR_INF, keys};
use std::sync::Arc;
use wakescope_optics as optics;
use wakescope_signal::Medium;

keys! {
    /// Aerosol and refractive turbulence.
    table Atmosphere {
        /// Aerosol backscatter coefficient, 1/(m sr).
        backscatter_per_m_sr: f64 = 1e-7 => 0.0..=1.0,
        /// Extinction coefficient, 1/m, one way.
        extinction_per_m: f64 = 7e-5 => 0.0..=1.0,
        /// Aerosol as a function of range, in place of the two values above.
        profile: Option<AirProfile> = None,
        /// Aerosol from a visibility or over height, in place of the first two values.
        aerosol: Option<Aerosol> = None,
        /// Refractive turbulence.
        turbulence: Turbulence = Turbulence::None {},
    }

    /// Aerosol along the lines of sight: linear between the ranges, constant beyond them.
    table AirProfile {
        /// Ranges, m, increasing.
        range_m: Vec<f64> = Vec::new(),
        /// Backscatter coefficient at each, 1/(m sr).
        backscatter_per_m_sr: Vec<f64> = Vec::new(),
        /// Extinction coefficient at each, 1/m, one way.
        extinction_per_m: Vec<f64> = Vec::new(),
    }

    /// Efficiency of the pulses.
    choice EfficiencyOfPulse {
        /// The mean for all pulses.
        Mean = "mean",
        /// That of one realisation of the path for each pulse, in turn.
        Realisation = "realisation",
    }

    /// Refractive turbulence along the beam.
    kinds Turbulence by "kind" {
        /// None: the free-space efficiency by quadrature, no phase screens.
        "none" => None {},
        /// Turbulence of constant strength along the path.
        "refractive" => Refractive(RefractiveTurbulence),
    }

    /// Turbulence of constant strength along the path, and its Monte Carlo sampling.
    table RefractiveTurbulence {
        /// Structure constant Cn2, m^(-2/3).
        cn2_m_m23: f64 = 1e-15 => 0.0..=1e-9,
        /// Cn2 over height, in place of cn2_m_m23.
        profile: Option<Cn2Profile> = None,
        /// Shape of the spectrum.
        spectrum: SpectrumKind = SpectrumKind::VonKarman,
        /// Inner scale l0, m; 0 for none.
        inner_scale_m: f64 = 0.01 => 0.0..=1.0,
        /// Outer scale L0, of wave number 1/L0, m; `inf` for none.
        outer_scale_m: f64 = 1.0 => ABOVE_ZERO_OR_INF,
        /// Choice of grid and layers of the phase screens.
        sampling: ScreenSampling = ScreenSampling::Explicit,
        /// Points along each side of the phase screens; not used with `sampling = "derived"`.
        grid_points: usize = 512 => 16..=16_384,
        /// Distance between points of the screens, m; not used with `sampling = "derived"`.
        grid_spacing_m: f64 = 0.002 => 1e-5..=1.0,
        /// Phase screens along the path; not used with `sampling = "derived"`.
        layers: usize = 10 => 1..=10_000,
        /// Realisations of the path, in antithetic pairs; standard errors by the jackknife over pairs.
        realisations: usize = 400 => 5..=10_000_000,
        /// Efficiency of the pulses.
        efficiency: EfficiencyOfPulse = EfficiencyOfPulse::Mean,
    }

    /// Choice of grid and layers of the phase screens.
    choice ScreenSampling {
        /// By the keys below; a grid that cannot resolve the beam is refused, a doubtful one gives a warning.
        Explicit = "explicit",
        /// Derived from beam, turbulence and range.
        Derived = "derived",
    }

    /// Shape of the refractive-index spectrum.
    choice SpectrumKind {
        /// (17), with outer scale and Gaussian inner scale.
        VonKarman = "von_karman",
        /// Kolmogorov: neither scale.
        Kolmogorov = "kolmogorov",
        /// Hill's bump near the inner scale, in Andrews' form.
        HillAndrews = "hill_andrews",
    }
}

impl super::Scene {
    /// The refractive turbulence, if there is any.
    pub(crate) fn refractive_turbulence(&self) -> Option<RefractiveTurbulence> {
        match &self.atmosphere.turbulence {
            Turbulence::Refractive(t) if t.cn2_m_m23 > 0.0 || t.profile.is_some() => {
                Some(t.clone())
            }
            _ => None,
        }
    }

    /// Whether the air of a line of sight depends on its elevation.
    pub(crate) fn has_layered_air(&self) -> bool {
        let turbulence = self.refractive_turbulence();
        let has_cn2_profile = turbulence.is_some_and(|t| t.profile.is_some());
        has_cn2_profile || self.atmosphere.has_layered_aerosol()
    }
}

impl RefractiveTurbulence {
    /// Cn2 along a line of sight from a height, m, with an elevation, rad.
    pub(crate) fn cn2_along(&self, height_m: f64, elevation_rad: f64) -> optics::Cn2Path {
        match &self.profile {
            Some(profile) => profile.along(height_m, elevation_rad),
            None => optics::Cn2Path::Uniform {
                cn2_m_m23: self.cn2_m_m23,
            },
        }
    }

    /// The turbulence that the optics propagate through along a line of sight from a height, m, with an elevation, rad.
    ///
    /// # Errors
    /// Fails if the optics refuse its strength or its scales.
    pub(crate) fn along(
        &self,
        height_m: f64,
        elevation_rad: f64,
    ) -> Result<optics::Turbulence, optics::Error> {
        let outer_scale_m = self.outer_scale_m;
        let inner_scale_m = self.inner_scale_m;
        let spectrum: Arc<dyn optics::Spectrum> = match self.spectrum {
            SpectrumKind::VonKarman => Arc::new(optics::VonKarman::new(
                outer_scale_m,
                inner_scale_m,
                optics::air::CHAPTER_CONSTANT,
            )?),
            SpectrumKind::Kolmogorov => Arc::new(optics::VonKarman::kolmogorov()),
            SpectrumKind::HillAndrews => {
                Arc::new(optics::air::HillAndrews::new(outer_scale_m, inner_scale_m)?)
            }
        };
        let cn2 = self.cn2_along(height_m, elevation_rad);
        Ok(optics::Turbulence {
            spectrum,
            cn2: cn2.validated()?,
        })
    }
}

impl Atmosphere {
    /// Whether the aerosol changes with height.
    pub(crate) fn has_layered_aerosol(&self) -> bool {
        self.aerosol.is_some_and(|aerosol| aerosol.is_layered())
    }

    /// The air that the signal simulation looks through at a wavelength; one with layers is over height.
    ///
    /// # Errors
    /// Fails if the ranges of a profile do not increase or a value is no coefficient.
    pub(crate) fn medium(&self, wavelength_m: f64) -> Result<Medium, wakescope_signal::Error> {
        if let Some(aerosol) = &self.aerosol {
            return aerosol.medium(wavelength_m);
        }
        let Some(profile) = &self.profile else {
            return Medium::uniform(self.backscatter_per_m_sr, self.extinction_per_m);
        };
        let mut range_m = profile.range_m.clone();
        let mut backscatter_per_m_sr = profile.backscatter_per_m_sr.clone();
        let mut extinction_per_m = profile.extinction_per_m.clone();
        let count = range_m.len();
        if count == 0 || backscatter_per_m_sr.len() != count || extinction_per_m.len() != count {
            return Medium::new(range_m, backscatter_per_m_sr, extinction_per_m);
        }
        // Beyond the table the air is as at its end, as far as a second-trip echo at the slowest
        // pulse repetition frequency.
        range_m.push(range_m.last().copied().unwrap_or(0.0).max(0.0) + 1e12);
        backscatter_per_m_sr.extend(profile.backscatter_per_m_sr.last());
        extinction_per_m.extend(profile.extinction_per_m.last());
        Medium::new(range_m, backscatter_per_m_sr, extinction_per_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The pulse before comes from 30 000 km at 5 Hz, and from farther at slower rates.
    #[test]
    fn a_profile_of_the_air_has_no_end_for_the_echo_of_the_pulse_before() {
        let profile = AirProfile {
            range_m: vec![0.0, 1e3],
            backscatter_per_m_sr: vec![1e-7; 2],
            extinction_per_m: vec![1e-9; 2],
        };
        let air = Atmosphere {
            profile: Some(profile),
            ..Atmosphere::default()
        }
        .medium(1.55e-6)
        .unwrap();
        for range_m in [1e4, 3e7, 1.5e11] {
            let found = air.transmission(range_m).unwrap();
            let expected = (-1e-9 * range_m).exp();
            assert!(
                (found - expected).abs() <= 1e-9 * expected,
                "{range_m} m: {found} {expected}"
            );
            assert_eq!(air.backscatter_per_m_sr(range_m).unwrap(), 1e-7);
        }
    }
}
