//! Figure 13: correlogram against periodogram accumulation on the early pair, 200 ns, and how it depends on the SNR.

use super::context::{Context, Rendered};
use super::profiles;
use super::study::{Age, INSIDE_M, REFERENCES, Sight, Study, mean_and_error, near_scene, of_batch, with_method};
use crate::Failure;
use crate::claim::{Claim, Verdict, with_error};
use profiles::{Profiles, edge_level};
use wakescope_sim::plot::Figure;
use wakescope_sim::scene::{Scene, SnrReference};

/// Fixed ratios beside the two references, dB.
const FIXED_DB: [f64; 4] = [-5.0, 0.0, 10.0, 20.0];

/// Batches of scans with seeds of their own, and Student's factor of a 95 % interval for their mean.
const BATCHES: u64 = 6;
const METHODS: [&str; 2] = ["PA", "CA"];
const STUDENT: f64 = 2.571;

/// PA and CA on the same signals at one signal-to-noise ratio.
struct Pair {
    pa: Profiles,
    ca: Profiles,
    /// CA less PA inside the vortices, each less its edges, for each batch, m/s.
    differences_m_s: Vec<f64>,
}

/// The scenes of the batches, PA and CA of each.
fn scenes(reference: SnrReference, realisations: usize) -> impl Iterator<Item = Scene> {
    let both = move |batch| {
        METHODS.map(|method| {
            let mut scene = of_batch(with_method(near_scene(realisations), method), batch);
            scene.detector.snr = reference;
            scene
        })
    };
    (0..BATCHES).flat_map(both)
}

/// What the batches of a ratio show.
fn pair(name: &'static str, studies: &[Study]) -> Result<Pair, Failure> {
    let (mut batches, mut differences_m_s) = ([Vec::new(), Vec::new()], Vec::new());
    for of_batch in studies.chunks(METHODS.len()) {
        let mut level_m_s = [0.0; 2];
        for (place, (method, study)) in METHODS.into_iter().zip(of_batch).enumerate() {
            let profiles = Profiles::of(method, name, study)?;
            level_m_s[place] = profiles.inside.rms_m_s - edge_level(&profiles);
            batches[place].push(profiles);
        }
        differences_m_s.push(level_m_s[1] - level_m_s[0]);
    }
    let [pa, ca] = batches.map(|of| Profiles::joined(&of));
    Ok(Pair { pa: pa?, ca: ca?, differences_m_s })
}

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let realisations = context.choose(1, 4, 16);
    let sight = Sight::of(context, Age::Early)?;
    let fixed = FIXED_DB.map(|snr_db| ("fixed", SnrReference::Fixed { snr_db }));
    let pairs = REFERENCES.into_iter().chain(fixed);
    let pairs: Vec<(&'static str, SnrReference)> = pairs.collect();
    let all_scenes = pairs.iter().flat_map(|(_, reference)| scenes(*reference, realisations)).collect();
    let studies = Study::runs(context, &sight, all_scenes)?;
    let of_pairs = pairs.iter().zip(studies.chunks(BATCHES as usize * METHODS.len()));
    let pairs: Vec<Pair> = of_pairs.map(|((name, _), studies)| pair(name, studies)).collect::<Result<_, _>>()?;
    let origin = context.provenance_of_formula(&sight.scene(context, near_scene(realisations)).to_toml());
    let all: Vec<&Profiles> = pairs.iter().flat_map(|p| [&p.pa, &p.ca]).collect();
    let shown = |p: &&Pair| p.pa.name != "fixed" || [0.0, 20.0].iter().any(|db| (p.pa.snr_db - db).abs() < 0.1);
    let panels = pairs.iter().filter(shown).map(|p| profiles::plot(&p.pa.title(), &[&p.pa, &p.ca]));
    let mut out = Rendered::new(&profiles::table(&all), &Figure::stacked(panels), &origin)?;
    out.marks = vec![sight.mark];
    out.caption = format!(
        "Root mean square error against the range from the vortex centre, over the lines within 4 m of a core, less its \
         level at the edges; periodogram (PA) and correlogram accumulation (CA, AR(16)), rho = 2 m, 200 ns, {} scans; {}.",
        BATCHES as usize * realisations,
        sight.words
    );
    out.claims.push(claim(&pairs));
    Ok(out)
}

fn claim(pairs: &[Pair]) -> Claim {
    let (mut words, mut shares, mut error) = (Vec::new(), Vec::new(), 0.0_f64);
    for pair in pairs {
        let (difference_m_s, standard_error) = mean_and_error(&pair.differences_m_s);
        shares.push((-difference_m_s / pair.pa.inside.rms_m_s, standard_error / pair.pa.inside.rms_m_s));
        error = error.max(standard_error);
        words.push(format!(
            "{}: CA - PA = {} (with the evolution {:.2} and {:.2})",
            pair.pa.title(),
            with_error(difference_m_s, standard_error),
            pair.ca.inside.rms_m_s,
            pair.pa.inside.rms_m_s
        ));
    }
    Claim {
        verdict: Verdict::of_differences(&shares, STUDENT),
        standard_error: error,
        ..Claim::exact(
            "F13",
            "fig13",
            &format!(
                "inside the vortices (within {INSIDE_M} m) the error of CA is below that of PA after the mean evolution with range \
                 is removed, on the same signals"
            ),
            "below with 95 % confidence at every signal-to-noise ratio; less than 5 % of the error is none",
            words.join("; "),
            false,
        )
    }
}
