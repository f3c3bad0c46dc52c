//! Aerosol and refractive turbulence of a scene.

use crate::keys::{AboveZeroOrInf, Checker, Keys, Limited};
use serde::{Deserialize, Serialize};

section! {
    /// Aerosol and refractive turbulence.
    Atmosphere {
        /// Aerosol backscatter coefficient, 1/(m sr).
        backscatter_per_m_sr: f64 = 1e-7 => 0.0..=1.0,
        /// Extinction coefficient, 1/m, one way.
        extinction_per_m: f64 = 7e-5 => 0.0..=1.0,
        /// Aerosol that changes with range, in place of the two values above.
        #[serde(skip_serializing_if = "Option::is_none")]
        profile: Option<AirProfile> = None,
        /// Refractive turbulence.
        turbulence: Turbulence = Turbulence::None {} => Keys,
    }
}

section! {
    /// Aerosol along the lines of sight: straight lines between the ranges, beyond them as at the ends.
    AirProfile {
        /// Ranges, m, increasing.
        range_m: Vec<f64> = Vec::new(),
        /// Backscatter coefficient at each, 1/(m sr).
        backscatter_per_m_sr: Vec<f64> = Vec::new(),
        /// Extinction coefficient at each, 1/m, one way.
        extinction_per_m: Vec<f64> = Vec::new(),
    }
}

/// Which efficiency the pulses have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EfficiencyOfPulse {
    /// All the mean.
    Mean,
    /// Each that of one realisation of the path, in turn.
    Realisation,
}

/// Refractive turbulence along the beam.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Turbulence {
    /// None: the free-space efficiency by quadrature, no phase screens.
    None {},
    /// Turbulence of constant strength along the path.
    Refractive(RefractiveTurbulence),
}

impl Limited for Turbulence {
    fn check_limits(&self, at: &str, c: &mut Checker<'_>) {
        if let Self::Refractive(turbulence) = self {
            turbulence.check_limits(at, c);
        }
    }
}

section! {
    /// Turbulence of constant strength along the path, and how a Monte Carlo samples it.
    #[derive(Copy)]
    RefractiveTurbulence {
        /// Structure constant Cn2, m^(-2/3).
        cn2_m_m23: f64 = 1e-15 => 0.0..=1e-9,
        /// Shape of the spectrum.
        spectrum: SpectrumKind = SpectrumKind::VonKarman,
        /// Inner scale l0, m; 0 for none.
        inner_scale_m: f64 = 0.01 => 0.0..=1.0,
        /// Outer scale L0, m; `inf` for none.
        outer_scale_m: f64 = 1.0 => AboveZeroOrInf,
        /// Wave number of the outer scale.
        outer_scale_wavenumber: OuterScaleWavenumber = OuterScaleWavenumber::Inverse,
        /// Who chooses grid and layers of the phase screens.
        sampling: ScreenSampling = ScreenSampling::Explicit,
        /// Points along each side of the phase screens; not used with `sampling = "derived"`.
        grid_points: usize = 512 => 16..=16_384,
        /// Distance between points of the screens, m; not used with `sampling = "derived"`.
        grid_spacing_m: f64 = 0.002 => 1e-5..=1.0,
        /// Phase screens along the path; not used with `sampling = "derived"`.
        layers: usize = 10 => 1..=10_000,
        /// Realisations of the path; the error of a mean over antithetic pairs is taken by leaving out one of three: +A +B -A -B +C.
        realisations: usize = 400 => 5..=10_000_000,
        /// Which efficiency the pulses have.
        efficiency: EfficiencyOfPulse = EfficiencyOfPulse::Mean,
    }
}

/// Who chooses grid and layers of the phase screens.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ScreenSampling {
    /// The scene; what cannot be resolved is refused, what is doubtful is warned of.
    Explicit,
    /// The planner, from beam, turbulence and range.
    Derived,
}

/// Shape of the refractive-index spectrum.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SpectrumKind {
    /// (17), with outer scale and Gaussian inner scale.
    VonKarman,
    /// Kolmogorov: neither scale.
    Kolmogorov,
    /// Tatarskii: the inner scale only.
    Tatarskii,
    /// Hill's bump near the inner scale, in Andrews' form.
    HillAndrews,
}

/// How the outer scale gives the wave number kappa_0 of (17).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OuterScaleWavenumber {
    /// 1/L0, as (17) has it.
    Inverse,
    /// 2 pi/L0.
    TwoPiOver,
}
