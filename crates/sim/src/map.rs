//! The radial-velocity map: estimates of every realisation, and their errors against the truth.

use crate::join::{Toolkit, WindowStatistics};
use crate::plan::{Plan, Stage};
use crate::progress::Observer;
use crate::region::{interpolated, region_radius};
use crate::scan::{Scanner, radial_velocity_m_s};
use crate::{Error, join};
use ndarray::{Array2, ArrayView1, ArrayView2};
use wakescope_estimate::{
    ErrorMap, Gates, MapPoint, PolarPoint, Radius, Sample, Sampling, Scan, ScanGeometry, ScanSums, Statistic,
    WindowCorrelation, noise_quality, polar_points,
};
use wakescope_signal::{Clipped, RangeFilter};

/// Estimates of the radial velocity and their errors, each \[line, gate\].
#[derive(Debug, Clone, PartialEq)]
pub struct VelocityEstimates {
    /// Elevation of each line, rad.
    pub elevation_rad: Vec<f64>,
    /// Range of each gate, m.
    pub range_m: Vec<f64>,
    /// Radial velocity of the air at the centre of the gate, m/s, positive away from the lidar.
    pub v_exact_m_s: Array2<f64>,
    /// The same weighted with the pulse, (28).
    pub v_pulse_m_s: Array2<f64>,
    /// The same weighted with pulse and window.
    pub v_gate_m_s: Array2<f64>,
    /// Mean estimate over the realisations, m/s.
    pub v_mean_m_s: Array2<f64>,
    /// Mean error against `v_pulse_m_s`, m/s.
    pub bias_m_s: Array2<f64>,
    /// Standard deviation of one realisation, m/s; NaN for one realisation.
    pub std_m_s: Array2<f64>,
    /// Root mean square error against `v_pulse_m_s`, m/s: the root of the mean of (33).
    pub rms_m_s: Array2<f64>,
    /// Standard error of `rms_m_s`, m/s; NaN for one realisation.
    pub standard_error_m_s: Array2<f64>,
    /// Windows accumulated for one estimate.
    pub level: Array2<f64>,
    /// Independent windows that they are worth.
    pub n_eff: Array2<f64>,
    /// Fraction of the realisations whose estimate was flagged.
    pub flagged: Array2<f64>,
    /// Realisations with a velocity, flagged ones included.
    pub count: Array2<f64>,
    /// Mean spectral width beyond that of the window, m/s; NaN where the estimator gives none.
    pub width_m_s: Array2<f64>,
    /// Signal-to-noise ratio in the detector band that the spectra show, of the mean power ratio, dB; NaN where there is none.
    pub snr_db: Array2<f64>,
    /// Mean density of the peak over the mean density in the band; 1 for a flat spectrum.
    pub quality: Array2<f64>,
    /// Fraction of the samples that the converter clipped.
    pub clipped_fraction: f64,
}

/// Sums over the realisations of what an estimator says beside the velocity.
struct Figures {
    flagged: Array2<f64>,
    count: Array2<f64>,
    /// Sum and number of the finite values: width, power ratio, quality.
    sums: [Array2<(f64, f64)>; 3],
}

impl Figures {
    fn new(shape: (usize, usize)) -> Self {
        let sums = || Array2::from_elem(shape, (0.0, 0.0));
        Self { flagged: Array2::zeros(shape), count: Array2::zeros(shape), sums: [sums(), sums(), sums()] }
    }

    fn add(&mut self, place: (usize, usize), point: &MapPoint, is_flagged: bool) {
        let e = &point.estimate;
        self.flagged[place] += f64::from(u8::from(is_flagged));
        self.count[place] += f64::from(u8::from(e.velocity_m_s.is_finite()));
        for (sums, value) in self.sums.iter_mut().zip([e.width_m_s, e.snr, e.quality]) {
            if value.is_finite() {
                sums[place].0 += value;
                sums[place].1 += 1.0;
            }
        }
    }

    fn means(&self) -> [Array2<f64>; 3] {
        self.sums.each_ref().map(|sums| sums.mapv(|(sum, count)| if count > 0.0 { sum / count } else { f64::NAN }))
    }
}

/// Accumulates the errors of realisation after realisation.
pub(crate) struct Mapper<S> {
    sampling: Sampling,
    gates: Gates,
    points: Vec<PolarPoint>,
    shape: (usize, usize),
    places: ScanGeometry,
    record_samples: usize,
    /// Real numbers that the converter sees in one realisation.
    samples_of_realisation: f64,
    tools: Toolkit<S>,
    correlation: WindowCorrelation,
    radius: Radius,
    /// Probability that noise passes for a signal, and independent frequencies of the band.
    detection: Option<(f64, f64)>,
    truth: Truth,
    errors: ErrorMap<ndarray::Ix2>,
    figures: Figures,
    level: Array2<f64>,
    n_eff: Array2<f64>,
    clipped: Clipped,
    samples: f64,
    realisations: usize,
}

struct Truth {
    exact_m_s: Array2<f64>,
    pulse_m_s: Array2<f64>,
    gate_m_s: Array2<f64>,
}

impl<S: Sample + wakescope_signal::Sample> Mapper<S> {
    pub(crate) fn new(plan: &Plan, scanner: &Scanner<'_>) -> Result<Self, Error> {
        let (scene, g) = (&plan.scene.scene, &plan.geometry);
        let (sampling, gates) = (join::sampling(scene)?, join::gates(scene)?);
        let shape = (g.elevation_rad.len(), g.gate_range_m.len());
        let pulses = scene.scan.pulses_per_line;
        let correlation = join::window_correlation(scene, scanner.mean_snr())?;
        let places = ScanGeometry::regular(&sampling, &gates, &g.elevation_rad, pulses, g.samples)?;
        let radius = region_radius(scene, scanner, &places, &correlation)?;
        let middle = PolarPoint {
            range_m: g.gate_range_m[g.gate_range_m.len() / 2],
            elevation_rad: g.elevation_rad[g.elevation_rad.len() / 2],
        };
        let n_eff = places.level(middle, radius.at_m(middle.range_m)?, &correlation).1;
        let known = WindowStatistics { snr: scanner.mean_snr(), n_eff };
        let cells = scene.detector.bandwidth_hz * scene.estimator.window_samples as f64 / scene.detector.sampling_hz;
        Ok(Self {
            sampling,
            gates,
            points: polar_points(&g.elevation_rad, &g.gate_range_m),
            shape,
            places,
            record_samples: g.samples,
            samples_of_realisation: (scanner.pulses() * g.samples * S::KIND.lag_numbers(1)) as f64,
            tools: Toolkit::new(scene, &known)?,
            correlation,
            radius,
            detection: scene.estimator.false_alarm.map(|rate| (rate, cells)),
            truth: truth(plan, scanner)?,
            errors: ErrorMap::new(ndarray::Dim(shape)),
            figures: Figures::new(shape),
            level: Array2::zeros(shape),
            n_eff: Array2::zeros(shape),
            clipped: Clipped::default(),
            samples: 0.0,
            realisations: 0,
        })
    }

    /// Estimates the velocities of one realisation.
    fn map(&self, scan: &Scan) -> Result<Vec<MapPoint>, Error> {
        let Toolkit { estimator, following, .. } = &self.tools;
        let first = scan.map(&self.points, &self.radius, Some(&self.correlation), &**estimator)?;
        let Some(following) = following else { return Ok(first) };
        let velocity_m_s =
            Array2::from_shape_fn(self.shape, |(i, j)| first[i * self.shape.1 + j].estimate.velocity_m_s);
        let guess = interpolated(&self.points, velocity_m_s);
        let mut second =
            scan.map_following(&self.points, &self.radius, S::KIND, &self.sampling, &guess, &**following)?;
        second.iter_mut().zip(&first).for_each(|(point, first)| point.n_eff = first.n_eff);
        Ok(second)
    }

    /// The sums of a realisation, still without any record.
    fn sums(&self) -> Result<ScanSums<'_, S, dyn Statistic<S>>, Error> {
        Ok(ScanSums::new(&*self.tools.statistic, &self.gates, self.places.clone(), self.record_samples)?)
    }

    /// Estimates the velocities of one realisation and adds their errors.
    pub(crate) fn add(&mut self, scan: &Scan, clipped: Clipped) -> Result<(), Error> {
        let map = self.map(scan)?;
        let columns = self.shape.1;
        let velocity = Array2::from_shape_fn(self.shape, |(i, j)| map[i * columns + j].estimate.velocity_m_s);
        self.errors.add(velocity.view(), self.truth.pulse_m_s.view())?;
        for (index, point) in map.iter().enumerate() {
            let place = (index / columns, index % columns);
            let is_flagged = match self.detection {
                Some((rate, cells)) if point.estimate.is_good() => {
                    let threshold = noise_quality(point.n_eff.max(1e-3), cells, rate)?;
                    !point.estimate.exceeds(threshold)
                }
                _ => !point.estimate.is_good(),
            };
            self.figures.add(place, point, is_flagged);
            // The level is the same for all realisations: a matter of geometry.
            (self.level[place], self.n_eff[place]) = (point.level as f64, point.n_eff);
        }
        self.clipped += clipped;
        self.samples += self.samples_of_realisation;
        self.realisations += 1;
        Ok(())
    }

    pub(crate) fn finish(self, plan: &Plan) -> VelocityEstimates {
        let statistics = self.errors.statistics();
        let bias_m_s = statistics.mapv(|s| s.bias_m_s);
        let [width_m_s, snr, quality] = self.figures.means();
        VelocityEstimates {
            elevation_rad: plan.geometry.elevation_rad.clone(),
            range_m: plan.geometry.gate_range_m.clone(),
            v_mean_m_s: &self.truth.pulse_m_s + &bias_m_s,
            bias_m_s,
            std_m_s: statistics.mapv(|s| s.std_m_s),
            rms_m_s: statistics.mapv(|s| s.rms_m_s),
            standard_error_m_s: statistics.mapv(|s| s.rms_standard_error_m_s),
            v_exact_m_s: self.truth.exact_m_s,
            v_pulse_m_s: self.truth.pulse_m_s,
            v_gate_m_s: self.truth.gate_m_s,
            level: self.level,
            n_eff: self.n_eff,
            flagged: self.figures.flagged / self.realisations.max(1) as f64,
            count: self.figures.count,
            width_m_s,
            snr_db: snr.mapv(|snr| if snr > 0.0 { 10.0 * snr.log10() } else { f64::NAN }),
            quality,
            clipped_fraction: self.clipped.total() as f64 / self.samples.max(1.0),
        }
    }
}

fn truth(plan: &Plan, scanner: &Scanner<'_>) -> Result<Truth, Error> {
    let (scene, g) = (&plan.scene.scene, &plan.geometry);
    let shape = (g.elevation_rad.len(), g.gate_range_m.len());
    let mut truth =
        Truth { exact_m_s: Array2::zeros(shape), pulse_m_s: Array2::zeros(shape), gate_m_s: Array2::zeros(shape) };
    let pulse = join::pulse(scene)?;
    let window = join::weighting(scene).weights(scene.estimator.window_samples)?;
    let by_pulse = RangeFilter::pulse(&pulse, g.layer_thickness_m)?;
    let by_gate = RangeFilter::gate(&pulse, &window, scene.detector.sampling_hz, g.layer_thickness_m)?;
    for (i, line) in scanner.lines().iter().enumerate() {
        let exact_m_s = radial_velocity_m_s(plan, i, &g.gate_range_m)?;
        truth.exact_m_s.row_mut(i).assign(&ArrayView1::from(&exact_m_s));
        let mut filtered_m_s = vec![0.0; g.gate_range_m.len()];
        for (filter, cells) in [(&by_pulse, &mut truth.pulse_m_s), (&by_gate, &mut truth.gate_m_s)] {
            filter.apply_into(line.first_range_m, &line.radial_velocity_m_s, &g.gate_range_m, &mut filtered_m_s)?;
            cells.row_mut(i).assign(&ArrayView1::from(&filtered_m_s));
        }
    }
    Ok(truth)
}

/// Runs the estimates of all realisations; the first one's records go to `first_records` as well, piece after piece.
pub(crate) fn estimate<S: Sample + wakescope_signal::Sample>(
    plan: &Plan,
    scanner: &Scanner<'_>,
    observer: &dyn Observer,
    mut first_records: impl FnMut(ArrayView2<'_, S>),
) -> Result<VelocityEstimates, Error> {
    let mut mapper = Mapper::new(plan, scanner)?;
    observer.begin(Stage::Estimates, (plan.realisations() * plan.geometry.elevation_rad.len()) as u64);
    for realisation in 0..plan.realisations() {
        let mut sums = mapper.sums()?;
        let clipped = scanner.in_pieces(realisation, observer, |first, records| {
            if realisation == 0 {
                first_records(records);
            }
            Ok(sums.add(first, records)?)
        })?;
        let scan = sums.finish();
        mapper.add(&scan, clipped)?;
    }
    observer.end();
    Ok(mapper.finish(plan))
}
