//! What `render` says of frames that are not what one might take them for.

use crate::cli::args::RenderArgs;
use crate::cli::progress::Terminal;
use crate::error::Error;
use crate::progress::Progress as _;
use crate::stats::FrameStats;
use crate::stream::Terrain;

/// Faults of data that are said one by one.
const SHOWN_FAULTS: usize = 4;

pub(super) fn warn_of_sun(args: &RenderArgs, terrain: &Terrain, terminal: &Terminal) {
    let other = |sun| args.view.sun.is_some_and(|asked| asked != sun);
    if terrain.sun().is_some_and(other) {
        terminal.warn(&format!(
            "{}: its light is traced already, so --sun changes nothing; preprocess the DEM with --sun instead",
            terrain.name()
        ));
    }
}

/// Says how far frames that do not keep the promised error are from it.
fn warn_of_promise(frames: &[FrameStats], terminal: &Terminal) {
    let broken: Vec<_> = frames
        .iter()
        .filter(|f| f.keeps_max_error == Some(false))
        .collect();
    let Some(first) = broken.first() else { return };
    let promised = first.max_error_px.unwrap_or_default();
    let worst = broken
        .iter()
        .try_fold(0.0, |most: f64, f| f.certified_error_px.map(|px| most.max(px)));
    let certified = match worst {
        Some(px) => format!("at most {px:.3} px is certified instead"),
        None => "for some nothing can be certified".to_string(),
    };
    terminal.warn(&format!(
        "{} of {} frames do not keep {promised} px, from frame {} on: {certified}; a greater --clip-size keeps more",
        broken.len(),
        frames.len(),
        first.frame
    ));
}

/// Says what is wrong with the data, and where it is much, how much.
pub(super) fn warn_of_faults(faults: &[String], terminal: &Terminal) {
    for fault in faults.iter().take(SHOWN_FAULTS) {
        terminal.warn(fault);
    }
    if faults.len() > SHOWN_FAULTS {
        let more = faults.len() - SHOWN_FAULTS;
        terminal.warn(&format!(
            "{more} more faults like these; see clipscape info --verify"
        ));
    }
}

/// What faults say, each once: ground that is met again is damaged still.
pub(super) fn distinct(faults: impl Iterator<Item = Error>) -> Vec<String> {
    let mut texts = Vec::new();
    for text in faults.map(|f| f.to_string()) {
        if !texts.contains(&text) {
            texts.push(text);
        }
    }
    texts
}

/// Says where frames show less than all there is.
pub(super) fn warn_of_frames(frames: &[FrameStats], terrain: &Terrain, terminal: &Terminal) {
    warn_of_promise(frames, terminal);
    if frames.iter().all(|f| f.patches == 0) {
        terminal.warn(&format!("{}: no terrain is seen", terrain.name()));
    } else if frames.iter().any(|f| f.cut) {
        terminal.warn("coarser levels are left out, so the terrain ends at a border; see --levels");
    }
    if frames.iter().any(|f| f.provisional) {
        terminal.warn("some frames are drafts: the terrain file was not built yet");
    } else if frames.iter().any(|f| !f.complete) {
        terminal.warn("some frames were drawn before all of their data were there; see --wait");
    }
}
