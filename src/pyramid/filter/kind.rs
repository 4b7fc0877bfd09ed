//! The filters that a pyramid may be made with, by name: the default, and what other programs use, to compare.

use std::f64::consts::PI;
use std::str::FromStr;

use crate::error::{Error, ErrorKind};

/// A filter's name.
///
/// With `t` the distance from the centre in fine samples, the taps of each:
///
/// | name | t = 0 | 1 | 3 | 5 | what it is |
/// |---|---|---|---|---|---|
/// | `point` | 1 | | | | every second sample, as it is |
/// | `box` | 1/3 | 1/3 | | | 1 up to t = 1, itself included: the mean of 3 x 3 |
/// | `bilinear` | 1/2 | 1/4 | | | the tent `1 - t / 2` |
/// | `cubic` | 1/2 | 9/32 | -1/32 | | cubic convolution with a = -1/2, stretched to the coarse step |
/// | `lanczos3` | 1/2 | 0.3057 | -0.0679 | 0.0122 | `sinc(t / 2) sinc(t / 6)` |
/// | `sinc-blackman` | 1/2 | ... | | | the sinc windowed by Blackman, see [`Filter::sinc_blackman`] |
/// | `sinc-blackman-clamped` | | | | | the same, kept within the range of the samples that it weighs |
///
/// with `sinc(x) = sin(pi x) / (pi x)`. Sources: R. Keys, *Cubic Convolution Interpolation for Digital Image
/// Processing*, 1981, for `cubic`; C. Duchon, *Lanczos Filtering in One and Two Dimensions*, 1979, for the window of
/// `lanczos3`. All but `point` and `box` are half-band filters: no tap at an even distance but the centre, which is
/// 1/2. The odd taps of `lanczos3` are normalised to sum 1/2, as the default's are; dividing all taps by their sum, as
/// image programs do, would make the centre 0.5014 instead.
///
/// An area-weighted mean over a coarse step, each sample counted as wide as a step, has the taps of `bilinear`.
///
/// [`Filter::sinc_blackman`]: super::Filter::sinc_blackman
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum FilterKind {
    /// Every second sample.
    Point,
    /// The mean of 3 x 3 samples.
    Box,
    /// The tent over a coarse step a side.
    Bilinear,
    /// Keys' cubic convolution.
    Cubic,
    /// The sinc windowed by the main lobe of a sinc three times as wide.
    Lanczos3,
    /// The sinc windowed by Blackman: the default.
    #[default]
    SincBlackman,
    /// The same, kept within the range of the samples that it weighs.
    SincBlackmanClamped,
}

impl FilterKind {
    /// All of them, from the plainest.
    pub const ALL: [Self; 7] = [
        Self::Point,
        Self::Box,
        Self::Bilinear,
        Self::Cubic,
        Self::Lanczos3,
        Self::SincBlackman,
        Self::SincBlackmanClamped,
    ];

    /// The name, as `--filter` and the terrain file's `clipscape.filter` give it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Point => "point",
            Self::Box => "box",
            Self::Bilinear => "bilinear",
            Self::Cubic => "cubic",
            Self::Lanczos3 => "lanczos3",
            Self::SincBlackman => "sinc-blackman",
            Self::SincBlackmanClamped => "sinc-blackman-clamped",
        }
    }

    /// The weights at `t` = 1, 3, 5, ... on one side, up to a common factor, and what they are to sum to.
    pub(super) fn side(self, lobes: u32) -> (Vec<f64>, f64) {
        match self {
            Self::Point => (vec![], 0.0),
            Self::Box => (vec![1.0], 1.0 / 3.0),
            Self::Bilinear => (vec![1.0], 0.25),
            Self::Cubic => (vec![9.0, -1.0], 0.25),
            Self::Lanczos3 => {
                let tap = |t: f64| sinc(t / 2.0) * sinc(t / 6.0);
                ([1.0, 3.0, 5.0].map(tap).to_vec(), 0.25)
            }
            Self::SincBlackman | Self::SincBlackmanClamped => {
                let reach = f64::from(2 * lobes);
                let tap = |t: f64| {
                    let window = 0.42 + 0.5 * (PI * t / reach).cos() + 0.08 * (2.0 * PI * t / reach).cos();
                    sinc(t / 2.0) / 2.0 * window
                };
                ((0..lobes).map(|k| tap(f64::from(2 * k + 1))).collect(), 0.25)
            }
        }
    }
}

/// `sin(pi x) / (pi x)` for x above 0.
fn sinc(x: f64) -> f64 {
    (PI * x).sin() / (PI * x)
}

impl FromStr for FilterKind {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self, Error> {
        let found = Self::ALL.into_iter().find(|kind| kind.name() == name);
        found.ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            Error::new(ErrorKind::Misuse, "filter", format!("{name:?} is none"))
                .advice(format!("choose one of {names}"))
        })
    }
}

impl std::fmt::Display for FilterKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}
