//! Keys that a scene states and that nothing reads, because another key chose a method that has no use for them.
//!
//! They are refused, so that nobody turns a knob that turns nothing. Keys that stand in the file of `wakescope init` may stay
//! there with their default.

use super::{Estimator, FrontEnd, HeadMotion, NoiseModel, Pattern, RefractiveTurbulence};
use super::{Problem, Scene, ScreenSampling, SnrReference, SpectrumKind, Turbulence};
use super::{RegionRadius, SignalsOf, VortexPair};
use crate::keys::{Text, lines_with_keys, to_table, value_at};
use toml::Value;

/// Keys of a scene without use: what each is for, and what the scene has instead.
fn idle(scene: &Scene) -> Vec<(&'static str, String)> {
    let method = &scene.estimator.method;
    let kind = format!("estimator.method.kind = \"{}\"", method.name());
    let mut found = Vec::new();
    let mut unused = |is_idle: bool, keys: &[&'static str], purpose: String| {
        if is_idle {
            found.extend(keys.iter().map(|key| (*key, purpose.clone())));
        }
    };
    for &(key, reason) in method.behaviour().unused_keys() {
        unused(true, &[key], format!("{kind} {reason}"));
    }
    let none = !scene.outputs.signals && scene.outputs.signals_of == SignalsOf::All;
    unused(
        none,
        &["outputs.signals_of"],
        "outputs.signals = false writes none".into(),
    );
    let untested = scene.estimator.false_alarm != Estimator::default().false_alarm;
    let without_noise = untested && scene.detector.noise == NoiseModel::None;
    unused(
        without_noise,
        &["estimator.false_alarm"],
        "detector.noise = \"none\" leaves nothing to test".into(),
    );
    let own_radius =
        scene.estimator.has_regions() && scene.estimator.radius != RegionRadius::Fixed {};
    unused(
        own_radius,
        &[Estimator::RADIUS],
        "this key is for estimator.radius.kind = \"fixed\"".into(),
    );
    let air = [
        "atmosphere.backscatter_per_m_sr",
        "atmosphere.extinction_per_m",
    ];
    unused(
        scene.atmosphere.profile.is_some(),
        &air,
        "atmosphere.profile takes its place".into(),
    );
    unused(
        scene.atmosphere.aerosol.is_some(),
        &air,
        "atmosphere.aerosol takes its place".into(),
    );
    let losses = ["telescope.optics_loss_db", "telescope.blind_range_m"];
    let fixed = matches!(scene.detector.snr, SnrReference::Fixed { .. });
    unused(
        fixed,
        &losses,
        "detector.snr.reference = \"fixed\" asks for no optics".into(),
    );
    if let Some(f) = &scene.detector.front_end {
        for (key, none, value) in [
            (
                "detector.front_end.load_temperature_k",
                "load_ohm",
                f.load_ohm,
            ),
            (
                "detector.front_end.rejection_db",
                "intensity_noise_db_hz",
                f.intensity_noise_db_hz,
            ),
            ("detector.front_end.poles", "half_power_hz", f.half_power_hz),
        ] {
            let purpose =
                format!("detector.front_end.{none} = {value} leaves nothing for it to act on");
            unused(value.is_infinite(), &[key], purpose);
        }
    }
    let scan = &scene.scan;
    let angles = format!(
        "scan.pattern.kind = \"{}\" has angles of its own",
        scan.pattern.name()
    );
    let rows = scan.pattern.has_scan_elevations();
    unused(
        !rows,
        &["scan.elevation_min_rad", "scan.elevation_max_rad"],
        angles.clone(),
    );
    unused(!rows, &["scan.elevation_step_rad"], angles.clone());
    unused(
        !scan.pattern.has_scan_azimuth(),
        &["scan.azimuth_rad"],
        angles,
    );
    let moves = scan.head.motion == HeadMotion::Continuous;
    let pace =
        "with scan.head.motion = \"continuous\" the rate and the pulses of a line set the step";
    unused(
        moves && scan.pattern == Pattern::Rhi {},
        &["scan.elevation_step_rad"],
        pace.into(),
    );
    unused(
        moves,
        &["scan.pattern.azimuth_step_rad", "scan.head.dead_time_s"],
        pace.into(),
    );
    if let Some(key) = scene.key_of_records() {
        let purpose = format!("{key} has every record simulated anyway");
        unused(true, &["scan.accumulation"], purpose);
    }
    if let Turbulence::Refractive(turbulence) = &scene.atmosphere.turbulence {
        const SCREENS: [&str; 3] = [
            "atmosphere.turbulence.grid_points",
            "atmosphere.turbulence.grid_spacing_m",
            "atmosphere.turbulence.layers",
        ];
        const SCALES: [&str; 2] = [
            "atmosphere.turbulence.inner_scale_m",
            "atmosphere.turbulence.outer_scale_m",
        ];
        unused(
            turbulence.profile.is_some(),
            &["atmosphere.turbulence.cn2_m_m23"],
            "atmosphere.turbulence.profile takes its place".into(),
        );
        let derived = turbulence.sampling == ScreenSampling::Derived;
        unused(
            derived,
            &SCREENS,
            "this key is for atmosphere.turbulence.sampling = \"explicit\"".into(),
        );
        unused(
            turbulence.spectrum == SpectrumKind::Kolmogorov,
            &SCALES,
            "atmosphere.turbulence.spectrum = \"kolmogorov\" has neither scale".into(),
        );
    }
    found
}

impl Scene {
    /// The scene with every default written out, as TOML; keys that it has no use for are left out.
    ///
    /// Equal scenes give equal text; the hash of it names the scene.
    pub fn to_toml(&self) -> String {
        let whole = toml::to_string(&to_table(self))
            .unwrap_or_else(|e| unreachable!("a scene is plain data: {e}"));
        let idle = idle(self);
        let kept =
            lines_with_keys(&whole).filter(|(key, _)| !idle.iter().any(|(idle, _)| idle == key));
        kept.map(|(_, line)| line.to_owned() + "\n").collect()
    }
}

/// Keys of transported pairs that a text states with their default for another motion; `check` refuses other values.
fn idle_transport(scene: &Scene, document: &Text<'_>) -> Vec<Problem> {
    let usual = VortexPair::default();
    let mut found = Vec::new();
    for (at, flow) in scene.flows() {
        let Some(pair) = flow.pair().filter(|pair| !pair.is_transported()) else {
            continue;
        };
        let keys = [
            ("decay", pair.decay == usual.decay, "\"two_phase\""),
            ("buoyancy_per_s", pair.buoyancy_per_s == 0.0, "0.0"),
            ("rebound", !pair.rebound, "false"),
            ("meander", !pair.meander, "false"),
        ];
        for (name, is_default, value) in keys {
            let key = format!("{at}.{name}");
            if is_default && document.line(&key).is_some() {
                let allowed = format!("absent without {at}.motion = \"transported\"");
                found.push(Problem::new(&key, value, allowed));
            }
        }
    }
    found
}

/// What a text states in vain.
pub(super) fn problems(scene: &Scene, document: &Text<'_>) -> Vec<Problem> {
    let mut idle = idle(scene);
    idle.retain(|(key, _)| document.line(key).is_some());
    let mut found = idle_transport(scene, document);
    if idle.is_empty() {
        return found;
    }
    let mut usual = Scene::default();
    usual.detector.front_end = Some(FrontEnd::default());
    usual.atmosphere.turbulence = Turbulence::Refractive(RefractiveTurbulence::default());
    let own = Value::Table(to_table(scene));
    let usual = Value::Table(to_table(&usual));
    idle.retain(|(key, _)| value_at(&own, key) != value_at(&usual, key));
    let problem = |(key, purpose): (&str, String)| {
        let value = value_at(&own, key)
            .map(|value| value.to_string())
            .unwrap_or_default();
        Problem::new(key, value, format!("{purpose}: take the line out"))
    };
    found.extend(idle.into_iter().map(problem));
    found
}

#[cfg(test)]
mod tests {
    use super::super::SceneFile;
    use std::path::Path;

    fn parse(text: &str) -> Result<SceneFile, String> {
        SceneFile::parse(text, Path::new("s.toml")).map_err(|e| e.to_string())
    }

    #[test]
    fn a_key_of_another_method_is_refused_and_says_what_it_is_for() {
        assert_eq!(
            parse("[estimator.method]\nkind = \"periodogram\"\norder = 8\n").unwrap_err(),
            "s.toml:3: estimator.method.order = 8 is not allowed: this key is for estimator.method.kind = \
             \"autoregressive\", and estimator.method.kind is \"periodogram\""
        );
        for (text, key) in [
            (
                "[estimator.method]\norder = 16\n",
                "estimator.method.order = 16",
            ),
            (
                "[estimator.method]\nkind = \"autoregressive\"\nmoment_reach = 2.0\n",
                "estimator.method.moment_reach = 2.0",
            ),
            (
                "[estimator.method]\nlikelihood_snr_db = 3\n",
                "estimator.method.likelihood_snr_db = 3",
            ),
            (
                "[estimator]\nmethod.kind = \"periodogram\"\nradius_m = 5.0\n",
                "estimator.radius_m = 5.0",
            ),
            (
                "[estimator]\nmethod.kind = \"likelihood\"\nweighting = \"hann\"\n",
                "estimator.weighting = \"hann\"",
            ),
            (
                "[estimator]\nmethod.kind = \"pulse_pair\"\nrefinement = \"none\"\n",
                "estimator.refinement = \"none\"",
            ),
            (
                "[atmosphere]\nextinction_per_m = 1e-3\nprofile = { range_m = [0.0], backscatter_per_m_sr = [1e-7], \
                 extinction_per_m = [1e-4] }\n",
                "atmosphere.extinction_per_m = 1e-3",
            ),
            (
                "[outputs]\nsignals_of = \"all\"\n",
                "outputs.signals_of = \"all\"",
            ),
            (
                "[detector]\nnoise = \"none\"\n[estimator]\nfalse_alarm = 0.02\n",
                "estimator.false_alarm = 0.02",
            ),
            (
                "[atmosphere.turbulence]\nkind = \"refractive\"\nsampling = \"derived\"\nlayers = 20\n",
                "atmosphere.turbulence.layers = 20",
            ),
        ] {
            let message = parse(text).unwrap_err();
            assert!(
                message.contains(&format!("{key} is not allowed: ")),
                "{message}"
            );
        }
    }

    #[test]
    fn keys_of_a_transported_pair_are_refused_beside_another_motion_even_with_their_default() {
        for (text, key) in [
            ("[flow.decay]\nlaw = \"two_phase\"\n", "decay"),
            (
                "[flow]\ndecay = { law = \"two_phase\" }\nmotion = \"inviscid\"\n",
                "decay",
            ),
            ("[flow]\nbuoyancy_per_s = 0.0\n", "buoyancy_per_s"),
            ("[flow]\nrebound = false\n", "rebound"),
            ("[flow]\nmeander = false\n", "meander"),
        ] {
            let message = parse(text).unwrap_err();
            let wanted = "is not allowed: absent without flow.motion = \"transported\"";
            assert!(
                message.contains(&format!("flow.{key} = ")) && message.contains(wanted),
                "{message}"
            );
        }
        let moving = "[flow]\nmotion = \"transported\"\nrebound = false\nmeander = false\ndecay = { law = \"two_phase\" }\n";
        assert!(parse(moving).is_ok());
    }

    #[test]
    fn what_the_first_scene_states_may_stay_and_written_scenes_read_again() {
        for method in ["periodogram", "pulse_pair", "first_moment"] {
            let text = super::super::TABLE2_TOML
                .replace("\"periodogram_accumulation\"", &format!("\"{method}\""));
            let file = parse(&text).unwrap();
            assert_eq!(parse(&file.toml).unwrap().toml, file.toml);
        }
        let fitted = parse("[estimator.method]\nkind = \"autoregressive\"\norder = 8\n").unwrap();
        assert!(
            fitted.toml.contains("\norder = 8\n") && !fitted.toml.contains("moment_reach"),
            "{}",
            fitted.toml
        );
        assert_eq!(parse(&fitted.toml).unwrap().content, fitted.content);
    }
}
