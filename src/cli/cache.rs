//! `clipscape cache`: the terrain files that were built in the background.

use std::time::Duration;

use super::args::{CacheAction, CacheArgs};
use super::progress::Terminal;
use super::{Outcome, print};
use crate::error::{Error, ErrorKind};
use crate::stream::CacheFolder;

/// Runs the command.
pub(super) fn run(args: &CacheArgs, terminal: &Terminal) -> Outcome {
    let Some(folder) = CacheFolder::of_user()? else {
        let what = "the system tells of no home folder";
        let error = Error::new(ErrorKind::Io, "cache", what).advice("set CLIPSCAPE_CACHE to a folder");
        return Err(error.into());
    };
    match args.action {
        CacheAction::List => {
            let mut text = String::new();
            for file in folder.list()? {
                let age = file.used.elapsed().unwrap_or(Duration::ZERO);
                text += &format!(
                    "{:>10}  {:>8}  {}\n",
                    size(file.bytes),
                    since(age),
                    file.path.display()
                );
            }
            print(&text)
        }
        CacheAction::Clear => {
            let (count, bytes) = folder.clear()?;
            let files = if count == 1 { "file" } else { "files" };
            terminal.note(&format!(
                "{}: {count} {files} removed, {}",
                folder.path().display(),
                size(bytes)
            ));
            Ok(())
        }
    }
}

/// Bytes as a person reads them.
fn size(bytes: u64) -> String {
    match bytes {
        0..1024 => format!("{bytes} B"),
        1024..0x10_0000 => format!("{:.1} KiB", bytes as f64 / 1024.0),
        0x10_0000..0x4000_0000 => format!("{:.1} MiB", bytes as f64 / 1_048_576.0),
        _ => format!("{:.1} GiB", bytes as f64 / 1_073_741_824.0),
    }
}

/// How long ago a file was used last.
fn since(age: Duration) -> String {
    match age.as_secs() {
        s @ 0..120 => format!("{s} s ago"),
        s @ 120..7200 => format!("{} min ago", s / 60),
        s @ 7200..172_800 => format!("{} h ago", s / 3600),
        s => format!("{} d ago", s / 86_400),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_and_ages_are_short() {
        assert_eq!(
            [0, 1023, 1536, 5 << 20, 3 << 30].map(size),
            ["0 B", "1023 B", "1.5 KiB", "5.0 MiB", "3.0 GiB"]
        );
        assert_eq!(
            [5, 600, 10_000, 400_000].map(|s| since(Duration::from_secs(s))),
            ["5 s ago", "10 min ago", "2 h ago", "4 d ago"]
        );
    }
}
