//! Samples that the converter clips where the signal is strongest.
//!
//! The budget has what clipping does to noise and weak signals; a signal that is much stronger than the noise is clipped by a full scale
//! that is chosen for the noise. Check: a scene whose signal is clipped is warned of, with a full scale that leaves no warning.

use crate::Error;
use crate::interpolation::linspace;
use crate::measure::profile::efficiency_by_theory;
use crate::plan::Plan;
use crate::plan::instrument;
use crate::scene::{DetectorSignal, Digitiser, NoiseModel, SnrReference};
use wakescope_signal::receiver::Converter;

/// Fraction of clipped samples up to which no scene is warned of.
const FEW: f64 = 1e-3;
/// Full scale that clips this fraction, over the standard deviation of the samples, rounded up.
const SUFFICIENT: f64 = 3.4;
/// Ranges at which the signal is looked at.
const POINTS: usize = 33;

/// Where noise and signal together are clipped, and by which full scale they are not; nothing where the signal is not known without
/// phase screens.
pub(crate) fn warning(plan: &Plan) -> Option<String> {
    let scene = plan.scene();
    let Digitiser::Quantised {
        full_scale_over_noise,
        ..
    } = scene.detector.digitiser
    else {
        return None;
    };
    let converter = instrument::converter(scene)?;
    let [range_m, snr] = strongest(plan).ok()?;
    let receiver = &plan.instrument.receiver;
    // The ratio counts the converter's own noise, which is not at its input.
    let front = &receiver.front_end;
    let over_noise = snr * (1.0 + front.rounding_noise + front.clipping_noise);
    let of_signal = match scene.detector.signal {
        DetectorSignal::IntermediateFrequency => over_noise,
        // Half in each quadrature.
        DetectorSignal::Baseband => 0.5 * over_noise,
    };
    let of_noise = match scene.detector.noise {
        NoiseModel::None => 0.0,
        NoiseModel::BandLimited | NoiseModel::White => converter.input_over_noise.powi(2),
    };
    let input_over_noise = (of_noise + of_signal).sqrt();
    if input_over_noise == 0.0 || !input_over_noise.is_finite() {
        return None;
    }
    // Speckle is Gaussian, as noise is.
    let strong = Converter {
        input_over_noise,
        ..converter
    };
    let clipped = strong.clipping().clipped_fraction;
    if clipped <= FEW {
        return None;
    }
    // The highest of 2^bits codes is below full scale.
    let highest = 1.0 - (-f64::from(converter.bits)).exp2();
    let enough = (SUFFICIENT * input_over_noise / highest).ceil();
    Some(format!(
        "detector.digitiser.full_scale_over_noise = {full_scale_over_noise} clips {:.1} % of the samples at {range_m:.0} m, where signal \
         and noise are {input_over_noise:.1} times the noise in the band: ratios of maps come out too low; {enough:.0} or more clips fewer \
         than {} %",
        100.0 * clipped,
        100.0 * FEW,
    ))
}

/// Range of the scan, m, from which the signal is strongest, and its signal-to-noise ratio there, a power ratio.
///
/// # Errors
/// What optics and signals refuse, such as a range beyond the theory of turbulence.
fn strongest(plan: &Plan) -> Result<[f64; 2], Error> {
    let scene = plan.scene();
    let first_m = scene.scan.range_min_m;
    let last_m = scene.scan.range_max_m;
    if let SnrReference::Fixed { snr_db } = scene.detector.snr {
        return Ok([first_m, 10f64.powf(0.1 * snr_db)]);
    }
    // The signal changes by factors of the range.
    let mut range_m = linspace(first_m.ln(), last_m.ln(), POINTS);
    for at_m in &mut range_m {
        *at_m = at_m.exp().clamp(first_m, last_m);
    }
    range_m.dedup();
    let efficiency = efficiency_by_theory(&plan.instrument, &range_m)?;
    if let Some(profile) = &scene.atmosphere.profile {
        let mut nodes_m = profile.range_m.clone();
        nodes_m.retain(|node_m| (first_m..=last_m).contains(node_m));
        range_m.extend(nodes_m);
    }
    let mut strongest = [first_m, 0.0];
    for at_m in range_m {
        let returned = plan.instrument.return_per_m(at_m)? * efficiency.interpolated(at_m)?;
        let snr = plan
            .instrument
            .receiver
            .slowly_varying_snr(scene.pulse.energy_j, returned);
        if snr > strongest[1] {
            strongest = [at_m, snr];
        }
    }
    Ok(strongest)
}

#[cfg(test)]
mod tests {
    use crate::measure::budget::Budget;
    use crate::plan::{Plan, Target};
    use crate::progress::Silent;
    use crate::scene::SceneFile;

    /// Warnings of a converter of 8 bits.
    fn warnings(energy_j: f64, full_scale: f64, detector: &str) -> Vec<String> {
        let text = format!(
            "[pulse]\nenergy_j = {energy_j:?}\n[detector]\n{detector}\n\
             digitiser = {{ kind = \"quantised\", bits = 8, full_scale_over_noise = {full_scale:?} }}\n"
        );
        let file = SceneFile::parse(&text, std::path::Path::new("s.toml")).unwrap();
        let plan = Plan::new(file, Target::Efficiency).unwrap();
        let of_budget = Budget::new(&plan, &[400.0], &Silent).unwrap().warnings;
        assert_eq!(of_budget, plan.warnings);
        plan.warnings
    }

    #[test]
    fn a_signal_beyond_full_scale_is_warned_of_with_one_that_is_enough() {
        assert!(warnings(150e-6, 8.0, "").is_empty());
        for (energy_j, detector, clipped) in [
            // 24 dB: the full scale is half of a standard deviation, beyond which are 60 % of the samples.
            (0.25, "", 55.0..65.0),
            // 20 dB in each of two quadratures: 1.13 standard deviations.
            (
                150e-6,
                "signal = \"baseband\"\nsnr = { reference = \"fixed\", snr_db = 20.0 }",
                25.0..27.0,
            ),
        ] {
            let found = warnings(energy_j, 8.0, detector);
            assert_eq!(found.len(), 1, "{found:?}");
            let words: Vec<&str> = found[0].split(' ').collect();
            assert_eq!(words[0], "detector.digitiser.full_scale_over_noise");
            let after = |word: &str| {
                let at = words.iter().position(|found| *found == word).unwrap();
                words[at + 1].parse::<f64>().unwrap()
            };
            assert!(clipped.contains(&after("clips")), "{found:?}");
            assert!((270.0..530.0).contains(&after("at")), "{found:?}");
            let enough = after("low;");
            assert!(warnings(energy_j, enough, detector).is_empty(), "{found:?}");
            assert!(!warnings(energy_j, 0.9 * enough, detector).is_empty());
        }
    }
}
