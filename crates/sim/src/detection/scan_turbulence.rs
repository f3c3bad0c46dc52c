//! The turbulence that was found in scans: columns, and everything as JSON.
//!
//! Check: retrievals and detections with and without it, in the tests of the program.

use crate::io::Table;
use serde_json::{Value, json};
#[cfg(feature = "cli")]
use wakescope_estimate::retrieval::Gate;
use wakescope_estimate::retrieval::ScanTurbulence;
use wakescope_estimate::wind_profile::OUTER_SCALES_M;

type OfTurbulence = (&'static str, fn(&ScanTurbulence) -> f64);

/// Columns of the turbulence of a scan.
const TURBULENCE: [OfTurbulence; 4] = [
    ("edr_m23_s", |t| t.edr_m23_s()[0]),
    ("edr_low_m23_s", |t| t.edr_m23_s()[1]),
    ("edr_high_m23_s", |t| t.edr_m23_s()[2]),
    ("outer_scale_m", |t| t.outer_scale_m()),
];

/// A table with the turbulence of each row, if it was found in any.
pub(crate) fn with_turbulence(
    mut table: Table,
    rows: impl Iterator<Item = Option<ScanTurbulence>> + Clone,
) -> Table {
    if rows.clone().all(|row| row.is_none()) {
        return table;
    }
    for (name, get) in TURBULENCE {
        let numbers = rows.clone();
        table = table.float(name, numbers.map(|row| row.as_ref().map_or(f64::NAN, get)));
    }
    table
}

/// Distance of gates, over the standard deviation of their weight, below which the noise of neighbours is correlated by more than 0.7: speckle is by
/// exp(-d²/(4 w²)), w = 0.84 standard deviations.
#[cfg(feature = "cli")]
const SHARED: f64 = 1.0;

/// That noise which overlapping gates share counts as turbulence, if gates at those ranges \[m\] overlap.
#[cfg(feature = "cli")]
pub(crate) fn overlap_warning(range_m: &[f64], gate: &Gate) -> Option<String> {
    let mut step_m = f64::INFINITY;
    for pair in range_m.windows(2) {
        step_m = step_m.min(pair[1] - pair[0]);
    }
    let least_m = SHARED * gate.std_m();
    (step_m < least_m).then(|| {
        format!(
            "gates are {step_m:.1} m apart and overlap: noise that neighbours share counts as turbulence; choose a step of \
             {least_m:.0} m or more"
        )
    })
}

/// The turbulence of a scan in words.
#[cfg(feature = "cli")]
pub(crate) fn turbulence_text(turbulence: &ScanTurbulence) -> String {
    let [edr, low, high] = turbulence.edr_m23_s();
    let outer_scale_m = turbulence.outer_scale_m();
    format!("EDR {edr:.3} ({low:.3} to {high:.3}) m^(2/3)/s, outer scale {outer_scale_m:.0} m")
}

/// The turbulence of a scan, with the probabilities of outer scales.
pub(crate) fn turbulence_json(turbulence: &ScanTurbulence) -> Value {
    let mut object =
        json!({ "noise_std_m_s": turbulence.noise_std_m_s, "eps23_m43_s2": turbulence.eps23 });
    for (name, get) in TURBULENCE {
        object[name] = json!(get(turbulence));
    }
    let scales = OUTER_SCALES_M.iter();
    let scales = scales.zip(turbulence.outer_scale_probability);
    object["outer_scales"] = scales
        .map(|(scale_m, probability)| json!({ "outer_scale_m": scale_m, "probability": probability }))
        .collect();
    object
}

#[cfg(all(test, feature = "cli"))]
mod tests {
    use super::*;

    #[test]
    fn gates_that_overlap_are_named_with_their_step() {
        let gate = Gate::Gaussian { std_m: 14.36 };
        let ranges = |step_m: f64| -> Vec<f64> {
            let gates = 0..20;
            gates.map(|gate| 300.0 + step_m * f64::from(gate)).collect()
        };
        let text = overlap_warning(&ranges(5.0), &gate).unwrap();
        assert!(
            text.contains("5.0 m apart") && text.contains("step of 14 m"),
            "{text}"
        );
        assert_eq!(overlap_warning(&ranges(30.0), &gate), None);
        assert_eq!(overlap_warning(&ranges(5.0), &Gate::Point), None);
    }
}
