//! The processes that `mpirun` has started as the ranks of a flow: for the program, and for user-supplied programs, which give
//! [`World::ranks`] to `FlowSettings::ranks` (the example `exchange_times` begins like this).
//!
//! All calls to MPI are made by the thread that joined. A process that fails ends all others: none waits for it in vain.
//!
//! Check: the step `mpi` of `cargo xtask ci` runs wakes on 2 and 4 processes against one, and kills one.

use crate::Error;
use mpi::collective::CommunicatorCollectives as _;
use mpi::datatype::{Partition, PartitionMut};
use mpi::environment::Universe;
use mpi::topology::{Communicator as _, SimpleCommunicator};
use mpi::{Count, Threading};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;
use wakescope_les::ranks::Ranks;

/// For how long a process leaves it to the first one to say what failed.
const GRACE: Duration = Duration::from_secs(5);
/// Exit code of a failed run.
const FAILED: i32 = 2;

/// Membership of this process; MPI ends with it.
pub struct World {
    _universe: Universe,
}

impl World {
    /// Joins the other processes. From then on a panic of this process ends all.
    ///
    /// # Errors
    /// [`Error::Input`] if MPI runs already, or allows no threads beside its own.
    pub fn join() -> Result<Self, Error> {
        let (universe, threads) = mpi::initialize_with_threading(Threading::Funneled)
            .ok_or_else(|| refused("MPI runs already"))?;
        if threads < Threading::Funneled {
            return Err(refused(
                "the MPI library allows no threads beside its own: take one built with MPI_THREAD_FUNNELED",
            ));
        }
        let usual = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            usual(panic);
            SimpleCommunicator::world().abort(FAILED)
        }));
        Ok(Self {
            _universe: universe,
        })
    }

    /// The processes as ranks.
    #[must_use]
    pub fn ranks(&self) -> Arc<dyn Ranks> {
        let world = SimpleCommunicator::world();
        Arc::new(Processes {
            rank: world.rank() as usize,
            count: world.size() as usize,
        })
    }

    /// Ends all processes after `say` has reported why: that of rank 0, or, where it reports nothing, that of another one.
    pub fn fail(&self, say: impl FnOnce()) -> ! {
        let world = SimpleCommunicator::world();
        if world.rank() > 0 {
            std::thread::sleep(GRACE);
        }
        say();
        world.abort(FAILED)
    }
}

fn refused(reason: &str) -> Error {
    Error::input(Path::new("mpirun"), reason)
}

#[derive(Debug)]
struct Processes {
    rank: usize,
    count: usize,
}

impl Ranks for Processes {
    fn rank(&self) -> usize {
        self.rank
    }

    fn count(&self) -> usize {
        self.count
    }

    fn all_to_all(
        &self,
        send: &[f64],
        to: &[usize],
        receive: &mut [f64],
        from: &[usize],
    ) -> Result<(), wakescope_les::Error> {
        let to = parts(to)?;
        let from = parts(from)?;
        let send = Partition::new(send, to.0, to.1);
        let mut receive = PartitionMut::new(receive, from.0, from.1);
        SimpleCommunicator::world().all_to_all_varcount_into(&send, &mut receive);
        Ok(())
    }
}

/// Lengths and starts of the parts of a message, as MPI counts them.
fn parts(lengths: &[usize]) -> Result<(Vec<Count>, Vec<Count>), wakescope_les::Error> {
    let mut end = 0;
    let mut counts = Vec::with_capacity(lengths.len());
    let mut starts = Vec::with_capacity(lengths.len());
    for length in lengths {
        counts.push(*length as Count);
        starts.push(end as Count);
        end += length;
    }
    if end > Count::MAX as usize {
        let field = "values in a message between ranks";
        let allowed = "at most 2147483647: take more ranks";
        return Err(wakescope_les::Error::OutOfRange {
            field,
            value: end as f64,
            allowed,
        });
    }
    Ok((counts, starts))
}
