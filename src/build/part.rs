//! A part of a terrain as a DEM of its own, to be written as a file: heights or light of a level, or a level's error.

use crate::error::{Error, ErrorKind, Result};
use crate::grid::{Grid, Rect};
use crate::levels::{Levels, LightSample};
use crate::source::{Description, HeightSource};

/// Which part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartKind {
    /// Heights of the level, metres.
    Height,
    /// Share of the sun's disc that is seen, times the cosine to it: 0 to 1.
    Sun,
    /// Share of the sky that is seen: 0 to 1.
    Sky,
    /// `S_l - S0` in metres at every sample of level 0: how far the level's surface lies above the DEM's own. No data
    /// where either has none.
    Error,
}

impl PartKind {
    /// All, by their names on the command line.
    pub const NAMED: [(&str, Self); 4] = [
        ("height", Self::Height),
        ("sun", Self::Sun),
        ("sky", Self::Sky),
        ("error", Self::Error),
    ];
}

/// A part of the level of a terrain.
pub struct Part<'a> {
    levels: &'a dyn Levels,
    kind: PartKind,
    level: u32,
    description: Description,
}

impl<'a> Part<'a> {
    /// The part `kind` of `level`. `source` says what is known of level 0: the part has its name and its place. Sample i
    /// of level l lies over column i 2^l, so the first sample stays where it is, and pixels are 2^l times as large; the
    /// error has the grid of level 0.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] for a level that is not there, and for light where there is none.
    pub fn new(levels: &'a dyn Levels, source: &Description, kind: PartKind, level: u32) -> Result<Self> {
        let misuse = |what: String| Error::new(ErrorKind::Misuse, &source.name, what);
        let count = levels.level_count();
        if level >= count {
            let what = format!("has no level {level}");
            return Err(misuse(what).advice(format!("its levels are 0 to {}", count - 1)));
        }
        if matches!(kind, PartKind::Sun | PartKind::Sky) && !levels.has_light() {
            return Err(misuse("has no light".into()).advice("preprocess the DEM, which traces it"));
        }
        let mut description = source.clone();
        if kind != PartKind::Height {
            description.grid.base_m = 0.0;
            description.vertical_unit = "unknown".into();
            if let Some(place) = &mut description.place
                && let [Some(code), Some(_)] = place.epsg()
            {
                place.crs = Some(format!("EPSG:{code}"));
            }
        }
        if kind != PartKind::Error {
            let step = f64::from(level).exp2();
            description.grid.size = levels.grid().level(level);
            description.grid.spacing_m = description.grid.spacing_m.map(|s| s * step);
            if let Some(place) = &mut description.place {
                place.pixel = place.pixel.map(|p| p * step);
            }
        }
        Ok(Self {
            levels,
            kind,
            level,
            description,
        })
    }

    /// `S_l - S0` at the samples `rect` of level 0.
    fn error(&self, rect: Rect, out: &mut [f32]) -> Result<()> {
        read(self.levels, 0, rect, out)?;
        let size = self.levels.grid().level(self.level);
        let level = self.level;
        let coarse = Rect::new(
            rect.x0 >> level,
            rect.z0 >> level,
            (((rect.x1 - 1) >> level) + 2).min(size.width),
            (((rect.z1 - 1) >> level) + 2).min(size.height),
        );
        let mut heights = vec![0.0; coarse.area() as usize];
        read(self.levels, level, coarse, &mut heights)?;
        let width = coarse.width();
        let step = 1_i64 << level;
        let at = |x: i64, z: i64| f64::from(heights[((z - coarse.z0) * width + x - coarse.x0) as usize]);
        for ((x, z), out) in rect.cells().zip(out) {
            let (i, j) = (x >> level, z >> level);
            let (u, v) = (
                (x - i * step) as f64 / step as f64,
                (z - j * step) as f64 / step as f64,
            );
            *out = (on_quad(u, v, |x, z| at(i + x, j + z)) - f64::from(*out)) as f32;
        }
        Ok(())
    }
}

/// The height at (u, v) of a quad of which `corner` gives the corners (0 west and north, 1 east and south). It is split
/// from north-west to south-east; a corner without weight is not asked for, as it may be void or not there.
fn on_quad(u: f64, v: f64, corner: impl Fn(i64, i64) -> f64) -> f64 {
    // The third corner is the north-eastern or the south-western.
    let (third, across, along) = if u >= v { ((1, 0), u, v) } else { ((0, 1), v, u) };
    let weights = [((0, 0), 1.0 - across), (third, across - along), ((1, 1), along)];
    let weighted = weights.into_iter().filter(|(_, weight)| *weight > 0.0);
    weighted.map(|((x, z), weight)| weight * corner(x, z)).sum()
}

/// Heights of a level; a source that waits has all of them.
fn read(levels: &dyn Levels, level: u32, rect: Rect, out: &mut [f32]) -> Result<()> {
    levels.heights(level, rect, out).map(drop)
}

impl HeightSource for Part<'_> {
    fn description(&self) -> &Description {
        &self.description
    }

    fn read(&self, rect: Rect, out: &mut [f32]) -> Result<()> {
        let Grid { size, .. } = self.description.grid;
        if !size.rect().contains_rect(rect) || out.len() as i64 != rect.area() {
            let what = format!("{rect:?} with {} places does not fit {size:?}", out.len());
            return Err(Error::new(ErrorKind::Misuse, &self.description.name, what));
        }
        match self.kind {
            _ if rect.is_empty() => Ok(()),
            PartKind::Height => read(self.levels, self.level, rect, out),
            PartKind::Error => self.error(rect, out),
            PartKind::Sun | PartKind::Sky => {
                let mut light = vec![LightSample::default(); out.len()];
                // As for heights: what is not there is an error.
                self.levels.light(self.level, rect, &mut light).map(drop)?;
                for (out, light) in out.iter_mut().zip(light) {
                    *out = match self.kind {
                        PartKind::Sun => light.sun,
                        _ => light.sky,
                    }
                    .to_f32();
                }
                Ok(())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::build_pyramid;
    use crate::grid::Patch;
    use crate::levels::Bounds;
    use crate::progress::Silent;
    use crate::pyramid::Filter;
    use crate::source::{Georeference, Registration, Synth};

    fn all(source: &dyn HeightSource) -> Vec<f32> {
        let size = source.description().grid.size;
        let mut out = vec![0.0; size.samples() as usize];
        source.read(size.rect(), &mut out).unwrap();
        out
    }

    /// Synthetic land with a void in it.
    struct Holed(Synth);

    impl HeightSource for Holed {
        fn description(&self) -> &Description {
            HeightSource::description(&self.0)
        }

        fn read(&self, rect: Rect, out: &mut [f32]) -> Result<()> {
            HeightSource::read(&self.0, rect, out)?;
            for ((x, z), h) in rect.cells().zip(out) {
                if (30..41).contains(&x) && (50..53).contains(&z) {
                    *h = f32::NAN;
                }
            }
            Ok(())
        }
    }

    #[test]
    fn the_error_of_a_level_is_within_its_bounds_and_reaches_them() {
        let source = Holed(Synth::new(150, 3).unwrap());
        let pyramid = build_pyramid(&source, &Filter::default(), &Silent).unwrap();
        let size = source.description().grid.size;
        let of = |level| all(&Part::new(&pyramid, source.description(), PartKind::Error, level).unwrap());
        assert!(of(0).iter().all(|e| e.is_nan() || *e == 0.0));
        for level in 1..pyramid.level_count() {
            let errors = of(level);
            let patches = pyramid.grid().patches(level);
            let mut bounds = vec![Bounds::VOID; patches.samples() as usize];
            pyramid
                .bounds(level, patches.rect(), &mut bounds)
                .map(drop)
                .unwrap();
            let (mut most, mut bound) = (0.0f32, 0.0f32);
            for ((a, b), bounds) in patches.rect().cells().zip(&bounds) {
                let own = Patch::new(level, a, b).samples();
                let last = |end: i64| ((end - 1) << level) + 1;
                let ground = Rect::new(own.x0 << level, own.z0 << level, last(own.x1), last(own.z1));
                let within = ground.intersection(size.rect());
                for (x, z) in within.cells() {
                    let error = errors[(z * size.width + x) as usize].abs();
                    assert!(
                        error.is_nan() || error <= bounds.error,
                        "({x}, {z}): {error}, {bounds:?}"
                    );
                    most = most.max(error);
                }
                bound = bound.max(bounds.error);
            }
            assert!(most > 0.9 * bound, "level {level}: {most} of {bound}");
        }
    }

    #[test]
    fn a_quad_is_interpolated_on_the_triangle_that_holds_the_place() {
        let corner = |x: i64, z: i64| [[0.0, 10.0], [100.0, 1000.0]][z as usize][x as usize];
        for (u, v, want) in [
            (0.0, 0.0, 0.0),
            (0.5, 0.0, 5.0),
            (0.5, 0.5, 500.0),
            (0.0, 0.25, 25.0),
            (0.75, 0.25, 0.5 * 10.0 + 0.25 * 1000.0),
            (0.25, 0.75, 0.5 * 100.0 + 0.25 * 1000.0),
        ] {
            assert_eq!(on_quad(u, v, corner), want, "({u}, {v})");
        }
        let void = |x: i64, z: i64| if (x, z) == (1, 1) { f64::NAN } else { 4.0 };
        assert_eq!(on_quad(0.5, 0.0, void), 4.0);
        assert!(on_quad(0.5, 0.25, void).is_nan());
    }

    #[test]
    fn a_level_lies_where_its_samples_lie() {
        let synth = Synth::new(150, 3).unwrap();
        let mut description = HeightSource::description(&synth).clone();
        description.place = Some(Georeference {
            crs: Some("EPSG:32633+5703".into()),
            origin: [500.0, 900.0],
            pixel: [2.0, -3.0],
            registration: Registration::Area,
            geographic: false,
        });
        let part = |kind, level| Part::new(&synth, &description, kind, level);
        let height = part(PartKind::Height, 2).unwrap();
        let d = height.description();
        let place = d.place.as_ref().unwrap();
        assert_eq!((place.origin, place.pixel), ([500.0, 900.0], [8.0, -12.0]));
        assert_eq!(place.crs.as_deref(), Some("EPSG:32633+5703"));
        assert_eq!(d.grid.size, description.grid.level(2));
        let error = part(PartKind::Error, 2).unwrap();
        let d = error.description();
        assert_eq!(
            (d.grid.size, d.vertical_unit.as_str()),
            (description.grid.size, "unknown")
        );
        assert_eq!(d.place.as_ref().unwrap().crs.as_deref(), Some("EPSG:32633"));
        assert!(part(PartKind::Height, 99).is_err());
        let error = part(PartKind::Sun, 0).err().unwrap();
        assert!(error.to_string().contains("has no light"), "{error}");
    }
}
