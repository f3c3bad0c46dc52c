//! Figure 14: correlogram against periodogram accumulation at 200 and 400 ns, Cn2 = 1e-15, about the vortex centre.

use super::context::{Context, Rendered};
use super::fig13::{of_all_methods, profiles_words};
use super::profiles::{self, Profiles};
use super::study::{Age, METHODS, Sight, near_scene, with_turbulence};
use crate::claim::Claim;
use fixtures::failure::Failure;
use wakescope_sim::plot::Figure;

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let scans = context.choose([16, 96], [32, 192], [96, 400]);
    let sight = Sight::of(context, Age::Early)?;
    let all = of_all_methods(context, &sight, scans, |scene| with_turbulence(context, scene, 1e-15))?;
    let origin = context.provenance_of_formula(&sight.scene(context, near_scene(scans[1])).to_toml());
    let panels = all
        .chunks(2 * METHODS.len())
        .map(|of| profiles::plot(&format!("{} signal-to-noise ratio, {:.1} dB", of[0].name, of[0].snr_db), of));
    let mut out = Rendered::new(&profiles::table(&all), &Figure::stacked(panels), &origin)?;
    out.add("batches.csv", &profiles::batches_table(all.iter().map(|p| (p.title(), p)), true), &origin)?;
    out.caption = format!(
        "{} PA, unweighted and with the Gaussian weighting, and CA (unweighted) at 200 and 400 ns, Cn2 = 1e-15 m^(-2/3), {} scans ({} at the physical ratio) of one \
         pulse a line; {}.",
        profiles_words(),
        scans[1],
        scans[0],
        sight.words
    );
    out.marks = vec![sight.mark];
    let chapter = &all[all.len() / 2..];
    let peaks = profiles::parts(chapter, " m/s", Profiles::peak_m_s);
    let widths = profiles::parts(chapter, " m", Profiles::width_m);
    out.words = format!("Is its profile across a core narrower, too? {} (figure 14).", profiles::told(&widths));
    out.claims = vec![Claim::judged("F14a", &peaks), Claim::judged("F14b", &widths)];
    Ok(out)
}
