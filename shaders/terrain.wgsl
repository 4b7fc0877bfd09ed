// Draws patches of the clipmap: displaces their vertices, lights and colours their fragments.
//
// Vertices come from an index buffer over the 9 x 9 corners of a patch, instances are the selected patches. Still patches
// (alpha is 0 on all of them) have a pipeline that looks up nothing coarser, ragged ones (voids, the DEM's edge) the only
// one that discards and that carries validity: what is interpolated is paid for with every triangle, so it is packed into
// as few slots as it fits.
#import shared/ground.wgsl

struct WholeVaryings {
    @builtin(position) @invariant position: vec4<f32>,
    @location(0) ground: vec4<f32>,     // samples from the eye, height, level and alpha
}

struct RaggedVaryings {
    @builtin(position) @invariant position: vec4<f32>,
    @location(0) ground: vec4<f32>,
    @location(1) valid: f32,
}

fn corner_vertex(index: u32, origin: vec2<i32>, level: u32, fill: f32) -> Vertex {
    return displace(origin, level, fill, vec2<i32>(vec2(index % PATCH_CORNERS, index / PATCH_CORNERS)));
}

// The level, the same at all vertices of a patch, and alpha share a number: 2 level + alpha.
fn packed(vertex: Vertex, level: u32) -> vec4<f32> {
    return vec4(vertex.from_eye, vertex.height, 2.0 * f32(level) + vertex.alpha);
}

// Interpolation rounds: taken in steps, a level comes out whole, and alpha 0 and 1 as such.
fn unpacked(ground: vec4<f32>) -> GroundPoint {
    let level_alpha = round(ground.w * ALPHA_STEPS) * (1.0 / ALPHA_STEPS);
    let level = floor(level_alpha * 0.5);
    return GroundPoint(ground.xy, ground.z, level_alpha - 2.0 * level, u32(level));
}

@vertex
fn whole_vertex(
    @builtin(vertex_index) index: u32,
    @location(0) origin: vec2<i32>,
    @location(1) level: u32,
    @location(2) fill: f32,
) -> WholeVaryings {
    let vertex = corner_vertex(index, origin, level, fill);
    return WholeVaryings(vertex.clip, packed(vertex, level));
}

@fragment
fn whole_fragment(in: WholeVaryings) -> @location(0) vec4<f32> {
    return point_colour(unpacked(in.ground));
}

@vertex
fn ragged_vertex(
    @builtin(vertex_index) index: u32,
    @location(0) origin: vec2<i32>,
    @location(1) level: u32,
    @location(2) fill: f32,
) -> RaggedVaryings {
    let vertex = corner_vertex(index, origin, level, fill);
    return RaggedVaryings(vertex.clip, packed(vertex, level), select(1.0, 0.0, vertex.void));
}

@fragment
fn ragged_fragment(in: RaggedVaryings) -> @location(0) vec4<f32> {
    // A triangle with a void corner is valid only along the opposite side.
    if in.valid < VALID_LEAST || any(in.ground.xy > view.edge) {
        discard;
    }
    return point_colour(unpacked(in.ground));
}
