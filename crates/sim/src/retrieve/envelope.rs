//! Velocity envelopes of spectra: circulations beside the fit.
//!
//! Check: a pair's envelopes, inverted, have its circulation, and raw ones more, in the tests of the program.

use super::table::{RetrievedScan, name, refused};
use crate::Error;
use crate::io::Table;
use crate::measure::recorded::{Spectra, upward};
use crate::plan::Plan;
use ndarray::Array3;
use std::ops::Range;
use wakescope_estimate::Measured;
use wakescope_estimate::Weighting;
use wakescope_estimate::estimators::cell_threshold;
use wakescope_estimate::retrieval::{
    EnvelopeResult, ScanSpectra, SpectralShape, velocity_envelopes,
};

/// Rate at which the highest cell of noise is above the threshold of an envelope.
const FALSE_ALARM: f64 = 1e-2;
/// Circulations by velocity envelopes about the wake that the map of a scan has; nothing without one. The circulations over 5 to
/// 15 m of the scan become the inverted ones.
///
/// # Errors
/// A scene whose pulse or window is no Gaussian, or whose noise is not known.
pub fn envelopes(
    plan: &Plan,
    spectra: &Spectra,
    lines: Range<usize>,
    snr: f64,
    found: &mut RetrievedScan,
) -> Result<Vec<EnvelopeResult>, Error> {
    let scene = plan.scene();
    let refuse = |reason: &str| Error::Input {
        path: found.scan.path.clone(),
        reason: reason.into(),
    };
    let (
        true,
        Weighting::Gaussian {
            relative_half_width,
        },
    ) = (scene.pulse.is_gaussian(), scene.weighting())
    else {
        return Err(refuse(
            "--method envelope knows Gaussian pulses and windows alone: estimator.weighting = \"gaussian\"",
        ));
    };
    let Some(about) = found
        .result
        .wake
        .filter(|_| found.result.vortices.len() == 2)
    else {
        return Ok(Vec::new());
    };
    let window_sigma_s =
        relative_half_width * scene.estimator.window_samples as f64 / scene.detector.sampling_hz;
    let wavelength_m = scene.laser.wavelength_m;
    let band_hz = scene.detector.bandwidth_hz;
    let shape = SpectralShape::gaussian(
        plan.instrument.pulse.sigma_s(),
        window_sigma_s,
        wavelength_m,
        band_hz,
    )?;
    let gates = spectra.range_m.len();
    let cells = spectra.velocity_m_s.len();
    let order = upward(lines, &spectra.elevation_rad);
    let power = Array3::from_shape_fn((order.len(), gates, cells), |(line, gate, cell)| {
        f64::from(spectra.density[(order[line] * gates + gate) * cells + cell])
    });
    let elevation_rad: Vec<f64> = order
        .iter()
        .map(|line| spectra.elevation_rad[*line])
        .collect();
    // Independent cells of the maximum over all frequencies of the band.
    let count = 3.0 * band_hz * scene.estimator.window_samples as f64 / scene.detector.sampling_hz;
    let of_cell = -((-FALSE_ALARM).ln_1p() / count).exp_m1();
    let windows = scene.scan.pulses_per_line as f64;
    let threshold = cell_threshold(windows, of_cell)?;
    let scan = ScanSpectra {
        elevation_rad: &elevation_rad,
        range_m: &spectra.range_m,
        velocity_m_s: &spectra.velocity_m_s,
        power: power.view(),
        snr,
    };
    let results = velocity_envelopes(&scan, &shape, &found.options.model, &about, threshold)
        .map_err(|error| refused(&found.scan, &error))?;
    for vortex in &mut found.result.vortices {
        if let Some(result) = results.iter().find(|result| result.side == vortex.side) {
            vortex.circulation_5_15_m2_s = result.inverted_m2_s;
            vortex.circulation_m2_s = Measured {
                value: f64::NAN,
                std: f64::NAN,
            };
        }
    }
    Ok(results.to_vec())
}

/// Raw, narrowed and inverted circulations of each scan.
pub fn envelope_table(all: &[(usize, EnvelopeResult)]) -> Table {
    Table::new()
        .int("scan", all.iter().map(|(scan, _)| *scan as i64))
        .text("side", all.iter().map(|(_, r)| name(r.side)))
        .float("raw_m2_s", all.iter().map(|(_, r)| r.raw_m2_s))
        .float("narrowed_m2_s", all.iter().map(|(_, r)| r.narrowed_m2_s))
        .float(
            "inverted_m2_s",
            all.iter().map(|(_, r)| r.inverted_m2_s.value),
        )
        .float(
            "inverted_std_m2_s",
            all.iter().map(|(_, r)| r.inverted_m2_s.std),
        )
        .int("lines", all.iter().map(|(_, r)| r.lines as i64))
        .int("left_out", all.iter().map(|(_, r)| r.left_out as i64))
}
