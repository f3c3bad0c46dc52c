//! A file of tagged sections and of planes, with a version and checksums, put in place in one
//! piece.
//!
//! Layout, all numbers little-endian: 16 bytes of magic, version (`u32`), number of sections
//! (`u32`), bytes of all sections, number of planes, bytes of each (`u64`); each section an
//! eight-byte tag, its length in bytes (`u64`) and its content; the SHA-256 of all before. Then the
//! planes, each followed by the SHA-256 of that checksum, its number and its content: whoever has
//! planes writes and checks them alone. The magic holds bytes that a transfer as text would change.
//! A file is written beside its place, synced, then renamed.
//!
//! Check: every truncation and every flipped byte of a small file is refused; planes of another
//! file.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufReader, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use crate::Error;

const MAGIC: [u8; 16] = *b"\x89WAKEFLOW\r\n\x1a\n\0\0\0";
const CHECKSUM_BYTES: u64 = 32;
/// Bytes before the first section.
const HEAD_BYTES: u64 = 48;

/// SHA-256.
pub(super) type Checksum = [u8; CHECKSUM_BYTES as usize];

/// Name of a section.
pub(super) type Tag = [u8; 8];

/// [`Error::File`] of a refusal.
pub(super) fn refused(action: &'static str, path: &Path, error: &io::Error) -> Error {
    Error::File {
        action,
        path: path.to_owned(),
        kind: error.kind(),
        reason: error.to_string(),
    }
}

/// The planes of a file that is written: where they begin, what they belong to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Planes {
    pub(super) start: u64,
    pub(super) checksum: Checksum,
}

/// Begins a file for `planes` planes of `plane_bytes` each beside its place.
pub(super) fn begin(
    path: &Path,
    version: u32,
    sections: &[(Tag, Vec<u8>)],
    [planes, plane_bytes]: [u64; 2],
) -> Result<Planes, Error> {
    let mut bytes = Vec::new();
    for (tag, content) in sections {
        bytes.extend(tag);
        bytes.extend((content.len() as u64).to_le_bytes());
        bytes.extend(content);
    }
    let mut head = MAGIC.to_vec();
    for count in [version, sections.len() as u32] {
        head.extend(count.to_le_bytes());
    }
    for number in [bytes.len() as u64, planes, plane_bytes] {
        head.extend(number.to_le_bytes());
    }
    head.extend(bytes);
    let checksum: Checksum = Sha256::digest(&head).into();
    head.extend(checksum);
    let start = head.len() as u64;
    let written = File::create(beside(path)).and_then(|mut file| {
        file.write_all(&head)?;
        file.set_len(start + planes * (plane_bytes + CHECKSUM_BYTES))?;
        file.sync_all()
    });
    written.map_err(|error| refused("write", path, &error))?;
    Ok(Planes { start, checksum })
}

/// Writes planes from number `first` on to a file that was begun; `next` fills in the bytes of
/// each.
pub(super) fn write_planes(
    path: &Path,
    planes: Planes,
    numbers: std::ops::Range<usize>,
    plane_bytes: u64,
    next: impl Fn(usize, &mut Vec<u8>),
) -> Result<(), Error> {
    try_write_planes(path, planes, numbers, plane_bytes, next)
        .map_err(|error| refused("write", path, &error))
}

fn try_write_planes(
    path: &Path,
    planes: Planes,
    numbers: std::ops::Range<usize>,
    plane_bytes: u64,
    next: impl Fn(usize, &mut Vec<u8>),
) -> io::Result<()> {
    let mut file = OpenOptions::new().write(true).open(beside(path))?;
    let start = planes.start + numbers.start as u64 * (plane_bytes + CHECKSUM_BYTES);
    file.seek(SeekFrom::Start(start))?;
    let mut out = BufWriter::with_capacity(1 << 18, file);
    let mut bytes = Vec::with_capacity(plane_bytes as usize);
    for number in numbers {
        bytes.clear();
        next(number, &mut bytes);
        out.write_all(&bytes)?;
        out.write_all(&checksum_of(&planes.checksum, number, &bytes))?;
    }
    let file = out.into_inner().map_err(io::IntoInnerError::into_error)?;
    file.sync_all()
}

/// Checksum of a plane of the file whose head has the checksum `head`.
fn checksum_of(head: &Checksum, number: usize, bytes: &[u8]) -> Checksum {
    let hash = Sha256::new()
        .chain_update(head)
        .chain_update((number as u64).to_le_bytes());
    hash.chain_update(bytes).finalize().into()
}

/// Puts a whole file in place; an older one of that name is replaced, or renamed to `previous`.
pub(super) fn finish(path: &Path, previous: Option<&Path>) -> Result<(), Error> {
    if let Some(previous) = previous
        && path.exists()
    {
        fs::rename(path, previous).map_err(|error| refused("write", path, &error))?;
    }
    fs::rename(beside(path), path).map_err(|error| refused("write", path, &error))?;
    // Makes the renaming last through a power failure where the system can do so.
    let folder = path
        .parent()
        .filter(|p| !p.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    let _ = File::open(folder).and_then(|f| f.sync_all());
    Ok(())
}

/// Takes away what was begun.
pub(super) fn abandon(path: &Path) {
    // The first refusal is the one to report.
    let _ = fs::remove_file(beside(path));
}

/// The name under which a file is written before it is put in place.
fn beside(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".part");
    path.with_file_name(name)
}

/// [`Error::CheckpointDamaged`] of a file.
fn damaged(path: &Path, what: &'static str) -> Error {
    Error::CheckpointDamaged {
        path: path.to_owned(),
        what,
    }
}

/// A file that is open for reading, and its length in bytes.
fn open_with_length(path: &Path) -> io::Result<(File, u64)> {
    let file = File::open(path)?;
    let length = file.metadata()?.len();
    Ok((file, length))
}

/// Checks the magic and the version of a file that begins with `head`; returns the bytes of all
/// sections, and the number of planes with the bytes of each.
fn parse_head(path: &Path, head: &[u8], supported: u32) -> Result<(u64, [u64; 2]), Error> {
    let magic = head.len().min(MAGIC.len());
    if head.is_empty() || head[..magic] != MAGIC[..magic] {
        return Err(Error::NotACheckpoint {
            path: path.to_owned(),
        });
    }
    let words = head[magic..].as_chunks::<8>().0;
    let &[version_and_sections, section_bytes, planes, plane_bytes] = words else {
        return Err(damaged(path, "it ends within its first bytes"));
    };
    let version = u64::from_le_bytes(version_and_sections) as u32;
    if version != supported {
        return Err(Error::CheckpointVersion {
            path: path.to_owned(),
            found: version,
            supported,
        });
    }
    Ok((
        u64::from_le_bytes(section_bytes),
        [planes, plane_bytes].map(u64::from_le_bytes),
    ))
}

/// Where the first plane begins, if a file of `length` bytes is as long as it should be.
fn first_plane(section_bytes: u64, [planes, plane_bytes]: [u64; 2], length: u64) -> Option<u64> {
    let start = (HEAD_BYTES + CHECKSUM_BYTES).checked_add(section_bytes)?;
    let each = plane_bytes.checked_add(CHECKSUM_BYTES)?;
    let end = start.checked_add(planes.checked_mul(each)?)?;
    (end == length).then_some(start)
}

/// A file whose sections are whole, and whose planes are read one by one.
#[derive(Debug)]
pub(super) struct Reader {
    path: PathBuf,
    file: BufReader<File>,
    sections: Vec<(Tag, Vec<u8>)>,
    planes: Planes,
    /// Number of planes, and bytes of each.
    pub(super) counts: [u64; 2],
}

impl Reader {
    /// Opens a file and checks its magic, version, length and the checksum of its sections.
    pub(super) fn open(path: &Path, supported: u32) -> Result<Self, Error> {
        let (mut file, length) =
            open_with_length(path).map_err(|error| refused("read", path, &error))?;
        let mut head = Vec::new();
        let mut first_bytes = (&mut file).take(HEAD_BYTES);
        first_bytes
            .read_to_end(&mut head)
            .map_err(|error| refused("read", path, &error))?;
        let (section_bytes, counts) = parse_head(path, &head, supported)?;
        let Some(start) = first_plane(section_bytes, counts, length) else {
            return Err(damaged(path, "it has not the length that it should have"));
        };
        let mut reader = Self {
            path: path.to_owned(),
            file: BufReader::with_capacity(1 << 18, file),
            sections: Vec::new(),
            planes: Planes {
                start,
                checksum: [0; CHECKSUM_BYTES as usize],
            },
            counts,
        };
        let mut content = vec![0; section_bytes as usize];
        let mut stored = reader.planes.checksum;
        reader.fill(&mut content)?;
        reader.fill(&mut stored)?;
        let hash = Sha256::new().chain_update(head).chain_update(&content);
        reader.planes.checksum = hash.finalize().into();
        if reader.planes.checksum != stored {
            return Err(reader.damaged("its checksum is wrong, so it was cut off or altered"));
        }
        let Some(sections) = sections_of(&content) else {
            return Err(reader.damaged("a section is not where it should be"));
        };
        reader.sections = sections;
        Ok(reader)
    }

    /// The bytes of a plane.
    pub(super) fn plane(&mut self, number: usize) -> Result<Vec<u8>, Error> {
        let [_, plane_bytes] = self.counts;
        let place =
            SeekFrom::Start(self.planes.start + number as u64 * (plane_bytes + CHECKSUM_BYTES));
        self.file
            .seek(place)
            .map_err(|e| refused("read", &self.path, &e))?;
        let mut bytes = vec![0; plane_bytes as usize];
        let mut stored = self.planes.checksum;
        self.fill(&mut bytes)?;
        self.fill(&mut stored)?;
        if checksum_of(&self.planes.checksum, number, &bytes) != stored {
            return Err(self.damaged("the checksum of a plane is wrong, so it was altered"));
        }
        Ok(bytes)
    }

    pub(super) fn damaged(&self, what: &'static str) -> Error {
        damaged(&self.path, what)
    }

    fn fill(&mut self, buffer: &mut [u8]) -> Result<(), Error> {
        self.file.read_exact(buffer).map_err(|e| match e.kind() {
            io::ErrorKind::UnexpectedEof => self.damaged("it is cut off"),
            _ => refused("read", &self.path, &e),
        })
    }

    /// The section of this tag as bytes.
    pub(super) fn bytes(&self, tag: &Tag) -> Result<&[u8], Error> {
        let found = self.sections.iter().find(|section| section.0 == *tag);
        found
            .map(|section| &section.1[..])
            .ok_or_else(|| self.damaged("a section is missing"))
    }

    /// The section of this tag as numbers.
    pub(super) fn floats(&self, tag: &Tag) -> Result<Vec<f64>, Error> {
        match self.bytes(tag)?.as_chunks::<8>() {
            (numbers, []) => Ok(numbers.iter().map(|b| f64::from_le_bytes(*b)).collect()),
            _ => Err(self.damaged("a section is not made of numbers")),
        }
    }
}

/// The sections that follow one another in `bytes`.
fn sections_of(mut bytes: &[u8]) -> Option<Vec<(Tag, Vec<u8>)>> {
    let mut sections = Vec::new();
    while !bytes.is_empty() {
        let (tag, rest) = bytes.split_first_chunk::<8>()?;
        let (length, rest) = rest.split_first_chunk::<8>()?;
        let (content, rest) =
            rest.split_at_checked(usize::try_from(u64::from_le_bytes(*length)).ok()?)?;
        sections.push((*tag, content.to_vec()));
        bytes = rest;
    }
    Some(sections)
}
