//! Figure 12: error of correlogram accumulation against range for four pulse energies, Cn2 = 1e-13, 200 ns.

use super::context::*;
use super::study::{
    EARLY_TAU, INSIDE_M, METHODS, OUTSIDE_M, REFERENCES, Sight, Study, Zone, batches, early_scene,
    with_method, with_turbulence,
};
use crate::statistics::NO_DIFFERENCE;

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

fn curve(study: &Study, reference: &'static str, energy_j: f64) -> Curve {
    let gates = study.map.range_m.len();
    let all_lines = |gate| {
        (0..study.map.elevation_rad.len())
            .map(|line| (line, gate))
            .collect::<Vec<_>>()
    };
    let lines = |gate: usize| {
        study
            .map
            .rms_m_s
            .column(gate)
            .iter()
            .copied()
            .filter(|rms| rms.is_finite())
            .collect::<Vec<_>>()
    };
    let mean = |of: Vec<f64>| of.iter().sum::<f64>() / of.len() as f64;
    Curve {
        reference,
        energy_j,
        over_lines: (0..gates)
            .map(|gate| study.zone(&all_lines(gate)))
            .collect(),
        mean_of_lines_m_s: (0..gates).map(|gate| mean(lines(gate))).collect(),
        inside: study.zone(&study.cells(|d, _| d < INSIDE_M)),
        outside: study.zone(&study.cells(|d, _| d > OUTSIDE_M)),
        halves: [false, true]
            .map(|far| study.zone(&study.cells(|d, j| d > OUTSIDE_M && (j >= gates / 2) == far))),
    }
}

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let sight = Sight::of(context, EARLY_TAU)?;
    // Claims are judged at the chapter's reference.
    let scans = context.profile.choose([8, 48], [24, 96], [104, 104]);
    let of_reference =
        |((name, snr), scans)| ENERGIES_J.map(|energy_j| (name, snr, scans, energy_j, 1.0));
    let mut cases: Vec<_> = REFERENCES
        .into_iter()
        .zip(scans)
        .flat_map(of_reference)
        .collect();
    cases.push((THIN, REFERENCES[0].1, scans[0], 2.0 * AS_THIN_J, 0.5));
    let scenes = cases
        .iter()
        .map(|&(_, snr, scans, energy_j, share_of_air)| {
            let mut scene = scene(context, scans);
            (scene.detector.snr, scene.pulse.energy_j) = (snr, energy_j);
            scene.atmosphere.backscatter_per_m_sr *= share_of_air;
            scene
        });
    let studies = Study::runs(context, &sight, scenes.collect())?;
    let all: Vec<Curve> = studies
        .iter()
        .zip(&cases)
        .map(|(study, (name, .., energy_j, _))| curve(study, name, *energy_j))
        .collect();
    let (curves, thin) = all.split_at(all.len() - 1);
    let origin =
        context.provenance_of_formula(&sight.scene(context, scene(context, scans[1])).to_toml());
    let styles = [Style::Dash, Style::Dot, Style::DashDot, Style::Line];
    let panel = |reference: &str| {
        let title = format!("Correlogram accumulation, {reference} signal-to-noise ratio");
        let mut plot = CurvePlot::new(
            &title,
            Axis::linear("range [m]"),
            Axis::linear("error [m/s]"),
        );
        let chosen = curves.iter().filter(|c| c.reference == reference);
        plot.series = chosen
            .zip(styles)
            .map(|(c, style)| {
                let points = c.over_lines.iter().map(|zone| (zone.range_m, zone.rms()));
                banded(&format!("{:.0} \u{b5}J", 1e6 * c.energy_j), style, points)
            })
            .collect();
        plot
    };
    let mut out = Rendered::new(
        &table(curves),
        &Figure::stacked(REFERENCES.map(|(name, _)| panel(name))),
        &origin,
    )?;
    out.add("batches.csv", &batches_table(&all), &origin)?;
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

fn table(curves: &[Curve]) -> Table {
    let rows: Vec<(&Curve, usize, &Zone)> = curves
        .iter()
        .flat_map(|c| {
            c.over_lines
                .iter()
                .enumerate()
                .map(move |(j, zone)| (c, j, zone))
        })
        .collect();
    Table::new()
        .float("pulse_energy_j", rows.iter().map(|(c, ..)| c.energy_j))
        .text("snr_reference", rows.iter().map(|(c, ..)| c.reference))
        .float("range_m", rows.iter().map(|(.., zone)| zone.range_m))
        .float(
            "sigma_v_m_s",
            rows.iter().map(|(.., zone)| zone.rms_m_s(None)),
        )
        .float(
            "standard_error_m_s",
            rows.iter().map(|(.., zone)| zone.rms().standard_error),
        )
        .float(
            "bias_m_s",
            rows.iter().map(|(.., zone)| zone.average.bias_m_s),
        )
        .float(
            "std_m_s",
            rows.iter().map(|(.., zone)| zone.average.std_m_s),
        )
        .float(
            "mean_of_lines_m_s",
            rows.iter().map(|(c, j, _)| c.mean_of_lines_m_s[*j]),
        )
}

fn batches_table(curves: &[Curve]) -> Table {
    batches(curves.iter().flat_map(|c| {
        let case = format!("{}; {:.0} uJ", c.reference, 1e6 * c.energy_j);
        let [near, far] = &c.halves;
        [
            ("inside", &c.inside),
            ("outside", &c.outside),
            ("outside, near half", near),
            ("outside, far half", far),
        ]
        .map(|(name, zone)| (case.clone(), name, f64::NAN, zone))
    }))
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
    all.collect::<Vec<_>>().join(", ")
}

fn outside_claim(curves: &[Curve], study: &Study) -> Claim {
    let s = &study.plan.scene.content;
    // What guesses all over the band err; an energy whose estimates are half of that has no signal.
    let guesses_m_s = 0.5 * s.laser.wavelength_m * s.detector.bandwidth_hz / 12_f64.sqrt();
    let energies = of_chapter(curves)
        .into_iter()
        .filter(|c| c.outside.rms_m_s(None) < 0.5 * guesses_m_s);
    let energies: Vec<&Curve> = energies.collect();
    let micro = |c: &Curve| 1e6 * c.energy_j;
    let falls = energies.windows(2).map(|pair| {
        (
            format!("{:.0} to {:.0} \u{b5}J", micro(pair[0]), micro(pair[1])),
            pair[1].outside.over(&pair[0].outside),
        )
    });
    let grows = energies.iter().map(|c| {
        (
            format!("near over far half, {:.0} \u{b5}J", micro(c)),
            c.halves[0].over(&c.halves[1]),
        )
    });
    let parts = falls.chain(grows).map(|(name, share)| {
        (
            name,
            share.times(100.0),
            " %",
            Bar::Less(100.0 * NO_DIFFERENCE),
        )
    });
    Claim::judged("F12a", &parts.collect::<Vec<Part>>()).beside(&levels(curves, |c| &c.outside))
}

fn inside_claim(curves: &[Curve]) -> Claim {
    let of = of_chapter(curves);
    let part = |c: &&Curve| {
        let share = c.inside.over(&of[of.len() - 1].inside).times(100.0);
        let limit = 100.0 * NO_INFLUENCE;
        (
            format!("{:.0} against 600 \u{b5}J", 1e6 * c.energy_j),
            share,
            " %",
            Bar::Between(-limit, limit),
        )
    };
    Claim::judged(
        "F12b",
        &of[..of.len() - 1].iter().map(part).collect::<Vec<Part>>(),
    )
    .beside(&levels(curves, |c| &c.inside))
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
