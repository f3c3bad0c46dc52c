//! Figure 11: estimated map and its error, late, 400 ns, Cn2 = 1e-15, windows of 64 samples.

use super::context::*;
use super::study::{
    LATE_TAU, METHODS, REFERENCES, Sight, Study, early_scene, stacked, with_method, with_turbulence,
};
use wakescope_sim::io::tables::map_table;
use wakescope_sim::scene::PulseShape;
use wakescope_sim::write;

/// Cells that count as those of a vortex, m from its centre.
const NEAR_M: f64 = 15.0;

fn scene(context: &Context, sight: &Sight) -> Scene {
    let mut scene = with_method(early_scene(context.profile.choose(8, 24, 104)), METHODS[0]);
    // An inviscid pair has spread far over the ground by then.
    let cores = &sight.cores;
    let (near_m, far_m) = cores.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), c| {
        (a.min(c.0), b.max(c.0))
    });
    let highest_rad = cores
        .iter()
        .map(|c| (c.1 + NEAR_M).atan2(c.0))
        .fold(0.0, f64::max);
    (scene.scan.elevation_min_rad, scene.scan.elevation_max_rad) = (0.0, highest_rad);
    (scene.scan.range_min_m, scene.scan.range_max_m) = ((near_m - 45.0).max(140.0), far_m + 45.0);
    scene.estimator.gate_step_samples = context.profile.choose(8, 5, 1);
    scene.pulse.shape = PulseShape::gaussian(400e-9);
    with_turbulence(context, scene, 1e-15)
}

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let (mut tables, mut panels, mut told, mut parts) =
        (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let sight = Sight::of(context, LATE_TAU)?;
    let studies = Study::at_references(context, &sight, &scene(context, &sight))?;
    for ((name, _), study) in REFERENCES.into_iter().zip(&studies) {
        let map = write::velocity_map(&study.plan, &study.map);
        tables.push((name, map_table(&map)?));
        let exact = MapPlot::new(&map, 0, "v_exact")?;
        let mean = MapPlot::new(&map, 0, "radial_velocity")?.coloured(exact.colours);
        if panels.is_empty() {
            panels.push(
                exact
                    .titled(&format!("Radial velocity, {}", sight.mark))
                    .labelled("v_R [m/s]"),
            );
        }
        panels.push(
            mean.titled(&format!("Mean estimate, {name} signal-to-noise ratio"))
                .labelled("v_R [m/s]"),
        );
        let error = MapPlot::new(&map, 0, "rms")?;
        panels.push(
            error
                .titled(&format!("Root mean square error, {name}"))
                .labelled("rms [m/s]"),
        );
        let (words, of_map) = measure(study);
        told.push(format!("{name}: {words}"));
        // At the physical ratio of one pulse the map is mostly noise; the chapter's own figure has the printed ratio.
        if name == "chapter" {
            parts = of_map;
        }
    }
    let origin = studies[0].plan.scene.provenance();
    let mut out = Rendered::new(
        &stacked("snr_reference", tables)?,
        &Figure::stacked(panels),
        &origin,
    )?;
    out.marks = vec![sight.mark];
    out.values = vec![studies[0].map.scans.len().to_string(), sight.words];
    out.claims
        .push(Claim::judged("F11", &parts).beside(&told.join("; ")));
    Ok(out)
}

/// Of a map, how far its largest estimate is from the largest exact velocity, and how much nearer its estimates are to the pulse-weighted
/// field than to the exact one: in words, and as parts of the claim.
fn measure(study: &Study) -> (String, Vec<Part>) {
    let m = &study.map;
    let mut near = study.cells(|d, _| d < NEAR_M);
    near.retain(|cell| m.v_mean_m_s[*cell].is_finite());
    let extreme = |field: &dyn Fn((usize, usize)) -> f64| {
        near.iter().map(|c| field(*c).abs()).fold(0.0, f64::max)
    };
    let mean = |cell, without| m.v_pulse_m_s[cell] + study.over_scans(cell, without, |error| error);
    let [pulse, exact] = [&m.v_pulse_m_s, &m.v_exact_m_s];
    let distance = |field: &Array2<f64>, without| {
        (near
            .iter()
            .map(|c| (mean(*c, without) - field[*c]).powi(2))
            .sum::<f64>()
            / near.len() as f64)
            .sqrt()
    };
    let [most_pulse, most_exact] = [pulse, exact].map(|field| extreme(&|cell| field[cell]));
    let weaker = Estimate::of(BATCHES, |without| {
        extreme(&|cell| mean(cell, without)) - most_exact
    });
    let closer = Estimate::of(BATCHES, |without| {
        distance(pulse, without) - distance(exact, without)
    });
    let told = format!(
        "extremes {} m/s beyond {most_exact:.2} exact, {most_pulse:.2} pulse-weighted; distances differ by {} m/s",
        weaker.words(),
        closer.words()
    );
    let part = |name: &str, of| (name.into(), of, " m/s", Bar::Below(0.0));
    let parts = vec![
        part("largest estimate less the largest exact velocity", weaker),
        part(
            "distance to the pulse-weighted field less that to the exact one",
            closer,
        ),
    ];
    (told, parts)
}
