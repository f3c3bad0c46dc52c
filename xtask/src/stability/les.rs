//! Extreme cases of the winds and of the flow solver (section 5 of its numerics).

use super::extreme::Extreme;
use crate::failure::Failure;
use std::f64::consts::TAU;
use wakescope_les::solver::{PressureMethod, ViscousTreatment};
use wakescope_les::winds::{Edges, OutsidePolicy, PlaneMesh, Side};
use wakescope_les::{
    CirculationProfile, Direction, Flow, FlowSettings, GridSnapshot, Ground, Mapping, Mesh, Motion, SubgridModel,
    TimeScheme, TimeStep, VortexPair, Wall, Wind, cases,
};

type Number = Result<f64, Failure>;

const DIVERGENCE: &str = "largest divergence over velocity per cell, after three steps";
const FACTOR: &str = "residual of the pressure left by an iteration, worst";

/// One case a row.
#[rustfmt::skip]
pub(super) fn cases() -> Vec<Extreme> {
    use Extreme as E;
    vec![
        E::at_most("flat cells, direct", "cells of aspect 1e4", DIVERGENCE, 1e-10, || divergence(Shape::Flat, PressureMethod::Direct)),
        E::at_most("flat cells, multigrid", "cells of aspect 1e4", DIVERGENCE, 1e-10, || divergence(Shape::Flat, PressureMethod::Multigrid)),
        E::at_most("flat cells, iteration", "cells of aspect 1e4", FACTOR, 0.1, || factor(Shape::Flat)),
        E::at_most("stretched both ways, direct", "sinh 5 x tanh 5, aspect 1e4", DIVERGENCE, 1e-10, || divergence(Shape::Stretched, PressureMethod::Direct)),
        E::at_most("stretched both ways, multigrid", "sinh 5 x tanh 5, aspect 1e4", DIVERGENCE, 1e-10, || divergence(Shape::Stretched, PressureMethod::Multigrid)),
        E::at_most("stretched both ways, iteration", "sinh 5 x tanh 5, aspect 1e4", FACTOR, 0.1, || factor(Shape::Stretched)),
        E::at_most("long domain", "1e5 times longer than high", DIVERGENCE, 1e-10, || divergence(Shape::Long, PressureMethod::Auto)),
        E::at_most("prime cells", "37 x 31 x 53 cells", DIVERGENCE, 1e-10, || divergence(Shape::Prime, PressureMethod::Auto)),
        E::at_most("coarsening ends early, iteration", "13 x 1018 cells", FACTOR, 0.15, || factor(Shape::Awkward)),
        E::at_most("flat domain", "1 : 1 : 1e-3, 5 x 8 x 12 cells", DIVERGENCE, 1e-9, || divergence(Shape::Slab, PressureMethod::Auto)),
        E::at_most("one cell in all", "1 x 1 x 1 cells", DIVERGENCE, 1e-9, || divergence(Shape::Cell, PressureMethod::Auto)),
        E::at_most("loose tolerance", "pressure_tolerance 1e-2", DIVERGENCE, 1e-2, || tolerance(1e-2)),
        E::at_most("tight tolerance", "pressure_tolerance 1e-13", DIVERGENCE, 1e-12, || tolerance(1e-13)),
        E::refused("impossible tolerance", "pressure_tolerance 1e-16", "between 1e-15 and 0.1", || tolerance(1e-16)),
        E::at_most("a plane flow in space", "12 x 16 cells, one and eight along x", "velocities with other bits", 0.0, plane_and_deep),
        E::at_most("threads", "one thread against three", "velocities with other bits", 0.0, threads),
        E::at_most("restart", "after two of four steps", "velocities with other bits", 0.0, restart),
        E::at_most("nanometres", "lengths of 1e-9 m, speeds of 1e9 m/s", "velocity, relative to that in metres", 1e-12, || units(1e-9, 1e9)),
        E::at_most("gigametres", "lengths of 1e9 m, speeds of 1e-9 m/s", "velocity, relative to that in metres", 1e-12, || units(1e9, 1e-9)),
        E::between("Re 1e7, Adams-Bashforth", "Taylor and Green's vortices, 24 cells a side, 40 steps", "energy over that of the start", (0.999, 1.001), || high_reynolds(TimeScheme::AdamsBashforth2, SubgridModel::None)),
        E::between("Re 1e7, Runge-Kutta and model", "Taylor and Green's vortices, 24 cells a side, 40 steps", "energy over that of the start", (0.9, 1.0), || high_reynolds(TimeScheme::RungeKutta3, SubgridModel::MULTISCALE_WALE)),
        E::between("zero viscosity, Adams-Bashforth", "between slip walls, steps of 5 and 2.5 ms", "power of the step in the drift of the energy", (2.7, 3.3), || drift_order(TimeScheme::AdamsBashforth2)),
        E::between("zero viscosity, Runge-Kutta", "between slip walls, steps of 5 and 2.5 ms", "power of the step in the drift of the energy", (2.7, 3.3), || drift_order(TimeScheme::RungeKutta3)),
        E::refused("zero viscosity at a no-slip wall", "viscosity_m2_s = 0", "make it a slip wall", || start(sticky(16)?, 0.0, TimeStep::Fixed { step_s: 0.01 }, [0.0; 3])),
        E::at_most("stiff viscosity", "nu dt/h^2 = 1e4, a layer between plates", "largest speed above that of the start, m/s", 1e-9, stiff_layer),
        E::at_most("impulsive plate", "nu dt/h^2 = 1e4", "growth of the error in a step, relative, worst", 1e-9, impulsive_plate),
        E::at_most("impulsive plate, damped", "nu dt/h^2 up to 1e4, four steps of backward Euler", "error of the profile after 400 steps", 1e-4, damped_plate),
        E::at_most("impulsive start against walls", "a uniform wind in a closed box", "energy that the projection leaves, relative", 1e-19, blown_box),
        E::at_most("at rest", "no wind, no force", "energy", 0.0, at_rest),
        E::between("Courant number below the limit", "1.09, Runge-Kutta", "Courant number", (1.089, 1.091), || courant(TimeScheme::RungeKutta3, 1.09)),
        E::refused("Courant number beyond the limit, Adams-Bashforth", "0.6", "above 0.4", || courant(TimeScheme::AdamsBashforth2, 0.6)),
        E::refused("Courant number beyond the limit, Runge-Kutta", "1.2", "above 1.1", || courant(TimeScheme::RungeKutta3, 1.2)),
        E::refused("NaN in the first field", "u of one cell", "cell [0, 3, 5]", || one_bad_cell(f64::NAN)),
        E::refused("infinite speed", "u of one cell", "the initial velocity u is not finite", || one_bad_cell(f64::INFINITY)),
        E::refused("negative viscosity", "-1 m^2/s", "viscosity_m2_s = -1.0", || start(slippery(8)?, -1.0, TimeStep::Fixed { step_s: 0.01 }, [0.0; 3])),
        E::refused("a wall that blows", "0.1 m/s through a wall", "the fluid cannot flow through it", || Ok(across(Wall::NoSlip { velocity_m_s: [0.0, 0.0, 0.1] }, None)?.cells()[2] as f64)),
        E::refused("neighbouring cells too unequal", "tanh 6 on 16 cells", "differ by a factor", || Ok(across(Wall::Slip, Some(Mapping::TanhLow { strength: 6.0 }))?.cells()[2] as f64)),
        E::refused("a mesh that folds", "x = s - s^2 on 16 cells", "must not fold", || Ok(across(Wall::Slip, Some(folding()))?.cells()[2] as f64)),
        E::refused("two cells", "2 cells across", "at least 4", || start(Mesh::new(Direction::thin(1.0), Direction::thin(1.0), Direction::periodic(2, 0.0, 1.0))?, 1.0, TimeStep::Fixed { step_s: 0.01 }, [0.0; 3])),
        E::at_most("a pair without circulation", "0 m^2/s", "speed between the vortices", 0.0, || speed_between(0.0, 2.35)),
        E::between("a core of a micrometre", "1e-6 m, in its centre", "speed from the other vortex and the images, over Gamma/(2 pi b)", (0.9, 1.1), tiny_core),
        E::refused("NaN circulation", "circulation_m2_s = NaN", "circulation_m2_s", || speed_between(f64::NAN, 2.35)),
        E::refused("a core without width", "core_radius_m = 0", "core_radius_m", || speed_between(500.0, 0.0)),
        E::refused("a point beside the mesh", "1 m outside", "outside the mesh", || interpolated(1.0)),
        E::refused("NaN in a sampled wind", "one node", "velocity_m_s", || interpolated(f64::NAN)),
    ]
}

#[derive(Clone, Copy)]
enum Shape {
    Flat,
    Stretched,
    Long,
    Prime,
    Awkward,
    Slab,
    Cell,
}

fn slip(cells: usize, length_m: f64) -> Direction {
    Direction::between(cells, 0.0, length_m, Wall::Slip, Wall::Slip)
}

fn mesh_of(shape: Shape) -> Result<Mesh, Failure> {
    let thin = || Direction::thin(1.0);
    let unit = |n| Direction::periodic(n, 0.0, 1.0);
    let [x, y, z] = match shape {
        Shape::Flat => [Direction::periodic(8, 0.0, 2.0), slip(32, 1e4), slip(32, 1.0)],
        Shape::Stretched => {
            let tanh = Direction::between(64, 0.0, 3.0, Wall::AT_REST, Wall::Slip);
            let fine = slip(64, 6.0).stretched(Mapping::SinhMiddle { strength: 5.0 });
            [Direction::periodic(8, 0.0, 2.0), fine, tanh.stretched(Mapping::TanhLow { strength: 5.0 })]
        }
        Shape::Long => [thin(), slip(64, 1e5), Direction::between(48, 0.0, 1.0, Wall::AT_REST, Wall::AT_REST)],
        Shape::Prime => [unit(37), unit(31), slip(53, 1.0)],
        Shape::Awkward => [thin(), slip(13, 1.0), slip(1018, 78.0)],
        Shape::Slab => [unit(5), unit(8), Direction::between(12, 0.0, 1e-3, Wall::AT_REST, Wall::Slip)],
        Shape::Cell => [thin(), thin(), thin()],
    };
    Ok(Mesh::new(x, y, z)?)
}

/// A flow of eddies as long and as high as the mesh.
fn eddies(shape: Shape, pressure: PressureMethod, pressure_tolerance: f64) -> Result<Flow, Failure> {
    let mesh = mesh_of(shape)?;
    let [length_m, height_m] = [1, 2].map(|axis| mesh.directions()[axis].length_m());
    let field = move |[x, y, z]: [f64; 3]| {
        let (s, c) = (TAU * y / length_m + 0.3).sin_cos();
        let (sz, cz) = (TAU * z / height_m + 0.5).sin_cos();
        [0.2 * s * cz, c * sz + 0.3 * (5.0 * s).cos() * cz, s * cz + 0.1 * (TAU * x).sin()]
    };
    let time_step = TimeStep::Courant { courant: 0.3, longest_s: 1e-3 };
    let settings = FlowSettings { pressure, pressure_tolerance, ..FlowSettings::new(1e-4, time_step) };
    Ok(Flow::new(mesh, settings, field)?.0)
}

fn divergence(shape: Shape, pressure: PressureMethod) -> Number {
    Ok(advanced(eddies(shape, pressure, 1e-10)?, 3)?.relative_divergence())
}

fn tolerance(tolerance: f64) -> Number {
    Ok(advanced(eddies(Shape::Stretched, PressureMethod::Multigrid, tolerance)?, 3)?.relative_divergence())
}

fn factor(shape: Shape) -> Number {
    let mut flow = eddies(shape, PressureMethod::Multigrid, 1e-10)?;
    let mut worst = f64::NAN;
    for _ in 0..3 {
        worst = worst.max(flow.step()?.pressure_factor.unwrap_or(f64::NAN));
    }
    Ok(worst)
}

fn advanced(mut flow: Flow, steps: usize) -> Result<Flow, Failure> {
    for _ in 0..steps {
        flow.step()?;
    }
    Ok(flow)
}

fn velocities(flow: &Flow) -> Vec<f64> {
    (0..3).flat_map(|d| flow.face_velocity_m_s(d)).collect()
}

/// Numbers that differ in a bit; what is missing differs.
fn other_bits(a: &[f64], b: &[f64]) -> f64 {
    let differ = a.iter().zip(b).filter(|(a, b)| a.to_bits() != b.to_bits()).count();
    (differ + a.len().abs_diff(b.len())) as f64
}

fn plane_and_deep() -> Number {
    let run = |x: Direction| -> Result<Flow, Failure> {
        let z = Direction::between(16, 0.0, 1.0, Wall::AT_REST, Wall::AT_REST);
        let y = Direction::periodic(12, 0.0, 1.0).stretched(Mapping::Sine { amplitude: 0.2 });
        let mesh = Mesh::new(x, y, z.stretched(Mapping::TanhBoth { strength: 1.0 }))?;
        let settings =
            FlowSettings { memory_order: Some([0, 1, 2]), ..FlowSettings::new(1e-3, TimeStep::Fixed { step_s: 0.01 }) };
        let field = |[_, y, z]: [f64; 3]| [z * (TAU * y).cos(), (TAU * z).sin(), 0.3 * (TAU * y).sin()];
        advanced(Flow::new(mesh, settings, field)?.0, 4)
    };
    let plane: Vec<f64> =
        velocities(&run(Direction::thin(0.7))?).iter().flat_map(|u| std::iter::repeat_n(*u, 8)).collect();
    Ok(other_bits(&plane, &velocities(&run(Direction::periodic(8, 0.0, 0.7))?)))
}

/// A flow without symmetries between a no-slip and a slip wall, lengths and speeds in those units.
fn layered(length: f64, speed: f64) -> Result<Flow, Failure> {
    let y = Direction::periodic(8, -0.5 * length, 0.5 * length).stretched(Mapping::Sine { amplitude: 0.2 });
    let z = Direction::between(13, 0.0, length, Wall::AT_REST, Wall::Slip);
    let mesh = Mesh::new(Direction::periodic(6, 0.0, length), y, z.stretched(Mapping::TanhLow { strength: 1.0 }))?;
    let settings = FlowSettings {
        force_m_s2: [0.1 * speed * speed / length, 0.0, 0.0],
        subgrid: SubgridModel::MULTISCALE_WALE,
        viscous: ViscousTreatment::Implicit([true; 3]),
        ..FlowSettings::new(2e-3 * length * speed, TimeStep::Fixed { step_s: 0.01 * length / speed })
    };
    let wave = |a: f64| (TAU * a).sin();
    let field = move |at_m: [f64; 3]| {
        let [x, y, z] = at_m.map(|a| a / length);
        [wave(y + 0.1) * z, wave(x + 2.0 * y) * z + 0.2, 0.3 * wave(x - y) * z].map(|v| speed * v)
    };
    Ok(Flow::new(mesh, settings, field)?.0)
}

fn units(length: f64, speed: f64) -> Number {
    let (plain, scaled) = (velocities(&advanced(layered(1.0, 1.0)?, 5)?), advanced(layered(length, speed)?, 5)?);
    Ok(plain.iter().zip(velocities(&scaled)).map(|(a, b)| (a - b / speed).abs()).fold(0.0, f64::max))
}

fn threads() -> Number {
    let run = |threads: usize| -> Result<Vec<f64>, Failure> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
        pool.install(|| Ok(velocities(&advanced(layered(1.0, 1.0)?, 4)?)))
    };
    Ok(other_bits(&run(1)?, &run(3)?))
}

fn restart() -> Number {
    let path = std::env::temp_dir().join(format!("wakescope-stability-{}.checkpoint", std::process::id()));
    let half = advanced(layered(1.0, 1.0)?, 2)?;
    half.save(&path, &[])?;
    let restored = Flow::restore(&path, half.mesh().clone(), half.settings().clone());
    std::fs::remove_file(&path)?;
    let (whole, continued) = (advanced(half, 2)?, advanced(restored?.0, 2)?);
    Ok(other_bits(&velocities(&whole), &velocities(&continued)))
}

fn high_reynolds(scheme: TimeScheme, subgrid: SubgridModel) -> Number {
    let mut case = cases::taylor_green_3d(24, 1e7)?;
    (case.settings.scheme, case.settings.subgrid) = (scheme, subgrid);
    let (flow, report) = case.start()?;
    Ok(advanced(flow, 40)?.kinetic_energy_m5_s2() / report.kinetic_energy_m5_s2)
}

fn drift_order(scheme: TimeScheme) -> Number {
    let drift = |step_s: f64| -> Number {
        let mesh = Mesh::new(Direction::thin(1.0), Direction::periodic(12, 0.0, 1.0), slip(12, 0.5))?;
        let field = |[_, y, z]: [f64; 3]| {
            let stream = |a: f64, b: f64| ((TAU * a * y).sin(), (TAU * a * y).cos(), TAU * b * z);
            let ((s1, c1, z1), (s2, c2, z2)) = (stream(1.0, 1.0), stream(2.0, 2.0));
            [0.0, s1 * z1.cos() + c2 * z2.cos() + 0.3 * z1.cos(), -c1 * z1.sin() + s2 * z2.sin()]
        };
        let settings = FlowSettings { scheme, ..FlowSettings::new(0.0, TimeStep::Fixed { step_s }) };
        let (flow, report) = Flow::new(mesh, settings, field)?;
        let flow = advanced(flow, (0.5 / step_s).round() as usize)?;
        Ok((flow.kinetic_energy_m5_s2() / report.kinetic_energy_m5_s2 - 1.0).abs())
    };
    Ok((drift(0.005)? / drift(0.0025)?).log2())
}

fn slippery(cells: usize) -> Result<Mesh, Failure> {
    let wide = || Direction::periodic(cells, 0.0, 1.0);
    Ok(Mesh::new(wide(), wide(), wide())?)
}

fn sticky(cells: usize) -> Result<Mesh, Failure> {
    let wall = || Direction::between(cells, 0.0, 1.0, Wall::AT_REST, Wall::AT_REST);
    Ok(Mesh::new(Direction::thin(1.0), wall(), wall())?)
}

/// One step from a uniform wind; the number is the energy that the start left, over that given.
fn start(mesh: Mesh, viscosity_m2_s: f64, time_step: TimeStep, wind_m_s: [f64; 3]) -> Number {
    let (mut flow, report) = Flow::new(mesh, FlowSettings::new(viscosity_m2_s, time_step), move |_| wind_m_s)?;
    flow.step()?;
    Ok(report.kinetic_energy_m5_s2 / report.given_energy_m5_s2)
}

fn blown_box() -> Number {
    start(sticky(16)?, 1e-2, TimeStep::Courant { courant: 0.3, longest_s: 0.01 }, [0.0, 1.0, 0.5])
}

fn at_rest() -> Number {
    let settings = FlowSettings::new(1e-3, TimeStep::Courant { courant: 0.3, longest_s: 0.1 });
    Ok(advanced(Flow::new(sticky(16)?, settings, |_| [0.0; 3])?.0, 3)?.kinetic_energy_m5_s2())
}

/// Sixteen cells and plates whose viscosity makes nu dt/h^2 1e4.
fn stiff_plates() -> cases::Plates {
    let (cells, step_s) = (16, 0.01);
    cases::Plates { cells, strength: 1.0, viscosity_m2_s: 1e4 * (2.0 / cells as f64).powi(2) / step_s, step_s }
}

fn stiff_layer() -> Number {
    let flow = advanced(stiff_plates().decaying_layer()?.start()?.0, 50)?;
    Ok(flow.face_velocity_m_s(0).iter().fold(0.0, |most: f64, u| most.max(u.abs() - 1.0)))
}

/// Largest distance of the wind along x from the line that a moving and a resting plate leave in the end.
fn from_couette(flow: &Flow) -> f64 {
    let [nx, ny, _] = flow.mesh().cells();
    let z_m = flow.mesh().centre_m(2);
    let of = |(i, u): (usize, &f64)| (u - 0.5 * (1.0 - z_m[i / (nx * ny)])).abs();
    flow.face_velocity_m_s(0).iter().enumerate().map(of).fold(0.0, f64::max)
}

fn impulsive_plate() -> Number {
    let mut flow = stiff_plates().rayleigh_plate()?.start()?.0;
    let (mut last, mut worst) = (f64::INFINITY, 0.0_f64);
    for _ in 0..60 {
        flow.step()?;
        let error = from_couette(&flow);
        (worst, last) = (worst.max(error / last - 1.0), error);
    }
    Ok(worst)
}

fn damped_plate() -> Number {
    let plates = cases::Plates { cells: 64, strength: 2.5, viscosity_m2_s: 1.0, step_s: 0.01 };
    let mut case = plates.rayleigh_plate()?;
    case.settings.damped_steps = 4;
    Ok(from_couette(&advanced(case.start()?.0, 400)?))
}

fn courant(scheme: TimeScheme, courant: f64) -> Number {
    let settings = FlowSettings { scheme, ..FlowSettings::new(1e-3, TimeStep::Fixed { step_s: courant / 8.0 }) };
    Ok(Flow::new(slippery(8)?, settings, |_| [0.0, 0.0, 1.0])?.0.step()?.courant)
}

fn one_bad_cell(value: f64) -> Number {
    let wide = || Direction::periodic(8, 0.0, 1.0);
    let mesh = Mesh::new(Direction::thin(1.0), wide(), wide())?;
    let inside = |y: f64, z: f64| y > 0.35 && y < 0.45 && z > 0.6 && z < 0.7;
    let field = move |[_, y, z]: [f64; 3]| [if inside(y, z) { value } else { 0.0 }, 0.0, 0.0];
    Ok(Flow::new(mesh, FlowSettings::new(1e-3, TimeStep::Fixed { step_s: 0.01 }), field)?.0.kinetic_energy_m5_s2())
}

/// A column of 16 cells over that wall.
fn across(low: Wall, mapping: Option<Mapping>) -> Result<Mesh, Failure> {
    let column = Direction::between(16, 0.0, 1.0, low, Wall::Slip);
    let column = match mapping {
        Some(mapping) => column.stretched(mapping),
        None => column,
    };
    Ok(Mesh::new(Direction::thin(1.0), Direction::thin(1.0), column)?)
}

fn folding() -> Mapping {
    Mapping::Custom(std::sync::Arc::new(|s: f64| (s - s * s, 1.0 - 2.0 * s)))
}

fn pair(circulation_m2_s: f64, core_radius_m: f64) -> VortexPair {
    VortexPair {
        circulation_m2_s,
        spacing_m: 47.0,
        core_radius_m,
        lateral_position_m: 400.0,
        height_m: 200.0,
        ground: Ground::Image,
        profile: CirculationProfile::Algebraic,
        motion: Motion::Frozen,
    }
}

fn speed(pair: VortexPair, at_m: [f64; 3]) -> Number {
    let mut out = [[0.0; 3]];
    pair.wind()?.velocity_into(&[at_m], 0.0, &mut out)?;
    Ok(out[0].iter().map(|u| u * u).sum::<f64>().sqrt())
}

fn speed_between(circulation_m2_s: f64, core_radius_m: f64) -> Number {
    speed(pair(circulation_m2_s, core_radius_m), [0.0, 400.0, 200.0])
}

fn tiny_core() -> Number {
    Ok(speed(pair(500.0, 1e-6), [0.0, 376.5, 200.0])? / (500.0 / (TAU * 47.0)))
}

/// A wind on 8 x 8 nodes of which one is `value`, 1 m beside the mesh.
fn interpolated(value: f64) -> Number {
    let axis: Vec<f64> = (0..8).map(|i| 10.0 * f64::from(i)).collect();
    let open = Edges::Bounded { low: Side::Open, high: Side::Open };
    let mesh = PlaneMesh { y_m: axis.clone(), z_m: axis, y_edges: open, z_edges: open, outside: OutsidePolicy::Error };
    let mut wind_m_s = vec![[0.0, 1.0, 0.0]; 64];
    wind_m_s[9][1] = value;
    let mut out = [[0.0; 3]];
    GridSnapshot::new(&mesh, &wind_m_s)?.velocity_into(&[[0.0, 71.0, 20.0]], 0.0, &mut out)?;
    Ok(out[0][1])
}
