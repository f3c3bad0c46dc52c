//! The limits of a grid for one telescope and one turbulence: what a set-up violates, and one that does not.

use super::case::Case;
use super::gaps::{Gaps, thin_layers};
use super::light::{Light, scatter_rad};
use super::violation::{Limit, SetUp, Violation, not_above, not_below};
use crate::air::cn2::Cn2Path;
use crate::air::structure::StructureTable;
use crate::beam::source::{grid_violations, slope_rad};
use crate::screens::grid::Grid;
use crate::theory::fresnel_number;
use crate::{Error, Misalignment, Telescope, Turbulence};

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
    pub(super) telescope: Telescope,
    pub(super) misalignment: Misalignment,
    pub(super) turbulence: &'a Turbulence,
    pub(super) cn2: Cn2Path,
    pub(super) table: StructureTable,
    realisations: usize,
}

/// What a grid violates, and the light that its border takes.
pub(super) struct Verdict {
    pub(super) violations: Vec<Violation>,
    pub(super) light_lost: f64,
}

impl<'a> Limits<'a> {
    pub(super) fn new(case: &'a Case) -> Result<Self, Error> {
        Ok(Self {
            telescope: case.telescope.validated()?,
            misalignment: case.misalignment.validated()?,
            turbulence: &case.turbulence,
            cn2: case.turbulence.cn2.clone().validated()?,
            table: StructureTable::new(&*case.turbulence.spectrum),
            realisations: case.realisations,
        })
    }

    /// What layers do to the mean at these ranges.
    pub(super) fn gaps(&self, range_m: &[f64]) -> Result<Gaps<'_>, Error> {
        Gaps::new(&self.telescope, &self.cn2, &self.table, range_m, self.realisations)
    }

    /// Tails of the beam out to the furthest range.
    fn light(&self, range_m: &[f64]) -> Result<Light, Error> {
        Light::new(&self.telescope, &self.misalignment, &self.cn2, &self.table, last(range_m)?)
    }

    /// Width \[m\] at which the border takes three quarters of what is doubtful, at the spacing of a grid.
    pub(super) fn width_for_light_m(&self, grid: &Grid, range_m: &[f64]) -> Result<f64, Error> {
        Ok(not_below(self.light(range_m)?.width_m(DERIVED_LOSS, grid.dx_m.max(grid.dy_m))))
    }

    /// Spacings \[m\] that the aperture wants: the one to plan with, and the largest that is accepted.
    ///
    /// Where every range is in the far field, the pattern at the target is that of the aperture's few lowest waves, and a sixth
    /// of the points give the efficiency as well (within 1e-4 in free space).
    fn aperture_spacings_m(&self, range_m: &[f64]) -> [f64; 2] {
        let fresnel = range_m.iter().fold(0f64, |worst, &r| worst.max(fresnel_number(&self.telescope, r)));
        let points = if fresnel < FAR_FIELD { [4.0, 3.0] } else { [25.0, 12.5] };
        points.map(|n| self.telescope.aperture_radius_m / n)
    }

    /// Spacings \[m\] for the angles into which focus, tilt and turbulence send the beam: to plan with, and the largest that is
    /// accepted. The rule keeps a margin of two: what lies within it is left to the monitored border.
    fn scatter_spacings_m(&self, range_m: &[f64]) -> Result<[f64; 2], Error> {
        let scatter = scatter_rad(&self.telescope, &self.cn2, last(range_m)?)?;
        let slope = slope_rad(&self.telescope, &self.misalignment) + 2.0 * scatter;
        Ok([0.5, 1.0].map(|waves| waves * self.telescope.wavelength_m / slope.max(1e-30)))
    }

    /// What a grid violates for these ranges.
    pub(super) fn verdict(&self, grid: &Grid, range_m: &[f64]) -> Result<Verdict, Error> {
        let furthest = last(range_m)?;
        let mut violations = grid_violations(&self.telescope, &self.misalignment, grid, furthest)?;
        let (width, spacing) = (grid.smallest_width_m(), grid.dx_m.max(grid.dy_m));
        let light = self.light(range_m)?;
        if !self.cn2.is_none() {
            let [_, aperture] = self.aperture_spacings_m(range_m);
            violations.extend(Violation::too_large(Limit::Aperture, aperture, spacing));
            let [_, scatter] = self.scatter_spacings_m(range_m)?;
            violations.extend(Violation::too_large(Limit::Scatter, scatter, spacing));
        }
        let light_lost = light.lost_from(grid);
        if light_lost > LARGEST_LOSS {
            violations.extend(Violation::too_small(Limit::Light, light.width_m(LARGEST_LOSS, spacing), width));
        }
        Ok(Verdict { violations, light_lost })
    }

    /// A grid for these ranges: with the spacing to plan with, or else with the largest that is accepted; with the border that takes next
    /// to nothing, or else with the narrowest that is accepted.
    pub(super) fn grid(&self, range_m: &[f64]) -> Result<Grid, Error> {
        let (aperture, scatter, light) =
            (self.aperture_spacings_m(range_m), self.scatter_spacings_m(range_m)?, self.light(range_m)?);
        let [mut spacing, largest] = [0, 1].map(|i| aperture[i].min(scatter[i]));
        let inner = self.turbulence.spectrum.inner_wavenumber_rad_m();
        if inner.is_finite() && !self.cn2.is_none() {
            // Half the inner scale if that costs no more than a factor of two.
            let fine = 2.96 / inner;
            if fine < spacing && fine >= 0.5 * spacing {
                spacing = fine;
            }
        }
        let grid = |spacing, loss| self.grid_of(spacing, light.width_m(loss, spacing), last(range_m)?);
        match grid(spacing, DERIVED_LOSS) {
            Ok(grid) if grid.nx <= COMFORTABLE_POINTS => Ok(grid),
            _ => grid(largest, DERIVED_LOSS).or_else(|_| grid(largest, LARGEST_LOSS)),
        }
    }

    /// A grid of at most this spacing and at least this width that holds the beam to `furthest_m`.
    fn grid_of(&self, mut spacing: f64, mut width: f64, furthest_m: f64) -> Result<Grid, Error> {
        // The limits of the grid itself, at no width at all: the largest of their widths, the least of their spacings.
        let nothing = Grid { nx: Grid::SMALLEST, ny: Grid::SMALLEST, dx_m: spacing, dy_m: spacing };
        for violation in grid_violations(&self.telescope, &self.misalignment, &nothing, furthest_m)? {
            match violation.limit.is_spacing() {
                true => spacing = spacing.min(violation.needed),
                false => width = width.max(violation.needed),
            }
        }
        let spacing = not_above(spacing);
        let points = good_size((width / spacing).ceil() as usize).max(128);
        if points > LARGEST_POINTS {
            let (needed, found) = (points as f64, LARGEST_POINTS as f64);
            let violations = vec![Violation { limit: Limit::Points, needed, found }];
            return Err(Error::Sampling { violations, would_do: None });
        }
        Grid::square(points, spacing)
    }

    /// A set-up of equal layers that holds for every one of these lists of ranges, tried on each.
    pub(super) fn set_up(&self, runs: &[&[f64]]) -> Option<SetUp> {
        let mut all: Vec<f64> = runs.concat();
        all.sort_by(f64::total_cmp);
        all.dedup();
        let grid = self.grid(&all).ok()?;
        let layers = self.equal_layers(runs).ok()??;
        let good = |range_m: &&[f64]| self.verdict(&grid, range_m).is_ok_and(|v| v.violations.is_empty());
        runs.iter().all(good).then_some(SetUp { points: grid.nx, spacing_m: grid.dx_m, layers })
    }

    /// How many equal layers to its last range are enough for every one of these lists of ranges; none if 1000 are not.
    pub(super) fn equal_layers(&self, runs: &[&[f64]]) -> Result<Option<usize>, Error> {
        let mut count = 1;
        for range_m in runs {
            let thin = thin_layers(&self.cn2, self.telescope.wavelength_m, last(range_m)?)?;
            count = count.max(thin.end_m().len());
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
    range_m.last().copied().ok_or(Error::Length { field: "range_m", found: 0, expected: 1 })
}

/// The next size with only the factors 2, 3 and 5, even.
fn good_size(at_least: usize) -> usize {
    (at_least.max(2)..)
        .find(|&n| {
            let mut rest = n;
            for prime in [2, 3, 5] {
                while rest % prime == 0 {
                    rest /= prime;
                }
            }
            rest == 1 && n % 2 == 0
        })
        .unwrap_or(at_least)
}
