//! A flight drawn into files: a picture a frame, and on request a contact sheet and an animation.

use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::headless::{Frame, Headless};
use super::pictures::{Animation, ContactSheet, write_png};
use crate::build::{Output, refuse_existing};
use crate::camera::{Camera, Flight};
use crate::error::{Error, ErrorKind, Result};
use crate::levels::Levels;
use crate::progress::Progress;
use crate::stats::FrameStats;

/// The most small frames on a contact sheet.
const SHEET_FRAMES: u32 = 25;

/// What a flight is drawn into.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recording {
    /// The folder of the frames, made where it is missing: `00000.png` and on, by the flight's numbers.
    pub folder: PathBuf,
    /// The frames drawn; none stands for all of the flight's.
    pub frames: Option<Range<u64>>,
    /// A picture of up to 25 small frames.
    pub contact_sheet: Option<PathBuf>,
    /// An animated PNG of small frames.
    pub animation: Option<PathBuf>,
    /// Whether files that exist are replaced.
    pub force: bool,
}

impl Recording {
    /// Draws `flight` over `levels`, and reports each frame.
    ///
    /// Frames that were written stay where a later one fails; the contact sheet and the animation appear whole or not.
    ///
    /// # Errors
    /// Those of [`Recording::check`], before anything is drawn; those of drawing and writing;
    /// [`ErrorKind::Cancelled`].
    pub fn record(
        &self,
        headless: &mut Headless,
        levels: &dyn Levels,
        flight: &Flight,
        progress: &dyn Progress,
    ) -> Result<Vec<FrameStats>> {
        let frames = self.check(flight)?;
        fs::create_dir_all(&self.folder).map_err(|e| folder_error(&self.folder, e))?;
        let [width, height] = headless.size_px();
        if let Some(path) = &self.contact_sheet {
            // It is written last: whether it can be is better known first.
            drop(Output::create(path, self.force)?);
        }
        let count = frames.end - frames.start;
        let mut sheet = self
            .contact_sheet
            .as_ref()
            .map(|_| ContactSheet::new(count, SHEET_FRAMES, width, height));
        let mut animation = match &self.animation {
            Some(path) => {
                let most = u32::try_from(count).map_err(|_| {
                    Error::new(
                        ErrorKind::Limit,
                        path.display(),
                        format!("{count} frames are too many for an animation"),
                    )
                })?;
                Some(Animation::create(path, most, width, height, flight.fps())?)
            }
            None => None,
        };
        progress.begin("frames", count);
        let mut stats = Vec::new();
        for k in frames.clone() {
            if progress.cancelled() {
                return Err(Error::cancelled(self.folder.display()));
            }
            let camera = flight.camera_at_frame(k);
            if let Some(hour) = flight.sun_hour_at(flight.time_of_frame_s(k)) {
                let time = headless.day().map_or(0.0, |day| day.time_of_hour(hour));
                headless.set_time_of_day(time)?;
            }
            let frame = headless.frame(levels, &camera, flight.time_of_frame_s(k))?;
            write_png(&self.picture(k), width, height, &frame.rgba8)?;
            if let Some(sheet) = sheet.as_mut().filter(|s| s.wants(k - frames.start)) {
                sheet.add(k - frames.start, &frame.rgba8)?;
            }
            if let Some(animation) = &mut animation {
                animation.add(&frame.rgba8)?;
            }
            stats.push(frame_stats(
                &frame,
                headless,
                k,
                flight.time_of_frame_s(k),
                &camera,
            ));
            progress.advance(1);
        }
        if let (Some(sheet), Some(path)) = (&sheet, &self.contact_sheet) {
            sheet.write(path)?;
        }
        if let Some(animation) = animation {
            animation.finish()?;
        }
        Ok(stats)
    }

    /// The frames to draw, once nothing stands in their way; for whoever wants to know before a long preparation.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] for frames that the flight does not have and for files that exist.
    pub fn check(&self, flight: &Flight) -> Result<Range<u64>> {
        let all = 0..flight.frame_count();
        let frames = self.frames.clone().unwrap_or_else(|| all.clone());
        if frames.is_empty() || frames.end > all.end {
            let what = format!(
                "frames {}..{} are not in a flight of {}",
                frames.start, frames.end, all.end
            );
            return Err(Error::new(ErrorKind::Misuse, "frames", what)
                .advice(format!("name a range within 0..{}, its end excluded", all.end)));
        }
        if !self.force {
            let pictures = frames.clone().map(|k| self.picture(k));
            let others = [&self.contact_sheet, &self.animation]
                .into_iter()
                .flatten()
                .cloned();
            for path in pictures.chain(others) {
                refuse_existing(&path)?;
            }
        }
        Ok(frames)
    }

    fn picture(&self, k: u64) -> PathBuf {
        self.folder.join(format!("{k:05}.png"))
    }
}

/// Draws one picture of `levels` into `path`, and reports it as frame 0.
///
/// # Errors
/// [`ErrorKind::Misuse`] where `path` exists and may not be replaced; those of drawing and writing;
/// [`ErrorKind::Cancelled`] once the frame is drawn.
pub fn picture(
    path: &Path,
    force: bool,
    headless: &mut Headless,
    levels: &dyn Levels,
    camera: &Camera,
    progress: &dyn Progress,
) -> Result<FrameStats> {
    if !force {
        refuse_existing(path)?;
    }
    let frame = headless.frame(levels, camera, 0.0)?;
    if progress.cancelled() {
        return Err(Error::cancelled(path.display()));
    }
    let [width, height] = headless.size_px();
    write_png(path, width, height, &frame.rgba8)?;
    Ok(frame_stats(&frame, headless, 0, 0.0, camera))
}

fn folder_error(folder: &Path, error: std::io::Error) -> Error {
    if folder.exists() {
        return Error::new(ErrorKind::Misuse, folder.display(), "is no folder")
            .advice("name a folder for the frames");
    }
    Error::io(folder.display(), error)
}

fn frame_stats(frame: &Frame, headless: &Headless, k: u64, t_s: f64, camera: &Camera) -> FrameStats {
    let max_error_px = headless.clipmap().max_error_px();
    let errors = frame.measured.as_ref().map(|m| m.errors.summary);
    FrameStats {
        frame: k,
        t_s,
        eye: camera.eye.to_array(),
        plan_ms: frame.plan_ms,
        certify_ms: frame.certify_ms,
        upload_ms: frame.upload_ms,
        draw_ms: frame.draw_ms,
        gpu_ms: frame.gpu_ms,
        frame_ms: frame.frame_ms,
        triangles: frame.draw.triangles,
        draw_calls: frame.draw.draw_calls,
        patches: frame.update.patches,
        patches_culled: frame.update.patches_culled,
        levels_drawn: frame.update.levels_drawn,
        uploads: frame.upload.uploads,
        upload_bytes: frame.upload.bytes,
        upload_bytes_exposed: frame.update.upload_bytes_exposed,
        complete: frame.update.complete,
        cut: frame.update.cut,
        stale_levels: frame.update.stale_levels,
        pops: frame.update.pops,
        provisional: frame.update.provisional,
        error_px_max: errors.map(|e| e.error_px_max),
        error_px_p99: errors.map(|e| e.error_px_p99),
        error_px_rms: errors.map(|e| e.error_px_rms),
        error_m_max: errors.map(|e| e.error_m_max),
        error_floor_px: errors.map(|e| e.error_floor_px),
        cracks: frame.measured.as_ref().map(|m| m.cracks),
        beside_px: errors.map(|e| e.beside_px),
        silhouette_px: errors.map(|e| e.silhouette_px),
        certified_error_px: frame.certificate.and_then(|c| c.error_px.ok()),
        certificate_reason: frame
            .certificate
            .and_then(|c| c.error_px.err())
            .map(|u| u.reason().to_string()),
        max_error_px,
        keeps_max_error: max_error_px.and_then(|px| frame.certificate.map(|c| c.keeps(px))),
    }
}
