//! How accurate the numbers of a scene or of a flow are, and the cheapest keys for an accuracy that is asked for.
//!
//! | module | what is in it |
//! |---|---|
//! | [`figures`] | the figures that a run writes, and their shifts between settings |
//! | [`keys`] | keys that trade error for time |
//! | [`ladder`] | values of a key from fine to coarse, verdicts, the choice |
//! | `search` | the search: what it plans, measures and spends; keys of the estimator, measured on maps |
//! | `screens` | keys of phase screens |
//! | `verify` | the choice as a whole; realisations |
//! | `flows` | meshes and steps of the case of a flow; the order of errors |
//! | `report`, `pictures` | the answer as text, table and scene; drawn |

pub mod figures;
mod flows;
pub mod keys;
pub mod ladder;
#[cfg(feature = "plots")]
mod pictures;
mod report;
mod screens;
mod search;
mod verify;

use crate::Error;
use crate::io::Provenance;
use crate::plan::Plan;
use crate::scene::{Pattern, SceneFile};
use crate::setup::efficiency_model::{drawn_turbulence, model};
use figures::{Figure, Shift};
use ladder::Ladder;
use wakescope_optics::plan::Model;

/// What is asked for.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "cli", derive(clap::Args))]
pub struct Request {
    /// Largest relative error of each figure, two standard errors included, such as 3%.
    #[cfg_attr(feature = "cli", arg(long, value_name = "PART", value_parser = part))]
    pub within: f64,
    /// Figures to be judged; all that a run of the scene writes without it, circulation where the scene has a retrieval.
    #[cfg_attr(
        feature = "cli",
        arg(long, value_name = "FIGURE,...", value_delimiter = ',', value_enum)
    )]
    pub of: Vec<Figure>,
    /// What the search may take, and a run that it proposes: so many times the scene's own run.
    #[cfg_attr(feature = "cli", arg(long, value_name = "RUNS", default_value = "10", value_parser = budget))]
    pub budget: f64,
}

impl Request {
    /// Of these figures, all where there are none, within a budget of ten runs.
    #[must_use]
    pub fn new(within: f64, of: &[Figure]) -> Self {
        Self {
            within,
            of: of.to_vec(),
            budget: 10.0,
        }
    }

    /// The figures that are judged, in the order of tables.
    ///
    /// # Errors
    /// One that the scene does not have.
    fn figures(&self, own: &Plan) -> Result<Vec<Figure>, Error> {
        let scene = &own.scene.content;
        let tells_winds = matches!(
            scene.scan.pattern,
            Pattern::Vad { .. } | Pattern::Dbs { .. }
        );
        let lacking = |figure: Figure| match figure {
            Figure::U | Figure::V | Figure::W if !tells_winds => {
                Some("is a wind of scan.pattern.kind = \"vad\" or \"dbs\" alone")
            }
            Figure::Height | Figure::Energy | Figure::Dissipation => {
                Some("is a figure of the case of a flow, and this is a scene")
            }
            Figure::Efficiency if drawn_turbulence(scene).is_some() => Some(
                "is one for each pulse with atmosphere.turbulence.efficiency = \"realisation\"; it has a mean to judge with \"mean\"",
            ),
            _ => None,
        };
        if let Some((figure, why)) = self
            .of
            .iter()
            .find_map(|figure| Some((figure, lacking(*figure)?)))
        {
            return Err(Error::Input {
                path: "--of".into(),
                reason: format!("{} {why}", figure.name()),
            });
        }
        let has = |figure: &Figure| match figure {
            Figure::Efficiency => model(scene) == Model::MonteCarlo,
            Figure::Circulation => scene.retrieval.is_some() || !self.of.is_empty(),
            _ => true,
        };
        let is_asked = |figure: &Figure| self.of.is_empty() || self.of.contains(figure);
        let is_judged =
            |figure: &Figure| lacking(*figure).is_none() && has(figure) && is_asked(figure);
        Ok(Figure::ALL.into_iter().filter(is_judged).collect())
    }
}

/// A relative error, such as 3% or 0.03.
#[cfg(feature = "cli")]
fn part(text: &str) -> Result<f64, String> {
    let number = match text.trim().strip_suffix('%') {
        Some(percent) => percent.trim().parse::<f64>().map(|percent| 0.01 * percent),
        None => text.trim().parse(),
    };
    let allowed = "from 0.001% to 50%, such as 3% or 0.03";
    number
        .ok()
        .filter(|part| (1e-5..=0.5).contains(part))
        .ok_or_else(|| allowed.into())
}

#[cfg(feature = "cli")]
fn budget(text: &str) -> Result<f64, String> {
    let number = text
        .trim()
        .parse::<f64>()
        .ok()
        .filter(|runs| (1.0..=1e6).contains(runs));
    number.ok_or_else(|| "from 1 to 1000000 runs of the scene".into())
}

/// What the noise of a figure asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// The figure.
    pub figure: Figure,
    /// The key of the realisations that average it.
    pub key: &'static str,
    /// Two standard errors over the value with the scene's own realisations.
    pub now: f64,
    /// Realisations that leave the target beside the keys.
    pub needed: f64,
    /// Forecast of a run with them, s of one core.
    pub forecast_s: f64,
    /// Error that a run for the whole budget has.
    pub of_budget: f64,
    /// Whether such a run is within the budget.
    pub is_reached: bool,
}

/// A figure with its predicted shift and the one that was found.
pub type Found = (Figure, f64, Shift);

/// The choice as a whole with another seed.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Verified {
    /// The seed.
    pub seed: u64,
    /// Predicted and found shift of each figure; none where nothing is coarser than the finest setting.
    pub rows: Vec<Found>,
    /// Whether all are within the target, two standard errors included.
    pub is_confirmed: bool,
}

/// What an answer is about: a scene, or the case of a flow.
pub trait Subject {
    /// In a word.
    const NAME: &'static str;
    /// Whether its figures are of random signals.
    const IS_NOISY: bool;

    /// What its files say of where they come from: all of its keys as TOML, its seed.
    fn provenance(&self) -> Provenance;
}

impl Subject for SceneFile {
    const NAME: &'static str = "scene";
    const IS_NOISY: bool = true;

    fn provenance(&self) -> Provenance {
        Self::provenance(self)
    }
}

/// The answer.
#[derive(Debug, Clone, PartialEq)]
pub struct Accuracy<S = SceneFile> {
    /// Hash of the scene or case.
    pub of_scene: String,
    /// Target, a relative error.
    pub within: f64,
    /// Forecast of its own run without pictures, s of one core.
    pub own_s: f64,
    /// Forecast of what the search did, s of one core.
    pub spent_s: f64,
    /// What it took, s.
    pub took_s: f64,
    /// The budget, s of one core.
    pub allowed_s: f64,
    /// Realisations of the pilot.
    pub pilot: usize,
    /// The figures that are judged.
    pub figures: Vec<Figure>,
    /// All keys with their values.
    pub ladders: Vec<Ladder>,
    /// Shift of figures of the map for that of the efficiency.
    pub response: Vec<(Figure, f64)>,
    /// What noise asks for.
    pub noises: Vec<Noise>,
    /// The choice as a whole.
    pub verified: Verified,
    /// What was not done, and why.
    pub notes: Vec<String>,
    /// The scene or case with the keys that are chosen.
    pub scene: S,
    /// Forecast of its run without pictures, s of one core.
    pub run_s: f64,
}

impl<S: Subject> Accuracy<S> {
    /// That of a scene or case, and its hash, before anything is looked at; forecasts of its own run and of what was done, s of one core.
    fn begun(
        (scene, hash): (S, &str),
        request: &Request,
        [own_s, spent_s]: [f64; 2],
        figures: Vec<Figure>,
    ) -> Self {
        Self {
            of_scene: hash.into(),
            within: request.within,
            own_s,
            spent_s,
            took_s: 0.0,
            allowed_s: request.budget * own_s,
            pilot: 0,
            figures,
            ladders: Vec::new(),
            response: Vec::new(),
            noises: Vec::new(),
            verified: Verified::default(),
            notes: Vec::new(),
            scene,
            run_s: own_s,
        }
    }

    /// Whether a run within the budget has every figure within the target.
    #[must_use]
    pub fn is_reached(&self) -> bool {
        let reached = |figure: &Figure| {
            self.noises
                .iter()
                .any(|noise| noise.figure == *figure && noise.is_reached)
        };
        self.verified.is_confirmed && (!S::IS_NOISY || self.figures.iter().all(reached))
    }
}
