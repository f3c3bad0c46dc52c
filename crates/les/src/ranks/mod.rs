//! The ranks that share a flow: processes of one machine or of many, each with a slab of the mesh and threads of its own.
//!
//! All that the solver exchanges is one operation, [`Ranks::turn`]: halos, lines that cross slabs, numbers of all planes.
//! Sums are made from the numbers of single planes in the order of the mesh, so that results have the same bits for any
//! number of ranks.
//!
//! Check: the solver on ranks against one process, bit for bit (`solver::slabs_tests`); a rank that is lost.

mod threads;

use std::fmt::Debug;

use crate::Error;

pub use threads::{ThreadRanks, on_threads};

/// The ranks that share a flow. All of them call the same operations in the same order.
pub trait Ranks: Debug + Send + Sync {
    /// Number of this rank, from 0. Rank 0 is the one that observers and files see.
    fn rank(&self) -> usize;

    /// How many there are.
    fn count(&self) -> usize;

    /// All-to-all: of `send` the first `to[0]` values go to rank 0, the next `to[1]` to rank 1; `receive` gets `from[0]`
    /// values of rank 0, then `from[1]` of rank 1.
    ///
    /// # Errors
    /// [`Error::RankLost`] if a rank has ended that was to send something.
    fn turn(&self, send: &[f64], to: &[usize], receive: &mut [f64], from: &[usize]) -> Result<(), Error>;
}

/// One process.
#[derive(Debug, Clone, Copy, Default)]
pub struct Single;

impl Ranks for Single {
    fn rank(&self) -> usize {
        0
    }

    fn count(&self) -> usize {
        1
    }

    fn turn(&self, send: &[f64], _: &[usize], receive: &mut [f64], _: &[usize]) -> Result<(), Error> {
        receive.copy_from_slice(send);
        Ok(())
    }
}
