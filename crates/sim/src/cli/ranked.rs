//! Commands that run on the processes of `mpirun`, or in one.

use super::Cli;
use crate::Error;
use std::sync::Arc;
use wakescope_les::ranks::{Ranks, Single};

/// What Open MPI and MPICH (with its relatives) tell each process of their number.
const COUNTS: [&str; 2] = ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE"];

/// Runs `work` on the processes that share it. Where it fails, rank 0 alone says so, and all end.
pub(super) fn ranked(cli: &Cli, work: impl FnOnce(&Arc<dyn Ranks>) -> Result<(), Error>) -> Result<(), Error> {
    let started = COUNTS.iter().find_map(|name| std::env::var(name).ok()?.parse::<usize>().ok());
    match started.filter(|count| *count > 1) {
        None => work(&(Arc::new(Single) as Arc<dyn Ranks>)),
        Some(count) => on_processes(count, cli, work),
    }
}

#[cfg(feature = "mpi")]
fn on_processes(_: usize, cli: &Cli, work: impl FnOnce(&Arc<dyn Ranks>) -> Result<(), Error>) -> Result<(), Error> {
    let world = crate::processes::World::join()?;
    let ranks = world.ranks();
    if ranks.rank() == 0 && !cli.quiet {
        use std::io::Write as _;
        let (count, threads) = (ranks.count(), rayon::current_num_threads());
        let _ = writeln!(std::io::stderr(), "{count} ranks; threads of the first: {threads}");
    }
    work(&ranks).or_else(|error| world.fail(|| super::output::complain(&error, cli.json)))
}

#[cfg(not(feature = "mpi"))]
fn on_processes(count: usize, _: &Cli, _: impl FnOnce(&Arc<dyn Ranks>) -> Result<(), Error>) -> Result<(), Error> {
    let reason = format!(
        "{count} processes were started, but this build shares no flow among them: build with `--features mpi`, or start one"
    );
    Err(Error::Input { path: "mpirun".into(), reason })
}
