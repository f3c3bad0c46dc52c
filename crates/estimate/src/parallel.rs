//! Indexed maps that run on the caller's thread pool with feature `rayon` and in a plain loop without.
//!
//! Every element is computed alone and in a fixed order, so the bits do not depend on the number of threads.

/// `f(state, index)` for every index below `count`, in order; `state` is made once per worker.
pub(crate) fn map_indexed<T: Send, W>(
    count: usize,
    state: impl Fn() -> W + Sync + Send,
    f: impl Fn(&mut W, usize) -> T + Sync + Send,
) -> Vec<T> {
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        (0..count).into_par_iter().map_init(state, f).collect()
    }
    #[cfg(not(feature = "rayon"))]
    {
        let mut worker = state();
        (0..count).map(|index| f(&mut worker, index)).collect()
    }
}

/// `f(index)` for every index below `count`, in order.
pub(crate) fn map_each<T: Send>(count: usize, f: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
    map_indexed(count, || (), |(), index| f(index))
}

/// `f(state, index, chunk)` for every chunk of `size` numbers.
pub(crate) fn for_each_chunk<W>(
    data: &mut [f64],
    size: usize,
    state: impl Fn() -> W + Sync + Send,
    f: impl Fn(&mut W, usize, &mut [f64]) + Sync + Send,
) {
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        data.par_chunks_mut(size)
            .enumerate()
            .for_each_init(state, |worker, (index, chunk)| f(worker, index, chunk));
    }
    #[cfg(not(feature = "rayon"))]
    {
        let mut worker = state();
        for (index, chunk) in data.chunks_mut(size).enumerate() {
            f(&mut worker, index, chunk);
        }
    }
}
