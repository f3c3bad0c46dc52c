//! Figure 9: accumulation level against range for three radii of the region.

use super::context::*;
use wakescope_estimate::map::{PolarPoint, ScanGeometry, WindowCorrelation};

const RADII_M: [f64; 3] = [1.0, 2.0, 4.0];
/// Where the chapter gives the levels.
const CHAPTER_RANGE_M: f64 = 400.0;

/// The middle line of a scan and how windows accumulate on it.
struct Accumulation {
    geometry: ScanGeometry,
    correlation: WindowCorrelation,
    elevation_rad: f64,
}

impl Accumulation {
    fn new(plan: &Plan) -> Result<Self, Failure> {
        let scene = plan.scene();
        let elevation_rad = &plan.geometry.elevation_rad;
        let gates = scene.gates()?;
        let sampling = scene.sampling()?;
        let samples = scene.samples_per_record();
        let window = scene.weighting().weights(scene.estimator.window_samples)?;
        Ok(Self {
            geometry: ScanGeometry::new(&sampling, &gates, elevation_rad, samples)?,
            // n_eff as the speckle has it: independent of the noise within a few per cent.
            correlation: WindowCorrelation::gaussian_pulse(
                &window,
                &gates,
                samples,
                scene.detector.sampling_hz,
                scene.pulse_sigma_s(),
                0.0,
            )?,
            elevation_rad: elevation_rad[elevation_rad.len() / 2],
        })
    }

    /// Windows accumulated for an estimate, and independent windows that they are worth.
    fn level(&self, range_m: f64, radius_m: f64) -> (usize, f64) {
        let point = PolarPoint::at_elevation(range_m, self.elevation_rad);
        self.geometry.level(point, radius_m, &self.correlation)
    }

    /// Every eighth gate, and the range of the chapter, in their order.
    fn ranges_m(&self) -> Vec<f64> {
        let mut gates_m = self.geometry.gate_ranges_m();
        gates_m.retain(|r| (200.0..=600.0).contains(r));
        let mut ranges_m: Vec<f64> = gates_m.into_iter().step_by(8).collect();
        ranges_m.push(CHAPTER_RANGE_M);
        ranges_m.sort_by(f64::total_cmp);
        ranges_m
    }
}

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let mut scene = Scene::default();
    scene.scan.pulses_per_line = 1;
    // One window is centred at 400 m exactly, where the chapter gives its levels.
    let half_window = 0.5 * scene.estimator.window_samples as f64;
    scene.scan.range_min_m = CHAPTER_RANGE_M - (400.0 + half_window) * scene.sample_spacing_m();
    scene.scan.range_max_m = 650.0;
    let plan = Plan::new(context.scene_file(scene)?, Target::Map)?;
    let accumulation = Accumulation::new(&plan)?;
    let ranges_m = accumulation.ranges_m();
    let styles = [Style::Dot, Style::DashDot, Style::Line];
    let mut rho_m = Vec::new();
    let mut range_m = Vec::new();
    let mut windows = Vec::new();
    let mut n_eff = Vec::new();
    let mut series = Vec::new();
    for (radius_m, style) in RADII_M.into_iter().zip(styles) {
        let mut points = Vec::new();
        for &gate_m in &ranges_m {
            let (level, independent) = accumulation.level(gate_m, radius_m);
            points.push((gate_m, level as f64));
            rho_m.push(radius_m);
            range_m.push(gate_m);
            windows.push(level);
            n_eff.push(independent);
        }
        series.push(Series::new(&format!("ρ = {radius_m} m"), style, points));
    }
    let table = Table::new()
        .float("rho_m", rho_m)
        .float("range_m", range_m)
        .int("level", column(&windows, |level| *level as i64))
        .float("n_eff", n_eff);
    let x = Axis::linear("range [m]");
    let y = Axis::log("windows accumulated");
    let plot = CurvePlot {
        series,
        ..CurvePlot::new("Accumulation level", x, y)
    };
    let origin = plan.file.provenance();
    let mut out = Rendered::new(&table, &Figure::stacked([plot]), &origin)?;
    let at_chapter = RADII_M.map(|radius_m| accumulation.level(CHAPTER_RANGE_M, radius_m));
    let of_radii: Vec<&[usize]> = windows.chunks(ranges_m.len()).collect();
    out.claims = vec![falling_claim(&of_radii), chapter_claim(&at_chapter)];
    Ok(out)
}

/// Counts of grid points jump by a few; the means over quarters of the range do not.
fn falling_claim(of_radii: &[&[usize]]) -> Claim {
    let mut falls = true;
    let mut measured = Vec::new();
    for (radius_m, levels) in RADII_M.into_iter().zip(of_radii) {
        let windows: Vec<f64> = levels.iter().map(|level| *level as f64).collect();
        let mut means = Vec::new();
        for quarter in windows.chunks(windows.len().div_ceil(4)) {
            means.push(quarter.iter().sum::<f64>() / quarter.len() as f64);
        }
        let first = means[0];
        let last = means[means.len() - 1];
        falls &= means.windows(2).all(|w| w[1] <= w[0]) && last < first;
        measured.push(format!("{radius_m} m: {first:.1} to {last:.1}"));
    }
    Claim::exact("F9a", measured.join("; "), falls)
}

/// The levels of the chapter at its range.
fn chapter_claim(levels: &[(usize, f64); 3]) -> Claim {
    let mut agrees = true;
    for ((windows, _), chapter) in levels.iter().zip([20.0, 60.0, 120.0]) {
        agrees &= (*windows as f64 / chapter - 1.0).abs() < 0.1;
    }
    let windows = levels.map(|(windows, _)| windows.to_string());
    let n_eff = levels.map(|(_, n_eff)| format!("{n_eff:.1}"));
    let measured = format!(
        "{} (as good as {} independent ones)",
        windows.join(", "),
        n_eff.join(", ")
    );
    Claim::exact("F9b", measured, agrees)
}
