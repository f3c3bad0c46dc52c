//! What a piece of work takes: processor time, time on the clock, memory; and on which machine. Linux only: memory and machine come
//! from /proc.

use crate::process::{output, resident_peak_bytes};
use fixtures::failure::Failure;
use rustix::time::{ClockId, clock_gettime};
use std::process::Command;
use std::time::Instant;

/// What a piece of work took.
#[derive(Clone, Copy)]
pub(crate) struct Cost {
    /// Processor time of all threads \[s\].
    pub(crate) cpu_s: f64,
    /// Wall-clock time \[s\].
    pub(crate) wall_s: f64,
    /// Largest resident memory of the process so far \[bytes\].
    pub(crate) peak_mem_bytes: f64,
}

impl Cost {
    /// The same for so much of the work, or for so many times as much.
    pub(crate) fn scaled(self, factor: f64) -> Self {
        Self {
            cpu_s: self.cpu_s * factor,
            wall_s: self.wall_s * factor,
            ..self
        }
    }

    /// What the rest of it took, beside a part.
    pub(crate) fn less(self, part: Self) -> Self {
        Self {
            cpu_s: self.cpu_s - part.cpu_s,
            wall_s: self.wall_s - part.wall_s,
            ..self
        }
    }
}

/// Runs a piece of work and measures it.
pub(crate) fn measured<T>(work: impl FnOnce() -> Result<T, Failure>) -> Result<(T, Cost), Failure> {
    let (before_s, start) = (clock_s(ClockId::ProcessCPUTime), Instant::now());
    let value = work()?;
    let cpu_s = clock_s(ClockId::ProcessCPUTime) - before_s;
    Ok((
        value,
        Cost {
            cpu_s,
            wall_s: start.elapsed().as_secs_f64(),
            peak_mem_bytes: resident_peak_bytes("self"),
        },
    ))
}

/// What a clock says, s: that of the process counts all its threads, those that have ended included.
pub(crate) fn clock_s(clock: ClockId) -> f64 {
    let time = clock_gettime(clock);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// Shortest piece of work whose time is told by one of three runs: a call into the system and a full cache count little beside it \[s\].
const TELLABLE_S: f64 = 0.01;

/// Work that takes longer \[s\] is timed once: what disturbs it now and then is a small part of it.
const LONG_S: f64 = 0.2;

/// The same three times: the first value, the smallest times; short work is repeated so that its time can be told, long work is not.
pub(crate) fn fastest<T>(
    mut work: impl FnMut() -> Result<T, Failure>,
) -> Result<(T, Cost), Failure> {
    let (value, first) = measured(&mut work)?;
    if first.wall_s > LONG_S {
        return Ok((value, first));
    }
    let times = (TELLABLE_S / first.wall_s.max(1e-6))
        .ceil()
        .clamp(1.0, 10_000.0) as usize;
    let mut batch = || {
        measured(|| (0..times).try_for_each(|_| work().map(drop)))
            .map(|((), cost)| cost.scaled(1.0 / times as f64))
    };
    let mut cost = if times == 1 { first } else { batch()? };
    for _ in 0..2 {
        let again = batch()?;
        cost = Cost {
            cpu_s: cost.cpu_s.min(again.cpu_s),
            wall_s: cost.wall_s.min(again.wall_s),
            ..again
        };
    }
    Ok((value, cost))
}

/// Kind of processor, number of cores and compiler, as far as the system tells.
pub(crate) fn machine() -> String {
    let cpu = std::fs::read_to_string("/proc/cpuinfo")
        .ok()
        .and_then(|text| {
            let line = text.lines().find(|l| l.starts_with("model name"))?;
            line.split_once(':').map(|(_, name)| name.trim().to_owned())
        });
    let cores = std::thread::available_parallelism().map_or(0, usize::from);
    let compiler =
        output(Command::new("rustc").arg("--version")).map(|text| text.trim().to_owned());
    format!(
        "{} ({}, {}), {cores} cores, {}",
        cpu.unwrap_or_else(|| "processor unknown".into()),
        std::env::consts::ARCH,
        std::env::consts::OS,
        compiler.unwrap_or_else(|_| "compiler unknown".into())
    )
}
