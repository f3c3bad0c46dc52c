//! The ranks that share a flow: processes of one machine or of many, each with a slab of the mesh
//! and threads of its own.
//!
//! All that the solver exchanges is one operation, [`Ranks::all_to_all`]: halos, lines that cross
//! slabs, numbers of all planes. Sums are made from the numbers of single planes in the order of
//! the mesh, so that results have the same bits for any number of ranks.
//!
//! Check: the solver on ranks against one process, bit for bit (`solver::slabs_tests`); a rank that
//! is lost.

#[cfg(test)]
mod threads_for_tests;

use std::fmt::{Debug, Display};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use crate::Error;

#[cfg(test)]
pub(crate) use threads_for_tests::on_threads;

/// The ranks that share a flow. All of them call the same operations in the same order.
pub trait Ranks: Debug + Send + Sync {
    /// Number of this rank, from 0. Rank 0 is the one that observers and files see.
    fn rank(&self) -> usize;

    /// How many there are.
    fn count(&self) -> usize;

    /// All-to-all: of `send` the first `to[0]` values go to rank 0, the next `to[1]` to rank 1;
    /// `receive` gets `from[0]` values of rank 0, then `from[1]` of rank 1.
    ///
    /// # Errors
    /// [`Error::RankLost`] if a rank has ended that was to send something.
    fn all_to_all(
        &self,
        send: &[f64],
        to: &[usize],
        receive: &mut [f64],
        from: &[usize],
    ) -> Result<(), Error>;
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

    fn all_to_all(
        &self,
        send: &[f64],
        _: &[usize],
        receive: &mut [f64],
        _: &[usize],
    ) -> Result<(), Error> {
        receive.copy_from_slice(send);
        Ok(())
    }
}

/// Ranks, and how long their exchanges take, waiting for others included.
#[derive(Debug)]
pub(crate) struct TimedRanks {
    ranks: Arc<dyn Ranks>,
    spent_ns: AtomicU64,
}

impl TimedRanks {
    pub(crate) fn new(ranks: Arc<dyn Ranks>) -> Self {
        Self {
            ranks,
            spent_ns: AtomicU64::new(0),
        }
    }

    /// Time of all exchanges so far \[s\].
    pub(crate) fn spent_s(&self) -> f64 {
        1e-9 * self.spent_ns.load(Ordering::Relaxed) as f64
    }
}

impl Ranks for TimedRanks {
    fn rank(&self) -> usize {
        self.ranks.rank()
    }

    fn count(&self) -> usize {
        self.ranks.count()
    }

    fn all_to_all(
        &self,
        send: &[f64],
        to: &[usize],
        receive: &mut [f64],
        from: &[usize],
    ) -> Result<(), Error> {
        let started = Instant::now();
        let result = self.ranks.all_to_all(send, to, receive, from);
        self.spent_ns
            .fetch_add(started.elapsed().as_nanos() as u64, Ordering::Relaxed);
        result
    }
}

/// Everybody's numbers in the order of the ranks.
///
/// # Errors
/// Those of [`Ranks::all_to_all`].
pub fn all_gather(ranks: &dyn Ranks, own: Vec<f64>) -> Result<Vec<f64>, Error> {
    let count = ranks.count();
    if count == 1 {
        return Ok(own);
    }
    let lengths = send_to_all(ranks, &[own.len() as f64], &vec![1; count])?;
    let lengths: Vec<usize> = lengths.into_iter().map(|length| length as usize).collect();
    send_to_all(ranks, &own, &lengths)
}

/// Sends `own` to every rank; returns the values of all ranks, the number of which is `from`.
fn send_to_all(ranks: &dyn Ranks, own: &[f64], from: &[usize]) -> Result<Vec<f64>, Error> {
    let count = ranks.count();
    let mut all = vec![0.0; from.iter().sum()];
    ranks.all_to_all(&own.repeat(count), &vec![own.len(); count], &mut all, from)?;
    Ok(all)
}

/// An error of one rank is the error of all, that of the lowest if there are several; `other` makes
/// it from [`Error::OtherRank`], which has its words, where it did not happen.
///
/// # Errors
/// It; those of [`Ranks::all_to_all`].
pub fn all_agree<T, E: Display>(
    ranks: &dyn Ranks,
    result: Result<T, E>,
    other: impl Fn(Error) -> E,
) -> Result<T, E> {
    if ranks.count() == 1 {
        return result;
    }
    let own = result.as_ref().err().map(ToString::to_string);
    let failed = all_gather(ranks, vec![f64::from(u8::from(own.is_some()))]).map_err(&other)?;
    let Some(rank) = failed.iter().position(|failed| *failed > 0.0) else {
        return result;
    };
    let sent: Vec<f64> = match &own {
        Some(message) if ranks.rank() == rank => message.bytes().map(f64::from).collect(),
        _ => Vec::new(),
    };
    let bytes = all_gather(ranks, sent).map_err(&other)?;
    let bytes: Vec<u8> = bytes.iter().map(|byte| *byte as u8).collect();
    let message = String::from_utf8_lossy(&bytes).into_owned();
    match result {
        // Every rank that found the same keeps what it knows of it.
        Err(error) if own.as_ref() == Some(&message) => Err(error),
        _ => Err(other(Error::OtherRank { rank, message })),
    }
}
