//! The radial-velocity map: estimates of every realisation, and their errors against the truth.

use crate::Error;
use crate::measure::error_law::{ErrorLaw, ScanErrors, range_filter, shared_cells};
use crate::measure::map_estimator::{self, MapEstimator, NoiseAtPoints};
use crate::measure::scan::Scanner;
use crate::plan::{Plan, Stage};
use crate::scene::DetectorSignal;
use crate::setup::air::radial_velocity_m_s;
use crate::setup::progress::Observer;
use crate::setup::region::places;
use ndarray::{Array2, ArrayView1, ArrayView2};
use num_complex::Complex;
use wakescope_estimate::{
    Scan, Statistic,
    map::{ErrorMap, MapPoint, PolarPoint, ScanGeometry, ScanSums},
    polar_points,
    window::Sample,
};
use wakescope_signal::RangeFilter;
use wakescope_signal::digitise::Clipped;

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
    /// Standard deviation of `v_pulse_m_s` over the pulses of a line, m/s, where they have airs of their own: it widens spectra.
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

/// Sums over the realisations of what an estimator says beside the velocity.
struct Figures {
    flagged: Array2<f64>,
    count: Array2<f64>,
    /// Sum and number of the finite values: power in the band, its gain, quality, resolution.
    sums: [Array2<(f64, f64)>; 4],
    /// Number, sum and sum of squares of the spreads that are known.
    spreads: Array2<[f64; 3]>,
}

impl Figures {
    fn new(shape: (usize, usize)) -> Self {
        let sums = || Array2::from_elem(shape, (0.0, 0.0));
        Self {
            flagged: Array2::zeros(shape),
            count: Array2::zeros(shape),
            sums: [sums(), sums(), sums(), sums()],
            spreads: Array2::from_elem(shape, [0.0; 3]),
        }
    }

    fn add(&mut self, place: (usize, usize), point: &MapPoint, is_flagged: bool, gain: f64) {
        let e = &point.estimate;
        self.flagged[place] += f64::from(u8::from(is_flagged));
        self.count[place] += f64::from(u8::from(e.velocity_m_s.is_finite()));
        let power_a2 = if e.velocity_m_s.is_finite() { e.power } else { f64::NAN };
        for (sums, value) in self.sums.iter_mut().zip([power_a2, gain, e.quality, e.resolution_m2_s2]) {
            if value.is_finite() {
                sums[place].0 += value;
                sums[place].1 += 1.0;
            }
        }
        let spread = e.spread_m2_s2;
        if spread.is_finite() && !is_flagged {
            self.spreads[place].iter_mut().zip([1.0, spread, spread * spread]).for_each(|(sum, term)| *sum += term);
        }
    }

    fn means(&self) -> [Array2<f64>; 4] {
        self.sums.each_ref().map(|sums| sums.mapv(|(sum, count)| if count > 0.0 { sum / count } else { f64::NAN }))
    }
}

/// Accumulates the errors of realisation after realisation.
pub(crate) struct Mapper<S> {
    estimator: MapEstimator<S>,
    places: ScanGeometry,
    points: Vec<PolarPoint>,
    shape: (usize, usize),
    /// Real numbers that the converter sees in one realisation.
    samples_of_realisation: f64,
    noise: NoiseAtPoints,
    truth: Truth,
    first_m_s: Array2<f64>,
    errors: ErrorMap<ndarray::Ix2>,
    figures: Figures,
    level: Array2<f64>,
    n_eff: Array2<f64>,
    clipped: Clipped,
    samples: f64,
    realisations: usize,
    /// The errors of each realisation.
    scans: Vec<ScanErrors>,
}

struct Truth {
    spread_m_s: Option<Array2<f64>>,
    exact_m_s: Array2<f64>,
    pulse_m_s: Array2<f64>,
    gate_m_s: Array2<f64>,
}

impl<S: Sample> Mapper<S> {
    pub(crate) fn new(plan: &Plan, scanner: &Scanner<'_>) -> Result<Self, Error> {
        let (scene, g) = (&plan.scene.scene, &plan.geometry);
        let shape = (g.elevation_rad.len(), g.gate_range_m.len());
        let places = places(scene, g)?;
        let estimator = MapEstimator::new(plan, &scanner.layer_snr(), &places)?;
        let points = polar_points(places.line_elevation_rad(), &g.gate_range_m);
        Ok(Self {
            noise: estimator.noise(&places, &points)?,
            estimator,
            places,
            points,
            shape,
            samples_of_realisation: (scanner.pulses() * g.samples * S::KIND.lag_numbers(1)) as f64,
            truth: truth(plan, scanner)?,
            first_m_s: Array2::from_elem(shape, f64::NAN),
            errors: ErrorMap::new(ndarray::Dim(shape)),
            figures: Figures::new(shape),
            level: Array2::zeros(shape),
            n_eff: Array2::zeros(shape),
            clipped: Clipped::default(),
            samples: 0.0,
            realisations: 0,
            scans: Vec::new(),
        })
    }

    /// The sums of a realisation, still without any record.
    fn sums(&self) -> Result<ScanSums<'_, S, dyn Statistic<S>>, Error> {
        self.estimator.sums(self.places.clone())
    }

    /// Estimates the velocities of one realisation and adds their errors; returns the velocities, m/s.
    pub(crate) fn add(&mut self, scan: &Scan, clipped: Clipped) -> Result<Array2<f64>, Error> {
        let map = self.estimator.map(scan, &self.points)?;
        let columns = self.shape.1;
        let velocity = Array2::from_shape_fn(self.shape, |(i, j)| map[i * columns + j].estimate.velocity_m_s);
        self.errors.add(velocity.view(), self.truth.pulse_m_s.view())?;
        if self.realisations == 0 {
            let known = |estimate: &f64, truth: &f64| if truth.is_nan() { f64::NAN } else { *estimate };
            self.first_m_s = ndarray::Zip::from(&velocity).and(&self.truth.pulse_m_s).map_collect(known);
        }
        let mut flagged = Array2::from_elem(self.shape, false);
        for (index, point) in map.iter().enumerate() {
            let place = (index / columns, index % columns);
            flagged[place] = self.noise.flags(index, &point.estimate);
            self.figures.add(place, point, flagged[place], self.estimator.gain(point.estimate.velocity_m_s));
            // The level is the same for all realisations: a matter of geometry.
            (self.level[place], self.n_eff[place]) = (point.level as f64, point.n_eff);
        }
        self.scans.push(ScanErrors { error_m_s: &velocity - &self.truth.pulse_m_s, flagged });
        self.clipped += clipped;
        self.samples += self.samples_of_realisation;
        self.realisations += 1;
        Ok(velocity)
    }

    pub(crate) fn finish(self, plan: &Plan) -> Result<VelocityEstimates, Error> {
        let statistics = self.errors.statistics();
        let bias_m_s = statistics.mapv(|s| s.bias_m_s);
        let [power_a2, gain, quality, resolution] = self.figures.means();
        let law = ErrorLaw::new(&self.scans, shared_cells(plan)?);
        let noise_a2 = self.estimator.noise_power_a2();
        let mut snr_db = power_a2;
        for (index, (place, power)) in snr_db.indexed_iter_mut().enumerate() {
            let (ratio, deviation) = (*power / noise_a2, self.noise.deviation(index));
            *power = map_estimator::snr_db(ratio, gain[place], deviation, self.figures.count[place]);
        }
        let mut width_m_s = resolution;
        for (place, width) in width_m_s.indexed_iter_mut() {
            let kept = self.realisations as f64 - self.figures.flagged[place];
            *width = match self.figures.spreads[place] {
                // what only some of the estimates show is not the mean of all
                [count, sum, squares] if count > 0.9 * kept => {
                    let mean = sum / count;
                    let variance = (squares / count - mean * mean).max(0.0) / (count - 1.0).max(1.0);
                    let snr = if noise_a2.is_nan() { f64::INFINITY } else { 10f64.powf(0.1 * snr_db[place]) };
                    map_estimator::width_m_s(mean, variance.sqrt(), *width, snr)
                }
                _ => f64::NAN,
            };
        }
        let radius_m = plan.geometry.gate_range_m.iter().map(|range_m| self.estimator.radius_m(*range_m));
        Ok(VelocityEstimates {
            elevation_rad: plan.geometry.elevation_rad.clone(),
            range_m: plan.geometry.gate_range_m.clone(),
            radius_m: radius_m.collect::<Result<_, _>>()?,
            v_scan_m_s: self.first_m_s,
            v_mean_m_s: &self.truth.pulse_m_s + &bias_m_s,
            bias_m_s,
            std_m_s: statistics.mapv(|s| s.std_m_s),
            rms_m_s: statistics.mapv(|s| s.rms_m_s),
            standard_error_m_s: law
                .as_ref()
                .map_or(Array2::from_elem(self.shape, f64::NAN), ErrorLaw::rms_standard_errors),
            v_exact_m_s: self.truth.exact_m_s,
            v_pulse_m_s: self.truth.pulse_m_s,
            v_gate_m_s: self.truth.gate_m_s,
            v_spread_m_s: self.truth.spread_m_s,
            level: self.level,
            n_eff: self.n_eff,
            flagged: self.figures.flagged / self.realisations.max(1) as f64,
            count: self.figures.count,
            width_m_s,
            snr_db,
            quality,
            clipped_fraction: self.clipped.total() as f64 / self.samples.max(1.0),
            scans: self.scans,
            law,
        })
    }
}

fn truth(plan: &Plan, scanner: &Scanner<'_>) -> Result<Truth, Error> {
    let g = &plan.geometry;
    let shape = (g.elevation_rad.len(), g.gate_range_m.len());
    let zeros = || Array2::zeros(shape);
    let spread_m_s = scanner.spread_m_s().cloned();
    let mut truth = Truth { spread_m_s, exact_m_s: zeros(), pulse_m_s: zeros(), gate_m_s: zeros() };
    let pulse = &plan.instrument.pulse;
    let by_pulse = RangeFilter::pulse(pulse, g.layer_thickness_m)?;
    let by_gate = range_filter(plan)?;
    for i in 0..scanner.lines().len() {
        let exact_m_s = radial_velocity_m_s(plan, i, &g.gate_range_m)?;
        truth.exact_m_s.row_mut(i).assign(&ArrayView1::from(&exact_m_s));
        let mut filtered_m_s = vec![0.0; g.gate_range_m.len()];
        for (filter, cells) in [(&by_pulse, &mut truth.pulse_m_s), (&by_gate, &mut truth.gate_m_s)] {
            scanner.seen_into(filter, g, i, &mut filtered_m_s)?;
            cells.row_mut(i).assign(&ArrayView1::from(&filtered_m_s));
        }
    }
    Ok(truth)
}

/// Runs the estimates of all realisations, of several plans that differ in their estimators alone: the signals of each are made
/// once. The records of those that the files will have go to `kept`, too, piece after piece; `seen` is given the place of the plan
/// and the velocities, m/s, of each map as it comes.
pub(crate) fn estimates<S: Sample + wakescope_signal::Sample>(
    plans: &[&Plan],
    scanner: &Scanner<'_>,
    observer: &dyn Observer,
    mut kept: impl FnMut(ArrayView2<'_, S>),
    mut seen: impl FnMut(usize, &Array2<f64>),
) -> Result<Vec<VelocityEstimates>, Error> {
    let Some(plan) = plans.first() else { return Ok(Vec::new()) };
    let mut mappers: Vec<Mapper<S>> = plans.iter().map(|plan| Mapper::new(plan, scanner)).collect::<Result<_, _>>()?;
    observer.begin(Stage::Estimates, (plan.realisations() * plan.geometry.elevation_rad.len()) as u64);
    for realisation in 0..plan.realisations() {
        let mut sums = mappers.iter().map(Mapper::sums).collect::<Result<Vec<_>, _>>()?;
        let clipped = scanner.in_pieces(realisation, observer, |first, records| {
            if realisation < plan.kept_realisations() {
                kept(records);
            }
            Ok(sums.iter_mut().try_for_each(|sums| sums.add(first, records))?)
        })?;
        let scans: Vec<Scan> = sums.into_iter().map(ScanSums::finish).collect();
        for (i, (mapper, scan)) in mappers.iter_mut().zip(&scans).enumerate() {
            seen(i, &mapper.add(scan, clipped)?);
        }
    }
    observer.end();
    mappers.into_iter().zip(plans).map(|(mapper, plan)| mapper.finish(plan)).collect()
}

/// The radial velocities \[line, gate\], m/s, of each realisation of a plan: what whole scans show, one after the other. Efficiency and
/// lines are made once for all of them.
///
/// # Errors
/// What the crates refuse; a checked scene gives none.
pub fn velocities(plan: &Plan, observer: &dyn Observer) -> Result<Vec<Array2<f64>>, Error> {
    let scanner = Scanner::new(plan, observer)?;
    let mut maps = Vec::with_capacity(plan.realisations());
    of_plans(&[plan], &scanner, observer, |_, velocity_m_s| maps.push(velocity_m_s.clone()))?;
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
    seen: impl FnMut(usize, &Array2<f64>),
) -> Result<Vec<VelocityEstimates>, Error> {
    let Some(first) = plans.first() else { return Ok(Vec::new()) };
    match first.scene.scene.detector.signal {
        DetectorSignal::IntermediateFrequency => estimates::<f64>(plans, scanner, observer, |_| (), seen),
        DetectorSignal::Baseband => estimates::<Complex<f64>>(plans, scanner, observer, |_| (), seen),
    }
}

/// What takes the records of pulses from a number on.
pub(crate) type AddRecords<'a, S> = &'a mut dyn FnMut(usize, ArrayView2<'_, S>) -> Result<(), Error>;

/// The estimates of a plan from records that `read` hands over for each realisation, piece after piece.
pub(crate) fn of_records<S: Sample>(
    plan: &Plan,
    scanner: &Scanner<'_>,
    mut read: impl FnMut(usize, AddRecords<'_, S>) -> Result<(), Error>,
) -> Result<VelocityEstimates, Error> {
    let mut mapper = Mapper::<S>::new(plan, scanner)?;
    for realisation in 0..plan.realisations() {
        let mut sums = mapper.sums()?;
        read(realisation, &mut |first, records| Ok(sums.add(first, records)?))?;
        let scan = sums.finish();
        mapper.add(&scan, Clipped::default())?;
    }
    mapper.finish(plan)
}
