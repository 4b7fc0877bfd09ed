//! Toroidal slots: sample `i` of a level lives in slot `i mod n`, so a window that moves keeps what it has.

use super::Rect;

/// The slot of sample `i` among `n` (n above 0), also for negative `i`.
pub fn slot(i: i64, n: i64) -> i64 {
    i.rem_euclid(n)
}

/// Splits `rect` (at most `n` cells a side) at the seam of an `n` x `n` torus: each piece is contiguous in
/// slots. `shift` is added to an index before its slot is taken.
pub fn seam_pieces(rect: Rect, n: i64, shift: [i64; 2]) -> impl Iterator<Item = Rect> {
    debug_assert!(
        rect.width() <= n && rect.height() <= n,
        "{rect:?} does not fit a torus of {n}"
    );
    let seam = |first: i64, end: i64, shift: i64| (first + (n - slot(first + shift, n))).clamp(first, end);
    let x = seam(rect.x0, rect.x1, shift[0]);
    let z = seam(rect.z0, rect.z1, shift[1]);
    [
        Rect::new(rect.x0, rect.z0, x, z),
        Rect::new(x, rect.z0, rect.x1, z),
        Rect::new(rect.x0, z, x, rect.z1),
        Rect::new(x, z, rect.x1, rect.z1),
    ]
    .into_iter()
    .filter(|r| !r.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_cover_the_rectangle_and_are_contiguous_in_slots() {
        let n = 8;
        for x0 in -20..20 {
            for width in 0..=n {
                for shift in [0, 3, -5, 1 << 40] {
                    let rect = Rect::new(x0, -3, x0 + width, 4);
                    let pieces: Vec<_> = seam_pieces(rect, n, [shift, 0]).collect();
                    assert_eq!(pieces.iter().map(|p| p.area()).sum::<i64>(), rect.area());
                    for p in pieces {
                        assert!(rect.contains_rect(p));
                        for x in p.x0..p.x1 {
                            assert_eq!(slot(x + shift, n), slot(p.x0 + shift, n) + (x - p.x0), "{p:?}");
                        }
                    }
                }
            }
        }
    }
}
