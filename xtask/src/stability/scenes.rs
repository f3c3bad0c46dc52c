//! Extreme scenes through the whole chain, as `wakescope run` has it but for the files.

use super::extreme::Extreme;
use crate::failure::Failure;
use std::path::Path;
use wakescope_sim::measure::map::VelocityEstimates;
use wakescope_sim::measure::progress::Silent;
use wakescope_sim::measure::run;
use wakescope_sim::plan::{Plan, Target};
use wakescope_sim::scene::SceneFile;

type Number = Result<f64, Failure>;

/// A calm flow, two lines, one pulse, two realisations.
const CALM: &str =
    "[flow]\nkind = \"calm\"\n[scan]\nelevation_max_rad = 0.0025\npulses_per_line = 1\nrealisations = 2\n";

const ERROR: &str = "root mean square error of the map, m/s";
const FLAGGED: &str = "share of the estimates that are flagged";

/// One case a row.
#[rustfmt::skip]
pub(super) fn cases() -> Vec<Extreme> {
    use Extreme as E;
    vec![
        E::at_most("scene without noise", "calm air", ERROR, 0.9, || rms("[detector]\nnoise = \"none\"\n")),
        E::at_most("scene at +100 dB", "calm air", ERROR, 0.9, || rms(&fixed(100.0))),
        E::between("scene at -60 dB", "calm air", FLAGGED, (0.95, 1.0), || flagged(&fixed(-60.0))),
        E::between("scene without backscatter", "backscatter 0", FLAGGED, (0.95, 1.0), || flagged("[atmosphere]\nbackscatter_per_m_sr = 0.0\n")),
        E::between("scene of short pulses", "1 ns at 60 dB: a spectrum wider than the band, 11.2 m/s where all is chance", ERROR, (9.0, 14.0), || rms(&format!("[pulse.shape]\nduration_s = 1e-9\n{}", fixed(60.0)))),
        E::at_most("scene of one window", "64 samples from 400 m on", "cells without an estimate", 0.0, one_window),
        E::refused("scene with an unknown key", "pulse.enery_j", "enery_j", || rms("[pulse]\nenery_j = 1e-4\n")),
        E::refused("scene with NaN", "pulse.energy_j = nan", "pulse.energy_j", || rms("[pulse]\nenergy_j = nan\n")),
        E::refused("scene of 1e9 realisations", "scan.realisations = 1e9", "scan.realisations", || rms("[scan]\nrealisations = 1000000000\n")),
        E::refused("scan backwards", "elevation_max_rad below elevation_min_rad", "elevation", || rms("[scan]\nelevation_min_rad = 0.2\nelevation_max_rad = 0.1\n")),
    ]
}

fn fixed(snr_db: f64) -> String {
    format!("[detector.snr]\nreference = \"fixed\"\nsnr_db = {snr_db:?}\n")
}

/// The map of a scene; what it says of the scan stands in for that of calm air.
fn map(scene: &str) -> Result<VelocityEstimates, Failure> {
    let text = if scene.contains("[scan]") { scene.to_owned() } else { format!("{CALM}{scene}") };
    let plan = Plan::new(SceneFile::parse(&text, Path::new("extreme.toml"))?, Target::Map)?;
    run::run(&plan, &Silent)?.map.ok_or_else(|| Failure::new("the plan gave no map".into()))
}

fn rms(scene: &str) -> Number {
    let map = map(scene)?;
    let errors = map.rms_m_s.iter().filter(|e| e.is_finite());
    let (sum, count) = errors.fold((0.0, 0.0), |(sum, count), e| (sum + e * e, count + 1.0));
    Ok(f64::sqrt(sum / count))
}

fn flagged(scene: &str) -> Number {
    let map = map(scene)?;
    Ok(map.flagged.mean().unwrap_or(f64::NAN))
}

fn one_window() -> Number {
    let scan = "[flow]\nkind = \"calm\"\n[scan]\nelevation_max_rad = 0.0\nrange_min_m = 400.0\nrange_max_m = 438.3\n\
                pulses_per_line = 2\nrealisations = 1\n";
    let map = map(&format!("{scan}{}", fixed(20.0)))?;
    Ok(map.v_mean_m_s.iter().filter(|v| v.is_nan()).count() as f64 + if map.v_mean_m_s.is_empty() { 1.0 } else { 0.0 })
}
