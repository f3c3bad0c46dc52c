//! A file of tagged sections with a version and a checksum, put in place in one piece.
//!
//! Layout, all numbers little-endian: 16 bytes of magic, version (`u32`), number of sections (`u32`); each section an
//! eight-byte tag, its length in bytes (`u64`) and its content; at last the SHA-256 of all before. The magic holds bytes that
//! a transfer as text would change. A file is written beside its place, synced, then renamed.
//!
//! Check: every truncation and every flipped byte of a small file is refused.

use std::fs::{self, File};
use std::io::{self, BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use crate::Error;

const MAGIC: [u8; 16] = *b"\x89WAKEFLOW\r\n\x1a\n\0\0\0";
const CHECKSUM_BYTES: u64 = 32;
/// Bytes before the first section.
const HEAD_BYTES: u64 = 24;
/// Values converted at once.
const BATCH: usize = 8192;

/// Name of a section.
pub(super) type Tag = [u8; 8];

/// Content of a section.
pub(super) enum Content<'a> {
    Bytes(&'a [u8]),
    Floats(&'a [f64]),
}

impl Content<'_> {
    fn bytes(&self) -> u64 {
        match self {
            Self::Bytes(bytes) => bytes.len() as u64,
            Self::Floats(values) => 8 * values.len() as u64,
        }
    }
}

/// [`Error::File`] of a refusal.
pub(super) fn refused(action: &'static str, path: &Path, error: &io::Error) -> Error {
    Error::File { action, path: path.to_owned(), kind: error.kind(), reason: error.to_string() }
}

/// Hashes what passes through it.
struct Hashing<W> {
    inner: W,
    hash: Sha256,
}

impl<W: Write> Write for Hashing<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.inner.write(bytes)?;
        self.hash.update(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}

/// Writes a file; an older one of that name is replaced, or renamed to `previous`, only once the new one is safe on disk.
pub(super) fn write(
    path: &Path,
    previous: Option<&Path>,
    version: u32,
    sections: &[(Tag, Content<'_>)],
) -> Result<(), Error> {
    let part = beside(path);
    let result = write_part(&part, version, sections).and_then(|()| {
        if let Some(previous) = previous
            && path.exists()
        {
            fs::rename(path, previous)?;
        }
        fs::rename(&part, path)
    });
    if let Err(error) = result {
        // The first refusal is the one to report.
        let _ = fs::remove_file(&part);
        return Err(refused("write", path, &error));
    }
    // Makes the renaming last through a power failure where the system can do so.
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let _ = File::open(folder).and_then(|f| f.sync_all());
    Ok(())
}

/// The name under which a file is written before it is put in place.
fn beside(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".part");
    path.with_file_name(name)
}

fn write_part(part: &Path, version: u32, sections: &[(Tag, Content<'_>)]) -> io::Result<()> {
    let mut out = Hashing { inner: BufWriter::with_capacity(1 << 18, File::create(part)?), hash: Sha256::new() };
    out.write_all(&MAGIC)?;
    out.write_all(&version.to_le_bytes())?;
    out.write_all(&(sections.len() as u32).to_le_bytes())?;
    for (tag, content) in sections {
        out.write_all(tag)?;
        out.write_all(&content.bytes().to_le_bytes())?;
        match content {
            Content::Bytes(bytes) => out.write_all(bytes)?,
            Content::Floats(values) => {
                let mut buffer = Vec::with_capacity(8 * BATCH);
                for batch in values.chunks(BATCH) {
                    buffer.clear();
                    buffer.extend(batch.iter().flat_map(|v| v.to_le_bytes()));
                    out.write_all(&buffer)?;
                }
            }
        }
    }
    let Hashing { mut inner, hash } = out;
    inner.write_all(&hash.finalize())?;
    inner.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()
}

/// A file whose checksum is right, read section after section.
#[derive(Debug)]
pub(super) struct Reader {
    path: PathBuf,
    file: BufReader<File>,
    sections_left: u32,
    /// Bytes before the checksum that are not read yet.
    left: u64,
}

impl Reader {
    /// Opens a file and checks its magic, version and checksum.
    pub(super) fn open(path: &Path, supported: u32) -> Result<Self, Error> {
        let io = |error: &io::Error| refused("read", path, error);
        let mut file = File::open(path).map_err(|e| io(&e))?;
        let length = file.metadata().map_err(|e| io(&e))?.len();
        let mut head = [0; HEAD_BYTES as usize];
        let found = read_up_to(&mut file, &mut head).map_err(|e| io(&e))?;
        let magic = found.min(MAGIC.len());
        if found == 0 || head[..magic] != MAGIC[..magic] {
            return Err(Error::NotACheckpoint { path: path.to_owned() });
        }
        let damaged = |what| Error::CheckpointDamaged { path: path.to_owned(), what };
        if length < HEAD_BYTES + CHECKSUM_BYTES {
            return Err(damaged("it ends within its first bytes"));
        }
        let [.., a, b, c, d, e, f, g, h] = head;
        let version = u32::from_le_bytes([a, b, c, d]);
        if version != supported {
            return Err(Error::CheckpointVersion { path: path.to_owned(), found: version, supported });
        }
        let mut reader = Self {
            path: path.to_owned(),
            file: BufReader::with_capacity(1 << 18, file),
            sections_left: u32::from_le_bytes([e, f, g, h]),
            left: length - HEAD_BYTES - CHECKSUM_BYTES,
        };
        reader.check(&head)?;
        Ok(reader)
    }

    /// Reads the whole file once against its checksum and goes back to the first section.
    fn check(&mut self, head: &[u8]) -> Result<(), Error> {
        use io::Seek as _;
        let mut hash = Sha256::new();
        hash.update(head);
        let mut buffer = vec![0; 8 * BATCH];
        let mut left = self.left;
        while left > 0 {
            let count = left.min(buffer.len() as u64) as usize;
            self.fill(&mut buffer[..count])?;
            hash.update(&buffer[..count]);
            left -= count as u64;
        }
        let mut stored = [0; CHECKSUM_BYTES as usize];
        self.fill(&mut stored)?;
        if hash.finalize()[..] != stored[..] {
            return Err(self.damaged("its checksum is wrong, so it was cut off or altered"));
        }
        self.file.seek(io::SeekFrom::Start(HEAD_BYTES)).map_err(|e| refused("read", &self.path, &e))?;
        Ok(())
    }

    pub(super) fn damaged(&self, what: &'static str) -> Error {
        Error::CheckpointDamaged { path: self.path.clone(), what }
    }

    fn fill(&mut self, buffer: &mut [u8]) -> Result<(), Error> {
        self.file.read_exact(buffer).map_err(|e| match e.kind() {
            io::ErrorKind::UnexpectedEof => self.damaged("it is cut off"),
            _ => refused("read", &self.path, &e),
        })
    }

    /// Length in bytes of the next section, which must have this tag.
    fn section(&mut self, tag: &Tag) -> Result<u64, Error> {
        let mut head = [0; 16];
        if self.sections_left == 0 || self.left < head.len() as u64 {
            return Err(self.damaged("a section is missing"));
        }
        self.fill(&mut head)?;
        self.sections_left -= 1;
        self.left -= head.len() as u64;
        let [a, b, c, d, e, f, g, h] = head[8..] else { return Err(self.damaged("a section is missing")) };
        let bytes = u64::from_le_bytes([a, b, c, d, e, f, g, h]);
        if head[..8] != tag[..] || bytes > self.left {
            return Err(self.damaged("a section is not where it should be"));
        }
        self.left -= bytes;
        Ok(bytes)
    }

    /// The next section as bytes.
    pub(super) fn bytes(&mut self, tag: &Tag) -> Result<Vec<u8>, Error> {
        let mut content = vec![0; self.section(tag)? as usize];
        self.fill(&mut content)?;
        Ok(content)
    }

    /// The next section as numbers.
    pub(super) fn floats(&mut self, tag: &Tag) -> Result<Vec<f64>, Error> {
        let bytes = self.section(tag)?;
        if bytes % 8 != 0 {
            return Err(self.damaged("a section is not made of numbers"));
        }
        let mut values = Vec::with_capacity((bytes / 8) as usize);
        let mut buffer = vec![0; 8 * BATCH];
        let mut left = bytes;
        while left > 0 {
            let count = left.min(buffer.len() as u64) as usize;
            self.fill(&mut buffer[..count])?;
            values.extend(buffer[..count].as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)));
            left -= count as u64;
        }
        Ok(values)
    }
}

/// Reads as many bytes as there are, at most the length of `buffer`.
fn read_up_to(file: &mut File, buffer: &mut [u8]) -> io::Result<usize> {
    let mut found = 0;
    while found < buffer.len() {
        match file.read(&mut buffer[found..])? {
            0 => break,
            count => found += count,
        }
    }
    Ok(found)
}
