//! What the estimator of a scene may say.

use super::{CorrelogramForm, Method, PulseShape, RegionRadius, Scene};
use crate::keys::Checker;

/// Every limit of the estimator's keys, and those between them.
pub(super) fn check_estimator(scene: &Scene, c: &mut Checker<'_>) {
    let e = &scene.estimator;
    let mut beside_window =
        |key, value, word| c.compare([key, "estimator.window_samples"], [value, e.window_samples], word);
    beside_window("estimator.padded_samples", e.padded_samples, "at least");
    if let Method::LagWindow(own) = e.method {
        beside_window("estimator.method.lag_window_lags", own.lag_window_lags, "below");
    }
    if let Some(model) = e.method.order() {
        beside_window("estimator.method.order", model.order, "below");
    }
    if let RegionRadius::OfRange { range_m, radius_m } = &e.radius {
        c.require(
            radius_m.len() == range_m.len() && radius_m.iter().all(|r| (0.0..=1e5).contains(r)),
            "estimator.radius.radius_m",
            radius_m,
            "one number from 0 to 1e5 m for each of estimator.radius.range_m",
        );
    }
    c.require(
        e.method != (Method::Periodogram {}) || e.radius == (RegionRadius::Fixed {}),
        "estimator.method.kind",
        "periodogram",
        "another one with estimator.radius: \"periodogram\" has no region",
    );
    // Methods that exclude a knob.
    let likelihood = matches!(e.method, Method::Likelihood(_) | Method::GradientLikelihood(_));
    c.require(
        e.correlogram == CorrelogramForm::Biased || !(likelihood || matches!(e.method, Method::FirstMoment(_))),
        "estimator.correlogram",
        "unbiased",
        "\"biased\" with first_moment and the likelihoods, whose statistic has no unbiased form",
    );
    c.require(
        !(e.follow_wind && matches!(e.method, Method::GradientLikelihood(_) | Method::Periodogram {})),
        "estimator.follow_wind",
        e.follow_wind,
        "false with gradient_likelihood, which has the gradient itself, and with periodogram, which has no region",
    );
    c.require(
        !matches!(e.method, Method::GradientLikelihood(_))
            || (matches!(scene.pulse.shape, PulseShape::Gaussian(_)) && scene.pulse.chirp_hz_s == 0.0),
        "estimator.method.kind",
        "gradient_likelihood",
        "another one for a pulse that is sampled or has a chirp: its covariance is that of a Gaussian pulse",
    );
}

#[cfg(test)]
mod tests {
    use super::super::{FirstMoment, GradientLikelihood, LagWindow, Likelihood, ModelOrder};
    use super::*;
    use crate::scene::Estimator;

    fn keys(change: impl FnOnce(&mut Estimator)) -> Vec<String> {
        let mut scene = Scene::default();
        change(&mut scene.estimator);
        scene.problems().into_iter().map(|p| p.key).collect()
    }

    #[test]
    fn knobs_of_the_estimators_are_held_to_their_limits() {
        let own = |method| keys(|e| e.method = method);
        let order = ModelOrder { order: 64, ..ModelOrder::default() };
        assert_eq!(own(Method::Capon(order)), ["estimator.method.order"]);
        let lags = LagWindow { lag_window_lags: 64 };
        assert_eq!(own(Method::LagWindow(lags)), ["estimator.method.lag_window_lags"]);
        let reach = FirstMoment { moment_reach: f64::NAN };
        assert_eq!(own(Method::FirstMoment(reach)), ["estimator.method.moment_reach"]);
        let strong = Likelihood { likelihood_snr_db: Some(200.0) };
        assert_eq!(own(Method::Likelihood(strong)), ["estimator.method.likelihood_snr_db"]);
        let even = GradientLikelihood { gradients: 4, ..GradientLikelihood::default() };
        assert_eq!(own(Method::GradientLikelihood(even)), ["estimator.method.gradients"]);
        let with = |method, change: fn(&mut Estimator)| {
            keys(|e| {
                e.method = method;
                change(e);
            })
        };
        let gradient = Method::GradientLikelihood(GradientLikelihood::default());
        assert_eq!(with(gradient, |e| e.follow_wind = true), ["estimator.follow_wind"]);
        let moment = Method::FirstMoment(FirstMoment::default());
        assert_eq!(with(moment, |e| e.correlogram = CorrelogramForm::Unbiased), ["estimator.correlogram"]);
        let model = Method::Autoregressive(ModelOrder::default());
        assert_eq!(with(model, |e| e.false_alarm = 1.0), ["estimator.false_alarm"]);
        let table = |e: &mut Estimator| {
            e.radius = RegionRadius::OfRange { range_m: vec![300.0, 200.0], radius_m: vec![1.0, 2.0] };
        };
        assert_eq!(with(model, table), ["estimator.radius.range_m"]);
    }
}
