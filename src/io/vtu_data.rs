//! The binary arrays of VTK XML files: a header that counts bytes, then the values, plain or in blocks compressed with
//! zlib; the whole as raw bytes or as base64 (`vtkXMLDataParser`, "VTK File Formats").

use std::format;
use std::io::Read;
use std::string::String;
use std::vec::Vec;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::read::ZlibDecoder;

use super::cursor::Encoding;
use super::error::quoted;

/// Where bytes come from.
pub(super) enum Source<'a> {
    Raw(&'a [u8]),
    Base64(Base64<'a>),
}

impl Source<'_> {
    fn take(&mut self, n: usize) -> Result<Vec<u8>, String> {
        match self {
            Self::Raw(bytes) => {
                let left = bytes.len();
                let (taken, rest) = bytes
                    .split_at_checked(n)
                    .ok_or_else(|| format!("{n} bytes are expected, but the data ends after {left}"))?;
                *bytes = rest;
                Ok(taken.to_vec())
            }
            Self::Base64(base64) => base64.take(n),
        }
    }
}

/// Base64 text that may consist of several encodings in a row, each padded on its own.
pub(super) struct Base64<'a> {
    text: &'a [u8],
    /// Decoded bytes that have not been taken yet.
    spare: Vec<u8>,
}

impl<'a> Base64<'a> {
    pub(super) fn new(text: &'a [u8]) -> Self {
        Self { text, spare: Vec::new() }
    }

    fn take(&mut self, n: usize) -> Result<Vec<u8>, String> {
        let mut taken = core::mem::take(&mut self.spare);
        while taken.len() < n {
            let mut quad = [0; 4];
            for place in &mut quad {
                let text = self.text.trim_ascii_start();
                let end = || format!("{n} bytes are expected, but the base64 text ends after {}", taken.len());
                let (&first, rest) = text.split_first().ok_or_else(end)?;
                (*place, self.text) = (first, rest);
            }
            STANDARD
                .decode_vec(quad, &mut taken)
                .map_err(|error| format!("{} is not base64: {error}", quoted(&quad)))?;
        }
        self.spare = taken.split_off(n);
        Ok(taken)
    }
}

/// How the binary arrays of a file are stored.
#[derive(Clone, Copy)]
pub(super) struct Layout<'a> {
    pub(super) order: Encoding,
    /// Counts of bytes have 64 instead of 32 bits.
    pub(super) wide: bool,
    /// The name of the compressor, if there is one.
    pub(super) compressor: Option<&'a str>,
}

/// Bytes that a mesh may make of one that is stored with zlib, and of any file. zlib could make 1,032 of one (Gailly &
/// Adler, zlib technical details); coordinates and numbers of nodes are two to ten.
const UNPACKED: u64 = 50;
const UNPACKED_OF_ANY: u64 = 1 << 20;

impl Layout<'_> {
    /// The most bytes that arrays can have that are stored in so many.
    pub(super) fn most(self, bytes: u64) -> u64 {
        if self.compressor.is_some() { bytes.saturating_mul(UNPACKED).saturating_add(UNPACKED_OF_ANY) } else { bytes }
    }

    /// The values of an array that must have `expected` bytes.
    pub(super) fn read(self, mut source: Source<'_>, expected: usize) -> Result<Vec<u8>, String> {
        match self.compressor {
            // Some writers leave out the header of an empty array, others write one.
            _ if expected == 0 => Ok(Vec::new()),
            None => {
                let announced = self.header(&mut source)?;
                if announced != expected as u64 {
                    return Err(format!("the array has {announced} bytes instead of {expected}"));
                }
                source.take(expected)
            }
            Some("vtkZLibDataCompressor") => self.read_zlib(source, expected),
            Some(other) => {
                Err(format!("compressed with {other:?}, which cannot be read; save with zlib or uncompressed"))
            }
        }
    }

    /// The number of blocks, the size of all but the last, that of the last (0 if it is full), the compressed sizes.
    fn read_zlib(self, mut source: Source<'_>, expected: usize) -> Result<Vec<u8>, String> {
        let blocks = self.header(&mut source)?;
        let full = self.header(&mut source)?;
        let last = self.header(&mut source)?;
        let compressed: Vec<u64> = (0..blocks).map(|_| self.header(&mut source)).collect::<Result<_, _>>()?;
        let mut values = Vec::new();
        for (block, &size) in compressed.iter().enumerate() {
            let bytes = source.take(usize::try_from(size).unwrap_or(usize::MAX))?;
            let start = values.len();
            // One byte more than allowed tells that there are too many.
            let limit = ((expected - start) as u64).saturating_add(1);
            ZlibDecoder::new(bytes.as_slice())
                .take(limit)
                .read_to_end(&mut values)
                .map_err(|error| format!("block {block} is not zlib data: {error}"))?;
            let announced = if block + 1 == compressed.len() && last != 0 { last } else { full };
            let actual = values.len() - start;
            if actual as u64 != announced || values.len() > expected {
                let what = format!("block {block} has {actual} bytes or more instead of {announced}");
                return Err(format!("{what}; the array should have {expected} in all"));
            }
        }
        if values.len() != expected {
            return Err(format!("the array has {} bytes instead of {expected}", values.len()));
        }
        Ok(values)
    }

    fn header(self, source: &mut Source<'_>) -> Result<u64, String> {
        let mut bytes = source.take(if self.wide { 8 } else { 4 })?;
        if self.order == Encoding::Big {
            bytes.reverse();
        }
        Ok(bytes.iter().rev().fold(0, |value, &byte| value << 8 | u64::from(byte)))
    }
}
