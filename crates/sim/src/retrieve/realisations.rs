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
use crate::measure::recorded::{spectra_of_samples, upward};
use crate::measure::response::SceneResponse;
use crate::measure::scan::Scanner;
use crate::plan::{Plan, Stage};
use crate::progress::{Observer, Silent};
use crate::scene::{FollowingAircraft, RetrievalMethod as Method, Scene};
use ndarray::{Array2, ArrayView2};
use wakescope_estimate::retrieval::{Flag, RetrievalOptions, ScanMap, Velocities, VortexResult};
use wakescope_estimate::vortex_fit::{CoreProfile, Follower, Wake, WakeModel};
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
    let truths = sweeps
        .iter()
        .map(|lines| true_vortices(plan, lines))
        .collect::<Result<Vec<_>, _>>()?;
    let own = SceneResponse::new(plan, scanner.layer_snr())?;
    let velocities = own
        .as_ref()
        .map_or(Velocities::Unknown, |own| Velocities::Estimates(own));
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
    let g = &plan.geometry;
    let time_s: Vec<f64> = g
        .line_time_s
        .iter()
        .map(|t| plan.wind.start_s + t)
        .collect();
    let each = maps.iter().enumerate().flat_map(|map| {
        sweeps
            .iter()
            .zip(&truths)
            .enumerate()
            .map(move |of| (map, of))
    });
    for ((realisation, velocity_m_s), (sweep, (lines, truth))) in each {
        let scan = || {
            scan_of_lines(
                "retrieval",
                plan,
                lines,
                [&g.elevation_rad, &time_s],
                velocity_m_s,
            )
        };
        let test = tests.get(realisation).copied();
        let by = |method| {
            let mut options = options.clone();
            if test.is_some_and(is_detected) {
                options.threshold_of_estimates = 0.0;
            }
            let found = retrieve_map(scan(), method, options, velocities).ok();
            found.map(|(found, _)| found)
        };
        // the fit of the map also starts that of the signals
        let of_map = wanted
            .methods
            .iter()
            .any(|method| *method != Method::Rv)
            .then(|| by(Method::Fit))
            .flatten();
        for &method in &wanted.methods {
            let found = match (method, of_map.clone(), &own) {
                (Method::Rv, ..) => by(method),
                (Method::Signals | Method::Envelope, Some(map), Some(own)) => of_signals::<S>(
                    plan,
                    scanner,
                    (method, own),
                    (realisation, lines),
                    map,
                    observer,
                )?,
                (_, map, _) => map.filter(|_| method == Method::Fit),
            };
            let found = match test {
                Some(test) => found.map(|found| compared_with_test(found, test)),
                None => found,
            };
            rows.extend(rows_of(
                scene,
                (realisation, sweep, method),
                truth,
                found.as_ref(),
                &options.model,
            )?);
            observer.advance(1);
        }
    }
    observer.end();
    Ok(Some(SceneRetrieval { rows, tests }))
}

/// The lines of each sweep, by increasing elevation.
fn upward_sweeps(plan: &Plan) -> Vec<Vec<usize>> {
    let g = &plan.geometry;
    let of_sweep = |sweep: usize| {
        let own = |line: &usize| g.schedule.lines[*line].sweep == sweep;
        upward((0..g.schedule.lines.len()).filter(own), &g.elevation_rad)
    };
    (0..g.schedule.sweeps.len()).map(of_sweep).collect()
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
    let is_own = |pulse: usize| lines.contains(&schedule.line_of(pulse));
    let mut samples: Vec<S> = Vec::new();
    let mut elevation_rad: Vec<f64> = Vec::new();
    scanner.in_pieces::<S>(realisation, &Silent, |first, records| {
        for (pulse, record) in (first..)
            .zip(records.outer_iter())
            .filter(|(pulse, _)| is_own(*pulse))
        {
            samples.extend(record);
            let line = schedule.line_of(pulse);
            elevation_rad.push(
                schedule
                    .beam(line, (pulse - schedule.lines[line].first) as f64)
                    .elevation_rad,
            );
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
    let follower = scene
        .retrieval
        .as_ref()
        .and_then(|r| r.follower)
        .map(|aircraft| {
            let FollowingAircraft {
                span_m,
                aspect_ratio,
                speed_m_s,
                slope,
            } = aircraft;
            Follower {
                span_m,
                aspect_ratio,
                speed_m_s,
                slope,
            }
        });
    let moment = |wake: Option<Wake>, at: Option<(f64, f64)>| match (&follower, wake.zip(at)) {
        // the coefficient is known for the profile (3)
        (Some(follower), Some((wake, at))) if model.profile == CoreProfile::Algebraic => {
            follower.rolling_moment(model, &wake, at)
        }
        _ => Ok(f64::NAN),
    };
    let row = |truth_of: VortexResult| -> Result<RetrievalRow, Error> {
        let vortex = found.and_then(|found| found.result.vortex(truth_of.side).copied());
        let wake = found.and_then(|found| found.result.wake);
        Ok(RetrievalRow {
            realisation,
            sweep,
            method,
            found: vortex,
            truth: truth_of,
            rolling_moment: (
                moment(wake, vortex.map(|vortex| vortex.place_m()))?,
                moment(true_wake(truth), Some(truth_of.place_m()))?,
            ),
            chi2_per_dof: found.map_or(f64::NAN, |found| found.result.chi2_per_dof),
            flags: found.map_or_else(String::new, |found| flags(&found.result)),
        })
    };
    Ok([row(truth[0])?, row(truth[1])?])
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
    let test = |map: &Array2<f64>| {
        let found = calibration.of_scan(
            &ScanMap {
                velocity_m_s: map.clone(),
                ..empty.clone()
            },
            &settings,
        )?;
        Ok((found.statistic.value, found.threshold))
    };
    maps.iter().map(test).collect()
}
