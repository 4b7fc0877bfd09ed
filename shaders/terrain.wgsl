// Draws patches of the clipmap: displaces their vertices, lights and colours their fragments.
//
// Vertices come from an index buffer over the 9 x 9 corners of a patch, instances are the selected patches. Ragged
// patches (voids, the DEM's edge) are drawn by a second pipeline, the only one of the two that discards.
#import shared/ground.wgsl

override RAGGED: bool = false;          // whether fragments may lie outside the ground

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

@fragment
fn fragment(in: Varyings) -> @location(0) vec4<f32> {
    if RAGGED {
        // A triangle with a void corner is valid only along the opposite side.
        let outside = in.valid < VALID_LEAST || any(in.from_eye > view.edge);
        if outside {
            discard;
        }
    }
    return point_colour(GroundPoint(in.from_eye, in.height, in.alpha, in.level));
}
