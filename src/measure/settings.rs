//! The settings to compare: a grid of clip sizes and promised errors, and one at a time transition, levels and filter.

use crate::clipmap::ClipmapOptions;
use crate::error::Result;
use crate::pyramid::FilterKind;

/// What a setting varies against the base setting.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Family {
    /// Clip size and promised error, each with each.
    Grid,
    /// Width of the morph band.
    Transition,
    /// Number of levels.
    Levels,
    /// How coarser levels were made.
    Filter,
}

impl Family {
    /// Its name in the files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Grid => "grid",
            Self::Transition => "transition",
            Self::Levels => "levels",
            Self::Filter => "filter",
        }
    }
}

/// One way to draw the terrain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    /// What it is compared for.
    pub family: Family,
    /// The filter of the coarser levels, rebuilt from level 0; none leaves them as the input has them.
    pub filter: Option<FilterKind>,
    /// Samples along a window's side.
    pub clip_size: i64,
    /// Only this many levels, the finest; none stands for all.
    pub levels: Option<u32>,
    /// Width of the morph band in steps; none stands for a tenth of the clip size.
    pub transition: Option<i64>,
    /// The promised error in pixels; none promises nothing.
    pub max_error_px: Option<f64>,
}

impl Setting {
    /// How its clipmap is laid out; all else as in `options`.
    pub fn clipmap(&self, options: &ClipmapOptions) -> ClipmapOptions {
        ClipmapOptions {
            clip_size: self.clip_size,
            levels: self.levels,
            transition: self.transition,
            max_error_px: self.max_error_px,
            ..*options
        }
    }

    /// What tells it from others of its family, short, as a picture's label.
    pub fn label(&self) -> String {
        match self.family {
            Family::Grid => match self.max_error_px {
                Some(error_px) => format!("{}, promised {error_px} px", self.clip_size),
                None => format!("{}", self.clip_size),
            },
            Family::Transition => format!("T = {}", self.transition.unwrap_or_default()),
            Family::Levels => match self.levels {
                Some(levels) => format!("{levels} levels"),
                None => "all levels".into(),
            },
            Family::Filter => self.filter.map_or("as it is", FilterKind::name).into(),
        }
    }

    /// The options by which `render` draws the same.
    pub fn arguments(&self) -> String {
        let mut text = format!("--clip-size {}", self.clip_size);
        if let Some(error_px) = self.max_error_px {
            text += &format!(" --max-error-px {error_px}");
        }
        if let Some(transition) = self.transition {
            text += &format!(" --transition {transition}");
        }
        if let Some(levels) = self.levels {
            text += &format!(" --levels {levels}");
        }
        if let Some(filter) = self.filter {
            text += &format!(" (preprocess --filter {filter})");
        }
        text
    }
}

/// The lists from which settings are made.
#[derive(Clone, Debug, PartialEq)]
pub struct SettingLists {
    /// Clip sizes; the base is 256 where it is among them, else the last.
    pub clip_sizes: Vec<i64>,
    /// Promised errors in pixels, none for no promise.
    pub max_errors_px: Vec<Option<f64>>,
    /// Widths of the morph band in steps, beside the default.
    pub transitions: Vec<i64>,
    /// Numbers of levels, beside all.
    pub levels: Vec<u32>,
    /// Filters, beside the input's own levels.
    pub filters: Vec<FilterKind>,
}

impl SettingLists {
    /// Enough for a look: two minutes on a software driver.
    pub fn quick() -> Self {
        Self {
            clip_sizes: vec![128, 256, 512, 1024],
            max_errors_px: vec![None, Some(1.0), Some(4.0), Some(16.0)],
            transitions: vec![1],
            levels: vec![3],
            filters: vec![FilterKind::Point, FilterKind::Bilinear, FilterKind::Lanczos3],
        }
    }

    /// All that the report speaks of.
    pub fn full() -> Self {
        Self {
            clip_sizes: vec![64, 128, 256, 512, 1024],
            max_errors_px: vec![
                None,
                Some(0.5),
                Some(1.0),
                Some(2.0),
                Some(4.0),
                Some(8.0),
                Some(16.0),
            ],
            transitions: vec![0, 1, 2, 8],
            levels: vec![2, 3, 4],
            filters: FilterKind::ALL.into(),
        }
    }

    /// The settings, those of one family together: the grid first, its base setting first of all.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Misuse`] where one is out of range.
    pub fn settings(&self) -> Result<Vec<Setting>> {
        let clip_size = match self.clip_sizes.contains(&256) {
            true => 256,
            false => self.clip_sizes.last().copied().unwrap_or(256),
        };
        let base = Setting {
            family: Family::Grid,
            filter: None,
            clip_size,
            levels: None,
            transition: None,
            max_error_px: None,
        };
        let mut all = vec![base];
        let mut add = |setting: Setting| {
            if !all.contains(&setting) {
                all.push(setting);
            }
        };
        for &clip_size in &self.clip_sizes {
            for &max_error_px in &self.max_errors_px {
                add(Setting {
                    clip_size,
                    max_error_px,
                    ..base
                });
            }
        }
        for &transition in &self.transitions {
            add(Setting {
                family: Family::Transition,
                transition: Some(transition),
                ..base
            });
        }
        for &levels in &self.levels {
            add(Setting {
                family: Family::Levels,
                levels: Some(levels),
                ..base
            });
        }
        for &filter in &self.filters {
            add(Setting {
                family: Family::Filter,
                filter: Some(filter),
                ..base
            });
        }
        for setting in &all {
            setting.clipmap(&ClipmapOptions::default()).check()?;
        }
        Ok(all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_base_comes_first_and_nothing_twice() {
        for lists in [SettingLists::quick(), SettingLists::full()] {
            let settings = lists.settings().unwrap();
            assert_eq!((settings[0].clip_size, settings[0].max_error_px), (256, None));
            for (k, setting) in settings.iter().enumerate() {
                assert!(!settings[..k].contains(setting), "{setting:?}");
            }
            let grid = settings.iter().filter(|s| s.family == Family::Grid).count();
            assert_eq!(grid, lists.clip_sizes.len() * lists.max_errors_px.len());
            let others = lists.transitions.len() + lists.levels.len() + lists.filters.len();
            assert_eq!(settings.len(), grid + others);
        }
    }

    #[test]
    fn what_no_clipmap_can_do_is_refused() {
        let refused = |change: fn(&mut SettingLists)| {
            let mut lists = SettingLists::quick();
            change(&mut lists);
            lists.settings().unwrap_err().to_string()
        };
        assert!(refused(|l| l.clip_sizes = vec![100]).contains("100"));
        assert!(refused(|l| l.transitions = vec![500]).contains("500"));
        assert!(refused(|l| l.levels = vec![0]).contains("level"));
        assert!(refused(|l| l.max_errors_px = vec![Some(-1.0)]).contains("-1"));
    }
}
