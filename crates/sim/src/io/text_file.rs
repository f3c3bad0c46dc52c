//! Texts and tables from files that may be anything: no device, no pipe and no file without end is read.

use std::fs::File;
use std::io::{Error, ErrorKind, Read, Result};
use std::path::Path;

/// Largest scene or case file \[bytes\].
const LARGEST_BYTES: u64 = 16 << 20;

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
            "it is no regular file but a device or a pipe: write its content to a file first";
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
    opened.map_err(crate::Error::io("read", path))
}

/// The text of a scene or case file.
///
/// # Errors
/// As [`open`]; more than 16 MiB; bytes that are no UTF-8.
pub(crate) fn read(path: &Path) -> Result<String> {
    let (file, _) = open(path)?;
    let mut bytes = Vec::new();
    // Files of the system may say that they are empty and still have no end.
    file.take(LARGEST_BYTES + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > LARGEST_BYTES {
        let reason = format!(
            "it is larger than {} MiB: no scene and no case is",
            LARGEST_BYTES >> 20
        );
        return Err(Error::new(ErrorKind::FileTooLarge, reason));
    }
    String::from_utf8(bytes).map_err(|e| {
        let at = e.utf8_error().valid_up_to();
        Error::new(
            ErrorKind::InvalidData,
            format!("it is no text in UTF-8: byte {} is not", at + 1),
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
        File::create(&path)
            .unwrap()
            .set_len(LARGEST_BYTES + 1)
            .unwrap();
        assert!(read(&path).unwrap_err().to_string().contains("16 MiB"));
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
}
