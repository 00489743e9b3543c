//! Prints the checksums of a Cortex-M4F, as `targets` does on processors with an operating system, and how many
//! instructions the steps of its scene of 208 nodes take. Both go to the emulator's console, and so does the exit
//! status.
#![no_std]
#![no_main]

use core::ops::Range;
use core::panic::PanicInfo;
use core::ptr;

use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{Peripherals, SYST};
use cortex_m_rt::entry;
use cortex_m_semihosting::debug::{self, EXIT_FAILURE, EXIT_SUCCESS};
use cortex_m_semihosting::{heprintln, hprintln};
use targets::{Level, NAMES, checksum, long_exact, long_learned, rounding};

/// Instructions in a tick of the timer: the board's clock has 25 MHz, and QEMU counts a nanosecond for each instruction
/// when it is told so (`-icount shift=0`).
const PER_TICK: u32 = 40;
/// What the timer counts down from: it has 24 bits.
const TICKS: u32 = (1 << 24) - 1;

#[entry]
fn main() -> ! {
    for (what, name) in NAMES.into_iter().enumerate() {
        hprintln!("{name} {} {:08x}", rounding(what, Level::Portable), checksum(what, Level::Portable));
    }
    let measured =
        Peripherals::take().is_some_and(|mut peripherals| print_instructions(&mut peripherals.SYST));
    exit(measured)
}

/// Times each of a thousand exact and a hundred learned steps: none may take longer than the others.
/// Gives whether there were as many, and the timer lasted for each.
fn print_instructions(timer: &mut SYST) -> bool {
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(TICKS);
    timer.enable_counter();
    let mut each =
        Each { timer, count: 0, least: u32::MAX, most: 0, painted: ptr::null_mut()..ptr::null_mut() };
    heprintln!("instructions and stack of a step of 208 nodes");
    let exact = long_exact(1_001, || each.ended());
    let exact_told = each.tell("exact", 1_000);
    let learned = long_learned(100, 101, || each.ended());
    exact.is_some() && exact_told && learned.is_some() && each.tell("learned", 100)
}

/// What consecutive steps take.
struct Each<'a> {
    timer: &'a mut SYST,
    count: u32,
    least: u32,
    most: u32,
    /// Painted words of the stack below that of the caller of steps.
    painted: Range<*mut u32>,
}

/// What unused stack is painted with, and how many words of it.
const PAINT: u32 = 0xa5a5_a5a5;
const WORDS: usize = 16 * 1024;
/// What a call that takes no step uses of it, words.
const OWN: usize = 64;

/// Paints the stack below what is in use.
#[inline(never)]
fn paint() -> Range<*mut u32> {
    let mut here = 0u32;
    let end = (&raw mut here).wrapping_sub(OWN);
    let start = end.wrapping_sub(WORDS);
    let mut word = end;
    while word > start {
        word = word.wrapping_sub(1);
        // SAFETY: below the stack pointer there is nothing but memory, megabytes of it on this board.
        unsafe { word.write_volatile(PAINT) };
    }
    start..end
}

/// Bytes from the deepest word that is not painted any more to the end.
fn used(painted: &Range<*mut u32>) -> usize {
    let mut word = painted.start;
    // SAFETY: as above.
    while word < painted.end && unsafe { word.read_volatile() } == PAINT {
        word = word.wrapping_add(1);
    }
    painted.end as usize - word as usize + size_of::<u32>() * OWN
}

impl Each<'_> {
    /// A step has ended, and the next begins. What was before the first is not counted.
    fn ended(&mut self) {
        let instructions =
            if self.timer.has_wrapped() { u32::MAX } else { (TICKS - SYST::get_current()) * PER_TICK };
        if self.count == 0 {
            self.painted = paint();
        } else {
            (self.least, self.most) = (self.least.min(instructions), self.most.max(instructions));
        }
        self.count += 1;
        self.timer.clear_current();
    }

    /// Prints them, and is ready for others.
    fn tell(&mut self, name: &str, count: u32) -> bool {
        let (stack, steps) = (used(&self.painted), self.count.saturating_sub(1));
        heprintln!("{name}: from {} to {} in {steps} steps, {stack} bytes", self.least, self.most);
        let fine = steps == count && self.most < u32::MAX;
        (self.count, self.least, self.most) = (0, u32::MAX, 0);
        fine
    }
}

fn exit(fine: bool) -> ! {
    debug::exit(if fine { EXIT_SUCCESS } else { EXIT_FAILURE });
    loop {
        cortex_m::asm::wfi();
    }
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    heprintln!("{info}");
    exit(false)
}
