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

    /// The velocity and its slopes by the free numbers of the wake at each gate of a line, gate by gate; with a motion, the wake is
    /// given for the time `motion.1` \[s\] before that of the line.
    fn line_numbers(
        &self,
        (model, wake): (&WakeModel, &Wake),
        motion: Option<(&Motion, f64)>,
        elevation_rad: f64,
        groups: &[Vec<usize>],
        scratch: &mut LineScratch,
    ) -> Vec<f64> {
        let wake_then = motion.map_or(*wake, |(motion, seconds)| motion.wake_after(wake, seconds));
        let seen = (model, &wake_then, Ray::new(elevation_rad));
        let width = groups.len() + 1;
        let mut numbers = vec![0.0; width * self.range_m.len()];
        let together = if self.shared_points {
            self.range_m.len().max(1)
        } else {
            1
        };
        let parts = self.range_m.chunks(together);
        for (range_m, numbers) in parts.zip(numbers.chunks_mut(together * width)) {
            let has_slopes = !groups.is_empty();
            self.kernel.apply(
                seen,
                range_m,
                has_slopes,
                scratch,
                |gate, velocity, slope| {
                    let (first, slopes) = numbers[width * gate..][..width].split_at_mut(1);
                    first[0] = velocity;
                    if has_slopes {
                        let mut slope = *slope;
                        if let Some((motion, seconds)) = motion {
                            motion.carry_back(seconds, &mut slope);
                        }
                        gathered(groups, &slope, slopes);
                    }
                },
            );
        }
        numbers
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
                let motion = moving
                    .as_ref()
                    .map(|(motion, seconds)| (motion, seconds[line]));
                let elevation_rad = self.elevation_rad[line];
                self.line_numbers((&model, &wake), motion, elevation_rad, own, scratch)
            },
        );
        let size = (self.elevation_rad.len(), self.range_m.len());
        let velocity_m_s = column(&lines, size, width, 0);
        let mut slopes: Vec<Array2<f64>> = (1..width)
            .map(|index| column(&lines, size, width, index))
            .collect();
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

/// One of the `width` numbers that lines have for each gate, as a map of that size.
fn column(lines: &[Vec<f64>], size: (usize, usize), width: usize, index: usize) -> Array2<f64> {
    Array2::from_shape_fn(size, |(line, gate)| lines[line][width * gate + index])
}
