//! How the pulses of a line are accumulated: record by record, or the sums of the products of their samples drawn at once.
//!
//! The draw has the distribution of the sums over records ([`wakescope_signal::AccumulatedProducts`]), but other random numbers. What
//! decides does not depend on the machine, the number of realisations or the estimator, so that a realisation has the same numbers in
//! a run, a sweep and a study of its accuracy.
//!
//! Check: forecasts of draws and records cross where benchmarks do (`cargo bench -p wakescope-signal -- products`).

use crate::plan::{Plan, Target};
use crate::scene::{Accumulation, RetrievalMethod};

/// Whether the products of all pulses of a line are drawn at once; else each pulse has a record.
pub(crate) fn draws_products(plan: &Plan) -> bool {
    !are_records_cheaper(plan) && reason_for_records(plan).is_none()
}

/// Why each pulse has a record although draws would be cheaper; `None` where they would not, or are made.
pub(crate) fn reason_against_draws(plan: &Plan) -> Option<String> {
    reason_for_records(plan).filter(|_| !are_records_cheaper(plan))
}

fn are_records_cheaper(plan: &Plan) -> bool {
    let pulses = plan.counts.records / plan.counts.lines;
    pulses * record_s(plan) < factor_s(plan) + draw_s(plan)
}

/// Why a plan needs the record of each pulse; `None` if it does not.
fn reason_for_records(plan: &Plan) -> Option<String> {
    let scene = plan.scene();
    if let Some(key) = scene.key_of_records() {
        return Some(format!("{key} acts on each"));
    }
    if !plan.target.has_map() || plan.kept_realisations() > 0 {
        return Some("they are written".into());
    }
    if plan.target == Target::Run && has_retrieval_of_signals(plan) {
        return Some("retrieval.methods fits them".into());
    }
    if scene.scan.accumulation == Accumulation::Records {
        return Some("scan.accumulation = \"records\"".into());
    }
    None
}

fn has_retrieval_of_signals(plan: &Plan) -> bool {
    let of_signals = [RetrievalMethod::Signals, RetrievalMethod::Envelope];
    let retrieval = plan.scene().retrieval.as_ref();
    retrieval.is_some_and(|r| of_signals.iter().any(|method| r.methods.contains(method)))
}

/// Lags of a window that its statistic has.
pub(crate) fn lags_per_window(plan: &Plan) -> usize {
    let e = &plan.scene().estimator;
    e.few_lags().unwrap_or(e.window_samples)
}

/// Time of one record, s of one core.
pub(crate) fn record_s(plan: &Plan) -> f64 {
    let n = &plan.counts;
    n.signal_layers * 5.4e-8 + n.samples * (n.layers_per_sample * 1.2e-10 + 5e-8)
}

/// Time to factor the covariance of the records of a line, s of one core.
pub(crate) fn factor_s(plan: &Plan) -> f64 {
    let n = &plan.counts;
    let g = &plan.geometry;
    // Samples that one layer contributes to, and the mean share of its layers that two of them have.
    let lit = n.layers_per_sample * g.signal_layer_thickness_m / g.sample_spacing_m;
    let near = n.samples.min(lit);
    let pairs = near * (1.0 - 0.5 * near / lit);
    let covariance_s = n.samples * n.layers_per_sample * (2.5e-8 + pairs * 3e-10);
    let cubic_s = if n.parts > 1.0 { 3.5e-10 } else { 8e-11 };
    covariance_s + n.samples.powi(2) * n.parts * 1e-8 + n.samples.powi(3) * cubic_s
}

/// Time to draw the products of a line, s of one core.
pub(crate) fn draw_s(plan: &Plan) -> f64 {
    let n = &plan.counts;
    let [square_s, cubic_s] = if n.parts > 1.0 {
        [2e-8, 2.4e-10]
    } else {
        [5e-9, 3.2e-11]
    };
    n.samples.powi(2) * square_s + n.samples.powi(3) * cubic_s
}

/// Memory of the factor of a line, bytes.
pub(crate) fn factor_bytes(plan: &Plan) -> f64 {
    let n = &plan.counts;
    n.samples.powi(2) * n.parts * 8.0
}
