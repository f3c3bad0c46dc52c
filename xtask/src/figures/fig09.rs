//! Figure 9: accumulation level against range for three radii of the region.

use super::{Claim, Context, Rendered, Verdict};
use crate::Failure;
use wakescope_estimate::{PolarPoint, ScanGeometry, WindowCorrelation};
use wakescope_sim::export::Table;
use wakescope_sim::join;
use wakescope_sim::plot::{Axis, CurvePlot, Figure, Series, Style};
use wakescope_sim::scene::Scene;

const RADII_M: [f64; 3] = [1.0, 2.0, 4.0];

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let mut scene = Scene::default();
    scene.scan.pulses_per_line = 1;
    scene.scan.range_min_m = 150.0;
    scene.scan.range_max_m = 650.0;
    let file = context.scene_file(scene)?;
    let scene = &file.scene;
    let gates = join::gates(scene)?;
    let elevation_rad: Vec<f64> = (0..185).map(|i| 1.25e-3 * f64::from(i)).collect();
    let samples = scene.samples_per_record();
    let geometry = ScanGeometry::new(&join::sampling(scene)?, &gates, &elevation_rad, samples)?;
    let window = join::weighting(scene).weights(scene.estimator.window_samples)?;
    // n_eff as the speckle has it: independent of the noise within a few per cent.
    let correlation =
        WindowCorrelation::gaussian_pulse(&window, &gates, samples, scene.detector.sampling_hz, scene.pulse_sigma_s(), 0.0)?;
    let all_ranges_m = geometry.gate_ranges_m();
    let ranges_m: Vec<f64> = all_ranges_m.iter().copied().filter(|r| (200.0..=600.0).contains(r)).step_by(8).collect();
    let middle_rad = elevation_rad[elevation_rad.len() / 2];
    let at = |range_m: f64, radius_m: f64| geometry.level(PolarPoint { range_m, elevation_rad: middle_rad }, radius_m, &correlation);

    let mut rows: Vec<(f64, f64, usize, f64)> = Vec::new();
    let mut series = Vec::new();
    for (radius_m, style) in RADII_M.into_iter().zip([Style::Dot, Style::DashDot, Style::Line]) {
        let curve: Vec<_> = ranges_m.iter().map(|&r| (radius_m, r, at(r, radius_m).0, at(r, radius_m).1)).collect();
        let points = curve.iter().map(|c| (c.1, c.2 as f64)).collect();
        series.push(Series::new(&format!("rho = {radius_m} m"), points, style));
        rows.extend(curve);
    }
    let table = Table::new()
        .float("rho_m", rows.iter().map(|r| r.0))
        .float("range_m", rows.iter().map(|r| r.1))
        .int("level", rows.iter().map(|r| r.2 as i64))
        .float("n_eff", rows.iter().map(|r| r.3));
    let mut out = Rendered::default();
    let origin = wakescope_sim::export::Provenance {
        program: wakescope_sim::PROGRAM.into(),
        scene_toml: file.toml.clone(),
        scene_hash: file.hash.clone(),
        seed: context.seed,
    };
    out.csv(table.to_csv(&origin)?);
    let plot = CurvePlot {
        title: "Accumulation level".into(),
        x: Axis::linear("range [m]"),
        y: Axis::log("windows accumulated"),
        series,
    };
    let figure = Figure::single(plot);
    out.picture(figure.svg(&origin)?, figure.png(&origin)?);
    out.caption = "Windows that one velocity estimate accumulates: one pulse a line every 1.25 mrad, one window a sample.".into();

    // On a gate at 400 m, as the chapter's numbers are for a point of the grid.
    let near_400_m = all_ranges_m.iter().copied().min_by(|a, b| (a - 400.0).abs().total_cmp(&(b - 400.0).abs())).unwrap_or(400.0);
    let here: Vec<(usize, f64)> = RADII_M.iter().map(|&rho| at(near_400_m, rho)).collect();
    out.claims = claims(&rows, &here);
    Ok(out)
}

fn claims(rows: &[(f64, f64, usize, f64)], here: &[(usize, f64)]) -> Vec<Claim> {
    // Counts of grid points jump by a few; the means over quarters of the range do not.
    let mut falls = true;
    let mut shown = Vec::new();
    for radius_m in RADII_M {
        let levels: Vec<f64> = rows.iter().filter(|r| r.0 == radius_m).map(|r| r.2 as f64).collect();
        let means: Vec<f64> =
            levels.chunks(levels.len().div_ceil(4)).map(|c| c.iter().sum::<f64>() / c.len() as f64).collect();
        falls &= means.windows(2).all(|w| w[1] < w[0]);
        shown.push(format!("{radius_m} m: {:.1} to {:.1}", means[0], means[means.len() - 1]));
    }
    let levels: Vec<String> = here.iter().map(|h| h.0.to_string()).collect();
    let n_eff: Vec<String> = here.iter().map(|h| format!("{:.1}", h.1)).collect();
    let agrees = here.iter().zip([20.0, 60.0, 120.0]).all(|(h, chapter)| (h.0 as f64 / chapter - 1.0).abs() < 0.1);
    vec![
        Claim::exact("F9a", "fig09", "the level falls with range", "falls in every quarter", shown.join("; "), falls),
        Claim {
            verdict: Verdict::of(agrees),
            ..Claim::exact(
                "F9b",
                "fig09",
                "at 400 m the levels for 1, 2, 4 m are those of the chapter; the spacing of Table 2 gives a full disc of a \
                 regular grid, which grows as rho^2, and the chapter's numbers do not",
                "20, 60, 120",
                format!("{} (n_eff {})", levels.join(", "), n_eff.join(", ")),
                agrees,
            )
        },
    ]
}
