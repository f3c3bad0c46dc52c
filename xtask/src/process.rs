//! Other programs as processes: called for their output, or watched for their time and memory.
//!
//! Watching works on Linux only: the numbers come from /proc.

use crate::workspace::{built, root};
use fixtures::failure::Failure;
use std::fs::File;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// How a watched process ended and what it used.
pub(crate) struct Watched {
    /// Exit code; `None` after a signal, also that of its end because it took too long.
    pub(crate) code: Option<i32>,
    /// Processor time \[s\].
    pub(crate) cpu_s: f64,
    /// Largest resident set that was observed \[bytes\].
    pub(crate) peak_bytes: f64,
    pub(crate) stderr: String,
}

/// Processor time after which [`run_scene`] stops a run \[s\].
const LONGEST_SCENE_S: f64 = 600.0;

/// Runs a command in the root of the workspace, unless it has another folder, and returns what it
/// prints where that is piped.
///
/// # Errors
/// Fails if the program is not installed or does not succeed.
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

/// Runs a command as [`call`] does and returns what it prints.
///
/// # Errors
/// As [`call`].
pub(crate) fn output(command: &mut Command) -> Result<String, Failure> {
    command.stdin(Stdio::null());
    command.stdout(Stdio::piped());
    command.stderr(Stdio::piped());
    call(command)
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

/// Runs a scene anew in `folder`, in one thread and for at most ten minutes of processor time.
///
/// # Errors
/// Fails if the run does.
pub(crate) fn run_scene(program: &Path, folder: &Path, scene: &str) -> Result<Watched, Failure> {
    let file = folder.join("scene.toml");
    let out = folder.join("out");
    std::fs::write(file, scene)?;
    if out.exists() {
        std::fs::remove_dir_all(out)?;
    }
    let arguments = [
        "run",
        "scene.toml",
        "--out",
        "out",
        "--quiet",
        "--threads",
        "1",
    ];
    let run = watch(program, &arguments, folder, LONGEST_SCENE_S)?;
    if run.code == Some(0) {
        return Ok(run);
    }
    Err(Failure::new(format!(
        "run of\n{scene}ended with {:?}: {}",
        run.code, run.stderr
    )))
}

/// Runs `program` in `folder` for at most `longest_s` of processor time or six times as much of the clock.
pub(crate) fn watch(
    program: &Path,
    arguments: &[&str],
    folder: &Path,
    longest_s: f64,
) -> Result<Watched, Failure> {
    // Output goes to files: a pipe that nobody reads would stop the process.
    let stdout = folder.join("stdout");
    let stderr = folder.join("stderr");
    let mut child = Command::new(program)
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(File::create(stdout)?)
        .stderr(File::create(&stderr)?)
        .spawn()
        .map_err(|e| Failure::new(format!("cannot run {}: {e}", program.display())))?;
    let start = Instant::now();
    let mut watched = Watched {
        code: None,
        cpu_s: 0.0,
        peak_bytes: 0.0,
        stderr: String::new(),
    };
    // A process that has ended keeps its times until it is waited for.
    while !watched.sample(&child) {
        if watched.cpu_s > longest_s || start.elapsed().as_secs_f64() > 6.0 * longest_s {
            child.kill()?;
            break;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    watched.code = child.wait()?.code();
    watched.stderr = String::from_utf8_lossy(&std::fs::read(stderr)?).into_owned();
    Ok(watched)
}

impl Watched {
    /// Brings time and memory up to date; returns whether the process has ended.
    fn sample(&mut self, child: &Child) -> bool {
        let process = child.id().to_string();
        self.peak_bytes = self.peak_bytes.max(resident_peak_bytes(&process));
        let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
        let user_s = ticks_s(&stat, 11);
        let system_s = ticks_s(&stat, 12);
        self.cpu_s = self.cpu_s.max(user_s + system_s);
        matches!(field(&stat, 0), None | Some("Z" | "X"))
    }
}

/// Processor time of the processes that this one has waited for, theirs included \[s\]; zero where the system does not
/// report it.
pub(crate) fn children_cpu_s() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    ticks_s(&stat, 13) + ticks_s(&stat, 14)
}

/// Field of `/proc/PID/stat` by its index behind the name of the process; the state has index 0.
fn field(stat: &str, index: usize) -> Option<&str> {
    let fields = stat.rsplit(')').next()?;
    fields.split_whitespace().nth(index)
}

/// Time in a field of `/proc/PID/stat` \[s\]; zero where there is none.
fn ticks_s(stat: &str, index: usize) -> f64 {
    let ticks: Option<f64> = field(stat, index).and_then(|ticks| ticks.parse().ok());
    ticks.unwrap_or(0.0) / 100.0
}

/// Largest resident memory of a process so far \[bytes\]; NaN where the system does not report it.
pub(crate) fn resident_peak_bytes(process: &str) -> f64 {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    for line in status.lines() {
        let Some(peak) = line.strip_prefix("VmHWM:") else {
            continue;
        };
        let kilobytes = peak.trim().trim_end_matches(" kB");
        return kilobytes.parse().map_or(f64::NAN, |kb: f64| 1024.0 * kb);
    }
    f64::NAN
}
