//! Whether a plan fits the machine.

use super::Plan;
use super::stage::{PlannedStage, largest_memory};
use crate::quantities::bytes;
use crate::{Error, machine};

/// Fraction of the available memory that a run may use.
const USABLE: f64 = 0.9;

impl Plan {
    /// Whether the memory of the forecast is available.
    ///
    /// # Errors
    /// Fails with [`Error::TooLarge`] for more than nine tenths of what the machine has available,
    /// with the keys that reduce it.
    pub fn fits(&self) -> Result<(), Error> {
        self.fits_in(machine::available_memory_bytes().unwrap_or(f64::INFINITY))
    }

    /// Whether the memory of the forecast is within a given amount, bytes.
    ///
    /// # Errors
    /// As [`Plan::fits`].
    pub fn fits_in(&self, available_bytes: f64) -> Result<(), Error> {
        refuse_too_large(&self.stages, available_bytes)
    }
}

/// Refuses stages that need more memory than is available, with the keys that reduce the largest.
pub(crate) fn refuse_too_large(stages: &[PlannedStage], available_bytes: f64) -> Result<(), Error> {
    let (memory_bytes, largest) = largest_memory(stages);
    let Some(largest) = largest.filter(|_| memory_bytes > USABLE * available_bytes) else {
        return Ok(());
    };
    Err(Error::TooLarge {
        needed: bytes(memory_bytes),
        available: bytes(available_bytes),
        stage: largest.stage.name(),
        remedy: format!("{} would take less", largest.remedy),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::Target;
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
        let few = memory(1000, "");
        let many = memory(1_000_000, "");
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
            plan.core_s().is_finite() && plan.memory_bytes().is_finite(),
            "{} {:?}",
            plan.core_s(),
            plan.memory_bytes()
        );
    }
}
