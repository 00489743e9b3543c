//! Instruction-set levels. The processor is asked once for its best level. The body of a kernel is the same for every
//! level; a level adds only a wrapper that enables its instructions. Levels with fused instructions use them in
//! networks and element loops, which is faster and rounds less often. With the feature `deterministic` nothing is
//! fused, and every level gives the same bits.

use core::sync::atomic::{AtomicU8, Ordering};

#[cfg(not(target_arch = "x86_64"))]
use super::Portable;
use super::Real;
#[cfg(all(target_arch = "aarch64", target_feature = "neon", target_endian = "little"))]
use super::{Pair, neon::Neon};
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
use super::{Pair, simd128::Simd128};
#[cfg(target_arch = "x86_64")]
use super::{avx2::Avx2, avx512::Avx512, sse2::Sse2};

/// A set of vector instructions.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
#[non_exhaustive]
pub enum Level {
    /// Only the instructions for which the crate was compiled.
    Portable,
    /// x86-64 with AVX2 and FMA.
    Avx2,
    /// x86-64 with AVX-512 (F, BW, DQ, VL) and its dot products of bytes (VNNI).
    Avx512,
    /// 64-bit Arm; every such processor has it.
    Neon,
    /// WebAssembly compiled with its feature `simd128`.
    Simd128,
}

/// Work that is written once for vectors of any width. `run` must be `#[inline(always)]`, so that it is compiled with
/// the instructions of the wrapper around it.
pub trait Kernel {
    /// What it gives.
    type Output;
    /// Whether scalar code gives the same bits as vectors. Processors without vector instructions then run scalar code.
    #[cfg_attr(target_arch = "x86_64", allow(dead_code))]
    const SCALAR: bool = false;
    /// Whether vectors must have eight values or more.
    const EIGHT: bool = false;
    /// Whether it runs seldom, as a look at the critical step: AVX2 will do where there is AVX-512, which saves its bytes.
    const SELDOM: bool = false;
    /// The work, with vectors of this kind.
    fn run<R: Real>(self) -> Self::Output;
    /// The same as scalar code. Kernels whose batches differ in size then say so here: vectors are not compiled with
    /// both.
    #[cfg_attr(target_arch = "x86_64", allow(dead_code))]
    #[inline(always)]
    fn run_scalar(self) -> Self::Output
    where
        Self: Sized,
    {
        self.run::<f32>()
    }
}

/// A piece of a kernel that is the same for several kernels, as for all laws: a function of its own
/// ([`Real::run_piece`]), so that it is compiled once for each level. `run` must be `#[inline(always)]`.
pub trait Piece {
    /// What it gives.
    type Output;
    /// Does it.
    fn run(self) -> Self::Output;
}

/// All levels, the best first.
const LEVELS: [Level; 5] = [Level::Avx512, Level::Avx2, Level::Neon, Level::Simd128, Level::Portable];

/// The level that every processor of the target has.
const BASELINE: Level = if cfg!(all(target_arch = "aarch64", target_feature = "neon", target_endian = "little")) {
    Level::Neon
} else if cfg!(all(target_arch = "wasm32", target_feature = "simd128")) {
    Level::Simd128
} else {
    Level::Portable
};

/// Place of the current level in [`LEVELS`], counted from one; zero before the processor was asked.
static DETECTED: AtomicU8 = AtomicU8::new(0);

impl Level {
    /// The best level of this processor, or the one set by [`Level::force`].
    #[inline]
    pub fn current() -> Self {
        let place = usize::from(DETECTED.load(Ordering::Relaxed));
        place.checked_sub(1).and_then(|place| LEVELS.get(place)).copied().unwrap_or_else(Self::detect)
    }

    /// The levels of this processor, the best first.
    pub fn available() -> impl Iterator<Item = Self> {
        LEVELS.into_iter().filter(|level| level.is_here())
    }

    #[cold]
    fn detect() -> Self {
        let level = Self::available().next().unwrap_or(Self::Portable);
        level.store();
        level
    }

    fn store(self) {
        let place = LEVELS.iter().position(|level| *level == self).map_or(0, |place| place + 1);
        DETECTED.store(place as u8, Ordering::Relaxed);
    }

    fn is_here(self) -> bool {
        match self {
            Self::Portable => true,
            Self::Neon | Self::Simd128 => self == BASELINE,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => has(AVX_STATE, AVX2_FEATURES),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => has(AVX512_STATE, AVX512_FEATURES),
            #[cfg(not(target_arch = "x86_64"))]
            Self::Avx2 | Self::Avx512 => false,
        }
    }

    /// Makes every later step of this process use `level`. Returns whether the processor has it; if not,
    /// nothing changes.
    pub fn force(level: Self) -> bool {
        let possible = level.is_here();
        if possible {
            level.store();
        }
        possible
    }
}

/// The vectors of [`Level::Portable`].
#[cfg(target_arch = "x86_64")]
pub(crate) type Baseline = Sse2;
/// The vectors of [`Level::Portable`].
#[cfg(not(target_arch = "x86_64"))]
pub(crate) type Baseline = Portable<8>;

/// Runs the kernel with the instructions of the current level.
#[cfg(not(test))]
#[inline(always)]
pub fn dispatch<K: Kernel>(kernel: K) -> K::Output {
    at_current_level(kernel)
}

/// The tests of this crate compile only one level of all kernels: those in `tests` run the others.
#[cfg(test)]
pub fn dispatch<K: Kernel>(kernel: K) -> K::Output {
    with_baseline(kernel)
}

#[inline(always)]
pub(super) fn at_current_level<K: Kernel>(kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    #[allow(unsafe_code)]
    match Level::current() {
        // SAFETY: a level is stored only after `Level::is_here` saw that processor and system support it.
        Level::Avx512 if !K::SELDOM => return unsafe { with_avx512(kernel) },
        // SAFETY: as above; the features of AVX-512 that are asked for contain those of AVX2.
        Level::Avx512 | Level::Avx2 => return unsafe { with_avx2(kernel) },
        _ => {}
    }
    #[cfg(all(target_arch = "aarch64", target_feature = "neon", target_endian = "little"))]
    if Level::current() == Level::Neon {
        return kernel.run::<Pair<Neon>>();
    }
    #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
    if Level::current() == Level::Simd128 {
        return kernel.run::<Pair<Simd128>>();
    }
    #[cfg(not(target_arch = "x86_64"))]
    if K::SCALAR {
        return kernel.run_scalar();
    }
    with_baseline(kernel)
}

/// Not inlined where there are other levels, because these would take its stack as well.
#[cfg_attr(target_arch = "x86_64", inline(never))]
#[cfg_attr(not(target_arch = "x86_64"), inline(always))]
fn with_baseline<K: Kernel>(kernel: K) -> K::Output {
    if K::EIGHT { kernel.run::<<Baseline as Real>::Width8>() } else { kernel.run::<Baseline>() }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn with_avx2<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<Avx2>()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,avx512f,avx512bw,avx512dq,avx512vl,avx512vnni")]
fn with_avx512<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<Avx512>()
}

/// Registers that the operating system must save (bits of XCR0): xmm and ymm; for AVX-512 masks and zmm as well.
#[cfg(target_arch = "x86_64")]
const AVX_STATE: u64 = 0b110;
#[cfg(target_arch = "x86_64")]
const AVX512_STATE: u64 = AVX_STATE | 0b1110_0000;

/// Bits of ebx and ecx in CPUID leaf 7: AVX2; for AVX-512 F, DQ, BW, VL and VNNI as well.
#[cfg(target_arch = "x86_64")]
const AVX2_FEATURES: [u32; 2] = [1 << 5, 0];
#[cfg(target_arch = "x86_64")]
const AVX512_FEATURES: [u32; 2] = [AVX2_FEATURES[0] | 1 << 16 | 1 << 17 | 1 << 30 | 1 << 31, 1 << 11];

/// Whether the processor has FMA, AVX and OSXSAVE (CPUID leaf 1) and the given features (leaf 7), and the operating
/// system saves the given registers.
#[cfg(target_arch = "x86_64")]
fn has(state: u64, [ebx, ecx]: [u32; 2]) -> bool {
    use core::arch::x86_64::{__cpuid_count, _xgetbv, CpuidResult};

    const FMA_OSXSAVE_AVX: u32 = 1 << 12 | 1 << 27 | 1 << 28;
    #[target_feature(enable = "xsave")]
    fn enabled_state() -> u64 {
        // SAFETY: the caller has checked OSXSAVE.
        #[allow(unsafe_code)]
        unsafe {
            _xgetbv(0)
        }
    }
    fn cpuid(leaf: u32) -> CpuidResult {
        // SAFETY: every processor of x86-64 has it. Newer compilers know.
        #[allow(unsafe_code, unused_unsafe)]
        unsafe {
            __cpuid_count(leaf, 0)
        }
    }
    // Miri has no cpuid.
    if cfg!(miri) || cpuid(0).eax < 7 || cpuid(1).ecx & FMA_OSXSAVE_AVX != FMA_OSXSAVE_AVX {
        return false;
    }
    // SAFETY: OSXSAVE is set, so xgetbv is there.
    #[allow(unsafe_code)]
    let saved = unsafe { enabled_state() };
    let features = cpuid(7);
    saved & state == state && features.ebx & ebx == ebx && features.ecx & ecx == ecx
}
