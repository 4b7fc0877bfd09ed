// Closes the sides of patches that border a coarser one, with triangles of no area: coarse end, middle, coarse end.
//
// The middle vertex lies on the coarse edge but for rounding, which may leave a pinhole between the two patches. The
// rasteriser covers it with such a triangle; what it interpolates across it is worthless (a quotient of an area near
// zero), so nothing is: the middle vertex carries both ends, flat, and the fragment finds its place between them.
#import shared/ground.wgsl

struct Varyings {
    @builtin(position) @invariant position: vec4<f32>,
    // Of the first vertex of the triangle, its middle. Ends: clip x, y, w and height; samples from the eye.
    @location(0) @interpolate(flat) start: vec4<f32>,
    @location(1) @interpolate(flat) end: vec4<f32>,
    @location(2) @interpolate(flat) from_eye: vec4<f32>,
    @location(3) @interpolate(flat) valid: u32,
    @location(4) @interpolate(flat) level: u32,
}

struct Fragment {
    @location(0) colour: vec4<f32>,
    @builtin(frag_depth) depth: f32,
}

// Column and row of the k-th vertex along a side: west, east, north, south.
fn side_corner(side: u32, k: i32) -> vec2<i32> {
    let far = i32(PATCH_CORNERS) - 1;
    let across = select(0, far, (side & 1u) == 1u);
    return select(vec2(k, across), vec2(across, k), side < 2u);
}

@vertex
fn vertex(
    @builtin(vertex_index) index: u32,
    @location(0) origin: vec2<i32>,
    @location(1) level: u32,
    @location(2) fill: f32,
) -> Varyings {
    let side = index / PATCH_CORNERS;
    let k = i32(index % PATCH_CORNERS);
    let here = displace(origin, level, fill, side_corner(side, k));
    let start = displace(origin, level, fill, side_corner(side, k - 1));
    let end = displace(origin, level, fill, side_corner(side, k + 1));
    var out: Varyings;
    out.position = here.clip;
    out.start = vec4(start.clip.x, start.clip.y, start.clip.w, start.height);
    out.end = vec4(end.clip.x, end.clip.y, end.clip.w, end.height);
    out.from_eye = vec4(start.from_eye, end.from_eye);
    out.valid = select(1u, 0u, here.void || start.void || end.void);
    out.level = level;
    return out;
}

// Where between two ends, in clip space, a pixel lies on the screen: 0 to 1, to be used for what is linear there.
fn place_between(pixel: vec2<f32>, start: vec4<f32>, end: vec4<f32>) -> f32 {
    if min(start.z, end.z) < view.near_m {
        return select(0.0, 1.0, end.z > start.z); // an end behind the near plane is nowhere on the screen
    }
    let half_size = 0.5 * view.size_px;
    let start_px = vec2(1.0 + start.x / start.z, 1.0 - start.y / start.z) * half_size;
    let end_px = vec2(1.0 + end.x / end.z, 1.0 - end.y / end.z) * half_size;
    let along = end_px - start_px;
    let length_squared = dot(along, along);
    let t = dot(pixel - start_px, along) / select(length_squared, 1.0, length_squared == 0.0);
    return clamp(t, 0.0, 1.0);
}

@fragment
fn fragment(in: Varyings) -> Fragment {
    let t = place_between(in.position.xy, in.start, in.end);
    // 1 / w is linear on the screen; all else is linear in it.
    let start_share = (1.0 - t) / max(in.start.z, view.near_m);
    let end_share = t / max(in.end.z, view.near_m);
    let inverse_w = start_share + end_share;
    let u = end_share / inverse_w;
    let from_eye = mix(in.from_eye.xy, in.from_eye.zw, u);
    if in.valid == 0u || any(from_eye > view.edge) {
        discard;
    }
    var out: Fragment;
    out.colour = point_colour(GroundPoint(from_eye, mix(in.start.w, in.end.w, u), 1.0, in.level));
    out.depth = view.depth.x + view.depth.y * inverse_w;
    return out;
}
