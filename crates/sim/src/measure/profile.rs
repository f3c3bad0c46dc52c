//! Efficiency and signal-to-noise ratio against range, by the cheapest model that is valid.
//!
//! Free space is a quadrature. Turbulence on independent paths (bistatic) has an exact mean at any strength.
//! Only turbulence that both beams share (monostatic) needs phase screens.

use crate::Error;
use crate::measure::instrument::{Instrument, receiver_path};
use crate::measure::progress::Observer;
use crate::plan::Stage;
use crate::scene::{EfficiencyOfPulse, ReceiverPath, RefractiveTurbulence, Scene, SnrReference, Turbulence};
use std::ops::ControlFlow;
use wakescope_optics::air::StructureTable;
use wakescope_optics::plan::{DOUBTFUL_LOSS, Model, cheapest_model};
use wakescope_optics::theory::{bistatic_efficiency_with, free_space_efficiency};
use wakescope_optics::{Cn2Path, EfficiencyProfile, Misalignment, Stop};

/// The cheapest model of the efficiency that is valid for a scene.
pub fn model(scene: &Scene) -> Model {
    let cn2 = match turbulence(scene) {
        None => Cn2Path::None,
        Some(t) => Cn2Path::Uniform { cn2_m_m23: t.cn2_m_m23 },
    };
    cheapest_model(receiver_path(scene), &cn2)
}

/// The turbulence of a scene, if there is any.
pub fn turbulence(scene: &Scene) -> Option<RefractiveTurbulence> {
    match scene.atmosphere.turbulence {
        Turbulence::Refractive(t) if t.cn2_m_m23 > 0.0 => Some(t),
        _ => None,
    }
}

/// The turbulence of a scene whose pulses each have the efficiency of one realisation.
pub(crate) fn drawn_turbulence(scene: &Scene) -> Option<RefractiveTurbulence> {
    turbulence(scene).filter(|t| t.efficiency == EfficiencyOfPulse::Realisation)
}

/// Efficiency (19) and signal-to-noise ratio (14) at the same ranges.
#[derive(Debug, Clone, PartialEq)]
pub struct RangeProfile {
    /// The model that the scene's signals use.
    pub model: Model,
    /// Efficiency by that model, with its scatter and error.
    pub efficiency: EfficiencyProfile,
    /// Mean signal-to-noise ratio in the detector band, dB, for a pulse short against the changes
    /// of the path.
    pub snr_db: Vec<f64>,
    /// The other models side by side, by the name of their column; empty without turbulence.
    pub others: Vec<(&'static str, EfficiencyProfile)>,
    /// Largest mean fraction of the power that the absorbing border of the phase screens took; above 0.01 the
    /// Monte Carlo is doubtful. `None` without one.
    pub lost_power_fraction: Option<f64>,
}

/// The profile that the scene's outputs ask for: with turbulence, theory and Monte Carlo side by side.
///
/// # Errors
/// What the optics refuse, such as a grid too small for the beam.
pub fn range_profile(scene: &Scene, instrument: &Instrument, observer: &dyn Observer) -> Result<RangeProfile, Error> {
    let o = &scene.outputs;
    let range_m = spaced(o.profile_range_min_m, o.profile_range_max_m, o.profile_points);
    let model = self::model(scene);
    let mut others = Vec::new();
    let mut lost_power_fraction = None;
    let efficiency = match turbulence(scene) {
        None => free_space(instrument, &range_m)?,
        Some(t) => {
            let exact = efficiency_by_theory(instrument, &range_m)?;
            let Paths { monostatic, bistatic, lost_power_fraction: lost, .. } =
                monte_carlo(scene, instrument, &t, &range_m, observer)?;
            lost_power_fraction = Some(lost);
            others.push(("efficiency_free_space", free_space(instrument, &range_m)?));
            others.push(("efficiency_bistatic_exact", exact.clone()));
            others.push(("efficiency_monostatic_monte_carlo", monostatic.clone()));
            others.push(("efficiency_bistatic_monte_carlo", bistatic));
            if model == Model::MonteCarlo { monostatic } else { exact }
        }
    };
    let receiver = &instrument.receiver;
    let snr_db = efficiency
        .range_m
        .iter()
        .zip(&efficiency.mean)
        .map(|(&range_m, &mean)| match scene.detector.snr {
            SnrReference::Fixed { snr_db } => Ok(snr_db),
            _ => Ok(10.0
                * receiver
                    .slowly_varying_snr(scene.pulse_energy_j(), instrument.return_per_m(range_m)? * mean)
                    .log10()),
        })
        .collect::<Result<_, Error>>()?;
    Ok(RangeProfile { model, efficiency, snr_db, others, lost_power_fraction })
}

/// The efficiency at given ranges, m, increasing, by the cheapest model that is valid.
///
/// # Errors
/// What the optics refuse, such as a range of 0 or a grid too small for the beam.
pub fn efficiency_at(
    scene: &Scene,
    instrument: &Instrument,
    range_m: &[f64],
    observer: &dyn Observer,
) -> Result<EfficiencyProfile, Error> {
    match (turbulence(scene), model(scene)) {
        (Some(_), Model::ExactBistatic) => efficiency_by_theory(instrument, range_m),
        (Some(t), Model::MonteCarlo) => Ok(monte_carlo(scene, instrument, &t, range_m, observer)?.monostatic),
        _ => free_space(instrument, range_m),
    }
}

pub(crate) fn free_space(instrument: &Instrument, range_m: &[f64]) -> Result<EfficiencyProfile, Error> {
    Ok(EfficiencyProfile::from_theory(range_m, |range_m| free_space_efficiency(&instrument.telescope, range_m))?)
}

/// The efficiency without phase screens: of free space, and in turbulence the exact mean of independent paths, which leaves out
/// what a path out and back gains.
///
/// # Errors
/// As [`efficiency_at`].
pub(crate) fn efficiency_by_theory(instrument: &Instrument, range_m: &[f64]) -> Result<EfficiencyProfile, Error> {
    let Some(turbulence) = &instrument.turbulence else { return free_space(instrument, range_m) };
    let table = StructureTable::new(&*turbulence.spectrum);
    Ok(EfficiencyProfile::from_theory(range_m, |range_m| {
        bistatic_efficiency_with(&instrument.telescope, &Misalignment::NONE, &turbulence.cn2, &table, range_m)
    })?)
}

/// Efficiency of each realisation of the path at given ranges, m, increasing: `[realisation][range]`, by phase screens.
///
/// # Errors
/// As [`efficiency_at`].
pub fn efficiency_realisations(
    scene: &Scene,
    instrument: &Instrument,
    t: &RefractiveTurbulence,
    range_m: &[f64],
    observer: &dyn Observer,
) -> Result<Vec<Vec<f64>>, Error> {
    let paths = monte_carlo(scene, instrument, t, range_m, observer)?;
    let by_range = match scene.telescope.receiver {
        ReceiverPath::Monostatic => paths.monostatic_realisations,
        ReceiverPath::Bistatic => paths.bistatic_realisations,
    };
    let count = by_range.iter().map(Vec::len).min().unwrap_or(0);
    Ok((0..count).map(|i| by_range.iter().map(|efficiencies| efficiencies[i]).collect()).collect())
}

/// What the phase screens give for both receivers.
struct Paths {
    monostatic: EfficiencyProfile,
    bistatic: EfficiencyProfile,
    monostatic_realisations: Vec<Vec<f64>>,
    bistatic_realisations: Vec<Vec<f64>>,
    /// Largest mean fraction of the power that the border of the grid took.
    lost_power_fraction: f64,
}

/// Monostatic and bistatic efficiency by phase screens, from one set of realisations.
fn monte_carlo(
    scene: &Scene,
    instrument: &Instrument,
    t: &RefractiveTurbulence,
    range_m: &[f64],
    observer: &dyn Observer,
) -> Result<Paths, Error> {
    observer.begin(Stage::PhaseScreens, t.realisations as u64);
    let mut seen = 0;
    // Single precision: its rounding is far below the error of any number of realisations.
    let estimate =
        instrument.monte_carlo(t, range_m, scene.seed)?.run::<f32>(Stop::after(t.realisations), |progress| {
            observer.advance((progress.done - seen) as u64);
            seen = progress.done;
            ControlFlow::Continue(())
        })?;
    observer.end();
    let lost = estimate.lost_power_fraction.iter().copied().fold(0.0, f64::max);
    if lost > DOUBTFUL_LOSS {
        observer.warn(&format!(
            "the border of the phase screens took {lost:.3} of the light, 0.01 at most is good: a wider grid is needed, more \
             atmosphere.turbulence.grid_points or sampling = \"derived\""
        ));
    }
    // A checked scene has at least two realisations, and so pairs of them.
    let bistatic =
        estimate.bistatic.ok_or(wakescope_optics::Error::Length { field: "realisations", found: 1, expected: 2 })?;
    Ok(Paths {
        monostatic: estimate.monostatic,
        bistatic,
        monostatic_realisations: estimate.monostatic_realisations,
        bistatic_realisations: estimate.bistatic_realisations,
        lost_power_fraction: lost,
    })
}

/// `points` values from `low` to `high`, both included.
pub(crate) fn spaced(low: f64, high: f64, points: usize) -> Vec<f64> {
    let step = (high - low) / (points.max(2) - 1) as f64;
    (0..points).map(|i| if i + 1 == points { high } else { low + i as f64 * step }).collect()
}
