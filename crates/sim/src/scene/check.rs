//! What a scene may say: every limit, and the limits between keys.
//!
//! [`Scene::problems`] collects all violations, so that one run of `wakescope check` shows them
//! all. Each names the key, the value and what is allowed.

use super::estimator::check_estimator;
use super::flow::check_flow;
use super::retrieval::check_retrieval;
use super::{
    EfficiencyOfPulse, FORMAT, FieldFlow, Flow, PulseShape, Scan, Scene, SnrReference, SpectrumKind, Turbulence,
};
use crate::keys::{Checker, Declared as _, Problem};

impl Scene {
    /// Everything in this scene that cannot be simulated; empty for a good scene.
    pub fn problems(&self) -> Vec<Problem> {
        self.problems_where(&|_| true)
    }

    /// The same for a file that states only some keys: limits between keys blame those.
    pub(super) fn problems_where(&self, is_stated: &dyn Fn(&str) -> bool) -> Vec<Problem> {
        let mut c = Checker::new(is_stated);
        c.require(self.format == FORMAT, "format", self.format, format!("{FORMAT}, the format of this program"));
        self.check_limits("", &mut c);
        self.check_instrument(&mut c);
        self.check_receiver(&mut c);
        let added = self.added_flows.iter().enumerate().map(|(i, flow)| (format!("added_flows[{i}]"), flow));
        for (at, flow) in std::iter::once(("flow".to_owned(), &self.flow)).chain(added) {
            check_flow(flow, &at, &mut c);
            if let (Flow::Fields(FieldFlow { backscatter: Some(carried), .. }), SnrReference::Fixed { .. }) =
                (flow, self.detector.snr)
            {
                let allowed = "absent with detector.snr.reference = \"fixed\", which asks for no backscatter";
                c.refuse(&format!("{at}.backscatter.name"), &format!("{:?}", carried.name), allowed);
            }
        }
        self.check_head(&mut c);
        check_estimator(self, &mut c);
        check_retrieval(self, &mut c);
        let o = &self.outputs;
        let allowed = "true, or else one of csv, netcdf, hpl, svg and png: nothing would be written";
        c.require(o.csv || o.netcdf || o.hpl || o.svg || o.png, "outputs.csv", o.csv, allowed);
        // Limits between keys make sense only once each key does.
        if c.is_good() {
            self.check_between(&mut c);
        }
        c.into_problems()
    }

    fn check_instrument(&self, c: &mut Checker<'_>) {
        if let PulseShape::Sampled(shape) = &self.pulse.shape {
            let lists = [("pulse.shape.time_s", &shape.time_s), ("pulse.shape.power", &shape.power)];
            let phase = ("pulse.shape.phase_rad", &shape.phase_rad);
            let lists = lists.into_iter().chain((!phase.1.is_empty()).then_some(phase));
            let counts: Vec<(&str, usize)> = lists.map(|(key, list)| (key, list.len())).collect();
            check_lengths(&counts, "pulse.shape", c);
        }
        if let Turbulence::Refractive(t) = self.atmosphere.turbulence {
            c.require(
                t.spectrum != SpectrumKind::HillAndrews || t.inner_scale_m > 0.0,
                "atmosphere.turbulence.inner_scale_m",
                t.inner_scale_m,
                "above 0 m with atmosphere.turbulence.spectrum = \"hill_andrews\", whose bump stands at it",
            );
            c.require(
                t.efficiency == EfficiencyOfPulse::Mean || !matches!(self.detector.snr, SnrReference::Fixed { .. }),
                "atmosphere.turbulence.efficiency",
                "realisation",
                "\"mean\" with detector.snr.reference = \"fixed\", which asks for no efficiency",
            );
        }
        if let Some(profile) = &self.atmosphere.profile {
            let counts = [
                ("atmosphere.profile.range_m", profile.range_m.len()),
                ("atmosphere.profile.backscatter_per_m_sr", profile.backscatter_per_m_sr.len()),
                ("atmosphere.profile.extinction_per_m", profile.extinction_per_m.len()),
            ];
            check_lengths(&counts, "atmosphere.profile", c);
        }
        // What is a profile of the air, or a sampled pulse, the simulation of signals knows best.
        if c.is_good()
            && let Err(e) = crate::setup::instrument::medium(&self.atmosphere)
        {
            c.refuse("atmosphere.profile", "", e.to_string());
        }
        if c.is_good()
            && matches!(self.pulse.shape, PulseShape::Sampled(_))
            && let Err(e) = crate::setup::instrument::pulse(&self.pulse)
        {
            c.refuse("pulse.shape", "", e.to_string());
        }
    }

    /// Samples recorded of each pulse: from `range_min_m` to `range_max_m`, ends included.
    pub fn samples_per_record(&self) -> usize {
        let Scan { range_min_m, range_max_m, .. } = self.scan;
        ((range_max_m - range_min_m) / self.sample_spacing_m() + 1e-9) as usize + 1
    }

    /// Distance between samples, c T_s/2, m.
    pub fn sample_spacing_m(&self) -> f64 {
        0.5 * crate::SPEED_OF_LIGHT_M_S / self.detector.sampling_hz
    }

    /// The 1/e half width sigma of |f|^2 in (7), s; for a sampled pulse that of the Gaussian with the same spread.
    pub fn pulse_sigma_s(&self) -> f64 {
        match &self.pulse.shape {
            PulseShape::Sampled(_) => {
                crate::setup::instrument::pulse(&self.pulse).map_or(f64::NAN, |pulse| pulse.sigma_s())
            }
            PulseShape::Gaussian(shape) => shape.duration().sigma_s(),
        }
    }

    /// Full width at half maximum of the power of the pulse, s; of a sampled one that of the Gaussian with the same spread.
    pub fn pulse_width_s(&self) -> f64 {
        match &self.pulse.shape {
            PulseShape::Gaussian(shape) if shape.definition == super::PulseDefinition::Fwhm => shape.duration_s,
            _ => 2.0 * std::f64::consts::LN_2.sqrt() * self.pulse_sigma_s(),
        }
    }

    /// How far before the range of a sample air contributes to it, c/2 times the last time of the pulse, m.
    pub fn pulse_reach_m(&self) -> f64 {
        crate::setup::instrument::pulse(&self.pulse)
            .map_or(f64::NAN, |pulse| 0.5 * crate::SPEED_OF_LIGHT_M_S * pulse.support_s().1)
    }
}

/// Lists of a table that belong together have the same length; the one that differs from the first is blamed.
fn check_lengths(counts: &[(&str, usize)], table: &str, c: &mut Checker<'_>) {
    let Some((first, count)) = counts.first() else { return };
    if let Some((key, other)) = counts.iter().find(|(_, other)| other != count) {
        let allowed = format!("as many values as {first} has, {count}");
        c.refuse(key, &format!("a list of {other}"), allowed);
    }
    if counts.iter().all(|(_, n)| *n == 0) {
        c.refuse(table, "", "a table with at least one value in each list");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Flow;

    fn keys(change: impl FnOnce(&mut Scene)) -> Vec<String> {
        let mut scene = Scene::default();
        change(&mut scene);
        scene.problems().into_iter().map(|p| p.key).collect()
    }

    #[test]
    fn a_spectrum_that_stands_on_its_inner_scale_needs_one() {
        let air = |spectrum, inner_scale_m| {
            keys(|s| {
                let t = crate::scene::RefractiveTurbulence { spectrum, inner_scale_m, ..Default::default() };
                s.atmosphere.turbulence = Turbulence::Refractive(t);
            })
        };
        assert_eq!(air(crate::scene::SpectrumKind::HillAndrews, 0.0), ["atmosphere.turbulence.inner_scale_m"]);
        assert!(air(crate::scene::SpectrumKind::HillAndrews, 0.01).is_empty());
        assert!(air(crate::scene::SpectrumKind::VonKarman, 0.0).is_empty());
    }

    #[test]
    fn default_scene_has_no_problem() {
        assert_eq!(Scene::default().problems(), vec![]);
    }

    #[test]
    fn impossible_values_are_named() {
        assert_eq!(keys(|s| s.telescope.beam_radius_m = -0.03), ["telescope.beam_radius_m"]);
        assert_eq!(keys(|s| s.pulse.shape = PulseShape::gaussian(f64::NAN)), ["pulse.shape.duration_s"]);
        assert_eq!(keys(|s| s.telescope.focus_m = 0.0), ["telescope.focus_m"]);
        assert_eq!(keys(|s| s.scan.elevation_min_rad = -0.01), ["scan.elevation_min_rad"]);
        assert_eq!(keys(|s| s.scan.range_max_m = 281.0), ["estimator.window_samples"]);
        assert_eq!(keys(|s| s.scan.range_min_m = 40.0), ["scan.range_min_m"]);
        assert_eq!(keys(|s| s.detector.intermediate_frequency_hz = 110e6), ["detector.intermediate_frequency_hz"]);
        assert_eq!(keys(|s| s.estimator.padded_samples = 63), ["estimator.padded_samples"]);
        assert_eq!(keys(|s| s.seed = u64::MAX), ["seed"]);
        assert_eq!(keys(|s| s.format = 7), ["format"]);
        let few = crate::scene::RefractiveTurbulence { realisations: 4, ..Default::default() };
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
        let Flow::VortexPair(pair) = &mut scene.flow else { unreachable!() };
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
}
