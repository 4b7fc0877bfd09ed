// The colour of a point of the ground: what is known of it, handed to the view that was asked for. Shared by patches and
// by the triangles that close their sides.
#import shared/views.wgsl
#import view colour
#import surface function

override TRACED_LIGHT: bool = true;     // whether light texels hold traced light; else it follows from slopes
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
    let constants = levels[level];
    let place = round(from_eye * (constants.light_scale * LIGHT_TEXEL_STEPS)) * (1.0 / LIGHT_TEXEL_STEPS);
    let texel = constants.light_at_eye + place + 0.5;
    return textureSampleLevel(light, light_sampler, texel * (0.5 / f32(view.slot_mask + 1)), level, 0.0);
}

fn point_colour(point: GroundPoint) -> vec4<f32> {
    var texel = light_at(point.level, point.from_eye);
    if MORPHS && point.alpha > 0.0 {
        texel = mix(texel, light_at(point.level + 1u, point.from_eye), point.alpha);
    }
    let colour = view_colour(surface_point(point, texel));
    return vec4(encode(colour.rgb), colour.a);
}

fn surface_point(point: GroundPoint, texel: vec4<f32>) -> SurfacePoint {
    let drawn_slopes = texel.zw * shade.slope_scale;
    let up_m = ((point.height - view.eye_height_m.x) - view.eye_height_m.y) * view.vertical_scale;
    var out: SurfacePoint;
    out.from_eye_m = vec3(point.from_eye.x * view.spacing_m.x, up_m, point.from_eye.y * view.spacing_m.y);
    out.height_m = point.height + shade.base_m;
    out.above_base_m = point.height;
    out.slopes = texel.zw;
    out.normal = normalize(vec3(-drawn_slopes.x, 1.0, -drawn_slopes.y));
    out.sun = texel.x;
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
