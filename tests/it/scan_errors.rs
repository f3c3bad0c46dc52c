//! Errors of the velocity estimators on a scan of the analytic vortex pair, against the velocity weighted with the pulse and with
//! pulse and window.

use ndarray::Array2;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;
use wakescope_estimate::*;
use wakescope_les::{CirculationProfile, Ground, Motion, VortexPair, Wind};
use wakescope_signal::{
    GaussianPulse, LineOfSight, NoiseModel, PlanckConvention, PulseDuration, RangeFilter, Receiver, Record, Simulator,
};

const WINDOW: usize = 64;
const LINES: usize = 185;
const STEP_RAD: f64 = 1.25e-3;
/// First sample and number of samples of each record.
const FIRST_SAMPLE_M: f64 = 310.0;
const SAMPLES: usize = 330;
/// Estimates are compared at every third gate.
const EVERY: usize = 3;

struct Scene {
    simulator: Simulator,
    lines: Vec<LineOfSight>,
    elevation_rad: Vec<f64>,
    sampling: Sampling,
    gates: Gates,
    points: Vec<PolarPoint>,
    /// At every point: velocity weighted with the pulse, with pulse and window, and the distance to the nearer core.
    v_pulse_m_s: Vec<f64>,
    v_gate_m_s: Vec<f64>,
    distance_m: Vec<f64>,
}

impl Scene {
    fn new(pulse_s: f64, snr_db: f64, noise: NoiseModel) -> Self {
        let receiver = Receiver {
            wavelength_m: 1.55e-6,
            sample_rate_hz: 250e6,
            intermediate_frequency_hz: 80e6,
            bandwidth_hz: 50e6,
            quantum_efficiency: 1.0,
            local_oscillator_w: 1e-3,
            planck: PlanckConvention::H,
            noise,
        };
        let pulse = GaussianPulse::new(PulseDuration::FullWidthHalfMaximum(pulse_s), 150e-6).unwrap();
        let weight_per_m = 10f64.powf(0.1 * snr_db) / receiver.slowly_varying_snr(150e-6, 1.0);
        let first_s = 2.0 * FIRST_SAMPLE_M / SPEED_OF_LIGHT_M_S;
        let record = Record { time_of_first_sample_s: first_s, samples: SAMPLES };
        let simulator = Simulator::new(pulse, receiver, record).unwrap();
        let pair = VortexPair {
            circulation_m2_s: 500.0,
            spacing_m: 47.0,
            core_radius_m: 2.35,
            lateral_position_m: 400.0,
            height_m: 47.0,
            ground: Ground::Image,
            profile: CirculationProfile::Algebraic,
            motion: Motion::Frozen,
        };
        let wind = pair.wind().unwrap();
        // lambda / (16 sigma g_max): 0.22 m at 200 ns; a divisor of the range step of a sample
        let sample_m = 0.5 * SPEED_OF_LIGHT_M_S / 250e6;
        let thickness_m = sample_m / if pulse_s > 300e-9 { 6.0 } else { 3.0 };
        let layers = ((SAMPLES as f64 * sample_m + 280.0) / thickness_m) as usize;
        let first_range_m = FIRST_SAMPLE_M - (140.0 / thickness_m).floor() * thickness_m;
        let elevation_rad: Vec<f64> = (0..LINES).map(|i| i as f64 * STEP_RAD).collect();
        let lines: Vec<LineOfSight> = elevation_rad
            .iter()
            .map(|angle_rad| {
                let (sin, cos) = angle_rad.sin_cos();
                let range_m = |l: usize| first_range_m + l as f64 * thickness_m;
                let points_m: Vec<[f64; 3]> = (0..layers).map(|l| [0.0, range_m(l) * cos, range_m(l) * sin]).collect();
                let mut wind_m_s = vec![[0.0; 3]; layers];
                wind.velocity_into(&points_m, 0.0, &mut wind_m_s).unwrap();
                LineOfSight {
                    first_range_m,
                    layer_thickness_m: thickness_m,
                    radial_velocity_m_s: wind_m_s.iter().map(|u| u[1] * cos + u[2] * sin).collect(),
                    weight_per_m: vec![weight_per_m; layers],
                }
            })
            .collect();
        let sampling = Sampling::new(250e6, 80e6, 1.55e-6, (55e6, 105e6)).unwrap();
        let gates = Gates::new(WINDOW, 1, first_s).unwrap();
        let range_m: Vec<f64> =
            gates.ranges_m(SAMPLES, &sampling).unwrap().into_iter().skip(3).step_by(EVERY).collect();
        let points = polar_points(&elevation_rad, &range_m);
        let filters = [
            RangeFilter::pulse(pulse, thickness_m).unwrap(),
            RangeFilter::gate(pulse, &[1.0; WINDOW], 250e6, thickness_m).unwrap(),
        ];
        let truth = |filter: &RangeFilter| -> Vec<f64> {
            lines
                .iter()
                .flat_map(|line| {
                    let mut out_m_s = vec![0.0; range_m.len()];
                    filter.apply_into(first_range_m, &line.radial_velocity_m_s, &range_m, &mut out_m_s).unwrap();
                    out_m_s
                })
                .collect()
        };
        let distance_m = points
            .iter()
            .map(|p| {
                let (sin, cos) = p.elevation_rad.sin_cos();
                let to = |y_m: f64| (p.range_m * cos - y_m).hypot(p.range_m * sin - 47.0);
                to(376.5).min(to(423.5))
            })
            .collect();
        let (v_pulse_m_s, v_gate_m_s) = (truth(&filters[0]), truth(&filters[1]));
        Self { simulator, lines, elevation_rad, sampling, gates, points, v_pulse_m_s, v_gate_m_s, distance_m }
    }

    /// One pulse along each line.
    fn records(&self, seed: u64) -> Array2<f64> {
        let mut records = Array2::zeros((LINES, SAMPLES));
        let mut scratch = Default::default();
        for (index, (line, mut record)) in self.lines.iter().zip(records.rows_mut()).enumerate() {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(1000 * seed + index as u64);
            let out = record.as_slice_mut().unwrap();
            self.simulator.record_into(line, &mut rng, &mut scratch, out).unwrap();
        }
        records
    }
}

/// Root-mean-square errors of an estimator: against the velocity of the pulse within 8 m of a core and beyond 30 m from
/// both, and against that of the gate within 8 m, m/s.
#[derive(Debug)]
struct Errors {
    inside_m_s: f64,
    outside_m_s: f64,
    gate_inside_m_s: f64,
}

fn errors(scene: &Scene, scans: &[Scan], estimator: &dyn Estimator) -> Errors {
    let inside = |i: &usize| scene.distance_m[*i] < 8.0;
    let chosen: Vec<usize> =
        (0..scene.points.len()).filter(|i| inside(i) || (scene.distance_m[*i] > 30.0 && i % 23 == 0)).collect();
    let points: Vec<PolarPoint> = chosen.iter().map(|&i| scene.points[i]).collect();
    let (mut squares, mut counts) = ([0.0; 3], [0.0; 3]);
    for scan in scans {
        let map = scan.map(&points, &Radius::Fixed { radius_m: 2.0 }, None, estimator).unwrap();
        for (found, i) in map.iter().zip(&chosen) {
            let error = |truth_m_s: &[f64]| (found.estimate.velocity_m_s - truth_m_s[*i]).powi(2);
            let place = usize::from(!inside(i));
            squares[place] += error(&scene.v_pulse_m_s);
            counts[place] += 1.0;
            if inside(i) {
                squares[2] += error(&scene.v_gate_m_s);
                counts[2] += 1.0;
            }
        }
    }
    let rms = |k: usize| (squares[k] / f64::from(counts[k] as u32)).sqrt();
    Errors { inside_m_s: rms(0), outside_m_s: rms(1), gate_inside_m_s: rms(2) }
}

/// PA, CA, CA-BT and the first moment on the scan, rho = 2 m, one pulse per line.
fn all_errors(snr_db: f64) -> [Errors; 4] {
    let scene = Scene::new(200e-9, snr_db, NoiseModel::BandLimited);
    let statistic = Correlogram::<f64>::new(Weighting::Rectangular, WINDOW).unwrap();
    let (sampling, kind, refinement) = (&scene.sampling, SignalKind::Real, Refinement::Parabola);
    let scans: Vec<Scan> = (0..2)
        .map(|seed| {
            let records = scene.records(seed);
            Scan::new(&statistic, sampling, &scene.gates, &scene.elevation_rad, records.view()).unwrap()
        })
        .collect();
    let estimators: [Box<dyn Estimator>; 4] = [
        Box::new(SpectralPeak::new(sampling, kind, WINDOW, 1024, refinement).unwrap()),
        Box::new(AutoregressivePeak::new(sampling, kind, WINDOW, 16, 2048, refinement).unwrap()),
        Box::new(LagWindowPeak::new(sampling, kind, WINDOW, 16, 1024, refinement).unwrap()),
        Box::new(FirstMoment::new(sampling, kind, WINDOW, 512, 3.5).unwrap()),
    ];
    estimators.map(|estimator| errors(&scene, &scans, estimator.as_ref()))
}

#[test]
fn errors_on_the_vortex_pair_at_0_db_are_those_of_an_independent_study() {
    let [pa, ca, hann, _] = all_errors(0.0);
    // 3.2 and 0.49 m/s for PA, 3.1 and 0.38 m/s for CA; the rms of some 45 independent places inside is known to 5 %
    for (found_m_s, study_m_s) in
        [(pa.inside_m_s, 3.2), (pa.outside_m_s, 0.49), (ca.inside_m_s, 3.1), (ca.outside_m_s, 0.38)]
    {
        assert!((found_m_s / study_m_s - 1.0).abs() < 0.13, "{found_m_s} {study_m_s}");
    }
    assert!(ca.inside_m_s < pa.inside_m_s && ca.outside_m_s < 0.85 * pa.outside_m_s, "{ca:?} {pa:?}");
    assert!(hann.inside_m_s < 0.75 * pa.inside_m_s && hann.outside_m_s < pa.outside_m_s, "{hann:?} {pa:?}");
}

#[test]
fn at_20_db_only_the_lag_window_and_the_moment_stay_below_the_periodogram() {
    let [pa, ca, hann, moment] = all_errors(20.0);
    // the model of order 16 takes the highest peak all the more: the claim "CA below PA" turns round
    assert!(ca.inside_m_s > pa.inside_m_s, "{ca:?} {pa:?}");
    assert!(hann.inside_m_s < 0.7 * pa.inside_m_s && hann.outside_m_s < 0.7 * pa.outside_m_s, "{hann:?} {pa:?}");
    assert!(moment.inside_m_s < 1.3 && moment.outside_m_s < ca.outside_m_s, "{moment:?} {ca:?}");
    assert!(moment.gate_inside_m_s < 0.8, "{moment:?}");
}
