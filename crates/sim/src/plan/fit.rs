//! Whether a plan fits the machine, and what would.
//!
//! Check: a scene that needs far more than the machine has is refused with keys and values that, set, are accepted.

use super::Plan;
use super::sizes::Sizes;
use super::stage::{Forecast, PlannedStage, total};
use super::stages::{of_bound, stages};
use super::units::bytes;
use crate::scene::{Scene, ScreenSampling, Turbulence};
use crate::setup::geometry::Geometry;
use crate::setup::progress::Stage;
use crate::{Error, machine};

/// Part of the memory that is available which a run may take.
const SHARE: f64 = 0.9;

/// So often a key may be halved before raw signals are better left out.
const FEW_HALVINGS: u32 = 3;

/// What is to be done with a plan.
#[derive(Clone, Copy)]
enum Work {
    Run,
    Bound,
}

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
        self.work_fits(Work::Run, available_bytes)
    }

    /// Whether the memory for the Cramer-Rao bound of the scene is there: matrices of a record's samples by as many.
    ///
    /// # Errors
    /// As [`Plan::fits`].
    pub fn bound_fits(&self) -> Result<(), Error> {
        machine::available_memory_bytes().map_or(Ok(()), |available_bytes| self.bound_fits_in(available_bytes))
    }

    /// The same for a given amount of memory, bytes.
    ///
    /// # Errors
    /// As [`Plan::fits`].
    pub fn bound_fits_in(&self, available_bytes: f64) -> Result<(), Error> {
        self.work_fits(Work::Bound, available_bytes)
    }

    fn work_fits(&self, work: Work, available_bytes: f64) -> Result<(), Error> {
        let Forecast { memory_bytes, largest, .. } = total(&self.stages_of(work));
        let room_bytes = SHARE * available_bytes;
        if memory_bytes <= room_bytes {
            return Ok(());
        }
        let mut scene = self.scene.scene.clone();
        let mut remedies = self.remedies(work, &scene, room_bytes);
        let mut before = "";
        if scene.outputs.signals && remedies.first().is_none_or(|(halvings, _)| *halvings > FEW_HALVINGS) {
            scene.outputs.signals = false;
            remedies = self.remedies(work, &scene, room_bytes);
            before = "outputs.signals = false with ";
        }
        Err(Error::TooLarge {
            needed: bytes(memory_bytes),
            available: bytes(available_bytes),
            stage: largest.map_or("", Stage::name),
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
    fn remedies(&self, work: Work, scene: &Scene, room_bytes: f64) -> Vec<(u32, String)> {
        let memory = |scene: &Scene| Some(total(&self.stages_with(work, scene)?).memory_bytes);
        let mut found: Vec<_> = REMEDIES.iter().filter_map(|r| r.found(scene, &memory, room_bytes)).collect();
        found.extend(self.smaller_screens(work, room_bytes));
        found.sort_by_key(|(halvings, _)| *halvings);
        found.truncate(3);
        found
    }

    fn stages_of(&self, work: Work) -> Vec<PlannedStage> {
        match work {
            Work::Run => self.stages.clone(),
            Work::Bound => of_bound(&self.stages, &self.sizes(&self.scene.scene, &self.geometry)),
        }
    }

    fn sizes(&self, scene: &Scene, geometry: &Geometry) -> Sizes {
        Sizes::new(scene, self.target, geometry)
    }

    /// The stages with another scan or estimator; `None` for a scene that cannot be planned. The optics stay as they are.
    fn stages_with(&self, work: Work, scene: &Scene) -> Option<Vec<PlannedStage>> {
        let mut file = self.scene.clone();
        file.scene = scene.clone();
        let geometry = Geometry::new(&file, &self.instrument.pulse, &self.wind).ok()?;
        let optics =
            [Stage::PhaseScreens, Stage::Efficiency].map(|stage| self.stages.iter().find(|s| s.stage == stage));
        let optics = [optics[0]?.clone(), optics[1]?.clone()];
        let planned = stages(scene, self.target, &geometry, &self.wind, optics);
        Some(match work {
            Work::Run => planned,
            Work::Bound => of_bound(&planned, &self.sizes(scene, &geometry)),
        })
    }

    /// The grid whose screens fit: their memory goes with the square of the points along a side.
    fn smaller_screens(&self, work: Work, room_bytes: f64) -> Option<(u32, String)> {
        let Turbulence::Refractive(t) = self.scene.scene.atmosphere.turbulence else { return None };
        let with = |halvings: i32| {
            let mut stages = self.stages_of(work);
            let screens = stages.iter_mut().find(|s| s.stage == Stage::PhaseScreens)?.cost.as_mut()?;
            screens.working_bytes *= 0.25_f64.powi(halvings);
            Some(total(&stages).memory_bytes)
        };
        let halvings = (1..=10).find(|k| with(*k).is_some_and(|bytes| bytes <= room_bytes))?;
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

const REMEDIES: [Remedy; 7] = [
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
    Remedy { key: "estimator.window_samples", halve: |s| halved(&mut s.estimator.window_samples) },
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
        // Signals are kept once, in double precision.
        let geometry = &plan("").geometry;
        let kept = 1e4 * (geometry.elevation_rad.len() * geometry.samples) as f64 * 8.0;
        let with_signals = memory(10_000, "signals = true\n");
        assert!((kept..1.1 * kept).contains(&with_signals), "{with_signals} {kept}");
    }

    #[test]
    fn a_single_gate_has_a_finite_forecast() {
        let total = plan("[scan]\nelevation_max_rad = 0.0\nrange_max_m = 320.0\n").total();
        assert!(total.core_s.is_finite() && total.memory_bytes.is_finite(), "{total:?}");
    }

    #[test]
    fn bound_of_windows_whose_matrices_do_not_fit_is_refused_and_the_remedy_fits() {
        let text = |window: &str| {
            format!(
                "[scan]\nrange_max_m = 9000.0\nelevation_max_rad = 0.01\n[estimator]\nwindow_samples = {window}\npadded_samples = 32768\n"
            )
        };
        let long = plan(&text("13000"));
        long.fits_in(8e9).unwrap();
        let refused = long.bound_fits_in(8e9).unwrap_err().to_string();
        // Some six matrices of 13 000 x 13 000 numbers.
        assert!(refused.contains("needs 8.") && refused.contains("--allow-large"), "{refused}");
        let window = refused.split("estimator.window_samples = ").nth(1).unwrap();
        plan(&text(window.split([',', ' ']).next().unwrap())).bound_fits_in(8e9).unwrap();
    }
}
