//! What a scene may say: every limit, and the limits between keys.
//!
//! [`Scene::problems`] collects all violations, so that one run of `wakescope check` shows them
//! all. Each names the key, the value and what is allowed. Limits between keys blame one that the file states, not the default beside it.

use super::estimator::check_estimator;
use super::flow::check_flow;
use super::retrieval::check_retrieval;
use super::{
    DetectorSignal, EfficiencyOfPulse, Outside, PulseShape, Scene, SnrReference, Turbulence,
};
use crate::Error;
use crate::keys::{Checker, Declared, Problem, side};

impl Scene {
    /// Everything in this scene that cannot be simulated; empty for a good scene.
    pub fn problems(&self) -> Vec<Problem> {
        self.problems_where(&|_| true)
    }

    /// The same for a file that states only some keys: limits between keys blame those.
    pub(super) fn problems_where(&self, is_stated: &dyn Fn(&str) -> bool) -> Vec<Problem> {
        let mut c = Checker::new(is_stated);
        self.check_limits("", &mut c);
        self.check_instrument(&mut c);
        self.check_receiver(&mut c);
        for (at, flow) in self.flows() {
            check_flow(flow, &at, &mut c);
        }
        self.check_air(&mut c);
        self.check_carriers(&mut c);
        self.check_head(&mut c);
        check_estimator(self, &mut c);
        check_retrieval(self, &mut c);
        let o = &self.outputs;
        let allowed =
            "true, or else one of csv, netcdf, hpl, svg and png: nothing would be written";
        c.require(
            o.csv || o.netcdf || o.hpl || o.svg || o.png,
            "outputs.csv",
            o.csv,
            allowed,
        );
        // Limits between keys make sense only once each key does.
        if c.is_good() {
            self.check_between(&mut c);
        }
        c.into_problems()
    }

    fn check_instrument(&self, c: &mut Checker<'_>) {
        if let Turbulence::Refractive(t) = &self.atmosphere.turbulence {
            let is_needed = !matches!(self.detector.snr, SnrReference::Fixed { .. });
            c.require(
                is_needed || t.efficiency == EfficiencyOfPulse::Mean,
                "atmosphere.turbulence.efficiency",
                "realisation",
                "\"mean\" with detector.snr.reference = \"fixed\", which asks for no efficiency",
            );
        }
        self.check_by_libraries(c);
    }

    /// What the libraries refuse of the tables that are passed to them as they are.
    fn check_by_libraries(&self, c: &mut Checker<'_>) {
        let air = &self.atmosphere;
        if let (Some(profile), Some(_)) = (&air.profile, &air.aerosol) {
            let allowed = "absent beside atmosphere.aerosol, which takes its place";
            c.require(false, "atmosphere.profile", profile.range_m.len(), allowed);
        } else if let (Some(profile), Err(error)) =
            (&air.profile, air.medium(self.laser.wavelength_m))
            && !c.has_problem_of("atmosphere.profile")
        {
            refuse(c, "atmosphere.profile", profile, error.into());
        }
        let shape = &self.pulse.shape;
        if let (PulseShape::Sampled(_), Err(error)) = (shape, self.pulse.simulated())
            && !c.has_problem_of("pulse")
        {
            refuse(c, "pulse.shape", shape, error.into());
        }
        let turbulence = &self.atmosphere.turbulence;
        let table = "atmosphere.turbulence";
        if let Turbulence::Refractive(t) = turbulence
            && !c.has_problem_of(table)
        {
            let keys = [
                "atmosphere.turbulence.outer_scale_m",
                "atmosphere.turbulence.inner_scale_m",
            ];
            let profile = t.profile.as_ref();
            if profile.is_some_and(|p| !p.check("atmosphere.turbulence.profile", c)) {
                return;
            }
            // Limits between keys make sense only once each key does.
            if c.compare(keys, [t.outer_scale_m, t.inner_scale_m], "above")
                && let Err(error) = t.along(0.0, 0.0)
            {
                refuse(c, table, turbulence, error.into());
            }
        }
    }
}

impl Scene {
    /// Limits that make sense only where each key is within its own.
    pub(super) fn check_between(&self, c: &mut Checker<'_>) {
        let t = &self.telescope;
        let radii = [t.obscuration_radius_m, t.aperture_radius_m];
        c.compare(
            [
                "telescope.obscuration_radius_m",
                "telescope.aperture_radius_m",
            ],
            radii,
            "below",
        );
        if let Some(p) = self.flow.pair() {
            let core_m = p.core_radius_m;
            let spacing_m = p.spacing_m;
            let below = format!("below half of flow.spacing_m, {} m", 0.5 * spacing_m);
            let above = format!("above twice flow.core_radius_m, {} m", 2.0 * core_m);
            let sides = [
                side("flow.core_radius_m", core_m, below),
                side("flow.spacing_m", spacing_m, above),
            ];
            c.between(core_m < 0.5 * spacing_m, &sides);
        }
        self.check_band(c);
        if self.scan.pattern.has_scan_elevations() {
            self.check_lines(c);
        }
        self.check_scan_between(c);
        self.check_ranges(c);
        if self.outputs.hpl {
            self.check_hpl(c);
        }
        let o = &self.outputs;
        let ends = [o.profile_range_max_m, o.profile_range_min_m];
        c.compare(
            ["outputs.profile_range_max_m", "outputs.profile_range_min_m"],
            ends,
            "above",
        );
    }

    /// The detector band lies between 0 and half the sampling frequency; that of two quadratures, which are made of it, within the whole one.
    fn check_band(&self, c: &mut Checker<'_>) {
        let d = &self.detector;
        let centre_hz = d.intermediate_frequency_hz;
        let half_hz = 0.5 * d.bandwidth_hz;
        let nyquist_hz = 0.5 * d.sampling_hz;
        let is_baseband = d.signal == DetectorSignal::Baseband;
        // Two quadratures hold the band about 0, whose upper end then bounds no frequency.
        let (sampled_hz, highest_hz) = if is_baseband {
            (0.0, f64::INFINITY)
        } else {
            (centre_hz, nyquist_hz - half_hz)
        };
        let why = match is_baseband {
            true => {
                "two quadratures of the sampling frequency hold the band about the intermediate one"
            }
            false => "the detector band lies between 0 and half of detector.sampling_hz",
        };
        let narrowest_hz = centre_hz.min(nyquist_hz - sampled_hz);
        let mut sides = Vec::new();
        // A key that can mend it alone; of sampling and intermediate frequency one that has to, where none can.
        if half_hz < highest_hz && (centre_hz <= half_hz || centre_hz >= highest_hz) {
            let below = if is_baseband {
                String::new()
            } else {
                format!(" and below {highest_hz:e}")
            };
            let allowed = format!("above {half_hz:e}{below} Hz, so that {why}");
            sides.push(side(
                "detector.intermediate_frequency_hz",
                centre_hz,
                allowed,
            ));
        }
        if nyquist_hz <= sampled_hz + half_hz && (centre_hz > half_hz || narrowest_hz <= 0.0) {
            let allowed = format!("above {:e} Hz, so that {why}", 2.0 * (sampled_hz + half_hz));
            sides.push(side("detector.sampling_hz", d.sampling_hz, allowed));
        }
        if narrowest_hz > 0.0 {
            let allowed = format!("below {:e} Hz, so that {why}", 2.0 * narrowest_hz);
            sides.push(side("detector.bandwidth_hz", d.bandwidth_hz, allowed));
        }
        if c.between(half_hz < narrowest_hz, &sides) && !is_baseband {
            self.check_frequencies(c);
        }
    }

    /// The spectrum has a frequency in the band.
    fn check_frequencies(&self, c: &mut Checker<'_>) {
        let d = &self.detector;
        let e = &self.estimator;
        let method = e.method.behaviour();
        let (key, factor) = method.frequencies_key();
        let value = method.frequencies(e) / factor;
        let points_of_one = factor as f64;
        let step_hz = d.sampling_hz / (value as f64 * points_of_one);
        let place =
            |edge: f64| (d.intermediate_frequency_hz + edge * 0.5 * d.bandwidth_hz) / step_hz;
        let why = "so that the spectrum has a frequency in the detector band";
        let needed = (d.sampling_hz / (d.bandwidth_hz * points_of_one)).ceil();
        let wide = side(
            "detector.bandwidth_hz",
            d.bandwidth_hz,
            format!("at least {step_hz:e} Hz, {why}"),
        );
        let fine = (key, value.to_string(), format!("at least {needed}, {why}"));
        c.between(
            (place(-1.0) - 1e-9).ceil() <= (place(1.0) + 1e-9).floor(),
            &[wide, fine],
        );
    }

    fn check_lines(&self, c: &mut Checker<'_>) {
        let s = &self.scan;
        let low_rad = s.elevation_min_rad;
        let high_rad = s.elevation_max_rad;
        c.compare(
            ["scan.elevation_max_rad", "scan.elevation_min_rad"],
            [high_rad, low_rad],
            "at least",
        );
        let lowest_m = s.lidar_height_m + s.range_max_m * low_rad.sin();
        let is_seen = lowest_m >= 0.0 || s.below_ground != (Outside::Error {});
        // Not -0.
        let least_rad = (-s.lidar_height_m / s.range_max_m).asin() + 0.0;
        let allowed = format!(
            "at least {least_rad} rad; at scan.range_max_m the lowest line is {:.3} m below the ground, which \
             scan.below_ground.policy = \"mask\" allows",
            -lowest_m
        );
        c.require(is_seen, "scan.elevation_min_rad", low_rad, allowed);
    }

    fn check_ranges(&self, c: &mut Checker<'_>) {
        let first_m = self.scan.range_min_m;
        let last_m = self.scan.range_max_m;
        // Scatterers that a sample sees reach back by the length of the summation of (15), to the last time of the pulse.
        let last_s = self
            .pulse
            .simulated()
            .map_or(f64::NAN, |pulse| pulse.support_s().1);
        let reach_m = 0.5 * crate::SPEED_OF_LIGHT_M_S * last_s;
        let far = format!("above {reach_m:.3} m, half the length of the pulse in the air");
        let of_pulse = match &self.pulse.shape {
            PulseShape::Sampled(_) => {
                let allowed = format!(
                    "a pulse that ends so early that half its length in the air, {reach_m:.3} m, is below scan.range_min_m, {first_m} m"
                );
                ("pulse.shape", String::new(), allowed)
            }
            PulseShape::Gaussian(shape) => {
                // A little less, so that rounding it is safe.
                let longest_s = shape.duration_s * first_m / reach_m * (1.0 - 1e-4);
                let allowed = format!(
                    "below {longest_s:.4e} s, so that half the length of the pulse in the air is below scan.range_min_m, {first_m} m"
                );
                side("pulse.shape.duration_s", shape.duration_s, allowed)
            }
        };
        c.between(
            first_m > reach_m,
            &[side("scan.range_min_m", first_m, far), of_pulse],
        );
        let ordered = c.compare(
            ["scan.range_max_m", "scan.range_min_m"],
            [last_m, first_m],
            "above",
        );
        if ordered {
            self.check_record(c);
        }
    }

    /// The record has samples for a window, and not too many of them.
    fn check_record(&self, c: &mut Checker<'_>) {
        let first_m = self.scan.range_min_m;
        let last_m = self.scan.range_max_m;
        let sampling_hz = self.detector.sampling_hz;
        let samples = self.samples_per_record();
        let spacing_m = self.sample_spacing_m();
        let many = format!("records of at most 10000000 samples; this one has {samples}");
        let values = [
            ("scan.range_max_m", last_m),
            ("scan.range_min_m", first_m),
            ("detector.sampling_hz", sampling_hz),
        ];
        c.between(
            samples <= 10_000_000,
            &values.map(|(key, value)| side(key, value, many.clone())),
        );
        let window = self.estimator.window_samples;
        let window_m = (window as f64 - 1.0) * spacing_m;
        let why = format!(
            "so that the record, {samples} samples, holds estimator.window_samples, {window}"
        );
        // Rounded to the side that is accepted.
        let up_m = ((first_m + window_m) * 1e3).ceil() / 1e3;
        let down_m = ((last_m - window_m) * 1e3).floor() / 1e3;
        let all = format!(
            "at most {samples}, the samples recorded from scan.range_min_m to scan.range_max_m"
        );
        let faster_hz = sampling_hz * (window_m / (last_m - first_m)) * (1.0 + 1e-6);
        let sides = [
            ("estimator.window_samples", window.to_string(), all),
            side(
                "scan.range_max_m",
                last_m,
                format!("at least {up_m} m, {why}"),
            ),
            side(
                "scan.range_min_m",
                first_m,
                format!("at most {down_m} m, {why}"),
            ),
            side(
                "detector.sampling_hz",
                sampling_hz,
                format!("at least {faster_hz:.6e} Hz, {why}"),
            ),
        ];
        c.between(window <= samples, &sides);
    }

    /// A HALO raw file counts gates from the lidar and knows their length alone.
    pub(super) fn check_hpl(&self, c: &mut Checker<'_>) {
        let window = self.estimator.window_samples;
        let step = self.estimator.gate_step_samples;
        let allowed = format!(
            "only with gates that touch and do not overlap: estimator.gate_step_samples = {window}, as estimator.window_samples, not {step}"
        );
        if !c.require(step == window, "outputs.hpl", true, allowed) {
            return;
        }
        let first_m = self.scan.range_min_m;
        let gate_m = window as f64 * self.sample_spacing_m();
        let near_m = |number: f64| (number * gate_m * 1e4).round() / 1e4;
        let before = (first_m / gate_m).floor();
        let allowed = format!(
            "a whole number of gates of {gate_m:.4} m with outputs.hpl, such as {} or {} m",
            near_m(before),
            near_m(before + 1.0)
        );
        // A millimetre is below what readers of the format keep.
        let is_whole = ((first_m / gate_m).round() * gate_m - first_m).abs() <= 1e-3;
        c.require(is_whole, "scan.range_min_m", first_m, allowed);
        let allowed = format!(
            "at least {:.4} m with outputs.hpl, which needs two gates",
            first_m + 2.0 * gate_m
        );
        let has_two = self.samples_per_record() >= 2 * window;
        c.require(has_two, "scan.range_max_m", self.scan.range_max_m, allowed);
    }
}

/// Refuses what a library refuses of a table: the key of the field that it names, or else the table.
fn refuse<T: Declared>(c: &mut Checker<'_>, table: &str, value: &T, error: Error) {
    let keys = value.to_value();
    let refused = error.refused_field().filter(|refused| {
        let name = refused.key.split('[').next().unwrap_or_default();
        keys.as_ref().is_some_and(|keys| keys.get(name).is_some())
    });
    match refused {
        Some(refused) => c.refuse(
            &format!("{table}.{}", refused.key),
            &refused.value,
            refused.allowed,
        ),
        None => c.refuse(table, "", error.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Flow;
    use crate::scene::SceneFile;
    use std::path::Path;

    fn keys(change: impl FnOnce(&mut Scene)) -> Vec<String> {
        let mut scene = Scene::default();
        change(&mut scene);
        scene.problems().into_iter().map(|p| p.key).collect()
    }

    #[test]
    fn a_spectrum_that_stands_on_its_inner_scale_needs_one() {
        let air = |spectrum, inner_scale_m| {
            keys(|s| {
                let t = crate::scene::RefractiveTurbulence {
                    spectrum,
                    inner_scale_m,
                    ..Default::default()
                };
                s.atmosphere.turbulence = Turbulence::Refractive(t);
            })
        };
        assert_eq!(
            air(crate::scene::SpectrumKind::HillAndrews, 0.0),
            ["atmosphere.turbulence.inner_scale_m"]
        );
        assert!(air(crate::scene::SpectrumKind::HillAndrews, 0.01).is_empty());
        assert!(air(crate::scene::SpectrumKind::VonKarman, 0.0).is_empty());
    }

    #[test]
    fn default_scene_has_no_problem() {
        assert_eq!(Scene::default().problems(), vec![]);
    }

    #[test]
    fn impossible_values_are_named() {
        assert_eq!(
            keys(|s| s.telescope.beam_radius_m = -0.03),
            ["telescope.beam_radius_m"]
        );
        assert_eq!(
            keys(|s| s.pulse.shape = PulseShape::gaussian(f64::NAN)),
            ["pulse.shape.duration_s"]
        );
        assert_eq!(keys(|s| s.telescope.focus_m = 0.0), ["telescope.focus_m"]);
        assert_eq!(
            keys(|s| s.scan.elevation_min_rad = -0.01),
            ["scan.elevation_min_rad"]
        );
        assert_eq!(
            keys(|s| s.scan.range_max_m = 281.0),
            ["estimator.window_samples"]
        );
        assert_eq!(keys(|s| s.scan.range_min_m = 40.0), ["scan.range_min_m"]);
        assert_eq!(
            keys(|s| s.detector.intermediate_frequency_hz = 110e6),
            ["detector.intermediate_frequency_hz"]
        );
        assert_eq!(
            keys(|s| s.estimator.padded_samples = 63),
            ["estimator.padded_samples"]
        );
        assert_eq!(keys(|s| s.seed = u64::MAX), ["seed"]);
        assert_eq!(keys(|s| s.format = 7), ["format"]);
        let few = crate::scene::RefractiveTurbulence {
            realisations: 4,
            ..Default::default()
        };
        let few = keys(|s| s.atmosphere.turbulence = Turbulence::Refractive(few));
        assert_eq!(few, ["atmosphere.turbulence.realisations"]);
    }

    #[test]
    fn all_problems_are_reported_at_once() {
        let found = keys(|s| {
            s.laser.wavelength_m = -1.0;
            s.scan.realisations = 0;
        });
        assert_eq!(found, ["laser.wavelength_m", "scan.realisations"]);
    }

    #[test]
    fn age_needs_motion() {
        let mut scene = Scene::default();
        let Flow::VortexPair(pair) = &mut scene.flow else {
            unreachable!()
        };
        pair.age_tau = 1.0;
        assert_eq!(scene.problems()[0].key, "flow.age_tau");
    }

    #[test]
    fn a_lidar_above_the_ground_may_look_down_until_the_beam_meets_it() {
        let with = |elevation_rad: f64| {
            keys(|s| {
                s.scan.lidar_height_m = 52.0;
                s.scan.elevation_min_rad = elevation_rad;
            })
        };
        assert!(with(-0.1).is_empty());
        assert_eq!(with(-0.101), ["scan.elevation_min_rad"]);
    }

    fn message(text: &str) -> String {
        SceneFile::parse(text, Path::new("s.toml"))
            .unwrap_err()
            .to_string()
    }

    #[test]
    fn a_limit_between_keys_blames_the_one_that_the_file_states() {
        for (text, wanted) in [
            (
                "[estimator]\nwindow_samples = 65536\n",
                "s.toml:2: estimator.window_samples = 65536 is not allowed: at most estimator.padded_samples, 1024",
            ),
            (
                "[detector]\nsampling_hz = 100e6\n",
                "s.toml:2: detector.sampling_hz = 100e6 is not allowed: above 2.1e8 Hz",
            ),
            (
                "[detector]\nbandwidth_hz = 95e6\n",
                "detector.bandwidth_hz = 95e6 is not allowed: below 9e7 Hz",
            ),
            (
                "[scan]\nrange_max_m = 300\n",
                "s.toml:2: scan.range_max_m = 300 is not allowed: at least 317.774 m",
            ),
            (
                "[pulse.shape]\nduration_s = 1.2e-6\n",
                "s.toml:2: pulse.shape.duration_s = 1.2e-6 is not allowed: below 8.36",
            ),
            (
                "[flow]\nspacing_m = 3\n",
                "flow.spacing_m = 3 is not allowed: above twice flow.core_radius_m, 4.7 m",
            ),
            (
                "[telescope]\naperture_radius_m = 0.01\nobscuration_radius_m = 0.02\n",
                "telescope.obscuration_radius_m = 0.02",
            ),
            (
                "[scan]\nelevation_min_rad = 0.5\n",
                "scan.elevation_min_rad = 0.5 is not allowed: at most scan.elevation_max_rad",
            ),
            (
                "[outputs]\nprofile_range_min_m = 4000\n",
                "outputs.profile_range_min_m = 4000 is not allowed: below",
            ),
            (
                "[estimator]\nmethod.kind = \"autoregressive\"\nwindow_samples = 10\n",
                "estimator.window_samples = 10 is not allowed: above estimator.method.order, 16",
            ),
        ] {
            let m = message(text);
            assert!(m.contains(wanted), "{m}");
        }
    }

    #[test]
    fn what_a_limit_names_is_accepted() {
        let good = |text: &str| {
            SceneFile::parse(text, Path::new("s.toml"))
                .map(|_| ())
                .map_err(|e| e.to_string())
        };
        assert_eq!(good("[pulse.shape]\nduration_s = 8.36e-7\n"), Ok(()));
        assert_eq!(good("[scan]\nrange_max_m = 317.774\n"), Ok(()));
        assert_eq!(good("[scan]\nrange_min_m = 482.226\n"), Ok(()));
        assert_eq!(good("[detector]\nsampling_hz = 210000001\n"), Ok(()));
        // The ends themselves are not accepted, and not named as if they were.
        let band = |middle: &str| {
            good(&format!(
                "[detector]\nsampling_hz = 200e6\nbandwidth_hz = 60e6\nintermediate_frequency_hz = {middle}\n"
            ))
        };
        let refused = band("70e6").unwrap_err();
        assert!(
            refused.contains("above 3e7 and below 7e7 Hz") && band("30e6").is_err(),
            "{refused}"
        );
        assert_eq!((band("30000001"), band("69999999")), (Ok(()), Ok(())));
        let fine = |words: &str| good(&format!("[detector]\nbandwidth_hz = 1e5\n{words}"));
        assert!(
            fine("")
                .unwrap_err()
                .contains("detector.bandwidth_hz = 1e5 is not allowed: at least 2.44140625e5 Hz")
        );
        assert_eq!(fine("[estimator]\npadded_samples = 2500\n"), Ok(()));
        assert_eq!(good("[detector]\nbandwidth_hz = 244141\n"), Ok(()));
        for (pattern, count) in [("\"vad\", beams", 10_000), ("\"stare\", lines", 100_000)] {
            let with = |n: usize| {
                good(&format!(
                    "[scan]\npulses_per_line = 1\npattern = {{ kind = {pattern} = {n} }}\n"
                ))
            };
            assert_eq!(with(count), Ok(()));
            assert!(with(count + 1).is_err());
        }
        assert!(
            good("[scan]\npattern = { kind = \"vad\", beams = 3 }\n")
                .unwrap_err()
                .contains("from 4 to 10000")
        );
        assert_eq!(
            good("[scan]\npattern = { kind = \"vad\", beams = 4 }\n"),
            Ok(())
        );
    }

    /// A default beside a changed key is not what the user wrote: nobody looks for it in the file.
    #[test]
    fn no_single_change_of_a_number_is_blamed_on_a_default() {
        let defaults = crate::keys::to_table(&Scene::default());
        let mut texts = Vec::new();
        for (section, keys) in defaults
            .iter()
            .filter_map(|(name, value)| Some((name, value.as_table()?)))
        {
            for (key, value) in keys {
                let values: Vec<String> = match value {
                    toml::Value::Float(x) => {
                        let factors = [
                            -1.0, 1e-9, 1e-4, 0.01, 0.1, 0.5, 2.0, 5.0, 20.0, 1e3, 1e6, 1e12,
                        ];
                        factors
                            .iter()
                            .map(|f| format!("{:?}", x * f))
                            .chain(["nan".into(), "inf".into()])
                            .collect()
                    }
                    toml::Value::Integer(_) => ["0", "1", "3", "100", "5000", "70000", "2000000"]
                        .map(String::from)
                        .into(),
                    toml::Value::Boolean(_) => vec!["true".into(), "false".into()],
                    _ => continue,
                };
                for value in values {
                    texts.push((
                        format!("{section}.{key}"),
                        format!("[{section}]\n{key} = {value}\n"),
                    ));
                }
            }
        }
        let mut refused = 0;
        for (key, text) in texts {
            let Err(error) = SceneFile::parse(&text, Path::new("s.toml")) else {
                continue;
            };
            refused += 1;
            for line in error.to_string().lines() {
                assert!(
                    line.starts_with(&format!("s.toml:2: {key} = ")),
                    "{text}{line}"
                );
            }
        }
        assert!(refused > 150, "{refused}");
    }

    #[test]
    fn place_and_date_have_limits() {
        assert_eq!(keys(|s| s.site.latitude_deg = 91.0), ["site.latitude_deg"]);
        assert_eq!(
            keys(|s| s.site.longitude_deg = f64::NAN),
            ["site.longitude_deg"]
        );
        assert_eq!(keys(|s| s.site.altitude_m = 1e6), ["site.altitude_m"]);
        assert_eq!(
            keys(|s| s.site.start_utc = "yesterday".into()),
            ["site.start_utc"]
        );
        assert_eq!(keys(|s| s.site.name = "two\nlines".into()), ["site.name"]);
    }

    #[test]
    fn a_halo_file_needs_gates_that_touch_and_begin_at_the_lidar() {
        let problems = |step: usize, range_min_m: f64| {
            let mut scene = Scene::default();
            scene.outputs.hpl = true;
            (scene.estimator.gate_step_samples, scene.scan.range_min_m) = (step, range_min_m);
            scene
                .problems()
                .iter()
                .map(ToString::to_string)
                .collect::<Vec<_>>()
        };
        let overlap = problems(5, 280.0).join(" ");
        assert!(
            overlap.contains("outputs.hpl") && overlap.contains("gate_step_samples = 64"),
            "{overlap}"
        );
        let shifted = problems(64, 280.0).join(" ");
        assert!(
            shifted.contains("scan.range_min_m = 280") && shifted.contains("306.9875"),
            "{shifted}"
        );
        assert_eq!(problems(64, 306.9875), Vec::<String>::new());
    }
}
