//! Other programs as processes: called, or watched, with their time, their memory, their end.
//!
//! Watching is of Linux only: the figures come from /proc.

use crate::workspace::{built, root};
use fixtures::failure::Failure;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// What became of a process.
pub(crate) struct Watched {
    /// Exit code; `None` after a signal.
    pub(crate) code: Option<i32>,
    /// It was stopped because it took too long.
    pub(crate) hung: bool,
    /// Processor time, s.
    pub(crate) cpu_s: f64,
    /// Largest resident set that was seen, bytes.
    pub(crate) peak_bytes: f64,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

/// Runs a command in the root of the workspace, unless it has another folder, to its good end; what it prints where that is piped.
///
/// # Errors
/// A program that is not there, one that fails.
pub(crate) fn call(command: &mut Command) -> Result<String, Failure> {
    if command.get_current_dir().is_none() {
        command.current_dir(root());
    }
    let program = command.get_program().display().to_string();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    match command.spawn().and_then(Child::wait_with_output) {
        Ok(ended) if ended.status.success() => Ok(text(&ended.stdout)),
        Ok(ended) => Err(Failure::new(format!(
            "failed: {command:?}\n{}",
            text(&ended.stderr)
        ))),
        Err(error) if error.kind() == ErrorKind::NotFound => Err(Failure::new(format!(
            "{program} is not installed: `cargo install --locked {program}` does that"
        ))),
        Err(error) => Err(Failure::new(format!("cannot run {program}: {error}"))),
    }
}

/// The same for what it prints.
///
/// # Errors
/// As [`call`].
pub(crate) fn output(command: &mut Command) -> Result<String, Failure> {
    call(
        command
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped()),
    )
}

/// The program to run: the given one, or the release build, made anew.
pub(crate) fn program(given: Option<&Path>) -> Result<PathBuf, Failure> {
    if let Some(given) = given {
        return Ok(given.canonicalize()?);
    }
    call(Command::new(env!("CARGO")).args([
        "build",
        "--release",
        "--quiet",
        "--package",
        "wakescope-sim",
    ]))?;
    Ok(built().join("release/wakescope"))
}

/// Runs a scene anew in `folder`, in one thread and for at most ten minutes of processor: a command, and what it is told besides.
///
/// # Errors
/// A scene that does not run to its end.
pub(crate) fn run_scene(
    program: &Path,
    folder: &Path,
    scene: &str,
    words: &[&str],
) -> Result<Watched, Failure> {
    std::fs::write(folder.join("scene.toml"), scene)?;
    if folder.join("out").exists() {
        std::fs::remove_dir_all(folder.join("out"))?;
    }
    let (command, more) = words.split_at(1);
    let words = [
        command,
        &["scene.toml", "--out", "out", "--quiet", "--threads", "1"],
        more,
    ]
    .concat();
    let run = watch(program, &words, folder, 600.0)?;
    match run.code {
        Some(0) => Ok(run),
        code => Err(Failure::new(format!(
            "{} of\n{scene}ended with {code:?}: {}",
            words[0], run.stderr
        ))),
    }
}

/// Runs `program` with `words` in `folder` for at most `seconds` of processor or six times as much of the clock.
pub(crate) fn watch(
    program: &Path,
    words: &[&str],
    folder: &Path,
    seconds: f64,
) -> Result<Watched, Failure> {
    // Output to files: a pipe that nobody reads would stop the process.
    let (out, err) = (folder.join("stdout"), folder.join("stderr"));
    let to = |path: &Path| std::fs::File::create(path).map(Stdio::from);
    let mut child = Command::new(program)
        .args(words)
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(to(&out)?)
        .stderr(to(&err)?)
        .spawn()
        .map_err(|e| Failure::new(format!("cannot run {}: {e}", program.display())))?;
    let begun = Instant::now();
    let (mut cpu_s, mut peak_bytes, mut hung) = (0.0, 0.0_f64, false);
    // A process that has ended keeps its times until it is waited for.
    while !hung && !sample(&child, &mut cpu_s, &mut peak_bytes) {
        hung = cpu_s > seconds || begun.elapsed().as_secs_f64() > 6.0 * seconds;
        std::thread::sleep(Duration::from_millis(1));
    }
    if hung {
        child.kill()?;
    }
    let code = child.wait()?.code();
    let [stdout, stderr] = [std::fs::read(out)?, std::fs::read(err)?]
        .map(|text| String::from_utf8_lossy(&text).into());
    Ok(Watched {
        code,
        hung,
        cpu_s,
        peak_bytes,
        stdout,
        stderr,
    })
}

/// Brings time and memory up to date; whether the process has ended.
fn sample(child: &Child, cpu_s: &mut f64, peak_bytes: &mut f64) -> bool {
    *peak_bytes = peak_bytes.max(resident_peak_bytes(&child.id().to_string()));
    let stat = std::fs::read_to_string(format!("/proc/{}/stat", child.id())).unwrap_or_default();
    // utime and stime.
    *cpu_s = cpu_s.max(ticks_s(&stat, 11) + ticks_s(&stat, 12));
    let state = stat
        .rsplit(')')
        .next()
        .and_then(|fields| fields.split_whitespace().next());
    matches!(state, None | Some("Z" | "X"))
}

/// Processor time of the processes that this one has waited for, and theirs, s; zero where the system does not tell.
pub(crate) fn children_cpu_s() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    ticks_s(&stat, 13) + ticks_s(&stat, 14)
}

/// The time at a place behind the name in `/proc/PID/stat`, where the state stands at place 0, s; zero where there is none.
pub(crate) fn ticks_s(stat: &str, place: usize) -> f64 {
    let field = stat
        .rsplit(')')
        .next()
        .and_then(|fields| fields.split_whitespace().nth(place));
    field
        .and_then(|ticks| ticks.parse::<f64>().ok())
        .unwrap_or(0.0)
        / 100.0
}

/// Largest resident memory of a process so far, bytes; NaN where the system does not tell.
pub(crate) fn resident_peak_bytes(process: &str) -> f64 {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let peak = status.lines().find_map(|l| {
        l.strip_prefix("VmHWM:")?
            .trim()
            .strip_suffix(" kB")?
            .parse::<f64>()
            .ok()
    });
    peak.map_or(f64::NAN, |kb| 1024.0 * kb)
}
