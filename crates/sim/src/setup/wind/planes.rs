//! Cross-planes of a simulated flow as the wind of a scene: scaled to metres and seconds, and moved to their place.
//!
//! Check: a scanned map shows the flow as sampled from the planes, frozen and moving.

use crate::Error;
use crate::io::CrossPlanes;
use crate::io::planes_input::{files, read};
use crate::scene::{SceneFile, SimulatedFlow};
use crate::setup::wind::SceneWind;
use wakescope_les::winds::{Edges, OutsidePolicy, PlaneMesh, Series, Side};
use wakescope_les::{Error as LesError, GridSnapshot};

/// From the units and the place of the flow to those of the scene.
struct Scale {
    length_m: f64,
    speed_m_s: f64,
    shift_y_m: f64,
}

impl Scale {
    fn edges(&self, edges: Edges, shift_m: f64) -> Edges {
        let side = |side: Side| match side {
            Side::Open => Side::Open,
            Side::SlipWall { position_m } => Side::SlipWall { position_m: position_m * self.length_m + shift_m },
            Side::NoSlipWall { position_m, velocity_m_s } => Side::NoSlipWall {
                position_m: position_m * self.length_m + shift_m,
                velocity_m_s: velocity_m_s.map(|v| v * self.speed_m_s),
            },
        };
        match edges {
            Edges::Periodic { period_m } => Edges::Periodic { period_m: period_m * self.length_m },
            Edges::Bounded { low, high } => Edges::Bounded { low: side(low), high: side(high) },
        }
    }

    fn snapshots(&self, planes: &CrossPlanes) -> Result<Vec<(f64, GridSnapshot)>, LesError> {
        let mesh = PlaneMesh {
            y_m: planes.y_m.iter().map(|y| y * self.length_m + self.shift_y_m).collect(),
            z_m: planes.z_m.iter().map(|z| z * self.length_m).collect(),
            y_edges: self.edges(planes.y_edges, self.shift_y_m),
            z_edges: self.edges(planes.z_edges, 0.0),
            outside: OutsidePolicy::Mask,
        };
        let fields = planes.v_m_s.outer_iter().zip(planes.w_m_s.outer_iter());
        let snapshot = |(time, (v, w)): (&f64, (ndarray::ArrayView2<'_, f64>, ndarray::ArrayView2<'_, f64>))| {
            let velocity_m_s: Vec<[f64; 3]> =
                v.iter().zip(w).map(|(v, w)| [0.0, v * self.speed_m_s, w * self.speed_m_s]).collect();
            Ok((time * self.length_m / self.speed_m_s, GridSnapshot::new(&mesh, &velocity_m_s)?))
        };
        planes.time_s.iter().zip(fields).map(snapshot).collect()
    }
}

/// Reads the planes of a simulated flow.
pub(super) fn simulated(flow: &SimulatedFlow, file: &SceneFile) -> Result<SceneWind, Error> {
    let scale =
        Scale { length_m: flow.length_unit_m, speed_m_s: flow.velocity_unit_m_s, shift_y_m: flow.lateral_position_m };
    let path = file.folder.join(&flow.planes);
    let of_key = Error::of_key("flow.planes");
    let refuse = |reason: String| Error::Input { path: path.clone(), reason };
    let (mut times, mut snapshots) = (Vec::new(), Vec::new());
    for path in files(&path).map_err(of_key)? {
        let planes = read(&path).map_err(of_key)?;
        let of_file = |e: LesError| Error::Input { path: path.clone(), reason: e.to_string() };
        snapshots.extend(scale.snapshots(&planes).map_err(of_file)?);
        times
            .extend(planes.tau.iter().zip(&planes.time_s).map(|(tau, t)| (*tau, t * scale.length_m / scale.speed_m_s)));
    }
    let count = snapshots.len();
    let series = Series::new(snapshots).map_err(|e| refuse(format!("the times of the planes: {e}")))?;
    let (start_s, tau) = start(flow, &times).map_err(&refuse)?;
    let (first_s, last_s) = (times[0].1, times[count - 1].1);
    let source = format!("{count} planes of {first_s:.4} to {last_s:.4} s from {}", path.display());
    Ok(SceneWind { tau, ..SceneWind::of_files(Box::new(series), flow.motion, [start_s, last_s], source) })
}

/// Time \[s\] and age of the flow when the scan begins; `times` are (tau, s) of the planes.
fn start(flow: &SimulatedFlow, times: &[(f64, f64)]) -> Result<(f64, f64), String> {
    let (Some(&first), Some(&last)) = (times.first(), times.last()) else {
        return Err("no plane at all".into());
    };
    let interpolated = |x: f64, from: fn(&(f64, f64)) -> f64, to: fn(&(f64, f64)) -> f64| {
        let at = times.partition_point(|t| from(t) <= x).clamp(1, times.len().max(2) - 1) - 1;
        match times.get(at + 1) {
            Some(next) => {
                let part = (x - from(&times[at])) / (from(next) - from(&times[at]));
                // Rounding must not lead beyond the last plane.
                (to(&times[at]) + part * (to(next) - to(&times[at]))).min(to(&last))
            }
            None => to(&times[at]),
        }
    };
    // Ages of files are rounded: the first and the last plane are meant.
    let within = |x: f64, from: f64, to: f64| {
        let clamped = x.clamp(from, to);
        if (x - clamped).abs() <= 1e-9 * to.abs() { clamped } else { x }
    };
    let time_s = flow.time_s.map(|time_s| within(time_s, first.1, last.1));
    match (time_s, flow.age_tau.map(|tau| within(tau, first.0, last.0))) {
        (Some(time_s), _) if (first.1..=last.1).contains(&time_s) => {
            Ok((time_s, interpolated(time_s, |t| t.1, |t| t.0)))
        }
        (Some(time_s), _) => {
            Err(format!("flow.time_s = {time_s:?}: the planes are from {:?} to {:?} s", first.1, last.1))
        }
        (None, Some(tau)) if (first.0..=last.0).contains(&tau) => Ok((interpolated(tau, |t| t.0, |t| t.1), tau)),
        (None, Some(tau)) => {
            Err(format!("flow.age_tau = {tau:?}: the planes are from tau = {:?} to {:?}", first.0, last.0))
        }
        (None, None) => Ok((first.1, first.0)),
    }
}
