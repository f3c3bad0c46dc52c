//! What this machine has: the memory that a process may still use.
//!
//! Check: control groups below the machine's memory win; text that is no number counts as no limit.

use std::path::Path;

/// Memory that can be had without swapping, bytes: what the system says is available, or less where a control group sets a
/// lower limit. `None` where the system does not say.
pub(crate) fn available_memory_bytes() -> Option<f64> {
    let read = |path: &str| std::fs::read_to_string(path).ok();
    let mut found = read("/proc/meminfo").and_then(|text| of_meminfo(&text));
    for (limit, usage) in [
        ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.current"),
        ("/sys/fs/cgroup/memory/memory.limit_in_bytes", "/sys/fs/cgroup/memory/memory.usage_in_bytes"),
    ] {
        if Path::new(limit).exists()
            && let (Some(limit), Some(usage)) = (read(limit).and_then(number), read(usage).and_then(number))
        {
            let left = (limit - usage).max(0.0);
            found = Some(found.map_or(left, |found: f64| found.min(left)));
        }
    }
    found
}

/// `MemAvailable` of the text of /proc/meminfo, bytes.
fn of_meminfo(text: &str) -> Option<f64> {
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    Some(1024.0 * number(line.trim().trim_end_matches("kB").to_owned())?)
}

/// A number of bytes; `max` is no limit.
fn number(text: String) -> Option<f64> {
    text.trim().parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_systems_words_are_understood() {
        let text = "MemTotal:       24000000 kB\nMemFree:  1 kB\nMemAvailable:   20000000 kB\n";
        assert_eq!(of_meminfo(text), Some(2.048e10));
        assert_eq!(of_meminfo("MemTotal: 1 kB\n"), None);
        assert_eq!((number("max\n".into()), number("1024\n".into())), (None, Some(1024.0)));
        if cfg!(target_os = "linux") {
            assert!(available_memory_bytes().is_some_and(|bytes| bytes > 1e6));
        }
    }
}
