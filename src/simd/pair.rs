//! Two vectors as one. A long sequence of dependent operations leaves a processor idle, and its reorder window is too
//! short to reach the next vector. Two independent sequences, interleaved instruction by instruction, use the idle
//! time.

// No closures over vectors here: the compiler may leave them as function calls.

use core::ops::{Add, Mul, Neg, Sub};

use super::int8::Whole;
use super::{Piece, Real, TILE};

/// The values of the first vector, then those of the second.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pair<R>(pub(crate) R, pub(crate) R);

macro_rules! operator {
    ($trait:ident, $method:ident) => {
        impl<R: Real> $trait for Pair<R> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(self.0.$method(other.0), self.1.$method(other.1))
            }
        }
    };
}

operator!(Add, add);
operator!(Sub, sub);
operator!(Mul, mul);

impl<R: Real> Neg for Pair<R> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0, -self.1)
    }
}

/// Methods that are applied to each of the two vectors.
macro_rules! each {
    ($($method:ident $($other:ident)?),*) => {
        $(#[inline(always)]
        fn $method(self $(, $other: Self)?) -> Self {
            Self(self.0.$method($($other.0)?), self.1.$method($($other.1)?))
        })*
    };
}

impl<R: Real> Real for Pair<R> {
    const COUNT: usize = 2 * R::COUNT;
    const MANY_REGISTERS: bool = R::MANY_REGISTERS;
    type Width8 = R::Width8;
    type Whole = Pair<R::Whole>;

    #[inline(always)]
    fn run_piece<P: Piece>(piece: P) -> P::Output {
        R::run_piece(piece)
    }
    #[inline(always)]
    fn from_fn(at: impl Fn(usize) -> f32) -> Self {
        Self(R::from_fn(&at), R::from_fn(|lane| at(R::COUNT + lane)))
    }
    #[inline(always)]
    fn from_rows(row: impl Fn(usize) -> [f32; 4]) -> [Self; 4] {
        let [a, b, c, d] = R::from_rows(&row);
        let [e, f, g, h] = R::from_rows(|lane| row(R::COUNT + lane));
        [Self(a, e), Self(b, f), Self(c, g), Self(d, h)]
    }
    #[inline(always)]
    fn to_rows([x, y, z, w]: [Self; 4], mut row: impl FnMut(usize, [f32; 4])) {
        R::to_rows([x.0, y.0, z.0, w.0], &mut row);
        R::to_rows([x.1, y.1, z.1, w.1], |lane, values| row(R::COUNT + lane, values));
    }
    #[inline(always)]
    fn all_in_range<const N: usize>(rows: [&[u32; TILE]; N], first: u32, count: u32) -> bool {
        R::all_in_range(rows, first, count)
    }
    #[inline(always)]
    fn lane(&self, lane: usize) -> f32 {
        if lane < R::COUNT { self.0.lane(lane) } else { self.1.lane(lane - R::COUNT) }
    }
    #[inline(always)]
    fn fused(self, factor: Self, addend: Self) -> Self {
        Self(self.0.fused(factor.0, addend.0), self.1.fused(factor.1, addend.1))
    }
    #[inline(always)]
    fn choose(self, yes: Self, no: Self) -> Self {
        Self(self.0.choose(yes.0, no.0), self.1.choose(yes.1, no.1))
    }
    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self(R::splat(value), R::splat(value))
    }
    each!(max other, min other, divide other, positive, abs, root, sqrt, exp, inverse_cbrt);
}

impl<R: Real, W: Whole<R>> Whole<Pair<R>> for Pair<W> {
    #[inline(always)]
    fn splat(value: i32) -> Self {
        Self(W::splat(value), W::splat(value))
    }
    #[inline(always)]
    fn dot(self, bytes: Self, weights: [i8; 4]) -> Self {
        Self(self.0.dot(bytes.0, weights), self.1.dot(bytes.1, weights))
    }
    #[inline(always)]
    fn numbers(self) -> Pair<R> {
        Pair(self.0.numbers(), self.1.numbers())
    }
    #[inline(always)]
    fn low_bytes([a, b, c, d]: [Pair<R>; 4]) -> Self {
        Self(W::low_bytes([a.0, b.0, c.0, d.0]), W::low_bytes([a.1, b.1, c.1, d.1]))
    }
}
