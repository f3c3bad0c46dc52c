//! Vortices of Taylor and Green in a plane: the simulated velocity against the exact one as they decay.
#![allow(clippy::print_stdout)]
use wakescope_les::cases::{taylor_green_plane, taylor_green_plane_exact};

fn main() -> Result<(), wakescope_les::Error> {
    let (mut flow, _) = taylor_green_plane(64, [0.0; 2], 0.01, 0.002)?.start()?;
    flow.run_to(0.5)?;
    let error_m_s =
        flow.largest_error_m_s(|at_m, time_s| taylor_green_plane_exact(at_m, time_s, 0.01));
    println!(
        "{} steps to {} s: largest error {error_m_s:.1e} m/s",
        flow.steps(),
        flow.time_s()
    );
    Ok(())
}
