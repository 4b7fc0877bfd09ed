// The drawn surface: what a frame and its levels are, and where a patch's vertices go.
//
// The vertex function's twin is `src/clipmap/vertex.rs`: same names, same order of steps. The structs are those of
// `src/clipmap/constants.rs`, compared by a test. Nothing here is absolute: positions are samples from the eye.

override MORPHS: bool = true;   // whether alpha may be other than 0: else no coarser level and nothing held is looked up

struct ViewConstants {
    clip_from_east: vec4<f32>,  // clip coordinates of a metre to the east of the eye
    clip_from_up: vec4<f32>,
    clip_from_south: vec4<f32>,
    ray_right: vec4<f32>,       // what the picture's right edge adds to ray_middle
    ray_up: vec4<f32>,          // what its upper edge adds
    ray_middle: vec4<f32>,      // metres from the eye to the picture's middle, at distance 1 along the view axis
    anchor: vec2<i32>,          // the level-0 sample on which positions are based
    fraction: vec2<f32>,        // samples from the anchor to the eye
    spacing_m: vec2<f32>,       // metres between columns and rows of level 0
    eye_height_m: vec2<f32>,    // above the DEM's base: a high and a low part
    edge: vec2<f32>,            // samples from the eye to the DEM's last column and row
    size_px: vec2<f32>,         // of the picture
    vertical_scale: f32,
    near_m: f32,                // nearest drawn distance along the view axis
    reach: f32,                 // R, in steps of a level
    transition: f32,            // T, in steps of a level
    slot_mask: i32,             // clip size - 1
    held_mask: i32,             // slots along a side of the held field - 1
    depth: vec2<f32>,           // a and b of clip z = a w + b
}

struct LevelConstants {
    last: vec2<i32>,            // last column and row of the level
    slot_shift: vec2<i32>,      // added to an index before its slot is taken
    parent_last: vec2<i32>,     // last patch of the next coarser level
    inverse_step: f32,          // 2^-l
    climb: f32,                 // the camera's height over the ground as a distance in steps
    light_at_eye: vec2<f32>,    // slot of the light texel at the eye, with its fraction
    light_scale: f32,           // light texels per level-0 sample
    has_coarser: u32,           // 0 on the coarsest level
}

@group(0) @binding(0) var<uniform> view: ViewConstants;
@group(0) @binding(1) var<uniform> levels: array<LevelConstants, LEVEL_SLOTS>;
@group(0) @binding(2) var heights: texture_2d_array<f32>;
@group(0) @binding(3) var held_corners: texture_2d_array<f32>;

struct Vertex {
    from_eye: vec2<f32>,    // samples of level 0 east and south of the eye
    height: f32,            // metres above the DEM's base
    alpha: f32,             // 0 on the vertex's own level, 1 on the next coarser surface
    void: bool,             // no data: the vertex's triangles are holes
    clip: vec4<f32>,
}

fn load_height(level: u32, sample: vec2<i32>) -> f32 {
    let slot = (sample + levels[level].slot_shift) & vec2(view.slot_mask);
    return textureLoad(heights, slot, level, 0).x;
}

fn load_held(level: u32, corner: vec2<i32>) -> f32 {
    return textureLoad(held_corners, corner & vec2(view.held_mask), level, 0).x;
}

// From s at k = 0 to t at k = 1, both exactly.
fn lerp(s: f32, t: f32, k: f32) -> f32 {
    return select(s + (t - s) * k, t, k == 1.0);
}

// The ring's share of alpha at distance d in steps. Its ends are selected: a division may be off by an ulp.
fn ring(d: f32) -> f32 {
    let start = view.reach - view.transition;
    let band = clamp((d - start) / view.transition, 0.0, 1.0);
    return select(select(0.0, band, d > start), 1.0, d >= view.reach);
}

// The held field of a level at its vertex: bilinear between the corners of the parent patch, 16 vertices wide.
fn held(level: u32, sample: vec2<i32>) -> f32 {
    let patch_index = min(sample >> vec2(4u), levels[level].parent_last);
    let k = vec2<f32>(sample - (patch_index << vec2(4u))) * 0.0625;
    let north = lerp(load_held(level, patch_index), load_held(level, patch_index + vec2(1, 0)), k.x);
    let south = lerp(load_held(level, patch_index + vec2(0, 1)), load_held(level, patch_index + vec2(1, 1)), k.x);
    return lerp(north, south, k.y);
}

// The vertex at column and row `corner` (0 to 8) of a drawn patch.
fn displace(origin: vec2<i32>, level: u32, fill: f32, corner: vec2<i32>) -> Vertex {
    let constants = levels[level];
    // Vertices past the last sample fall on it.
    let sample = min(origin + corner, constants.last);

    let k = (sample << vec2(level)) - view.anchor;
    let from_eye = vec2<f32>(k) - view.fraction;

    let ground = max(abs(from_eye.x), abs(from_eye.y)) * constants.inverse_step;
    let d = max(ground, constants.climb);
    var alpha = 0.0;
    let h = load_height(level, sample);
    var c0 = h;
    var c1 = h;
    if MORPHS && constants.has_coarser != 0u {
        alpha = max(ring(d), held(level, sample));
        // The coarse sample where both indices are even, else the ends of the edge or diagonal that holds the vertex.
        c0 = load_height(level + 1u, sample >> vec2(1u));
        c1 = load_height(level + 1u, (sample + 1) >> vec2(1u));
    }
    let c_void = c0 == VOID_HEIGHT || c1 == VOID_HEIGHT;
    let c = c0 * 0.5 + c1 * 0.5;

    // Selected, not mixed, at the ends.
    let morphed = select(h + alpha * (c - h), h, alpha == 0.0 || c_void);
    let void = select(h == VOID_HEIGHT, c_void, alpha == 1.0);
    let drawn = select(morphed, c, alpha == 1.0);
    let height = select(drawn, fill, void);

    let east = from_eye.x * view.spacing_m.x;
    let up = ((height - view.eye_height_m.x) - view.eye_height_m.y) * view.vertical_scale;
    let south = from_eye.y * view.spacing_m.y;
    // Summed in this order, term by term: a matrix product's order differs between adapters.
    let position = view.clip_from_east * east + view.clip_from_up * up + view.clip_from_south * south;

    var vertex: Vertex;
    vertex.from_eye = from_eye;
    vertex.height = height;
    vertex.alpha = alpha;
    vertex.void = void;
    vertex.clip = vec4(position.x, position.y, view.depth.x * position.w + view.depth.y, position.w);
    return vertex;
}
