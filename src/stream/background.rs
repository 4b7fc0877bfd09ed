//! Building a DEM's terrain file while it is flown over, by the same code as `preprocess`: first heights and bounds, which
//! replace the draft as soon as they are there, then the same with light.

use std::fs;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use super::cache_folder::{CacheFolder, Fingerprint};
use super::stage::{Current, Stage};
use super::{READER_BYTES, TileOptions};
use crate::build::{PreprocessOptions, preprocess};
use crate::error::{Error, ErrorKind, Result};
use crate::light::LightOptions;
use crate::progress::Progress;
use crate::source::{self, HeightSource};
use crate::terrain::TerrainFile;

/// How long the first frame has the processors for itself.
const HEAD_START: Duration = Duration::from_millis(1500);

/// What a background build is told.
pub(super) struct Plan {
    pub(super) source: Arc<dyn HeightSource>,
    pub(super) fingerprint: Fingerprint,
    /// Where the file is kept; none keeps none.
    pub(super) folder: Option<CacheFolder>,
    /// Whether the file there has all but light.
    pub(super) has_heights: bool,
    pub(super) light: LightOptions,
    pub(super) tiles: TileOptions,
    pub(super) memory_bytes: u64,
}

/// A build on a thread of its own.
pub(super) struct Background {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Default)]
struct Shared {
    cancelled: AtomicBool,
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
struct State {
    /// Whether somebody waits for it.
    hurry: bool,
    /// Whether heights are there, or will never be.
    heights_done: bool,
    warnings: Vec<String>,
}

impl Background {
    /// Starts building; what is done is put in the place of `current`.
    pub(super) fn start(plan: Plan, current: Arc<Current>) -> Self {
        let shared = Arc::new(Shared::default());
        let theirs = shared.clone();
        let work = move || {
            theirs.give_a_start();
            if let Err(error) = build(&plan, &current, &theirs)
                && error.kind() != ErrorKind::Cancelled
            {
                let stays = if theirs.lock().heights_done {
                    "it is drawn without traced light"
                } else {
                    "what was drawn stays provisional"
                };
                theirs.warn(&format!("{error}; {stays}"));
            }
            theirs.heights_done();
        };
        let thread = std::thread::Builder::new()
            .name("clipscape build".into())
            .spawn(work);
        if let Err(error) = &thread {
            shared.warn(&format!("nothing can be built in the background: {error}"));
            shared.heights_done();
        }
        Self {
            shared,
            thread: thread.ok(),
        }
    }

    /// Waits until heights are there, or cannot be built, or `progress` cancels.
    ///
    /// # Errors
    /// [`ErrorKind::Cancelled`].
    pub(super) fn wait_for_heights(&self, progress: &dyn Progress) -> Result<()> {
        let mut state = self.shared.lock();
        state.hurry = true;
        self.shared.changed.notify_all();
        while !state.heights_done {
            if progress.cancelled() {
                return Err(Error::cancelled("the terrain file"));
            }
            let short = Duration::from_millis(50);
            state = self
                .shared
                .changed
                .wait_timeout(state, short)
                .unwrap_or_else(PoisonError::into_inner)
                .0;
        }
        Ok(())
    }

    /// Whether it has come to its end.
    pub(super) fn is_done(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Takes what it has to say.
    pub(super) fn take_warnings(&self) -> Vec<String> {
        std::mem::take(&mut self.shared.lock().warnings)
    }
}

impl Drop for Background {
    fn drop(&mut self) {
        self.shared.cancelled.store(true, Ordering::Relaxed);
        self.shared.lock().hurry = true;
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            // It has said what there was to say.
            let _ = thread.join();
        }
    }
}

impl Shared {
    fn lock(&self) -> std::sync::MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Lets the first frame have the processors, unless somebody waits for what is to be built.
    fn give_a_start(&self) {
        let waits = |state: &mut State| !state.hurry;
        drop(
            self.changed
                .wait_timeout_while(self.lock(), HEAD_START, waits)
                .unwrap_or_else(PoisonError::into_inner),
        );
    }

    fn heights_done(&self) {
        self.lock().heights_done = true;
        self.changed.notify_all();
    }
}

impl Progress for Shared {
    fn warn(&self, sentence: &str) {
        let mut state = self.lock();
        if !state.warnings.iter().any(|w| w == sentence) {
            state.warnings.push(sentence.into());
        }
    }

    fn cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }
}

fn build(plan: &Plan, current: &Current, shared: &Shared) -> Result<()> {
    let description = plan.source.description();
    for remark in plan.source.remarks(shared)? {
        shared.warn(&format!("{}: {remark}", description.name));
    }
    let mut folder = plan.folder.clone();
    for light in [None, Some(plan.light)] {
        // Where the heights are in the folder from an earlier run, only the light is to be made.
        if light.is_none() && plan.has_heights {
            shared.heights_done();
            continue;
        }
        let path = match make(plan, folder.as_ref(), light, shared) {
            // A folder that cannot be written to, or a disk that is full, is no reason to show a draft for ever.
            Err(error) if folder.is_some() && error.kind() == ErrorKind::Io => {
                shared.warn(&format!("{error}; nothing is kept for the next run"));
                folder = None;
                make(plan, None, light, shared)?
            }
            made => made?,
        };
        let name = description.name.clone();
        let file = TerrainFile::open(&name, source::open_file(&path)?)?.with_cache(READER_BYTES);
        match &folder {
            Some(folder) => folder.make_room(&path, shared),
            // Who has it open goes on reading it.
            None => drop(fs::remove_file(&path)),
        }
        current.replace(Stage::of_file(file, &plan.tiles));
        shared.heights_done();
    }
    Ok(())
}

/// Makes the file, in the folder or where temporary files are.
fn make(
    plan: &Plan,
    folder: Option<&CacheFolder>,
    light: Option<LightOptions>,
    shared: &Shared,
) -> Result<PathBuf> {
    let path = match folder {
        Some(folder) => {
            folder.create()?;
            folder.path_of(&plan.fingerprint)
        }
        None => {
            let name = format!(
                "clipscape-{}-{}",
                std::process::id(),
                plan.fingerprint.file_name()
            );
            std::env::temp_dir().join(name)
        }
    };
    let options = PreprocessOptions {
        light,
        force: true,
        source: plan.fingerprint.stamp(),
        memory_bytes: plan.memory_bytes,
        ..Default::default()
    };
    preprocess(plan.source.as_ref(), &path, &options, shared)?;
    if !plan.fingerprint.is_current() {
        drop(fs::remove_file(&path));
        let what = "has changed while it was read";
        return Err(Error::new(ErrorKind::Broken, &plan.fingerprint.name, what).advice("start again"));
    }
    Ok(path)
}
