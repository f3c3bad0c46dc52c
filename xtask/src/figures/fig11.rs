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
    let mut near_m = f64::INFINITY;
    let mut far_m = 0.0_f64;
    let mut highest_rad = 0.0_f64;
    for (y_m, z_m) in cores {
        near_m = near_m.min(*y_m);
        far_m = far_m.max(*y_m);
        highest_rad = highest_rad.max((z_m + NEAR_M).atan2(*y_m));
    }
    scene.scan.elevation_min_rad = 0.0;
    scene.scan.elevation_max_rad = highest_rad;
    scene.scan.range_min_m = (near_m - 45.0).max(140.0);
    scene.scan.range_max_m = far_m + 45.0;
    scene.estimator.gate_step_samples = context.profile.choose(8, 5, 1);
    scene.pulse.shape = PulseShape::gaussian(400e-9);
    with_turbulence(context, scene, 1e-15)
}

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let mut tables = Vec::new();
    let mut panels = Vec::new();
    let mut beside = Vec::new();
    let mut parts = Vec::new();
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
                    .labelled("v_{R} [m/s]"),
            );
        }
        panels.push(
            mean.titled(&format!("Mean estimate, {name} signal-to-noise ratio"))
                .labelled("v_{R} [m/s]"),
        );
        let error = MapPlot::new(&map, 0, "rms")?;
        panels.push(
            error
                .titled(&format!("Root mean square error, {name}"))
                .labelled("rms [m/s]"),
        );
        let (words, of_map) = measure(study);
        beside.push(format!("{name}: {words}"));
        // At the physical ratio of one pulse the map is mostly noise; the chapter's own figure has the printed ratio.
        if name == "chapter" {
            parts = of_map;
        }
    }
    let origin = studies[0].plan.file.provenance();
    let mut out = Rendered::new(
        &stacked("snr_reference", tables)?,
        &Figure::stacked(panels),
        &origin,
    )?;
    out.marks = vec![sight.mark];
    out.values = vec![studies[0].map.scans.len().to_string(), sight.words];
    out.claims
        .push(Claim::judged("F11", &parts).beside(&beside.join("; ")));
    Ok(out)
}

/// The cells about the vortices of a map that have estimates.
fn near_cells(study: &Study) -> Vec<(usize, usize)> {
    let mut cells = study.cells(|d, _| d < NEAR_M);
    cells.retain(|cell| study.map.v_mean_m_s[*cell].is_finite());
    cells
}

/// Mean estimate of a cell without one batch.
fn mean_m_s(study: &Study, cell: (usize, usize), without: Option<usize>) -> f64 {
    let error_m_s = study.over_scans(cell, without, |error| error);
    study.map.v_pulse_m_s[cell] + error_m_s
}

/// Largest absolute value of a field in some cells.
fn extreme_m_s(cells: &[(usize, usize)], value_m_s: impl Fn((usize, usize)) -> f64) -> f64 {
    cells
        .iter()
        .map(|cell| value_m_s(*cell).abs())
        .fold(0.0, f64::max)
}

/// Root mean square difference of the mean estimates of some cells and a field, without one batch.
fn distance_m_s(
    study: &Study,
    cells: &[(usize, usize)],
    field: &Array2<f64>,
    without: Option<usize>,
) -> f64 {
    let squares = cells
        .iter()
        .map(|cell| (mean_m_s(study, *cell, without) - field[*cell]).powi(2));
    (squares.sum::<f64>() / cells.len() as f64).sqrt()
}

/// Of a map, how far its largest estimate is from the largest exact velocity, and how much nearer its estimates are to the pulse-weighted
/// field than to the exact one: in words, and as parts of the claim.
fn measure(study: &Study) -> (String, Vec<Part>) {
    let pulse = &study.map.v_pulse_m_s;
    let exact = &study.map.v_exact_m_s;
    let cells = near_cells(study);
    let most_pulse = extreme_m_s(&cells, |cell| pulse[cell]);
    let most_exact = extreme_m_s(&cells, |cell| exact[cell]);
    let weaker = Estimate::of(BATCHES, |without| {
        extreme_m_s(&cells, |cell| mean_m_s(study, cell, without)) - most_exact
    });
    let closer = Estimate::of(BATCHES, |without| {
        distance_m_s(study, &cells, pulse, without) - distance_m_s(study, &cells, exact, without)
    });
    let words = format!(
        "extremes {} m/s beyond {most_exact:.2} exact, {most_pulse:.2} pulse-weighted; distances differ by {} m/s",
        weaker.words(),
        closer.words()
    );
    let below = Bar::Below(0.0);
    let extremes = "largest estimate less the largest exact velocity";
    let distances = "distance to the pulse-weighted field less that to the exact one";
    let parts = vec![
        Part::new(extremes, weaker, " m/s", below),
        Part::new(distances, closer, " m/s", below),
    ];
    (words, parts)
}
