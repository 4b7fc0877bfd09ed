// Boxes of the embedding program: lit by one sun, at home in the same depth buffer as the terrain.

struct Varyings {
    @builtin(position) position: vec4<f32>,
    @location(0) normal: vec3<f32>,
    @location(1) colour: vec3<f32>,
}

// The corners of a box's two triangles a side, each coordinate -1 or 1: the side's axis and direction, then two more.
fn corner(index: u32) -> array<vec3<f32>, 2> {
    let side = index / 6u;
    let towards = select(-1.0, 1.0, (side & 1u) == 1u);
    let in_side = array(vec2(-1.0, -1.0), vec2(1.0, -1.0), vec2(1.0, 1.0), vec2(-1.0, -1.0), vec2(1.0, 1.0), vec2(-1.0, 1.0));
    let p = in_side[index % 6u];
    switch side / 2u {
        case 0u: { return array(vec3(towards, p.x, p.y), vec3(towards, 0.0, 0.0)); }
        case 1u: { return array(vec3(p.x, towards, p.y), vec3(0.0, towards, 0.0)); }
        default: { return array(vec3(p.x, p.y, towards), vec3(0.0, 0.0, towards)); }
    }
}

@vertex
fn vertex(
    @builtin(vertex_index) index: u32,
    @location(0) clip_0: vec4<f32>,
    @location(1) clip_1: vec4<f32>,
    @location(2) clip_2: vec4<f32>,
    @location(3) clip_3: vec4<f32>,
    @location(4) turn: vec4<f32>,
    @location(5) colour: vec4<f32>,
) -> Varyings {
    let of_box = corner(index);
    let n = of_box[1];
    let normal = vec3(turn.x * n.x + turn.y * n.z, n.y, turn.x * n.z - turn.y * n.x);
    return Varyings(mat4x4(clip_0, clip_1, clip_2, clip_3) * vec4(of_box[0], 1.0), normal, colour.rgb);
}

@fragment
fn fragment(in: Varyings) -> @location(0) vec4<f32> {
    let to_sun = normalize(vec3(-0.5, 0.7, -0.5));
    return vec4(in.colour * (0.25 + 0.75 * max(dot(in.normal, to_sun), 0.0)), 1.0);
}
