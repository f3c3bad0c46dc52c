//! A run in small before the run: one pulse along one line, with the receiver, the windows and the estimator of the scene.
//!
//! What only the computing shows - a window that no estimator can be planned for, values that a file cannot hold - shows
//! here within moments. `cargo xtask fuzz-scenes` looks for scenes that pass and do not run.

use crate::plan::{Plan, Stage, Target};
use crate::scene::{Flow, HeadMotionKeys, Pattern, Scene, SceneFile, Turbulence};
use crate::setup::progress::Silent;
use crate::{Error, run, write};

/// Longest forecast of a rehearsal, s.
const LONGEST_S: f64 = 0.5;

/// Most memory for one, bytes.
const LARGEST_BYTES: f64 = 1e9;

/// Runs a plan in small, without writing anything; nothing where even that would take long.
///
/// Phase screens are left out; the planner has looked at them.
///
/// # Errors
/// What the run would refuse.
pub fn rehearse(plan: &Plan) -> Result<(), Error> {
    if !plan.runs(Stage::Signals) && plan.target != Target::Efficiency {
        return Ok(());
    }
    let Some(small) = in_small(plan) else { return Ok(()) };
    let result = run::run(&small, &Silent)?;
    write::files(&small, &result, std::path::Path::new("rehearsal")).map(drop)
}

/// The plan of one pulse along one line, if its forecast is short.
fn in_small(plan: &Plan) -> Option<Plan> {
    let shortened = |scene: &mut Scene| {
        let record_m = scene.estimator.window_samples as f64 * scene.sample_spacing_m();
        scene.scan.range_max_m = scene.scan.range_max_m.min(scene.scan.range_min_m + 1.5 * record_m);
    };
    for shorten in [false, true] {
        let mut scene = plan.scene.scene.clone();
        scene.scan.elevation_max_rad = scene.scan.elevation_min_rad;
        // One line says it all; which one makes no difference to the signals.
        (scene.scan.pattern, scene.scan.head) = (Pattern::default(), HeadMotionKeys::default());
        (scene.scan.pulses_per_line, scene.scan.realisations) = (1, scene.scan.realisations.min(2));
        scene.outputs.profile_points = 2;
        // The drawing takes longest and depends on the values alone.
        scene.outputs.png = false;
        scene.outputs.svg &= !(scene.outputs.csv || scene.outputs.netcdf);
        scene.outputs.csv |= !scene.outputs.netcdf && !scene.outputs.svg;
        scene.atmosphere.turbulence = Turbulence::None {};
        if matches!(scene.flow, Flow::Simulated(_) | Flow::Fields(_)) {
            // Its files are not read twice.
            scene.flow = Flow::Calm {};
        }
        scene.added_flows.clear();
        if shorten {
            shortened(&mut scene);
        }
        let mut file = SceneFile::new(scene).ok()?;
        file.folder.clone_from(&plan.scene.folder);
        let small = Plan::new(file, plan.target).ok()?;
        let total = small.total();
        if total.core_s < LONGEST_S && total.memory_bytes < LARGEST_BYTES {
            return Some(small);
        }
    }
    None
}
