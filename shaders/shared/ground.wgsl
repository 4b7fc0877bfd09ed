// The colour of a point of the ground: what is known of it, handed to the view that was asked for. Shared by patches and
// by the triangles that close their sides.
#import shared/views.wgsl
#import view colour
#import surface function

override TRACED_LIGHT: bool = true;     // whether light texels hold traced light; else it follows from slopes
override DAY: bool = false;             // whether light is of a day: its texels stand in the layers after those of light
override TINT: bool = true;             // whether the look tints the ground by height and slope
override HAZE: bool = true;             // whether the look lays air between ground and eye
override ENCODE_SRGB: bool = false;     // whether the target's format leaves sRGB encoding to the shader

@group(0) @binding(5) var light: texture_2d_array<f32>;
@group(0) @binding(6) var light_sampler: sampler;

// What the vertex stage hands over.
struct GroundPoint {
    from_eye: vec2<f32>,    // samples of level 0 east and south of the eye
    height: f32,            // metres above the DEM's base
    alpha: f32,             // 0 on its own level, 1 on the next coarser surface
    level: u32,
}

// The light texel over a point, bilinear. Slots repeat, so the sampler's repetition is the torus. The place from the eye
// is taken in steps of a texel that add to a slot without rounding, so that it does not matter where the slots begin.
fn light_at(level: u32, from_eye: vec2<f32>) -> vec4<f32> {
    return textureSampleLevel(light, light_sampler, light_place(level, from_eye), level, 0.0);
}

fn light_place(level: u32, from_eye: vec2<f32>) -> vec2<f32> {
    let constants = levels[level];
    let place = round(from_eye * (constants.light_scale * LIGHT_TEXEL_STEPS)) * (1.0 / LIGHT_TEXEL_STEPS);
    let texel = constants.light_at_eye + place + 0.5;
    return texel * (0.5 / f32(view.slot_mask + 1));
}

// The texel of light over a day there: first light, its softness, last light, its softness.
fn day_at(level: u32, from_eye: vec2<f32>) -> vec4<f32> {
    let layer = textureNumLayers(light) / 2u + level;
    return textureSampleLevel(light, light_sampler, light_place(level, from_eye), layer, 0.0);
}

// The share of a disc on one side of a line at distance x of its radius from its middle.
fn disc(x: f32) -> f32 {
    let c = clamp(x, -1.0, 1.0);
    let square = c * c;
    return 0.5 + c * (DISC.x + square * (DISC.y + square * DISC.z));
}

// The integral of `disc` from -1 to x.
fn disc_integral(x: f32) -> f32 {
    let c = clamp(x, -1.0, 1.0);
    let square = c * c;
    let least = 0.5 - DISC.x / 2.0 - DISC.y / 4.0 - DISC.z / 6.0;
    let inner = least + c * 0.5 + square * (DISC.x / 2.0 + square * (DISC.y / 4.0 + square * (DISC.z / 6.0)));
    return inner + max(x - 1.0, 0.0);
}

// The sun's share at the time of day on ground of which `day` is first light, its softness, last light, its softness, and
// `rough` how far the slopes under it spread about `slopes`. The twin is `sun_of_day` in `src/light/day.rs`.
fn day_sun(day: vec4<f32>, rough: f32, slopes: vec2<f32>) -> f32 {
    let to_sun = shade.to_sun.xyz;
    let time = shade.day_time;
    let share = max(disc((time - day.x) / day.y) - disc((time - day.z) / day.w), 0.0);
    let level = length(to_sun.xz);
    let mean = to_sun.y - slopes.x * to_sun.x - slopes.y * to_sun.z;
    let width = max(2.0 * rough * level, 1e-4);
    let x = mean / width;
    let facing = disc(x);
    let cosine = width * disc_integral(x) / sqrt(1.0 + dot(slopes, slopes) + 2.0 * rough * rough);
    return min(cosine * min(share / max(facing, 1e-3), 1.0), 1.0) * shade.to_sun.w;
}

fn point_colour(point: GroundPoint) -> vec4<f32> {
    var texel = light_at(point.level, point.from_eye);
    if MORPHS && point.alpha > 0.0 {
        texel = mix(texel, light_at(point.level + 1u, point.from_eye), point.alpha);
    }
    var sun = texel.x;
    if DAY {
        var day = day_at(point.level, point.from_eye);
        if MORPHS && point.alpha > 0.0 {
            day = mix(day, day_at(point.level + 1u, point.from_eye), point.alpha);
        }
        sun = day_sun(day, texel.x, texel.zw);
    }
    let colour = view_colour(surface_point(point, texel, sun));
    return vec4(encode(colour.rgb), colour.a);
}

fn surface_point(point: GroundPoint, texel: vec4<f32>, sun: f32) -> SurfacePoint {
    let drawn_slopes = texel.zw * shade.slope_scale;
    let up_m = ((point.height - view.eye_height_m.x) - view.eye_height_m.y) * view.vertical_scale;
    var out: SurfacePoint;
    out.from_eye_m = vec3(point.from_eye.x * view.spacing_m.x, up_m, point.from_eye.y * view.spacing_m.y);
    out.height_m = point.height + shade.base_m;
    out.above_base_m = point.height;
    out.slopes = texel.zw;
    out.normal = normalize(vec3(-drawn_slopes.x, 1.0, -drawn_slopes.y));
    out.sun = sun;
    out.sky = texel.y;
    if !TRACED_LIGHT {
        out.sun = max(dot(out.normal, shade.to_sun.xyz), 0.0) * step(0.0, shade.to_sun.y);
        out.sky = 0.5 + 0.5 * out.normal.y;
    }
    out.from_eye = point.from_eye;
    out.alpha = point.alpha;
    out.level = point.level;
    return out;
}
