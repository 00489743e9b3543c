//! What commands print: results on standard output, progress and warnings on standard error.
//!
//! `println!` panics where nobody reads it any more (`supple inspect FILE | head`) or the disk is full. Here the first
//! failure of standard output is kept for the end and no more is written to it: files, warnings and the exit code do
//! not depend on who reads the table. Without a reader the command says nothing of it and ends with the code of the
//! signal that ends other programs then.

use std::fmt::Display;
use std::io::{self, ErrorKind, Write as _};
use std::process::ExitCode;
use std::sync::OnceLock;

use crate::problem::{End, Problem};

/// The first failure of standard output.
static FAILURE: OnceLock<io::Error> = OnceLock::new();
/// 128 and the number of SIGPIPE, as shells have it.
const NO_READER: u8 = 141;

/// Prints a line on standard output.
#[macro_export]
macro_rules! output {
    ($($argument:tt)*) => {
        $crate::screen::print(format_args!("{}\n", format_args!($($argument)*)))
    };
}

/// Prints a line on standard error.
#[macro_export]
macro_rules! message {
    ($($argument:tt)*) => {
        $crate::screen::print_message(format_args!($($argument)*))
    };
}

pub use crate::{message, output};

/// Prints text that ends its lines itself.
pub fn print(text: impl Display) {
    if FAILURE.get().is_none()
        && let Err(error) = write!(io::stdout().lock(), "{text}")
    {
        let _ = FAILURE.set(error);
    }
}

pub fn print_message(text: impl Display) {
    // There is no other place to complain.
    let _ = writeln!(io::stderr().lock(), "{text}");
}

/// Tells how a command ended; gives its exit code.
pub fn ended(done: Result<End, Problem>) -> ExitCode {
    match done {
        Ok(End::Reached) => exit_code(),
        Ok(End::Diverged(divergence)) => {
            message!("error: the simulation {divergence}; the results end before that");
            ExitCode::from(3)
        }
        Err(problem) => {
            message!("error: {problem}");
            ExitCode::from(2)
        }
    }
}

/// The exit code of a command that did as asked.
fn exit_code() -> ExitCode {
    match FAILURE.get() {
        None => ExitCode::SUCCESS,
        Some(error) if error.kind() == ErrorKind::BrokenPipe => ExitCode::from(NO_READER),
        Some(error) => {
            message!("error: standard output: cannot be written: {error}");
            ExitCode::from(2)
        }
    }
}

/// Prints a row: what it is and its value.
pub(crate) fn row(name: &str, value: impl Display) {
    output!("{name:<21} {value}");
}
