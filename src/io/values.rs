//! Arrays of values as the VTK formats store them: ten scalar types, as text or in either byte order.

use core::fmt::Display;
use std::format;
use std::string::String;
use std::vec::Vec;

use super::cursor::{Cursor, Encoding};
use super::error::Fault;

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Scalar {
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    pub(super) fn is_real(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }
}

/// The values of an array, widened to the largest type of their kind.
pub(super) enum Values {
    Whole(Vec<i64>),
    Real(Vec<f64>),
}

impl Values {
    pub(super) fn into_points(self) -> Vec<[f64; 3]> {
        match self {
            Self::Real(values) => values.as_chunks().0.to_vec(),
            Self::Whole(values) => values.as_chunks().0.iter().map(|p: &[i64; 3]| p.map(|x| x as f64)).collect(),
        }
    }

    pub(super) fn into_whole(self, what: impl Display) -> Result<Vec<i64>, String> {
        match self {
            Self::Whole(values) => Ok(values),
            Self::Real(_) => Err(format!("{what} must be whole numbers, but is stored as real numbers")),
        }
    }
}

/// `n` values of the array `what`; `n` is `None` where the count itself overflows.
pub(super) fn read_values(
    cursor: &mut Cursor<'_>,
    n: Option<usize>,
    scalar: Scalar,
    encoding: Encoding,
    what: impl Display,
) -> Result<Values, Fault> {
    if encoding == Encoding::Text {
        // Grows with what is there: the announced count is not trusted with memory.
        return Ok(if scalar.is_real() {
            Values::Real(read_text(cursor, n, what)?)
        } else {
            Values::Whole(read_text(cursor, n, what)?)
        });
    }
    let bytes = cursor.take(n.and_then(|n| n.checked_mul(scalar.size())), what)?;
    let big = encoding == Encoding::Big;
    Ok(match scalar {
        Scalar::I8 => whole(bytes, big, |b| i8::from_le_bytes(b).into()),
        Scalar::U8 => whole(bytes, big, |b| u8::from_le_bytes(b).into()),
        Scalar::I16 => whole(bytes, big, |b| i16::from_le_bytes(b).into()),
        Scalar::U16 => whole(bytes, big, |b| u16::from_le_bytes(b).into()),
        Scalar::I32 => whole(bytes, big, |b| i32::from_le_bytes(b).into()),
        Scalar::U32 => whole(bytes, big, |b| u32::from_le_bytes(b).into()),
        Scalar::I64 => whole(bytes, big, i64::from_le_bytes),
        // Nothing that large is a valid index or region, and neither is the largest `i64`.
        Scalar::U64 => whole(bytes, big, |b| i64::try_from(u64::from_le_bytes(b)).unwrap_or(i64::MAX)),
        Scalar::F32 => Values::Real(each(bytes, big, |b| f32::from_le_bytes(b).into())),
        Scalar::F64 => Values::Real(each(bytes, big, f64::from_le_bytes)),
    })
}

fn read_text<T: core::str::FromStr>(
    cursor: &mut Cursor<'_>,
    n: Option<usize>,
    what: impl Display,
) -> Result<Vec<T>, Fault> {
    let n = n.unwrap_or(usize::MAX);
    (0..n).map(|i| cursor.number(format_args!("value {} of {n} of {what}", i + 1))).collect()
}

fn whole<const N: usize>(bytes: &[u8], big: bool, convert: impl Fn([u8; N]) -> i64) -> Values {
    Values::Whole(each(bytes, big, convert))
}

fn each<const N: usize, T>(bytes: &[u8], big: bool, convert: impl Fn([u8; N]) -> T) -> Vec<T> {
    let order = |mut value: [u8; N]| {
        if big {
            value.reverse();
        }
        value
    };
    bytes.as_chunks().0.iter().map(|&value| convert(order(value))).collect()
}
