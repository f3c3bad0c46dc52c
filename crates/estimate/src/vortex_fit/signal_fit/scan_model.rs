//! The model of all raw signals of a scan: how they were taken, and each line of sight cut into layers of air.
//!
//! Layers are thin where the velocity changes fast, near the vortices of a guess, by the rule of the signal model,
//! thickness <= lambda / (16 sigma g). Each layer is shared among four nodes (cubic interpolation in range of the smooth
//! weights of the pulse), which stand half a baseband sample apart. Check: the covariance of a line against the plain sum
//! over very thin layers.

use std::f64::consts::PI;

use crate::bound::Noise;
use crate::error::{Error, finite, not_empty, not_negative, positive};
use crate::vortex_fit::signal_fit::baseband::PowerGain;
use crate::vortex_fit::wake::pair::Ray;
use crate::vortex_fit::wake::pulse::PairWeights;
use crate::vortex_fit::{Baseband, CoreProfile, PulseShape, Vortex, Wake, WakeModel};
use crate::window::{SPEED_OF_LIGHT_M_S, Sampling, SignalKind};

/// Covariances below this part of the noise are left out.
const CUT: f64 = 1e-6;
/// The layers stay thin enough while the vortices are within this distance of the guess \[m\].
const MARGIN_M: f64 = 5.0;
/// The most layers between two nodes.
const MOST_LAYERS: f64 = 64.0;

/// How the signals of a scan were taken.
#[derive(Debug, Clone)]
pub struct ScanSetup {
    /// Sampling of the records.
    pub sampling: Sampling,
    /// Whether they are real or complex.
    pub kind: SignalKind,
    /// Spectrum of their noise.
    pub noise: Noise,
    /// The pulse.
    pub pulse: PulseShape,
    /// What is known of the wake.
    pub wake: WakeModel,
    /// Elevation of each ray (pulse) \[rad\], in any order.
    pub elevation_rad: Vec<f64>,
    /// Time of the first sample of a record after the middle of the pulse has left \[s\].
    pub first_sample_time_s: f64,
    /// Samples of a record.
    pub record_samples: usize,
}

/// A thin layer of air and what its return adds to four nodes.
#[derive(Debug, Clone)]
pub(crate) struct Layer {
    pub(crate) range_m: f64,
    /// First of the four nodes.
    pub(crate) node: usize,
    pub(crate) share: [f64; 4],
}

/// One line of sight.
#[derive(Debug, Clone)]
pub(crate) struct Line {
    pub(crate) ray: Ray,
    pub(crate) layers: Vec<Layer>,
    /// The rays (rows of the records) along it.
    pub(crate) rays: Vec<usize>,
}

/// Model of the raw signals of a scan near a guess of the wake.
#[derive(Debug, Clone)]
pub struct ScanModel {
    pub(crate) wake: WakeModel,
    pub(crate) baseband: Baseband,
    pub(crate) gain: PowerGain,
    pub(crate) weights: PairWeights,
    /// Covariance of the noise at each lag, for unit noise power in the band.
    pub(crate) noise: Vec<f64>,
    pub(crate) samples: usize,
    pub(crate) record_samples: usize,
    pub(crate) rays: usize,
    pub(crate) nodes: usize,
    pub(crate) lines: Vec<Line>,
    pub(crate) guess: Wake,
    pub(crate) largest_snr: f64,
}

impl ScanModel {
    /// The model for wakes near `guess`; `snr(range_m, elevation_rad)` is signal power over noise power in the
    /// detector band, 0 where no air is seen.
    ///
    /// # Errors
    /// [`Error::Empty`] without rays; [`Error::OutOfRange`] for an impossible guess, angle or SNR, or one that is 0
    /// everywhere; [`Error::WindowLongerThanRecord`] for records shorter than the filter; as [`Baseband::new`].
    pub fn new(
        setup: &ScanSetup,
        snr: impl Fn(f64, f64) -> f64,
        guess: &Wake,
    ) -> Result<Self, Error> {
        Self::with_layers(setup, snr, guess, 1.0)
    }

    /// The same with layers `thicker` times as thick as the rule allows.
    pub(crate) fn with_layers(
        setup: &ScanSetup,
        snr: impl Fn(f64, f64) -> f64,
        guess: &Wake,
        thicker: f64,
    ) -> Result<Self, Error> {
        guess.validate()?;
        finite("first_sample_time_s", setup.first_sample_time_s)?;
        setup
            .elevation_rad
            .iter()
            .try_for_each(|e| finite("elevation_rad", *e))?;
        not_empty("elevation_rad", setup.elevation_rad.len())?;
        let baseband = Baseband::new(&setup.sampling, setup.kind)?;
        let samples = baseband.samples(setup.record_samples)?;
        let interval_s = baseband.interval_s();
        let weights_of = |cut| PairWeights::new(&setup.pulse, interval_s, samples, cut);
        // the first table serves to place the layers, the second has the lags that their SNR needs
        let probe = weights_of(1.0);
        let cutter = Cutter {
            setup,
            guess,
            thicker,
            first_range_m: 0.5
                * SPEED_OF_LIGHT_M_S
                * (setup.first_sample_time_s + baseband.delay_s()),
            spacing_m: 0.25 * SPEED_OF_LIGHT_M_S * interval_s,
            samples,
            half: probe.half,
        };
        let mut largest = 0.0;
        let mut lines = Vec::<(f64, Line)>::new();
        for (ray, &elevation_rad) in setup.elevation_rad.iter().enumerate() {
            match lines.iter_mut().find(|(angle, _)| *angle == elevation_rad) {
                Some((_, line)) => line.rays.push(ray),
                None => {
                    let layers = cutter.layers(elevation_rad, &snr, &mut largest)?;
                    lines.push((
                        elevation_rad,
                        Line {
                            ray: Ray::new(elevation_rad),
                            layers,
                            rays: vec![ray],
                        },
                    ));
                }
            }
        }
        positive("largest SNR", largest)?;
        let weights = weights_of(CUT / largest.max(1.0));
        Ok(Self {
            wake: setup.wake,
            gain: baseband.power_gain(),
            noise: baseband.noise_covariance(setup.noise, weights.lags),
            baseband,
            weights,
            samples,
            record_samples: setup.record_samples,
            rays: setup.elevation_rad.len(),
            nodes: 2 * samples - 1 + 2 * cutter.pad(),
            lines: lines.into_iter().map(|(_, line)| line).collect(),
            guess: *guess,
            largest_snr: largest,
        })
    }

    /// Whether the layers are still thin enough for a wake.
    pub(crate) fn covers(&self, wake: &Wake) -> bool {
        // steeper cores are those smaller than the third to spare
        let covers = |a: &Vortex, b: &Vortex| {
            a.away_m(b.place_m()) <= MARGIN_M && a.core_radius_m >= b.core_radius_m * 2.0 / 3.0
        };
        covers(&wake.left, &self.guess.left) && covers(&wake.right, &self.guess.right)
    }

    /// The model of some of the lines alone.
    pub(crate) fn of_lines(&self, keep: impl Fn(&Line) -> bool) -> Self {
        let lines: Vec<Line> = self
            .lines
            .iter()
            .filter(|line| keep(line))
            .cloned()
            .collect();
        Self {
            rays: lines.iter().map(|line| line.rays.len()).sum(),
            lines,
            ..self.clone()
        }
    }

    /// Whether a line of another model of the same scan is one of this model.
    pub(crate) fn has(&self, line: &Line) -> bool {
        self.lines.iter().any(|own| own.rays == line.rays)
    }
}

/// Cuts lines of sight into layers.
struct Cutter<'a> {
    setup: &'a ScanSetup,
    guess: &'a Wake,
    thicker: f64,
    /// Range of the first baseband sample.
    first_range_m: f64,
    /// Distance of the nodes.
    spacing_m: f64,
    samples: usize,
    /// Nodes that the pulse reaches beyond the record.
    half: usize,
}

impl Cutter<'_> {
    /// Nodes before that of the first sample.
    fn pad(&self) -> usize {
        self.half + 2
    }

    /// Layers that the wake of the guess needs in the node interval about a point, a third of its core radius spare.
    fn parts(&self, range_m: f64, elevation_rad: f64) -> f64 {
        let place_m = self.setup.wake.position_m(range_m, elevation_rad);
        let steep: f64 = match self.setup.wake.profile {
            CoreProfile::Algebraic => 1.0,
            CoreProfile::LambOseen => 1.5,
        };
        let gradient_per_s: f64 = [&self.guess.left, &self.guess.right]
            .iter()
            .map(|vortex| {
                let away_m = vortex.away_m(place_m) - MARGIN_M - self.spacing_m;
                let core_m = vortex.core_radius_m * 2.0 / 3.0;
                let radius_m = away_m.max(2.0 * core_m / steep.sqrt());
                vortex.circulation_m2_s.abs() / (2.0 * PI * radius_m * radius_m)
            })
            .sum();
        let limit_m =
            self.setup.sampling.wavelength_m / (16.0 * self.setup.pulse.sigma_s * gradient_per_s);
        (self.spacing_m / (self.thicker * limit_m))
            .ceil()
            .clamp(1.0, MOST_LAYERS)
    }

    fn layers(
        &self,
        elevation_rad: f64,
        snr: &impl Fn(f64, f64) -> f64,
        largest: &mut f64,
    ) -> Result<Vec<Layer>, Error> {
        let mut layers = Vec::new();
        // intervals between nodes that the pulse reaches from the first to the last sample
        let reach = self.half as i64;
        for interval in -reach..2 * self.samples as i64 - 2 + reach {
            let middle_m = self.first_range_m + (interval as f64 + 0.5) * self.spacing_m;
            let parts = self.parts(middle_m, elevation_rad);
            for part in 0..parts as usize {
                let s = (part as f64 + 0.5) / parts;
                let range_m = self.first_range_m + (interval as f64 + s) * self.spacing_m;
                let ratio = snr(range_m, elevation_rad);
                not_negative("snr", ratio)?;
                *largest = largest.max(ratio);
                if range_m > 0.0 && ratio > 0.0 {
                    let node = (interval + self.pad() as i64 - 1) as usize;
                    layers.push(Layer {
                        range_m,
                        node,
                        share: mean_cubic(s, 0.5 / parts).map(|w| w * ratio / parts),
                    });
                }
            }
        }
        Ok(layers)
    }
}

/// Mean of the weights over s - half .. s + half (two points of Gauss and Legendre are exact for cubics): neighbouring
/// layers of different thickness then join without an error of the midpoint rule.
fn mean_cubic(s: f64, half: f64) -> [f64; 4] {
    let apart = half / 3.0_f64.sqrt();
    let (a, b) = (cubic(s - apart), cubic(s + apart));
    std::array::from_fn(|i| 0.5 * (a[i] + b[i]))
}

/// Lagrange's weights of the nodes -1, 0, 1, 2 for a point s between 0 and 1.
fn cubic(s: f64) -> [f64; 4] {
    [
        -s * (s - 1.0) * (s - 2.0) / 6.0,
        (s + 1.0) * (s - 1.0) * (s - 2.0) / 2.0,
        -(s + 1.0) * s * (s - 2.0) / 2.0,
        (s + 1.0) * s * (s - 1.0) / 6.0,
    ]
}
