//! What is stable of optics, signals, estimators and fits.

use super::{Curve, NO_THEORY, Panel, logs};
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
    EstimatorResponse, MapFitOptions, PulseShape, VelocityMap, Wake, WakeModel,
    refine_map_fit_of_estimator,
};
use wakescope_estimate::{Correlogram, Refinement, SignalKind, SpectralPeak, Weighting};
use wakescope_optics::{Focus, Grid, Layers, MonteCarlo, Stop, Telescope, theory};
use wakescope_signal::literal::literal_envelope;
use wakescope_signal::{
    GaussianPulse, LineOfSight, NoiseModel, PulseDuration, Record, SPEED_OF_LIGHT_M_S, Scratch,
    Simulator,
};
use wakescope_sim::plot::Axis;

const SEED: u64 = 1;
const PULSE_S: f64 = 200e-9;

/// Error of the free-space efficiency in the focus against the spacing of the grid over lambda F/(4 a), which the spectrum of the focused field asks for.
pub(super) fn focus() -> Result<Vec<Panel>, Failure> {
    let curves = [150.0, 300.0, 600.0].map(|focus_m| {
        let telescope = Telescope {
            focus: Focus::At(focus_m),
            ..Telescope::table2()
        };
        let exact = theory::free_space_efficiency(&telescope, focus_m)?;
        let asked_m = telescope.wavelength_m * focus_m / (4.0 * telescope.aperture_radius_m);
        Curve::new(
            format!("focus {focus_m} m"),
            &[0.5, 0.6, 0.7, 0.8, 0.9, 0.99],
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
        limit: Some(("largest spacing accepted", 1.0, false)),
        ..panel
    }])
}

/// What single precision changes of the efficiency of a pair of paths at 1500 m, in turbulence that is cut into ever more layers.
pub(super) fn layers() -> Result<Vec<Panel>, Failure> {
    let turbulence = [("Cn² 1e-15 m^(-2/3)", 1e-15), ("Cn² 1e-13 m^(-2/3)", 1e-13)];
    let curves = turbulence.map(|(name, cn2_m_m23)| {
        Curve::new(name, &[1.0, 10.0, 100.0, 1000.0], |layers| {
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

/// Largest difference of the last samples of a record from the sum as it is written, over their root mean square. Theory: the last digit of the phase.
pub(super) fn phasors() -> Result<Vec<Panel>, Failure> {
    const LAST: usize = 50;
    let receiver = receiver(NoiseModel::None);
    let step_m = 0.5 * SPEED_OF_LIGHT_M_S / receiver.sample_rate_hz;
    let pulse = GaussianPulse::new(PulseDuration::FullWidthHalfMaximum(PULSE_S), ENERGY_J)?;
    let first_m = 400.0;
    let at = |from: usize, samples| {
        let time_of_first_sample_s =
            2.0 * first_m / SPEED_OF_LIGHT_M_S + from as f64 / receiver.sample_rate_hz;
        Simulator::new(
            pulse,
            receiver,
            Record {
                time_of_first_sample_s,
                samples,
            },
        )
    };
    let curves = [1.0, 30.0].map(|velocity_m_s| {
        Curve::new(
            format!("{velocity_m_s} m/s"),
            &[1e2, 1e3, 1e4, 1e5, 1e6],
            |samples| {
                let samples = samples as usize;
                let air = |from: usize, layers| LineOfSight {
                    first_range_m: first_m - 300.0 + from as f64 * step_m,
                    layer_thickness_m: step_m,
                    radial_velocity_m_s: vec![velocity_m_s; layers],
                    weight_per_m: vec![1e-9; layers],
                };
                let layers = samples + 1000;
                let speckle: Vec<Complex<f64>> = (0..layers)
                    .map(|l| Complex::cis(0.7 * (l * l % 997) as f64))
                    .collect();
                let mut found = vec![Complex::ZERO; samples];
                at(0, samples)?.envelope_of_speckle_into(
                    &air(0, layers),
                    &speckle,
                    &mut Scratch::default(),
                    &mut found,
                )?;
                // The layers that the last samples see.
                let from = samples - LAST;
                let exact = literal_envelope(
                    &at(from, LAST)?,
                    &air(from, 1000),
                    &speckle[from..from + 1000],
                )?;
                let rms = (exact.iter().map(Complex::norm_sqr).sum::<f64>() / LAST as f64).sqrt();
                let apart = found[from..]
                    .iter()
                    .zip(&exact)
                    .map(|(a, b)| (a - b).norm())
                    .fold(0.0, f64::max);
                let phase_rad =
                    4.0 * PI * velocity_m_s * at(samples, 1)?.time_s(0) / receiver.wavelength_m;
                Ok([apart / rms, f64::EPSILON * phase_rad])
            },
        )
    });
    let axes = logs(["samples", "difference over rms"]);
    Ok(vec![Panel::new(
        "end of a long record against the literal sum",
        axes,
        curves,
    )?])
}

/// Methods that are drawn.
const METHODS: [&str; 4] = ["PA", "CA, AR(16)", "pulse pair", "likelihood"];
/// Trials of each method.
const TRIALS: usize = 200;

/// Standard deviation of good estimates over the Cramer-Rao bound, and the share of bad ones, in white noise.
pub(super) fn ratios() -> Result<Vec<Panel>, Failure> {
    let mut curves = [(); 2].map(|()| {
        METHODS.map(|name| Curve {
            name: name.into(),
            points: Vec::new(),
        })
    });
    for snr_db in [-20.0, -15.0, -10.0, 0.0, 20.0, 40.0, 70.0, 100.0] {
        let air = Air::new(NoiseModel::White, PULSE_S, snr_db, SEED)?;
        let bound_m_s = bound_m_s(&air.known, WINDOWS)?;
        for of in errors(&air, &[WINDOWS], TRIALS)? {
            let Some(method) = METHODS.iter().position(|method| *method == of.method) else {
                continue;
            };
            let found = good_and_bad(&of.errors_m_s, BAND_M_S);
            for (curves, measured) in curves
                .iter_mut()
                .zip([found.std_good_m_s / bound_m_s, found.bad_fraction])
            {
                curves[method].points.push([snr_db, measured, NO_THEORY]);
            }
        }
    }
    let [good, bad] = curves.map(|curves| curves.map(Ok));
    Ok(vec![
        Panel::new(
            "good estimates over the bound",
            [Axis::linear("SNR [dB]"), Axis::log("std over the bound")],
            good,
        )?,
        Panel::new(
            "bad estimates",
            [Axis::linear("SNR [dB]"), share("share")],
            bad,
        )?,
    ])
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
                let errors_m_s: Vec<f64> = wind
                    .errors(&statistic, &model)
                    .into_iter()
                    .map(|(error, _)| error)
                    .collect();
                Ok([
                    good_and_bad(&errors_m_s, BAND_M_S).std_good_m_s / wind.bound_m_s,
                    NO_THEORY,
                ])
            },
        )
    });
    Ok(vec![Panel::new(
        "autoregressive models over the bound",
        logs(["order", "std over the bound"]),
        curves,
    )?])
}

/// Share of fits to an exact map of peaks that end at the true pair, from starts whose vortices are so far from theirs, in all directions alike.
pub(super) fn basins() -> Result<Vec<Panel>, Failure> {
    const DIRECTIONS: usize = 4;
    const CORE_M: f64 = 2.35;
    let s = sampling()?;
    let peak = SpectralPeak::new(
        &s,
        SignalKind::Real,
        &unweighted_lags(WINDOW),
        1024,
        Refinement::Parabola,
    )?;
    let statistic = Correlogram::<f64>::new(Weighting::default(), WINDOW)?;
    let sigma_s = Air::new(NoiseModel::White, PULSE_S, 10.0, SEED)?
        .known
        .sigma_s;
    let pulse = PulseShape::gaussian(sigma_s)?;
    let response =
        EstimatorResponse::new(&statistic, &peak, &s, &pulse, (Noise::White, 10.0), 2.0)?;
    let elevation_rad: Vec<f64> = (0..26).map(|i| 0.02 + 0.007 * f64::from(i)).collect();
    let range_m: Vec<f64> = (0..13).map(|i| 320.0 + 13.0 * f64::from(i)).collect();
    let model = WakeModel::default();
    let truth = [
        500.0, 500.0, 376.5, 47.0, 423.5, 47.0, CORE_M, CORE_M, 0.0, 0.0,
    ];
    let shown = response.map(&model, &Wake::from_array(&truth), &elevation_rad, &range_m)?;
    let map = VelocityMap {
        elevation_rad: &elevation_rad,
        range_m: &range_m,
        velocity_m_s: shown.view(),
        standard_deviation_m_s: None,
    };
    let curve = Curve::new(
        format!("core {CORE_M} m"),
        &[10.0, 20.0, 30.0, 40.0, 60.0],
        |away_m| {
            let ends = (0..DIRECTIONS).into_par_iter().filter(|&k| {
                let turn = TAU * k as f64 / DIRECTIONS as f64;
                let mut start = truth;
                // The other vortex is off to another side.
                for (place, angle) in [(2, turn), (4, 2.6 * turn + 1.0)] {
                    start[place] += away_m * angle.cos();
                    start[place + 1] += away_m * angle.sin();
                }
                let options = MapFitOptions::default();
                let found = refine_map_fit_of_estimator(
                    &map,
                    &model,
                    &response,
                    &Wake::from_array(&start),
                    &options,
                );
                let is_near = |wake: [f64; 10]| {
                    [0, 1]
                        .iter()
                        .all(|&k| (wake[k] / truth[k] - 1.0).abs() < 0.02)
                };
                found.is_ok_and(|fit| is_near(fit.wake.to_array()))
            });
            Ok([ends.count() as f64 / DIRECTIONS as f64, NO_THEORY])
        },
    );
    let axes = [
        Axis::linear("distance of each vortex [m]"),
        share("share of starts"),
    ];
    Ok(vec![Panel::new(
        "starts that end at the true pair",
        axes,
        [curve],
    )?])
}
