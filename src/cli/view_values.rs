//! How a camera, a picture's size and the way of showing terrain are written.

use std::ops::Range;
use std::str::FromStr;

use super::values::{number, numbers};
use crate::camera::MIN_FOV_DEG;
use crate::clipmap::{MAX_ERROR_PX, Wait};
use crate::shade::ViewMode;

/// A place `X,Y,Z` in world metres.
pub(super) fn place(text: &str) -> Result<[f64; 3], String> {
    numbers(text)
}

/// A place `E,N` in a DEM's reference system.
pub(super) fn crs_place(text: &str) -> Result<[f64; 2], String> {
    numbers(text)
}

/// A pitch in degrees.
pub(super) fn pitch(text: &str) -> Result<f64, String> {
    let pitch = number(text)?;
    if pitch.abs() <= 90.0 {
        Ok(pitch)
    } else {
        Err("outside of -90 to 90 degrees".into())
    }
}

/// A field of view in degrees.
pub(super) fn fov(text: &str) -> Result<f64, String> {
    let fov = number(text)?;
    if (MIN_FOV_DEG..180.0).contains(&fov) {
        Ok(fov)
    } else {
        Err(format!("not within {MIN_FOV_DEG} to below 180 degrees"))
    }
}

/// A picture's size `WIDTHxHEIGHT` in pixels, both above 0.
pub(super) fn size(text: &str) -> Result<[u32; 2], String> {
    let side = |text: &str| text.parse::<u32>().ok().filter(|&n| n > 0);
    let sides = text
        .split_once(['x', 'X'])
        .and_then(|(width, height)| Some([side(width)?, side(height)?]));
    sides.ok_or_else(|| "not WIDTHxHEIGHT in pixels, as in 1280x720".into())
}

/// Frames `A..B`: from A on, up to but without B.
pub(super) fn frames(text: &str) -> Result<Range<u64>, String> {
    let wanted = || "not A..B with A below B, as in 0..3 for the first three".to_string();
    let (from, to) = text.split_once("..").ok_or_else(wanted)?;
    let (from, to) = from.parse().ok().zip(to.parse().ok()).ok_or_else(wanted)?;
    if from < to { Ok(from..to) } else { Err(wanted()) }
}

/// A clip size that was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ClipSize {
    /// This one.
    Fixed(i64),
    /// The smallest that keeps the promised error.
    Auto,
}

/// A clip size: a power of two from 64 to 2048, or auto.
pub(super) fn clip_size(text: &str) -> Result<ClipSize, String> {
    if text == "auto" {
        return Ok(ClipSize::Auto);
    }
    let size = text
        .parse::<i64>()
        .ok()
        .filter(|n| (64..=2048).contains(n) && n & (n - 1) == 0);
    size.map(ClipSize::Fixed)
        .ok_or_else(|| "not a power of two from 64 to 2048, nor auto".into())
}

/// A clip size that is a number.
pub(super) fn fixed_clip_size(text: &str) -> Result<i64, String> {
    match clip_size(text) {
        Ok(ClipSize::Fixed(size)) => Ok(size),
        _ => Err("not a power of two from 64 to 2048".into()),
    }
}

/// An error in pixels that can be promised.
pub(super) fn max_error(text: &str) -> Result<f64, String> {
    let px = number(text)?;
    if MAX_ERROR_PX.contains(&px) {
        Ok(px)
    } else {
        let (least, most) = (MAX_ERROR_PX.start(), MAX_ERROR_PX.end());
        Err(format!("not within {least} to {most} pixels"))
    }
}

/// Samples a pixel.
pub(super) fn msaa(text: &str) -> Result<u32, String> {
    match text {
        "1" => Ok(1),
        "4" => Ok(4),
        _ => Err("neither 1 nor 4".into()),
    }
}

/// A way of showing the terrain, by its name.
pub(super) fn view(text: &str) -> Result<ViewMode, String> {
    let known = ViewMode::NAMED.iter().find(|(name, _)| *name == text);
    known.map(|(_, mode)| *mode).ok_or_else(|| {
        let names: Vec<&str> = ViewMode::NAMED.iter().map(|(name, _)| *name).collect();
        format!("not one of {}", names.join(", "))
    })
}

/// A promised error in pixels, or none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Promise(pub(super) Option<f64>);

/// `off`, or a promised error in pixels.
pub(super) fn promise(text: &str) -> Result<Promise, String> {
    match text {
        "off" => Ok(Promise(None)),
        _ => number(text).map(|px| Promise(Some(px))),
    }
}

/// Values with commas between them; nothing where `none` was typed.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct List<T>(pub(super) Vec<T>);

/// `none`, or values with commas between them.
pub(super) fn list_of<T: FromStr>(text: &str) -> Result<List<T>, String>
where
    T::Err: std::fmt::Display,
{
    if text == "none" {
        return Ok(List(Vec::new()));
    }
    let values = text
        .split(',')
        .map(|word| word.trim().parse().map_err(|e: T::Err| e.to_string()));
    values.collect::<Result<_, _>>().map(List)
}

/// Whether frames wait for their data.
pub(super) fn wait(text: &str) -> Result<Wait, String> {
    match text {
        "all" => Ok(Wait::All),
        "none" => Ok(Wait::None),
        _ => Err("neither all nor none".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_may_be_negative_and_must_be_finite() {
        assert_eq!(place("-5,100,-3"), Ok([-5.0, 100.0, -3.0]));
        assert_eq!(place("1e3, -0.5,.25"), Ok([1000.0, -0.5, 0.25]));
        for bad in ["", "1,2", "1,2,3,4", "a,b,c", "nan,0,0", "0,inf,0", "1,,3"] {
            assert!(place(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn sizes_frames_and_ranges_are_checked() {
        assert_eq!(size("1280x720"), Ok([1280, 720]));
        assert_eq!(size("8192X16"), Ok([8192, 16]));
        for bad in ["", "1280", "0x5", "5x0", "-1x5", "1x2x3", "1.5x2"] {
            assert!(size(bad).is_err(), "{bad}");
        }
        assert_eq!(frames("0..3"), Ok(0..3));
        for bad in ["", "3", "3..3", "5..2", "..4", "0..=3", "-1..3"] {
            assert!(frames(bad).is_err(), "{bad}");
        }
        assert_eq!(clip_size("64"), Ok(ClipSize::Fixed(64)));
        assert_eq!(clip_size("auto"), Ok(ClipSize::Auto));
        assert_eq!(fixed_clip_size("64"), Ok(64));
        assert!(fixed_clip_size("auto").is_err());
        for bad in ["32", "100", "4096", "-64", "x"] {
            assert!(clip_size(bad).is_err(), "{bad}");
        }
        assert_eq!(fov("0.01"), Ok(0.01));
        assert!(fov("0").is_err() && fov("180").is_err() && pitch("90.1").is_err());
        assert_eq!(pitch("-90"), Ok(-90.0));
    }

    #[test]
    fn views_are_known_or_refused() {
        for (name, mode) in ViewMode::NAMED {
            assert_eq!(view(name), Ok(mode));
        }
        assert!(view("wires").unwrap_err().contains("shaded, light, level, wire"));
        assert_eq!((msaa("1"), msaa("4")), (Ok(1), Ok(4)));
        assert!(msaa("2").is_err());
    }
}
