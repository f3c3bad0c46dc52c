//! Figure 8: radial velocity of the early wake, here of the analytic pair.
//!
//! The pair follows the inviscid path over the ground until tau = 2.5; there is no boundary layer, no
//! secondary vortex and no rebound. The simulated flow takes its place when there is one, and with
//! it comes the late map.

use super::{Claim, Context, Rendered, Verdict};
use crate::Failure;
use wakescope_sim::export::tables::map_table;
use wakescope_sim::plan::{Plan, Target};
use wakescope_sim::plot::{Figure, MapPlot};
use wakescope_sim::progress::Silent;
use wakescope_sim::scene::{Flow, Scene, SnrReference, VortexMotion, VortexPair};
use wakescope_sim::{run, write};

const TAU: f64 = 2.5;

fn scene(context: &Context) -> Scene {
    let pair = VortexPair { motion: VortexMotion::Inviscid, age_tau: TAU, ..VortexPair::default() };
    let mut scene = Scene { flow: Flow::VortexPair(pair), ..Scene::default() };
    // At tau = 2.5 the inviscid pair has spread over the ground: the scan must reach both.
    scene.scan.range_min_m = 240.0;
    scene.scan.range_max_m = 560.0;
    scene.scan.elevation_max_rad = 0.16;
    scene.scan.pulses_per_line = 1;
    scene.scan.realisations = context.choose(4, 32, 128);
    scene.detector.snr = SnrReference::Fixed { snr_db: 0.0 };
    scene.estimator.gate_step_samples = context.choose(5, 2, 1);
    scene
}

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let plan = Plan::new(context.scene_file(scene(context))?, Target::Map)?;
    let estimates = run::run(&plan, &Silent)?.map.ok_or_else(|| Failure::new("the plan gave no map".into()))?;
    let map = write::velocity_map(&plan, &estimates);
    let origin = write::provenance(&plan);
    let mut out = Rendered::default();
    out.csv(map_table(&map)?.to_csv(&origin)?);
    let exact = MapPlot::new(&map, 0, "v_exact")?.titled("Radial velocity of the analytic pair, tau = 2.5");
    let estimate = MapPlot::new(&map, 0, "radial_velocity")?
        .titled("Mean estimate, periodogram accumulation, 0 dB, rho = 2 m")
        .coloured(exact.colours);
    let error = MapPlot::new(&map, 0, "rms")?.titled("Root mean square error against the pulse-weighted velocity");
    let figure =
        Figure::stacked([exact.labelled("v_R [m/s]"), estimate.labelled("v_R [m/s]"), error.labelled("rms [m/s]")]);
    out.picture(figure.svg(&origin)?, figure.png(&origin)?);
    out.marks = vec!["analytic pair".into()];
    out.caption = format!(
        "ANALYTIC PAIR, not a simulated flow: radial velocity at tau = {TAU} on the inviscid path over the ground (top), what \
         periodogram accumulation makes of {} scans at 0 dB (middle), and its error (bottom). The late map needs the simulated flow.",
        plan.realisations()
    );
    out.claims.push(Claim {
        verdict: Verdict::NotResolved,
        ..Claim::exact(
            "F8",
            "fig08",
            "late extrema are weaker than early ones",
            "late below early",
            format!(
                "early: {:.2} to {:.2} m/s; the analytic pair does not decay, so there is no late map",
                extreme(&estimates.v_exact_m_s, f64::min),
                extreme(&estimates.v_exact_m_s, f64::max)
            ),
            false,
        )
    });
    Ok(out)
}

fn extreme(values: &ndarray::Array2<f64>, pick: fn(f64, f64) -> f64) -> f64 {
    values.iter().copied().fold(f64::NAN, pick)
}
