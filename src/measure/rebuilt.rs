//! The coarser levels of a terrain made anew by other filters, in memory.

use crate::build::{Threads, needed_bytes};
use crate::error::{Error, ErrorKind, Result};
use crate::grid::Rect;
use crate::levels::{Arrival, Levels, LightSample};
use crate::light::light_levels;
use crate::progress::Progress;
use crate::pyramid::{Filter, FilterKind, Pyramid};
use crate::stream::{Origin, Terrain};

/// The pyramid of level 0 of `terrain` by each of `kinds`, with bounds, and with its traced light where there is some.
///
/// # Errors
/// [`ErrorKind::Limit`] where they need more than `memory_bytes`; those of reading; [`ErrorKind::Cancelled`].
pub fn rebuilt<'a>(
    terrain: &Terrain,
    kinds: &[FilterKind],
    memory_bytes: u64,
    threads: &Threads,
    progress: &dyn Progress,
) -> Result<Vec<(FilterKind, Box<dyn Levels + 'a>)>> {
    let grid = *terrain.grid();
    let needed = needed_bytes(&grid, terrain.has_light()).saturating_mul(kinds.len() as u64);
    if needed > memory_bytes {
        let what = format!(
            "rebuilding it with {} filters needs {} MiB of memory, {} MiB are allowed",
            kinds.len(),
            needed.div_ceil(1 << 20),
            memory_bytes >> 20
        );
        return Err(Error::new(ErrorKind::Limit, terrain.name(), what)
            .advice("name fewer with --filter (none for no other), or allow more with --memory"));
    }
    if kinds.is_empty() {
        return Ok(Vec::new());
    }
    let arrived = |arrival| match arrival {
        Arrival::Arrived => Ok(()),
        Arrival::Missing => Err(Error::new(
            ErrorKind::Unsupported,
            terrain.name(),
            "its level 0 is not there yet",
        )),
    };
    let whole = grid.size.rect();
    let mut heights = vec![0.0; grid.size.samples() as usize];
    let rows = (0..grid.size.height).step_by(256);
    for z in rows.clone() {
        let rect = Rect::new(0, z, whole.x1, (z + 256).min(whole.z1));
        let from = (z * grid.size.width) as usize;
        arrived(terrain.heights(0, rect, &mut heights[from..from + rect.area() as usize])?)?;
    }
    let mut light = Vec::new();
    if terrain.has_light() {
        light.resize(heights.len(), LightSample::default());
        for z in rows {
            let rect = Rect::new(0, z, whole.x1, (z + 256).min(whole.z1));
            let from = (z * grid.size.width) as usize;
            arrived(terrain.light(0, rect, &mut light[from..from + rect.area() as usize])?)?;
        }
    }
    // A step of which rounding makes that of the file's own levels above 0.
    let step_m = match terrain.origin() {
        Origin::File(meta) => meta.rounding_step_m.map(|step| 4.0 * step),
        Origin::Dem(description) => description.step_m,
    };
    let mut all: Vec<(FilterKind, Box<dyn Levels>)> = Vec::new();
    for &kind in kinds {
        let filter = Filter::from(kind);
        let mut made = Pyramid::new(grid, heights.clone(), step_m, &filter, threads, progress)?;
        made.bound(threads, progress)?;
        if !light.is_empty() {
            let share = |of: fn(&LightSample) -> f32| light.iter().map(of).collect::<Vec<f32>>();
            let (sun, sky) = (share(|l| l.sun.to_f32()), share(|l| l.sky.to_f32()));
            made.set_light(light_levels(
                &grid, &heights, sun, sky, &filter, threads, progress,
            )?)?;
        }
        all.push((kind, Box::new(made)));
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::build_pyramid;
    use crate::progress::Silent;
    use crate::source::Synth;

    #[test]
    fn the_filter_of_a_terrain_rebuilt_gives_its_own_levels_and_another_others() {
        let synth = Synth::new(200, 3).unwrap();
        let terrain = Terrain::from_source(&synth, &Silent).unwrap();
        let own = build_pyramid(&synth, &Filter::default(), &Silent).unwrap();
        let threads = Threads::new(0).unwrap();
        let kinds = [FilterKind::default(), FilterKind::Point];
        let made = rebuilt(&terrain, &kinds, u64::MAX, &threads, &Silent).unwrap();
        let all = |levels: &dyn Levels, level| {
            let rect = own.grid().level(level).rect();
            let mut heights = vec![0.0; rect.area() as usize];
            assert_eq!(
                levels.heights(level, rect, &mut heights).unwrap(),
                Arrival::Arrived
            );
            heights
        };
        for level in 0..own.level_count() {
            assert_eq!(all(made[0].1.as_ref(), level), own.level(level), "level {level}");
            assert_eq!(all(made[1].1.as_ref(), level) == own.level(level), level == 0);
        }
        let error = rebuilt(&terrain, &kinds, 1 << 20, &threads, &Silent)
            .err()
            .unwrap();
        assert!(error.to_string().contains("--filter"), "{error}");
    }
}
