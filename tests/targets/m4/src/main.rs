//! Prints the checksums of a Cortex-M4F, as `targets` does on processors with an operating system, and how many instructions
//! the steps of its scene of 208 nodes take. Both go to the emulator's console, and so does the exit status.
#![no_std]
#![no_main]

use core::panic::PanicInfo;

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

/// Whether the timer lasted for all of it.
fn print_instructions(timer: &mut SYST) -> bool {
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(TICKS);
    timer.enable_counter();
    let mut of = |run: fn() -> Option<u32>| {
        timer.clear_current();
        run()?;
        let ticks = TICKS - SYST::get_current();
        (!timer.has_wrapped()).then_some(ticks * PER_TICK)
    };
    // Differences of two runs: what comes before the steps is in both.
    let (Some(rest), Some(exact)) = (of(|| long_exact(10)), of(|| long_exact(110))) else { return false };
    let (Some(led), Some(learned)) = (of(|| long_learned(100, 0)), of(|| long_learned(100, 10))) else {
        return false;
    };
    heprintln!(
        "instructions a step of 208 nodes: exact {}, learned {}",
        (exact - rest) / 100,
        (learned - led) / 10
    );
    true
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
