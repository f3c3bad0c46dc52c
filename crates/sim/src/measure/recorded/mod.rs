//! Velocities from the records of a file, measured or simulated, through the estimator of a scene.
//!
//! Records of a simulation whose scene differs in estimator, outputs and site alone are held against the truth of that scene, as
//! a run does it; all others give what an instrument can know: velocity, quality, n_eff, signal-to-noise ratio, and the standard
//! deviation that the Cramer-Rao bound predicts for it. Records are read in pieces and estimated in tiles of lines and gates, so
//! that the memory for signals grows neither with their number nor with their length.
//! Check: maps of a run's own signals have the bytes of the run, from every format, whole or in blocks.

mod blocks;
mod lines;
mod predicted;
mod result;
mod spectra;
mod tiles;

pub use crate::io::Spectra;
pub(crate) use lines::upward;
pub use lines::{RayTable, ScanLines};
pub(crate) use predicted::PredictedError;
pub use predicted::predicted_table;
pub use result::{MeasuredScan, measured_map};
use spectra::spectra_of_scans;
pub(crate) use spectra::{GateSpectra, spectra_of_samples};

use crate::Error;
use crate::io::raw::{RawFormat, RawRecords};
use crate::measure::map::{self, VelocityEstimates};
use crate::measure::map_estimator::WindowSums;
use crate::measure::scan::Scanner;
use crate::measure::scan::records_at_once;
use crate::plan::scan_lines;
use crate::plan::{Plan, Stage};
use crate::progress::Observer;
use crate::scene::{DetectorSignal, Digitiser, Estimator, Outputs, Scene, SceneFile, Site};
use num_complex::Complex;
use std::ops::Range;
use std::path::Path;
use wakescope_estimate::window::{Sample, SampleSizes};

/// The power of the noise that velocities are held against.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NoiseLevel {
    /// As the scene's receiver has it, for signals in ampere.
    OfScene,
    /// That of the gates without a signal, found from the quietest tenth on, in the mean over the lines; corrected for being chosen
    /// by their power.
    Quietest,
    /// Mean square of a sample of noise in the band, both quadratures together, in the square of the unit of the samples.
    Given(f64),
}

/// How the records of a file are estimated.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RecordedOptions {
    /// Angles and times of the records, where they are not those of the file or of the scene.
    pub rays: Option<RayTable>,
    /// The noise; that of the scene for its own signals and the quietest gates for others if absent.
    pub noise: Option<NoiseLevel>,
    /// Whether the spectrum of each gate is kept.
    pub spectra: bool,
    /// Most bytes that the sums of a tile of lines and gates may take.
    pub block_bytes: Option<usize>,
}

/// What the records of a file give.
#[derive(Debug, PartialEq)]
pub enum Recorded {
    /// Signals of a simulation, with the truth of its scene.
    OfRun {
        /// Velocities, and what they are held against.
        map: Box<VelocityEstimates>,
        /// Spectra of all scans, if they were asked for.
        spectra: Option<Spectra>,
    },
    /// Signals of which nothing is known but themselves.
    Measured {
        /// Velocities of each scan.
        scans: Vec<MeasuredScan>,
        /// Their spectra, if they were asked for.
        spectra: Option<Spectra>,
    },
}

/// Opens a file of raw signals, with the samples and pulses that a scene has.
///
/// # Errors
/// As [`RawRecords::open`].
pub fn open(path: &Path, format: &RawFormat, scene: &Scene) -> Result<RawRecords, Error> {
    RawRecords::open(
        path,
        format,
        scene.samples_per_record(),
        scene.scan.pulses_per_line,
    )
}

/// The scene for the records of a file: with as many repetitions as the file has, its receiver mirrored where the spectrum of the
/// records is reversed; and whether the truth of the scene is that of the records. The observer is warned of keys of the file's
/// scene that are skipped.
///
/// # Errors
/// Fails if the records have another shape or kind than the scene's or were recorded with other keys, or if they are signals of the
/// same scene that were drawn with another seed or number of realisations.
pub fn scene_of_records(
    scene: SceneFile,
    records: &RawRecords,
    observer: &dyn Observer,
) -> Result<(SceneFile, bool), Error> {
    fits(&scene.content, records)?;
    let scene = if records.is_reversed {
        mirrored(scene)?
    } else {
        scene
    };
    let whole = scan_lines::schedule(&scene)?.pulses();
    // The truth of a scene is not that of its signals with another sign of the velocities.
    let of_run = records.scene_toml.as_deref();
    let own = of_run
        .filter(|_| !records.is_reversed)
        .and_then(|toml| SceneFile::embedded(toml, &records.path).ok())
        .filter(|(own, _)| signals_of(&own.content) == signals_of(&scene.content));
    if let Some((own, warning)) = &own {
        warning.iter().for_each(|text| observer.warn(text));
        let drawn = |s: &Scene| {
            [
                ("seed", s.seed),
                ("scan.realisations", s.scan.realisations as u64),
            ]
        };
        if let Some(((key, of_file), (_, stated))) = drawn(&own.content)
            .into_iter()
            .zip(drawn(&scene.content))
            .find(|(a, b)| a != b)
        {
            return Err(records.refuse(format!(
                "it has the signals of this scene with {key} = {of_file}, and {key} is {stated}: only estimator, outputs and site may differ"
            )));
        }
    }
    let is_own = own.is_some() && records.records.is_multiple_of(whole);
    let repetitions = records.records / whole.max(1);
    let file = if !is_own || repetitions == scene.content.scan.realisations {
        scene
    } else {
        let mut own = scene.content.clone();
        own.scan.realisations = repetitions;
        scene.with(own)?
    };
    Ok((file, is_own))
}

/// The scene whose receiver records signals with the reversed spectrum: the intermediate frequency of
/// real samples is mirrored at a quarter of the sampling rate, complex samples remain about zero.
fn mirrored(scene: SceneFile) -> Result<SceneFile, Error> {
    if scene.content.detector.signal == DetectorSignal::Baseband {
        return Ok(scene);
    }
    let mut content = scene.content.clone();
    let detector = &mut content.detector;
    detector.intermediate_frequency_hz =
        0.5 * detector.sampling_hz - detector.intermediate_frequency_hz;
    scene.with(content)
}

/// A scene without what is done with its signals.
fn signals_of(scene: &Scene) -> String {
    let mut same = Scene {
        seed: 0,
        estimator: Estimator::default(),
        outputs: Outputs::default(),
        site: Site::default(),
        ..scene.clone()
    };
    same.scan.realisations = 1;
    format!("{same:?}")
}

/// Refuses records that are not those of the scene's receiver.
fn fits(scene: &Scene, records: &RawRecords) -> Result<(), Error> {
    let samples = scene.samples_per_record();
    if records.samples != samples {
        let last_m =
            scene.scan.range_min_m + (records.samples as f64 - 0.5) * scene.sample_spacing_m();
        return Err(records.refuse(format!(
            "a record has {} samples, {samples} in the scene: scan.range_max_m = {last_m:.3} makes it as many",
            records.samples
        )));
    }
    let needed = scene.detector.signal == DetectorSignal::Baseband;
    if records.is_complex != needed {
        let kind = |complex| if complex { "complex" } else { "real" };
        return Err(records.refuse(format!(
            "its samples are {}, the scene's {}: detector.signal is \"intermediate_frequency\" for real and \"baseband\" for \
             complex samples; --complex says that the numbers of a file are pairs",
            kind(records.is_complex),
            kind(needed)
        )));
    }
    let d = &scene.detector;
    let at_rest_hz = if needed {
        0.0
    } else {
        d.intermediate_frequency_hz
    };
    for (name, key, own) in [
        ("sampling_frequency", "detector.sampling_hz", d.sampling_hz),
        (
            "intermediate_frequency",
            "detector.intermediate_frequency_hz",
            at_rest_hz,
        ),
        ("bandwidth", "detector.bandwidth_hz", d.bandwidth_hz),
        ("wavelength", "laser.wavelength_m", scene.laser.wavelength_m),
        (
            "pulse_repetition_frequency",
            "laser.pulse_repetition_hz",
            scene.laser.pulse_repetition_hz,
        ),
        ("pulse_sigma", "pulse", scene.pulse_sigma_s()),
    ] {
        let Some(value) = records.constants.get(name) else {
            continue;
        };
        let off = (value - own).abs();
        if off.is_nan() || off > 1e-6 * own.abs() {
            return Err(records.refuse(format!(
                "its {name} is {value:?}, the scene's {key} says {own:?}"
            )));
        }
    }
    Ok(())
}

/// Estimates the velocities of all records, with the plan of the scene of [`scene_of_records`] and whether that is their own.
///
/// # Errors
/// What the system says of the file; records without any number; angles and times that do not fit.
pub fn estimate(
    (plan, is_own): (&Plan, bool),
    records: &mut RawRecords,
    options: &RecordedOptions,
    observer: &dyn Observer,
) -> Result<Recorded, Error> {
    match plan.scene().detector.signal {
        DetectorSignal::IntermediateFrequency => {
            of_samples::<f64>(plan, is_own, records, options, observer)
        }
        DetectorSignal::Baseband => {
            of_samples::<Complex<f64>>(plan, is_own, records, options, observer)
        }
    }
    .map_err(|error| plan.file.of_key(error))
}

fn of_samples<S: Sample>(
    plan: &Plan,
    is_own: bool,
    records: &mut RawRecords,
    options: &RecordedOptions,
    observer: &dyn Observer,
) -> Result<Recorded, Error> {
    let largest = largest_part(plan, is_own, records, observer)?;
    // Numbers that are scaled are not those of the scene any more, and another noise gives another map.
    let is_own = is_own && records.whole_scale() == 1.0;
    let noise = options.noise.unwrap_or(if is_own {
        NoiseLevel::OfScene
    } else {
        NoiseLevel::Quietest
    });
    let is_run = is_own && noise == NoiseLevel::OfScene && options.rays.is_none();
    if is_run && !options.spectra {
        return Ok(Recorded::OfRun {
            map: of_run::<S>(plan, records, observer)?,
            spectra: None,
        });
    }
    if !plan.geometry.schedule.keeps_to_a_plane() {
        let kind = plan.scene().scan.pattern.name();
        return Err(records.refuse(format!(
            "the lines of the scene (scan.pattern.kind = \"{kind}\") are not those of one vertical plane from a lidar and a head that \
             stand still: such records are estimated where they are a simulation's own, by its scene, without --rays and --spectra; \
             others need kind = \"rhi\" with scan.head.motion = \"stepped\""
        )));
    }
    let scans = lines::scans(plan, records, options.rays.as_ref())?;
    observer.begin(
        Stage::Estimates,
        scans
            .iter()
            .map(|scan| scan.elevation_rad.len() as u64)
            .sum(),
    );
    let found = blocks::scans::<S>(plan, records, largest, &scans, options, observer)?;
    observer.end();
    let density: Vec<_> = found
        .iter()
        .filter_map(|scan| Some((&scan.lines, scan.spectra.as_deref()?)))
        .collect();
    let spectra = (!density.is_empty())
        .then(|| spectra_of_scans(plan, &density))
        .transpose()?;
    if is_run {
        return Ok(Recorded::OfRun {
            map: of_run::<S>(plan, records, observer)?,
            spectra,
        });
    }
    let measured = found
        .into_iter()
        .map(|scan| result::measured(plan, scan, noise))
        .collect::<Result<_, _>>()?;
    Ok(Recorded::Measured {
        scans: measured,
        spectra,
    })
}

/// The maps of a simulation's own records, held against the truth of its scene.
fn of_run<S: Sample>(
    plan: &Plan,
    records: &mut RawRecords,
    observer: &dyn Observer,
) -> Result<Box<VelocityEstimates>, Error> {
    let scanner = Scanner::new(plan, observer)?;
    let lines = plan.geometry.elevation_rad.len() as u64;
    let pulses = scanner.pulses();
    let read = |realisation: usize, sums: &mut [WindowSums<'_, S>]| {
        let scan = realisation * pulses..(realisation + 1) * pulses;
        for piece in pieces(scan.clone(), records.samples) {
            let samples = samples::<S>(records, piece.clone(), 0..records.samples)?;
            map::add_records(sums, piece.start - scan.start, samples.view())?;
        }
        observer.advance(lines);
        Ok(0)
    };
    let maps = map::of_sums(&[plan], &scanner, observer, read, |_| ())?;
    Ok(maps.into_iter().map(Box::new).next().unwrap_or_default())
}

/// Pieces of a range of records of some ten megabytes.
fn pieces(records: Range<usize>, samples: usize) -> impl Iterator<Item = Range<usize>> {
    let size = records_at_once::<Complex<f64>>(samples, records.len());
    let end = records.end;
    records
        .step_by(size)
        .map(move |first| first..(first + size).min(end))
}

/// Some samples of some records \[record, sample\].
pub(crate) fn samples<S: Sample>(
    records: &mut RawRecords,
    range: Range<usize>,
    some: Range<usize>,
) -> Result<ndarray::Array2<S>, Error> {
    let shape = (range.len(), some.len());
    let samples: Vec<S> = records
        .read_samples(range, some)?
        .into_iter()
        .map(S::from_complex)
        .collect();
    ndarray::Array2::from_shape_vec(shape, samples)
        .map_err(|_| records.refuse("it became shorter".into()))
}

/// What is known of the samples of a file before they are used.
#[derive(Default)]
struct Survey {
    sizes: SampleSizes,
    /// The mean of each record that has a sample.
    means: Vec<Complex<f64>>,
    /// The sum of the samples at each place of a record, and their number.
    places: Vec<(Complex<f64>, f64)>,
    /// Number of samples that are not finite.
    not_finite: usize,
}

/// Surveys the samples of a file.
fn survey(records: &mut RawRecords) -> Result<Survey, Error> {
    let mut found = Survey {
        places: vec![(Complex::new(0.0, 0.0), 0.0); records.samples],
        ..Survey::default()
    };
    for piece in pieces(0..records.records, records.samples) {
        for record in records.read(piece)?.chunks(records.samples) {
            let mut sum = Complex::new(0.0, 0.0);
            let mut count = 0.0;
            for (sample, place) in record.iter().zip(&mut found.places) {
                if !sample.is_finite() {
                    found.not_finite += 1;
                    continue;
                }
                found.sizes.add(sample.largest_part());
                sum += *sample;
                count += 1.0;
                place.0 += *sample;
                place.1 += 1.0;
            }
            if count > 0.0 {
                found.means.push(sum / count);
            }
        }
    }
    Ok(found)
}

/// Whether a mean is that of most places of a record, as an offset is and a hard target is not.
fn is_along_records(mean: Complex<f64>, places: &[(Complex<f64>, f64)]) -> bool {
    /// Part of the mean by which the median of the places may differ.
    const SAME: f64 = 0.25;
    let median = |part: fn(Complex<f64>) -> f64| {
        let known = places.iter().filter(|(_, count)| *count > 0.0);
        let mut all: Vec<f64> = known.map(|(sum, count)| part(sum / count)).collect();
        all.sort_by(f64::total_cmp);
        all.get(all.len() / 2).copied().unwrap_or(f64::NAN)
    };
    let median = Complex::new(median(|value| value.re), median(|value| value.im));
    (median - mean).norm() < SAME * mean.norm()
}

/// Fewest records that show whether their mean is none of chance.
const FEWEST_RECORDS: usize = 16;
/// Standard errors that the mean of [`FEWEST_RECORDS`] records exceeds by chance once in 10^8 (Student's distribution).
const SURE: f64 = 12.0;

/// The offset of a converter: the mean of the records, where it is far beyond what their scatter leaves to chance.
fn constant_offset(means: &[Complex<f64>]) -> Option<Complex<f64>> {
    if means.len() < FEWEST_RECORDS {
        return None;
    }
    let count = means.len() as f64;
    let mean = means.iter().sum::<Complex<f64>>() / count;
    let square_sum: f64 = means.iter().map(|own| (own - mean).norm_sqr()).sum();
    let standard_error = (square_sum / (count * (count - 1.0))).sqrt();
    (mean.norm() > SURE * standard_error).then_some(mean)
}

/// The size from which on samples of some records are missing.
fn outsized(records: &RawRecords, sizes: &SampleSizes) -> f64 {
    match records.are_integers {
        true => f64::INFINITY,
        false => sizes.outsized(),
    }
}

/// Warns of missing samples, which cost the windows that hold them.
fn warn_of_missing(records: &RawRecords, found: &Survey, observer: &dyn Observer) {
    let missing = found.not_finite + found.sizes.count_from(records.outsized);
    if missing == 0 {
        return;
    }
    let path = records.path.display();
    let all = records.records * records.samples;
    observer.warn(&format!(
        "{path}: {missing} of {all} samples are missing (a declared fill value, not finite, or a million times larger than the others): \
         windows that hold one are skipped"
    ));
}

/// The largest part of all samples, the outsized ones left out from here on; refuses records without any, and codes that the
/// scene's converter does not have. A constant offset of the samples of an instrument is subtracted from here on: echoes of the air have
/// other phases in each record, and a hard target has some places of it.
fn largest_part(
    plan: &Plan,
    is_own: bool,
    records: &mut RawRecords,
    observer: &dyn Observer,
) -> Result<f64, Error> {
    let found = survey(records)?;
    records.outsized = outsized(records, &found.sizes);
    let largest = found.sizes.largest_below(records.outsized);
    if found.means.is_empty() {
        return Err(
            records.refuse("all of its samples are missing: none is a finite number".into())
        );
    }
    if largest == 0.0 {
        return Err(records.refuse("all of its samples are 0".into()));
    }
    if let Digitiser::Quantised { bits, .. } = plan.scene().detector.digitiser
        && records.are_integers
        && largest / records.whole_scale() > (f64::from(bits) - 1.0).exp2()
    {
        return Err(records.refuse(format!(
            "it has the code {}, beyond the {bits} bits of detector.digitiser: is --byte-order right?",
            largest / records.whole_scale()
        )));
    }
    let offset = match is_own {
        true => None,
        false => constant_offset(&found.means),
    };
    let offset =
        offset.filter(|mean| !records.is_complex || is_along_records(*mean, &found.places));
    let Some(offset) = offset else {
        warn_of_missing(records, &found, observer);
        return Ok(largest);
    };
    subtract(records, offset, observer);
    records.outsized = f64::INFINITY;
    let found = survey(records)?;
    records.outsized = outsized(records, &found.sizes);
    warn_of_missing(records, &found, observer);
    Ok(found.sizes.largest_below(records.outsized))
}

/// Subtracts a constant offset from all samples that are read from here on, with a warning.
fn subtract(records: &mut RawRecords, offset: Complex<f64>, observer: &dyn Observer) {
    let path = records.path.display();
    let shown = match records.is_complex {
        true => format!("{:.4e} {:+.4e} i", offset.re, offset.im),
        false => format!("{:.4e}", offset.re),
    };
    observer.warn(&format!(
        "{path}: the mean of its samples is {shown}, which no echo makes: it is subtracted"
    ));
    // Complex samples with a reversed spectrum are conjugates of the stored ones.
    let stored = match records.is_complex && records.is_reversed {
        true => offset.conj(),
        false => offset,
    };
    records.zero += stored / records.scale;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_offset_of_all_records_is_none_of_their_scatter() {
        let phase = |record: i32| Complex::from_polar(0.1, 2.4 * f64::from(record));
        let about = |offset: Complex<f64>, count: i32| {
            let means: Vec<_> = (0..count).map(|record| offset + phase(record)).collect();
            constant_offset(&means)
        };
        for offset in [Complex::new(2.0, 0.0), Complex::new(-3.0, 1.5)] {
            let found = about(offset, 40).expect("an offset");
            assert!((found - offset).norm() < 0.02, "{found}");
            assert_eq!(about(offset, 8), None, "too few records");
        }
        assert_eq!(about(Complex::new(0.05, -0.05), 40), None);
        let offset = Complex::new(1.0, -2.0);
        let of_places = |target: usize| -> Vec<_> {
            let echo = |place: usize| {
                if place < target {
                    10.0
                } else {
                    0.1 * (place as f64).sin()
                }
            };
            (0..100)
                .map(|place| (4.0 * (offset + echo(place)), 4.0))
                .collect()
        };
        assert!(is_along_records(offset, &of_places(0)));
        let of_target = Complex::new(2.0, 0.0);
        let places: Vec<_> = of_places(20)
            .iter()
            .map(|(sum, count)| (sum - 4.0 * offset, *count))
            .collect();
        assert!(
            !is_along_records(of_target, &places),
            "a hard target in a fifth of the record"
        );
    }
}
