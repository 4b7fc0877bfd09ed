//! What near ground hides of far ground: an occlusion horizon, raised patch by patch from the eye outwards.
//!
//! After Lloyd and Egbert, "Horizon Occlusion Culling for Real-time Rendering of Hierarchical Terrains" (2002). The horizon
//! is the greatest tangent of elevation, for each of a circle's bins of directions over the ground, below which
//! everything farther out is hidden. It is conservative, so that the picture is the same with and without it:
//!
//! *A patch raises it* over the bins that it fills from side to side. Every ray of such a bin meets the patch's ground
//! somewhere between its nearest and its farthest place, and the drawn surface there is no lower than the patch's least
//! height. So a ray that passes below that height at the nearest place (at the farthest, for heights above the eye, whose
//! tangent falls with distance) is under the surface when it leaves the patch. It started above it, and between the eye and
//! the patch the surface has no gap (fact (a) of [`super::alpha`]): it has gone through the surface, and what it meets later
//! is hidden.
//!
//! *It started above it*: the horizon is used only where all that is drawn nearer than the near plane reaches is
//! below the eye by more than that. So nothing that hides is cut away, and a ray to anything that is drawn starts above.
//!
//! *No gap*: a patch that may have voids raises nothing, and no patch after it raises the bins that it touches, as rays may
//! have slipped below the surface there; nor does one where that is not known. The DEM's edge is no such gap: no ray comes
//! back over it.
//!
//! *What is farther out* comes later in the walk: it takes halves of the ground in the order in which any ray from
//! the eye meets them.
//!
//! *Rounding.* Directions and tangents keep a distance of [`SLACK_PX`] pixels, to which rasterisers may snap vertices,
//! and of what f32 loses of a position on its way to the screen.

use std::ops::Range;

use glam::DVec3;

use super::screen::Screen;

/// Bins to a quarter of the circle.
const QUARTER: usize = 256;
const BINS: usize = 4 * QUARTER;

/// Twice what a snap to sixteenths of a pixel moves a vertex by, on both axes: no rasteriser may be coarser.
const SLACK_PX: f64 = 0.1;

/// The share of a tangent, and of 1, that is kept besides: far more than a handful of roundings of f32.
const SLACK: f64 = 1e-5;

/// The share of a height that is kept: a few roundings of 2^-24 of a height over the DEM's base.
const HEIGHT_SLACK: f64 = 5e-7;

/// What lies over the ground of a box, as seen from the eye.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sector {
    /// Where it begins and ends, in bins: from east over south, west and north. May end in the next turn.
    bins: [f64; 2],
    /// The least and the greatest distance over the ground.
    distances: [f64; 2],
    /// The least and the greatest height above the eye.
    heights: [f64; 2],
}

impl Sector {
    /// That of the box from `low` to `high` in metres from the eye; none where it is above or below the eye.
    pub(super) fn new(low: DVec3, high: DVec3) -> Option<Self> {
        let side = |low: f64, high: f64| i32::from(low > 0.0) - i32::from(high < 0.0);
        let (east, south) = (side(low.x, high.x), side(low.z, high.z));
        let pick = |positive: bool, low: f64, high: f64| if positive { high } else { low };
        // The corners that its outline ends at, turning from east to south.
        let (from, to) = match (east, south) {
            (0, 0) => return None,
            (_, 0) => {
                let x = pick(east < 0, low.x, high.x);
                (
                    [x, pick(east < 0, low.z, high.z)],
                    [x, pick(east > 0, low.z, high.z)],
                )
            }
            (0, _) => {
                let z = pick(south < 0, low.z, high.z);
                (
                    [pick(south > 0, low.x, high.x), z],
                    [pick(south < 0, low.x, high.x), z],
                )
            }
            _ => (
                [pick(south > 0, low.x, high.x), pick(east < 0, low.z, high.z)],
                [pick(south < 0, low.x, high.x), pick(east > 0, low.z, high.z)],
            ),
        };
        let (first, mut last) = (bin(from), bin(to));
        if last < first {
            last += BINS as f64;
        }
        let nearest = |low: f64, high: f64| low.max(-high).max(0.0);
        let farthest = |low: f64, high: f64| high.max(-low);
        let length = |x: f64, z: f64| (x * x + z * z).sqrt();
        Some(Self {
            bins: [first, last],
            distances: [
                length(nearest(low.x, high.x), nearest(low.z, high.z)),
                length(farthest(low.x, high.x), farthest(low.z, high.z)),
            ],
            heights: [low.y, high.y],
        })
    }

    /// The least tangent of elevation that the least height may have (`k` is 0), or the greatest that the greatest may
    /// (`k` is 1).
    fn tangent(&self, k: usize, height_slack_m: f64) -> f64 {
        let height = self.heights[k] + height_slack_m;
        let nearer = (k == 0) == (height <= 0.0);
        height / self.distances[usize::from(!nearer)]
    }
}

/// Where a direction over the ground falls on the circle, in bins: rises with the angle, at most by `QUARTER` a radian.
fn bin([x, z]: [f64; 2]) -> f64 {
    let along = x / (x.abs() + z.abs());
    QUARTER as f64 * if z >= 0.0 { 1.0 - along } else { 3.0 + along }
}

/// Bins from `first` to `end`, less than a turn, as ranges of the circle's: the second one is empty where they do not go
/// round it.
fn turns(first: usize, end: usize) -> [Range<usize>; 2] {
    let start = first % BINS;
    let end = start + (end - first).min(BINS);
    [start..end.min(BINS), 0..end.saturating_sub(BINS)]
}

/// How much of a picture's precision is kept between what hides and what is hidden.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Slack {
    /// The angle of [`SLACK_PX`] pixels in the picture's middle, where they are widest.
    angle: f64,
    /// Metres up as drawn.
    height_m: f64,
    /// What is nearer than this to the eye may be cut away, in metres.
    cut_m: f64,
}

impl Slack {
    /// For a screen and for heights above the DEM's base, times the vertical scale, of up to `greatest_m`.
    pub(super) fn new(screen: &Screen, greatest_m: f64) -> Self {
        Self {
            angle: SLACK_PX * screen.widest_pixel(),
            height_m: HEIGHT_SLACK * greatest_m,
            cut_m: screen.drawn_from_m() * (1.0 + SLACK),
        }
    }

    /// What is nearer than this to the eye may be cut away, in metres.
    pub(super) fn cut_m(&self) -> f64 {
        self.cut_m
    }

    /// Metres up as drawn.
    pub(super) fn height_m(&self) -> f64 {
        self.height_m
    }
}

/// The horizon of what a walk has met so far.
#[derive(Clone, Debug)]
pub(super) struct OcclusionHorizon {
    tangents: Box<[f32; BINS]>,
    /// What a bin may still be raised to: all, or nothing after a gap.
    ceilings: Box<[f32; BINS]>,
    /// None where it is not used.
    slack: Option<Slack>,
    /// Whether gaps are closed to what comes after: a control of tests.
    pub(super) heeds_gaps: bool,
}

impl Default for OcclusionHorizon {
    fn default() -> Self {
        Self {
            tangents: Box::new([f32::NEG_INFINITY; BINS]),
            ceilings: Box::new([f32::INFINITY; BINS]),
            slack: None,
            heeds_gaps: true,
        }
    }
}

impl OcclusionHorizon {
    /// Begins anew; without slack it hides nothing.
    pub(super) fn begin(&mut self, slack: Option<Slack>) {
        self.slack = slack;
        if slack.is_some() {
            self.tangents.fill(f32::NEG_INFINITY);
            self.ceilings.fill(f32::INFINITY);
        }
    }

    /// Whether it is used.
    pub(super) fn is_used(&self) -> bool {
        self.slack.is_some()
    }

    /// Whether all of a sector is hidden.
    pub(super) fn hides(&self, sector: &Sector) -> bool {
        let Some(slack) = self.slack else { return false };
        let tangent = sector.tangent(1, slack.height_m);
        let steepest = tangent.abs().max(sector.tangent(0, -slack.height_m).abs());
        let widened = slack.angle * (1.0 + steepest * steepest) + SLACK * (1.0 + steepest);
        let aside = QUARTER as f64 * (slack.angle * (1.0 + steepest) + SLACK);
        let [first, last] = [sector.bins[0] - aside, sector.bins[1] + aside];
        // Steep or near sectors, whose slack goes round the circle, and numbers that are none.
        let is_narrow = last - first < BINS as f64 / 2.0;
        if !is_narrow {
            return false;
        }
        let least = (tangent + widened) as f32;
        // A bin below 0 is one of the turn before.
        let first = (first + BINS as f64) as usize;
        let end = (last + BINS as f64) as usize + 1;
        turns(first, end)
            .into_iter()
            .all(|bins| self.tangents[bins].iter().all(|tangent| *tangent > least))
    }

    /// Raises it by a patch without voids.
    pub(super) fn raise(&mut self, sector: &Sector) {
        let Some(slack) = self.slack else { return };
        let tangent = sector.tangent(0, -slack.height_m);
        if !tangent.is_finite() {
            return;
        }
        let tangent = tangent as f32;
        let (first, end) = (sector.bins[0].ceil() as usize, sector.bins[1] as usize);
        for bins in turns(first, end.max(first)) {
            for (least, ceiling) in self.tangents[bins.clone()].iter_mut().zip(&self.ceilings[bins]) {
                *least = least.max(tangent.min(*ceiling));
            }
        }
    }

    /// Notes that ground may have gaps, or all ground around the eye: nothing behind raises the horizon.
    pub(super) fn open(&mut self, sector: Option<&Sector>) {
        if !self.heeds_gaps {
            return;
        }
        let Some(sector) = sector else {
            self.ceilings.fill(f32::NEG_INFINITY);
            return;
        };
        let first = (sector.bins[0] + BINS as f64 - 1.0) as usize;
        let end = first + (sector.bins[1] - sector.bins[0]) as usize + 4;
        for bins in turns(first, end) {
            self.ceilings[bins].fill(f32::NEG_INFINITY);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pyramid::random::Random;

    fn sectors(count: usize, mut check: impl FnMut(&mut Random, DVec3, DVec3, Sector)) {
        let mut random = Random::new(4);
        let mut made = 0;
        while made < count {
            let mut between = |low: f64, high: f64| low + (high - low) * random.unit();
            let low = DVec3::new(between(-9.0, 5.0), between(-9.0, 5.0), between(-9.0, 5.0));
            let high = low + DVec3::new(between(0.1, 8.0), between(0.0, 4.0), between(0.1, 8.0));
            if let Some(sector) = Sector::new(low, high) {
                made += 1;
                check(&mut random, low, high, sector);
            }
        }
    }

    /// Whether a bin's place is between the sector's, whatever the turn.
    fn holds(sector: &Sector, bin: f64) -> bool {
        let [first, last] = sector.bins;
        let slack = 1e-9;
        [bin, bin + BINS as f64]
            .iter()
            .any(|b| (first - slack..=last + slack).contains(b))
    }

    #[test]
    fn a_sector_holds_what_is_over_its_ground_and_nothing_else() {
        let mut beside = 0;
        sectors(500, |random, low, high, sector| {
            for _ in 0..40 {
                let p = low + (high - low) * DVec3::new(random.unit(), random.unit(), random.unit());
                assert!(
                    holds(&sector, bin([p.x, p.z])),
                    "{p} of {low} to {high}: {sector:?}"
                );
                let away = p.x.hypot(p.z);
                let [near, far] = sector.distances;
                assert!((near - 1e-9..=far + 1e-9).contains(&away), "{away}: {sector:?}");
                let tangent = p.y / away;
                let [least, greatest] = [0, 1].map(|k| sector.tangent(k, 0.0));
                assert!(
                    (least - 1e-9..=greatest + 1e-9).contains(&tangent),
                    "{tangent}: {sector:?}"
                );
                // A ray of any direction meets the ground just where its bin is the sector's.
                let angle = std::f64::consts::TAU * random.unit();
                let (x, z) = (angle.cos(), angle.sin());
                let along = |low: f64, high: f64, d: f64| {
                    let ends = [low / d, high / d];
                    [ends[0].min(ends[1]), ends[0].max(ends[1])]
                };
                let (a, b) = (along(low.x, high.x, x), along(low.z, high.z, z));
                let meets = a[0].max(b[0]).max(0.0) <= a[1].min(b[1]);
                assert_eq!(meets, holds(&sector, bin([x, z])), "{x} {z}, {low} to {high}");
                beside += u32::from(!meets);
            }
        });
        assert!(beside > 5000, "{beside}");
        let around = Sector::new(DVec3::new(-1.0, -9.0, -1.0), DVec3::new(1.0, -8.0, 1.0));
        assert_eq!(around, None);
    }

    #[test]
    fn bins_turn_from_east_over_south_by_at_most_a_quarter_a_radian() {
        for k in 0..4000 {
            let place = |k: i32| {
                let angle = f64::from(k) * std::f64::consts::TAU / 4000.0;
                bin([angle.cos(), angle.sin()])
            };
            let step = place(k + 1) - place(k);
            let step = if step < 0.0 { step + BINS as f64 } else { step };
            let most = QUARTER as f64 * std::f64::consts::TAU / 4000.0;
            assert!((0.0..=most + 1e-9).contains(&step), "{k}: {step}");
        }
    }

    #[test]
    fn a_ridge_hides_what_is_lower_behind_it_unless_there_was_a_gap() {
        let slack = Slack {
            angle: 1e-4,
            height_m: 1e-3,
            cut_m: 0.1,
        };
        let patch = |x: f64, z: f64, low: f64, high: f64| {
            Sector::new(DVec3::new(x, low, z), DVec3::new(x + 10.0, high, z + 10.0)).unwrap()
        };
        // North of the eye, 100 m away, no lower than 10 m below it.
        let ridge = patch(-5.0, -110.0, -10.0, 5.0);
        let [behind, higher, beside] = [
            patch(-4.0, -310.0, -90.0, -40.0),
            patch(-4.0, -310.0, -90.0, -20.0),
            patch(40.0, -310.0, -90.0, -40.0),
        ];
        let mut horizon = OcclusionHorizon::default();
        horizon.raise(&ridge);
        assert!(!horizon.is_used() && !horizon.hides(&behind));
        horizon.begin(Some(slack));
        assert!(!horizon.hides(&behind), "nothing is before it yet");
        horizon.raise(&ridge);
        let hidden = [behind, higher, beside].map(|s| horizon.hides(&s));
        assert_eq!(hidden, [true, false, false]);
        for gap in [Some(patch(-5.0, -60.0, 0.0, 0.0)), None] {
            horizon.begin(Some(slack));
            horizon.open(gap.as_ref());
            horizon.raise(&ridge);
            assert!(!horizon.hides(&behind), "there is a gap before the ridge");
            horizon.begin(Some(slack));
            horizon.raise(&ridge);
            horizon.open(gap.as_ref());
            assert!(horizon.hides(&behind), "what was hidden before the gap stays so");
        }
        // Heights that are no numbers hide nothing and are not hidden.
        horizon.begin(Some(slack));
        horizon.raise(&patch(-5.0, -110.0, f64::NEG_INFINITY, f64::INFINITY));
        assert!(!horizon.hides(&behind));
        horizon.raise(&ridge);
        assert!(!horizon.hides(&patch(-4.0, -310.0, f64::NEG_INFINITY, f64::INFINITY)));
    }
}
