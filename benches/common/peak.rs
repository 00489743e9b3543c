//! What this machine can do at most: float32 multiply-adds on one core, measured, in GFLOP/s. A share of
//! this is the honest way to say how fast a kernel is.

use std::hint::black_box;
use std::time::Instant;

const SUMS: usize = 12;
const ROUNDS: usize = 20_000;

/// Independent sums of vector multiply-adds, as many as the pipelines hold.
#[inline(always)]
fn sums<const L: usize>(fused: impl Fn(f32, f32, f32) -> f32) -> f32 {
    let mut sums = black_box([[1.0f32; L]; SUMS]);
    let (factor, add) = (black_box([0.999_9f32; L]), black_box([1e-4f32; L]));
    for _ in 0..ROUNDS {
        for sum in &mut sums {
            for lane in 0..L {
                sum[lane] = fused(sum[lane], factor[lane], add[lane]);
            }
        }
    }
    black_box(sums)[0][0]
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn sums_fma() -> f32 {
    sums::<8>(|a, b, c| a.mul_add(b, c))
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,fma")]
fn sums_avx512() -> f32 {
    use std::arch::x86_64::{_mm512_fmadd_ps, _mm512_reduce_add_ps, _mm512_set1_ps};
    // Explicitly: the compiler does not choose these vectors by itself.
    let mut sums = [_mm512_set1_ps(black_box(1.0)); SUMS];
    let (factor, add) = (_mm512_set1_ps(black_box(0.999_9)), _mm512_set1_ps(black_box(1e-4)));
    for _ in 0..ROUNDS {
        for sum in &mut sums {
            *sum = _mm512_fmadd_ps(*sum, factor, add);
        }
    }
    let mut total = 0.0;
    for sum in sums {
        total += _mm512_reduce_add_ps(sum);
    }
    total
}

fn most<F: Fn() -> f32>(rounds: usize, flops: f64, run: F) -> f64 {
    (0..rounds)
        .map(|_| {
            let start = Instant::now();
            black_box(run());
            flops / start.elapsed().as_secs_f64() * 1e-9
        })
        .fold(0.0, f64::max)
}

/// GFLOP/s of one core with what the portable build may use.
pub(crate) fn baseline(rounds: usize) -> f64 {
    most(rounds, (2 * SUMS * 4 * ROUNDS) as f64, || sums::<4>(|a, b, c| a * b + c))
}

/// GFLOP/s of one core with its widest instructions, the best of so many rounds of 40 us. A machine that others use
/// changes its speed: shares of the peak are taken of one that was measured just before.
pub(crate) fn widest(rounds: usize) -> f64 {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx512f") {
        #[allow(unsafe_code)]
        // SAFETY: the feature was detected.
        return most(rounds, (2 * SUMS * 16 * ROUNDS) as f64, || unsafe { sums_avx512() });
    }
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma") {
        #[allow(unsafe_code)]
        // SAFETY: both features were detected.
        return most(rounds, (2 * SUMS * 8 * ROUNDS) as f64, || unsafe { sums_fma() });
    }
    baseline(rounds)
}
