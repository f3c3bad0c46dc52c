//! The stages of a run in their order, each planned by its own module.

use crate::Error;
use crate::measure::profile::EfficiencyMemo;
use crate::measure::{clipping, map_stages, plane, profile, scan_stages, screens};
use crate::plan::wind::SceneWind;
use crate::plan::{Plan, PlannedStage, Stage, Target};
use crate::retrieve;
use crate::scene::SceneFile;
use crate::write;
use std::sync::Arc;

impl Plan {
    /// Plans a run; reads the planes of a simulated flow.
    ///
    /// # Errors
    /// Fails if planes cannot be read, end before the scan or are left by a line of sight, if a
    /// crate refuses the scene, such as phase screens too coarse for the turbulence, and if a file
    /// cannot hold its results.
    pub fn new(scene: SceneFile, target: Target) -> Result<Self, Error> {
        let wind = Arc::new(SceneWind::new(&scene)?);
        Self::sharing(scene, target, wind, &EfficiencyMemo::default())
    }

    /// Plans a run with a wind and phase screens that other plans may share.
    ///
    /// # Errors
    /// As [`Plan::new`].
    pub(crate) fn sharing(
        scene: SceneFile,
        target: Target,
        wind: Arc<SceneWind>,
        memo: &EfficiencyMemo,
    ) -> Result<Self, Error> {
        let file = scene.clone();
        let plan = Self::with_wind(scene, target, wind);
        plan.and_then(|plan| with_stages(plan, memo))
            .map_err(|error| file.of_key(error))
    }
}

/// Plans the stages, in the order in which they run.
fn with_stages(mut plan: Plan, memo: &EfficiencyMemo) -> Result<Plan, Error> {
    // A beam without a valid theory is refused before its phase screens.
    let efficiency = profile::planned(&plan)?;
    let (screens, screen_plans) = screens::planned(&plan, memo)?;
    plan.warnings
        .extend(screens::warnings(&plan, &screen_plans));
    plan.screens = screen_plans;
    plan.warnings.extend(map_stages::warnings(&plan)?);
    plan.warnings.extend(clipping::warning(&plan));
    let retrieval = retrieve::stage::planned(&plan)?;
    plan.stages = vec![
        PlannedStage::skipped(Stage::FlowSimulation, &plan.wind.source),
        plane::planned(&plan),
        screens,
        efficiency,
        scan_stages::lines_of_sight(&plan)?,
        scan_stages::signals(&plan),
        scan_stages::noise(&plan),
        map_stages::estimates(&plan),
        map_stages::errors(&plan),
    ];
    plan.stages.extend(retrieval);
    plan.stages.push(write::stage::planned(&plan)?);
    Ok(plan)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Flow, NoiseModel, RefractiveTurbulence, Scene, SnrReference, Turbulence};

    fn plan(target: Target, change: impl FnOnce(&mut Scene)) -> Plan {
        let mut scene = Scene::default();
        change(&mut scene);
        Plan::new(SceneFile::new(scene).unwrap(), target).unwrap()
    }

    fn run_stages(plan: &Plan) -> Vec<&'static str> {
        plan.stages
            .iter()
            .filter(|s| s.runs)
            .map(|s| s.stage.name())
            .collect()
    }

    #[test]
    fn each_target_runs_only_what_it_needs() {
        let stages = |target| run_stages(&plan(target, |_| {}));
        assert_eq!(stages(Target::Efficiency), ["efficiency", "files"]);
        let signal = ["efficiency", "lines of sight", "signals", "noise"];
        assert_eq!(stages(Target::Signal), [&signal[..], &["files"]].concat());
        assert_eq!(
            stages(Target::Map),
            [&signal[..], &["estimates", "errors", "files"]].concat()
        );
        assert_eq!(stages(Target::Run).len(), 8);
    }

    #[test]
    fn what_the_scene_does_not_need_is_left_out_with_a_reason() {
        let lean = plan(Target::Map, |s| {
            s.detector.snr = SnrReference::Fixed { snr_db: 0.0 };
            s.detector.noise = NoiseModel::None;
        });
        assert_eq!(
            run_stages(&lean),
            ["lines of sight", "signals", "estimates", "errors", "files"]
        );
        assert!(
            lean.stages
                .iter()
                .filter(|s| !s.runs)
                .all(|s| !s.reason.is_empty())
        );
        let calm = plan(Target::Run, |s| s.flow = Flow::Calm {});
        assert!(!calm.runs(Stage::CrossPlane));
    }

    #[test]
    fn forecasts_grow_with_the_work() {
        let once = plan(Target::Map, |s| s.scan.realisations = 100).core_s();
        let twice = plan(Target::Map, |s| s.scan.realisations = 200).core_s();
        assert!((1.9..2.0).contains(&(twice / once)), "{}", twice / once);
    }

    #[test]
    fn memory_is_that_of_the_threads_of_the_pool() {
        let with = |threads: usize, of: fn(&mut Scene)| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| plan(Target::Run, of).memory_bytes())
        };
        let screens = |s: &mut Scene| {
            let t = RefractiveTurbulence {
                grid_points: 512,
                realisations: 64,
                ..RefractiveTurbulence::default()
            };
            s.atmosphere.turbulence = Turbulence::Refractive(t);
        };
        // Eight groups of realisations at most run at a time, each with some 80 bytes a point.
        let [one, two, eight, more] = [1, 2, 8, 16].map(|threads| with(threads, screens));
        let group = 512.0 * 512.0 * 80.0;
        assert!(
            two - one > 0.9 * group && (6.9..7.1).contains(&((eight - one) / (two - one))),
            "{one} {two} {eight}"
        );
        assert!(more - eight < 0.2 * group, "{eight} {more}");
    }

    #[test]
    fn coarse_spectra_are_warned_of_with_the_bias_that_their_refinement_leaves() {
        use crate::scene::Refinement;
        let off_m_s = |refinement| {
            let change = |s: &mut Scene| {
                (s.estimator.padded_samples, s.estimator.refinement) = (64, refinement)
            };
            let text = plan(Target::Map, change).warnings.remove(0);
            assert!(text.contains("steps of 3.03 m/s"), "{text}");
            text.split("up to ")
                .nth(1)
                .unwrap()
                .split(' ')
                .next()
                .unwrap()
                .parse::<f64>()
                .unwrap()
        };
        // half a step, and what the parabola and the image leave
        assert!(
            (off_m_s(Refinement::None) - 1.51).abs() < 0.04,
            "{}",
            off_m_s(Refinement::None)
        );
        assert!(off_m_s(Refinement::Parabola) < 0.15);
    }

    #[test]
    fn air_faster_than_the_band_is_warned_of() {
        let of = |words: &str| {
            let scene = SceneFile::parse(words, std::path::Path::new("s.toml")).unwrap();
            Plan::new(scene, Target::Map).unwrap()
        };
        // The largest speeds in brackets: where they are no radial velocities, nobody sees them.
        for (words, expected_m_s) in [
            // The horizontal line at 520 m; the air of the last line, 2.6 m/s faster each second.
            (
                "[scan]\nelevation_min_rad = 0.0\n[flow]\nkind = \"linear\"\ngradient_v_per_s = [0.0, 0.2, 0.0]\n",
                104.0,
            ),
            (
                "[flow]\nkind = \"linear\"\nvelocity_m_s = [0.0, 0.0, 5.0]\ngradient_u_per_s = [0.3, 0.0, 0.0]\n",
                f64::NAN,
            ),
            (
                "[flow]\nkind = \"linear\"\nvelocity_m_s = [0.0, 5.0, 0.0]\nacceleration_m_s2 = [0.0, 10.0, 0.0]\n",
                f64::NAN,
            ),
            ("[flow]\nprofile = \"lamb_oseen\"\n", 24.5),
            ("[flow]\ncirculation_m2_s = 570.0\n", 19.6),
            ("[flow]\nspacing_m = 12.0\n", 16.5),
            (
                "[flow]\nkind = \"uniform\"\nlateral_m_s = 12.0\nvertical_m_s = 0.0\n[[added_flows]]\nkind = \"uniform\"\n\
                 lateral_m_s = -12.0\nvertical_m_s = 0.0\n",
                0.0,
            ),
            (
                "[flow]\nkind = \"calm\"\n[scan.lidar]\nvelocity_m_s = [0.0, 25.0, 0.0]\n[scan]\nelevation_min_rad = 0.0\n",
                25.0,
            ),
        ] {
            let plan = of(words);
            // Each line at every five centimetres.
            let scan = &plan.scene().scan;
            let schedule = &plan.geometry.schedule;
            let mut dense_m_s = 0.0_f64;
            for line in 0..schedule.lines.len() {
                let beam = schedule.middle(line);
                let steps = ((scan.range_max_m - scan.range_min_m) / 0.05) as usize;
                let points: Vec<[f64; 3]> = (0..=steps)
                    .map(|i| beam.at_range_m(scan.range_min_m + 0.05 * i as f64))
                    .collect();
                let mut velocity = vec![[0.0; 3]; points.len()];
                plan.wind
                    .wind()
                    .velocity_into(&points, plan.wind.start_s + beam.time_s, &mut velocity)
                    .unwrap();
                let seen = velocity.iter().map(|v| {
                    beam.direction
                        .radial_velocity_m_s(*v, beam.velocity_m_s)
                        .abs()
                });
                dense_m_s = dense_m_s.max(seen.fold(0.0, f64::max));
            }
            let found_m_s = plan.fastest_m_s;
            assert!(
                (found_m_s - dense_m_s).abs() <= 2e-3 * dense_m_s,
                "{words}: {found_m_s} for {dense_m_s}"
            );
            assert!(
                expected_m_s.is_nan() || (found_m_s - expected_m_s).abs() <= 0.015 * expected_m_s,
                "{words}: {found_m_s}"
            );
            let warned = plan
                .warnings
                .iter()
                .any(|w| w.contains("reaches") && w.contains("19.4 m/s"));
            assert_eq!(warned, dense_m_s > 19.375, "{words}: {:?}", plan.warnings);
        }
        assert!(plan(Target::Map, |_| {}).warnings.is_empty());
    }
}
