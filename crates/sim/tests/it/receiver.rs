//! A real receiver in a scene: what its keys do to whole runs, and what `wakescope budget` prints.

use std::path::Path;
use wakescope_sim::plan::{Plan, Target};
use wakescope_sim::progress::Silent;
use wakescope_sim::run::{RunResult, run};
use wakescope_sim::scene::SceneFile;

fn plan(words: &str, target: Target) -> Plan {
    let text = format!(
        "flow = {{ kind = \"uniform\", lateral_m_s = 4.0, vertical_m_s = 0.0 }}\n{words}\n\
         [scan]\nelevation_min_rad = 0.05\nelevation_max_rad = 0.058\nelevation_step_rad = 2e-3\nrange_min_m = 300.0\n\
         range_max_m = 400.0\npulses_per_line = 40\nrealisations = 3\nSECOND\n[outputs]\nsignals = true\nprofile_points = 3\n"
    );
    let second = if words.contains("# second") {
        "second_trip = { radial_velocity_m_s = -6.0 }"
    } else {
        ""
    };
    let file = SceneFile::parse(&text.replace("SECOND", second), Path::new("s.toml"));
    Plan::new(file.unwrap_or_else(|e| panic!("{e}\n{text}")), target).unwrap()
}

fn signals(words: &str) -> (Plan, RunResult) {
    let plan = plan(words, Target::Signal);
    let result = run(&plan, &Silent).unwrap();
    (plan, result)
}

/// Mean square of the raw signals and its standard error, for noise with some independent samples a record.
fn mean_square(result: &RunResult, independent: f64) -> (f64, f64) {
    let signals = result.signals_a.as_ref().unwrap();
    let mean = signals.iter().map(|x| x * x).sum::<f64>() / signals.len() as f64;
    (
        mean,
        mean * (2.0 / (signals.nrows() as f64 * independent)).sqrt(),
    )
}

/// The same about the mean, which codes that are not symmetric have.
fn variance(result: &RunResult, independent: f64) -> (f64, f64) {
    let signals = result.signals_a.as_ref().unwrap();
    let mean = signals.iter().sum::<f64>() / signals.len() as f64;
    let centred = RunResult {
        signals_a: Some(signals - mean),
        ..RunResult::default()
    };
    mean_square(&centred, independent)
}

const DARK: &str = "[atmosphere]\nbackscatter_per_m_sr = 0.0\n[detector]\nnoise = \"white\"\n";
const FRONT_END: &str = "[detector.front_end]\namplifier_noise_a_rthz = 10e-12\nload_ohm = 100.0\ndark_current_a = 5e-5\n\
    intensity_noise_db_hz = -150.0\nrejection_db = 5.0\nsaturation_w = 5e-3\nhalf_power_hz = 100e6\n";

#[test]
fn the_noise_of_the_signals_is_that_which_the_ratio_counts() {
    let ideal = plan(DARK, Target::Signal).instrument.receiver;
    let (plan, result) = signals(&format!("{DARK}{FRONT_END}"));
    let receiver = plan.instrument.receiver;
    let (found, error) = mean_square(&result, plan.geometry.samples as f64);
    let expected = receiver.noise_density_a2_hz() * 125e6;
    assert!(
        (found - expected).abs() < 3.0 * error,
        "{found} {expected} {error}"
    );
    let lost_db =
        10.0 * (ideal.slowly_varying_snr(1.0, 1.0) / receiver.slowly_varying_snr(1.0, 1.0)).log10();
    assert!(
        (lost_db - receiver.penalties().total_db()).abs() < 1e-9 && lost_db > 3.0,
        "{lost_db}"
    );
}

#[test]
fn the_noise_of_clipped_samples_is_that_of_maps() {
    for (bits, full_scale) in [(8, 2.0), (8, 3.0), (4, 4.0), (2, 3.0), (3, 1.5)] {
        let digitiser = format!(
            "digitiser = {{ kind = \"quantised\", bits = {bits}, full_scale_over_noise = {full_scale:?} }}\n"
        );
        let (plan, result) = signals(&format!("{DARK}{digitiser}"));
        let (found, error) = variance(&result, plan.geometry.samples as f64);
        let receiver = plan.instrument.receiver;
        let density = receiver.sampled_noise_a2() / plan.scene().detector.bandwidth_hz;
        let expected = density * 0.5 * plan.scene().detector.sampling_hz;
        assert!(
            (found - expected).abs() < 3.0 * error,
            "{bits} bits: {found} {expected} {error}"
        );
    }
}

#[test]
fn a_map_has_the_ratio_of_the_scene_with_a_converter_of_few_bits() {
    let of_map = |snr_db: f64, bits: u32, full_scale: f64, words: &str| {
        let plan = plan(
            &format!(
                "[detector]\nsnr = {{ reference = \"fixed\", snr_db = {snr_db:?} }}\n\
                 digitiser = {{ kind = \"quantised\", bits = {bits}, full_scale_over_noise = {full_scale:?} }}\n{words}\n"
            ),
            Target::Map,
        );
        let map = run(&plan, &Silent).unwrap().map.unwrap();
        let ratios: Vec<f64> = map.snr_db.iter().map(|db| 10f64.powf(0.1 * db)).collect();
        10.0 * (ratios.iter().sum::<f64>() / ratios.len() as f64).log10()
    };
    // 3 gates of 5 lines and 120 pulses; the speckle of a gate and pulse has a relative deviation of 1.
    for (snr_db, bits, full_scale, words, off_db) in [
        (-3.0, 3, 8.0, "", 0.0),
        (5.0, 3, 8.0, "", 0.0),
        (-3.0, 3, 8.0, "noise = \"white\"", 0.0),
        // With a full scale of 8 a step is 2.8 deviations of a quadrature: the ratio is 3 dB too high, as the page says.
        (-3.0, 3, 5.0, "signal = \"baseband\"", 0.0),
        // Clipping, by the table of the page.
        (-3.0, 8, 1.0, "", -5.0),
        (-3.0, 8, 2.0, "", -1.6),
        (-3.0, 8, 3.0, "", -0.3),
    ] {
        let found_db = of_map(snr_db, bits, full_scale, words);
        assert!(
            (found_db - snr_db - off_db).abs() < 0.35,
            "{bits} bits, {full_scale} x noise, {words}: {found_db} {snr_db}"
        );
    }
}

#[test]
fn losses_change_the_profile_by_their_decibels() {
    let snr_db = |words: &str| {
        let plan = plan(words, Target::Efficiency);
        run(&plan, &Silent).unwrap().profile.unwrap().snr_db
    };
    let plain = snr_db("");
    let lossy = snr_db("[telescope]\noptics_loss_db = 2.25\n");
    for (found, plain) in lossy.iter().zip(&plain) {
        assert!((found - plain + 2.25).abs() < 1e-9, "{found} {plain}");
    }
    let blind = snr_db("[telescope]\nblind_range_m = 150.0\n");
    assert!(blind[0].is_nan() && blind[1] == plain[1], "{blind:?}");
}

#[test]
fn the_echo_of_the_pulse_before_is_weaker_by_what_the_budget_says() {
    // Pulses 1.5 km apart, no noise.
    let words = "[laser]\npulse_repetition_hz = 100e3\n[detector]\nnoise = \"none\"\n";
    let (_, alone) = signals(words);
    let (plan, both) = signals(&format!("{words}# second"));
    let (first, second) = (
        alone.signals_a.as_ref().unwrap(),
        both.signals_a.as_ref().unwrap(),
    );
    let echo = RunResult {
        signals_a: Some(second - first),
        ..RunResult::default()
    };
    // The record is some two pulses long.
    let (found, error) = mean_square(&echo, 2.0);
    let reference = mean_square(&alone, 2.0);
    let budget = wakescope_sim::measure::budget::Budget::new(&plan, &[350.0], &Silent).unwrap();
    let expected = 10f64.powf(0.1 * budget.rows.last().unwrap().db[0]);
    let relative = (error / found).hypot(reference.1 / reference.0);
    assert_eq!(budget.rows.last().unwrap().name, "= pulse before over echo");
    assert!(
        (found / reference.0 / expected - 1.0).abs() < 3.0 * relative,
        "{} {expected}",
        found / reference.0
    );
}

#[test]
fn two_quadratures_hold_a_band_that_a_real_current_of_their_rate_does_not() {
    let words = "[detector]\nsignal = \"baseband\"\nsampling_hz = 50e6\nbandwidth_hz = 49e6\n\
        snr = { reference = \"fixed\", snr_db = 10.0 }\n[estimator]\nwindow_samples = 10\n";
    let map = run(&plan(words, Target::Map), &Silent)
        .unwrap()
        .map
        .unwrap();
    let count = map.v_mean_m_s.len() as f64;
    let error_m_s = map
        .v_mean_m_s
        .iter()
        .zip(&map.v_pulse_m_s)
        .map(|(a, b)| a - b)
        .sum::<f64>()
        / count;
    assert!(error_m_s.abs() < 0.15, "{error_m_s}");
    let refused = |words: &str| {
        SceneFile::parse(words, Path::new("s.toml"))
            .unwrap_err()
            .to_string()
    };
    let message = refused("[detector]\nsignal = \"baseband\"\nsampling_hz = 50e6\n");
    assert!(
        message.contains("detector.sampling_hz = 50e6 is not allowed: above 5e7 Hz"),
        "{message}"
    );
}

#[cfg(feature = "cli")]
#[test]
fn the_command_prints_tables_and_presets_that_check_takes() {
    let temp = tempfile::tempdir().unwrap();
    let output = |words: &[&str]| crate::wakescope(temp.path(), words);
    let stdout = |words: &[&str]| {
        let output = output(words);
        assert!(
            output.status.success(),
            "{words:?}: {}",
            String::from_utf8_lossy(&output.stderr)
        );
        String::from_utf8(output.stdout).unwrap()
    };
    stdout(&["init", "--preset", "halo_streamline", "s.toml"]);
    assert!(
        std::fs::read_to_string(temp.path().join("s.toml"))
            .unwrap()
            .contains("Nominal")
    );
    let checked = stdout(&["check", "s.toml", "--json"]);
    assert!(checked.contains("\"snr_db\""), "{checked}");
    let text = stdout(&["budget", "s.toml", "--range", "300,450", "--out", "out"]);
    assert!(
        text.contains("= SNR in the band") && text.contains("        300        450"),
        "{text}"
    );
    let table = std::fs::read_to_string(temp.path().join("out/budget.csv")).unwrap();
    assert!(
        table.contains("range_m,row,symbol,db") && table.contains("450.0,photons sent,E/(h nu),"),
        "{table}"
    );
    let json = stdout(&["budget", "s.toml", "--json"]);
    assert!(json.contains("\"mean_power_w\": 0.3"), "{json}");
    assert_eq!(
        output(&["budget", "s.toml", "--range", "0"]).status.code(),
        Some(2)
    );
    assert_eq!(
        output(&["init", "--preset", "lidar", "t.toml"])
            .status
            .code(),
        Some(2)
    );
}
