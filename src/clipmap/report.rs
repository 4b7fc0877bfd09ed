//! What an update of a clipmap did.

/// What an update did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct UpdateReport {
    /// Rectangles to upload.
    pub uploads: u64,
    /// Their bytes.
    pub upload_bytes: u64,
    /// The bytes that the windows' moves exposed, computed from the windows alone.
    pub upload_bytes_exposed: u64,
    /// Patches drawn.
    pub patches: u64,
    /// Subtrees of patches that were dropped because they are not seen.
    pub patches_culled: u64,
    /// Triangles drawn.
    pub triangles: u64,
    /// Levels of which something is drawn.
    pub levels_drawn: u32,
    /// Whether all data that the frame should show are there, and have faded in.
    pub complete: bool,
    /// Levels of which something is drawn coarser than it would be if its data had been there in time.
    pub stale_levels: u32,
    /// Patches whose detail vanished at once, because their data came too late to be taken back gently.
    pub pops: u64,
    /// Whether coarser levels were left out by [`ClipmapOptions::levels`](super::ClipmapOptions::levels), so that the picture ends at a border.
    pub cut: bool,
    /// Whether some of what is resident stands in for data that are not there yet.
    pub provisional: bool,
}
