//! The bytes of a file that somebody names.

use std::fs;
use std::io::{Error, ErrorKind, Result};
use std::path::Path;
use std::string::String;
use std::vec::Vec;

/// All bytes of a regular file. Devices and pipes, which may never end, are refused.
pub fn read_file(path: &Path) -> Result<Vec<u8>> {
    if fs::metadata(path)?.is_file() {
        return fs::read(path);
    }
    Err(Error::new(ErrorKind::InvalidInput, "it is a folder, a device or a pipe, not a file"))
}

/// The same as text, without a byte-order mark.
pub fn read_text(path: &Path) -> Result<String> {
    let bytes = read_file(path)?;
    let text = str::from_utf8(without_mark(&bytes)).map_err(|error| {
        let at = error.valid_up_to();
        Error::new(ErrorKind::InvalidData, std::format!("byte {at} is not UTF-8"))
    })?;
    Ok(text.into())
}

/// What follows the mark that some editors put before a text in UTF-8.
pub(super) fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes)
}
