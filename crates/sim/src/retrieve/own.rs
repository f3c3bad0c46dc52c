//! Signals of which the scene is known, and their maps: fits to their likelihood.
//!
//! Check: circulations of maps and signals of a pair within their standard errors.

use super::table::{RetrievedScan, refused};
use crate::Error;
use crate::io::raw::RawRecords;
use crate::io::scans::ReadScan;
use crate::measure::recorded::{MeasuredScan, samples, upward};
use crate::measure::response::SceneResponse;
use crate::plan::Plan;
use crate::plan::described::fold_m_s;
use crate::progress::Observer;
use crate::scene::DetectorSignal;
use ndarray::{Array2, ArrayView2, Axis};
use num_complex::Complex;
use wakescope_estimate::retrieval::{Flag, ScanMap};
use wakescope_estimate::vortex_fit::{
    FreeParameters, SignalFit, SignalFitOptions, Wake, WindFit, fit_signals,
};
use wakescope_estimate::window::Sample;

impl SceneResponse {
    /// Expected signal-to-noise ratio in the band at the middle of a wake, a power ratio.
    pub fn snr_of(&self, wake: &Wake) -> f64 {
        let y_m = 0.5 * (wake.left.lateral_position_m + wake.right.lateral_position_m);
        let z_m = 0.5 * (wake.left.height_m + wake.right.height_m);
        self.snr_at(y_m.hypot(z_m - self.scene.scan.lidar_height_m))
    }
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
    let (range, elevation_rad) = measured.lines.all_records();
    let all = 0..records.samples;
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
        let fit_options = SignalFitOptions {
            // the lines of the signals are too few to tell the logarithmic part, which stays that of the map
            free: FreeParameters {
                wind: WindFit::Linear,
                ..found.options.free
            },
            ..SignalFitOptions::default()
        };
        let fit = match fit_signals(
            &setup,
            |range_m, _| {
                // Whenever the fit makes a model of the lines.
                observer.advance(0);
                self.snr_at(range_m)
            },
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
        Ok(with_signal_fit(found, fit, setup.elevation_rad.len()))
    }
}

/// The scan with the result of a fit to its signals, of so many rays, in place of that of its map.
fn with_signal_fit(found: RetrievedScan, fit: SignalFit, rays: usize) -> RetrievedScan {
    let mut tops = fit.tops;
    let least = tops
        .iter()
        .map(|top| top.chi2)
        .fold(f64::INFINITY, f64::min);
    for top in &mut tops {
        top.chi2 -= least;
    }
    let mut result = found.result.with_wake(
        &found.scan.map,
        &found.options.model,
        (fit.wake, fit.covariance),
        tops,
        false,
    );
    result.statistic = 2.0 * fit.log_likelihood_gain;
    result.cells_used = fit.used_rays;
    result.cells_rejected = rays - fit.used_rays;
    result.chi2_per_dof = f64::NAN;
    RetrievedScan { result, ..found }
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
            fold_m_s: fold_m_s(plan.scene()),
        },
    )
}
