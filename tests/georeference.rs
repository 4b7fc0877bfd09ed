//! Where samples lie: the same terrain from files that register it differently, exported levels, and cameras placed in
//! the DEM's own reference system.
#![cfg(feature = "dem")]

use std::fmt::Write;
use std::fs;
use std::io::Cursor;
use std::sync::Arc;

use clipscape::grid::Rect;
use clipscape::source::{HeightSource, OpenOptions, open_bytes};
use tiff::encoder::TiffEncoder;
use tiff::encoder::colortype::GrayI16;
use tiff::tags::Tag;

const SIDE: i64 = 1201;
const STEP: f64 = 1.0 / 1200.0;

/// The shipped tile as its bytes have it: the sample in a column and row, and where it lies (longitude, latitude).
struct Tile(Vec<u8>);

impl Tile {
    fn read() -> Self {
        Self(fs::read("data/N42E001.hgt").unwrap())
    }

    fn sample(&self, x: i64, z: i64) -> i16 {
        let at = 2 * (z * SIDE + x) as usize;
        i16::from_be_bytes([self.0[at], self.0[at + 1]])
    }

    fn all(&self) -> Vec<i16> {
        Rect::new(0, 0, SIDE, SIDE)
            .cells()
            .map(|(x, z)| self.sample(x, z))
            .collect()
    }

    fn place(x: i64, z: i64) -> [f64; 2] {
        [1.0 + x as f64 * STEP, 43.0 - z as f64 * STEP]
    }

    /// As a GeoTIFF whose tie point names the corner of the first pixel, or its sample.
    fn tiff(&self, point: bool) -> Vec<u8> {
        let mut out = Cursor::new(Vec::new());
        let mut encoder = TiffEncoder::new(&mut out).unwrap();
        let mut image = encoder.new_image::<GrayI16>(SIDE as u32, SIDE as u32).unwrap();
        let corner = if point { 0.0 } else { 0.5 * STEP };
        let tie = [0.0, 0.0, 0.0, 1.0 - corner, 43.0 + corner, 0.0];
        let keys: [u16; 16] = [
            1,
            1,
            0,
            3,
            1024,
            0,
            1,
            2,
            1025,
            0,
            1,
            1 + u16::from(point),
            2048,
            0,
            1,
            4326,
        ];
        let tags = image.encoder();
        tags.write_tag(Tag::ModelPixelScaleTag, &[STEP, STEP, 0.0][..])
            .unwrap();
        tags.write_tag(Tag::ModelTiepointTag, &tie[..]).unwrap();
        tags.write_tag(Tag::GeoKeyDirectoryTag, &keys[..]).unwrap();
        tags.write_tag(Tag::GdalNodata, "-32768").unwrap();
        image.write_data(&self.all()).unwrap();
        out.into_inner()
    }

    /// As an ESRI ASCII grid that names the corner of its south-western cell, or its sample.
    fn ascii(&self, centre: bool) -> Vec<u8> {
        let (word, half) = if centre {
            ("center", 0.0)
        } else {
            ("corner", 0.5 * STEP)
        };
        let mut text = format!(
            "ncols {SIDE}\nnrows {SIDE}\nxll{word} {:?}\nyll{word} {:?}\ncellsize {STEP:?}\nNODATA_value -32768\n",
            1.0 - half,
            42.0 - half
        );
        for row in self.all().chunks(SIDE as usize) {
            row.iter().for_each(|h| write!(text, "{h} ").unwrap());
            text.push('\n');
        }
        text.into_bytes()
    }
}

fn open(name: &str, bytes: Vec<u8>) -> Box<dyn HeightSource> {
    open_bytes(name, Arc::new(bytes), &OpenOptions::default()).unwrap()
}

/// The farthest, in pixels, that any of some samples lies from where it should.
fn farthest(source: &dyn HeightSource) -> f64 {
    let place = source.description().place.as_ref().unwrap();
    let mut most = 0.0_f64;
    for (x, z) in [
        (0, 0),
        (SIDE - 1, 0),
        (0, SIDE - 1),
        (SIDE - 1, SIDE - 1),
        (600, 17),
        (3, 900),
    ] {
        let found = place.place(x as f64, z as f64);
        let want = Tile::place(x, z);
        most = most.max((found[0] - want[0]).hypot(found[1] - want[1]) / STEP);
    }
    most
}

#[test]
fn the_same_terrain_lies_at_the_same_place_however_its_file_registers_it() {
    let tile = Tile::read();
    let files = [
        ("N42E001.hgt", tile.0.clone()),
        ("area.tif", tile.tiff(false)),
        ("point.tif", tile.tiff(true)),
        ("corner.asc", tile.ascii(false)),
        ("centre.asc", tile.ascii(true)),
    ];
    let rect = Rect::new(0, 0, SIDE, SIDE);
    let mut spacing_m: Option<[f64; 2]> = None;
    for (name, bytes) in files {
        let source = open(name, bytes);
        let mut heights = vec![0.0; rect.area() as usize];
        source.read(rect, &mut heights).unwrap();
        for ((x, z), height) in rect.cells().zip(heights) {
            match tile.sample(x, z) {
                i16::MIN => assert!(height.is_nan(), "{name}: ({x}, {z})"),
                want => assert_eq!(height, f32::from(want), "{name}: ({x}, {z})"),
            }
        }
        let off = farthest(source.as_ref());
        assert!(off < 1e-6, "{name}: {off} pixels off");
        let here = source.description().grid.spacing_m;
        let there = spacing_m.get_or_insert(here);
        for axis in 0..2 {
            assert!(
                (here[axis] / there[axis] - 1.0).abs() < 1e-9,
                "{name}: {here:?} {there:?}"
            );
        }
    }
}

#[test]
fn half_a_pixel_would_be_seen() {
    // The tie point of an area taken for that of a point.
    let mut bytes = Tile::read().tiff(false);
    let key = [1025u16, 0, 1, 1].map(u16::to_le_bytes).concat();
    let at = bytes.windows(8).position(|w| w == key).unwrap();
    bytes[at + 6] = 2;
    let off = farthest(open("wrong.tif", bytes).as_ref());
    assert!((off - 0.5_f64.hypot(0.5)).abs() < 1e-6, "{off}");
}

#[cfg(feature = "cli")]
mod program {
    use super::*;
    use std::path::Path;
    use std::process::{Command, Output};

    fn run(folder: &Path, arguments: &[&str]) -> Output {
        let mut program = Command::new(env!("CARGO_BIN_EXE_clipscape"));
        program.args(arguments).current_dir(folder).output().unwrap()
    }

    fn done(folder: &Path, arguments: &[&str]) {
        let output = run(folder, arguments);
        assert!(
            output.status.success(),
            "{arguments:?}: {}",
            String::from_utf8_lossy(&output.stderr)
        );
    }

    fn fails(folder: &Path, arguments: &[&str], says: &str) {
        let output = run(folder, arguments);
        let line = String::from_utf8_lossy(&output.stderr);
        assert!(
            output.status.code() == Some(1) && line.contains(says),
            "{arguments:?}: {line}"
        );
        let own = line.lines().filter(|line| line.starts_with("clipscape: "));
        assert_eq!(own.count(), 1, "{line}");
    }

    fn back(folder: &Path, name: &str) -> (Box<dyn HeightSource>, Vec<f32>) {
        let source = open(name, fs::read(folder.join(name)).unwrap());
        let size = source.description().grid.size;
        let mut heights = vec![0.0; size.samples() as usize];
        source.read(size.rect(), &mut heights).unwrap();
        (source, heights)
    }

    /// A corner of the tile that is quick to filter, as a point-registered GeoTIFF would give it.
    fn corner(folder: &Path) {
        let tile = Tile::read();
        let mut text = format!(
            "ncols 200\nnrows 150\nxllcenter 1\nyllcenter {:?}\ncellsize {STEP:?}\n",
            43.0 - 149.0 * STEP
        );
        for z in 0..150 {
            (0..200).for_each(|x| write!(text, "{} ", tile.sample(x, z)).unwrap());
            text.push('\n');
        }
        fs::write(folder.join("corner.asc"), text).unwrap();
    }

    #[test]
    fn exported_parts_lie_over_their_source() {
        let folder = tempfile::tempdir().unwrap();
        let here = folder.path();
        corner(here);
        done(
            here,
            &["preprocess", "corner.asc", "--sky-directions", "4", "--quiet"],
        );
        let (source, truth) = back(here, "corner.asc");
        let place = source.description().place.clone().unwrap();
        for input in ["corner.asc", "corner.terrain.exr"] {
            for level in 0..3 {
                let l = level.to_string();
                done(
                    here,
                    &[
                        "export", input, "--part", "height", "--level", &l, "-o", "h.tif", "-fq",
                    ],
                );
                let (part, heights) = back(here, "h.tif");
                let d = part.description();
                assert_eq!(d.grid.size, source.description().grid.level(level));
                let at = d.place.as_ref().unwrap();
                let (step, close) = (f64::from(1 << level), |a: f64, b: f64| {
                    (a - b).abs() < 1e-9 * STEP
                });
                assert!(close(at.origin[0], place.origin[0]) && close(at.origin[1], place.origin[1]));
                assert!(close(at.pixel[0] / step, place.pixel[0]) && at.registration == place.registration);
                if level == 0 {
                    assert_eq!(heights, truth);
                }
                done(
                    here,
                    &[
                        "export", input, "--part", "error", "--level", &l, "-o", "e.tif", "-fq",
                    ],
                );
                let (_, errors) = back(here, "e.tif");
                let width = d.grid.size.width;
                for z in (0..150_i64).step_by(1 << level) {
                    for x in (0..200_i64).step_by(1 << level) {
                        let coarse = heights[((z >> level) * width + (x >> level)) as usize];
                        let fine = (z * 200 + x) as usize;
                        assert_eq!(errors[fine], coarse - truth[fine], "level {level} ({x}, {z})");
                    }
                }
            }
        }
        for part in ["sun", "sky"] {
            done(
                here,
                &[
                    "export",
                    "corner.terrain.exr",
                    "--part",
                    part,
                    "-o",
                    "l.tif",
                    "-fq",
                ],
            );
            let (_, shares) = back(here, "l.tif");
            assert!(shares.iter().all(|s| (0.0..=1.0).contains(s)));
            assert!(shares.iter().any(|s| *s > 0.0));
            fails(
                here,
                &["export", "corner.asc", "--part", part, "-o", "l.tif", "-f"],
                "preprocess it",
            );
        }
        fails(
            here,
            &["export", "corner.asc", "--part", "height", "-o", "h.tif"],
            "h.tif",
        );
        fails(
            here,
            &["export", "corner.asc", "--part", "height", "-o", "h.png"],
            "name it .tif",
        );
        fails(
            here,
            &["export", "h.tif", "--part", "height", "-o", "h.tif", "-f"],
            "is an input",
        );
        fails(
            here,
            &[
                "export",
                "corner.asc",
                "--part",
                "height",
                "--level",
                "9",
                "-o",
                "x.tif",
            ],
            "levels are 0 to",
        );
        assert!(!here.join("x.tif").exists());
    }

    #[cfg(feature = "gpu")]
    #[test]
    fn a_camera_over_the_map_is_the_same_in_world_metres() {
        if clipscape::gpu::open().is_err() {
            return; // The tests of the GPU say that there is none, and fail where one is required.
        }
        let folder = tempfile::tempdir().unwrap();
        let here = folder.path();
        corner(here);
        let (source, truth) = back(here, "corner.asc");
        let [dx, dz] = source.description().grid.spacing_m;
        let (x, z) = (60, 100);
        let ground = truth[z * 200 + x];
        let [east, north] = Tile::place(x as i64, z as i64);
        let [to_east, to_north] = Tile::place(150, 20);
        let target = truth[20 * 200 + 150];
        let eye = format!(
            "{},{},{}",
            x as f64 * dx,
            f64::from(ground) + 700.0,
            z as f64 * dz
        );
        let at = format!("{east:?},{north:?}");
        let to = format!("{to_east:?},{to_north:?}");
        // Heading and pitch by hand.
        let (e, s) = ((150.0 - x as f64) * dx, (20.0 - z as f64) * dz);
        let up = f64::from(target) - f64::from(ground) - 700.0;
        let heading = e.atan2(-s).to_degrees().to_string();
        let pitch = up.atan2(e.hypot(s)).to_degrees().to_string();
        let size = ["--size", "64x48", "-q", "-f"];
        let shot = |out: &str, arguments: &[&str]| {
            let base = ["render", "corner.asc", "-o", out];
            done(here, &[&base, arguments, &size].concat());
            fs::read(here.join(out)).unwrap()
        };
        let world = shot(
            "a.png",
            &["--eye", &eye, "--heading", &heading, "--pitch", &pitch],
        );
        let map = shot("b.png", &["--eye-at", &at, "--above", "700", "--look-at", &to]);
        assert_eq!(world, map);
        let other = shot("c.png", &["--eye-at", &at, "--above", "700", "--look-at", &at]);
        assert_ne!(other, map, "control");
        fs::write(
            here.join("f.json"),
            format!(
                "{{\"frame\": \"crs\", \"keys\": [{{\"t\": 0, \"at\": [{east:?}, {north:?}], \"above_m\": 700, \
                 \"heading\": {heading}, \"pitch\": {pitch}}}]}}"
            ),
        )
        .unwrap();
        done(
            here,
            &[
                "render",
                "corner.asc",
                "--flight",
                "f.json",
                "-o",
                "frames",
                "--size",
                "64x48",
                "-q",
            ],
        );
        // A flight's clip size is another than a picture's, so only what is the same for both is compared.
        let flown = fs::read(here.join("frames/00000.png")).unwrap();
        assert_eq!(flown, world);
        fails(
            here,
            &["render", "corner.asc", "--eye-at", "7,42", "-o", "d.png"],
            "has no ground at 7, 42",
        );
        fails(
            here,
            &["render", "synth:64", "--eye-at", "7,42", "-o", "d.png"],
            "does not say where it lies",
        );
    }
}
