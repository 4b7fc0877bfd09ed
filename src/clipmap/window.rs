//! A level's window: which samples are resident, and their mirror on the CPU, from which the GPU is fed.

mod take_over;

use half::f16;

use super::arrivals::Faults;
use super::constants::{Ring, VOID_HEIGHT, light_level};
use super::eye::Eye;
use super::missing::Missing;
use super::plan::{LIGHT_BYTES, LevelPlan};
use super::relief;
use crate::error::{Error, ErrorKind, Result};
use crate::grid::{Grid, PATCH, Patch, Rect, Size, seam_pieces, slot};
use crate::levels::{Arrival, Bounds, Data, DaySample, Levels, Wanted};

/// What a window knows of a patch.
#[derive(Clone, Copy, Debug)]
pub struct PatchInfo {
    /// The patch's stored bounds.
    pub bounds: Bounds,
    /// Whether a resident sample of it is void.
    pub voids: bool,
    /// Whether one of a finer level over its ground is, or was while the patch was resident.
    pub voids_below: bool,
}

/// A texel of the light texture: share of the sun, share of the sky, slope to the east, slope to the south.
pub type LightTexel = [f16; 4];

/// A texel of light over a day: first light, its softness, last light, its softness; see
/// [`crate::light::sun_of_day`]. Beside it the light texel holds, in place of the share of the sun, how far the slopes of
/// the ground under it spread about the level's.
pub type DayTexel = [f16; 4];

/// The samples of a level around the camera, addressed toroidally.
#[derive(Clone, Debug)]
pub struct Window {
    level: u32,
    size: Size,
    n: i64,
    shift: [i64; 2],
    resident: Rect,
    heights: Vec<f32>,
    light_n: i64,
    light_level_size: Size,
    light_shift: [i64; 2],
    light: Vec<LightTexel>,
    /// Empty where no light over a day is held.
    day: Vec<DayTexel>,
    patch_slots: i64,
    patch_resident: Rect,
    patches: Vec<Option<PatchInfo>>,
    /// Patches of which something was read, until that is handed up.
    noted: Vec<[i64; 2]>,
    has_met_voids: bool,
    provisional: bool,
    pub(super) missing: Missing,
}

impl Window {
    /// An empty window of `level`.
    pub fn new(level: u32, grid: &Grid, ring: &Ring) -> Self {
        let n = ring.clip_size;
        let light_n = ring.light_size();
        let patch_slots = n / PATCH + 2; // a window touches one patch more than it holds, at each end
        Self {
            level,
            size: grid.level(level),
            n,
            shift: grid.offset.map(|o| o >> level),
            resident: Rect::EMPTY,
            heights: vec![f32::NAN; (n * n) as usize],
            light_n,
            light_level_size: grid.level(light_level(level)),
            light_shift: grid.offset.map(|o| o >> light_level(level)),
            light: vec![LightTexel::default(); (light_n * light_n) as usize],
            day: Vec::new(),
            patch_slots,
            patch_resident: Rect::EMPTY,
            patches: vec![None; (patch_slots * patch_slots) as usize],
            noted: Vec::new(),
            has_met_voids: false,
            provisional: false,
            missing: Missing::default(),
        }
    }

    /// The same, which holds light over a day too if `day`.
    #[must_use]
    pub fn with_day(mut self, day: bool) -> Self {
        let count = if day { self.light.len() } else { 0 };
        self.day = vec![DayTexel::default(); count];
        self
    }

    /// The level.
    pub fn level(&self) -> u32 {
        self.level
    }

    /// The samples that the window is for: all of them are resident but for those that are missing.
    pub fn resident(&self) -> Rect {
        self.resident
    }

    /// The light texels over the same ground, in samples of the level whose light this one holds.
    pub fn light_resident(&self) -> Rect {
        self.light_of(self.resident)
    }

    /// Whether some of it stands in for data that were not there.
    pub fn is_provisional(&self) -> bool {
        self.provisional
    }

    /// The samples that have not arrived, as disjoint rectangles. Their light has not arrived either.
    pub fn missing(&self) -> impl Iterator<Item = Rect> {
        self.missing.rects()
    }

    /// The samples that have arrived, as disjoint rectangles.
    pub fn arrived(&self) -> Vec<Rect> {
        self.missing().fold(vec![self.resident], |arrived, missing| {
            arrived
                .into_iter()
                .flat_map(|rect| rect.difference(missing))
                .collect()
        })
    }

    /// Where the window of a level of `size` samples belongs for an eye: around it, but held within the level, so
    /// that a level that fits is held whole and one at whose border the eye stands wastes nothing beyond it.
    pub fn placed(size: Size, n: i64, level: u32, eye: &Eye) -> Rect {
        let axis = |anchor: i64, samples: i64| {
            if samples <= n {
                return (0, samples);
            }
            // From here N samples hold everything nearer than R = N/2 - 2, and a sample more on each side.
            let first = ((anchor >> level) - n / 2 + 1).clamp(0, samples - n);
            (first, first + n)
        };
        let (x0, x1) = axis(eye.anchor[0], size.width);
        let (z0, z1) = axis(eye.anchor[1], size.height);
        Rect::new(x0, z0, x1, z1)
    }

    /// Where this window belongs for an eye.
    pub fn target(&self, eye: &Eye) -> Rect {
        Self::placed(self.size, self.n, self.level, eye)
    }

    /// The light texels over the ground of the samples `rect`, in samples of the level whose light this one holds.
    pub fn light_of(&self, rect: Rect) -> Rect {
        let scale = if self.level == 0 { 1 } else { 2 };
        Rect::new(rect.x0 * scale, rect.z0 * scale, rect.x1 * scale, rect.z1 * scale)
            .intersection(self.light_level_size.rect())
    }

    /// Pieces of `rect`, contiguous in this window's slots.
    pub fn pieces(&self, rect: Rect) -> impl Iterator<Item = Rect> {
        seam_pieces(rect, self.n, self.shift)
    }

    /// Pieces of the light texels `rect`, contiguous in slots.
    pub fn light_pieces(&self, rect: Rect) -> impl Iterator<Item = Rect> {
        seam_pieces(rect, self.light_n, self.light_shift)
    }

    /// Column and row of the slot of sample (i, j).
    pub fn slot_of(&self, i: i64, j: i64) -> [i64; 2] {
        [slot(i + self.shift[0], self.n), slot(j + self.shift[1], self.n)]
    }

    /// Column and row of the slot of light texel (i, j).
    pub fn light_slot_of(&self, i: i64, j: i64) -> [i64; 2] {
        [
            slot(i + self.light_shift[0], self.light_n),
            slot(j + self.light_shift[1], self.light_n),
        ]
    }

    /// The height in metres above the DEM's base at sample (i, j), NaN for no data; none where it is not resident.
    pub fn height(&self, i: i64, j: i64) -> Option<f32> {
        let arrived = self.resident.contains(i, j) && !self.missing.contains(i, j);
        arrived.then(|| self.heights[self.index(i, j)])
    }

    /// What is in the slot of sample (i, j), be it that sample or another: what the shader reads.
    pub fn slot_height(&self, i: i64, j: i64) -> f32 {
        self.heights[self.index(i, j)]
    }

    /// The mirror of the height texture: `n` x `n` slots, row by row.
    pub fn heights(&self) -> &[f32] {
        &self.heights
    }

    /// The mirror of the light texture, row by row of slots.
    pub fn light(&self) -> &[LightTexel] {
        &self.light
    }

    /// The mirror of the texture of light over a day, in the slots of light; empty where none is held.
    pub fn day(&self) -> &[DayTexel] {
        &self.day
    }

    /// Bytes of a light texel, light over a day included where it is held.
    pub fn light_bytes(&self) -> u64 {
        if self.day.is_empty() {
            LIGHT_BYTES
        } else {
            2 * LIGHT_BYTES
        }
    }

    /// Slots along a side of the light texture.
    pub fn light_size(&self) -> i64 {
        self.light_n
    }

    /// What is known of patch (a, b); none where no sample of it has arrived.
    pub fn patch(&self, a: i64, b: i64) -> Option<&PatchInfo> {
        if !self.patch_resident.contains(a, b) {
            return None;
        }
        self.patches[self.patch_index(a, b)].as_ref()
    }

    /// What is known of all its patches.
    pub(super) fn known_patches(&self) -> impl Iterator<Item = &PatchInfo> {
        let patches = self.patch_resident.cells();
        patches.filter_map(|(a, b)| self.patch(a, b))
    }

    /// Whether all samples of patch (a, b) that the window is for have arrived.
    pub(super) fn has_all_of(&self, a: i64, b: i64) -> bool {
        let samples = Patch::new(self.level, a, b).samples_within(self.size);
        self.missing.is_empty() || self.missing.rects().all(|r| r.intersection(samples).is_empty())
    }

    /// Moves to `target`. What that exposes is missing until [`Window::fill`] has read it.
    pub(super) fn move_to(&mut self, target: Rect) {
        if target == self.resident {
            return;
        }
        self.missing.follow(self.resident, target);
        let patches = target.touching_patches(self.size);
        for gained in patches.difference(self.patch_resident) {
            for (a, b) in gained.cells() {
                let index = self.patch_index(a, b);
                self.patches[index] = None;
            }
        }
        self.resident = target;
        self.patch_resident = patches;
    }

    /// Adds to `wanted` what [`Window::fill`] will ask for to read `rect`.
    pub(super) fn wants(&self, rect: Rect, has_light: bool, wanted: &mut Vec<Wanted>) {
        let (level, fine) = (self.level, light_level(self.level));
        let mut add = |data, level, rect: Rect| {
            if !rect.is_empty() {
                wanted.push(Wanted { data, level, rect });
            }
        };
        add(Data::Bounds, level, rect.touching_patches(self.size));
        add(Data::Heights, level, rect);
        let light = self.light_of(rect);
        if has_light {
            add(Data::Light, fine, light);
        }
        if !self.day.is_empty() {
            add(Data::Day, fine, light);
        }
        // For the slopes.
        add(
            Data::Heights,
            fine,
            light.grown(1).intersection(self.light_level_size.rect()),
        );
    }

    /// Reads the samples `rect`, which must be missing, with their light and the bounds of their patches, into the
    /// mirror; where they arrive, lists the rectangles that were written, split at the seams. Whoever calls takes
    /// `rect` from what is missing.
    ///
    /// The light of a level is as fine as the next finer level, whose data may be damaged where its own are not: if
    /// `faults` are taken, such a fault is added to them and the light is as fine as the level itself.
    ///
    /// # Errors
    /// Those of `source`. The samples are then still missing.
    pub(super) fn fill(
        &mut self,
        source: &dyn Levels,
        rect: Rect,
        written: &mut LevelPlan,
        scratch: &mut Scratch,
        mut faults: Option<&mut Faults>,
    ) -> Result<Arrival> {
        let patches = rect.touching_patches(self.size).intersection(self.patch_resident);
        let unknown = |(a, b)| self.patches[self.patch_index(a, b)].is_none();
        let wants_bounds = self.provisional || patches.cells().any(unknown);
        if wants_bounds {
            scratch.bounds.resize(patches.area() as usize, Bounds::VOID);
            if source.bounds(self.level, patches, &mut scratch.bounds)? == Arrival::Missing {
                return Ok(Arrival::Missing);
            }
        }
        for piece in seam_pieces(rect, self.n, self.shift) {
            scratch.heights.resize(piece.area() as usize, 0.0);
            if source.heights(self.level, piece, &mut scratch.heights)? == Arrival::Missing {
                return Ok(Arrival::Missing);
            }
            // A source of the caller's own may not know that infinities, and what stands for no data on the GPU, are none.
            let none = |h: &&mut f32| !h.is_finite() || **h == VOID_HEIGHT;
            scratch
                .heights
                .iter_mut()
                .filter(none)
                .for_each(|h| *h = f32::NAN);
            let first = self.index(piece.x0, piece.z0);
            copy_rows(&scratch.heights, &mut self.heights[first..], piece, self.n);
        }
        let light = self.light_of(rect);
        for piece in seam_pieces(light, self.light_n, self.light_shift) {
            let fine = light_level(self.level);
            let day = !self.day.is_empty();
            let arrival = match (relief::read(source, fine, piece, day, scratch), &mut faults) {
                (Err(fault), Some(faults)) if fine < self.level && is_damage(&fault) => {
                    let coarser = relief::read_coarser(source, fine, piece, day, scratch)?;
                    faults.push(fault);
                    coarser
                }
                (arrival, _) => arrival?,
            };
            if arrival == Arrival::Missing {
                return Ok(Arrival::Missing);
            }
            let [x, z] = self.light_slot_of(piece.x0, piece.z0);
            let first = (z * self.light_n + x) as usize;
            copy_rows(&scratch.texels, &mut self.light[first..], piece, self.light_n);
            if day {
                copy_rows(&scratch.days, &mut self.day[first..], piece, self.light_n);
            }
        }
        for (k, (a, b)) in patches.cells().enumerate() {
            let bounds = if wants_bounds {
                Some(scratch.bounds[k])
            } else {
                None
            };
            self.note_patch(a, b, bounds);
        }
        self.provisional |= source.is_provisional();
        written.heights.extend(self.pieces(rect));
        written.light.extend(self.light_pieces(light));
        Ok(Arrival::Arrived)
    }

    /// Notes what is known of a patch some of whose samples have just been read. A patch keeps its flag when samples
    /// leave the window or are not there yet: it may then say void in vain, never the reverse.
    fn note_patch(&mut self, a: i64, b: i64, bounds: Option<Bounds>) {
        let samples = Patch::new(self.level, a, b)
            .samples_within(self.size)
            .intersection(self.resident);
        let voids = samples
            .cells()
            .any(|(i, j)| self.heights[self.index(i, j)].is_nan());
        let index = self.patch_index(a, b);
        let voids_below = self.patches[index].is_some_and(|p| p.voids_below);
        // What was handed up before holds still.
        let is_news = self.patches[index].is_none_or(|p| voids && !p.voids);
        let known = self.patches[index].map(|p| p.bounds);
        let bounds = match (known, bounds) {
            // What stood in for these data is still drawn beside them.
            (Some(known), Some(bounds)) if self.provisional => Some(both(&known, &bounds)),
            _ => known.or(bounds),
        };
        self.patches[index] = bounds.map(|bounds| PatchInfo {
            bounds,
            voids,
            voids_below,
        });
        self.has_met_voids |= voids;
        if is_news {
            self.noted.push([a, b]);
        }
    }

    /// A patch of which something was read since it was last taken here.
    pub(super) fn take_noted(&mut self) -> Option<[i64; 2]> {
        self.noted.pop()
    }

    /// Whether any patch ever had voids.
    pub(super) fn has_met_voids(&self) -> bool {
        self.has_met_voids
    }

    /// Whether the window is for samples of patch (a, b), known or not.
    pub(super) fn is_for_patch(&self, a: i64, b: i64) -> bool {
        self.patch_resident.contains(a, b)
    }

    /// Notes voids of a finer level over the ground of patch (a, b), if that is known.
    pub(super) fn note_voids_below(&mut self, a: i64, b: i64) {
        if self.patch_resident.contains(a, b) {
            let index = self.patch_index(a, b);
            if let Some(info) = &mut self.patches[index] {
                info.voids_below = true;
            }
        }
    }

    fn index(&self, i: i64, j: i64) -> usize {
        let [x, z] = self.slot_of(i, j);
        (z * self.n + x) as usize
    }

    fn patch_index(&self, a: i64, b: i64) -> usize {
        (slot(b, self.patch_slots) * self.patch_slots + slot(a, self.patch_slots)) as usize
    }
}

/// Bounds of a patch that holds samples of both.
fn both(a: &Bounds, b: &Bounds) -> Bounds {
    Bounds {
        min: a.min.min(b.min),
        max: a.max.max(b.max),
        error: a.error.max(b.error),
        need_min: a.need_min.min(b.need_min),
        need_max: a.need_max.max(b.need_max),
        need_error: a.need_error.max(b.need_error),
    }
}

/// Whether an error is about data that are damaged or cannot be read, not about what was asked for.
pub(super) fn is_damage(error: &Error) -> bool {
    matches!(error.kind(), ErrorKind::Broken | ErrorKind::Io)
}

/// Memory that is used anew at every update.
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch {
    heights: Vec<f32>,
    bounds: Vec<Bounds>,
    pub(super) relief: Vec<f32>,
    pub(super) shares: Vec<crate::levels::LightSample>,
    pub(super) texels: Vec<LightTexel>,
    pub(super) rows: relief::Rows,
    pub(super) day_samples: Vec<DaySample>,
    pub(super) days: Vec<DayTexel>,
}

/// Copies a rectangle's rows into the rows of a square of `n` slots, from its first slot on.
fn copy_rows<T: Copy>(rows: &[T], slots: &mut [T], rect: Rect, n: i64) {
    let (width, n) = (rect.width() as usize, n as usize);
    for (row, out) in rows.chunks_exact(width).zip(slots.chunks_mut(n)) {
        out[..width].copy_from_slice(row);
    }
}
