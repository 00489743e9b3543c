//! What all types of numbers in one register have in common, whatever its instructions are: the way to its single numbers, and
//! functions that are made of its other operations.

/// The register as an array, and back.
macro_rules! memory {
    ($register:ident, $count:literal) => {
        impl $register {
            #[inline(always)]
            fn numbers(self) -> [f32; $count] {
                bytemuck::must_cast(self.0)
            }
            #[inline(always)]
            fn of(numbers: [f32; $count]) -> Self {
                Self(bytemuck::must_cast(numbers))
            }
        }
    };
}

/// Methods of [`Real`](super::Real) that are the same for all of them.
macro_rules! same_methods {
    () => {
        #[inline(always)]
        fn from_fn(at: impl Fn(usize) -> f32) -> Self {
            let mut out = [0.0; Self::COUNT];
            for (lane, value) in out.iter_mut().enumerate() {
                *value = at(lane);
            }
            Self::of(out)
        }
        #[inline(always)]
        fn lane(&self, lane: usize) -> f32 {
            self.numbers().get(lane).copied().unwrap_or(0.0)
        }
        #[inline(always)]
        fn sqrt(self) -> Self {
            $crate::lanes::functions::sqrt(self)
        }
        #[inline(always)]
        fn exp(self) -> Self {
            $crate::lanes::functions::exp(self)
        }
        #[inline(always)]
        fn inverse_cbrt(self) -> Self {
            $crate::lanes::functions::inverse_cbrt(self)
        }
    };
}

pub(super) use {memory, same_methods};
