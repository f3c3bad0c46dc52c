//! Sizes that the forecast and the run share.

/// Records that are in memory at a time: some ten megabytes of them, and enough for every thread.
pub(crate) fn records_at_once<T>(samples: usize, pulses: usize) -> usize {
    let record_bytes = samples.max(1) * size_of::<T>();
    (PIECE_BYTES / record_bytes)
        .max(rayon::current_num_threads())
        .min(pulses.max(1))
}

/// Size of a piece of records, bytes.
const PIECE_BYTES: usize = 16 << 20;

/// Size of the airs of a piece, where pulses have their own, bytes.
pub(crate) const AIRS_BYTES: f64 = (64 << 20) as f64;

/// Points of the cross-plane across and up.
pub(crate) const PLANE_POINTS: (usize, usize) = (161, 81);
