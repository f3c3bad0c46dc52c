//! Where fits of maps begin, and which of their ends is taken.
//!
//! Core radii are tried small and large; what they end at is compared by the likelihood that the loss stands for. Ends that are
//! not the best but compete with it add their distance to the covariance, weighted with their likelihood. Check: synthetic minima; fits of many maps.

use crate::error::Error;
use crate::vortex_fit::map_fit::prediction::LONE_M;
use crate::vortex_fit::tolerances::{COMPETES, HOPELESS_OF_ESTIMATES, ONE_SIGMAS, SAME_SIGMAS};
use crate::vortex_fit::top::{distinct, mixed};
use crate::vortex_fit::{CorePrior, MapFit, MapFitOptions, PARAMETERS, Sharing, Wake};

/// Core radius of a wake over its spacing (the chapter: 3 to 5 % of the span, 3.8 to 6.4 % of the spacing).
pub(crate) const CORE_OVER_SPACING: f64 = CorePrior::TYPICAL.median_ratio;
/// Large core radius over the spacing, from which fits start once more.
const LARGE_CORE_OVER_SPACING: f64 = 0.1;
/// Circulation of a vortex over that of its partner, below which another one may be the partner.
const WEAK: f64 = 0.5;
/// Relative change of the typical core at which its iteration ends, and the largest number of rounds.
const TYPICAL: f64 = 0.05;
const ROUNDS: usize = 3;

/// The starts about a wake: its core radii are the one that is kept, or the typical one. Where one vortex is far weaker than the other, a pair of
/// equal ones is the other start.
pub(crate) fn starts_about(about: &Wake, options: &MapFitOptions) -> Vec<Wake> {
    let mut starts = vec![with_start_core(about, options)];
    if let Some(equal) = with_equal_partner(about) {
        starts.push(with_start_core(&equal, options));
    }
    starts
}

/// A wake with the core radii that fits start with.
fn with_start_core(wake: &Wake, options: &MapFitOptions) -> Wake {
    let typical_m = CORE_OVER_SPACING * wake.spacing_m();
    match options.free.core_radius {
        Sharing::Fixed => wake.with_cores(options.core_radius_m.unwrap_or(typical_m)),
        Sharing::Common | Sharing::Separate => wake.with_cores(typical_m),
    }
}

/// A wake with the large cores from which a fit starts once more, if core radii are fitted.
pub(crate) fn with_large_cores(wake: &Wake, options: &MapFitOptions) -> Option<Wake> {
    let is_fitted = options.free.core_radius != Sharing::Fixed;
    is_fitted.then(|| wake.with_cores(LARGE_CORE_OVER_SPACING * wake.spacing_m()))
}

/// A vortex whose partner is far weaker with one like itself in its place, as where the partner is beyond the scan and what is taken for it is not.
fn with_equal_partner(wake: &Wake) -> Option<Wake> {
    let Wake { left, right, .. } = *wake;
    if left.circulation_m2_s < WEAK * right.circulation_m2_s {
        Some(Wake {
            left: right.beside(-LONE_M),
            ..*wake
        })
    } else if right.circulation_m2_s < WEAK * left.circulation_m2_s {
        Some(Wake {
            right: left.beside(LONE_M),
            ..*wake
        })
    } else {
        None
    }
}

/// The best end of the fits from some starts; the first error if none comes to an end.
pub(crate) fn best_of(
    starts: &[Wake],
    fit: impl Fn(&Wake) -> Result<MapFit, Error>,
) -> Result<MapFit, Error> {
    let mut ends = Vec::new();
    let mut failed = None;
    for start in starts {
        match fit(start) {
            Ok(end) => ends.push(end),
            Err(error) => failed = failed.or(Some(error)),
        }
    }
    merged(ends).ok_or(failed.unwrap_or(Error::Empty { field: "starts" }))
}

/// A fit that keeps the typical core begins again until that is the one of the spacing that it ends with, which the search for
/// the best pair knows only as well as its grid is fine.
pub(crate) fn with_typical_core(
    mut end: MapFit,
    options: &MapFitOptions,
    fit: impl Fn(&Wake) -> Result<MapFit, Error>,
) -> Result<MapFit, Error> {
    for _ in 0..ROUNDS {
        let next = with_start_core(&end.wake, options);
        let ratio = end.wake.left.core_radius_m / next.left.core_radius_m;
        let is_off = (ratio - 1.0).abs() > TYPICAL;
        if options.free.core_radius != Sharing::Fixed || !is_off {
            break;
        }
        end = fit(&next)?;
    }
    Ok(end)
}

/// Chi-square of an end.
pub(crate) fn chi2(end: &MapFit) -> f64 {
    end.tops.first().map_or(f64::INFINITY, |top| top.chi2)
}

/// Whether two minima are closer than this number of standard errors of the first, in all that either of them has fitted.
pub(crate) fn same(a: &MapFit, b: &MapFit, sigmas: f64) -> bool {
    let at = a.wake.to_array();
    let other = b.wake.to_array();
    (0..PARAMETERS).all(|i| {
        let variance = a.covariance[[i, i]];
        let is_kept = variance == 0.0 && b.covariance[[i, i]] == 0.0;
        is_kept || (other[i] - at[i]).powi(2) <= sigmas.powi(2) * variance
    })
}

/// The wakes of those ends of rough fits that lead to different ends, the best first, but for those that are hopeless.
pub(crate) fn rivals(ends: &[MapFit]) -> Vec<Wake> {
    let mut ends: Vec<&MapFit> = ends.iter().collect();
    ends.sort_by(|a, b| chi2(a).total_cmp(&chi2(b)));
    let hopeless = ends.first().map_or(f64::INFINITY, |end| chi2(end)) + HOPELESS_OF_ESTIMATES;
    ends.retain(|end| chi2(end) <= hopeless);
    distinct(ends, |better, end| same(better, end, ONE_SIGMAS))
        .into_iter()
        .map(|end| end.wake)
        .collect()
}

/// The best of some ends with the others as its competing tops.
fn merged(mut ends: Vec<MapFit>) -> Option<MapFit> {
    ends.sort_by(|a, b| chi2(a).total_cmp(&chi2(b)));
    let (best, others) = ends.split_first()?;
    let others = others.iter().filter(|end| !same(best, end, SAME_SIGMAS));
    let all: Vec<&MapFit> = std::iter::once(best).chain(others).collect();
    // the covariance of an unlikely minimum may be so large that its weight does not make up for it
    let likely = all.iter().filter(|end| chi2(end) - chi2(best) < COMPETES);
    let weighted = likely.map(|end| {
        (
            (0.5 * (chi2(best) - chi2(end))).exp(),
            &end.wake,
            &end.covariance,
        )
    });
    let covariance = mixed(weighted, &best.wake);
    let tops = all.iter().flat_map(|end| end.tops.clone()).collect();
    Some(MapFit {
        covariance,
        tops,
        ..best.clone()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vortex_fit::{Parameter, Top};
    use ndarray::Array2;

    /// An end at so many errors of its first circulation from 400 m^2/s.
    fn end(sigmas: f64, chi2: f64) -> MapFit {
        let wake = Wake::from_array(&[
            400.0 + 10.0 * sigmas,
            400.0,
            376.5,
            45.0,
            423.5,
            49.0,
            2.0,
            2.0,
            1.0,
            0.0,
            0.0,
        ]);
        MapFit {
            wake,
            covariance: Array2::from_diag_elem(PARAMETERS, 100.0),
            cores_fitted: true,
            used: 1000,
            outliers: 0,
            residual_scale: 1.0,
            statistic: 100.0,
            explained_fraction: 0.9,
            tops: vec![Top { wake, chi2 }],
        }
    }

    #[test]
    fn what_both_of_two_ends_keep_does_not_tell_them_apart() {
        let core = Parameter::LeftCore as usize;
        let mut kept = end(0.0, 0.0);
        kept.covariance[[core, core]] = 0.0;
        let mut other = kept.clone();
        other.wake.left.core_radius_m = 3.0;
        assert!(same(&kept, &other, SAME_SIGMAS));
        other.wake.left.circulation_m2_s += 4.0;
        assert!(!same(&kept, &other, SAME_SIGMAS));
        let mut fitted = kept.clone();
        fitted.wake.left.core_radius_m = 3.0;
        fitted.covariance[[core, core]] = 1.0;
        assert!(!same(&kept, &fitted, ONE_SIGMAS));
        assert!(same(&fitted, &kept, ONE_SIGMAS));
    }

    #[test]
    fn ends_are_followed_that_differ_from_better_ones_and_are_not_hopeless() {
        let ends = [end(6.0, 25.0), end(3.0, 19.0), end(0.5, 2.0), end(0.0, 0.0)];
        let kept: Vec<f64> = rivals(&ends)
            .iter()
            .map(|wake| (wake.left.circulation_m2_s - 400.0) / 10.0)
            .collect();
        assert_eq!(kept, [0.0, 3.0]);
        // alone it is followed, however large its chi-square is
        assert_eq!(rivals(&ends[..1]).len(), 1);
    }
}
