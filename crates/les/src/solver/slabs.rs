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
use crate::ranks::{self, Ranks, TimedRanks};

/// All planes of a halo, for fields that are read by operators of several kinds.
pub(crate) const WHOLE: [usize; 2] = [HALO; 2];

/// The ranks and what this one holds.
#[derive(Debug, Clone)]
pub(crate) struct Slabs {
    pub(crate) ranks: Arc<TimedRanks>,
    pub(crate) shape: Shape,
}

impl Slabs {
    /// Equal slabs of a mesh of `n` values along the memory axes.
    ///
    /// # Errors
    /// [`Error::TooManyRanks`] if one would own fewer planes than a halo has.
    pub(crate) fn new(ranks: Arc<dyn Ranks>, n: [usize; 3]) -> Result<Self, Error> {
        let count = ranks.count();
        let most = (n[2] / HALO).max(1);
        if count > most {
            return Err(Error::TooManyRanks {
                ranks: count,
                planes: n[2],
                most,
            });
        }
        let shape = Shape::slab(n, ranks.rank(), count);
        Ok(Self {
            ranks: Arc::new(TimedRanks::new(ranks)),
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

    /// How many planes below and above its own a slab needs of a field that is read by an operator
    /// along axis 2 with the rows `rows`; the most over all slabs, so that the ranks agree.
    pub(crate) fn reach(&self, rows: &[Taps]) -> [usize; 2] {
        let n2 = self.shape.n[2];
        let count = self.ranks.count();
        let [mut reach_below, mut reach_above] = [0; 2];
        for rank in 0..count {
            let own = self.shape.planes_of(rank, count);
            for &(plane, _) in rows[own.clone()].iter().flatten() {
                if own.contains(&plane) {
                    continue;
                }
                let below = (own.start + n2 - plane) % n2;
                let above = (plane + n2 - own.end) % n2 + 1;
                if below <= above {
                    reach_below = reach_below.max(below);
                } else {
                    reach_above = reach_above.max(above);
                }
            }
        }
        [reach_below, reach_above]
    }

    /// Planes of the halos of rank `to` that rank `from` owns, in the order in which they are sent.
    fn halo_planes(&self, from: usize, to: usize, [below, above]: [usize; 2]) -> Vec<usize> {
        let n2 = self.shape.n[2];
        let count = self.ranks.count();
        let owned = self.shape.planes_of(from, count);
        let Range { start, end } = self.shape.planes_of(to, count);
        let halos = (start + n2 - below..start + n2).chain(end..end + above);
        halos
            .map(|k| k % n2)
            .filter(|k| owned.contains(k))
            .collect()
    }

    /// Brings `below` and `above` planes of the halos of fields up to date, at most [`HALO`] each.
    ///
    /// # Errors
    /// Those of [`Ranks::all_to_all`].
    pub(crate) fn halos(&self, fields: &mut [&mut [f64]], reach: [usize; 2]) -> Result<(), Error> {
        if self.is_alone() {
            return Ok(());
        }
        let shape = self.shape;
        let count = self.ranks.count();
        let own_rank = self.ranks.rank();
        let plane = shape.plane();
        let mut to = Vec::with_capacity(count);
        let mut send = Vec::new();
        for rank in 0..count {
            let planes = self.halo_planes(own_rank, rank, reach);
            to.push(planes.len() * plane * fields.len());
            for field in fields.iter() {
                for &k in &planes {
                    send.extend_from_slice(&field[shape.place([0, 0, k])..][..plane]);
                }
            }
        }
        let incoming: Vec<Vec<usize>> = (0..count)
            .map(|rank| self.halo_planes(rank, own_rank, reach))
            .collect();
        let from: Vec<usize> = incoming
            .iter()
            .map(|planes| planes.len() * plane * fields.len())
            .collect();
        let mut receive = vec![0.0; from.iter().sum()];
        self.ranks.all_to_all(&send, &to, &mut receive, &from)?;
        let mut received = receive.chunks(plane);
        for planes in &incoming {
            for field in fields.iter_mut() {
                for (&k, values) in planes.iter().zip(&mut received) {
                    field[shape.place([0, 0, k])..][..plane].copy_from_slice(values);
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

    /// The numbers of all planes, from those of the planes that are owned: what is summed in their
    /// order does not depend on the ranks.
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

    /// Lets `work` act on the planes that are owned while they lie so that lines along the axes 1
    /// and 2 are whole: each rank has some places of axis 0, in groups of `step`. The arguments of
    /// `work` are the field, its shape and its first place; a rank without places does nothing.
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
        let shape = self.shape;
        let count = self.ranks.count();
        let [n0, n1, n2] = shape.n;
        let groups = n0.div_ceil(step);
        // Places of axis 0 that each rank gets.
        let columns: Vec<Range<usize>> = (0..count)
            .map(|r| (groups * r / count * step).min(n0)..(groups * (r + 1) / count * step).min(n0))
            .collect();
        let mine = columns[self.ranks.rank()].clone();
        let to: Vec<usize> = columns
            .iter()
            .map(|columns| shape.own().len() * n1 * columns.len())
            .collect();
        let from: Vec<usize> = (0..count)
            .map(|r| shape.planes_of(r, count).len() * n1 * mine.len())
            .collect();
        let mut pieces = vec![0.0; own.len()];
        pack(own, &mut pieces, shape, &columns, |row, piece| {
            piece.copy_from_slice(row)
        });
        // In the order of the ranks the planes follow one another.
        let mut turned = vec![0.0; mine.len() * n1 * n2];
        self.ranks.all_to_all(&pieces, &to, &mut turned, &from)?;
        let found = if mine.is_empty() {
            R::default()
        } else {
            work(&mut turned, Shape::whole([mine.len(), n1, n2]), mine.start)
        };
        self.ranks.all_to_all(&turned, &from, &mut pieces, &to)?;
        pack(own, &mut pieces, shape, &columns, |row, piece| {
            row.copy_from_slice(piece)
        });
        Ok(found)
    }

    /// What rank 0 has of some numbers, on all: what decides what all do next must be the same to
    /// the last bit, also where the machines differ.
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

/// Goes through the pieces of all rows of `own`: those of the first columns, plane after plane,
/// then those of the next.
fn pack(
    own: &mut [f64],
    pieces: &mut [f64],
    shape: Shape,
    columns: &[Range<usize>],
    each: impl Fn(&mut [f64], &mut [f64]) + Sync,
) {
    let [n0, n1, _] = shape.n;
    let mut rest = pieces;
    for columns in columns.iter().filter(|columns| !columns.is_empty()) {
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
