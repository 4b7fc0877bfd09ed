//! `clipscape info`: what a DEM or terrain file is, and what was assumed of it.

use std::fmt::Write;

use serde::Serialize;

use super::args::InfoArgs;
use super::input::{self, Input};
use super::preprocess::clock;
use super::suspects::Suspects;
use super::{Failure, Outcome, print, say};
use crate::error::{Error, Result};
use crate::grid::{Grid, Rect, Size};
use crate::levels::{Bounds, Levels};
use crate::progress::Progress;
use crate::source::{self, Description, Georeference, HeightSource, Registration};
use crate::terrain::{LightMeta, TerrainFile};

/// A DEM of at most this many samples is read to say its least and greatest height and its voids.
const CHEAP_SAMPLES: i64 = 1 << 24;

/// Samples read at once, where rows are not longer.
const BAND_SAMPLES: i64 = 1 << 20;

/// What `--json` prints, one object.
#[derive(Debug, Serialize)]
struct Info {
    /// The file format.
    format: String,
    /// The type of its samples.
    #[serde(rename = "type")]
    sample_type: String,
    /// Columns.
    width: i64,
    /// Rows.
    height: i64,
    /// Metres between columns and between rows.
    spacing: [f64; 2],
    /// Least height in metres; null where it is not cheap to know, or there is none.
    min: Option<f64>,
    /// Greatest height in metres, likewise.
    max: Option<f64>,
    /// Samples without data; null where that is not cheap to know.
    voids: Option<u64>,
    /// The unit of heights as the file has them; `min` and `max` are metres. Null where it is not known.
    vertical_unit: Option<String>,
    /// What heights are measured from; null where that is not known.
    vertical_datum: Option<String>,
    /// The reference system; null where it is not known, as all that follow about the place.
    crs: Option<String>,
    /// The unit of its coordinates.
    unit: Option<String>,
    /// CRS units from column to column and from row to row.
    pixel: Option<[f64; 2]>,
    /// CRS coordinates of sample (0, 0).
    origin: Option<[f64; 2]>,
    /// CRS coordinates of the least and greatest easting and northing of any sample: west, south, east, north.
    extent: Option<[f64; 4]>,
    /// How the file registered its pixels.
    registration: Option<Registration>,
    /// Levels of its pyramid.
    levels: u32,
    /// The step in metres that was smoothed away of its heights, which moved by half of it at most; null where they are as
    /// they were read.
    destep: Option<f64>,
    /// How its light was traced; null where it has none.
    light: Option<Light>,
    /// Its light over a day; null where it has none.
    day: Option<DayInfo>,
    /// What was assumed because the file does not say, as sentences.
    assumed: Vec<String>,
    /// What a look at the samples showed that a user should know, as sentences.
    noticed: Vec<String>,
}

#[derive(Debug, Serialize)]
struct DayInfo {
    /// Suns that light was traced from.
    positions: u32,
    /// The moment of the sun's noon.
    noon: String,
    /// Hours by the sun, which stands highest at 12, at which the day begins and ends.
    hours: [f64; 2],
    /// Latitude and longitude in degrees.
    seen_from: [f64; 2],
}

#[derive(Debug, Serialize)]
struct Light {
    /// Azimuth and altitude of the sun in degrees.
    sun: [f64; 2],
    /// Directions in which the sky was looked for.
    sky_directions: u32,
}

/// Least and greatest height, less the grid's base, voids, and what looks like voids that nobody declared.
#[derive(Clone, Debug, Default, PartialEq)]
struct Heights {
    range: Option<[f32; 2]>,
    voids: Option<u64>,
    suspects: Suspects,
}

/// Runs the command.
pub(super) fn run(args: &InfoArgs, progress: &dyn Progress) -> Outcome {
    let info = match input::open(&args.input)? {
        Input::Dem(source) => of_dem(source.as_ref(), args.verify, progress)?,
        Input::Terrain(file) => {
            if args.verify {
                let faults = file.verify(progress)?;
                if !faults.is_empty() {
                    faults.iter().for_each(|fault| say(&fault.to_string()));
                    return Err(Failure::Said);
                }
            }
            of_terrain(&file, args.verify, progress)?
        }
    };
    if args.json {
        let json = serde_json::to_string(&info).expect("finite numbers and text are valid JSON");
        return print(&(json + "\n"));
    }
    print(&text(&source::name_of(&args.input.inputs), &info, args.verify))
}

fn of_dem(source: &dyn HeightSource, all: bool, progress: &dyn Progress) -> Result<Info> {
    let Description {
        grid,
        format,
        sample_type,
        place,
        assumed,
        name,
        vertical_unit,
        ..
    } = source.description();
    let suspects = Suspects::new(source.description());
    let heights = if all || grid.size.samples() <= CHEAP_SAMPLES {
        read_heights(name, grid, suspects, progress, |rect, out| source.read(rect, out))?
    } else {
        Heights::default()
    };
    let mut noticed = source.remarks(progress)?;
    noticed.extend(heights.suspects.sentences());
    let mut info = Info::new(
        grid,
        format,
        sample_type,
        place.as_ref(),
        vertical_unit,
        heights,
        None,
        assumed,
    );
    info.noticed = noticed;
    Ok(info)
}

fn of_terrain(file: &TerrainFile, all: bool, progress: &dyn Progress) -> Result<Info> {
    let (grid, meta) = (file.grid(), file.meta());
    let heights = if all || grid.size.samples() <= CHEAP_SAMPLES {
        read_heights(file.name(), grid, Suspects::default(), progress, |rect, out| {
            // A file that is open has all its data, or answers with an error.
            file.heights(0, rect, out).map(drop)
        })?
    } else {
        bounded_heights(file)?
    };
    let mut info = Info::new(
        grid,
        "terrain file",
        "float32",
        meta.place.as_ref(),
        &meta.vertical_unit,
        heights,
        meta.light,
        &meta.assumed,
    );
    info.destep = meta.destep_m;
    info.day = meta.day.map(|day| DayInfo {
        positions: day.positions,
        noon: day.noon.to_string(),
        hours: [-1.0, 1.0].map(|end| day.hour_of_time(end)),
        seen_from: [day.latitude_deg, day.longitude_deg],
    });
    Ok(info)
}

/// Reads all heights, band by band.
fn read_heights(
    name: &str,
    grid: &Grid,
    mut suspects: Suspects,
    progress: &dyn Progress,
    read: impl Fn(Rect, &mut [f32]) -> Result<()>,
) -> Result<Heights> {
    let Size { width, height } = grid.size;
    let rows = (BAND_SAMPLES / width).clamp(1, height);
    let mut band = vec![0.0_f32; (rows * width) as usize];
    let (mut voids, mut range) = (0, None);
    progress.begin("read", height as u64);
    for z in (0..height).step_by(rows as usize) {
        if progress.cancelled() {
            return Err(Error::cancelled(name));
        }
        let rect = Rect::new(0, z, width, (z + rows).min(height));
        let band = &mut band[..rect.area() as usize];
        read(rect, band)?;
        for &h in band.iter() {
            if h.is_nan() {
                voids += 1;
            } else {
                widen(&mut range, h, h);
                suspects.look_at(h);
            }
        }
        progress.advance(rect.height() as u64);
    }
    Ok(Heights {
        range,
        voids: Some(voids),
        suspects,
    })
}

/// The range from the bounds of level 0, a row of patches at a time; they do not tell voids.
fn bounded_heights(file: &TerrainFile) -> Result<Heights> {
    let patches = file.grid().patches(0);
    let mut row = vec![Bounds::VOID; patches.width as usize];
    let mut range = None;
    for b in 0..patches.height {
        // As for heights: what is not there is an error.
        file.bounds(0, Rect::new(0, b, patches.width, b + 1), &mut row)
            .map(drop)?;
        row.iter()
            .filter(|bounds| !bounds.is_void())
            .for_each(|p| widen(&mut range, p.min, p.max));
    }
    Ok(Heights {
        range,
        ..Heights::default()
    })
}

fn widen(range: &mut Option<[f32; 2]>, min: f32, max: f32) {
    let [low, high] = range.unwrap_or([min, max]);
    *range = Some([low.min(min), high.max(max)]);
}

impl Info {
    fn new(
        grid: &Grid,
        format: &str,
        sample_type: &str,
        place: Option<&Georeference>,
        vertical_unit: &str,
        heights: Heights,
        light: Option<LightMeta>,
        assumed: &[String],
    ) -> Self {
        let Size { width, height } = grid.size;
        let absolute = |h: f32| f64::from(h) + grid.base_m;
        Self {
            format: format.into(),
            sample_type: sample_type.into(),
            width,
            height,
            spacing: grid.spacing_m,
            min: heights.range.map(|[min, _]| absolute(min)),
            max: heights.range.map(|[_, max]| absolute(max)),
            voids: heights.voids,
            vertical_unit: (!matches!(vertical_unit, "unknown" | "")).then(|| vertical_unit.into()),
            vertical_datum: place.and_then(|p| p.epsg()[1]).map(|code| format!("EPSG:{code}")),
            unit: place.map(|p| p.unit(grid.spacing_m[0])),
            pixel: place.map(|p| p.pixel),
            crs: place.and_then(|p| p.crs.clone()),
            origin: place.map(|p| p.origin),
            extent: place.map(|p| {
                let [x, y] = p.origin;
                let [u, v] = p.place(width as f64 - 1.0, height as f64 - 1.0);
                [x.min(u), y.min(v), x.max(u), y.max(v)]
            }),
            registration: place.map(|p| p.registration),
            levels: grid.file_levels(),
            light: light.map(|l| Light {
                sun: [l.sun_azimuth_deg, l.sun_altitude_deg],
                sky_directions: l.sky_directions,
            }),
            destep: None,
            day: None,
            assumed: assumed.to_vec(),
            noticed: Vec::new(),
        }
    }
}

/// The same for people.
fn text(name: &str, info: &Info, verified: bool) -> String {
    let mut text = format!("{name}: {}, {}\n", info.format, info.sample_type);
    let mut line = |title: &str, value: String| {
        writeln!(text, "  {title:<9} {value}").expect("a text takes all that is written to it");
    };
    let [dx, dz] = info.spacing.map(short);
    line(
        "size",
        format!("{} x {} samples, {dx} x {dz} m apart", info.width, info.height),
    );
    match (info.min, info.max, info.voids) {
        (Some(min), Some(max), _) => line("heights", format!("{} to {} m", short(min), short(max))),
        (_, _, Some(_)) => line("heights", "none: all samples are void".into()),
        _ => line(
            "heights",
            "not read: it is large (--verify reads all of it)".into(),
        ),
    }
    if let Some(voids) = info.voids {
        line(
            "voids",
            format!("{voids} of {} samples", info.width * info.height),
        );
    }
    let [unit, datum] =
        [&info.vertical_unit, &info.vertical_datum].map(|known| known.as_deref().unwrap_or("unknown"));
    line("vertical", format!("unit {unit}, datum {datum}"));
    match (info.extent, info.origin) {
        (Some([west, south, east, north]), Some([x, y])) => {
            let crs = info.crs.as_deref().unwrap_or("unknown reference system");
            line("place", crs.into());
            line(
                "",
                format!(
                    "x {} to {}, y {} to {}",
                    short(west),
                    short(east),
                    short(south),
                    short(north)
                ),
            );
            let how = match info.registration {
                Some(Registration::Area) => "pixels are areas",
                _ => "pixels are points",
            };
            line("", format!("first sample at {}, {}; {how}", short(x), short(y)));
            if let (Some([dx, dy]), Some(unit)) = (info.pixel, &info.unit) {
                line("", format!("pixel {} x {}, unit {unit}", short(dx), short(dy)));
            }
        }
        _ => line("place", "unknown".into()),
    }
    line("levels", info.levels.to_string());
    if let Some(step) = info.destep {
        let (step, half) = (short(step), short(0.5 * step));
        line(
            "destep",
            format!("steps of {step} m smoothed away, by at most {half} m"),
        );
    }
    match &info.light {
        Some(light) => {
            let [azimuth, altitude] = light.sun.map(short);
            let directions = light.sky_directions;
            line(
                "light",
                format!("sun at azimuth {azimuth}, altitude {altitude}; {directions} sky directions"),
            );
        }
        None => line("light", "none".into()),
    }
    if let Some(day) = &info.day {
        let [from, until] = day.hours.map(clock);
        line(
            "day",
            format!(
                "{from} to {until} by the sun, noon at {}; from {} suns",
                day.noon, day.positions
            ),
        );
    }
    for sentence in &info.assumed {
        line("assumed", sentence.clone());
    }
    for sentence in &info.noticed {
        line("noticed", sentence.clone());
    }
    if verified {
        line("verified", "all of it was read, and is whole".into());
    }
    text
}

/// A number with at most eight significant digits.
fn short(value: f64) -> String {
    let magnitude = value.abs();
    if magnitude != 0.0 && !(1e-6..1e12).contains(&magnitude) {
        return format!("{value:e}");
    }
    let whole_digits = if magnitude < 1.0 {
        0
    } else {
        magnitude.log10() as usize + 1
    };
    let text = format!("{value:.*}", 8_usize.saturating_sub(whole_digits));
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').into()
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::Silent;

    #[test]
    fn numbers_have_honest_digits() {
        for (value, text) in [
            (0.0, "0"),
            (45.0, "45"),
            (-3.5, "-3.5"),
            (68.499_123_456_7, "68.499123"),
            (1_200_000.0, "1200000"),
            (0.001, "0.001"),
            (1e-9, "1e-9"),
            (1e30, "1e30"),
            (100.0, "100"),
        ] {
            assert_eq!(short(value), text);
        }
    }

    #[test]
    fn heights_are_gathered_over_bands_with_voids_apart() {
        let grid = Grid {
            base_m: 1000.0,
            ..Grid::new(1500, 1500, [1.0, 1.0])
        };
        let heights = read_heights("t", &grid, Suspects::default(), &Silent, |rect, out| {
            for ((x, z), h) in rect.cells().zip(out) {
                *h = match (x, z) {
                    (3, 1499) => -7.0,
                    (1499, 0) => 9.0,
                    (0, _) => f32::NAN,
                    _ => 0.5,
                };
            }
            Ok(())
        });
        let heights = heights.unwrap();
        assert_eq!(
            heights,
            Heights {
                range: Some([-7.0, 9.0]),
                voids: Some(1500),
                suspects: Suspects::default(),
            }
        );
        let info = Info::new(&grid, "test", "float32", None, "unknown", heights, None, &[]);
        assert_eq!((info.min, info.max), (Some(993.0), Some(1009.0)));
    }

    #[test]
    fn all_void_is_said_as_such() {
        let grid = Grid::new(3, 2, [1.0, 1.0]);
        let heights = read_heights("t", &grid, Suspects::default(), &Silent, |_, out| {
            out.fill(f32::NAN);
            Ok(())
        });
        let info = Info::new(
            &grid,
            "test",
            "float32",
            None,
            "unknown",
            heights.unwrap(),
            None,
            &[],
        );
        assert_eq!((info.min, info.voids), (None, Some(6)));
        assert!(text("t", &info, false).contains("all samples are void"));
    }
}
