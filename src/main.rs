//! The command line program: all of it is in `cli`.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(clipscape::cli::run(std::env::args_os()))
}
