//! A part of a DEM, and a spacing given by the user in place of the file's.

use super::{Crop, Description, Georeference, HeightSource, OpenOptions, Overview, Reads, geographic};
use crate::error::{Error, ErrorKind, Result};
use crate::grid::Rect;
use crate::progress::Progress;

/// A sample this near to an edge, in steps, is on it: coordinates are typed in decimals.
const EDGE_STEPS: f64 = 1e-6;

/// A DEM of which a rectangle is seen.
struct Part {
    whole: Box<dyn HeightSource>,
    at: [i64; 2],
    description: Description,
}

/// Applies the crop and the spacing of `options` to a DEM that is open.
///
/// # Errors
/// [`ErrorKind::Misuse`] where the crop is not in the DEM or the spacing impossible.
pub(super) fn apply(whole: Box<dyn HeightSource>, options: &OpenOptions) -> Result<Box<dyn HeightSource>> {
    if options.crop.is_none() && options.spacing_m.is_none() {
        return Ok(whole);
    }
    let mut description = whole.description().clone();
    let all = description.grid.size.rect();
    let rect = match options.crop {
        None => all,
        Some(Crop::Samples(rect)) => rect,
        Some(Crop::Place {
            west,
            north,
            east,
            south,
        }) => within(&description, [west, north, east, south])?,
    };
    if rect.is_empty() || !all.contains_rect(rect) {
        let what = format!(
            "has {} x {} samples, among which columns {} to {}, rows {} to {} are not",
            all.x1,
            all.z1,
            rect.x0,
            rect.x1 - 1,
            rect.z0,
            rect.z1 - 1
        );
        return Err(Error::new(ErrorKind::Misuse, &description.name, what).advice("ask for a part of it"));
    }
    cut(&mut description, rect);
    if let Some(spacing_m) = options.spacing_m {
        // What was said of the spacing that is not used would be wrong.
        let of_spacing = |s: &String| {
            ["spacing", "cell size", "units are taken"]
                .iter()
                .any(|w| s.contains(w))
        };
        description.assumed.retain(|s| !of_spacing(s));
        let [dx, dz] = spacing_m;
        description
            .assumed
            .push(format!("The spacing is {dx} x {dz} m, as asked for."));
        description.grid.spacing_m = spacing_m;
    }
    description
        .grid
        .check()
        .map_err(|what| Error::new(ErrorKind::Misuse, &description.name, what))?;
    Ok(Box::new(Part {
        whole,
        at: [rect.x0, rect.z0],
        description,
    }))
}

/// Makes the description one of `rect` alone: degrees are turned into metres at its own middle latitude.
fn cut(description: &mut Description, rect: Rect) {
    let Description {
        grid, place, assumed, ..
    } = description;
    let whole = grid.size;
    grid.size.width = rect.width();
    grid.size.height = rect.height();
    grid.offset[0] += rect.x0;
    grid.offset[1] += rect.z0;
    let Some(place) = place else { return };
    let old = geographic::spacing_m(place, whole).ok();
    place.origin = place.place(rect.x0 as f64, rect.z0 as f64);
    if !place.geographic {
        return;
    }
    if let (Some((_, said)), Ok((spacing_m, sentence))) = (old, geographic::spacing_m(place, grid.size)) {
        grid.spacing_m = spacing_m;
        match assumed.iter_mut().find(|s| **s == said) {
            Some(old) => *old = sentence,
            None => assumed.push(sentence),
        }
    }
}

/// The samples that lie within CRS coordinates, edges included.
fn within(description: &Description, [west, north, east, south]: [f64; 4]) -> Result<Rect> {
    let misuse = |what: String| Error::new(ErrorKind::Misuse, &description.name, what);
    let Some(place) = &description.place else {
        return Err(
            misuse("does not say where it lies".into()).advice("crop it by samples, with --srcwin X,Y,W,H")
        );
    };
    if !(west <= east && south <= north) {
        return Err(misuse(format!(
            "west {west} and east {east}, or north {north} and south {south}, are swapped"
        )));
    }
    let size = description.grid.size;
    let range = |axis: usize, from: f64, to: f64, count: i64| {
        let Georeference { origin, pixel, .. } = place;
        let steps = [from, to].map(|v| (v - origin[axis]) / pixel[axis]);
        let low = (steps[0].min(steps[1]) - EDGE_STEPS).ceil().max(0.0);
        let high = (steps[0].max(steps[1]) + EDGE_STEPS)
            .floor()
            .min((count - 1) as f64);
        (low as i64, high as i64 + 1, low <= high)
    };
    let (x0, x1, some_columns) = range(0, west, east, size.width);
    let (z0, z1, some_rows) = range(1, north, south, size.height);
    if some_columns && some_rows {
        return Ok(Rect::new(x0, z0, x1, z1));
    }
    let first = place.origin;
    let last = place.place((size.width - 1) as f64, (size.height - 1) as f64);
    Err(misuse(format!(
        "has no sample within {west} to {east}, {south} to {north}: it lies within {} to {}, {} to {}",
        first[0].min(last[0]),
        first[0].max(last[0]),
        first[1].min(last[1]),
        first[1].max(last[1]),
    )))
}

impl HeightSource for Part {
    fn description(&self) -> &Description {
        &self.description
    }

    fn read(&self, rect: Rect, out: &mut [f32]) -> Result<()> {
        self.description.check_rect(rect, out)?;
        self.whole.read(rect.moved(self.at[0], self.at[1]), out)
    }

    fn held_bytes(&self) -> u64 {
        self.whole.held_bytes()
    }

    /// Those of the whole, of which the part may have read little.
    fn reads(&self) -> Reads {
        self.whole.reads()
    }

    /// Those of the whole, which reach beyond the part.
    fn overviews(&self) -> Result<Vec<Overview>> {
        let mut overviews = self.whole.overviews()?;
        for Overview { shift, .. } in &mut overviews {
            *shift = [shift[0] - self.at[0] as f64, shift[1] - self.at[1] as f64];
        }
        Ok(overviews)
    }

    /// Those of the whole: a part may be free of what they tell.
    fn remarks(&self, progress: &dyn Progress) -> Result<Vec<String>> {
        self.whole.remarks(progress)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Registration;
    use super::super::held::{Held, bare_description};
    use super::*;
    use crate::grid::Size;

    /// 5 x 4 samples, 10 column + row.
    fn dem(place: Option<Georeference>) -> Box<dyn HeightSource> {
        let size = Size { width: 5, height: 4 };
        let mut description = bare_description("t", "test", "uint8", size);
        if let Some(place) = place.as_ref().filter(|p| p.geographic) {
            let (spacing_m, sentence) = geographic::spacing_m(place, size).unwrap();
            description.grid.spacing_m = spacing_m;
            description.assumed = vec![sentence];
        }
        description.place = place;
        let heights = size.rect().cells().map(|(x, z)| (10 * x + z) as f32).collect();
        Box::new(Held::new(description, heights).unwrap())
    }

    fn place(origin: [f64; 2], step: f64, geographic: bool) -> Georeference {
        Georeference {
            crs: None,
            origin,
            pixel: [step, -step],
            registration: Registration::Point,
            geographic,
        }
    }

    fn crop(dem: Box<dyn HeightSource>, crop: Crop) -> Result<Box<dyn HeightSource>> {
        let options = OpenOptions {
            crop: Some(crop),
            ..OpenOptions::default()
        };
        apply(dem, &options)
    }

    fn window(west: f64, north: f64, east: f64, south: f64) -> Crop {
        Crop::Place {
            west,
            north,
            east,
            south,
        }
    }

    #[test]
    fn a_part_keeps_its_samples_places_and_indices() {
        let part = crop(
            dem(Some(place([100.0, 200.0], 10.0, false))),
            Crop::Samples(Rect::new(1, 2, 4, 4)),
        )
        .unwrap();
        let d = part.description();
        assert_eq!(
            (d.grid.size.width, d.grid.size.height, d.grid.offset),
            (3, 2, [1, 2])
        );
        assert_eq!(d.place.as_ref().unwrap().origin, [110.0, 180.0]);
        let mut out = [0.0; 2];
        part.read(Rect::new(1, 0, 2, 2), &mut out).unwrap();
        assert_eq!(out, [22.0, 23.0]);
        assert!(
            part.read(Rect::new(0, 0, 4, 1), &mut [0.0; 4]).is_err(),
            "beyond the part, though in the whole"
        );
    }

    /// A DEM that counts what is read of it and has one overview, of every fourth sample.
    struct Reduced(Box<dyn HeightSource>);

    impl HeightSource for Reduced {
        fn description(&self) -> &Description {
            self.0.description()
        }

        fn read(&self, rect: Rect, out: &mut [f32]) -> Result<()> {
            self.0.read(rect, out)
        }

        fn reads(&self) -> Reads {
            Reads {
                decoded: 7,
                ..Reads::default()
            }
        }

        fn overviews(&self) -> Result<Vec<Overview>> {
            Ok(vec![Overview {
                source: dem(None),
                step: [4.0, 4.0],
                shift: [1.5, 1.5],
            }])
        }
    }

    #[test]
    fn overviews_lie_where_they_lay_over_the_whole() {
        let part = crop(Box::new(Reduced(dem(None))), Crop::Samples(Rect::new(1, 2, 4, 4))).unwrap();
        let overviews = part.overviews().unwrap();
        assert_eq!((overviews[0].step, overviews[0].shift), ([4.0, 4.0], [0.5, -0.5]));
        assert_eq!(part.reads().decoded, 7);
    }

    #[test]
    fn coordinates_take_the_samples_on_their_edges_and_within() {
        let rect = |c| crop(dem(Some(place([0.1, 0.7], 0.1, false))), c).map(|p| p.description().grid);
        // 0.1 + 2 * 0.1 is not 0.3 in f64, yet the sample there is meant.
        let grid = rect(window(0.3, 0.65, 0.4, 0.45)).unwrap();
        assert_eq!((grid.offset, grid.size.width, grid.size.height), ([2, 1], 2, 2));
        let grid = rect(window(-9.0, 9.0, 9.0, -9.0)).unwrap();
        assert_eq!((grid.offset, grid.size.width, grid.size.height), ([0, 0], 5, 4));
        for bad in [
            window(0.31, 0.7, 0.39, 0.4),
            window(2.0, 3.0, 3.0, 2.0),
            window(0.3, 0.4, 0.2, 0.5),
            window(f64::NAN, 1.0, 1.0, 0.0),
        ] {
            assert_eq!(rect(bad).unwrap_err().kind(), ErrorKind::Misuse, "{bad:?}");
        }
        assert_eq!(
            crop(dem(None), window(0.0, 1.0, 1.0, 0.0)).err().unwrap().kind(),
            ErrorKind::Misuse
        );
    }

    #[test]
    fn what_is_not_there_is_refused() {
        for rect in [
            Rect::new(0, 0, 6, 1),
            Rect::new(-1, 0, 1, 1),
            Rect::new(2, 2, 2, 3),
            Rect::new(i64::MAX - 1, 0, i64::MAX, 1),
        ] {
            assert_eq!(
                crop(dem(None), Crop::Samples(rect)).err().unwrap().kind(),
                ErrorKind::Misuse
            );
        }
    }

    #[test]
    fn degrees_are_measured_at_the_parts_own_latitude() {
        let part = crop(
            dem(Some(place([7.0, 60.0], 5.0, true))),
            Crop::Samples(Rect::new(0, 3, 5, 4)),
        )
        .unwrap();
        let d = part.description();
        let at = place([7.0, 45.0], 5.0, true);
        let (spacing_m, sentence) = geographic::spacing_m(&at, Size { width: 5, height: 1 }).unwrap();
        assert_eq!((d.grid.spacing_m, &d.assumed), (spacing_m, &vec![sentence]));
    }

    #[test]
    fn a_spacing_replaces_what_was_assumed_of_it() {
        let asked = |spacing_m| {
            let options = OpenOptions {
                spacing_m: Some(spacing_m),
                ..OpenOptions::default()
            };
            apply(dem(None), &options)
        };
        let source = asked([2.0, 3.0]).unwrap();
        let d = source.description();
        assert_eq!(d.grid.spacing_m, [2.0, 3.0]);
        assert_eq!(
            d.assumed.iter().filter(|s| s.contains("spacing")).count(),
            1,
            "{:?}",
            d.assumed
        );
        assert_eq!(asked([0.0, 1.0]).err().unwrap().kind(), ErrorKind::Misuse);
    }
}
