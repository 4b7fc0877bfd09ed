//! A sample of the errors that are stored, found anew by brute force: for up to 256 patches of all levels above 0, the
//! greatest difference between the level and level 0 at the samples of level 0 on the patch's ground.
//!
//! It shares no arithmetic with [`crate::pyramid`], which measures what is stored: each difference is a weighted mean of
//! corners in f64, as written down here. Which patches are looked at follows from the grid alone. Their ground is about a
//! tenth of all ground in the sum over the levels (most of it that of the coarsest level's one), and is at hand in the pass
//! that measures: the check costs next to nothing.

use crate::error::{Error, ErrorKind, Result};
use crate::grid::{Grid, PATCH, Patch, Rect};
use crate::levels::Bounds;
use crate::pyramid::Rows;

/// Patches that are looked at, at most.
const PATCHES: i64 = 256;

/// The ground of those of one level is at most this part of all ground over the number of levels, or one patch.
const GROUND_PART: i64 = 32;

/// The patches looked at.
pub(super) struct Tightness {
    patches: Vec<Chosen>,
}

/// A patch, and what is known of its error.
struct Chosen {
    patch: Patch,
    /// The samples of level 0 on its closed ground.
    ground: Rect,
    /// The greatest difference so far, in metres; none where its level and level 0 have not both been there.
    found: Option<f64>,
    /// What is stored.
    stored: Option<f32>,
}

/// What a block of level 0 adds: a patch by its number, and its greatest difference there.
pub(super) type Found = (usize, f64);

/// How near stored errors are to what they bound.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Tight {
    /// Patches looked at.
    pub(super) patches: u64,
    /// True over stored error of those that store more than 0: the median and the least. None where there are none.
    pub(super) median_and_least: Option<[f64; 2]>,
}

impl Tightness {
    /// The patches of `grid` to look at: of each level so many, spread over it.
    pub(super) fn new(grid: &Grid) -> Self {
        let mut patches = Vec::new();
        let levels = i64::from(grid.file_levels()) - 1;
        for level in 1..grid.file_levels() {
            let size = grid.patches(level);
            let side = PATCH << level;
            let affordable = grid.size.samples() / GROUND_PART / levels / (side * side);
            let wanted = (PATCHES / levels).min(affordable).clamp(1, size.samples());
            for k in 0..wanted {
                // Somewhere in the k-th of equal parts of the level, by Knuth's multiplicative hash.
                let (from, until) = (k * size.samples() / wanted, (k + 1) * size.samples() / wanted);
                let hash = (k + 131 * i64::from(level)).wrapping_mul(2_654_435_761) & 0xffff_ffff;
                let index = from + (hash >> 8) % (until - from);
                let (a, b) = (index % size.width, index / size.width);
                let ground = Rect::new(a * side, b * side, (a + 1) * side + 1, (b + 1) * side + 1);
                patches.push(Chosen {
                    patch: Patch::new(level, a, b),
                    ground: ground.intersection(grid.size.rect()),
                    found: None,
                    stored: None,
                });
            }
        }
        Self { patches }
    }

    /// What `block` of level 0, whose samples are `truth`, row by row, says of the patches. Of each level above 0,
    /// `levels` has the rows over the block, and the next one to the south where there is one.
    pub(super) fn look(&self, block: Rect, truth: &[f32], levels: &[Rows<'_>]) -> Vec<Found> {
        let mut all = Vec::new();
        for (number, chosen) in self.patches.iter().enumerate() {
            let ground = chosen.ground.intersection(block);
            if ground.is_empty() {
                continue;
            }
            let rows = &levels[chosen.patch.level as usize - 1];
            let mut most: Option<f64> = None;
            for z in ground.z0..ground.z1 {
                let row = (z - block.z0) * block.width() - block.x0;
                for x in ground.x0..ground.x1 {
                    let truth = f64::from(truth[(row + x) as usize]);
                    let difference = (surface(rows, chosen.patch.level, x, z) - truth).abs();
                    // No comparison with NaN holds: where either is void there is no difference.
                    if difference >= most.unwrap_or(0.0) {
                        most = Some(difference);
                    }
                }
            }
            all.extend(most.map(|most| (number, most)));
        }
        all
    }

    /// Takes what a block said.
    pub(super) fn add(&mut self, found: &[Found]) {
        for &(number, more) in found {
            let own = &mut self.patches[number].found;
            *own = Some(own.map_or(more, |own| own.max(more)));
        }
    }

    /// Takes the bounds of whole rows of patches of `level`, `width` in a row, that are stored from row `first` on.
    pub(super) fn stored(&mut self, level: u32, first: i64, width: i64, bounds: &[Bounds]) {
        let rows = first..first + bounds.len() as i64 / width;
        let of_level = |chosen: &&mut Chosen| chosen.patch.level == level && rows.contains(&chosen.patch.b);
        for chosen in self.patches.iter_mut().filter(of_level) {
            let Patch { a, b, .. } = chosen.patch;
            chosen.stored = Some(bounds[((b - first) * width + a) as usize].error);
        }
    }

    /// How tight the errors are, once all is known.
    ///
    /// # Errors
    /// [`ErrorKind::Broken`] where an error was found that is above the one stored in the file called `name`.
    pub(super) fn finish(&self, name: &str) -> Result<Tight> {
        let mut ratios = Vec::new();
        for chosen in &self.patches {
            let stored = f64::from(chosen.stored.unwrap_or(f32::NAN));
            // Patches without ground of their own store no number.
            let Some(found) = chosen.found else { continue };
            let holds = found <= stored;
            if !holds {
                let Patch { level, a, b } = chosen.patch;
                let what = format!(
                    "stores an error of {stored} m for patch ({a}, {b}) of level {level}, and brute force finds {found} m"
                );
                return Err(Error::new(ErrorKind::Broken, name, what)
                    .advice("report this, with the DEM; no file is kept"));
            }
            if stored > 0.0 {
                ratios.push(found / stored);
            }
        }
        ratios.sort_unstable_by(f64::total_cmp);
        Ok(Tight {
            patches: self.patches.len() as u64,
            median_and_least: ratios.first().map(|least| [ratios[ratios.len() / 2], *least]),
        })
    }
}

/// The surface of `level` over the sample (x, z) of level 0; NaN where a corner that has weight is void, or beyond the
/// level.
fn surface(rows: &Rows<'_>, level: u32, x: i64, z: i64) -> f64 {
    let step = 1i64 << level;
    let (i, j) = (x >> level, z >> level);
    let [u, v] = [x - i * step, z - j * step].map(|n| n as f64 / step as f64);
    let corner = |weight: f64, i: i64, j: i64| {
        if weight == 0.0 {
            0.0
        } else if rows.size.rect().contains(i, j) {
            weight * f64::from(rows.heights[((j - rows.first) * rows.size.width + i) as usize])
        } else {
            f64::NAN
        }
    };
    // Cells are split from their north-western to their south-eastern corner.
    let middle = if u < v {
        corner(v - u, i, j + 1)
    } else {
        corner(u - v, i + 1, j)
    };
    corner(1.0 - u.max(v), i, j) + middle + corner(u.min(v), i + 1, j + 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::levels::Levels;
    use crate::progress::Silent;
    use crate::pyramid::random::Random;
    use crate::pyramid::{Filter, Pyramid};
    use crate::work::Serial;

    fn pyramid(width: i64, height: i64, voids: f64) -> Pyramid {
        let grid = Grid::new(width, height, [1.0, 1.0]);
        let heights = Random::new(7).heights(grid.size.samples(), 0.0, 900.0, voids);
        let mut pyramid = Pyramid::new(grid, heights, None, &Filter::default(), &Serial, &Silent).unwrap();
        pyramid.bound(&Serial, &Silent).unwrap();
        pyramid
    }

    /// Looks at all of the pyramid in blocks of 256 x 256, with its stored bounds as `change` leaves them.
    fn checked(pyramid: &Pyramid, change: impl Fn(u32, &mut Bounds)) -> Result<Tight> {
        let grid = pyramid.grid();
        let mut tightness = Tightness::new(grid);
        let levels: Vec<Rows<'_>> = (1..grid.file_levels())
            .map(|l| Rows {
                size: grid.level(l),
                first: 0,
                heights: pyramid.level(l),
            })
            .collect();
        let whole = grid.size.rect();
        for z in (0..whole.z1).step_by(256) {
            for x in (0..whole.x1).step_by(256) {
                let block = Rect::new(x, z, x + 256, z + 256).intersection(whole);
                let mut truth = vec![0.0; block.area() as usize];
                let _ = pyramid.heights(0, block, &mut truth).unwrap();
                let found = tightness.look(block, &truth, &levels);
                tightness.add(&found);
            }
        }
        for l in 0..grid.file_levels() {
            let mut bounds = pyramid.level_bounds(l).to_vec();
            bounds.iter_mut().for_each(|bounds| change(l, bounds));
            let width = grid.patches(l).width;
            // In pieces, as they are stored.
            for (n, rows) in bounds.chunks(3 * width as usize).enumerate() {
                tightness.stored(l, 3 * n as i64, width, rows);
            }
        }
        tightness.finish("t")
    }

    #[test]
    fn true_errors_are_stored_and_a_spoiled_one_is_told() {
        for (width, height, voids) in [(700, 530, 0.0), (700, 530, 0.1), (1300, 70, 0.0), (70, 90, 0.0)] {
            let pyramid = pyramid(width, height, voids);
            let case = format!("{width} x {height}, {voids}");
            let tight = checked(&pyramid, |_, _| ()).unwrap();
            let [median, least] = tight.median_and_least.unwrap();
            assert!(tight.patches > 0 && tight.patches <= 256, "{case}");
            assert!(
                least > 0.99 && median > 0.9999 && median <= 1.0,
                "{case}: {median}, {least}"
            );
            // Controls: what is stored twice as great is half as tight; a little too small is an error, on any level.
            let loose = checked(&pyramid, |_, bounds| bounds.error *= 2.0).unwrap();
            assert!(
                (loose.median_and_least.unwrap()[0] - 0.5 * median).abs() < 1e-6,
                "{case}"
            );
            for level in 1..pyramid.grid().file_levels() {
                let spoiled = checked(&pyramid, |l, bounds| {
                    bounds.error *= if l == level { 0.999 } else { 1.0 };
                });
                let error = spoiled.unwrap_err();
                assert_eq!(error.kind(), ErrorKind::Broken, "{case}");
                let of_level = format!("of level {level}, and brute force finds");
                assert!(error.to_string().contains(&of_level), "{case}: {error}");
            }
        }
        // All void, or nothing above level 0: there is nothing to be tight.
        assert_eq!(
            checked(&pyramid(300, 300, 1.0), |_, _| ())
                .unwrap()
                .median_and_least,
            None
        );
        assert_eq!(checked(&pyramid(9, 9, 0.0), |_, _| ()).unwrap().patches, 0);
    }

    #[test]
    fn all_levels_have_patches_and_the_ground_looked_at_is_little() {
        for (width, height) in [
            (13_201, 4801),
            (65_536, 65_536),
            (1201, 1201),
            (1, 1),
            (1 << 30, 3),
        ] {
            let grid = Grid::new(width, height, [1.0, 1.0]);
            let patches = Tightness::new(&grid).patches;
            assert!(patches.len() <= 256);
            for level in 1..grid.file_levels() {
                let of_level = patches.iter().filter(|chosen| chosen.patch.level == level);
                assert!(of_level.clone().count() > 0, "level {level}");
                assert!(of_level.clone().all(|chosen| !chosen.ground.is_empty()));
            }
            let ground: i64 = patches.iter().map(|chosen| chosen.ground.area()).sum();
            if width == height && width > 2000 || width == 13_201 {
                assert!(ground < grid.size.samples() / 8, "{width}: {ground}");
            }
        }
    }
}
