//! What this process has used so far, as Linux tells it; 0 elsewhere. For examples and tests that measure.
#![allow(dead_code, reason = "each of them uses a part")]

/// CPU seconds of all threads.
pub(crate) fn cpu_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let rest = stat.rsplit(')').next().unwrap_or("");
    let fields: Vec<&str> = rest.split_whitespace().collect();
    let ticks = |i: usize| fields.get(i).and_then(|f| f.parse::<f64>().ok());
    (ticks(11).unwrap_or(0.0) + ticks(12).unwrap_or(0.0)) / 100.0
}

/// The same from the scheduler's own account, to about a tick of its clock, without threads that have ended.
pub(crate) fn scheduled_seconds() -> f64 {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten();
    let ran = |task: std::fs::DirEntry| {
        let stat = std::fs::read_to_string(task.path().join("schedstat")).ok()?;
        stat.split_whitespace().next()?.parse::<f64>().ok()
    };
    tasks.flatten().filter_map(ran).sum::<f64>() * 1e-9
}

/// Lets [`peak_memory`] begin anew with what is held now.
pub(crate) fn forget_peak() {
    // Where this cannot be, the peak is that of all before.
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

/// Most resident memory that it has held [MiB].
pub(crate) fn peak_memory() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|l| l.starts_with("VmHWM"));
    let kib = line.and_then(|l| l.split_whitespace().nth(1)?.parse::<f64>().ok());
    kib.unwrap_or(0.0) / 1024.0
}
