//! Numbers that begin on a line of the cache.
//!
//! A vector of eight numbers that lies across two lines costs two accesses. Rows of a field whose
//! length is a multiple of eight begin on a line where the field does, and allocators promise no
//! more than two numbers.
//!
//! Check: where the numbers begin, also of a copy.

use std::ops::{Deref, DerefMut};

/// Bytes of a line of the cache, which is also the widest vector of the processors in use.
const LINE_BYTES: usize = 64;
/// Numbers that are allocated beyond those that are wanted, so that some place before the first of
/// them begins a line.
const SPARE: usize = LINE_BYTES / size_of::<f64>() - 1;

/// A list of numbers of fixed length, the first of which begins a line of the cache.
#[derive(Debug, Default)]
pub(crate) struct Aligned {
    memory: Vec<f64>,
    first: usize,
}

impl Aligned {
    /// `count` zeros.
    pub(crate) fn zeros(count: usize) -> Self {
        if count == 0 {
            return Self::default();
        }
        let mut memory = vec![0.0; count + SPARE];
        // More than the spare numbers would mean that nothing is known of the address: any place is
        // right, if slower.
        let first = memory.as_ptr().align_offset(LINE_BYTES).min(SPARE);
        memory.truncate(first + count);
        Self { memory, first }
    }
}

impl Deref for Aligned {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        &self.memory[self.first..]
    }
}

impl DerefMut for Aligned {
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut self.memory[self.first..]
    }
}

impl Clone for Aligned {
    fn clone(&self) -> Self {
        let mut copy = Self::zeros(self.len());
        copy.copy_from_slice(self);
        copy
    }
}

impl PartialEq for Aligned {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_their_copies_begin_a_line_and_stay_the_same() {
        for count in [0, 1, 7, 8, 9, 1000, 100_000] {
            let mut numbers = Aligned::zeros(count);
            assert_eq!(*numbers, vec![0.0; count]);
            numbers
                .iter_mut()
                .enumerate()
                .for_each(|(place, number)| *number = place as f64);
            let copy = numbers.clone();
            assert_eq!(copy, numbers);
            for numbers in [&numbers, &copy] {
                assert!(
                    count == 0 || numbers.as_ptr().addr() % LINE_BYTES == 0,
                    "{count}"
                );
            }
        }
    }
}
