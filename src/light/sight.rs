//! How high the terrain stands along the rays of one azimuth over each sample of a block.
//!
//! With H the height over a ray at distance t and h its sample's, `(H - h) / t` is monotone between two crossings, so
//! its greatest value is taken at a crossing. (On a curved earth that is short of the truth by at most half a
//! crossing's distance from the last over the earth's radius: 1e-5 for cells of 100 m.) An edge counts where its two
//! ends are valid, a sample that the ray hits where it is; what is void or beyond the DEM does not stand in the way.
//!
//! The terrain is looked at block by block and, for each, in runs of crossings outward: the heights that the block's
//! rays meet in a run are fetched, so that what is held depends neither on the DEM's size nor on how far a shadow
//! comes from. A few samples beside each other walk their rays at once. A run is left out where the highest ground
//! that it may pass over could not raise the horizon of any: with H never above M, `(M - h) / t` for the nearest t of
//! a run bounds all of it, as long as the tangent sought is at least 0. That is exact, in whatever order runs are
//! looked at: so those that promise most come first.
//!
//! Differences of heights are formed first, so that in f32 a rise is off by at most 2^-22 of the differences it is
//! made of; heights must lie within 1e38 m of each other.

use super::rays::Rays;
use super::region::Region;
use super::relief::{GROUPS, LANES, Relief, Scratch, lanes, lanes_mut, place};
use super::stage::{STRIDE, Stage};
use super::tops::Tops;
use crate::error::Result;
use crate::grid::Rect;

/// Stages at which all samples look.
const NEAR: i64 = 2;

/// What a block looks at: reused from block to block.
#[derive(Default)]
pub(super) struct Sight {
    region: Region,
    room: Stage,
    /// Groups of samples that are not decided; those of them that may look at the next stages, and those that look at
    /// a run.
    open: Vec<u32>,
    near: Vec<u32>,
    looking: Vec<u32>,
    far: Vec<Far>,
}

/// A stage that is not near.
#[derive(Clone, Copy)]
struct Far {
    k: i64,
    /// Its highest ground, and the greatest tangent at which any of the block could see it.
    most: f32,
    tangent: f32,
}

/// Who looks where.
struct Block<'a> {
    rect: Rect,
    /// Its own heights; see [`Scratch`].
    own: &'a [f32],
    rays: &'a Rays,
    until: f32,
}

impl Block<'_> {
    fn heights(&self, group: u32) -> &[f32; LANES] {
        let [x, z] = place(group);
        lanes(self.own, (z + 1) * STRIDE + x + 1)
    }

    /// Whether ground as high as `most` at a distance of `1 / per_m` could raise any tangent of a group.
    fn could_rise(&self, group: u32, most: f32, per_m: f32, drop: f32, tangents: &[f32]) -> bool {
        let tangents = lanes(tangents, group as usize * LANES);
        could_rise(most, per_m, drop, self.heights(group), tangents)
    }
}

impl Relief<'_> {
    /// Raises each of `tangents`, at least 0, to the tangent of the elevation of the terrain along `rays` over its
    /// sample; the samples are those of `block`, in rows of [`super::relief::BLOCK`]`[0]`, whose own heights have been
    /// fetched. Where one is void or its tangent not below `until`, the tangent becomes infinite.
    pub(super) fn raise(
        &self,
        rays: &Rays,
        block: Rect,
        until: f32,
        tangents: &mut [f32],
        scratch: &mut Scratch,
    ) -> Result<()> {
        let Scratch { own, sight, .. } = scratch;
        let block = Block {
            rect: block,
            own,
            rays,
            until,
        };
        sight.open(&block, tangents);
        sight.near.clone_from(&sight.open);
        for k in 0..rays.stages().min(NEAR) {
            self.look(&block, k, tangents, sight)?;
        }
        if sight.open.is_empty() {
            return Ok(());
        }
        self.rank(&block, sight);
        for at in 0..sight.far.len() {
            let Far { k, most, tangent } = sight.far[at];
            let (per_m, drop) = rays.beyond(k);
            let Sight { open, near, .. } = sight;
            near.clear();
            open.retain(|&group| {
                if block.could_rise(group, most, per_m, drop, tangents) {
                    near.push(group);
                }
                // Of the stages that are left none stands higher over any of the block.
                lanes(tangents, group as usize * LANES)
                    .iter()
                    .any(|&least| least < tangent)
            });
            if open.is_empty() {
                break;
            }
            self.look(&block, k, tangents, sight)?;
        }
        Ok(())
    }

    /// Finds the stages that are not near and how high their ground may stand over the block's lowest open sample, the
    /// highest first: what they raise leaves the fewest of the others to be looked at.
    fn rank(&self, block: &Block<'_>, sight: &mut Sight) {
        let lowest = |group: &u32| block.heights(*group).iter().fold(f32::INFINITY, |l, &h| l.min(h));
        let h = sight.open.iter().map(lowest).fold(f32::INFINITY, f32::min);
        let far = |k: i64| {
            let (per_m, drop) = block.rays.beyond(k);
            let most = self.crests.over(block.rays.swept(k, block.rect));
            let tangent = (most - h) * per_m - drop;
            Far { k, most, tangent }
        };
        sight.far.clear();
        sight.far.extend((NEAR..block.rays.stages()).map(far));
        sight.far.retain(|far| far.tangent > 0.0);
        sight
            .far
            .sort_unstable_by(|a, b| b.tangent.total_cmp(&a.tangent).then(a.k.cmp(&b.k)));
    }

    /// Has the groups of `sight.near` look at stage `k`.
    fn look(&self, block: &Block<'_>, k: i64, tangents: &mut [f32], sight: &mut Sight) -> Result<()> {
        let Sight {
            region,
            room,
            near,
            looking,
            ..
        } = sight;
        if near.is_empty() {
            return Ok(());
        }
        // No height is below the one and no tangent below the other of those that may look.
        let [mut lowest, mut least] = [f32::INFINITY; 2];
        for &group in &*near {
            let tangents = lanes(tangents, group as usize * LANES);
            for (&h, &tangent) in block.heights(group).iter().zip(tangents) {
                if tangent < f32::INFINITY {
                    (lowest, least) = (lowest.min(h), least.min(tangent));
                }
            }
        }
        let stage = block.rays.stage(k, room);
        for &longest in &stage.longest {
            let run = &stage.runs[longest as usize];
            looking.clear();
            let tops = Tops::new(&self.crests, block.rays.strips(), block.rect, run.begin);
            if (tops.greatest() - lowest) * run.per_m - run.drop <= least {
                continue;
            }
            for &group in &*near {
                if block.could_rise(group, tops.highest(place(group)), run.per_m, run.drop, tangents) {
                    looking.push(group);
                }
            }
            let Some(seen) = Seen::of(looking, run.hull, block.rect) else {
                continue;
            };
            self.fetch(seen.rect, region.room(seen.rect.height() as usize))?;
            region.measure(seen.rect.width() as usize, block.rays.strips());
            looking.retain(|&group| {
                let tangents = lanes(tangents, group as usize * LANES);
                region.any_could_rise(stage, longest, seen.from(group), block.heights(group), tangents)
            });
            region.measure_finely(seen.rect.width() as usize, block.rays.strips(), looking.len());
            // What the samples above see is most likely seen from here.
            let mut likely = [usize::MAX; GROUPS];
            for &group in &*looking {
                let likely = &mut likely[place(group)[0] / LANES];
                let tangents = lanes_mut(tangents, group as usize * LANES);
                let h = block.heights(group);
                region.walk(stage, longest, seen.from(group), block.until, h, tangents, likely);
            }
        }
        Ok(())
    }
}

/// What groups that look at a run see.
struct Seen {
    /// Its north-western corner in the block's columns and rows.
    corner: [i64; 2],
    rect: Rect,
}

impl Seen {
    /// What `groups` of `block` see of a run of `hull`; none where there are none.
    fn of(groups: &[u32], hull: Rect, block: Rect) -> Option<Self> {
        let (first, last) = (place(*groups.first()?)[1], place(*groups.last()?)[1]);
        let columns = groups.iter().map(|&group| place(group)[0]);
        let [west, east] = columns.fold([usize::MAX, 0], |[w, e], x| [w.min(x), e.max(x)]);
        let corner = [west as i64 + hull.x0, first as i64 + hull.z0];
        Some(Self {
            corner,
            rect: Rect::new(
                block.x0 + corner[0],
                block.z0 + corner[1],
                block.x0 + (east + LANES) as i64 + hull.x1 - 1,
                block.z0 + last as i64 + hull.z1,
            ),
        })
    }

    /// Where a group lies from its corner.
    fn from(&self, group: u32) -> [i64; 2] {
        let at = place(group);
        [0, 1].map(|c| at[c] as i64 - self.corner[c])
    }
}

impl Sight {
    /// Finds the groups of `block` that are not decided.
    fn open(&mut self, block: &Block<'_>, tangents: &mut [f32]) {
        let wide = (block.rect.width() as usize).div_ceil(LANES);
        self.open.clear();
        for z in 0..block.rect.height() as usize {
            for x in 0..wide {
                let group = (z * GROUPS + x) as u32;
                let (h, t) = (block.heights(group), lanes_mut(tangents, group as usize * LANES));
                let mut decided = true;
                for l in 0..LANES {
                    if h[l].is_nan() || t[l] >= block.until {
                        t[l] = f32::INFINITY;
                    }
                    decided &= t[l] == f32::INFINITY;
                }
                if !decided {
                    self.open.push(group);
                }
            }
        }
    }
}

/// Whether ground of height `most` at a distance of `1 / per_m` could raise any of `tangents` over samples of heights
/// `h`.
pub(super) fn could_rise(
    most: f32,
    per_m: f32,
    drop: f32,
    h: &[f32; LANES],
    tangents: &[f32; LANES],
) -> bool {
    // False for voids, and for what is decided.
    (0..LANES).fold(false, |any, l| any | ((most - h[l]) * per_m - drop > tangents[l]))
}
