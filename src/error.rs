//! One error type: its kind by who must act, the subject, what was found, advice, and the source.

use std::fmt::{self, Write as _};
use std::sync::Arc;

/// A result whose error is this crate's [`Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Who must act on an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ErrorKind {
    /// The input is damaged or is not what its name says: its owner must mend it.
    Broken,
    /// The input is valid, but this crate does not read that kind of it.
    Unsupported,
    /// A limit of memory or size is exceeded: raise it, or ask for less.
    Limit,
    /// The caller asked for something that makes no sense (a clip size of 100, a NaN position).
    Misuse,
    /// The operating system refused: missing file, permission, full disk.
    Io,
    /// No graphics adapter, or the adapter failed.
    Device,
    /// The caller cancelled the work.
    Cancelled,
}

/// What went wrong: a subject (a file, an option), what was found there, and what to do about it.
///
/// Displayed as one line, `subject: what; advice`.
#[derive(Clone, Debug)]
pub struct Error {
    kind: ErrorKind,
    subject: String,
    what: String,
    advice: String,
    source: Option<Arc<dyn std::error::Error + Send + Sync>>,
}

impl Error {
    /// An error of `kind` about `subject` (a path, an option, a part of a file): `what` is wrong.
    pub fn new(kind: ErrorKind, subject: impl fmt::Display, what: impl fmt::Display) -> Self {
        Self {
            kind,
            subject: subject.to_string(),
            what: what.to_string(),
            advice: String::new(),
            source: None,
        }
    }

    /// The same error with a hint of what to do about it.
    #[must_use]
    pub fn advice(mut self, advice: impl fmt::Display) -> Self {
        self.advice = advice.to_string();
        self
    }

    /// The same error with its cause; the cause's text is not part of the displayed line.
    #[must_use]
    pub fn because(mut self, source: impl std::error::Error + Send + Sync + 'static) -> Self {
        self.source = Some(Arc::new(source));
        self
    }

    /// The same error about another subject: a reader that knows only bytes is given the file's name.
    #[must_use]
    pub fn about(mut self, subject: impl fmt::Display) -> Self {
        self.subject = subject.to_string();
        self
    }

    /// The operating system's refusal while doing something with `subject`.
    pub fn io(subject: impl fmt::Display, error: std::io::Error) -> Self {
        let kind = match error.kind() {
            std::io::ErrorKind::UnexpectedEof | std::io::ErrorKind::InvalidData => ErrorKind::Broken,
            std::io::ErrorKind::Unsupported => ErrorKind::Unsupported,
            _ => ErrorKind::Io,
        };
        let (what, advice) = match error.kind() {
            std::io::ErrorKind::NotFound => ("no such file or folder".into(), "check the path"),
            std::io::ErrorKind::PermissionDenied => ("permission denied".into(), "choose another place"),
            std::io::ErrorKind::StorageFull => ("the disk is full".into(), "free some space"),
            std::io::ErrorKind::NotADirectory => (
                "a part of its path is a file, not a folder".into(),
                "choose another place",
            ),
            std::io::ErrorKind::IsADirectory => ("is a folder".into(), "name a file"),
            std::io::ErrorKind::UnexpectedEof => ("ends too early".into(), "fetch the file again"),
            _ => (error.to_string(), ""),
        };
        let what: String = what;
        Self::new(kind, subject, what).advice(advice).because(error)
    }

    /// The caller cancelled.
    pub fn cancelled(subject: impl fmt::Display) -> Self {
        Self::new(ErrorKind::Cancelled, subject, "interrupted")
    }

    /// Who must act.
    pub fn kind(&self) -> ErrorKind {
        self.kind
    }

    /// What was found there, without subject and advice.
    pub fn what(&self) -> &str {
        &self.what
    }

    /// What the error is about.
    pub fn subject(&self) -> &str {
        &self.subject
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // One line, whatever a library's message or a file's name contains.
        let mut line = format!("{}: {}", self.subject, self.what);
        if !self.advice.is_empty() {
            line.push_str("; ");
            line.push_str(&self.advice);
        }
        for c in line.chars() {
            f.write_char(if c.is_control() { ' ' } else { c })?;
        }
        Ok(())
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.source.as_ref().map(|s| s.as_ref() as _)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_is_one_line_with_its_advice_and_keeps_its_cause() {
        let cause = std::io::Error::from(std::io::ErrorKind::NotFound);
        let error = Error::io("a\nb.tif", cause);
        assert_eq!(error.kind(), ErrorKind::Io);
        assert_eq!(
            error.to_string(),
            "a b.tif: no such file or folder; check the path"
        );
        assert!(std::error::Error::source(&error).is_some());
    }
}
