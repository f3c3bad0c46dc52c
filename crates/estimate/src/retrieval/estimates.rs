//! Fit of one scan to what its estimator makes of vortices at rest and in motion, from a fit of means on.
//!
//! Check: circulations of maps of a pair within their standard errors; pairs in narrow sectors; empty scans.

mod in_turbulence;

use self::in_turbulence::TurbulentFit;
use crate::error::Error;
use crate::retrieval::{
    Flag, Movement, RetrievalOptions, ScanEstimator, ScanMap, ScanResult, VortexResult,
};
use crate::vortex_fit::map_fit::data::ends;
use crate::vortex_fit::map_fit::secondary::LEAST_GAIN;
use crate::vortex_fit::map_fit::starts::chi2;
use crate::vortex_fit::{
    EstimatorResponse, MapFit, MapFitOptions, Secondary, VelocityMap, Wake, WakeModel,
    fit_map_of_estimator, fit_secondary_vortices, gain_over_local_circulations,
    refine_map_fit_of_estimator, with_local_circulations,
};

/// The fit to estimates in which means show `found`: of a pair, as means may show but one of its vortices or none and the other may be beyond the
/// scan, else of the one that is found. Nothing where there is no model of the estimator or the fit does not converge.
pub(super) fn fit_estimates(
    map: &ScanMap,
    estimator: &dyn ScanEstimator,
    options: &RetrievalOptions,
    found: &ScanResult,
) -> Option<ScanResult> {
    let range_m = wake_range_m(map, options, found);
    let spacing_rad = spacing(&map.elevation_rad);
    let response = estimator.response(range_m)?;
    let fits = EstimateFits {
        scan: map,
        // Maps of one scan know no deviation, and those of a few scans hardly any.
        view: VelocityMap {
            standard_deviation_m_s: None,
            ..map.view()
        },
        moving: estimator
            .response(range_m)?
            .moving(&map.elevation_rad, &map.after_middle_s()),
        still: response,
        options,
        map_options: MapFitOptions {
            free: options.free,
            core_radius_m: options.core_radius_m,
            loss: options.loss,
            secondary: options.secondary,
            least_statistic: options.threshold_of_estimates,
            correlated_lines: estimator.correlated_lines(spacing_rad, range_m),
            fold_m_s: map.fold_m_s,
            ..MapFitOptions::default()
        },
        observed_range_m: {
            let (near_m, far_m) = ends(&map.range_m);
            let half_window_m = estimator.half_window_m();
            [near_m - half_window_m, far_m + half_window_m]
        },
    };
    fits.reported(found)
}

/// Mean range of the vortices of a result, or the middle of the scan \[m\].
fn wake_range_m(map: &ScanMap, options: &RetrievalOptions, found: &ScanResult) -> f64 {
    if found.vortices.is_empty() {
        let (near_m, far_m) = ends(&map.range_m);
        return 0.5 * (near_m + far_m);
    }
    let ranges = found
        .vortices
        .iter()
        .map(|vortex| options.model.range_and_elevation(vortex.place_m()).0);
    ranges.sum::<f64>() / found.vortices.len() as f64
}

/// Mean distance of neighbouring numbers of an axis.
fn spacing(axis: &[f64]) -> f64 {
    let (first, last) = ends(axis);
    (last - first) / (axis.len().max(2) - 1) as f64
}

/// Fits of one scan to what an estimator makes of vortices at rest and in motion.
struct EstimateFits<'a> {
    scan: &'a ScanMap,
    view: VelocityMap<'a>,
    still: EstimatorResponse<'a>,
    moving: EstimatorResponse<'a>,
    options: &'a RetrievalOptions,
    map_options: MapFitOptions,
    /// Ranges that the gates observe \[m\].
    observed_range_m: [f64; 2],
}

impl EstimateFits<'_> {
    /// The fit that is reported where means show `found`.
    fn reported(&self, found: &ScanResult) -> Option<ScanResult> {
        match (self.pair(found), found.vortices.len()) {
            (Ok(pair), 2) => Some(pair),
            // What is beyond the scan acts on what is in it, but is not reported. Where nothing is found in it, anything may be beyond.
            (Ok(pair), 1) if self.is_lone_or_certain(&pair) => {
                Some(pair.reporting(|vortex| self.observes(vortex)))
            }
            (Ok(pair), _) if self.is_likely_in_view(&pair) => Some(with_certainty(pair)),
            (pair, 1) => {
                let mut one = self.one(found)?;
                let may_be_pair = pair.is_ok_and(|pair| self.is_hidden(&pair));
                let is_ambiguous = may_be_pair || one.has(Flag::Ambiguous);
                one.set(Flag::Ambiguous, is_ambiguous);
                let is_certain = one.vortices.iter().all(VortexResult::is_certain);
                is_certain.then_some(one)
            }
            (Ok(pair), _) => Some(without_vortices(pair)),
            (Err(Error::NoVortex { statistic, needed }), 0) => {
                Some(without_wake(found, statistic, needed))
            }
            (Err(_), _) => None,
        }
    }

    /// Whether the centre of a vortex is in view.
    fn observes(&self, vortex: &VortexResult) -> bool {
        let sector = (&self.scan.elevation_rad[..], &self.observed_range_m[..]);
        self.options.model.sees(sector, vortex.place_m())
    }

    /// Number of the vortices of a result that are not in view.
    fn unobserved(&self, result: &ScanResult) -> usize {
        let vortices = result.vortices.iter();
        vortices.filter(|vortex| !self.observes(vortex)).count()
    }

    /// Whether the circulations of a pair are certain, and one of its vortices at least is in view.
    fn is_lone_or_certain(&self, pair: &ScanResult) -> bool {
        self.unobserved(pair) <= 1 && pair.vortices.iter().all(VortexResult::is_certain)
    }

    /// Whether both vortices of a pair are in view and each circulation exceeds its standard error.
    fn is_likely_in_view(&self, pair: &ScanResult) -> bool {
        self.unobserved(pair) == 0 && pair.vortices.iter().all(is_likely)
    }

    /// Whether a pair is in view whose vortices the gates do not resolve.
    fn is_hidden(&self, pair: &ScanResult) -> bool {
        self.unobserved(pair) == 0
            && pair
                .wake
                .is_some_and(|wake| !self.options.gate.resolves(wake.spacing_m()))
    }

    /// The fit from a start or, without one, from a blind search on, and whether its vortices move: as requested, else as it is likely in scans
    /// that last so long unless the other is clearly better.
    ///
    /// # Errors
    /// What the fits refuse.
    fn best(&self, start: Option<&Wake>) -> Result<(MapFit, bool), Error> {
        let moves = match self.options.movement {
            Movement::Moving => true,
            Movement::Frozen => false,
            Movement::Auto => self.scan.lasts_s() >= RetrievalOptions::SHORT_S,
        } && self.scan.has_times();
        let first = match start {
            Some(start) => self.fit_from(start, moves)?,
            None => fit_map_of_estimator(
                &self.view,
                &self.options.model,
                self.response(moves),
                &self.map_options,
            )?,
        };
        if self.options.movement != Movement::Auto || self.scan.lasts_s() == 0.0 {
            return Ok((first, moves));
        }
        let other = self.fit_from(&first.wake, !moves).ok();
        let Some(other) = other.filter(|other| is_clearly_better(other, &first)) else {
            return Ok((first, moves));
        };
        // It may be better because it came to another place: there, too, the first has to be worse.
        match self.fit_from(&other.wake, moves) {
            Ok(again) if !is_clearly_better(&other, &again) => Ok((again, moves)),
            _ => Ok((other, !moves)),
        }
    }

    fn fit_from(&self, start: &Wake, moves: bool) -> Result<MapFit, Error> {
        let model = &self.options.model;
        let response = self.response(moves);
        refine_map_fit_of_estimator(&self.view, model, response, start, &self.map_options)
    }

    fn response(&self, moves: bool) -> &EstimatorResponse<'_> {
        if moves { &self.moving } else { &self.still }
    }

    /// A pair that stands out of the wind, with the secondary vortices that the map shows beside it.
    ///
    /// # Errors
    /// What the fit of the pair refuses.
    fn pair(&self, found: &ScanResult) -> Result<ScanResult, Error> {
        let (mut fit, moves) = self.best(None)?;
        let turbulent = self.in_turbulence(&fit, moves)?;
        if let Some(turbulent) = &turbulent
            && turbulent.turbulence.stands_out()
        {
            return Ok(self.of_turbulent(found, turbulent, moves));
        }
        let mut options = self.options.clone();
        let response = self.response(moves);
        let mut local = self.with_local_circulations(&options.model, response, &fit);
        let four = fit_secondary_vortices(
            &self.view,
            &options.model,
            response,
            &fit.wake,
            &self.map_options,
        )
        .ok()
        .flatten();
        let are_shown = four.as_ref().is_some_and(|(_, secondary)| secondary.shown);
        if let Some((Some(with_secondary), secondary)) = four {
            let model = WakeModel {
                secondary: Some(secondary.vortices),
                ..options.model
            };
            let both = [(&model, &with_secondary.wake), (&options.model, &fit.wake)];
            if local.is_none() || self.are_needed_nearby(response, both) {
                local = self.with_local_circulations(&model, response, &with_secondary);
                fit = with_secondary;
                options.model = model;
            }
        }
        let are_local = local.is_some();
        let mut fit = local.unwrap_or(fit);
        if let Some(turbulent) = &turbulent {
            fit.covariance += &turbulent.of_air;
        }
        let mut result = result_of(found, self.scan, &options, &fit, moves);
        result.turbulence = turbulent.map(|turbulent| turbulent.turbulence);
        result.statistic = fit.statistic;
        result.threshold = self.map_options.least_statistic;
        result.set(Flag::SecondaryVortices, are_shown);
        result.set(Flag::LocalCirculation, are_local);
        Ok(result)
    }

    /// The pair of a fit with the circulation of each vortex from what is near it, where that explains the map clearly better.
    fn with_local_circulations(
        &self,
        model: &WakeModel,
        response: &EstimatorResponse<'_>,
        fit: &MapFit,
    ) -> Option<MapFit> {
        with_local_circulations(&self.view, model, response, fit, &self.map_options)
            .ok()
            .flatten()
    }

    /// Whether a pair with secondary vortices explains what is near its vortices so much better than the pair alone does with local circulations as
    /// secondary vortices have to: else what is far away decides about the circulations.
    fn are_needed_nearby(
        &self,
        response: &EstimatorResponse<'_>,
        [four, pair]: [(&WakeModel, &Wake); 2],
    ) -> bool {
        self.map_options.secondary == Secondary::Always
            || gain_over_local_circulations(&self.view, response, [four, pair], &self.map_options)
                .is_none_or(|gain| gain >= LEAST_GAIN)
    }

    /// A pair in turbulence that stands out of the noise: what else is in the air is part of that.
    fn of_turbulent(
        &self,
        found: &ScanResult,
        turbulent: &TurbulentFit,
        moves: bool,
    ) -> ScanResult {
        let fit = &turbulent.fit;
        let mut result = result_of(found, self.scan, self.options, fit, moves);
        result.statistic = fit.statistic;
        result.threshold = self.map_options.least_statistic;
        result.turbulence = Some(turbulent.turbulence);
        result.set(Flag::LocalCirculation, turbulent.is_local);
        result
    }

    /// The one vortex that is found; another may be there beyond the scan.
    fn one(&self, found: &ScanResult) -> Option<ScanResult> {
        let (fit, moves) = self.best(found.wake.as_ref()).ok()?;
        let turbulent = self.in_turbulence(&fit, moves).ok()?;
        let turbulence = turbulent.as_ref().map(|found| found.turbulence);
        let fit = turbulent.map_or(fit, |found| found.fit);
        let mut result = result_of(found, self.scan, self.options, &fit, moves);
        result.turbulence = turbulence;
        Some(result.reporting(|vortex| found.vortex(vortex.side).is_some()))
    }
}

/// Whether the chi-square of a fit is clearly less than that of another one.
fn is_clearly_better(fit: &MapFit, than: &MapFit) -> bool {
    chi2(than) - chi2(fit) > RetrievalOptions::MOVES
}

/// Whether a circulation exceeds its standard error.
fn is_likely(vortex: &VortexResult) -> bool {
    vortex.circulation_m2_s.value > vortex.circulation_m2_s.std
}

/// The fit with a flag where a circulation is not certain.
fn with_certainty(mut pair: ScanResult) -> ScanResult {
    let are_certain = pair.vortices.iter().all(VortexResult::is_certain);
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

/// The fit of a wake that stands out of the wind, without its vortices, of which too little is known.
fn without_vortices(pair: ScanResult) -> ScanResult {
    let mut result = pair.reporting(|_| false);
    result.wake = None;
    result.set(Flag::Uncertain, true);
    result
}

/// The result of a fit to a map that has other vortices than the means showed.
fn result_of(
    found: &ScanResult,
    map: &ScanMap,
    options: &RetrievalOptions,
    fit: &MapFit,
    moves: bool,
) -> ScanResult {
    let mut result = found.with_wake(
        map,
        &options.model,
        (fit.wake, fit.covariance.clone()),
        fit.tops.clone(),
        moves,
    );
    result.cells_used = fit.used - fit.outliers;
    result.cells_rejected = fit.outliers;
    result.set(Flag::Outliers, 10 * fit.outliers > fit.used);
    result
}
