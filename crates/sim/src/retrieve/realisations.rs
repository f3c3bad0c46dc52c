//! Retrieval from every realisation of a scene, by each of its methods, held against the truth of the flow.
//!
//! Check: bias and scatter of a pair; a method that fails is counted; the test for a wake keeps its rate.

use super::envelope::envelopes;
use super::one_scan::{gate_of, options, retrieve_map};
use super::own::scan_of_lines;
use super::table::{RetrievedScan, flags};
use super::truth::{true_vortices, true_wake};
use crate::Error;
use crate::detection::{Calibration, DetectionSettings, SceneNoise};
use crate::io::scans::ReadScan;
use crate::measure::recorded::{spectra_of_samples, upward};
use crate::measure::response::SceneResponse;
use crate::measure::scan::Scanner;
use crate::plan::{Plan, Stage};
use crate::progress::{Observer, Silent};
use crate::scene::{FollowingAircraft, RetrievalMethod as Method, Scene};
use ndarray::{Array2, ArrayView2};
use wakescope_estimate::retrieval::{Flag, RetrievalOptions, ScanMap, Velocities, VortexResult};
use wakescope_estimate::vortex_fit::{CoreProfile, Follower, WakeModel};
use wakescope_estimate::window::Sample;

/// Empty scans of the test for a wake.
const EMPTY_SCANS: usize = 10_000;

/// One vortex of one realisation by one method.
#[derive(Debug, Clone, PartialEq)]
pub struct RetrievalRow {
    /// Number of the realisation, from 0.
    pub realisation: usize,
    /// Number of the sweep, from 0.
    pub sweep: usize,
    /// How it was found.
    pub method: Method,
    /// What was found; nothing where the method failed or found no such vortex.
    pub found: Option<VortexResult>,
    /// The truth, which also says which vortex it is: exact; NaN and nothing where it is not known.
    pub truth: VortexResult,
    /// Rolling-moment coefficient of the aircraft in that vortex, found and true; NaN without an aircraft, or where it is unknown.
    pub rolling_moment: (f64, f64),
    /// Sum of squares of the residuals per degree of freedom.
    pub chi2_per_dof: f64,
    /// Names of what is to be thought of the result.
    pub flags: String,
}

/// What retrievals gave in all realisations.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneRetrieval {
    /// A row for each realisation, sweep, method and vortex.
    pub rows: Vec<RetrievalRow>,
    /// Statistic and threshold of the test of each map for a wake, if the scene asks for it.
    pub tests: Vec<(f64, f64)>,
}

/// Retrieves the maps of all realisations, and their signals where a method needs them.
///
/// # Errors
/// What the crates refuse; a fit that does not come to an end is none.
pub(crate) fn of_realisations<S: Sample + wakescope_signal::Sample>(
    plan: &Plan,
    scanner: &Scanner<'_>,
    maps: &[Array2<f64>],
    observer: &dyn Observer,
) -> Result<Option<SceneRetrieval>, Error> {
    let scene = plan.scene();
    let Some(wanted) = &scene.retrieval else {
        return Ok(None);
    };
    let sweeps = upward_sweeps(plan);
    let mut truths = Vec::with_capacity(sweeps.len());
    for lines in &sweeps {
        truths.push(true_vortices(plan, lines)?);
    }
    let own = SceneResponse::new(plan, scanner.layer_snr())?;
    let options = options(
        Some(scene),
        gate_of(None, None, Some(scene))?.0,
        wanted.core_radius_m,
    );
    let mut tests = Vec::new();
    if let Some(false_alarm) = wanted.false_alarm {
        tests = self::tests(plan, &options, false_alarm, maps, observer)?;
    }
    observer.begin(
        Stage::Retrieval,
        (maps.len() * sweeps.len() * wanted.methods.len()) as u64,
    );
    let mut rows = Vec::new();
    for (realisation, velocity_m_s) in maps.iter().enumerate() {
        let test = tests.get(realisation).copied();
        let mut map_options = options.clone();
        if test.is_some_and(is_detected) {
            map_options.threshold_of_estimates = 0.0;
        }
        for (sweep, (lines, truth)) in sweeps.iter().zip(&truths).enumerate() {
            let scan = scan_of_sweep(plan, lines, velocity_m_s);
            let records = (realisation, &lines[..]);
            let own = own.as_ref();
            let found =
                by_methods::<S>(plan, scanner, own, &scan, records, &map_options, observer)?;
            for (&method, found) in wanted.methods.iter().zip(found) {
                let found = match test {
                    Some(test) => found.map(|found| compared_with_test(found, test)),
                    None => found,
                };
                let number = (realisation, sweep, method);
                rows.extend(rows_of(
                    scene,
                    number,
                    truth,
                    found.as_ref(),
                    &options.model,
                )?);
            }
        }
    }
    observer.end();
    Ok(Some(SceneRetrieval { rows, tests }))
}

/// What each requested method finds in a scan, whose records are those of some lines of a realisation.
fn by_methods<S: Sample + wakescope_signal::Sample>(
    plan: &Plan,
    scanner: &Scanner<'_>,
    own: Option<&SceneResponse>,
    scan: &ReadScan,
    records: (usize, &[usize]),
    options: &RetrievalOptions,
    observer: &dyn Observer,
) -> Result<Vec<Option<RetrievedScan>>, Error> {
    let methods: &[Method] = match &plan.scene().retrieval {
        Some(wanted) => &wanted.methods,
        None => &[],
    };
    let velocities = match own {
        Some(own) => Velocities::Estimates(own),
        None => Velocities::Unknown,
    };
    // the fit of the map also starts that of the signals
    let of_map = if methods == [Method::Rv] {
        None
    } else {
        found_in_map(scan, Method::Fit, options, velocities)
    };
    let mut all = Vec::with_capacity(methods.len());
    for &method in methods {
        all.push(match (method, of_map.clone(), own) {
            (Method::Rv, ..) => found_in_map(scan, method, options, velocities),
            (Method::Signals | Method::Envelope, Some(map), Some(own)) => {
                of_signals::<S>(plan, scanner, (method, own), records, map, observer)?
            }
            (_, map, _) => map.filter(|_| method == Method::Fit),
        });
        observer.advance(1);
    }
    Ok(all)
}

/// The lines of a sweep of the map of a realisation as a scan.
fn scan_of_sweep(plan: &Plan, lines: &[usize], velocity_m_s: &Array2<f64>) -> ReadScan {
    let g = &plan.geometry;
    let times_s = g.line_time_s.iter();
    let times_s: Vec<f64> = times_s.map(|t| plan.wind.start_s + t).collect();
    let axes = [&g.elevation_rad[..], &times_s];
    scan_of_lines("retrieval", plan, lines, axes, velocity_m_s)
}

/// What a method finds in a map; nothing where it fails.
fn found_in_map(
    scan: &ReadScan,
    method: Method,
    options: &RetrievalOptions,
    velocities: Velocities<'_>,
) -> Option<RetrievedScan> {
    let found = retrieve_map(scan.clone(), method, options.clone(), velocities).ok();
    found.map(|(found, _)| found)
}

/// The lines of each sweep, by increasing elevation.
fn upward_sweeps(plan: &Plan) -> Vec<Vec<usize>> {
    let g = &plan.geometry;
    let mut sweeps = Vec::with_capacity(g.schedule.sweeps.len());
    for sweep in 0..g.schedule.sweeps.len() {
        let lines = 0..g.schedule.lines.len();
        let own = lines.filter(|line| g.schedule.lines[*line].sweep == sweep);
        sweeps.push(upward(own, &g.elevation_rad));
    }
    sweeps
}

/// What the signals of some lines of a realisation, which are made again, give by fit or envelopes; the wake of the map starts them.
/// Nothing where the map shows no pair, or the fit does not come to an end.
fn of_signals<S: Sample + wakescope_signal::Sample>(
    plan: &Plan,
    scanner: &Scanner<'_>,
    (method, own): (Method, &SceneResponse),
    (realisation, lines): (usize, &[usize]),
    mut of_map: RetrievedScan,
    observer: &dyn Observer,
) -> Result<Option<RetrievedScan>, Error> {
    let Some(wake) = of_map
        .result
        .wake
        .filter(|_| of_map.result.vortices.len() == 2)
    else {
        return Ok(None);
    };
    let schedule = &plan.geometry.schedule;
    let mut samples: Vec<S> = Vec::new();
    let mut elevation_rad: Vec<f64> = Vec::new();
    scanner.in_pieces::<S>(realisation, &Silent, |first, records| {
        for (pulse, record) in (first..).zip(records.outer_iter()) {
            let line = schedule.line_of(pulse);
            if lines.contains(&line) {
                samples.extend(record);
                let pulse_of_line = (pulse - schedule.lines[line].first) as f64;
                elevation_rad.push(schedule.beam(line, pulse_of_line).elevation_rad);
            }
        }
        Ok(())
    })?;
    let samples = ArrayView2::from_shape((elevation_rad.len(), plan.geometry.samples), &samples)
        .map_err(|_| wakescope_estimate::Error::Empty {
            field: "records of a realisation",
        })?;
    if method == Method::Envelope {
        let spectra = spectra_of_samples(plan, &scanner.layer_snr(), &elevation_rad, samples)?;
        let lines = 0..spectra.elevation_rad.len();
        return Ok(
            envelopes(plan, &spectra, lines, own.snr_of(&wake), &mut of_map)
                .ok()
                .map(|_| of_map),
        );
    }
    Ok(own
        .of_records(samples, elevation_rad, of_map, observer)
        .ok())
}

/// The scan with flags where its fit and its test for a wake disagree.
fn compared_with_test(mut scan: RetrievedScan, test: (f64, f64)) -> RetrievedScan {
    let is_detected = is_detected(test);
    let result = &mut scan.result;
    if is_detected && result.has(Flag::NoWake) {
        result.set(Flag::NoWake, false);
        result.set(Flag::Uncertain, true);
    }
    let has_vortices = !result.vortices.is_empty();
    result.set(Flag::NotDetected, has_vortices && !is_detected);
    scan
}

/// Whether a test finds a wake: its statistic is above its threshold.
pub(super) fn is_detected((statistic, threshold): (f64, f64)) -> bool {
    statistic > threshold
}

fn rows_of(
    scene: &Scene,
    (realisation, sweep, method): (usize, usize, Method),
    truth: &[VortexResult; 2],
    found: Option<&RetrievedScan>,
    model: &WakeModel,
) -> Result<[RetrievalRow; 2], Error> {
    let mut rolling_moments = [(f64::NAN, f64::NAN); 2];
    let aircraft = scene.retrieval.as_ref().and_then(|r| r.follower);
    // the coefficient is known for the profile (3)
    if let Some(aircraft) = aircraft.filter(|_| model.profile == CoreProfile::Algebraic) {
        let follower = follower(&aircraft);
        for (moments, truth_of) in rolling_moments.iter_mut().zip(truth) {
            if let Some(wake) = found.and_then(|found| found.result.wake)
                && let Some(vortex) = found.and_then(|found| found.result.vortex(truth_of.side))
            {
                moments.0 = follower.rolling_moment(model, &wake, vortex.place_m())?;
            }
            if let Some(wake) = true_wake(truth) {
                moments.1 = follower.rolling_moment(model, &wake, truth_of.place_m())?;
            }
        }
    }
    let result = found.map(|found| &found.result);
    let chi2_per_dof = result.map_or(f64::NAN, |result| result.chi2_per_dof);
    Ok([0, 1].map(|i| RetrievalRow {
        realisation,
        sweep,
        method,
        found: result.and_then(|result| result.vortex(truth[i].side).copied()),
        truth: truth[i],
        rolling_moment: rolling_moments[i],
        chi2_per_dof,
        flags: result.map_or_else(String::new, flags),
    }))
}

fn follower(aircraft: &FollowingAircraft) -> Follower {
    Follower {
        span_m: aircraft.span_m,
        aspect_ratio: aircraft.aspect_ratio,
        speed_m_s: aircraft.speed_m_s,
        slope: aircraft.slope,
    }
}

/// Tests of all maps for a wake, calibrated on the noise of the scene.
fn tests(
    plan: &Plan,
    options: &RetrievalOptions,
    false_alarm: f64,
    maps: &[Array2<f64>],
    observer: &dyn Observer,
) -> Result<Vec<(f64, f64)>, Error> {
    let noise = SceneNoise::new(plan, observer)?;
    let settings = DetectionSettings {
        false_alarm,
        model: options.model,
        gate: options.gate.clone(),
        empty_scans: EMPTY_SCANS,
        stride: noise.stride,
        seed: plan.scene().seed,
        ..DetectionSettings::default()
    };
    let empty = noise.empty_scan(plan);
    let calibration = Calibration::new(
        &empty.strided(settings.stride.0, settings.stride.1),
        &settings,
        observer,
    )?;
    let mut tests = Vec::with_capacity(maps.len());
    for map in maps {
        let scan = ScanMap {
            velocity_m_s: map.clone(),
            ..empty.clone()
        };
        let found = calibration.of_scan(&scan, &settings)?;
        tests.push((found.statistic.value, found.threshold));
    }
    Ok(tests)
}
