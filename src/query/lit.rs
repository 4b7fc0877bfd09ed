//! The shadow surface, asked: how much of the sun's disc a point at or above the ground sees.
//!
//! A point in the air over ground is in shadow where the shadow surface of the sun's place, the height below which the air
//! there is dark, lies above it. As no ground hangs over, a ray from the point that meets the ground still does when it is
//! lowered; so in the sun's direction there is one angle of elevation above which the point sees the sky. That angle is
//! found by halving over the half degree of the disc, with the rays of [`Surface::ray`]; most points need two of them, as
//! they see all of the disc or none. The share is then that of [`disc_share`], as for the light of a terrain file.

use glam::DVec3;

use super::Surface;
use crate::error::Result;
use crate::light::{DISC_DEG, Earth, Sun, disc_share};

/// The part of a spacing by which a point on the ground is taken above it, so that its own place casts no shadow on it.
const LIFT: f64 = 1.0 / (1u64 << 20) as f64;

/// Halvings of the disc: its share is then within 2e-5.
const HALVINGS: u32 = 16;

/// The share of the disc of `sun` that is seen from the world point (x, y, z), in metres, over `surface`: 0 in full shadow, 1
/// in full light. None below the ground. Where no ground is (a hole, beyond the DEM) nothing stands in the way of the point
/// itself, and none of it casts a shadow.
///
/// `earth` turns the sun's azimuth from true north to the grid's; its curve is not heeded. For the sun of a time of day see
/// [`crate::light::Day::sun`]; the terrain's own is [`crate::stream::Terrain::sun`]. The light of things that stand there is
/// the share times the cosine of their own normal.
///
/// # Errors
/// [`crate::ErrorKind::Misuse`] for other than finite numbers and a sun that is nowhere; those of reading.
pub fn lit_at<S: Surface + ?Sized>(
    surface: &S,
    earth: &Earth,
    sun: Sun,
    [x_m, y_m, z_m]: [f64; 3],
) -> Result<Option<f64>> {
    sun.check()?;
    let grid = surface.grid();
    let mut point = DVec3::new(x_m, y_m, z_m);
    if let Some(ground_m) = surface.height_at(x_m, z_m)? {
        let lift_m = LIFT * grid.spacing_m[0].min(grid.spacing_m[1]);
        // A height that was asked for may have lost its last bits on the way.
        if y_m < ground_m - lift_m {
            return Ok(None);
        }
        point.y = y_m.max(ground_m + lift_m);
    }
    let radius = (DISC_DEG / 2.0).to_radians();
    let altitude = sun.altitude_deg.to_radians();
    let seen = |elevation: f64| -> Result<bool> {
        let direction = Sun {
            azimuth_deg: earth.on_grid_deg(sun.azimuth_deg),
            altitude_deg: elevation.to_degrees().clamp(-90.0, 90.0),
        }
        .direction();
        Ok(surface.ray(point, direction.into())?.is_none())
    };
    let (mut hidden, mut clear) = (altitude - radius, altitude + radius);
    // The horizon is nowhere below level, as where a plain goes on beyond the DEM.
    if clear <= 0.0 || !seen(clear)? {
        return Ok(Some(0.0));
    }
    if hidden <= 0.0 {
        if seen(0.0)? {
            return Ok(Some(disc_share(0.0, altitude)));
        }
        hidden = 0.0;
    } else if seen(hidden)? {
        return Ok(Some(1.0));
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (hidden + clear);
        if seen(middle)? {
            clear = middle;
        } else {
            hidden = middle;
        }
    }
    Ok(Some(disc_share(0.5 * (hidden + clear), altitude)))
}
