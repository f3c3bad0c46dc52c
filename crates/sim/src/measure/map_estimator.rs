//! The estimator of a scene with the regions of its maps and the noise that it is held against: what turns the windows of a
//! scan into velocities, whether the records are simulated or read from a file.
//!
//! Check: maps of simulated records have the same bits whether they come from memory or from a file, whole or in blocks.

use crate::Error;
use crate::measure::gate_estimates::GateEstimate;
use crate::measure::ray_information::RayInformation;
use crate::measure::region::region_radius;
use crate::measure::scan::median_snr;
use crate::plan::Plan;
use crate::plan::estimators::{self, Toolkit};
use rayon::prelude::*;
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::ops::Range;
use wakescope_estimate::{
    Radius, Scan, Statistic,
    estimators::{NoiseTest, RegionNoise},
    map::{MapPoint, PolarPoint, ScanGeometry, ScanSums, WindowCovariance},
    window::Sample,
};

/// Statistic, regions and estimator of a scene.
pub(crate) struct MapEstimator<'p, S> {
    plan: &'p Plan,
    pub(crate) tools: Toolkit<S>,
    covariance: WindowCovariance,
    of_rays: RayInformation<'p>,
    pub(crate) radius: Radius,
}

/// Sums over the windows of a scan.
pub(crate) type WindowSums<'a, S> = ScanSums<'a, S, dyn Statistic<S>>;

/// What noise alone gives at a point: the density in the band, A^2, that it exceeds with the probability of the scene, NaN without a test,
/// and the standard deviation of the power in the band over its mean.
pub(crate) type PointNoise = (f64, f64);

/// Where the windows of records at some elevations, rad, are in a plane.
///
/// # Errors
/// What the estimators refuse; a checked scene gives none.
pub(crate) fn windows_at(plan: &Plan, record_elevation_rad: &[f64]) -> Result<ScanGeometry, Error> {
    let scene = plan.scene();
    let samples = plan.geometry.samples;
    let sampling = scene.sampling()?;
    let gates = scene.gates()?;
    Ok(ScanGeometry::new(
        &sampling,
        &gates,
        record_elevation_rad,
        samples,
    )?)
}

impl<'p, S: Sample> MapEstimator<'p, S> {
    /// For the lines of `places`; `layer_snr` holds range, m, and expected signal-to-noise ratio of the layers of a line.
    ///
    /// # Errors
    /// What the estimators refuse; a checked scene gives none.
    pub(crate) fn new(
        plan: &'p Plan,
        layer_snr: &[(f64, f64)],
        places: &ScanGeometry,
    ) -> Result<Self, Error> {
        let scene = plan.scene();
        let covariance = estimators::window_covariance(scene, &plan.instrument.pulse)?;
        let of_rays = RayInformation::new(plan, layer_snr)?;
        let radius = region_radius(&of_rays, places)?;
        let tools = Toolkit::new(scene, &plan.instrument, median_snr(layer_snr))?;
        Ok(Self {
            plan,
            tools,
            covariance,
            of_rays,
            radius,
        })
    }

    /// Sums over the windows of some lines, still without any record; over those of some gates if these are given.
    pub(crate) fn sums(
        &self,
        places: ScanGeometry,
        held: Option<Range<usize>>,
    ) -> Result<WindowSums<'_, S>, Error> {
        let statistic = &*self.tools.statistic;
        let gates = self.plan.scene().gates()?;
        Ok(match held {
            None => ScanSums::new(statistic, &gates, places, self.plan.geometry.samples)?,
            Some(held) => ScanSums::of_gates(statistic, &gates, places, held)?,
        })
    }

    /// Estimates at points, the gates of a line together and lines by increasing elevation, held against the noise there.
    pub(crate) fn gates(
        &self,
        scan: &Scan,
        points: &[PolarPoint],
        noise: &[PointNoise],
    ) -> Result<Vec<GateEstimate>, Error> {
        let found = scan.map(points, &self.radius, None, &*self.tools.estimator)?;
        let gates = points
            .iter()
            .take_while(|p| p.line == points[0].line)
            .count()
            .max(1);
        // Speckle and noise share out the spectrum of a gate as its own signal-to-noise ratio says.
        let range_m: Vec<f64> = points
            .iter()
            .take(gates)
            .map(|point| point.range_m)
            .collect();
        let of_gate = |(range_m, snr): (&f64, f64)| {
            Ok((
                self.radius.at_m(*range_m)?,
                self.covariance.correlation(snr)?,
            ))
        };
        let ratios = self.of_rays.of_windows(&range_m)?;
        let of_gates = range_m
            .iter()
            .zip(ratios)
            .map(of_gate)
            .collect::<Result<Vec<_>, Error>>()?;
        let held = |(index, (found, point)): (usize, (MapPoint, &PolarPoint))| {
            let ((radius_m, correlation), e) = (&of_gates[index % gates], &found.estimate);
            let (threshold, deviation) = noise[index];
            GateEstimate {
                found: MapPoint {
                    n_eff: scan.n_eff(*point, *radius_m, correlation),
                    ..found
                },
                power_a2: if e.velocity_m_s.is_finite() {
                    e.power
                } else {
                    f64::NAN
                },
                gain: self.tools.noise.gain(e.velocity_m_s),
                detection_ratio: e.detection / threshold,
                deviation,
            }
        };
        Ok(found
            .into_par_iter()
            .zip(points)
            .enumerate()
            .map(held)
            .collect())
    }

    /// What noise gives at each of some points of a scan.
    pub(crate) fn noise(
        &self,
        places: &ScanGeometry,
        points: &[PolarPoint],
    ) -> Result<Vec<PointNoise>, Error> {
        let Some(test) = &self.tools.test else {
            return Ok(vec![(f64::NAN, 0.0); points.len()]);
        };
        let region = |point: &PolarPoint| {
            Ok(test.region_at(places, *point, self.radius.at_m(point.range_m)?))
        };
        let regions = points
            .iter()
            .map(region)
            .collect::<Result<Vec<RegionNoise>, Error>>()?;
        let rate = self.plan.scene().estimator.false_alarm;
        let threshold = if rate > 0.0 {
            self.thresholds(test, &regions)?
        } else {
            vec![f64::NAN; points.len()]
        };
        let deviations = regions.iter().map(|at| test.band_deviation(at.n_eff));
        Ok(threshold.into_iter().zip(deviations).collect())
    }

    /// Densities, A^2, that noise exceeds with the rate of false alarms; NaN where there is no window.
    fn thresholds(&self, test: &NoiseTest, regions: &[RegionNoise]) -> Result<Vec<f64>, Error> {
        let density_a2 = self.tools.noise.density_a2;
        let rate = self.plan.scene().estimator.false_alarm;
        // Many points share their windows.
        let mut known = HashMap::new();
        let of = |region: &RegionNoise| {
            Ok(match known.entry(region.key()) {
                Entry::Occupied(level) => *level.get(),
                Entry::Vacant(place) => *place.insert(density_a2 * test.threshold(region, rate)?),
            })
        };
        regions.iter().map(of).collect()
    }
}
