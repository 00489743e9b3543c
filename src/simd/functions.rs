//! Exponential, inverse cube root and square root without branches, table look-ups or integer conversions, so that they
//! can be vectorised. Errors are measured by the tests at the end.

use super::Real;

/// Vectors whose bits can be used as integers.
pub(super) trait Bits: Real {
    /// The bits, taken as a signed integer and converted to the nearest float.
    fn bits_to_float(self) -> Self;
    /// The bits plus `addend` (wrapping), shifted left by 8 or 23.
    fn plus_shifted(self, addend: u32, left: u32) -> Self;
    /// `minuend` minus half the bits.
    fn half_from(self, minuend: u32) -> Self;
}

impl Bits for f32 {
    #[inline(always)]
    fn bits_to_float(self) -> Self {
        (self.to_bits() as i32) as f32
    }
    #[inline(always)]
    fn plus_shifted(self, addend: u32, left: u32) -> Self {
        Self::from_bits(self.to_bits().wrapping_add(addend) << (left % 32))
    }
    #[inline(always)]
    fn half_from(self, minuend: u32) -> Self {
        Self::from_bits(minuend.wrapping_sub(self.to_bits() >> 1))
    }
}

/// `exp(x)`: `2^n p(r)` with `n = round(x / ln 2)` and the minimax polynomial of Cephes' `expf`
/// (Moshier) for `|r| <= ln 2 / 2`. Arguments beyond -87 and 88 are clamped.
#[inline(always)]
pub(super) fn exp<R: Bits>(x: R) -> R {
    const MAGIC: f32 = 12_582_912.0; // 1.5 * 2^23: adding it rounds to an integer, in the low bits
    const LN2_HIGH: f32 = 0.693_359_4; // 355/512, exact
    const LN2_LOW: f32 = -2.121_944_4e-4;
    let c = R::splat;
    let x = x.min(c(88.0)).max(c(-87.0));
    let shifted = x.fused(c(core::f32::consts::LOG2_E), c(MAGIC));
    let n = shifted - c(MAGIC);
    let r = x - n * c(LN2_HIGH) - n * c(LN2_LOW);
    let p = c(1.987_569_2e-4);
    let p = p.fused(r, c(1.398_199_9e-3));
    let p = p.fused(r, c(8.333_452e-3));
    let p = p.fused(r, c(4.166_579_6e-2));
    let p = p.fused(r, c(1.666_666_5e-1));
    let p = p.fused(r, c(0.5));
    let p = p.fused(r * r, r) + c(1.0);
    // Shifting drops the exponent of MAGIC and leaves n in the exponent field.
    p * shifted.plus_shifted(127, 23)
}

/// `x^(-1/3)` for positive normal `x`: a first guess from the bits (-1/3 of the exponent), then two
/// third-order steps `y (1 + h/3 + 2 h^2/9)`, `h = 1 - x y^3`.
#[inline(always)]
pub(super) fn inverse_cbrt<R: Bits>(x: R) -> R {
    // The guess 0x54a2fa8c - bits/3, computed in floats: a vector unit has no integer division.
    const SCALE: f32 = -1.0 / (3.0 * 256.0);
    const OFFSET: f32 = 0x54a2_fa8c as f32 / 256.0 + 8_388_608.0;
    let c = R::splat;
    let guess = x.bits_to_float() * c(SCALE) + c(OFFSET);
    let mut y = guess.plus_shifted(0, 8);
    for _ in 0..2 {
        let h = (x * y * y).fused(-y, c(1.0));
        y = (y * h).fused(h.fused(c(2.0 / 9.0), c(1.0 / 3.0)), y);
    }
    y
}

/// `sqrt(x) = x x^(-1/2)` for zero and positive normal `x`: a first guess from the bits, then three Newton
/// steps. libm's is exact, but the compiler cannot vectorise it.
#[inline(always)]
pub(super) fn sqrt<R: Bits>(x: R) -> R {
    let c = R::splat;
    let mut y = x.half_from(0x5f37_59df);
    for _ in 0..3 {
        y = y * (c(1.5) - c(0.5) * x * y * y);
    }
    x * y
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::println;

    #[test]
    fn exponential_is_accurate_over_its_range() {
        let mut worst = 0.0f64;
        let mut x = -87.0f32;
        while x < 88.0 {
            let exact = f64::from(x).exp();
            worst = worst.max((f64::from(super::exp(x)) - exact).abs() / exact);
            x += 1.3e-4;
        }
        println!("exp: largest relative error {worst:.2e}");
        assert!(worst < 1.2e-7);
        assert_eq!(super::exp(0.0f32), 1.0);
        assert_eq!(super::exp(1e9f32), super::exp(88.0));
        assert_eq!(super::exp(-1e9f32), super::exp(-87.0));
    }

    #[test]
    fn inverse_cube_root_is_accurate_over_its_range() {
        let mut worst = 0.0f64;
        let mut x = 1e-30f32;
        while x < 1e30 {
            let exact = f64::from(x).powf(-1.0 / 3.0);
            worst = worst.max((f64::from(super::inverse_cbrt(x)) - exact).abs() / exact);
            x *= 1.000_1;
        }
        println!("inverse cube root: largest relative error {worst:.2e}");
        assert!(worst < 2e-7);
    }

    #[test]
    fn square_root_is_accurate_over_its_range() {
        let mut worst = 0.0f64;
        let mut x = 1e-37f32;
        while x < 1e38 {
            let exact = f64::from(x).sqrt();
            worst = worst.max((f64::from(super::sqrt(x)) - exact).abs() / exact);
            x *= 1.000_1;
        }
        println!("square root: largest relative error {worst:.2e}");
        assert!(worst < 3e-7);
        assert_eq!(super::sqrt(0.0f32), 0.0);
    }
}
