//! A rigid body of any form as signed distances on a grid: an instrument, or ribs and tables that tissue rests on.
//! Between the points of the grid the distance (m, negative inside) and the slopes that give the normal are trilinear.
//! Edges and details finer than the spacing are rounded.

use core::fmt;

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use crate::checksum::crc_32;

/// Signed distances on a grid, checked: finite, negative somewhere, positive all around.
#[derive(Clone, Copy, PartialEq)]
pub struct Field<'a> {
    values: &'a [f32],
    size: [u32; 3],
    origin: [f32; 3],
    spacing: f32,
    /// Of the deepest point of the grid below the surface, m.
    deepest: f32,
    checksum: u32,
}

/// Why a field was refused.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum FieldError {
    /// Fewer than two points along an axis, or another number of values than of points.
    Size {
        /// Points along x, y, z.
        size: [u32; 3],
        /// Values.
        values: usize,
    },
    /// A spacing that is not positive, or an origin that is not a number.
    Place {
        /// m.
        spacing: f32,
        /// m.
        origin: [f32; 3],
    },
    /// A distance that is not finite, or farther than the grid is wide.
    Value {
        /// Its place in the list.
        index: usize,
        /// m.
        value: f32,
    },
    /// The body reaches the rim of the grid: what is beyond is not known.
    Rim {
        /// The value's place in the list.
        index: usize,
    },
    /// No point of the grid is inside the body: the spacing is too large.
    Empty,
    /// Bytes that are no field: too few, of another kind or version, not aligned to four bytes, or changed.
    Bytes {
        /// What is wrong.
        what: &'static str,
    },
}

/// The head of a field's file; the values follow, x fastest, as little-endian floats.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Head {
    magic: [u8; 8],
    version: u32,
    size: [u32; 3],
    origin: [f32; 3],
    spacing: f32,
    /// CRC-32 of the values.
    checksum: u32,
    spare: [u32; 3],
}

const MAGIC: [u8; 8] = *b"supfield";
const VERSION: u32 = 1;

impl<'a> Field<'a> {
    /// Checks distances (m) at `size` points that are `spacing` (m) apart, from `origin` (m, in the axes of the shape)
    /// on; x runs fastest. Far from the surface values may be nearer to zero than the distance, never farther.
    pub fn new(values: &'a [f32], size: [u32; 3], origin: [f32; 3], spacing: f32) -> Result<Self, FieldError> {
        let points = size.iter().map(|&points| u64::from(points)).try_fold(1u64, u64::checked_mul);
        if size.iter().any(|&points| points < 2) || points != Some(values.len() as u64) {
            return Err(FieldError::Size { size, values: values.len() });
        }
        let far = spacing * size.iter().map(|&points| points as f32).sum::<f32>();
        if !(spacing > 0.0 && far.is_finite() && Vec3::from_array(origin).is_finite()) {
            return Err(FieldError::Place { spacing, origin });
        }
        let mut deepest = 0.0f32;
        let [x, y, z] = size.map(|points| points as usize);
        for (index, &value) in values.iter().enumerate() {
            if value.is_nan() || value.abs() > far {
                return Err(FieldError::Value { index, value });
            }
            let at = [index % x, index / x % y, index / (x * y)];
            let is_rim = at.iter().zip([x, y, z]).any(|(&at, points)| at == 0 || at + 1 == points);
            if is_rim && value <= 0.0 {
                return Err(FieldError::Rim { index });
            }
            deepest = deepest.max(-value);
        }
        if deepest <= 0.0 {
            return Err(FieldError::Empty);
        }
        let checksum = crc_32(bytemuck::must_cast_slice(values));
        Ok(Self { values, size, origin, spacing, deepest, checksum })
    }

    /// The field in the bytes of a file, which are used where they are: aligned to four bytes.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, FieldError> {
        let wrong = |what| FieldError::Bytes { what };
        let (head, values) = bytes.split_at_checked(size_of::<Head>()).ok_or(wrong("they are too few for a field"))?;
        let head: Head = bytemuck::pod_read_unaligned(head);
        if head.magic != MAGIC {
            return Err(wrong("they are not those of a field"));
        }
        if head.version.to_le() != VERSION || cfg!(target_endian = "big") {
            return Err(wrong("their version is not known"));
        }
        let values = bytemuck::try_cast_slice(values).map_err(|_| wrong("they are not aligned to four bytes"))?;
        let field = Self::new(values, head.size, head.origin, head.spacing)?;
        if field.checksum == head.checksum { Ok(field) } else { Err(wrong("their checksum does not match")) }
    }

    /// The head of the file.
    #[cfg(any(feature = "std", test))]
    fn head(&self) -> Head {
        let Self { size, origin, spacing, checksum, .. } = *self;
        Head { magic: MAGIC, version: VERSION, size, origin, spacing, checksum, spare: [0; 3] }
    }

    /// The bytes of a file.
    #[cfg(any(feature = "std", test))]
    #[must_use]
    pub fn to_bytes(&self) -> std::vec::Vec<u8> {
        let mut bytes = bytemuck::bytes_of(&self.head()).to_vec();
        bytes.extend_from_slice(bytemuck::must_cast_slice(self.values));
        bytes
    }

    /// Points along each axis.
    #[must_use]
    pub const fn size(&self) -> [u32; 3] {
        self.size
    }

    /// Distance of neighbouring points, m.
    #[must_use]
    pub const fn spacing(&self) -> f32 {
        self.spacing
    }

    /// How deep its deepest point is, m.
    #[must_use]
    pub const fn deepest(&self) -> f32 {
        self.deepest
    }

    /// Largest distance of the grid from the centre of the shape, m.
    pub(super) fn extent(&self) -> f32 {
        let low = Vec3::from_array(self.origin);
        let high = low + self.spacing * self.last();
        low.abs().max(high.abs()).length()
    }

    /// Tells it from other fields.
    pub(super) fn number(&self) -> u32 {
        let place = self.origin.map(f32::to_bits).into_iter().chain([self.spacing.to_bits()]).chain(self.size);
        place.fold(self.checksum, |sum, each| sum.rotate_left(5) ^ each)
    }

    /// The last point of the grid, in spacings from the first.
    fn last(&self) -> Vec3 {
        Vec3::from_array(self.size.map(|points| points as f32)) - 1.0
    }

    /// Distance and normal at a point in the axes of the shape.
    pub(super) fn nearest(&self, point: Vec3) -> (f32, Vec3) {
        let last = self.last();
        let at = (point - Vec3::from_array(self.origin)) / self.spacing;
        let inside = at.clamp(Vec3::ZERO, last);
        let cell = inside.floor().min(last - Vec3::ONE);
        let [x, y, z] = (inside - cell).to_array();
        let corner = |index: usize| self.at(cell, index);
        let distance = trilinear(corner, [x, y, z]);
        // Central differences, interpolated, do not jump between cells as the gradient of the interpolation does.
        let slope = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| {
            let difference = |index: usize| {
                let at = cell + Vec3::new((index & 1) as f32, (index >> 1 & 1) as f32, (index >> 2) as f32);
                let [low, high] = [(at - axis).max(Vec3::ZERO), (at + axis).min(last)];
                (self.at(high, 0) - self.at(low, 0)) / (high - low).dot(axis)
            };
            trilinear(difference, [x, y, z])
        });
        let normal = Vec3::from_array(slope).normalize_or(Vec3::X);
        let beyond = (at - inside) * self.spacing;
        if beyond == Vec3::ZERO {
            return (distance, normal);
        }
        // Beyond the grid, at least so far: the body is on the other side of the rim.
        let way = beyond + distance * normal;
        let square = beyond.length_squared() + distance * distance;
        (libm::sqrtf(square), way.normalize_or(normal))
    }

    /// The value at a corner of a cell: bits of `index` are offsets along x, y, z.
    fn at(&self, cell: Vec3, index: usize) -> f32 {
        let [x, y, z] = cell.to_array().map(|at| at as usize);
        let [points_x, points_y, _] = self.size.map(|points| points as usize);
        let (i, j, k) = (x + (index & 1), y + (index >> 1 & 1), z + (index >> 2));
        self.values.get(i + points_x * (j + points_y * k)).copied().unwrap_or(f32::NAN)
    }
}

/// The interpolation of the values at the corners of a cell: bits of the index are offsets along x, y, z.
fn trilinear(corner: impl Fn(usize) -> f32, [x, y, z]: [f32; 3]) -> f32 {
    let [a, b, c, d] = [0, 2, 4, 6].map(|first| {
        let (low, high) = (corner(first), corner(first + 1));
        low + x * (high - low)
    });
    let (low, high) = (a + y * (b - a), c + y * (d - c));
    low + z * (high - low)
}

impl fmt::Debug for Field<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { size, origin, spacing, deepest, .. } = self;
        f.debug_struct("Field")
            .field("size", size)
            .field("origin", origin)
            .field("spacing", spacing)
            .field("deepest", deepest)
            .finish_non_exhaustive()
    }
}

impl fmt::Display for FieldError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Size { size: [x, y, z], values } => {
                write!(f, "a field of {x} x {y} x {z} points, at least two along each axis, with {values} values")
            }
            Self::Place { spacing, origin } => {
                write!(f, "a field with a spacing of {spacing} m from {origin:?} m on cannot be")
            }
            Self::Value { index, value } => {
                write!(f, "value {index} of the field, {value} m, is not a distance within its grid")
            }
            Self::Rim { index } => write!(
                f,
                "value {index} of the field is at the rim of the grid and not outside the body: make the grid larger"
            ),
            Self::Empty => write!(f, "no point of the field is inside the body: make the spacing smaller"),
            Self::Bytes { what } => write!(f, "the bytes of the field cannot be used: {what}"),
        }
    }
}

impl core::error::Error for FieldError {}
