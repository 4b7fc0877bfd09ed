//! Which settings are worth having: the Pareto front of frame time against error, and the quickest within an error.

use super::row::Row;

/// Whether a row competes: not where its picture is cut, since what it leaves out cannot be wrong, nor where its levels
/// were made anew, since that is another file and no way to draw this one.
fn competes(row: &Row) -> bool {
    !row.cut && row.setting.filter.is_none()
}

/// Marks the rows that compete and that no other beats: quicker and no more wrong, or less wrong and no slower. Of rows
/// that draw the same, which only chance tells apart, the first competes.
pub(super) fn mark_front(rows: &mut [Row]) {
    let drawn = |row: &Row| (row.triangles, row.errors, row.setting.clip_size);
    let points: Vec<Option<[f64; 2]>> = (0..rows.len())
        .map(|k| {
            let row = &rows[k];
            let seen = rows[..k].iter().any(|r| competes(r) && drawn(r) == drawn(row));
            (competes(row) && !seen).then_some([row.frame_ms_median, row.errors.error_px_max])
        })
        .collect();
    for (row, point) in rows.iter_mut().zip(&points) {
        row.pareto = point.is_some_and(|[ms, px]| {
            !points
                .iter()
                .flatten()
                .any(|[a, b]| *a <= ms && *b <= px && (*a < ms || *b < px))
        });
    }
}

/// By which of its errors a setting is held against a limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Criterion {
    /// The greatest error measured at any pixel.
    Greatest,
    /// The error that 99 of 100 pixels do not exceed.
    Most,
    /// The error certified before each frame was drawn.
    Certified,
}

impl Criterion {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Most, Self::Greatest, Self::Certified];

    /// What a setting must keep, as a phrase.
    pub fn phrase(self) -> &'static str {
        match self {
            Self::Most => "99 of 100 pixels",
            Self::Greatest => "every pixel, as measured",
            Self::Certified => "every pixel, certified before drawing",
        }
    }

    /// The row's error in pixels; none where there is none to speak of.
    pub fn error_px(self, row: &Row) -> Option<f64> {
        match self {
            Self::Most => Some(row.errors.error_px_p99),
            Self::Greatest => Some(row.errors.error_px_max),
            Self::Certified => row.certified_error_px,
        }
    }
}

/// The row to use where the error may be `limit_px` by `criterion`: of those that keep it the quickest; where others are as
/// quick as far as the rounds tell (their least median is not above its median), the one of fewest triangles.
pub fn quickest(rows: &[Row], criterion: Criterion, limit_px: f64) -> Option<&Row> {
    let keeps = |row: &&Row| competes(row) && criterion.error_px(row).is_some_and(|px| px <= limit_px);
    let quickest = rows
        .iter()
        .filter(keeps)
        .min_by(|a, b| a.frame_ms_median.total_cmp(&b.frame_ms_median))?;
    rows.iter()
        .filter(keeps)
        .filter(|row| row.frame_ms_spread[0] <= quickest.frame_ms_median)
        .min_by_key(|row| (row.triangles[0], row.number))
}

/// The row that comes nearest where none keeps a limit.
pub fn nearest(rows: &[Row], criterion: Criterion) -> Option<&Row> {
    rows.iter()
        .filter(|row| competes(row))
        .filter_map(|row| Some((criterion.error_px(row)?, row)))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, row)| row)
}

#[cfg(test)]
mod tests {
    use super::super::row::tests::row;
    use super::*;
    use crate::pyramid::FilterKind;

    #[test]
    fn the_front_is_what_nothing_beats() {
        let mut rows = vec![
            row(0, 5.0, 1.0),
            row(1, 3.0, 2.0),
            row(2, 6.0, 1.5), // slower and more wrong than 0
            row(3, 3.0, 2.5), // as quick as 1, more wrong
            row(4, 9.0, 0.1),
            row(5, 1.0, 0.0), // cut
            row(6, 2.0, 0.0), // another file
            row(1, 2.9, 2.0), // draws what 1 draws
        ];
        rows[5].cut = true;
        rows[6].setting.filter = Some(FilterKind::Point);
        mark_front(&mut rows);
        let front: Vec<usize> = rows.iter().filter(|r| r.pareto).map(|r| r.number).collect();
        assert_eq!(front, [0, 1, 4]);
    }

    #[test]
    fn the_quickest_that_keeps_a_limit_is_named() {
        let mut rows = vec![
            row(1, 9.0, 0.4),
            row(2, 5.0, 0.9),
            row(3, 5.2, 0.8),
            row(4, 2.0, 3.0),
        ];
        let number = |rows: &[Row], criterion, limit| quickest(rows, criterion, limit).map(|r| r.number);
        assert_eq!(number(&rows, Criterion::Greatest, 0.5), Some(1));
        // 3 is as quick as 2 within its spread, and has more triangles.
        assert_eq!(number(&rows, Criterion::Greatest, 1.0), Some(2));
        rows[2].triangles[0] = 10;
        assert_eq!(number(&rows, Criterion::Greatest, 1.0), Some(3));
        assert_eq!(number(&rows, Criterion::Most, 1.0), Some(4));
        assert_eq!(number(&rows, Criterion::Certified, 1.0), Some(1));
        assert_eq!(number(&rows, Criterion::Certified, 0.5), None);
        assert_eq!(nearest(&rows, Criterion::Certified).map(|r| r.number), Some(1));
        rows.iter_mut().for_each(|r| r.certified_error_px = None);
        assert_eq!(nearest(&rows, Criterion::Certified), None);
    }
}
