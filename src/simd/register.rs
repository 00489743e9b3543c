//! What all register types have in common: conversion from and to arrays, and functions composed of their other
//! operations.

/// Conversion of a register from and to an array.
macro_rules! memory {
    ($register:ident, $count:literal) => {
        impl $register {
            #[inline(always)]
            fn to_array(self) -> [f32; $count] {
                bytemuck::must_cast(self.0)
            }
            #[inline(always)]
            fn from_array(values: [f32; $count]) -> Self {
                Self(bytemuck::must_cast(values))
            }
        }
    };
}

/// Methods of [`Real`](super::Real) that are the same for all register types.
macro_rules! same_methods {
    () => {
        #[inline(always)]
        fn from_fn(at: impl Fn(usize) -> f32) -> Self {
            let mut out = [0.0; Self::COUNT];
            for (lane, value) in out.iter_mut().enumerate() {
                *value = at(lane);
            }
            Self::from_array(out)
        }
        #[inline(always)]
        fn lane(&self, lane: usize) -> f32 {
            self.to_array().get(lane).copied().unwrap_or(0.0)
        }
        #[inline(always)]
        fn sqrt(self) -> Self {
            $crate::simd::functions::sqrt(self)
        }
        #[inline(always)]
        fn exp(self) -> Self {
            $crate::simd::functions::exp(self)
        }
        #[inline(always)]
        fn inverse_cbrt(self) -> Self {
            $crate::simd::functions::inverse_cbrt(self)
        }
    };
}

/// Rows of a register of four values, by the `transpose` of its own module.
macro_rules! four_rows {
    () => {
        #[inline(always)]
        fn from_rows(row: impl Fn(usize) -> [f32; 4]) -> [Self; 4] {
            transpose([
                Self::from_array(row(0)),
                Self::from_array(row(1)),
                Self::from_array(row(2)),
                Self::from_array(row(3)),
            ])
        }
        #[inline(always)]
        fn to_rows(columns: [Self; 4], mut row: impl FnMut(usize, [f32; 4])) {
            let [a, b, c, d] = transpose(columns);
            row(0, a.to_array());
            row(1, b.to_array());
            row(2, c.to_array());
            row(3, d.to_array());
        }
    };
}

pub(super) use {four_rows, memory, same_methods};
