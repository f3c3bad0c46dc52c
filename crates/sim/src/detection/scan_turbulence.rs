//! The turbulence that was found in scans: columns, and everything as JSON.
//!
//! Check: retrievals and detections with and without it, in the tests of the program.

use crate::io::Table;
use serde_json::{Value, json};
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
