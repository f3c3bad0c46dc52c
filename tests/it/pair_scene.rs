//! A scan of the analytic vortex pair, or of any wind in its place: one pulse along each of 185 lines, and the velocities
//! weighted with the pulse, and with pulse and window.

use ndarray::Array2;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;
use wakescope_estimate::*;
use wakescope_les::{CirculationProfile, Ground, Motion, VortexPair, Wind};
use wakescope_signal::{
    GaussianPulse, LineOfSight, NoiseModel, PulseDuration, RangeFilter, Receiver, Record, Simulator,
};

pub(crate) const WINDOW: usize = 64;
pub(crate) const LINES: usize = 185;
pub(crate) const STEP_RAD: f64 = 1.25e-3;
/// First sample and number of samples of each record.
pub(crate) const FIRST_SAMPLE_M: f64 = 310.0;
pub(crate) const SAMPLES: usize = 330;
/// Estimates are compared at every third gate.
const EVERY: usize = 3;

pub(crate) struct Scene {
    simulator: Simulator,
    pub(crate) receiver: Receiver,
    lines: Vec<LineOfSight>,
    pub(crate) elevation_rad: Vec<f64>,
    pub(crate) sampling: Sampling,
    pub(crate) gates: Gates,
    /// Ranges of the gates that are compared.
    pub(crate) range_m: Vec<f64>,
    pub(crate) points: Vec<PolarPoint>,
    /// At every point: velocity weighted with the pulse, with pulse and window, and the distance to the nearer core.
    pub(crate) v_pulse_m_s: Vec<f64>,
    pub(crate) v_gate_m_s: Vec<f64>,
    pub(crate) distance_m: Vec<f64>,
}

impl Scene {
    pub(crate) fn new(pulse_s: f64, snr_db: f64, noise: NoiseModel) -> Self {
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
        Self::of_wind(pulse_s, snr_db, noise, &pair.wind().unwrap())
    }

    /// The same scan of another wind, no steeper than the pair.
    pub(crate) fn of_wind(pulse_s: f64, snr_db: f64, noise: NoiseModel, wind: &dyn Wind) -> Self {
        let receiver = Receiver { noise, ..Receiver::table2() };
        let pulse = GaussianPulse::new(PulseDuration::FullWidthHalfMaximum(pulse_s), 150e-6).unwrap();
        let weight_per_m = 10f64.powf(0.1 * snr_db) / receiver.slowly_varying_snr(150e-6, 1.0);
        let first_s = 2.0 * FIRST_SAMPLE_M / SPEED_OF_LIGHT_M_S;
        let record = Record { time_of_first_sample_s: first_s, samples: SAMPLES };
        let simulator = Simulator::new(pulse, receiver, record).unwrap();
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
        Self {
            simulator,
            receiver,
            lines,
            elevation_rad,
            sampling,
            gates,
            range_m,
            points,
            v_pulse_m_s,
            v_gate_m_s,
            distance_m,
        }
    }

    /// One pulse along each line.
    pub(crate) fn records(&self, seed: u64) -> Array2<f64> {
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
