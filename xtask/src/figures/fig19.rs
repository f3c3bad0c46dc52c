//! Figure 19: detection of wakes in maps, operating curves and the smallest circulation that is found against range.

use super::context::*;
use wakescope_estimate::retrieval::{ScanMap, Turbulence};
use wakescope_estimate::wake_detection::{DetectorOptions, Share};
use wakescope_sim::detection::{
    Calibration, DetectionSettings, Power, SceneNoise, detect, strided,
};
use wakescope_sim::measure::budget::snr_without_screens_db;
use wakescope_sim::measure::map::velocities;
use wakescope_sim::retrieve::gate_of;
use wakescope_sim::scene::Flow;

const FALSE_ALARM: f64 = 1e-2;
/// The turbulence of the second background.
const AIR: Turbulence = Turbulence {
    deviation_m_s: 0.8,
    length_m: 25.0,
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
    (scene.scan.range_min_m, scene.scan.range_max_m) =
        (range_m - HALF_LENGTH_M, range_m + HALF_LENGTH_M);
    scene.scan.realisations = 1;
    (scene.outputs.svg, scene.outputs.png) = (false, false);
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
        gate: gate_of(None, None, Some(&plan.scene.content))?.0,
        options: DetectorOptions {
            turbulence,
            ..DetectorOptions::default()
        },
        stride: noise.stride,
        seed: plan.scene.content.seed,
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
    let (scans, rate) = context.profile.choose((24, 0.3), (300, 0.1), (1000, 0.1));
    let (mut cases, mut alarmed) = (Vec::new(), None);
    for &range_m in &ranges_m {
        let plan = Plan::new(context.scene_file(scene(range_m, step_m))?, Target::Map)?;
        let snr_db = snr_without_screens_db(&plan, &[range_m])?
            .first()
            .copied()
            .unwrap_or(f64::NAN);
        let noise = SceneNoise::new(&plan, &Silent)?;
        for (background, turbulence) in [("still air", None), ("turbulence", Some(AIR))] {
            let settings = settings(&plan, &noise, turbulence, FALSE_ALARM)?;
            let power = Calibration::new(
                &strided(&noise.empty_scan(&plan), settings.stride),
                &settings,
                &Silent,
            )?
            .power(&settings, &Silent)?;
            cases.push(Case {
                background,
                range_m,
                snr_db,
                power,
            });
        }
        if range_m == ALARM_RANGE_M {
            alarmed = Some(alarms(&plan, &noise, (scans, rate))?);
        }
    }
    let alarmed = alarmed.ok_or_else(|| Failure::new(format!("no scan at {ALARM_RANGE_M} m")))?;
    let parameters = format!(
        "profile = \"{}\"\nrange_m = {ranges_m:?}\nline_spacing_m = {step_m}\nfalse_alarm = {FALSE_ALARM}\nturbulence = [{}, {}]\nscans_of_still_air = {scans}\nrate_counted = {rate}\n",
        context.profile.name(),
        AIR.deviation_m_s,
        AIR.length_m
    );
    let origin = context.provenance_of_formula(&parameters);
    let mut out = Rendered::new(&table(&cases), &picture(&cases), &origin)?;
    out.values = vec![
        HEIGHT_M.to_string(),
        (2.0 * HALF_LENGTH_M).to_string(),
        FALSE_ALARM.to_string(),
        AIR.deviation_m_s.to_string(),
        AIR.length_m.to_string(),
    ];
    out.claims = claims(&cases, alarmed);
    Ok(out)
}

/// Share of alarms at a rate in whole scans of still air, each with signals of its own, through the scene's estimator; the rate and its
/// binomial standard error.
fn alarms(
    plan: &Plan,
    noise: &SceneNoise,
    (scans, rate): (usize, f64),
) -> Result<(Share, [f64; 2]), Failure> {
    let settings = settings(plan, noise, None, rate)?;
    let mut file = plan.scene.clone();
    file.content.scan.realisations = scans;
    let shown_m_s = velocities(&Plan::new(file, Target::Map)?, &Silent)?;
    let maps: Vec<_> = shown_m_s
        .into_iter()
        .map(|velocity_m_s| ScanMap {
            velocity_m_s,
            ..noise.empty_scan(plan)
        })
        .collect();
    let (found, _) = detect(&maps, &settings, &Silent)?;
    let error = (rate * (1.0 - rate) / maps.len() as f64).sqrt();
    Ok((
        Share::of(
            found.iter().filter(|scan| scan.is_wake()).count(),
            maps.len(),
        ),
        [rate, error],
    ))
}

/// Rows of operating curves, of shares at the rate, and of the smallest circulation.
fn table(cases: &[Case]) -> Table {
    let mut rows: Vec<(&Case, [f64; 4])> = Vec::new();
    for case in cases {
        rows.extend(
            case.power
                .roc
                .iter()
                .map(|r| (case, [r.0, r.1, r.3.value, r.3.standard_error])),
        );
        rows.extend(
            case.power
                .found
                .iter()
                .map(|r| (case, [r.0, FALSE_ALARM, r.3.value, r.3.standard_error])),
        );
        rows.push((
            case,
            [case.power.smallest_m2_s.0, FALSE_ALARM, 0.9, f64::NAN],
        ));
    }
    let column = |i: usize| rows.iter().map(move |row| row.1[i]).collect::<Vec<_>>();
    Table::new()
        .text("background", rows.iter().map(|row| row.0.background))
        .text("method", rows.iter().map(|_| "map"))
        .float("range_m", rows.iter().map(|row| row.0.range_m))
        .float("snr_db", rows.iter().map(|row| row.0.snr_db))
        .float("gamma_m2_s", column(0))
        .float("false_alarm", column(1))
        .float("detection", column(2))
        .float("standard_error", column(3))
        .float(
            "sigma_gamma_m2_s",
            rows.iter().map(|row| row.0.power.circulation_std_m2_s),
        )
        .float(
            "smallest_foretold_m2_s",
            rows.iter().map(|row| row.0.power.smallest_m2_s.1),
        )
}

fn picture(cases: &[Case]) -> Figure {
    let mut roc = CurvePlot::new(
        "Operating curves",
        Axis::log("rate of false alarms"),
        Axis::linear("share found").between(0.0, 1.0),
    );
    for (place, case) in cases
        .iter()
        .filter(|case| case.range_m == 400.0)
        .enumerate()
    {
        let styles = [Style::Dot, Style::DashDot, Style::Dash, Style::Line];
        for (curve, style) in case.power.roc.chunk_by(|a, b| a.0 == b.0).zip(styles) {
            let label = format!(
                "{}, {:.0} m²/s",
                case.background,
                curve.first().map_or(f64::NAN, |row| row.0)
            );
            let points = curve.iter().map(|row| (row.1, row.3.value));
            roc = roc.with(Series::new(&label, style, points).in_colour(place));
        }
    }
    let mut smallest = CurvePlot::new(
        "Found nine times in ten",
        Axis::linear("range [m]"),
        Axis::linear("circulation [m²/s]"),
    );
    for (place, background) in ["still air", "turbulence"].into_iter().enumerate() {
        let of = |get: fn(&Power) -> f64| -> Vec<(f64, f64)> {
            let own = cases.iter().filter(|case| case.background == background);
            own.map(|case| (case.range_m, get(&case.power))).collect()
        };
        smallest = smallest
            .with(
                Series::new(
                    background,
                    Style::LineMarkers,
                    of(|power| power.smallest_m2_s.0),
                )
                .in_colour(place),
            )
            .with(Series::new("", Style::Dash, of(|power| power.smallest_m2_s.1)).in_colour(place));
    }
    let figure = Figure::side_by_side([roc, smallest].map(|plot| CurvePlot {
        shape: 0.75,
        ..plot
    }));
    Figure {
        width: 1200.0,
        ..figure
    }
}

fn claims(cases: &[Case], (alarms, [rate, error]): (Share, [f64; 2])) -> Vec<Claim> {
    let ratios: Vec<f64> = cases
        .iter()
        .map(|c| c.power.smallest_m2_s.0 / c.power.smallest_m2_s.1)
        .collect();
    let worst = ratios.iter().fold(1.0_f64, |worst, r| {
        if (r - 1.0).abs() > (worst - 1.0).abs() {
            *r
        } else {
            worst
        }
    });
    let betas: Vec<f64> = cases.iter().map(|c| c.power.gumbel.1).collect();
    let far = betas.iter().fold(2.0_f64, |far, b| {
        if (b - 2.0).abs() > (far - 2.0).abs() {
            *b
        } else {
            far
        }
    });
    // a test that would pass twice the rate tells nothing
    let alarms = Estimate::stated(alarms.value, error);
    let rates = Claim::judged_alone("F19c", alarms, "", Bar::Between(0.5 * rate, 2.0 * rate));
    vec![
        Claim::exact("F19a", format!("{worst:.3}"), (0.75..1.25).contains(&worst)),
        Claim::exact("F19b", format!("{far:.2}"), (1.6..2.5).contains(&far)),
        rates.expecting(format!("half of {rate} to twice that")),
    ]
}
