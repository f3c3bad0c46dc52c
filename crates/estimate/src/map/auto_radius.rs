//! The radius rho(R) that a target variance needs: small where the signal is strong or the lines are close, larger
//! where they are not.
//!
//! A large region averages noise away and blurs the vortex; this takes the smallest sufficient one. The information of a region rises
//! in steps, with each window that it gains, so that the radius of one range is not that of another. Check: the requested variance
//! is reached at each range and not with a smaller radius.

use crate::error::{Error, increasing, not_empty, positive};
use crate::map::Radius;

/// Bisections of the radius: to a thousandth of the largest.
const BISECTIONS: usize = 10;

impl Radius {
    /// rho(R) for a target standard deviation `target_m_s` \[m/s\] of velocity: at each of the increasing ranges `range_m` \[m\] the
    /// smallest radius that is enough, to a thousandth of `largest_m`, and elsewhere that of the nearest of them.
    ///
    /// `information` gives the information on the velocity, 1/(m/s)^2, of the region about a range \[m\] with a radius \[m\]: that of the
    /// records ([`RecordModel::information`](crate::bound::RecordModel::information)) which its chords cover, less the losses of the
    /// estimator. Where `largest_m` does not reach the target it is used all the same; the bound reports it.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a target or radius that is not above 0 and for ranges that do not increase, [`Error::Empty`] without
    /// ranges; what `information` fails with.
    pub fn for_standard_deviation<E: From<Error>>(
        range_m: &[f64],
        mut information: impl FnMut(f64, f64) -> Result<f64, E>,
        target_m_s: f64,
        largest_m: f64,
    ) -> Result<Self, E> {
        positive("target_m_s", target_m_s)?;
        positive("largest_m", largest_m)?;
        not_empty("range_m", range_m.len())?;
        increasing("range_m", range_m)?;
        let needed = target_m_s.powi(-2);
        let mut table_m = Vec::with_capacity(range_m.len());
        for &at_m in range_m {
            let is_enough = |radius_m: f64| -> Result<bool, E> {
                let found = information(at_m, radius_m)?;
                Ok(found >= needed)
            };
            table_m.push(smallest_m(largest_m, is_enough)?);
        }
        let known_m = range_m.to_vec();
        Ok(Self::OfRange(Box::new(move |range_m| {
            table_m[nearest(&known_m, range_m)]
        })))
    }
}

/// Smallest radius that is enough, or the largest one where none is.
fn smallest_m<E>(
    largest_m: f64,
    mut is_enough: impl FnMut(f64) -> Result<bool, E>,
) -> Result<f64, E> {
    if !is_enough(largest_m)? {
        return Ok(largest_m);
    }
    if is_enough(0.0)? {
        return Ok(0.0);
    }
    let mut too_small_m = 0.0;
    let mut enough_m = largest_m;
    for _ in 0..BISECTIONS {
        let middle_m = 0.5 * (too_small_m + enough_m);
        if is_enough(middle_m)? {
            enough_m = middle_m;
        } else {
            too_small_m = middle_m;
        }
    }
    Ok(enough_m)
}

/// Index of the nearest of some increasing ranges.
fn nearest(known_m: &[f64], range_m: f64) -> usize {
    let above = known_m.partition_point(|known_m| *known_m < range_m);
    if above == 0 {
        return 0;
    }
    let below = above - 1;
    match known_m.get(above) {
        Some(above_m) if above_m - range_m <= range_m - known_m[below] => above,
        _ => below,
    }
}
