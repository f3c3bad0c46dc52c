//! A uniform wind comes out as it is, at any speed in the band.

use wakescope_sim::measure::map::VelocityEstimates;
use wakescope_sim::plan::{Plan, Target};
use wakescope_sim::progress::Silent;
use wakescope_sim::run;
use wakescope_sim::scene::{Flow, Refinement, Scene, SceneFile, SnrReference};

/// Errors of the map of a uniform wind.
fn map(lateral_m_s: f64, change: impl Fn(&mut Scene)) -> VelocityEstimates {
    let mut scene = Scene {
        flow: Flow::Uniform {
            lateral_m_s,
            vertical_m_s: 0.0,
        },
        ..Scene::default()
    };
    scene.detector.snr = SnrReference::Fixed { snr_db: 10.0 };
    // Lines far apart and gates a pulse apart: the cells of the map are independent.
    scene.scan.elevation_max_rad = 0.2;
    scene.scan.elevation_step_rad = 0.02;
    scene.scan.pulses_per_line = 8;
    scene.scan.realisations = 12;
    scene.estimator.gate_step_samples = 150;
    change(&mut scene);
    let plan = Plan::new(SceneFile::new(scene).unwrap(), Target::Map).unwrap();
    run::run(&plan, &Silent).unwrap().map.unwrap()
}

/// Mean error over the cells of a map, and its standard error, m/s.
fn bias_m_s(map: &VelocityEstimates) -> (f64, f64) {
    let n = map.bias_m_s.len() as f64;
    let mean = map.bias_m_s.sum() / n;
    let variance = map.bias_m_s.mapv(|b| (b - mean).powi(2)).sum() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

#[test]
fn uniform_wind_has_no_bias_above_5_cm_per_second() {
    for speed_m_s in [-15.3, -3.7, 0.0, 0.4, 7.1, 14.9] {
        let (bias, error) = bias_m_s(&map(speed_m_s, |_| {}));
        assert!(error < 0.02, "the test resolves the bar: {error}");
        assert!(
            bias.abs() + error < 0.05,
            "{speed_m_s} m/s: bias {bias} +- {error} m/s"
        );
    }
}

#[test]
fn without_interpolation_calm_air_never_reads_zero() {
    // 64 bins are 3.03 m/s apart and none is at 0 m/s: the nearest read +1.45 and -1.57 m/s.
    let literal = map(0.0, |s| {
        s.estimator.padded_samples = 64;
        s.estimator.refinement = Refinement::None;
    });
    assert!(
        literal
            .rms_m_s
            .iter()
            .all(|&rms| (1.45..1.58).contains(&rms)),
        "{}",
        literal.rms_m_s
    );
    let interpolated = map(0.0, |_| {});
    assert!(
        interpolated.rms_m_s.iter().all(|&rms| rms < 0.5),
        "{}",
        interpolated.rms_m_s
    );
}
