//! What a case gives in numbers: a row of the results. Cases that share their signals are measured together.
//!
//! Errors are averages over cells of the map, with standard errors from their scatter over the realisations. Check: the columns of a run against its map; resolution against the stored table.

use super::circulation::Retrieval;
use crate::Error;
use crate::measure::bound::bound_in_the_middle;
use crate::measure::cell_average::{CellAverage, error_of_fraction, flagged_fraction};
use crate::measure::error_law::shared_cells;
use crate::measure::map::{self, VelocityEstimates};
use crate::measure::profile::EfficiencyMemo;
use crate::measure::ray_information::range_filter;
use crate::measure::scan::Scanner;
use crate::plan::Plan;
use crate::progress::Observer;
use crate::run::ScanMiddle;
use crate::scene::{Flow, NoiseModel};
use ndarray::Array2;
use wakescope_les::winds::Vortex;

/// Cells within this part of the spacing of a pair from a centre are inside its vortices: 8 m of 47.
const INSIDE_PART: f64 = 8.0 / 47.0;
/// Cells beyond this part from both are outside: 30 m of 47.
const OUTSIDE_PART: f64 = 30.0 / 47.0;

/// Estimates farther from the wind than this many widths of a peak are no estimates of it.
const BEYOND_WIDTHS: f64 = 3.0;

/// With some flagged estimates, but fewer than these, outliers may be missing by chance.
const LEAST_FLAGGED: f64 = 19.5;
/// Estimates that a standard error needs.
const LEAST_ESTIMATES: usize = 16;

/// Names, units and meanings of the results, in the order of the columns.
pub(super) fn results() -> impl Iterator<Item = (&'static str, &'static str, &'static str)> {
    include_str!("results.csv").lines().filter_map(|line| {
        let (name, rest) = line.split_once(',')?;
        let (unit, meaning) = rest.split_once(',')?;
        Some((name, unit, meaning))
    })
}

/// What is collected of the maps of a case.
struct Collected<'p> {
    plan: &'p Plan,
    /// Distance of the cells from the nearer centre over the spacing, \[line, gate\]; infinite in air without vortices, NaN where centres
    /// are not known.
    distance: Array2<f64>,
    retrieval: Option<Retrieval<'p>>,
    /// Cells outside the vortices, all where these are not known, one of each group that shares windows, and their velocities, m/s, map after map.
    apart: Vec<(usize, usize)>,
    velocity_m_s: Vec<f64>,
}

/// The rows of plans whose scenes differ in estimator, outputs and site alone, each in the order of [`results`]: the records of each
/// realisation are made once.
///
/// # Errors
/// What the crates refuse; a checked scene gives none.
pub(super) fn rows(
    plans: &[Plan],
    known: &EfficiencyMemo,
    observer: &dyn Observer,
    fits: bool,
) -> Result<Vec<Vec<f64>>, Error> {
    let Some(first) = plans.first() else {
        return Ok(Vec::new());
    };
    let scanner = Scanner::with(first, known, observer)?;
    let mut all = Vec::with_capacity(plans.len());
    for plan in plans {
        all.push(Collected::new(
            plan,
            if fits {
                Retrieval::new(plan, &scanner)
            } else {
                None
            },
        )?);
    }
    let of_plans: Vec<&Plan> = plans.iter().collect();
    let maps = map::of_plans(&of_plans, &scanner, observer, |map| {
        let own = &mut all[map.plan];
        let velocity_m_s = map.velocity_m_s;
        own.velocity_m_s
            .extend(own.apart.iter().map(|cell| velocity_m_s[*cell]));
        own.retrieval
            .iter_mut()
            .for_each(|retrieval| retrieval.add(velocity_m_s));
    })?;
    all.iter()
        .zip(&maps)
        .map(|(own, map)| own.row(map, &scanner))
        .collect()
}

impl<'p> Collected<'p> {
    fn new(plan: &'p Plan, retrieval: Option<Retrieval<'p>>) -> Result<Self, Error> {
        let scene = plan.scene();
        let g = &plan.geometry;
        let mut centres = Vec::new();
        if let Some(pair) = &plan.wind.pair {
            for time_s in &g.line_time_s {
                centres.push(pair.vortices(plan.wind.start_s + time_s)?);
            }
        }
        let distance =
            Array2::from_shape_fn((g.elevation_rad.len(), g.gate_range_m.len()), |(i, j)| {
                let elevation_rad = g.elevation_rad[i];
                let range_m = g.gate_range_m[j];
                let y_m = range_m * elevation_rad.cos();
                let z_m = scene.scan.lidar_height_m + range_m * elevation_rad.sin();
                match &scene.flow {
                    Flow::VortexPair(pair) => {
                        let vortices = &centres[i];
                        let distance_m = |vortex: &Vortex| {
                            let below_m = z_m - vortex.height_m;
                            (y_m - vortex.lateral_position_m).hypot(below_m)
                        };
                        distance_m(&vortices[0]).min(distance_m(&vortices[1])) / pair.spacing_m
                    }
                    Flow::Simulated(_) | Flow::Fields(_) => f64::NAN,
                    Flow::Calm {}
                    | Flow::Uniform { .. }
                    | Flow::Linear(_)
                    | Flow::Wind(_)
                    | Flow::Eddies(_) => f64::INFINITY,
                }
            });
        let mut own = Self {
            plan,
            distance,
            retrieval,
            apart: Vec::new(),
            velocity_m_s: Vec::new(),
        };
        let [lines, gates] = shared_cells(plan)?.map(|cells| cells.ceil() as usize);
        let outside = own.cells(OUTSIDE);
        own.apart = if outside.is_empty() {
            own.cells(ALL)
        } else {
            outside
        };
        own.apart
            .retain(|(i, j)| i.is_multiple_of(lines) && j.is_multiple_of(gates));
        Ok(own)
    }

    fn cells(&self, part: Part) -> Vec<(usize, usize)> {
        self.distance
            .indexed_iter()
            .filter(|(_, distance)| part(**distance))
            .map(|(cell, _)| cell)
            .collect()
    }

    /// Standard deviation, bias and root mean square over some cells, each with its standard error, m/s.
    fn averages(&self, map: &VelocityEstimates, part: Part) -> [f64; 6] {
        let a = CellAverage::over(map, &self.cells(part));
        let [bias, std] = [
            [a.bias_m_s, a.bias_standard_error_m_s],
            [a.std_m_s, a.std_standard_error_m_s],
        ];
        [
            std[0],
            std[1],
            bias[0],
            bias[1],
            a.rms_m_s,
            a.standard_error_m_s,
        ]
    }

    /// Whether standard errors over the map or a part of it are an order of magnitude only: outliers
    /// are likely to be missing by chance, or there are too few estimates.
    fn has_rough_errors(&self, map: &VelocityEstimates) -> bool {
        let scans = map.scans.len();
        let flagged = map.flagged.sum() * scans as f64;
        let few_outliers = flagged > 0.5 && flagged < LEAST_FLAGGED;
        if few_outliers {
            return true;
        }
        for part in [ALL, INSIDE, OUTSIDE] {
            let mut cells = self.cells(part);
            cells.retain(|cell| map.rms_m_s[*cell].is_finite());
            if (1..LEAST_ESTIMATES).contains(&(cells.len() * scans)) {
                return true;
            }
        }
        false
    }

    fn row(&self, map: &VelocityEstimates, scanner: &Scanner<'_>) -> Result<Vec<f64>, Error> {
        let plan = self.plan;
        let scene = self.plan.scene();
        let middle =
            ScanMiddle::of(plan, None, Some(scanner)).ok_or(wakescope_estimate::Error::Empty {
                field: "layers of a line",
            })?;
        let has_bound = scene.detector.noise != NoiseModel::None;
        let bound_m_s = if has_bound {
            bound_in_the_middle(plan, scanner)?.region_m_s
        } else {
            f64::NAN
        };
        let filter = range_filter(plan)?;
        let mut out = vec![
            middle.snr_db,
            filter.full_width_half_maximum_m(),
            filter.standard_deviation_m(),
            bound_m_s,
        ];
        for part in [ALL, INSIDE, OUTSIDE] {
            out.extend(self.averages(map, part));
        }
        out.extend(flagged_fraction(map));
        out.push(f64::from(u8::from(self.has_rough_errors(map))));
        let mut errors_m_s = Vec::with_capacity(self.velocity_m_s.len());
        let scans = self.velocity_m_s.chunks(self.apart.len().max(1));
        for (realisation, scan) in scans.enumerate() {
            let truth = map.gate_truth_m_s(realisation);
            for (velocity_m_s, cell) in scan.iter().zip(&self.apart) {
                let truth_m_s = truth[*cell];
                if truth_m_s.is_finite() {
                    errors_m_s.push(velocity_m_s - truth_m_s);
                }
            }
        }
        out.extend(bad_fraction(plan, &errors_m_s)?);
        out.extend(
            self.retrieval
                .as_ref()
                .map_or([f64::NAN; 6], Retrieval::result),
        );
        Ok(out)
    }
}

/// Moment of the squared weights of a window about its first sample.
fn moment(window: &[f64], power: i32) -> f64 {
    let weighted = window.iter().enumerate();
    weighted.map(|(n, h)| h * h * (n as f64).powi(power)).sum()
}

/// Part of the estimates that say nothing of the air, and its standard error: those farther from it than any part of a peak, and
/// as many of the others as a level floor over the band has there.
fn bad_fraction(plan: &Plan, errors_m_s: &[f64]) -> Result<[f64; 2], Error> {
    let scene = plan.scene();
    let pulse = &plan.instrument.pulse;
    let window = scene.weighting().weights(scene.estimator.window_samples)?;
    let mean = moment(&window, 1) / moment(&window, 0);
    let variance = moment(&window, 2) / moment(&window, 0) - mean * mean;
    let window_s = variance.max(1.0 / 12.0).sqrt() / scene.detector.sampling_hz;
    // A window cannot be narrower in frequency than the inverse of its length.
    let width_hz = pulse
        .spectral_width_hz()
        .hypot(0.25 * std::f64::consts::FRAC_1_PI / window_s);
    let part = (2.0 * BEYOND_WIDTHS * width_hz / scene.detector.bandwidth_hz).min(0.9);
    let limit_m_s = 0.25 * scene.laser.wavelength_m * scene.detector.bandwidth_hz * part;
    let of = errors_m_s.len() as f64;
    let share = 1.0 - part;
    let beyond = errors_m_s
        .iter()
        .filter(|error| error.is_nan() || error.abs() > limit_m_s)
        .count() as f64
        / of;
    Ok([
        (beyond / share).min(1.0),
        error_of_fraction(beyond, of) / share,
    ])
}

/// Whether a cell at a distance of a centre, over the spacing, is among those about which a column speaks.
type Part = fn(f64) -> bool;
const ALL: Part = |_| true;
const INSIDE: Part = |distance| distance < INSIDE_PART;
const OUTSIDE: Part = |distance| distance > OUTSIDE_PART;
