// Draws the sky where no terrain is: one triangle over the whole picture, at the depth to which it was cleared.
#import shared/surface.wgsl
#import shared/shade.wgsl

override ENCODE_SRGB: bool = false;     // whether the target's format leaves sRGB encoding to the shader

override FAR_DEPTH: f32 = 0.0;          // the depth that is cleared to

struct Varyings {
    @builtin(position) position: vec4<f32>,
    @location(0) ndc: vec2<f32>,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Varyings {
    let ndc = vec2(select(-1.0, 3.0, index == 1u), select(-1.0, 3.0, index == 2u));
    return Varyings(vec4(ndc, FAR_DEPTH, 1.0), ndc);
}

@fragment
fn fragment(in: Varyings) -> @location(0) vec4<f32> {
    let ray = view.ray_middle.xyz + view.ray_right.xyz * in.ndc.x + view.ray_up.xyz * in.ndc.y;
    return vec4(encode(tone(sky_colour(normalize(ray)))), 1.0);
}
