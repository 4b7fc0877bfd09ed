// The ways of showing the ground, a function each: `view_` and the name that `src/shade.rs` gives it.
#import shared/point.wgsl

fn view_shaded(point: SurfacePoint) -> vec4<f32> {
    return surface_colour(point);
}

fn view_light(point: SurfacePoint) -> vec4<f32> {
    return vec4(vec3(grey(point)), 1.0);
}

// The light under the colours of errors, which are measured and laid over it on the CPU.
fn view_error(point: SurfacePoint) -> vec4<f32> {
    return view_light(point);
}

// A hue per level; white where the ring slides it into the next one, hatched where that is held: the black share of the
// hatching is the held one.
fn view_level(point: SurfacePoint) -> vec4<f32> {
    let shares = alpha_shares(point.level, point.from_eye);
    let banded = mix(level_hue(point.level), vec3(1.0), 0.7 * shares.x);
    let hatched = hatch(grid_place(point.level, point.from_eye), shares.y);
    return vec4(mix(banded, vec3(0.0), 0.85 * hatched) * (0.25 + 0.75 * grey(point)), 1.0);
}

// The triangles' edges over the surface.
fn view_wire(point: SurfacePoint) -> vec4<f32> {
    let surface = surface_colour(point);
    let line = mix(level_hue(point.level), vec3(1.0), 0.35);
    return vec4(mix(0.35 * surface.rgb, line, wire(grid_place(point.level, point.from_eye))), surface.a);
}

fn grey(point: SurfacePoint) -> f32 {
    return LIGHT_VIEW_SUN * point.sun + LIGHT_VIEW_SKY * point.sky;
}

fn level_hue(level: u32) -> vec3<f32> {
    let turn = fract(f32(level) * 0.381966) * 6.0;
    let hue = clamp(vec3(abs(turn - 3.0) - 1.0, 2.0 - abs(turn - 2.0), 2.0 - abs(turn - 4.0)), vec3(0.0), vec3(1.0));
    return 0.25 + 0.75 * hue;
}

// Columns and rows of a level from a whole number of them, the same over the whole picture, to a point: the triangles'
// edges lie where one of them, or their difference, is a whole number.
fn grid_place(level: u32, from_eye: vec2<f32>) -> vec2<f32> {
    let into_cell = vec2<f32>(view.anchor & vec2((1 << level) - 1)) + view.fraction;
    return (from_eye + into_cell) * levels[level].inverse_step;
}

// How much of a pixel an edge of a triangle covers, 0 to 1. The rows, columns and diagonals of a level's grid are
// distances in pixels by their derivatives on the screen, so that a line is as wide near as it is far; where cells
// are of a few pixels, what is left is their lines' share of the ground.
fn wire(place: vec2<f32>) -> f32 {
    let across = vec3(place, place.x - place.y);
    let right = dpdx(across);
    let down = dpdy(across);
    let per_px = sqrt(right * right + down * down);
    let from_edge = 0.5 - abs(fract(across) - 0.5);
    // An edge seen end on has no width to lie off it.
    let off_px = select(from_edge / per_px, vec3(0.0), per_px == vec3(0.0));
    let lines = clamp(0.5 * WIRE_PX + 0.5 - off_px, vec3(0.0), vec3(1.0));
    let share = clamp(WIRE_PX * per_px, vec3(0.0), vec3(1.0));
    let fine = mix(lines, share, smoothstep(vec3(0.2), vec3(0.5), per_px));
    return max(fine.x, max(fine.y, fine.z));
}

// Black stripes across a level's grid, one every four cells, that cover `share` of the ground; where stripes are of a few
// pixels, an even black of that share.
fn hatch(place: vec2<f32>, share: f32) -> f32 {
    let across = (place.x + place.y) * 0.25;
    let per_px = fwidth(across);
    let off_middle = abs(fract(across) - 0.5) * 2.0;
    let stripe = clamp((share - off_middle) / (2.0 * per_px) + 0.5, 0.0, 1.0);
    return select(mix(stripe, share, smoothstep(0.1, 0.3, per_px)), 0.0, share == 0.0);
}

// The ring's and the held field's share of alpha at a point between vertices.
fn alpha_shares(level: u32, from_eye: vec2<f32>) -> vec2<f32> {
    let constants = levels[level];
    if constants.has_coarser == 0u {
        return vec2(0.0);
    }
    let d = max(max(abs(from_eye.x), abs(from_eye.y)) * constants.inverse_step, constants.climb);
    let place = grid_place(level, from_eye);
    let first = vec2<i32>(floor(place));
    let sample = clamp((view.anchor >> vec2(level)) + first, vec2(0), constants.last);
    let east = held(level, min(sample + vec2(1, 0), constants.last));
    let south = held(level, min(sample + vec2(0, 1), constants.last));
    let here = held(level, sample);
    let into = place - floor(place);
    return vec2(ring(d), clamp(here + (east - here) * into.x + (south - here) * into.y, 0.0, 1.0));
}
