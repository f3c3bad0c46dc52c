//! The wind of a scene, made once for a run: analytic, or read from the cross-planes of a simulated flow.
//!
//! A simulated flow is scaled from its own units to metres and seconds and shifted to its place in front of the lidar; between
//! the nodes it is interpolated by (26), between the times linearly. Outside its mesh the velocity is NaN, which the scan
//! treats as the scene says. Check: a scanned map shows the flow as sampled from the planes, frozen and moving.

use crate::Error;
use crate::scene::{CoreProfile, Flow, Scene, SceneFile, VortexLines, VortexMotion, VortexPair};
use std::fmt;
use wakescope_les::{self as les, Wind};

/// The wind of a scene, with what the run needs to know of it.
pub struct SceneWind {
    wind: Box<dyn Wind>,
    /// Time of the flow when the scan begins, s.
    pub start_s: f64,
    /// Age of the wake then, in tau; 0 where there is no wake.
    pub tau: f64,
    /// Last time that the wind can be asked for, s; infinite if there is none.
    pub end_s: f64,
    /// A speed that no node of fields exceeds which are read when they are needed, m/s; 0 without such fields.
    pub(crate) max_speed_m_s: f64,
    /// Where the wind comes from, in words.
    pub source: String,
    /// Times of fields that are read when they are needed, s.
    field_times_s: Vec<f64>,
    /// Whether the air carries its backscatter somewhere.
    carries_backscatter: bool,
}

impl fmt::Debug for SceneWind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "SceneWind({} from {} s)", self.source, self.start_s)
    }
}

impl SceneWind {
    /// The wind of a checked scene; files are looked for relative to the folder of the scene.
    ///
    /// # Errors
    /// What the wind refuses; files that cannot be read, or do not hold the time that is asked for.
    pub fn new(file: &SceneFile) -> Result<Self, Error> {
        let mut whole = Self::of_flow(&file.scene.flow, file)?;
        for (i, flow) in file.scene.added_flows.iter().enumerate() {
            let added = Self::of_flow(flow, file)
                .map_err(|source| Error::OfAddedFlow { number: i, source: Box::new(source) })?;
            whole = whole.plus(added);
        }
        Ok(whole)
    }

    fn of_flow(flow: &Flow, file: &SceneFile) -> Result<Self, Error> {
        match flow {
            Flow::Simulated(flow) => simulated(flow, file),
            Flow::Fields(flow) => fields(flow, file),
            _ => Self::analytic(flow),
        }
    }

    /// Both winds, each from its own start.
    fn plus(self, other: Self) -> Self {
        let by_s = other.start_s - self.start_s;
        let later: Box<dyn Wind> = match by_s {
            0.0 => other.wind,
            _ => Box::new(Retimed { wind: other.wind, time_s: move |time_s| time_s + by_s }),
        };
        let mut field_times_s = self.field_times_s;
        field_times_s.extend(other.field_times_s.iter().map(|t| t - by_s));
        field_times_s.sort_by(f64::total_cmp);
        Self {
            wind: Box::new(les::winds::Sum { winds: vec![self.wind, later] }),
            end_s: self.end_s.min(other.end_s - by_s),
            max_speed_m_s: self.max_speed_m_s + other.max_speed_m_s,
            source: format!("{}; added: {}", self.source, other.source),
            field_times_s,
            carries_backscatter: self.carries_backscatter || other.carries_backscatter,
            ..self
        }
    }

    fn analytic(flow: &Flow) -> Result<Self, Error> {
        let tau = if let Flow::VortexPair(pair) = flow { pair.age_tau } else { 0.0 };
        Ok(Self { start_s: start_s(flow), tau, ..Self::of(analytic_wind(flow)?, "the flow is analytic".into()) })
    }

    /// A wind without an end.
    fn of(wind: Box<dyn Wind>, source: String) -> Self {
        Self {
            wind,
            start_s: 0.0,
            tau: 0.0,
            end_s: f64::INFINITY,
            max_speed_m_s: 0.0,
            source,
            field_times_s: Vec::new(),
            carries_backscatter: false,
        }
    }

    /// A flow of files that starts at one time and whose last one is known, s.
    fn of_files(wind: Box<dyn Wind>, motion: SimulatedMotion, [start_s, last_s]: [f64; 2], source: String) -> Self {
        match motion {
            SimulatedMotion::Moving => Self { start_s, end_s: last_s, ..Self::of(wind, source) },
            SimulatedMotion::Frozen => {
                Self { start_s, ..Self::of(Box::new(Retimed { wind, time_s: move |_| start_s }), source) }
            }
        }
    }

    /// Largest gradient of the radial velocity at times from the start of the scan, s; what lies beyond the end of the flow
    /// counts as its last time.
    pub fn max_gradient_per_s(&self, after_start_s: &[f64]) -> f64 {
        let at = |after_s: &f64| self.wind.max_gradient_per_s((self.start_s + after_s).min(self.end_s));
        after_start_s.iter().map(at).fold(self.wind.max_gradient_per_s(self.start_s), f64::max)
    }

    /// Which stretch of its times a time, s, lies in: between two fields that are in memory together.
    pub fn stretch_of(&self, time_s: f64) -> usize {
        self.field_times_s.partition_point(|t| *t <= time_s)
    }

    /// Whether the air carries its backscatter somewhere.
    pub(crate) fn carries_backscatter(&self) -> bool {
        self.carries_backscatter
    }

    /// Backscatter that the air carries at places, 1/(m sr), NaN where it carries none; nothing where no wind carries any.
    ///
    /// # Errors
    /// What the wind refuses.
    pub(crate) fn backscatter_per_m_sr(&self, points_m: &[[f64; 3]], time_s: f64) -> Result<Option<Vec<f64>>, Error> {
        if !self.carries_backscatter {
            return Ok(None);
        }
        let mut carried = vec![0.0; points_m.len()];
        self.wind.scalar_into(points_m, time_s, &mut carried)?;
        // (26) swings below zero beside the edge of a cloud.
        Ok(Some(carried.into_iter().map(|beta| if beta < 0.0 { 0.0 } else { beta }).collect()))
    }

    /// The wind itself.
    pub fn wind(&self) -> &dyn Wind {
        &*self.wind
    }
}

/// A wind that is asked for at other times.
struct Retimed<T> {
    wind: Box<dyn Wind>,
    time_s: T,
}

impl<T: Fn(f64) -> f64 + Send + Sync> Wind for Retimed<T> {
    fn velocity_into(&self, points_m: &[[f64; 3]], time_s: f64, out_m_s: &mut [[f64; 3]]) -> Result<(), les::Error> {
        self.wind.velocity_into(points_m, (self.time_s)(time_s), out_m_s)
    }

    fn max_gradient_per_s(&self, time_s: f64) -> f64 {
        self.wind.max_gradient_per_s((self.time_s)(time_s))
    }

    fn scalar_into(&self, points_m: &[[f64; 3]], time_s: f64, out: &mut [f64]) -> Result<(), les::Error> {
        self.wind.scalar_into(points_m, (self.time_s)(time_s), out)
    }
}

/// A flow that is analytic, and calm air for another.
///
/// # Errors
/// What the wind refuses; a checked scene gives none.
fn analytic_wind(flow: &Flow) -> Result<Box<dyn Wind>, Error> {
    Ok(match flow {
        Flow::Calm {} | Flow::Simulated(_) | Flow::Fields(_) => Box::<les::winds::Sum>::default(),
        Flow::Uniform { lateral_m_s, vertical_m_s } => {
            Box::new(les::winds::Linear::uniform([0.0, *lateral_m_s, *vertical_m_s])?)
        }
        Flow::Linear(wind) => {
            let linear = les::winds::Linear {
                velocity_m_s: wind.velocity_m_s,
                gradient_per_s: [wind.gradient_u_per_s, wind.gradient_v_per_s, wind.gradient_w_per_s],
                acceleration_m_s2: wind.acceleration_m_s2,
            };
            Box::new(linear.validated()?)
        }
        Flow::VortexLines(lines) => Box::new(vortex_lines(lines)?),
        Flow::VortexPair(pair) => {
            let vortices: Box<dyn Wind> = match pair.aircraft {
                Some(a) => Box::new(les::winds::AlongFlight::new(vortex_pair(pair), a.speed_m_s, a.x_m)?),
                None => Box::new(vortex_pair(pair).wind()?),
            };
            if pair.cross_wind_m_s == 0.0 {
                return Ok(vortices);
            }
            let cross = Box::new(les::winds::Linear::uniform([0.0, pair.cross_wind_m_s, 0.0])?);
            Box::new(les::winds::Sum { winds: vec![vortices, cross] })
        }
    })
}

/// The vortices of a scene.
///
/// # Errors
/// Nodes in one place.
pub(crate) fn vortex_lines(lines: &VortexLines) -> Result<les::winds::VortexLines, les::Error> {
    let line = |(nodes_m, circulation_m2_s): (&Vec<[f64; 3]>, &f64)| les::winds::VortexLine {
        nodes_m: nodes_m.clone(),
        endless: lines.endless,
        circulation_m2_s: *circulation_m2_s,
        core_radius_m: lines.core_radius_m,
        axial_deficit_m_s: lines.axial_deficit_m_s,
    };
    let ground = if lines.images { les::Ground::Image } else { les::Ground::None };
    les::winds::VortexLines::new(lines.nodes_m.iter().zip(&lines.circulation_m2_s).map(line).collect(), ground)
}

/// The vortex pair of a scene.
pub fn vortex_pair(pair: &VortexPair) -> les::VortexPair {
    les::VortexPair {
        circulation_m2_s: pair.circulation_m2_s,
        spacing_m: pair.spacing_m,
        core_radius_m: pair.core_radius_m,
        lateral_position_m: pair.lateral_position_m,
        height_m: pair.height_m,
        ground: les::Ground::Image,
        profile: circulation_profile(pair.profile),
        motion: match pair.motion {
            VortexMotion::Frozen => les::Motion::Frozen,
            VortexMotion::Inviscid => les::Motion::Inviscid,
        },
    }
}

/// The circulation profile of a scene or a flow case.
pub(crate) fn circulation_profile(profile: CoreProfile) -> les::CirculationProfile {
    match profile {
        CoreProfile::Algebraic => les::CirculationProfile::Algebraic,
        CoreProfile::LambOseen => les::CirculationProfile::LambOseen,
    }
}

/// Age of an analytic flow when the scan begins, s.
pub fn start_time_s(scene: &Scene) -> f64 {
    start_s(&scene.flow)
}

fn start_s(flow: &Flow) -> f64 {
    match flow {
        Flow::VortexPair(pair) if pair.age_tau > 0.0 && pair.circulation_m2_s > 0.0 => {
            vortex_pair(pair).time_s(pair.age_tau)
        }
        _ => 0.0,
    }
}

mod fields;
use {crate::scene::SimulatedMotion, fields::fields, planes::simulated};

mod planes {
    use crate::io::CrossPlanes;
    use crate::io::planes_input::{files, read};
    use crate::scene::SimulatedFlow;
    use crate::setup::wind::SceneWind;
    use crate::{Error, scene::SceneFile};
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
        let scale = Scale {
            length_m: flow.length_unit_m,
            speed_m_s: flow.velocity_unit_m_s,
            shift_y_m: flow.lateral_position_m,
        };
        let path = file.folder.join(&flow.planes);
        let of_key = Error::of_key("flow.planes");
        let refuse = |reason: String| Error::Input { path: path.clone(), reason };
        let (mut times, mut snapshots) = (Vec::new(), Vec::new());
        for path in files(&path).map_err(of_key)? {
            let planes = read(&path).map_err(of_key)?;
            let of_file = |e: LesError| Error::Input { path: path.clone(), reason: e.to_string() };
            snapshots.extend(scale.snapshots(&planes).map_err(of_file)?);
            times.extend(
                planes.tau.iter().zip(&planes.time_s).map(|(tau, t)| (*tau, t * scale.length_m / scale.speed_m_s)),
            );
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
}
