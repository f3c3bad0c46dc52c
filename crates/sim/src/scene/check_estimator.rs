//! What the estimator of a scene may say.

use super::{CorrelogramForm, Estimator, Method, PulseShape, RegionRadius, Scene};
use crate::keys::{Checker, Side};

/// Every limit of the estimator's keys, and those between them.
pub(super) fn check_estimator(scene: &Scene, c: &mut Checker<'_>) {
    let e = &scene.estimator;
    c.count("estimator.window_samples", e.window_samples, 4, 65_536);
    c.count("estimator.window_step_samples", e.window_step_samples, 1, 1_000_000);
    c.count("estimator.gate_step_samples", e.gate_step_samples, 1, 1_000_000);
    c.count("estimator.padded_samples", e.padded_samples, 1, 1 << 22);
    let window = e.window_samples;
    let beside_window = |key, value: usize, limit: &str| -> [Side<'_>; 2] {
        [
            (key, value.to_string(), format!("{limit} estimator.window_samples, {window}")),
            ("estimator.window_samples", window.to_string(), format!("{} {key}, {value}", other_side(limit))),
        ]
    };
    c.between(e.padded_samples >= window, &beside_window("estimator.padded_samples", e.padded_samples, "at least"));
    c.count("estimator.order", e.order, 1, 65_535);
    let order_fits = e.order < window || !uses_order(e.method);
    c.between(order_fits, &beside_window("estimator.order", e.order, "below"));
    c.count("estimator.lag_window_lags", e.lag_window_lags, 1, 65_535);
    let lags_fit = e.lag_window_lags < window || e.method != Method::LagWindow;
    c.between(lags_fit, &beside_window("estimator.lag_window_lags", e.lag_window_lags, "below"));
    c.within("estimator.moment_reach", e.moment_reach, 0.1, 100.0, "");
    if let Some(snr_db) = e.likelihood_snr_db {
        c.within("estimator.likelihood_snr_db", snr_db, -100.0, 100.0, "dB");
    }
    c.within("estimator.gradient_max_per_s", e.gradient_max_per_s, 1e-6, 1e3, "1/s");
    c.count("estimator.gradients", e.gradients, 1, 999);
    c.require(e.gradients % 2 == 1, "estimator.gradients", e.gradients, "an odd number, so that 0 is among them");
    let rate = e.false_alarm;
    let allowed = "0 for no test, or from 1e-12 to 0.5: the probability that noise passes at a gate, for example 0.01";
    c.require(rate == 0.0 || (1e-12..=0.5).contains(&rate), "estimator.false_alarm", rate, allowed);
    check_radius(e, c);
    check_combinations(scene, c);
}

/// What one key must be beside another, seen from the other.
fn other_side(limit: &str) -> &'static str {
    if limit == "below" { "above" } else { "at most" }
}

/// Whether a method fits a model of `order`.
fn uses_order(method: Method) -> bool {
    matches!(method, Method::Autoregressive | Method::AutoregressivePole | Method::Capon)
}

fn check_radius(e: &Estimator, c: &mut Checker<'_>) {
    match &e.radius {
        RegionRadius::Fixed {} => {
            c.within("estimator.radius_m", e.radius_m, 0.0, 1e5, "m");
        }
        RegionRadius::OfRange { range_m, radius_m } => {
            let increasing = range_m.windows(2).all(|r| r[1] > r[0]) && range_m.iter().all(|r| r.is_finite());
            c.require(
                !range_m.is_empty() && increasing,
                "estimator.radius.range_m",
                range_m,
                "at least one range, finite and increasing",
            );
            c.require(
                radius_m.len() == range_m.len() && radius_m.iter().all(|r| (0.0..=1e5).contains(r)),
                "estimator.radius.radius_m",
                radius_m,
                "one number from 0 to 1e5 m for each of estimator.radius.range_m",
            );
        }
        RegionRadius::Target { standard_deviation_m_s, largest_m } => {
            c.within("estimator.radius.standard_deviation_m_s", *standard_deviation_m_s, 1e-6, 1e3, "m/s");
            c.within("estimator.radius.largest_m", *largest_m, 1e-3, 1e5, "m");
        }
    }
    c.require(
        e.method != Method::Periodogram || e.radius == (RegionRadius::Fixed {}),
        "estimator.method",
        "periodogram",
        "another one with estimator.radius: \"periodogram\" has no region",
    );
}

/// Methods that exclude a knob.
fn check_combinations(scene: &Scene, c: &mut Checker<'_>) {
    let e = &scene.estimator;
    let likelihood = matches!(e.method, Method::Likelihood | Method::GradientLikelihood);
    c.require(
        e.correlogram == CorrelogramForm::Biased || !(likelihood || e.method == Method::FirstMoment),
        "estimator.correlogram",
        "unbiased",
        "\"biased\" with first_moment and the likelihoods, whose statistic has no unbiased form",
    );
    c.require(
        !(e.follow_wind && matches!(e.method, Method::GradientLikelihood | Method::Periodogram)),
        "estimator.follow_wind",
        e.follow_wind,
        "false with gradient_likelihood, which has the gradient itself, and with periodogram, which has no region",
    );
    c.require(
        e.method != Method::GradientLikelihood
            || (scene.pulse.shape == (PulseShape::Gaussian {}) && scene.pulse.chirp_hz_s == 0.0),
        "estimator.method",
        "gradient_likelihood",
        "another one for a pulse that is sampled or has a chirp: its covariance is that of a Gaussian pulse",
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keys(change: impl FnOnce(&mut Estimator)) -> Vec<String> {
        let mut scene = Scene::default();
        change(&mut scene.estimator);
        scene.problems().into_iter().map(|p| p.key).collect()
    }

    #[test]
    fn knobs_of_the_estimators_are_held_to_their_limits() {
        assert!(keys(|e| e.order = 64).is_empty(), "no model is fitted");
        let with = |method, change: fn(&mut Estimator)| {
            keys(|e| {
                e.method = method;
                change(e);
            })
        };
        assert_eq!(with(Method::Capon, |e| e.order = 64), ["estimator.order"]);
        assert_eq!(with(Method::LagWindow, |e| e.lag_window_lags = 64), ["estimator.lag_window_lags"]);
        assert_eq!(with(Method::FirstMoment, |e| e.moment_reach = f64::NAN), ["estimator.moment_reach"]);
        assert_eq!(with(Method::Likelihood, |e| e.likelihood_snr_db = Some(200.0)), ["estimator.likelihood_snr_db"]);
        assert_eq!(with(Method::GradientLikelihood, |e| e.gradients = 4), ["estimator.gradients"]);
        assert_eq!(with(Method::GradientLikelihood, |e| e.follow_wind = true), ["estimator.follow_wind"]);
        assert_eq!(with(Method::FirstMoment, |e| e.correlogram = CorrelogramForm::Unbiased), ["estimator.correlogram"]);
        assert_eq!(with(Method::Autoregressive, |e| e.false_alarm = 1.0), ["estimator.false_alarm"]);
        let table = |e: &mut Estimator| {
            e.radius = RegionRadius::OfRange { range_m: vec![300.0, 200.0], radius_m: vec![1.0, 2.0] };
        };
        assert_eq!(with(Method::Autoregressive, table), ["estimator.radius.range_m"]);
    }
}
