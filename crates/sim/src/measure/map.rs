//! The radial-velocity map: estimates of every realisation, and their errors against the truth.

use crate::Error;
use crate::measure::accumulation::{draws_products, lags_per_window};
use crate::measure::error_law::{ErrorLaw, ScanErrors, shared_cells};
use crate::measure::gate_estimates::GateSums;
use crate::measure::map_estimator::{MapEstimator, PointNoise, WindowSums};
use crate::measure::ray_information::range_filter;
use crate::measure::region::places;
use crate::measure::scan::products::LineDraws;
use crate::measure::scan::{ScanAir, Scanner};
use crate::plan::line_wind::{radial_velocity_m_s, weighted_at_gates_m_s};
use crate::plan::{Plan, Stage};
use crate::progress::Observer;
use crate::scene::DetectorSignal;
use ndarray::{Array1, Array2, ArrayView2};
use num_complex::Complex;
use wakescope_estimate::{
    Scan,
    map::{ErrorStatistics, PolarPoint, ScanGeometry, ScanSums},
    window::Sample,
};
use wakescope_signal::RangeFilter;

/// Estimates of the radial velocity and their errors, each \[line, gate\].
#[derive(Debug, Clone, Default, PartialEq)]
pub struct VelocityEstimates {
    /// Elevation of each line, rad.
    pub elevation_rad: Vec<f64>,
    /// Range of each gate, m.
    pub range_m: Vec<f64>,
    /// Radius of the region of each gate, m.
    pub radius_m: Vec<f64>,
    /// Radial velocity of the air at the centre of the gate, m/s, positive away from the lidar.
    pub v_exact_m_s: Array2<f64>,
    /// The same weighted with the pulse, (28).
    pub v_pulse_m_s: Array2<f64>,
    /// The same weighted with pulse and window.
    pub v_gate_m_s: Array2<f64>,
    /// Standard deviation of `v_pulse_m_s` over the pulses of a line, m/s, where they have winds of their own: it widens spectra.
    pub v_spread_m_s: Option<Array2<f64>>,
    /// Estimate of the first realisation, m/s; NaN where there is no true velocity, as in the mean.
    pub v_scan_m_s: Array2<f64>,
    /// Mean estimate over the realisations, m/s.
    pub v_mean_m_s: Array2<f64>,
    /// Mean error against `v_pulse_m_s`, m/s.
    pub bias_m_s: Array2<f64>,
    /// Standard deviation of one realisation, m/s; NaN for one realisation.
    pub std_m_s: Array2<f64>,
    /// Root mean square error against `v_pulse_m_s`, m/s: the root of the mean of (33).
    pub rms_m_s: Array2<f64>,
    /// Standard error of `rms_m_s`, m/s, by the law of the errors of the map; NaN for one realisation.
    pub standard_error_m_s: Array2<f64>,
    /// Windows accumulated for one estimate.
    pub level: Array2<f64>,
    /// Independent windows that they are worth.
    pub n_eff: Array2<f64>,
    /// Fraction of the realisations whose estimate was flagged: a flag of its own, or a peak that does not stand out of noise.
    pub flagged: Array2<f64>,
    /// Realisations with a velocity, flagged ones included.
    pub count: Array2<f64>,
    /// Spectral width of air and pulse, m/s, without what the method adds: the root of its mean square over the realisations that are
    /// not flagged. NaN where that does not stand out of its error, and where the method shows none.
    pub width_m_s: Array2<f64>,
    /// Signal-to-noise ratio in the detector band, dB: the excess of the mean power of the spectra in the band over that which the noise
    /// alone has there, over that power, times the mean of what the windows keep of the noise over what they keep of a signal of the
    /// estimated velocity. Unbiased at any ratio; NaN where the excess is below twice its standard deviation, and without noise.
    pub snr_db: Array2<f64>,
    /// Mean density of the peak over the mean density in the band; 1 for a flat spectrum.
    pub quality: Array2<f64>,
    /// Fraction of the samples that the converter clipped.
    pub clipped_fraction: f64,
    /// The errors of each realisation.
    pub scans: Vec<ScanErrors>,
    /// What they say of the law of the errors; nothing of one realisation.
    pub law: Option<ErrorLaw>,
}

impl VelocityEstimates {
    /// True velocities of a realisation weighted with the pulse, m/s.
    pub(crate) fn pulse_truth_m_s(&self, realisation: usize) -> &Array2<f64> {
        self.own_truth_m_s(realisation)
            .map_or(&self.v_pulse_m_s, |[pulse_m_s, _]| pulse_m_s)
    }

    /// True velocities of a realisation weighted with pulse and window, m/s.
    pub(crate) fn gate_truth_m_s(&self, realisation: usize) -> &Array2<f64> {
        self.own_truth_m_s(realisation)
            .map_or(&self.v_gate_m_s, |[_, gate_m_s]| gate_m_s)
    }

    fn own_truth_m_s(&self, realisation: usize) -> Option<&[Array2<f64>; 2]> {
        self.scans.get(realisation)?.own_truth_m_s.as_ref()
    }
}

/// The map of one realisation.
pub(crate) struct RealisationMap<'a> {
    /// Index of its plan among those that are measured together.
    pub(crate) plan: usize,
    /// Radial velocities \[line, gate\], m/s.
    pub(crate) velocity_m_s: &'a Array2<f64>,
    /// Sums over the windows of its records.
    pub(crate) scan: &'a Scan,
    /// The gates, the lines one after the other, and the radius of the region of each gate of a line, m.
    pub(crate) points: &'a [PolarPoint],
    pub(crate) radius_m: &'a [f64],
    /// Spectral density of the noise, A^2; NaN without noise.
    pub(crate) noise_density_a2: f64,
}

/// Accumulates the errors of realisation after realisation.
struct Mapper<'p, S> {
    estimator: MapEstimator<'p, S>,
    places: ScanGeometry,
    points: Vec<PolarPoint>,
    noise: Vec<PointNoise>,
    /// The truth, the first realisation, and the errors of each.
    map: VelocityEstimates,
    gates: Array2<GateSums>,
}

impl<'p, S: Sample> Mapper<'p, S> {
    fn new(plan: &'p Plan, scanner: &Scanner<'_>) -> Result<Self, Error> {
        let scene = plan.scene();
        let g = &plan.geometry;
        let shape = (g.elevation_rad.len(), g.gate_range_m.len());
        let places = places(scene, g)?;
        let estimator = MapEstimator::new(plan, &scanner.layer_snr(), &places)?;
        let points = places.points(&g.gate_range_m);
        let radius_m = g
            .gate_range_m
            .iter()
            .map(|range_m| estimator.radius.at_m(*range_m));
        let map = VelocityEstimates {
            elevation_rad: g.elevation_rad.clone(),
            range_m: g.gate_range_m.clone(),
            radius_m: radius_m.collect::<Result<_, _>>()?,
            ..truth(plan, &scanner.air, shape)?
        };
        Ok(Self {
            noise: estimator.noise(&places, &points)?,
            estimator,
            places,
            points,
            map,
            gates: Array2::default(shape),
        })
    }

    /// Estimates the velocities of one realisation and adds their errors against its own air, or else that of all; returns the
    /// velocities, m/s.
    fn add(
        &mut self,
        plan: &Plan,
        scan: &Scan,
        own: Option<&ScanAir>,
    ) -> Result<Array2<f64>, Error> {
        let found = self.estimator.gates(scan, &self.points, &self.noise)?;
        let map = &mut self.map;
        let shape = self.gates.dim();
        let own = own.map(|air| truth(plan, air, shape)).transpose()?;
        let own_truth_m_s = own.map(|truth| [truth.v_pulse_m_s, truth.v_gate_m_s]);
        let velocity = Array2::from_shape_fn(shape, |(i, j)| {
            found[i * shape.1 + j].found.estimate.velocity_m_s
        });
        let truth_m_s = own_truth_m_s
            .as_ref()
            .map_or(&map.v_pulse_m_s, |[pulse_m_s, _]| pulse_m_s);
        let error_m_s = &velocity - truth_m_s;
        if map.scans.is_empty() {
            let known =
                |estimate: &f64, truth: &f64| if truth.is_nan() { f64::NAN } else { *estimate };
            map.v_scan_m_s = ndarray::Zip::from(&velocity)
                .and(&map.v_pulse_m_s)
                .map_collect(known);
        }
        let mut flagged = Array2::from_elem(shape, false);
        for ((sums, flagged), found) in self.gates.iter_mut().zip(&mut flagged).zip(&found) {
            *flagged = sums.add(found, 1.0);
        }
        map.scans.push(ScanErrors {
            error_m_s,
            flagged,
            own_truth_m_s,
        });
        Ok(velocity)
    }

    /// `clipped_fraction` is that of the samples that the converter clipped.
    fn finish(self, plan: &Plan, clipped_fraction: f64) -> Result<VelocityEstimates, Error> {
        let Self { mut map, gates, .. } = self;
        let statistics = Array2::from_shape_fn(gates.dim(), |cell| {
            ErrorStatistics::of(map.scans.iter().map(|scan| scan.error_m_s[cell]))
        });
        let noise_a2 = self.estimator.tools.noise.power_a2;
        map.level = gates.map(|gate| gate.level);
        map.n_eff = gates.map(|gate| gate.n_eff);
        map.count = gates.map(|gate| gate.count);
        map.flagged = gates.map(GateSums::flagged);
        map.quality = gates.map(GateSums::quality);
        map.snr_db = gates.map(|gate| gate.snr_db(noise_a2, 1.0));
        map.width_m_s = gates.map(|gate| gate.width_m_s(noise_a2, 1.0));
        map.bias_m_s = statistics.mapv(|s| s.bias_m_s);
        map.v_mean_m_s = &map.v_pulse_m_s + &map.bias_m_s;
        map.std_m_s = statistics.mapv(|s| s.std_m_s);
        map.rms_m_s = statistics.mapv(|s| s.rms_m_s);
        let (low_m_s, high_m_s) = plan.scene().sampling()?.velocity_limits_m_s();
        let half_band_m_s = 0.5 * (high_m_s - low_m_s);
        map.law = ErrorLaw::new(&map.scans, shared_cells(plan)?, half_band_m_s);
        let unknown = || Array2::from_elem(map.count.dim(), f64::NAN);
        map.standard_error_m_s = map
            .law
            .as_ref()
            .map_or_else(unknown, ErrorLaw::rms_standard_errors);
        map.clipped_fraction = clipped_fraction;
        Ok(map)
    }
}

/// The air at the gates, \[line, gate\], and nothing else yet.
fn truth(plan: &Plan, air: &ScanAir, shape: (usize, usize)) -> Result<VelocityEstimates, Error> {
    let g = &plan.geometry;
    let [mut exact_m_s, mut pulse_m_s, mut gate_m_s] = [(); 3].map(|()| Array2::zeros(shape));
    let by_pulse = RangeFilter::pulse(&plan.instrument.pulse, g.layer_thickness_m)?;
    let by_gate = range_filter(plan)?;
    for i in 0..air.lines.len() {
        let at_gates_m_s = exact_at_gates_m_s(plan, air, i)?;
        exact_m_s.row_mut(i).assign(&Array1::from(at_gates_m_s));
        let line = &air.lines[i];
        for (filter, cells) in [(&by_pulse, &mut pulse_m_s), (&by_gate, &mut gate_m_s)] {
            cells.row_mut(i).assign(&Array1::from(weighted_at_gates_m_s(
                filter,
                g,
                &line.radial_velocity_m_s,
            )?));
        }
    }
    Ok(VelocityEstimates {
        v_exact_m_s: exact_m_s,
        v_pulse_m_s: pulse_m_s,
        v_gate_m_s: gate_m_s,
        v_spread_m_s: air.spread_m_s.clone(),
        v_scan_m_s: Array2::from_elem(shape, f64::NAN),
        ..VelocityEstimates::default()
    })
}

/// Radial velocity of the air at the gates of a line, m/s. Where the signals of lines have layers of their own, it is that of the layer
/// at each gate: eddies are summed along a line once.
fn exact_at_gates_m_s(plan: &Plan, air: &ScanAir, line: usize) -> Result<Vec<f64>, Error> {
    let g = &plan.geometry;
    let along = &air.lines[line];
    let mut at_gates_m_s = Vec::with_capacity(g.gate_range_m.len());
    for range_m in &g.gate_range_m {
        let layer = (range_m - along.first_range_m) / along.layer_thickness_m;
        let nearest = layer.round();
        let velocity_m_s = along.radial_velocity_m_s.get(nearest as usize);
        if let (true, Some(velocity_m_s)) = ((layer - nearest).abs() < 1e-6, velocity_m_s) {
            at_gates_m_s.push(*velocity_m_s);
        }
    }
    let is_on_layers = at_gates_m_s.len() == g.gate_range_m.len();
    if plan.scene().has_layers_of_each_line() && is_on_layers {
        return Ok(at_gates_m_s);
    }
    radial_velocity_m_s(plan, &air.wind, line, &g.gate_range_m)
}

/// Runs the estimates of all realisations, of several plans that differ in their estimators alone: the signals of each are made
/// once. The records of those that the files will have go to `kept`, too, piece after piece; `seen` is given each map as
/// it comes.
pub(crate) fn estimates<S: Sample + wakescope_signal::Sample>(
    plans: &[&Plan],
    scanner: &Scanner<'_>,
    observer: &dyn Observer,
    mut kept: impl FnMut(ArrayView2<'_, S>),
    seen: impl FnMut(&RealisationMap<'_>),
) -> Result<Vec<VelocityEstimates>, Error> {
    let kept_realisations = plans.first().map_or(0, |plan| plan.kept_realisations());
    if plans.iter().all(|plan| draws_products(plan)) {
        let realisations = plans.first().map_or(0, |plan| plan.realisations());
        let lags = plans.iter().map(|plan| lags_per_window(plan)).max();
        let draws = LineDraws::<S>::new(scanner, lags.unwrap_or(0), realisations)?;
        let drawn = |realisation: usize, sums: &mut [WindowSums<'_, S>]| {
            draws.in_pieces(realisation, observer, |first_line, products| {
                Ok(sums
                    .iter_mut()
                    .try_for_each(|sums| sums.add_products(first_line, products))?)
            })?;
            Ok(0)
        };
        return of_sums(plans, scanner, observer, drawn, seen);
    }
    let simulated = |realisation: usize, sums: &mut [WindowSums<'_, S>]| {
        scanner.in_pieces(realisation, observer, |first, records| {
            if realisation < kept_realisations {
                kept(records);
            }
            add_records(sums, first, records)
        })
    };
    of_sums(plans, scanner, observer, simulated, seen)
}

/// Adds the records of pulses from a number on to the sums of every plan.
pub(crate) fn add_records<S: Sample>(
    sums: &mut [WindowSums<'_, S>],
    first: usize,
    records: ArrayView2<'_, S>,
) -> Result<(), Error> {
    for sums in sums {
        sums.add(first, records)?;
    }
    Ok(())
}

/// The same of sums over windows, one of each plan, to which `add` adds all pulses of a realisation; it returns how many samples were
/// clipped.
pub(crate) fn of_sums<S: Sample>(
    plans: &[&Plan],
    scanner: &Scanner<'_>,
    observer: &dyn Observer,
    mut add: impl FnMut(usize, &mut [WindowSums<'_, S>]) -> Result<u64, Error>,
    mut seen: impl FnMut(&RealisationMap<'_>),
) -> Result<Vec<VelocityEstimates>, Error> {
    let Some(plan) = plans.first() else {
        return Ok(Vec::new());
    };
    let mut mappers: Vec<Mapper<'_, S>> = plans
        .iter()
        .map(|plan| Mapper::new(plan, scanner))
        .collect::<Result<_, _>>()?;
    let mut clipped = 0_u64;
    observer.begin(
        Stage::Estimates,
        (plan.realisations() * plan.geometry.elevation_rad.len()) as u64,
    );
    for realisation in 0..plan.realisations() {
        let sums = mappers
            .iter()
            .map(|mapper| mapper.estimator.sums(mapper.places.clone(), None));
        let mut sums = sums.collect::<Result<Vec<_>, _>>()?;
        clipped += add(realisation, &mut sums)?;
        let scans: Vec<Scan> = sums.into_iter().map(ScanSums::finish).collect();
        let own = scanner.own_air(realisation)?;
        for (i, (mapper, scan)) in mappers.iter_mut().zip(&scans).enumerate() {
            let velocity_m_s = mapper.add(plans[i], scan, own.as_ref())?;
            seen(&RealisationMap {
                plan: i,
                velocity_m_s: &velocity_m_s,
                scan,
                points: &mapper.points,
                radius_m: &mapper.map.radius_m,
                noise_density_a2: mapper.estimator.tools.noise.density_a2,
            });
        }
    }
    observer.end();
    // The real numbers that the converter sees.
    let samples =
        plan.realisations() * scanner.pulses() * plan.geometry.samples * S::KIND.lag_numbers(1);
    let clipped_fraction = clipped as f64 / (samples as f64).max(1.0);
    mappers
        .into_iter()
        .zip(plans)
        .map(|(mapper, plan)| mapper.finish(plan, clipped_fraction))
        .collect()
}

/// The radial velocities \[line, gate\], m/s, of each realisation of a plan: what whole scans show, one after the other. Efficiency and
/// lines are made once for all of them.
///
/// # Errors
/// What the crates refuse; a checked scene gives none.
pub fn velocities(plan: &Plan, observer: &dyn Observer) -> Result<Vec<Array2<f64>>, Error> {
    let scanner = Scanner::new(plan, observer)?;
    let mut maps = Vec::with_capacity(plan.realisations());
    of_plans(&[plan], &scanner, observer, |map| {
        maps.push(map.velocity_m_s.clone())
    })?;
    Ok(maps)
}

/// [`estimates()`] of samples of the kind that the scenes have, none of which are kept.
///
/// # Errors
/// As there.
pub(crate) fn of_plans(
    plans: &[&Plan],
    scanner: &Scanner<'_>,
    observer: &dyn Observer,
    seen: impl FnMut(&RealisationMap<'_>),
) -> Result<Vec<VelocityEstimates>, Error> {
    let Some(first) = plans.first() else {
        return Ok(Vec::new());
    };
    match first.scene().detector.signal {
        DetectorSignal::IntermediateFrequency => {
            estimates::<f64>(plans, scanner, observer, |_| (), seen)
        }
        DetectorSignal::Baseband => {
            estimates::<Complex<f64>>(plans, scanner, observer, |_| (), seen)
        }
    }
}
