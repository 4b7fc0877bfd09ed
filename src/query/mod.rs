//! Queries: heights, normals, rays and picks on the DEM's own surface and on the drawn one, by one code.
//!
//! A [`Surface`] is a tree of patches over the ground: [`S0`] is the truth (level 0 of any [`Levels`]), and
//! [`Drawn`](crate::clipmap::Drawn) what a frame draws. Both split each quad from its north-west to its south-east
//! corner. A surface exists where every corner that has weight is valid: in a triangle where all three are, on an edge
//! where both its ends are. Elsewhere, and off the DEM, is a hole.
//!
//! Points are world metres, x east, y up, z south, heights with the DEM's base and before vertical scale. All is f64;
//! positions are taken from a query's own place, so that large indices cost nothing. [`cast`](ray) says how a ray
//! meets the surface. [`lit_at`] asks how much of the sun a point sees. [`collider`] copies the heights of a rectangle for a physics engine.
//!
//! [`Levels`]: crate::levels::Levels

mod collider;
mod drawn;
mod ground;
mod line;
mod lit;
mod places;
mod quad;
pub mod ray;
mod s0;
mod shelf;
mod tile;
mod truth;
mod walk;

use glam::DVec3;

pub use collider::{Collider, MAX_COLLIDER_SAMPLES, collider};
pub use lit::lit_at;
pub use places::Places;
pub use quad::{Quad, Triangle};
pub use ray::Crossing;
pub use s0::S0;
pub use tile::Tiles;
pub use truth::{Probe, Truth, Under};

use crate::camera::View;
use crate::clipmap::{Corners, Eye, Place, near_of_m};
use crate::error::{Error, ErrorKind, Result};
use crate::grid::{Grid, Patch, Rect};
use line::Line;
pub(crate) use shelf::{Remembered, Shelf};

/// A surface made of patches, which can be asked for heights, normals and rays, by several threads at once.
pub trait Surface: Sync {
    /// Where the samples lie.
    fn grid(&self) -> &Grid;

    /// Factor on heights relative to the eye, as drawn; may be 0 or negative. Only picks heed it.
    fn vertical_scale(&self) -> f64;

    /// The coarsest level, and its patches under which the surface lies.
    fn roots(&self) -> (u32, Rect);

    /// What reads the surface for one query after another; it may remember what it read.
    fn reader(&self) -> Box<dyn Reader + '_>;

    /// The height over a place in the world; none in a hole and off the DEM.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] for a place of other than finite numbers; those of reading.
    fn height_at(&self, x_m: f64, z_m: f64) -> Result<Option<f64>> {
        let found = quad_at(self, x_m, z_m)?;
        Ok(found.and_then(|f| f.quad.height(f.at).map(|h| h + self.grid().base_m)))
    }

    /// The unit normal, upwards, of the triangle over a place in the world; none where that triangle is a hole, and off
    /// the DEM. On an edge it is that of one of the two triangles.
    ///
    /// # Errors
    /// As for [`Surface::height_at`].
    fn normal_at(&self, x_m: f64, z_m: f64) -> Result<Option<DVec3>> {
        let found = quad_at(self, x_m, z_m)?;
        let spacing_m = self.grid().spacing_m;
        Ok(found.and_then(|f| f.quad.normal(Triangle::holding(f.at), f.level, spacing_m)))
    }

    /// The first point of the surface, seen from above or from below, on the ray from `origin` along `direction`.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] for other than finite numbers and for no direction; those of reading.
    fn ray(&self, origin: DVec3, direction: DVec3) -> Result<Option<Hit>> {
        let eye = Eye::new(checked(origin)?, self.grid());
        let line = Line::new(self.grid(), &eye, direction, 1.0, 0.0)?;
        let crossing = ray::cast(self, self.reader().as_mut(), &line)?;
        Ok(crossing.map(|c| Hit::new(self.grid(), origin, direction, &c)))
    }

    /// The first point of the surface, as drawn, under a place of the picture of `view`: pixels east and south of its
    /// upper left corner, so that the centre of the first pixel is at 0.5, 0.5. What is nearer along the view axis than
    /// [`near_of_m`] is not drawn, and not found; a far end of the view's own is not heeded.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] for other than finite numbers; those of reading.
    fn pick(&self, view: &View, pixel: [f64; 2]) -> Result<Option<Hit>> {
        let direction = view.ray(pixel);
        let crossing = Picker::new(self, view)?.cast(pixel)?;
        Ok(crossing.map(|c| Hit::new(self.grid(), view.eye, direction, &c)))
    }
}

/// Reads a surface for one query after another.
pub trait Reader {
    /// What lies over a patch that is a root or whose parent is [`Place::Finer`].
    fn place(&self, patch: Patch) -> Place;

    /// Least and greatest height over a patch's ground and of all below it, in metres above the DEM's base; NaN or
    /// infinite where that is not known.
    ///
    /// # Errors
    /// Where they cannot be read.
    fn heights(&mut self, patch: Patch) -> Result<[f32; 2]>;

    /// The corners of a patch that is [`Place::Patch`].
    ///
    /// # Errors
    /// Where they cannot be read.
    fn corners(&mut self, patch: Patch) -> Result<&Corners>;
}

/// Where a ray first meets a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The point: world metres, before vertical scale.
    pub point: DVec3,
    /// Metres from the ray's origin, as drawn where it was a pick.
    pub distance_m: f64,
    /// The same as a multiple of the ray's direction; for a pick the metres along the view axis.
    pub along: f64,
    /// The level of the patch that it meets.
    pub level: u32,
    /// The unit normal, upwards, of the triangle that it meets, before vertical scale; none in the rare case that it
    /// meets but the edge of a hole.
    pub normal: Option<DVec3>,
}

impl Hit {
    fn new(grid: &Grid, origin: DVec3, direction: DVec3, crossing: &Crossing) -> Self {
        let along = crossing.along;
        let greatest = direction.abs().max_element(); // so that no square leaves f64's range
        Self {
            point: DVec3::new(
                origin.x + direction.x * along,
                crossing.height_m + grid.base_m,
                origin.z + direction.z * along,
            ),
            distance_m: (direction / greatest).length() * (greatest * along),
            along,
            level: crossing.level,
            normal: crossing
                .quad
                .normal(crossing.triangle, crossing.level, grid.spacing_m),
        }
    }
}

/// Casts rays through the pixels of one view, one after another.
pub struct Picker<'a, S: Surface + ?Sized> {
    surface: &'a S,
    reader: Box<dyn Reader + 'a>,
    view: View,
    eye: Eye,
    near_m: f64,
}

impl<'a, S: Surface + ?Sized> Picker<'a, S> {
    /// A picker for `view` over `surface`.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] for a view of other than finite numbers.
    pub fn new(surface: &'a S, view: &View) -> Result<Self> {
        view.check()?;
        Ok(Self {
            reader: surface.reader(),
            view: *view,
            eye: Eye::new(view.eye, surface.grid()),
            near_m: near_of_m(view, surface.grid()),
            surface,
        })
    }

    /// Where the ray through a place of the picture first meets the surface, from the near plane on.
    ///
    /// # Errors
    /// As for [`Surface::pick`].
    pub fn cast(&mut self, pixel: [f64; 2]) -> Result<Option<Crossing>> {
        self.cast_from(pixel, self.near_m)
    }

    /// The same from `start_m` metres along the view axis on: the surface may be met there a second time.
    ///
    /// # Errors
    /// As for [`Surface::pick`].
    pub fn cast_from(&mut self, pixel: [f64; 2], start_m: f64) -> Result<Option<Crossing>> {
        let line = self.line(pixel, start_m)?;
        ray::cast(self.surface, self.reader.as_mut(), &line)
    }

    /// Where the ray through a place of the picture is behind the surface, between the near plane and `end_m`: on the
    /// other side of it than before it first met it. Spans of metres along the view axis, one after another.
    ///
    /// # Errors
    /// As for [`Surface::pick`].
    pub fn behind(&mut self, pixel: [f64; 2], end_m: f64) -> Result<Vec<[f64; 2]>> {
        let line = self.line(pixel, self.near_m)?;
        ray::behind(self.surface, self.reader.as_mut(), &line, end_m)
    }

    fn line(&self, pixel: [f64; 2], start_m: f64) -> Result<Line> {
        let scale = self.surface.vertical_scale();
        Line::new(
            self.surface.grid(),
            &self.eye,
            self.view.ray(pixel),
            scale,
            start_m,
        )
    }
}

impl<S: Surface + ?Sized> std::fmt::Debug for Picker<'_, S> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Picker")
            .field("view", &self.view)
            .finish_non_exhaustive()
    }
}

fn checked(point: DVec3) -> Result<DVec3> {
    if point.is_finite() {
        return Ok(point);
    }
    let what = format!("the place {point} is not finite");
    Err(Error::new(ErrorKind::Misuse, "query", what))
}

/// The quad over a place in the world, and where in it the place is; none off the surface.
fn quad_at<S: Surface + ?Sized>(surface: &S, x_m: f64, z_m: f64) -> Result<Option<ground::Found>> {
    let eye = Eye::new(checked(DVec3::new(x_m, 0.0, z_m))?, surface.grid());
    ground::find(surface, surface.reader().as_mut(), &eye)
}
