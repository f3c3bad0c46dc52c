//! What retrievals found, as rows and as JSON.
//!
//! Check: rows of no wake, one vortex and two.

use crate::Error;
use crate::io::Table;
use crate::io::scans::ReadScan;
use serde::Serialize;
use serde_json::{Value, json};
use wakescope_estimate::retrieval::{Measured, RetrievalOptions, ScanResult, VortexResult};

/// One scan with what was found in it.
#[derive(Debug, Clone, PartialEq)]
pub struct RetrievedScan {
    /// The scan.
    pub scan: ReadScan,
    /// How it was retrieved.
    pub options: RetrievalOptions,
    /// Its vortices, or none.
    pub result: ScanResult,
}

/// An error of the fits with the file that caused it.
pub(super) fn refused(scan: &ReadScan, error: &wakescope_estimate::Error) -> Error {
    Error::Input { path: scan.path.clone(), reason: format!("sweep {}: {error}", scan.sweep) }
}

/// A row for each vortex and scan; a scan without a wake has one row without a vortex.
pub fn rows(scans: &[RetrievedScan]) -> Table {
    let mut of: Vec<(usize, &RetrievedScan, Option<&VortexResult>)> = Vec::new();
    for (number, scan) in scans.iter().enumerate() {
        let none = scan.result.vortices.is_empty().then_some(None);
        of.extend(scan.result.vortices.iter().map(Some).chain(none).map(|vortex| (number + 1, scan, vortex)));
    }
    let text = |get: &dyn Fn(&RetrievedScan, Option<&VortexResult>) -> String| -> Vec<String> {
        of.iter().map(|(_, scan, vortex)| get(scan, *vortex)).collect()
    };
    let number = |get: &dyn Fn(&ScanResult, Option<&VortexResult>) -> f64| -> Vec<f64> {
        of.iter().map(|(_, scan, vortex)| get(&scan.result, *vortex)).collect()
    };
    let time =
        |result: &ScanResult, vortex: Option<&VortexResult>| vortex.map_or(result.reference_time_s, |v| v.time_s);
    let mut table = Table::new()
        .int("scan", of.iter().map(|(number, ..)| *number as i64))
        .text("file", text(&|scan, _| scan.scan.file_name()))
        .int("sweep", of.iter().map(|(_, scan, _)| scan.scan.sweep as i64))
        .float("time_s", number(&time))
        .text("side", text(&|_, vortex| vortex.map_or_else(|| "none".to_owned(), |v| name(v.side))));
    for (name, get) in VORTEX {
        let of = |vortex: Option<&VortexResult>| vortex.and_then(get).unwrap_or(UNKNOWN);
        table = table.float(name, number(&|_, v| of(v).value)).float(&with(name, "std"), number(&|_, v| of(v).std));
    }
    for (name, get) in WIND {
        table = table.float(name, number(&|r, _| get(r).value)).float(&with(name, "std"), number(&|r, _| get(r).std));
    }
    table
        .float("chi2_per_dof", number(&|result, _| result.chi2_per_dof))
        .int("cells_used", of.iter().map(|(_, scan, _)| scan.result.cells_used as i64))
        .int("cells_rejected", of.iter().map(|(_, scan, _)| scan.result.cells_rejected as i64))
        .float("statistic", number(&|result, _| result.statistic))
        .float("threshold", number(&|result, _| result.threshold))
        .text("flags", text(&|scan, _| flags(&scan.result)))
}

/// What is not known.
pub(super) const UNKNOWN: Measured = Measured { value: f64::NAN, std: f64::NAN };

pub(super) type OfVortex = (&'static str, fn(&VortexResult) -> Option<Measured>);

/// Columns of a vortex.
pub(super) const VORTEX: [OfVortex; 5] = [
    ("gamma_m2_s", |v| Some(v.circulation_m2_s)),
    ("gamma_5_15_m2_s", |v| Some(v.circulation_5_15_m2_s)),
    ("y_m", |v| Some(v.lateral_position_m)),
    ("z_m", |v| Some(v.height_m)),
    ("core_m", |v| v.core_radius_m),
];

type OfScan = (&'static str, fn(&ScanResult) -> Measured);

/// Columns of the wind.
const WIND: [OfScan; 2] = [("wind_m_s", |r| r.lateral_wind_m_s), ("shear_per_s", |r| r.wind_shear_per_s)];

/// `gamma_m2_s` to `gamma_std_m2_s`: the unit stays at the end.
pub(super) fn with(name: &str, word: &str) -> String {
    let unit = ["_m2_s", "_m_s", "_per_s", "_m"].into_iter().find(|unit| name.ends_with(unit)).unwrap_or_default();
    format!("{}_{word}{unit}", name.strip_suffix(unit).unwrap_or(name))
}

/// The name that files have for a side or a flag.
pub fn name(choice: impl Serialize) -> String {
    json!(choice).as_str().unwrap_or_default().to_owned()
}

/// Names of what is to be thought of a result.
pub fn flags(result: &ScanResult) -> String {
    result.flags.iter().map(name).collect::<Vec<_>>().join(" ")
}

/// Everything that was found, with covariances and competing tops.
pub fn json(scans: &[RetrievedScan]) -> serde_json::Value {
    // JSON has no NaN: what is not known is null.
    let wake = |values: [f64; 10]| -> Value {
        PARAMETER_NAMES.iter().zip(values).map(|(name, value)| ((*name).to_owned(), json!(value))).collect()
    };
    let of_vortex = |vortex: &VortexResult| -> Value {
        let mut object = json!({ "side": vortex.side, "time_s": vortex.time_s });
        for (name, get) in VORTEX {
            object[name] = json!(get(vortex));
        }
        object
    };
    let of_scan = |(number, scan): (usize, &RetrievedScan)| -> Value {
        let r = &scan.result;
        let rows: Vec<Vec<f64>> = r.covariance.outer_iter().map(|row| row.to_vec()).collect();
        json!({
            "scan": number + 1, "file": scan.scan.path.to_string_lossy(), "sweep": scan.scan.sweep, "reference_time_s": r.reference_time_s,
            "vortices": r.vortices.iter().map(of_vortex).collect::<Vec<_>>(),
            "wind_m_s": r.lateral_wind_m_s, "shear_per_s": r.wind_shear_per_s,
            "chi2_per_dof": r.chi2_per_dof, "cells_used": r.cells_used, "cells_rejected": r.cells_rejected,
            "statistic": r.statistic, "threshold": r.threshold, "flags": r.flags,
            "parameters": PARAMETER_NAMES, "wake": r.wake.map(|found| wake(found.to_array())), "covariance": rows,
            "secondary": scan.options.model.secondary.map(|both| both.map(|v| json!({
                "gamma_m2_s": v.circulation_m2_s, "y_m": v.lateral_position_m, "z_m": v.height_m, "core_m": v.core_radius_m,
            }))),
            "tops": r.tops.iter().map(|top| json!({ "wake": wake(top.wake.to_array()), "chi2": top.chi2 })).collect::<Vec<_>>(),
        })
    };
    Value::Array(scans.iter().enumerate().map(of_scan).collect())
}

/// Names of the parameters of a wake in their order.
const PARAMETER_NAMES: [&str; 10] = [
    "gamma_left_m2_s",
    "gamma_right_m2_s",
    "y_left_m",
    "z_left_m",
    "y_right_m",
    "z_right_m",
    "core_left_m",
    "core_right_m",
    "wind_m_s",
    "shear_per_s",
];
