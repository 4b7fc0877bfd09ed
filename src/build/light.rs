//! The third pass: the light of one sun and of the sky, traced over the heights of a terrain file.
//!
//! What is held depends on the DEM's width alone: for each column of level 0 5.5 KiB.

use std::io::{Seek, Write};
use std::ops::Range;
use std::time::Instant;

use half::f16;

use super::blocks::{Blocks, Traced};
use crate::error::Result;
use crate::grid::Grid;
use crate::levels::Levels;
use crate::light::{Earth, LightLevels, LightOptions, Relief, Skylight, Sunlight};
use crate::progress::Progress;
use crate::pyramid::Filter;
use crate::terrain::TerrainWriter;
use crate::terrain::layout::Kind;
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

/// Traces the light over `blocks` as `lit` says, filters it into all levels and puts them.
///
/// # Errors
/// Those of tracing and of the file; [`crate::ErrorKind::Cancelled`].
pub(super) fn write_light<W: Write + Seek + Sync + Send>(
    blocks: &Blocks<'_>,
    writer: &mut TerrainWriter<W>,
    lit: &Lit<'_>,
    work: &dyn Work,
    progress: &dyn Progress,
) -> Result<Took> {
    let start = Instant::now();
    let mut shares = Shares::new(blocks.heights().grid(), lit)?;
    let begun_s = start.elapsed().as_secs_f64();
    let write_s = blocks.write(&mut shares, writer, work, progress)?;
    Ok(Took {
        sun_s: begun_s + shares.sun_s,
        sky_s: shares.sky_s,
        write_s,
    })
}

/// The shares of the sun and of the sky.
struct Shares {
    sun: Sunlight,
    sky: Option<Skylight>,
    levels: LightLevels,
    grid: Grid,
    /// Of the rows that were traced last; no sky where that is whole.
    suns: Vec<f32>,
    skies: Vec<f32>,
    /// The rows that are ready, and their width.
    ready: [Vec<f16>; 2],
    ready_width: i64,
    sun_s: f64,
    sky_s: f64,
}

impl Shares {
    fn new(grid: &Grid, lit: &Lit<'_>) -> Result<Self> {
        let directions = lit.options.sky_directions;
        let sky = (directions > 0).then(|| Skylight::new(grid, lit.earth, directions));
        Ok(Self {
            sun: Sunlight::new(grid, lit.earth, lit.options.sun)?,
            levels: LightLevels::new(grid, lit.filter, sky.is_some()),
            sky,
            grid: *grid,
            suns: Vec::new(),
            skies: Vec::new(),
            ready: Default::default(),
            ready_width: 0,
            sun_s: 0.0,
            sky_s: 0.0,
        })
    }
}

impl Traced for Shares {
    const KIND: Kind = Kind::Light;
    const NAME: &str = "light";
    const SAMPLE_BYTES: usize = 4;

    fn trace(
        &mut self,
        relief: &Relief<'_>,
        rows: Range<i64>,
        work: &dyn Work,
        progress: &dyn Progress,
    ) -> Result<()> {
        let start = Instant::now();
        let count = ((rows.end - rows.start) * self.grid.size.width) as usize;
        self.suns.resize(count, 0.0);
        self.sun
            .rows(relief, rows.clone(), &mut self.suns, work, progress)?;
        self.sun_s += start.elapsed().as_secs_f64();

        let start = Instant::now();
        if let Some(sky) = &self.sky {
            self.skies.resize(count, 0.0);
            sky.rows(relief, rows, &mut self.skies, work, progress)?;
        }
        self.sky_s += start.elapsed().as_secs_f64();
        Ok(())
    }

    fn filter(&mut self, rows: Range<i64>, work: &dyn Work) {
        let start = Instant::now();
        let width = self.grid.size.width;
        let rows = (rows.start * width) as usize..(rows.end * width) as usize;
        let skies = if self.sky.is_some() {
            &self.skies[rows.clone()]
        } else {
            &[]
        };
        self.levels.take(&self.suns[rows], skies, work);
        self.sky_s += start.elapsed().as_secs_f64();
    }

    fn known(&self, level: u32) -> i64 {
        self.levels.known(level)
    }

    fn ready(&mut self, level: u32, rows: Range<i64>, work: &dyn Work) {
        self.ready_width = self.grid.level(level).width;
        self.ready = self.levels.give(level, rows, work);
    }

    fn pack(&self, columns: Range<i64>) -> Vec<u8> {
        crate::terrain::pack_light(&self.ready, self.ready_width as usize, columns)
    }

    fn forget(&mut self) {
        self.ready = Default::default();
    }
}
