//! The circulation of an analytic pair from the maps of a case: a fit to each, and the bound of all raw signals of a scan.
//!
//! The fit keeps the core of `[retrieval] core_radius_m`, or one of 4.5 % of the spacing; the bound is for known cores. Check: against the truth
//! of the scene, and the bound of Table 2's scan against the stored one.

use crate::measure::response::SceneResponse;
use crate::measure::scan::Scanner;
use crate::plan::Plan;
use crate::plan::described::fold_m_s;
use crate::scene::{Flow, VortexPair};
use ndarray::{Array2, s};
use wakescope_estimate::map::ErrorStatistics;
use wakescope_estimate::retrieval::ScanEstimator;
use wakescope_estimate::vortex_fit::{
    FreeParameters, MapFitOptions, Parameter, Powers, ScanModel, Sharing, VelocityMap, Vortex,
    Wake, WakeModel, fit_map_of_estimator,
};
use wakescope_les::winds::Vortex as TrueVortex;

/// What fits and bound need of a case whose flow is a pair.
pub(crate) struct Retrieval<'p> {
    plan: &'p Plan,
    pair: VortexPair,
    /// The vortices in the middle of the scan.
    vortices: [TrueVortex; 2],
    response: SceneResponse,
    circulations_m2_s: Vec<f64>,
}

impl<'p> Retrieval<'p> {
    /// For a case; nothing where the flow is no pair that turns, or one behind its aircraft, the lines are not one still sweep across
    /// the flight, or the pulse is no Gaussian.
    pub(crate) fn new(plan: &'p Plan, scanner: &Scanner<'_>) -> Option<Self> {
        let scene = plan.scene();
        let Flow::VortexPair(pair) = scene.flow else {
            return None;
        };
        let lines = &plan.geometry.schedule;
        let is_one_scan = scene.scan.is_across() && lines.is_plane() && lines.keeps_to_a_plane();
        if !is_one_scan || pair.circulation_m2_s <= 0.0 || pair.aircraft.is_some() {
            return None;
        }
        let time_s = 0.5 * (plan.wind.start_s + plan.scan_end_s());
        let vortices = plan.wind.pair.as_ref()?.vortices(time_s).ok()?;
        let response = SceneResponse::new(plan, scanner.layer_snr())
            .ok()
            .flatten()?;
        Some(Self {
            plan,
            pair,
            vortices,
            response,
            circulations_m2_s: Vec::new(),
        })
    }

    fn model(&self) -> WakeModel {
        WakeModel {
            profile: self.pair.profile,
            lidar_height_m: self.plan.scene().scan.lidar_height_m,
            ..WakeModel::default()
        }
    }

    /// Fits the velocities of a map, m/s; nothing where it is not known what the estimator shows of a wake.
    pub(super) fn add(&mut self, velocity_m_s: &Array2<f64>) {
        let found = self.circulation_m2_s(velocity_m_s);
        self.circulations_m2_s.extend(found);
    }

    /// The circulation that the velocities of a map, m/s, have; NaN where the fit came to no end, nothing where none can be tried.
    pub(crate) fn circulation_m2_s(&self, velocity_m_s: &Array2<f64>) -> Option<f64> {
        let shown = self.response.response(self.pair.lateral_position_m)?;
        let scene = self.plan.scene();
        let g = &self.plan.geometry;
        let step = self.response.gate_stride(&g.gate_range_m);
        let range_m: Vec<f64> = g.gate_range_m.iter().copied().step_by(step).collect();
        let map = VelocityMap {
            elevation_rad: &g.elevation_rad,
            range_m: &range_m,
            velocity_m_s: velocity_m_s.slice(s![.., ..;step]),
            standard_deviation_m_s: None,
        };
        let step_rad = scene.scan.elevation_step_rad;
        let correlated_lines = self
            .response
            .correlated_lines(step_rad, self.pair.lateral_position_m);
        let core_radius_m = scene
            .retrieval
            .as_ref()
            .and_then(|wanted| wanted.core_radius_m);
        let options = MapFitOptions {
            free: free(),
            core_radius_m,
            correlated_lines,
            fold_m_s: fold_m_s(scene),
            ..Default::default()
        };
        let fitted = fit_map_of_estimator(&map, &self.model(), &shown, &options);
        Some(fitted.map_or(f64::NAN, |fit| {
            0.5 * (fit.wake.left.circulation_m2_s + fit.wake.right.circulation_m2_s)
        }))
    }

    /// The bound on the circulation, m^2/s; the pair where it is in the middle of the scan.
    fn bound_m2_s(&self) -> Result<f64, crate::Error> {
        let scene = self.plan.scene();
        let g = &self.plan.geometry;
        let [left, right] = self.vortices.map(|vortex| Vortex {
            circulation_m2_s: vortex.circulation_m2_s.abs(),
            lateral_position_m: vortex.lateral_position_m,
            height_m: vortex.height_m,
            core_radius_m: self.pair.core_radius_m,
        });
        let truth = Wake {
            left,
            right,
            lateral_wind_m_s: self.pair.cross_wind_m_s,
            wind_shear_per_s: 0.0,
            log_wind_m_s: 0.0,
        };
        let pulses = scene.scan.pulses_per_line;
        let lines = g.elevation_rad.iter();
        let elevation_rad = lines
            .flat_map(|line| std::iter::repeat_n(*line, pulses))
            .collect();
        let setup = self.response.setup(self.model(), elevation_rad)?;
        let model = ScanModel::new(&setup, |range_m, _| self.response.snr_at(range_m), &truth)?;
        let bound = model.bound(&truth, Powers::default(), &free(), true)?;
        Ok(bound[[Parameter::LeftCirculation as usize; 2]].sqrt())
    }

    /// Mean error of the fits and root mean square, m^2/s, each with its standard error; the part of the fits that did not come to an
    /// end; the bound, m^2/s. NaN with all others but the bound where no fit was tried.
    pub(super) fn result(&self) -> [f64; 6] {
        let [left, right] = self.vortices.map(|vortex| vortex.circulation_m2_s.abs());
        let truth_m2_s = 0.5 * (left + right);
        let errors = ErrorStatistics::of(
            self.circulations_m2_s
                .iter()
                .map(|found| found - truth_m2_s),
        );
        let [bias, rms] = [
            [errors.bias_m_s, errors.bias_standard_error_m_s],
            [errors.rms_m_s, errors.rms_standard_error_m_s],
        ];
        let failed = errors.missing as f64 / (errors.missing + errors.count) as f64;
        [
            bias[0],
            bias[1],
            rms[0],
            rms[1],
            failed,
            self.bound_m2_s().unwrap_or(f64::NAN),
        ]
    }
}

/// One circulation for both vortices; the core radius is not fitted.
fn free() -> FreeParameters {
    FreeParameters {
        core_radius: Sharing::Fixed,
        ..FreeParameters::common_circulation()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::Target;
    use crate::scene::{NoiseModel, Scene, SceneFile, SnrReference};
    use crate::{Silent, measure::map};

    fn plan(change: impl FnOnce(&mut Scene)) -> Plan {
        let mut scene = Scene::default();
        scene.detector.snr = SnrReference::Fixed { snr_db: 0.0 };
        (scene.scan.pulses_per_line, scene.scan.realisations) = (1, 2);
        change(&mut scene);
        Plan::new(SceneFile::new(scene).unwrap(), Target::Map).unwrap()
    }

    #[test]
    fn bound_on_the_circulation_of_one_scan_of_table_2_is_that_of_an_independent_study() {
        let plan = plan(|_| ());
        let scanner = Scanner::new(&plan, &Silent).unwrap();
        let bound_m2_s = Retrieval::new(&plan, &scanner)
            .unwrap()
            .bound_m2_s()
            .unwrap();
        assert!((bound_m2_s / 6.9 - 1.0).abs() < 0.06, "{bound_m2_s}");
    }

    #[test]
    fn circulation_fitted_to_maps_is_that_of_the_pair_within_its_error() {
        let plan = plan(|scene| {
            scene.detector.snr = SnrReference::Fixed { snr_db: 10.0 };
            (scene.scan.elevation_min_rad, scene.scan.elevation_max_rad) = (0.06, 0.18);
            scene.scan.elevation_step_rad = 2.5e-3;
            (scene.scan.range_min_m, scene.scan.range_max_m) = (310.0, 490.0);
        });
        let scanner = Scanner::new(&plan, &Silent).unwrap();
        let mut retrieval = Retrieval::new(&plan, &scanner).unwrap();
        map::estimates::<f64>(
            &[&plan],
            &scanner,
            &Silent,
            |_| (),
            |map| retrieval.add(map.velocity_m_s),
        )
        .unwrap();
        let found = retrieval.result();
        let [_, _, rms_m2_s, _, failed, bound_m2_s] = found;
        assert_eq!(failed, 0.0);
        // A map of one scan at 0 dB and twice the lines has 19 m^2/s; at 10 dB speckle is left.
        assert!(rms_m2_s < 3.0 * 19.0 && bound_m2_s < 5.0, "{found:?}");
        assert!(
            rms_m2_s > 0.2 * bound_m2_s,
            "no fit is so much better than the bound: {found:?}"
        );
    }

    #[test]
    fn what_was_never_tried_did_not_fail() {
        let plan = plan(|_| ());
        let retrieval = Retrieval::new(&plan, &Scanner::new(&plan, &Silent).unwrap()).unwrap();
        let found = retrieval.result();
        assert!(
            found[4].is_nan() && found[2].is_nan() && found[5] > 0.0,
            "{found:?}"
        );
    }

    #[test]
    fn air_without_a_pair_and_signals_without_noise_have_no_circulation() {
        for change in [
            (|scene| scene.flow = Flow::Calm {}) as fn(&mut Scene),
            |scene| scene.detector.noise = NoiseModel::None,
            |scene| {
                scene.pulse.shape = crate::scene::PulseShape::Sampled(crate::scene::SampledShape {
                    time_s: vec![0.0, 1e-7, 2e-7],
                    power: vec![0.0, 1.0, 0.0],
                    ..Default::default()
                });
            },
            |scene| {
                scene.scan.pattern = crate::scene::Pattern::Stare {
                    elevation_rad: 0.1,
                    lines: 60,
                }
            },
            |scene| scene.scan.head.sweeps = 2,
        ] {
            let plan = plan(change);
            assert!(Retrieval::new(&plan, &Scanner::new(&plan, &Silent).unwrap()).is_none());
        }
    }
}
