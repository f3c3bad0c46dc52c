//! A file in parts that lie at known places, so that several ranks can write it: each the parts that it has.
//! Check: the formats' tests put the parts of several ranks together and compare the bytes with those of one.

use std::ops::Range;

/// What one rank has of a file.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FileParts {
    /// Bytes of the whole file.
    pub length: u64,
    /// Where each part begins, and its bytes.
    pub parts: Vec<(u64, Vec<u8>)>,
}

impl FileParts {
    /// The bytes of a file whose parts are all here.
    pub fn into_bytes(self) -> Vec<u8> {
        let mut all = vec![0; self.length as usize];
        for (start, bytes) in self.parts {
            all[start as usize..start as usize + bytes.len()].copy_from_slice(&bytes);
        }
        all
    }
}

impl From<Vec<u8>> for FileParts {
    fn from(bytes: Vec<u8>) -> Self {
        Self {
            length: bytes.len() as u64,
            parts: vec![(0, bytes)],
        }
    }
}

/// What one of several ranks has of a field over planes across z.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Share {
    /// The planes whose values it has.
    pub planes: Range<usize>,
    /// Whether it writes what belongs to no plane, too.
    pub is_first: bool,
}

impl Share {
    /// All of `planes` planes.
    pub fn whole(planes: usize) -> Self {
        Self {
            planes: 0..planes,
            is_first: true,
        }
    }
}
