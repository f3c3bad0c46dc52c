//! What is true of a scan of the set: velocities, wind, turbulence, vortices, and the geometry that its files hold.
//! Check: a sine fit to the velocities of a linear wind gives the closed form; variances are those of the velocities.

use super::scan::Scan;
use fixtures::failure::Failure;
use ndarray::Array2;
use serde_json::{Map, Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::Path;
use wakescope_estimate::retrieval::Side;
use wakescope_sim::SceneFile;
use wakescope_sim::beams::SweepMode;
use wakescope_sim::io::Ray;
use wakescope_sim::plan::wind::SceneWind;
use wakescope_sim::retrieve::true_vortices;
use wakescope_sim::scene::{Flow, LinearWind, Pattern, Scene};

/// Heights of the wind of scans with more elevations than [`FEW_ELEVATIONS`].
const HEIGHTS: usize = 25;
/// Elevations whose gates have a height of their own in the wind.
const FEW_ELEVATIONS: usize = 3;

/// The true velocities: `ray,gate,true_m_s`, numbered as in the file.
pub(super) fn csv(scan: &Scan, (first, last): (usize, usize), gates_before: usize) -> String {
    let mut out = String::from("ray,gate,true_m_s\n");
    for ray in first..=last {
        for (gate, true_m_s) in scan.true_m_s.row(ray).iter().enumerate() {
            let gate = gate + gates_before;
            // Writing to a text cannot fail.
            let _ = writeln!(out, "{},{gate},{true_m_s:.6}", ray - first);
        }
    }
    out
}

/// All else that is known, as JSON with a line for each name.
pub(super) fn json_text(
    scan: &Scan,
    (first, last): (usize, usize),
    gates_before: usize,
    files: &Value,
) -> Result<String, Failure> {
    let scene = scan.plan.scene();
    let map = &scan.map;
    let rays = &map.rays[first..=last];
    let eddies = scene.added_flows.iter().find_map(|flow| match flow {
        Flow::Eddies(eddies) => Some(eddies),
        _ => None,
    });
    let mut sweeps = Vec::new();
    let mut nyquist_m_s = Vec::new();
    for (number, sweep) in map.sweeps.iter().enumerate() {
        if rays.iter().any(|ray| ray.sweep == number) {
            sweeps.push(json!(sweep.mode.name()));
            let of_all_m_s = map.pulse.nyquist_velocity_m_s;
            nyquist_m_s.push(sweep.nyquist_velocity_m_s.unwrap_or(of_all_m_s));
        }
    }
    let missing: Vec<[usize; 2]> = scan.missing();
    let cases: BTreeSet<u64> = files
        .as_object()
        .into_iter()
        .flat_map(|files| files.values().filter_map(Value::as_u64))
        .collect();
    let mut entries = vec![
        ("case", json!(cases)),
        ("files", files.clone()),
        ("wind", wind(scan, rays)?),
        (
            "dissipation_m2_s3",
            json!(eddies.map(|eddies| eddies.dissipation_m2_s3)),
        ),
        (
            "outer_scale_m",
            json!(eddies.map(|eddies| eddies.outer_scale_m)),
        ),
        ("vortices", vortices(scan)?),
        ("variances", variances(scan, rays)),
        ("nyquist_m_s", json!(nyquist_m_s)),
        ("missing", json!(missing)),
        ("sweep_modes", json!(sweeps)),
    ];
    entries.extend(geometry(scan, gates_before, rays));
    entries.extend([
        ("version", json!(wakescope_sim::VERSION)),
        ("scene", json!(scan.plan.file.toml)),
    ]);
    let mut out = String::from("{\n");
    for (i, (name, value)) in entries.iter().enumerate() {
        let comma = if i + 1 < entries.len() { "," } else { "" };
        // Writing to a text cannot fail.
        let _ = writeln!(out, "  \"{name}\": {value}{comma}");
    }
    Ok(out + "}\n")
}

/// Times and directions of the rays, and the centres of the gates.
fn geometry(scan: &Scan, gates_before: usize, rays: &[Ray]) -> Vec<(&'static str, Value)> {
    let map = &scan.map;
    vec![
        ("start_utc", json!(map.site.start_utc)),
        (
            "sweep",
            of_rays(rays, |ray| json!(ray.sweep - rays[0].sweep)),
        ),
        ("time_s", of_rays(rays, |ray| json!(rounded(ray.time_s)))),
        (
            "azimuth_deg",
            of_rays(rays, |ray| {
                json!(rounded(ray.azimuth_rad.to_degrees().rem_euclid(360.0)))
            }),
        ),
        (
            "elevation_deg",
            of_rays(rays, |ray| json!(rounded(ray.elevation_rad.to_degrees()))),
        ),
        ("gates_before", json!(gates_before)),
        (
            "range_m",
            map.range_m
                .iter()
                .map(|range_m| rounded(*range_m))
                .collect(),
        ),
    ]
}

/// A value of each ray.
fn of_rays(rays: &[Ray], value: impl Fn(&Ray) -> Value) -> Value {
    rays.iter().map(value).collect()
}

/// A number to nine decimals, which is below what any file holds.
fn rounded(value: f64) -> f64 {
    (value * 1e9).round() / 1e9
}

/// The mean wind over the height above the lidar: north, east, up.
fn wind(scan: &Scan, rays: &[Ray]) -> Result<Value, Failure> {
    let scene = scan.plan.scene();
    let file = without_vortices(scene)?;
    let winds = SceneWind::new(&file)?;
    let heights_m = heights_m(scan, rays);
    let points_m: Vec<[f64; 3]> = heights_m.iter().map(|z_m| [0.0, 0.0, *z_m]).collect();
    let mut wind_m_s = vec![[0.0; 3]; points_m.len()];
    let steady = winds.without_eddies();
    steady.velocity_into(&points_m, 0.0, &mut wind_m_s)?;
    let mut out = profile(&wind_m_s);
    out.insert("height_m".into(), json!(heights_m));
    if let Flow::Linear(linear) = &scene.flow
        && linear.gradient_u_per_s != [0.0; 3]
    {
        let elevation_rad = rays[0].elevation_rad;
        let sine_fit = heights_m
            .iter()
            .map(|height_m| sine_fit_m_s(linear, elevation_rad, *height_m))
            .collect::<Vec<_>>();
        out.insert("sine_fit".into(), Value::Object(profile(&sine_fit)));
        if matches!(scene.scan.pattern, Pattern::Dbs { .. }) {
            let beam_swinging = heights_m
                .iter()
                .map(|height_m| beam_swinging_m_s(linear, *height_m))
                .collect::<Vec<_>>();
            out.insert(
                "beam_swinging".into(),
                Value::Object(profile(&beam_swinging)),
            );
        }
    }
    Ok(Value::Object(out))
}

/// Components of winds as columns.
fn profile(wind_m_s: &[[f64; 3]]) -> Map<String, Value> {
    let mut out = Map::new();
    for (component, name) in ["north_m_s", "east_m_s", "up_m_s"].into_iter().enumerate() {
        let column: Vec<f64> = wind_m_s.iter().map(|v| rounded(v[component])).collect();
        out.insert(name.into(), json!(column));
    }
    out
}

/// What a sine fit makes of exact velocities of evenly spaced beams in a linear wind, m/s.
///
/// With e = (c cos a, c sin a, s) the velocity e . (u + R G e) has the harmonics of order 0 and 1
/// s w + R (c^2 (G_xx + G_yy)/2 + s^2 G_zz), c u + R c s (G_xz + G_zx), c v + R c s (G_yz + G_zy).
pub(super) fn sine_fit_m_s(wind: &LinearWind, elevation_rad: f64, height_m: f64) -> [f64; 3] {
    let [u, v, w] = wind.velocity_m_s;
    let of_u = wind.gradient_u_per_s;
    let of_v = wind.gradient_v_per_s;
    let of_w = wind.gradient_w_per_s;
    let divergence_per_s = 0.5 * (of_u[0] + of_v[1]);
    let cot = 1.0 / elevation_rad.tan();
    [
        u + height_m * (of_u[2] + of_w[0]),
        v + height_m * (of_v[2] + of_w[1]),
        w + height_m * (divergence_per_s * cot * cot + of_w[2]),
    ]
}

/// What beam swinging makes of exact velocities in a linear wind, m/s: differences of opposite beams, and the vertical beam.
pub(super) fn beam_swinging_m_s(wind: &LinearWind, height_m: f64) -> [f64; 3] {
    let [north_m_s, east_m_s, _] = sine_fit_m_s(wind, 1.0, height_m);
    let up_m_s = wind.velocity_m_s[2] + height_m * wind.gradient_w_per_s[2];
    [north_m_s, east_m_s, up_m_s]
}

/// The scene with the wind alone: a pair leaves its cross wind, and turbulence nothing.
fn without_vortices(scene: &Scene) -> Result<SceneFile, Failure> {
    let mut alone = scene.clone();
    alone.scan.pattern = Pattern::default();
    alone.flow = match &scene.flow {
        Flow::VortexPair(pair) => Flow::Uniform {
            lateral_m_s: pair.cross_wind_m_s,
            vertical_m_s: 0.0,
        },
        flow => flow.clone(),
    };
    alone
        .added_flows
        .retain(|flow| !matches!(flow, Flow::Eddies(_)));
    let text = alone.to_toml();
    Ok(SceneFile::parse(&text, Path::new("wind.toml"))?)
}

/// Heights of the gates of each elevation, m; equal steps where elevations are many.
fn heights_m(scan: &Scan, rays: &[Ray]) -> Vec<f64> {
    let range_m = &scan.map.range_m;
    let mut sines: Vec<f64> = Vec::new();
    for ray in rays {
        let sine = ray.elevation_rad.sin();
        if !sines.iter().any(|known| (known - sine).abs() < 1e-9) {
            sines.push(sine);
        }
    }
    let mut out = Vec::new();
    if sines.len() <= FEW_ELEVATIONS {
        for sine in sines {
            out.extend(range_m.iter().map(|r| rounded(sine * r)));
        }
        out.sort_by(f64::total_cmp);
        out.dedup();
        return out;
    }
    let highest = sines.iter().copied().fold(0.0, f64::max);
    let top_m = highest * range_m.last().copied().unwrap_or(0.0);
    for step in 0..HEIGHTS {
        out.push(rounded(top_m * step as f64 / (HEIGHTS - 1) as f64));
    }
    out
}

/// The vortices of each sweep, where they are when a line of sight passes them.
fn vortices(scan: &Scan) -> Result<Value, Failure> {
    let mut out = Vec::new();
    if !matches!(scan.plan.scene().flow, Flow::VortexPair(_)) {
        return Ok(json!(out));
    }
    for (sweep, (first, last)) in scan.map.sweep_bounds().into_iter().enumerate() {
        let lines: Vec<usize> = (first..=last).collect();
        for vortex in true_vortices(&scan.plan, &lines)? {
            let side = if vortex.side == Side::Left {
                "left"
            } else {
                "right"
            };
            out.push(json!({
                "sweep": sweep,
                "side": side,
                "y_m": rounded(vortex.lateral_position_m.value),
                "z_m": rounded(vortex.height_m.value),
                "gamma_m2_s": rounded(vortex.circulation_m2_s.value),
                "gamma_5_15_m2_s": rounded(vortex.circulation_5_15_m2_s.value),
                "core_m": vortex.core_radius_m.map(|core| core.value),
                "time_s": rounded(vortex.time_s),
            }));
        }
    }
    Ok(json!(out))
}

/// Variance of the velocities of each direction and gate over the rays, m^2/s^2: the mean square about the mean. Only of
/// directions in turn, as those of six beams.
fn variances(scan: &Scan, rays: &[Ray]) -> Value {
    let mut sweeps = scan.map.sweeps.iter();
    let is_pointing = sweeps.all(|sweep| sweep.mode == SweepMode::Pointing);
    let has_eddies = scan.plan.scene().added_flows.len() == 1;
    if !(is_pointing && has_eddies) {
        return Value::Null;
    }
    let mut rays_of: BTreeMap<(i64, i64), Vec<usize>> = BTreeMap::new();
    for (number, ray) in rays.iter().enumerate() {
        let [azimuth, elevation] = [ray.azimuth_rad, ray.elevation_rad]
            .map(|angle_rad| (angle_rad.to_degrees() * 1e6).round() as i64);
        rays_of
            .entry((azimuth, elevation))
            .or_default()
            .push(number);
    }
    let mut out = Vec::new();
    for ((azimuth, elevation), own) in rays_of {
        out.push(json!({
            "azimuth_deg": azimuth as f64 * 1e-6,
            "elevation_deg": elevation as f64 * 1e-6,
            "values": own.len(),
            "variance_m2_s2": variance_m2_s2(&scan.true_m_s, &own),
        }));
    }
    json!(out)
}

/// Mean square about the mean of some rows of velocities, m^2/s^2, gate by gate.
pub(super) fn variance_m2_s2(velocity_m_s: &Array2<f64>, rows: &[usize]) -> Vec<f64> {
    let mut out = Vec::with_capacity(velocity_m_s.ncols());
    for column in velocity_m_s.columns() {
        let count = rows.len() as f64;
        let mean = rows.iter().map(|row| column[*row]).sum::<f64>() / count;
        let square = rows.iter().map(|row| (column[*row] - mean).powi(2));
        out.push(rounded(square.sum::<f64>() / count));
    }
    out
}
