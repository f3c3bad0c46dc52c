//! The wind of a scene, made once for a run: analytic, or read from the cross-planes of a simulated flow.
//!
//! A simulated flow is scaled from its own units to metres and seconds and shifted to its place in front of the lidar; between
//! the nodes it is interpolated by (26), between the times linearly. Outside its mesh the velocity is NaN, which the scan
//! treats as the scene says. Check: a scanned map shows the flow as sampled from the planes, frozen and moving.

mod eddies;
mod fields;
mod pair;
mod planes;

pub(crate) use pair::{ScenePair, mean_winds};
pub use pair::{start_s, vortex_pair};

use crate::Error;
use crate::scene::{CoreProfile, Flow, SceneFile, SimulatedMotion};
use std::fmt;
use std::sync::Arc;
use wakescope_les::{self as les, Wind};

/// The wind of a scene, with what the run needs to know of it.
#[derive(Clone)]
pub struct SceneWind {
    /// Everything but the turbulence.
    steady: Arc<dyn Wind>,
    /// The whole wind.
    wind: Arc<dyn Wind>,
    has_eddies: bool,
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
    /// The analytic pair of `[flow]`, if there is one.
    pub(crate) pair: Option<ScenePair>,
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
        let mut whole = Self::of_flow(&file.content.flow, file)?;
        for (i, flow) in file.content.added_flows.iter().enumerate() {
            if matches!(flow, Flow::Eddies(_)) {
                continue;
            }
            let added = Self::of_flow(flow, file).map_err(|source| Error::OfAddedFlow {
                number: i,
                source: Box::new(source),
            })?;
            whole = whole.plus(added);
        }
        whole.with_eddies_of(file, 0)
    }

    /// The same wind with the turbulence of a realisation.
    ///
    /// # Errors
    /// What the turbulence refuses; a checked scene gives none.
    pub(crate) fn with_eddies_of(
        &self,
        file: &SceneFile,
        realisation: usize,
    ) -> Result<Self, Error> {
        let Some(eddies) = eddies::eddies(&file.content, realisation)? else {
            return Ok(self.clone());
        };
        let start_s = self.start_s;
        let later = Retimed {
            wind: Box::new(eddies),
            time_s: move |time_s| time_s - start_s,
        };
        Ok(Self {
            wind: summed(vec![Box::new(self.steady.clone()), Box::new(later)]),
            has_eddies: true,
            ..self.clone()
        })
    }

    fn of_flow(flow: &Flow, file: &SceneFile) -> Result<Self, Error> {
        match flow {
            Flow::Simulated(flow) => planes::simulated(flow, file),
            Flow::Fields(flow) => fields::fields(flow, file),
            Flow::VortexPair(pair) => {
                let found = ScenePair::new(pair, file)?;
                let vortices = found.wind(pair)?;
                let wind: Box<dyn Wind> = match pair.cross_wind_m_s {
                    0.0 => vortices,
                    lateral_m_s => {
                        let across = Box::new(uniform_wind(lateral_m_s, 0.0)?);
                        let sum: Vec<Box<dyn Wind>> = vec![vortices, across];
                        Box::new(sum)
                    }
                };
                let end_s = match pair.aircraft {
                    None => found.last_age_s(),
                    Some(_) => f64::INFINITY,
                };
                Ok(Self {
                    start_s: start_s(flow),
                    tau: pair.age_tau,
                    end_s,
                    pair: Some(found),
                    ..Self::of(wind, "the flow is analytic".into())
                })
            }
            _ => Ok(Self::of(
                analytic_wind(flow)?,
                "the flow is analytic".into(),
            )),
        }
    }

    /// Both winds, each from its own start.
    fn plus(self, other: Self) -> Self {
        let by_s = other.start_s - self.start_s;
        let later = Box::new(Retimed {
            wind: Box::new(other.steady),
            time_s: move |time_s| time_s + by_s,
        });
        let mut field_times_s = self.field_times_s;
        field_times_s.extend(other.field_times_s.iter().map(|t| t - by_s));
        field_times_s.sort_by(f64::total_cmp);
        let wind = summed(vec![Box::new(self.steady), later]);
        let source = if self.source == other.source {
            self.source
        } else {
            format!("{}; added: {}", self.source, other.source)
        };
        Self {
            steady: wind.clone(),
            wind,
            end_s: self.end_s.min(other.end_s - by_s),
            max_speed_m_s: self.max_speed_m_s + other.max_speed_m_s,
            source,
            field_times_s,
            ..self
        }
    }

    /// A wind without an end.
    fn of(wind: Box<dyn Wind>, source: String) -> Self {
        let wind: Arc<dyn Wind> = Arc::from(wind);
        Self {
            steady: wind.clone(),
            wind,
            has_eddies: false,
            start_s: 0.0,
            tau: 0.0,
            end_s: f64::INFINITY,
            max_speed_m_s: 0.0,
            source,
            field_times_s: Vec::new(),
            pair: None,
        }
    }

    /// A flow of files that starts at one time and whose last one is known, s.
    fn of_files(
        wind: Box<dyn Wind>,
        motion: SimulatedMotion,
        [start_s, last_s]: [f64; 2],
        source: String,
    ) -> Self {
        match motion {
            SimulatedMotion::Moving => Self {
                start_s,
                end_s: last_s,
                ..Self::of(wind, source)
            },
            SimulatedMotion::Frozen | SimulatedMotion::Carried => Self {
                start_s,
                ..Self::of(
                    Box::new(Retimed {
                        wind,
                        time_s: move |_| start_s,
                    }),
                    source,
                )
            },
        }
    }

    /// Largest gradient of the radial velocity at times from the start of the scan, s; what lies beyond the end of the flow
    /// counts as its last time.
    pub fn max_gradient_per_s(&self, after_start_s: &[f64]) -> f64 {
        let at = |after_s: &f64| {
            self.wind
                .max_gradient_per_s((self.start_s + after_s).min(self.end_s))
        };
        after_start_s
            .iter()
            .map(at)
            .fold(self.wind.max_gradient_per_s(self.start_s), f64::max)
    }

    /// Which stretch of its times a time, s, lies in: between two fields that are in memory together.
    pub fn stretch_of(&self, time_s: f64) -> usize {
        self.field_times_s.partition_point(|t| *t <= time_s)
    }

    /// The wind itself.
    pub fn wind(&self) -> &dyn Wind {
        &*self.wind
    }

    /// The wind without the turbulence of `"eddies"`.
    pub fn without_eddies(&self) -> &dyn Wind {
        &*self.steady
    }

    /// Whether there is turbulence, which is summed along lines.
    pub(crate) fn has_eddies(&self) -> bool {
        self.has_eddies
    }
}

/// A wind that is asked for at other times.
struct Retimed<T> {
    wind: Box<dyn Wind>,
    time_s: T,
}

impl<T: Fn(f64) -> f64 + Send + Sync> Wind for Retimed<T> {
    fn velocity_into(
        &self,
        points_m: &[[f64; 3]],
        time_s: f64,
        out_m_s: &mut [[f64; 3]],
    ) -> Result<(), les::Error> {
        self.wind
            .velocity_into(points_m, (self.time_s)(time_s), out_m_s)
    }

    fn along_line_into(
        &self,
        line: &les::winds::SampledLine,
        first: usize,
        time_s: f64,
        out_m_s: &mut [f64],
    ) -> Result<(), les::Error> {
        self.wind
            .along_line_into(line, first, (self.time_s)(time_s), out_m_s)
    }

    fn max_gradient_per_s(&self, time_s: f64) -> f64 {
        self.wind.max_gradient_per_s((self.time_s)(time_s))
    }
}

/// A flow that is analytic and no pair, and calm air for another.
///
/// # Errors
/// What the wind refuses; a checked scene gives none.
fn analytic_wind(flow: &Flow) -> Result<Box<dyn Wind>, Error> {
    Ok(match flow {
        // Turbulence is added to the sum of all other flows.
        Flow::Calm {}
        | Flow::Eddies(_)
        | Flow::VortexPair(_)
        | Flow::Simulated(_)
        | Flow::Fields(_) => Box::<Vec<Box<dyn Wind>>>::default(),
        Flow::Wind(wind) => Box::new(wind.simulated()?),
        Flow::Uniform {
            lateral_m_s,
            vertical_m_s,
        } => Box::new(uniform_wind(*lateral_m_s, *vertical_m_s)?),
        Flow::Linear(wind) => {
            let linear = les::winds::Linear {
                velocity_m_s: wind.velocity_m_s,
                gradient_per_s: [
                    wind.gradient_u_per_s,
                    wind.gradient_v_per_s,
                    wind.gradient_w_per_s,
                ],
                acceleration_m_s2: wind.acceleration_m_s2,
            };
            Box::new(linear.validated()?)
        }
    })
}

/// The same wind everywhere.
fn uniform_wind(lateral_m_s: f64, vertical_m_s: f64) -> Result<les::winds::Linear, Error> {
    Ok(les::winds::Linear::uniform([
        0.0,
        lateral_m_s,
        vertical_m_s,
    ])?)
}

/// The circulation profile of a scene or a flow case.
pub(crate) fn circulation_profile(profile: CoreProfile) -> les::CirculationProfile {
    match profile {
        CoreProfile::Algebraic => les::CirculationProfile::Algebraic,
        CoreProfile::LambOseen => les::CirculationProfile::LambOseen,
    }
}

/// The sum of winds.
fn summed(winds: Vec<Box<dyn Wind>>) -> Arc<dyn Wind> {
    Arc::new(winds)
}
