// Draws patches of the clipmap: displaces their vertices, lights and colours their fragments.
//
// Vertices come from an index buffer over the 9 x 9 corners of a patch, instances are the selected patches. Ragged
// patches (voids, the DEM's edge) are drawn by a second pipeline, the only one of the two that discards and that carries
// validity: what is interpolated is paid for with every triangle, so it is packed into as few slots as it fits.
#import shared/ground.wgsl

struct WholeVaryings {
    @builtin(position) @invariant position: vec4<f32>,
    @location(0) ground: vec4<f32>,     // samples from the eye, height, alpha
    @location(1) @interpolate(flat) level: u32,
}

struct RaggedVaryings {
    @builtin(position) @invariant position: vec4<f32>,
    @location(0) ground: vec4<f32>,
    @location(1) @interpolate(flat) level: u32,
    @location(2) valid: f32,
}

fn corner_vertex(index: u32, origin: vec2<i32>, level: u32, fill: f32) -> Vertex {
    return displace(origin, level, fill, vec2<i32>(vec2(index % PATCH_CORNERS, index / PATCH_CORNERS)));
}

fn packed(vertex: Vertex) -> vec4<f32> {
    return vec4(vertex.from_eye, vertex.height, vertex.alpha);
}

fn unpacked(ground: vec4<f32>, level: u32) -> GroundPoint {
    return GroundPoint(ground.xy, ground.z, ground.w, level);
}

@vertex
fn whole_vertex(
    @builtin(vertex_index) index: u32,
    @location(0) origin: vec2<i32>,
    @location(1) level: u32,
    @location(2) fill: f32,
) -> WholeVaryings {
    let vertex = corner_vertex(index, origin, level, fill);
    return WholeVaryings(vertex.clip, packed(vertex), level);
}

@fragment
fn whole_fragment(in: WholeVaryings) -> @location(0) vec4<f32> {
    return point_colour(unpacked(in.ground, in.level));
}

@vertex
fn ragged_vertex(
    @builtin(vertex_index) index: u32,
    @location(0) origin: vec2<i32>,
    @location(1) level: u32,
    @location(2) fill: f32,
) -> RaggedVaryings {
    let vertex = corner_vertex(index, origin, level, fill);
    return RaggedVaryings(vertex.clip, packed(vertex), level, select(1.0, 0.0, vertex.void));
}

@fragment
fn ragged_fragment(in: RaggedVaryings) -> @location(0) vec4<f32> {
    // A triangle with a void corner is valid only along the opposite side.
    if in.valid < VALID_LEAST || any(in.ground.xy > view.edge) {
        discard;
    }
    return point_colour(unpacked(in.ground, in.level));
}
