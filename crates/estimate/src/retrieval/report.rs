//! What is reported of the fits of a scan: which vortices there are, their standard deviations, and flags.
//!
//! Check: the reference maps; wakes at the end of the sector, near the ground, with a kept core.

use ndarray::{Array1, Array2};

use crate::Measured;
use crate::error::Error;
use crate::linalg::positive_definite::solve;
use crate::retrieval::hypotheses::{End, Kind, Stage, best, least, tops};
use crate::retrieval::{Flag, ScanResult, Side, VortexResult};
use crate::vortex_fit::map_fit::least_squares::{Scores, Uncertainty, submatrix};
use crate::vortex_fit::tolerances::{CERTAIN_SIGMAS, COMPETES, NOT_CONVERGED_SIGMAS};
use crate::vortex_fit::{Parameter, Top, Wake};

/// Velocities with larger residuals, in their deviations, are outliers.
pub(crate) const OUTLIER: f64 = 4.0;
/// So many times the root of the threshold is far beyond doubt in correlated noise too.
const BY_FAR: f64 = 2.0;
/// Most that each of a few velocities may say for a vortex, in parts of the threshold: a loss of outliers lets one bad velocity exceed it alone, which
/// a narrow pair or a small core then explains.
const OF_ONE: f64 = 0.2;
const FEW: usize = 4;
/// A side of a vortex is seen if the sector reaches so far beyond its centre \[m\], where circulation begins to be counted.
const SEEN_M: f64 = 5.0;
/// Chi-square per degree after robust scaling that is too much, and part of outliers that is.
const POOR: f64 = 2.0;
const MANY_OUTLIERS: f64 = 0.1;
/// Blocks of a map that tell how its residuals are correlated: more are no better for wakes, and take longer.
const BLOCKS: usize = 2000;

pub(crate) struct Report<'a> {
    pub(crate) stage: &'a Stage<'a>,
    /// Scale of the residuals over the stated deviations, at least 1.
    pub(crate) scale: f64,
    pub(crate) wind: &'a End,
    pub(crate) ends: &'a [End],
}

/// The end that a report is of, its covariance, the statistic of the scan, and how many velocities count as one.
pub(crate) struct Chosen<'a> {
    pub(crate) end: &'a End,
    pub(crate) covariance: Array2<f64>,
    pub(crate) statistic: f64,
    pub(crate) alike: f64,
}

impl<'a> Report<'a> {
    /// The likely end if it is a wake, a lone vortex instead of a pair of which one is not seen, or the wind.
    pub(crate) fn chosen(&self) -> Result<Chosen<'a>, Error> {
        let cells = self.stage.squares.cells.len();
        let likely = least(self.ends, cells);
        let mut of_likely = likely.map(|end| self.uncertainty(end)).transpose()?;
        let alike = match (likely, &of_likely) {
            (Some(end), Some(known)) if self.stage.is_noise_left && !self.stage.is_noise_known => {
                known.excess(&end.wake, self.scale.powi(2))
            }
            _ => 1.0,
        };
        let statistic = likely.map_or(0.0, |end| self.gain(Some(self.wind), end, alike));
        let left = best(self.ends, Kind::Left);
        let right = best(self.ends, Kind::Right);
        let lone = [left, right]
            .into_iter()
            .flatten()
            .min_by(|a, b| a.chi2.total_cmp(&b.chi2));
        // the likely one comes first
        for end in likely
            .into_iter()
            .chain(lone.filter(|_| likely.is_some_and(|end| end.kind == Kind::Both)))
        {
            let known = of_likely.take();
            let seen = match end.kind {
                Kind::Both => self
                    .gain(left, end, alike)
                    .min(self.gain(right, end, alike)),
                _ => self.gain(Some(self.wind), end, alike),
            };
            if seen.min(statistic) < self.stage.options.threshold {
                continue;
            }
            let uncertainty = known.map_or_else(|| self.uncertainty(end), Ok)?;
            if self.are_certain(end, &uncertainty)? {
                return Ok(Chosen {
                    end,
                    covariance: uncertainty.covariance(|_| true)?,
                    statistic,
                    alike,
                });
            }
        }
        Ok(Chosen {
            end: self.wind,
            covariance: self.covariance(self.wind)?,
            statistic,
            alike,
        })
    }

    /// Drop of chi-square from one fit to another one with more vortices, with correlated velocities counted once; infinite without the first. Of
    /// the [`FEW`] velocities that say most for it each counts at most [`OF_ONE`] of the threshold.
    fn gain(&self, without: Option<&End>, with: &End, alike: f64) -> f64 {
        let Some(without) = without else {
            return f64::INFINITY;
        };
        let variance = self.scale.powi(2);
        let of_all = (without.chi2 - with.chi2) / variance / alike;
        let threshold = self.stage.options.threshold;
        if of_all < threshold {
            return of_all;
        }
        let squares = &self.stage.squares;
        let before = squares.rows(&without.wake.to_array(), &[]).residuals;
        let after = squares.rows(&with.wake.to_array(), &[]).residuals;
        let mut drops = Vec::with_capacity(before.len());
        for (before, after) in before.iter().zip(&after) {
            drops.push(2.0 * (squares.loss.at(*before).0 - squares.loss.at(*after).0) / variance);
        }
        drops.sort_by(|a, b| b.total_cmp(a));
        let mut too_much = 0.0;
        for drop in drops.iter().take(FEW) {
            too_much += (drop - OF_ONE * threshold).max(0.0);
        }
        let of_several = of_all - too_much / alike;
        if of_several < threshold {
            of_several
        } else {
            of_all
        }
    }

    /// Whether the circulations of all vortices of an end are positive beyond doubt.
    fn are_certain(&self, end: &End, uncertainty: &Uncertainty<'_>) -> Result<bool, Error> {
        let mut are_certain = true;
        for side in self.sides(end) {
            let circulation = side.parameters()[0] as usize;
            are_certain &=
                uncertainty.certain(&end.wake, circulation, self.stage.options.threshold)?;
        }
        Ok(are_certain)
    }

    /// Covariance \[11, 11\] of an end.
    pub(crate) fn covariance(&self, end: &End) -> Result<Array2<f64>, Error> {
        self.uncertainty(end)?.covariance(|_| true)
    }

    /// The vortices of an end with that covariance, each at its line.
    pub(crate) fn vortices(&self, end: &End, covariance: &Array2<f64>) -> Vec<VortexResult> {
        let model = self.stage.gates.model;
        let moves = self.stage.gates.seconds.is_some();
        let mut vortices = Vec::new();
        for side in self.sides(end) {
            let fitted = (&end.wake, covariance);
            let vortex = VortexResult::at_its_line(self.stage.map, model, fitted, side, moves);
            vortices.push(vortex);
        }
        vortices
    }

    fn sides(&self, end: &End) -> Vec<Side> {
        Side::BOTH
            .into_iter()
            .filter(|side| end.kind.has(side.parameters()[0] as usize))
            .collect()
    }

    fn uncertainty<'b>(&self, end: &'b End) -> Result<Uncertainty<'b>, Error> {
        let from = if self.stage.is_noise_known {
            Scores::Stated
        } else {
            Scores::Decaying {
                blocks: self.stage.map.view().blocks(BLOCKS),
            }
        };
        self.stage
            .squares
            .uncertainty(&end.wake.to_array(), &end.groups, from)
    }

    /// The result that an end is reported as.
    pub(crate) fn result(&self, end: &End, covariance: Array2<f64>, statistic: f64) -> ScanResult {
        let residuals = self.stage.squares.rows(&end.wake.to_array(), &[]).residuals;
        let used = residuals.iter().filter(|r| r.abs() <= OUTLIER * self.scale);
        let (count, squares) = used.fold((0, 0.0), |(count, sum), r| (count + 1, sum + r * r));
        let cells_rejected = self.stage.rejected + residuals.len() - count;
        let mut vortices = self.vortices(end, &covariance);
        // what is beyond the sector is hardly known, though it acts
        if vortices.iter().any(|vortex| self.margin_m(vortex) >= 0.0) {
            vortices.retain(|vortex| self.margin_m(vortex) >= 0.0);
        }
        let tops: Vec<Top> = tops(self.ends, end, &covariance)
            .iter()
            .map(|end| Top {
                wake: end.wake,
                chi2: end.chi2,
            })
            .collect();
        let flags = self.flags(end, &vortices, &tops, statistic, cells_rejected);
        ScanResult {
            wake: (!vortices.is_empty()).then_some(end.wake),
            reference_time_s: self.stage.map.middle_s(),
            lateral_wind_m_s: Measured::of_wake(Parameter::Wind, &end.wake, &covariance),
            wind_shear_per_s: Measured::of_wake(Parameter::Shear, &end.wake, &covariance),
            chi2_per_dof: squares / (count.saturating_sub(end.groups.len()).max(1)) as f64,
            cells_used: count,
            cells_rejected,
            statistic,
            threshold: self.stage.options.threshold,
            flags,
            vortices,
            covariance,
            tops,
            turbulence: None,
            model: self.stage.options.model,
        }
    }

    /// What is to be thought of an end whose vortices are reported.
    fn flags(
        &self,
        end: &End,
        vortices: &[VortexResult],
        tops: &[Top],
        statistic: f64,
        cells_rejected: usize,
    ) -> Vec<Flag> {
        let spacing_m = if end.kind == Kind::Both {
            end.wake.spacing_m()
        } else {
            2.0 * SEEN_M
        };
        let is_near_ground = vortices
            .iter()
            .any(|vortex| vortex.height_m.value < 0.5 * spacing_m);
        let competes = tops
            .get(1)
            .zip(tops.first())
            .is_some_and(|(second, first)| {
                second.chi2 - first.chi2 < COMPETES * self.scale.powi(2)
            });
        let map = self.stage.map;
        let is_instant = map.has_times() && map.time_s.windows(2).all(|pair| pair[0] == pair[1]);
        let is_at_rest = self.stage.gates.seconds.is_none() && !is_instant;
        let cells = self.stage.rejected + self.stage.squares.cells.len();
        let stands_out = statistic >= self.stage.options.threshold;
        let flags = [
            (Flag::NoWake, vortices.is_empty() && !stands_out),
            (Flag::Uncertain, vortices.is_empty() && stands_out),
            (Flag::OneVortex, vortices.len() == 1),
            (
                Flag::CoreKept,
                vortices.iter().any(|vortex| vortex.core_radius_m.is_none()),
            ),
            (
                Flag::AtEdge,
                vortices.iter().any(|vortex| self.margin_m(vortex) < SEEN_M),
            ),
            (Flag::NearGround, is_near_ground),
            (Flag::MotionIgnored, is_at_rest),
            (Flag::Ambiguous, competes),
            (Flag::PoorFit, self.scale.powi(2) > POOR),
            (
                Flag::Outliers,
                cells_rejected as f64 > MANY_OUTLIERS * cells as f64,
            ),
            (Flag::Thinned, self.stage.thinned),
            (Flag::NotConverged, end.sigmas_left > NOT_CONVERGED_SIGMAS),
        ];
        let set = flags.into_iter().filter(|(_, is_set)| *is_set);
        set.map(|(flag, _)| flag).collect()
    }

    /// How far the sector reaches beyond a centre \[m\]; negative outside.
    fn margin_m(&self, vortex: &VortexResult) -> f64 {
        let (range_m, elevation_rad) = self
            .stage
            .options
            .model
            .range_and_elevation(vortex.place_m());
        let map = self.stage.map;
        let margin_rad = margin(&map.elevation_rad, elevation_rad);
        margin(&map.range_m, range_m).min(range_m * margin_rad)
    }
}

/// Distance of a value from the nearer end of an axis; negative outside, NaN for an empty axis.
fn margin(axis: &[f64], value: f64) -> f64 {
    axis.first()
        .zip(axis.last())
        .map_or(f64::NAN, |(first, last)| (value - first).min(last - value))
}

/// Product of a row of a matrix with a vector.
fn row_product(matrix: &Array2<f64>, row: usize, vector: &[f64]) -> f64 {
    (0..vector.len())
        .map(|j| matrix[[row, j]] * vector[j])
        .sum()
}

impl Uncertainty<'_> {
    /// Variance of the size of a wake at its places over that in independent noise of the variance that was taken, at least 1: a gain of chi-square
    /// is so many times larger by chance. What wind takes from the wake is left out.
    fn excess(&self, wake: &Wake, variance: f64) -> f64 {
        let p = wake.to_array();
        let mut wind = Vec::new();
        let mut along = vec![0.0; self.groups.len()];
        for (i, group) in self.groups.iter().enumerate() {
            if group[0] >= Parameter::Wind as usize {
                wind.push(i);
            } else if group[0] <= Parameter::RightCirculation as usize {
                along[i] = p[group[0]];
            }
        }
        let towards: Vec<f64> = wind
            .iter()
            .map(|i| -row_product(&self.curvature, *i, &along))
            .collect();
        let own = submatrix(&self.curvature, &wind);
        let taken = solve(&own, &towards).unwrap_or_else(|| vec![0.0; wind.len()]);
        wind.iter()
            .zip(taken)
            .for_each(|(i, taken)| along[*i] = taken);
        let along = Array1::from_vec(along);
        let ratio = along.dot(&self.scores.dot(&along)) / along.dot(&self.curvature.dot(&along));
        // also 1 for NaN, where no circulation is free
        (ratio / variance).max(1.0)
    }

    /// Whether a circulation is positive beyond doubt, or is so by far where all but it and the wind is as found: long gates show little
    /// more than circulation times spacing, so that each of them may be uncertain where the wake is not. Correlated residuals count in
    /// both, as far as the fit leaves them; the places are the best of many, as those of the statistic are.
    fn certain(&self, wake: &Wake, circulation: usize, threshold: f64) -> Result<bool, Error> {
        let value = wake.to_array()[circulation];
        let of_all = self.covariance(|_| true)?;
        if value > CERTAIN_SIGMAS * of_all[[circulation; 2]].sqrt() {
            return Ok(true);
        }
        let of_wind_and_circulation = self.covariance(|group| {
            group.contains(&circulation) || group[0] >= Parameter::Wind as usize
        })?;
        let sigmas = (BY_FAR * threshold.sqrt()).max(CERTAIN_SIGMAS);
        Ok(value > sigmas * of_wind_and_circulation[[circulation; 2]].sqrt())
    }
}
