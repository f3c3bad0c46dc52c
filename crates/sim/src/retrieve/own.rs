//! Maps and signals of scenes of this program: what their estimator makes of a wake is known, and so are their signals.
//!
//! Check: circulations of maps and signals of a pair within their stated deviations.

use super::retrieved_scan::{RetrievedScan, refused};
use crate::Error;
use crate::io::raw::RawRecords;
use crate::io::scans::ReadScan;
use crate::measure::progress::Observer;
use crate::measure::recorded::{FromParts, MeasuredScan};
use crate::measure::response::{SceneResponse, correlated_lines, gate_step};
use crate::measure::scan::Scanner;
use crate::plan::Plan;
use crate::scene::{DetectorSignal, Scene};
use ndarray::{Array2, ArrayView2, Axis};
use num_complex::Complex;
use wakescope_estimate::retrieval::{Flag, Measured, RetrievalOptions, ScanMap, ScanResult, Side, Top, VortexResult};
use wakescope_estimate::vortex_fit::{
    MapFitOptions, Parameter, Sharing, SignalFit, SignalFitOptions, VelocityMap, Vortex, Wake, fit_map_of_estimator,
    fit_secondary_vortices, fit_signals,
};
use wakescope_estimate::window::Sample;

/// A top so much above the least chi-square competes with it.
const COMPETES: f64 = 9.0;
/// A vortex that means do not show is one if its circulation is that many of its deviations.
const CERTAIN_SIGMAS: f64 = 3.0;

/// The scene of a map or of signals.
pub struct OwnScene {
    scene: Scene,
    response: SceneResponse,
    noise_power_a2: f64,
}

impl OwnScene {
    /// Nothing for a scene without noise, or with a pulse that is no Gaussian without chirp.
    ///
    /// # Errors
    /// What the efficiency refuses; a checked scene gives none.
    pub fn new(plan: &Plan, observer: &dyn Observer) -> Result<Option<Self>, Error> {
        let layers = Scanner::expected_layer_snr(plan, observer)?;
        let scene = plan.scene.scene.clone();
        let noise_power_a2 = plan.instrument.receiver.noise_variance_a2();
        let response = SceneResponse::new(&scene, &plan.instrument, layers);
        Ok(response.map(|response| Self { scene, response, noise_power_a2 }))
    }

    /// The same for a plan whose lines are there.
    pub(super) fn of_scanner(plan: &Plan, scanner: &Scanner<'_>) -> Option<Self> {
        let scene = plan.scene.scene.clone();
        let noise_power_a2 = plan.instrument.receiver.noise_variance_a2();
        let response = SceneResponse::new(&scene, &plan.instrument, scanner.layer_snr())?;
        Some(Self { scene, response, noise_power_a2 })
    }

    /// Expected signal-to-noise ratio in the band at the middle of a wake, a power ratio.
    pub fn snr_of(&self, wake: &Wake) -> f64 {
        let (y_m, z_m) = middle_m(wake);
        self.response.snr_at(y_m.hypot(z_m - self.scene.scan.lidar_height_m))
    }

    /// The fit of a pair to what the estimator of the scene shows, for a map in which `found` has a wake: taken for means, peaks may show
    /// but one of its vortices. Nothing where there is no wake or no certain pair, the estimator is one of those without such a
    /// model, or the fit does not come to an end. The options are those with the secondary vortices that the map shows beside the pair.
    pub(super) fn refined(
        &self,
        map: &ScanMap,
        options: &RetrievalOptions,
        found: &ScanResult,
    ) -> Option<(ScanResult, RetrievalOptions)> {
        if found.statistic.is_nan() || found.statistic < options.threshold {
            return None;
        }
        let from_lidar = |vortex: &VortexResult| {
            vortex.lateral_position_m.value.hypot(vortex.height_m.value - self.scene.scan.lidar_height_m)
        };
        let range_m = match found.vortices.len() {
            0 => 0.5 * (map.range_m.first()? + map.range_m.last()?),
            count => found.vortices.iter().map(from_lidar).sum::<f64>() / count as f64,
        };
        let shown = self.response.shown(&self.scene, range_m)?;
        let some: Vec<usize> = (0..map.range_m.len()).step_by(gate_step(&self.scene)).collect();
        let ranges_m: Vec<f64> = some.iter().map(|gate| map.range_m[*gate]).collect();
        let velocity_m_s = map.velocity_m_s.select(Axis(1), &some);
        // Maps of one scan know no deviation, and those of a few scans hardly any.
        let view = VelocityMap {
            elevation_rad: &map.elevation_rad,
            range_m: &ranges_m,
            velocity_m_s: velocity_m_s.view(),
            standard_deviation_m_s: None,
        };
        let lines = map.elevation_rad.len();
        let (lowest, highest) = (*map.elevation_rad.first()?, *map.elevation_rad.last()?);
        let step_rad = (highest - lowest) / (lines.max(2) - 1) as f64;
        let fit_options = MapFitOptions {
            free: options.free,
            loss: options.loss,
            correlated_lines: correlated_lines(&self.scene, step_rad, range_m),
            ..MapFitOptions::default()
        };
        let mut options = options.clone();
        let mut fit = fit_map_of_estimator(&view, &options.model, &shown, &fit_options).ok()?;
        let four = fit_secondary_vortices(&view, &options.model, &shown, &fit.wake, &fit_options).ok().flatten();
        if let Some((with_secondary, vortices)) = four {
            fit = with_secondary;
            options.model.secondary = Some(vortices);
        }
        let tops = fit.tops.iter().map(|top| Top { wake: top.wake, chi2: -2.0 * top.log_likelihood }).collect();
        let pair = as_pair(found, map, &options, &fit.wake);
        let mut result = retold(&pair, &options, (fit.wake, fit.covariance), tops);
        // Beyond the scan there may be anything.
        let (ranges, elevations) = (map.range_m.first()?..=map.range_m.last()?, lowest..=highest);
        let is_seen = |vortex: &VortexResult| {
            let (y_m, z_m) = (vortex.lateral_position_m.value, vortex.height_m.value);
            let elevation_rad = (z_m - self.scene.scan.lidar_height_m).atan2(y_m);
            ranges.contains(&&from_lidar(vortex)) && elevations.contains(&elevation_rad)
        };
        let is_certain =
            |vortex: &VortexResult| vortex.circulation_m2_s.value > CERTAIN_SIGMAS * vortex.circulation_m2_s.std;
        if found.vortices.len() < 2 && !result.vortices.iter().all(|vortex| is_seen(vortex) && is_certain(vortex)) {
            return None;
        }
        if !fit.cores_fitted || options.free.core_radius == Sharing::Fixed {
            keep_cores(&mut result);
        }
        (result.cells_used, result.cells_rejected) = (fit.used - fit.outliers, fit.outliers);
        set(&mut result.flags, Flag::Outliers, 10 * fit.outliers > fit.used);
        set(&mut result.flags, Flag::SecondaryVortices, options.model.secondary.is_some());
        Some((result, options))
    }
}

/// Retrieves a scan from its raw signals: the wake of its map starts the fit.
///
/// # Errors
/// What the system says of the file, and what the fits refuse.
pub fn retrieve_signals(
    own: &OwnScene,
    records: &mut RawRecords,
    measured: &MeasuredScan,
    found: RetrievedScan,
) -> Result<RetrievedScan, Error> {
    match own.scene.detector.signal {
        DetectorSignal::IntermediateFrequency => of_samples::<f64>(own, records, measured, found),
        DetectorSignal::Baseband => of_samples::<Complex<f64>>(own, records, measured, found),
    }
}

fn of_samples<S: FromParts>(
    own: &OwnScene,
    records: &mut RawRecords,
    measured: &MeasuredScan,
    found: RetrievedScan,
) -> Result<RetrievedScan, Error> {
    let (range, elevation_rad) = measured.lines.all_records();
    let samples: Array2<S> = crate::measure::recorded::samples(records, range, 0..records.samples())?;
    own.of_records(samples.view(), elevation_rad, found)
}

impl OwnScene {
    /// The fit to the records of lines at those elevations, rad; the wake of their map starts it.
    ///
    /// # Errors
    /// What the fit refuses.
    pub(super) fn of_records<S: Sample>(
        &self,
        samples: ArrayView2<'_, S>,
        elevation_rad: Vec<f64>,
        found: RetrievedScan,
    ) -> Result<RetrievedScan, Error> {
        let Some(guess) = found.result.wake.filter(|_| found.result.vortices.len() == 2) else { return Ok(found) };
        let RetrievedScan { scan, options, result } = found;
        let setup = self.response.setup(&self.scene, options.model, elevation_rad)?;
        let snr = |range_m: f64, _: f64| self.response.snr_at(range_m);
        let fit_options = SignalFitOptions { free: options.free, ..SignalFitOptions::default() };
        let fit = fit_signals(&setup, snr, samples, self.noise_power_a2, &guess, &fit_options)
            .map_err(|error| refused(&scan, &error))?;
        let SignalFit { wake, covariance, tops, log_likelihood_gain, used_rays, .. } = fit;
        let best = tops.iter().map(|top| top.log_likelihood).fold(f64::NEG_INFINITY, f64::max);
        let tops = tops.iter().map(|top| Top { wake: top.wake, chi2: 2.0 * (best - top.log_likelihood) }).collect();
        let mut result = retold(&result, &options, (wake, covariance), tops);
        if options.free.core_radius == Sharing::Fixed {
            keep_cores(&mut result);
        }
        result.statistic = 2.0 * log_likelihood_gain;
        (result.cells_used, result.cells_rejected) = (used_rays, setup.elevation_rad.len() - used_rays);
        result.chi2_per_dof = f64::NAN;
        Ok(RetrievedScan { scan, options, result })
    }
}

/// The middle of both vortices, m.
fn middle_m(wake: &Wake) -> (f64, f64) {
    (
        0.5 * (wake.left.lateral_position_m + wake.right.lateral_position_m),
        0.5 * (wake.left.height_m + wake.right.height_m),
    )
}

/// A result in which both vortices of a wake are found, each when the line of sight passes it.
fn as_pair(found: &ScanResult, map: &ScanMap, options: &RetrievalOptions, wake: &Wake) -> ScanResult {
    if found.vortices.len() == 2 {
        return found.clone();
    }
    let unknown = Measured { value: f64::NAN, std: f64::NAN };
    let of = |(side, vortex): (Side, Vortex)| {
        let elevation_rad = (vortex.height_m - options.model.lidar_height_m).atan2(vortex.lateral_position_m);
        let away = |line: &usize| (map.elevation_rad[*line] - elevation_rad).abs();
        let line = (0..map.elevation_rad.len()).min_by(|a, b| away(a).total_cmp(&away(b)));
        VortexResult {
            side,
            time_s: line.map_or(f64::NAN, |line| map.time_s[line]),
            circulation_m2_s: unknown,
            circulation_5_15_m2_s: unknown,
            lateral_position_m: unknown,
            height_m: unknown,
            core_radius_m: None,
        }
    };
    let mut pair = found.clone();
    pair.vortices = [(Side::Left, wake.left), (Side::Right, wake.right)].map(of).to_vec();
    // What the other fit left says nothing of this one.
    [Flag::NoWake, Flag::OneVortex, Flag::PoorFit].into_iter().for_each(|flag| set(&mut pair.flags, flag, false));
    pair.chi2_per_dof = f64::NAN;
    pair
}

/// A result with another wake of standing vortices.
fn retold(
    found: &ScanResult,
    options: &RetrievalOptions,
    (wake, covariance): (Wake, Array2<f64>),
    tops: Vec<Top>,
) -> ScanResult {
    let values = wake.to_array();
    let measured = |parameter: Parameter| Measured {
        value: values[parameter as usize],
        std: covariance[[parameter as usize; 2]].sqrt(),
    };
    let means = wake.mean_circulations_5_15_m2_s(options.model.profile, covariance.view());
    let vortex = |vortex: &VortexResult| {
        let mean = means[usize::from(vortex.side == Side::Right)];
        let [circulation_m2_s, lateral_position_m, height_m, core_radius_m] = vortex.side.parameters().map(measured);
        VortexResult {
            circulation_m2_s,
            circulation_5_15_m2_s: Measured { value: mean.0, std: mean.1 },
            lateral_position_m,
            height_m,
            core_radius_m: Some(core_radius_m),
            ..*vortex
        }
    };
    let mut flags = found.flags.clone();
    // The wake stands still in these fits, and that of the map moved or had no times.
    set(&mut flags, Flag::MotionIgnored, true);
    set(&mut flags, Flag::CoreKept, false);
    let competing = tops.iter().skip(1).any(|top: &Top| top.chi2 - tops[0].chi2 < COMPETES);
    set(&mut flags, Flag::Ambiguous, competing);
    ScanResult {
        vortices: found.vortices.iter().map(vortex).collect(),
        wake: Some(wake),
        lateral_wind_m_s: measured(Parameter::Wind),
        wind_shear_per_s: measured(Parameter::Shear),
        covariance,
        flags,
        tops,
        ..found.clone()
    }
}

/// Core radii that were not fitted.
fn keep_cores(result: &mut ScanResult) {
    result.vortices.iter_mut().for_each(|vortex| vortex.core_radius_m = None);
    set(&mut result.flags, Flag::CoreKept, true);
}

fn set(flags: &mut Vec<Flag>, flag: Flag, is_set: bool) {
    flags.retain(|own| *own != flag);
    if is_set {
        flags.push(flag);
        flags.sort();
    }
}

/// A scan of recorded signals as a map for a retrieval.
pub fn scan_of_signals(path: &std::path::Path, sweep: usize, plan: &Plan, scan: &MeasuredScan) -> ReadScan {
    // Lines by increasing elevation.
    let mut order: Vec<usize> = (0..scan.lines.elevation_rad.len()).collect();
    order.sort_by(|a, b| scan.lines.elevation_rad[*a].total_cmp(&scan.lines.elevation_rad[*b]));
    let mut velocity_m_s = scan.velocity_m_s.select(Axis(0), &order);
    let flagged = scan.flagged.select(Axis(0), &order);
    velocity_m_s.zip_mut_with(&flagged, |velocity, flagged| {
        if *flagged > 0.5 {
            *velocity = f64::NAN
        }
    });
    let of = |values: &[f64]| order.iter().map(|line| values[*line]).collect();
    let map = ScanMap {
        elevation_rad: of(&scan.lines.elevation_rad),
        time_s: of(&scan.lines.time_s),
        range_m: plan.geometry.gate_range_m.clone(),
        velocity_m_s,
        sigma_m_s: None,
        fold_m_s: None,
    };
    ReadScan {
        path: path.to_owned(),
        sweep,
        reference: crate::io::UtcTime::parse(&plan.scene.scene.site.start_utc),
        scene_toml: Some(plan.scene.toml.clone()),
        ..ReadScan::own("", map)
    }
}
