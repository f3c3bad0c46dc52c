//! What a piece of work costs: processor time, time on the clock, memory; and on which machine. Linux only: memory and machine
//! come from /proc.

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
    let before_s = clock_s(ClockId::ProcessCPUTime);
    let start = Instant::now();
    let value = work()?;
    let cost = Cost {
        cpu_s: clock_s(ClockId::ProcessCPUTime) - before_s,
        wall_s: start.elapsed().as_secs_f64(),
        peak_mem_bytes: resident_peak_bytes("self"),
    };
    Ok((value, cost))
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
    let mut cost = if times == 1 {
        first
    } else {
        repeated(&mut work, times)?
    };
    for _ in 0..2 {
        let again = repeated(&mut work, times)?;
        cost = Cost {
            cpu_s: cost.cpu_s.min(again.cpu_s),
            wall_s: cost.wall_s.min(again.wall_s),
            ..again
        };
    }
    Ok((value, cost))
}

/// Mean cost of work that is done several times in a row.
fn repeated<T>(
    work: &mut impl FnMut() -> Result<T, Failure>,
    times: usize,
) -> Result<Cost, Failure> {
    let ((), cost) = measured(|| {
        for _ in 0..times {
            work()?;
        }
        Ok(())
    })?;
    Ok(cost.scaled(1.0 / times as f64))
}

/// Kind of processor, number of cores and compiler, as far as the system tells.
pub(crate) fn machine() -> String {
    let cpuinfo = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let line = cpuinfo.lines().find(|l| l.starts_with("model name"));
    let cpu = line.and_then(|line| line.split_once(':'));
    let cores = std::thread::available_parallelism().map_or(0, usize::from);
    let compiler =
        output(Command::new("rustc").arg("--version")).map(|text| text.trim().to_owned());
    format!(
        "{} ({}, {}), {cores} cores, {}",
        cpu.map_or("processor unknown", |(_, name)| name.trim()),
        std::env::consts::ARCH,
        std::env::consts::OS,
        compiler.unwrap_or_else(|_| "compiler unknown".into())
    )
}
