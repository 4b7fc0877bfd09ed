//! The drawn surface, as queries see it.

use super::{Reader, Surface};
use crate::clipmap::{Corners, Drawn, Place};
use crate::error::{Error, ErrorKind, Result};
use crate::grid::{Grid, Patch, Rect};

impl Surface for Drawn<'_> {
    fn grid(&self) -> &Grid {
        Drawn::grid(self)
    }

    fn vertical_scale(&self) -> f64 {
        self.clipmap().vertical_scale()
    }

    fn roots(&self) -> (u32, Rect) {
        (self.coarsest(), Drawn::roots(self))
    }

    fn reader(&self) -> Box<dyn Reader + '_> {
        Box::new(self)
    }
}

impl Reader for &Drawn<'_> {
    fn place(&self, patch: Patch) -> Place {
        Drawn::place(self, patch)
    }

    fn heights(&mut self, patch: Patch) -> Result<[f32; 2]> {
        Ok(Drawn::heights(self, patch))
    }

    fn corners(&mut self, patch: Patch) -> Result<&Corners> {
        Drawn::corners(self, patch).ok_or_else(|| {
            Error::new(ErrorKind::Misuse, "query", format!("{patch:?} is not drawn"))
                .advice("ask for its place first")
        })
    }
}
