//! Cross-planes of a simulated flow as the wind of a scene: scaled to metres and seconds, and moved to their place.
//!
//! Check: a scanned map shows the flow as sampled from the planes, frozen and moving.

use crate::Error;
use crate::io::CrossPlanes;
use crate::io::planes_input::{files, read};
use crate::plan::wind::SceneWind;
use crate::scene::{SceneFile, SimulatedFlow};
use wakescope_les::winds::{Edges, PlaneMesh, Series, Side};
use wakescope_les::{Error as LesError, GridSnapshot};

/// Edges in the units and at the place of the scene.
fn edges(flow: &SimulatedFlow, edges: Edges, shift_m: f64) -> Edges {
    let length_m = flow.length_unit_m;
    let speed_m_s = flow.velocity_unit_m_s;
    let side = |side: Side| match side {
        Side::Open => Side::Open,
        Side::SlipWall { position_m } => Side::SlipWall {
            position_m: position_m * length_m + shift_m,
        },
        Side::NoSlipWall {
            position_m,
            velocity_m_s,
        } => Side::NoSlipWall {
            position_m: position_m * length_m + shift_m,
            velocity_m_s: velocity_m_s.map(|v| v * speed_m_s),
        },
    };
    match edges {
        Edges::Periodic { period_m } => Edges::Periodic {
            period_m: period_m * length_m,
        },
        Edges::Bounded { low, high } => Edges::Bounded {
            low: side(low),
            high: side(high),
        },
    }
}

/// The planes with their times in the units and at the place of the scene.
fn snapshots(
    flow: &SimulatedFlow,
    planes: &CrossPlanes,
) -> Result<Vec<(f64, GridSnapshot)>, LesError> {
    let length_m = flow.length_unit_m;
    let speed_m_s = flow.velocity_unit_m_s;
    let shift_y_m = flow.lateral_position_m;
    let mesh = PlaneMesh {
        y_m: planes
            .y_m
            .iter()
            .map(|y| y * length_m + shift_y_m)
            .collect(),
        z_m: planes.z_m.iter().map(|z| z * length_m).collect(),
        y_edges: edges(flow, planes.y_edges, shift_y_m),
        z_edges: edges(flow, planes.z_edges, 0.0),
    };
    let fields = planes.v_m_s.outer_iter().zip(planes.w_m_s.outer_iter());
    let snapshot = |(time, (v, w)): (
        &f64,
        (ndarray::ArrayView2<'_, f64>, ndarray::ArrayView2<'_, f64>),
    )| {
        let velocity_m_s: Vec<[f64; 3]> = v
            .iter()
            .zip(w)
            .map(|(v, w)| [0.0, v * speed_m_s, w * speed_m_s])
            .collect();
        Ok((
            time * length_m / speed_m_s,
            GridSnapshot::new(&mesh, &velocity_m_s)?,
        ))
    };
    planes.time_s.iter().zip(fields).map(snapshot).collect()
}

/// Reads the planes of a simulated flow.
pub(super) fn simulated(flow: &SimulatedFlow, file: &SceneFile) -> Result<SceneWind, Error> {
    let path = file.folder().join(&flow.planes);
    let of_key = Error::of_key("flow.planes");
    let refuse = |reason: String| Error::Input {
        path: path.clone(),
        reason,
    };
    let mut times = Vec::new();
    let mut all = Vec::new();
    for path in files(&path).map_err(of_key)? {
        let planes = read(&path).map_err(of_key)?;
        let of_file = |e: LesError| Error::Input {
            path: path.clone(),
            reason: e.to_string(),
        };
        let own = snapshots(flow, &planes).map_err(of_file)?;
        times.extend(
            planes
                .tau
                .iter()
                .zip(&own)
                .map(|(tau, (time_s, _))| [*tau, *time_s]),
        );
        all.extend(own);
    }
    let count = all.len();
    let series = Series::new(all).map_err(|e| refuse(format!("the times of the planes: {e}")))?;
    let (start_s, tau) = start(flow, &times).map_err(&refuse)?;
    let first_s = times[0][1];
    let last_s = times[count - 1][1];
    let source = format!(
        "{count} planes of {first_s:.4} to {last_s:.4} s from {}",
        path.display()
    );
    Ok(SceneWind {
        tau,
        ..SceneWind::of_files(Box::new(series), flow.motion, [start_s, last_s], source)
    })
}

/// Time \[s\] and age of the flow when the scan begins; `times` are [tau, s] of the planes.
fn start(flow: &SimulatedFlow, times: &[[f64; 2]]) -> Result<(f64, f64), String> {
    let (Some(first), Some(last)) = (times.first(), times.last()) else {
        return Err("no plane at all".into());
    };
    // What is given, its place beside that of what follows from it.
    let (given, [from, to]) = match (flow.time_s, flow.age_tau) {
        (Some(time_s), _) => (time_s, [1, 0]),
        (None, Some(tau)) => (tau, [0, 1]),
        (None, None) => return Ok((first[1], first[0])),
    };
    // Ages of files are rounded: the first and the last plane are meant.
    let low = first[from];
    let high = last[from];
    let clamped = given.clamp(low, high);
    let x = if (given - clamped).abs() <= 1e-9 * high.abs() {
        clamped
    } else {
        given
    };
    if !(low..=high).contains(&x) {
        return Err(match flow.time_s {
            Some(_) => format!("flow.time_s = {x:?}: the planes are from {low:?} to {high:?} s"),
            None => format!("flow.age_tau = {x:?}: the planes are from tau = {low:?} to {high:?}"),
        });
    }
    let at = times
        .partition_point(|t| t[from] <= x)
        .clamp(1, times.len().max(2) - 1)
        - 1;
    let here = times[at];
    let other = times.get(at + 1).map_or(here[to], |next| {
        let part = (x - here[from]) / (next[from] - here[from]);
        // Rounding must not lead beyond the last plane.
        (here[to] + part * (next[to] - here[to])).min(last[to])
    });
    Ok(if flow.time_s.is_some() {
        (x, other)
    } else {
        (other, x)
    })
}
