//! Figure 13: correlogram against periodogram accumulation on the early pair, 200 ns, and 400 ns beside it.

use super::context::{Context, Rendered};
use super::profiles::{self, Profiles};
use super::study::{Age, METHODS, REFERENCES, Sight, Study, near_scene, with_method};
use crate::claim::Claim;
use fixtures::failure::Failure;
use wakescope_sim::plot::Figure;
use wakescope_sim::scene::{PulseShape, Scene, SnrReference};

const DURATIONS_S: [f64; 2] = [200e-9, 400e-9];
/// The reference at which the chapter is judged, and its place among them.
const CHAPTER: &str = REFERENCES[1].0;

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let scans = context.choose([16, 96], [32, 192], [96, 400]);
    let sight = Sight::of(context, Age::Early)?;
    let all = of_all_methods(context, &sight, scans, |scene| scene)?;
    let origin = context.provenance_of_formula(&sight.scene(context, near_scene(scans[1])).to_toml());
    let panels = all.chunks(METHODS.len()).map(|of| profiles::plot(&of[0].title(), of));
    let mut out = Rendered::new(&profiles::table(&all), &Figure::stacked(panels), &origin)?;
    out.add("batches.csv", &profiles::batches_table(all.iter().map(|p| (p.title(), p)), true), &origin)?;
    out.caption = format!(
        "{} Periodogram accumulation (PA), unweighted and with the Gaussian weighting, and correlogram accumulation (CA, AR(16), unweighted) \
         on the same signals; no refractive turbulence, {} scans ({} at the physical ratio) of one pulse a line; {}.",
        profiles_words(),
        scans[1],
        scans[0],
        sight.words
    );
    out.marks = vec![sight.mark];
    let chapter: Vec<Profiles> = all.into_iter().filter(|p| p.name == CHAPTER).collect();
    let parts = profiles::parts(&chapter, " m/s", Profiles::inside_m_s);
    let whole = profiles::parts(&chapter, " m/s", |p, without| p.inside.rms_m_s(without));
    out.words = format!(
        "Does correlogram accumulation err less than periodogram accumulation inside the vortices, as the chapter has it, at its ratio? As it is: \
         {}. Less what each errs outside, as the chapter draws it: {} (figure 13).",
        profiles::told(&whole),
        profiles::told(&parts)
    );
    let claim = Claim::judged("F13", &parts).beside(&format!("with the evolution: {}", profiles::told(&whole)));
    out.claims.push(claim);
    Ok(out)
}

/// What errors across a core are.
pub(super) fn profiles_words() -> String {
    "Root mean square error against the range from the vortex centre, over the lines within 4 m of a core, both vortices together, less its \
     evolution with range, a straight line through what it is beyond 30 m from both; \u{3c1} = 2 m, bands of one standard error over batches of scans."
        .into()
}

/// PA and CA on the same signals for both references, with so many scans, and durations, for scenes about the cores that may be changed.
pub(super) fn of_all_methods(
    context: &Context,
    sight: &Sight,
    scans: [usize; 2],
    change: impl Fn(Scene) -> Scene,
) -> Result<Vec<Profiles>, Failure> {
    let mut cases = Vec::new();
    for ((name, reference), scans) in REFERENCES.into_iter().zip(scans) {
        for duration_s in DURATIONS_S {
            cases.extend(METHODS.map(|method| (name, reference, scans, duration_s, method)));
        }
    }
    let scene = |(_, reference, scans, duration_s, method): &(&str, SnrReference, usize, f64, &str)| {
        let mut scene = with_method(near_scene(*scans), method);
        scene.detector.snr = *reference;
        scene.pulse.shape = PulseShape::gaussian(*duration_s);
        change(scene)
    };
    let studies = Study::runs(context, sight, cases.iter().map(scene).collect())?;
    cases.iter().zip(&studies).map(|((name, .., method), study)| Profiles::of(method, name, study)).collect()
}
