//! What went wrong in a mesh file, where, and with which value, in a sentence for the person who has the file.

use core::fmt;
use std::format;
use std::io;
use std::path::{Path, PathBuf};
use std::string::String;

/// Why a mesh file could not be read. The text names the file, the place in it and the offending value:
/// `liver.msh, line 231: element 40 names node 999, which is not one of the file's 181 nodes`.
#[derive(Debug)]
#[non_exhaustive]
pub enum ReadError {
    /// The file cannot be opened or read.
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: io::Error,
    },
    /// The file was read, but its content is not a mesh this crate understands.
    Malformed {
        /// The file.
        path: PathBuf,
        /// Where in the file: a line, a byte offset, an array; empty if it concerns the whole file.
        place: String,
        /// What is wrong there.
        reason: String,
    },
}

impl fmt::Display for ReadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unreadable { path, source } => write!(f, "{}: cannot be read: {source}", path.display()),
            Self::Malformed { path, place, reason } if place.is_empty() => {
                write!(f, "{}: {reason}", path.display())
            }
            Self::Malformed { path, place, reason } => write!(f, "{}, {place}: {reason}", path.display()),
        }
    }
}

impl core::error::Error for ReadError {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            Self::Unreadable { source, .. } => Some(source),
            Self::Malformed { .. } => None,
        }
    }
}

/// A [`ReadError::Malformed`] whose file is not known yet: the parsers see bytes, not paths.
#[derive(Debug)]
pub(super) struct Fault {
    pub(super) place: String,
    pub(super) reason: String,
}

impl Fault {
    pub(super) fn new(place: impl Into<String>, reason: impl fmt::Display) -> Self {
        Self { place: on_a_line(&place.into()), reason: on_a_line(&format!("{reason}")) }
    }

    pub(super) fn in_file(self, path: &Path) -> ReadError {
        ReadError::Malformed { path: path.into(), place: self.place, reason: self.reason }
    }
}

/// The beginning of a text without characters that a terminal obeys: names of a file may be in it, of any length and
/// content.
fn on_a_line(text: &str) -> String {
    const LONGEST: usize = 400;
    let mut line: String = text.chars().take(LONGEST).map(|c| if c.is_control() { ' ' } else { c }).collect();
    if text.chars().nth(LONGEST).is_some() {
        line.push_str("...");
    }
    line
}

/// Up to 40 characters of a file's bytes between quotes, so that a message shows any value on one line.
pub(super) fn quoted(bytes: &[u8]) -> String {
    const LONGEST: usize = 40;
    let text = String::from_utf8_lossy(bytes.get(..4 * LONGEST).unwrap_or(bytes));
    match text.char_indices().nth(LONGEST) {
        Some((cut, _)) => format!("{:?}...", &text[..cut]),
        None => format!("{text:?}"),
    }
}
