//! The command `supple-lab`: judge methods against the exact step, elements against nature, guards against hard cases,
//! and train networks. Exit codes are those of `supple`.

use std::process::ExitCode;

use supple_cli::screen;

fn main() -> ExitCode {
    screen::ended(supple_lab::command::run(std::env::args_os()))
}
