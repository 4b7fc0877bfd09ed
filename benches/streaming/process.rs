//! What the system says of this process: CPU time of a thread, memory; and its cache of a file, emptied.

use std::path::Path;

/// CPU time of this thread so far, where the system has such a clock.
#[cfg(target_os = "linux")]
pub(crate) fn cpu_ms() -> Option<f64> {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    Some(now.tv_sec as f64 * 1e3 + now.tv_nsec as f64 / 1e6)
}

/// Asks the system to forget what it holds of a file (`posix_fadvise`); whether it was asked.
#[cfg(target_os = "linux")]
pub(crate) fn forget(path: &Path) -> bool {
    use rustix::fs::{Advice, fadvise};
    let forget = |file: std::fs::File| {
        // What has not been written yet cannot be forgotten.
        let _ = file.sync_data();
        fadvise(&file, 0, None, Advice::DontNeed).is_ok()
    };
    std::fs::File::open(path).is_ok_and(forget)
}

#[cfg(not(target_os = "linux"))]
pub(crate) fn cpu_ms() -> Option<f64> {
    None
}

#[cfg(not(target_os = "linux"))]
pub(crate) fn forget(_: &Path) -> bool {
    false
}

/// Memory that this process holds, files that it maps left out, in bytes; none where the system does not tell.
pub(crate) fn held_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("RssAnon:"))?;
    let kib: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(1024 * kib)
}
