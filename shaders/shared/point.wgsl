// What is known of a point of the drawn surface, and what its colour may be made of: by the views, by this crate's look,
// and by a caller's own surface function.
#import shared/surface.wgsl
#import shared/shade.wgsl

// A point of the drawn surface.
struct SurfacePoint {
    from_eye_m: vec3<f32>,  // metres east, up (as drawn, vertical scale included) and south of the eye
    height_m: f32,          // the DEM's own height
    above_base_m: f32,      // the same above the DEM's base, finer where that is not 0
    normal: vec3<f32>,      // of the ground as drawn: unit vector east, up, south
    slopes: vec2<f32>,      // rise over run to the east and to the south, before vertical scale
    sun: f32,               // share of the sun's light: its disc that is seen, times the cosine to the normal
    sky: f32,               // share of the sky that is seen
    from_eye: vec2<f32>,    // samples of level 0 east and south of the eye
    alpha: f32,             // 0 on its own level, 1 on the next coarser surface
    level: u32,             // 0 is the finest
}

// The ground's own colour at a point: by its height within the DEM's, its height above the sea, and its true slope.
fn tint(point: SurfacePoint) -> vec3<f32> {
    let true_up = inverseSqrt(1.0 + dot(point.slopes, point.slopes));
    let rise = (point.above_base_m - shade.low_m) * shade.per_relief;
    return ground_colour(clamp(rise, 0.0, 1.0), point.height_m, true_up);
}

// What is left of a point's radiance at the eye, and the light that the air between them adds.
fn through_air(radiance: vec3<f32>, from_eye_m: vec3<f32>) -> vec3<f32> {
    // Farther than f32 can square a length is infinite, and times no density at all no number.
    let distance_m = min(length(from_eye_m), 1e18);
    let clear = transmission(distance_m, from_eye_m.y);
    let level_ray = vec3(from_eye_m.x, 0.0, from_eye_m.z) * inverseSqrt(max(dot(from_eye_m.xz, from_eye_m.xz), 1e-30));
    return radiance * clear + horizon_colour(level_ray) * (1.0 - clear);
}
