//! What pipelines are made for: targets, depth, light, and the caller's own surface function.

use super::shader::Parts;
use crate::camera::DepthDirection;
use crate::error::{Error, ErrorKind, Result};
use crate::shade::ViewMode;

/// What pipelines are made for.
///
/// The caller owns the targets and clears them: depth to [`RendererOptions::clear_depth`].
#[derive(Clone, Debug, PartialEq)]
pub struct RendererOptions {
    /// Format of the colour target: 8 or 10 bits a channel, or float. Formats of whole numbers get encoded as sRGB, by
    /// the format itself or by the shader; float formats get linear colours.
    pub colour_format: wgpu::TextureFormat,
    /// Format of the depth target, with or without a stencil (which is left alone). Formats other than 32-bit float need
    /// views with a near and a far distance of their own ([`crate::camera::Depth`]).
    pub depth_format: wgpu::TextureFormat,
    /// Which way depth runs. The views that are drawn must agree.
    pub depth_direction: DepthDirection,
    /// Samples a pixel: 1 or 4.
    pub sample_count: u32,
    /// What is shown.
    pub view_mode: ViewMode,
    /// Whether the terrain has traced light ([`crate::Clipmap::has_light`]); else light follows from slopes and sun.
    pub traced_light: bool,
    /// Whether light is that of a day at the time of [`super::ViewTextures::set_time_of_day`]
    /// ([`crate::Clipmap::has_day`]); else the light of the terrain's one sun.
    pub day: bool,
    /// Whether the ground is tinted by height and slope.
    pub tint: bool,
    /// Whether air lies between ground and eye.
    pub haze: bool,
    /// WGSL of the caller's own that colours the ground instead of tint, light and haze: any number of declarations, one
    /// of which is `fn surface_colour(point: SurfacePoint) -> vec4<f32>`.
    ///
    /// It returns linear red, green and blue, 0 to 1 for formats of whole numbers, and what the target's alpha is to be.
    /// It is called once a fragment, and has no bindings. Of the point it knows
    ///
    /// ```wgsl
    /// struct SurfacePoint {
    ///     from_eye_m: vec3<f32>,  // metres east, up (as drawn, vertical scale included) and south of the eye
    ///     height_m: f32,          // the DEM's own height
    ///     above_base_m: f32,      // the same above the DEM's base, finer where that is not 0
    ///     normal: vec3<f32>,      // of the ground as drawn: unit vector east, up, south
    ///     slopes: vec2<f32>,      // rise over run to the east and to the south, before vertical scale
    ///     sun: f32,               // share of the sun's light: its disc that is seen, times the cosine to the normal
    ///     sky: f32,               // share of the sky that is seen
    ///     from_eye: vec2<f32>,    // samples of level 0 east and south of the eye
    ///     alpha: f32,             // 0 on its own level, 1 on the next coarser surface
    ///     level: u32,             // 0 is the finest
    /// }
    /// ```
    ///
    /// and it may call what this crate's own look is made of: `tint(point)`, the ground's own colour by height and slope;
    /// `illumination(sun, sky)`, the light on it; `through_air(radiance, point.from_eye_m)`, what reaches the eye; and
    /// `tone(radiance)`, which takes radiance to 0 to 1. Contour lines every 100 m on grey ground, for example:
    ///
    /// ```wgsl
    /// fn surface_colour(point: SurfacePoint) -> vec4<f32> {
    ///     let lines = point.height_m / 100.0;
    ///     let off_line = (0.5 - abs(fract(lines) - 0.5)) / max(fwidth(lines), 1e-6);
    ///     let ground = mix(vec3(0.05), vec3(0.4), smoothstep(0.5, 1.5, off_line));
    ///     return vec4(tone(ground * illumination(point.sun, point.sky)), 1.0);
    /// }
    /// ```
    ///
    /// Names that the shaders have already are refused like anything else that does not compile. Derivatives are zero or
    /// meaningless on the few pixels where a seam between levels is closed. Where it discards, or what it returns is
    /// blended, [`crate::clipmap::ClipmapOptions::occlusion`] is to be cleared: else ground behind ground is left out.
    pub surface: Option<String>,
}

impl Default for RendererOptions {
    fn default() -> Self {
        Self {
            colour_format: wgpu::TextureFormat::Rgba8UnormSrgb,
            depth_format: wgpu::TextureFormat::Depth32Float,
            depth_direction: DepthDirection::Reversed,
            sample_count: 1,
            view_mode: ViewMode::Shaded,
            traced_light: true,
            day: false,
            tint: true,
            haze: true,
            surface: None,
        }
    }
}

impl RendererOptions {
    /// What the caller clears depth to before drawing: 0 where it is reversed, 1 where it runs forward.
    pub fn clear_depth(&self) -> f32 {
        match self.depth_direction {
            DepthDirection::Reversed => 0.0,
            DepthDirection::Forward => 1.0,
        }
    }

    /// Refuses formats and sample counts that `device` cannot draw with.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`], naming the option.
    pub fn check(&self, device: &wgpu::Device) -> Result<()> {
        let misuse =
            |subject: &str, what: String| Err(Error::new(ErrorKind::Misuse, subject.to_string(), what));
        let features = device.features();
        for (subject, format) in [
            ("colour format", self.colour_format),
            ("depth format", self.depth_format),
        ] {
            if !features.contains(format.required_features()) {
                let needs = format.required_features();
                return misuse(
                    subject,
                    format!("{format:?} needs a device with the feature {needs}"),
                );
            }
        }
        let colour = self.colour_format.guaranteed_format_features(features);
        let float = matches!(
            self.colour_format.sample_type(None, Some(features)),
            Some(wgpu::TextureSampleType::Float { .. })
        );
        let target = colour
            .allowed_usages
            .contains(wgpu::TextureUsages::RENDER_ATTACHMENT);
        if !(target && float) {
            return misuse(
                "colour format",
                format!("{:?} is no target for colours", self.colour_format),
            );
        }
        if !self.depth_format.has_depth_aspect() {
            return misuse("depth format", format!("{:?} has no depth", self.depth_format));
        }
        if ![1, 4].contains(&self.sample_count) {
            return Err(Error::new(
                ErrorKind::Misuse,
                "multisampling",
                format!("{} samples a pixel", self.sample_count),
            )
            .advice("use 1 or 4"));
        }
        if !colour.flags.sample_count_supported(self.sample_count) {
            let what = format!(
                "{:?} has no {} samples a pixel",
                self.colour_format, self.sample_count
            );
            return misuse("multisampling", what);
        }
        Ok(())
    }

    /// What these options put into shaders.
    pub(super) fn parts(&self) -> Parts<'_> {
        Parts {
            view_mode: self.view_mode,
            surface: self.surface.as_deref(),
        }
    }

    /// Whether the shader encodes sRGB: for formats of whole numbers that do not do it themselves.
    pub(super) fn encodes_srgb(&self) -> bool {
        use wgpu::TextureFormat as Format;
        matches!(
            self.colour_format,
            Format::R8Unorm
                | Format::Rg8Unorm
                | Format::Rgba8Unorm
                | Format::Bgra8Unorm
                | Format::Rgb10a2Unorm
        )
    }

    /// How depth is tested by what `write`s it or not.
    pub(super) fn depth_state(&self, write: bool, compare: wgpu::CompareFunction) -> wgpu::DepthStencilState {
        wgpu::DepthStencilState {
            format: self.depth_format,
            depth_write_enabled: Some(write),
            depth_compare: Some(compare),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }
    }

    /// The comparison by which nearer fragments win.
    pub(super) fn nearer(&self) -> wgpu::CompareFunction {
        match self.depth_direction {
            DepthDirection::Reversed => wgpu::CompareFunction::Greater,
            DepthDirection::Forward => wgpu::CompareFunction::Less,
        }
    }

    /// Refuses a view whose near distance, clip z terms and this format's depth do not go together.
    pub(super) fn check_view(&self, clipmap: &crate::Clipmap) -> Result<()> {
        let view = clipmap.view_constants();
        let direction = if view.depth[1] > 0.0 {
            DepthDirection::Reversed
        } else {
            DepthDirection::Forward
        };
        if direction != self.depth_direction {
            let what = format!(
                "depth runs {direction:?}, but pipelines are made for {:?}",
                self.depth_direction
            );
            return Err(Error::new(ErrorKind::Misuse, "view", what.to_lowercase())
                .advice("set RendererOptions::depth_direction, or give the view another depth"));
        }
        let float = matches!(
            self.depth_format,
            wgpu::TextureFormat::Depth32Float | wgpu::TextureFormat::Depth32FloatStencil8
        );
        // Without an end, and from so near on, fixed point has no bits left for the ground.
        let own_near = crate::clipmap::near_m(clipmap.grid()) as f32;
        if !float && view.near_m == own_near && view.depth[0] == 0.0 {
            let what = format!("depth without near and far is lost in {:?}", self.depth_format);
            return Err(Error::new(ErrorKind::Misuse, "view", what)
                .advice("give the view near and far distances, or use Depth32Float"));
        }
        Ok(())
    }
}
