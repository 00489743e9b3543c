//! The bytes of a file that somebody names.

use std::fs;
use std::io::{Error, ErrorKind, Result};
use std::path::Path;
use std::vec::Vec;

/// What some editors put before a text in UTF-8.
const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

/// All bytes of a regular file, without a byte-order mark. Devices and pipes, which may never end, are refused.
pub fn read_file(path: &Path) -> Result<Vec<u8>> {
    if !fs::metadata(path)?.is_file() {
        return Err(Error::new(ErrorKind::InvalidInput, "it is a folder, a device or a pipe, not a file"));
    }
    let mut bytes = fs::read(path)?;
    if bytes.starts_with(BYTE_ORDER_MARK) {
        bytes.drain(..BYTE_ORDER_MARK.len());
    }
    Ok(bytes)
}

/// The same as text.
pub fn read_text(path: &Path) -> Result<std::string::String> {
    std::string::String::from_utf8(read_file(path)?).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        Error::new(ErrorKind::InvalidData, std::format!("byte {at} is not UTF-8"))
    })
}
