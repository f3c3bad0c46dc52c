//! The power of the simulated signal against (14), through all crates that have a part in it.

use wakescope_optics::EfficiencyProfile;
use wakescope_optics::theory::free_space_efficiency;
use wakescope_sim::plan::{Plan, Target};
use wakescope_sim::progress::Silent;
use wakescope_sim::run;
use wakescope_sim::scene::{Flow, NoiseModel, Scene, SceneFile};

fn plan(change: impl Fn(&mut Scene)) -> Plan {
    let mut scene = Scene {
        flow: Flow::Calm {},
        ..Scene::default()
    };
    scene.scan.elevation_max_rad = 0.1;
    scene.scan.elevation_step_rad = 0.01;
    scene.scan.pulses_per_line = 300;
    change(&mut scene);
    Plan::new(SceneFile::new(scene).unwrap(), Target::Signal).unwrap()
}

const SPEED_OF_LIGHT_M_S: f64 = 299_792_458.0;

/// (14) as it is written, for a return that changes slowly over the pulse, in even air.
fn of_14(plan: &Plan, range_m: f64, efficiency: f64) -> f64 {
    let (scene, air) = (plan.scene(), &plan.scene().atmosphere);
    let photon_j = 6.626_070_15e-34 * SPEED_OF_LIGHT_M_S / scene.laser.wavelength_m;
    let photons = scene.detector.quantum_efficiency * scene.pulse.energy_j / photon_j;
    let area_m2 = std::f64::consts::PI * scene.telescope.aperture_radius_m.powi(2);
    let seen =
        (-2.0 * air.extinction_per_m * range_m).exp() * area_m2 / (range_m * range_m) * efficiency;
    photons / scene.detector.bandwidth_hz
        * 0.5
        * SPEED_OF_LIGHT_M_S
        * air.backscatter_per_m_sr
        * seen
}

/// Mean square of the current and its standard error over the pulses, A^2.
fn mean_square_a2(plan: &Plan) -> (f64, f64) {
    let signals = run::run(plan, &Silent).unwrap().signals_a.unwrap();
    let of_pulse: Vec<f64> = signals
        .rows()
        .into_iter()
        .map(|r| r.dot(&r) / r.len() as f64)
        .collect();
    let n = of_pulse.len() as f64;
    let mean = of_pulse.iter().sum::<f64>() / n;
    let variance = of_pulse.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

#[test]
fn mean_signal_power_over_noise_power_is_the_snr_of_14() {
    let plan = plan(|s| s.detector.noise = NoiseModel::None);
    let (power_a2, error_a2) = mean_square_a2(&plan);
    let noise_a2 = plan.instrument.receiver.noise_variance_a2();
    let telescope = &plan.instrument.telescope;
    // The mean over the samples of the record.
    let g = &plan.geometry;
    let expected = (0..g.samples)
        .map(|k| plan.scene().scan.range_min_m + k as f64 * g.sample_spacing_m)
        .map(|r| of_14(&plan, r, free_space_efficiency(telescope, r).unwrap()))
        .sum::<f64>()
        / g.samples as f64;
    let (snr, error) = (power_a2 / noise_a2, error_a2 / noise_a2);
    assert!(
        error / expected < 0.01,
        "the test resolves a per cent: {error}"
    );
    assert!(
        (snr - expected).abs() < 3.5 * error,
        "SNR {snr} +- {error}, (14) gives {expected}"
    );
}

#[test]
fn noise_power_is_13_in_the_band_and_two_and_a_half_times_that_if_white() {
    for (kind, factor) in [(NoiseModel::BandLimited, 1.0), (NoiseModel::White, 2.5)] {
        let plan = plan(|s| {
            s.detector.noise = kind;
            s.atmosphere.backscatter_per_m_sr = 0.0;
        });
        let (power_a2, error_a2) = mean_square_a2(&plan);
        let expected_a2 = factor * plan.instrument.receiver.noise_variance_a2();
        assert!(
            (power_a2 - expected_a2).abs() < 3.5 * error_a2,
            "{kind:?}: {power_a2} +- {error_a2}, not {expected_a2}"
        );
        assert!(error_a2 < 0.005 * expected_a2);
    }
}

#[test]
fn power_does_not_depend_on_the_layer_thickness() {
    // A steep flow makes the layers thinner; at rest the same scene has layers of one sample.
    let [thick, mut thin] = [(), ()].map(|()| plan(|s| s.detector.noise = NoiseModel::None));
    let factor = 4;
    let g = &mut thin.geometry;
    g.layer_thickness_m /= factor as f64;
    g.layers *= factor;
    g.layers_per_sample = (g.layers_per_sample - 1) * factor + 1;
    let ((a, a_error), (b, b_error)) = (mean_square_a2(&thick), mean_square_a2(&thin));
    assert!(
        (a - b).abs() < 3.5 * a_error.hypot(b_error),
        "{a} +- {a_error} and {b} +- {b_error}"
    );
}

#[test]
fn power_through_a_near_focus_is_14_over_the_pulse() {
    for (focus_m, radii_m, ends_m, at_m) in [
        (300.0, [0.05, 0.03], [150.0, 900.0], 180.0),
        (600.0, [0.15, 0.09], [200.0, 1500.0], 555.0),
    ] {
        let plan = plan(|s| {
            s.detector.noise = NoiseModel::None;
            s.telescope.focus_m = focus_m;
            [s.telescope.aperture_radius_m, s.telescope.beam_radius_m] = radii_m;
            [s.scan.range_min_m, s.scan.range_max_m] = ends_m;
            s.scan.pulses_per_line = 200;
        });
        let g = &plan.geometry;
        let range_m = |k: usize| plan.scene().scan.range_min_m + k as f64 * g.sample_spacing_m;
        let near: Vec<usize> = (0..g.samples)
            .filter(|k| (range_m(*k) - at_m).abs() < 8.0)
            .collect();
        let signals = run::run(&plan, &Silent).unwrap().signals_a.unwrap();
        let of_pulse: Vec<f64> = signals
            .rows()
            .into_iter()
            .map(|r| near.iter().map(|k| r[*k].powi(2)).sum::<f64>() / near.len() as f64)
            .collect();
        let n = of_pulse.len() as f64;
        let mean = of_pulse.iter().sum::<f64>() / n;
        let error =
            (of_pulse.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / (n - 1.0) / n).sqrt();
        // The air that the pulse lights, quadrature by quadrature a metre apart.
        let telescope = &plan.instrument.telescope;
        let (first_m, last_m) = (at_m - 120.0, at_m + 120.0);
        let metres: Vec<f64> = (0..=240)
            .map(|i| first_m + f64::from(i) * (last_m - first_m) / 240.0)
            .collect();
        let eta = EfficiencyProfile::from_theory(&metres, |r| free_space_efficiency(telescope, r))
            .unwrap();
        // (14) as it is written: the mean over the pulse, in steps of a fifth of a metre.
        let sigma_m = 0.5 * SPEED_OF_LIGHT_M_S * plan.instrument.pulse.sigma_s();
        let snr = |k: &usize| {
            let weighted = (-500..=500).map(|i| 0.2 * f64::from(i)).map(|offset_m| {
                let r = range_m(*k) + offset_m;
                let weight = (-(offset_m / sigma_m).powi(2)).exp()
                    / (std::f64::consts::PI.sqrt() * sigma_m)
                    * 0.2;
                weight
                    * of_14(
                        &plan,
                        r,
                        eta.interpolated(r.clamp(first_m, last_m)).unwrap(),
                    )
            });
            weighted.sum::<f64>()
        };
        let expected = near.iter().map(snr).sum::<f64>() / near.len() as f64;
        let noise_a2 = plan.instrument.receiver.noise_variance_a2();
        let (found, error) = (mean / noise_a2, error / noise_a2);
        assert!(
            error / expected < 0.04,
            "the test resolves a fifth of a decibel: {error} {expected}"
        );
        assert!(
            (found - expected).abs() < 3.5 * error,
            "{focus_m}: {found} +- {error}, (14) gives {expected}"
        );
    }
}
