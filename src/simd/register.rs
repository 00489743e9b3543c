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

pub(super) use {memory, same_methods};
