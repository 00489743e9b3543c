//! A position in a file that mixes lines of text with binary arrays, as VTK and Gmsh files do.
//! Every failure names its place: the line while only text has been read, the byte offset after that, because
//! lines mean nothing once binary data has gone by.

use core::fmt::Display;
use core::str::FromStr;
use std::format;
use std::string::String;

use super::error::{Fault, quoted};

/// How values are stored.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Encoding {
    Text,
    Big,
    Little,
}

pub(super) struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Line of `at`, from 1.
    line: usize,
    /// Where the last token or array began.
    mark: usize,
    seen_binary: bool,
    /// Tokens must not be looked for beyond the end of this line.
    in_record: bool,
}

impl<'a> Cursor<'a> {
    /// At the start of `bytes`, whose first line has the number `line`.
    pub(super) fn new(bytes: &'a [u8], line: usize) -> Self {
        Self { bytes, at: 0, line, mark: 0, seen_binary: false, in_record: false }
    }

    pub(super) fn place(&self) -> String {
        if self.seen_binary { format!("byte {}", self.mark) } else { format!("line {}", self.line) }
    }

    /// A complaint about what was read last.
    pub(super) fn fault(&self, reason: impl Display) -> Fault {
        Fault::new(self.place(), reason)
    }

    pub(super) fn rest(&self) -> &'a [u8] {
        self.bytes.get(self.at..).unwrap_or_default()
    }

    pub(super) fn skip(&mut self, n: usize) {
        let skipped = self.rest().get(..n).unwrap_or(self.rest());
        self.line += skipped.iter().filter(|&&b| b == b'\n').count();
        self.at += skipped.len();
    }

    /// The next run of characters other than white space, `None` at the end of the file or record.
    pub(super) fn token(&mut self) -> Option<&'a [u8]> {
        let in_record = self.in_record;
        let blank = |b: &u8| b.is_ascii_whitespace() && !(in_record && *b == b'\n');
        let rest = self.rest();
        self.skip(rest.iter().position(|b| !blank(b)).unwrap_or(rest.len()));
        self.mark = self.at;
        let rest = self.rest();
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        self.at += length;
        rest.get(..length).filter(|token| !token.is_empty())
    }

    /// The next token; `what` says in the message what it should have been.
    pub(super) fn word(&mut self, what: impl Display) -> Result<&'a [u8], Fault> {
        match self.token() {
            Some(token) => Ok(token),
            None if self.rest().is_empty() => Err(self.fault(format_args!("the file ends where {what} is expected"))),
            None => Err(self.fault(format_args!("the line ends where {what} is expected"))),
        }
    }

    pub(super) fn number<T: FromStr>(&mut self, what: impl Display) -> Result<T, Fault> {
        let token = self.word(&what)?;
        let value = core::str::from_utf8(token).ok().and_then(|text| text.parse().ok());
        value.ok_or_else(|| self.fault(format_args!("{} where {what} is expected", quoted(token))))
    }

    /// The rest of the line, without its end; binary data starts right behind.
    pub(super) fn rest_of_line(&mut self) -> &'a [u8] {
        let rest = self.rest();
        self.mark = self.at;
        let end = rest.iter().position(|&b| b == b'\n');
        self.skip(end.map_or(rest.len(), |end| end + 1));
        let line = rest.get(..end.unwrap_or(rest.len())).unwrap_or_default();
        line.strip_suffix(b"\r").unwrap_or(line)
    }

    /// Reads one record with `read`: a line of its own in text, just the next bytes in binary. A line with too few
    /// or too many tokens is caught here, not hundreds of lines further down.
    pub(super) fn record<T>(
        &mut self,
        encoding: Encoding,
        read: impl FnOnce(&mut Self) -> Result<T, Fault>,
    ) -> Result<T, Fault> {
        if encoding != Encoding::Text {
            return read(self);
        }
        let rest = self.rest();
        self.skip(rest.iter().position(|b| !b.is_ascii_whitespace()).unwrap_or(rest.len()));
        self.in_record = true;
        let value = read(self)?;
        if let Some(extra) = self.token() {
            return Err(self.fault(format_args!("{} where the line should end", quoted(extra))));
        }
        self.in_record = false;
        Ok(value)
    }

    /// The next `n` bytes; a header that promises more than the file holds ends here, before any allocation.
    pub(super) fn take(&mut self, n: Option<usize>, what: impl Display) -> Result<&'a [u8], Fault> {
        self.seen_binary = true;
        self.mark = self.at;
        let left = self.rest().len();
        match n.and_then(|n| self.rest().get(..n)) {
            Some(taken) => {
                self.at += taken.len();
                Ok(taken)
            }
            None => Err(self.fault(match n {
                Some(n) => format!("{what}: {n} bytes are expected, but the file ends after {left}"),
                None => format!("{what}: more bytes are expected than a file can have"),
            })),
        }
    }

    fn array<const N: usize>(&mut self, encoding: Encoding, what: impl Display) -> Result<[u8; N], Fault> {
        let mut bytes = [0; N];
        bytes.copy_from_slice(self.take(Some(N), what)?);
        if encoding == Encoding::Big {
            bytes.reverse();
        }
        Ok(bytes)
    }

    /// A 32-bit integer.
    pub(super) fn int(&mut self, encoding: Encoding, what: impl Display) -> Result<i32, Fault> {
        match encoding {
            Encoding::Text => self.number(what),
            _ => self.array(encoding, what).map(i32::from_le_bytes),
        }
    }

    /// A 64-bit count or node tag.
    pub(super) fn size(&mut self, encoding: Encoding, what: impl Display) -> Result<u64, Fault> {
        match encoding {
            Encoding::Text => self.number(what),
            _ => self.array(encoding, what).map(u64::from_le_bytes),
        }
    }

    /// A 64-bit real number.
    pub(super) fn real(&mut self, encoding: Encoding, what: impl Display) -> Result<f64, Fault> {
        match encoding {
            Encoding::Text => self.number(what),
            _ => self.array(encoding, what).map(f64::from_le_bytes),
        }
    }

    /// Three coordinates.
    pub(super) fn point(&mut self, encoding: Encoding, what: impl Display) -> Result<[f64; 3], Fault> {
        let mut point = [0.0; 3];
        for (x, axis) in point.iter_mut().zip(['x', 'y', 'z']) {
            *x = self.real(encoding, format_args!("the coordinate {axis} of {what}"))?;
        }
        Ok(point)
    }
}
