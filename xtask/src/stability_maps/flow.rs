//! What is stable of flows: time schemes, stiff viscosity, pressure solvers, energy.

use super::{Curve, Limit, NO_THEORY, Panel, logs, thinned};
use crate::profile::Profile;
use fixtures::failure::Failure;
use num_complex::Complex;
use std::f64::consts::{PI, TAU};
use wakescope_les::solver::{PressureMethod, StepReport};
use wakescope_les::{
    Direction, Flow, FlowSettings, Mesh, SubgridModel, TimeScheme, TimeStep, Wall, cases,
};
use wakescope_sim::plot::Axis;
use wakescope_tests::extreme::les::{energy_drift, energy_left};

const SCHEMES: [(&str, TimeScheme); 2] = [
    ("Adams-Bashforth 2", TimeScheme::AdamsBashforth2),
    ("Runge-Kutta 3", TimeScheme::RungeKutta3),
];

/// Cells of the periodic line.
const CELLS: usize = 48;

/// A line of equal cells along y, one metre long, with a stream of 1 m/s along it and a small wind across.
fn line(
    scheme: TimeScheme,
    viscosity_m2_s: f64,
    step_s: f64,
    across: impl Fn(f64) -> f64 + Sync,
) -> Result<Flow, Failure> {
    let mesh = Mesh::new(
        Direction::thin(1.0),
        Direction::periodic(CELLS, 0.0, 1.0),
        Direction::thin(1.0),
    )?;
    let settings = FlowSettings {
        scheme,
        ..FlowSettings::new(viscosity_m2_s, TimeStep::Fixed { step_s })
    };
    Ok(Flow::new(mesh, settings, |[_, y, _]| [1e-3 * across(y), 1.0, 0.0])?.0)
}

/// Amplitude of a wave of the wind across.
fn amplitude(flow: &Flow, wave: usize) -> f64 {
    let velocity_m_s = flow.face_velocity_m_s(0);
    let terms = velocity_m_s.iter().enumerate().map(|(j, u)| {
        let phase = -TAU * (wave * j) as f64 / CELLS as f64;
        u * Complex::cis(phase)
    });
    terms.sum::<Complex<f64>>().norm()
}

/// The wave number that convection sees of a wave that turns by `theta` from one cell to the next, times the length of a cell.
fn symbol(theta: f64) -> f64 {
    1.5 * theta.sin() - 0.3 * (2.0 * theta).sin() + (3.0 * theta).sin() / 30.0
}

/// Takes some steps.
fn advance(flow: &mut Flow, steps: usize) -> Result<(), Failure> {
    for _ in 0..steps {
        flow.step()?;
    }
    Ok(())
}

/// Growth of the amplitude in a step, of a wave that turns by `angle` in a step, against the larger root of the scheme.
pub(super) fn growth() -> Result<Vec<Panel>, Failure> {
    const WAVE: usize = 14;
    let symbol = symbol(TAU * WAVE as f64 / CELLS as f64);
    let curves = SCHEMES.map(|(name, scheme)| {
        let angles: &[f64] = match scheme {
            TimeScheme::AdamsBashforth2 => &[0.0733, 0.1, 0.1467, 0.2, 0.2933, 0.4, 0.5133, 0.5456],
            TimeScheme::RungeKutta3 => &[0.2, 0.2933, 0.4, 0.5133, 0.7, 1.0132, 1.3, 1.5753, 1.7],
        };
        Curve::new(name, angles, |angle| {
            let step_s = angle / symbol / CELLS as f64;
            let mut flow = line(scheme, 0.0, step_s, |y| (TAU * WAVE as f64 * y).sin())?;
            advance(&mut flow, 20)?;
            let before = amplitude(&flow, WAVE);
            advance(&mut flow, 40)?;
            let growth = (amplitude(&flow, WAVE) / before).powf(1.0 / 40.0);
            let expected = root(scheme, Complex::new(0.0, angle), 0.0);
            Ok([(growth - 1.0).abs(), (expected - 1.0).abs()])
        })
    });
    let axes = logs(["angle in a step [rad]", "||G| − 1|"]);
    Ok(vec![Panel::new(
        "growth of a wave in a step",
        axes,
        curves,
    )?])
}

/// The largest Courant number, to a thousandth, at which a step is not refused and no wave grows, against the root of the scheme. Waves of all lengths
/// start alike.
pub(super) fn limits(profile: Profile) -> Result<Vec<Panel>, Failure> {
    let curves = SCHEMES.map(|(name, scheme)| {
        let viscous = thinned(
            profile,
            &[1e-3, 3e-2, 3e-1],
            &[1e-3, 1e-2, 3e-2, 1e-1, 3e-1],
        );
        Curve::new(name, viscous, |viscous| {
            let mut low = 0.05;
            let mut high = 2.0;
            while high - low > 5e-4 * low {
                let middle = 0.5 * (low + high);
                if is_stable(scheme, viscous, middle)? {
                    low = middle
                } else {
                    high = middle
                }
            }
            Ok([low, limit(scheme, viscous)])
        })
    });
    Ok(vec![Panel::new(
        "largest stable Courant number",
        logs(["ν Δt/h²", "Courant number"]),
        curves,
    )?])
}

/// Whether no wave has grown from one span of steps to the next, with nu = viscous h^2/dt and dt = courant h.
fn is_stable(scheme: TimeScheme, viscous: f64, courant: f64) -> Result<bool, Failure> {
    let h = 1.0 / CELLS as f64;
    let step_s = courant / CELLS as f64;
    let mut flow = line(scheme, viscous * h * h / step_s, step_s, spike)?;
    let first = largest_amplitude(&mut flow);
    let last = largest_amplitude(&mut flow);
    Ok(matches!((first, last), (Some(first), Some(last)) if last <= first))
}

/// One cell: waves of all lengths start alike.
fn spike(y: f64) -> f64 {
    if (y * CELLS as f64).floor() == 7.0 {
        1.0
    } else {
        0.0
    }
}

/// The largest amplitude of all waves after some steps; none if a step is refused, which is an answer.
fn largest_amplitude(flow: &mut Flow) -> Option<f64> {
    advance(flow, 600).ok()?;
    let amplitudes = (1..=CELLS / 2).map(|wave| amplitude(flow, wave));
    Some(amplitudes.fold(0.0, f64::max))
}

/// Decay of the shortest wave in a step up to which the solver takes viscosity explicitly: a tenth of
/// the decay up to which the scheme itself is stable on the real axis.
fn explicit_up_to(scheme: TimeScheme) -> f64 {
    match scheme {
        TimeScheme::AdamsBashforth2 => 0.1,
        TimeScheme::RungeKutta3 => 0.25,
    }
}

/// The Courant number up to which every wave decays, with `viscous = nu dt/h^2` explicit where it is small and by Crank-Nicolson else.
fn limit(scheme: TimeScheme, viscous: f64) -> f64 {
    let mut low = 0.0;
    let mut high = 2.5;
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if (1..=180).all(|k| decays(scheme, viscous, middle, PI * f64::from(k) / 180.0)) {
            low = middle
        } else {
            high = middle
        }
    }
    low
}

/// Whether a wave that turns by `theta` from one cell to the next decays.
fn decays(scheme: TimeScheme, viscous: f64, courant: f64, theta: f64) -> bool {
    let kappa = 2.0 * (9.0 / 8.0 * (0.5 * theta).sin() - (1.5 * theta).sin() / 24.0);
    let decay = viscous * kappa * kappa;
    let [explicit, implicit] = if viscous * KAPPA2 > explicit_up_to(scheme) {
        [0.0, decay]
    } else {
        [decay, 0.0]
    };
    let rate = Complex::new(-explicit, courant * symbol(theta));
    root(scheme, rate, implicit) <= 1.0
}

/// Shares of a step that Wray's stages give the present rate and the one before.
const STAGES: [(f64, f64); 3] = [
    (8.0 / 15.0, 0.0),
    (5.0 / 12.0, -17.0 / 60.0),
    (3.0 / 4.0, -5.0 / 12.0),
];

/// Amplification of `du/dt = (z u - d u)/dt` in a step, the decay `d` by Crank-Nicolson, in each stage of Wray's Runge-Kutta.
fn root(scheme: TimeScheme, z: Complex<f64>, d: f64) -> f64 {
    match scheme {
        TimeScheme::AdamsBashforth2 => {
            let a = (1.0 - 0.5 * d) / (1.0 + 0.5 * d);
            let z = z / (1.0 + 0.5 * d);
            let b = a + 1.5 * z;
            let root = (b * b - 2.0 * z).sqrt();
            (0.5 * (b + root)).norm().max((0.5 * (b - root)).norm())
        }
        TimeScheme::RungeKutta3 => {
            let mut u = Complex::new(1.0, 0.0);
            let mut before = Complex::new(0.0, 0.0);
            for (now, last) in STAGES {
                let rate = z * u;
                let half = 0.5 * d * (now + last);
                u = (u * (1.0 - half) + now * rate + last * before) / (1.0 + half);
                before = rate;
            }
            u.norm()
        }
    }
}

/// Square of kappa h of a wave of two cells.
const KAPPA2: f64 = 49.0 / 9.0;

/// Cells along a direction of the flows that are stiff.
const STIFF_CELLS: usize = 16;

/// What the first step leaves of the shortest wave, stiff along one direction or two, by Crank-Nicolson.
pub(super) fn stiff() -> Result<Vec<Panel>, Failure> {
    let cases = [
        ("Crank-Nicolson, one direction", 1),
        ("Crank-Nicolson, two directions", 2),
    ];
    let curves = cases.map(|(name, directions)| {
        Curve::new(name, &[1e1, 1e2, 1e3, 1e4, 1e5, 1e6], |viscous| {
            let mut flow = stiff_flow(directions, viscous)?;
            flow.step()?;
            let left = flow.face_velocity_m_s(0)[0].abs();
            Ok([left, left_by_theory(directions, viscous)])
        })
    });
    let axes = logs(["ν Δt/h²", "share of the wave"]);
    let panel = Panel::new("what the first step leaves of a stiff wave", axes, curves)?;
    Ok(vec![Panel {
        least: 1e-12,
        ..panel
    }])
}

/// The shortest wave along one direction, y, or along two, y and z.
fn stiff_flow(directions: u32, viscous: f64) -> Result<Flow, Failure> {
    let across = if directions == 1 {
        Direction::thin(1.0)
    } else {
        Direction::periodic(STIFF_CELLS, 0.0, 1.0)
    };
    let along = Direction::periodic(STIFF_CELLS, 0.0, 1.0);
    let mesh = Mesh::new(Direction::thin(1.0), along, across)?;
    let step_s = 1e-3;
    let viscosity_m2_s = viscous / (STIFF_CELLS * STIFF_CELLS) as f64 / step_s;
    let settings = FlowSettings::new(viscosity_m2_s, TimeStep::Fixed { step_s });
    let (flow, _) = Flow::new(mesh, settings, |[_, y, z]| {
        let wave_across = if directions == 1 {
            1.0
        } else {
            shortest_wave(z)
        };
        [shortest_wave(y) * wave_across, 0.0, 0.0]
    })?;
    Ok(flow)
}

/// A wave of two cells.
fn shortest_wave(position: f64) -> f64 {
    let cell = (position * STIFF_CELLS as f64) as usize;
    if cell.is_multiple_of(2) { 1.0 } else { -1.0 }
}

/// What Crank and Nicolson's factors leave of it. The first step of either scheme is one of Runge-Kutta.
fn left_by_theory(directions: u32, viscous: f64) -> f64 {
    let directions = f64::from(directions);
    let mut left = 1.0;
    for (now, last) in STAGES {
        let d = (now + last) * (viscous * KAPPA2);
        left *= (1.0 - directions * d / (1.0 + 0.5 * d).powf(directions)).abs();
    }
    left
}

/// The residual that an iteration of multigrid leaves, and what the direct solver leaves, on cells longer along y, or along x and y.
pub(super) fn pressure(profile: Profile) -> Result<Vec<Panel>, Failure> {
    let multigrid = PressureMethod::Multigrid;
    let direct = PressureMethod::Direct;
    let cases = [
        ("multigrid, cells long along y", multigrid, 1),
        ("multigrid, cells long along x and y", multigrid, 2),
        ("direct, what it leaves, long along y", direct, 1),
        ("direct, what it leaves, long along x and y", direct, 2),
    ];
    let curves = cases.map(|(name, pressure, directions)| {
        let aspects = thinned(profile, &[1.0, 1e5], &[1.0, 1e1, 1e2, 1e3, 1e4, 1e5]);
        Curve::new(name, aspects, |aspect| {
            let residual = worst_residual(pressure, directions, aspect)?;
            Ok([residual, NO_THEORY])
        })
    });
    let axes = logs(["aspect of the cells", "residual left"]);
    let panel = Panel::new("pressure solvers on flat cells", axes, curves)?;
    Ok(vec![Panel {
        limit: Some(Limit::Level("at most 0.10 an iteration", 0.1)),
        ..panel
    }])
}

/// The largest residual in three steps of eddies, of the direct solver; of multigrid the largest factor of an iteration.
fn worst_residual(pressure: PressureMethod, directions: u32, aspect: f64) -> Result<f64, Failure> {
    let length_m = if directions == 1 { 1.0 } else { aspect };
    let mesh = Mesh::new(
        Direction::periodic(8, 0.0, length_m / 6.0),
        Direction::between(48, 0.0, aspect, Wall::Slip, Wall::Slip),
        Direction::between(48, 0.0, 1.0, Wall::Slip, Wall::Slip),
    )?;
    let time_step = TimeStep::Courant {
        courant: 0.3,
        longest_s: 1e-3,
    };
    let settings = FlowSettings {
        pressure,
        pressure_tolerance: 1e-10,
        ..FlowSettings::new(1e-4, time_step)
    };
    let (mut flow, _) = Flow::new(mesh, settings, |position_m| {
        eddies(position_m, length_m, aspect)
    })?;
    let mut worst = f64::NAN;
    for _ in 0..3 {
        let report = flow.step()?;
        let residual = match pressure {
            PressureMethod::Direct => report.pressure_residual,
            _ => report.pressure_factor,
        };
        worst = worst.max(residual.unwrap_or(f64::NAN));
    }
    Ok(worst)
}

/// Eddies in a box of some length along x and width along y.
fn eddies([x, y, z]: [f64; 3], length_m: f64, width_m: f64) -> [f64; 3] {
    let a = TAU * 6.0 * x / length_m;
    let b = TAU * y / width_m + 0.3;
    let c = TAU * z + 0.5;
    [
        0.2 * a.cos() * b.sin(),
        b.cos() * c.sin() + 0.3 * (5.0 * b).cos() * c.cos(),
        b.sin() * c.cos() + 0.1 * a.sin(),
    ]
}

/// Energy that a flow without viscosity gains or loses in half a second, against a cube through the shortest step.
pub(super) fn drift() -> Result<Vec<Panel>, Failure> {
    const STEPS_S: [f64; 5] = [0.02, 0.01, 0.005, 0.0025, 0.00125];
    let curves = SCHEMES.map(|(name, scheme)| {
        let found = STEPS_S.map(|step_s| energy_drift(scheme, step_s).ok());
        let last = found[4].unwrap_or(f64::NAN);
        let mut points = Vec::new();
        for (step_s, drift) in STEPS_S.into_iter().zip(found) {
            if let Some(drift) = drift {
                points.push([step_s, drift, last * (step_s / STEPS_S[4]).powi(3)]);
            }
        }
        Ok(Curve {
            name: name.into(),
            points,
        })
    });
    Ok(vec![Panel::new(
        "energy lost without viscosity",
        logs(["step [s]", "energy lost, relative"]),
        curves,
    )?])
}

/// Energy that steps feed beyond the powers of viscosity and subgrid stress, over what these take, as vortices break up into turbulence.
pub(super) fn fed(profile: Profile) -> Result<Vec<Panel>, Failure> {
    let models = [
        ("no model", SubgridModel::None),
        ("multiscale WALE", SubgridModel::MULTISCALE_WALE),
    ];
    let courants = thinned(
        profile,
        &[0.4, 0.6, 1.0],
        &[0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0],
    );
    let mut curves = Vec::new();
    for (scheme_name, scheme) in SCHEMES {
        for (model_name, subgrid) in models {
            let mut points = Vec::new();
            for &courant in courants {
                // Where steps are refused there is no point.
                if let Ok(fed) = fed_over_taken(scheme, subgrid, courant) {
                    points.push([courant, fed, NO_THEORY]);
                }
            }
            curves.push(Ok(Curve {
                name: format!("{scheme_name}, {model_name}"),
                points,
            }));
        }
    }
    let axes = ["Courant number", "fed over taken"].map(Axis::linear);
    let panel = Panel::new("energy that steps feed, over what is taken", axes, curves)?;
    Ok(vec![Panel {
        limit: Some(Limit::Level("nothing fed", 0.0)),
        ..panel
    }])
}

fn fed_over_taken(scheme: TimeScheme, subgrid: SubgridModel, courant: f64) -> Result<f64, Failure> {
    let mut case = cases::taylor_green_3d(16, 1e4)?;
    case.settings.scheme = scheme;
    case.settings.subgrid = subgrid;
    case.settings.time_step = TimeStep::Courant {
        courant,
        longest_s: 1.0,
    };
    let (mut flow, _) = case.start()?;
    let start_m5_s2 = flow.kinetic_energy_m5_s2();
    let mut steps = Vec::new();
    while flow.time_s() < 5.0 {
        steps.push(flow.step()?);
    }
    // Powers are those at the start of a step: at its end they are those of the next one.
    let taken: f64 = steps
        .windows(2)
        .map(|pair| -0.5 * pair[0].step_s * (power_m5_s3(&pair[0]) + power_m5_s3(&pair[1])))
        .sum();
    let last = steps.len().saturating_sub(2);
    Ok((steps[last].kinetic_energy_m5_s2 - start_m5_s2 + taken) / taken)
}

/// Power of viscosity and of subgrid stress.
fn power_m5_s3(step: &StepReport) -> f64 {
    step.viscous_power_m5_s3 + step.subgrid_power_m5_s3
}

/// Energy of Taylor and Green's vortices on 16 cells a side after 150 steps, over that of the start.
pub(super) fn reynolds(profile: Profile) -> Result<Vec<Panel>, Failure> {
    let models = [
        ("no model", SubgridModel::None),
        ("WALE", SubgridModel::WALE),
        ("multiscale WALE", SubgridModel::MULTISCALE_WALE),
    ];
    let curves = models.map(|(name, subgrid)| {
        let reynolds = thinned(profile, &[1e3, 1e12], &[1e3, 1e5, 1e8, 1e12]);
        Curve::new(name, reynolds, |reynolds| {
            Ok([
                energy_left(16, reynolds, TimeScheme::RungeKutta3, subgrid, 150)?,
                NO_THEORY,
            ])
        })
    });
    let axes = logs(["Reynolds number", "energy over that of the start"]);
    Ok(vec![Panel::new(
        "energy of turbulent vortices",
        axes,
        curves,
    )?])
}
