//! Figure 14: correlogram against periodogram accumulation at 200 and 400 ns, Cn2 = 1e-15, about the vortex centre.

use super::context::{Context, Rendered};
use super::profiles;
use super::study::{Age, REFERENCES, Sight, Study, near_scene, with_method, with_turbulence};
use crate::Failure;
use crate::claim::{Claim, Verdict};
use profiles::{Profiles, peak, width_m};
use wakescope_sim::plot::Figure;
use wakescope_sim::scene::{PulseShape, SnrReference};

const DURATIONS_S: [f64; 2] = [200e-9, 400e-9];

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let realisations = context.choose(3, 24, 100);
    let sight = Sight::of(context, Age::Early)?;
    let mut cases = Vec::new();
    for (name, reference) in REFERENCES {
        for duration_s in DURATIONS_S {
            cases.extend(["PA", "CA"].map(|method| (name, reference, duration_s, method)));
        }
    }
    let scene = |(_, reference, duration_s, method): &(&str, SnrReference, f64, &str)| {
        let mut scene = with_method(near_scene(realisations), method);
        scene.detector.snr = *reference;
        scene.pulse.shape = PulseShape::gaussian(*duration_s);
        with_turbulence(context, scene, 1e-15)
    };
    let studies = Study::runs(context, &sight, cases.iter().map(scene).collect())?;
    let shown = cases.iter().zip(&studies);
    let all: Vec<Profiles> =
        shown.map(|((name, _, _, method), study)| Profiles::of(method, name, study)).collect::<Result<_, _>>()?;
    let origin = context.provenance_of_formula(&sight.scene(context, near_scene(realisations)).to_toml());
    let every: Vec<&Profiles> = all.iter().collect();
    let panels = all.chunks(4).map(|of| {
        let four: Vec<&Profiles> = of.iter().collect();
        profiles::plot(&format!("{} signal-to-noise ratio", of[0].name), &four)
    });
    let mut out = Rendered::new(&profiles::table(&every), &Figure::stacked(panels), &origin)?;
    out.marks = vec![sight.mark];
    out.caption = format!(
        "Root mean square error against the range from the vortex centre, over the lines within 4 m of a core, less its \
         level at the edges; PA and CA at 200 and 400 ns, Cn2 = 1e-15, rho = 2 m, {realisations} scans of one pulse a line; {}.",
        sight.words
    );
    out.claims = vec![peak_claim(&all), width_claim(&all)];
    Ok(out)
}

fn peak_claim(all: &[Profiles]) -> Claim {
    let (mut words, mut shares, mut error) = (Vec::new(), Vec::new(), 0.0_f64);
    for pair in all.chunks(2) {
        let [(pa, pa_error), (ca, ca_error)] = [peak(&pair[0]), peak(&pair[1])];
        let standard_error = pa_error.hypot(ca_error);
        shares.push(((pa - ca) / pa, standard_error / pa));
        error = error.max(standard_error);
        words.push(format!("{}: PA {pa:.2}, CA {ca:.2} (± {standard_error:.2})", pair[0].title()));
    }
    Claim {
        verdict: Verdict::of_differences(&shares, 2.0),
        standard_error: error,
        ..Claim::exact(
            "F14a",
            "fig14",
            "the peak of the error of CA is below that of PA at both durations",
            "below by more than two standard errors, with both references; less than 5 % of the peak is none",
            words.join("; "),
            false,
        )
    }
}

fn width_claim(all: &[Profiles]) -> Claim {
    let (mut words, mut narrower, mut resolved) = (Vec::new(), Vec::new(), true);
    for pair in all.chunks(2) {
        let [pa, ca] = [width_m(&pair[0]), width_m(&pair[1])];
        words.push(format!("{}: PA {pa:.1}, CA {ca:.1}", pair[0].title()));
        narrower.push(ca < pa);
        // A profile that does not fall to half of its peak has no width; two gates are the resolution.
        resolved &= (ca - pa).abs() > 2.0 * pair[0].gate_m;
    }
    Claim {
        verdict: if resolved { Verdict::of(narrower.iter().all(|n| *n)) } else { Verdict::NotResolved },
        ..Claim::exact(
            "F14b",
            "fig14",
            "the full width at half maximum of the error of CA is below that of PA",
            "narrower by more than two gates, at both durations and with both references",
            format!("{} m", words.join("; ")),
            false,
        )
    }
}
