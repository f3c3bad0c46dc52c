//! Figure 12: error of correlogram accumulation against range for four pulse energies, Cn2 = 1e-13, 200 ns.

use super::context::*;
use super::study::{
    EARLY_TAU, INSIDE_M, METHODS, OUTSIDE_M, REFERENCES, Sight, Study, Zone, early_scene,
    with_method, with_turbulence,
};

const ENERGIES_J: [f64; 4] = [50e-6, 150e-6, 300e-6, 600e-6];

/// The physical reference with half of the aerosol and twice this energy.
const THIN: &str = "physical, half the backscatter";
const AS_THIN_J: f64 = ENERGIES_J[1];

/// Errors of inside that differ by less are those of one energy.
const NO_INFLUENCE: f64 = 0.1;

/// One energy with one reference.
struct Curve {
    reference: &'static str,
    energy_j: f64,
    /// Over all lines, at each range.
    over_lines: Vec<Zone>,
    /// Mean over the lines of what each errs, m/s.
    mean_of_lines_m_s: Vec<f64>,
    /// Over the cells inside and outside of the vortices, and outside in the nearer and the farther half of the ranges.
    inside: Zone,
    outside: Zone,
    halves: [Zone; 2],
}

fn scene(context: &Context, scans: usize) -> Scene {
    with_turbulence(context, with_method(early_scene(scans), METHODS[2]), 1e-13)
}

/// The scenes of all curves with their references: all energies at both references, in so many
/// scans at each, then the thin air.
fn scenes(context: &Context, scans: [usize; 2]) -> Vec<(&'static str, Scene)> {
    let mut scenes = Vec::new();
    for ((reference, snr), scans) in REFERENCES.into_iter().zip(scans) {
        for energy_j in ENERGIES_J {
            let mut scene = scene(context, scans);
            scene.detector.snr = snr;
            scene.pulse.energy_j = energy_j;
            scenes.push((reference, scene));
        }
    }
    let mut thin = scene(context, scans[0]);
    thin.detector.snr = REFERENCES[0].1;
    thin.pulse.energy_j = 2.0 * AS_THIN_J;
    thin.atmosphere.backscatter_per_m_sr *= 0.5;
    scenes.push((THIN, thin));
    scenes
}

fn curve(study: &Study, reference: &'static str) -> Curve {
    let map = &study.map;
    let gates = map.range_m.len();
    let mut over_lines = Vec::new();
    let mut mean_of_lines_m_s = Vec::new();
    for gate in 0..gates {
        let cells: Vec<(usize, usize)> = (0..map.elevation_rad.len())
            .map(|line| (line, gate))
            .collect();
        over_lines.push(study.zone(&cells));
        let mut errors_m_s = map.rms_m_s.column(gate).to_vec();
        errors_m_s.retain(|error| error.is_finite());
        mean_of_lines_m_s.push(errors_m_s.iter().sum::<f64>() / errors_m_s.len() as f64);
    }
    let near = study.cells(|d, j| d > OUTSIDE_M && j < gates / 2);
    let far = study.cells(|d, j| d > OUTSIDE_M && j >= gates / 2);
    Curve {
        reference,
        energy_j: study.plan.scene().pulse.energy_j,
        over_lines,
        mean_of_lines_m_s,
        inside: study.zone(&study.cells(|d, _| d < INSIDE_M)),
        outside: study.zone(&study.cells(|d, _| d > OUTSIDE_M)),
        halves: [study.zone(&near), study.zone(&far)],
    }
}

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let sight = Sight::of(context, EARLY_TAU)?;
    // Claims are judged at the chapter's reference.
    let scans = context.profile.choose([8, 16], [24, 96], [104, 104]);
    let (references, scenes): (Vec<_>, Vec<_>) = self::scenes(context, scans).into_iter().unzip();
    let studies = Study::runs(context, &sight, scenes)?;
    let mut all = Vec::new();
    for (study, reference) in studies.iter().zip(references) {
        all.push(curve(study, reference));
    }
    let (curves, thin) = all.split_at(all.len() - 1);
    let shown = sight.scene(context, scene(context, scans[1]));
    let origin = context.provenance_of_formula(&shown.to_toml());
    let panels = REFERENCES.map(|(reference, _)| panel(curves, reference));
    let mut out = Rendered::new(&table(curves), &Figure::stacked(panels), &origin)?;
    out.add("batches.csv", &batches_table(&all)?, &origin)?;
    out.marks = vec![sight.mark];
    let [few, many] = scans;
    out.values = vec![many.to_string(), few.to_string(), sight.words];
    out.claims = vec![
        outside_claim(curves, &studies[0]),
        inside_claim(curves),
        thin_claim(curves, thin),
    ];
    Ok(out)
}

/// The errors of all energies against range at one reference.
fn panel(curves: &[Curve], reference: &str) -> CurvePlot {
    let title = format!("Correlogram accumulation, {reference} signal-to-noise ratio");
    let x = Axis::linear("range [m]");
    let y = Axis::linear("error [m/s]");
    let mut plot = CurvePlot::new(&title, x, y);
    let styles = [Style::Dash, Style::Dot, Style::DashDot, Style::Line];
    let chosen = curves.iter().filter(|c| c.reference == reference);
    for (curve, style) in chosen.zip(styles) {
        let label = format!("{:.0} \u{b5}J", 1e6 * curve.energy_j);
        let zones = curve.over_lines.iter();
        let points = zones.map(|zone| (zone.range_m, zone.rms()));
        plot.series.push(banded(&label, style, points));
    }
    plot
}

fn table(curves: &[Curve]) -> Table {
    let mut rows: Vec<(&Curve, &Zone, f64)> = Vec::new();
    for curve in curves {
        for (zone, mean_m_s) in curve.over_lines.iter().zip(&curve.mean_of_lines_m_s) {
            rows.push((curve, zone, *mean_m_s));
        }
    }
    Table::new()
        .float("pulse_energy_j", column(&rows, |(c, ..)| c.energy_j))
        .text("snr_reference", column(&rows, |(c, ..)| c.reference))
        .float("range_m", column(&rows, |(_, zone, _)| zone.range_m))
        .float(
            "sigma_v_m_s",
            column(&rows, |(_, zone, _)| zone.rms_m_s(None)),
        )
        .float(
            "standard_error_m_s",
            column(&rows, |(_, zone, _)| zone.rms().standard_error),
        )
        .float(
            "bias_m_s",
            column(&rows, |(_, zone, _)| zone.average.bias_m_s),
        )
        .float(
            "std_m_s",
            column(&rows, |(_, zone, _)| zone.average.std_m_s),
        )
        .float(
            "mean_of_lines_m_s",
            column(&rows, |(.., mean_m_s)| *mean_m_s),
        )
}

fn batches_table(curves: &[Curve]) -> Result<Table, Failure> {
    let mut zones = Vec::new();
    for c in curves {
        let case = format!("{}; {:.0} uJ", c.reference, 1e6 * c.energy_j);
        let [near, far] = &c.halves;
        let of_curve = [
            ("inside", &c.inside),
            ("outside", &c.outside),
            ("outside, near half", near),
            ("outside, far half", far),
        ];
        for (name, zone) in of_curve {
            zones.push(zone.batches(&case, name, f64::NAN));
        }
    }
    Ok(Table::stack(zones)?)
}

/// The energies at the chapter's reference.
fn of_chapter(curves: &[Curve]) -> Vec<&Curve> {
    curves.iter().filter(|c| c.reference == "chapter").collect()
}

/// In words what each energy errs in a zone, for both references.
fn levels(curves: &[Curve], zone: fn(&Curve) -> &Zone) -> String {
    let all = curves.iter().map(|c| {
        format!(
            "{} {:.0} \u{b5}J {} (bias {:.2}) m/s",
            c.reference,
            1e6 * c.energy_j,
            zone(c).rms().words(),
            zone(c).average.bias_m_s
        )
    });
    all.collect::<Vec<_>>().join("; ")
}

fn outside_claim(curves: &[Curve], study: &Study) -> Claim {
    let s = study.plan.scene();
    // What guesses all over the band err; an energy whose estimates are half of that has no signal.
    let guesses_m_s = 0.5 * s.laser.wavelength_m * s.detector.bandwidth_hz / 12_f64.sqrt();
    let mut energies = of_chapter(curves);
    energies.retain(|c| c.outside.rms_m_s(None) < 0.5 * guesses_m_s);
    let bar = Bar::Less(100.0 * NO_DIFFERENCE);
    let mut parts = Vec::new();
    for pair in energies.windows(2) {
        let name = format!(
            "{:.0} to {:.0} \u{b5}J",
            1e6 * pair[0].energy_j,
            1e6 * pair[1].energy_j
        );
        let share = pair[1].outside.over(&pair[0].outside);
        parts.push(Part::new(name, share.times(100.0), " %", bar));
    }
    for curve in &energies {
        let name = format!("near over far half, {:.0} \u{b5}J", 1e6 * curve.energy_j);
        let share = curve.halves[0].over(&curve.halves[1]);
        parts.push(Part::new(name, share.times(100.0), " %", bar));
    }
    Claim::judged("F12a", &parts).beside(&levels(curves, |c| &c.outside))
}

fn inside_claim(curves: &[Curve]) -> Claim {
    let limit = 100.0 * NO_INFLUENCE;
    let mut parts = Vec::new();
    if let [others @ .., largest] = &of_chapter(curves)[..] {
        for curve in others {
            let name = format!("{:.0} against 600 \u{b5}J", 1e6 * curve.energy_j);
            let share = curve.inside.over(&largest.inside).times(100.0);
            parts.push(Part::new(name, share, " %", Bar::Between(-limit, limit)));
        }
    }
    Claim::judged("F12b", &parts).beside(&levels(curves, |c| &c.inside))
}

fn thin_claim(curves: &[Curve], thin: &[Curve]) -> Claim {
    let physical = curves
        .iter()
        .filter(|c| c.reference == REFERENCES[0].0 && c.energy_j == AS_THIN_J);
    let shares = physical.zip(thin).flat_map(|(full, thin)| {
        [
            thin.inside.over(&full.inside),
            thin.outside.over(&full.outside),
        ]
    });
    let differs: f64 = shares.map(|share| share.value.abs()).sum();
    Claim::exact(
        "F12c",
        format!("relative difference inside and outside together: {differs:.0e}"),
        differs < 1e-9,
    )
}
