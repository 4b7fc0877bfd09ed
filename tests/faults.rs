//! Faults during a flight that does not wait: it goes on with coarser data, says what is wrong, and shows no garbage.

mod support;

use std::fs::{self, File, OpenOptions};
use std::io::{Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::{Arc, Mutex};

use clipscape::clipmap::{Clipmap, ClipmapOptions, Wait};
use clipscape::levels::Levels;
use clipscape::progress::Silent;
use clipscape::source::ReadAt;
use clipscape::stream::Terrain;
use clipscape::terrain::TerrainFile;
use clipscape::terrain::layout::Kind;
use clipscape::{Error, ErrorKind, Result};
use glam::DVec3;
use support::flights::{Rough, Wander, bytes_of, garbage, make_file, settle, view};
use support::{Random, seed};

const OPTIONS: ClipmapOptions = ClipmapOptions {
    clip_size: 64,
    levels: None,
    transition: None,
    vertical_scale: 1.0,
    cull: false,
    occlusion: true,
    day: false,
    max_error_px: None,
    wait: Wait::None,
    upload_budget_bytes: None,
    day: false,
};

/// Bytes that can be damaged while they are read.
struct Fragile(Mutex<Vec<u8>>, u64);

impl Fragile {
    fn new(bytes: Vec<u8>) -> Self {
        let length = bytes.len() as u64;
        Self(Mutex::new(bytes), length)
    }
}

impl ReadAt for Fragile {
    fn size_bytes(&self) -> u64 {
        self.1
    }

    fn read_exact_at(&self, offset: u64, out: &mut [u8]) -> std::io::Result<()> {
        self.0.lock().unwrap().read_exact_at(offset, out)
    }
}

/// What a short flight over damaged data came to.
struct Flown {
    faults: Vec<Error>,
    complete: bool,
    /// The finest level that was drawn in the end.
    finest: Option<u32>,
}

/// Stands over `eye` until all has arrived that can, and checks that nothing is drawn that is not in `truth`.
fn stand(terrain: &Terrain, truth: &dyn Levels, eye: DVec3, case: &str) -> Result<Flown> {
    let arriving = terrain.arriving();
    let mut clipmap = Clipmap::new(&arriving, &OPTIONS)?;
    let mut faults = Vec::new();
    for k in 0..12 {
        clipmap.update(&arriving, &view(eye), f64::from(k))?;
        settle(&arriving);
        faults.append(&mut clipmap.take_faults());
        assert_eq!(garbage(&clipmap, truth), 0, "{case}, frame {k}");
    }
    let mut texts: Vec<String> = faults.iter().map(|f| f.to_string()).collect();
    texts.sort();
    let all = texts.len();
    texts.dedup();
    assert!(texts.len() == all, "{case}: said twice: {texts:?}");
    Ok(Flown {
        faults,
        complete: clipmap.report().complete,
        finest: clipmap.selection().instances().map(|i| i.level).min(),
    })
}

/// A terrain file, the same open and undamaged, and where the data of a tile of heights begin.
struct Scene {
    bytes: Vec<u8>,
    truth: TerrainFile,
}

/// Over the tile (1, 1) of level 0.
const SMOOTH: DVec3 = DVec3::new(400.0 * 30.0, 250.0, 384.0 * 20.0);

/// Over the tile (0, 1) of level 0: noise, which is stored.
const NOISE: DVec3 = DVec3::new(200.0 * 30.0, 250.0, 300.0 * 20.0);

impl Scene {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.terrain.exr");
        make_file(&Rough::new(700, 600), &path);
        let bytes = fs::read(&path).unwrap();
        Self {
            truth: TerrainFile::open("truth", Arc::new(bytes.clone())).unwrap(),
            bytes,
        }
    }

    /// Where the head of a tile begins, and the length of its data: looked for by what must stand there.
    fn tile(&self, kind: Kind, level: u32, x: i32, y: i32) -> (usize, usize) {
        let part = self.truth.layout().part(kind, level) as i32;
        let head: Vec<u8> = [part, x, y, 0, 0].iter().flat_map(|n| n.to_le_bytes()).collect();
        let word = |at: usize| i32::from_le_bytes(self.bytes[at..at + 4].try_into().unwrap());
        // Where the next tile follows it, or the file's end.
        let follows = |at: usize| {
            let end = at + 24 + word(at + 20).max(0) as usize;
            word(at + 20) > 0
                && (end == self.bytes.len()
                    || end + 24 < self.bytes.len() && word(end + 12) == 0 && word(end + 16) == 0)
        };
        let last = self.bytes.len() - 24;
        let found = (0..last).find(|at| self.bytes[*at..].starts_with(&head) && follows(*at));
        let at = found.expect("the tile is in the file");
        (at, word(at + 20) as usize)
    }

    fn fly(&self, bytes: Vec<u8>, eye: DVec3, case: &str) -> Result<Flown> {
        let terrain = Terrain::from_bytes("damaged", Arc::new(bytes), &Silent)?;
        stand(&terrain, &self.truth, eye, case)
    }
}

/// That damage was noticed where it mattered, and cost no more than detail.
fn survived(flown: Result<Flown>, case: &str) -> Option<Flown> {
    match flown {
        Ok(flown) => {
            assert!(
                flown.complete || !flown.faults.is_empty(),
                "{case}: incomplete, and nothing is said"
            );
            let kinds = |f: &Error| f.kind() == ErrorKind::Broken && f.to_string().contains("tile (");
            assert!(flown.faults.iter().all(kinds), "{case}: {:?}", flown.faults);
            assert!(flown.finest.is_some(), "{case}: nothing is drawn");
            Some(flown)
        }
        // Where nothing could be drawn instead.
        Err(error) => {
            assert_eq!(error.kind(), ErrorKind::Broken, "{case}: {error}");
            None
        }
    }
}

#[test]
fn undamaged_it_is_complete() {
    let scene = Scene::new();
    let flown = scene.fly(scene.bytes.clone(), SMOOTH, "undamaged").unwrap();
    assert!(flown.complete && flown.faults.is_empty() && flown.finest == Some(0));
}

#[test]
fn every_byte_of_a_tile_s_head_may_be_wrong() {
    let scene = Scene::new();
    let mut noticed = 0;
    for (kind, level) in [
        (Kind::Height, 0),
        (Kind::Height, 1),
        (Kind::Bounds, 0),
        (Kind::Light, 0),
        (Kind::Check, 0),
    ] {
        // That under the eye.
        let (x, y) = match (kind, level) {
            (Kind::Height | Kind::Light, 0) => (1, 1),
            _ => (0, 0),
        };
        let (at, _) = scene.tile(kind, level, x, y);
        for byte in at..at + 24 {
            for flip in [1u8, 0x80] {
                let mut bytes = scene.bytes.clone();
                bytes[byte] ^= flip;
                let case = format!("{kind:?} {level}, byte {} ^ {flip}", byte - at);
                let flown = survived(scene.fly(bytes, SMOOTH, &case), &case);
                // A length that is a little longer may still decode to the same.
                noticed += u32::from(flown.is_none_or(|f| !f.faults.is_empty()));
            }
        }
    }
    assert!(noticed > 200, "{noticed} of 240");
}

#[test]
fn payloads_may_be_flipped_stored_ones_too() {
    let scene = Scene::new();
    let seed = seed(51);
    let random = &mut Random(seed);
    let parts: Vec<_> = [Kind::Height, Kind::Bounds, Kind::Light, Kind::Check]
        .into_iter()
        .flat_map(|kind| (0..3).map(move |level| (kind, level)))
        .collect();
    let (mut stored, mut refused) = (0, 0);
    for round in 0..200 {
        // Half of them on the tile of noise.
        let (at, length) = match round % 2 {
            0 => scene.tile(Kind::Height, 0, 0, 1),
            _ => {
                let (kind, level) = random.pick(&parts);
                scene.tile(kind, level, 0, 0)
            }
        };
        stored += u32::from(length == 256 * 256 * 4);
        let mut bytes = scene.bytes.clone();
        let byte = at + 24 + (random.bits() % length as u64) as usize;
        bytes[byte] ^= 1 << (random.bits() % 8);
        let case = format!("seed {seed}, round {round}, byte {byte}");
        let flown = survived(scene.fly(bytes, NOISE, &case), &case);
        refused += u32::from(flown.is_none_or(|f| !f.faults.is_empty()));
    }
    assert!(stored >= 90, "{stored} of 200 tiles were stored");
    assert!(refused > 150, "{refused} of 200 flips were noticed");
}

/// Flies over the file at `path`, does `harm` to it on the way, and goes on.
fn harmed(path: &Path, truth: &dyn Levels, harm: impl FnOnce(&Path)) -> (Vec<Error>, u32) {
    let terrain = Terrain::open(path, &Silent).unwrap();
    let arriving = terrain.arriving();
    let mut clipmap = Clipmap::new(&arriving, &OPTIONS).unwrap();
    let mut wander = Wander::new(seed(52), truth.grid(), 250.0, 0.0);
    wander.eye.y = 250.0;
    let (mut faults, mut coarse) = (Vec::new(), 0);
    let mut harm = Some(harm);
    for k in 0..60 {
        if k == 10 {
            harm.take().unwrap()(path);
        }
        clipmap
            .update(&arriving, &view(wander.step()), f64::from(k) / 10.0)
            .unwrap_or_else(|e| panic!("frame {k}: {e}"));
        settle(&arriving);
        assert_eq!(garbage(&clipmap, truth), 0, "frame {k}");
        assert!(clipmap.report().patches > 0, "frame {k}");
        faults.append(&mut clipmap.take_faults());
        coarse += u32::from(clipmap.report().stale_levels > 0 && k > 12);
    }
    (faults, coarse)
}

/// What is done to a file, whether it hurts, and how.
type Case<'a> = (&'a str, bool, &'a dyn Fn(&Path));

#[test]
fn a_file_may_be_cut_overwritten_replaced_or_removed_during_a_flight() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.terrain.exr");
    // Large enough that the flight leaves what it has read at the start.
    make_file(&Rough::new(1500, 1300), &path);
    let whole = bytes_of(&path);
    let truth = TerrainFile::open("truth", whole.clone()).unwrap();
    let open = || OpenOptions::new().write(true).open(&path).unwrap();
    let cases: [Case<'_>; 5] = [
        ("cut to nothing", true, &|_| open().set_len(0).unwrap()),
        ("cut", true, &|_| open().set_len(whole.len() as u64 / 3).unwrap()),
        ("overwritten", true, &|_| {
            let mut file = open();
            file.seek(SeekFrom::Start(20_000)).unwrap();
            let mut random = Random(9);
            let noise: Vec<u8> = (0..whole.len() - 20_000).map(|_| random.bits() as u8).collect();
            file.write_all(&noise).unwrap();
        }),
        // Who has a file open goes on reading it under whatever name, or none.
        ("replaced", false, &|path| {
            let other = path.with_extension("other");
            File::create(&other).unwrap().write_all(b"another file").unwrap();
            fs::rename(&other, path).unwrap();
        }),
        ("removed", false, &|path| fs::remove_file(path).unwrap()),
    ];
    for (case, hurts, harm) in cases {
        fs::write(&path, &*whole).unwrap();
        let (faults, coarse) = harmed(&path, &truth, harm);
        assert_eq!(!faults.is_empty(), hurts, "{case}: {faults:?}");
        assert_eq!(coarse > 0, hurts, "{case}: {coarse} frames");
        let mut lines: Vec<_> = faults.iter().map(|f| f.to_string()).collect();
        lines.sort();
        lines.dedup();
        assert!(
            lines
                .iter()
                .all(|l| l.contains("a.terrain.exr: ") && l.lines().count() == 1)
        );
    }
}

#[test]
fn what_is_damaged_while_it_is_read_is_told_by_its_checks() {
    let scene = Scene::new();
    let fragile = Arc::new(Fragile::new(scene.bytes.clone()));
    let terrain = Terrain::from_bytes("fragile", fragile.clone(), &Silent).unwrap();
    let (at, length) = scene.tile(Kind::Height, 0, 0, 1);
    assert_eq!(length, 256 * 256 * 4, "it is stored");
    for byte in fragile.0.lock().unwrap()[at + 24..][..length]
        .iter_mut()
        .step_by(1000)
    {
        *byte ^= 1;
    }
    let flown = stand(&terrain, &scene.truth, NOISE, "fragile").unwrap();
    assert!(!flown.complete && flown.finest > Some(0) && flown.faults.len() == 1);
    // Control: what is not so is told from what is.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("b.terrain.exr");
    make_file(&Rough::new(702, 600), &path);
    let other = Terrain::open(&path, &Silent).unwrap();
    let mut clipmap = Clipmap::new(&other, &OPTIONS).unwrap();
    clipmap.update(&other, &view(NOISE), 0.0).unwrap();
    assert!(garbage(&clipmap, &scene.truth) > 1000);
}
