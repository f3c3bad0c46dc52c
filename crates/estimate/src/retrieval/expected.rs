//! What the gates of a scan show of a wake that moves while it is scanned, with derivatives.
//!
//! Check: a wake that stands still is that of the map model; difference quotients; the reference maps.

use crate::error::Error;
use crate::retrieval::motion::Motion;
use crate::retrieval::{Gate, Movement, RetrievalOptions, ScanMap};
use crate::vortex_fit::wake::pair::Ray;
use crate::vortex_fit::wake::range_kernel::LineScratch;
use crate::vortex_fit::{PARAMETERS, RangeKernel, Wake, WakeModel};

/// A Gaussian weight is cut off after so many standard deviations, and sampled at so many points at last.
const REACH: f64 = 3.5;
const POINTS: usize = 41;
/// A search is content with points so many times as far apart.
const COARSER: usize = 2;

/// Geometry, times and gates of a scan.
#[derive(Clone)]
pub(crate) struct Expected<'a> {
    pub(crate) model: &'a WakeModel,
    pub(crate) kernel: RangeKernel,
    pub(crate) map: &'a ScanMap,
    /// Seconds of each line after the reference time, if the vortices move.
    seconds: Option<Vec<f64>>,
    pub(crate) reference_time_s: f64,
    /// Whether gates lie on one grid with the points of the weight.
    uniform: bool,
}

impl<'a> Expected<'a> {
    /// For the search of a wake, with few points.
    pub(crate) fn rough(map: &'a ScanMap, options: &'a RetrievalOptions) -> Result<Self, Error> {
        Self::on_grid(map, options, COARSER)
    }

    /// For the way to the end of a fit: the points of a Gaussian weight lie on one grid with the gates, which is quick, `coarser` times as far
    /// apart as in the end at most.
    pub(crate) fn on_grid(map: &'a ScanMap, options: &'a RetrievalOptions, coarser: usize) -> Result<Self, Error> {
        options.gate.validate(&map.range_m)?;
        let step_m = uniform_step_m(&map.range_m);
        let kernel = match &options.gate {
            Gate::Gaussian { std_m } if *std_m > 0.0 => {
                let longest_m = coarser as f64 * 2.0 * REACH * std_m / (POINTS - 1) as f64;
                let spacing_m = step_m.map_or(longest_m, |step| step / (step / longest_m).ceil());
                gaussian(*std_m, spacing_m, (REACH * std_m / spacing_m).ceil() as usize)?
            }
            Gate::Kernel(kernel) => kernel.coarser(coarser),
            Gate::Point | Gate::Gaussian { .. } => RangeKernel::new(0.0, step_m.unwrap_or(1.0), &[1.0])?,
        };
        let ((first_s, last_s), reference_time_s) = (map.ends_s(), map.middle_s());
        let moves = options.movement != Movement::Frozen && map.has_times() && last_s > first_s;
        let seconds = moves.then(|| map.after_middle_s());
        let uniform = step_m.is_some();
        Ok(Self { model: &options.model, kernel, map, seconds, reference_time_s, uniform })
    }

    /// For the end of a fit: every gate has its own points, each at its place.
    pub(crate) fn fine(&self, options: &RetrievalOptions) -> Result<Self, Error> {
        let mut fine = self.clone();
        if let Gate::Kernel(kernel) = &options.gate {
            fine.kernel = kernel.clone();
        }
        if let Gate::Gaussian { std_m } = options.gate
            && std_m > 0.0
        {
            fine.kernel = gaussian(std_m, 2.0 * REACH * std_m / (POINTS - 1) as f64, POINTS / 2)?;
            fine.uniform = false;
        }
        Ok(fine)
    }

    /// The same with vortices that stand still.
    pub(crate) fn frozen(&self) -> Self {
        Self { seconds: None, ..self.clone() }
    }

    pub(crate) fn moves(&self) -> bool {
        self.seconds.is_some()
    }

    /// How the vortices of a wake move, if they do.
    pub(crate) fn motion(&self, wake: &Wake) -> Option<Motion> {
        self.seconds.as_ref().map(|_| Motion::new(self.model, wake))
    }

    /// The velocities of a line, with `slopes` their derivatives: `out(gate, velocity, derivatives)`.
    pub(crate) fn line(
        &self,
        (wake, motion, line): (&Wake, Option<&Motion>, usize),
        slopes: bool,
        scratch: &mut LineScratch,
        mut out: impl FnMut(usize, f64, &[f64; PARAMETERS]),
    ) {
        let ray = Ray::new(self.map.elevation_rad[line]);
        let moving = motion.zip(self.seconds.as_ref().map(|seconds| seconds[line]));
        let now = moving.map_or(*wake, |(motion, seconds)| motion.wake_after(wake, seconds));
        let mut take = |gate: usize, velocity: f64, slope: &[f64; PARAMETERS]| {
            let mut slope = *slope;
            if let Some((motion, seconds)) = moving.filter(|_| slopes) {
                motion.carry_back(seconds, &mut slope);
            }
            out(gate, velocity, &slope);
        };
        let ranges = &self.map.range_m;
        if self.uniform {
            self.kernel.apply((self.model, &now, ray), ranges, slopes, scratch, take);
        } else {
            for (gate, range_m) in ranges.iter().enumerate() {
                let range_m = std::slice::from_ref(range_m);
                self.kernel.apply((self.model, &now, ray), range_m, slopes, scratch, |_, v, s| take(gate, v, s));
            }
        }
    }
}

/// A Gaussian weight of so many points on either side.
fn gaussian(std_m: f64, spacing_m: f64, points: usize) -> Result<RangeKernel, Error> {
    let weight = |i: usize| (-0.5 * ((i as f64 - points as f64) * spacing_m / std_m).powi(2)).exp();
    let weights: Vec<f64> = (0..=2 * points).map(weight).collect();
    RangeKernel::new(-(points as f64) * spacing_m, spacing_m, &weights)
}

/// Distance of the gates if it is the same everywhere.
fn uniform_step_m(range_m: &[f64]) -> Option<f64> {
    let (first, last) = (range_m.first()?, range_m.last()?);
    let step = (last - first) / (range_m.len() - 1) as f64;
    let even = range_m.iter().enumerate().all(|(i, r)| (r - first - i as f64 * step).abs() < 1e-4 * step);
    (even && step > 0.0).then_some(step)
}
