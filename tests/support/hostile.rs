//! Hostile input: many inputs made from sound ones by random changes, each tried within limits of time and memory.
//!
//! A run is determined by its seed: try `n` of a run is the same whatever the number of tries. `SUPPLE_SECONDS=600`
//! goes on for ten minutes instead of the number of tries of an ordinary test, `SUPPLE_SEED=2` makes other tries,
//! `SUPPLE_TRY=17` makes only that one. A failure names the seed and the try.
// The command, whose own printing does not panic, has it in its unit tests.
#![allow(clippy::print_stdout, clippy::print_stderr)]
#![allow(dead_code, unreachable_pub, unsafe_code)] // A global allocator is an unsafe trait.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::time::{Duration, Instant};

/// Counts the bytes that each thread has from the heap.
pub struct Counting;

thread_local! {
    static HELD: Cell<i64> = const { Cell::new(0) };
    static MOST: Cell<i64> = const { Cell::new(0) };
}

fn count(bytes: i64) {
    let _ = HELD.try_with(|held| {
        held.set(held.get() + bytes);
        let _ = MOST.try_with(|most| most.set(most.get().max(held.get())));
    });
}

// SAFETY: every call goes on to the system's allocator with the arguments as they are.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size() as i64);
        // SAFETY: as promised by the caller.
        unsafe { System.alloc(layout) }
    }
    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count(layout.size() as i64);
        // SAFETY: as promised by the caller.
        unsafe { System.alloc_zeroed(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        count(-(layout.size() as i64));
        // SAFETY: as promised by the caller.
        unsafe { System.dealloc(pointer, layout) }
    }
    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // Both pieces may be there at the same time.
        count(size as i64);
        count(-(layout.size() as i64));
        // SAFETY: as promised by the caller.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

/// What `work` gives, and the most bytes from the heap that this thread held meanwhile.
pub fn measured<T>(work: impl FnOnce() -> T) -> (T, u64) {
    let before = HELD.with(Cell::get);
    MOST.with(|most| most.set(before));
    let value = work();
    (value, (MOST.with(Cell::get) - before) as u64)
}

/// Random numbers (splitmix64, Steele et al. 2014).
pub struct Dice(u64);

impl Dice {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Below `count`, or zero.
    pub fn below(&mut self, count: usize) -> usize {
        (self.bits() % count.max(1) as u64) as usize
    }

    pub fn one_in(&mut self, count: usize) -> bool {
        self.below(count) == 0
    }

    pub fn pick<'a, T>(&mut self, from: &'a [T]) -> &'a T {
        &from[self.below(from.len())]
    }

    /// From zero to one.
    pub fn share(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Numbers as hosts get them wrong: mostly of a size that is usual, now and then anything.
    pub fn wild(&mut self, usual: f32) -> f32 {
        match self.below(12) {
            0 => *self.pick(&[f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.0, -0.0, f32::MIN_POSITIVE]),
            1 => *self.pick(&[f32::MAX, f32::MIN, 1e30, -1e30, 1e-40, 1e-30, 1e19, 1e10]),
            2 => f32::from_bits(self.bits() as u32),
            3 => usual * 10.0_f32.powi(self.below(20) as i32 - 10),
            _ => usual * (2.0 * self.share() as f32 - 1.0),
        }
    }
}

/// How many tries there are, and which.
pub struct Run {
    name: &'static str,
    tries: u64,
    seconds: Option<f64>,
    seed: u64,
    only: Option<u64>,
    made: u64,
    /// Of the tries that may be called good, by the target's own measure.
    pub good: u64,
    started: Instant,
    pub slowest: Duration,
}

fn asked<T: std::str::FromStr>(variable: &str) -> Option<T> {
    std::env::var(variable).ok().and_then(|text| text.parse().ok())
}

/// Longer than any try takes on a busy machine.
const LONGEST: Duration = Duration::from_secs(20);

impl Run {
    /// So many tries, unless the environment asks for others.
    pub fn new(name: &'static str, tries: u64) -> Self {
        Self {
            name,
            tries,
            seconds: asked("SUPPLE_SECONDS"),
            seed: asked("SUPPLE_SEED").unwrap_or(1),
            only: asked("SUPPLE_TRY"),
            made: 0,
            good: 0,
            started: Instant::now(),
            slowest: Duration::ZERO,
        }
    }

    /// Makes the tries. `one` makes one from its random numbers, panics if a promise is broken, and tells whether the
    /// input was accepted.
    pub fn each(mut self, mut one: impl FnMut(&mut Dice) -> bool) {
        let mut number = self.only.unwrap_or(0);
        loop {
            let ends = match (self.only, self.seconds) {
                (Some(_), _) => self.made == 1,
                (_, Some(seconds)) => self.started.elapsed().as_secs_f64() >= seconds,
                (_, None) => number >= self.tries,
            };
            if ends {
                break;
            }
            let (name, seed) = (self.name, self.seed);
            let mut dice = Dice::new(seed.wrapping_mul(0x0101_0101_0101_0101) ^ number << 20);
            dice.bits();
            let start = Instant::now();
            match catch_unwind(AssertUnwindSafe(|| one(&mut dice))) {
                Ok(good) => self.good += u64::from(good),
                Err(panic) => {
                    eprintln!("{name}: SUPPLE_SEED={seed} SUPPLE_TRY={number} makes this try alone");
                    resume_unwind(panic);
                }
            }
            let taken = start.elapsed();
            self.slowest = self.slowest.max(taken);
            assert!(taken < LONGEST, "{name}: SUPPLE_SEED={seed} SUPPLE_TRY={number} took {taken:?}");
            self.made += 1;
            number += 1;
        }
        println!(
            "{}: {} tries in {:.1} s, {} accepted, the slowest took {:.1} ms",
            self.name,
            self.made,
            self.started.elapsed().as_secs_f64(),
            self.good,
            1e3 * self.slowest.as_secs_f64()
        );
    }
}

/// What changes of a text are made of, apart from numbers.
const PIECES: [&[u8]; 12] =
    [b"\0", b"\n", b"\r\n", b"\"", b"[", b"{", b"<a>", b"&amp;", b"\xff\xfe", b" ", b"-", b"= ["];
const NUMBERS: [&[u8]; 22] = [
    b"0",
    b"-1",
    b"1",
    b"2",
    b"nan",
    b"inf",
    b"-inf",
    b"1e400",
    b"-0.0",
    b"1e-320",
    b"3.5",
    b"255",
    b"65536",
    b"2147483647",
    b"-2147483648",
    b"4294967295",
    b"4294967296",
    b"9223372036854775807",
    b"-9223372036854775808",
    b"18446744073709551615",
    b"99999999999999999999",
    b"1000000000",
];

/// Some sound inputs with a few changes.
pub struct Changes<'a> {
    pub sound: &'a [Vec<u8>],
    /// Words of the format.
    pub words: &'a [&'a [u8]],
    /// Longest input.
    pub most: usize,
}

impl Changes<'_> {
    /// An input: mostly one with a few changes, seldom nothing but noise.
    pub fn input(&self, dice: &mut Dice) -> Vec<u8> {
        let mut bytes = dice.pick(self.sound).clone();
        if dice.one_in(200) {
            bytes = (0..dice.below(300)).map(|_| dice.bits() as u8).collect();
        }
        // Few more often than many: most changes end the reading where they are.
        let changes = 1 + dice.below(3) * dice.below(4);
        for _ in 0..changes {
            self.change(dice, &mut bytes);
        }
        bytes.truncate(self.most);
        bytes
    }

    fn change(&self, dice: &mut Dice, bytes: &mut Vec<u8>) {
        if bytes.is_empty() {
            bytes.push(dice.bits() as u8);
        }
        let at = dice.below(bytes.len());
        match dice.below(16) {
            0 => bytes[at] ^= 1 << dice.below(8),
            1 => bytes[at] = dice.bits() as u8,
            2..=4 => write_number(dice, bytes, at),
            5..=8 => {
                if let Some(range) = number_near(bytes, at) {
                    let number = if dice.one_in(4) {
                        dice.below(40).to_string().into_bytes()
                    } else {
                        dice.pick(&NUMBERS).to_vec()
                    };
                    bytes.splice(range, number);
                }
            }
            9 => bytes.truncate(at),
            10 => {
                let range = piece(dice, bytes);
                bytes.drain(range);
            }
            11 => {
                let range = piece(dice, bytes);
                let copy = bytes[range].to_vec();
                bytes.splice(at..at, copy);
            }
            12 => {
                let other = dice.pick(self.sound);
                let range = piece(dice, other);
                bytes.splice(at..at, other[range].to_vec());
            }
            13 => {
                let range = line_at(bytes, at);
                let line = bytes[range.clone()].to_vec();
                if dice.one_in(2) {
                    bytes.drain(range);
                }
                let to = line_at(bytes, dice.below(bytes.len())).start;
                bytes.splice(to..to, line);
            }
            14 => {
                let from = if self.words.is_empty() || dice.one_in(3) { &PIECES[..] } else { self.words };
                let word = *dice.pick(from);
                // Nesting that is deeper than a stack.
                let times = if dice.one_in(20) { 20_000 } else { 1 };
                bytes.splice(at..at, word.repeat(times));
            }
            _ => {
                let count = 1 + dice.below(16);
                let noise: Vec<u8> = (0..count).map(|_| dice.bits() as u8).collect();
                bytes.splice(at..at, noise);
            }
        }
    }
}

/// Overwrites 2, 4 or 8 bytes with a number at a limit of its type, in either byte order.
fn write_number(dice: &mut Dice, bytes: &mut [u8], at: usize) {
    let value = match dice.below(6) {
        0 => u64::from(dice.wild(1.0).to_bits()),
        1 => f64::from(dice.wild(1.0)).to_bits(),
        2 => 1u64 << dice.below(64),
        3 => (1u64 << dice.below(64)).wrapping_sub(1 + dice.below(2) as u64),
        4 => dice.below(64) as u64,
        _ => dice.bits(),
    };
    let width = *dice.pick(&[2, 4, 8]);
    let mut value = value.to_le_bytes()[..width].to_vec();
    if dice.one_in(3) {
        value.reverse();
    }
    // Numbers of binary files are mostly aligned.
    let at = if dice.one_in(2) { at } else { at - at % 4 };
    for (byte, new) in bytes[at..].iter_mut().zip(value) {
        *byte = new;
    }
}

fn piece(dice: &mut Dice, bytes: &[u8]) -> Range<usize> {
    let from = dice.below(bytes.len());
    let longest = if dice.one_in(4) { bytes.len() } else { 32 };
    from..(from + 1 + dice.below(longest)).min(bytes.len())
}

/// The next number in a text, after a place.
fn number_near(bytes: &[u8], at: usize) -> Option<Range<usize>> {
    let is_part = |byte: &u8| byte.is_ascii_digit() || b"+-.eE".contains(byte);
    let start = at + bytes[at..].iter().position(u8::is_ascii_digit)?;
    let before = bytes[..start].iter().rev().take_while(|byte| is_part(byte)).count();
    let after = bytes[start..].iter().take_while(|byte| is_part(byte)).count();
    Some(start - before..start + after)
}

fn line_at(bytes: &[u8], at: usize) -> Range<usize> {
    let start = bytes[..at.min(bytes.len())].iter().rposition(|&byte| byte == b'\n').map_or(0, |end| end + 1);
    let end = bytes[start..].iter().position(|&byte| byte == b'\n').map_or(bytes.len(), |end| start + end + 1);
    start..end
}
