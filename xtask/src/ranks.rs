//! `cargo xtask ranks`: a wake under `mpirun` on 2 and 4 processes against one process, byte for byte, a run whose
//! second process is killed; with `--measure` also how fast two processes are, and how long single exchanges take.
//!
//! Needs an MPI library with its compiler `mpicc`, and libclang, for the build; on Debian as root it installs them.

use crate::process::{call, output, watch};
use crate::workspace::{built, root};
use fixtures::failure::{Failure, Outcome};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// What is run, whole or for some steps.
const CASE: &str = include_str!("ranks.toml");
/// Steps of the runs that are compared.
const STEPS: u32 = 20;
/// Longest processor time of a run, s; six times as much of the clock.
const LONGEST_S: f64 = 100.0;
/// What Debian calls the library.
const INSTALL: &str = "timeout 300 sh -c 'apt-get update -qq && apt-get install -y -qq openmpi-bin libopenmpi-dev libclang-dev'";
/// Whether all is there; clang's library is sought where linkers and Debian have it.
const IS_THERE: &str = "command -v mpicc && command -v mpirun && { ldconfig -p | grep -q libclang || ls /usr/lib/llvm-*/lib/libclang*.so*; }";

/// Turns of a field in a stage.
pub(crate) const TURNS: f64 = 2.0;
/// Planes of the whole halos of one field, on either side of a slab.
const WHOLE: f64 = 8.0;

/// Planes of halos that leave a slab in a stage with the multiscale model.
pub(crate) const PLANES: f64 = 63.0;

/// Runs the checks, or prints why there are none.
///
/// # Errors
/// Fails if the build does, files differ, or a run hangs or succeeds although a process was killed.
pub(crate) fn run(is_measured: bool) -> Outcome {
    if !succeeds(IS_THERE) && !is_installed() {
        println!(
            "skipped: mpicc, mpirun or libclang is missing, and cannot be installed here ({INSTALL})"
        );
        return Ok(());
    }
    // As one of the workspace, with the features that its other crates need.
    let mut build = Command::new(env!("CARGO"));
    build.args(["build", "--quiet", "--workspace", "--bin", "wakescope"]);
    build.args(["--features", "wakescope-sim/mpi"]);
    if is_measured {
        build.args(["--example", "exchange_times"]);
    }
    call(&mut build)?;
    let program = built().join("debug/wakescope");
    let scratch = root().join("target/ranks");
    let _ = std::fs::remove_dir_all(&scratch);
    std::fs::create_dir_all(&scratch)?;
    let short = format!("{CASE}pause_after_steps = {STEPS}\n");
    std::fs::write(scratch.join("short.toml"), short)?;
    std::fs::write(scratch.join("long.toml"), CASE)?;
    compare(&program, &scratch)?;
    kill_one(&program, &scratch)?;
    if !is_measured {
        return Ok(());
    }
    let cell_s = measure(&program, &scratch)?;
    exchanges(&built().join("debug/examples/exchange_times"), cell_s)
}

/// Whether a command of the shell succeeds.
fn succeeds(command: &str) -> bool {
    let mut shell = Command::new("sh");
    shell.args(["-c", command]);
    shell.stdout(Stdio::null()).stderr(Stdio::null());
    shell.status().is_ok_and(|status| status.success())
}

/// Installs what is missing, as root alone; returns whether all is there.
fn is_installed() -> bool {
    succeeds("[ $(id -u) = 0 ]") && succeeds(INSTALL) && succeeds(IS_THERE)
}

/// Runs the flow of the measurement on some ranks of one thread; returns what it reports, as JSON.
fn flow_report(program: &Path, scratch: &Path, ranks: usize, out: &str) -> Result<String, Failure> {
    let arguments = ["flow", "even.toml", "--quiet", "--json", "--threads", "1"];
    let mut flow = mpirun(ranks);
    flow.arg(program).args(arguments).args(["--out", out]);
    output(flow.current_dir(scratch))
}

/// The first number of a key in a text of JSON.
fn json_number(text: &str, key: &str) -> Result<f64, Failure> {
    let after = text.split_once(&format!("\"{key}\":"));
    after
        .and_then(|(_, rest)| rest.split([',', '}']).next()?.trim().parse().ok())
        .ok_or_else(|| Failure::new(format!("a flow reports no {key}: {text}")))
}

/// Prints how much less time steps need on two ranks of one thread than on one, and what they spend in turns and halos. A
/// measurement, which depends on what else the machine does: nothing is decided by it. Returns the work on a cell in a stage by one \[s\].
fn measure(program: &Path, scratch: &Path) -> Result<f64, Failure> {
    let cells = 128;
    let steps = 4;
    let stages = 3;
    let case = format!(
        "format = 1\n[case]\nkind = \"vortex_pair\"\ncells = [{cells}, {cells}, {cells}]\n[time]\n\
         pause_after_steps = {steps}\n[solver]\nsubgrid = {{ model = \"multiscale_wale\" }}\n[checkpoint]\nwrite = false\n"
    );
    std::fs::write(scratch.join("even.toml"), case)?;
    let one = flow_report(program, scratch, 1, "even_one")?;
    let two = flow_report(program, scratch, 2, "even_two")?;
    let one_s = json_number(&one, "steps_wall_s")?;
    let two_s = json_number(&two, "steps_wall_s")?;
    let exchange_s = json_number(&two, "exchange_wall_s")?;
    println!(
        "measured, {cells}^3 with the multiscale model: two ranks of one thread are {:.2} times as fast as one; {:.0} % of a \
         step in turns and halos",
        one_s / two_s,
        100.0 * exchange_s / two_s
    );
    Ok(one_s / f64::from(steps * stages * i32::pow(cells, 3)))
}

/// The numbers of a line of the example `exchange_times`: cells of a rank, bytes of a message and its time \[s\].
fn exchange(line: &str) -> Option<[f64; 3]> {
    let mut numbers = line.split(',').skip(2).map(|word| word.parse().ok());
    Some([numbers.next()??, numbers.next()??, numbers.next()??])
}

/// Prints how long single exchanges last on 2 to 4 ranks by the size of their messages, and how well equal slabs would scale by it if the
/// work on a cell in a stage needs `cell_s` \[s\].
fn exchanges(program: &Path, cell_s: f64) -> Outcome {
    let cores = std::thread::available_parallelism()?.get();
    println!(
        "measured exchanges on {cores} cores, whose times count waiting where there are more ranks than cores:"
    );
    println!(
        "| ranks | cells of a rank | turn: MB | ms | halos of a field: MB | ms | efficiency with the multiscale model |"
    );
    println!("|---|---|---|---|---|---|---|");
    for count in 2..=4 {
        let text = output(mpirun(count).arg(program))?;
        let lines: Vec<&str> = text.lines().skip(1).collect();
        for pair in lines.chunks(2) {
            let halos = pair.first().and_then(|line| exchange(line));
            let turn = pair.get(1).and_then(|line| exchange(line));
            let (Some([cells, halo_bytes, halos_s]), Some([_, turn_bytes, turn_s])) = (halos, turn)
            else {
                return Err(Failure::new(format!("exchange_times prints\n{text}")));
            };
            let work_s = cells * cell_s;
            let exchange_s = TURNS * turn_s + PLANES / WHOLE * halos_s;
            println!(
                "| {count} | {cells} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} |",
                1e-6 * turn_bytes,
                1e3 * turn_s,
                1e-6 * halo_bytes,
                1e3 * halos_s,
                work_s / (work_s + exchange_s)
            );
        }
    }
    Ok(())
}

/// Words of `mpirun` for `count` processes, more than cores if need be.
fn mpirun(count: usize) -> Command {
    let mut command = Command::new("mpirun");
    command.args([
        "--oversubscribe",
        "--bind-to",
        "none",
        "-n",
        &count.to_string(),
    ]);
    command.envs([
        ("OMPI_ALLOW_RUN_AS_ROOT", "1"),
        ("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"),
    ]);
    command
}

/// Options of a run of the wake in one thread.
const ONE_THREAD: [&str; 3] = ["--quiet", "--threads", "1"];

/// Runs some steps on one process and under `mpirun`: all files must be equal.
fn compare(program: &Path, scratch: &Path) -> Outcome {
    let arguments = [&["wake", "short.toml", "--out", "one"][..], &ONE_THREAD].concat();
    let alone = watch(program, &arguments, scratch, LONGEST_S)?;
    if alone.code != Some(0) {
        return Err(Failure::new(format!("one process: {}", alone.stderr)));
    }
    let expected = files(&scratch.join("one"))?;
    for (count, out) in [(2, "two"), (4, "four")] {
        let start = Instant::now();
        let mut wake = mpirun(count);
        wake.arg(program).args(["wake", "short.toml", "--out", out]);
        let text = output(wake.args(ONE_THREAD).current_dir(scratch))?;
        let found = files(&scratch.join(out))?;
        let problem = if text.matches("wrote").count() != 1 {
            Some("not exactly one of them reports what was written".into())
        } else {
            difference(&expected, &found)
        };
        if let Some(problem) = problem {
            return Err(Failure::new(format!(
                "{count} processes: {problem}\n{text}"
            )));
        }
        println!(
            "{count} processes: {} files of {STEPS} steps, the bytes of one process, {:.0} s",
            found.len(),
            start.elapsed().as_secs_f64()
        );
    }
    Ok(())
}

/// Files by name.
type Files = BTreeMap<OsString, Vec<u8>>;

/// The first file that is not the same in both folders.
fn difference(expected: &Files, found: &Files) -> Option<String> {
    let mut names = expected.keys().chain(found.keys());
    let name = names.find(|name| found.get(*name) != expected.get(*name))?;
    Some(format!("{} is not that of one process", name.display()))
}

/// The files of a folder.
fn files(folder: &Path) -> Result<Files, Failure> {
    let mut files = Files::new();
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        files.insert(entry.file_name(), std::fs::read(entry.path())?);
    }
    Ok(files)
}

/// Waits until a process has ended or a condition holds; kills it if neither comes in time. Returns whether one did.
fn ends_in_time(child: &mut Child, is_done: impl Fn() -> bool) -> Result<bool, Failure> {
    let start = Instant::now();
    while start.elapsed().as_secs_f64() < LONGEST_S {
        if is_done() || child.try_wait()?.is_some() {
            return Ok(true);
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    child.kill()?;
    Ok(false)
}

/// Kills one of two processes when there is a checkpoint: the other must end, and the checkpoint must be whole.
fn kill_one(program: &Path, scratch: &Path) -> Outcome {
    let mut command = mpirun(2);
    command
        .arg(program)
        .args(["wake", "long.toml", "--out", "killed"]);
    command.args(ONE_THREAD).current_dir(scratch);
    command.stderr(Stdio::null()).stdout(Stdio::null());
    let mut child = command.spawn()?;
    let previous = scratch.join("killed/flow.checkpoint.previous");
    let is_written = ends_in_time(&mut child, || previous.exists())?;
    if !is_written || child.try_wait()?.is_some() {
        return Err(Failure::new(
            "no two checkpoints were written by two processes".into(),
        ));
    }
    let is_killed = kill_last_child(&child)?;
    if !is_killed || !ends_in_time(&mut child, || false)? || child.wait()?.success() {
        return Err(Failure::new(
            "a process was killed, and the run hangs or succeeds".into(),
        ));
    }
    let restart = ["wake", "short.toml", "--out", "killed", "--restart"];
    let arguments = [&restart[..], &ONE_THREAD].concat();
    let restarted = watch(program, &arguments, scratch, LONGEST_S)?;
    if restarted.code != Some(0) {
        return Err(Failure::new(format!(
            "the run of a killed process does not continue: {}",
            restarted.stderr
        )));
    }
    println!(
        "one of two processes killed: the other ended, one process continues from the checkpoint"
    );
    Ok(())
}

/// Kills the last process that another one has started; returns whether it could.
fn kill_last_child(parent: &Child) -> Result<bool, Failure> {
    let listed = Command::new("pgrep")
        .args(["-P", &parent.id().to_string()])
        .output()?;
    let children = String::from_utf8_lossy(&listed.stdout);
    let victim = children
        .lines()
        .last()
        .ok_or_else(|| Failure::new("mpirun has no processes".into()))?;
    let kill = Command::new("kill").args(["-9", victim]).status()?;
    Ok(kill.success())
}
