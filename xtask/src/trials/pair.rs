//! Scans of an analytic vortex pair: one pulse along each of 185 lines, and what pulse and gate see of the wind.
//!
//! The pair of the figures has Gamma0 500 m^2/s, 47 m apart and 47 m high, cores of 2.35 m, 376.5 and 423.5 m away; the low pair
//! is narrow, uneven, with wide cores, near the ground and in a wind. 0 to 13.2 degrees in steps of
//! 1.25 mrad; layers thin enough for the cores. Scans differ in their speckle and noise only.

use super::methods::WINDOW;
use super::{ENERGY_J, receiver, sampling};
use crate::Failure;
use ndarray::Array2;
use rayon::prelude::*;
use wakescope_estimate::vortex_fit::{PulseShape, ScanSetup, Vortex, Wake, WakeModel};
use wakescope_estimate::{
    Estimator, Gates, Noise, PolarPoint, Radius, SPEED_OF_LIGHT_M_S, Sampling, Scan, SignalKind, Statistic,
    polar_points,
};
use wakescope_les::{CirculationProfile, Ground, Motion, Sum, Uniform, VortexPair, Wind};
use wakescope_signal::scan::{PulseKey, pulse_generator};
use wakescope_signal::{
    GaussianPulse, LineOfSight, NoiseModel, PulseDuration, RangeFilter, Receiver, Record, Scratch, Simulator,
};

const LINES: usize = 185;
const STEP_RAD: f64 = 1.25e-3;
/// Range of the first sample \[m\] and samples of a record: 280 to 520 m.
const FIRST_M: f64 = 280.0;
const SAMPLES: usize = 400;
/// Circulation of both vortices \[m^2/s\].
pub(crate) const CIRCULATION_M2_S: f64 = 500.0;

/// A pair at 400 m, as it is scanned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PairCase {
    /// Of the left and of the right vortex.
    circulation_m2_s: [f64; 2],
    spacing_m: f64,
    core_radius_m: f64,
    height_m: f64,
    wind_m_s: f64,
}

/// Far enough for a vortex not to be felt \[m\].
const AWAY_M: f64 = 1e6;

impl PairCase {
    /// The pair of the figures.
    pub(crate) const FIGURES: Self = Self {
        circulation_m2_s: [CIRCULATION_M2_S; 2],
        spacing_m: 47.0,
        core_radius_m: 2.35,
        height_m: 47.0,
        wind_m_s: 0.0,
    };
    /// Cores of 7.5 % of the spacing, unequal circulations.
    pub(crate) const LOW: Self =
        Self { circulation_m2_s: [380.0, 340.0], spacing_m: 40.0, core_radius_m: 3.0, height_m: 30.0, wind_m_s: 2.0 };
    /// Cores of 2 % of the spacing, smaller than the distance of lines resolves.
    pub(crate) const SMALL_CORES: Self = Self { core_radius_m: 0.8, ..Self::LOW };

    /// The wind: a pair as strong as the right vortex, and what the left one has more, its partner far away.
    fn wind(&self) -> Result<Sum, Failure> {
        let [left_m2_s, right_m2_s] = self.circulation_m2_s;
        let even = VortexPair {
            circulation_m2_s: right_m2_s,
            spacing_m: self.spacing_m,
            core_radius_m: self.core_radius_m,
            lateral_position_m: 400.0,
            height_m: self.height_m,
            ground: Ground::Image,
            profile: CirculationProfile::Algebraic,
            motion: Motion::Frozen,
        };
        let mut winds: Vec<Box<dyn Wind>> = vec![Box::new(even.wind()?)];
        if left_m2_s > right_m2_s {
            let left_m = 400.0 - 0.5 * self.spacing_m;
            let more = VortexPair {
                circulation_m2_s: left_m2_s - right_m2_s,
                spacing_m: AWAY_M,
                lateral_position_m: left_m + 0.5 * AWAY_M,
                ..even
            };
            winds.push(Box::new(more.wind()?));
        }
        winds.push(Box::new(Uniform::new([0.0, self.wind_m_s, 0.0])?));
        Ok(Sum { winds })
    }

    /// The pair in the words of the fits.
    pub(crate) fn truth(&self) -> Wake {
        let vortex = |circulation_m2_s, side: f64| Vortex {
            circulation_m2_s,
            lateral_position_m: 400.0 + side * 0.5 * self.spacing_m,
            height_m: self.height_m,
            core_radius_m: self.core_radius_m,
        };
        Wake {
            left: vortex(self.circulation_m2_s[0], -1.0),
            right: vortex(self.circulation_m2_s[1], 1.0),
            lateral_wind_m_s: self.wind_m_s,
            wind_shear_per_s: 0.0,
        }
    }
}

/// The pair of the figures in the words of the fits.
pub(crate) fn truth() -> Wake {
    PairCase::FIGURES.truth()
}

/// How the pair is scanned, and the truth.
pub(crate) struct PairScan {
    simulator: Simulator,
    receiver: Receiver,
    lines: Vec<LineOfSight>,
    seed: u64,
    pulse: GaussianPulse,
    noise: NoiseModel,
    pub(crate) snr: f64,
    pub(crate) sampling: Sampling,
    pub(crate) gates: Gates,
    pub(crate) elevation_rad: Vec<f64>,
    /// Ranges of the map \[m\]; with the elevations, its points.
    pub(crate) range_m: Vec<f64>,
    pub(crate) points: Vec<PolarPoint>,
    /// Velocity weighted with the pulse \[m/s\] at the points; distance to the nearer core \[m\].
    pub(crate) v_pulse_m_s: Vec<f64>,
    pub(crate) distance_m: Vec<f64>,
}

impl PairScan {
    /// Scans with that pulse (full width at half maximum), noise and signal-to-noise ratio; the map has every `every`th gate.
    pub(crate) fn new(noise: NoiseModel, pulse_s: f64, snr_db: f64, every: usize, seed: u64) -> Result<Self, Failure> {
        Self::of(&PairCase::FIGURES, noise, (pulse_s, snr_db), every, seed)
    }

    /// The same of another pair; (pulse, signal-to-noise ratio).
    pub(crate) fn of(
        case: &PairCase,
        noise: NoiseModel,
        (pulse_s, snr_db): (f64, f64),
        every: usize,
        seed: u64,
    ) -> Result<Self, Failure> {
        let (receiver, sampling) = (receiver(noise), sampling()?);
        let pulse = GaussianPulse::new(PulseDuration::FullWidthHalfMaximum(pulse_s), ENERGY_J)?;
        let first_s = 2.0 * FIRST_M / SPEED_OF_LIGHT_M_S;
        let simulator = Simulator::new(pulse, receiver, Record { time_of_first_sample_s: first_s, samples: SAMPLES })?;
        let (wind, centres) = (case.wind()?, case.truth());
        let sample_m = 0.5 * SPEED_OF_LIGHT_M_S * sampling.period_s();
        // lambda / (16 sigma g_max): 0.22 m at 200 ns, 0.11 m at 400 ns
        let parts = (3.0 * pulse_s / 200e-9).ceil();
        let thickness_m = sample_m / parts;
        let before = (4.0 * 0.5 * SPEED_OF_LIGHT_M_S * pulse.sigma_s() / thickness_m).ceil();
        let layers = SAMPLES * parts as usize + 2 * before as usize;
        let first_range_m = FIRST_M - before * thickness_m;
        let weight_per_m = 10f64.powf(0.1 * snr_db) / receiver.slowly_varying_snr(ENERGY_J, 1.0);
        let elevation_rad: Vec<f64> = (0..LINES).map(|i| i as f64 * STEP_RAD).collect();
        let line = |angle_rad: &f64| -> Result<LineOfSight, Failure> {
            let (sin, cos) = angle_rad.sin_cos();
            let at_m = |l: usize| first_range_m + l as f64 * thickness_m;
            let points_m: Vec<[f64; 3]> = (0..layers).map(|l| [0.0, at_m(l) * cos, at_m(l) * sin]).collect();
            let mut wind_m_s = vec![[0.0; 3]; layers];
            wind.velocity_into(&points_m, 0.0, &mut wind_m_s)?;
            Ok(LineOfSight {
                first_range_m,
                layer_thickness_m: thickness_m,
                radial_velocity_m_s: wind_m_s.iter().map(|u| u[1] * cos + u[2] * sin).collect(),
                weight_per_m: vec![weight_per_m; layers],
            })
        };
        let lines = elevation_rad.iter().map(line).collect::<Result<Vec<_>, _>>()?;
        let gates = Gates::new(WINDOW, 1, first_s)?;
        let range_m: Vec<f64> = gates.ranges_m(SAMPLES, &sampling)?.into_iter().step_by(every).collect();
        let points = polar_points(&elevation_rad, &range_m);
        let truth = |filter: RangeFilter| -> Result<Vec<f64>, Failure> {
            let mut all_m_s = Vec::with_capacity(points.len());
            for line in &lines {
                let mut out_m_s = vec![0.0; range_m.len()];
                filter.apply_into(first_range_m, &line.radial_velocity_m_s, &range_m, &mut out_m_s)?;
                all_m_s.extend(out_m_s);
            }
            Ok(all_m_s)
        };
        let distance = |p: &PolarPoint| {
            let (sin, cos) = p.elevation_rad.sin_cos();
            let to = |vortex: &Vortex| {
                (p.range_m * cos - vortex.lateral_position_m).hypot(p.range_m * sin - vortex.height_m)
            };
            to(&centres.left).min(to(&centres.right))
        };
        Ok(Self {
            v_pulse_m_s: truth(RangeFilter::pulse(pulse, thickness_m)?)?,
            distance_m: points.iter().map(distance).collect(),
            snr: 10f64.powf(0.1 * snr_db),
            simulator,
            receiver,
            lines,
            seed,
            pulse,
            noise,
            sampling,
            gates,
            elevation_rad,
            range_m,
            points,
        })
    }

    /// Half-width of |f|^2 at 1/e \[s\].
    pub(crate) fn sigma_s(&self) -> f64 {
        self.pulse.sigma_s()
    }

    /// Power of the noise in the band, in the unit of the records.
    pub(crate) fn noise_power_a2(&self) -> f64 {
        self.receiver.noise_variance_a2()
    }

    /// The raw signals \[line, sample\] of one scan.
    pub(crate) fn records(&self, scan: usize) -> Result<Array2<f64>, Failure> {
        let rows: Vec<Vec<f64>> = (0..LINES)
            .into_par_iter()
            .map_init(Scratch::default, |scratch, line| {
                let mut rng = pulse_generator(self.seed, PulseKey { line, pulse: scan });
                let mut row = vec![0.0; SAMPLES];
                self.simulator.record_into(&self.lines[line], &mut rng, scratch, &mut row)?;
                Ok(row)
            })
            .collect::<Result<_, wakescope_signal::Error>>()?;
        Ok(Array2::from_shape_vec((LINES, SAMPLES), rows.concat())?)
    }

    /// Statistics of all windows of a scan.
    pub(crate) fn statistics(&self, records: &Array2<f64>, statistic: &dyn Statistic<f64>) -> Result<Scan, Failure> {
        Ok(Scan::new(statistic, &self.sampling, &self.gates, &self.elevation_rad, records.view())?)
    }

    /// Velocities \[m/s\] at points with regions of that radius.
    pub(crate) fn velocities(
        &self,
        scan: &Scan,
        points: &[PolarPoint],
        radius_m: f64,
        estimator: &dyn Estimator,
    ) -> Result<Vec<f64>, Failure> {
        let found = scan.map(points, &Radius::Fixed { radius_m }, None, estimator)?;
        Ok(found.iter().map(|p| p.estimate.velocity_m_s).collect())
    }

    /// What the fits of the signals are told.
    pub(crate) fn setup(&self) -> Result<ScanSetup, Failure> {
        Ok(ScanSetup {
            sampling: self.sampling,
            kind: SignalKind::Real,
            noise: match self.noise {
                NoiseModel::BandLimited => Noise::Band { floor: 0.0 },
                _ => Noise::White,
            },
            pulse: PulseShape::gaussian(self.sigma_s())?,
            wake: WakeModel::default(),
            elevation_rad: self.elevation_rad.clone(),
            first_sample_time_s: 2.0 * FIRST_M / SPEED_OF_LIGHT_M_S,
            record_samples: SAMPLES,
        })
    }
}
