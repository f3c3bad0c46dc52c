//! Maps and signals of which the scene is known: what their estimator makes of a wake, and their likelihood.
//!
//! Check: circulations of maps and signals of a pair within their stated deviations.

use super::table::{RetrievedScan, refused};
use crate::Error;
use crate::io::raw::RawRecords;
use crate::io::scans::ReadScan;
use crate::measure::recorded::{MeasuredScan, samples, upward};
use crate::measure::response::{SceneResponse, spacing_m};
use crate::plan::Plan;
use crate::progress::Observer;
use crate::scene::DetectorSignal;
use ndarray::{Array2, ArrayView2, Axis};
use num_complex::Complex;
use wakescope_estimate::Measured;
use wakescope_estimate::retrieval::{
    Flag, Movement, RetrievalOptions, ScanMap, ScanResult, Side, Top, VortexResult,
};
use wakescope_estimate::vortex_fit::{
    EstimatorResponse, MapFit, MapFitOptions, Parameter, SignalFit, SignalFitOptions, VelocityMap,
    Wake, WakeModel, fit_map_of_estimator, fit_secondary_vortices, fit_signals,
    refine_map_fit_of_estimator, with_local_circulations,
};
use wakescope_estimate::window::Sample;

/// A top so much above the least chi-square competes with it.
const COMPETES: f64 = 9.0;
/// A vortex that means do not show is one if its circulation is that many of its deviations.
const CERTAIN_SIGMAS: f64 = 3.0;

impl SceneResponse {
    /// Expected signal-to-noise ratio in the band at the middle of a wake, a power ratio.
    pub fn snr_of(&self, wake: &Wake) -> f64 {
        let y_m = 0.5 * (wake.left.lateral_position_m + wake.right.lateral_position_m);
        let z_m = 0.5 * (wake.left.height_m + wake.right.height_m);
        self.snr_at(y_m.hypot(z_m - self.scene.scan.lidar_height_m))
    }

    /// The fit to what the estimator of the scene shows, for a map in which means show `found`: of a pair, as means may show but one of its
    /// vortices or none and the other may be beyond the scan, else of the one that is found. Nothing where no wake stands out of the wind,
    /// the estimator is one of those without such a model, or the fit does not come to an end. The options are those with the secondary vortices that the map shows beside the pair.
    pub(super) fn refined(
        &self,
        map: &ScanMap,
        options: &RetrievalOptions,
        found: &ScanResult,
    ) -> Option<(ScanResult, RetrievalOptions)> {
        let range_of =
            |vortex: &VortexResult| options.model.range_and_elevation(vortex.place_m()).0;
        let range_m = match found.vortices.len() {
            0 => 0.5 * (map.range_m.first()? + map.range_m.last()?),
            count => found.vortices.iter().map(range_of).sum::<f64>() / count as f64,
        };
        let fits = Fits {
            scan: map,
            // Maps of one scan know no deviation, and those of a few scans hardly any.
            view: VelocityMap {
                standard_deviation_m_s: None,
                ..map.view()
            },
            still: self.shown(range_m)?,
            moving: self
                .shown(range_m)?
                .moving(&map.elevation_rad, &map.after_middle_s()),
            options,
            map_options: MapFitOptions {
                free: options.free,
                core_radius_m: options.core_radius_m,
                loss: options.loss,
                secondary: options.secondary,
                least_statistic: options.threshold_of_estimates,
                correlated_lines: self.correlated_lines(spacing_m(&map.elevation_rad), range_m),
                ..MapFitOptions::default()
            },
        };
        let reach_m = self.reach_m(&map.range_m);
        let sector = (&map.elevation_rad[..], &reach_m[..]);
        let is_seen = |vortex: &VortexResult| options.model.sees(sector, vortex.place_m());
        let unseen = |pair: &ScanResult| {
            pair.vortices
                .iter()
                .filter(|vortex| !is_seen(vortex))
                .count()
        };
        match (fits.pair(found), found.vortices.len()) {
            (Ok(pair), 2) => Some(pair),
            // What is beyond the scan acts on what is in it, but is not told. Where nothing is found in it, anything may be beyond.
            (Ok((pair, options)), 1)
                if unseen(&pair) <= 1 && pair.vortices.iter().all(is_certain) =>
            {
                Some((telling(pair, is_seen), options))
            }
            (Ok((pair, options)), _) if self.are_reported(&pair, map, &options.model) => {
                Some((with_certainty(pair), options))
            }
            (pair, 1) => {
                let (mut one, options) = fits.one(found)?;
                let may_be_pair = pair.is_ok_and(|(pair, _)| {
                    let is_hidden = |wake: Wake| !options.gate.resolves(wake.spacing_m());
                    unseen(&pair) == 0 && pair.wake.is_some_and(is_hidden)
                });
                one.set(Flag::Ambiguous, may_be_pair || one.has(Flag::Ambiguous));
                let is_certain = one.vortices.iter().all(is_certain);
                is_certain.then_some((one, options))
            }
            (Ok((pair, options)), _) => Some((without_vortices(pair), options)),
            (Err(wakescope_estimate::Error::NoVortex { statistic, needed }), 0) => {
                Some((without_wake(found, statistic, needed), options.clone()))
            }
            (Err(_), _) => None,
        }
    }

    /// Whether the vortices of a pair are reported where means do not show both: both are in view and each circulation exceeds its standard error.
    fn are_reported(&self, pair: &ScanResult, map: &ScanMap, model: &WakeModel) -> bool {
        let reach_m = self.reach_m(&map.range_m);
        let is_reported = |vortex: &VortexResult| {
            model.sees((&map.elevation_rad, &reach_m), vortex.place_m()) && is_likely(vortex)
        };
        pair.vortices.iter().all(is_reported)
    }

    /// Nearest and farthest range that gates at those ranges observe, m: the outermost ones reach half a window beyond their middles.
    fn reach_m(&self, range_m: &[f64]) -> [f64; 2] {
        let half_window_m =
            0.5 * self.scene.estimator.window_samples as f64 * self.scene.sample_spacing_m();
        let [near_m, far_m] = ends_m(range_m);
        [near_m - half_window_m, far_m + half_window_m]
    }
}

/// Fits of one scan to what an estimator shows of vortices that stand still, and that move.
struct Fits<'a> {
    scan: &'a ScanMap,
    view: VelocityMap<'a>,
    still: EstimatorResponse<'a>,
    moving: EstimatorResponse<'a>,
    options: &'a RetrievalOptions,
    map_options: MapFitOptions,
}

impl Fits<'_> {
    /// The fit from a start or, without one, from a blind search on, and whether its vortices move: as stated, else as it is likely in scans
    /// that last so long unless the other is clearly better.
    ///
    /// # Errors
    /// What the fits refuse.
    fn best(&self, start: Option<&Wake>) -> Result<(MapFit, bool), wakescope_estimate::Error> {
        let moves = match self.options.movement {
            Movement::Moving => true,
            Movement::Frozen => false,
            Movement::Auto => self.scan.lasts_s() >= RetrievalOptions::SHORT_S,
        } && self.scan.has_times();
        let (view, model, options) = (&self.view, &self.options.model, &self.map_options);
        let from = |moves, start: &Wake| {
            refine_map_fit_of_estimator(view, model, self.shown(moves), start, options)
        };
        let first = match start {
            Some(start) => from(moves, start)?,
            None => fit_map_of_estimator(view, model, self.shown(moves), options)?,
        };
        if self.options.movement != Movement::Auto || self.scan.lasts_s() == 0.0 {
            return Ok((first, moves));
        }
        let chi2 = |fit: &MapFit| fit.tops.first().map_or(f64::INFINITY, |top| top.chi2);
        let is_better =
            |other: &MapFit, than: &MapFit| chi2(than) - chi2(other) > RetrievalOptions::MOVES;
        let other = from(!moves, &first.wake).ok();
        let Some(other) = other.filter(|other| is_better(other, &first)) else {
            return Ok((first, moves));
        };
        // It may be better because it came to another place: there, too, the first has to be worse.
        match from(moves, &other.wake) {
            Ok(again) if !is_better(&other, &again) => Ok((again, moves)),
            _ => Ok((other, !moves)),
        }
    }

    fn shown(&self, moves: bool) -> &EstimatorResponse<'_> {
        if moves { &self.moving } else { &self.still }
    }

    /// A pair that stands out of the wind, and the options with the secondary vortices that the map shows beside it.
    ///
    /// # Errors
    /// What the fit of the pair refuses.
    fn pair(
        &self,
        found: &ScanResult,
    ) -> Result<(ScanResult, RetrievalOptions), wakescope_estimate::Error> {
        let mut options = self.options.clone();
        let (mut fit, moves) = self.best(None)?;
        let shown = self.shown(moves);
        let four = fit_secondary_vortices(
            &self.view,
            &options.model,
            shown,
            &fit.wake,
            &self.map_options,
        )
        .ok()
        .flatten();
        let are_shown = four.as_ref().is_some_and(|(_, secondary)| secondary.shown);
        if let Some((Some(with_secondary), secondary)) = four {
            fit = with_secondary;
            options.model.secondary = Some(secondary.vortices);
        }
        let local =
            with_local_circulations(&self.view, &options.model, shown, &fit, &self.map_options)
                .ok()
                .flatten();
        let are_local = local.is_some();
        let fit = local.unwrap_or(fit);
        let mut result = of_fit(found, self.scan, &options, &fit, moves);
        result.statistic = fit.statistic;
        result.threshold = self.map_options.least_statistic;
        result.set(Flag::SecondaryVortices, are_shown);
        result.set(Flag::LocalCirculation, are_local);
        Ok((result, options))
    }

    /// The one vortex that is found; another may be there beyond the scan.
    fn one(&self, found: &ScanResult) -> Option<(ScanResult, RetrievalOptions)> {
        let (fit, moves) = self.best(found.wake.as_ref()).ok()?;
        let result = of_fit(found, self.scan, self.options, &fit, moves);
        Some((
            telling(result, |vortex| found.vortex(vortex.side).is_some()),
            self.options.clone(),
        ))
    }
}

/// Whether a circulation is positive beyond doubt.
fn is_certain(vortex: &VortexResult) -> bool {
    vortex.circulation_m2_s.value > CERTAIN_SIGMAS * vortex.circulation_m2_s.std
}

/// The first and the last number of an axis, m; NaN if it has none.
fn ends_m(axis_m: &[f64]) -> [f64; 2] {
    [axis_m.first(), axis_m.last()].map(|end| end.copied().unwrap_or(f64::NAN))
}

/// Whether a circulation exceeds its standard error.
fn is_likely(vortex: &VortexResult) -> bool {
    vortex.circulation_m2_s.value > vortex.circulation_m2_s.std
}

/// The result with a flag where a circulation is not certain.
fn with_certainty(mut pair: ScanResult) -> ScanResult {
    let are_certain = pair.vortices.iter().all(is_certain);
    pair.set(Flag::Uncertain, !are_certain);
    pair
}

/// The result of a scan in which no pair stands out of the wind by the least statistic that is needed.
fn without_wake(found: &ScanResult, statistic: f64, needed: f64) -> ScanResult {
    let mut result = ScanResult {
        statistic,
        threshold: needed,
        ..found.clone()
    };
    result.set(Flag::Uncertain, false);
    result.set(Flag::NoWake, true);
    result
}

/// The result of a wake that stands out of the wind, without its vortices, of which too little is known.
fn without_vortices(result: ScanResult) -> ScanResult {
    let mut result = telling(result, |_| false);
    result.wake = None;
    result.set(Flag::Uncertain, true);
    result
}

/// The result without the vortices that are not to be told.
fn telling(mut result: ScanResult, is_told: impl Fn(&VortexResult) -> bool) -> ScanResult {
    result.vortices.retain(is_told);
    result.set(Flag::OneVortex, result.vortices.len() == 1);
    result.set(
        Flag::CoreKept,
        result
            .vortices
            .iter()
            .any(|vortex| vortex.core_radius_m.is_none()),
    );
    result
}

/// The result of a fit to a map that tells other vortices than the means did.
fn of_fit(
    found: &ScanResult,
    map: &ScanMap,
    options: &RetrievalOptions,
    fit: &MapFit,
    moves: bool,
) -> ScanResult {
    let mut result = retold(
        found,
        map,
        options,
        (fit.wake, fit.covariance.clone()),
        fit.tops.clone(),
        moves,
    );
    (result.cells_used, result.cells_rejected) = (fit.used - fit.outliers, fit.outliers);
    result.set(Flag::Outliers, 10 * fit.outliers > fit.used);
    result
}

/// Retrieves a scan from its raw signals: the wake of its map starts the fit, which the observer may stop.
///
/// # Errors
/// What the system says of the file, and what the fits refuse.
pub fn retrieve_signals(
    own: &SceneResponse,
    records: &mut RawRecords,
    measured: &MeasuredScan,
    found: RetrievedScan,
    observer: &dyn Observer,
) -> Result<RetrievedScan, Error> {
    let ((range, elevation_rad), all) = (measured.lines.all_records(), 0..records.samples);
    match own.scene.detector.signal {
        DetectorSignal::IntermediateFrequency => own.of_records(
            samples::<f64>(records, range, all)?.view(),
            elevation_rad,
            found,
            observer,
        ),
        DetectorSignal::Baseband => own.of_records(
            samples::<Complex<f64>>(records, range, all)?.view(),
            elevation_rad,
            found,
            observer,
        ),
    }
}

impl SceneResponse {
    /// The fit to the records of lines at those elevations, rad; the wake of their map starts it.
    ///
    /// # Errors
    /// What the fit refuses.
    pub(super) fn of_records<S: Sample>(
        &self,
        samples: ArrayView2<'_, S>,
        elevation_rad: Vec<f64>,
        mut found: RetrievedScan,
        observer: &dyn Observer,
    ) -> Result<RetrievedScan, Error> {
        let Some(guess) = found
            .result
            .wake
            .filter(|_| found.result.vortices.len() == 2)
        else {
            return Ok(found);
        };
        let setup = self.setup(found.options.model, elevation_rad)?;
        let snr = |range_m: f64, _: f64| {
            // Whenever the fit makes a model of the lines.
            observer.advance(0);
            self.snr_at(range_m)
        };
        let fit_options = SignalFitOptions {
            free: found.options.free,
            ..SignalFitOptions::default()
        };
        let fit = match fit_signals(
            &setup,
            snr,
            samples,
            self.noise_power_a2,
            &guess,
            &fit_options,
        ) {
            // what the map shows is what was found
            Err(wakescope_estimate::Error::NotConverged { .. }) => {
                found.result.set(Flag::NotConverged, true);
                return Ok(found);
            }
            fit => fit.map_err(|error| refused(&found.scan, &error))?,
        };
        let SignalFit {
            wake,
            covariance,
            tops,
            log_likelihood_gain,
            used_rays,
            ..
        } = fit;
        let least = tops
            .iter()
            .map(|top| top.chi2)
            .fold(f64::INFINITY, f64::min);
        let tops = tops
            .iter()
            .map(|top| Top {
                chi2: top.chi2 - least,
                ..*top
            })
            .collect();
        let mut result = retold(
            &found.result,
            &found.scan.map,
            &found.options,
            (wake, covariance),
            tops,
            false,
        );
        result.statistic = 2.0 * log_likelihood_gain;
        (result.cells_used, result.cells_rejected) =
            (used_rays, setup.elevation_rad.len() - used_rays);
        result.chi2_per_dof = f64::NAN;
        Ok(RetrievedScan { result, ..found })
    }
}

/// A result with another wake: the vortices that it has, each when the line of sight passes it.
pub(super) fn retold(
    found: &ScanResult,
    map: &ScanMap,
    options: &RetrievalOptions,
    (wake, covariance): (Wake, Array2<f64>),
    tops: Vec<Top>,
    moves: bool,
) -> ScanResult {
    let is_there = |side: &Side| wake.to_array()[side.parameters()[0] as usize] != 0.0;
    let vortex =
        |side| VortexResult::at_its_line(map, &options.model, (&wake, &covariance), side, moves);
    let mut result = ScanResult {
        vortices: Side::BOTH
            .into_iter()
            .filter(is_there)
            .map(vortex)
            .collect(),
        wake: Some(wake),
        lateral_wind_m_s: Measured::of_wake(Parameter::Wind, &wake, &covariance),
        wind_shear_per_s: Measured::of_wake(Parameter::Shear, &wake, &covariance),
        covariance,
        tops,
        ..found.clone()
    };
    if result.vortices.len() != found.vortices.len() {
        // What the other fit left says nothing of this one.
        result.set(Flag::PoorFit, false);
        result.chi2_per_dof = f64::NAN;
    }
    result.set(Flag::NoWake, false);
    result.set(Flag::Uncertain, false);
    let is_instant = map.has_times() && map.lasts_s() == 0.0;
    result.set(Flag::MotionIgnored, !moves && !is_instant);
    result.set(Flag::NotConverged, false);
    let competing = result
        .tops
        .iter()
        .skip(1)
        .any(|top| top.chi2 - result.tops[0].chi2 < COMPETES);
    result.set(Flag::Ambiguous, competing);
    telling(result, |_| true)
}

/// A scan of recorded signals as a map for a retrieval.
pub fn scan_of_signals(
    path: &std::path::Path,
    sweep: usize,
    plan: &Plan,
    scan: &MeasuredScan,
) -> ReadScan {
    let lines = &scan.lines;
    let mut velocity_m_s = scan.velocity_m_s.clone();
    velocity_m_s.zip_mut_with(&scan.flagged, |velocity, flagged| {
        if *flagged > 0.5 {
            *velocity = f64::NAN
        }
    });
    let order = upward(0..lines.elevation_rad.len(), &lines.elevation_rad);
    ReadScan {
        path: path.to_owned(),
        sweep,
        reference: crate::io::UtcTime::parse(&plan.scene().site.start_utc),
        scene_toml: Some(plan.file.toml.clone()),
        ..scan_of_lines(
            "",
            plan,
            &order,
            [&lines.elevation_rad, &lines.time_s],
            &velocity_m_s,
        )
    }
}

/// Some lines of a map with the gates of a plan as a scan; `axes` are the elevations, rad, and times, s, of all of its lines.
pub(super) fn scan_of_lines(
    name: &str,
    plan: &Plan,
    lines: &[usize],
    axes: [&[f64]; 2],
    velocity_m_s: &Array2<f64>,
) -> ReadScan {
    let [elevation_rad, time_s] =
        axes.map(|values| lines.iter().map(|line| values[*line]).collect());
    let velocity_m_s = velocity_m_s.select(Axis(0), lines);
    let range_m = plan.geometry.gate_range_m.clone();
    ReadScan::own(
        name,
        ScanMap {
            elevation_rad,
            time_s,
            range_m,
            velocity_m_s,
            sigma_m_s: None,
            fold_m_s: None,
        },
    )
}
