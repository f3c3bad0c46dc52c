//! What is made of a scene before anything is planned or run: instrument, estimators, wind, the beams and their samples.
//!
//! | module | what is in it |
//! |---|---|
//! | [`instrument`], [`estimators`] | a scene in the words of the other crates |
//! | [`wind`], `air` | the wind: analytic, or the planes of a simulated flow; the wind along beams |
//! | [`beams`], `scan_lines` | when, from where and in which direction each pulse leaves |
//! | [`geometry`], `sizes` | lines of sight, samples, gates, layers; sizes that plan and run share |
//! | `efficiency_model` | the cheapest model of the efficiency that is valid, and the ranges at which it is computed |
//! | `region`, `ray_information` | the radius of regions; what a pulse tells of the velocity about a range |
//! | `described` | pulse and site as files carry them |
//! | `table`, `known` | tables of numbers and straight lines between them; what several scenes share |
//! | [`progress`], [`streams`] | stages of a run and who is told of them; one random stream for each pulse |

pub(crate) mod air;
pub mod beams;
pub(crate) mod described;
pub(crate) mod efficiency_model;
pub mod estimators;
pub mod geometry;
pub mod instrument;
pub(crate) mod known;
pub mod progress;
pub(crate) mod ray_information;
pub(crate) mod region;
pub(crate) mod scan_lines;
pub(crate) mod sizes;
pub mod streams;
pub(crate) mod table;
pub mod wind;

use crate::Error;
use crate::scene::{Flow, SceneFile};
use geometry::Geometry;
use instrument::Instrument;
use std::sync::Arc;
use wind::SceneWind;

/// A scene with what is made of it.
#[derive(Debug)]
pub struct Setup {
    /// The scene, checked.
    pub scene: SceneFile,
    /// The instrument and its air.
    pub instrument: Instrument,
    /// Sampling in angle, range and time.
    pub geometry: Geometry,
    /// The wind.
    pub wind: Arc<SceneWind>,
}

impl Setup {
    /// What is made of a scene with its wind, which others may share.
    ///
    /// # Errors
    /// What a crate refuses of the scene; a flow that ends before the scan.
    pub(crate) fn new(scene: SceneFile, wind: Arc<SceneWind>) -> Result<Self, Error> {
        let instrument = Instrument::new(&scene.content)?;
        let geometry = Geometry::new(&scene, &instrument.pulse, &wind)?;
        let setup = Self {
            scene,
            instrument,
            geometry,
            wind,
        };
        let (last_s, end_s) = (setup.scan_end_s(), setup.wind.end_s);
        if last_s > end_s {
            let (key, what) = match setup.scene.content.flow {
                Flow::Fields(_) => ("flow.files", "fields"),
                _ => ("flow.planes", "planes"),
            };
            let reason = format!(
                "the scan ends at {last_s:.3} s of the flow, the {what} at {end_s:.3} s: begin earlier, scan faster, or set \
                 flow.motion = \"frozen\""
            );
            return Err(Error::Key { key, reason });
        }
        Ok(setup)
    }

    /// Time of the last line from the start of the flow, s.
    pub fn scan_end_s(&self) -> f64 {
        self.wind.start_s + self.geometry.line_time_s.last().copied().unwrap_or(0.0)
    }
}
