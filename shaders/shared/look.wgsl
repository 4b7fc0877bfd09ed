// The look of the ground where the caller has no function of their own: tint by height and slope, sun and sky, air.

fn surface_colour(point: SurfacePoint) -> vec4<f32> {
    var ground = GROUND_PLAIN;
    if TINT {
        ground = tint(point);
    }
    var radiance = ground * illumination(point.sun, point.sky);
    if HAZE {
        radiance = through_air(radiance, point.from_eye_m);
    }
    return vec4(tone(radiance), 1.0);
}
