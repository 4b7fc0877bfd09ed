//! What may be typed after `cache`.

use clap::{Args, Subcommand};

/// List or clear the terrain files that were built in the background, in CLIPSCAPE_CACHE or the user's cache folder.
#[derive(Debug, Args)]
pub(in crate::cli) struct CacheArgs {
    #[command(subcommand)]
    pub(in crate::cli) action: CacheAction,

    /// Show no notes
    #[arg(long, short, global = true)]
    pub(in crate::cli) quiet: bool,
}

#[derive(Clone, Copy, Debug, Subcommand)]
pub(in crate::cli) enum CacheAction {
    /// Print size, last use and path of each, the last used first
    List,
    /// Remove them all
    Clear,
}
