//! Whole fields over time as the wind of a scene: read slice by slice, turned, moved to their place and carried by a mean wind.
//!
//! Check: a carried field is the field with a moved origin; a right-handed file with one vortex comes out unmirrored; a field off
//! the cross-plane is what it says.

use crate::Error;
use crate::beams::direction::sin_cos_of_turn;
use crate::io::fields_input::{FieldPlace, places, read};
use crate::io::planes_input::files;
use crate::plan::wind::SceneWind;
use crate::scene::{FieldFlow, FieldGround, SceneFile, SimulatedMotion};
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

/// A field in metres and seconds.
fn snapshot(field: &FieldPlace, flow: &FieldFlow) -> Result<VolumeSnapshot, Error> {
    let scaled = |c: VolumeComponent, unit: f64| VolumeComponent {
        nodes_m: c
            .nodes_m
            .map(|nodes| nodes.into_iter().map(|x| x * flow.length_unit_m).collect()),
        values: c.values.into_iter().map(|v| v * unit).collect(),
    };
    let (components, stated_m) = read(field, &flow.names)?;
    let components = components.map(|c| scaled(c, flow.velocity_unit_m_s));
    let refuse = |reason: String| Error::Input {
        path: field.path.clone(),
        reason,
    };
    // The period that the file states, or of evenly spaced nodes; faces and centres have the same.
    let along = |direction: usize, periodic: bool| -> Result<Edges, Error> {
        let nodes_m = &components[direction].nodes_m[direction];
        let (Some(first), Some(second), Some(last)) =
            (nodes_m.first(), nodes_m.get(1), nodes_m.last())
        else {
            return Err(refuse("a coordinate without values".into()));
        };
        if !periodic {
            return Ok(Edges::Bounded {
                low: Side::Open,
                high: Side::Open,
            });
        }
        if let Some(period_m) = stated_m[direction] {
            return Ok(Edges::Periodic {
                period_m: period_m * flow.length_unit_m,
            });
        }
        let step_m = second - first;
        if nodes_m
            .windows(2)
            .any(|pair| (pair[1] - pair[0] - step_m).abs() > EQUAL_STEPS * step_m)
        {
            let needed = "a periodic direction needs nodes at equal distances, or an attribute edges = \"periodic LENGTH\"";
            return Err(refuse(needed.into()));
        }
        Ok(Edges::Periodic {
            period_m: last - first + step_m,
        })
    };
    let low = match flow.ground {
        FieldGround::Open => Side::Open,
        FieldGround::NoSlip => Side::NoSlipWall {
            position_m: 0.0,
            velocity_m_s: [0.0; 3],
        },
        FieldGround::Slip => Side::SlipWall { position_m: 0.0 },
    };
    let edges = [
        along(0, flow.periodic_x)?,
        along(1, flow.periodic_y)?,
        Edges::Bounded {
            low,
            high: Side::Open,
        },
    ];
    VolumeSnapshot::new(&components, edges).map_err(|e| refuse(e.to_string()))
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
    for path in files(&path).map_err(of_key)? {
        all.extend(places(&path, &flow.names[0]).map_err(of_key)?);
    }
    // Files may count from dates of their own.
    let start = all.first().and_then(|field| field.reference);
    let later_s = |field: &FieldPlace| match (start, field.reference) {
        (Some(start), Some(own)) => own.seconds_since(start),
        _ => 0.0,
    };
    let times_s: Vec<f64> = all
        .iter()
        .map(|f| f.time_s * flow.length_unit_m / flow.velocity_unit_m_s + later_s(f))
        .collect();
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
    for (_, field) in all.iter().enumerate().filter(|(i, _)| used(*i)) {
        let snapshot = snapshot(field, flow).map_err(of_key)?;
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
        let field = all.get(i).ok_or(LesError::OutOfRange {
            field: "field",
            value: i as f64,
            allowed: "in the series",
        })?;
        let unreadable = |e: Error| LesError::File {
            action: "read",
            path: field.path.clone(),
            kind: std::io::ErrorKind::InvalidData,
            reason: e.to_string(),
        };
        snapshot(field, &own).map_err(unreadable)
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
