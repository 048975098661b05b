//! The command `celaje`: see the library `celaje_cli`.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(celaje_cli::run(std::env::args_os()))
}
