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
use crate::vortex_fit::{Baseband, CoreProfile, Vortex, Wake, WakeModel};
use crate::window::{SPEED_OF_LIGHT_M_S, Sampling, SignalKind};

/// Covariances below this fraction of the noise are neglected.
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
    /// Half-width of the power of the Gaussian pulse at 1/e \[s\].
    pub pulse_sigma_s: f64,
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
    /// detector band, 0 where there is no signal.
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

    /// The model with layers `thicker` times as thick as the rule allows.
    pub(crate) fn with_layers(
        setup: &ScanSetup,
        snr: impl Fn(f64, f64) -> f64,
        guess: &Wake,
        thicker: f64,
    ) -> Result<Self, Error> {
        guess.validate()?;
        positive("pulse_sigma_s", setup.pulse_sigma_s)?;
        finite("first_sample_time_s", setup.first_sample_time_s)?;
        for &elevation_rad in &setup.elevation_rad {
            finite("elevation_rad", elevation_rad)?;
        }
        not_empty("elevation_rad", setup.elevation_rad.len())?;
        let baseband = Baseband::new(&setup.sampling, setup.kind)?;
        let samples = baseband.samples(setup.record_samples)?;
        let interval_s = baseband.interval_s();
        let first_time_s = setup.first_sample_time_s + baseband.delay_s();
        // the first table serves to place the layers, the second has the lags that their SNR needs
        let probe = PairWeights::new(setup.pulse_sigma_s, interval_s, samples, 1.0);
        let cutter = Cutter {
            setup,
            guess,
            thicker,
            first_range_m: 0.5 * SPEED_OF_LIGHT_M_S * first_time_s,
            spacing_m: 0.25 * SPEED_OF_LIGHT_M_S * interval_s,
            samples,
            half: probe.half,
        };
        let (lines, largest_snr) = cutter.lines(&snr)?;
        positive("largest SNR", largest_snr)?;
        let cut = CUT / largest_snr.max(1.0);
        let weights = PairWeights::new(setup.pulse_sigma_s, interval_s, samples, cut);
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
            lines,
            guess: *guess,
            largest_snr,
        })
    }

    /// Whether the layers are still thin enough for a wake.
    pub(crate) fn covers(&self, wake: &Wake) -> bool {
        is_covered(&wake.left, &self.guess.left) && is_covered(&wake.right, &self.guess.right)
    }

    /// The model of some of the lines alone.
    pub(crate) fn with_lines(&self, keep: impl Fn(&Line) -> bool) -> Self {
        let kept = self.lines.iter().filter(|line| keep(line));
        let lines: Vec<Line> = kept.cloned().collect();
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

/// Whether layers for the vortex of a guess are thin enough for another one.
fn is_covered(vortex: &Vortex, guess: &Vortex) -> bool {
    // layers allow for cores that are smaller by a third, thus steeper
    let is_wide = vortex.core_radius_m >= guess.core_radius_m * 2.0 / 3.0;
    vortex.away_m(guess.place_m()) <= MARGIN_M && is_wide
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

    /// Lines of sight with their layers, and the largest SNR.
    fn lines(&self, snr: &dyn Fn(f64, f64) -> f64) -> Result<(Vec<Line>, f64), Error> {
        let mut largest_snr = 0.0;
        let mut lines = Vec::<Line>::new();
        let mut angles_rad = Vec::<f64>::new();
        for (ray, &elevation_rad) in self.setup.elevation_rad.iter().enumerate() {
            let known = angles_rad.iter().position(|angle| *angle == elevation_rad);
            if let Some(index) = known {
                lines[index].rays.push(ray);
                continue;
            }
            angles_rad.push(elevation_rad);
            lines.push(Line {
                ray: Ray::new(elevation_rad),
                layers: self.layers(elevation_rad, snr, &mut largest_snr)?,
                rays: vec![ray],
            });
        }
        Ok((lines, largest_snr))
    }

    /// Layers that the wake of the guess needs in the node interval about a point, a third of its core radius spare.
    fn parts(&self, range_m: f64, elevation_rad: f64) -> f64 {
        let place_m = self.setup.wake.position_m(range_m, elevation_rad);
        let steep: f64 = match self.setup.wake.profile {
            CoreProfile::Algebraic => 1.0,
            CoreProfile::LambOseen => 1.5,
        };
        let mut gradient_per_s = 0.0;
        for vortex in [&self.guess.left, &self.guess.right] {
            let away_m = vortex.away_m(place_m) - MARGIN_M - self.spacing_m;
            let core_m = vortex.core_radius_m * 2.0 / 3.0;
            let radius_m = away_m.max(2.0 * core_m / steep.sqrt());
            gradient_per_s += vortex.circulation_m2_s.abs() / (2.0 * PI * radius_m * radius_m);
        }
        let limit_m =
            self.setup.sampling.wavelength_m / (16.0 * self.setup.pulse_sigma_s * gradient_per_s);
        (self.spacing_m / (self.thicker * limit_m))
            .ceil()
            .clamp(1.0, MOST_LAYERS)
    }

    /// Layers of a line of sight; raises `largest_snr` to theirs.
    fn layers(
        &self,
        elevation_rad: f64,
        snr: &dyn Fn(f64, f64) -> f64,
        largest_snr: &mut f64,
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
                *largest_snr = largest_snr.max(ratio);
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
    let a = cubic(s - apart);
    let b = cubic(s + apart);
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
