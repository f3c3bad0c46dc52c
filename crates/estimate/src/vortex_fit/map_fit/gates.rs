//! What gates show in the mean of a wake that stands still or moves while it is scanned, with derivatives.
//!
//! Check: a wake that stands still is that of the map model; difference quotients; the reference maps.

use ndarray::Array2;

use crate::parallel::map_indexed;
use crate::vortex_fit::map_fit::prediction::{Predicted, Prediction, quotients};
use crate::vortex_fit::wake::free_parameters::gathered;
use crate::vortex_fit::wake::motion::Motion;
use crate::vortex_fit::wake::pair::Ray;
use crate::vortex_fit::wake::range_kernel::LineScratch;
use crate::vortex_fit::{PARAMETERS, RangeKernel, Wake, WakeModel};

/// Places of a map and the weight of their gates.
#[derive(Clone)]
pub(crate) struct Gates<'a> {
    pub(crate) model: &'a WakeModel,
    pub(crate) kernel: RangeKernel,
    pub(crate) elevation_rad: &'a [f64],
    pub(crate) range_m: &'a [f64],
    /// Seconds of each line after the time of the wake, if the vortices move.
    pub(crate) seconds: Option<Vec<f64>>,
    /// Whether all gates of a line share the points of the weight; else each has its own.
    pub(crate) shared_points: bool,
}

impl<'a> Gates<'a> {
    /// Of vortices that stand still.
    pub(crate) fn at_rest(
        model: &'a WakeModel,
        kernel: RangeKernel,
        (elevation_rad, range_m): (&'a [f64], &'a [f64]),
    ) -> Self {
        Self {
            model,
            kernel,
            elevation_rad,
            range_m,
            seconds: None,
            shared_points: true,
        }
    }

    /// Velocities \[m/s\] \[line, gate\] of a wake.
    pub(crate) fn velocities(&self, wake: &Wake) -> Array2<f64> {
        self.predict(&wake.to_array(), &[]).velocity_m_s
    }
}

impl Prediction for Gates<'_> {
    fn allows(&self, p: &[f64]) -> bool {
        self.model.allows(p)
    }

    fn of_other_profile(&self, wake: &Wake) -> Array2<f64> {
        let model = WakeModel {
            profile: self.model.profile.other(),
            ..*self.model
        };
        Gates {
            model: &model,
            ..self.clone()
        }
        .velocities(wake)
    }

    fn predict(&self, p: &[f64], groups: &[Vec<usize>]) -> Predicted {
        let (model, wake) = self.model.with(p);
        let moving = self
            .seconds
            .as_ref()
            .map(|seconds| (Motion::new(&model, &wake), seconds));
        let (own, secondary) =
            groups.split_at(groups.partition_point(|group| group[0] < PARAMETERS));
        let width = own.len() + 1;
        let lines = map_indexed(
            self.elevation_rad.len(),
            LineScratch::default,
            |scratch, line| {
                let ray = Ray::new(self.elevation_rad[line]);
                let moving = moving
                    .as_ref()
                    .map(|(motion, seconds)| (motion, seconds[line]));
                let now =
                    moving.map_or(wake, |(motion, seconds)| motion.wake_after(&wake, seconds));
                let mut numbers = vec![0.0; width * self.range_m.len()];
                let mut take = |gate: usize, velocity: f64, slope: &[f64; PARAMETERS]| {
                    let (first, slopes) = numbers[width * gate..][..width].split_at_mut(1);
                    first[0] = velocity;
                    if !own.is_empty() {
                        let mut slope = *slope;
                        if let Some((motion, seconds)) = moving {
                            motion.carry_back(seconds, &mut slope);
                        }
                        gathered(own, &slope, slopes);
                    }
                };
                let seen = (&model, &now, ray);
                let together = if self.shared_points {
                    self.range_m.len().max(1)
                } else {
                    1
                };
                for (part, range_m) in self.range_m.chunks(together).enumerate() {
                    let first = part * together;
                    self.kernel
                        .apply(seen, range_m, !own.is_empty(), scratch, |gate, v, s| {
                            take(first + gate, v, s)
                        });
                }
                numbers
            },
        );
        let size = (self.elevation_rad.len(), self.range_m.len());
        let column =
            |i: usize| Array2::from_shape_fn(size, |(line, gate)| lines[line][width * gate + i]);
        let velocity_m_s = column(0);
        let mut slopes: Vec<Array2<f64>> = (1..width).map(column).collect();
        slopes.extend(quotients(
            |p| self.predict(p, &[]).velocity_m_s,
            p,
            &velocity_m_s,
            secondary,
        ));
        Predicted {
            velocity_m_s,
            slopes,
        }
    }
}
