// Draws the sky where no terrain is: one triangle over the whole picture at infinite distance.
#import shared/shade.wgsl

override ENCODE_SRGB: bool = false;     // whether the target's format leaves sRGB encoding to the shader

struct SkyConstants {
    right: vec4<f32>,       // half the picture's width at distance 1, in metres east, up, south
    up: vec4<f32>,          // half its height
    forward: vec4<f32>,     // unit vector
}

@group(0) @binding(0) var<uniform> camera: SkyConstants;

struct Varyings {
    @builtin(position) position: vec4<f32>,
    @location(0) ndc: vec2<f32>,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Varyings {
    let ndc = vec2(select(-1.0, 3.0, index == 1u), select(-1.0, 3.0, index == 2u));
    return Varyings(vec4(ndc, 0.0, 1.0), ndc);
}

@fragment
fn fragment(in: Varyings) -> @location(0) vec4<f32> {
    let ray = camera.forward.xyz + camera.right.xyz * in.ndc.x + camera.up.xyz * in.ndc.y;
    return vec4(encode(tone(sky_colour(normalize(ray)))), 1.0);
}
