//! Figure 9: accumulation level against range for three radii of the region.

use super::context::*;
use wakescope_estimate::map::{PolarPoint, ScanGeometry, WindowCorrelation};
use wakescope_sim::setup::estimators;

const RADII_M: [f64; 3] = [1.0, 2.0, 4.0];
/// Where the chapter gives the levels.
const CHAPTER_RANGE_M: f64 = 400.0;

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let mut scene = Scene::default();
    scene.scan.pulses_per_line = 1;
    // One window is centred at 400 m exactly, where the chapter gives its levels.
    let half_window = 0.5 * scene.estimator.window_samples as f64;
    scene.scan.range_min_m = CHAPTER_RANGE_M - (400.0 + half_window) * scene.sample_spacing_m();
    scene.scan.range_max_m = 650.0;
    let plan = Plan::new(context.scene_file(scene)?, Target::Map)?;
    let (scene, elevation_rad) = (&plan.scene.content, &plan.geometry.elevation_rad);
    let gates = estimators::gates(scene)?;
    let samples = scene.samples_per_record();
    let geometry = ScanGeometry::new(
        &estimators::sampling(scene)?,
        &gates,
        elevation_rad,
        samples,
    )?;
    let window = estimators::weighting(scene).weights(scene.estimator.window_samples)?;
    // n_eff as the speckle has it: independent of the noise within a few per cent.
    let correlation = WindowCorrelation::gaussian_pulse(
        &window,
        &gates,
        samples,
        scene.detector.sampling_hz,
        scene.pulse_sigma_s(),
        0.0,
    )?;
    let gates_m = geometry
        .gate_ranges_m()
        .into_iter()
        .filter(|r| (200.0..=600.0).contains(r))
        .step_by(8);
    let mut ranges_m: Vec<f64> = gates_m.chain([CHAPTER_RANGE_M]).collect();
    ranges_m.sort_by(f64::total_cmp);
    let middle_rad = elevation_rad[elevation_rad.len() / 2];
    let at = |range_m: f64, radius_m: f64| {
        geometry.level(
            PolarPoint {
                range_m,
                elevation_rad: middle_rad,
            },
            radius_m,
            &correlation,
        )
    };

    let mut rows: Vec<(f64, f64, usize, f64)> = Vec::new();
    let mut series = Vec::new();
    for (radius_m, style) in RADII_M
        .into_iter()
        .zip([Style::Dot, Style::DashDot, Style::Line])
    {
        let curve: Vec<_> = ranges_m
            .iter()
            .map(|&r| (radius_m, r, at(r, radius_m).0, at(r, radius_m).1))
            .collect();
        let points: Vec<_> = curve.iter().map(|c| (c.1, c.2 as f64)).collect();
        series.push(Series::new(&format!("rho = {radius_m} m"), style, points));
        rows.extend(curve);
    }
    let table = Table::new()
        .float("rho_m", rows.iter().map(|r| r.0))
        .float("range_m", rows.iter().map(|r| r.1))
        .int("level", rows.iter().map(|r| r.2 as i64))
        .float("n_eff", rows.iter().map(|r| r.3));
    let origin = plan.scene.provenance();
    let (x, y) = (Axis::linear("range [m]"), Axis::log("windows accumulated"));
    let plot = CurvePlot {
        series,
        ..CurvePlot::new("Accumulation level", x, y)
    };
    let mut out = Rendered::new(&table, &Figure::stacked([plot]), &origin)?;
    let here: Vec<(usize, f64)> = RADII_M
        .iter()
        .map(|&rho| at(CHAPTER_RANGE_M, rho))
        .collect();
    out.claims = claims(&rows, &here);
    Ok(out)
}

fn claims(rows: &[(f64, f64, usize, f64)], here: &[(usize, f64)]) -> Vec<Claim> {
    // Counts of grid points jump by a few; the means over quarters of the range do not.
    let mut falls = true;
    let mut shown = Vec::new();
    for radius_m in RADII_M {
        let levels: Vec<f64> = rows
            .iter()
            .filter(|r| r.0 == radius_m)
            .map(|r| r.2 as f64)
            .collect();
        let means: Vec<f64> = levels
            .chunks(levels.len().div_ceil(4))
            .map(|c| c.iter().sum::<f64>() / c.len() as f64)
            .collect();
        falls &= means.windows(2).all(|w| w[1] <= w[0]) && means[means.len() - 1] < means[0];
        shown.push(format!(
            "{radius_m} m: {:.1} to {:.1}",
            means[0],
            means[means.len() - 1]
        ));
    }
    let levels: Vec<String> = here.iter().map(|h| h.0.to_string()).collect();
    let n_eff: Vec<String> = here.iter().map(|h| format!("{:.1}", h.1)).collect();
    let agrees = here
        .iter()
        .zip([20.0, 60.0, 120.0])
        .all(|(h, chapter)| (h.0 as f64 / chapter - 1.0).abs() < 0.1);
    vec![
        Claim::exact("F9a", shown.join("; "), falls),
        Claim::exact(
            "F9b",
            format!("{} (n_eff {})", levels.join(", "), n_eff.join(", ")),
            agrees,
        ),
    ]
}
