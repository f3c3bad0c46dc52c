//! Texts and tables from files that may be anything: no device, no pipe and no file without end is read.

use std::fs::File;
use std::io::{Error, ErrorKind, Read, Result};
use std::path::Path;

/// Largest scene or case file \[bytes\].
const LARGEST_BYTES: u64 = 16 << 20;
/// Largest text of data \[bytes\].
pub(crate) const LARGEST_DATA_BYTES: u64 = 1 << 30;

/// Opens a regular file; a device may have no end, and a pipe may wait for its writer for ever.
///
/// # Errors
/// What the system says; anything that is no regular file.
pub(crate) fn open(path: &Path) -> Result<(File, u64)> {
    let about = std::fs::metadata(path)?;
    if about.is_dir() {
        return Err(Error::new(
            ErrorKind::IsADirectory,
            "it is a folder, a file is needed",
        ));
    }
    if !about.is_file() {
        let reason =
            "it is not a regular file but a device or a pipe: write its content to a file first";
        return Err(Error::new(ErrorKind::InvalidInput, reason));
    }
    Ok((File::open(path)?, about.len()))
}

/// Opens a regular file; it comes with its length \[bytes\] and its first eight bytes, by which formats are known.
///
/// # Errors
/// As [`open`].
pub(crate) fn begin(path: &Path) -> std::result::Result<(File, u64, Vec<u8>), crate::Error> {
    let opened = open(path).and_then(|(mut file, length)| {
        let mut first = Vec::new();
        Read::by_ref(&mut file).take(8).read_to_end(&mut first)?;
        Ok((file, length, first))
    });
    let opened = opened.map_err(crate::Error::io("read", path))?;
    match compression(&opened.2) {
        Some((name, program)) => Err(crate::Error::Input {
            path: path.to_owned(),
            reason: format!(
                "it is compressed with {name}: {program} FILE > NEW makes the file that is read"
            ),
        }),
        None => Ok(opened),
    }
}

/// The compression that a file begins with, and what undoes it.
fn compression(beginning: &[u8]) -> Option<(&'static str, &'static str)> {
    match beginning {
        [0x1F, 0x8B, ..] => Some(("gzip", "gunzip -c")),
        [b'B', b'Z', b'h', ..] => Some(("bzip2", "bunzip2 -c")),
        [0xFD, b'7', b'z', b'X', b'Z', ..] => Some(("xz", "unxz -c")),
        [0x28, 0xB5, 0x2F, 0xFD, ..] => Some(("zstd", "unzstd -c")),
        _ => None,
    }
}

/// The characters of a text in UTF-8 or, behind its mark, UTF-16.
///
/// # Errors
/// The first byte that is none of a text in UTF-8, from 0.
pub(crate) fn decode(bytes: &[u8]) -> std::result::Result<String, usize> {
    let text = match bytes {
        [0xFF, 0xFE, rest @ ..] => utf16(rest, u16::from_le_bytes),
        [0xFE, 0xFF, rest @ ..] => utf16(rest, u16::from_be_bytes),
        _ => match std::str::from_utf8(bytes) {
            Ok(text) => text.to_owned(),
            Err(e) => return Err(e.valid_up_to()),
        },
    };
    let text = match text.strip_prefix('\u{feff}') {
        Some(behind_mark) => behind_mark.to_owned(),
        None => text,
    };
    Ok(with_line_feeds(text))
}

/// A text whose lines end as those of other systems: old ones end lines with a carriage return alone.
pub(crate) fn with_line_feeds(text: String) -> String {
    match text.contains('\r') && !text.contains('\n') {
        true => text.replace('\r', "\n"),
        false => text,
    }
}

fn utf16(bytes: &[u8], unit: fn([u8; 2]) -> u16) -> String {
    let units: Vec<u16> = bytes
        .chunks_exact(2)
        .map(|pair| unit([pair[0], pair[1]]))
        .collect();
    String::from_utf16_lossy(&units)
}

/// The text of a scene or case file.
///
/// # Errors
/// As [`open`]; more than 16 MiB; a compressed file; bytes that are no text in UTF-8 or UTF-16.
pub(crate) fn read(path: &Path) -> Result<String> {
    read_at_most(path, LARGEST_BYTES, "no scene and no case is")
}

/// The text of a file of data.
///
/// # Errors
/// As [`read`], but for more than 1 GiB.
#[cfg(feature = "cli")]
pub(crate) fn read_data(path: &Path) -> Result<String> {
    read_at_most(path, LARGEST_DATA_BYTES, "divide it")
}

fn read_at_most(path: &Path, largest_bytes: u64, remark: &str) -> Result<String> {
    let (file, _) = open(path)?;
    let mut bytes = Vec::new();
    // Files of the system may say that they are empty and still have no end.
    file.take(largest_bytes + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > largest_bytes {
        let reason = format!("it is larger than {} MiB: {remark}", largest_bytes >> 20);
        return Err(Error::new(ErrorKind::FileTooLarge, reason));
    }
    if let Some((name, program)) = compression(&bytes) {
        let reason = format!(
            "it is compressed with {name}: {program} FILE > NEW makes the file that is read"
        );
        return Err(Error::new(ErrorKind::InvalidData, reason));
    }
    decode(&bytes).map_err(|at| {
        Error::new(
            ErrorKind::InvalidData,
            format!("it is not text in UTF-8: byte {} is not", at + 1),
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_text_file_is_refused_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.toml");
        std::fs::write(&path, "seed = 1\n").unwrap();
        assert_eq!(read(&path).unwrap(), "seed = 1\n");
        std::fs::write(&path, b"seed = \xff\n").unwrap();
        assert!(read(&path).unwrap_err().to_string().contains("byte 8"));
        std::fs::write(&path, b"\x1f\x8b\x08\0").unwrap();
        assert!(read(&path).unwrap_err().to_string().contains("gunzip -c"));
        File::create(&path)
            .unwrap()
            .set_len(LARGEST_BYTES + 1)
            .unwrap();
        assert!(read(&path).unwrap_err().to_string().contains("16 MiB"));
        #[cfg(feature = "cli")]
        assert!(read_data(&path).is_ok());
        assert!(
            read(folder.path())
                .unwrap_err()
                .to_string()
                .contains("folder")
        );
        #[cfg(unix)]
        assert!(
            read(Path::new("/dev/zero"))
                .unwrap_err()
                .to_string()
                .contains("device")
        );
    }

    #[test]
    fn texts_of_other_systems_have_the_same_characters() {
        let text = "range_m,elevation_deg\n1.0,2.0\n";
        let little = text.encode_utf16().flat_map(u16::to_le_bytes);
        let big = text.encode_utf16().flat_map(u16::to_be_bytes);
        for bytes in [
            text.as_bytes().to_vec(),
            format!("\u{feff}{text}").into_bytes(),
            [0xFF, 0xFE].into_iter().chain(little).collect(),
            [0xFE, 0xFF].into_iter().chain(big).collect(),
            text.replace('\n', "\r").into_bytes(),
        ] {
            assert_eq!(decode(&bytes).as_deref(), Ok(text));
        }
        assert_eq!(decode(b"ab\xff"), Err(2));
    }
}
