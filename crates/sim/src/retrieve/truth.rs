//! The vortices of the air that a scan saw: each where it was when the line of sight passed it.
//!
//! An analytic pair is known exactly. In a simulated flow the truth is that of the scanned plane at that time: the centroid of the
//! vorticity of the vortex's own sign within 0.15 of the spacing, and the circulation on circles of 5 to 15 m about it. Check: the
//! pair's own vortices, found in its wind as if that were simulated.

use crate::Error;
use crate::plan::Plan;
use crate::plan::wind::ScenePair;
use crate::scene::{Flow, VortexPair};
use wakescope_estimate::Measured;
use wakescope_estimate::retrieval::{Side, VortexResult};
use wakescope_estimate::vortex_fit::{Vortex, Wake};
use wakescope_les::analysis::mean_circulation_5_15_m2_s;

/// Distance of the points at which vorticity is looked for, m, first and about a centre.
const COARSE_M: f64 = 2.0;
const FINE_M: f64 = 0.5;
/// Points of a circle.
const CIRCLE: usize = 128;
/// Vorticity counts within this part of the spacing.
const REACH_OVER_SPACING: f64 = 0.15;
/// Most rounds to a centre or a time.
const ROUNDS: usize = 20;

/// A centre when the line of sight passes it.
#[derive(Debug, Clone, Copy)]
struct Passage {
    /// Its place (y, z), m.
    place_m: (f64, f64),
    time_s: f64,
    /// Where the plane of the line crosses it, m along the flight.
    x_m: f64,
}

/// A vortex with its circulation and the mean of that over 5 to 15 m, m^2/s; NaN for what cannot be known.
fn exact(
    side: Side,
    passage: Passage,
    [circulation, mean]: [f64; 2],
    core_m: Option<f64>,
) -> VortexResult {
    VortexResult {
        side,
        time_s: passage.time_s,
        circulation_m2_s: known(circulation),
        circulation_5_15_m2_s: known(mean),
        lateral_position_m: known(passage.place_m.0),
        height_m: known(passage.place_m.1),
        core_radius_m: core_m.map(known),
    }
}

fn known(value: f64) -> Measured {
    Measured { value, std: 0.0 }
}

/// A vortex that is not there, since the aircraft has not passed yet.
fn absent(side: Side, passage: Passage) -> VortexResult {
    let nowhere = Passage {
        place_m: (f64::NAN, f64::NAN),
        ..passage
    };
    exact(side, nowhere, [0.0, 0.0], None)
}

/// Whether the air has this vortex.
pub(crate) fn is_there(truth: &VortexResult) -> bool {
    truth.circulation_m2_s.value != 0.0
}

/// Both vortices of the air, left and right, as some lines pass them: exact numbers. In a simulated flow the circulation depends on
/// the radius, so that it and the core radius are not known. In a plane that the aircraft has not reached there is no vortex: its circulation is 0
/// and its place is not known.
///
/// # Errors
/// A simulated flow in which no vortices are found; what the wind refuses.
pub fn true_vortices(plan: &Plan, lines: &[usize]) -> Result<[VortexResult; 2], Error> {
    match &plan.scene().flow {
        Flow::VortexPair(pair) => Ok([
            of_pair(plan, lines, pair, Side::Left)?,
            of_pair(plan, lines, pair, Side::Right)?,
        ]),
        _ => Ok([
            simulated(plan, lines, Side::Left)?,
            simulated(plan, lines, Side::Right)?,
        ]),
    }
}

/// A vortex of an analytic pair.
fn of_pair(
    plan: &Plan,
    lines: &[usize],
    pair: &VortexPair,
    side: Side,
) -> Result<VortexResult, Error> {
    let passage = when_passed(plan, lines, |time_s, x_m| {
        let age_s = time_s + passed_since_s(pair, x_m);
        let vortex = vortex_of(plan.wind.pair.as_ref(), side, age_s)?;
        Ok((vortex.lateral_position_m, vortex.height_m))
    })?;
    let age_s = passage.time_s + passed_since_s(pair, passage.x_m);
    if pair.aircraft.is_some() && age_s < 0.0 {
        return Ok(absent(side, passage));
    }
    let vortex = vortex_of(plan.wind.pair.as_ref(), side, age_s)?;
    let circulation_m2_s = vortex.circulation_m2_s.abs();
    let mean_m2_s = circulation_m2_s * pair.profile.mean_5_15(pair.core_radius_m).0;
    Ok(exact(
        side,
        passage,
        [circulation_m2_s, mean_m2_s],
        Some(pair.core_radius_m),
    ))
}

/// How long before the start of the scan the aircraft passed a position along the flight, m, in s; 0 for a wake of one age everywhere.
fn passed_since_s(pair: &VortexPair, x_m: f64) -> f64 {
    match pair.aircraft {
        Some(aircraft) => (aircraft.x_m - x_m) / aircraft.speed_m_s,
        None => 0.0,
    }
}

/// A vortex of the analytic pair at an age, s; nowhere in a plan without one.
fn vortex_of(
    pair: Option<&ScenePair>,
    side: Side,
    age_s: f64,
) -> Result<wakescope_les::winds::Vortex, Error> {
    let Some(pair) = pair else {
        return Ok(wakescope_les::winds::Vortex {
            circulation_m2_s: 0.0,
            lateral_position_m: f64::NAN,
            height_m: f64::NAN,
        });
    };
    let [left, right] = pair.vortices(age_s)?;
    Ok(match side {
        Side::Left => left,
        Side::Right => right,
    })
}

/// Both vortices as a wake; nothing in a simulated flow.
pub(crate) fn true_wake(truth: &[VortexResult; 2]) -> Option<Wake> {
    let [left, right] = truth.each_ref().map(|v| Vortex {
        circulation_m2_s: v.circulation_m2_s.value,
        lateral_position_m: v.lateral_position_m.value,
        height_m: v.height_m.value,
        core_radius_m: v.core_radius_m.map_or(f64::NAN, |core| core.value),
    });
    let wake = Wake {
        left,
        right,
        lateral_wind_m_s: 0.0,
        wind_shear_per_s: 0.0,
        log_wind_m_s: 0.0,
    };
    wake.validate().is_ok().then_some(wake)
}

/// When one of some lines of sight passes a centre, which is a function of the time, s, and of the position along the flight, m: that line is
/// nearest in elevation, seen from where the lidar is then.
fn when_passed(
    plan: &Plan,
    lines: &[usize],
    centre: impl Fn(f64, f64) -> Result<(f64, f64), Error>,
) -> Result<Passage, Error> {
    let g = &plan.geometry;
    let times_s = lines.iter();
    let times_s = times_s.map(|line| plan.wind.start_s + g.line_time_s[*line]);
    let time_s = times_s.sum::<f64>() / lines.len().max(1) as f64;
    let x_m = plan.scene().scan.lidar.x_m;
    let mut passage = Passage {
        place_m: centre(time_s, x_m)?,
        time_s,
        x_m,
    };
    for _ in 0..ROUNDS {
        let off_rad = |line: usize| {
            let crossing = g.schedule.crossing(line, passage.place_m);
            (g.elevation_rad[line] - crossing.elevation_rad).abs()
        };
        let nearest = lines
            .iter()
            .copied()
            .min_by(|a, b| off_rad(*a).total_cmp(&off_rad(*b)));
        let Some(line) = nearest else { break };
        let time_s = plan.wind.start_s + g.line_time_s[line];
        let x_m = g.schedule.crossing(line, passage.place_m).x_m;
        if (time_s, x_m) == (passage.time_s, passage.x_m) {
            break;
        }
        passage = Passage {
            place_m: centre(time_s, x_m)?,
            time_s,
            x_m,
        };
    }
    Ok(passage)
}

fn simulated(plan: &Plan, lines: &[usize], side: Side) -> Result<VortexResult, Error> {
    let sense = if side == Side::Left { -1.0 } else { 1.0 };
    let first = lines.first().copied().unwrap_or(0);
    let passage = when_passed(plan, lines, |time_s, _| {
        let left = strongest(plan, first, time_s, -1.0)?;
        let right = strongest(plan, first, time_s, 1.0)?;
        let reach_m = REACH_OVER_SPACING * (left.0 - right.0).hypot(left.1 - right.1);
        let first_m = if side == Side::Left { left } else { right };
        centroid(plan, time_s, first_m, sense, reach_m)
    })?;
    let wind = plan.wind.without_eddies();
    let centre_m = [passage.place_m.0, passage.place_m.1];
    let mean_m2_s = mean_circulation_5_15_m2_s(wind, centre_m, passage.time_s, CIRCLE)?;
    Ok(exact(side, passage, [f64::NAN, sense * mean_m2_s], None))
}

/// A place (y, z), m, and the vorticity there, 1/s.
type PlaceAndVorticity = ((f64, f64), f64);

/// Vorticity at points `step_m` apart in a box, where the wind is known: place and value, 1/s.
fn vorticity(
    plan: &Plan,
    time_s: f64,
    (low_m, high_m): ((f64, f64), (f64, f64)),
    step_m: f64,
) -> Result<Vec<PlaceAndVorticity>, Error> {
    let columns = ((high_m.0 - low_m.0) / step_m).ceil().max(0.0) as usize + 1;
    let rows = ((high_m.1 - low_m.1) / step_m).ceil().max(0.0) as usize + 1;
    let mut points_m = Vec::with_capacity(columns * rows);
    for row in 0..rows {
        for column in 0..columns {
            let y_m = low_m.0 + column as f64 * step_m;
            points_m.push([0.0, y_m, low_m.1 + row as f64 * step_m]);
        }
    }
    let mut velocity_m_s = vec![[0.0; 3]; points_m.len()];
    plan.wind
        .without_eddies()
        .velocity_into(&points_m, time_s, &mut velocity_m_s)?;
    let mut known = Vec::new();
    for row in 1..rows.saturating_sub(1) {
        for column in 1..columns.saturating_sub(1) {
            let i = row * columns + column;
            let up = velocity_m_s[i + 1][2] - velocity_m_s[i - 1][2];
            let across = velocity_m_s[i + columns][1] - velocity_m_s[i - columns][1];
            let value = (up - across) / (2.0 * step_m);
            if value.is_finite() {
                let [_, y_m, z_m] = points_m[i];
                known.push(((y_m, z_m), value));
            }
        }
    }
    Ok(known)
}

/// The place of the scan with this first line where the vorticity of a sign is strongest.
fn strongest(plan: &Plan, first: usize, time_s: f64, sense: f64) -> Result<(f64, f64), Error> {
    let scan = &plan.scene().scan;
    let g = &plan.geometry;
    let top = g
        .elevation_rad
        .iter()
        .fold(0.0_f64, |top, e| top.max(*e))
        .min(std::f64::consts::FRAC_PI_2);
    let steepest = g
        .elevation_rad
        .iter()
        .fold(top, |most, e| most.max(e.abs()));
    let beam = g.schedule.middle(first);
    let ahead = g.schedule.ahead(&beam);
    let [near_m, far_m] = [scan.range_min_m * steepest.cos(), scan.range_max_m]
        .map(|range_m| ahead.at_range_m(beam.position_m, range_m)[1]);
    let sector = (
        (near_m.min(far_m), COARSE_M),
        (
            near_m.max(far_m),
            scan.lidar_height_m + scan.range_max_m * top.sin(),
        ),
    );
    let all = vorticity(plan, time_s, sector, COARSE_M)?;
    let best = all
        .into_iter()
        .max_by(|a, b| (sense * a.1).total_cmp(&(sense * b.1)))
        .filter(|(_, w)| sense * w > 0.0);
    best.map(|(place, _)| place).ok_or_else(|| Error::Input {
        path: "retrieval".into(),
        reason: format!("the simulated flow has no vortex in the scanned plane at {time_s} s: it must lie in the scan"),
    })
}

/// Centroid of the vorticity of a sign within `reach_m`, from a first place on.
fn centroid(
    plan: &Plan,
    time_s: f64,
    first_m: (f64, f64),
    sense: f64,
    reach_m: f64,
) -> Result<(f64, f64), Error> {
    let mut centre_m = first_m;
    for _ in 0..ROUNDS {
        let edge = reach_m + 2.0 * FINE_M;
        let around = (
            (centre_m.0 - edge, centre_m.1 - edge),
            (centre_m.0 + edge, centre_m.1 + edge),
        );
        let mut sum = 0.0;
        let mut y = 0.0;
        let mut z = 0.0;
        for ((at_y, at_z), value) in vorticity(plan, time_s, around, FINE_M)? {
            let near = (at_y - centre_m.0).hypot(at_z - centre_m.1) <= reach_m;
            let weight = if near { (sense * value).max(0.0) } else { 0.0 };
            sum += weight;
            y += weight * at_y;
            z += weight * at_z;
        }
        if sum <= 0.0 {
            break;
        }
        let next = (y / sum, z / sum);
        let step = (next.0 - centre_m.0).hypot(next.1 - centre_m.1);
        centre_m = next;
        if step < 1e-3 * reach_m {
            break;
        }
    }
    Ok(centre_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::Target;
    use crate::plan::wind::vortex_pair;
    use crate::scene::{Scene, SceneFile, SnrReference, VortexMotion};

    fn plan(change: impl FnOnce(&mut crate::scene::VortexPair)) -> Plan {
        let mut scene = Scene::default();
        scene.detector.snr = SnrReference::Fixed { snr_db: 0.0 };
        if let Flow::VortexPair(pair) = &mut scene.flow {
            change(pair);
        }
        Plan::new(SceneFile::new(scene).unwrap(), Target::Map).unwrap()
    }

    fn lines(plan: &Plan) -> Vec<usize> {
        (0..plan.geometry.elevation_rad.len()).collect()
    }

    #[test]
    fn vortices_of_a_pair_are_found_in_its_wind_as_if_that_were_simulated() {
        let plan = plan(|_| ());
        let truth = true_vortices(&plan, &lines(&plan)).unwrap();
        for (side, truth) in [Side::Left, Side::Right].into_iter().zip(truth) {
            let found = simulated(&plan, &lines(&plan), side).unwrap();
            let apart = |get: fn(&VortexResult) -> Measured| get(&found).value - get(&truth).value;
            let away = apart(|v| v.lateral_position_m).hypot(apart(|v| v.height_m));
            assert!(away < 0.3, "{found:?} {truth:?}");
            // the other vortex has no circulation within 15 m
            let ratio = found.circulation_5_15_m2_s.value / truth.circulation_5_15_m2_s.value;
            assert!((ratio - 1.0).abs() < 0.01, "{ratio}");
        }
    }

    #[test]
    fn before_the_aircraft_has_passed_there_is_no_vortex() {
        let behind = |x_m: f64| {
            plan(|pair| {
                pair.motion = VortexMotion::Inviscid;
                pair.aircraft = Some(crate::scene::Aircraft {
                    speed_m_s: 70.0,
                    x_m,
                })
            })
        };
        // The scan lasts 7.4 s: the aircraft comes after its end, in its middle and before its beginning.
        for (x_m, there) in [(-700.0, 0), (-70.0, 2), (70.0, 2)] {
            let plan = behind(x_m);
            let truth = true_vortices(&plan, &lines(&plan)).unwrap();
            assert_eq!(truth.iter().filter(|v| is_there(v)).count(), there, "{x_m}");
            assert_eq!(true_wake(&truth).is_some(), there == 2, "{x_m}");
            for vortex in truth.iter().filter(|v| !is_there(v)) {
                assert_eq!(vortex.circulation_5_15_m2_s.value, 0.0);
                assert!(vortex.lateral_position_m.value.is_nan());
            }
        }
    }

    /// A scan of the default pair at a distance, m, by a lidar with an azimuth, rad, a lateral position, m, and a velocity, m/s.
    fn seen_from(
        lateral_position_m: f64,
        azimuth_rad: f64,
        y_m: f64,
        velocity_m_s: [f64; 3],
    ) -> Plan {
        let mut scene = Scene::default();
        scene.detector.snr = SnrReference::Fixed { snr_db: 0.0 };
        scene.scan.azimuth_rad = azimuth_rad;
        scene.scan.lidar.flight_azimuth_rad = Some(0.0);
        scene.scan.lidar.y_m = y_m;
        scene.scan.lidar.velocity_m_s = velocity_m_s;
        if let Flow::VortexPair(pair) = &mut scene.flow {
            pair.lateral_position_m = lateral_position_m;
        }
        Plan::new(SceneFile::new(scene).unwrap(), Target::Map).unwrap()
    }

    #[test]
    fn the_line_that_passes_a_vortex_depends_on_where_the_lidar_is_and_looks() {
        let quarter_rad = std::f64::consts::FRAC_PI_2;
        for (pair_y_m, azimuth_rad, lidar_y_m, speed_m_s) in [
            (520.0, quarter_rad, 120.0, 0.0),
            (-400.0, 3.0 * quarter_rad, 0.0, 0.0),
            (280.0, 0.5 * quarter_rad, 0.0, 0.0),
            (400.0, quarter_rad, 0.0, -20.0),
        ] {
            let plan = seen_from(pair_y_m, azimuth_rad, lidar_y_m, [0.0, speed_m_s, 0.0]);
            for vortex in true_vortices(&plan, &lines(&plan)).unwrap() {
                let (y_m, z_m) = vortex.place_m();
                let lidar_m = lidar_y_m + speed_m_s * vortex.time_s;
                let distance_m = (y_m - lidar_m) / azimuth_rad.sin();
                let times_s = &plan.geometry.line_time_s;
                let line = times_s.iter().position(|time_s| *time_s == vortex.time_s);
                let off_rad = plan.geometry.elevation_rad[line.unwrap()] - z_m.atan2(distance_m);
                assert!(off_rad.abs() < 0.8e-3, "{azimuth_rad} {off_rad}");
            }
        }
    }

    #[test]
    fn in_an_oblique_plane_the_wake_has_the_age_of_the_place_where_it_is_crossed() {
        let mut scene = seen_from(280.0, std::f64::consts::FRAC_PI_4, 0.0, [0.0; 3])
            .scene()
            .clone();
        if let Flow::VortexPair(pair) = &mut scene.flow {
            pair.motion = VortexMotion::Inviscid;
            pair.aircraft = Some(crate::scene::Aircraft {
                speed_m_s: 70.0,
                x_m: 1400.0,
            });
        }
        let plan = Plan::new(SceneFile::new(scene).unwrap(), Target::Map).unwrap();
        let [left, right] = true_vortices(&plan, &lines(&plan)).unwrap();
        let pair = vortex_pair(plan.scene().flow.pair().unwrap());
        for (vortex, side) in [(left, 0), (right, 1)] {
            // At 45 degrees it is crossed as far along the flight as across it.
            let age_s = vortex.time_s + (1400.0 - vortex.lateral_position_m.value) / 70.0;
            let expected = pair.vortices(age_s)[side];
            let off_m = vortex.lateral_position_m.value - expected.lateral_position_m;
            assert!(off_m.abs() < 1e-6, "{off_m}");
            assert!((vortex.height_m.value - expected.height_m).abs() < 1e-6);
        }
    }

    #[test]
    fn vortices_are_found_in_simulated_wind_on_either_side_of_the_lidar() {
        let back_rad = 3.0 * std::f64::consts::FRAC_PI_2;
        let plan = seen_from(-400.0, back_rad, 0.0, [0.0; 3]);
        let truth = true_vortices(&plan, &lines(&plan)).unwrap();
        for (side, truth) in [Side::Left, Side::Right].into_iter().zip(truth) {
            let found = simulated(&plan, &lines(&plan), side).unwrap();
            let away_m = found.lateral_position_m.value - truth.lateral_position_m.value;
            assert!(away_m.abs() < 0.3, "{found:?} {truth:?}");
        }
    }

    #[test]
    fn a_pair_that_moves_is_where_it_is_when_the_line_passes() {
        let moving = plan(|pair| {
            pair.motion = VortexMotion::Inviscid;
            pair.age_tau = 0.5;
        });
        let [left, right] = true_vortices(&moving, &lines(&moving)).unwrap();
        let Flow::VortexPair(pair) = moving.scene().flow else {
            unreachable!()
        };
        let [at, _] = vortex_pair(&pair).vortices(left.time_s);
        assert_eq!(
            (left.lateral_position_m.value, left.height_m.value),
            (at.lateral_position_m, at.height_m)
        );
        let line = moving
            .geometry
            .line_time_s
            .iter()
            .position(|t| moving.wind.start_s + t == left.time_s)
            .unwrap();
        let elevation_rad = left.height_m.value.atan2(left.lateral_position_m.value);
        assert!((moving.geometry.elevation_rad[line] - elevation_rad).abs() < 1.25e-3);
        // the far one is lower in elevation, and so seen at another time
        assert!(left.time_s != right.time_s);
    }
}
