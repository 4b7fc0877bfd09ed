//! The command line program: one file a command. Results go to standard output, everything else to standard
//! error, an error as one line: `clipscape: SUBJECT: what is wrong; what to do`.

mod args;
mod cache;
#[cfg(feature = "dem")]
mod export;
#[cfg(feature = "window")]
mod fly;
mod info;
mod input;
#[cfg(feature = "gpu")]
mod measure;
#[cfg(feature = "gpu")]
mod measure_depth;
mod preprocess;
mod progress;
#[cfg(feature = "gpu")]
mod render;
#[cfg(feature = "gpu")]
mod shots;
mod suspects;
#[cfg(feature = "dem")]
mod synth;
mod values;
#[cfg(feature = "gpu")]
mod view_values;

use std::ffi::OsString;
use std::io::{self, Write};

use clap::Parser;
use clap::error::{ContextKind, ContextValue};

use self::args::{Cli, Command};
use self::progress::Terminal;
use crate::error::{Error, ErrorKind};

/// Exit status of a program that did what it was asked.
pub const DONE_STATUS: u8 = 0;
/// Exit status where it could not.
pub const FAILED_STATUS: u8 = 1;
/// Exit status where it was not told clearly what to do.
pub const USAGE_STATUS: u8 = 2;
/// Exit status after Ctrl-C.
pub const INTERRUPTED_STATUS: u8 = 130;

/// Runs the program with `arguments`, the first of which is its own name, and returns its exit status.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    let cli = match Cli::try_parse_from(arguments) {
        Ok(cli) => cli,
        Err(error) if error.use_stderr() => {
            say(&usage_line(&error));
            return USAGE_STATUS;
        }
        Err(help) => return status(print(&help.render().to_string())),
    };
    progress::catch_interrupts();
    status(match cli.command {
        Command::Info(args) => info::run(&args, &Terminal::new(args.quiet)),
        Command::Preprocess(args) => preprocess::run(&args, &Terminal::new(args.quiet)),
        #[cfg(feature = "gpu")]
        Command::Render(args) => render::run(&args, &Terminal::new(args.quiet)),
        #[cfg(feature = "window")]
        Command::Fly(args) => fly::run(&args, &Terminal::new(args.quiet)),
        #[cfg(feature = "gpu")]
        Command::Measure(args) => measure::run(&args, &Terminal::new(args.quiet)),
        Command::Cache(args) => cache::run(&args, &Terminal::new(args.quiet)),
        #[cfg(feature = "dem")]
        Command::Export(args) => export::run(&args, &Terminal::new(args.quiet)),
        #[cfg(feature = "dem")]
        Command::Synth(args) => synth::run(&args, &Terminal::new(args.quiet)),
    })
}

/// Why a command ended early.
#[derive(Debug)]
enum Failure {
    /// Something is wrong: it is said in one line.
    Error(Error),
    /// Flags that do not go together: it is said in one line.
    #[cfg(feature = "gpu")]
    Usage(Error),
    /// All has been said already.
    Said,
    /// Whoever read standard output has stopped reading, which is their right.
    BrokenPipe,
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Self::Error(error)
    }
}

/// What a command ends with.
type Outcome = Result<(), Failure>;

fn status(outcome: Outcome) -> u8 {
    match outcome {
        Ok(()) | Err(Failure::BrokenPipe) => DONE_STATUS,
        Err(Failure::Said) => FAILED_STATUS,
        #[cfg(feature = "gpu")]
        Err(Failure::Usage(error)) => {
            say(&error.to_string());
            USAGE_STATUS
        }
        Err(Failure::Error(error)) => {
            say(&error.to_string());
            if error.kind() == ErrorKind::Cancelled {
                INTERRUPTED_STATUS
            } else {
                FAILED_STATUS
            }
        }
    }
}

/// One line on standard error. Where even that is closed, nobody is left to be told.
fn say(line: &str) {
    let _ = writeln!(io::stderr(), "clipscape: {line}");
}

/// Results on standard output.
fn print(text: &str) -> Outcome {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Ok(()) => Ok(()),
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Err(Failure::BrokenPipe),
        Err(error) => Err(Error::io("standard output", error).into()),
    }
}

/// The parser's complaint as one line: what is wrong, the nearest name where there is one, where to read on.
fn usage_line(error: &clap::Error) -> String {
    if error.kind() == clap::error::ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        return "no command is given; see clipscape --help".into();
    }
    let text = error.render().to_string();
    let lines = text
        .lines()
        .map(str::trim)
        .take_while(|line| !line.starts_with("Usage:"));
    let what: Vec<&str> = lines
        .filter(|line| !line.is_empty() && !line.starts_with("tip:"))
        .collect();
    let what = what.join(" ");
    let what = what
        .strip_prefix("error: ")
        .unwrap_or(&what)
        .trim_end_matches("For more information, try '--help'.");
    let near = [
        ContextKind::SuggestedArg,
        ContextKind::SuggestedSubcommand,
        ContextKind::SuggestedValue,
    ]
    .iter()
    .find_map(|kind| match error.get(*kind)? {
        ContextValue::String(name) => Some(name.clone()),
        ContextValue::Strings(names) => names.first().cloned(),
        _ => None,
    });
    match near {
        Some(name) => format!("{}; did you mean {name}?", what.trim()),
        None => format!("{}; see --help", what.trim()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn usage(line: &str) -> String {
        usage_line(&Cli::try_parse_from(line.split_whitespace()).unwrap_err())
    }

    #[test]
    fn complaints_are_one_line_and_name_what_is_near() {
        for (line, says) in [
            ("clipscape", "no command is given; see clipscape --help"),
            (
                "clipscape inof a.tif",
                "unrecognized subcommand 'inof'; did you mean info?",
            ),
            (
                "clipscape info --jsno a.tif",
                "unexpected argument '--jsno' found; did you mean --json?",
            ),
            (
                "clipscape info",
                "the following required arguments were not provided: <INPUT>...; see --help",
            ),
            (
                "clipscape preprocess a.tif --sun 0,99",
                "invalid value '0,99' for '--sun <AZIMUTH,ALTITUDE>': the altitude is outside of -90 to 90 degrees; \
                 see --help",
            ),
        ] {
            assert_eq!(usage(line), says);
        }
    }
}
