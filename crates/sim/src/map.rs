//! The radial-velocity map: estimates of every realisation, and their errors against the truth.

use crate::plan::{Plan, Stage};
use crate::progress::Observer;
use crate::scan::{Scanner, radial_velocity_m_s};
use crate::scene::{Method, NoiseKind, Scene};
use crate::{Error, join};
use ndarray::{Array2, ArrayView1};
use wakescope_estimate::{
    Correlogram, ErrorMap, PolarPoint, Quality, Radius, Scan, SpectralPeak, WindowCorrelation, polar_points,
};
use wakescope_signal::RangeFilter;

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
}

/// Accumulates the errors of realisation after realisation.
pub(crate) struct Mapper<'a> {
    scene: &'a Scene,
    points: Vec<PolarPoint>,
    elevation_of_ray_rad: Vec<f64>,
    statistic: Correlogram<f64>,
    peak: SpectralPeak,
    correlation: WindowCorrelation,
    radius: Radius,
    truth: Truth,
    errors: ErrorMap<ndarray::Ix2>,
    flagged: Array2<f64>,
    level: Array2<f64>,
    n_eff: Array2<f64>,
    realisations: usize,
}

struct Truth {
    exact_m_s: Array2<f64>,
    pulse_m_s: Array2<f64>,
    gate_m_s: Array2<f64>,
}

impl<'a> Mapper<'a> {
    pub(crate) fn new(plan: &'a Plan, scanner: &Scanner<'_>) -> Result<Self, Error> {
        let (scene, g) = (&plan.scene.scene, &plan.geometry);
        let e = &scene.estimator;
        let sampling = join::sampling(scene)?;
        let statistic = Correlogram::new(join::weighting(scene), e.window_samples)?;
        let peak = SpectralPeak::new(
            &sampling,
            statistic.kind(),
            statistic.lags(),
            e.padded_samples,
            join::refinement(scene),
        )?;
        let shape = (g.elevation_rad.len(), g.gate_range_m.len());
        let pulses = scene.scan.pulses_per_line;
        Ok(Self {
            scene,
            points: polar_points(&g.elevation_rad, &g.gate_range_m),
            elevation_of_ray_rad: g.elevation_rad.iter().flat_map(|&el| std::iter::repeat_n(el, pulses)).collect(),
            statistic,
            peak,
            correlation: correlation(scene, scanner)?,
            radius: Radius::Fixed {
                radius_m: match e.method {
                    Method::Periodogram => 0.0,
                    Method::PeriodogramAccumulation => e.radius_m,
                },
            },
            truth: truth(plan, scanner)?,
            errors: ErrorMap::new(ndarray::Dim(shape)),
            flagged: Array2::zeros(shape),
            level: Array2::zeros(shape),
            n_eff: Array2::zeros(shape),
            realisations: 0,
        })
    }

    /// Estimates the velocities of one realisation and adds their errors.
    pub(crate) fn add(&mut self, records: &Array2<f64>) -> Result<(), Error> {
        let sampling = join::sampling(self.scene)?;
        let gates = join::gates(self.scene)?;
        let scan = Scan::new(&self.statistic, &sampling, &gates, &self.elevation_of_ray_rad, records.view())?;
        let map = scan.map(&self.points, &self.radius, Some(&self.correlation), &self.peak)?;
        let shape = self.flagged.dim();
        let velocity = Array2::from_shape_fn(shape, |(i, j)| map[i * shape.1 + j].estimate.velocity_m_s);
        self.errors.add(velocity.view(), self.truth.pulse_m_s.view())?;
        for ((cell, point), (level, n_eff)) in
            self.flagged.iter_mut().zip(&map).zip(self.level.iter_mut().zip(self.n_eff.iter_mut()))
        {
            if point.estimate.flag != Quality::Good {
                *cell += 1.0;
            }
            // The level is the same for all realisations: a matter of geometry.
            (*level, *n_eff) = (point.level as f64, point.n_eff);
        }
        self.realisations += 1;
        Ok(())
    }

    pub(crate) fn finish(self, plan: &Plan) -> VelocityEstimates {
        let statistics = self.errors.statistics();
        let bias_m_s = statistics.mapv(|s| s.bias_m_s);
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
            flagged: self.flagged / self.realisations.max(1) as f64,
        }
    }
}

/// Correlation between windows of one pulse: of the speckle, and of the noise at the scene's typical SNR.
fn correlation(scene: &Scene, scanner: &Scanner<'_>) -> Result<WindowCorrelation, Error> {
    let e = &scene.estimator;
    let window = join::weighting(scene).weights(e.window_samples)?;
    let d = &scene.detector;
    let in_band_hz = match d.noise {
        NoiseKind::White => 0.5 * d.sampling_hz,
        NoiseKind::Band | NoiseKind::None => d.bandwidth_hz,
    };
    let snr = if d.noise == NoiseKind::None { f64::INFINITY } else { scanner.mean_snr() };
    // Without any return there is only noise, which a large finite ratio says as well.
    let noise_to_signal = (in_band_hz / d.bandwidth_hz / snr).min(1e12);
    Ok(WindowCorrelation::gaussian_pulse(
        &window,
        &join::gates(scene)?,
        scene.samples_per_record(),
        d.sampling_hz,
        scene.pulse_sigma_s(),
        noise_to_signal,
    )?)
}

fn truth(plan: &Plan, scanner: &Scanner<'_>) -> Result<Truth, Error> {
    let (scene, g) = (&plan.scene.scene, &plan.geometry);
    let shape = (g.elevation_rad.len(), g.gate_range_m.len());
    let mut truth =
        Truth { exact_m_s: Array2::zeros(shape), pulse_m_s: Array2::zeros(shape), gate_m_s: Array2::zeros(shape) };
    let wind = join::wind(scene)?;
    let start_s = join::start_time_s(scene);
    let pulse = join::pulse(scene)?;
    let window = join::weighting(scene).weights(scene.estimator.window_samples)?;
    let by_pulse = RangeFilter::pulse(pulse, g.layer_thickness_m)?;
    let by_gate = RangeFilter::gate(pulse, &window, scene.detector.sampling_hz, g.layer_thickness_m)?;
    for (i, line) in scanner.lines().iter().enumerate() {
        let time_s = start_s + g.line_time_s[i];
        let exact_m_s = radial_velocity_m_s(&*wind, scene, g.elevation_rad[i], time_s, &g.gate_range_m)?;
        truth.exact_m_s.row_mut(i).assign(&ArrayView1::from(&exact_m_s));
        let mut filtered_m_s = vec![0.0; g.gate_range_m.len()];
        for (filter, cells) in [(&by_pulse, &mut truth.pulse_m_s), (&by_gate, &mut truth.gate_m_s)] {
            filter.apply_into(line.first_range_m, &line.radial_velocity_m_s, &g.gate_range_m, &mut filtered_m_s)?;
            cells.row_mut(i).assign(&ArrayView1::from(&filtered_m_s));
        }
    }
    Ok(truth)
}

/// Runs the estimates of all realisations.
pub(crate) fn estimate(
    plan: &Plan,
    scanner: &Scanner<'_>,
    observer: &dyn Observer,
    mut first_records: impl FnMut(&Array2<f64>),
) -> Result<VelocityEstimates, Error> {
    let mut mapper = Mapper::new(plan, scanner)?;
    observer.begin(Stage::Estimates, (plan.realisations() * plan.geometry.elevation_rad.len()) as u64);
    for realisation in 0..plan.realisations() {
        let records = scanner.records(realisation, observer)?;
        if realisation == 0 {
            first_records(&records);
        }
        mapper.add(&records)?;
    }
    observer.end();
    Ok(mapper.finish(plan))
}
