//! A scene with its instrument, geometry and wind.

use crate::Error;
use crate::plan::geometry::Geometry;
use crate::plan::instrument::Instrument;
use crate::plan::wind::SceneWind;
use crate::scene::{Flow, SceneFile};
use std::sync::Arc;

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
