//! The command `supple`.

use std::process::ExitCode;

fn main() -> ExitCode {
    supple_cli::main()
}
