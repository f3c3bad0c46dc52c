//! The optics of a plan: phase screens only where no theory is valid, or where they are asked for beside it.

use super::{Cost, PlannedStage, Stage, Target};
use crate::geometry::Geometry;
use crate::profile::{drawn_turbulence, model, spaced, turbulence};
use crate::scan::profile_ranges_m;
use crate::scene::{RefractiveTurbulence, Scene, SnrReference};
use crate::{Error, join};
use wakescope_optics::plan::{Model, Warning};

/// Time of one quadrature on one core, s.
const QUADRATURE_S: f64 = 2e-3;

/// Phase screens and efficiency; adds what is doubtful about the screens to `warnings`.
///
/// # Errors
/// Screens that cannot resolve the scene, with the limit and what would do.
pub(super) fn stages(
    scene: &Scene,
    target: Target,
    geometry: &Geometry,
    warnings: &mut Vec<String>,
) -> Result<[PlannedStage; 2], Error> {
    let fixed = match scene.detector.snr {
        SnrReference::Fixed { snr_db } => Some(snr_db),
        _ => None,
    };
    let o = &scene.outputs;
    let model = model(scene);
    // Ranges at which the efficiency is wanted: for the table, and for the layers of the signals.
    let table = matches!(target, Target::Run | Target::Efficiency)
        .then(|| spaced(o.profile_range_min_m, o.profile_range_max_m, o.profile_points));
    let layers = (target != Target::Efficiency && fixed.is_none()).then(|| profile_ranges_m(scene, geometry));
    let quadratures = (table.as_ref().map_or(0, Vec::len) + layers.as_ref().map_or(0, Vec::len)) as f64;
    let planned = |stage, reason: String, cost| PlannedStage { stage, reason, cost };

    let screens = match turbulence(scene) {
        None => planned(Stage::PhaseScreens, "no turbulence: atmosphere.turbulence".into(), None),
        Some(t) => {
            let drawn = layers.filter(|_| model == Model::MonteCarlo || drawn_turbulence(scene).is_some());
            let runs: Vec<Vec<f64>> = [table, drawn].into_iter().flatten().collect();
            match (runs.is_empty(), model) {
                (false, _) => screens(scene, &t, &runs, warnings)?,
                (true, Model::ExactBistatic) => {
                    planned(Stage::PhaseScreens, "the bistatic efficiency has an exact theory".into(), None)
                }
                (true, _) => planned(Stage::PhaseScreens, "not asked for".into(), None),
            }
        }
    };
    let efficiency = match fixed {
        Some(snr_db) if quadratures == 0.0 => {
            planned(Stage::Efficiency, format!("detector.snr fixes {snr_db} dB at every range"), None)
        }
        _ => {
            let how = match model {
                Model::FreeSpace => "free space, by quadrature",
                Model::ExactBistatic => "independent paths, exact by quadrature",
                Model::MonteCarlo => "one path out and back, by phase screens",
            };
            let cost = Cost { core_s: quadratures * QUADRATURE_S, memory_bytes: quadratures * 64.0 };
            planned(Stage::Efficiency, format!("{how}, at {quadratures} ranges"), Some(cost))
        }
    };
    Ok([screens, efficiency])
}

/// The phase screens of all runs, each for its own ranges.
fn screens(
    scene: &Scene,
    t: &RefractiveTurbulence,
    runs: &[Vec<f64>],
    warnings: &mut Vec<String>,
) -> Result<PlannedStage, Error> {
    let mut cost = Cost { core_s: 0.0, memory_bytes: 0.0 };
    let mut what = Vec::new();
    for range_m in runs {
        let plan = join::screen_plan(scene, t, range_m)?;
        cost.core_s += plan.realisation_cpu_s * t.realisations as f64;
        cost.memory_bytes = cost.memory_bytes.max(plan.memory_bytes as f64);
        let last_m = range_m.last().copied().unwrap_or(0.0);
        let g = plan.grid;
        what.push(format!(
            "{} screens to {last_m:.0} m of {} x {} points of {:.3} mm",
            plan.layers.end_m().len(),
            g.nx,
            g.ny,
            1e3 * g.dx_m
        ));
        warnings.extend(plan.warnings.iter().map(|w| in_words(w, last_m)));
    }
    let reason = format!("{} realisations of {}", t.realisations, what.join("; "));
    Ok(PlannedStage { stage: Stage::PhaseScreens, reason, cost: Some(cost) })
}

fn in_words(warning: &Warning, range_m: f64) -> String {
    match warning {
        Warning::InnerScale { missing } => format!(
            "the screens miss {:.1} % of the structure function at one grid spacing: atmosphere.turbulence.grid_spacing_m is \
             above half the inner scale",
            100.0 * missing
        ),
        Warning::ThickLayers { rytov_variance, layers_needed } => format!(
            "layers to {range_m:.0} m have a Rytov variance of {rytov_variance:.2}, above 0.1: \
             atmosphere.turbulence.layers = {layers_needed} would do"
        ),
        Warning::WeakTurbulence { rytov_variance } => format!(
            "turbulence of Rytov variance {rytov_variance:.1e} changes less than the error of phase screens: \
             atmosphere.turbulence.kind = \"none\" is as good"
        ),
        other => format!("{other:?}"),
    }
}
