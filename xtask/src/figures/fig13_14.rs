//! Figures 13 and 14: correlogram against periodogram accumulation on the early pair, at 200 and 400 ns, without refractive turbulence and
//! with Cn2 = 1e-15.

use super::context::*;
use super::profiles::{self, Profiles};
use super::study::{
    EARLY_TAU, METHODS, REFERENCES, Sight, Study, near_scene, with_method, with_turbulence,
};
use wakescope_sim::scene::PulseShape;

const DURATIONS_S: [f64; 2] = [200e-9, 400e-9];
/// The reference at which the chapter is judged.
const CHAPTER: &str = REFERENCES[1].0;

pub(super) fn make_13(context: &Context) -> Result<Rendered, Failure> {
    // Rare estimates anywhere in the band make most of the scatter, so scans count more than neighbouring gates, which see the same signals.
    // At 200 ns the difference from weighted PA is next to nothing, which takes many to tell.
    let scans = context.profile.choose(
        [[8; 2], [72, 32]],
        [[32; 2], [1280, 320]],
        [[96; 2], [1600, 400]],
    );
    let (mut out, chapter) = compare(context, 1, scans, |scene| scene)?;
    let parts = profiles::parts(&chapter, " m/s", |p, without| {
        p.excess_m_s(&p.inside, without)
    });
    out.comparison = profiles::comparison(&chapter);
    let along = profiles::parts(&chapter, " m/s", Profiles::near_core_m_s);
    let along: Vec<String> = along.iter().map(Part::to_string).collect();
    let along = format!("along the lines of the figure: {}", along.join("; "));
    out.claims = vec![Claim::judged("F13", &parts).beside(&along)];
    Ok(out)
}

pub(super) fn make_14(context: &Context) -> Result<Rendered, Failure> {
    let scans = context
        .profile
        .choose([[8; 2], [24; 2]], [[32; 2], [192; 2]], [[96; 2], [400; 2]]);
    let (mut out, chapter) = compare(context, DURATIONS_S.len(), scans, |scene| {
        with_turbulence(context, scene, 1e-15)
    })?;
    let peaks = profiles::parts(&chapter, " m/s", |p, without| {
        profiles::peak(&p.across_m_s(without)).1
    });
    let widths = profiles::parts(&chapter, " m", |p, without| {
        profiles::width_m(&p.across_m_s(without))
    });
    out.claims = vec![
        Claim::judged("F14a", &peaks),
        Claim::judged("F14b", &widths),
    ];
    Ok(out)
}

/// PA and CA on the same signals for both references and durations, in so many scans at each, for scenes about the cores that
/// may be changed: the figure, whose panels show one pulse duration each or all of them, and the profiles at the chapter's reference.
fn compare(
    context: &Context,
    durations_in_panel: usize,
    scans: [[usize; 2]; 2],
    change: impl Fn(Scene) -> Scene,
) -> Result<(Rendered, Vec<Profiles>), Failure> {
    let sight = Sight::of(context, EARLY_TAU)?;
    let mut references = Vec::new();
    let mut scenes = Vec::new();
    for ((reference, snr), scans) in REFERENCES.into_iter().zip(scans) {
        for (duration_s, scans) in DURATIONS_S.into_iter().zip(scans) {
            references.push(reference);
            for method in METHODS {
                let mut scene = with_method(near_scene(scans), method);
                scene.detector.snr = snr;
                scene.pulse.shape = PulseShape::gaussian(duration_s);
                scene.estimator.gate_step_samples = context.profile.choose(10, 5, 5);
                scenes.push(change(scene));
            }
        }
    }
    let studies = Study::runs(context, &sight, scenes)?;
    let all = profiles_of(&references, &studies)?;
    let shown = sight.scene(context, near_scene(scans[1][0]));
    let origin = context.provenance_of_formula(&shown.to_toml());
    let figure = Figure::stacked(plots(durations_in_panel, &all));
    let mut out = Rendered::new(&profiles::table(&all), &figure, &origin)?;
    let mut zones = Vec::new();
    for p in &all {
        zones.extend(p.regions(&p.title()));
        zones.extend(p.gates(&p.title()));
    }
    out.add("batches.csv", &Table::stack(zones)?, &origin)?;
    let [[few, _], [short, long]] = scans;
    let many = if short == long {
        short.to_string()
    } else {
        format!("{short} (200 ns) and {long} (400 ns)")
    };
    out.values = vec![many, few.to_string(), sight.words];
    out.marks = vec![sight.mark];
    let chapter = all.into_iter().filter(|p| p.name == CHAPTER).collect();
    Ok((out, chapter))
}

/// The errors of all methods for each reference and duration; methods on the same signals have the
/// same ratio.
fn profiles_of(references: &[&'static str], studies: &[Study]) -> Result<Vec<Profiles>, Failure> {
    let mut all = Vec::new();
    for (reference, studies) in references.iter().zip(studies.chunks(METHODS.len())) {
        let snr_db = profiles::snr_db(&studies[0])?;
        for (method, study) in METHODS.into_iter().zip(studies) {
            all.push(Profiles::of(method, reference, snr_db, study));
        }
    }
    Ok(all)
}

fn plots(durations_in_panel: usize, all: &[Profiles]) -> Vec<CurvePlot> {
    let mut plots = Vec::new();
    for shown in all.chunks(durations_in_panel * METHODS.len()) {
        let first = &shown[0];
        let mut title = format!(
            "{} signal-to-noise ratio, {:.1} dB",
            first.name, first.snr_db
        );
        if durations_in_panel == 1 {
            title += &format!("; pulses of {:.0} ns", 1e9 * first.pulse_s);
        }
        plots.push(profiles::plot(&title.replace(" -", " −"), shown));
    }
    plots
}
