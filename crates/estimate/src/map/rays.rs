//! Which records (rays) belong to each line of sight: listed, or one line after the other, equally many for each or not.
//!
//! Only the first form needs memory for each ray. Check: all forms of one scan give the same rays.

use std::ops::Range;

use crate::error::{Error, finite};

#[derive(Debug, Clone)]
pub(crate) enum Rays {
    /// The rays of each line, increasing.
    Listed(Vec<Vec<usize>>),
    /// One line after the other: the first ray of each, and one behind the last of all.
    Bounds(Vec<usize>),
    /// So many for each line.
    Regular {
        /// Rays of a line.
        per_line: usize,
    },
}

impl Rays {
    /// The different elevations \[rad\], increasing, and the rays of each.
    pub(crate) fn grouped(elevation_rad: &[f64]) -> (Vec<f64>, Self) {
        let mut order: Vec<usize> = (0..elevation_rad.len()).collect();
        order.sort_by(|&a, &b| elevation_rad[a].total_cmp(&elevation_rad[b]).then(a.cmp(&b)));
        let (mut lines, mut rays) = (Vec::<f64>::new(), Vec::<Vec<usize>>::new());
        for ray in order {
            match (lines.last(), rays.last_mut()) {
                (Some(&line), Some(members)) if line == elevation_rad[ray] => members.push(ray),
                _ => {
                    lines.push(elevation_rad[ray]);
                    rays.push(vec![ray]);
                }
            }
        }
        (lines, Self::Listed(rays))
    }

    /// Number of rays of a line.
    pub(crate) fn count(&self, line: usize) -> usize {
        match self {
            Self::Listed(rays) => rays.get(line).map_or(0, Vec::len),
            Self::Bounds(bounds) => {
                let of_line = bounds.get(line..line + 2);
                of_line.map_or(0, |ends| ends[1].saturating_sub(ends[0]))
            }
            Self::Regular { per_line } => *per_line,
        }
    }

    /// The rays of a line that are in `range`, increasing.
    pub(crate) fn within(&self, line: usize, range: &Range<usize>) -> impl Iterator<Item = usize> + '_ {
        let (listed, regular) = match self {
            Self::Listed(rays) => {
                let all = rays.get(line).map_or(&[][..], Vec::as_slice);
                let first = all.partition_point(|ray| *ray < range.start);
                let end = all.partition_point(|ray| *ray < range.end);
                (&all[first..end.max(first)], 0..0)
            }
            Self::Bounds(bounds) => {
                let ends = bounds.get(line..line + 2).map_or(0..0, |ends| ends[0]..ends[1]);
                (&[][..], ends.start.max(range.start)..ends.end.min(range.end))
            }
            Self::Regular { per_line } => {
                (&[][..], (line * per_line).max(range.start)..((line + 1) * per_line).min(range.end))
            }
        };
        listed.iter().copied().chain(regular)
    }
}

/// Refuses angles that are none of a line of sight.
pub(crate) fn check_angles(elevation_rad: &[f64]) -> Result<(), Error> {
    if elevation_rad.is_empty() {
        return Err(Error::Empty { field: "elevation_rad" });
    }
    for &value in elevation_rad {
        finite("elevation_rad", value)?;
        if value.abs() > std::f64::consts::PI {
            return Err(Error::OutOfRange { field: "elevation_rad", value, allowed: "between -pi and pi" });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_forms_give_the_same_rays() {
        let listed = Rays::Listed(vec![vec![0, 1, 2], vec![3, 4, 5], vec![6, 7, 8]]);
        let regular = Rays::Regular { per_line: 3 };
        let bounds = Rays::Bounds(vec![0, 3, 6, 9]);
        for range in [0..9, 2..7, 4..5, 5..5, 8..20] {
            for line in 0..3 {
                let of = |rays: &Rays| rays.within(line, &range).collect::<Vec<_>>();
                for other in [&regular, &bounds] {
                    assert_eq!(of(&listed), of(other), "{line} {range:?}");
                    assert_eq!((listed.count(line), other.count(line)), (3, 3));
                }
            }
        }
    }
}
