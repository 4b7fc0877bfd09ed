//! How long work reports what it has done, warns, and learns that it is no longer wanted.

/// Receives progress and warnings, and may cancel. All methods have harmless defaults.
pub trait Progress: Sync {
    /// A stage begins; it will advance by `total` steps in all.
    fn begin(&self, stage: &str, total: u64) {
        let _ = (stage, total);
    }

    /// The stage has advanced by `steps` more.
    fn advance(&self, steps: u64) {
        let _ = steps;
    }

    /// Something that the user should know, as one sentence.
    fn warn(&self, sentence: &str) {
        let _ = sentence;
    }

    /// Whether the caller wants the work to stop; it then ends with [`crate::ErrorKind::Cancelled`].
    fn cancelled(&self) -> bool {
        false
    }
}

/// Reports nothing and never cancels.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {}
