//! The pulses of a whole scan: in parallel, in bounded memory, with one random stream
//! for each pulse.
//!
//! Pulses are numbered line after line and made in batches of fixed size; what is done with them
//! happens in their order. So neither the numbers nor their sums depend on the number of threads.
//!
//! Check: records of a scan are those made one by one; they have the same bits with 1,
//! 2 and 5 threads.

use ndarray::Array2;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::digitise::Digitiser;
use crate::parallel::map_chunks;
use crate::{Error, Sample, Scratch, Shot, Simulator};

/// Records that are in memory at a time.
const BATCH: usize = 256;

/// Which pulse of a scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct PulseKey {
    /// Index of the line of sight.
    pub line: usize,
    /// Index of the pulse among those of its line.
    pub pulse: usize,
}

/// A random generator for one pulse: its 256 bits of state are four hashes (SplitMix64) of seed,
/// line and pulse, so that neighbouring keys and seeds have unrelated streams. For programs that use this crate alone:
/// `wakescope run` has generators of its own.
pub fn pulse_generator(seed: u64, key: PulseKey) -> Xoshiro256PlusPlus {
    const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;
    let mut state = [0; 32];
    for (word, bytes) in (1_u64..).zip(state.chunks_exact_mut(8)) {
        let salt = word.wrapping_mul(GOLDEN);
        let mut hash = salt;
        for input in [seed, key.line as u64, key.pulse as u64] {
            hash = mix(hash.wrapping_add(GOLDEN) ^ mix(input.wrapping_add(salt)));
        }
        bytes.copy_from_slice(&hash.to_le_bytes());
    }
    Xoshiro256PlusPlus::from_seed(state)
}

/// Finaliser of SplitMix64 (Steele, Lea, Flood 2014): a bijection in which every bit of the input
/// changes every other.
fn mix(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// A scan: its pulses, their lines of sight and their random numbers.
#[derive(Debug, Clone, Copy)]
pub struct Scan<'s, S, G> {
    /// Pulse, receiver and sampling times.
    pub simulator: &'s Simulator,
    /// Number of lines of sight.
    pub lines: usize,
    /// Number of pulses along each.
    pub pulses_per_line: usize,
    /// Line of sight and efficiency of a pulse, `Fn(PulseKey) -> Shot`; called from any thread.
    pub shot: S,
    /// The random generator of a pulse, `Fn(PulseKey) -> impl Rng`, such as [`pulse_generator`];
    /// called from any thread.
    pub generator: G,
    /// The converter; `None`: samples are not rounded or clipped.
    pub digitiser: Option<Digitiser>,
}

impl<'a, S, G, R> Scan<'_, S, G>
where
    S: Fn(PulseKey) -> Shot<'a> + Sync,
    G: Fn(PulseKey) -> R + Sync,
    R: Rng,
{
    /// Number of records.
    pub fn records(&self) -> usize {
        self.lines * self.pulses_per_line
    }

    /// Hands each record \[A\] to `sink`, in the order of lines and pulses; makes them in parallel,
    /// some hundred at a time, however many there are. Returns how many samples were clipped.
    ///
    /// # Errors
    /// The first error in the order of the records: of `sink`, or as [`Simulator::record_into`] and
    /// [`Digitiser::digitise`]. Records before it have been handed over.
    pub fn for_each<T: Sample, E: From<Error>>(
        &self,
        mut sink: impl FnMut(PulseKey, &[T]) -> Result<(), E>,
    ) -> Result<u64, E> {
        let samples = self.simulator.record().samples;
        let mut clipped = 0;
        let mut batch_a = vec![T::default(); samples * BATCH.min(self.records())];
        for first in (0..self.records()).step_by(BATCH) {
            let count = BATCH.min(self.records() - first);
            let rows = &mut batch_a[..count * samples];
            let results = self.make(first, rows);
            for (i, (result, row)) in results.into_iter().zip(rows.chunks(samples)).enumerate() {
                clipped += result?;
                sink(self.key(first + i), row)?;
            }
        }
        Ok(clipped)
    }

    /// All records in memory \[record, sample\], A, the pulses of a line together; and how many
    /// samples were clipped.
    ///
    /// # Errors
    /// As [`Scan::for_each`].
    pub fn collect<T: Sample>(&self) -> Result<(Array2<T>, u64), Error> {
        let mut records_a = Array2::from_elem(
            (self.records(), self.simulator.record().samples),
            T::default(),
        );
        let made = records_a
            .as_slice_mut()
            .map_or_else(Vec::new, |rows| self.make(0, rows));
        let mut clipped = 0;
        for result in made {
            clipped += result?;
        }
        Ok((records_a, clipped))
    }

    fn key(&self, record: usize) -> PulseKey {
        PulseKey {
            line: record / self.pulses_per_line,
            pulse: record % self.pulses_per_line,
        }
    }

    /// Makes the records from `first` on, in parallel.
    fn make<T: Sample>(&self, first: usize, rows_a: &mut [T]) -> Vec<Result<u64, Error>> {
        map_chunks(
            rows_a,
            self.simulator.record().samples,
            Scratch::default,
            |scratch, i, out_a| {
                let key = self.key(first + i);
                self.simulator.record_into(
                    (self.shot)(key),
                    &mut (self.generator)(key),
                    scratch,
                    out_a,
                )?;
                self.digitiser
                    .map_or(Ok(0), |digitiser| digitiser.digitise(out_a))
            },
        )
    }
}
