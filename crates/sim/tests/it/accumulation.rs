//! Velocities from products of samples that are drawn at once, against those from records.

use std::path::Path;

use wakescope_sim::io::csv::Column;
use wakescope_sim::measure::map::VelocityEstimates;
use wakescope_sim::measure::recorded::predicted_table;
use wakescope_sim::plan::{Plan, Stage, Target};
use wakescope_sim::progress::Silent;
use wakescope_sim::run::run;
use wakescope_sim::scene::SceneFile;
use wakescope_sim::sweep::maps;

/// Records of 32 samples of a wind that changes by 4 m/s along them; three gates, whose windows share samples.
const SCENE: &str = r#"
[detector]
SIGNAL
snr = { reference = "fixed", snr_db = SNR }
[pulse.shape]
kind = "gaussian"
duration_s = 60e-9
[flow]
kind = "linear"
velocity_m_s = [0.0, -20.0, 0.0]
gradient_v_per_s = [0.0, 0.2, 0.0]
[scan]
elevation_min_rad = 0.1
elevation_max_rad = 0.4
elevation_step_rad = 0.1
range_min_m = 100.0
range_max_m = 118.6
pulses_per_line = PULSES
realisations = REALISATIONS
accumulation = "ACCUMULATION"
[estimator]
window_samples = 16
window_step_samples = 4
gate_step_samples = 8
METHOD
"#;

/// All methods; their regions hold three windows of a line.
const METHODS: [&str; 6] = [
    "padded_samples = 64\nmethod.kind = \"periodogram\"",
    "padded_samples = 64\nradius_m = 2.5\nmethod.kind = \"periodogram_accumulation\"",
    "padded_samples = 64\nradius_m = 2.5\nweighting = \"rectangular\"\nmethod = { kind = \"autoregressive\", order = 4 }",
    "radius_m = 2.5\nweighting = \"rectangular\"\nmethod.kind = \"pulse_pair\"",
    "padded_samples = 64\nradius_m = 2.5\nweighting = \"rectangular\"\nmethod.kind = \"first_moment\"",
    "padded_samples = 64\nradius_m = 2.5\nmethod.kind = \"likelihood\"",
];

/// Lines of a scan.
const LINES: usize = 4;

/// Errors beyond this are outliers, m/s: the band reaches from -19 to 19 m/s.
const OUTLIER_M_S: f64 = 7.0;

/// Fewest errors without outliers whose moments are compared.
const FEWEST: usize = 10;

/// Signals of a scene, and the pulses of a line.
#[derive(Debug, Clone, Copy)]
struct Case {
    /// Keys of the detector.
    signal: &'static str,
    pulses: usize,
    snr_db: f64,
    /// Realisations of the four lines.
    realisations: usize,
}

impl Case {
    fn scene(&self, accumulation: &str, method: &str) -> SceneFile {
        let text = SCENE
            .replace("SIGNAL", self.signal)
            .replace("SNR", &format!("{:?}", self.snr_db))
            .replace("PULSES", &self.pulses.to_string())
            .replace("REALISATIONS", &self.realisations.to_string())
            .replace("ACCUMULATION", accumulation)
            .replace("METHOD", method);
        SceneFile::parse(&text, Path::new("scene.toml")).unwrap()
    }

    /// Errors of each method at each gate, m/s, over all lines and realisations.
    fn errors_m_s(&self, accumulation: &str) -> Vec<Vec<Vec<f64>>> {
        let scenes = METHODS.map(|method| self.scene(accumulation, method));
        let maps = maps(&scenes, &Silent).unwrap();
        let mut errors_m_s = Vec::new();
        for (plan, map) in &maps {
            assert_eq!(is_drawn(plan), accumulation == "auto", "{self:?}");
            errors_m_s.push(errors_of_gates_m_s(map));
        }
        errors_m_s
    }
}

fn is_drawn(plan: &Plan) -> bool {
    let mut stages = plan.stages.iter();
    let signals = stages.find(|stage| stage.stage == Stage::Signals).unwrap();
    signals.reason.ends_with("all pulses drawn at once")
}

fn errors_of_gates_m_s(map: &VelocityEstimates) -> Vec<Vec<f64>> {
    let mut gates = vec![Vec::new(); map.range_m.len()];
    for scan in &map.scans {
        for ((_, gate), error_m_s) in scan.error_m_s.indexed_iter() {
            gates[gate].push(*error_m_s);
        }
    }
    gates
}

/// A number from a sample, with its standard error.
#[derive(Debug, Clone, Copy)]
struct Estimate {
    value: f64,
    standard_error: f64,
}

impl Estimate {
    /// Of a sample too small to tell.
    const UNKNOWN: Self = Self {
        value: 0.0,
        standard_error: f64::INFINITY,
    };

    /// Difference over its standard error.
    fn deviation(&self, other: &Self) -> f64 {
        let apart = (self.value - other.value).abs();
        if apart == 0.0 {
            return 0.0;
        }
        apart / self.standard_error.hypot(other.standard_error)
    }
}

/// Mean and logarithm of the standard deviation of errors without outliers, and the share of outliers.
fn statistics(errors_m_s: &[f64]) -> [Estimate; 3] {
    let good: Vec<f64> = errors_m_s
        .iter()
        .copied()
        .filter(|error| error.abs() < OUTLIER_M_S)
        .collect();
    let all = errors_m_s.len() as f64;
    let n = good.len() as f64;
    let share = 1.0 - n / all;
    // Of one more outlier, so that none still has an error.
    let bounded = (share + 1.0 / all).min(1.0 - 1.0 / all);
    let share = Estimate {
        value: share,
        standard_error: (bounded * (1.0 - bounded) / all).sqrt(),
    };
    if good.len() < FEWEST {
        return [Estimate::UNKNOWN, Estimate::UNKNOWN, share];
    }
    let mean = good.iter().sum::<f64>() / n;
    let variance = good.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / n;
    let fourth = good.iter().map(|e| (e - mean).powi(4)).sum::<f64>() / n;
    [
        Estimate {
            value: mean,
            standard_error: (variance / n).sqrt(),
        },
        Estimate {
            value: 0.5 * variance.ln(),
            standard_error: ((fourth / variance.powi(2) - 1.0) / (4.0 * n)).sqrt(),
        },
        share,
    ]
}

/// Correlation between the errors of neighbouring gates without outliers, by Fisher's transform.
fn correlation(first_m_s: &[f64], second_m_s: &[f64]) -> Estimate {
    let mut sums = [0.0; 6];
    for (a, b) in first_m_s.iter().zip(second_m_s) {
        if a.abs().max(b.abs()) < OUTLIER_M_S {
            for (sum, term) in sums.iter_mut().zip([1.0, *a, *b, a * a, b * b, a * b]) {
                *sum += term;
            }
        }
    }
    let [n, a, b, aa, bb, ab] = sums;
    if n < FEWEST as f64 {
        return Estimate::UNKNOWN;
    }
    let covariance = ab - a * b / n;
    let variances = (aa - a * a / n) * (bb - b * b / n);
    Estimate {
        value: (covariance / variances.sqrt()).atanh(),
        standard_error: 1.0 / (n - 3.0).sqrt(),
    }
}

/// Compares all methods and gates of a case; the largest deviation in standard errors.
fn compare(case: Case) -> f64 {
    let records = case.errors_m_s("records");
    let draws = case.errors_m_s("auto");
    let mut largest = 0.0_f64;
    for (method, (records, draws)) in records.iter().zip(&draws).enumerate() {
        let mut deviations = Vec::new();
        for (gate, (records, draws)) in records.iter().zip(draws).enumerate() {
            assert_eq!(records.len(), LINES * case.realisations);
            for (a, b) in statistics(records).iter().zip(statistics(draws)) {
                deviations.push((gate, a.deviation(&b), *a, b));
            }
        }
        for gate in 1..records.len() {
            let a = correlation(&records[gate - 1], &records[gate]);
            let b = correlation(&draws[gate - 1], &draws[gate]);
            deviations.push((gate, a.deviation(&b), a, b));
        }
        for found in deviations {
            assert!(found.1 < 4.0, "{case:?} {}: {found:?}", METHODS[method]);
            largest = largest.max(found.1);
        }
    }
    largest
}

const REAL_BAND: &str = "signal = \"intermediate_frequency\"\nnoise = \"band\"";
const REAL_WHITE: &str = "signal = \"intermediate_frequency\"\nnoise = \"white\"";
const COMPLEX_BAND: &str = "signal = \"baseband\"\nnoise = \"band\"";
const COMPLEX_WHITE: &str = "signal = \"baseband\"\nnoise = \"white\"";

/// As many pulses as samples, more, and thousands, with weaker signals; `lines` of each.
fn compare_counts(signal: &'static str, lines: [usize; 3]) {
    let counts = [(32, -1.0), (500, -8.0), (4000, -13.0)];
    for ((pulses, snr_db), lines) in counts.into_iter().zip(lines) {
        let largest = compare(Case {
            signal,
            pulses,
            snr_db,
            realisations: lines / LINES,
        });
        eprintln!(
            "{signal:?}, {pulses} pulses, {lines} lines: at most {largest:.2} standard errors"
        );
    }
}

#[test]
fn velocities_of_real_records_and_draws_agree_in_band_noise() {
    compare_counts(REAL_BAND, [600, 60, 12]);
}

#[test]
fn velocities_of_real_records_and_draws_agree_in_white_noise() {
    compare_counts(REAL_WHITE, [600, 60, 12]);
}

#[test]
fn velocities_of_complex_records_and_draws_agree_in_band_noise() {
    compare_counts(COMPLEX_BAND, [600, 60, 12]);
}

#[test]
fn velocities_of_complex_records_and_draws_agree_in_white_noise() {
    compare_counts(COMPLEX_WHITE, [600, 60, 12]);
}

#[test]
#[ignore = "takes minutes: 2000 lines by records, each"]
fn velocities_of_two_thousand_lines_agree() {
    for signal in [REAL_BAND, REAL_WHITE, COMPLEX_BAND, COMPLEX_WHITE] {
        compare_counts(signal, [2000; 3]);
    }
}

/// A uniform wind along lines that share nothing.
fn uniform(pulses: usize, snr_db: f64, words: &str) -> Plan {
    let text = format!(
        r#"
[detector]
noise = "white"
snr = {{ reference = "fixed", snr_db = {snr_db:?} }}
[flow]
kind = "uniform"
lateral_m_s = 6.0
vertical_m_s = 0.0
[scan]
elevation_min_rad = 0.0
elevation_max_rad = 0.06
elevation_step_rad = 0.02
range_min_m = 320.0
range_max_m = 380.0
pulses_per_line = {pulses}
realisations = 50
{words}
[estimator]
method.kind = "likelihood"
radius_m = 3.0
gate_step_samples = 16
"#
    );
    let scene = SceneFile::parse(&text, Path::new("scene.toml")).unwrap();
    Plan::new(scene, Target::Map).unwrap()
}

/// Standard deviation of the estimates over the predicted one, over all cells, with its standard error.
fn scatter_over_prediction(plan: &Plan) -> (f64, f64) {
    let map = run(plan, &Silent).unwrap().map.unwrap();
    let table = predicted_table(plan, &map).unwrap();
    let is_predicted = |(name, _): &&(String, Column)| name == "predicted_std_m_s";
    let Some((_, Column::Float(predicted_m_s))) = table.columns().iter().find(is_predicted) else {
        panic!("a column of floats")
    };
    let mut sum = 0.0;
    for (std_m_s, predicted_m_s) in map.std_m_s.iter().zip(predicted_m_s) {
        sum += (std_m_s / predicted_m_s).powi(2);
    }
    let cells = predicted_m_s.len() as f64;
    // Lines and realisations are independent, gates hardly.
    let independent = (map.elevation_rad.len() * map.scans.len()) as f64;
    ((sum / cells).sqrt(), (0.5 / independent).sqrt())
}

#[test]
fn scatter_of_thousands_of_pulses_keeps_to_the_bound_as_that_of_four() {
    let few = uniform(4, 5.0, "");
    let many = uniform(4000, -15.0, "");
    assert!(!is_drawn(&few) && is_drawn(&many));
    for plan in [few, many] {
        let (ratio, error) = scatter_over_prediction(&plan);
        assert!(ratio > 1.0 - 3.0 * error, "{ratio} +- {error}");
        assert!(ratio < 1.15 + 3.0 * error, "{ratio} +- {error}");
    }
}

#[test]
fn draws_have_the_same_bits_on_any_threads_and_beside_other_estimators() {
    let case = Case {
        signal: COMPLEX_BAND,
        pulses: 1000,
        snr_db: -6.0,
        realisations: 3,
    };
    let with_threads = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| case.errors_m_s("auto"))
    };
    let one = with_threads(1);
    assert_eq!(one, with_threads(2));
    assert_eq!(one, with_threads(5));
    for (method, errors_m_s) in METHODS.iter().zip(&one) {
        let alone = maps(&[case.scene("auto", method)], &Silent).unwrap();
        assert_eq!(&errors_of_gates_m_s(&alone[0].1), errors_m_s, "{method}");
    }
}

#[test]
fn plans_say_why_records_are_simulated_and_need_no_more_for_more_pulses() {
    let reason = |plan: &Plan| {
        let mut stages = plan.stages.iter();
        let signals = stages.find(|stage| stage.stage == Stage::Signals).unwrap();
        signals.reason.clone()
    };
    let thousands = uniform(4000, 0.0, "");
    let more = uniform(40_000, 0.0, "");
    assert!(is_drawn(&thousands), "{}", reason(&thousands));
    assert!((more.memory_bytes() / thousands.memory_bytes() - 1.0).abs() < 1e-9);
    assert!((more.core_s() / thousands.core_s() - 1.0).abs() < 1e-9);
    for (words, why) in [
        (
            "accumulation = \"records\"",
            "scan.accumulation = \"records\"",
        ),
        (
            "[telescope]\nreflection_db = -60.0",
            "telescope.reflection_db acts on each",
        ),
        (
            "[laser]\nlinewidth_hz = 1e3",
            "laser.linewidth_hz acts on each",
        ),
        (
            "wind_of_pulses.kind = \"pulse\"",
            "scan.wind_of_pulses acts on each",
        ),
        (
            "[detector.digitiser]\nkind = \"quantised\"\nbits = 8\nfull_scale_over_noise = 6.0",
            "detector.digitiser acts on each",
        ),
    ] {
        let plan = uniform(4000, 0.0, words);
        assert!(reason(&plan).ends_with(why), "{}", reason(&plan));
    }
    let few = uniform(4, 0.0, "");
    assert!(reason(&few).ends_with("layers each"), "{}", reason(&few));
    let text = "[laser]\nlinewidth_hz = 1e3\n[scan]\naccumulation = \"records\"\n";
    let refused = SceneFile::parse(text, Path::new("s.toml")).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "s.toml:4: scan.accumulation = \"records\" is not allowed: laser.linewidth_hz has every record simulated anyway: \
         take the line out"
    );
}
