//! The lidar and the lines of sight of these tests.

use num_complex::Complex;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;
use wakescope_signal::{
    GaussianPulse, LayerLimits, LineOfSight, NoiseModel, Pulse, Receiver, Record, Scratch,
    Simulator,
};

pub(crate) const C: f64 = 299_792_458.0;
pub(crate) const WAVELENGTH_M: f64 = 1.55e-6;
/// Range step of one sample at 250 MHz.
pub(crate) const STEP_M: f64 = C / 500e6;

pub(crate) fn receiver(noise: NoiseModel) -> Receiver {
    Receiver {
        quantum_efficiency: 0.8,
        local_oscillator_w: 2e-3,
        noise,
        ..Receiver::table2()
    }
}

/// What bounds the layers in a wind of this steepness.
pub(crate) fn limits(max_gradient_per_s: f64) -> LayerLimits {
    LayerLimits {
        sample_rate_hz: 250e6,
        wavelength_m: WAVELENGTH_M,
        max_gradient_per_s,
    }
}

pub(crate) fn gaussian(width_s: f64) -> GaussianPulse {
    GaussianPulse::of_full_width(width_s, 150e-6).unwrap()
}

/// A pulse with a rise of 40 ns, a long tail and a phase that is no chirp, about its centroid.
pub(crate) fn skewed() -> Pulse {
    let times: Vec<f64> = (0..400).map(|i| f64::from(i) * 2e-9).collect();
    let amplitude: Vec<Complex<f64>> = times
        .iter()
        .map(|t| {
            Complex::from_polar(
                (1.0 - (-(t / 4e-8).powi(2)).exp()) * (-(t / 2.5e-7).powi(3)).exp(),
                2e6 * t,
            )
        })
        .collect();
    Pulse::from_envelope(&times, &amplitude, 150e-6)
        .unwrap()
        .centred()
}

/// A Gaussian pulse whose frequency rises by `chirp_hz_s`.
pub(crate) fn chirped(width_s: f64, chirp_hz_s: f64) -> Pulse {
    let shape = gaussian(width_s);
    let step_s = 5e-10;
    let half = (5.0 * shape.sigma_s() / step_s) as i32;
    let times: Vec<f64> = (-half..=half).map(|i| f64::from(i) * step_s).collect();
    let amplitude: Vec<Complex<f64>> = times
        .iter()
        .map(|t| {
            let phase = std::f64::consts::PI * chirp_hz_s * t * t;
            Complex::from_polar(shape.envelope_per_sqrt_s(*t), phase)
        })
        .collect();
    Pulse::from_envelope(&times, &amplitude, shape.energy_j()).unwrap()
}

/// A flat pulse about time 0 that rises and falls within one step of its samples.
pub(crate) fn rectangle(duration_s: f64, step_s: f64) -> Pulse {
    let half = (0.5 * duration_s / step_s).round() as i32;
    let times: Vec<f64> = (-half - 1..=half)
        .map(|i| (f64::from(i) + 0.5) * step_s)
        .collect();
    let mut power = vec![1.0; times.len()];
    power[0] = 0.0;
    power[times.len() - 1] = 0.0;
    Pulse::from_power(&times, &power, 150e-6).unwrap()
}

/// Records that begin when the light sent at time 0 comes back from `first_m`.
pub(crate) fn simulator(
    pulse: impl Into<Pulse>,
    noise: NoiseModel,
    first_m: f64,
    samples: usize,
) -> Simulator {
    let record = Record {
        time_of_first_sample_s: 2.0 * first_m / C,
        samples,
    };
    Simulator::new(pulse, receiver(noise), record).unwrap()
}

/// A line from `first_m` to `last_m` with a velocity by range and a constant weight.
pub(crate) fn line(
    first_m: f64,
    last_m: f64,
    thickness_m: f64,
    velocity: impl Fn(f64) -> f64,
) -> LineOfSight {
    weighted_line(first_m, last_m, thickness_m, velocity, |_| 5e-17)
}

/// The same with a weight by range.
pub(crate) fn weighted_line(
    first_m: f64,
    last_m: f64,
    thickness_m: f64,
    velocity: impl Fn(f64) -> f64,
    weight: impl Fn(f64) -> f64,
) -> LineOfSight {
    let layers = ((last_m - first_m) / thickness_m) as usize;
    let ranges = (0..layers).map(|l| first_m + l as f64 * thickness_m);
    LineOfSight {
        first_range_m: first_m,
        layer_thickness_m: thickness_m,
        radial_velocity_m_s: ranges.clone().map(velocity).collect(),
        weight_per_m: ranges.map(weight).collect(),
    }
}

/// Mean power of the envelope at each sample \[A^2\].
pub(crate) fn mean_power(simulator: &Simulator, line: &LineOfSight) -> Vec<f64> {
    let mut power = vec![0.0; simulator.record().samples];
    simulator
        .mean_power_into(line, &mut Scratch::default(), &mut power)
        .unwrap();
    power
}

/// Radial velocity along a line that passes a vortex core of a heavy wake at one core radius from
/// its axis, at 420 m.
pub(crate) fn core(range_m: f64) -> f64 {
    let (circulation_m2_s, core_m, along_m) = (500.0, 2.35, range_m - 420.0);
    circulation_m2_s * core_m
        / (2.0 * std::f64::consts::PI * (along_m * along_m + 2.0 * core_m * core_m))
}

pub(crate) fn normal_speckle(count: usize, seed: u64) -> Vec<Complex<f64>> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut normal = || -> f64 { rng.sample(StandardNormal) };
    (0..count)
        .map(|_| Complex::new(normal(), normal()) * 0.5_f64.sqrt())
        .collect()
}
