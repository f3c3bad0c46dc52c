//! Extreme cases of the estimators: each takes one window through the accumulation, as any map has it.

use super::extreme::Extreme;
use crate::failure::Failure;
use crate::trials::methods::{Known, Method, Methods};
use crate::trials::uniform::Air;
use fixtures::{WINDOW, sampling};
use ndarray::Array2;
use std::f64::consts::TAU;
use wakescope_estimate::bound::{GradientModel, Noise, WindowModel};
use wakescope_estimate::estimators::{AutoregressivePeak, CaponPeak, GradientLikelihood, Quality};
use wakescope_estimate::map::{MapPoint, PolarPoint};
use wakescope_estimate::models::Autoregression;
use wakescope_estimate::spectrum::ShortCorrelogram;
use wakescope_estimate::vortex_fit::{MapFitOptions, RangeKernel, VelocityMap, WakeModel, fit_map};
use wakescope_estimate::{
    Correlogram, Estimator, Gates, Radius, Refinement, Sampling, Scan, Scratch, SignalKind, SpectralPeak, Statistic,
    Weighting,
};
use wakescope_signal::NoiseModel;

type Number = Result<f64, Failure>;

const OTHERS: &str = "estimators that say otherwise";
const SIGMA_S: f64 = 120.112e-9;

/// One case a row.
#[rustfmt::skip]
pub(super) fn cases() -> Vec<Extreme> {
    use Extreme as E;
    vec![
        E::at_most("zero signal", "64 zeros: no signal, velocity NaN", OTHERS, 0.0, || others(&[0.0; WINDOW], Quality::NoSignal)),
        E::at_most("NaN sample", "one of 64: an empty region, velocity NaN", OTHERS, 0.0, || others(&broken(f64::NAN)?, Quality::Empty)),
        E::at_most("infinite sample", "one of 64: an empty region, velocity NaN", OTHERS, 0.0, || others(&broken(f64::INFINITY)?, Quality::Empty)),
        E::at_most("NaN statistic", "all numbers of the mean", OTHERS, 0.0, nan_statistic),
        E::at_most("constant signal", "64 times 3", "estimators that call it good", 0.0, constant),
        E::at_most("samples of 1e-200", "against samples of order one", "change of velocity, m/s, worst", 1e-6, || amplitude(1e-200)),
        E::at_most("samples of 1e200", "against samples of order one", "change of velocity, m/s, worst", 1e-6, || amplitude(1e200)),
        E::at_most("tone without noise", "-14 to 9.3 m/s", "velocity error, m/s, worst", 0.16, || tones(false)),
        E::at_most("tone without noise, coarse methods", "-14 to 9.3 m/s: moments, low orders, no interpolation", "velocity error, m/s, worst: half a bin", 1.52, || tones(true)),
        E::at_most("velocities beyond the band", "25, 40 and 100 m/s: out of band", OTHERS, 0.0, beyond_band),
        E::between("SNR -60 dB, one window", "40 windows an estimator", "share within 3 m/s, worst estimator: chance is 0.15", (0.0, 0.45), || near(-60.0, f64::max)),
        E::between("SNR +100 dB, one window", "40 windows an estimator", "share within 3 m/s, worst estimator", (0.92, 1.0), || near(100.0, f64::min)),
        E::at_most("velocities at -60 dB", "40 windows an estimator", "largest size, m/s", 19.6, || fastest(-60.0)),
        E::at_most("estimates of a pulse much shorter than the gate", "10 ns, gate 256 ns, likelihood", "error over four bounds and 2 cm/s", 1.0, || pulse_and_gate(10e-9)),
        E::at_most("estimates of a pulse much longer than the gate", "5 us, gate 256 ns, likelihood", "error over four bounds and 2 cm/s", 1.0, || pulse_and_gate(5e-6)),
        E::between("bound at -60 dB", "over that at -50 dB", "ratio, 10 where noise is all", (9.99, 10.01), || Ok(bound(1e-6)? / bound(1e-5)?)),
        E::between("bound at +60 dB", "over that at +40 dB", "ratio", (0.5, 1.0), || Ok(bound(1e6)? / bound(1e4)?)),
        E::refused("bound at +160 dB", "white noise", "too near a singular one", || bound(1e16)),
        E::refused("bound without noise outside the band", "floor = 0", "floor = 0.0", || Ok(model(Noise::Band { floor: 0.0 })?.bound_m_s(0.0, 0.1, SignalKind::Real, 1.0)?)),
        E::at_most("unbiased correlogram of a tone", "no positive definite one: invalid, velocity NaN", "velocities given", 0.0, unbiased),
        E::refused("singular correlogram", "sixteen equal lags, order 15", "not positive definite", || Ok(Autoregression::yule_walker(&[1.0; 16], SignalKind::Real, 15)?.order() as f64)),
        E::refused("indefinite correlogram", "lags 1, 2", "not positive definite", || Ok(Autoregression::yule_walker(&[1.0, 2.0], SignalKind::Real, 1)?.order() as f64)),
        E::refused("order of the window's length, CA", "order 64 of 64 samples", "order", || Ok(AutoregressivePeak::new(&sampling()?, SignalKind::Real, WINDOW, WINDOW, 1024, Refinement::None)?.statistic_len() as f64)),
        E::refused("order of the window's length, Capon", "order 64 of 64 samples", "order", || Ok(CaponPeak::new(&sampling()?, SignalKind::Real, WINDOW, WINDOW, 1024, Refinement::None)?.statistic_len() as f64)),
        E::refused("window longer than the record", "64 of 63 samples", "window_samples = 64 is longer", || Ok(Gates::new(WINDOW, 1, 0.0)?.count(63)? as f64)),
        E::refused("band beyond Nyquist", "55 to 130 MHz at 250 MHz", "band_hz", || Ok(Sampling::new(250e6, 80e6, 1.55e-6, (55e6, 130e6))?.period_s())),
        E::at_most("region beside the sector", "1 rad away", "windows in it, or a velocity", 0.0, beside),
        E::at_most("one NaN in a long record", "400 samples, 16 lags", "windows without it with other bits", 0.0, one_nan),
        E::refused("fit of a map without a wake", "a smooth wind of 3 m/s", "no vortex pair found", || fit(|line, gate| 3.0 + 0.3 * ((line * 7 + gate * 3) as f64).sin())),
        E::refused("fit of a map of NaN", "3720 cells", "0 of the map's velocities", || fit(|_, _| f64::NAN)),
    ]
}

/// What all estimators know; 10 dB.
fn methods() -> Result<Methods, Failure> {
    Methods::all(&Known { noise: NoiseModel::White, sigma_s: SIGMA_S, snr: 10.0 }, &[1])
}

fn model(noise: Noise) -> Result<WindowModel, Failure> {
    Ok(WindowModel::gaussian_pulse(&sampling()?, WINDOW, SIGMA_S, noise)?)
}

fn tone(velocity_m_s: f64) -> Result<Vec<f64>, Failure> {
    let s = sampling()?;
    let turn = TAU * s.frequency_hz(velocity_m_s) * s.period_s();
    Ok((0..WINDOW).map(|n| (turn * n as f64 + 0.4).cos()).collect())
}

fn broken(value: f64) -> Result<Vec<f64>, Failure> {
    let mut window = tone(1.0)?;
    window[10] = value;
    Ok(window)
}

/// One window as a map has it.
fn single(statistic: &dyn Statistic<f64>, estimator: &dyn Estimator, window: &[f64]) -> Result<MapPoint, Failure> {
    let gates = Gates::new(window.len(), 1, 2e-6)?;
    let records = Array2::from_shape_vec((1, window.len()), window.to_vec())?;
    let scan = Scan::new(statistic, &sampling()?, &gates, &[0.0], records.view())?;
    let point = PolarPoint { range_m: scan.geometry().gate_ranges_m()[0], elevation_rad: 0.0 };
    let map = scan.map(&[point], &Radius::Fixed { radius_m: 0.0 }, None, estimator)?;
    map.first().copied().ok_or_else(|| Failure::new("a map without points".into()))
}

/// What each method makes of a window, with its name; [`UNBIASED`] is left out.
fn all(methods: &Methods, window: &[f64]) -> Result<Vec<(&'static str, MapPoint)>, Failure> {
    let one =
        |m: &Method| Ok((m.name, single(methods.statistics[m.statistic].as_ref(), m.estimators[0].as_ref(), window)?));
    methods.methods.iter().filter(|m| m.name != UNBIASED).map(one).collect()
}

/// Of tones and of much signal its correlogram is not positive definite, and it must say so.
const UNBIASED: &str = "CA, unbiased AR(16)";

fn unbiased() -> Number {
    let methods = methods()?;
    let mut valid = 0;
    for method in methods.methods.iter().filter(|m| m.name == UNBIASED) {
        for velocity_m_s in TONES_M_S {
            let statistic = methods.statistics[method.statistic].as_ref();
            let found = single(statistic, method.estimators[0].as_ref(), &tone(velocity_m_s)?)?.estimate;
            valid += usize::from(found.flag != Quality::Invalid || !found.velocity_m_s.is_nan());
        }
    }
    Ok(valid as f64)
}

fn others(window: &[f64], flag: Quality) -> Number {
    let fine = |p: &MapPoint| p.estimate.flag == flag && p.estimate.velocity_m_s.is_nan();
    Ok(all(&methods()?, window)?.iter().filter(|(_, point)| !fine(point)).count() as f64)
}

fn nan_statistic() -> Number {
    let flag = |e: &dyn Estimator| e.estimate(&vec![f64::NAN; e.statistic_len()], &mut Scratch::new()).flag;
    Ok(methods()?.methods.iter().filter(|m| flag(m.estimators[0].as_ref()) != Quality::Invalid).count() as f64)
}

fn constant() -> Number {
    Ok(all(&methods()?, &[3.0; WINDOW])?.iter().filter(|(_, point)| point.estimate.is_good()).count() as f64)
}

fn amplitude(factor: f64) -> Number {
    let window = Windows::new(10.0)?.draw(0)?;
    let scaled: Vec<f64> = window.iter().map(|x| x * factor).collect();
    let methods = methods()?;
    let change = all(&methods, &window)?.into_iter().zip(all(&methods, &scaled)?).map(|(a, b)| {
        let change_m_s = (a.1.estimate.velocity_m_s - b.1.estimate.velocity_m_s).abs();
        if a.1.estimate.flag == b.1.estimate.flag { change_m_s } else { f64::INFINITY }
    });
    Ok(change.filter(|c| !c.is_nan()).fold(0.0, f64::max))
}

/// A moment takes the sidelobes along that the edges of the band cut off; of a tone a low order is chosen; 64 bins without
/// interpolation are 3 m/s wide.
const COARSE: [&str; 4] = ["first moment", "pulse pair", "CA, order by MDL", "PA, no interpolation"];

const TONES_M_S: [f64; 4] = [-14.0, -3.7, 0.0, 9.3];

fn tones(coarse: bool) -> Number {
    let (methods, mut worst) = (methods()?, 0.0_f64);
    for velocity_m_s in TONES_M_S {
        for (_, point) in
            all(&methods, &tone(velocity_m_s)?)?.iter().filter(|(name, _)| COARSE.contains(name) == coarse)
        {
            let error_m_s = (point.estimate.velocity_m_s - velocity_m_s).abs();
            worst = if error_m_s.is_nan() { f64::INFINITY } else { worst.max(error_m_s) };
        }
    }
    Ok(worst)
}

fn beyond_band() -> Number {
    let (methods, mut count) = (methods()?, 0);
    for velocity_m_s in [25.0, 40.0, 100.0] {
        let found = all(&methods, &tone(velocity_m_s)?)?;
        count += found.iter().filter(|(_, point)| point.estimate.flag != Quality::OutOfBand).count();
    }
    Ok(count as f64)
}

/// Windows of a uniform wind.
struct Windows(Air);

impl Windows {
    /// Of trials.
    const TRIALS: usize = 40;

    fn new(snr_db: f64) -> Result<Self, Failure> {
        Ok(Self(Air::new(NoiseModel::White, 200e-9, snr_db, 8)?))
    }

    fn draw(&self, trial: usize) -> Result<Vec<f64>, Failure> {
        let mut window = vec![0.0; WINDOW];
        let line = self.0.line(trial, Self::TRIALS).0;
        self.0.window(&line, trial, 0, &mut wakescope_signal::Scratch::default(), &mut window)?;
        Ok(window)
    }

    /// Velocities of every trial, and what each estimator finds.
    fn velocities(&self) -> Result<Vec<(f64, Vec<f64>)>, Failure> {
        let methods = methods()?;
        let one = |trial: usize| {
            let found =
                all(&methods, &self.draw(trial)?)?.iter().map(|(_, point)| point.estimate.velocity_m_s).collect();
            Ok((self.0.line(trial, Self::TRIALS).1, found))
        };
        (0..Self::TRIALS).map(one).collect()
    }
}

/// Share of the estimates within 3 m/s of the wind: of the estimator that `choose` prefers.
fn near(snr_db: f64, choose: fn(f64, f64) -> f64) -> Number {
    let found = Windows::new(snr_db)?.velocities()?;
    let of = |k: usize| found.iter().filter(|(wind, all)| (all[k] - wind).abs() < 3.0).count() as f64;
    let estimators = found.first().map_or(0, |(_, all)| all.len());
    Ok((0..estimators).map(of).reduce(choose).unwrap_or(f64::NAN) / Windows::TRIALS as f64)
}

fn fastest(snr_db: f64) -> Number {
    let found = Windows::new(snr_db)?.velocities()?;
    Ok(found.iter().flat_map(|(_, all)| all).map(|v| v.abs()).filter(|v| !v.is_nan()).fold(0.0, f64::max))
}

fn pulse_and_gate(full_width_s: f64) -> Number {
    const WINDOWS: usize = 100;
    let air = Air::new(NoiseModel::White, full_width_s, 10.0, 3)?;
    let model = GradientModel::new(&sampling()?, WINDOW, air.sigma_s(), Noise::White)?;
    let plan = GradientLikelihood::<f64>::new(&model, 10.0, &[0.0], 1024)?;
    let (line, velocity_m_s) = air.line(26, 40);
    let (mut scratch, mut signal) = (Scratch::new(), wakescope_signal::Scratch::default());
    let (mut window, mut one) = (vec![0.0; WINDOW], vec![0.0; plan.statistic.statistic_len()]);
    let mut mean = one.clone();
    for pulse in 0..WINDOWS {
        air.window(&line, 0, pulse, &mut signal, &mut window)?;
        plan.statistic.evaluate(&window, &mut scratch, &mut one);
        mean.iter_mut().zip(&one).for_each(|(sum, value)| *sum += value / WINDOWS as f64);
    }
    let found = plan.estimator.estimate(&mean, &mut scratch);
    let bound_m_s = model.bound(velocity_m_s, 0.0, 10.0, SignalKind::Real, WINDOWS as f64)?.velocity_alone_m_s;
    Ok((found.velocity_m_s - velocity_m_s).abs() / (4.0 * bound_m_s + 0.02))
}

fn bound(snr: f64) -> Number {
    Ok(model(Noise::White)?.bound_m_s(0.0, snr, SignalKind::Complex, 1.0)?)
}

fn beside() -> Number {
    let gates = Gates::new(WINDOW, 1, 2e-6)?;
    let records = Array2::from_elem((3, 200), 1.0);
    let statistic = Correlogram::<f64>::new(Weighting::Rectangular, WINDOW)?;
    let scan = Scan::new(&statistic, &sampling()?, &gates, &[0.0, 0.002, 0.004], records.view())?;
    let peak = SpectralPeak::new(&sampling()?, SignalKind::Real, WINDOW, 1024, Refinement::Parabola)?;
    let far = PolarPoint { range_m: 330.0, elevation_rad: 1.0 };
    let found = scan.map(&[far], &Radius::Fixed { radius_m: 1.3 }, None, &peak)?;
    Ok(found.iter().map(|p| p.level + usize::from(!p.estimate.velocity_m_s.is_nan())).sum::<usize>() as f64)
}

fn one_nan() -> Number {
    const BAD: usize = 200;
    let s = sampling()?;
    let gates = Gates::new(WINDOW, 1, 2e-6)?;
    let statistic = ShortCorrelogram::<f64>::new(WINDOW, 17)?;
    let model = AutoregressivePeak::new(&s, SignalKind::Real, 17, 16, 2048, Refinement::Parabola)?;
    let of = |bad: Option<f64>| -> Result<Vec<f64>, Failure> {
        let mut samples: Vec<f64> =
            (0..400).map(|n| (2.1 * f64::from(n)).cos() + 0.3 * (f64::from(n * n)).sin()).collect();
        if let Some(value) = bad {
            samples[BAD] = value;
        }
        let records = Array2::from_shape_vec((1, 400), samples)?;
        let scan = Scan::new(&statistic, &s, &gates, &[0.0], records.view())?;
        let points: Vec<PolarPoint> =
            scan.geometry().gate_ranges_m().iter().map(|&range_m| PolarPoint { range_m, elevation_rad: 0.0 }).collect();
        let map = scan.map(&points, &Radius::Fixed { radius_m: 0.0 }, None, &model)?;
        Ok(map.iter().map(|p| p.estimate.velocity_m_s).collect())
    };
    let (whole, spoilt) = (of(None)?, of(Some(f64::NAN))?);
    let holds = |gate: usize| (gate..gate + WINDOW).contains(&BAD);
    Ok((0..whole.len()).filter(|&g| !holds(g) && whole[g].to_bits() != spoilt[g].to_bits()).count() as f64)
}

/// The significance of nothing: a map that no wake has made.
fn fit(velocity: fn(usize, usize) -> f64) -> Number {
    let elevation_rad: Vec<f64> = (0..93).map(|i| 0.0025 * f64::from(i)).collect();
    let range_m: Vec<f64> = (0..40).map(|i| 296.0 + 6.0 * f64::from(i)).collect();
    let velocity_m_s = Array2::from_shape_fn((93, 40), |(line, gate)| velocity(line, gate));
    let map = VelocityMap {
        elevation_rad: &elevation_rad,
        range_m: &range_m,
        velocity_m_s: velocity_m_s.view(),
        standard_deviation_m_s: None,
    };
    let kernel = RangeKernel::gaussian_gate(SIGMA_S, &[1.0; WINDOW], 4e-9, 1.5)?;
    Ok(fit_map(&map, &WakeModel::default(), &kernel, &MapFitOptions::default())?.wake.left.circulation_m2_s)
}
