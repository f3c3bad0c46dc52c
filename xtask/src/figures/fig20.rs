//! Figure 20: one scan of the pair, the wake that was fitted to it, and what is left.

use super::context::{Context, Rendered};
use crate::claim::Claim;
use crate::statistics::{Bar, Estimate};
use fixtures::failure::Failure;
use wakescope_estimate::retrieval::{Measured, RetrievalOptions, ScanMap, Side, expected_velocities};
use wakescope_estimate::vortex_fit::CorePrior;
use wakescope_sim::Silent;
use wakescope_sim::io::Table;
use wakescope_sim::io::scans::ReadScan;
use wakescope_sim::plan::{Plan, Target};
use wakescope_sim::retrieve::{Method, OwnScene, RetrievedScan, Velocities, figure, gate_of, retrieve_map};
use wakescope_sim::scene::{Scene, SnrReference};

const TRUE_M2_S: f64 = 500.0;

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let mut scene = Scene::default();
    scene.detector.snr = SnrReference::Fixed { snr_db: 10.0 };
    (scene.scan.elevation_min_rad, scene.scan.elevation_max_rad) = (0.03, 0.21);
    scene.scan.elevation_step_rad = context.choose(2.5e-3, 1.25e-3, 1.25e-3);
    (scene.scan.pulses_per_line, scene.scan.realisations) = (4, 1);
    let plan = Plan::new(context.scene_file(scene)?, Target::Map)?;
    let map = wakescope_sim::run(&plan, &Silent)?.map.ok_or_else(|| Failure::new("a run without a map".into()))?;
    let map = ScanMap {
        elevation_rad: map.elevation_rad,
        time_s: plan.geometry.line_time_s.clone(),
        range_m: map.range_m,
        velocity_m_s: map.v_scan_m_s,
        sigma_m_s: None,
        fold_m_s: None,
    };
    let scan = ReadScan::own("scan", map);
    let options = RetrievalOptions {
        gate: gate_of(None, None, Some(&plan.scene.scene))?.0,
        core_prior: Some(CorePrior::TYPICAL),
        ..RetrievalOptions::default()
    };
    let own = OwnScene::new(&plan.scene, &Silent)?;
    let found = retrieve_map(scan, Method::Fit, options, own.as_ref().map_or(Velocities::Unknown, Velocities::Shown))?;
    let origin = wakescope_sim::write::provenance(&plan);
    let mut out = Rendered::new(&table(&found)?, &figure(&found, 1)?, &origin)?;
    out.marks = vec!["analytic pair".into()];
    out.caption = "ANALYTIC PAIR, not a simulated flow: velocities of one scan at 10 dB with four pulses a line, gate means of the fitted wake, and the \
                   difference. What is left at the cores is what peaks of spectra show beyond means, which the fit knows; crosses: the fitted \
                   centres."
        .into();
    out.claims = claims(&found);
    Ok(out)
}

fn table(found: &RetrievedScan) -> Result<Table, Failure> {
    let map = &found.scan.map;
    let wake = found.result.wake.ok_or_else(|| Failure::new("no wake in the scan of a pair".into()))?;
    let model = expected_velocities(map, &found.options, &wake, false)?;
    let cells: Vec<(usize, usize)> = map.velocity_m_s.indexed_iter().map(|(at, _)| at).collect();
    let column = |get: &dyn Fn((usize, usize)) -> f64| cells.iter().map(|at| get(*at)).collect::<Vec<_>>();
    let fitted = |side: Side, get: fn(&Measured) -> f64| {
        let value = found.result.vortex(side).map_or(f64::NAN, |vortex| get(&vortex.circulation_m2_s));
        vec![value; cells.len()]
    };
    Ok(Table::new()
        .float("range_m", column(&|at| map.range_m[at.1]))
        .float("elevation_rad", column(&|at| map.elevation_rad[at.0]))
        .float("velocity_m_s", column(&|at| map.velocity_m_s[at]))
        .float("model_m_s", column(&|at| model[at]))
        .float("residual_m_s", column(&|at| map.velocity_m_s[at] - model[at]))
        .float("gamma_left_m2_s", fitted(Side::Left, |of| of.value))
        .float("gamma_left_std_m2_s", fitted(Side::Left, |of| of.std))
        .float("gamma_right_m2_s", fitted(Side::Right, |of| of.value))
        .float("gamma_right_std_m2_s", fitted(Side::Right, |of| of.std)))
}

fn claims(found: &RetrievedScan) -> Vec<Claim> {
    let part = |(name, side): (&str, Side)| {
        let value = found.result.vortex(side).map(|vortex| vortex.circulation_m2_s);
        let stated = value.map_or(Estimate::stated(f64::NAN, f64::NAN), |v| Estimate::stated(v.value, v.std));
        (name.into(), stated, " m²/s", Bar::Between(0.9 * TRUE_M2_S, 1.1 * TRUE_M2_S))
    };
    let parts = [("left", Side::Left), ("right", Side::Right)].map(part);
    vec![Claim::judged("F20a", &parts)]
}
