//! A run of the program `wakescope` as another process, watched: its time, its memory, its end.
//!
//! Linux only: the figures come from /proc.

use crate::cost;
use crate::workspace::{built, root};
use fixtures::failure::Failure;
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

/// The program to run: the given one, or the release build, made anew.
pub(crate) fn program(given: Option<&Path>) -> Result<PathBuf, Failure> {
    if let Some(given) = given {
        return Ok(given.canonicalize()?);
    }
    let words = ["build", "--release", "--quiet", "--package", "wakescope-sim"];
    let status = Command::new(env!("CARGO")).args(words).current_dir(root()).status();
    match status.map_err(|e| Failure::new(format!("cannot run cargo: {e}")))?.success() {
        true => Ok(built().join("release/wakescope")),
        false => Err(Failure::new("wakescope does not build".into())),
    }
}

/// Runs `program` with `words` in `folder` for at most `seconds` of processor or six times as much of the clock.
pub(crate) fn watch(program: &Path, words: &[&str], folder: &Path, seconds: f64) -> Result<Watched, Failure> {
    let io = |e: std::io::Error| Failure::new(format!("cannot run {}: {e}", program.display()));
    // Output to files: a pipe that nobody reads would stop the process.
    let (out, err) = (folder.join("stdout"), folder.join("stderr"));
    let to = |path: &Path| std::fs::File::create(path).map(Stdio::from).map_err(io);
    let mut child = Command::new(program)
        .args(words)
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(to(&out)?)
        .stderr(to(&err)?)
        .spawn()
        .map_err(io)?;
    let begun = Instant::now();
    let (mut cpu_s, mut peak_bytes, mut hung) = (0.0, 0.0_f64, false);
    loop {
        // A process that has ended keeps its times until it is waited for.
        let ended = sample(&child, &mut cpu_s, &mut peak_bytes);
        if ended {
            break;
        }
        if cpu_s > seconds || begun.elapsed().as_secs_f64() > 6.0 * seconds {
            hung = true;
            child.kill().map_err(io)?;
            break;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    let code = child.wait().map_err(io)?.code();
    let read = |path: &Path| Ok::<_, Failure>(String::from_utf8_lossy(&std::fs::read(path).map_err(io)?).into_owned());
    Ok(Watched { code, hung, cpu_s, peak_bytes, stdout: read(&out)?, stderr: read(&err)? })
}

/// Brings time and memory up to date; whether the process has ended.
fn sample(child: &Child, cpu_s: &mut f64, peak_bytes: &mut f64) -> bool {
    *peak_bytes = peak_bytes.max(cost::peak_bytes(&child.id().to_string()));
    let stat = std::fs::read_to_string(format!("/proc/{}/stat", child.id())).unwrap_or_default();
    // utime and stime.
    *cpu_s = cpu_s.max(cost::ticks_s(&stat, 11) + cost::ticks_s(&stat, 12));
    let state = stat.rsplit(')').next().and_then(|fields| fields.split_whitespace().next());
    matches!(state, None | Some("Z" | "X"))
}
