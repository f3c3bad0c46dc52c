//! The table of the limits of a grid for one telescope and one turbulence: what a set-up violates, and one that does not.

use super::Case;
use super::gaps::{Gaps, thin_layers};
use super::light::{Light, scatter_rad};
use super::violation::{Limit, SetUp, Violation, not_above, not_below};
use crate::air::structure::StructureTable;
use crate::beam::source::{beam_limits_m, slope_rad};
use crate::screens::grid::Grid;
use crate::theory::fresnel_number;
use crate::{Error, Layers, Turbulence};

/// Points along an axis up to which a plan keeps a margin in its spacing, and the most that it proposes.
const COMFORTABLE_POINTS: usize = 4096;
const LARGEST_POINTS: usize = 16384;
/// Share of the light that the border of a derived grid takes at most, by forecast: three quarters of what is doubtful.
const DERIVED_LOSS: f64 = 0.0075;
/// Share at which a run ends with an error; a little less, so that the run does not end where the plan went on.
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

    /// Width \[m\] at which the border takes three quarters of what is doubtful, at the spacing of a grid.
    pub(super) fn width_for_light_m(&self, grid: &Grid, range_m: &[f64]) -> Result<f64, Error> {
        Ok(not_below(
            self.light(range_m)?
                .width_m(DERIVED_LOSS, grid.largest_spacing_m()),
        ))
    }

    /// The table: what turbulence and the aperture demand of the spacing, beside what the beam demands of any grid
    /// ([`beam_limits_m`]); the largest that each accepts, and the largest to plan with \[m\].
    ///
    /// Where every range is in the far field, the pattern at the target is that of the aperture's few lowest waves, and a sixth
    /// of the points give the efficiency as well (within 1e-4 in free space). For the angles into which focus, tilt and
    /// turbulence send the beam the plan keeps a margin of two: what lies within it is left to the monitored border.
    fn spacings_m(&self, range_m: &[f64]) -> Result<([(Limit, f64); 2], f64), Error> {
        let Case {
            telescope,
            misalignment,
            turbulence,
            ..
        } = self.case;
        let (a, lambda) = (telescope.aperture_radius_m, telescope.wavelength_m);
        let fresnel = range_m
            .iter()
            .fold(0f64, |worst, &r| worst.max(fresnel_number(telescope, r)));
        let [planned, accepted] = if fresnel < FAR_FIELD {
            [4.0, 3.0]
        } else {
            [25.0, 12.5]
        };
        let scatter = scatter_rad(telescope, &turbulence.cn2, last(range_m)?)?;
        let slope = (slope_rad(telescope, misalignment) + 2.0 * scatter).max(1e-30);
        let planned_m = (a / planned).min(0.5 * lambda / slope);
        Ok((
            [
                (Limit::Aperture, a / accepted),
                (Limit::Scatter, lambda / slope),
            ],
            planned_m,
        ))
    }

    /// What a grid violates for these ranges, and the share of the light that its border takes.
    pub(super) fn verdict(
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
            limits_m.extend(self.spacings_m(range_m)?.0);
        }
        let (light, spacing_m, width_m) = (
            self.light(range_m)?,
            grid.largest_spacing_m(),
            grid.smallest_width_m(),
        );
        let light_lost = light.lost(width_m, spacing_m);
        if light_lost > LARGEST_LOSS {
            limits_m.push((Limit::Light, light.width_m(LARGEST_LOSS, spacing_m)));
        }
        let violated = |row| Violation::of(row, spacing_m, width_m);
        Ok((
            limits_m.into_iter().filter_map(violated).collect(),
            light_lost,
        ))
    }

    /// A grid for these ranges: with the spacing to plan with, or else with the largest that is accepted; with the border that takes next
    /// to nothing, or else with the narrowest that is accepted.
    pub(super) fn grid(&self, range_m: &[f64]) -> Result<Grid, Error> {
        let ([(_, aperture_m), (_, scatter_m)], mut planned_m) = self.spacings_m(range_m)?;
        let (accepted_m, light) = (aperture_m.min(scatter_m), self.light(range_m)?);
        // Half the inner scale if that costs no more than a factor of two.
        let Turbulence { spectrum, cn2 } = &self.case.turbulence;
        let fine_m = 2.96 / spectrum.inner_wavenumber_rad_m();
        if !cn2.is_none() && fine_m < planned_m && fine_m >= 0.5 * planned_m {
            planned_m = fine_m;
        }
        let grid = |spacing_m, loss| {
            self.grid_of(spacing_m, light.width_m(loss, spacing_m), last(range_m)?)
        };
        match grid(planned_m, DERIVED_LOSS) {
            Ok(grid) if grid.nx <= COMFORTABLE_POINTS => Ok(grid),
            _ => grid(accepted_m, DERIVED_LOSS).or_else(|_| grid(accepted_m, LARGEST_LOSS)),
        }
    }

    /// A grid of at most this spacing and at least this width that holds the beam to `furthest_m`.
    fn grid_of(
        &self,
        mut spacing_m: f64,
        mut width_m: f64,
        furthest_m: f64,
    ) -> Result<Grid, Error> {
        for (limit, limit_m) in
            beam_limits_m(&self.case.telescope, &self.case.misalignment, furthest_m)
        {
            match limit.is_spacing() {
                true => spacing_m = spacing_m.min(limit_m),
                false => width_m = width_m.max(not_below(limit_m)),
            }
        }
        let spacing_m = not_above(spacing_m);
        let points = good_size((width_m / spacing_m).ceil() as usize).max(128);
        if points > LARGEST_POINTS {
            let (needed, found) = (points as f64, LARGEST_POINTS as f64);
            let violations = vec![Violation {
                limit: Limit::Points,
                needed,
                found,
            }];
            return Err(Error::Sampling {
                violations,
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
        let good = |range_m: &&[f64]| {
            self.verdict(&grid, range_m)
                .is_ok_and(|(violations, _)| violations.is_empty())
        };
        runs.iter().all(good).then_some(SetUp {
            points: grid.nx,
            spacing_m: grid.dx_m,
            layers,
        })
    }

    /// How many equal layers to its last range are enough for every one of these lists of ranges; none if 1000 are not.
    pub(super) fn equal_layers(&self, runs: &[&[f64]]) -> Result<Option<usize>, Error> {
        let mut count = 1;
        for range_m in runs {
            count = count.max(self.thin_layers(range_m)?.end_m().len());
        }
        // What is enough for one may leave a gap in another.
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

/// The next size with only the factors 2, 3 and 5, even.
fn good_size(at_least: usize) -> usize {
    let rest = |n: usize| {
        [2, 3, 5].into_iter().fold(n, |mut rest, prime| {
            while rest % prime == 0 {
                rest /= prime;
            }
            rest
        })
    };
    (at_least.max(2)..)
        .find(|&n| n % 2 == 0 && rest(n) == 1)
        .unwrap_or(at_least)
}
