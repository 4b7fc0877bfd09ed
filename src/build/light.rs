//! The third pass: light traced over the heights of a terrain file, put as tiles where that was just written.
//!
//! The heights are read back through the file's cache of tiles, so many rows at once as blocks of light are high, and
//! whatever lies towards the light as far as it may matter; how much of that is kept changes the time, and nothing else.
//! Each level of light takes rows from the next finer one as they come to be known ([`LightLevels`]) until a row of tiles
//! is due. So what is held does not depend on the DEM's height: for each column of level 0 4.5 KiB.

use std::io::{Seek, Write};
use std::time::Instant;

use super::tiles::put_packed;
use crate::error::{Error, Result};
use crate::grid::Rect;
use crate::levels::Levels;
use crate::light::{Crests, Earth, Ground, LightLevels, LightOptions, ROWS, Relief, Skylight, Sunlight};
use crate::progress::Progress;
use crate::pyramid::Filter;
use crate::terrain::layout::{Kind, TILE};
use crate::terrain::{TerrainFile, TerrainWriter};
use crate::work::Work;

/// Seconds that the third pass took.
#[derive(Debug, Default)]
pub(super) struct Took {
    /// Reading heights back and tracing the sun's share.
    pub(super) sun_s: f64,
    /// Tracing the sky's share, and filtering both.
    pub(super) sky_s: f64,
    /// Compressing and writing.
    pub(super) write_s: f64,
}

/// What light is made of beside the heights: the light itself, the earth, the filter of its levels.
pub(super) struct Lit<'a> {
    pub(super) options: &'a LightOptions,
    pub(super) earth: &'a Earth,
    pub(super) filter: &'a Filter,
}

/// Level 0 of a terrain file.
struct Heights<'a>(&'a TerrainFile);

impl Ground for Heights<'_> {
    fn copy(&self, rect: Rect, stride: usize, out: &mut [f32]) -> Result<()> {
        self.0.heights_strided(0, rect, stride, out)
    }
}

/// Traces the light of `heights`, whose crests are `crests`, as `lit` says, filters it into all levels and puts them.
///
/// # Errors
/// Those of tracing and of the file; [`crate::ErrorKind::Cancelled`].
pub(super) fn write_light<W: Write + Seek + Sync + Send>(
    heights: &TerrainFile,
    crests: Crests,
    writer: &mut TerrainWriter<W>,
    lit: &Lit<'_>,
    work: &dyn Work,
    progress: &dyn Progress,
) -> Result<Took> {
    let mut took = Took::default();
    let start = Instant::now();
    let grid = *heights.grid();
    let width = grid.size.width as usize;
    let ground = Heights(heights);
    let relief = Relief::new(&grid, &ground, crests);
    let sun = Sunlight::new(&grid, lit.earth, lit.options.sun)?;
    let directions = lit.options.sky_directions;
    let sky = (directions > 0).then(|| Skylight::new(&grid, lit.earth, directions));
    let mut levels = LightLevels::new(&grid, lit.filter, sky.is_some());
    let mut due = writer.layout().order_of(Kind::Light).into_iter().peekable();
    let (mut suns, mut skies) = (Vec::new(), Vec::new());
    progress.begin("light", grid.size.samples() as u64);
    took.sun_s = start.elapsed().as_secs_f64();
    for z0 in (0..grid.size.height).step_by(ROWS) {
        if progress.cancelled() {
            return Err(Error::cancelled(heights.name()));
        }
        let start = Instant::now();
        let z1 = (z0 + ROWS as i64).min(grid.size.height);
        let count = (z1 - z0) as usize * width;
        hold(heights, z0, work)?;
        suns.resize(count, 0.0);
        sun.rows(&relief, z0..z1, &mut suns, work, progress)?;
        took.sun_s += start.elapsed().as_secs_f64();

        let start = Instant::now();
        if let Some(sky) = &sky {
            skies.resize(count, 0.0);
            sky.rows(&relief, z0..z1, &mut skies, work, progress)?;
        }
        levels.take(&suns, &skies, work);
        took.sky_s += start.elapsed().as_secs_f64();

        let start = Instant::now();
        while let Some(row) = due.next_if(|row| row.seen <= z1) {
            let level = writer.layout().parts()[row.part].level;
            let size = grid.level(level);
            let rows = row.y * TILE..((row.y + 1) * TILE).min(size.height);
            let shares = levels.give(level, rows);
            put_packed(writer, row, 4, work, progress, |x| {
                let columns = x * TILE..((x + 1) * TILE).min(size.width);
                crate::terrain::pack_light(&shares, size.width as usize, columns)
            })?;
        }
        took.write_s += start.elapsed().as_secs_f64();
        progress.advance(count as u64);
    }
    Ok(took)
}

/// Has the tiles in the cache that rows from `z0` on are likely to ask for next, each read once.
fn hold(heights: &TerrainFile, z0: i64, work: &dyn Work) -> Result<()> {
    let size = heights.grid().size;
    let wide = (size.width as u64).div_ceil(TILE as u64) as usize;
    if z0 % TILE != 0 {
        return Ok(());
    }
    // Of the first row of tiles nothing is there yet; the next one lies in the way of half of all light.
    let rows = if z0 == 0 {
        0..2
    } else {
        z0 / TILE + 1..z0 / TILE + 2
    };
    for z in rows.filter(|z| z * TILE < size.height) {
        let failed = std::sync::Mutex::new(None);
        work.each(wide, &|x| {
            if let Err(error) = heights.hold_heights(0, x as i64, z) {
                *failed.lock().unwrap_or_else(std::sync::PoisonError::into_inner) = Some(error);
            }
        });
        if let Some(error) = failed
            .into_inner()
            .unwrap_or_else(std::sync::PoisonError::into_inner)
        {
            return Err(error);
        }
    }
    Ok(())
}

/// The crests of a terrain file, whose heights are read once for them.
///
/// # Errors
/// Those of the file; [`crate::ErrorKind::Cancelled`].
pub(super) fn crests(heights: &TerrainFile, work: &dyn Work, progress: &dyn Progress) -> Result<Crests> {
    let grid = heights.grid();
    let mut crests = Crests::new(grid);
    progress.begin("crests", grid.size.samples() as u64);
    for z0 in (0..grid.size.height).step_by(TILE as usize) {
        if progress.cancelled() {
            return Err(Error::cancelled(heights.name()));
        }
        let z1 = (z0 + TILE).min(grid.size.height);
        let measured = super::bounds::each_tile(grid.size.width, work, |x0, x1| {
            let rect = Rect::new(x0, z0, x1, z1);
            let mut samples = vec![0.0; rect.area() as usize];
            heights.heights_strided(0, rect, rect.width() as usize, &mut samples)?;
            Ok((rect, Crests::measure(&samples, rect.width() as usize)))
        })?;
        measured.iter().for_each(|(rect, most)| crests.put(*rect, most));
        progress.advance((grid.size.width * (z1 - z0)) as u64);
    }
    Ok(crests)
}
