//! What a terrain file says of itself: [`Meta`] and its `clipscape.` attributes.
//!
//! All are OpenEXR strings (UTF-8) on the first part. Numbers are written so that reading gives the same bits.
//! A text that is empty, and what is not known, is left out.
//!
//! | attribute | text |
//! |---|---|
//! | `clipscape.version` | format version |
//! | `clipscape.spacing` | dx dz, metres |
//! | `clipscape.base` | metres subtracted from every height |
//! | `clipscape.offset` | column and row of sample (0, 0) |
//! | `clipscape.crs`, `.origin`, `.pixel`, `.registration`, `.geographic` | [`Georeference`] |
//! | `clipscape.vertical_unit` | unit of heights as read |
//! | `clipscape.filter`, `.lobes`, `.rounding_step` | how levels above 0 were made: a name of [`crate::pyramid::FilterKind`], its kernel's reach a side in coarse samples, the step in metres |
//! | `clipscape.destep` | the step in metres that was smoothed away of level 0, by half of it at most |
//! | `clipscape.sun`, `.sky_directions` | azimuth and altitude in degrees; number of directions |
//! | `clipscape.day` | positions, half its length in seconds, latitude and longitude in degrees, Julian date of noon (UT) and terrestrial time less UT in seconds: [`Day`] |
//! | `clipscape.source`, `.source_bytes`, `.source_modified` | name, length, seconds since 1970 |
//! | `clipscape.tool` | program and version |
//! | `clipscape.assumed` | what was assumed of the source, a sentence a line |
//! | `clipscape.crc32c` | CRC-32C (8 hexadecimal digits) of all the others, sorted by name: name, 0, text, 0 |

use std::collections::BTreeMap;
use std::str::FromStr;

use crate::grid::{Grid, Size};
use crate::light::{Day, Sun};
use crate::source::{Georeference, Registration};

/// What every attribute's name begins with.
pub(super) const PREFIX: &str = "clipscape.";
/// The attribute that tells a terrain file from any other OpenEXR file.
pub(super) const VERSION: &str = "clipscape.version";
const CRC: &str = "clipscape.crc32c";

/// The file from which a terrain file was made.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SourceStamp {
    /// Its name, as messages speak of it.
    pub name: String,
    /// Its length in bytes; 0 for one that is computed.
    pub length_bytes: u64,
    /// When it was last modified, in seconds since 1970-01-01 UTC, where that is known.
    pub modified_s: Option<i64>,
}

/// How the light was traced.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightMeta {
    /// Azimuth of the sun in degrees, clockwise from true north.
    pub sun_azimuth_deg: f64,
    /// Altitude of the sun above the horizon in degrees.
    pub sun_altitude_deg: f64,
    /// Directions of the sky share.
    pub sky_directions: u32,
}

/// What a terrain file says of itself.
#[derive(Clone, Debug, PartialEq)]
pub struct Meta {
    /// Size, spacing, index offset, base.
    pub grid: Grid,
    /// Where the source lies, where it says.
    pub place: Option<Georeference>,
    /// The unit of heights as read.
    pub vertical_unit: String,
    /// Name of the filter that made the levels above 0.
    pub filter: String,
    /// How far its kernel reaches a side, in coarse samples: its lobes, see [`crate::pyramid::Filter::lobes`].
    pub lobes: u32,
    /// The step to which heights above level 0 are rounded, in metres, where they are.
    pub rounding_step_m: Option<f64>,
    /// The step of the source's heights in metres, where level 0 holds them de-stepped: within half of it.
    pub destep_m: Option<f64>,
    /// How the light was traced; the file has light exactly if this is there.
    pub light: Option<LightMeta>,
    /// The day whose light it has beside that; the file has light over a day exactly if this is there.
    pub day: Option<Day>,
    /// The file from which it was made.
    pub source: SourceStamp,
    /// Program and version that made it.
    pub tool: String,
    /// Whole sentences on what was assumed of the source.
    pub assumed: Vec<String>,
}

/// This program and its version, as it signs the files it makes.
pub const TOOL: &str = concat!("clipscape ", env!("CARGO_PKG_VERSION"));

impl Meta {
    /// The attributes, sorted by name; the check among them.
    pub(super) fn to_attributes(&self) -> BTreeMap<String, String> {
        let mut all = BTreeMap::new();
        let mut put = |name: &str, text: String| {
            if !text.is_empty() {
                all.insert(format!("{PREFIX}{name}"), text);
            }
        };
        // The debug form of an f64 is the shortest text that reads back as the same bits.
        put("version", super::FORMAT_VERSION.to_string());
        put(
            "spacing",
            format!("{:?} {:?}", self.grid.spacing_m[0], self.grid.spacing_m[1]),
        );
        put("base", format!("{:?}", self.grid.base_m));
        put(
            "offset",
            format!("{} {}", self.grid.offset[0], self.grid.offset[1]),
        );
        if let Some(place) = &self.place {
            put("crs", place.crs.clone().unwrap_or_default());
            put("origin", format!("{:?} {:?}", place.origin[0], place.origin[1]));
            put("pixel", format!("{:?} {:?}", place.pixel[0], place.pixel[1]));
            let registration = match place.registration {
                Registration::Area => "area",
                Registration::Point => "point",
            };
            put("registration", registration.into());
            put("geographic", place.geographic.to_string());
        }
        put("vertical_unit", self.vertical_unit.clone());
        put("filter", self.filter.clone());
        put("lobes", self.lobes.to_string());
        put(
            "rounding_step",
            self.rounding_step_m.map(|s| format!("{s:?}")).unwrap_or_default(),
        );
        put(
            "destep",
            self.destep_m.map(|s| format!("{s:?}")).unwrap_or_default(),
        );
        if let Some(light) = &self.light {
            put(
                "sun",
                format!("{:?} {:?}", light.sun_azimuth_deg, light.sun_altitude_deg),
            );
            put("sky_directions", light.sky_directions.to_string());
        }
        put("day", self.day.map(|day| day.to_string()).unwrap_or_default());
        put("source", self.source.name.clone());
        put("source_bytes", self.source.length_bytes.to_string());
        put(
            "source_modified",
            self.source.modified_s.map(|s| s.to_string()).unwrap_or_default(),
        );
        put("tool", self.tool.clone());
        let sentences: Vec<String> = self.assumed.iter().map(|s| s.replace('\n', " ")).collect();
        put("assumed", sentences.join("\n"));
        let crc = crc_of(&all);
        all.insert(CRC.into(), crc);
        all
    }

    /// Reads what [`Meta::to_attributes`] wrote, of a DEM of `size`; else what is wrong, as a phrase. The version
    /// has been checked already.
    pub(super) fn from_attributes(all: &BTreeMap<String, String>, size: Size) -> Result<Self, String> {
        let found = all.get(CRC).ok_or("it has no attribute clipscape.crc32c")?;
        let mut others = all.clone();
        others.remove(CRC);
        let want = crc_of(&others);
        if *found != want {
            return Err(format!(
                "its attributes have the CRC-32C {want}, clipscape.crc32c says {found}"
            ));
        }
        let read = Attributes(all);
        let place = match read.optional::<Pair<f64>>("origin")? {
            None => None,
            Some(Pair(origin)) => Some(Georeference {
                crs: read.text("crs").map(Into::into),
                origin,
                pixel: read.required::<Pair<f64>>("pixel")?.0,
                registration: match read.required::<String>("registration")?.as_str() {
                    "area" => Registration::Area,
                    "point" => Registration::Point,
                    other => return Err(format!("clipscape.registration is {other:?}, not area or point")),
                },
                geographic: read.required("geographic")?,
            }),
        };
        let light = match read.optional::<Pair<f64>>("sun")? {
            None => None,
            Some(Pair([sun_azimuth_deg, sun_altitude_deg])) => {
                let sun = Sun {
                    azimuth_deg: sun_azimuth_deg,
                    altitude_deg: sun_altitude_deg,
                };
                sun.check().map_err(|e| format!("clipscape.sun: {e}"))?;
                Some(LightMeta {
                    sun_azimuth_deg,
                    sun_altitude_deg,
                    sky_directions: read.required("sky_directions")?,
                })
            }
        };
        let meta = Self {
            grid: Grid {
                size,
                spacing_m: read.required::<Pair<f64>>("spacing")?.0,
                offset: read.required::<Pair<i64>>("offset")?.0,
                base_m: read.required("base")?,
            },
            place,
            vertical_unit: read.text("vertical_unit").unwrap_or_default().into(),
            filter: read.text("filter").unwrap_or_default().into(),
            lobes: read.required("lobes")?,
            rounding_step_m: read.optional("rounding_step")?,
            destep_m: read.optional("destep")?,
            light,
            day: read.optional("day")?,
            source: SourceStamp {
                name: read.text("source").unwrap_or_default().into(),
                length_bytes: read.required("source_bytes")?,
                modified_s: read.optional("source_modified")?,
            },
            tool: read.text("tool").unwrap_or_default().into(),
            assumed: read
                .text("assumed")
                .map(|t| t.split('\n').map(Into::into).collect())
                .unwrap_or_default(),
        };
        meta.grid.check()?;
        Ok(meta)
    }
}

/// The check over all attributes but itself.
fn crc_of(all: &BTreeMap<String, String>) -> String {
    let crc = all
        .iter()
        .flat_map(|(name, text)| [name, text])
        .fold(0, |crc, part| {
            let crc = crc32c::crc32c_append(crc, part.as_bytes());
            crc32c::crc32c_append(crc, &[0])
        });
    format!("{crc:08x}")
}

struct Attributes<'a>(&'a BTreeMap<String, String>);

impl Attributes<'_> {
    fn text(&self, name: &str) -> Option<&str> {
        self.0.get(&format!("{PREFIX}{name}")).map(String::as_str)
    }

    fn optional<T: FromStr>(&self, name: &str) -> Result<Option<T>, String> {
        let parse = |text: &str| {
            text.parse()
                .map_err(|_| format!("clipscape.{name} cannot be {text:?}"))
        };
        self.text(name).map(parse).transpose()
    }

    fn required<T: FromStr>(&self, name: &str) -> Result<T, String> {
        self.optional(name)?
            .ok_or_else(|| format!("it has no attribute clipscape.{name}"))
    }
}

/// Two numbers with white space between them.
struct Pair<T>([T; 2]);

impl<T: FromStr> FromStr for Pair<T> {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        let mut words = text.split_whitespace();
        let mut next = || words.next().and_then(|w| w.parse().ok()).ok_or(());
        let pair = [next()?, next()?];
        if words.next().is_some() {
            Err(())
        } else {
            Ok(Self(pair))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::terrain::testing::meta;

    #[test]
    fn attributes_give_back_the_same_bits() {
        for light in [false, true] {
            let meta = meta(Grid::new(300, 700, [30.000000000000004, 1.0 / 3.0]), light);
            let back = Meta::from_attributes(&meta.to_attributes(), meta.grid.size).unwrap();
            assert_eq!(back, meta);
        }
        let mut bare = meta(Grid::new(3, 1, [1e-3, 1e6]), false);
        bare.place = None;
        bare.assumed.clear();
        bare.source = SourceStamp::default();
        bare.rounding_step_m = None;
        bare.destep_m = None;
        bare.grid.base_m = -1.0e-300;
        bare.grid.offset = [-(1 << 60), 1 << 60];
        assert_eq!(
            Meta::from_attributes(&bare.to_attributes(), bare.grid.size).unwrap(),
            bare
        );
    }

    #[test]
    fn any_edited_attribute_is_noticed() {
        let meta = meta(Grid::new(300, 700, [30.0, 30.0]), true);
        let whole = meta.to_attributes();
        for name in whole.keys() {
            for edit in ["gone", "text"] {
                let mut all = whole.clone();
                let text = all.remove(name).unwrap();
                if edit == "text" {
                    all.insert(name.clone(), format!("{text}1"));
                }
                assert!(
                    Meta::from_attributes(&all, meta.grid.size).is_err(),
                    "{name}: {edit}"
                );
            }
        }
        // Control: with the check made anew an edit that makes sense is taken, one that does not is not.
        let edited = |spacing: &str| {
            let mut all = whole.clone();
            all.remove(CRC);
            all.insert("clipscape.spacing".into(), spacing.into());
            let crc = crc_of(&all);
            all.insert(CRC.into(), crc);
            Meta::from_attributes(&all, meta.grid.size).map(|m| m.grid.spacing_m)
        };
        assert_eq!(edited("31 32").unwrap(), [31.0, 32.0]);
        for wrong in ["31", "31 32 33", "0 1", "nan 1", "inf 1", "x y"] {
            assert!(edited(wrong).is_err(), "{wrong}");
        }
    }
}
