//! Maps drawn towards a fitted wake, against the velocity weighted with the pulse and with pulse and window.

use fixtures::WINDOW;
use fixtures::pair::{PairCase, PairScan, STEP_RAD, truth};
use ndarray::{Array2, Axis};
use wakescope_estimate::vortex_fit::{
    EstimatorResponse, FreeParameters, MapFitOptions, RangeKernel, Sharing, SignalFitOptions,
    VelocityMap, Wake, WakeModel, fit_map_of_estimator, fit_signals,
};
use wakescope_estimate::{
    Correlogram, Error, estimators::*, map::*, spectrum::unweighted_lags, window::*,
};
use wakescope_les::winds::Sum;
use wakescope_les::{VortexPair, Wind};
use wakescope_signal::NoiseModel;

/// Radius of the regions \[m\].
const RADIUS_M: f64 = 2.0;
/// Grid of the kernels \[m\].
const GRID_M: f64 = 0.6;

/// Root-mean-square errors over scans: against the pulse's velocity within 8 m of a core and beyond 30 m, against the
/// gate's within 8 m.
#[derive(Debug, Default, Clone, Copy)]
struct Errors {
    squares: [f64; 3],
    counts: [f64; 3],
}

impl Errors {
    fn add(&mut self, scene: &PairScan, pulse_m_s: &Array2<f64>, gate_m_s: &Array2<f64>) {
        let all = pulse_m_s.iter().zip(gate_m_s).enumerate();
        for (i, (pulse, gate)) in all {
            let mut take = |place: usize, error: f64| {
                self.squares[place] += error * error;
                self.counts[place] += 1.0;
            };
            if scene.distance_m[i] < 8.0 {
                take(0, pulse - scene.v_pulse_m_s[i]);
                take(2, gate - scene.v_gate_m_s[i]);
            } else if scene.distance_m[i] > 30.0 {
                take(1, pulse - scene.v_pulse_m_s[i]);
            }
        }
    }

    fn rms(&self) -> [f64; 3] {
        [0, 1, 2].map(|k| (self.squares[k] / self.counts[k]).sqrt())
    }
}

struct Guided<'s> {
    scene: &'s PairScan,
    gate: RangeKernel,
    pulse: RangeKernel,
}

impl<'s> Guided<'s> {
    fn new(scene: &'s PairScan) -> Self {
        let (period_s, sigma_s) = (scene.sampling.period_s(), scene.sigma_s());
        let gate = RangeKernel::gaussian_gate(sigma_s, &[1.0; WINDOW], period_s, GRID_M).unwrap();
        // a window of one sample lies c T_s / 4 before the range of its gate
        let reach = (0.5 * SPEED_OF_LIGHT_M_S * 4.0 * sigma_s / GRID_M).ceil() as i64;
        let weight =
            |i: i64| (-(2.0 * i as f64 * GRID_M / SPEED_OF_LIGHT_M_S / sigma_s).powi(2)).exp();
        let weights: Vec<f64> = (-reach..=reach).map(weight).collect();
        let pulse = RangeKernel::new(-(reach as f64) * GRID_M, GRID_M, &weights).unwrap();
        Self { scene, gate, pulse }
    }

    fn scan(&self, records: &Array2<f64>, weighting: Weighting, lines: &[usize]) -> Scan {
        let statistic = Correlogram::<f64>::new(weighting, WINDOW).unwrap();
        let chosen = records.select(Axis(0), lines);
        let elevation_rad: Vec<f64> = lines
            .iter()
            .map(|&line| self.scene.elevation_rad[line])
            .collect();
        Scan::new(
            &statistic,
            &self.scene.sampling,
            &self.scene.gates,
            &elevation_rad,
            chosen.view(),
        )
        .unwrap()
    }

    fn map(&self, scan: &Scan, estimator: &dyn Estimator) -> Array2<f64> {
        let found = scan
            .map(
                &self.scene.points,
                &Radius::Fixed { radius_m: RADIUS_M },
                None,
                estimator,
            )
            .unwrap();
        let velocity = found.iter().map(|p| p.estimate.velocity_m_s).collect();
        Array2::from_shape_vec(
            (self.scene.elevation_rad.len(), self.scene.range_m.len()),
            velocity,
        )
        .unwrap()
    }

    /// The wake that fits the map of lag-window peaks, and with `signals` all raw signals after it.
    fn wake(&self, records: &Array2<f64>, signals: bool) -> Result<Wake, Error> {
        let all: Vec<usize> = (0..self.scene.elevation_rad.len()).collect();
        let (sampling, kind) = (&self.scene.sampling, SignalKind::Real);
        let setup = self.scene.setup().unwrap();
        let lag_window = LagWindowPeak::new(
            sampling,
            kind,
            &unweighted_lags(WINDOW),
            16,
            1024,
            Refinement::Parabola,
        )
        .unwrap();
        let velocity_m_s = self.map(&self.scan(records, Weighting::default(), &all), &lag_window);
        let map = VelocityMap {
            elevation_rad: &self.scene.elevation_rad,
            range_m: &self.scene.range_m,
            velocity_m_s: velocity_m_s.view(),
            standard_deviation_m_s: None,
        };
        let free = FreeParameters {
            core_radius: Sharing::Common,
            ..FreeParameters::common_circulation()
        };
        let options = MapFitOptions {
            free,
            ..Default::default()
        };
        let statistic = Correlogram::<f64>::new(Weighting::default(), WINDOW).unwrap();
        let shown = EstimatorResponse::new(
            &statistic,
            &lag_window,
            sampling,
            &setup.pulse,
            (setup.noise, self.scene.snr),
            RADIUS_M,
        )?;
        let mut found = fit_map_of_estimator(&map, &WakeModel::default(), &shown, &options)?.wake;
        if signals {
            let (snr, noise_a2) = (self.scene.snr, self.scene.noise_power_a2());
            let options = SignalFitOptions {
                free,
                ..Default::default()
            };
            found = fit_signals(
                &setup,
                |_, _| snr,
                records.view(),
                noise_a2,
                &found,
                &options,
            )?
            .wake;
        }
        Ok(found)
    }

    /// Maps against the pulse's and the gate's velocity, drawn towards a wake; towards rest without one.
    fn guided(
        &self,
        records: &Array2<f64>,
        wake: Option<&Wake>,
        options: &ShrinkageOptions,
    ) -> [Array2<f64>; 2] {
        let moment = FirstMoment::new(
            &self.scene.sampling,
            SignalKind::Real,
            &unweighted_lags(WINDOW),
            512,
            3.5,
        )
        .unwrap();
        let lines = self.scene.elevation_rad.len();
        let map = |lines: Vec<usize>| {
            self.map(&self.scan(records, Weighting::Rectangular, &lines), &moment)
        };
        let whole = map((0..lines).collect());
        let halves = [
            map((0..lines).step_by(2).collect()),
            map((1..lines).step_by(2).collect()),
        ];
        let half_difference = 0.5 * (&halves[0] - &halves[1]);
        let of = |kernel: &RangeKernel, radius_m: f64| match wake {
            Some(wake) => WakeModel::default()
                .map(
                    wake,
                    kernel,
                    &self.scene.elevation_rad,
                    &self.scene.range_m,
                    radius_m,
                )
                .unwrap(),
            None => Array2::zeros(whole.dim()),
        };
        let seen = of(&self.gate, RADIUS_M);
        [&self.pulse, &self.gate].map(|wanted| {
            let wanted = of(wanted, 0.0);
            shrink_to_guess(
                whole.view(),
                half_difference.view(),
                seen.view(),
                wanted.view(),
                options,
            )
            .unwrap()
            .velocity_m_s
        })
    }
}

fn scene(snr_db: f64) -> PairScan {
    PairScan::new(NoiseModel::BandLimited, 200e-9, snr_db, 3, 1).unwrap()
}

fn options(scene: &PairScan) -> ShrinkageOptions {
    let gate_spacing_m = scene.range_m[1] - scene.range_m[0];
    ShrinkageOptions::for_map(400.0 * STEP_RAD, gate_spacing_m, RADIUS_M, 15.0).unwrap()
}

/// Errors over scans of maps guided by a fit of the map, by one of all signals, by that fit alone, and of CA.
fn measured(
    scene: &PairScan,
    scans: std::ops::Range<usize>,
    signals: bool,
) -> Vec<(&'static str, Errors)> {
    let guided = Guided::new(scene);
    let shrunk = options(scene);
    let mut all = [
        "guided by the map",
        "guided by the signals",
        "wake alone",
        "first moment",
        "CA",
    ]
    .map(|name| (name, Errors::default()))
    .to_vec();
    for scan in scans {
        let records = scene.records(scan).unwrap();
        let by_map = guided.wake(&records, false).ok();
        let by_signals = if signals {
            guided.wake(&records, true).ok()
        } else {
            by_map
        };
        let unguided = ShrinkageOptions {
            factor: 0.0,
            ..shrunk
        };
        let nothing_else = ShrinkageOptions {
            factor: 1e9,
            ..shrunk
        };
        let runs = [
            (by_map, shrunk),
            (by_signals, shrunk),
            (by_signals, nothing_else),
            (None, unguided),
        ];
        for ((_, errors), (wake, options)) in all.iter_mut().zip(runs) {
            let [pulse, gate] = guided.guided(&records, wake.as_ref(), &options);
            errors.add(scene, &pulse, &gate);
        }
        let lines = (0..scene.elevation_rad.len()).collect::<Vec<_>>();
        let peak = ModelPeak::new(
            ModelReading::Spectrum,
            &scene.sampling,
            SignalKind::Real,
            WINDOW,
            16,
            2048,
            Refinement::Parabola,
        );
        let ca = guided.map(
            &guided.scan(&records, Weighting::Rectangular, &lines),
            &peak.unwrap(),
        );
        all[4].1.add(scene, &ca, &ca);
    }
    all
}

#[test]
fn a_map_guided_by_the_fit_of_its_signals_is_within_1_3_m_s_inside_and_better_than_ca_outside() {
    let scene = scene(0.0);
    let found = measured(&scene, 0..1, true);
    let ([inside, outside, gate], [.., ca_outside, _]) = (found[1].1.rms(), found[4].1.rms());
    assert!(
        inside < 1.3 && outside < ca_outside && gate < 0.9,
        "{found:?}"
    );
}

/// Two vortices that the fit does not know of come out of the data at 10 dB, somewhat blurred; the fitted wake alone
/// has nothing there.
#[test]
fn vortices_that_no_fit_knows_of_come_out_of_the_data() {
    let found = measured(&distorted(10.0), 0..1, false);
    let [guided, _, alone, data, ca] = [0, 1, 2, 3, 4].map(|k| found[k].1.rms());
    assert!(
        guided[0] < 0.65 * alone[0] && guided[0] < 0.65 * ca[0] && guided[0] < 2.0 * data[0],
        "{found:?}"
    );
    assert!(
        guided[1] < data[1] && guided[1] < ca[1] && guided[2] < 0.5 * alone[2],
        "{found:?}"
    );
}

/// `SCANS` and `SNR_DB` in the environment change the number of scans (4) and the signal-to-noise ratio (0),
/// `UNKNOWN` adds vortices that the fit does not know of, about which the errors are then taken.
///
/// `cargo test --release -p wakescope-tests --test it -- --ignored --nocapture errors_of_guided_maps`
#[test]
#[ignore = "minutes: measures errors over scans"]
fn errors_of_guided_maps_over_scans() {
    let number =
        |name, default: f64| std::env::var(name).map_or(default, |text| text.parse().unwrap());
    let (scans, snr_db) = (number("SCANS", 4.0) as usize, number("SNR_DB", 0.0));
    let scene = match std::env::var("UNKNOWN") {
        Ok(_) => distorted(snr_db),
        Err(_) => scene(snr_db),
    };
    let mut means = vec![(0.0, 0.0); 15];
    for scan in 0..scans {
        let found = measured(&scene, scan..scan + 1, true);
        for (k, (_, errors)) in found.iter().enumerate() {
            for (j, rms) in errors.rms().into_iter().enumerate() {
                means[3 * k + j].0 += rms * rms;
                means[3 * k + j].1 += rms.powi(4);
            }
        }
        let n = (scan + 1) as f64;
        for (k, (name, _)) in found.iter().enumerate() {
            let show = |j: usize| {
                let (mean, squares) = (means[3 * k + j].0 / n, means[3 * k + j].1 / n);
                let error = ((squares - mean * mean).max(0.0) / (n - 1.0).max(1.0)).sqrt()
                    / (2.0 * mean.sqrt());
                format!("{:.3} +- {error:.3}", mean.sqrt())
            };
            println!(
                "{n} scans, {name:<22} inside {}, outside {}, gate inside {}",
                show(0),
                show(1),
                show(2)
            );
        }
    }
}

/// The pair with a second, smaller one above it that no fit knows of; distances are those to the smaller one's cores.
fn distorted(snr_db: f64) -> PairScan {
    let pair = PairCase::FIGURES.even();
    let small = VortexPair {
        circulation_m2_s: 250.0,
        spacing_m: 25.0,
        lateral_position_m: 420.0,
        height_m: 80.0,
        ..pair
    };
    let winds: Vec<Box<dyn Wind>> = vec![
        Box::new(pair.wind().unwrap()),
        Box::new(small.wind().unwrap()),
    ];
    let (wind, noise) = (Sum { winds }, NoiseModel::BandLimited);
    let mut scene = PairScan::of_wind(&wind, &truth(), noise, (200e-9, snr_db), 3, 1).unwrap();
    for (point, distance_m) in scene.points.iter().zip(&mut scene.distance_m) {
        let (sin, cos) = point.elevation_rad.sin_cos();
        let to = |y_m: f64| (point.range_m * cos - y_m).hypot(point.range_m * sin - 80.0);
        let near_m = to(407.5).min(to(432.5));
        // outside is outside of both pairs
        let elsewhere = *distance_m > 30.0;
        *distance_m = if near_m < 8.0 || elsewhere {
            near_m
        } else {
            20.0
        };
    }
    scene
}
