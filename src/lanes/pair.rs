//! Two vectors as one. A long chain of operations that wait for each other leaves a processor idle, and its window is too
//! short to find the next vector's chain by itself; two chains, instruction by instruction in turn, fill the gaps.

// No closures over vectors here: the compiler leaves calls of them standing where instructions were to be.

use core::ops::{Add, Mul, Neg, Sub};

use super::int8::Whole;
use super::{BLOCK, Real};

/// The lanes of the first, then those of the second.
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

/// Methods that do to each vector what they do to one.
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
    type Eight = R::Eight;
    type Whole = Pair<R::Whole>;

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
        R::to_rows([x.1, y.1, z.1, w.1], |lane, numbers| row(R::COUNT + lane, numbers));
    }
    #[inline(always)]
    fn are_among<const N: usize>(rows: [&[u32; BLOCK]; N], first: u32, count: u32) -> bool {
        R::are_among(rows, first, count)
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
    each!(max other, min other, over other, positive, abs, root, sqrt, exp, inverse_cbrt);
}

impl<R: Real, W: Whole<R>> Whole<Pair<R>> for Pair<W> {
    #[inline(always)]
    fn splat(number: i32) -> Self {
        Self(W::splat(number), W::splat(number))
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
