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
        [[8; 2], [1280, 160]],
        [[32; 2], [1280, 320]],
        [[96; 2], [1600, 400]],
    );
    let (mut out, chapter) = compare(context, (1, scans), |mut scene| {
        scene.estimator.gate_step_samples = context.profile.choose(10, 5, 5);
        scene
    })?;
    let parts = profiles::parts(&chapter, " m/s", |p, without| {
        p.excess_m_s(&p.inside, without)
    });
    let whole = profiles::parts(&chapter, " m/s", |p, without| p.inside.rms_m_s(without));
    out.words = format!(
        "Does correlogram accumulation err less than periodogram accumulation inside the vortices, as the chapter has it, at its ratio? As it is: \
         {}. Less what each errs outside, as the chapter draws it: {} (figure 13).",
        profiles::told(&whole),
        profiles::told(&parts)
    );
    out.claims = vec![
        Claim::judged("F13", &parts)
            .beside(&format!("with the evolution: {}", profiles::told(&whole))),
    ];
    Ok(out)
}

pub(super) fn make_14(context: &Context) -> Result<Rendered, Failure> {
    let scans =
        context
            .profile
            .choose([[8; 2], [168; 2]], [[32; 2], [192; 2]], [[96; 2], [400; 2]]);
    let (mut out, chapter) = compare(context, (2, scans), |scene| {
        with_turbulence(context, scene, 1e-15)
    })?;
    let peaks = profiles::parts(&chapter, " m/s", |p, without| {
        profiles::peak(&p.across_m_s(without)).1
    });
    let widths = profiles::parts(&chapter, " m", |p, without| {
        profiles::width_m(&p.across_m_s(without))
    });
    out.words = format!(
        "Is its profile across a core narrower, too? {} (figure 14).",
        profiles::told(&widths)
    );
    out.claims = vec![
        Claim::judged("F14a", &peaks),
        Claim::judged("F14b", &widths),
    ];
    Ok(out)
}

/// PA and CA on the same signals for both references and durations, so many of these in a panel, in so many scans at each reference and
/// duration, for scenes about the cores that may be changed: the figure, and the profiles at the chapter's reference.
fn compare(
    context: &Context,
    (durations, scans): (usize, [[usize; 2]; 2]),
    change: impl Fn(Scene) -> Scene,
) -> Result<(Rendered, Vec<Profiles>), Failure> {
    let sight = Sight::of(context, EARLY_TAU)?;
    let mut cases = Vec::new();
    for ((name, reference), scans) in REFERENCES.into_iter().zip(scans) {
        for (duration_s, scans) in DURATIONS_S.into_iter().zip(scans) {
            cases.extend(METHODS.map(|method| (name, reference, scans, duration_s, method)));
        }
    }
    let scene =
        |(_, reference, scans, duration_s, method): &(&str, SnrReference, usize, f64, &str)| {
            let mut scene = with_method(near_scene(*scans), method);
            scene.detector.snr = *reference;
            scene.pulse.shape = PulseShape::gaussian(*duration_s);
            change(scene)
        };
    let studies = Study::runs(context, &sight, cases.iter().map(scene).collect())?;
    let mut all = Vec::new();
    for (cases, studies) in cases
        .chunks(METHODS.len())
        .zip(studies.chunks(METHODS.len()))
    {
        let snr_db = profiles::snr_db(&studies[0])?;
        let of = cases
            .iter()
            .zip(studies)
            .map(|((name, .., method), study)| Profiles::of(method, name, snr_db, study));
        all.extend(of);
    }
    let panels = all.chunks(durations * METHODS.len()).map(|of| {
        let several = || {
            format!(
                "{} signal-to-noise ratio, {:.1} dB",
                of[0].name, of[0].snr_db
            )
        };
        profiles::plot(
            &if durations == 1 {
                of[0].title()
            } else {
                several()
            },
            of,
        )
    });
    let origin =
        context.provenance_of_formula(&sight.scene(context, near_scene(scans[1][0])).to_toml());
    let mut out = Rendered::new(&profiles::table(&all), &Figure::stacked(panels), &origin)?;
    out.add(
        "batches.csv",
        &profiles::batches_table(all.iter().map(|p| (p.title(), p)), true),
        &origin,
    )?;
    let [[few, _], [short, long]] = scans;
    let many = if short == long {
        short.to_string()
    } else {
        format!("{short} and {long}")
    };
    out.values = vec![many, few.to_string(), sight.words];
    out.marks = vec![sight.mark];
    Ok((out, all.into_iter().filter(|p| p.name == CHAPTER).collect()))
}
