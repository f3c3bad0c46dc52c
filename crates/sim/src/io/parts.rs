//! A file in parts that lie at known places, so that several ranks can write it: each the parts that it has.
//! Check: the formats' tests put the parts of several ranks together and compare the bytes with those of one.

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
