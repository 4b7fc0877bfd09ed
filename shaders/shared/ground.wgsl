// The colour of a point of the ground: light, tint and air, as the view asks for. Shared by patches and by the
// triangles that close their sides.
#import shared/surface.wgsl
#import shared/shade.wgsl

override VIEW_MODE: u32 = 0u;           // as in src/shade.rs
override TRACED_LIGHT: bool = true;     // whether light texels hold traced light; else it follows from slopes
override TINT: bool = true;
override HAZE: bool = true;
override ENCODE_SRGB: bool = false;     // whether the target's format leaves sRGB encoding to the shader

@group(0) @binding(5) var light: texture_2d_array<f32>;
@group(0) @binding(6) var light_sampler: sampler;

struct GroundPoint {
    from_eye: vec2<f32>,    // samples of level 0 east and south of the eye
    height: f32,            // metres above the DEM's base
    alpha: f32,             // 0 on its own level, 1 on the next coarser surface
    level: u32,
}

// The light texel over a point, bilinear. Slots repeat, so the sampler's repetition is the torus. The place from the eye
// is taken in steps of a texel that add to a slot without rounding, so that it does not matter where the slots begin.
fn light_at(level: u32, from_eye: vec2<f32>) -> vec4<f32> {
    let constants = levels[level];
    let place = round(from_eye * (constants.light_scale * LIGHT_TEXEL_STEPS)) * (1.0 / LIGHT_TEXEL_STEPS);
    let texel = constants.light_at_eye + place + 0.5;
    return textureSampleLevel(light, light_sampler, texel * (0.5 / f32(view.slot_mask + 1)), level, 0.0);
}

fn point_colour(point: GroundPoint) -> vec4<f32> {
    var texel = light_at(point.level, point.from_eye);
    if point.alpha > 0.0 {
        texel = mix(texel, light_at(point.level + 1u, point.from_eye), point.alpha);
    }
    return vec4(encode(surface_colour(point, texel)), 1.0);
}

fn surface_colour(point: GroundPoint, texel: vec4<f32>) -> vec3<f32> {
    let slopes = texel.zw * shade.slope_scale;
    let normal = normalize(vec3(-slopes.x, 1.0, -slopes.y));
    var sun = texel.x;
    var sky = texel.y;
    if !TRACED_LIGHT {
        sun = max(dot(normal, shade.to_sun.xyz), 0.0) * step(0.0, shade.to_sun.y);
        sky = 0.5 + 0.5 * normal.y;
    }
    if VIEW_MODE == VIEW_LIGHT {
        return vec3(LIGHT_VIEW_SUN * sun + LIGHT_VIEW_SKY * sky);
    }
    if VIEW_MODE == VIEW_LEVEL {
        return level_colour(point.level, point.alpha) * (0.25 + 0.75 * (LIGHT_VIEW_SUN * sun + LIGHT_VIEW_SKY * sky));
    }
    var ground = GROUND_PLAIN;
    if TINT {
        let true_up = 1.0 / sqrt(1.0 + dot(texel.zw, texel.zw));
        let rise = (point.height - shade.low_m) / max(shade.high_m - shade.low_m, RELIEF_LEAST_M);
        ground = ground_colour(clamp(rise, 0.0, 1.0), point.height + shade.base_m, true_up);
    }
    var radiance = ground * illumination(sun, sky);
    if HAZE {
        let up = ((point.height - view.eye_height_m.x) - view.eye_height_m.y) * view.vertical_scale;
        let ray = vec3(point.from_eye.x * view.spacing_m.x, up, point.from_eye.y * view.spacing_m.y);
        let distance_m = length(ray);
        let eye_m = (view.eye_height_m.x - shade.low_m) * view.vertical_scale;
        let clear = transmission(distance_m, eye_m, eye_m + up);
        let level_ray = vec3(ray.x, 0.0, ray.z) / max(length(ray.xz), 1e-20);
        radiance = radiance * clear + sky_colour(level_ray) * (1.0 - clear);
    }
    return tone(radiance);
}

// A hue per level, white towards the next one in the band.
fn level_colour(level: u32, alpha: f32) -> vec3<f32> {
    let turn = fract(f32(level) * 0.381966) * 6.0;
    let hue = clamp(vec3(abs(turn - 3.0) - 1.0, 2.0 - abs(turn - 2.0), 2.0 - abs(turn - 4.0)), vec3(0.0), vec3(1.0));
    return mix(0.25 + 0.75 * hue, vec3(1.0), 0.7 * alpha);
}
