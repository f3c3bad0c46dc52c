//! Figure 8: radial velocity of the simulated wake, early and late, and what the lidar makes of it.

use super::context::{Context, Rendered};
use crate::claim::Claim;
use crate::wakes;
use fixtures::failure::Failure;
use wakescope_les::analysis::decay::value_at;
use wakescope_sim::flow::FinishedWake;
use wakescope_sim::io::tables::map_table;
use wakescope_sim::io::{Table, VelocityMap};
use wakescope_sim::plan::{Plan, Target};
use wakescope_sim::plot::{ColourMap, Figure, MapPlot};
use wakescope_sim::scene::{Flow, Outside, Scene, SceneFile, SimulatedFlow, SimulatedMotion, SnrReference};
use wakescope_sim::setup::progress::Silent;
use wakescope_sim::{run, write};

const AGES: [(f64, &str); 2] = [(2.5, "early"), (5.0, "late")];
/// Air about the centre of a vortex that belongs to it, in spacings: half of the way between the two at the start.
const REACH: f64 = 0.5;

/// Smallest and largest distance from the middle and largest height of a vortex centre at the ages shown \[m\].
fn extent_m(wake: &FinishedWake) -> Result<[f64; 3], Failure> {
    let mut extent_m = [f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
    for (tau, _) in AGES {
        for side in ["left", "right"] {
            let at =
                |name: &str| -> Result<f64, Failure> { Ok(value_at(&wake.curve(&format!("{name}_{side}_m"))?, tau)) };
            let (y_m, z_m) = (at("y")?, at("z")?);
            extent_m = [extent_m[0].min(y_m), extent_m[1].max(y_m), extent_m[2].max(z_m)];
        }
    }
    Ok(extent_m)
}

/// A sector from the ground up, as a lidar on the ground scans it.
struct Sector {
    range_m: [f64; 2],
    elevation_max_rad: f64,
}

impl Sector {
    /// The smallest about the boxes that reach `reach_m` beyond the centres of vortices, which lie from `low_m` to `high_m` about
    /// `middle_m` and at most `top_m` high.
    fn about([low_m, high_m, top_m]: [f64; 3], middle_m: f64, reach_m: f64) -> Self {
        let (near_m, far_m, top_m) = (middle_m + low_m - reach_m, middle_m + high_m + reach_m, top_m + reach_m);
        // The far upper corner is a range away, not a distance along the ground.
        Self { range_m: [near_m, far_m.hypot(top_m)], elevation_max_rad: top_m.atan2(near_m) }
    }
}

fn scene(context: &Context, wake: &FinishedWake, tau: f64) -> Result<Scene, Failure> {
    let b0_m = wake.flow.pair.scales()?.spacing_m;
    let flow = SimulatedFlow {
        planes: "plane1".into(),
        motion: SimulatedMotion::Frozen,
        age_tau: Some(tau),
        ..SimulatedFlow::default()
    };
    let mut scene = Scene { seed: context.seed, ..Scene::default() };
    // Both vortices whole at both ages, with the same sector: air beyond the box of the flow is masked.
    let sector = Sector::about(extent_m(wake)?, flow.lateral_position_m, REACH * b0_m);
    // Gates begin and end half a window inside the samples.
    let half_window_m = 0.5 * scene.estimator.window_samples as f64 * scene.sample_spacing_m();
    scene.scan.range_min_m = sector.range_m[0] - half_window_m;
    scene.scan.range_max_m = sector.range_m[1] + half_window_m;
    scene.scan.elevation_max_rad = sector.elevation_max_rad;
    scene.scan.pulses_per_line = 1;
    scene.scan.realisations = context.choose(4, 32, 128);
    scene.scan.outside_flow = Outside::Mask {};
    scene.detector.snr = SnrReference::Fixed { snr_db: 0.0 };
    scene.estimator.gate_step_samples = context.choose(5, 2, 1);
    scene.flow = Flow::Simulated(flow);
    Ok(scene)
}

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let wake = wakes::of(context)?;
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
    let realisations = scene(context, &wake, AGES[0].0)?.scan.realisations;
    let title =
        format!("Radial velocity, positive away from the lidar; estimated: mean of {realisations} realisations");
    let mut figure = Figure::stacked(panels).titled(&title);
    (figure.columns, figure.width) = (2, 1300.0);
    let mut out = Rendered::new(&Table::stack(tables)?, &figure, &origin)?;
    out.caption = format!(
        "Radial velocity early and late (left: exact, right: mean of the estimates by periodogram accumulation with the Gaussian weighting, 200 ns, no refractive \
         turbulence, one pulse a line, 0 dB, \u{3c1} = 2 m); {}.",
        wake.words()
    );
    let [(_, early_low, early_high), (_, late_low, late_high)] = extremes[..] else {
        return Err(Failure::new("two ages are compared".into()));
    };
    out.claims.push(Claim::exact(
        "F8",
        format!(
            "{:.2} and {:.2}; early: {early_low:.2} to {early_high:.2} m/s; late: {late_low:.2} to {late_high:.2} m/s",
            late_low / early_low,
            late_high / early_high
        ),
        late_high < 0.8 * early_high && late_low > 0.8 * early_low,
    ));
    Ok(out)
}

/// An extremum of the exact radial velocity.
fn extreme(map: &VelocityMap, pick: fn(f64, f64) -> f64) -> Result<f64, Failure> {
    let field = map.field("v_exact").ok_or_else(|| Failure::new("the map has no exact velocity".into()))?;
    Ok(field.values.iter().copied().fold(f64::NAN, pick))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sector_holds_a_box_about_each_vortex() {
        // The coarse wake: the late vortices are 1.2 spacings from the middle, the early ones 0.9 and lower.
        for (extent_m, reach_m) in [([-56.0, 57.0, 45.0], 23.5), ([-80.0, 75.0, 30.0], 30.0)] {
            let sector = Sector::about(extent_m, 400.0, reach_m);
            let [low_m, high_m, top_m] = extent_m;
            for (y_m, z_m) in [low_m, high_m].into_iter().flat_map(|y_m| [(y_m, 0.5 * top_m), (y_m, top_m)]) {
                for (dy, dz) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
                    let corner = (400.0 + y_m + dy * reach_m, (z_m + dz * reach_m).max(0.0));
                    let (range_m, elevation_rad) = (corner.0.hypot(corner.1), corner.1.atan2(corner.0));
                    let slack = 1e-9;
                    assert!(range_m > sector.range_m[0] - slack && range_m < sector.range_m[1] + slack, "{corner:?}");
                    assert!(elevation_rad < sector.elevation_max_rad + slack, "{corner:?}");
                }
            }
        }
    }
}
