//! The one way in which rooms that may not start threads share work out.

/// Runs independent tasks, on one thread or on many. Results must not depend on which.
pub trait Work: Sync {
    /// Runs `task(0)` to `task(count - 1)`, in any order and possibly at the same time.
    fn each(&self, count: usize, task: &(dyn Fn(usize) + Sync));
}

/// Runs tasks one after another on the calling thread.
#[derive(Clone, Copy, Debug, Default)]
pub struct Serial;

impl Work for Serial {
    fn each(&self, count: usize, task: &(dyn Fn(usize) + Sync)) {
        (0..count).for_each(task);
    }
}

/// Splits `rows` into equal chunks of `chunk_len` elements and runs `task(index, chunk)` on each.
///
/// The chunks are disjoint, so a task may write its own without locking others out.
pub fn each_chunk<T: Send>(
    work: &dyn Work,
    data: &mut [T],
    chunk_len: usize,
    task: impl Fn(usize, &mut [T]) + Sync,
) {
    let chunks: Vec<std::sync::Mutex<&mut [T]>> = data
        .chunks_mut(chunk_len.max(1))
        .map(std::sync::Mutex::new)
        .collect();
    work.each(chunks.len(), &|index| {
        let mut chunk = chunks[index]
            .lock()
            .expect("each chunk is locked once, by its own task");
        task(index, &mut chunk);
    });
}

/// Splits `rows`, each `width` long, into stripes of `columns` columns: of each stripe its part of every row.
pub(crate) fn split_columns<T>(rows: &mut [T], width: usize, columns: usize) -> Vec<Vec<&mut [T]>> {
    let mut stripes: Vec<Vec<&mut [T]>> = (0..width.div_ceil(columns)).map(|_| Vec::new()).collect();
    for row in rows.chunks_mut(width) {
        for (stripe, part) in stripes.iter_mut().zip(row.chunks_mut(columns)) {
            stripe.push(part);
        }
    }
    stripes
}
