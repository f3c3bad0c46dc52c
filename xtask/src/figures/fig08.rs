//! Figure 8: radial velocity of the simulated wake, early and late, and what the lidar makes of it.

use super::context::*;
use super::study::{EARLY_TAU, LATE_TAU, Sight, Study};
use crate::wakes;
use wakescope_sim::io::VelocityMap;
use wakescope_sim::io::tables::map_table;
use wakescope_sim::write;

/// Air about the centre of a vortex that belongs to it, in spacings: half of the way between the two at the start.
const REACH: f64 = 0.5;

/// Ranges and highest elevation of the smallest sector from the ground up about the boxes that reach `reach_m` beyond the centres of
/// vortices, (y, z).
fn sector(cores: &[(f64, f64)], reach_m: f64) -> ([f64; 2], f64) {
    let mut nearest_m = f64::NAN;
    let mut farthest_m = f64::NAN;
    let mut highest_m = f64::NAN;
    for (y_m, z_m) in cores {
        nearest_m = nearest_m.min(*y_m);
        farthest_m = farthest_m.max(*y_m);
        highest_m = highest_m.max(*z_m);
    }
    let near_m = nearest_m - reach_m;
    let far_m = farthest_m + reach_m;
    let top_m = highest_m + reach_m;
    // The far upper corner is a range away, not a distance along the ground.
    ([near_m, far_m.hypot(top_m)], top_m.atan2(near_m))
}

/// A scan of both vortices whole at both ages, with the same sector: air beyond the box of the flow is masked.
fn scene(context: &Context, (range_m, elevation_max_rad): ([f64; 2], f64)) -> Scene {
    let mut scene = Scene {
        seed: 0,
        ..Scene::default()
    };
    // Gates begin and end half a window inside the samples.
    let half_window_m = 0.5 * scene.estimator.window_samples as f64 * scene.sample_spacing_m();
    scene.scan.range_min_m = range_m[0] - half_window_m;
    scene.scan.range_max_m = range_m[1] + half_window_m;
    scene.scan.elevation_max_rad = elevation_max_rad;
    scene.scan.pulses_per_line = 1;
    scene.scan.realisations = context.profile.choose(4, 32, 128);
    scene.detector.snr = SnrReference::Fixed { snr_db: 0.0 };
    scene.estimator.gate_step_samples = context.profile.choose(5, 2, 1);
    scene
}

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let wake = wakes::of(context)?;
    let reach_m = REACH * wake.scales.spacing_m;
    let early_sight = Sight::of_wake(&wake, EARLY_TAU)?;
    let late_sight = Sight::of_wake(&wake, LATE_TAU)?;
    let cores = [&early_sight.cores[..], &late_sight.cores[..]].concat();
    let scene = scene(context, sector(&cores, reach_m));
    let early_study = Study::runs(context, &early_sight, vec![scene.clone()])?.remove(0);
    let late_study = Study::runs(context, &late_sight, vec![scene.clone()])?.remove(0);
    let early = write::velocity_map(&early_study.plan, &early_study.map);
    let late = write::velocity_map(&late_study.plan, &late_study.map);
    let colours = MapPlot::new(&early, 0, "v_exact")?.colours;
    let mut panels = Vec::new();
    for (map, tau) in [(&early, EARLY_TAU), (&late, LATE_TAU)] {
        for (field, title) in [("v_exact", "exact"), ("radial_velocity", "estimated")] {
            let plot = MapPlot::new(map, 0, field)?
                .titled(&format!("{title}, τ = {tau}"))
                .labelled("v_{R} [m/s]");
            panels.push(plot.coloured(colours));
        }
    }
    let [early_low, early_high] = extremes(&early)?;
    let [late_low, late_high] = extremes(&late)?;
    let realisations = scene.scan.realisations;
    let title = format!(
        "Radial velocity, positive away from the lidar; estimated: mean of {realisations} realisations"
    );
    let mut figure = Figure::stacked(panels).titled(&title);
    figure.columns = 2;
    figure.width = 1300.0;
    let table = Table::stack([map_table(&early)?, map_table(&late)?])?;
    let mut out = Rendered::new(&table, &figure, &late_study.plan.file.provenance())?;
    out.values = vec![wake.words()];
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

/// The least and the largest exact radial velocity.
fn extremes(map: &VelocityMap) -> Result<[f64; 2], Failure> {
    let field = map
        .field("v_exact")
        .ok_or_else(|| Failure::new("the map has no exact velocity".into()))?;
    Ok([f64::min, f64::max].map(|pick| field.values.iter().copied().fold(f64::NAN, pick)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sector_holds_a_box_about_each_vortex() {
        // The coarse wake: the late vortices are 1.2 spacings from the middle, the early ones 0.9 and lower.
        for (extent_m, reach_m) in [([-56.0, 57.0, 45.0], 23.5), ([-80.0, 75.0, 30.0], 30.0)] {
            let [low_m, high_m, top_m]: [f64; 3] = extent_m;
            let ([near_m, far_m], highest_rad) = sector(
                &[(400.0 + low_m, top_m), (400.0 + high_m, 0.5 * top_m)],
                reach_m,
            );
            for (y_m, z_m) in [low_m, high_m]
                .into_iter()
                .flat_map(|y_m| [(y_m, 0.5 * top_m), (y_m, top_m)])
            {
                for (dy, dz) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
                    let corner = (400.0 + y_m + dy * reach_m, (z_m + dz * reach_m).max(0.0));
                    let (range_m, elevation_rad) =
                        (corner.0.hypot(corner.1), corner.1.atan2(corner.0));
                    let slack = 1e-9;
                    assert!(
                        range_m > near_m - slack && range_m < far_m + slack,
                        "{corner:?}"
                    );
                    assert!(elevation_rad < highest_rad + slack, "{corner:?}");
                }
            }
        }
    }
}
