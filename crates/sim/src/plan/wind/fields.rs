//! Whole fields over time as the wind of a scene: read slice by slice, turned, moved to their place and carried by a mean wind.
//!
//! Check: a carried field is the field with a moved origin; a right-handed file with one vortex comes out unmirrored; a field off
//! the cross-plane is what it says.

use crate::Error;
use crate::beams::direction::sin_cos_of_turn;
use crate::io::fields_input::{places, read};
use crate::io::planes_input::files;
use crate::plan::wind::SceneWind;
use crate::scene::{FieldFlow, FieldGround, SceneFile, SimulatedMotion};
use std::path::Path;
use std::sync::Arc;
use wakescope_les::winds::{Edges, Series, Side, VolumeComponent, VolumeSnapshot};
use wakescope_les::{Error as LesError, Wind};

/// A wind in axes of its own.
struct Placed {
    wind: Arc<dyn Wind>,
    /// Position of the origin of the axes at `start_s`.
    origin_m: [f64; 3],
    /// Velocity of the origin along x and y.
    carried_m_s: [f64; 2],
    start_s: f64,
    sin: f64,
    cos: f64,
    /// -1 where y of the file points to the left.
    side: f64,
}

/// Steps of a periodic direction may differ by this fraction: axes of turbulence boxes are often 32-bit numbers.
const EQUAL_STEPS: f64 = 1e-3;

/// A node repeats the first one if it is one period further, to this fraction of a step.
const SAME_PLACE: f64 = 0.01;

/// Points that are turned at once.
const BATCH: usize = 256;

impl Placed {
    /// Position of the origin at a time: the hypothesis of Taylor (1938), (A8).
    fn origin_m(&self, time_s: f64) -> [f64; 3] {
        let [x, y, z] = self.origin_m;
        let [u, v] = self.carried_m_s;
        let later_s = time_s - self.start_s;
        [x + u * later_s, y + v * later_s, z]
    }

    /// A position of the scene in the axes of the file, whose origin is at `origin_m`.
    fn own_m(&self, [x, y, z]: &[f64; 3], origin_m: [f64; 3]) -> [f64; 3] {
        let (sin, cos, [x0, y0, z0]) = (self.sin, self.cos, origin_m);
        let x = x - x0;
        let y = y - y0;
        [cos * x + sin * y, self.side * (cos * y - sin * x), z - z0]
    }
}

impl Wind for Placed {
    fn velocity_into(
        &self,
        points_m: &[[f64; 3]],
        time_s: f64,
        out_m_s: &mut [[f64; 3]],
    ) -> Result<(), LesError> {
        let sin = self.sin;
        let cos = self.cos;
        let origin_m = self.origin_m(time_s);
        let mut turned = Vec::with_capacity(BATCH);
        for (points, outs) in points_m.chunks(BATCH).zip(out_m_s.chunks_mut(BATCH)) {
            turned.clear();
            turned.extend(points.iter().map(|point_m| self.own_m(point_m, origin_m)));
            self.wind.velocity_into(&turned, time_s, outs)?;
            for out in outs {
                let [u, v, w] = *out;
                let v = self.side * v;
                *out = [cos * u - sin * v, sin * u + cos * v, w];
            }
        }
        Ok(())
    }

    fn max_gradient_per_s(&self, time_s: f64) -> f64 {
        self.wind.max_gradient_per_s(time_s)
    }
}

/// The field at a place along the time of a file, in metres and seconds.
fn snapshot(path: &Path, place: Option<usize>, flow: &FieldFlow) -> Result<VolumeSnapshot, Error> {
    let scaled = |c: VolumeComponent, unit: f64| VolumeComponent {
        nodes_m: c
            .nodes_m
            .map(|nodes| nodes.into_iter().map(|x| x * flow.length_unit_m).collect()),
        values: c.values.into_iter().map(|v| v * unit).collect(),
    };
    let (components, stated_m) = read(path, place, &flow.names)?;
    let mut components = components.map(|c| scaled(c, flow.velocity_unit_m_s));
    let stated_m = stated_m.map(|stated| stated.map(|period_m| period_m * flow.length_unit_m));
    let refuse = |reason: String| Error::input(path, reason);
    let low = match flow.ground {
        FieldGround::Open => Side::Open,
        FieldGround::NoSlip => Side::NoSlipWall {
            position_m: 0.0,
            velocity_m_s: [0.0; 3],
        },
        FieldGround::Slip => Side::SlipWall { position_m: 0.0 },
    };
    let is_periodic = [flow.periodic_x, flow.periodic_y];
    let [along_x, along_y] =
        horizontal_edges(&mut components, is_periodic, stated_m).map_err(refuse)?;
    let along_z = Edges::Bounded {
        low,
        high: Side::Open,
    };
    let edges = [along_x, along_y, along_z];
    VolumeSnapshot::new(&components, edges).map_err(|e| refuse(e.to_string()))
}

/// The ends of the directions x and y, with the periods that a file states, if it does; last nodes that repeat the first ones of a
/// period are taken out of the components.
fn horizontal_edges(
    components: &mut [VolumeComponent; 3],
    is_periodic: [bool; 2],
    stated_m: [Option<f64>; 2],
) -> Result<[Edges; 2], String> {
    let mut edges = [Edges::Bounded {
        low: Side::Open,
        high: Side::Open,
    }; 2];
    for (direction, edges) in edges.iter_mut().enumerate() {
        if !is_periodic[direction] {
            continue;
        }
        let period_m = match stated_m[direction] {
            Some(stated_m) => stated_m,
            None => spaced_period_m(components, direction)?,
        };
        for component in components.iter_mut() {
            take_out_repeated(component, direction, period_m);
        }
        *edges = Edges::Periodic { period_m };
    }
    Ok(edges)
}

/// The period of evenly spaced nodes along a direction \[m\]: of the component with the fewest of them. Faces have one node more than
/// centres in files of WRF and CM1, where the last face is the first one again.
fn spaced_period_m(components: &[VolumeComponent; 3], direction: usize) -> Result<f64, String> {
    let mut nodes_m = &components[direction].nodes_m[direction];
    for component in components {
        let own_m = &component.nodes_m[direction];
        if own_m.len() < nodes_m.len() {
            nodes_m = own_m;
        }
    }
    let &[first_m, second_m, .., last_m] = &nodes_m[..] else {
        let count = nodes_m.len();
        return Err(format!(
            "a periodic direction has {count} nodes: at least 4 are needed"
        ));
    };
    let step_m = second_m - first_m;
    if nodes_m
        .windows(2)
        .any(|pair| (pair[1] - pair[0] - step_m).abs() > EQUAL_STEPS * step_m)
    {
        let needed = "a periodic direction needs nodes at equal distances, or an attribute edges = \"periodic LENGTH\"";
        return Err(needed.into());
    }
    Ok(last_m - first_m + step_m)
}

/// Takes the last node of a component along a direction out, with its values, where it is the first one again.
fn take_out_repeated(component: &mut VolumeComponent, direction: usize, period_m: f64) {
    let nodes_m = &component.nodes_m[direction];
    let count = nodes_m.len();
    let (Some(first_m), Some(last_m)) = (nodes_m.first(), nodes_m.last()) else {
        return;
    };
    let beyond_m = (last_m - first_m - period_m).abs();
    if beyond_m > SAME_PLACE * period_m / count as f64 {
        return;
    }
    let lengths = component.nodes_m[..direction].iter().map(Vec::len);
    let inner: usize = lengths.product();
    let mut at = 0;
    component.values.retain(|_| {
        let place = at / inner % count;
        at += 1;
        place + 1 != count
    });
    component.nodes_m[direction].pop();
}

/// Reads fields: their times, and once each for its gradient; the rest when it is needed.
pub(super) fn fields(flow: &FieldFlow, file: &SceneFile) -> Result<SceneWind, Error> {
    let path = file.folder().join(&flow.files);
    let of_key = Error::of_key("flow.files");
    let refuse = |reason: String| Error::Input {
        path: path.clone(),
        reason,
    };
    let mut all = Vec::new();
    let mut times_s = Vec::new();
    let mut start = None;
    for path in files(&path).map_err(of_key)? {
        let (of_file, reference) = places(&path, &flow.names[0]).map_err(of_key)?;
        if all.is_empty() {
            start = reference;
        }
        // Files may count from dates of their own.
        let later_s = match (start, reference) {
            (Some(start), Some(own)) => own.seconds_since(start),
            _ => 0.0,
        };
        for (place, time_s) in of_file {
            all.push((path.clone(), place));
            times_s.push(time_s * flow.length_unit_m / flow.velocity_unit_m_s + later_s);
        }
    }
    let (Some(&first_s), Some(&last_s)) = (times_s.first(), times_s.last()) else {
        return Err(refuse("no field at all".into()));
    };
    let start_s = flow.time_s.unwrap_or(first_s);
    if !(first_s..=last_s).contains(&start_s) {
        return Err(refuse(format!(
            "flow.time_s = {start_s:?}: the fields are from {first_s:?} to {last_s:?} s"
        )));
    }
    let mut steepest_per_s = 0.0_f64;
    let mut fastest_m_s = 0.0_f64;
    let ends_s = [
        start_s,
        if flow.motion == SimulatedMotion::Moving {
            last_s
        } else {
            start_s
        },
    ];
    let used = |i: usize| {
        let before = times_s.get(i + 1);
        let after = i.checked_sub(1).and_then(|i| times_s.get(i));
        before.is_none_or(|t| *t > ends_s[0]) && after.is_none_or(|t| *t < ends_s[1])
    };
    for (_, (path, place)) in all.iter().enumerate().filter(|(i, _)| used(*i)) {
        let snapshot = snapshot(path, *place, flow).map_err(of_key)?;
        steepest_per_s = steepest_per_s.max(snapshot.max_gradient_per_s(0.0));
        fastest_m_s = fastest_m_s.max(snapshot.max_speed_m_s());
    }
    let source = format!(
        "{} fields of {first_s:.4} to {last_s:.4} s from {}",
        all.len(),
        path.display()
    );
    let own = flow.clone();
    let reader = move |i: usize| {
        let (path, place) = all.get(i).ok_or(LesError::OutOfRange {
            field: "field",
            value: i as f64,
            allowed: "in the series",
        })?;
        let unreadable = |e: Error| LesError::File {
            action: "read",
            path: path.clone(),
            kind: std::io::ErrorKind::InvalidData,
            reason: e.to_string(),
        };
        snapshot(path, *place, &own).map_err(unreadable)
    };
    let series = Series::read(times_s.clone(), steepest_per_s, reader)
        .map_err(|e| refuse(format!("the times of the fields: {e}")))?;
    let found = SceneWind::of_files(Box::new(series), flow.motion, [start_s, last_s], source);
    let (sin, cos) = sin_cos_of_turn(flow.rotation_rad);
    let side = if flow.mirror_y { -1.0 } else { 1.0 };
    let plain = flow.origin_m == [0.0; 3]
        && (sin, cos) == (0.0, 1.0)
        && !flow.mirror_y
        && flow.carried_m_s == [0.0; 2];
    let wind: Arc<dyn Wind> = if plain {
        found.steady
    } else {
        Arc::new(Placed {
            wind: found.steady,
            origin_m: flow.origin_m,
            carried_m_s: flow.carried_m_s,
            start_s,
            sin,
            cos,
            side,
        })
    };
    Ok(SceneWind {
        steady: wind.clone(),
        wind,
        max_speed_m_s: fastest_m_s,
        field_times_s: if found.end_s.is_finite() {
            times_s
        } else {
            Vec::new()
        },
        ..found
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Length after which the wave of the tests repeats itself, m.
    const PERIOD_M: f64 = 80.0;

    fn wave(x_m: f64) -> f64 {
        (TAU * x_m / PERIOD_M).sin()
    }

    /// Nodes 10 m apart.
    fn nodes_m(first_m: f64, count: usize) -> Vec<f64> {
        (0..count).map(|i| first_m + 10.0 * i as f64).collect()
    }

    /// A component with these nodes along x and y whose values are a wave along one of them.
    fn component(xs_m: Vec<f64>, ys_m: Vec<f64>, direction: usize) -> VolumeComponent {
        let zs_m = nodes_m(5.0, 4);
        let mut values = Vec::new();
        for _ in &zs_m {
            for &y_m in &ys_m {
                values.extend(xs_m.iter().map(|&x_m| wave([x_m, y_m][direction])));
            }
        }
        VolumeComponent {
            nodes_m: [xs_m, ys_m, zs_m],
            values,
        }
    }

    /// The components u, v, w of a staggered mesh of 8 x 8 cells with 9 faces, the last of which are the first ones again.
    fn staggered(direction: usize) -> [VolumeComponent; 3] {
        [
            component(nodes_m(0.0, 9), nodes_m(5.0, 8), direction),
            component(nodes_m(5.0, 8), nodes_m(0.0, 9), direction),
            component(nodes_m(5.0, 8), nodes_m(5.0, 8), direction),
        ]
    }

    #[test]
    fn the_last_faces_of_a_periodic_direction_are_the_first_ones_again() {
        for direction in [0, 1] {
            for stated_m in [None, Some(PERIOD_M)] {
                let mut components = staggered(direction);
                let edges = horizontal_edges(&mut components, [true; 2], [stated_m; 2]).unwrap();
                let period = Edges::Periodic { period_m: PERIOD_M };
                assert_eq!(edges, [period; 2]);
                let along_z = Edges::Bounded {
                    low: Side::Open,
                    high: Side::Open,
                };
                let edges = [period, period, along_z];
                let wind = VolumeSnapshot::new(&components, edges).unwrap();
                // Nodes of faces, those at both ends of the last cell and of the third period among them.
                for place_m in [0.0, 70.0, 80.0, 250.0] {
                    let mut point_m = [35.0, 35.0, 20.0];
                    point_m[direction] = place_m;
                    let mut found_m_s = [[0.0; 3]];
                    wind.velocity_into(&[point_m], 0.0, &mut found_m_s).unwrap();
                    let found = found_m_s[0][direction];
                    let expected = wave(place_m);
                    assert!(
                        (found - expected).abs() < 1e-9,
                        "{place_m} m: {found} for {expected}"
                    );
                }
            }
        }
    }

    #[test]
    fn nodes_within_one_period_all_stay() {
        let mut components = [(); 3].map(|()| component(nodes_m(5.0, 8), nodes_m(5.0, 8), 0));
        let before = components.clone();
        let edges = horizontal_edges(&mut components, [true, false], [None; 2]).unwrap();
        assert_eq!(edges[0], Edges::Periodic { period_m: PERIOD_M });
        assert_eq!(components, before);
        let mut bounded = staggered(0);
        let edges = horizontal_edges(&mut bounded, [false; 2], [None; 2]).unwrap();
        assert!(matches!(edges[0], Edges::Bounded { .. }));
        assert_eq!(bounded, staggered(0));
    }

    #[test]
    fn uneven_nodes_need_a_stated_period() {
        let mut uneven = staggered(0);
        for component in &mut uneven {
            component.nodes_m[0][1] += 1.0;
        }
        let refused = horizontal_edges(&mut uneven, [true, false], [None; 2]).unwrap_err();
        assert!(refused.contains("equal distances"), "{refused}");
        assert!(horizontal_edges(&mut uneven, [true, false], [Some(PERIOD_M); 2]).is_ok());
    }
}
