//! light
/// TEMPORARY
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// a
    pub azimuth_deg: f64,
    /// b
    pub altitude_deg: f64,
}
impl Sun {
    /// d
    pub fn direction(&self) -> glam::DVec3 {
        let (sa, ca) = crate::camera::sin_cos_degrees(self.azimuth_deg);
        let (sl, cl) = crate::camera::sin_cos_degrees(self.altitude_deg);
        glam::DVec3::new(sa * cl, sl, -ca * cl)
    }
}
