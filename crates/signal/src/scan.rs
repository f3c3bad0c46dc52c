//! The pulses of a whole scan: in parallel, in bounded memory, with one random stream for each pulse.
//!
//! Pulses are numbered line after line and made in batches of fixed size; what is done with them happens in their order, or
//! in blocks of fixed size whose results are merged in order. So neither the numbers nor their sums depend on the number of
//! threads.
//!
//! Check: records of a scan are those made one by one; sums have the same bits with 1, 2 and 5 threads.

use ndarray::Array2;
use num_complex::Complex;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::digitise::{Clipped, Digitiser};
use crate::parallel::{map_chunks, map_indices};
use crate::{Error, Scratch, Shot, Simulator};

/// Records that are in memory at a time.
const BATCH: usize = 256;

/// Records summed one after the other by [`Scan::fold`], and blocks of them that are in memory at a time.
const BLOCK: usize = 32;
const BLOCKS: usize = 128;

/// Which pulse of a scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct PulseKey {
    /// Index of the line of sight.
    pub line: usize,
    /// Index of the pulse among those of its line.
    pub pulse: usize,
}

/// A random generator for one pulse: its 256 bits of state are four hashes (SplitMix64) of seed, line and pulse, so that
/// neighbouring keys and seeds have unrelated streams.
pub fn pulse_generator(seed: u64, key: PulseKey) -> Xoshiro256PlusPlus {
    // Finaliser of SplitMix64 (Steele, Lea, Flood 2014): a bijection in which every bit of the input moves every other.
    let mix = |mut x: u64| {
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    };
    const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;
    let mut state = [0; 32];
    for (word, bytes) in (1_u64..).zip(state.chunks_exact_mut(8)) {
        let keyed = [seed, key.line as u64, key.pulse as u64];
        let hash = keyed.iter().fold(word.wrapping_mul(GOLDEN), |hash, part| {
            mix(hash.wrapping_add(GOLDEN) ^ mix(part.wrapping_add(word.wrapping_mul(GOLDEN))))
        });
        bytes.copy_from_slice(&hash.to_le_bytes());
    }
    Xoshiro256PlusPlus::from_seed(state)
}

/// The two kinds of samples: `f64`, the current at the intermediate frequency
/// ([`Simulator::record_into`]), and `Complex<f64>`, the baseband ([`Simulator::baseband_into`]).
pub trait Sample: sealed::Make {}

impl Sample for f64 {}
impl Sample for Complex<f64> {}

mod sealed {
    use super::{Clipped, Complex, Digitiser, Error, Rng, Scratch, Shot, Simulator};

    pub trait Make: Copy + Default + Send + Sync {
        fn make<R: Rng>(s: &Simulator, shot: Shot<'_>, rng: R, w: &mut Scratch, out: &mut [Self]) -> Result<(), Error>;
        fn digitise(digitiser: &Digitiser, samples: &mut [Self]) -> Result<Clipped, Error>;
    }

    impl Make for f64 {
        fn make<R: Rng>(s: &Simulator, shot: Shot<'_>, rng: R, w: &mut Scratch, out: &mut [Self]) -> Result<(), Error> {
            s.record_into(shot, &mut { rng }, w, out)
        }

        fn digitise(digitiser: &Digitiser, samples: &mut [Self]) -> Result<Clipped, Error> {
            digitiser.digitise(samples)
        }
    }

    impl Make for Complex<f64> {
        fn make<R: Rng>(s: &Simulator, shot: Shot<'_>, rng: R, w: &mut Scratch, out: &mut [Self]) -> Result<(), Error> {
            s.baseband_into(shot, &mut { rng }, w, out)
        }

        fn digitise(digitiser: &Digitiser, samples: &mut [Self]) -> Result<Clipped, Error> {
            digitiser.digitise_complex(samples)
        }
    }
}

/// A scan: which pulses there are, what each meets, and its random numbers.
#[derive(Debug, Clone, Copy)]
pub struct Scan<'s, S, G> {
    /// Pulse, receiver and sampling times.
    pub simulator: &'s Simulator,
    /// Number of lines of sight.
    pub lines: usize,
    /// Number of pulses along each.
    pub pulses_per_line: usize,
    /// What a pulse meets, `Fn(PulseKey) -> Shot`; called from any thread.
    pub shot: S,
    /// The random generator of a pulse, `Fn(PulseKey) -> impl Rng`, such as [`pulse_generator`]; called from any thread.
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

    /// Hands each record \[A\] to `sink`, in the order of lines and pulses; makes them in parallel, some hundred at a time,
    /// however many there are. Returns how many samples were clipped.
    ///
    /// # Errors
    /// The first error in the order of the records: of `sink`, or as [`Simulator::record_into`] and
    /// [`Digitiser::digitise`]. Records before it have been handed over.
    pub fn for_each<T: Sample, E: From<Error>>(
        &self,
        mut sink: impl FnMut(PulseKey, &[T]) -> Result<(), E>,
    ) -> Result<Clipped, E> {
        let samples = self.simulator.record().samples;
        let mut clipped = Clipped::default();
        let mut batch_a = vec![T::default(); samples * BATCH.min(self.records())];
        for first in (0..self.records()).step_by(BATCH) {
            let count = BATCH.min(self.records() - first);
            let rows = &mut batch_a[..count * samples];
            let made = map_chunks(rows, samples, Scratch::default, |scratch, i, out| {
                self.make(self.key(first + i), scratch, out)
            });
            for ((i, result), row) in made.into_iter().enumerate().zip(rows.chunks(samples)) {
                clipped += result?;
                sink(self.key(first + i), row)?;
            }
        }
        Ok(clipped)
    }

    /// Sums up the records in parallel: each block of records is added, in order, to an accumulator of its own made by
    /// `new`; `merge` joins them in order. Memory is bounded by some hundred accumulators.
    ///
    /// # Errors
    /// As [`Scan::for_each`], with the errors of `add`.
    pub fn fold<T: Sample, A: Send, E: From<Error> + Send>(
        &self,
        new: impl Fn() -> A + Sync + Send,
        add: impl Fn(&mut A, PulseKey, &[T]) -> Result<(), E> + Sync + Send,
        mut merge: impl FnMut(&mut A, A),
    ) -> Result<(A, Clipped), E> {
        let block = |index: usize| -> Result<(A, Clipped), E> {
            let (mut sum, mut clipped, mut scratch) = (new(), Clipped::default(), Scratch::default());
            let mut row_a = vec![T::default(); self.simulator.record().samples];
            for record in index * BLOCK..((index + 1) * BLOCK).min(self.records()) {
                clipped += self.make(self.key(record), &mut scratch, &mut row_a)?;
                add(&mut sum, self.key(record), &row_a)?;
            }
            Ok((sum, clipped))
        };
        let blocks = self.records().div_ceil(BLOCK);
        let (mut sum, mut clipped) = (new(), Clipped::default());
        for first in (0..blocks).step_by(BLOCKS) {
            for part in map_indices(BLOCKS.min(blocks - first), |i| block(first + i)) {
                let (part, part_clipped) = part?;
                merge(&mut sum, part);
                clipped += part_clipped;
            }
        }
        Ok((sum, clipped))
    }

    /// All records in memory \[record, sample\], A, the pulses of a line together; and how many samples were clipped.
    ///
    /// # Errors
    /// As [`Scan::for_each`].
    pub fn collect<T: Sample>(&self) -> Result<(Array2<T>, Clipped), Error> {
        let samples = self.simulator.record().samples;
        let mut records_a = Array2::from_elem((self.records(), samples), T::default());
        let mut clipped = Clipped::default();
        if let Some(rows) = records_a.as_slice_mut() {
            let made =
                map_chunks(rows, samples, Scratch::default, |scratch, i, out| self.make(self.key(i), scratch, out));
            for result in made {
                clipped += result?;
            }
        }
        Ok((records_a, clipped))
    }

    fn key(&self, record: usize) -> PulseKey {
        PulseKey { line: record / self.pulses_per_line, pulse: record % self.pulses_per_line }
    }

    fn make<T: Sample>(&self, key: PulseKey, scratch: &mut Scratch, out_a: &mut [T]) -> Result<Clipped, Error> {
        T::make(self.simulator, (self.shot)(key), (self.generator)(key), scratch, out_a)?;
        match &self.digitiser {
            Some(digitiser) => T::digitise(digitiser, out_a),
            None => Ok(Clipped::default()),
        }
    }
}
