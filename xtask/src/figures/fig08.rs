//! Figure 8: radial velocity of the simulated wake, early and late, and what the lidar makes of it.

use super::{Claim, Context, Rendered};
use crate::Failure;
use crate::wakes::Wake;
use wakescope_sim::export::tables::map_table;
use wakescope_sim::export::{Table, VelocityMap};
use wakescope_sim::plan::{Plan, Target};
use wakescope_sim::plot::{ColourMap, Figure, MapPlot};
use wakescope_sim::progress::Silent;
use wakescope_sim::scene::{Flow, Outside, Scene, SceneFile, SimulatedFlow, SimulatedMotion, SnrReference};
use wakescope_sim::{run, write};

const AGES: [(f64, &str); 2] = [(2.5, "early"), (5.0, "late")];

fn scene(context: &Context, wake: &Wake, tau: f64) -> Result<Scene, Failure> {
    let b0_m = wake.flow.pair.scales()?.spacing_m;
    let flow = SimulatedFlow {
        planes: "plane1".into(),
        motion: SimulatedMotion::Frozen,
        age_tau: Some(tau),
        ..SimulatedFlow::default()
    };
    let mut scene = Scene { seed: context.seed, ..Scene::default() };
    // The box of the flow, as far as the vortices go.
    let half_m = 0.5 * wake.flow.size[1] * b0_m - 10.0;
    scene.scan.range_min_m = flow.lateral_position_m - half_m;
    scene.scan.range_max_m = flow.lateral_position_m + half_m;
    scene.scan.elevation_max_rad = (1.6 * b0_m / flow.lateral_position_m).atan();
    scene.scan.pulses_per_line = 1;
    scene.scan.realisations = context.choose(4, 32, 128);
    scene.scan.outside_flow = Outside::Mask {};
    scene.detector.snr = SnrReference::Fixed { snr_db: 0.0 };
    scene.estimator.gate_step_samples = context.choose(5, 2, 1);
    scene.flow = Flow::Simulated(flow);
    Ok(scene)
}

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let wake = Wake::of(context)?;
    let mut out = Rendered::default();
    let mut panels = Vec::new();
    let mut tables = Vec::new();
    let mut extremes = Vec::new();
    let mut colours: [Option<ColourMap>; 2] = [None; 2];
    let mut origin = context.provenance_of_formula(&wake.case_toml);
    for (tau, name) in AGES {
        let toml = scene(context, &wake, tau)?.to_toml();
        let plan = Plan::new(SceneFile::parse(&toml, &wake.folder.join("scene.toml"))?, Target::Map)?;
        let estimates = run::run(&plan, &Silent)?.map.ok_or_else(|| Failure::new("the plan gave no map".into()))?;
        let map = write::velocity_map(&plan, &estimates);
        origin = write::provenance(&plan);
        tables.push(map_table(&map)?);
        extremes.push((name, extreme(&map, f64::min)?, extreme(&map, f64::max)?));
        for (place, (field, title)) in [("v_exact", "exact"), ("radial_velocity", "estimated")].into_iter().enumerate()
        {
            let plot = MapPlot::new(&map, 0, field)?.titled(&format!("{title}, τ = {tau}")).labelled("v_R [m/s]");
            let shared = *colours[0].get_or_insert(plot.colours);
            colours[place] = Some(shared);
            panels.push(plot.coloured(shared));
        }
    }
    out.csv(Table::stack(tables)?.to_csv(&origin)?);
    let mut figure = Figure::stacked(panels);
    (figure.columns, figure.width) = (2, 1300.0);
    out.picture(figure.svg(&origin)?, figure.png(&origin)?);
    out.caption = format!(
        "Radial velocity early and late (left: exact, right: mean of the estimates by periodogram accumulation, one pulse a line, 0 dB, \
         rho = 2 m); {}.",
        wake.words()
    );
    let [(_, early_low, early_high), (_, late_low, late_high)] = extremes[..] else {
        return Err(Failure::new("two ages are compared".into()));
    };
    out.claims.push(Claim::exact(
        "F8",
        "fig08",
        "late extrema are weaker than early ones",
        "late below early, on both sides",
        format!("early: {early_low:.2} to {early_high:.2} m/s; late: {late_low:.2} to {late_high:.2} m/s"),
        late_high < early_high && late_low > early_low,
    ));
    Ok(out)
}

/// An extremum of the exact radial velocity.
fn extreme(map: &VelocityMap, pick: fn(f64, f64) -> f64) -> Result<f64, Failure> {
    let field = map.field("v_exact").ok_or_else(|| Failure::new("the map has no exact velocity".into()))?;
    Ok(field.values.iter().copied().fold(f64::NAN, pick))
}
