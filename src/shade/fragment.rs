//! The twin of the fragment stage: the colour of a point of the ground and of the sky.
//!
//! Same names and order of steps as `shaders/shared/` (`ground.wgsl`, `views.wgsl`'s shaded view, `look.wgsl`,
//! `point.wgsl`, `shade.wgsl`) and `sky.wgsl`, in f32. The light texel is the caller's, as is where the point lies. What
//! the target's format does is [`encode8`].

use glam::{Vec2, Vec3};

use super::*;

/// What the fragment stage knows of a frame.
#[derive(Clone, Copy, Debug)]
pub struct Fragment {
    /// The frame's shading constants.
    pub shade: ShadeConstants,
    /// The eye's height above the DEM's base, metres, as a high and a low part.
    pub eye_height_m: [f32; 2],
    /// Factor on heights relative to the eye.
    pub vertical_scale: f32,
    /// Metres between columns and rows of level 0.
    pub spacing_m: [f32; 2],
    /// Whether light texels hold traced light; else it follows from slopes.
    pub traced_light: bool,
    /// Whether the ground is tinted by height and slope.
    pub tint: bool,
    /// Whether air lies between ground and eye.
    pub haze: bool,
}

/// A point of the surface.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// Metres east, up (as drawn) and south of the eye.
    pub from_eye_m: Vec3,
    /// The DEM's own height in metres.
    pub height_m: f32,
    /// The same above the DEM's base.
    pub above_base_m: f32,
    /// Unit normal of the ground as drawn: east, up, south.
    pub normal: Vec3,
    /// Rise over run to the east and to the south, before vertical scale.
    pub slopes: Vec2,
    /// Share of the sun's light.
    pub sun: f32,
    /// Share of the sky that is seen.
    pub sky: f32,
}

impl Fragment {
    /// The linear colour of a point, 0 to 1: samples of level 0 east and south of the eye, metres above the DEM's base, and
    /// its light texel.
    pub fn point_colour(&self, from_eye: [f32; 2], height: f32, texel: [f32; 4]) -> Vec3 {
        self.surface_colour(&self.surface_point(from_eye, height, texel))
    }

    /// The linear colour of the sky along a ray of any length: metres east, up and south.
    pub fn sky(&self, ray: Vec3) -> Vec3 {
        tone(self.sky_colour(ray.normalize()))
    }

    /// What is known of a point.
    pub fn surface_point(&self, from_eye: [f32; 2], height: f32, texel: [f32; 4]) -> SurfacePoint {
        let slopes = Vec2::new(texel[2], texel[3]);
        let drawn_slopes = slopes * self.shade.slope_scale;
        let up_m = ((height - self.eye_height_m[0]) - self.eye_height_m[1]) * self.vertical_scale;
        let normal = Vec3::new(-drawn_slopes.x, 1.0, -drawn_slopes.y).normalize();
        let (mut sun, mut sky) = (texel[0], texel[1]);
        if !self.traced_light {
            let up = f32::from(u8::from(self.shade.to_sun[1] >= 0.0));
            sun = normal.dot(self.sunward()).max(0.0) * up;
            sky = 0.5 + 0.5 * normal.y;
        }
        SurfacePoint {
            from_eye_m: Vec3::new(
                from_eye[0] * self.spacing_m[0],
                up_m,
                from_eye[1] * self.spacing_m[1],
            ),
            height_m: height + self.shade.base_m,
            above_base_m: height,
            normal,
            slopes,
            sun,
            sky,
        }
    }

    fn sunward(&self) -> Vec3 {
        let [x, y, z, _] = self.shade.to_sun;
        Vec3::new(x, y, z)
    }

    fn surface_colour(&self, point: &SurfacePoint) -> Vec3 {
        let ground = if self.tint {
            self.ground_tint(point)
        } else {
            GROUND_PLAIN
        };
        let mut radiance = ground * illumination(point.sun, point.sky);
        if self.haze {
            radiance = self.through_air(radiance, point.from_eye_m);
        }
        tone(radiance)
    }

    /// `tint` in WGSL.
    fn ground_tint(&self, point: &SurfacePoint) -> Vec3 {
        let true_up = 1.0 / (1.0 + point.slopes.dot(point.slopes)).sqrt();
        let rise = (point.above_base_m - self.shade.low_m) * self.shade.per_relief;
        ground_colour(rise.clamp(0.0, 1.0), point.height_m, true_up)
    }

    fn through_air(&self, radiance: Vec3, from_eye_m: Vec3) -> Vec3 {
        let distance_m = from_eye_m.length().min(1e18);
        let clear = self.transmission(distance_m, from_eye_m.y);
        let level = Vec3::new(from_eye_m.x, 0.0, from_eye_m.z);
        let level_ray = level / level.dot(level).max(1e-30).sqrt();
        radiance * clear + self.horizon_colour(level_ray) * (1.0 - clear)
    }

    fn transmission(&self, distance_m: f32, up_m: f32) -> Vec3 {
        let ShadeConstants {
            eye_haze,
            eye_density,
            ..
        } = self.shade;
        let a = eye_haze.clamp(0.0, 80.0);
        let b = (eye_haze + up_m * (1.0 / HAZE_SCALE_M)).clamp(0.0, 80.0);
        let x = b - a;
        let density = if x.abs() < 1e-3 {
            eye_density * (1.0 - 0.5 * x)
        } else {
            (eye_density - (-b).exp()) / x
        };
        let clear = (-(HAZE_PER_M * (density * distance_m)).min(16.0)).exp();
        let squared = clear * clear;
        let cubed = squared * clear;
        Vec3::new(squared, cubed, squared * cubed)
    }

    fn sun_glow(&self, direction: Vec3) -> Vec3 {
        let toward_sun = direction.dot(self.sunward()).max(0.0);
        let squared = toward_sun * toward_sun;
        let fourth = squared * squared;
        SUN_GLOW * (fourth * fourth)
    }

    fn horizon_colour(&self, direction: Vec3) -> Vec3 {
        SKY_HORIZON + self.sun_glow(direction)
    }

    fn sky_colour(&self, direction: Vec3) -> Vec3 {
        let height = direction.y.clamp(0.0, 1.0);
        let clear = mix(SKY_HORIZON, SKY_ZENITH, height.sqrt());
        let below = mix(clear, SKY_BELOW, smoothstep(0.0, 0.5, -direction.y));
        below + self.sun_glow(direction) * (1.0 - smoothstep(0.0, 0.3, -direction.y))
    }
}

fn mix(a: Vec3, b: Vec3, t: f32) -> Vec3 {
    a * (1.0 - t) + b * t
}

fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

fn ramp(x: f32, low: f32, per_width: f32) -> f32 {
    let t = ((x - low) * per_width).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

fn ground_colour(rise: f32, height_m: f32, up: f32) -> Vec3 {
    let green = mix(GROUND_LOW, GROUND_MIDDLE, ramp(rise, 0.0, 1.0 / 0.45));
    let meadow = mix(green, GROUND_HIGH, ramp(rise, 0.35, 1.0 / 0.55));
    let covered = ramp(up, ROCK_UP, 1.0 / (MEADOW_UP - ROCK_UP));
    let snow = ramp(height_m, SNOW_M[0], 1.0 / (SNOW_M[1] - SNOW_M[0])) * covered;
    mix(mix(GROUND_ROCK, meadow, covered), GROUND_SNOW, snow)
}

fn illumination(sun: f32, sky: f32) -> Vec3 {
    SUN_LIGHT * sun + SKY_LIGHT * sky
}

/// From radiance to what a display shows, before its own encoding.
pub fn tone(radiance: Vec3) -> Vec3 {
    radiance.max(Vec3::ZERO).map(|v| 1.0 - (-EXPOSURE * v).exp())
}

/// Red, green and blue of 8 bits, sRGB, as a target of that format stores a linear colour.
pub fn encode8(linear: Vec3) -> [u8; 3] {
    linear.to_array().map(|v| {
        let v = v.clamp(0.0, 1.0);
        let encoded = if v <= 0.003_130_8 {
            v * 12.92
        } else {
            1.055 * v.powf(1.0 / 2.4) - 0.055
        };
        (encoded * 255.0).round() as u8
    })
}
