// The look: ground colour, light, air and sky. The twin is `src/shade.rs`, which also emits the constants in capitals.

struct ShadeConstants {
    to_sun: vec4<f32>,          // unit vector east, up, south; w is 0 once its disc has set, else 1
    low_m: f32,                 // heights above the DEM's base between which the ground's tint runs
    high_m: f32,
    base_m: f32,                // height of the DEM's base above sea level
    slope_scale: f32,           // factor on slopes where light follows from them
    per_relief: f32,            // 1 over the metres over which the tint stretches
    eye_haze: f32,              // height of the eye above the lowest ground over HAZE_SCALE_M
    eye_density: f32,           // of the air at the eye: 1 at the lowest ground
    day_time: f32,              // where light is of a day: 0 at the sun's noon, -1 and 1 at the day's ends
}

@group(0) @binding(4) var<uniform> shade: ShadeConstants;

// As smoothstep from `low` on, with the reciprocal of the width, so that nothing is divided a pixel.
fn ramp(x: f32, low: f32, per_width: f32) -> f32 {
    let t = clamp((x - low) * per_width, 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
}

// The colour of the ground by its height (0 at the lowest, 1 at the highest), its height above the sea, and the up
// component of its normal.
fn ground_colour(rise: f32, height_m: f32, up: f32) -> vec3<f32> {
    let green = mix(GROUND_LOW, GROUND_MIDDLE, ramp(rise, 0.0, 1.0 / 0.45));
    let meadow = mix(green, GROUND_HIGH, ramp(rise, 0.35, 1.0 / 0.55));
    let covered = ramp(up, ROCK_UP, 1.0 / (MEADOW_UP - ROCK_UP));
    let snow = ramp(height_m, SNOW_LOW_M, 1.0 / (SNOW_HIGH_M - SNOW_LOW_M)) * covered;
    return mix(mix(GROUND_ROCK, meadow, covered), GROUND_SNOW, snow);
}

// Light on the ground from its shares of the sun and of the sky.
fn illumination(sun: f32, sky: f32) -> vec3<f32> {
    return SUN_LIGHT * sun + SKY_LIGHT * sky;
}

// Share of the light that reaches the eye through the air, by wavelength: density is exp(-h) at h times HAZE_SCALE_M above
// the lowest ground. `up_m` is the far end's height above the eye.
fn transmission(distance_m: f32, up_m: f32) -> vec3<f32> {
    // Some adapters' exp is no number far below 0, where it should vanish; at -80 it has.
    let a = clamp(shade.eye_haze, 0.0, 80.0);
    let b = clamp(shade.eye_haze + up_m * (1.0 / HAZE_SCALE_M), 0.0, 80.0);
    // The mean of exp(-h) from a to b, which is (exp(-a) - exp(-b)) / (b - a); where they are near by its series.
    let x = b - a;
    let is_level = abs(x) < 1e-3;
    let mean = (shade.eye_density - exp(-b)) / select(x, 1.0, is_level);
    let density = select(mean, shade.eye_density * (1.0 - 0.5 * x), is_level);
    // Red, green and blue are powers of one number, as their extinctions are multiples of one: an exponential for three.
    let clear = exp(-min(HAZE_PER_M * (density * distance_m), 16.0));
    let squared = clear * clear;
    let cubed = squared * clear;
    return vec3(squared, cubed, squared * cubed);
}

// The sky's glow around the sun, in a direction (unit vector).
fn sun_glow(direction: vec3<f32>) -> vec3<f32> {
    let toward_sun = max(dot(direction, shade.to_sun.xyz), 0.0);
    let squared = toward_sun * toward_sun;
    let fourth = squared * squared;
    return SUN_GLOW * (fourth * fourth);
}

// The sky at the horizon, in a level direction (unit vector): what much air looks like.
fn horizon_colour(direction: vec3<f32>) -> vec3<f32> {
    return SKY_HORIZON + sun_glow(direction);
}

// The sky in a direction (unit vector): horizon to zenith, brighter around the sun.
fn sky_colour(direction: vec3<f32>) -> vec3<f32> {
    let height = clamp(direction.y, 0.0, 1.0);
    let clear = mix(SKY_HORIZON, SKY_ZENITH, sqrt(height));
    let below = mix(clear, SKY_BELOW, smoothstep(0.0, 0.5, -direction.y));
    return below + sun_glow(direction) * (1.0 - smoothstep(0.0, 0.3, -direction.y));
}

// From radiance to what a display shows, before its own encoding. Over heights that differ by 1e30 m a rasteriser's own
// products overflow, and what it interpolates is no number: that is to be black, and no number to whoever reads it.
fn tone(radiance: vec3<f32>) -> vec3<f32> {
    return 1.0 - exp(-EXPOSURE * max(radiance, vec3(0.0)));
}

// For targets that do not encode sRGB themselves.
fn encode(linear: vec3<f32>) -> vec3<f32> {
    let curve = 1.055 * pow(max(linear, vec3(0.0031308)), vec3(1.0 / 2.4)) - 0.055;
    return select(linear, select(curve, linear * 12.92, linear <= vec3(0.0031308)), ENCODE_SRGB);
}
