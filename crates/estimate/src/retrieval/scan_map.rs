//! One scan's map of radial velocities as any instrument gives it: a polar grid with holes.
//!
//! Check: impossible maps are refused with the field's name.

use ndarray::{Array2, s};

use crate::error::{Error, finite, length, positive};
use crate::vortex_fit::map_fit::data::{BlockMedians, block_means, median};
use crate::vortex_fit::{VelocityMap, Wake, WakeModel};

/// A map of radial velocities with the times of its lines.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanMap {
    /// Elevation of the lines \[rad\], increasing.
    pub elevation_rad: Vec<f64>,
    /// Time of each line \[s\], of any origin and in any order; NaN for all lines if unknown.
    pub time_s: Vec<f64>,
    /// Ranges of the gates \[m\], increasing.
    pub range_m: Vec<f64>,
    /// Radial velocities \[m/s\] \[line, gate\], positive away from the lidar; NaN where there is none.
    pub velocity_m_s: Array2<f64>,
    /// Their standard deviations \[m/s\], used as they are; if absent they are equal, and known from the residuals only.
    pub sigma_m_s: Option<Array2<f64>>,
    /// Velocities repeat after this width \[m/s\] (lambda F_s / 2, or the band): residuals are taken modulo it.
    pub fold_m_s: Option<f64>,
}

impl ScanMap {
    /// Checks shapes, axes and numbers, and counts the velocities.
    ///
    /// # Errors
    /// [`Error::Length`], [`Error::OutOfRange`] with the field at fault.
    pub fn validate(&self) -> Result<usize, Error> {
        let found = self.view().validate()?;
        length("time_s", self.elevation_rad.len(), self.time_s.len())?;
        if self.has_times() {
            self.time_s
                .iter()
                .try_for_each(|time| finite("time_s", *time))?;
        }
        self.fold_m_s
            .map_or(Ok(()), |fold| positive("fold_m_s", fold))?;
        Ok(found)
    }

    /// The map with velocities that repeat put about their median.
    pub(crate) fn unfolded(&self) -> Self {
        let mut unfolded = self.clone();
        if let Some(fold) = self.fold_m_s {
            let middle = median(
                &mut self
                    .velocity_m_s
                    .iter()
                    .copied()
                    .filter(|v| v.is_finite())
                    .collect::<Vec<f64>>(),
            );
            unfolded
                .velocity_m_s
                .mapv_inplace(|v| v - fold * ((v - middle) / fold).round());
        }
        unfolded
    }

    /// The map with velocities that repeat put about those of a wake.
    pub(crate) fn unfolded_about(&self, model: &WakeModel, wake: &Wake) -> Self {
        let mut unfolded = self.clone();
        let Some(fold) = self.fold_m_s else {
            return unfolded;
        };
        for ((line, gate), velocity) in unfolded.velocity_m_s.indexed_iter_mut() {
            let range_m = self.range_m[gate];
            let elevation_rad = self.elevation_rad[line];
            let away_m_s = *velocity - model.radial_velocity_m_s(wake, range_m, elevation_rad);
            *velocity -= fold * (away_m_s / fold).round();
        }
        unfolded
    }

    /// Medians over blocks of lines and gates, at most so many, which outliers do not move; nothing where there are not more velocities.
    pub(crate) fn medians(&self, most: usize) -> Option<Self> {
        let (by_line, by_gate) = self.view().blocks(most);
        if by_line * by_gate == 1 {
            return None;
        }
        let BlockMedians {
            elevation_rad,
            range_m,
            velocity_m_s,
            sigma_m_s,
        } = self.view().block_medians((by_line, by_gate));
        let time_s = block_means(&self.time_s, by_line);
        let fold_m_s = self.fold_m_s;
        let sigma_m_s = self.sigma_m_s.is_some().then_some(sigma_m_s);
        Some(Self {
            elevation_rad,
            time_s,
            range_m,
            velocity_m_s,
            sigma_m_s,
            fold_m_s,
        })
    }

    /// Every Nth line and gate of the map; a stride of 0 counts as 1.
    #[must_use]
    pub fn strided(&self, lines: usize, gates: usize) -> Self {
        let lines = lines.max(1);
        let gates = gates.max(1);
        let cells = s![..;lines, ..;gates];
        let sigma_m_s = self.sigma_m_s.as_ref();
        Self {
            elevation_rad: every_nth(&self.elevation_rad, lines),
            time_s: every_nth(&self.time_s, lines),
            range_m: every_nth(&self.range_m, gates),
            velocity_m_s: self.velocity_m_s.slice(cells).to_owned(),
            sigma_m_s: sigma_m_s.map(|sigma| sigma.slice(cells).to_owned()),
            fold_m_s: self.fold_m_s,
        }
    }

    /// Whether the lines have times.
    #[must_use]
    pub fn has_times(&self) -> bool {
        self.time_s.iter().any(|time| time.is_finite())
    }

    /// Times of the first and the last line \[s\]; infinite the wrong way round if they are unknown.
    pub(crate) fn ends_s(&self) -> (f64, f64) {
        self.time_s
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), t| {
                (a.min(*t), b.max(*t))
            })
    }

    /// How long the scan lasts \[s\]; 0 if times are unknown.
    #[must_use]
    pub fn lasts_s(&self) -> f64 {
        let (first_s, last_s) = self.ends_s();
        if self.has_times() {
            last_s - first_s
        } else {
            0.0
        }
    }

    /// Time in the middle of the scan \[s\], that of the wake of a fit; NaN if times are unknown.
    #[must_use]
    pub fn middle_s(&self) -> f64 {
        let (first_s, last_s) = self.ends_s();
        if self.has_times() {
            0.5 * (first_s + last_s)
        } else {
            f64::NAN
        }
    }

    /// Time of each line after the middle of the scan \[s\].
    #[must_use]
    pub fn after_middle_s(&self) -> Vec<f64> {
        let middle_s = self.middle_s();
        self.time_s.iter().map(|time_s| time_s - middle_s).collect()
    }

    /// The map for the fits that know no times.
    #[must_use]
    pub fn view(&self) -> VelocityMap<'_> {
        VelocityMap {
            elevation_rad: &self.elevation_rad,
            range_m: &self.range_m,
            velocity_m_s: self.velocity_m_s.view(),
            standard_deviation_m_s: self.sigma_m_s.as_ref().map(|sigma| sigma.view()),
        }
    }
}

fn every_nth(values: &[f64], stride: usize) -> Vec<f64> {
    values.iter().copied().step_by(stride).collect()
}
