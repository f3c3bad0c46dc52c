//! Loops that run on the caller's thread pool with feature `rayon` and one after the other without.
//!
//! Items are independent and results are in the order of the items, so the bits do not depend on
//! the number of threads.

/// `f(state, index, chunk)` for every chunk of `size` elements; `state` is made once per worker.
pub(crate) fn map_chunks<T: Send, S, O: Send>(
    data: &mut [T],
    size: usize,
    state: impl Fn() -> S + Sync + Send,
    f: impl Fn(&mut S, usize, &mut [T]) -> O + Sync + Send,
) -> Vec<O> {
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        data.par_chunks_mut(size)
            .enumerate()
            .map_init(state, |worker, (index, chunk)| f(worker, index, chunk))
            .collect()
    }
    #[cfg(not(feature = "rayon"))]
    {
        let mut worker = state();
        let mut results = Vec::new();
        for (index, chunk) in data.chunks_mut(size).enumerate() {
            results.push(f(&mut worker, index, chunk));
        }
        results
    }
}
