//! Vortices of Taylor and Green in a plane: the simulated velocity against the exact one as they decay.
#![allow(clippy::print_stdout)]
use wakescope_les::cases::{taylor_green_plane, taylor_green_plane_exact};

fn main() -> Result<(), wakescope_les::Error> {
    let viscosity_m2_s = 0.01;
    let case = taylor_green_plane(64, [0.0; 2], viscosity_m2_s, 0.002)?;
    let (mut flow, _) = case.start()?;
    while flow.time_s() < 0.5 {
        flow.step_towards(0.5)?;
    }
    let (y_m, z_m) = (flow.mesh().face_m(1), flow.mesh().centre_m(2));
    let exact = |p: usize| taylor_green_plane_exact([0.0, y_m[p % 64], z_m[p / 64]], flow.time_s(), viscosity_m2_s)[1];
    let v_m_s = flow.face_velocity_m_s(1);
    let error_m_s = v_m_s.iter().enumerate().map(|(p, v)| (v - exact(p)).abs()).fold(0.0, f64::max);
    println!("{} steps to {} s: largest error {error_m_s:.1e} m/s", flow.steps(), flow.time_s());
    Ok(())
}
