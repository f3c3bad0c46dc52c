//! What the slabs of a flow exchange: halos, numbers of planes and ranks, lines that cross slabs.
//!
//! One process exchanges nothing, and no array is copied.
//!
//! Check: the tests of the flow on ranks.

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

use super::operators_1d::Taps;
use super::rows::HALO;
use super::shape::Shape;
use crate::Error;
use crate::ranks::{self, Ranks, Timed};

/// All planes of a halo, for fields that are read by operators of several kinds.
pub(crate) const WHOLE: [usize; 2] = [HALO; 2];

/// The ranks and what this one holds.
#[derive(Debug, Clone)]
pub(crate) struct Slabs {
    pub(crate) ranks: Arc<Timed>,
    pub(crate) shape: Shape,
}

impl Slabs {
    /// Equal slabs of a mesh of `n` values along the memory axes.
    ///
    /// # Errors
    /// [`Error::TooManyRanks`] if one would own fewer planes than a halo has.
    pub(crate) fn new(ranks: Arc<dyn Ranks>, n: [usize; 3]) -> Result<Self, Error> {
        let (ranks_found, most) = (ranks.count(), (n[2] / HALO).max(1));
        if ranks_found > most {
            return Err(Error::TooManyRanks {
                ranks: ranks_found,
                planes: n[2],
                most,
            });
        }
        let shape = Shape::slab(n, ranks.rank(), ranks.count());
        Ok(Self {
            ranks: Arc::new(Timed::new(ranks)),
            shape,
        })
    }

    /// Whether there is but one rank.
    pub(crate) fn is_alone(&self) -> bool {
        self.ranks.count() == 1
    }

    /// Whether observers and files see this rank.
    pub(crate) fn is_first(&self) -> bool {
        self.ranks.rank() == 0
    }

    /// How many planes below and above its own a slab needs of a field that is read by an operator along axis 2 with the rows `rows`; the
    /// most over all slabs, so that the ranks agree.
    pub(crate) fn reach(&self, rows: &[Taps]) -> [usize; 2] {
        let (n2, count) = (self.shape.n[2], self.ranks.count());
        let mut reach = [0; 2];
        for own in (0..count).map(|rank| self.shape.planes_of(rank, count)) {
            for place in rows[own.clone()]
                .iter()
                .flatten()
                .map(|tap| tap.0)
                .filter(|place| !own.contains(place))
            {
                let below = (own.start + n2 - place) % n2;
                let above = (place + n2 - own.end) % n2 + 1;
                let (side, planes) = if below <= above {
                    (0, below)
                } else {
                    (1, above)
                };
                reach[side] = reach[side].max(planes);
            }
        }
        reach
    }

    /// Brings `below` and `above` planes of the halos of fields up to date, at most [`HALO`] each.
    ///
    /// # Errors
    /// Those of [`Ranks::all_to_all`].
    pub(crate) fn halos(
        &self,
        fields: &mut [&mut [f64]],
        [below, above]: [usize; 2],
    ) -> Result<(), Error> {
        if self.is_alone() {
            return Ok(());
        }
        let (shape, count, own_rank) = (self.shape, self.ranks.count(), self.ranks.rank());
        let (plane, n2) = (shape.plane(), shape.n[2]);
        // Planes of the halos of one rank that another owns, in the order in which they are sent.
        let sent = |from: usize, to: usize| {
            let (owned, Range { start, end }) =
                (shape.planes_of(from, count), shape.planes_of(to, count));
            let halos = (start + n2 - below..start + n2)
                .chain(end..end + above)
                .map(move |k| k % n2);
            halos.filter(move |k| owned.contains(k))
        };
        let values = |from: usize, to: usize| sent(from, to).count() * plane * fields.len();
        let to: Vec<usize> = (0..count).map(|rank| values(own_rank, rank)).collect();
        let from: Vec<usize> = (0..count).map(|rank| values(rank, own_rank)).collect();
        let mut send = Vec::with_capacity(to.iter().sum());
        for rank in 0..count {
            for (field, k) in fields
                .iter()
                .flat_map(|field| sent(own_rank, rank).map(move |k| (field, k)))
            {
                send.extend_from_slice(&field[shape.place([0, 0, k])..][..plane]);
            }
        }
        let mut receive = vec![0.0; from.iter().sum()];
        self.ranks.all_to_all(&send, &to, &mut receive, &from)?;
        let mut came = receive.chunks(plane);
        for rank in 0..count {
            for field in fields.iter_mut() {
                for (k, plane) in sent(rank, own_rank).zip(&mut came) {
                    field[shape.place([0, 0, k])..][..plane.len()].copy_from_slice(plane);
                }
            }
        }
        Ok(())
    }

    /// As [`ranks::all_gather`].
    ///
    /// # Errors
    /// As there.
    pub(crate) fn all_gather(&self, own: Vec<f64>) -> Result<Vec<f64>, Error> {
        ranks::all_gather(&*self.ranks, own)
    }

    /// The numbers of all planes, from those of the planes that are owned: what is summed in their order does not depend on
    /// the ranks.
    ///
    /// # Errors
    /// Those of [`Ranks::all_to_all`].
    pub(crate) fn planes<const M: usize>(
        &self,
        own: Vec<[f64; M]>,
    ) -> Result<Vec<[f64; M]>, Error> {
        Ok(self
            .all_gather(own.into_flattened())?
            .as_chunks::<M>()
            .0
            .to_vec())
    }

    /// Sums over the planes that are owned to sums over all, one after the other.
    ///
    /// # Errors
    /// Those of [`Ranks::all_to_all`].
    pub(crate) fn sums<const M: usize>(&self, own: Vec<[f64; M]>) -> Result<[f64; M], Error> {
        let planes = self.planes(own)?;
        Ok(planes.iter().fold([0.0; M], |sum, plane| {
            std::array::from_fn(|i| sum[i] + plane[i])
        }))
    }

    /// The largest of each of some numbers.
    ///
    /// # Errors
    /// Those of [`Ranks::all_to_all`].
    pub(crate) fn largest<const M: usize>(&self, own: [f64; M]) -> Result<[f64; M], Error> {
        let all = self.all_gather(own.to_vec())?;
        Ok(all
            .as_chunks::<M>()
            .0
            .iter()
            .fold(own, |a, b| std::array::from_fn(|i| a[i].max(b[i]))))
    }

    /// Lets `work` act on the planes that are owned while they lie so that lines along the axes 1 and 2 are whole: each rank
    /// has some places of axis 0, in groups of `step`. `work` is told the shape that it sees and the first place; a rank
    /// without places does nothing.
    ///
    /// # Errors
    /// Those of [`Ranks::all_to_all`].
    pub(crate) fn transposed<R: Default>(
        &self,
        own: &mut [f64],
        step: usize,
        work: impl FnOnce(&mut [f64], Shape, usize) -> R,
    ) -> Result<R, Error> {
        if self.is_alone() {
            return Ok(work(own, self.shape, 0));
        }
        let (shape, count) = (self.shape, self.ranks.count());
        let [n0, n1, n2] = shape.n;
        let groups = n0.div_ceil(step);
        let columns = |r: usize| {
            (groups * r / count * step).min(n0)..(groups * (r + 1) / count * step).min(n0)
        };
        let mine = columns(self.ranks.rank());
        let to: Vec<usize> = (0..count)
            .map(|r| shape.own().len() * n1 * columns(r).len())
            .collect();
        let from: Vec<usize> = (0..count)
            .map(|r| shape.planes_of(r, count).len() * n1 * mine.len())
            .collect();
        let mut pieces = vec![0.0; own.len()];
        pack(
            own,
            &mut pieces,
            shape,
            (0..count).map(columns),
            |row, piece| piece.copy_from_slice(row),
        );
        // In the order of the ranks the planes follow one another.
        let mut turned = vec![0.0; mine.len() * n1 * n2];
        self.ranks.all_to_all(&pieces, &to, &mut turned, &from)?;
        let found = if mine.is_empty() {
            R::default()
        } else {
            work(&mut turned, Shape::whole([mine.len(), n1, n2]), mine.start)
        };
        self.ranks.all_to_all(&turned, &from, &mut pieces, &to)?;
        pack(
            own,
            &mut pieces,
            shape,
            (0..count).map(columns),
            |row, piece| row.copy_from_slice(piece),
        );
        Ok(found)
    }

    /// What rank 0 has of some numbers, on all: what decides what all do next must be the same to the last bit, also where
    /// the machines differ.
    ///
    /// # Errors
    /// Those of [`Ranks::all_to_all`].
    pub(crate) fn broadcast(&self, numbers: impl FnOnce() -> Vec<f64>) -> Result<Vec<f64>, Error> {
        self.all_gather(if self.is_first() {
            numbers()
        } else {
            Vec::new()
        })
    }

    /// As [`ranks::all_agree`].
    ///
    /// # Errors
    /// As there.
    pub(crate) fn all_agree<T>(&self, result: Result<T, Error>) -> Result<T, Error> {
        ranks::all_agree(&*self.ranks, result, |other| other)
    }
}

/// Goes through the pieces of all rows of `own`: those of the first columns, plane after plane, then those of the next.
fn pack(
    own: &mut [f64],
    pieces: &mut [f64],
    shape: Shape,
    columns: impl Iterator<Item = Range<usize>>,
    each: impl Fn(&mut [f64], &mut [f64]) + Sync,
) {
    let [n0, n1, _] = shape.n;
    let mut rest = pieces;
    for columns in columns.filter(|columns| !columns.is_empty()) {
        let (part, after) = rest.split_at_mut(shape.own().len() * n1 * columns.len());
        let planes = own
            .par_chunks_mut(shape.plane())
            .zip(part.par_chunks_mut(n1 * columns.len()));
        planes.for_each(|(plane, part)| {
            for (row, piece) in plane.chunks_mut(n0).zip(part.chunks_mut(columns.len())) {
                each(&mut row[columns.clone()], piece);
            }
        });
        rest = after;
    }
}
