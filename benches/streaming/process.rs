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

/// Resident memory of this process, now and at most since [`forget_peak`], in bytes; none where the system does not tell.
pub(crate) fn resident_bytes() -> Option<[u64; 2]> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let field = |name: &str| -> Option<u64> {
        let line = status.lines().find(|l| l.starts_with(name))?;
        Some(1024 * line.split_whitespace().nth(1)?.parse::<u64>().ok()?)
    };
    Some([field("VmRSS:")?, field("VmHWM:")?])
}

/// Begins to look for the most resident memory anew, where the system allows that.
pub(crate) fn forget_peak() {
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}
