//! Figure 19: detection of wakes in maps, operating curves and the smallest circulation that is found against range.

use super::context::*;
use wakescope_estimate::Measured;
use wakescope_estimate::retrieval::{ScanMap, Turbulence};
use wakescope_estimate::wake_detection::DetectorOptions;
use wakescope_sim::detection::{Calibration, DetectionSettings, Power, SceneNoise, detect};
use wakescope_sim::measure::budget::snr_without_screens_db;
use wakescope_sim::measure::map::velocities;
use wakescope_sim::retrieve::gate_of;
use wakescope_sim::scene::Flow;

const FALSE_ALARM: f64 = 1e-2;
/// The turbulence of the second background.
const DEVIATION_M_S: f64 = 0.8;
const LENGTH_M: f64 = 25.0;
const AIR: Turbulence = Turbulence::Exponential {
    deviation_m_s: DEVIATION_M_S,
    length_m: LENGTH_M,
};
/// Height that is scanned and half the length of the scan, m.
const HEIGHT_M: f64 = 110.0;
const HALF_LENGTH_M: f64 = 110.0;
/// Where alarms in still air are counted \[m\].
const ALARM_RANGE_M: f64 = 400.0;

/// What is found at one range in one background.
struct Case {
    background: &'static str,
    range_m: f64,
    snr_db: f64,
    power: Power,
}

/// The lidar of Table 2 with a scan of the same extent about a range, lines so far apart there.
fn scene(range_m: f64, step_m: f64) -> Scene {
    let mut scene = Scene {
        flow: Flow::Calm {},
        ..Scene::default()
    };
    // windows of 64 samples overlap so far that each fourth one says nearly all
    scene.estimator.window_step_samples = 4;
    scene.scan.elevation_step_rad = step_m / range_m;
    scene.scan.elevation_max_rad = HEIGHT_M / range_m;
    scene.scan.range_min_m = range_m - HALF_LENGTH_M;
    scene.scan.range_max_m = range_m + HALF_LENGTH_M;
    scene.scan.realisations = 1;
    scene.outputs.svg = false;
    scene.outputs.png = false;
    scene
}

fn settings(
    plan: &Plan,
    noise: &SceneNoise,
    turbulence: Option<Turbulence>,
    rate: f64,
) -> Result<DetectionSettings, Failure> {
    Ok(DetectionSettings {
        false_alarm: rate,
        gate: gate_of(None, None, Some(plan.scene()))?.0,
        options: DetectorOptions {
            turbulence,
            ..DetectorOptions::default()
        },
        stride: noise.stride,
        seed: plan.scene().seed,
        ..DetectionSettings::default()
    })
}

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let ranges_m = context.profile.choose(
        vec![400.0],
        vec![300.0, 400.0, 600.0, 900.0],
        vec![300.0, 400.0, 600.0, 900.0],
    );
    let step_m = context.profile.choose(1.0, 0.5, 0.5);
    // Few scans tell a high rate alone.
    let (scans, rate) = context.profile.choose((8, 0.3), (300, 0.1), (1000, 0.1));
    let mut cases = Vec::new();
    let mut alarmed = None;
    for &range_m in &ranges_m {
        let plan = Plan::new(context.scene_file(scene(range_m, step_m))?, Target::Map)?;
        let snr_db = snr_without_screens_db(&plan, &[range_m])?
            .first()
            .copied()
            .unwrap_or(f64::NAN);
        let noise = SceneNoise::new(&plan, &Silent)?;
        for (background, turbulence) in [("still air", None), ("turbulence", Some(AIR))] {
            let settings = settings(&plan, &noise, turbulence, FALSE_ALARM)?;
            let empty = noise
                .empty_scan(&plan)
                .strided(settings.stride.0, settings.stride.1);
            let calibration = Calibration::new(&empty, &settings, &Silent)?;
            let power = calibration.power(&settings, &Silent)?;
            cases.push(Case {
                background,
                range_m,
                snr_db,
                power,
            });
        }
        if range_m == ALARM_RANGE_M {
            alarmed = Some(alarms(&plan, &noise, scans, rate)?);
        }
    }
    let alarmed = alarmed.ok_or_else(|| Failure::new(format!("no scan at {ALARM_RANGE_M} m")))?;
    let parameters = format!(
        "profile = \"{}\"\nrange_m = {ranges_m:?}\nline_spacing_m = {step_m}\nfalse_alarm = {FALSE_ALARM}\nturbulence = [{}, {}]\nscans_of_still_air = {scans}\nrate_counted = {rate}\n",
        context.profile.name(),
        DEVIATION_M_S,
        LENGTH_M
    );
    let origin = context.provenance_of_formula(&parameters);
    let mut out = Rendered::new(&table(&cases), &picture(&cases), &origin)?;
    out.values = vec![
        HEIGHT_M.to_string(),
        (2.0 * HALF_LENGTH_M).to_string(),
        FALSE_ALARM.to_string(),
        DEVIATION_M_S.to_string(),
        LENGTH_M.to_string(),
    ];
    out.claims = claims(&cases, alarmed, rate);
    Ok(out)
}

/// Alarms in whole scans of still air, each with signals of its own, through the scene's estimator:
/// their fraction, with the binomial standard error of the rate that was set.
fn alarms(plan: &Plan, noise: &SceneNoise, scans: usize, rate: f64) -> Result<Estimate, Failure> {
    let settings = settings(plan, noise, None, rate)?;
    let mut file = plan.file.clone();
    file.content.scan.realisations = scans;
    let mut maps = Vec::new();
    for velocity_m_s in velocities(&Plan::new(file, Target::Map)?, &Silent)? {
        maps.push(ScanMap {
            velocity_m_s,
            ..noise.empty_scan(plan)
        });
    }
    let (found, _) = detect(&maps, &settings, &Silent)?;
    let alarms = found.iter().filter(|scan| scan.is_wake()).count();
    let rate_error = (rate * (1.0 - rate) / maps.len() as f64).sqrt();
    let share = Measured::share(alarms, maps.len());
    Ok(Estimate::stated(share.value, rate_error))
}

/// Rows of operating curves, of shares at the rate, and of the smallest circulation.
fn table(cases: &[Case]) -> Table {
    let mut of_row = Vec::new();
    let mut gamma_m2_s = Vec::new();
    let mut false_alarm = Vec::new();
    let mut shares = Vec::new();
    for case in cases {
        for (circulation_m2_s, rate, _, share) in &case.power.roc {
            of_row.push(case);
            gamma_m2_s.push(*circulation_m2_s);
            false_alarm.push(*rate);
            shares.push(*share);
        }
        for (circulation_m2_s, _, _, share) in &case.power.found {
            of_row.push(case);
            gamma_m2_s.push(*circulation_m2_s);
            false_alarm.push(FALSE_ALARM);
            shares.push(*share);
        }
        of_row.push(case);
        gamma_m2_s.push(case.power.smallest_m2_s.0);
        false_alarm.push(FALSE_ALARM);
        shares.push(Measured {
            value: 0.9,
            std: f64::NAN,
        });
    }
    Table::new()
        .text("background", column(&of_row, |case| case.background))
        .text("method", column(&of_row, |_| "map"))
        .float("range_m", column(&of_row, |case| case.range_m))
        .float("snr_db", column(&of_row, |case| case.snr_db))
        .float("gamma_m2_s", gamma_m2_s)
        .float("false_alarm", false_alarm)
        .float("detection", column(&shares, |share| share.value))
        .float("standard_error", column(&shares, |share| share.std))
        .float(
            "sigma_gamma_m2_s",
            column(&of_row, |case| case.power.circulation_std_m2_s),
        )
        .float(
            "smallest_foretold_m2_s",
            column(&of_row, |case| case.power.smallest_m2_s.1),
        )
}

fn picture(cases: &[Case]) -> Figure {
    let panels = [operating_curves(cases), smallest_circulations(cases)];
    let figure = Figure::side_by_side(panels.map(|plot| CurvePlot {
        shape: 0.75,
        ..plot
    }));
    Figure {
        width: 1200.0,
        ..figure
    }
}

fn operating_curves(cases: &[Case]) -> CurvePlot {
    let x = Axis::log("rate of false alarms");
    let y = Axis::linear("share found").between(0.0, 1.0);
    let mut plot = CurvePlot::new("Operating curves", x, y);
    let near = cases.iter().filter(|case| case.range_m == 400.0);
    for (colour, case) in near.enumerate() {
        let styles = [Style::Dot, Style::DashDot, Style::Dash, Style::Line];
        for (curve, style) in case.power.roc.chunk_by(|a, b| a.0 == b.0).zip(styles) {
            let gamma_m2_s = curve.first().map_or(f64::NAN, |row| row.0);
            let label = format!("{}, {gamma_m2_s:.0} m²/s", case.background);
            let points = curve.iter().map(|row| (row.1, row.3.value));
            plot = plot.with(Series::new(&label, style, points).in_colour(colour));
        }
    }
    plot
}

/// What is found with probability 0.9, and what the bound predicts.
fn smallest_circulations(cases: &[Case]) -> CurvePlot {
    let x = Axis::linear("range [m]");
    let y = Axis::linear("circulation [m²/s]");
    let mut plot = CurvePlot::new("Found nine times in ten", x, y);
    for (colour, background) in ["still air", "turbulence"].into_iter().enumerate() {
        let mut found = Vec::new();
        let mut predicted = Vec::new();
        for case in cases.iter().filter(|case| case.background == background) {
            let (found_m2_s, predicted_m2_s) = case.power.smallest_m2_s;
            found.push((case.range_m, found_m2_s));
            predicted.push((case.range_m, predicted_m2_s));
        }
        let found = Series::new(background, Style::LineMarkers, found);
        let predicted = Series::new("", Style::Dash, predicted);
        plot = plot
            .with(found.in_colour(colour))
            .with(predicted.in_colour(colour));
    }
    plot
}

/// Of some numbers that which is farthest from a value; the value if there is none.
fn farthest(numbers: impl Iterator<Item = f64>, from: f64) -> f64 {
    let mut farthest = from;
    for number in numbers {
        if (number - from).abs() > (farthest - from).abs() {
            farthest = number;
        }
    }
    farthest
}

fn claims(cases: &[Case], alarmed: Estimate, rate: f64) -> Vec<Claim> {
    let ratios = cases
        .iter()
        .map(|c| c.power.smallest_m2_s.0 / c.power.smallest_m2_s.1);
    let worst = farthest(ratios, 1.0);
    let far = farthest(cases.iter().map(|c| c.power.gumbel.1), 2.0);
    // A test that would pass twice the rate tells nothing.
    let bar = Bar::Between(0.5 * rate, 2.0 * rate);
    let rates = Claim::judged_alone("F19c", alarmed, "", bar);
    vec![
        Claim::exact("F19a", format!("{worst:.3}"), (0.75..1.25).contains(&worst)),
        Claim::exact("F19b", format!("{far:.2}"), (1.6..2.5).contains(&far)),
        rates.expecting(format!("half of {rate} to twice that")),
    ]
}
