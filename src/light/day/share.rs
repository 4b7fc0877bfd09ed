//! The sun's share at any time of a day from what is stored of it: what is drawn.

/// Coefficients of [`disc`]: of x, x^3 and x^5.
#[allow(clippy::approx_constant, reason = "the three are to sum to a half in f32 too")]
const DISC: [f32; 3] = [0.636_62, -0.1017, -0.034_92];

/// The coefficients of [`disc`]: of x, x^3 and x^5.
pub(crate) fn disc_coefficients() -> [f32; 3] {
    DISC
}

/// The share of a disc of radius 1 that lies on one side of a line at distance x from its middle: 0 at -1 and below, 1 at
/// 1 and above. Within 0.006 of `1 - (acos x - x sqrt(1 - x^2)) / pi`.
pub fn disc(x: f32) -> f32 {
    let x = x.clamp(-1.0, 1.0);
    let square = x * x;
    0.5 + x * (DISC[0] + square * (DISC[1] + square * DISC[2]))
}

/// The integral of [`disc`] from -1 to x: the mean of `max(0, x + u)` over u of a half circle's distribution.
pub fn disc_integral(x: f32) -> f32 {
    let clamped = x.clamp(-1.0, 1.0);
    let square = clamped * clamped;
    let least = 0.5 - DISC[0] / 2.0 - DISC[1] / 4.0 - DISC[2] / 6.0;
    let inner = least
        + clamped * 0.5
        + square * (DISC[0] / 2.0 + square * (DISC[1] / 4.0 + square * (DISC[2] / 6.0)));
    inner + (x - 1.0).max(0.0)
}

/// The sun's share at `time` of a day on ground of `slopes` (rise over run to the east and to the south), of which `day`
/// is (first, first_soft, last, last_soft), and `rough` how far the slopes of the ground under it spread about those (root
/// mean square, an axis). `to_sun` is the unit vector to the sun: east, up, south.
///
/// The twin of `day_sun` in `shaders/shared/ground.wgsl`.
pub fn sun_of_day(day: [f32; 4], rough: f32, slopes: [f32; 2], to_sun: [f32; 3], time: f32) -> f32 {
    let share = (disc((time - day[0]) / day[1]) - disc((time - day[2]) / day[3])).max(0.0);
    let level = (to_sun[0] * to_sun[0] + to_sun[2] * to_sun[2]).sqrt();
    let mean = to_sun[1] - slopes[0] * to_sun[0] - slopes[1] * to_sun[2];
    let width = (2.0 * rough * level).max(1e-4);
    let x = mean / width;
    let facing = disc(x);
    let cosine = width * disc_integral(x)
        / (1.0 + slopes[0] * slopes[0] + slopes[1] * slopes[1] + 2.0 * rough * rough).sqrt();
    (cosine * (share / facing.max(1e-3)).min(1.0)).min(1.0)
}
