//! Whether a plan fits the machine, and what would.
//!
//! Check: a scene that needs far more than the machine has is refused with keys and values that, set, are accepted.

use super::stages::stages;
use super::units::bytes;
use super::{Cost, Plan, Stage};
use crate::measure::geometry::Geometry;
use crate::scene::{Scene, ScreenSampling, Turbulence};
use crate::{Error, machine};

/// Part of the memory that is available which a run may take.
const SHARE: f64 = 0.9;

/// So often a key may be halved before raw signals are better left out.
const FEW_HALVINGS: u32 = 3;

impl Plan {
    /// Whether the memory of the forecast is there.
    ///
    /// # Errors
    /// [`Error::TooLarge`] for more than nine tenths of what the machine has available, with keys that would make it fit.
    pub fn fits(&self) -> Result<(), Error> {
        machine::available_memory_bytes().map_or(Ok(()), |available_bytes| self.fits_in(available_bytes))
    }

    /// The same for a given amount of memory, bytes.
    ///
    /// # Errors
    /// As [`Plan::fits`].
    pub fn fits_in(&self, available_bytes: f64) -> Result<(), Error> {
        let Cost { memory_bytes, .. } = self.total();
        let room_bytes = SHARE * available_bytes;
        if memory_bytes <= room_bytes {
            return Ok(());
        }
        let mut scene = self.scene.scene.clone();
        let mut remedies = self.remedies(&scene, room_bytes);
        let mut before = "";
        if scene.outputs.signals && remedies.first().is_none_or(|(halvings, _)| *halvings > FEW_HALVINGS) {
            scene.outputs.signals = false;
            remedies = self.remedies(&scene, room_bytes);
            before = "outputs.signals = false with ";
        }
        let largest = self.stages.iter().filter_map(|s| Some((s.cost?.memory_bytes, s.stage.name())));
        Err(Error::TooLarge {
            needed: bytes(memory_bytes),
            available: bytes(available_bytes),
            stage: largest.max_by(|a, b| a.0.total_cmp(&b.0)).map_or("", |(_, name)| name),
            remedy: match remedies.is_empty() {
                true => "no single key makes it fit: make several smaller, such as scan.elevation_max_rad, \
                         scan.range_max_m and estimator.window_samples"
                    .into(),
                false => {
                    let texts: Vec<String> = remedies.into_iter().map(|(_, text)| text).collect();
                    format!("{before}{} would fit", texts.join(", or "))
                }
            },
        })
    }

    /// Up to three single keys, the smallest changes first, that make a scene fit.
    fn remedies(&self, scene: &Scene, room_bytes: f64) -> Vec<(u32, String)> {
        let memory = |scene: &Scene| self.memory_with(scene);
        let mut found: Vec<_> = REMEDIES.iter().filter_map(|r| r.found(scene, &memory, room_bytes)).collect();
        found.extend(self.smaller_screens(room_bytes));
        found.sort_by_key(|(halvings, _)| *halvings);
        found.truncate(3);
        found
    }
}

impl Plan {
    /// Forecast of the memory with another scan or estimator, bytes; `None` for a scene that cannot be planned. The optics
    /// stay as they are.
    fn memory_with(&self, scene: &Scene) -> Option<f64> {
        let geometry = Geometry::new(scene, &self.instrument.pulse, &self.wind).ok()?;
        let optics =
            [Stage::PhaseScreens, Stage::Efficiency].map(|stage| self.stages.iter().find(|s| s.stage == stage));
        let optics = [optics[0]?.clone(), optics[1]?.clone()];
        let planned = stages(scene, self.target, &geometry, &self.wind, optics);
        Some(planned.iter().filter_map(|s| s.cost).map(|c| c.memory_bytes).sum())
    }

    /// The grid whose screens fit: their memory goes with the square of the points along a side.
    fn smaller_screens(&self, room_bytes: f64) -> Option<(u32, String)> {
        let screens = self.stages.iter().find(|s| s.stage == Stage::PhaseScreens)?.cost?.memory_bytes;
        let Turbulence::Refractive(t) = self.scene.scene.atmosphere.turbulence else { return None };
        let others = self.total().memory_bytes - screens;
        let halvings = (1..=10).find(|k| others + screens * 0.25_f64.powi(*k) <= room_bytes)?;
        let points = t.grid_points >> halvings;
        (t.sampling == ScreenSampling::Explicit && points >= 16)
            .then(|| (halvings as u32, format!("atmosphere.turbulence.grid_points = {points}")))
    }
}

/// A key, and how half of what it costs is saved; `None` where there is nothing to halve.
struct Remedy {
    key: &'static str,
    halve: fn(&mut Scene) -> Option<String>,
}

impl Remedy {
    /// How often it must be halved until the scene fits, and the value then.
    fn found(
        &self,
        scene: &Scene,
        memory_bytes: &dyn Fn(&Scene) -> Option<f64>,
        room_bytes: f64,
    ) -> Option<(u32, String)> {
        let mut smaller = scene.clone();
        for halvings in 1..=24 {
            let value = (self.halve)(&mut smaller)?;
            if smaller.problems().is_empty() && memory_bytes(&smaller)? <= room_bytes {
                return Some((halvings, format!("{} = {value}", self.key)));
            }
        }
        None
    }
}

const REMEDIES: [Remedy; 6] = [
    Remedy { key: "outputs.signals", halve: |s| std::mem::take(&mut s.outputs.signals).then(|| "false".into()) },
    Remedy {
        key: "scan.elevation_step_rad",
        halve: |s| {
            s.scan.elevation_step_rad *= 2.0;
            Some(format!("{:e}", s.scan.elevation_step_rad))
        },
    },
    Remedy { key: "scan.pulses_per_line", halve: |s| halved(&mut s.scan.pulses_per_line) },
    Remedy { key: "estimator.window_step_samples", halve: |s| doubled(&mut s.estimator.window_step_samples) },
    Remedy { key: "estimator.gate_step_samples", halve: |s| doubled(&mut s.estimator.gate_step_samples) },
    Remedy {
        key: "scan.range_max_m",
        halve: |s| {
            s.scan.range_max_m = (0.5 * (s.scan.range_min_m + s.scan.range_max_m)).ceil();
            Some(format!("{:?}", s.scan.range_max_m))
        },
    },
];

fn halved(count: &mut usize) -> Option<String> {
    *count /= 2;
    (*count > 0).then(|| count.to_string())
}

fn doubled(count: &mut usize) -> Option<String> {
    *count *= 2;
    Some(count.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::Target;
    use crate::scene::SceneFile;

    fn plan(text: &str) -> Plan {
        Plan::new(SceneFile::parse(text, std::path::Path::new("s.toml")).unwrap(), Target::Run).unwrap()
    }

    #[test]
    fn what_does_not_fit_is_refused_and_the_remedies_fit() {
        let text = "[scan]\nelevation_step_rad = 1.1e-5\nelevation_max_rad = 1.09\npulses_per_line = 1000000\n";
        let refused = plan(text).fits_in(2e10).unwrap_err().to_string();
        assert!(refused.contains("and 20.0 GB are available"), "{refused}");
        assert!(refused.contains("--allow-large"), "{refused}");
        let step = refused.split("scan.elevation_step_rad = ").nth(1).unwrap().split(',').next().unwrap();
        let step = step.split_whitespace().next().unwrap();
        let smaller = text.replace("1.1e-5", step);
        plan(&smaller).fits_in(2e10).unwrap();
    }

    #[test]
    fn pulses_along_a_line_cost_no_memory_unless_their_signals_are_kept() {
        let memory = |pulses: usize, more: &str| {
            plan(&format!("[scan]\npulses_per_line = {pulses}\n[outputs]\nnetcdf = false\n{more}")).total().memory_bytes
        };
        let (few, many) = (memory(100, ""), memory(1_000_000, ""));
        assert!(many < 1.01 * few && many < 2e8, "{few} {many}");
        assert!(memory(10_000, "signals = true\n") > 1e10);
    }
}
