//! What this machine has: the memory that a process may still use.
//!
//! Check: control groups and limits of the shell below the machine's memory win; text that is no number counts as no limit.

use crate::quantities;
use std::path::Path;

/// Memory that can be had without swapping, bytes: what the system says is available, or less where a control group or a limit
/// of the shell (`ulimit -v`) leaves less. `None` where the system does not say.
pub(crate) fn available_memory_bytes() -> Option<f64> {
    let limits = [
        memory_of_system(),
        memory_under_shell_limit(),
        memory_of_group("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.current"),
        memory_of_group(
            "/sys/fs/cgroup/memory/memory.limit_in_bytes",
            "/sys/fs/cgroup/memory/memory.usage_in_bytes",
        ),
    ];
    let known = limits.into_iter().flatten();
    known.map(|bytes| bytes.max(0.0)).reduce(f64::min)
}

/// Free bytes of the file system of a folder, which need not exist yet. `None` where the system does not say.
#[cfg(unix)]
pub(crate) fn free_bytes(folder: &Path) -> Option<f64> {
    let absolute = std::path::absolute(folder).ok()?;
    let there = absolute.ancestors().find(|ancestor| ancestor.exists())?;
    let about = rustix::fs::statvfs(there).ok()?;
    Some(about.f_bavail as f64 * about.f_frsize as f64)
}

/// Other systems are not asked.
#[cfg(not(unix))]
pub(crate) fn free_bytes(_: &Path) -> Option<f64> {
    None
}

fn read(path: &str) -> Option<String> {
    std::fs::read_to_string(path).ok()
}

/// Memory that the system says is available, bytes.
fn memory_of_system() -> Option<f64> {
    kilobytes(&read("/proc/meminfo")?, "MemAvailable:")
}

/// What a limit of the shell leaves of the addresses, bytes.
fn memory_under_shell_limit() -> Option<f64> {
    let limit = of_addresses(&read("/proc/self/limits")?)?;
    Some(limit - kilobytes(&read("/proc/self/status")?, "VmSize:").unwrap_or(0.0))
}

/// What the limit of a control group leaves, bytes, by the files of its limit and its usage.
fn memory_of_group(limit: &str, usage: &str) -> Option<f64> {
    Some(number(read(limit)?)? - number(read(usage)?)?)
}

/// Holds what a file asks for against the memory, before any of it is allocated.
///
/// # Errors
/// How much `what` would take, and how much can be had.
pub(crate) fn holds(what: &str, bytes: f64) -> Result<(), String> {
    // So little is not worth the question.
    const LITTLE_BYTES: f64 = 1e7;
    let too_much = (bytes > LITTLE_BYTES)
        .then(available_memory_bytes)
        .flatten()
        .filter(|available| bytes > *available);
    let needed = quantities::bytes(bytes);
    match too_much.map(quantities::bytes) {
        Some(available) => Err(format!(
            "{what} would take {needed} of memory, and {available} are available"
        )),
        None => Ok(()),
    }
}

/// An entry of the texts of /proc that are in kB, bytes.
fn kilobytes(text: &str, name: &str) -> Option<f64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    Some(1024.0 * number(line.trim().trim_end_matches("kB").to_owned())?)
}

/// The limit of the addresses of a process in the text of /proc/self/limits, bytes; none where there is no limit.
fn of_addresses(text: &str) -> Option<f64> {
    let line = text
        .lines()
        .find_map(|line| line.strip_prefix("Max address space"))?;
    number(line.split_whitespace().next()?.to_owned())
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
        assert_eq!(kilobytes(text, "MemAvailable:"), Some(2.048e10));
        assert_eq!(kilobytes("MemTotal: 1 kB\n", "MemAvailable:"), None);
        let limit = |soft: &str| {
            format!(
                "Max cpu time  1  2  seconds\nMax address space         {soft}   unlimited    bytes\n"
            )
        };
        assert_eq!(of_addresses(&limit("8192000")), Some(8_192_000.0));
        assert_eq!(of_addresses(&limit("unlimited")), None);
        assert!(
            holds("a list", 1e18).is_err_and(|e| e.contains("a list would take"))
                || !cfg!(target_os = "linux")
        );
        assert_eq!(
            (number("max\n".into()), number("1024\n".into())),
            (None, Some(1024.0))
        );
        if cfg!(target_os = "linux") {
            assert!(available_memory_bytes().is_some_and(|bytes| bytes > 1e6));
        }
    }
}
