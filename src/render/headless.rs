//! Frames without a window, through the same face that an embedding program uses.

use std::sync::Arc;
use std::time::Instant;

use super::error_view::colour_errors;
use super::measuring::{Measured, MeasuringPass};
use crate::accuracy::ErrorPool;
use crate::camera::{View, check_picture};
use crate::clipmap::{Certificate, Clipmap, ClipmapOptions, UpdateReport, certify};
use crate::error::{Error, ErrorKind, Result};
use crate::gpu::{
    ClipmapRenderer, DrawReport, Gpu, RendererOptions, SkyRenderer, Targets, UploadReport, ViewTextures, read,
};
use crate::levels::Levels;
use crate::light::{Day, Sun};
use crate::shade::ViewMode;

/// The colour format drawn into: 8 bits a channel, sRGB.
pub const COLOUR_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;

/// How frames are drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeadlessOptions {
    /// Width and height in pixels.
    pub size_px: [u32; 2],
    /// Samples a pixel: 1 or 4.
    pub sample_count: u32,
    /// What is shown.
    pub view_mode: ViewMode,
    /// Whether the ground is tinted by height and slope.
    pub tint: bool,
    /// Whether air lies between ground and eye.
    pub haze: bool,
    /// Whether the light that came with the terrain is used; else light follows from slopes and sun.
    pub traced_light: bool,
    /// The sun: by it slopes are lit where no traced light is used, and around it the sky glows.
    pub sun: Sun,
    /// Clip size, levels, transition, vertical scale, culling.
    pub clipmap: ClipmapOptions,
}

impl Default for HeadlessOptions {
    fn default() -> Self {
        Self {
            size_px: [1280, 720],
            sample_count: 1,
            view_mode: ViewMode::Shaded,
            tint: true,
            haze: true,
            traced_light: true,
            sun: Sun::default(),
            clipmap: ClipmapOptions::default(),
        }
    }
}

/// A frame, and what making it took.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Pixels, row by row from the top left: red, green, blue, alpha, sRGB.
    pub rgba8: Vec<u8>,
    /// What the update did.
    pub update: UpdateReport,
    /// What is certified of its error, where that is asked for, see [`Headless::certify`].
    pub certificate: Option<Certificate>,
    /// What was uploaded.
    pub upload: UploadReport,
    /// What was drawn.
    pub draw: DrawReport,
    /// Moving the windows (what is newly exposed is read) and selecting patches, in wall milliseconds.
    pub plan_ms: f64,
    /// Finding the certificate; 0 without one.
    pub certify_ms: f64,
    /// Writing the uploads into mapped memory and recording their copies, which are part of the draw.
    pub upload_ms: f64,
    /// Recording, submitting and waiting for the draw, without reading back.
    pub draw_ms: f64,
    /// The draw by the device's own clock, where it has one.
    pub gpu_ms: Option<f64>,
    /// All of it, reading back included, measuring not.
    pub frame_ms: f64,
    /// Its errors and cracks, where they are measured, see [`Headless::measure`].
    pub measured: Option<Measured>,
}

/// Draws frames of one terrain into memory.
pub struct Headless {
    gpu: Gpu,
    options: HeadlessOptions,
    clipmap: Clipmap,
    renderer: ClipmapRenderer,
    sky: SkyRenderer,
    textures: ViewTextures,
    targets: Targets,
    timer: Option<Timer>,
    certifies: bool,
    measuring: Option<MeasuringPass>,
    pool: Option<ErrorPool>,
    truth: Option<Arc<dyn Levels>>,
    day: Option<Day>,
    frames: u64,
}

impl std::fmt::Debug for Headless {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Headless")
            .field("options", &self.options)
            .field("clipmap", &self.clipmap.identity())
            .finish_non_exhaustive()
    }
}

#[derive(Debug)]
struct Timer {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    mappable: wgpu::Buffer,
    period_ns: f64,
}

impl Headless {
    /// Prepares to draw `levels` on `gpu`.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] for options out of range; those of `levels`.
    pub fn new(gpu: Gpu, levels: &dyn Levels, options: &HeadlessOptions) -> Result<Self> {
        check_picture(options.size_px)?;
        let clipmap = Clipmap::new(levels, &options.clipmap)?;
        let renderer_options = renderer_options(options, &clipmap);
        let renderer = ClipmapRenderer::new(&gpu.device, &renderer_options)?;
        let textures = renderer.textures(&gpu.device, &clipmap, options.sun)?;
        Ok(Self {
            sky: SkyRenderer::new(&gpu.device, &renderer_options)?,
            targets: Targets::new(&gpu, options.size_px, &renderer_options),
            timer: gpu.has_timestamps().then(|| Timer::new(&gpu)),
            certifies: false,
            // The errors that this view shows are measured.
            measuring: (options.view_mode == ViewMode::Error)
                .then(|| MeasuringPass::new(&gpu, options))
                .transpose()?,
            pool: None,
            truth: None,
            day: None,
            frames: 0,
            gpu,
            options: *options,
            clipmap,
            renderer,
            textures,
        })
    }

    /// Draws the frame that `camera` sees at `time_s` seconds of its flight.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] for a camera of other than finite numbers, [`ErrorKind::Device`] where the device fails;
    /// those of `levels`.
    pub fn frame(&mut self, levels: &dyn Levels, camera: &crate::Camera, time_s: f64) -> Result<Frame> {
        self.frame_of(levels, &View::new(*camera, self.options.size_px)?, time_s)
    }

    /// Draws the frame of a view at `time_s` seconds, which must be of these frames' size and of reversed depth.
    ///
    /// # Errors
    /// As [`Headless::frame`], and [`ErrorKind::Misuse`] for a view of another size or of forward depth.
    pub fn frame_of(&mut self, levels: &dyn Levels, view: &View, time_s: f64) -> Result<Frame> {
        let start = Instant::now();
        if view.size_px != self.options.size_px {
            let [w, h] = view.size_px;
            let what = format!("is of {w}x{h} pixels");
            let [w, h] = self.options.size_px;
            return Err(Error::new(ErrorKind::Misuse, "view", what).advice(format!("frames are of {w}x{h}")));
        }
        let update = *self.clipmap.update(levels, view, time_s)?;
        self.follow_light()?;
        let planned = Instant::now();
        let certificate = self.certifies.then(|| certify(&self.clipmap)).transpose()?;
        let certified = Instant::now();
        let mut encoder = self
            .gpu
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor {
                label: Some("clipscape frame"),
            });
        let upload = self
            .renderer
            .upload(&mut encoder, &self.clipmap, &mut self.textures)?;
        let uploaded = Instant::now();
        let draw = self.record(&mut encoder)?;
        self.gpu.queue.submit([encoder.finish()]);
        self.wait()?;
        let drawn = Instant::now();
        let mut rgba8 = self.gpu.read_texture(self.targets.colour(), 0)?;
        let gpu_ms = self.timer.as_ref().map(|t| t.read_ms(&self.gpu)).transpose()?;
        let ms = |from: Instant, to: Instant| (to - from).as_secs_f64() * 1e3;
        let frame_ms = ms(start, Instant::now());
        let measured = self.measured(levels, view, &mut rgba8)?;
        Ok(Frame {
            rgba8,
            update,
            certificate,
            upload,
            draw,
            plan_ms: ms(start, planned),
            certify_ms: ms(planned, certified),
            upload_ms: ms(certified, uploaded),
            draw_ms: ms(uploaded, drawn),
            gpu_ms,
            frame_ms,
            measured,
        })
    }

    /// Where light has come that was traced meanwhile, or gone, other pipelines draw it.
    fn follow_light(&mut self) -> Result<()> {
        let wanted = renderer_options(&self.options, &self.clipmap);
        if wanted.traced_light != self.renderer.options().traced_light {
            self.renderer = ClipmapRenderer::new(&self.gpu.device, &wanted)?;
            self.sky = SkyRenderer::new(&self.gpu.device, &wanted)?;
            self.textures = self
                .renderer
                .textures(&self.gpu.device, &self.clipmap, self.options.sun)?;
        }
        Ok(())
    }

    /// Shows the light of `day`, the terrain's, from now on: at noon, until [`Headless::set_time_of_day`].
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] where the clipmap holds no light over a day.
    pub fn set_day(&mut self, day: Day) -> Result<()> {
        if !self.clipmap.has_day() {
            let what = "the frames' clipmap holds no light over a day";
            return Err(Error::new(ErrorKind::Misuse, "day", what)
                .advice("preprocess the terrain with --day N, and set ClipmapOptions::day"));
        }
        self.day = Some(day);
        self.set_time_of_day(0.0)
    }

    /// Sets the time of the day whose light is shown, -1 to 1, see [`Day::time_of_hour`].
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] where no day is shown, and for a time of other than finite numbers.
    pub fn set_time_of_day(&mut self, time: f64) -> Result<()> {
        let day = self.day.ok_or_else(|| {
            Error::new(ErrorKind::Misuse, "time of day", "no light over a day is shown")
                .advice("render terrain that was preprocessed with --day N")
        })?;
        self.textures.set_time_of_day(&day, time)
    }

    /// The day whose light is shown.
    pub fn day(&self) -> Option<&Day> {
        self.day.as_ref()
    }

    /// What frames are measured against, where that is not the levels that they are drawn from: those do not wait.
    pub fn set_truth(&mut self, truth: Arc<dyn Levels>) {
        self.truth = Some(truth);
    }

    /// Certifies every frame from now on: [`Frame::certificate`].
    pub fn certify(&mut self) {
        self.certifies = true;
    }

    /// Measures every frame from now on: [`Frame::measured`], from a second pass where there are several samples a pixel.
    /// Levels must wait for their data, or there must be a truth that does: [`Headless::set_truth`].
    ///
    /// # Errors
    /// [`ErrorKind::Limit`] where the system starts no threads.
    pub fn measure(&mut self) -> Result<()> {
        if self.measuring.is_none() {
            self.measuring = Some(MeasuringPass::new(&self.gpu, &self.options)?);
        }
        self.pool = Some(ErrorPool::default());
        self.frames = 0;
        Ok(())
    }

    /// The errors of all frames since [`Headless::measure`], numbered from 0; none without it.
    pub fn pooled_errors(&self) -> Option<&ErrorPool> {
        self.pool.as_ref()
    }

    /// Measures the frame just drawn, as far as that was asked for, and lays its errors over its picture where those
    /// are what is shown.
    fn measured(&mut self, levels: &dyn Levels, view: &View, rgba8: &mut [u8]) -> Result<Option<Measured>> {
        let Some(pass) = &self.measuring else {
            return Ok(None);
        };
        let depths = pass.depths(&self.gpu, &self.clipmap, &self.textures, self.targets.depth())?;
        let truth = self.truth.as_deref().unwrap_or(levels);
        let errors = pass.errors(truth, &self.clipmap, view, &depths)?;
        if self.options.view_mode == ViewMode::Error {
            colour_errors(&errors, rgba8);
        }
        let Some(pool) = &mut self.pool else {
            return Ok(None);
        };
        pool.add(self.frames, &errors);
        self.frames += 1;
        let cracks = pass.cracks(&self.clipmap, view, &depths)?;
        Ok(Some(Measured { errors, cracks }))
    }

    fn record(&self, encoder: &mut wgpu::CommandEncoder) -> Result<DrawReport> {
        let timestamp_writes = self.timer.as_ref().map(|timer| wgpu::RenderPassTimestampWrites {
            query_set: &timer.queries,
            beginning_of_pass_write_index: Some(0),
            end_of_pass_write_index: Some(1),
        });
        let mut pass = self.targets.pass(encoder, timestamp_writes);
        let report = self.renderer.draw(&mut pass, &self.clipmap, &self.textures)?;
        if matches!(self.options.view_mode, ViewMode::Shaded | ViewMode::Wire) {
            self.sky.draw(&mut pass, &self.textures)?;
        }
        drop(pass);
        if let Some(timer) = &self.timer {
            encoder.resolve_query_set(&timer.queries, 0..2, &timer.resolved, 0);
            encoder.copy_buffer_to_buffer(&timer.resolved, 0, &timer.mappable, 0, 16);
        }
        Ok(report)
    }

    fn wait(&self) -> Result<()> {
        self.gpu
            .device
            .poll(wgpu::PollType::wait_indefinitely())
            .map(drop)
            .map_err(|e| {
                Error::new(
                    ErrorKind::Device,
                    "graphics",
                    format!("the device does not answer ({e})"),
                )
            })
    }

    /// The depth of the last frame, row by row from the top left: near distance over distance along the view axis, 0
    /// where no terrain is.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] with several samples a pixel, [`ErrorKind::Device`] where the device fails.
    pub fn read_depth(&self) -> Result<Vec<f32>> {
        if self.options.sample_count != 1 {
            let what = format!("depth has {} samples a pixel", self.options.sample_count);
            return Err(Error::new(ErrorKind::Misuse, "multisampling", what)
                .advice("draw with 1 sample to read depth"));
        }
        let bytes = self.gpu.read_texture(self.targets.depth(), 0)?;
        Ok(bytemuck::pod_collect_to_vec(&bytes))
    }

    /// Width and height of the frames in pixels.
    pub fn size_px(&self) -> [u32; 2] {
        self.options.size_px
    }

    /// Takes the faults that frames have met since the last call without ending, see [`Clipmap::take_faults`].
    pub fn take_faults(&mut self) -> Vec<Error> {
        self.clipmap.take_faults()
    }

    /// The clipmap as of the last frame.
    pub fn clipmap(&self) -> &Clipmap {
        &self.clipmap
    }

    /// The textures as of the last frame.
    pub fn textures(&self) -> &ViewTextures {
        &self.textures
    }

    /// The pipelines.
    pub fn renderer(&self) -> &ClipmapRenderer {
        &self.renderer
    }

    /// The device.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }
}

/// How the pipelines of frames are made, with traced light or without.
fn renderer_options(options: &HeadlessOptions, clipmap: &Clipmap) -> RendererOptions {
    RendererOptions {
        colour_format: COLOUR_FORMAT,
        sample_count: options.sample_count,
        view_mode: options.view_mode,
        traced_light: options.traced_light && clipmap.has_light(),
        day: clipmap.has_day(),
        tint: options.tint,
        haze: options.haze,
        ..Default::default()
    }
}

impl Timer {
    fn new(gpu: &Gpu) -> Self {
        let buffer = |label, usage| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: 16,
                usage,
                mapped_at_creation: false,
            })
        };
        use wgpu::BufferUsages as Usage;
        Self {
            queries: gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("clipscape frame timestamps"),
                ty: wgpu::QueryType::Timestamp,
                count: 2,
            }),
            resolved: buffer(
                "clipscape resolved timestamps",
                Usage::QUERY_RESOLVE | Usage::COPY_SRC,
            ),
            mappable: buffer("clipscape mappable timestamps", Usage::COPY_DST | Usage::MAP_READ),
            period_ns: f64::from(gpu.queue.get_timestamp_period()),
        }
    }

    fn read_ms(&self, gpu: &Gpu) -> Result<f64> {
        let ticks: Vec<u64> = bytemuck::pod_collect_to_vec(&read(&gpu.device, &self.mappable)?);
        Ok(ticks[1].saturating_sub(ticks[0]) as f64 * self.period_ns / 1e6)
    }
}
