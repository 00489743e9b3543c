//! Numbers that are computed side by side: one generic body serves one element (`f32`) and `L`
//! elements at once ([`Lanes`]).
//!
//! Element loops are written once over [`Real`]. On x86-64 the compiler turns the fixed-length loops of
//! [`Lanes`] into vector instructions; other processors without a register type here take numbers one by one. Only [`Real::fused`] may fuse a multiplication
//! with an addition, and not with the feature `deterministic`: without it every width gives the same bits.

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
mod level;
#[cfg(test)]
mod level_tests;
#[cfg(all(target_arch = "aarch64", target_feature = "neon", target_endian = "little"))]
mod neon;
mod pair;
// Not every processor has such registers.
#[allow(unused_imports, unused_macros)]
mod register;
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
mod simd128;
mod vectors;

pub use level::Level;
pub(crate) use level::{Kernel, dispatch};
pub(crate) use pair::Pair;
pub use vectors::NodeVector;
use vectors::transpose;
pub(crate) use vectors::{
    BlockNodes, Chosen, EIGHT, Following, Gather, Rows, Scatter, Waiting, axes, dot, write_rows,
};

use core::ops::{Add, Mul, Neg, Sub};

use int8::{Packed, Whole};

/// The same statements for each number below one that the compiler knows, at most six: it leaves long ones in a loop, and
/// the vectors that they handle in memory.
macro_rules! unrolled {
    ($number:ident < $count:ident => $statements:block) => {
        unrolled!($number < $count => $statements; 0 1 2 3 4 5)
    };
    ($number:ident < $count:ident => $statements:block; $($each:literal)*) => {
        const { assert!($count <= 6) };
        $(if $each < $count {
            let $number: usize = $each;
            $statements
        })*
    };
}
pub(crate) use unrolled;

/// Elements in one block of the scene's tables; every lane count divides it.
pub const BLOCK: usize = 16;

/// Real numbers in single precision, one or several side by side.
pub trait Real:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self>
{
    /// Numbers held side by side: one, or a multiple of four.
    const COUNT: usize;
    /// There are registers for a block of four by two of these sums, and what goes into them.
    const MANY_REGISTERS: bool = false;
    /// Eight numbers side by side with the same instructions: for tables eight wide, and for sums over nodes, whose
    /// order and so whose bits the width would change.
    type Eight: Real;
    /// As many whole numbers.
    type Whole: Whole<Self>;

    /// Number `lane` is `at(lane)`.
    fn from_fn(at: impl Fn(usize) -> f32) -> Self;
    /// Lane `l` of the four takes the four numbers of `row(l)`.
    fn from_rows(row: impl Fn(usize) -> [f32; 4]) -> [Self; 4];
    /// Hands the four numbers of each lane to `row`.
    fn to_rows(columns: [Self; 4], row: impl FnMut(usize, [f32; 4]));
    /// Hands the four numbers of each corner and lane of elements side by side to `row`: of eight lanes those of the first
    /// corner, then of the second and so on, then of the next eight. Sums must not depend on how wide a vector is.
    #[inline(always)]
    fn corners_to_rows<const N: usize>(corners: [[Self; 4]; N], mut row: impl FnMut(usize, usize, [f32; 4])) {
        unrolled!(corner < N => {
            Self::to_rows(corners[corner], |lane, numbers| row(corner, lane, numbers));
        });
    }
    /// As many rows as there are lanes, in the order of lanes that takes the fewest instructions: lane [`Real::lane_of`] of the
    /// four takes the numbers of a row. Zeros if there are fewer.
    #[inline(always)]
    fn from_block(rows: &[[f32; 4]]) -> [Self; 4] {
        Self::from_rows(|lane| rows.get(lane).copied().unwrap_or_default())
    }
    /// Writes what [`Real::from_block`] reads; nothing if there are fewer rows.
    #[inline(always)]
    fn to_block(columns: [Self; 4], rows: &mut [[f32; 4]]) {
        Self::to_rows(columns, |lane, numbers| {
            if let Some(row) = rows.get_mut(lane) {
                *row = numbers;
            }
        });
    }
    /// The lane of a row of a block.
    #[inline(always)]
    fn lane_of(row: usize) -> usize {
        row
    }
    /// Whether all of some numbers are among `count` from `first` on.
    #[inline(always)]
    fn are_among<const N: usize>(rows: [&[u32; BLOCK]; N], first: u32, count: u32) -> bool {
        let mut among = true;
        for row in rows {
            for number in row {
                among &= number.wrapping_sub(first) < count;
            }
        }
        among
    }
    /// The number in `lane`; lanes that do not exist read as zero.
    fn lane(&self, lane: usize) -> f32;
    /// Applies `f` to each number.
    #[inline(always)]
    fn map(self, f: impl Fn(f32) -> f32) -> Self {
        Self::from_fn(|lane| f(self.lane(lane)))
    }
    /// Applies `f` to each pair of numbers.
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self::from_fn(|lane| f(self.lane(lane), other.lane(lane)))
    }

    /// `self * factor + addend`, rounded once where the level can, unless the feature `deterministic` is on.
    #[inline(always)]
    fn fused(self, factor: Self, addend: Self) -> Self {
        self * factor + addend
    }
    /// `yes` where positive, else `no`.
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
    /// One where positive, else zero.
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
    fn over(self, other: Self) -> Self {
        self.zip(other, |a, b| a / b)
    }
    /// Square root, correctly rounded.
    #[inline(always)]
    fn root(self) -> Self {
        self.map(libm::sqrtf)
    }
    /// Square root of zero or a positive normal number, relative error below 3e-7.
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.map(functions::sqrt)
    }
    /// `exp(self)`, relative error below 1.2e-7 for arguments from -87 to 88; outside, the value at the
    /// nearer end.
    #[inline(always)]
    fn exp(self) -> Self {
        self.map(functions::exp)
    }
    /// `self^(-1/3)` for positive normal numbers, relative error below 2e-7.
    #[inline(always)]
    fn inverse_cbrt(self) -> Self {
        self.map(functions::inverse_cbrt)
    }
}

impl Real for f32 {
    const COUNT: usize = 1;
    type Eight = Lanes<8>;
    type Whole = Packed<1>;

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

/// `L` numbers side by side.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(transparent)]
pub struct Lanes<const L: usize>(pub [f32; L]);

impl<const L: usize> Real for Lanes<L> {
    const COUNT: usize = L;
    type Eight = Lanes<8>;
    type Whole = Packed<L>;

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
            for (lane, numbers) in transpose(quads).into_iter().enumerate() {
                row(first + lane, numbers);
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

impl<const L: usize> Add for Lanes<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
}

impl<const L: usize> Sub for Lanes<L> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
}

impl<const L: usize> Mul for Lanes<L> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
}

impl<const L: usize> Neg for Lanes<L> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|a| -a)
    }
}
