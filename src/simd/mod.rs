//! Vectors of float32 values (SIMD). A loop is written once over the trait [`Real`] and runs as scalar code (`f32`), on
//! vectors that the compiler makes ([`Portable`]), or on a register type of an instruction-set level ([`Level`]).
//!
//! Processors without a register type here run scalar code where that gives the same bits, else [`Portable`]. Only
//! [`Real::fused`] may fuse a multiplication with an addition, and not with the feature `deterministic`: without fusion
//! every width gives the same bits.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod functions;
pub mod int8;
#[cfg(target_arch = "x86_64")]
mod int8_avx2;
#[cfg(target_arch = "x86_64")]
mod int8_avx512;
#[cfg(all(target_arch = "aarch64", target_feature = "neon", target_endian = "little"))]
mod int8_neon;
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
mod int8_simd128;
#[cfg(target_arch = "x86_64")]
mod int8_sse2;
mod level;
#[cfg(test)]
mod level_tests;
#[cfg(all(target_arch = "aarch64", target_feature = "neon", target_endian = "little"))]
mod neon;
mod numbers;
mod pair;
// Unused on processors without a register type here.
#[allow(unused_imports, unused_macros)]
mod register;
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
mod simd128;
#[cfg(target_arch = "x86_64")]
mod sse2;
mod vectors;

#[cfg(test)]
pub(crate) use level::Baseline;
pub use level::{Kernel, Level, Piece, dispatch};
pub(crate) use numbers::{NumberBuffer, ScatterNumbers};
pub(crate) use pair::Pair;
pub use vectors::NodeVector;
use vectors::transpose;
pub(crate) use vectors::{
    Contiguous, Gather, Indexed, Rows, SCATTER_WIDTH, Scatter, ScatterBuffer, TileNodes, axes, dot,
};

use core::ops::{Add, Mul, Neg, Sub};

use int8::{Packed, Whole};

/// Repeats statements for each index below a constant of at most six. The compiler would leave a long body in a loop,
/// and keep its vectors in memory.
macro_rules! unrolled {
    ($index:ident < $count:ident => $statements:block) => {
        unrolled!($index < $count => $statements; 0 1 2 3 4 5)
    };
    ($index:ident < $count:ident => $statements:block; $($each:literal)*) => {
        const { assert!($count <= 6) };
        $(if $each < $count {
            let $index: usize = $each;
            $statements
        })*
    };
}
pub(crate) use unrolled;

/// Elements in one tile of the scene's tables; every vector width divides it.
pub const TILE: usize = 16;

/// A vector of one or more float32 values. The place of a value in the vector is called its lane.
pub trait Real: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self> {
    /// Values in the vector: one, or a multiple of four.
    const COUNT: usize;
    /// Whether the processor has enough registers for four by two sums and the values that are added to them.
    const MANY_REGISTERS: bool = false;
    /// A vector of eight values, with instructions of the same level. For tables of eight columns, and for sums over
    /// nodes: their order, and so their bits, must not depend on the level.
    type Width8: Real;
    /// A vector of as many integers of 32 bits.
    type Whole: Whole<Self>;

    /// Runs a piece as a function of its own, compiled with the instructions of the level to which the vector belongs.
    fn run_piece<P: Piece>(piece: P) -> P::Output;

    /// The vector whose value in each `lane` is `at(lane)`.
    fn from_fn(at: impl Fn(usize) -> f32) -> Self;
    /// Four vectors, one for each column; the values in lane `l` are those of `row(l)`.
    fn from_rows(row: impl Fn(usize) -> [f32; 4]) -> [Self; 4];
    /// Calls `row` with each lane and the values of the four vectors in it.
    fn to_rows(columns: [Self; 4], row: impl FnMut(usize, [f32; 4]));
    /// Calls `row` with each corner and lane of a vector of elements and the four values there. The order is that of
    /// vectors of eight elements, for any width: eight places of the first corner, the same of the second and so on,
    /// then the next eight. So the order of sums does not depend on the width.
    #[inline(always)]
    fn corners_to_rows<const N: usize>(corners: [[Self; 4]; N], mut row: impl FnMut(usize, usize, [f32; 4])) {
        unrolled!(corner < N => {
            Self::to_rows(corners[corner], |lane, values| row(corner, lane, values));
        });
    }
    /// Like [`Real::from_rows`], for the first `COUNT` of some rows, in the order that takes the fewest instructions:
    /// row `r` goes to lane [`Real::lane_of_row`]. Zeros if there are fewer rows.
    #[inline(always)]
    fn from_consecutive_rows(rows: &[[f32; 4]]) -> [Self; 4] {
        Self::from_rows(|lane| rows.get(lane).copied().unwrap_or_default())
    }
    /// Writes what [`Real::from_consecutive_rows`] reads; nothing if there are fewer rows.
    #[inline(always)]
    fn to_consecutive_rows(columns: [Self; 4], rows: &mut [[f32; 4]]) {
        Self::to_rows(columns, |lane, values| {
            if let Some(row) = rows.get_mut(lane) {
                *row = values;
            }
        });
    }
    /// The lane to which [`Real::from_consecutive_rows`] takes a row.
    #[inline(always)]
    fn lane_of_row(row: usize) -> usize {
        row
    }
    /// The row that [`Real::from_consecutive_rows`] takes to a lane.
    #[inline(always)]
    fn row_of_lane(lane: usize) -> usize {
        lane
    }
    /// Whether all indices are in the range of `count` indices from `first` on.
    #[inline(always)]
    fn all_in_range<const N: usize>(rows: [&[u32; TILE]; N], first: u32, count: u32) -> bool {
        let mut inside = true;
        for row in rows {
            for index in row {
                inside &= index.wrapping_sub(first) < count;
            }
        }
        inside
    }
    /// The value in `lane`; zero if there is no such lane.
    fn lane(&self, lane: usize) -> f32;
    /// Applies `f` to each value.
    #[inline(always)]
    fn map(self, f: impl Fn(f32) -> f32) -> Self {
        Self::from_fn(|lane| f(self.lane(lane)))
    }
    /// Applies `f` to the two values of each lane.
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self::from_fn(|lane| f(self.lane(lane), other.lane(lane)))
    }

    /// `self * factor + addend`, rounded once where the level can, unless the feature `deterministic` is on.
    #[inline(always)]
    fn fused(self, factor: Self, addend: Self) -> Self {
        self * factor + addend
    }
    /// `yes` in places where `self` is positive, else `no`.
    #[inline(always)]
    fn choose(self, yes: Self, no: Self) -> Self {
        Self::from_fn(|lane| if self.lane(lane) > 0.0 { yes.lane(lane) } else { no.lane(lane) })
    }
    /// The same value in every lane.
    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self::from_fn(|_| value)
    }
    /// The larger of the two; `other` where the comparison is with NaN, as the vector instructions do.
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }
    /// The smaller of the two; `other` where the comparison is with NaN.
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }
    /// One in places where `self` is positive, else zero.
    #[inline(always)]
    fn positive(self) -> Self {
        self.map(|a| if a > 0.0 { 1.0 } else { 0.0 })
    }
    /// Magnitude.
    #[inline(always)]
    fn abs(self) -> Self {
        self.map(f32::abs)
    }
    /// `self / other`.
    #[inline(always)]
    fn divide(self, other: Self) -> Self {
        self.zip(other, |a, b| a / b)
    }
    /// Square root, correctly rounded.
    #[inline(always)]
    fn root(self) -> Self {
        self.map(libm::sqrtf)
    }
    /// Square root of zero or a positive normal value, relative error below 3e-7.
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.map(functions::sqrt)
    }
    /// `exp(self)`, relative error below 1.2e-7 for arguments from -87 to 88; beyond, the value at the nearer end of
    /// that range.
    #[inline(always)]
    fn exp(self) -> Self {
        self.map(functions::exp)
    }
    /// `self^(-1/3)` for positive normal values, relative error below 2e-7.
    #[inline(always)]
    fn inverse_cbrt(self) -> Self {
        self.map(functions::inverse_cbrt)
    }
}

impl Real for f32 {
    const COUNT: usize = 1;
    type Width8 = Portable<8>;
    type Whole = Packed<1>;

    #[inline(never)]
    fn run_piece<P: Piece>(piece: P) -> P::Output {
        piece.run()
    }
    #[inline(always)]
    fn from_fn(at: impl Fn(usize) -> f32) -> Self {
        at(0)
    }
    #[inline(always)]
    fn from_rows(row: impl Fn(usize) -> [f32; 4]) -> [Self; 4] {
        row(0)
    }
    #[inline(always)]
    fn to_rows(columns: [Self; 4], mut row: impl FnMut(usize, [f32; 4])) {
        row(0, columns);
    }
    #[inline(always)]
    fn lane(&self, lane: usize) -> f32 {
        if lane == 0 { *self } else { 0.0 }
    }
    #[inline(always)]
    fn map(self, f: impl Fn(f32) -> f32) -> Self {
        f(self)
    }
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        f(self, other)
    }
}

/// A vector of `L` values as an array, which the compiler vectorises.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(transparent)]
pub struct Portable<const L: usize>(pub [f32; L]);

impl<const L: usize> Real for Portable<L> {
    const COUNT: usize = L;
    type Width8 = Portable<8>;
    type Whole = Packed<L>;

    #[inline(never)]
    fn run_piece<P: Piece>(piece: P) -> P::Output {
        piece.run()
    }
    #[inline(always)]
    fn from_fn(at: impl Fn(usize) -> f32) -> Self {
        let mut out = [0.0; L];
        for (lane, value) in out.iter_mut().enumerate() {
            *value = at(lane);
        }
        Self(out)
    }
    #[inline(always)]
    fn from_rows(row: impl Fn(usize) -> [f32; 4]) -> [Self; 4] {
        let mut out = [[0.0; L]; 4];
        for first in (0..L).step_by(4) {
            let columns = transpose([0, 1, 2, 3].map(|lane| row(first + lane)));
            for (out, column) in out.iter_mut().zip(columns) {
                if let Some(out) = out.get_mut(first..first + 4) {
                    out.copy_from_slice(&column);
                }
            }
        }
        out.map(Self)
    }
    #[inline(always)]
    fn to_rows(columns: [Self; 4], mut row: impl FnMut(usize, [f32; 4])) {
        for first in (0..L).step_by(4) {
            let quads = columns.map(|column| [0, 1, 2, 3].map(|lane| column.lane(first + lane)));
            for (lane, values) in transpose(quads).into_iter().enumerate() {
                row(first + lane, values);
            }
        }
    }
    #[inline(always)]
    fn lane(&self, lane: usize) -> f32 {
        self.0.get(lane).copied().unwrap_or(0.0)
    }
    #[inline(always)]
    fn map(self, f: impl Fn(f32) -> f32) -> Self {
        let mut out = self.0;
        for value in &mut out {
            *value = f(*value);
        }
        Self(out)
    }
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        let mut out = self.0;
        for (a, b) in out.iter_mut().zip(other.0) {
            *a = f(*a, b);
        }
        Self(out)
    }
}

impl<const L: usize> Add for Portable<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
}

impl<const L: usize> Sub for Portable<L> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
}

impl<const L: usize> Mul for Portable<L> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
}

impl<const L: usize> Neg for Portable<L> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|a| -a)
    }
}
