//! Whether a plan fits the machine.
//!
//! Check: a scene that needs far more than the machine has is refused with keys that, made smaller, are accepted.

use super::sizes::Sizes;
use super::stage::{PlannedStage, largest_memory};
use super::stages::of_bound;
use super::{Plan, Target};
use crate::progress::Stage;
use crate::quantities::bytes;
use crate::scene::{Pattern, ScreenSampling, Turbulence};
use crate::{Error, machine};

/// Part of the memory that is available which a run may take.
const SHARE: f64 = 0.9;

impl Plan {
    /// Whether the memory of the forecast is there.
    ///
    /// # Errors
    /// [`Error::TooLarge`] for more than nine tenths of what the machine has available, with the keys on which it depends.
    pub fn fits(&self) -> Result<(), Error> {
        self.fits_in(machine::available_memory_bytes().unwrap_or(f64::INFINITY))
    }

    /// The same for a given amount of memory, bytes.
    ///
    /// # Errors
    /// As [`Plan::fits`].
    pub fn fits_in(&self, available_bytes: f64) -> Result<(), Error> {
        hold(&self.stages, available_bytes, |stage| self.smaller(stage))
    }

    /// What makes a stage smaller, by the keys that this scene has a use for.
    fn smaller(&self, stage: Stage) -> String {
        let scene = &self.scene.content;
        let lines = match scene.scan.pattern {
            Pattern::Rhi {} => "a larger scan.elevation_step_rad",
            Pattern::Ppi { .. } | Pattern::Axial { .. } => "a larger scan.pattern.azimuth_step_rad",
            _ => "fewer lines of sight",
        };
        let is_derived = matches!(scene.atmosphere.turbulence, Turbulence::Refractive(t) if t.sampling == ScreenSampling::Derived);
        match stage {
            Stage::PhaseScreens if is_derived => {
                "a smaller scan.range_max_m and outputs.profile_range_max_m".into()
            }
            Stage::PhaseScreens => "fewer atmosphere.turbulence.grid_points".into(),
            Stage::CrossPlane | Stage::Efficiency => {
                "fewer outputs.profile_points, or outputs.flow = false".into()
            }
            _ if self.kept_realisations() > 0 && self.target == Target::Run => {
                format!("outputs.signals = false, {lines} or fewer scan.pulses_per_line")
            }
            _ if self.kept_realisations() > 0 => format!("{lines} or fewer scan.pulses_per_line"),
            Stage::Estimates | Stage::Errors | Stage::Retrieval | Stage::Files => {
                format!("{lines}, estimator.gate_step_samples or estimator.window_step_samples")
            }
            _ => format!("{lines} or a smaller scan.range_max_m"),
        }
    }

    /// Whether the memory for the Cramer-Rao bound of the scene is there: matrices of a record's samples by as many.
    ///
    /// # Errors
    /// As [`Plan::fits`].
    pub fn bound_fits(&self) -> Result<(), Error> {
        self.bound_fits_in(machine::available_memory_bytes().unwrap_or(f64::INFINITY))
    }

    /// The same for a given amount of memory, bytes.
    ///
    /// # Errors
    /// As [`Plan::fits`].
    pub fn bound_fits_in(&self, available_bytes: f64) -> Result<(), Error> {
        let stages = of_bound(
            &self.stages,
            &Sizes::new(&self.scene.content, self.target, &self.geometry),
        );
        hold(&stages, available_bytes, |_| {
            "fewer estimator.window_samples".into()
        })
    }
}

/// Holds the memory of some stages against what is available; `smaller` says what makes a stage smaller.
fn hold(
    stages: &[PlannedStage],
    available_bytes: f64,
    smaller: impl Fn(Stage) -> String,
) -> Result<(), Error> {
    let (memory_bytes, largest) = largest_memory(stages);
    if memory_bytes <= SHARE * available_bytes {
        return Ok(());
    }
    let remedy = largest.map(smaller).unwrap_or_default();
    Err(Error::TooLarge {
        needed: bytes(memory_bytes),
        available: bytes(available_bytes),
        stage: largest.map_or("", Stage::name),
        remedy: format!("{remedy} would take less"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SceneFile;

    fn plan(text: &str) -> Plan {
        Plan::new(
            SceneFile::parse(text, std::path::Path::new("s.toml")).unwrap(),
            Target::Run,
        )
        .unwrap()
    }

    #[test]
    fn what_does_not_fit_is_refused_and_the_remedies_fit() {
        let text = "[scan]\nelevation_step_rad = 1.1e-5\nelevation_max_rad = 1.09\npulses_per_line = 1000000\n";
        let refused = plan(text).fits_in(2e10).unwrap_err().to_string();
        assert!(refused.contains("and 20.0 GB are available"), "{refused}");
        assert!(refused.contains("--allow-large"), "{refused}");
        assert!(
            refused.contains("a larger scan.elevation_step_rad"),
            "{refused}"
        );
        plan(&text.replace("1.1e-5", "1.1e-3"))
            .fits_in(2e10)
            .unwrap();
        // The keys are those of the pattern and of the sampling.
        let of = |text: &str| plan(text).fits_in(1e6).unwrap_err().to_string();
        let around = of("[scan.pattern]\nkind = \"ppi\"\n");
        assert!(
            around.contains("scan.pattern.azimuth_step_rad") && !around.contains("elevation_step"),
            "{around}"
        );
        let screens = "[scan]\nelevation_max_rad = 0.01\n[atmosphere.turbulence]\nkind = \"refractive\"\ncn2_m_m23 = 1e-14\nsampling = ";
        let derived = of(&format!("{screens}\"derived\"\n"));
        assert!(
            derived.contains("phase screens") && derived.contains("profile_range_max_m"),
            "{derived}"
        );
        let explicit = of(&format!(
            "{screens}\"explicit\"\ngrid_points = 1024\nlayers = 12\n"
        ));
        assert!(explicit.contains("grid_points"), "{explicit}");
    }

    #[test]
    fn pulses_along_a_line_cost_no_memory_unless_their_signals_are_kept() {
        let memory = |pulses: usize, more: &str| {
            plan(&format!(
                "[scan]\npulses_per_line = {pulses}\n[outputs]\nnetcdf = false\n{more}"
            ))
            .memory_bytes()
        };
        let (few, many) = (memory(100, ""), memory(1_000_000, ""));
        assert!(many < 1.01 * few && many < 2e8, "{few} {many}");
        // Signals are kept once, in double precision.
        let geometry = &plan("").geometry;
        let kept = 1e4 * (geometry.elevation_rad.len() * geometry.samples) as f64 * 8.0;
        let with_signals = memory(10_000, "signals = true\n");
        assert!(
            (kept..1.1 * kept).contains(&with_signals),
            "{with_signals} {kept}"
        );
    }

    #[test]
    fn a_single_gate_has_a_finite_forecast() {
        let plan = plan("[scan]\nelevation_max_rad = 0.0\nrange_max_m = 320.0\n");
        assert!(
            plan.core_s.is_finite() && plan.memory_bytes().is_finite(),
            "{} {:?}",
            plan.core_s,
            plan.memory_bytes()
        );
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
        assert!(
            refused.contains("needs 8.") && refused.contains("--allow-large"),
            "{refused}"
        );
        assert!(
            refused.contains("fewer estimator.window_samples"),
            "{refused}"
        );
        plan(&text("6500")).bound_fits_in(8e9).unwrap();
    }
}
