//! Which instructions a kernel may use, asked of the processor once. The body of a kernel is the same for
//! every level; a wrapper with the level's instructions switched on is all there is to one. Levels that have them fuse
//! multiplications and additions in networks and element loops, which is faster and rounds less often. With the feature
//! `deterministic` nothing is fused, and every level gives the same bits.

use core::sync::atomic::{AtomicU8, Ordering};

use super::{Lanes, Real};
#[cfg(all(target_arch = "aarch64", target_feature = "neon", target_endian = "little"))]
use super::{Pair, neon::Neon};
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
use super::{Pair, simd128::Simd128};
#[cfg(target_arch = "x86_64")]
use super::{avx2::Avx2, avx512::Avx512};

/// A set of vector instructions.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
#[non_exhaustive]
pub enum Level {
    /// What the crate was compiled for.
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

/// Work written once for any number of lanes. `run` must be `#[inline(always)]`, so that it is compiled
/// with the instructions of the wrapper around it.
pub(crate) trait Kernel {
    type Output;
    /// Whether numbers one by one move a body by the same bits: processors without vectors then take them so.
    const ONE_BY_ONE: bool = false;
    fn run<R: Real>(self) -> Self::Output;
}

/// Whether the compiler is taken to make vectors of [`Lanes`]: where it does not, they become as many times the code.
const VECTORS: bool = cfg!(target_arch = "x86_64");

/// All of them, the best first.
const LEVELS: [Level; 5] = [Level::Avx512, Level::Avx2, Level::Neon, Level::Simd128, Level::Portable];

/// What every processor of the target has.
const BASELINE: Level =
    if cfg!(all(target_arch = "aarch64", target_feature = "neon", target_endian = "little")) {
        Level::Neon
    } else if cfg!(all(target_arch = "wasm32", target_feature = "simd128")) {
        Level::Simd128
    } else {
        Level::Portable
    };

/// Place in [`LEVELS`], counted from one; zero before it was asked for.
static DETECTED: AtomicU8 = AtomicU8::new(0);

impl Level {
    /// The best level of this processor, or the one set by [`Level::force`].
    #[inline]
    pub fn current() -> Self {
        let place = usize::from(DETECTED.load(Ordering::Relaxed));
        place.checked_sub(1).and_then(|place| LEVELS.get(place)).copied().unwrap_or_else(Self::detect)
    }

    /// Those this processor has, the best first.
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

/// Runs the kernel with the instructions of the current level.
#[inline(always)]
pub(crate) fn dispatch<K: Kernel>(kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    #[allow(unsafe_code)]
    match Level::current() {
        // SAFETY: a level is stored only after `Level::is_here` saw that processor and system support it.
        Level::Avx512 => return unsafe { with_avx512(kernel) },
        // SAFETY: as above.
        Level::Avx2 => return unsafe { with_avx2(kernel) },
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
    if K::ONE_BY_ONE && !VECTORS {
        return kernel.run::<f32>();
    }
    kernel.run::<Lanes<8>>()
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

/// Registers that the system saves (XCR0): xmm and ymm; masks and zmm as well.
#[cfg(target_arch = "x86_64")]
const AVX_STATE: u64 = 0b110;
#[cfg(target_arch = "x86_64")]
const AVX512_STATE: u64 = AVX_STATE | 0b1110_0000;

/// What leaf 7 says in ebx and ecx: AVX2; F, DQ, BW, VL and VNNI as well.
#[cfg(target_arch = "x86_64")]
const AVX2_FEATURES: [u32; 2] = [1 << 5, 0];
#[cfg(target_arch = "x86_64")]
const AVX512_FEATURES: [u32; 2] = [AVX2_FEATURES[0] | 1 << 16 | 1 << 17 | 1 << 30 | 1 << 31, 1 << 11];

/// FMA, AVX and the saving of registers in the processor (leaf 1), the given features (leaf 7), and the given registers
/// saved by the system.
#[cfg(target_arch = "x86_64")]
fn has(state: u64, [ebx, ecx]: [u32; 2]) -> bool {
    use core::arch::x86_64::{__cpuid, __cpuid_count, _xgetbv};

    const NEEDED: u32 = 1 << 12 | 1 << 27 | 1 << 28;
    #[target_feature(enable = "xsave")]
    fn enabled_state() -> u64 {
        // SAFETY: the caller has checked OSXSAVE.
        #[allow(unsafe_code)]
        unsafe {
            _xgetbv(0)
        }
    }
    if __cpuid(0).eax < 7 || __cpuid(1).ecx & NEEDED != NEEDED {
        return false;
    }
    // SAFETY: OSXSAVE is set, so xgetbv is there.
    #[allow(unsafe_code)]
    let saved = unsafe { enabled_state() };
    let features = __cpuid_count(7, 0);
    saved & state == state && features.ebx & ebx == ebx && features.ecx & ecx == ecx
}
