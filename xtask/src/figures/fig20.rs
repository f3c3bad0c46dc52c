//! Figure 20: one scan of the pair, the wake that was fitted to it, and what is left.

use super::context::*;
use wakescope_estimate::retrieval::{
    Measured, RetrievalOptions, ScanMap, Side, expected_velocities,
};
use wakescope_estimate::vortex_fit::CorePrior;
use wakescope_sim::io::scans::ReadScan;
use wakescope_sim::retrieve::{
    Method, RetrievedScan, SceneResponse, Velocities, figure, gate_of, retrieve_map,
};

const TRUE_M2_S: f64 = 500.0;

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let mut scene = Scene::default();
    scene.detector.snr = SnrReference::Fixed { snr_db: 10.0 };
    (scene.scan.elevation_min_rad, scene.scan.elevation_max_rad) = (0.03, 0.21);
    scene.scan.elevation_step_rad = context.profile.choose(2.5e-3, 1.25e-3, 1.25e-3);
    (scene.scan.pulses_per_line, scene.scan.realisations) = (4, 1);
    let plan = Plan::new(context.scene_file(scene)?, Target::Map)?;
    let map = wakescope_sim::run(&plan, &Silent)?
        .map
        .ok_or_else(|| Failure::new("a run without a map".into()))?;
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
        gate: gate_of(None, None, Some(&plan.scene.content))?.0,
        core_prior: Some(CorePrior::TYPICAL),
        ..RetrievalOptions::default()
    };
    let own = SceneResponse::of_scene(&plan.scene, &Silent)?;
    let found = retrieve_map(
        scan,
        Method::Fit,
        options,
        own.as_ref().map_or(Velocities::Unknown, Velocities::Shown),
    )?;
    let origin = plan.scene.provenance();
    let mut out = Rendered::new(&table(&found)?, &figure(&found, 1)?, &origin)?;
    out.marks = vec!["analytic pair".into()];
    out.claims = claims(&found);
    Ok(out)
}

fn table(found: &RetrievedScan) -> Result<Table, Failure> {
    let map = &found.scan.map;
    let wake = found
        .result
        .wake
        .ok_or_else(|| Failure::new("no wake in the scan of a pair".into()))?;
    let model = expected_velocities(map, &found.options, &wake, false)?;
    let fitted = |side: Side, get: fn(&Measured) -> f64| {
        found
            .result
            .vortex(side)
            .map_or(f64::NAN, |vortex| get(&vortex.circulation_m2_s))
    };
    let [left, right] = [Side::Left, Side::Right]
        .map(|side| [fitted(side, |of| of.value), fitted(side, |of| of.std)]);
    let row = |((line, gate), velocity_m_s): ((usize, usize), &f64)| {
        let (range_m, elevation_rad, model_m_s) = (
            map.range_m[gate],
            map.elevation_rad[line],
            model[[line, gate]],
        );
        let residual_m_s = velocity_m_s - model_m_s;
        [
            range_m,
            elevation_rad,
            *velocity_m_s,
            model_m_s,
            residual_m_s,
            left[0],
            left[1],
            right[0],
            right[1],
        ]
    };
    let names = "range_m elevation_rad velocity_m_s model_m_s residual_m_s gamma_left_m2_s gamma_left_std_m2_s gamma_right_m2_s \
                 gamma_right_std_m2_s";
    Ok(numbers_table(
        names,
        &map.velocity_m_s.indexed_iter().map(row).collect::<Vec<_>>(),
    ))
}

fn claims(found: &RetrievedScan) -> Vec<Claim> {
    let part = |(name, side): (&str, Side)| {
        let value = found
            .result
            .vortex(side)
            .map(|vortex| vortex.circulation_m2_s);
        let stated = value.map_or(Estimate::stated(f64::NAN, f64::NAN), |v| {
            Estimate::stated(v.value, v.std)
        });
        (
            name.into(),
            stated,
            " m²/s",
            Bar::Between(0.9 * TRUE_M2_S, 1.1 * TRUE_M2_S),
        )
    };
    let parts = [("left", Side::Left), ("right", Side::Right)].map(part);
    vec![Claim::judged("F20a", &parts)]
}
