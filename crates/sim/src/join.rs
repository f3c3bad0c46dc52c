//! The only place where the types of two crates meet: a scene in the words of each crate.

use crate::Error;
use crate::geometry::Geometry;
use crate::scene::{
    BeamRadiusDefinition, Flow, NoiseKind, OuterScaleWavenumber, PulseDefinition, ReceiverPath, Refinement,
    RefractiveTurbulence, Scene, ScreenSampling, SnrReference, SpectrumKind, VortexMotion, VortexPair, VortexProfile,
    Weighting,
};
use std::sync::Arc;
use wakescope_estimate as estimate;
use wakescope_les as les;
use wakescope_optics as optics;
use wakescope_signal as signal;

/// The wind of a scene.
///
/// # Errors
/// What the wind refuses; a checked scene gives none.
pub fn wind(scene: &Scene) -> Result<Box<dyn les::Wind>, Error> {
    Ok(match scene.flow {
        Flow::Calm {} => Box::new(les::Calm),
        Flow::Uniform { lateral_m_s, vertical_m_s } => Box::new(les::Uniform::new([0.0, lateral_m_s, vertical_m_s])?),
        Flow::VortexPair(pair) => {
            let vortices = Box::new(vortex_pair(&pair).wind()?);
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

/// Age of the flow when the scan begins, s.
pub fn start_time_s(scene: &Scene) -> f64 {
    match scene.flow {
        Flow::VortexPair(pair) if pair.age_tau > 0.0 && pair.circulation_m2_s > 0.0 => {
            vortex_pair(&pair).time_s(pair.age_tau)
        }
        _ => 0.0,
    }
}

/// The telescope of a scene.
///
/// # Errors
/// What the optics refuse; a checked scene gives none.
pub fn telescope(scene: &Scene) -> Result<optics::Telescope, Error> {
    let t = &scene.telescope;
    let telescope = optics::Telescope {
        wavelength_m: scene.laser.wavelength_m,
        aperture_radius_m: t.aperture_radius_m,
        obscuration_radius_m: t.obscuration_radius_m,
        beam_radius_m: t.beam_radius_m,
        radius_definition: match t.beam_radius_definition {
            BeamRadiusDefinition::Intensity => optics::RadiusDefinition::Intensity,
            BeamRadiusDefinition::Field => optics::RadiusDefinition::Field,
        },
        focus: if t.focus_m.is_infinite() { optics::Focus::Collimated } else { optics::Focus::At(t.focus_m) },
    };
    Ok(telescope.validated()?)
}

/// The turbulence of a scene.
///
/// # Errors
/// What the optics refuse; a checked scene gives none.
pub fn turbulence(t: &RefractiveTurbulence) -> Result<optics::Turbulence, Error> {
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

/// Grid and layers of a scene's phase screens for given ranges, m, increasing, with their cost.
///
/// # Errors
/// What cannot be resolved, with the limit and what would do.
pub fn screen_plan(scene: &Scene, t: &RefractiveTurbulence, range_m: &[f64]) -> Result<optics::plan::Plan, Error> {
    let (telescope, turbulence, none) = (telescope(scene)?, turbulence(t)?, optics::Misalignment::NONE);
    Ok(match t.sampling {
        ScreenSampling::Derived => optics::plan::plan(&telescope, &none, &turbulence, range_m)?,
        ScreenSampling::Explicit => {
            let grid = optics::Grid::square(t.grid_points, t.grid_spacing_m)?;
            let layers = optics::Layers::equal(t.layers, range_m.last().copied().unwrap_or(0.0))?;
            optics::plan::examine(&telescope, &none, &turbulence, &grid, &layers, range_m)?
        }
    })
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
/// What the signal simulation refuses; a checked scene gives none.
pub fn pulse(scene: &Scene) -> Result<signal::GaussianPulse, Error> {
    let duration = match scene.pulse.definition {
        PulseDefinition::Fwhm => signal::PulseDuration::FullWidthHalfMaximum(scene.pulse.duration_s),
        PulseDefinition::OneOverEHalfWidth => signal::PulseDuration::OneOverEHalfWidth(scene.pulse.duration_s),
    };
    Ok(signal::GaussianPulse::new(duration, scene.pulse.energy_j)?)
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

/// The simulator of the records of a scene.
///
/// # Errors
/// What the signal simulation refuses; a checked scene gives none.
pub fn simulator(scene: &Scene, geometry: &Geometry) -> Result<signal::Simulator, Error> {
    let record = signal::Record {
        time_of_first_sample_s: 2.0 * geometry.first_range_m / crate::SPEED_OF_LIGHT_M_S,
        samples: geometry.samples,
    };
    Ok(signal::Simulator::new(pulse(scene)?, receiver(scene), record)?)
}

/// Return per metre K^2 beta A_R eta_s/R^2 of each layer, (9).
///
/// # Errors
/// What the optics refuse, such as a layer outside the efficiency profile.
pub fn layer_weights_per_m(
    scene: &Scene,
    geometry: &Geometry,
    efficiency: &optics::EfficiencyProfile,
) -> Result<Vec<f64>, Error> {
    let model = snr_model(scene)?;
    geometry
        .layer_range_m()
        .map(|range_m| Ok(model.return_per_m(range_m)? * efficiency.interpolated(range_m)?))
        .collect()
}

/// The constant return per metre of each layer that gives the signal-to-noise ratio `snr_db`.
pub fn fixed_weights_per_m(scene: &Scene, geometry: &Geometry, snr_db: f64) -> Vec<f64> {
    let unit = receiver(scene).slowly_varying_snr(scene.pulse.energy_j, 1.0);
    vec![10f64.powf(0.1 * snr_db) / unit; geometry.layers]
}

/// The sampling of the records, in the words of the estimators.
///
/// # Errors
/// What the estimators refuse; a checked scene gives none.
pub fn sampling(scene: &Scene) -> Result<estimate::Sampling, Error> {
    let d = &scene.detector;
    let half_hz = 0.5 * d.bandwidth_hz;
    let band_hz = (d.intermediate_frequency_hz - half_hz, d.intermediate_frequency_hz + half_hz);
    Ok(estimate::Sampling::new(d.sampling_hz, d.intermediate_frequency_hz, scene.laser.wavelength_m, band_hz)?)
}

/// The windows that are accumulated.
///
/// # Errors
/// What the estimators refuse; a checked scene gives none.
pub fn gates(scene: &Scene) -> Result<estimate::Gates, Error> {
    let e = &scene.estimator;
    let first_sample_time_s = 2.0 * scene.scan.range_min_m / crate::SPEED_OF_LIGHT_M_S;
    Ok(estimate::Gates::new(e.window_samples, e.window_step_samples, first_sample_time_s)?)
}

/// The weighting of the windows.
pub fn weighting(scene: &Scene) -> estimate::Weighting {
    match scene.estimator.weighting {
        Weighting::Gaussian => estimate::Weighting::default(),
        Weighting::Rectangular => estimate::Weighting::Rectangular,
        Weighting::Hann => estimate::Weighting::Hann,
    }
}

/// How a peak is refined.
pub fn refinement(scene: &Scene) -> estimate::Refinement {
    match scene.estimator.refinement {
        Refinement::Parabola => estimate::Refinement::Parabola,
        Refinement::None => estimate::Refinement::None,
    }
}
