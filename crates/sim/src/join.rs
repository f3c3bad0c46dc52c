//! The only place where the types of two crates meet: a scene in the words of each crate.

mod estimators;

pub use estimators::{
    Toolkit, WindowStatistics, bound_m_s, gates, refinement, sampling, signal_kind, weighting, window_correlation,
    window_model,
};

use crate::Error;
use crate::scene::{
    AirProfile, BeamRadiusDefinition, Digitiser, Flow, NoiseKind, OuterScaleWavenumber, PulseDefinition,
    PulseResampling, PulseShape, ReceiverPath, RefractiveTurbulence, Scene, ScreenSampling, SnrReference, SpectrumKind,
    VortexMotion, VortexPair, VortexProfile,
};
use num_complex::Complex;
use std::sync::Arc;
use wakescope_les as les;
use wakescope_optics as optics;
use wakescope_signal as signal;

/// The wind of a scene whose flow is analytic, and calm air for another; [`SceneWind`](crate::wind::SceneWind) has all.
///
/// # Errors
/// What the wind refuses; a checked scene gives none.
pub fn analytic_wind(scene: &Scene) -> Result<Box<dyn les::Wind>, Error> {
    Ok(match &scene.flow {
        Flow::Calm {} | Flow::Simulated(_) => Box::new(les::Calm),
        Flow::Uniform { lateral_m_s, vertical_m_s } => Box::new(les::Uniform::new([0.0, *lateral_m_s, *vertical_m_s])?),
        Flow::VortexPair(pair) => {
            let vortices = Box::new(vortex_pair(pair).wind()?);
            if pair.cross_wind_m_s == 0.0 {
                return Ok(vortices);
            }
            let cross = Box::new(les::Uniform::new([0.0, pair.cross_wind_m_s, 0.0])?);
            Box::new(les::Sum { winds: vec![vortices, cross] })
        }
    })
}

/// The vortex pair of a scene.
pub fn vortex_pair(pair: &VortexPair) -> les::VortexPair {
    les::VortexPair {
        circulation_m2_s: pair.circulation_m2_s,
        spacing_m: pair.spacing_m,
        core_radius_m: pair.core_radius_m,
        lateral_position_m: pair.lateral_position_m,
        height_m: pair.height_m,
        ground: les::Ground::Image,
        profile: circulation_profile(pair.profile),
        motion: match pair.motion {
            VortexMotion::Frozen => les::Motion::Frozen,
            VortexMotion::Inviscid => les::Motion::Inviscid,
        },
    }
}

/// The circulation profile of a scene or a flow case.
pub(crate) fn circulation_profile(profile: VortexProfile) -> les::CirculationProfile {
    match profile {
        VortexProfile::Algebraic => les::CirculationProfile::Algebraic,
        VortexProfile::LambOseen => les::CirculationProfile::LambOseen,
    }
}

/// Age of an analytic flow when the scan begins, s.
pub fn start_time_s(scene: &Scene) -> f64 {
    match &scene.flow {
        Flow::VortexPair(pair) if pair.age_tau > 0.0 && pair.circulation_m2_s > 0.0 => {
            vortex_pair(pair).time_s(pair.age_tau)
        }
        _ => 0.0,
    }
}

/// The telescope of a scene.
///
/// # Errors
/// What the optics refuse; a checked scene gives none.
pub fn telescope(scene: &Scene) -> Result<optics::Telescope, Error> {
    Ok(unchecked_telescope(scene).validated()?)
}

fn unchecked_telescope(scene: &Scene) -> optics::Telescope {
    let t = &scene.telescope;
    optics::Telescope {
        wavelength_m: scene.laser.wavelength_m,
        aperture_radius_m: t.aperture_radius_m,
        obscuration_radius_m: t.obscuration_radius_m,
        beam_radius_m: t.beam_radius_m,
        radius_definition: match t.beam_radius_definition {
            BeamRadiusDefinition::Intensity => optics::RadiusDefinition::Intensity,
            BeamRadiusDefinition::Field => optics::RadiusDefinition::Field,
        },
        focus: if t.focus_m.is_infinite() { optics::Focus::Collimated } else { optics::Focus::At(t.focus_m) },
    }
}

/// The turbulence of a scene.
///
/// # Errors
/// What the optics refuse; a checked scene gives none.
pub fn turbulence(t: &RefractiveTurbulence) -> Result<optics::Turbulence, optics::Error> {
    let convention = match t.outer_scale_wavenumber {
        OuterScaleWavenumber::Inverse => optics::OuterScaleConvention::Inverse,
        OuterScaleWavenumber::TwoPiOver => optics::OuterScaleConvention::TwoPiOver,
    };
    let spectrum: Arc<dyn optics::Spectrum> = match t.spectrum {
        SpectrumKind::VonKarman => Arc::new(optics::VonKarman::new(
            t.outer_scale_m,
            t.inner_scale_m,
            convention,
            optics::spectrum::CHAPTER_CONSTANT,
        )?),
        SpectrumKind::Kolmogorov => Arc::new(optics::VonKarman::kolmogorov()),
        SpectrumKind::Tatarskii => Arc::new(optics::VonKarman::tatarskii(t.inner_scale_m)?),
        SpectrumKind::HillAndrews => Arc::new(optics::HillAndrews::new(t.outer_scale_m, t.inner_scale_m, convention)?),
    };
    Ok(optics::Turbulence { spectrum, cn2: optics::Cn2Path::Uniform { cn2_m_m23: t.cn2_m_m23 }.validated()? })
}

/// Which paths the two beams of a scene take.
pub fn receiver_path(scene: &Scene) -> optics::plan::Receiver {
    match scene.telescope.receiver {
        ReceiverPath::Monostatic => optics::plan::Receiver::Monostatic,
        ReceiverPath::Bistatic => optics::plan::Receiver::Bistatic,
    }
}

/// Grid and layers of a scene's phase screens for several runs, each with its ranges, m, increasing; with their cost.
///
/// # Errors
/// What cannot be resolved, with every limit and what would do for all of the runs.
pub fn screen_plans(
    scene: &Scene,
    t: &RefractiveTurbulence,
    runs: &[&[f64]],
) -> Result<Vec<optics::plan::Plan>, optics::Error> {
    let (telescope, turbulence, none) = (unchecked_telescope(scene), turbulence(t)?, optics::Misalignment::NONE);
    match t.sampling {
        ScreenSampling::Derived => {
            let plan = |range_m: &&[f64]| optics::plan::plan(&telescope, &none, &turbulence, range_m, t.realisations);
            runs.iter().map(plan).collect()
        }
        ScreenSampling::Explicit => {
            let grid = optics::Grid::square(t.grid_points, t.grid_spacing_m)?;
            optics::plan::examine_runs(&telescope, &none, &turbulence, &grid, t.layers, runs, t.realisations)
        }
    }
}

/// As [`screen_plans`] for one run.
///
/// # Errors
/// As there.
pub fn screen_plan(scene: &Scene, t: &RefractiveTurbulence, range_m: &[f64]) -> Result<optics::plan::Plan, Error> {
    let plan = screen_plans(scene, t, &[range_m])?.pop();
    Ok(plan.ok_or(optics::Error::Length { field: "range_m", found: 0, expected: 1 })?)
}

/// The Monte Carlo of a scene's turbulence for given ranges, m, increasing.
///
/// # Errors
/// As [`screen_plan`].
pub fn monte_carlo(scene: &Scene, t: &RefractiveTurbulence, range_m: &[f64]) -> Result<optics::MonteCarlo, Error> {
    let plan = screen_plan(scene, t, range_m)?;
    Ok(optics::MonteCarlo {
        telescope: telescope(scene)?,
        misalignment: optics::Misalignment::NONE,
        turbulence: turbulence(t)?,
        grid: plan.grid,
        layers: plan.layers,
        range_m: range_m.to_vec(),
        transfer: optics::propagate::TransferKind::Paraxial,
        seed: scene.seed,
        sampling: optics::Sampling::Antithetic,
        correct_grid: true,
    })
}

/// Everything of (14) but the efficiency.
///
/// # Errors
/// What the optics refuse; a checked scene gives none.
pub fn snr_model(scene: &Scene) -> Result<optics::SnrModel, Error> {
    let model = optics::SnrModel {
        wavelength_m: scene.laser.wavelength_m,
        aperture_area_m2: telescope(scene)?.aperture_area_m2(),
        pulse_energy_j: scene.pulse.energy_j,
        quantum_efficiency: scene.detector.quantum_efficiency,
        bandwidth_hz: scene.detector.bandwidth_hz,
        backscatter_per_m_sr: scene.atmosphere.backscatter_per_m_sr,
        extinction_per_m: scene.atmosphere.extinction_per_m,
        planck: match scene.detector.snr {
            SnrReference::Chapter {} => optics::PlanckConvention::Hbar,
            _ => optics::PlanckConvention::H,
        },
    };
    Ok(model.validated()?)
}

/// The pulse of a scene.
///
/// # Errors
/// What the signal simulation refuses, such as samples that are no pulse.
pub fn pulse(scene: &Scene) -> Result<signal::Pulse, Error> {
    let p = &scene.pulse;
    let pulse = match &p.shape {
        PulseShape::Gaussian(shape) => {
            let duration = match shape.definition {
                PulseDefinition::Fwhm => signal::PulseDuration::FullWidthHalfMaximum(shape.duration_s),
                PulseDefinition::OneOverEHalfWidth => signal::PulseDuration::OneOverEHalfWidth(shape.duration_s),
            };
            signal::Pulse::from(signal::GaussianPulse::new(duration, p.energy_j)?)
        }
        PulseShape::Sampled(shape) => {
            let resampling = match shape.resampling {
                PulseResampling::CubicSpline => signal::Resampling::CubicSpline,
                PulseResampling::BandLimited => signal::Resampling::BandLimited,
                PulseResampling::Linear => signal::Resampling::Linear,
            };
            let sampled = if shape.phase_rad.is_empty() {
                signal::SampledPulse::from_power(&shape.time_s, &shape.power, resampling, p.energy_j)?
            } else {
                let polar = |(power, phase): (&f64, &f64)| Complex::from_polar(power.sqrt(), *phase);
                let envelope: Vec<_> = shape.power.iter().zip(&shape.phase_rad).map(polar).collect();
                signal::SampledPulse::new(&shape.time_s, &envelope, resampling, p.energy_j)?
            };
            signal::Pulse::from(if shape.centred { sampled.centred() } else { sampled })
        }
    };
    Ok(pulse.with_chirp(p.chirp_hz_s)?)
}

/// The air of a scene that changes with range; none where it is uniform.
///
/// # Errors
/// What the signal simulation refuses, such as ranges that do not increase.
pub fn medium(scene: &Scene) -> Result<Option<signal::Medium>, Error> {
    let Some(profile) = &scene.atmosphere.profile else { return Ok(None) };
    let AirProfile { mut range_m, mut backscatter_per_m_sr, mut extinction_per_m } = profile.clone();
    // Beyond the table the air is as at its end.
    range_m.push(range_m.last().copied().unwrap_or(0.0).max(0.0) + 1e7);
    backscatter_per_m_sr.extend(profile.backscatter_per_m_sr.last());
    extinction_per_m.extend(profile.extinction_per_m.last());
    Ok(Some(signal::Medium::new(range_m, backscatter_per_m_sr, extinction_per_m)?))
}

/// Return per metre of range K^2 beta A_R/R^2 of the air of a scene, (9) without the efficiency, 1/m.
///
/// # Errors
/// What optics or signal refuse; a checked scene gives none.
pub fn return_per_m(scene: &Scene) -> Result<impl Fn(f64) -> Result<f64, Error>, Error> {
    let (model, medium) = (snr_model(scene)?, medium(scene)?);
    Ok(move |range_m: f64| match &medium {
        Some(medium) => Ok(medium.return_per_m(range_m, model.aperture_area_m2)?),
        None => Ok(model.return_per_m(range_m)?),
    })
}

/// The converter of a scene, if it has one.
///
/// # Errors
/// What the signal simulation refuses; a checked scene gives none.
pub fn digitiser(scene: &Scene) -> Result<Option<signal::Digitiser>, Error> {
    match scene.detector.digitiser {
        Digitiser::None {} => Ok(None),
        Digitiser::Quantised { bits, full_scale_over_noise } => {
            let full_scale_a = full_scale_over_noise * receiver(scene).noise_variance_a2().sqrt();
            Ok(Some(signal::Digitiser::new(bits, full_scale_a)?))
        }
    }
}

/// The receiver of a scene.
pub fn receiver(scene: &Scene) -> signal::Receiver {
    let d = &scene.detector;
    signal::Receiver {
        wavelength_m: scene.laser.wavelength_m,
        sample_rate_hz: d.sampling_hz,
        intermediate_frequency_hz: d.intermediate_frequency_hz,
        bandwidth_hz: d.bandwidth_hz,
        quantum_efficiency: d.quantum_efficiency,
        local_oscillator_w: d.local_oscillator_w,
        planck: match d.snr {
            SnrReference::Chapter {} => signal::PlanckConvention::Hbar,
            _ => signal::PlanckConvention::H,
        },
        noise: match d.noise {
            NoiseKind::Band => signal::NoiseModel::BandLimited,
            NoiseKind::White => signal::NoiseModel::White,
            NoiseKind::None => signal::NoiseModel::None,
        },
    }
}
