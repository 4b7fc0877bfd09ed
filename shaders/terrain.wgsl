// Draws patches of the clipmap: displaces their vertices, lights and colours their fragments.
//
// Vertices come from an index buffer over the 9 x 9 corners of a patch, instances are the selected patches. Ragged
// patches (voids, the DEM's edge) are drawn by a second pipeline, the only one that discards. The closing triangles
// of sides that border a coarser patch are drawn by that pipeline too, from their own indices.
#import shared/surface.wgsl
#import shared/shade.wgsl

override RAGGED: bool = false;          // whether fragments may lie outside the ground
override VIEW_MODE: u32 = 0u;           // as in src/shade.rs
override TRACED_LIGHT: bool = true;     // whether light texels hold traced light; else it follows from slopes
override TINT: bool = true;
override HAZE: bool = true;
override ENCODE_SRGB: bool = false;     // whether the target's format leaves sRGB encoding to the shader

@group(0) @binding(5) var light: texture_2d_array<f32>;
@group(0) @binding(6) var light_sampler: sampler;

struct Varyings {
    @builtin(position) @invariant position: vec4<f32>,
    @location(0) from_eye: vec2<f32>,
    @location(1) height: f32,
    @location(2) alpha: f32,
    @location(3) valid: f32,
    @location(4) @interpolate(flat) level: u32,
}

@vertex
fn vertex(
    @builtin(vertex_index) index: u32,
    @location(0) origin: vec2<i32>,
    @location(1) level: u32,
    @location(2) fill: f32,
) -> Varyings {
    let corner = vec2<i32>(vec2(index % PATCH_CORNERS, index / PATCH_CORNERS));
    let vertex = displace(origin, level, fill, corner);
    var out: Varyings;
    out.position = vertex.clip;
    out.from_eye = vertex.from_eye;
    out.height = vertex.height;
    out.alpha = vertex.alpha;
    out.valid = select(1.0, 0.0, vertex.void);
    out.level = level;
    return out;
}

// The light texel over a point, bilinear. Slots repeat, so the sampler's repetition is the torus.
fn light_at(level: u32, from_eye: vec2<f32>) -> vec4<f32> {
    let constants = levels[level];
    let texel = constants.light_at_eye + from_eye * constants.light_scale + 0.5;
    return textureSampleLevel(light, light_sampler, texel * (0.5 / f32(view.slot_mask + 1)), level, 0.0);
}

@fragment
fn fragment(in: Varyings) -> @location(0) vec4<f32> {
    if RAGGED {
        // A triangle with a void corner is valid only along the opposite side.
        let outside = in.valid < VALID_LEAST || any(in.from_eye > view.edge);
        if outside {
            discard;
        }
    }
    var texel = light_at(in.level, in.from_eye);
    if in.alpha > 0.0 {
        texel = mix(texel, light_at(in.level + 1u, in.from_eye), in.alpha);
    }
    let colour = surface_colour(in, texel);
    return vec4(encode(colour), 1.0);
}

fn surface_colour(in: Varyings, texel: vec4<f32>) -> vec3<f32> {
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
        return level_colour(in.level, in.alpha) * (0.25 + 0.75 * (LIGHT_VIEW_SUN * sun + LIGHT_VIEW_SKY * sky));
    }
    var ground = GROUND_PLAIN;
    if TINT {
        let true_up = 1.0 / sqrt(1.0 + dot(texel.zw, texel.zw));
        let rise = (in.height - shade.low_m) / max(shade.high_m - shade.low_m, RELIEF_LEAST_M);
        ground = ground_colour(clamp(rise, 0.0, 1.0), in.height + shade.base_m, true_up);
    }
    var radiance = ground * illumination(sun, sky);
    if HAZE {
        let up = ((in.height - view.eye_height_m.x) - view.eye_height_m.y) * view.vertical_scale;
        let ray = vec3(in.from_eye.x * view.spacing_m.x, up, in.from_eye.y * view.spacing_m.y);
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
