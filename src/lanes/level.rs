//! Which instructions a kernel may use, asked of the processor once. The body of a kernel is the same for
//! every level; a wrapper with the level's instructions switched on is all there is to one. Only networks use fused
//! multiplications and additions, and not with the feature `deterministic`: all else gives the same bits at every level.

use core::sync::atomic::{AtomicU8, Ordering};

#[cfg(target_arch = "x86_64")]
use super::wide::Avx;
use super::{Lanes, Real};

/// A set of vector instructions.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
#[non_exhaustive]
pub enum Level {
    /// What the crate was compiled for.
    Portable,
    /// x86-64 with AVX2 and FMA.
    Avx2,
}

/// Work written once for any number of lanes. `run` must be `#[inline(always)]`, so that it is compiled
/// with the instructions of the wrapper around it.
pub(crate) trait Kernel {
    type Output;
    fn run<R: Real>(self) -> Self::Output;
}

const UNKNOWN: u8 = 0;
const PORTABLE: u8 = 1;
const AVX2: u8 = 2;

static DETECTED: AtomicU8 = AtomicU8::new(UNKNOWN);

impl Level {
    /// The best level of this processor, or the one set by [`Level::force`].
    #[inline]
    pub fn current() -> Self {
        match DETECTED.load(Ordering::Relaxed) {
            AVX2 => Self::Avx2,
            PORTABLE => Self::Portable,
            _ => Self::detect(),
        }
    }

    #[cold]
    fn detect() -> Self {
        let level = if has_avx2() { Self::Avx2 } else { Self::Portable };
        level.store();
        level
    }

    fn store(self) {
        let code = match self {
            Self::Portable => PORTABLE,
            Self::Avx2 => AVX2,
        };
        DETECTED.store(code, Ordering::Relaxed);
    }

    /// Makes every later step of this process use `level`. Returns whether the processor has it; if not,
    /// nothing changes.
    pub fn force(level: Self) -> bool {
        let possible = level == Self::Portable || has_avx2();
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
    if Level::current() == Level::Avx2 {
        #[allow(unsafe_code)]
        // SAFETY: `Level::Avx2` is stored only after `has_avx2` saw that processor and system support it.
        return unsafe { with_avx2(kernel) };
    }
    kernel.run::<Lanes<8>>()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn with_avx2<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<Avx>()
}

/// AVX2 in the processor (leaf 7), FMA, AVX and the saving of its registers by the system (leaf 1, XCR0).
#[cfg(target_arch = "x86_64")]
fn has_avx2() -> bool {
    use core::arch::x86_64::{__cpuid, __cpuid_count, _xgetbv};

    const NEEDED: u32 = 1 << 12 | 1 << 27 | 1 << 28;
    const XMM_AND_YMM: u64 = 0b110;
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
    let state = unsafe { enabled_state() };
    state & XMM_AND_YMM == XMM_AND_YMM && __cpuid_count(7, 0).ebx >> 5 & 1 == 1
}

#[cfg(not(target_arch = "x86_64"))]
fn has_avx2() -> bool {
    false
}
