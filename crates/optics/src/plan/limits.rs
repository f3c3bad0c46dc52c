//! The table of the limits of a grid for one telescope and one turbulence: the violations of a
//! set-up, and a set-up without any.

use super::Case;
use super::gaps::{Gaps, thin_layers};
use super::light::{Light, scatter_rad};
use super::violation::{Limit, SetUp, Violation, not_above, not_below, violations_of};
use crate::air::structure::StructureTable;
use crate::beam::source::{beam_limits_m, slope_rad};
use crate::screens::grid::Grid;
use crate::theory::fresnel_number;
use crate::{Error, Layers, Turbulence};

/// Largest number of points along an axis with which a plan has a margin in its spacing.
const COMFORTABLE_POINTS: usize = 4096;
/// Largest number of points along an axis that a plan proposes.
const LARGEST_POINTS: usize = 16384;
/// Largest forecast fraction of the light that the border of a derived grid absorbs: three quarters
/// of [`DOUBTFUL_LOSS`](super::DOUBTFUL_LOSS).
const DERIVED_LOSS: f64 = 0.0075;
/// Largest forecast fraction that a plan accepts: a little less than that at which a run
/// ends with an error.
const LARGEST_LOSS: f64 = 0.04;
/// Fresnel number below which the whole path is in the far field of the aperture.
const FAR_FIELD: f64 = 0.2;

/// A case with what its limits need, computed once.
pub(super) struct Limits<'a> {
    pub(super) case: &'a Case,
    table: StructureTable,
}

impl<'a> Limits<'a> {
    pub(super) fn new(case: &'a Case) -> Result<Self, Error> {
        case.telescope.validated()?;
        case.misalignment.validated()?;
        case.turbulence.cn2.clone().validated()?;
        Ok(Self {
            case,
            table: StructureTable::new(&*case.turbulence.spectrum),
        })
    }

    /// What layers do to the mean at these ranges.
    pub(super) fn gaps(&self, range_m: &[f64]) -> Result<Gaps<'_>, Error> {
        let Case {
            telescope,
            turbulence,
            realisations,
            ..
        } = self.case;
        Gaps::new(
            telescope,
            &turbulence.cn2,
            &self.table,
            range_m,
            *realisations,
        )
    }

    /// Equal layers to the last of these ranges, each thin against diffraction.
    pub(super) fn thin_layers(&self, range_m: &[f64]) -> Result<Layers, Error> {
        thin_layers(
            &self.case.turbulence.cn2,
            self.case.telescope.wavelength_m,
            last(range_m)?,
        )
    }

    /// Tails of the beam out to the furthest range.
    fn light(&self, range_m: &[f64]) -> Result<Light, Error> {
        let Case {
            telescope,
            misalignment,
            turbulence,
            ..
        } = self.case;
        Light::new(
            telescope,
            misalignment,
            &turbulence.cn2,
            &self.table,
            last(range_m)?,
        )
    }

    /// Width \[m\] at which the border absorbs [`DERIVED_LOSS`] of the light, at the
    /// spacing of a grid.
    pub(super) fn width_for_light_m(&self, grid: &Grid, range_m: &[f64]) -> Result<f64, Error> {
        Ok(not_below(
            self.light(range_m)?
                .width_m(DERIVED_LOSS, grid.largest_spacing_m()),
        ))
    }

    /// Spacings that resolve the beam at these ranges \[m\]: the largest to plan with, and the
    /// largest that is accepted.
    ///
    /// If every range is in the far field, the pattern at the target is that of the aperture's few
    /// lowest waves, and a sixth of the points give the efficiency as well (within 1e-4 in free
    /// space).
    fn aperture_spacings_m(&self, range_m: &[f64]) -> [f64; 2] {
        let telescope = &self.case.telescope;
        let fresnel = range_m
            .iter()
            .fold(0f64, |worst, &r| worst.max(fresnel_number(telescope, r)));
        let points = if fresnel < FAR_FIELD {
            [4.0, 3.0]
        } else {
            [25.0, 12.5]
        };
        points.map(|points| telescope.aperture_radius_m / points)
    }

    /// Largest spacing that holds the angles into which focus, tilt and turbulence send the beam
    /// \[m\]. A plan has a margin of two; the monitored border covers what lies within it.
    fn scatter_spacing_m(&self, range_m: &[f64]) -> Result<f64, Error> {
        let Case {
            telescope,
            misalignment,
            turbulence,
            ..
        } = self.case;
        let scatter = scatter_rad(telescope, &turbulence.cn2, last(range_m)?)?;
        let slope = (slope_rad(telescope, misalignment) + 2.0 * scatter).max(1e-30);
        Ok(telescope.wavelength_m / slope)
    }

    /// Violations of a grid by a run to these ranges, and the forecast of the fraction of the light
    /// that its border absorbs.
    pub(super) fn examine(
        &self,
        grid: &Grid,
        range_m: &[f64],
    ) -> Result<(Vec<Violation>, f64), Error> {
        let grid = grid.validated()?;
        let Case {
            telescope,
            misalignment,
            turbulence,
            ..
        } = self.case;
        let mut limits_m = beam_limits_m(telescope, misalignment, last(range_m)?).to_vec();
        if !turbulence.cn2.is_none() {
            let [_, accepted_m] = self.aperture_spacings_m(range_m);
            limits_m.push((Limit::Aperture, accepted_m));
            limits_m.push((Limit::Scatter, self.scatter_spacing_m(range_m)?));
        }
        let light = self.light(range_m)?;
        let spacing_m = grid.largest_spacing_m();
        let light_lost = light.lost(grid.smallest_width_m(), spacing_m);
        if light_lost > LARGEST_LOSS {
            limits_m.push((Limit::Light, light.width_m(LARGEST_LOSS, spacing_m)));
        }
        let violations =
            violations_of(&limits_m, grid.largest_spacing_m(), grid.smallest_width_m());
        Ok((violations, light_lost))
    }

    /// A grid for these ranges. Its spacing is the one to plan with, or else the largest that is
    /// accepted; its border absorbs [`DERIVED_LOSS`] at most, or else [`LARGEST_LOSS`].
    pub(super) fn grid(&self, range_m: &[f64]) -> Result<Grid, Error> {
        let [planned_m, accepted_m] = self.aperture_spacings_m(range_m);
        let scatter_m = self.scatter_spacing_m(range_m)?;
        let mut planned_m = planned_m.min(0.5 * scatter_m);
        let accepted_m = accepted_m.min(scatter_m);
        let light = self.light(range_m)?;
        // Half the inner scale if that costs no more than a factor of two.
        let Turbulence { spectrum, cn2 } = &self.case.turbulence;
        let fine_m = 2.96 / spectrum.inner_wavenumber_rad_m();
        if !cn2.is_none() && fine_m < planned_m && fine_m >= 0.5 * planned_m {
            planned_m = fine_m;
        }
        let furthest_m = last(range_m)?;
        let narrow_m = light.width_m(DERIVED_LOSS, planned_m);
        match self.smallest_grid(planned_m, narrow_m, furthest_m) {
            Ok(grid) if grid.nx <= COMFORTABLE_POINTS => return Ok(grid),
            _ => {}
        }
        let derived_m = light.width_m(DERIVED_LOSS, accepted_m);
        if let Ok(grid) = self.smallest_grid(accepted_m, derived_m, furthest_m) {
            return Ok(grid);
        }
        let narrowest_m = light.width_m(LARGEST_LOSS, accepted_m);
        self.smallest_grid(accepted_m, narrowest_m, furthest_m)
    }

    /// The grid of fewest points with at most this spacing and at least this width that holds the
    /// beam to `furthest_m`.
    fn smallest_grid(
        &self,
        mut spacing_m: f64,
        mut width_m: f64,
        furthest_m: f64,
    ) -> Result<Grid, Error> {
        for (limit, limit_m) in
            beam_limits_m(&self.case.telescope, &self.case.misalignment, furthest_m)
        {
            if limit.is_spacing() {
                spacing_m = spacing_m.min(limit_m);
            } else {
                width_m = width_m.max(not_below(limit_m));
            }
        }
        let spacing_m = not_above(spacing_m);
        let points = good_size((width_m / spacing_m).ceil() as usize).max(128);
        if points > LARGEST_POINTS {
            return Err(Error::Sampling {
                violations: vec![Violation {
                    limit: Limit::Points,
                    needed: points as f64,
                    found: LARGEST_POINTS as f64,
                }],
                would_do: None,
            });
        }
        Grid::square(points, spacing_m)
    }

    /// A set-up of equal layers that holds for every one of these lists of ranges, tried on each.
    pub(super) fn set_up(&self, runs: &[&[f64]]) -> Option<SetUp> {
        let mut all: Vec<f64> = runs.concat();
        all.sort_by(f64::total_cmp);
        all.dedup();
        let grid = self.grid(&all).ok()?;
        let layers = self.equal_layers(runs).ok()??;
        for range_m in runs {
            let (violations, _) = self.examine(&grid, range_m).ok()?;
            if !violations.is_empty() {
                return None;
            }
        }
        Some(SetUp {
            points: grid.nx,
            spacing_m: grid.dx_m,
            layers,
        })
    }

    /// Number of equal layers to its last range that is enough for each of these lists of ranges;
    /// none if 1000 are not.
    pub(super) fn equal_layers(&self, runs: &[&[f64]]) -> Result<Option<usize>, Error> {
        let mut count = 1;
        for range_m in runs {
            count = count.max(self.thin_layers(range_m)?.end_m().len());
        }
        // A number that is enough for one list may leave a gap in another.
        loop {
            let before = count;
            for range_m in runs {
                match self.gaps(range_m)?.equal_layers(count, last(range_m)?)? {
                    Some(enough) => count = enough,
                    None => return Ok(None),
                }
            }
            if count == before {
                return Ok(Some(count));
            }
        }
    }
}

/// The last of a list of ranges.
pub(super) fn last(range_m: &[f64]) -> Result<f64, Error> {
    range_m.last().copied().ok_or(Error::Length {
        field: "range_m",
        found: 0,
        expected: 1,
    })
}

/// The next even size with only the factors 2, 3 and 5.
fn good_size(at_least: usize) -> usize {
    (at_least.max(2)..)
        .find(|&n| n % 2 == 0 && is_smooth(n))
        .unwrap_or(at_least)
}

/// Whether a number has only the factors 2, 3 and 5.
fn is_smooth(n: usize) -> bool {
    let mut rest = n;
    for prime in [2, 3, 5] {
        while rest.is_multiple_of(prime) {
            rest /= prime;
        }
    }
    rest == 1
}
