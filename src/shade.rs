//! The look: its constants, emitted into WGSL, and the twin of the fragment stage's colours ([`Fragment`]).
//!
//! Colours are linear RGB radiance for a white surface of 1, before exposure. The air follows Beer and Lambert with a
//! density that falls exponentially with height, integrated in closed form along the ray.

mod fragment;

pub use fragment::{Fragment, SurfacePoint, encode8, tone};

use std::fmt::Write;

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use crate::clipmap::{LEVEL_SLOTS, LIGHT_TEXEL_STEPS, VOID_HEIGHT};
use crate::grid::PATCH;
use crate::light::{DISC_DEG, Sun, disc_coefficients};

/// What a frame shows: for each of these a function `view_NAME` in `shaders/shared/views.wgsl`, and a name below.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ViewMode {
    /// Ground colours in light and air.
    #[default]
    Shaded,
    /// The bare light, grey.
    Light,
    /// A colour per level: whiter where the ring slides it into the next one, hatched where it is held.
    Level,
    /// The edges of the triangles that are drawn, over the ground.
    Wire,
    /// The error of each pixel in a colour, over the light. What draws frames lays the colours over them, once it has
    /// measured them; the GPU draws the light alone.
    Error,
}

impl ViewMode {
    /// All modes with the names by which people ask for them.
    pub const NAMED: [(&'static str, Self); 5] = [
        ("shaded", Self::Shaded),
        ("light", Self::Light),
        ("level", Self::Level),
        ("wire", Self::Wire),
        ("error", Self::Error),
    ];

    /// Its name, which is also that of its function in the shader.
    pub fn name(self) -> &'static str {
        Self::NAMED[self as usize].0
    }
}

/// Shading constants of a frame, as in `shaders/shared/shade.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct ShadeConstants {
    /// Unit vector to the sun: east, up, south; the fourth is 0 once its disc has set, else 1.
    pub to_sun: [f32; 4],
    /// Least height of the DEM in metres above its base: where the ground's tint begins.
    pub low_m: f32,
    /// Greatest height of the DEM in metres above its base.
    pub high_m: f32,
    /// Height of the DEM's base in metres.
    pub base_m: f32,
    /// Factor on slopes where light follows from them: the vertical scale.
    pub slope_scale: f32,
    /// 1 over the metres over which the ground's tint stretches.
    pub per_relief: f32,
    /// Height of the eye as drawn above the lowest ground, in [`HAZE_SCALE_M`].
    pub eye_haze: f32,
    /// Density of the air at the eye, 1 at the lowest ground and below it.
    pub eye_density: f32,
    /// The time of day, of [`crate::light::Day`]; 0 where light is not of a day.
    pub day_time: f32,
}

impl ShadeConstants {
    /// The constants for a DEM with heights in `range_m` above `base_m`, seen from `eye_height_m` above `base_m`.
    pub fn new(sun: &Sun, range_m: [f32; 2], base_m: f64, vertical_scale: f64, eye_height_m: f32) -> Self {
        let [x, y, z] = sun.direction();
        let up = sun.altitude_deg > -DISC_DEG / 2.0;
        let eye_haze = (eye_height_m - range_m[0]) * vertical_scale as f32 * (1.0 / HAZE_SCALE_M);
        Self {
            to_sun: [x as f32, y as f32, z as f32, f32::from(u8::from(up))],
            low_m: range_m[0],
            high_m: range_m[1],
            base_m: base_m as f32,
            slope_scale: vertical_scale as f32,
            per_relief: 1.0 / (range_m[1] - range_m[0]).max(RELIEF_LEAST_M),
            eye_haze,
            eye_density: (-eye_haze.clamp(0.0, 80.0)).exp(),
            day_time: 0.0,
        }
    }
}

/// Light of the full sun on a surface that faces it.
pub const SUN_LIGHT: Vec3 = Vec3::new(3.0, 2.75, 2.35);
/// Light of the whole sky.
pub const SKY_LIGHT: Vec3 = Vec3::new(0.40, 0.52, 0.74);
/// Share of the sun and of the sky in the grey of the light view.
pub const LIGHT_VIEW: [f32; 2] = [0.8, 0.2];
/// Ground at the lowest.
pub const GROUND_LOW: Vec3 = Vec3::new(0.080, 0.125, 0.035);
/// Ground a little below the middle.
pub const GROUND_MIDDLE: Vec3 = Vec3::new(0.165, 0.175, 0.065);
/// Ground at the highest, where it is not snow.
pub const GROUND_HIGH: Vec3 = Vec3::new(0.30, 0.24, 0.16);
/// Steep ground.
pub const GROUND_ROCK: Vec3 = Vec3::new(0.235, 0.215, 0.20);
/// Snow.
pub const GROUND_SNOW: Vec3 = Vec3::new(0.78, 0.82, 0.88);
/// Ground without tint.
pub const GROUND_PLAIN: Vec3 = Vec3::new(0.45, 0.45, 0.45);
/// Up component of the normal below which ground is bare rock.
pub const ROCK_UP: f32 = 0.70;
/// Up component of the normal above which ground is covered.
pub const MEADOW_UP: f32 = 0.90;
/// Heights in metres between which snow begins.
pub const SNOW_M: [f32; 2] = [2350.0, 2900.0];
/// Relief in metres below which the tint does not stretch over all its colours.
pub const RELIEF_LEAST_M: f32 = 300.0;
/// Height in metres by which the air's density falls to 1/e.
pub const HAZE_SCALE_M: f32 = 8000.0;
/// Extinction at the lowest ground, per metre, of which red has 2, green 3 and blue 5: blue scatters most.
pub const HAZE_PER_M: f32 = 0.193e-5;
/// The sky at the horizon, which is also the colour of much air.
pub const SKY_HORIZON: Vec3 = Vec3::new(0.75, 0.95, 1.20);
/// The sky overhead.
pub const SKY_ZENITH: Vec3 = Vec3::new(0.10, 0.27, 0.70);
/// Below the horizon, where no terrain is.
pub const SKY_BELOW: Vec3 = Vec3::new(0.30, 0.38, 0.48);
/// Around the sun.
pub const SUN_GLOW: Vec3 = Vec3::new(0.55, 0.42, 0.22);
/// Exposure before the tone curve `1 - exp(-x)`.
pub const EXPOSURE: f32 = 0.85;
/// Steps in which a fragment's alpha is taken: far more than light shows, far fewer than interpolation holds.
pub const ALPHA_STEPS: f32 = 4096.0;
/// Width in pixels of the edges that the wire view draws.
pub const WIRE_PX: f32 = 1.0;
/// Interpolated validity below which a fragment belongs to a hole. A corner's share of a triangle may round to a few
/// ulps above 0 along the opposite side; 2^-16 of a triangle is below any pixel.
pub const VALID_LEAST: f32 = 1.0 - 1.0 / 65536.0;

/// The constants that shaders share with this crate, as WGSL declarations.
pub fn wgsl_constants() -> String {
    let mut out = String::new();
    let mut line = |name: &str, value: String| {
        writeln!(out, "const {name} = {value};").expect("a String takes all that is written");
    };
    let float = |v: f32| format!("{v:?}f");
    let vector = |v: Vec3| format!("vec3<f32>({:?}, {:?}, {:?})", v.x, v.y, v.z);
    line("LEVEL_SLOTS", format!("{LEVEL_SLOTS}u"));
    line("PATCH_CORNERS", format!("{}u", PATCH + 1));
    for (name, value) in [
        ("VOID_HEIGHT", VOID_HEIGHT),
        ("LIGHT_TEXEL_STEPS", LIGHT_TEXEL_STEPS as f32),
        ("ALPHA_STEPS", ALPHA_STEPS),
        ("LIGHT_VIEW_SUN", LIGHT_VIEW[0]),
        ("LIGHT_VIEW_SKY", LIGHT_VIEW[1]),
        ("ROCK_UP", ROCK_UP),
        ("MEADOW_UP", MEADOW_UP),
        ("SNOW_LOW_M", SNOW_M[0]),
        ("SNOW_HIGH_M", SNOW_M[1]),
        ("HAZE_SCALE_M", HAZE_SCALE_M),
        ("HAZE_PER_M", HAZE_PER_M),
        ("EXPOSURE", EXPOSURE),
        ("WIRE_PX", WIRE_PX),
        ("VALID_LEAST", VALID_LEAST),
    ] {
        line(name, float(value));
    }
    line("DISC", vector(Vec3::from_array(disc_coefficients())));
    for (name, value) in [
        ("SUN_LIGHT", SUN_LIGHT),
        ("SKY_LIGHT", SKY_LIGHT),
        ("GROUND_LOW", GROUND_LOW),
        ("GROUND_MIDDLE", GROUND_MIDDLE),
        ("GROUND_HIGH", GROUND_HIGH),
        ("GROUND_ROCK", GROUND_ROCK),
        ("GROUND_SNOW", GROUND_SNOW),
        ("GROUND_PLAIN", GROUND_PLAIN),
        ("SKY_HORIZON", SKY_HORIZON),
        ("SKY_ZENITH", SKY_ZENITH),
        ("SKY_BELOW", SKY_BELOW),
        ("SUN_GLOW", SUN_GLOW),
    ] {
        line(name, vector(value));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_view_has_its_own_name() {
        for (k, (name, mode)) in ViewMode::NAMED.into_iter().enumerate() {
            assert_eq!((mode as usize, mode.name()), (k, name));
        }
    }
}
