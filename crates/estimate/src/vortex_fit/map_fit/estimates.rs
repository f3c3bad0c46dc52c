//! Fit of the wake to a map that an estimator of this crate made.
//!
//! Damped steps of Gauss and Newton on what the estimator itself makes of the wake's spectra, with difference quotients
//! that are taken anew when the wake has moved by more than its error. Residuals are those of all places, so that the fit ends
//! where it must; slopes only weigh them, and are taken at every few lines and gates, linear between. There, too, the fits from
//! all starts begin: all places are asked from their ends on. Check: exact maps of peaks; the spread of fits over many maps.

use ndarray::Array2;

use crate::error::Error;
use crate::vortex_fit::levenberg_marquardt::StoppingRule;
use crate::vortex_fit::map_fit::coarse::Coarse;
use crate::vortex_fit::map_fit::estimator_response::Prepared;
use crate::vortex_fit::map_fit::gates::Gates;
use crate::vortex_fit::map_fit::guess::first_guesses;
use crate::vortex_fit::map_fit::local_circulation::{REACH_M, joined};
use crate::vortex_fit::map_fit::prediction::{Predicted, Prediction, near, quotients};
use crate::vortex_fit::map_fit::setting::Setting;
use crate::vortex_fit::map_fit::starts::{
    best_of, rivals, same, starts_about, with_large_cores, with_typical_core,
};
use crate::vortex_fit::tolerances::{ESTIMATES, MEANS, MEANS_START, ONE_SIGMAS, STARTS};
use crate::vortex_fit::top::distinct;
use crate::vortex_fit::{
    EstimatorResponse, FreeParameters, MapFit, MapFitOptions, RangeKernel, SecondaryVortices,
    Sharing, VelocityMap, Vortex, Wake, WakeModel,
};

/// The least core radius over a region's radius, or over the distance of lines.
const SMALLEST_CORE: f64 = 0.25;
/// Places that tell nearly all of a map: no farther apart than these parts of the radius of its regions, for starts, for secondary vortices and for
/// slopes (half the radius for these saves a tenth of the time, but heights scatter by some per cent more), and of the width of its gates.
const START_LINES_OVER_RADIUS: f64 = 1.6;
const SECONDARY_LINES_OVER_RADIUS: f64 = 0.8;
const SLOPE_LINES_OVER_RADIUS: f64 = 0.3;
const GATES_OVER_WIDTH: f64 = 0.6;
/// Nodes of the air are farther apart there by this factor.
const COARSER_NODES: f64 = 2.0;

/// Fits the wake to a map whose velocities are means over gates, without any prior knowledge: a search for the best pair, then a fit from there with
/// each of a few core radii, if they are fitted. `kernel` is what each velocity sees of the air about its range.
///
/// # Errors
/// [`Error::NoVortex`] if no pair stands out; [`Error::Length`], [`Error::OutOfRange`] for impossible input; [`Error::TooFewVelocities`] with less
/// than a hundred, or ten for each free number; [`Error::NotConverged`]; [`Error::Linalg`] if a free parameter does not show in the map.
pub fn fit_map(
    map: &VelocityMap<'_>,
    model: &WakeModel,
    kernel: &RangeKernel,
    options: &MapFitOptions,
) -> Result<MapFit, Error> {
    let guess = &first_guesses(map, model, kernel, options.least_statistic)?[0];
    let gates = Gates::at_rest(model, kernel.clone(), (map.elevation_rad, map.range_m));
    let setting = Setting {
        map,
        model,
        prediction: &gates,
        kernel,
        options,
        least_core_m: 0.0,
    };
    let mut starts = starts_about(guess, options);
    starts.extend(with_large_cores(guess, options));
    let best = best_of(&starts, |start| setting.descended(start, MEANS))?;
    let fit = with_typical_core(best, options, |start| setting.descended(start, MEANS))?;
    fit.standing_out(options.least_statistic)
}

/// Fits the wake to a map that an estimator of this crate made, without any prior knowledge: as [`fit_map`] with its mean gate, then
/// [`refine_map_fit_of_estimator`] of every few lines and gates with each of a few core radii, if they are fitted, then of all from the ends that
/// differ.
///
/// # Errors
/// As [`fit_map`].
pub fn fit_map_of_estimator(
    map: &VelocityMap<'_>,
    model: &WakeModel,
    response: &EstimatorResponse<'_>,
    options: &MapFitOptions,
) -> Result<MapFit, Error> {
    map.validate()?;
    let full = EstimatorPrediction::new(map, model, response, options, 1.0)?;
    let guesses = first_guesses(map, model, &full.prepared.kernel, options.least_statistic)?;
    let coarse = full.coarse(START_LINES_OVER_RADIUS);
    let thinned = full.at(&coarse)?;
    let about = thinned.ends_of_means(&guesses);
    let for_slopes = full.coarse_for_slopes();
    let full = full.with_slopes_at(&for_slopes)?;
    let best = match full.best_about(&about, &thinned) {
        Err(Error::NotConverged { .. }) => full.best_about(&guesses, &thinned),
        first => first,
    };
    let fit = with_typical_core(best?, options, |start| full.refined(start, ESTIMATES))?;
    fit.standing_out(options.least_statistic)
}

/// Fits the wake to a map that an estimator made, from a given start on: what is expected of a wake is the estimate from its
/// expected correlograms. A vortex that has no circulation at the start is none: its numbers are not fitted.
///
/// # Errors
/// As [`fit_map`], but for a map without a wake.
pub fn refine_map_fit_of_estimator(
    map: &VelocityMap<'_>,
    model: &WakeModel,
    response: &EstimatorResponse<'_>,
    guess: &Wake,
    options: &MapFitOptions,
) -> Result<MapFit, Error> {
    map.validate()?;
    let full = EstimatorPrediction::new(map, model, response, options, 1.0)?;
    let for_slopes = full.coarse_for_slopes();
    full.with_slopes_at(&for_slopes)?.refined(guess, ESTIMATES)
}

/// Secondary vortices beside the pair of a fit, if the map shows them or the options want them anyway, and that pair with them: both are fitted at
/// once, then the pair once more with the others as they are. The covariance counts what is not known of them. Nothing but what the map shows is
/// told where they are not fitted.
///
/// # Errors
/// As [`refine_map_fit_of_estimator`].
pub fn fit_secondary_vortices(
    map: &VelocityMap<'_>,
    model: &WakeModel,
    response: &EstimatorResponse<'_>,
    pair: &Wake,
    options: &MapFitOptions,
) -> Result<Option<(Option<MapFit>, SecondaryVortices)>, Error> {
    map.validate()?;
    pair.validate()?;
    let full = EstimatorPrediction::new(map, model, response, options, 1.0)?;
    let coarse = full.coarse(SECONDARY_LINES_OVER_RADIUS);
    let Some(found) = full.at(&coarse)?.setting().with_secondary(pair) else {
        return Ok(None);
    };
    if !found.fitted {
        return Ok(Some((None, found)));
    }
    let model = WakeModel {
        secondary: Some(found.vortices),
        ..*model
    };
    let fit = refine_map_fit_of_estimator(map, &model, response, &found.wake, options)?;
    let covariance = found.covariance.clone();
    Ok(Some((Some(MapFit { covariance, ..fit }), found)))
}

/// The same pair with the circulation of each vortex from what is near it, in a wind of its own, where that explains the map clearly better: what
/// else is in the air than a pair then weighs less.
///
/// # Errors
/// [`Error::Length`], [`Error::OutOfRange`] for impossible input.
pub fn with_local_circulations(
    map: &VelocityMap<'_>,
    model: &WakeModel,
    response: &EstimatorResponse<'_>,
    pair: &MapFit,
    options: &MapFitOptions,
) -> Result<Option<MapFit>, Error> {
    map.validate()?;
    pair.wake.validate()?;
    let vortices = [pair.wake.left, pair.wake.right];
    let local = [0, 1].map(|side| {
        let near = near_vortex(map, model, &vortices[side]);
        let shown = EstimatorPrediction::new(&near.map(), model, response, options, 1.0).ok()?;
        shown
            .setting()
            .local_circulation(&pair.wake, side, ESTIMATES)
    });
    Ok(joined(pair, &local))
}

/// How much better a wake explains what is near each vortex of a pair than that pair does with a circulation of that vortex and a wind of its own
/// there: the gain of the logarithm of the likelihood by both, with velocities that say the same counted once. Nothing where either fit fails or the input is impossible.
pub fn gain_over_local_circulations(
    map: &VelocityMap<'_>,
    response: &EstimatorResponse<'_>,
    [(model, wake), (model_of_pair, pair)]: [(&WakeModel, &Wake); 2],
    options: &MapFitOptions,
) -> Option<f64> {
    map.validate().ok()?;
    wake.validate().ok()?;
    pair.validate().ok()?;
    let mut gain = 0.0;
    for (side, vortex) in [&pair.left, &pair.right].into_iter().enumerate() {
        let near = near_vortex(map, model_of_pair, vortex);
        let near = near.map();
        let of_pair =
            EstimatorPrediction::new(&near, model_of_pair, response, options, 1.0).ok()?;
        let local = of_pair.setting().settled_nearby(pair, side, ESTIMATES)?;
        let of_wake = EstimatorPrediction::new(&near, model, response, options, 1.0).ok()?;
        let setting = of_wake.setting();
        let shown = setting.linear(&wake.to_array(), &local.groups, None).ok()?;
        gain += setting.gain(&shown, &local);
    }
    Some(gain)
}

/// What is near a vortex.
pub(crate) fn near_vortex(map: &VelocityMap<'_>, model: &WakeModel, vortex: &Vortex) -> Coarse {
    Coarse::near(map, |line, gate| {
        let place_m = model.position_m(map.range_m[gate], map.elevation_rad[line]);
        vortex.away_m(place_m) < REACH_M
    })
}

/// A map, and what an estimator shows at its places.
pub(crate) struct EstimatorPrediction<'a, 'm> {
    pub(crate) map: VelocityMap<'m>,
    pub(crate) prepared: Prepared<'a>,
    /// Some places at which slopes are taken, if not at all of them; between they are linear.
    slopes_at: Option<(&'a Coarse, Prepared<'a>)>,
    options: MapFitOptions,
    /// Core radii below this do not show \[m\].
    least_core_m: f64,
}

impl<'a, 'm: 'a> EstimatorPrediction<'a, 'm> {
    /// With nodes of the air `coarser` times as far apart as need be.
    pub(crate) fn new(
        map: &VelocityMap<'m>,
        model: &'a WakeModel,
        response: &'a EstimatorResponse<'a>,
        options: &MapFitOptions,
        coarser: f64,
    ) -> Result<Self, Error> {
        let prepared = response.prepared(model, (map.elevation_rad, map.range_m), coarser)?;
        let least_core_m = SMALLEST_CORE
            * map
                .line_spacing_m()
                .max(response.least_radius_m(map.range_m));
        Ok(Self {
            map: *map,
            prepared,
            slopes_at: None,
            options: *options,
            least_core_m,
        })
    }

    /// The places at which slopes are taken.
    pub(crate) fn coarse_for_slopes(&self) -> Coarse {
        self.coarse(SLOPE_LINES_OVER_RADIUS)
    }

    /// The places that tell nearly all of the map.
    fn coarse(&self, lines_over_radius: f64) -> Coarse {
        let line_m = lines_over_radius * self.prepared.response.least_radius_m(self.map.range_m);
        Coarse::of(
            &self.map,
            line_m,
            GATES_OVER_WIDTH * self.prepared.kernel.width_m(),
        )
    }

    /// What the estimator shows at some of the places.
    fn at<'c>(&self, places: &'c Coarse) -> Result<EstimatorPrediction<'c, 'c>, Error>
    where
        'a: 'c,
    {
        let correlated_lines = self.options.correlated_lines.div_ceil(places.line_step);
        let options = MapFitOptions {
            correlated_lines,
            ..self.options
        };
        EstimatorPrediction::new(
            &places.map(),
            self.prepared.model,
            self.prepared.response,
            &options,
            COARSER_NODES,
        )
    }

    /// The same with slopes at some places. Where these are all, slopes need the nodes of the velocities: small cores fall between coarser ones.
    pub(crate) fn with_slopes_at(self, places: &'a Coarse) -> Result<Self, Error> {
        if places.map().velocity_m_s.dim() == self.map.velocity_m_s.dim() {
            return Ok(self);
        }
        let slopes_at = Some((places, self.at(places)?.prepared));
        Ok(Self { slopes_at, ..self })
    }

    pub(crate) fn setting(&self) -> Setting<'_, 'm> {
        let Self {
            map,
            prepared: Prepared { model, kernel, .. },
            options,
            least_core_m,
            ..
        } = self;
        Setting {
            map,
            model,
            prediction: self,
            kernel,
            options,
            least_core_m: *least_core_m,
        }
    }

    /// Different minima of fits of means over gates, started from some guesses. A guess is returned, too,
    /// where a vortex left the map during the fit, and alone where the fit did not converge. Peaks
    /// that are fitted as means mislead the core radius most, so it is fixed.
    fn ends_of_means(&self, guesses: &[Wake]) -> Vec<Wake> {
        let model = self.prepared.model;
        let kernel = &self.prepared.kernel;
        let sector = (self.map.elevation_rad, self.map.range_m);
        let gates = Gates::at_rest(model, kernel.clone(), sector);
        let options = MapFitOptions {
            free: FreeParameters {
                core_radius: Sharing::Fixed,
                ..self.options.free
            },
            ..self.options
        };
        let setting = Setting {
            map: &self.map,
            model,
            prediction: &gates,
            kernel,
            options: &options,
            least_core_m: 0.0,
        };
        let mut ends = Vec::new();
        let mut wakes = Vec::new();
        for guess in guesses {
            let end = setting.descended(guess, MEANS_START).ok();
            let is_in_map = end.as_ref().is_some_and(|MapFit { wake, .. }| {
                model.sees(sector, wake.left.place_m()) && model.sees(sector, wake.right.place_m())
            });
            if !is_in_map {
                wakes.push(*guess);
            }
            ends.extend(end);
        }
        let ends = distinct(ends, |a, b| same(a, b, ONE_SIGMAS));
        wakes.extend(ends.iter().map(|end| end.wake));
        distinct(wakes, |a, b| near(&a.to_array(), &b.to_array()))
    }

    /// Where rough fits from some starts are after a few steps.
    fn ends(&self, starts: &[Wake]) -> Vec<MapFit> {
        let setting = self.setting();
        let mut ends = Vec::new();
        for start in starts {
            let end = setting.approached(start, STARTS).and_then(|end| {
                with_typical_core(end, &self.options, |start| {
                    setting.approached(start, STARTS)
                })
            });
            ends.extend(end);
        }
        ends
    }

    /// The fit by steps of Gauss and Newton from a start on.
    fn refined(&self, start: &Wake, stop: StoppingRule) -> Result<MapFit, Error> {
        self.setting().refined(start, stop)
    }

    /// The best of the fits from the starts about some wakes, by way of rough fits to the `thinned` map, which show the starts that lead to one
    /// minimum and those that lead nowhere. Where these end, large cores are tried, too.
    fn best_about(
        &self,
        wakes: &[Wake],
        thinned: &EstimatorPrediction<'_, '_>,
    ) -> Result<MapFit, Error> {
        let mut starts = Vec::new();
        for about in wakes {
            starts.extend(starts_about(about, &self.options));
        }
        let mut ends = thinned.ends(&starts);
        if !ends.is_empty() {
            starts = rivals(&ends);
        }
        let mut large = Vec::new();
        for start in &starts {
            large.extend(with_large_cores(start, &self.options));
        }
        ends.extend(thinned.ends(&large));
        if !ends.is_empty() {
            starts = rivals(&ends);
        }
        best_of(&starts, |start| self.refined(start, ESTIMATES))
    }
}

impl Prediction for EstimatorPrediction<'_, '_> {
    fn allows(&self, p: &[f64]) -> bool {
        self.prepared.model.allows(p)
    }

    fn predict(&self, p: &[f64], groups: &[Vec<usize>]) -> Predicted {
        let velocity_m_s = self.prepared.velocities_of(p);
        let slopes = match &self.slopes_at {
            None => quotients(|p| self.prepared.velocities_of(p), p, &velocity_m_s, groups),
            Some(_) if groups.is_empty() => Vec::new(),
            Some((coarse, thinned)) => {
                let here = thinned.velocities_of(p);
                let slopes = quotients(|p| thinned.velocities_of(p), p, &here, groups);
                slopes
                    .iter()
                    .map(|slope| coarse.everywhere(slope, velocity_m_s.dim()))
                    .collect()
            }
        };
        Predicted {
            velocity_m_s,
            slopes,
        }
    }

    fn of_other_profile(&self, wake: &Wake) -> Array2<f64> {
        let model = self.prepared.model;
        self.prepared.velocities(
            &WakeModel {
                profile: model.profile.other(),
                ..*model
            },
            wake,
        )
    }

    fn air_variances(&self, p: &[f64]) -> Option<Array2<f64>> {
        Some(self.prepared.variances(&Wake::from_list(p)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bound::Noise;
    use crate::estimators::{Refinement, SpectralPeak};
    use crate::spectrum::Correlogram;
    use crate::spectrum::unweighted_lags;
    use crate::window::{Sampling, SignalKind, Weighting};

    /// Slopes at every few lines and gates, linear between, against difference quotients at all places.
    #[test]
    fn slopes_from_few_places_are_near_those_of_all() {
        let sampling = Sampling::new(250e6, 80e6, 1.55e-6, (55e6, 105e6)).unwrap();
        let peak = SpectralPeak::new(
            &sampling,
            SignalKind::Real,
            &unweighted_lags(64),
            1024,
            Refinement::Parabola,
        )
        .unwrap();
        let statistic = Correlogram::<f64>::new(Weighting::default(), 64).unwrap();
        let response = EstimatorResponse::new(
            &statistic,
            &peak,
            &sampling,
            120e-9,
            (Noise::White, 1.0),
            2.0,
        )
        .unwrap();
        let (elevation_rad, range_m): (Vec<f64>, Vec<f64>) = (
            (0..130).map(|i| 0.05 + f64::from(i) * 1e-3).collect(),
            (0..40).map(|i| 320.0 + 4.0 * f64::from(i)).collect(),
        );
        let wake = Wake::from_array(&[
            480.0, 520.0, 376.5, 45.0, 423.5, 49.0, 2.0, 2.7, 1.3, 0.0, 0.0,
        ]);
        let (model, options) = (WakeModel::default(), MapFitOptions::default());
        let velocity_m_s = response
            .map(&model, &wake, &elevation_rad, &range_m)
            .unwrap();
        let map = VelocityMap {
            elevation_rad: &elevation_rad,
            range_m: &range_m,
            velocity_m_s: velocity_m_s.view(),
            standard_deviation_m_s: None,
        };
        let whole = EstimatorPrediction::new(&map, &model, &response, &options, 1.0).unwrap();
        let coarse = whole.coarse_for_slopes();
        assert!(2 * coarse.map().velocity_m_s.len() <= velocity_m_s.len());
        let groups = options.free.groups();
        let all = whole.predict(&wake.to_array(), &groups).slopes;
        let whole = whole.with_slopes_at(&coarse).unwrap();
        let some = whole.predict(&wake.to_array(), &groups).slopes;
        for ((group, some), all) in groups.iter().zip(&some).zip(&all) {
            let product = |a: &Array2<f64>, b: &Array2<f64>| (a * b).sum();
            let size = (product(some, some) / product(all, all)).sqrt();
            let alike = product(some, all) / (product(some, some) * product(all, all)).sqrt();
            // slopes of cores are narrow, and peaks that jump make them rough
            let least = if group[0] == 6 || group[0] == 7 {
                0.8
            } else {
                0.93
            };
            assert!(
                (size - 1.0).abs() < 0.15 && alike > least,
                "{group:?}: {size} {alike}"
            );
        }
    }
}
