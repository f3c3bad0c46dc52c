//! Circulations of pairs in turbulence through raw signals, spectra and their peaks: errors against their standard errors, with and without
//! the turbulence of each scan in the covariance.

use std::path::Path;
use wakescope_sim::plan::{Plan, Target};
use wakescope_sim::progress::Silent;
use wakescope_sim::retrieve::RetrievalRow;
use wakescope_sim::run;
use wakescope_sim::scene::SceneFile;

/// A pair of 400 m²/s at 10 dB in turbulence of a dissipation, m²/s³, and an outer scale, m, or in still air, seen by lines that far apart, rad.
struct Scans {
    air: Option<(f64, f64)>,
    step_rad: f64,
    count: usize,
}

impl Scans {
    fn scene(&self, turbulence: &str) -> SceneFile {
        let Self {
            air,
            step_rad,
            count,
        } = self;
        let mut text = format!(
            "seed = 11
            [detector.snr]
            reference = \"fixed\"
            snr_db = 10.0
            [flow]
            kind = \"vortex_pair\"
            circulation_m2_s = 400.0
            core_radius_m = 2.1
            height_m = 60.0
            [scan]
            elevation_min_rad = 0.02
            elevation_max_rad = 0.265
            elevation_step_rad = {step_rad:e}
            range_min_m = 300.0
            range_max_m = 500.0
            pulses_per_line = 4
            realisations = {count}
            [estimator]
            gate_step_samples = 15
            [retrieval]
            turbulence = \"{turbulence}\"
            "
        );
        if let Some((dissipation_m2_s3, outer_scale_m)) = air {
            text += &format!(
                "[[added_flows]]
                kind = \"eddies\"
                dissipation_m2_s3 = {dissipation_m2_s3:e}
                outer_scale_m = {outer_scale_m:?}
                realisations = \"each\"
                "
            );
        }
        SceneFile::parse(&text, Path::new("turbulence.toml")).unwrap()
    }

    /// The vortices of all scans, a row for each, found or not.
    fn rows(&self, turbulence: &str) -> Vec<RetrievalRow> {
        let plan = Plan::new(self.scene(turbulence), Target::Run).unwrap();
        run::run(&plan, &Silent).unwrap().retrieval.unwrap().rows
    }
}

/// Errors of circulation, lateral coordinate and height with their standard errors; none of a vortex that is not found.
fn errors(row: &RetrievalRow) -> Option<[(f64, f64); 3]> {
    let found = row.found?;
    let of = |measured: wakescope_estimate::Measured, truth: wakescope_estimate::Measured| {
        (measured.value - truth.value, measured.std)
    };
    Some([
        of(found.circulation_m2_s, row.truth.circulation_m2_s),
        of(found.lateral_position_m, row.truth.lateral_position_m),
        of(found.height_m, row.truth.height_m),
    ])
}

/// Errors of one number over many vortices.
struct Summary {
    mean: f64,
    rms: f64,
    stated: f64,
    covered: f64,
}

impl Summary {
    fn new(rows: &[RetrievalRow], number: usize) -> Self {
        let mut sums = [0.0; 5];
        for own in rows.iter().filter_map(errors) {
            let (error, std) = own[number];
            let is_covered = f64::from(u8::from(error.abs() < 1.96 * std));
            let terms = [1.0, error, error * error, std * std, is_covered];
            for (sum, term) in sums.iter_mut().zip(terms) {
                *sum += term;
            }
        }
        let [count, error, square, stated, covered] = sums;
        Self {
            mean: error / count,
            rms: (square / count).sqrt(),
            stated: (stated / count).sqrt(),
            covered: covered / count,
        }
    }
}

/// Difference of the squared errors of the circulations that both retrievals find, second less first, and its standard error, m⁴/s².
fn difference(first: &[RetrievalRow], second: &[RetrievalRow]) -> (f64, f64) {
    let mut sums = [0.0; 3];
    for (a, b) in first.iter().zip(second) {
        let (Some(a), Some(b)) = (errors(a), errors(b)) else {
            continue;
        };
        let change = b[0].0.powi(2) - a[0].0.powi(2);
        sums[0] += 1.0;
        sums[1] += change;
        sums[2] += change * change;
    }
    let mean = sums[1] / sums[0];
    (mean, ((sums[2] / sums[0] - mean * mean) / sums[0]).sqrt())
}

/// What was found, in words.
fn described(name: &str, rows: &[RetrievalRow]) -> String {
    let found = rows.iter().filter(|row| row.found.is_some()).count();
    let mut text = format!("{name}: {found} of {} vortices", rows.len());
    for (number, of) in ["Gamma", "y", "z"].into_iter().enumerate() {
        let own = Summary::new(rows, number);
        text += &format!(
            "\n  {of:5} mean {:.3}, rms {:.3}, stated {:.3}, ratio {:.2}, coverage {:.3}",
            own.mean,
            own.rms,
            own.stated,
            own.stated / own.rms,
            own.covered
        );
    }
    text
}

/// Three scans of moderate turbulence, of which a fit to independent velocities knows nothing.
#[test]
fn standard_errors_contain_the_turbulence_of_each_scan() {
    let scans = Scans {
        air: Some((5e-4, 60.0)),
        step_rad: 5e-3,
        count: 3,
    };
    let independent = Summary::new(&scans.rows("none"), 0);
    let rows = scans.rows("auto");
    println!("{}", described("auto", &rows));
    let own = Summary::new(&rows, 0);
    assert!(own.stated > 1.15 * independent.stated, "{}", own.stated);
    let ratio = own.stated / own.rms;
    assert!((0.5..2.5).contains(&ratio), "{ratio}");
}

/// `SCANS=24 cargo test --release -p wakescope-tests --test it -- --ignored --nocapture circulations_through_signals`
#[test]
#[ignore = "half an hour for 24 scans in each air, with and without its turbulence"]
fn circulations_in_turbulence_through_signals_have_the_stated_errors() {
    let count = std::env::var("SCANS").map_or(200, |scans| scans.parse().unwrap());
    for air in [
        None,
        Some((4e-5, 100.0)),
        Some((5e-4, 60.0)),
        Some((1.45e-2, 100.0)),
    ] {
        let scans = Scans {
            air,
            step_rad: 2.5e-3,
            count,
        };
        println!("{air:?}");
        let independent = scans.rows("none");
        println!("{}", described("none", &independent));
        let correlated = scans.rows("auto");
        println!("{}", described("auto", &correlated));
        let (worse, error) = difference(&independent, &correlated);
        println!("  square of the error, auto less none: {worse:.1} +- {error:.1} m^4/s^2");
    }
}
