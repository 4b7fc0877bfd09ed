//! Round trips, order, determinism, misuse and cancellation.

use std::io::Cursor;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::layout::Layout;
use super::testing::{Arrays, Look, Random, all_bits, first_tile, meta, open};
use super::*;
use crate::error::ErrorKind;
use crate::grid::{Grid, Rect};
use crate::levels::Levels;
use crate::progress::{Progress, Silent};
use crate::source::ReadAt;
use crate::work::{Serial, Work};

const SIZES: [(i64, i64); 7] = [
    (1, 1),
    (1, 600),
    (600, 1),
    (2, 3),
    (257, 256),
    (300, 700),
    (1201, 65),
];

#[test]
fn all_samples_come_back_bit_for_bit() {
    for (seed, (width, height)) in SIZES.into_iter().enumerate() {
        for light in [false, true] {
            for look in [Look::Noise, Look::Smooth] {
                let arrays = Arrays::random(width, height, light, look, seed as u64);
                let file = open(arrays.file()).unwrap();
                assert_eq!(*file.meta(), meta(arrays.grid, light));
                let case = format!("seed {seed}: {width} x {height}, light {light}, {look:?}");
                assert_eq!(file.has_light(), light, "{case}");
                assert!(all_bits(&file).unwrap() == all_bits(&arrays).unwrap(), "{case}");
                assert_eq!(file.verify(&Silent).unwrap().len(), 0, "{case}");
            }
        }
    }
}

#[test]
fn any_rectangle_is_the_same_part_of_the_whole_whatever_the_cache() {
    let arrays = Arrays::random(700, 530, true, Look::Noise, 3);
    let bytes: Arc<Vec<u8>> = Arc::new(arrays.file());
    for cache_bytes in [0, 300_000, DEFAULT_CACHE_BYTES] {
        let file = TerrainFile::open("t", bytes.clone())
            .unwrap()
            .with_cache(cache_bytes);
        let random = &mut Random::new(17);
        for round in 0..200 {
            let level = random.below(4) as u32;
            let size = arrays.grid.level(level);
            let mut pick = |n: i64| {
                let (a, b) = (random.below(n + 1), random.below(n + 1));
                (a.min(b), a.max(b))
            };
            let ((x0, x1), (z0, z1)) = (pick(size.width), pick(size.height));
            let rect = Rect::new(x0, z0, x1, z1);
            let (mut got, mut want) = (vec![0f32; rect.area() as usize], vec![0f32; rect.area() as usize]);
            let _ = file.heights(level, rect, &mut got).unwrap();
            let _ = arrays.heights(level, rect, &mut want).unwrap();
            let bits = |v: &[f32]| v.iter().map(|h| h.to_bits()).collect::<Vec<_>>();
            assert!(
                bits(&got) == bits(&want),
                "seed 17, round {round}: {rect:?} of level {level}"
            );
        }
    }
}

#[test]
fn what_is_not_there_is_refused_as_misuse() {
    let file = open(Arrays::random(300, 70, false, Look::Smooth, 1).file()).unwrap();
    let heights = |level, rect, length| file.heights(level, rect, &mut vec![0.0; length]).map(|_| ());
    assert!(heights(0, Rect::new(0, 0, 300, 70), 21_000).is_ok());
    for error in [
        heights(0, Rect::new(0, 0, 301, 70), 301 * 70),
        heights(0, Rect::new(-1, 0, 1, 1), 2),
        heights(0, Rect::new(0, 0, 2, 2), 3),
        heights(99, Rect::new(0, 0, 1, 1), 1),
        file.light(0, Rect::new(0, 0, 1, 1), &mut [Default::default()])
            .map(|_| ()),
    ] {
        assert_eq!(error.unwrap_err().kind(), ErrorKind::Misuse);
    }
}

/// Runs tasks backwards: results may not depend on the order.
struct Backwards;

impl Work for Backwards {
    fn each(&self, count: usize, task: &(dyn Fn(usize) + Sync)) {
        (0..count).rev().for_each(task);
    }
}

#[test]
fn the_same_input_gives_the_same_bytes() {
    let arrays = Arrays::random(800, 600, true, Look::Smooth, 5);
    let description = meta(arrays.grid, true);
    let out = || Cursor::new(Vec::new());
    let again = write(out(), &description, &arrays, &Backwards, &Silent)
        .unwrap()
        .into_inner();
    assert!(arrays.file() == again);
}

#[test]
fn tiles_stand_in_the_order_of_the_layout() {
    let arrays = Arrays::random(600, 1300, true, Look::Smooth, 6);
    let bytes = arrays.file();
    let layout = Layout::new(&arrays.grid, true, true).unwrap();
    // Walk the file from the first tile on, by the lengths before each tile.
    let tables = bytes.len() - walk(&bytes, &layout);
    assert!(tables > 0);
    let mut wrong = bytes.clone();
    let first = first_tile(&wrong);
    wrong[first] ^= 1;
    assert!(
        std::panic::catch_unwind(|| walk(&wrong, &layout)).is_err(),
        "control"
    );
}

/// Follows the tiles through the file and returns how many bytes they take.
fn walk(bytes: &[u8], layout: &Layout) -> usize {
    let start = first_tile(bytes);
    let mut at = start;
    for row in layout.order() {
        for x in 0..layout.parts()[row.part].tiles().width {
            let word = |n: usize| i32::from_le_bytes(bytes[at + 4 * n..][..4].try_into().unwrap());
            assert_eq!(
                [word(0) as i64, word(1) as i64, word(2) as i64],
                [row.part as i64, x, row.y]
            );
            at += 24 + word(5) as usize;
        }
    }
    assert_eq!(at, bytes.len());
    at - start
}

#[test]
fn tiles_must_be_put_once_and_all() {
    let arrays = Arrays::random(70, 33, false, Look::Smooth, 15);
    let description = meta(arrays.grid, false);
    let mut writer = TerrainWriter::new(Cursor::new(Vec::new()), &description).unwrap();
    let bytes = vec![0; 70 * 33 * 4];
    let tile = writer.encode(0, 0, 0, bytes.clone()).unwrap();
    assert!(writer.encode(0, 0, 0, vec![0; 5]).is_err());
    assert!(writer.encode(0, 1, 0, bytes.clone()).is_err());
    assert!(writer.encode(99, 0, 0, bytes).is_err());
    writer.put(tile.clone()).unwrap();
    assert!(writer.put(tile).unwrap_err().to_string().contains("twice"));
    assert!(writer.finish().unwrap_err().to_string().contains("not written"));
    let with_light = meta(arrays.grid, true);
    let refused = write(Cursor::new(Vec::new()), &with_light, &arrays, &Serial, &Silent);
    assert_eq!(refused.unwrap_err().kind(), ErrorKind::Misuse);
}

/// Cancels after some steps.
struct Impatient(AtomicUsize);

impl Progress for Impatient {
    fn cancelled(&self) -> bool {
        self.0.fetch_add(1, Ordering::Relaxed) > 2
    }
}

#[test]
fn writing_and_verifying_can_be_cancelled() {
    let arrays = Arrays::random(300, 700, false, Look::Smooth, 16);
    let impatient = || Impatient(AtomicUsize::new(0));
    let description = meta(arrays.grid, false);
    let result = write(
        Cursor::new(Vec::new()),
        &description,
        &arrays,
        &Serial,
        &impatient(),
    );
    assert_eq!(result.unwrap_err().kind(), ErrorKind::Cancelled);
    let file = open(arrays.file()).unwrap();
    assert_eq!(
        file.verify(&impatient()).unwrap_err().kind(),
        ErrorKind::Cancelled
    );
}

/// Counts reads of more than a tile's head.
struct Counting(Vec<u8>, AtomicUsize);

impl ReadAt for Counting {
    fn size_bytes(&self) -> u64 {
        self.0.size_bytes()
    }

    fn read_exact_at(&self, offset: u64, out: &mut [u8]) -> std::io::Result<()> {
        self.1.fetch_add(usize::from(out.len() > 24), Ordering::Relaxed);
        self.0.read_exact_at(offset, out)
    }
}

#[test]
fn strips_do_not_decode_a_tile_for_every_row() {
    let bytes = Arc::new(Counting(
        Arrays::random(600, 600, false, Look::Smooth, 18).file(),
        AtomicUsize::new(0),
    ));
    let file = TerrainFile::open("t", bytes.clone()).unwrap();
    bytes.1.store(0, Ordering::Relaxed);
    for z in 0..600 {
        let _ = file
            .heights(0, Rect::new(0, z, 600, z + 1), &mut [0.0; 600])
            .unwrap();
    }
    // Nine tiles, the one that holds their checks, and a page of the offset table.
    assert_eq!(bytes.1.load(Ordering::Relaxed), 11);
}

/// The beginning of a file and its last tile's head, nothing between; counts the bytes that are read.
struct Ends {
    pieces: Vec<(u64, Vec<u8>)>,
    size_bytes: u64,
    read: AtomicUsize,
}

impl ReadAt for Ends {
    fn size_bytes(&self) -> u64 {
        self.size_bytes
    }

    fn read_exact_at(&self, offset: u64, out: &mut [u8]) -> std::io::Result<()> {
        self.read.fetch_add(out.len(), Ordering::Relaxed);
        out.fill(0);
        for (start, bytes) in &self.pieces {
            for (at, byte) in (*start..).zip(bytes) {
                if let Some(k) = at.checked_sub(offset).filter(|k| *k < out.len() as u64) {
                    out[k as usize] = *byte;
                }
            }
        }
        Ok(())
    }
}

#[test]
fn a_file_of_any_size_opens_without_its_index() {
    let grid = Grid::new(1 << 20, 1 << 20, [1.0, 1.0]);
    let layout = Layout::new(&grid, true, true).unwrap();
    let header = header::to_bytes(&meta(grid, true), &header::describe(&layout)).unwrap();
    let tables = 8 * layout.tile_count();
    let last = layout.parts().len() - 1;
    let tiles = layout.parts()[last].tiles();
    let tile_at = header.len() as u64 + tables + 1_000_000;
    let words = [
        last as i32,
        tiles.width as i32 - 1,
        tiles.height as i32 - 1,
        0,
        0,
        100,
    ];
    let head: Vec<u8> = words.iter().flat_map(|n| n.to_le_bytes()).collect();
    let entry_at = header.len() as u64 + tables - 8;
    let header_bytes = header.len();
    let file = Arc::new(Ends {
        pieces: vec![
            (0, header),
            (entry_at, tile_at.to_le_bytes().into()),
            (tile_at, head),
        ],
        size_bytes: 1 << 40,
        read: AtomicUsize::new(0),
    });
    TerrainFile::open("t", file.clone()).unwrap();
    let read = file.read.load(Ordering::Relaxed);
    assert!(read < header_bytes + 50_000, "{read} bytes were read");
    assert!(tables > 300_000_000, "{tables} bytes of tables");
}

#[test]
fn the_exr_crate_reads_every_part_as_written() {
    use exr::prelude::{ReadChannels, ReadLayers, read};
    for look in [Look::Noise, Look::Smooth] {
        let arrays = Arrays::random(530, 300, true, look, 21);
        let image = read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .all_layers()
            .all_attributes()
            .from_buffered(Cursor::new(arrays.file()))
            .unwrap();
        let layout = Layout::new(&arrays.grid, true, true).unwrap();
        assert_eq!(image.layer_data.len(), layout.parts().len());
        for (layer, part) in image.layer_data.iter().zip(layout.parts()) {
            let level = part.level as usize;
            for (index, channel) in layer.channel_data.list.iter().enumerate() {
                assert_eq!(channel.name.to_string(), part.channels().0[index]);
                let bits: Vec<u64> = channel
                    .sample_data
                    .values_as_f32()
                    .map(|v| v.to_bits().into())
                    .collect();
                let want: Vec<u64> = match part.kind {
                    layout::Kind::Height => {
                        arrays.heights[level].iter().map(|h| h.to_bits().into()).collect()
                    }
                    layout::Kind::Bounds => {
                        let field = BOUNDS_FIELDS[index];
                        let of = |b: &crate::levels::Bounds| bytemuck::cast::<_, [u32; 6]>(*b)[field].into();
                        arrays.bounds[level].iter().map(of).collect()
                    }
                    layout::Kind::Light => {
                        let all = &arrays.light.as_ref().unwrap()[level];
                        let of = |l: &crate::levels::LightSample| [l.sky, l.sun][index].to_f32().to_bits();
                        all.iter().map(|l| of(l).into()).collect()
                    }
                    layout::Kind::Day => {
                        let all = &arrays.day.as_ref().unwrap()[level];
                        let of = |d: &crate::levels::DaySample| {
                            let fields = [d.first, d.first_soft, d.last, d.last_soft, d.slope];
                            fields[index].to_f32().to_bits()
                        };
                        all.iter().map(|d| of(d).into()).collect()
                    }
                    layout::Kind::Check | layout::Kind::CheckDay | layout::Kind::CheckBounds => continue,
                };
                assert!(bits == want, "{look:?}, {}", part.name());
            }
        }
    }
}
