//! Error against run time of the flow solver: grid, time step, scheme, tolerance of the pressure solve, pressure solver.

use super::{Row, few};
use crate::cost::fastest;
use fixtures::failure::Failure;
use wakescope_les::cases::{self, Case, TollmienSchlichting};
use wakescope_les::solver::PressureMethod;
use wakescope_les::{Flow, TimeScheme, TimeStep};

/// All measurements; few and coarse ones if `quick`.
pub(super) fn rows(quick: bool) -> Result<Vec<Row>, Failure> {
    let mut rows = vortices(quick)?;
    rows.extend(tolerances(quick)?);
    if !quick {
        rows.extend(waves()?);
        rows.extend(dipole()?);
    }
    Ok(rows)
}

const SCHEMES: [(&str, TimeScheme); 2] =
    [("Adams-Bashforth 2", TimeScheme::AdamsBashforth2), ("Runge-Kutta 3", TimeScheme::RungeKutta3)];

const VISCOSITY_M2_S: f64 = 0.01;
const REFUSED: &str = "FAILED: the step is beyond the limit of the scheme";
const END_S: f64 = 0.25;

/// Largest error of the plane vortices after a quarter of a second.
fn vortex_error(case: &Case, steps: usize) -> Result<f64, Failure> {
    let (mut flow, _) = case.start()?;
    for _ in 0..steps {
        flow.step()?;
    }
    let n = flow.mesh().cells()[1];
    let (y_m, z_m) = (flow.mesh().face_m(1), flow.mesh().centre_m(2));
    let exact =
        |i: usize| cases::taylor_green_plane_exact([0.0, y_m[i % n], z_m[i / n]], flow.time_s(), VISCOSITY_M2_S)[1];
    Ok(flow.face_velocity_m_s(1).iter().enumerate().map(|(i, v)| (v - exact(i)).abs()).fold(0.0, f64::max))
}

fn vortices(quick: bool) -> Result<Vec<Row>, Failure> {
    let mut rows = Vec::new();
    let words = ["largest velocity error over the largest velocity", "exact solution"];
    for (name, scheme) in SCHEMES {
        for &cells in few(&[32, 64, 128, 192], quick) {
            let steps = 5 * cells / 8;
            let mut case = cases::taylor_green_plane(cells, [0.5, -0.4], VISCOSITY_M2_S, END_S / steps as f64)?;
            case.settings.scheme = scheme;
            let (error, cost) = fastest(|| vortex_error(&case, steps))?;
            rows.push(Row::new("plane vortices, grid", name, ("cells", cells as f64), (error, 0.0), words, cost));
        }
        for &steps in few(&[16, 32, 64, 128], quick) {
            let mut case = cases::taylor_green_plane(64, [0.5, -0.4], VISCOSITY_M2_S, END_S / steps as f64)?;
            case.settings.scheme = scheme;
            // A step beyond the limit of the scheme is refused, which is a result.
            let (error, cost) = fastest(|| Ok(vortex_error(&case, steps).unwrap_or(f64::NAN)))?;
            let words = if error.is_nan() { [REFUSED, words[1]] } else { words };
            rows.push(Row::new("plane vortices, step", name, ("steps", steps as f64), (error, 0.0), words, cost));
        }
    }
    Ok(rows)
}

/// What an unfinished pressure solve costs and saves: divergence left against time.
fn tolerances(quick: bool) -> Result<Vec<Row>, Failure> {
    let mut rows = Vec::new();
    let words = ["divergence over the largest velocity per cell", "none: what the solve leaves"];
    let methods = [("direct", PressureMethod::Direct), ("multigrid", PressureMethod::Multigrid)];
    for (name, method) in methods {
        for &tolerance in few(&[1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12], quick) {
            let mut case = cases::taylor_green_3d(32, 1600.0)?;
            case.settings.pressure = method;
            case.settings.pressure_tolerance = tolerance;
            let (divergence, cost) = fastest(|| {
                let (mut flow, _) = case.start()?;
                for _ in 0..10 {
                    flow.step()?;
                }
                Ok(flow.relative_divergence())
            })?;
            rows.push(Row::new("pressure", name, ("tolerance", tolerance), (divergence, 0.0), words, cost));
        }
    }
    Ok(rows)
}

/// Growth rate of a Tollmien-Schlichting wave against linear theory.
fn waves() -> Result<Vec<Row>, Failure> {
    let mode = TollmienSchlichting::new(7500.0, 1.0)?;
    let expected = mode.omega.im;
    let span_s = 10.0;
    let mut rows = Vec::new();
    let words = ["growth rate, relative", "linear theory"];
    for (name, scheme, factor) in [(SCHEMES[0].0, SCHEMES[0].1, 1.0), (SCHEMES[1].0, SCHEMES[1].1, 4.0)] {
        for cells in [[32, 48], [32, 64], [64, 96]] {
            let step_s = factor * 0.64 / cells[0] as f64;
            let mut case = mode.clone().case(cells, 1.8, 1e-4, step_s)?;
            case.settings.scheme = scheme;
            let (rate, cost) = fastest(|| {
                let (mut flow, _) = case.start()?;
                let start = run_until(&mut flow, 5.0)?;
                let end = run_until(&mut flow, 5.0 + span_s)?;
                Ok(0.5 * (end / start).ln() / span_s)
            })?;
            let error = (rate / expected - 1.0).abs();
            let knob = ("cells across", cells[1] as f64);
            rows.push(Row::new("waves on Poiseuille flow", name, knob, (error, 0.0), words, cost));
        }
    }
    Ok(rows)
}

/// Advances and returns the energy of the velocity across the plates, which is that of the wave.
fn run_until(flow: &mut Flow, end_s: f64) -> Result<f64, Failure> {
    while flow.time_s() < end_s - 1e-9 {
        flow.step_towards(end_s)?;
    }
    let nx = flow.mesh().cells()[0];
    let face_m = flow.mesh().face_m(2);
    let w = flow.face_velocity_m_s(2);
    let width = |k: usize| if k == 0 { 0.0 } else { face_m[k + 1] - face_m[k - 1] };
    Ok(w.chunks(nx).enumerate().map(|(k, row)| width(k) * row.iter().map(|w| w * w).sum::<f64>()).sum())
}

/// First maximum of the enstrophy of a dipole at Re 625 against the literature.
fn dipole() -> Result<Vec<Row>, Failure> {
    const LITERATURE: f64 = 933.6;
    let mut rows = Vec::new();
    let words = ["first maximum of the enstrophy, relative", "Clercx and Bruneau 2006"];
    for cells in [64, 96, 128] {
        for (name, scheme) in SCHEMES {
            let mut case = cases::dipole_in_a_box([cells, cells], [1.5; 2], 625.0)?;
            case.settings.scheme = scheme;
            case.settings.time_step = TimeStep::Courant { courant: scheme.default_courant(), longest_s: 1e-2 };
            let (largest, cost) = fastest(|| {
                let (mut flow, _) = case.start()?;
                let mut largest = 0.0_f64;
                while flow.time_s() < 0.4 {
                    let report = flow.step()?;
                    if report.time_s > 0.2 {
                        largest = largest.max(-0.5 * 625.0 * report.viscous_power_m5_s3);
                    }
                }
                Ok(largest)
            })?;
            let error = (largest / LITERATURE - 1.0).abs();
            rows.push(Row::new("dipole against a wall", name, ("cells", cells as f64), (error, 0.0), words, cost));
        }
    }
    Ok(rows)
}
