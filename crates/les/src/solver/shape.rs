//! Number of values of a field, and which of them a rank holds: the planes of memory axis 2 that it
//! owns, and halos.
//!
//! Kernels name planes by their number in the whole mesh. A slab lies in memory from [`HALO`]
//! planes below the first that is owned, in the periodic sense; with one rank every plane has its
//! own place, and nothing is moved.
//!
//! Check: every plane has one owner; places of owned planes and halos.

use std::ops::Range;

use super::rows::HALO;
use super::rows::RowOffsets;

/// Number of values along the three memory axes, and the slab of them that is held.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Shape {
    /// Values of the whole mesh along the axes; axis 0 is contiguous.
    pub(crate) n: [usize; 3],
    /// First plane that is owned, and the one after the last.
    own: [usize; 2],
    /// First plane in memory.
    lowest: usize,
    /// Planes in memory.
    held: usize,
}

impl Shape {
    /// All planes.
    pub(crate) fn whole(n: [usize; 3]) -> Self {
        Self {
            n,
            own: [0, n[2]],
            lowest: 0,
            held: n[2],
        }
    }

    /// The slab of one of `count` ranks.
    pub(crate) fn slab(n: [usize; 3], rank: usize, count: usize) -> Self {
        let whole = Self::whole(n);
        let own = whole.planes_of(rank, count);
        if own.len() == n[2] {
            return whole;
        }
        let lowest = (own.start + n[2] - HALO.min(n[2])) % n[2];
        Self {
            n,
            own: [own.start, own.end],
            lowest,
            held: (own.len() + 2 * HALO).min(n[2]),
        }
    }

    /// Planes that one of `count` ranks owns.
    pub(crate) fn planes_of(self, rank: usize, count: usize) -> Range<usize> {
        self.n[2] * rank / count..self.n[2] * (rank + 1) / count
    }

    /// Planes in memory, in their order there.
    pub(crate) fn held(self) -> impl Iterator<Item = usize> {
        (self.lowest..self.lowest + self.held).map(move |k| k % self.n[2])
    }

    /// Planes that are owned.
    pub(crate) fn own(self) -> Range<usize> {
        self.own[0]..self.own[1]
    }

    /// Where they lie in memory.
    pub(crate) fn own_range(self) -> Range<usize> {
        let start = self.place([0, 0, self.own[0]]);
        start..start + self.own().len() * self.plane()
    }

    /// Number of values in memory.
    pub(crate) fn len(self) -> usize {
        self.held * self.plane()
    }

    /// Number of values of a plane at one index of axis 2.
    pub(crate) fn plane(self) -> usize {
        self.n[0] * self.n[1]
    }

    /// Indices along the axes of a place in a whole field.
    pub(crate) fn index(self, place: usize) -> [usize; 3] {
        [
            place % self.n[0],
            place / self.n[0] % self.n[1],
            place / self.plane(),
        ]
    }

    /// Indices along the axes of a place in memory.
    pub(crate) fn index_held(self, place: usize) -> [usize; 3] {
        let [i, j, k] = self.index(place);
        [i, j, (self.lowest + k) % self.n[2]]
    }

    /// Place in memory of indices along the axes. That of a plane that is not held lies beyond the
    /// end.
    #[inline(always)]
    pub(crate) fn place(self, [i, j, k]: [usize; 3]) -> usize {
        let k = if k >= self.lowest {
            k - self.lowest
        } else {
            k + self.n[2] - self.lowest
        };
        (k * self.n[1] + j) * self.n[0] + i
    }

    /// Where the rows begin whose index along `axis` (1 or 2) takes the place of that in `[j, k]`.
    #[inline(always)]
    pub(crate) fn row_offsets(self, axis: usize, [j, k]: [usize; 2]) -> RowOffsets {
        if axis == 1 {
            return RowOffsets {
                first: self.place([0, 0, k]),
                step: self.n[0],
                lowest: 0,
                round: 0,
            };
        }
        let step = self.plane();
        RowOffsets {
            first: (j * self.n[0]).wrapping_sub(self.lowest * step),
            step,
            lowest: self.lowest,
            round: self.n[2] * step,
        }
    }

    /// Places in memory of the row at indices `j` of axis 1 and `k` of axis 2.
    #[inline(always)]
    pub(crate) fn row(self, j: usize, k: usize) -> Range<usize> {
        let start = self.place([0, j, k]);
        start..start + self.n[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_plane_has_one_owner_and_the_halos_of_a_slab_lie_beside_it() {
        for (planes, count) in [(8, 2), (13, 3), (29, 7), (64, 5), (9, 1)] {
            let n = [3, 2, planes];
            let mut owners = vec![0; planes];
            for rank in 0..count {
                let shape = Shape::slab(n, rank, count);
                assert!(shape.own().len() >= HALO && shape.own_range().end <= shape.len());
                shape.own().for_each(|k| owners[k] += 1);
                for (at, k) in shape.own().enumerate() {
                    assert_eq!(
                        [
                            shape.row_offsets(1, [0, k]).start(1),
                            shape.row_offsets(2, [1, 0]).start(k)
                        ],
                        [shape.place([0, 1, k]); 2]
                    );
                    assert_eq!(shape.place([1, 1, k]), shape.own_range().start + 6 * at + 4);
                }
                let held = (0..planes)
                    .filter(|&k| shape.row(1, k).end <= shape.len())
                    .count();
                assert_eq!(held * 6, shape.len());
                for step in 0..if count > 1 { HALO } else { 0 } {
                    let beside = [
                        (shape.own().start + planes - step - 1) % planes,
                        (shape.own().end + step) % planes,
                    ];
                    assert!(beside.iter().all(|&k| shape.row(1, k).end <= shape.len()));
                }
            }
            assert_eq!(owners, vec![1; planes]);
        }
    }
}
