//! A DEM that is flown at once: a draft first, then its terrain file, which the next run opens.

mod support;

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use clipscape::clipmap::{Clipmap, ClipmapOptions, Uncertified, Wait, certify};
use clipscape::levels::Levels;
use clipscape::light::LightOptions;
use clipscape::progress::{Progress, Silent};
use clipscape::source::OpenOptions;
use clipscape::stream::{AtOnce, CacheFolder, Terrain};
use glam::DVec3;
use support::facts;
use support::flights::{garbage, view};

const DEM: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/data/N42E001.hgt");

const OPTIONS: ClipmapOptions = ClipmapOptions {
    clip_size: 128,
    levels: None,
    transition: None,
    vertical_scale: 1.0,
    cull: false,
    occlusion: true,
    max_error_px: None,
    wait: Wait::None,
    upload_budget_bytes: None,
    day: false,
};

/// Keeps what is said.
#[derive(Default)]
struct Said(std::sync::Mutex<Vec<String>>);

impl Progress for Said {
    fn warn(&self, sentence: &str) {
        self.0.lock().unwrap().push(sentence.into());
    }
}

impl Said {
    fn take(&self) -> Vec<String> {
        std::mem::take(&mut self.0.lock().unwrap())
    }
}

fn at_once(folder: Option<&Path>) -> AtOnce {
    AtOnce {
        folder: folder.map(|f| CacheFolder::new(f, 1 << 30)),
        light: LightOptions {
            sky_directions: 0,
            ..Default::default()
        },
        ..Default::default()
    }
}

fn open(folder: Option<&Path>, progress: &dyn Progress) -> Terrain {
    Terrain::open_at_once(&[DEM], &OpenOptions::default(), &at_once(folder), progress).unwrap()
}

fn spot() -> clipscape::View {
    view(DVec3::new(14_000.0, 2600.0, 17_000.0))
}

/// Draws until what is drawn is final, with light if it is to have some; the frames until then.
fn fly_until_final(terrain: &Terrain, light: bool) -> (Clipmap, u32) {
    let arriving = terrain.arriving();
    let mut clipmap = Clipmap::new(&arriving, &OPTIONS).unwrap();
    let start = Instant::now();
    let mut drafts = 0;
    for k in 0.. {
        let report = *clipmap.update(&arriving, &spot(), f64::from(k) / 30.0).unwrap();
        let faults = facts::faults(&clipmap, &clipmap);
        assert!(
            faults.is_empty(),
            "frame {k}: {:?}",
            &faults[..faults.len().min(3)]
        );
        assert!(report.patches > 0);
        let certified = certify(&clipmap).unwrap().error_px;
        assert_eq!(report.provisional, certified == Err(Uncertified::Provisional));
        assert!(!report.provisional || !report.complete);
        drafts += u32::from(report.provisional);
        if report.complete && (!light || clipmap.has_light()) {
            break;
        }
        assert!(start.elapsed() < Duration::from_secs(120), "it stays a draft");
        std::thread::sleep(Duration::from_millis(5));
    }
    (clipmap, drafts)
}

#[test]
fn a_dem_whose_light_does_not_fit_is_drawn_without() {
    let options = AtOnce {
        memory_bytes: 90 << 20,
        ..at_once(None)
    };
    let terrain = Terrain::open_at_once(&[DEM], &OpenOptions::default(), &options, &Silent).unwrap();
    let (clipmap, _) = fly_until_final(&terrain, false);
    let start = Instant::now();
    while terrain.is_building() {
        assert!(start.elapsed() < Duration::from_secs(120), "it has no end");
        std::thread::sleep(Duration::from_millis(5));
    }
    let said = terrain.take_warnings();
    assert!(!terrain.is_provisional() && !terrain.has_light() && !clipmap.has_light());
    assert!(
        said.len() == 1 && said[0].ends_with("; it is drawn without traced light"),
        "{said:?}"
    );
}

#[test]
fn a_draft_becomes_the_terrain_that_the_next_run_opens() {
    let folder = tempfile::tempdir().unwrap();
    let cache = folder.path().join("made/as needed");
    let said = Said::default();
    let terrain = open(Some(&cache), &said);
    assert!(terrain.is_provisional() && terrain.is_building() && !terrain.has_light());
    let lines = said.take();
    let path = CacheFolder::new(&cache, 0).path().display().to_string();
    assert!(lines.len() == 1 && lines[0].contains(&path), "{lines:?}");
    let truth = Terrain::open(DEM, &Silent).unwrap();
    // Nowhere is a hole where the DEM has data.
    let rect = truth.grid().size.rect();
    let (mut draft, mut dem) = (vec![0.0; 1201 * 1201], vec![0.0; 1201 * 1201]);
    let _ = terrain.arriving().heights(0, rect, &mut draft).unwrap();
    let _ = truth.heights(0, rect, &mut dem).unwrap();
    assert!(draft.iter().zip(&dem).all(|(a, b)| !a.is_nan() || b.is_nan()));
    let square = |(a, b): (&f32, &f32)| f64::from(a - b).powi(2);
    let both = draft.iter().zip(&dem).filter(|(_, b)| !b.is_nan());
    let rms_m = (both.clone().map(square).sum::<f64>() / both.count() as f64).sqrt();
    assert!(rms_m < 40.0, "the draft is {rms_m} m off");

    let (clipmap, drafts) = fly_until_final(&terrain, true);
    assert!(drafts > 0, "the first frames are drafts");
    assert_eq!(garbage(&clipmap, &truth), 0);
    assert!(certify(&clipmap).unwrap().error_px.is_ok());
    assert!(!terrain.is_provisional() && terrain.has_light());
    assert_eq!(terrain.take_warnings(), [""; 0]);
    drop(terrain);

    let again = open(Some(&cache), &said);
    assert!(!again.is_provisional() && again.has_light() && !again.is_building());
    assert_eq!(fly_until_final(&again, true).1, 0);
    assert_eq!(said.take(), [""; 0], "its path is said once");
    assert_eq!(fs::read_dir(&cache).unwrap().count(), 1);
}

#[test]
fn without_a_folder_nothing_is_left() {
    let before = temporaries();
    let said = Said::default();
    let terrain = open(None, &said);
    let (clipmap, _) = fly_until_final(&terrain, false);
    assert_eq!(garbage(&clipmap, &Terrain::open(DEM, &Silent).unwrap()), 0);
    drop(terrain);
    assert!(said.take().is_empty());
    assert_eq!(temporaries(), before);
}

/// Files of this process among the system's temporary ones.
fn temporaries() -> usize {
    let ours = format!("clipscape-{}-", std::process::id());
    let entries = fs::read_dir(std::env::temp_dir()).unwrap().flatten();
    entries
        .filter(|e| e.file_name().to_string_lossy().contains(&ours))
        .count()
}

#[test]
fn a_folder_that_cannot_be_written_to_costs_only_the_next_run_s_time() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("file"), "no folder").unwrap();
    let terrain = open(Some(&folder.path().join("file/cache")), &Silent);
    let (clipmap, _) = fly_until_final(&terrain, false);
    assert_eq!(garbage(&clipmap, &Terrain::open(DEM, &Silent).unwrap()), 0);
    let warnings = terrain.take_warnings();
    assert!(
        warnings.len() == 1 && warnings[0].contains("nothing is kept for the next run"),
        "{warnings:?}"
    );
}

#[test]
fn a_kept_file_that_is_damaged_is_built_again() {
    let folder = tempfile::tempdir().unwrap();
    let first = open(Some(folder.path()), &Silent);
    fly_until_final(&first, true);
    drop(first);
    let file = fs::read_dir(folder.path())
        .unwrap()
        .next()
        .unwrap()
        .unwrap()
        .path();
    let whole = fs::read(&file).unwrap();
    fs::write(&file, &whole[..whole.len() / 2]).unwrap();
    let said = Said::default();
    let second = open(Some(folder.path()), &said);
    assert!(second.is_provisional());
    let lines = said.take();
    assert!(lines.iter().any(|l| l.contains("it is built again")), "{lines:?}");
    fly_until_final(&second, true);
    drop(second);
    assert!(fs::read(&file).unwrap() == whole, "the same DEM, the same bytes");
}

#[test]
fn two_at_once_do_not_harm_each_other() {
    let folder = tempfile::tempdir().unwrap();
    let truth = Terrain::open(DEM, &Silent).unwrap();
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                let terrain = open(Some(folder.path()), &Silent);
                let (clipmap, _) = fly_until_final(&terrain, true);
                assert_eq!(garbage(&clipmap, &truth), 0);
                assert_eq!(terrain.take_warnings(), [""; 0]);
            });
        }
    });
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    assert!(!open(Some(folder.path()), &Silent).is_provisional());
}

#[test]
fn what_was_begun_ends_with_the_terrain() {
    let folder = tempfile::tempdir().unwrap();
    let start = Instant::now();
    drop(open(Some(folder.path()), &Silent));
    assert!(start.elapsed() < Duration::from_secs(30));
    let left = fs::read_dir(folder.path()).map_or(0, Iterator::count);
    assert!(left <= 1, "{left} files are left, none of them unfinished");
    for entry in fs::read_dir(folder.path()).into_iter().flatten() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        assert!(!name.ends_with(".part"), "{name}");
    }
}

#[test]
fn a_dem_that_changes_while_it_is_built_is_said_and_its_draft_flown_on() {
    let folder = tempfile::tempdir().unwrap();
    let dem = folder.path().join("N42E001.hgt");
    let cache = folder.path().join("cache");
    let cases: [(&str, &dyn Fn()); 3] = [
        ("cut", &|| {
            let file = fs::OpenOptions::new().write(true).open(&dem).unwrap();
            file.set_len(1_000_000).unwrap();
        }),
        ("overwritten", &|| {
            use std::io::Write;
            let mut file = fs::OpenOptions::new().write(true).open(&dem).unwrap();
            file.write_all(&[7; 100_000]).unwrap();
            let later = std::time::SystemTime::now() + Duration::from_secs(5);
            file.set_modified(later).unwrap();
        }),
        ("removed", &|| fs::remove_file(&dem).unwrap()),
    ];
    for (case, harm) in cases {
        fs::copy(DEM, &dem).unwrap();
        let options = OpenOptions::default();
        let terrain = Terrain::open_at_once(&[&dem], &options, &at_once(Some(&cache)), &Silent).unwrap();
        let arriving = terrain.arriving();
        let mut clipmap = Clipmap::new(&arriving, &OPTIONS).unwrap();
        clipmap.update(&arriving, &spot(), 0.0).unwrap();
        // Before it is built: the first frame has the processors for itself.
        harm();
        terrain.wait_for_heights(&Silent).unwrap();
        for k in 1..10 {
            let report = clipmap.update(&arriving, &spot(), f64::from(k) / 30.0).unwrap();
            assert!(report.provisional && report.patches > 0, "{case}");
        }
        let warnings = terrain.take_warnings();
        assert!(
            warnings.len() == 1 && warnings[0].contains("N42E001.hgt: "),
            "{case}: {warnings:?}"
        );
        drop(terrain);
        assert_eq!(
            fs::read_dir(&cache).map_or(0, Iterator::count),
            0,
            "{case}: what was read is not kept"
        );
    }
}

/// A frame's colours and depths.
#[cfg(feature = "gpu")]
type Picture = (Vec<u8>, Vec<f32>);

#[cfg(feature = "gpu")]
const SIZE_PX: [u32; 2] = [320, 180];

#[cfg(feature = "gpu")]
fn picture(gpu: &clipscape::gpu::Gpu, levels: &dyn Levels, wait: Wait, shift_m: f64) -> Picture {
    use clipscape::render::{Headless, HeadlessOptions};

    let options = HeadlessOptions {
        size_px: SIZE_PX,
        view_mode: clipscape::shade::ViewMode::Shaded,
        traced_light: false,
        clipmap: ClipmapOptions {
            clip_size: 256,
            wait,
            ..OPTIONS
        },
        ..Default::default()
    };
    let mut headless = Headless::new(gpu.clone(), levels, &options).unwrap();
    let camera = clipscape::Camera {
        eye: DVec3::new(55_000.0 + shift_m, 14_000.0, 110_000.0),
        heading_deg: 0.0,
        pitch_deg: -20.0,
        roll_deg: 0.0,
        fov_deg: 60.0,
    };
    let frame = headless.frame(levels, &camera, 0.0).unwrap();
    (frame.rgba8, headless.read_depth().unwrap())
}

/// The signal-to-noise ratio of one picture's colours to another's in dB.
#[cfg(feature = "gpu")]
fn psnr_db(a: &Picture, b: &Picture) -> f64 {
    let squares =
        a.0.iter()
            .zip(&b.0)
            .map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2));
    // Alpha is the same everywhere.
    let mean = squares.sum::<f64>() / (0.75 * a.0.len() as f64);
    10.0 * (255.0 * 255.0 / mean).log10()
}

/// The pixels in which `draft` shows sky and `whole` ground, as it does within 2 pixels around: crests of a draft may be a
/// little lower.
#[cfg(feature = "gpu")]
fn holes(draft: &Picture, whole: &Picture) -> usize {
    let [width, height] = SIZE_PX.map(i64::from);
    let picture = clipscape::grid::Rect::new(0, 0, width, height);
    let at = |depths: &[f32], (x, y): (i64, i64)| depths[(y * width + x) as usize] > 0.0;
    let ground_around = |(x, y): (i64, i64)| {
        let around = clipscape::grid::Rect::new(x - 2, y - 2, x + 3, y + 3).intersection(picture);
        around.cells().all(|cell| at(&whole.1, cell))
    };
    let hole = |cell: &(i64, i64)| !at(&draft.1, *cell) && ground_around(*cell);
    picture.cells().filter(hole).count()
}

#[cfg(feature = "gpu")]
#[test]
fn a_draft_s_picture_is_like_the_one_that_waits_and_has_no_holes() {
    let Some(gpu) = support::gpu() else { return };
    let folder = tempfile::tempdir().unwrap();
    let terrain = open(Some(folder.path()), &Silent);
    let arriving = terrain.arriving();
    assert!(arriving.is_provisional());
    let whole = picture(&gpu, &Terrain::open(DEM, &Silent).unwrap(), Wait::All, 0.0);
    let draft = picture(&gpu, &arriving, Wait::None, 0.0);
    let ratio_db = psnr_db(&draft, &whole);
    assert!(ratio_db > 20.0, "{ratio_db} dB");
    assert_eq!(holes(&draft, &whole), 0);
    let ground = whole.1.iter().filter(|depth| **depth > 0.0).count();
    assert!(ground > 10_000, "{ground} pixels show ground");
    let shifted = picture(&gpu, &arriving, Wait::None, 8000.0);
    let shifted_db = psnr_db(&shifted, &whole);
    assert!(
        shifted_db < ratio_db - 3.0,
        "control: {shifted_db} dB against {ratio_db}"
    );
    // Control: a hole of a few pixels is seen.
    let mut pierced = draft;
    let nearest = |a: &usize, b: &usize| pierced.1[*a].total_cmp(&pierced.1[*b]);
    let nearest = (0..pierced.1.len()).max_by(nearest).unwrap();
    pierced.1[nearest] = 0.0;
    assert_eq!(holes(&pierced, &whole), 1);
}
