//! Which records (rays) belong to each line of sight: listed, or one line after the other.
//!
//! Only a list needs memory for each ray. Check: both forms of one scan give the same rays.

use std::ops::Range;

use crate::error::{Error, check, finite, not_empty};

/// The rays of each line, increasing: those that stand from one bound to the next.
#[derive(Debug, Clone)]
pub(crate) struct Rays {
    /// Place of the first ray of each line, and one behind the last of all.
    bounds: Vec<usize>,
    /// The ray at each place; none where the rays stand line by line themselves.
    listed: Option<Vec<usize>>,
}

impl Rays {
    /// One line after the other: the first ray of each, and one behind the last of all.
    pub(crate) fn in_order(bounds: Vec<usize>) -> Self {
        Self { bounds, listed: None }
    }

    /// The different elevations \[rad\], increasing, and the rays of each.
    pub(crate) fn grouped(elevation_rad: &[f64]) -> (Vec<f64>, Self) {
        let mut order: Vec<usize> = (0..elevation_rad.len()).collect();
        order.sort_by(|&a, &b| elevation_rad[a].total_cmp(&elevation_rad[b]).then(a.cmp(&b)));
        let (mut lines, mut bounds) = (Vec::new(), Vec::new());
        for (place, &ray) in order.iter().enumerate() {
            if lines.last() != Some(&elevation_rad[ray]) {
                lines.push(elevation_rad[ray]);
                bounds.push(place);
            }
        }
        bounds.push(order.len());
        (lines, Self { bounds, listed: Some(order) })
    }

    fn places(&self, line: usize) -> Range<usize> {
        self.bounds.get(line..line + 2).map_or(0..0, |ends| ends[0]..ends[1])
    }

    /// Number of rays of a line.
    pub(crate) fn count(&self, line: usize) -> usize {
        self.places(line).len()
    }

    /// The rays of a line that are in `range`, increasing.
    pub(crate) fn within(&self, line: usize, range: &Range<usize>) -> impl Iterator<Item = usize> + '_ {
        let places = self.places(line);
        let (listed, regular) = match &self.listed {
            Some(rays) => {
                let all = &rays[places];
                let [first, end] = [range.start, range.end].map(|bound| all.partition_point(|ray| *ray < bound));
                (&all[first..end.max(first)], 0..0)
            }
            None => (&[][..], places.start.max(range.start)..places.end.min(range.end)),
        };
        listed.iter().copied().chain(regular)
    }
}

/// Refuses angles that are none of a line of sight.
pub(crate) fn check_angles(elevation_rad: &[f64]) -> Result<(), Error> {
    not_empty("elevation_rad", elevation_rad.len())?;
    elevation_rad.iter().try_for_each(|&value| {
        finite("elevation_rad", value)?;
        check("elevation_rad", value, "between -pi and pi", value.abs() <= std::f64::consts::PI)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_forms_give_the_same_rays() {
        let (_, listed) = Rays::grouped(&[0.1, 0.1, 0.1, 0.2, 0.2, 0.2, 0.3, 0.3, 0.3]);
        let bounds = Rays::in_order(vec![0, 3, 6, 9]);
        for range in [0..9, 2..7, 4..5, 5..5, 8..20] {
            for line in 0..3 {
                let of = |rays: &Rays| rays.within(line, &range).collect::<Vec<_>>();
                assert_eq!(of(&listed), of(&bounds), "{line} {range:?}");
                assert_eq!((listed.count(line), bounds.count(line)), (3, 3));
            }
        }
    }
}
