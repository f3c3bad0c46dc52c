//! Efficiency of the chapter's lidar: free space, exact bistatic theory, and Monte
//! Carlo side by side.
//!
//! `cargo run --release --example efficiency -- [cn2_m_m23] [realisations] [seed]`

#![allow(clippy::print_stdout)]

use std::time::Instant;
use wakescope_optics::air::StructureTable;
use wakescope_optics::{MonteCarlo, theory};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let cn2_m_m23: f64 = arguments.next().map_or(Ok(1e-13), |a| a.parse())?;
    let realisations: usize = arguments.next().map_or(Ok(400), |a| a.parse())?;
    let seed: u64 = arguments.next().map_or(Ok(1), |a| a.parse())?;

    let run = MonteCarlo::table2(cn2_m_m23, seed)?;
    let start = Instant::now();
    let estimate = run.run(realisations)?;
    let seconds = start.elapsed().as_secs_f64();

    let table = StructureTable::new(&*run.turbulence.spectrum);
    println!(
        "Cn2 = {cn2_m_m23:e} m^(-2/3), {} realisations, {seconds:.1} s",
        estimate.realisations
    );
    println!(
        "  R/m  free     grid/exact-1 monostatic          bistatic            exact    z     lost"
    );
    for (i, &range_m) in run.range_m.iter().enumerate() {
        let screens = run
            .layers
            .split_at(&run.range_m)
            .screens_to(range_m, &run.turbulence.cn2)?;
        let exact = theory::bistatic_efficiency_screens(
            &run.telescope,
            &run.misalignment,
            &screens,
            &table,
            range_m,
        )?;
        let mono = &estimate.monostatic;
        let (bi, bi_error) = estimate
            .bistatic
            .as_ref()
            .map_or((f64::NAN, f64::NAN), |b| (b.mean[i], b.standard_error[i]));
        println!(
            "{range_m:6.0} {:.6} {:+.2e}  {:.6} +- {:.6} {bi:.6} +- {bi_error:.6} {exact:.6} {:+.2} {:.4}",
            estimate.exact_free_space[i],
            estimate.grid_free_space[i] / estimate.exact_free_space[i] - 1.0,
            mono.mean[i],
            mono.standard_error[i],
            (bi - exact) / bi_error,
            estimate.lost_power_fraction[i],
        );
    }
    Ok(())
}
