//! What is stable of optics, signals, estimators and fits.

use super::{Curve, Limit, NO_THEORY, Panel, logs, thinned};
use crate::profile::Profile;
use crate::work_precision::estimate::{Uniform, WINDOWS, bound_m_s};
use fixtures::failure::Failure;
use fixtures::uniform::{Air, BAND_M_S, errors};
use fixtures::{ENERGY_J, WINDOW, receiver, sampling};
use num_complex::Complex;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};
use std::ops::ControlFlow;
use wakescope_estimate::bound::Noise;
use wakescope_estimate::estimators::ModelPeak;
use wakescope_estimate::map::good_and_bad;
use wakescope_estimate::spectrum::unweighted_lags;
use wakescope_estimate::vortex_fit::{
    EstimatorResponse, MapFitOptions, PARAMETERS, VelocityMap, Wake, WakeModel,
    refine_map_fit_of_estimator,
};
use wakescope_estimate::{Correlogram, Refinement, SignalKind, SpectralPeak, Weighting};
use wakescope_optics::{Focus, Grid, Layers, MonteCarlo, Stop, Telescope, theory};
use wakescope_signal::literal::literal_envelope;
use wakescope_signal::{
    GaussianPulse, LineOfSight, NoiseModel, Record, SPEED_OF_LIGHT_M_S, Scratch, Simulator,
};
use wakescope_sim::plot::Axis;

const SEED: u64 = 1;
const PULSE_S: f64 = 200e-9;

/// Error of the free-space efficiency in the focus against the spacing of the grid over lambda F/(4 a), which the spectrum of the focused field asks for.
pub(super) fn focus(profile: Profile) -> Result<Vec<Panel>, Failure> {
    let curves = [150.0, 300.0, 600.0].map(|focus_m| {
        let telescope = Telescope {
            focus: Focus::At(focus_m),
            ..Telescope::table2()
        };
        let exact = theory::free_space_efficiency(&telescope, focus_m)?;
        let asked_m = telescope.wavelength_m * focus_m / (4.0 * telescope.aperture_radius_m);
        Curve::new(
            format!("focus {focus_m} m"),
            thinned(profile, &[0.5, 0.99], &[0.5, 0.6, 0.7, 0.8, 0.9, 0.99]),
            |share| {
                let screens = MonteCarlo {
                    telescope,
                    layers: Layers::equal(5, focus_m)?,
                    range_m: vec![focus_m],
                    grid: Grid::square(512, share * asked_m)?,
                    ..MonteCarlo::table2(1e-13, SEED)?
                };
                Ok([
                    (screens.grid_free_space::<f64>()?[0] / exact - 1.0).abs(),
                    NO_THEORY,
                ])
            },
        )
    });
    let axes = logs(["spacing over λF/(4a)", "error of the efficiency"]);
    let panel = Panel::new("grid of a focused beam", axes, curves)?;
    Ok(vec![Panel {
        limit: Some(Limit::Abscissa("largest spacing accepted", 1.0)),
        ..panel
    }])
}

/// What single precision changes of the efficiency of a pair of paths at 1500 m, in turbulence that is cut into ever more layers.
pub(super) fn layers(profile: Profile) -> Result<Vec<Panel>, Failure> {
    let turbulence = [
        ("C_{n}^{2} = 10^{−15} m^{−2/3}", 1e-15),
        ("C_{n}^{2} = 10^{−13} m^{−2/3}", 1e-13),
    ];
    let curves = turbulence.map(|(name, cn2_m_m23)| {
        let layers = thinned(profile, &[1.0, 10.0, 100.0], &[1.0, 10.0, 100.0, 1000.0]);
        Curve::new(name, layers, |layers| {
            let set_up = MonteCarlo {
                grid: Grid::square(128, 4e-3)?,
                layers: Layers::equal(layers as usize, 1500.0)?,
                range_m: vec![1500.0],
                ..MonteCarlo::table2(cn2_m_m23, SEED)?
            };
            let double = set_up.run_in::<f64>(Stop::after(2), |_| ControlFlow::Continue(()))?;
            Ok([
                (set_up.run(2)?.monostatic.mean[0] / double.monostatic.mean[0] - 1.0).abs(),
                NO_THEORY,
            ])
        })
    });
    let axes = logs(["layers", "change of the efficiency"]);
    Ok(vec![Panel::new(
        "single precision through many layers",
        axes,
        curves,
    )?])
}

/// Samples at the end of a record that are compared.
const LAST: usize = 50;
/// Layers that contribute to these samples.
const LAYERS: usize = 1000;
/// Range of the first sample \[m\].
const FIRST_M: f64 = 400.0;
/// Layers begin this far before the range of the first sample \[m\].
const BEFORE_M: f64 = 300.0;

/// Largest difference of the last samples of a record from the sum as it is written, over their root mean square. Theory: the last digit of the phase.
pub(super) fn phasors() -> Result<Vec<Panel>, Failure> {
    let curves = [1.0, 30.0].map(|velocity_m_s| {
        let name = format!("{velocity_m_s} m/s");
        Curve::new(name, &[1e2, 1e3, 1e4, 1e5, 1e6], |samples| {
            end_of_record(velocity_m_s, samples as usize)
        })
    });
    let title = "end of a long record against the literal sum";
    let axes = logs(["samples", "difference over rms"]);
    Ok(vec![Panel::new(title, axes, curves)?])
}

/// The receiver without noise, from one of the samples on.
fn simulator(from: usize, samples: usize) -> Result<Simulator, Failure> {
    let receiver = receiver(NoiseModel::None);
    let pulse = GaussianPulse::of_full_width(PULSE_S, ENERGY_J)?;
    let record = Record {
        time_of_first_sample_s: 2.0 * FIRST_M / SPEED_OF_LIGHT_M_S
            + from as f64 / receiver.sample_rate_hz,
        samples,
    };
    Ok(Simulator::new(pulse, receiver, record)?)
}

/// Layers of the thickness of a sample in uniform wind, from one of them on.
fn uniform_line(velocity_m_s: f64, from: usize, layers: usize) -> LineOfSight {
    let sample_rate_hz = receiver(NoiseModel::None).sample_rate_hz;
    let thickness_m = 0.5 * SPEED_OF_LIGHT_M_S / sample_rate_hz;
    LineOfSight {
        first_range_m: FIRST_M - BEFORE_M + from as f64 * thickness_m,
        layer_thickness_m: thickness_m,
        radial_velocity_m_s: vec![velocity_m_s; layers],
        weight_per_m: vec![1e-9; layers],
    }
}

/// Difference of the last samples and what the last digit of their phase makes.
fn end_of_record(velocity_m_s: f64, samples: usize) -> Result<[f64; 2], Failure> {
    let layers = samples + LAYERS;
    let speckle: Vec<Complex<f64>> = (0..layers)
        .map(|l| Complex::cis(0.7 * (l * l % 997) as f64))
        .collect();
    let mut found = vec![Complex::ZERO; samples];
    simulator(0, samples)?.envelope_of_speckle_into(
        &uniform_line(velocity_m_s, 0, layers),
        &speckle,
        &mut Scratch::default(),
        &mut found,
    )?;
    let from = samples - LAST;
    let exact = literal_envelope(
        &simulator(from, LAST)?,
        &uniform_line(velocity_m_s, from, LAYERS),
        &speckle[from..from + LAYERS],
    )?;
    let rms = (exact.iter().map(Complex::norm_sqr).sum::<f64>() / LAST as f64).sqrt();
    let mut largest = 0.0_f64;
    for (found, exact) in found[from..].iter().zip(&exact) {
        largest = largest.max((found - exact).norm());
    }
    let end = simulator(samples, 1)?;
    let wavelength_m = end.receiver().wavelength_m;
    let phase_rad = 4.0 * PI * velocity_m_s * end.time_s(0) / wavelength_m;
    Ok([largest / rms, f64::EPSILON * phase_rad])
}

/// Methods that are drawn.
const METHODS: [&str; 4] = ["PA", "CA, AR(16)", "pulse pair", "likelihood"];
/// Trials of each method.
const TRIALS: usize = 200;

/// Standard deviation of good estimates over the Cramer-Rao bound, and the share of bad ones, in white noise.
pub(super) fn ratios() -> Result<Vec<Panel>, Failure> {
    let mut good = METHODS.map(|_| Vec::new());
    let mut bad = METHODS.map(|_| Vec::new());
    for snr_db in [-20.0, -15.0, -10.0, 0.0, 20.0, 40.0, 70.0, 100.0] {
        let air = Air::new(NoiseModel::White, PULSE_S, snr_db, SEED)?;
        let bound_m_s = bound_m_s(&air.known, WINDOWS)?;
        for errors in errors(&air, &[WINDOWS], TRIALS)? {
            let Some(method) = METHODS.iter().position(|method| *method == errors.method) else {
                continue;
            };
            let found = good_and_bad(&errors.errors_m_s, BAND_M_S);
            let good_over_bound = found.std_good_m_s / bound_m_s;
            good[method].push([snr_db, good_over_bound, NO_THEORY]);
            bad[method].push([snr_db, found.bad_fraction, NO_THEORY]);
        }
    }
    let over_bound = [Axis::linear("SNR [dB]"), Axis::log("std over the bound")];
    let fraction = [Axis::linear("SNR [dB]"), share("share")];
    Ok(vec![
        Panel::new(
            "good estimates over the bound",
            over_bound,
            curves_of_methods(good),
        )?,
        Panel::new("bad estimates", fraction, curves_of_methods(bad))?,
    ])
}

/// A curve for each of the [`METHODS`].
fn curves_of_methods(
    points: [Vec<[f64; 3]>; METHODS.len()],
) -> impl Iterator<Item = Result<Curve, Failure>> {
    METHODS.into_iter().zip(points).map(|(name, points)| {
        Ok(Curve {
            name: name.into(),
            points,
        })
    })
}

/// A linear axis of shares.
fn share(label: &str) -> Axis {
    Axis::linear(label).between(-0.05, 1.05)
}

/// Standard deviation over the bound of autoregressive models of all orders, where noise does not help the matrix.
pub(super) fn orders() -> Result<Vec<Panel>, Failure> {
    let s = sampling()?;
    let statistic = Correlogram::<f64>::new(Weighting::Rectangular, WINDOW)?;
    let curves = [0.0, 40.0, 100.0].map(|snr_db| {
        let wind = Uniform::new(NoiseModel::White, snr_db, TRIALS)?;
        Curve::new(
            format!("{snr_db} dB"),
            &[1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 48.0, (WINDOW - 1) as f64],
            |order| {
                let model = ModelPeak::new(
                    &s,
                    SignalKind::Real,
                    WINDOW,
                    order as usize,
                    2048,
                    Refinement::Parabola,
                )?;
                let mut errors_m_s = Vec::new();
                for (error_m_s, _) in wind.errors(&statistic, &model) {
                    errors_m_s.push(error_m_s);
                }
                let found = good_and_bad(&errors_m_s, BAND_M_S);
                Ok([found.std_good_m_s / wind.bound_m_s, NO_THEORY])
            },
        )
    });
    Ok(vec![Panel::new(
        "autoregressive models over the bound",
        logs(["order", "std over the bound"]),
        curves,
    )?])
}

/// The true pair, as the parameters of a fit.
const TRUTH: [f64; PARAMETERS] = [
    500.0, 500.0, 376.5, 47.0, 423.5, 47.0, CORE_M, CORE_M, 0.0, 0.0, 0.0,
];
const CORE_M: f64 = 2.35;
/// Directions in which starts are away from the pair.
const DIRECTIONS: usize = 4;
/// Relative error of the circulations of a fit that converged to the true pair.
const NEAR: f64 = 0.02;

/// Share of fits to an exact map of peaks that converge to the true pair, from starts whose vortices are so far from theirs, in all directions alike.
pub(super) fn basins(profile: Profile) -> Result<Vec<Panel>, Failure> {
    let sampling = sampling()?;
    let peak = SpectralPeak::new(
        &sampling,
        SignalKind::Real,
        &unweighted_lags(WINDOW),
        1024,
        Refinement::Parabola,
    )?;
    let statistic = Correlogram::<f64>::new(Weighting::default(), WINDOW)?;
    let air = Air::new(NoiseModel::White, PULSE_S, 10.0, SEED)?;
    let noise = (Noise::White, 10.0);
    let sigma_s = air.known.sigma_s;
    let response = EstimatorResponse::new(&statistic, &peak, &sampling, sigma_s, noise, 2.0)?;
    let elevation_rad: Vec<f64> = (0..26).map(|i| 0.02 + 0.007 * f64::from(i)).collect();
    let range_m: Vec<f64> = (0..13).map(|i| 320.0 + 13.0 * f64::from(i)).collect();
    let model = WakeModel::default();
    let truth = Wake::from_array(&TRUTH);
    let predicted = response.map(&model, &truth, &elevation_rad, &range_m)?;
    let map = VelocityMap {
        elevation_rad: &elevation_rad,
        range_m: &range_m,
        velocity_m_s: predicted.view(),
        standard_deviation_m_s: None,
    };
    let name = format!("core {CORE_M} m");
    let away_m = thinned(profile, &[20.0, 60.0], &[10.0, 20.0, 30.0, 40.0, 60.0]);
    let curve = Curve::new(name, away_m, |away_m| {
        let converged = (0..DIRECTIONS)
            .into_par_iter()
            .filter(|&direction| finds_the_pair(&map, &response, start(away_m, direction)));
        Ok([converged.count() as f64 / DIRECTIONS as f64, NO_THEORY])
    });
    let axes = [
        Axis::linear("distance of each vortex [m]"),
        share("share of starts"),
    ];
    let title = "starts that end at the true pair";
    Ok(vec![Panel::new(title, axes, [curve])?])
}

/// The pair with its vortices away from their positions, each to another side.
fn start(away_m: f64, direction: usize) -> Wake {
    let turn = TAU * direction as f64 / DIRECTIONS as f64;
    let mut start = TRUTH;
    for (lateral, angle) in [(2, turn), (4, 2.6 * turn + 1.0)] {
        start[lateral] += away_m * angle.cos();
        start[lateral + 1] += away_m * angle.sin();
    }
    Wake::from_array(&start)
}

/// Whether a fit from a start has the circulations of the true pair.
fn finds_the_pair(map: &VelocityMap, response: &EstimatorResponse, start: Wake) -> bool {
    let model = WakeModel::default();
    let options = MapFitOptions::default();
    let Ok(fit) = refine_map_fit_of_estimator(map, &model, response, &start, &options) else {
        return false;
    };
    let found = fit.wake.to_array();
    (0..2).all(|k| (found[k] / TRUTH[k] - 1.0).abs() < NEAR)
}
