//! Velocity envelopes of spectra: circulations beside the fit.
//!
//! Check: a pair's envelopes, inverted, have its circulation, and raw ones more, in the tests of the program.

use super::table::{RetrievedScan, measured, name, refused};
use crate::Error;
use crate::io::Table;
use crate::measure::recorded::{Spectra, upward};
use crate::plan::Plan;
use crate::scene::Scene;
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
    let Some(shape) = gaussian_shape(plan)? else {
        return Err(Error::Input {
            path: found.scan.path.clone(),
            reason: "--method envelope knows Gaussian pulses and windows alone: estimator.weighting = \"gaussian\"".into(),
        });
    };
    let Some(about) = found
        .result
        .wake
        .filter(|_| found.result.vortices.len() == 2)
    else {
        return Ok(Vec::new());
    };
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
    let threshold = threshold(plan.scene())?;
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

/// The spectra of a scene with a Gaussian pulse and window; nothing for others.
fn gaussian_shape(plan: &Plan) -> Result<Option<SpectralShape>, Error> {
    let scene = plan.scene();
    let Weighting::Gaussian {
        relative_half_width,
    } = scene.weighting()
    else {
        return Ok(None);
    };
    if !scene.pulse.is_gaussian() {
        return Ok(None);
    }
    let window_sigma_s =
        relative_half_width * scene.estimator.window_samples as f64 / scene.detector.sampling_hz;
    let shape = SpectralShape::gaussian(
        plan.instrument.pulse.sigma_s(),
        window_sigma_s,
        scene.laser.wavelength_m,
        scene.detector.bandwidth_hz,
    )?;
    Ok(Some(shape))
}

/// Power over the noise that the highest cell of noise exceeds at the false-alarm rate.
fn threshold(scene: &Scene) -> Result<f64, Error> {
    let band_hz = scene.detector.bandwidth_hz;
    // Independent cells of the maximum over all frequencies of the band.
    let count = 3.0 * band_hz * scene.estimator.window_samples as f64 / scene.detector.sampling_hz;
    let of_cell = -((-FALSE_ALARM).ln_1p() / count).exp_m1();
    Ok(cell_threshold(scene.scan.pulses_per_line as f64, of_cell)?)
}

/// Raw, narrowed and inverted circulations of each scan.
pub fn envelope_table(all: &[(usize, EnvelopeResult)]) -> Table {
    let results = all.iter().map(|(_, result)| result);
    let raw_m2_s = results.clone().map(|r| r.raw_m2_s);
    let narrowed_m2_s = results.clone().map(|r| r.narrowed_m2_s);
    let inverted = results.clone().map(|r| r.inverted_m2_s);
    let table = Table::new()
        .int("scan", all.iter().map(|(scan, _)| *scan as i64))
        .text("side", results.clone().map(|r| name(r.side)))
        .float("raw_m2_s", raw_m2_s)
        .float("narrowed_m2_s", narrowed_m2_s);
    measured(table, "inverted_m2_s", inverted)
        .int("lines", results.clone().map(|r| r.lines as i64))
        .int("left_out", results.map(|r| r.left_out as i64))
}
