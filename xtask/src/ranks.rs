//! `cargo xtask ranks`: a wake under `mpirun` on 2 and 4 processes against one process, byte for byte, a run whose
//! second process is killed; with `--measure` also how fast two processes are, and how long single exchanges take.
//!
//! Needs an MPI library with its compiler `mpicc`, and libclang, for the build; on Debian as root it installs them.

use crate::process::{call, output, watch};
use crate::workspace::{built, root};
use fixtures::failure::{Failure, Outcome};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs::DirEntry;
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

/// Options of the task.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Measure as well, which decides nothing: two ranks against one, and single exchanges.
    #[arg(long)]
    measure: bool,
}

/// Runs the checks, or says why there are none.
///
/// # Errors
/// A build that fails, files that differ, a run that hangs or ends well although a process was killed.
pub(crate) fn run(options: &Options) -> Outcome {
    let succeeds = |command: &str| {
        let status = Command::new("sh")
            .args(["-c", command])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status();
        status.is_ok_and(|status| status.success())
    };
    let is_there = || succeeds(IS_THERE);
    let installed = || succeeds("[ $(id -u) = 0 ]") && succeeds(INSTALL) && is_there();
    if !is_there() && !installed() {
        println!(
            "skipped: mpicc, mpirun or libclang is missing, and cannot be installed here ({INSTALL})"
        );
        return Ok(());
    }
    // As one of the workspace, with the features that its other crates ask for.
    let example: &[&str] = if options.measure {
        &["--example", "exchange_times"]
    } else {
        &[]
    };
    let words = [
        "build",
        "--quiet",
        "--workspace",
        "--features",
        "wakescope-sim/mpi",
        "--bin",
        "wakescope",
    ];
    call(Command::new(env!("CARGO")).args(words).args(example))?;
    let program = built().join("debug/wakescope");
    let scratch = root().join("target/ranks");
    let _ = std::fs::remove_dir_all(&scratch);
    std::fs::create_dir_all(&scratch)?;
    std::fs::write(
        scratch.join("short.toml"),
        format!("{CASE}pause_after_steps = {STEPS}\n"),
    )?;
    std::fs::write(scratch.join("long.toml"), CASE)?;
    compare(&program, &scratch)?;
    kill_one(&program, &scratch)?;
    if !options.measure {
        return Ok(());
    }
    let work_s = measure(&program, &scratch)?;
    exchanges(&built().join("debug/examples/exchange_times"), work_s)
}

/// Prints how much less time steps take on two ranks of one thread than on one, and what they spend in turns and halos. A
/// measurement, which depends on what else the machine does: nothing is decided by it. Returns the work on a cell in a stage by one \[s\].
fn measure(program: &Path, scratch: &Path) -> Result<f64, Failure> {
    let (cells, steps, stages) = (128, 4, 3);
    let case = format!(
        "format = 1\n[case]\nkind = \"vortex_pair\"\ncells = [{cells}, {cells}, {cells}]\n[time]\n\
         pause_after_steps = {steps}\n[solver]\nsubgrid = {{ model = \"multiscale_wale\" }}\n[checkpoint]\nwrite = false\n"
    );
    std::fs::write(scratch.join("even.toml"), case)?;
    let times_s = |count: usize, out: &str| {
        let words = [
            "flow",
            "even.toml",
            "--quiet",
            "--json",
            "--threads",
            "1",
            "--out",
            out,
        ];
        let text = output(mpirun(count).arg(program).args(words).current_dir(scratch))?;
        let number = |key: &str| {
            let (_, rest) = text.split_once(&format!("\"{key}\":"))?;
            rest.split([',', '}']).next()?.trim().parse::<f64>().ok()
        };
        let both = number("steps_wall_s").zip(number("exchange_wall_s"));
        both.ok_or_else(|| Failure::new(format!("a flow tells no times: {text}")))
    };
    let ((one_s, _), (two_s, exchange_s)) = (times_s(1, "even_one")?, times_s(2, "even_two")?);
    println!(
        "measured, {cells}^3 with the multiscale model: two ranks of one thread are {:.2} times as fast as one; {:.0} % of a \
         step in turns and halos",
        one_s / two_s,
        100.0 * exchange_s / two_s
    );
    Ok(one_s / f64::from(steps * stages * i32::pow(cells, 3)))
}

/// Prints how long single exchanges take on 2 to 4 ranks by the size of their messages, and how well equal slabs would scale by it if the
/// work on a cell in a stage takes `cell_s` \[s\].
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
        let rows: Vec<Vec<&str>> = text
            .lines()
            .skip(1)
            .map(|line| line.split(',').collect())
            .collect();
        for pair in rows.chunks(2) {
            let [halos, turn] = [0, 1].map(|place| {
                let numbers: Option<Vec<f64>> = pair
                    .get(place)?
                    .iter()
                    .skip(2)
                    .map(|word| word.parse().ok())
                    .collect();
                <[f64; 3]>::try_from(numbers?).ok()
            });
            let (Some([cells, halo_bytes, halo_s]), Some([_, turn_bytes, turn_s])) = (halos, turn)
            else {
                return Err(Failure::new(format!("exchange_times prints\n{text}")));
            };
            let work_s = cells * cell_s;
            let efficiency = work_s / (work_s + TURNS * turn_s + PLANES / WHOLE * halo_s);
            println!(
                "| {count} | {cells} | {:.2} | {:.2} | {:.2} | {:.2} | {efficiency:.2} |",
                1e-6 * turn_bytes,
                1e3 * turn_s,
                1e-6 * halo_bytes,
                1e3 * halo_s
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

fn compare(program: &Path, scratch: &Path) -> Outcome {
    let words = |out: &'static str| {
        [
            "wake",
            "short.toml",
            "--quiet",
            "--threads",
            "1",
            "--out",
            out,
        ]
    };
    let alone = watch(program, &words("one"), scratch, LONGEST_S)?;
    if alone.code != Some(0) {
        return Err(Failure::new(format!("one process: {}", alone.stderr)));
    }
    let expected = files(&scratch.join("one"))?;
    for (count, out) in [(2, "two"), (4, "four")] {
        let begun = Instant::now();
        let text = output(
            mpirun(count)
                .arg(program)
                .args(words(out))
                .current_dir(scratch),
        )?;
        let failed = |why: &str| Failure::new(format!("{count} processes: {why}\n{text}"));
        if text.matches("wrote").count() != 1 {
            return Err(failed("not exactly one of them says what was written"));
        }
        let found = files(&scratch.join(out))?;
        if let Some(name) = expected
            .keys()
            .chain(found.keys())
            .find(|name| found.get(*name) != expected.get(*name))
        {
            return Err(failed(&format!(
                "{} is not that of one process",
                name.display()
            )));
        }
        let seconds = begun.elapsed().as_secs_f64();
        println!(
            "{count} processes: {} files of {STEPS} steps, the bytes of one process, {seconds:.0} s",
            found.len()
        );
    }
    Ok(())
}

/// The files of a folder.
fn files(folder: &Path) -> Result<BTreeMap<OsString, Vec<u8>>, Failure> {
    let read = |entry: std::io::Result<DirEntry>| {
        let entry = entry?;
        Ok((entry.file_name(), std::fs::read(entry.path())?))
    };
    std::fs::read_dir(folder)?.map(read).collect()
}

/// Kills one of two processes when there is a checkpoint: the other must end, and the checkpoint must be whole.
fn kill_one(program: &Path, scratch: &Path) -> Outcome {
    let words = |case| ["wake", case, "--quiet", "--threads", "1", "--out", "killed"];
    let mut command = mpirun(2);
    command
        .arg(program)
        .args(words("long.toml"))
        .current_dir(scratch)
        .stderr(Stdio::null())
        .stdout(Stdio::null());
    let mut child = command.spawn()?;
    let ends_within =
        |child: &mut Child, seconds: f64, done: &dyn Fn() -> bool| -> Result<bool, Failure> {
            let begun = Instant::now();
            while begun.elapsed().as_secs_f64() < seconds {
                if done() || child.try_wait()?.is_some() {
                    return Ok(true);
                }
                std::thread::sleep(Duration::from_millis(20));
            }
            child.kill()?;
            Ok(false)
        };
    let previous = scratch.join("killed/flow.checkpoint.previous");
    if !ends_within(&mut child, LONGEST_S, &|| previous.exists())? || child.try_wait()?.is_some() {
        return Err(Failure::new(
            "no two checkpoints were written by two processes".into(),
        ));
    }
    let ranks = Command::new("pgrep")
        .args(["-P", &child.id().to_string()])
        .output()?;
    let ranks = String::from_utf8_lossy(&ranks.stdout).into_owned();
    let victim = ranks
        .lines()
        .last()
        .ok_or_else(|| Failure::new("mpirun has no processes".into()))?;
    let killed = Command::new("kill").args(["-9", victim]).status()?;
    if !killed.success()
        || !ends_within(&mut child, LONGEST_S, &|| false)?
        || child.wait()?.success()
    {
        return Err(Failure::new(
            "a process was killed, and the run hangs or ends well".into(),
        ));
    }
    let goes_on = [&words("short.toml")[..], &["--restart"]].concat();
    let goes_on = watch(program, &goes_on, scratch, LONGEST_S)?;
    if goes_on.code != Some(0) {
        return Err(Failure::new(format!(
            "the run of a killed process does not continue: {}",
            goes_on.stderr
        )));
    }
    println!(
        "one of two processes killed: the other ended, one process continues from the checkpoint"
    );
    Ok(())
}
