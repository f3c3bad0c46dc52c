//! What retrievals of a scene gave, as text and as JSON.

use super::shown;
use crate::retrieve::SceneRetrieval;
use serde_json::{Value, json};
use wakescope_estimate::retrieval::Side;

fn word(side: Side) -> &'static str {
    if side == Side::Left { "left" } else { "right" }
}

/// A line for each method, vortex and quantity.
pub(super) fn text(retrieval: &SceneRetrieval) -> String {
    let mut out = String::from(
        "method   vortex quantity              truth       bias    +-error        std        rms     stated failures\n",
    );
    for e in retrieval.errors() {
        let numbers =
            [e.truth, e.bias.0, e.bias.1, e.std, e.rms, e.stated_std].map(|value| format!("{:>11}", shown(value)));
        out += &format!(
            "{:<8} {:<6} {:<16}{} {:>4} of {}\n",
            e.method.name(),
            word(e.side),
            e.quantity,
            numbers.concat(),
            e.failures,
            e.realisations
        );
    }
    if let Some(share) = retrieval.detected() {
        out += &format!("{:<44} {}\n", "share of scans in which the test finds a wake", shown(share));
    }
    out.trim_end().into()
}

pub(super) fn as_json(retrieval: &SceneRetrieval) -> Value {
    let errors: Vec<Value> = retrieval
        .errors()
        .iter()
        .map(|e| {
            json!({
                "method": e.method.name(), "side": word(e.side), "quantity": e.quantity, "truth": e.truth,
                "realisations": e.realisations, "failures": e.failures, "bias": e.bias.0,
                "bias_standard_error": e.bias.1, "std": e.std, "rms": e.rms, "stated_std": e.stated_std,
            })
        })
        .collect();
    json!({ "errors": errors, "detected": retrieval.detected() })
}
