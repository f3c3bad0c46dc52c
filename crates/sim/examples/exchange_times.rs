//! How long the processes of `mpirun` take for what a stage of a flow exchanges, by the size of the messages: halos of one field, and a
//! field that turns, so that lines across the planes are whole. Each rank has a slab of n x n x n/4 cells.
//!
//! `cargo build --release -p wakescope-sim --features mpi --example exchange_times`, then
//! `mpirun -n 2 --bind-to none target/release/examples/exchange_times`

#![allow(clippy::print_stdout)]

use std::error::Error;
use std::time::Instant;
use wakescope_les::ranks::Ranks;
use wakescope_sim::processes::World;

/// Planes of a halo.
const HALO: usize = 4;
const REPETITIONS: usize = 21;

fn main() -> Result<(), Box<dyn Error>> {
    let world = World::join()?;
    let ranks = &*world.ranks();
    let (rank, count) = (ranks.rank(), ranks.count());
    if rank == 0 {
        println!("exchange,ranks,cells_of_a_rank,bytes_that_leave_a_rank,median_s");
    }
    for n in [32, 64, 128, 256] {
        let (plane, slab) = (n * n, n * n * n / 4);
        let mut halos = vec![0; count];
        for neighbour in [(rank + 1) % count, (rank + count - 1) % count] {
            halos[neighbour] += HALO * plane;
        }
        for (exchange, lengths) in [("halos", halos), ("turn", vec![slab / count; count])] {
            let bytes = 8 * (lengths.iter().sum::<usize>() - lengths[rank]);
            let median_s = median_s(ranks, &lengths)?;
            if rank == 0 {
                println!("{exchange},{count},{slab},{bytes},{median_s:.3e}");
            }
        }
    }
    Ok(())
}

/// Median time of an exchange in which each rank gets from another what it sends there \[s\].
fn median_s(ranks: &dyn Ranks, lengths: &[usize]) -> Result<f64, Box<dyn Error>> {
    let send = vec![1.0; lengths.iter().sum()];
    let mut receive = vec![0.0; send.len()];
    let mut once = || {
        let begun = Instant::now();
        ranks
            .all_to_all(&send, lengths, &mut receive, lengths)
            .map(|()| begun.elapsed().as_secs_f64())
    };
    let mut times = (0..REPETITIONS)
        .map(|_| once())
        .collect::<Result<Vec<f64>, _>>()?;
    times.sort_by(f64::total_cmp);
    Ok(times[REPETITIONS / 2])
}
