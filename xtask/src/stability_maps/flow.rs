//! What is stable of flows: time schemes, stiff viscosity, pressure solvers, energy.

use super::{Curve, NO_THEORY, Panel, logs};
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
    let at = |(j, u): (usize, &f64)| u * Complex::cis(-TAU * (wave * j) as f64 / CELLS as f64);
    flow.face_velocity_m_s(0)
        .iter()
        .enumerate()
        .map(at)
        .sum::<Complex<f64>>()
        .norm()
}

/// The wave number that convection sees of a wave that turns by `theta` from one cell to the next, times the length of a cell.
fn symbol(theta: f64) -> f64 {
    1.5 * theta.sin() - 0.3 * (2.0 * theta).sin() + (3.0 * theta).sin() / 30.0
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
            (0..20).try_for_each(|_| flow.step().map(drop))?;
            let before = amplitude(&flow, WAVE);
            (0..40).try_for_each(|_| flow.step().map(drop))?;
            let measured = ((amplitude(&flow, WAVE) / before).powf(1.0 / 40.0) - 1.0).abs();
            Ok([
                measured,
                (root(scheme, Complex::new(0.0, angle), 0.0) - 1.0).abs(),
            ])
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
pub(super) fn limits() -> Result<Vec<Panel>, Failure> {
    let curves = SCHEMES.map(|(name, scheme)| {
        Curve::new(name, &[1e-3, 1e-2, 3e-2, 1e-1, 3e-1], |viscous| {
            // nu = viscous h^2/dt, with dt = courant h.
            let holds = |courant: f64| -> Result<bool, Failure> {
                let (h, step_s) = (1.0 / CELLS as f64, courant / CELLS as f64);
                let spike = |y: f64| {
                    if (y * CELLS as f64).floor() == 7.0 {
                        1.0
                    } else {
                        0.0
                    }
                };
                let mut flow = line(scheme, viscous * h * h / step_s, step_s, spike)?;
                let mut largest = || -> Result<Option<f64>, Failure> {
                    for _ in 0..600 {
                        // A refusal is an answer.
                        let Ok(_) = flow.step() else { return Ok(None) };
                    }
                    Ok(Some(
                        (1..=CELLS / 2)
                            .map(|wave| amplitude(&flow, wave))
                            .fold(0.0, f64::max),
                    ))
                };
                let (first, last) = (largest()?, largest()?);
                Ok(matches!((first, last), (Some(first), Some(last)) if last <= first))
            };
            let (mut low, mut high) = (0.05, 2.0);
            while high - low > 5e-4 * low {
                let middle = 0.5 * (low + high);
                if holds(middle)? {
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

/// Decay of the shortest wave in a step up to which the solver takes viscosity explicitly.
const EXPLICIT: f64 = 0.1;

/// The Courant number up to which every wave decays, with `viscous = nu dt/h^2` explicit where it is small and by Crank-Nicolson else.
fn limit(scheme: TimeScheme, viscous: f64) -> f64 {
    let decays = |courant: f64| {
        (1..=180).all(|k| {
            let theta = PI * f64::from(k) / 180.0;
            let kappa = 2.0 * (9.0 / 8.0 * (0.5 * theta).sin() - (1.5 * theta).sin() / 24.0);
            let decay = viscous * kappa * kappa;
            let [explicit, implicit] = if viscous * KAPPA2 > EXPLICIT {
                [0.0, decay]
            } else {
                [decay, 0.0]
            };
            root(
                scheme,
                Complex::new(-explicit, courant * symbol(theta)),
                implicit,
            ) <= 1.0
        })
    };
    let (mut low, mut high) = (0.0, 2.5);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if decays(middle) {
            low = middle
        } else {
            high = middle
        }
    }
    low
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
            let (a, z) = ((1.0 - 0.5 * d) / (1.0 + 0.5 * d), z / (1.0 + 0.5 * d));
            let b = a + 1.5 * z;
            let root = (b * b - 2.0 * z).sqrt();
            (0.5 * (b + root)).norm().max((0.5 * (b - root)).norm())
        }
        TimeScheme::RungeKutta3 => {
            let (mut u, mut before) = (Complex::new(1.0, 0.0), Complex::new(0.0, 0.0));
            for (now, last) in STAGES {
                let (rate, half) = (z * u, 0.5 * d * (now + last));
                u = (u * (1.0 - half) + now * rate + last * before) / (1.0 + half);
                before = rate;
            }
            u.norm()
        }
    }
}

/// Square of kappa h of a wave of two cells.
const KAPPA2: f64 = 49.0 / 9.0;

/// What the first step leaves of the shortest wave, stiff along one direction or two, by Crank-Nicolson.
pub(super) fn stiff() -> Result<Vec<Panel>, Failure> {
    const N: usize = 16;
    let cases = [
        ("Crank-Nicolson, one direction", false),
        ("Crank-Nicolson, two directions", true),
    ];
    let curves = cases.map(|(name, both)| {
        Curve::new(name, &[1e1, 1e2, 1e3, 1e4, 1e5, 1e6], |viscous| {
            let periodic = || Direction::periodic(N, 0.0, 1.0);
            let mesh = Mesh::new(
                Direction::thin(1.0),
                periodic(),
                if both {
                    periodic()
                } else {
                    Direction::thin(1.0)
                },
            )?;
            let step_s = 1e-3;
            let settings = FlowSettings::new(
                viscous / (N * N) as f64 / step_s,
                TimeStep::Fixed { step_s },
            );
            let short = |a: f64| {
                if ((a * N as f64) as usize).is_multiple_of(2) {
                    1.0
                } else {
                    -1.0
                }
            };
            let mut flow = Flow::new(mesh, settings, |[_, y, z]| {
                [short(y) * if both { short(z) } else { 1.0 }, 0.0, 0.0]
            })?
            .0;
            flow.step()?;
            let (d, directions) = (viscous * KAPPA2, if both { 2.0 } else { 1.0 });
            // The first step of either scheme is one of Runge-Kutta.
            let theory =
                STAGES
                    .iter()
                    .map(|(now, last)| (now + last) * d)
                    .fold(1.0, |left: f64, d| {
                        left * (1.0 - directions * d / (1.0 + 0.5 * d).powf(directions)).abs()
                    });
            Ok([flow.face_velocity_m_s(0)[0].abs(), theory])
        })
    });
    let axes = logs(["ν Δt/h²", "share of the wave"]);
    let panel = Panel::new("what the first step leaves of a stiff wave", axes, curves)?;
    Ok(vec![Panel {
        least: 1e-12,
        ..panel
    }])
}

/// The residual that an iteration of multigrid leaves, and what the direct solver leaves, on cells longer along y, or along x and y.
pub(super) fn pressure() -> Result<Vec<Panel>, Failure> {
    let cases = [
        (
            "multigrid, cells long along y",
            PressureMethod::Multigrid,
            false,
        ),
        (
            "multigrid, cells long along x and y",
            PressureMethod::Multigrid,
            true,
        ),
        (
            "direct, what it leaves, long along y",
            PressureMethod::Direct,
            false,
        ),
        (
            "direct, what it leaves, long along x and y",
            PressureMethod::Direct,
            true,
        ),
    ];
    let curves = cases.map(|(name, pressure, both)| {
        Curve::new(name, &[1.0, 1e1, 1e2, 1e3, 1e4, 1e5], |aspect| {
            let slip =
                |cells, length_m| Direction::between(cells, 0.0, length_m, Wall::Slip, Wall::Slip);
            let [length_m, width_m] = [if both { aspect } else { 1.0 }, aspect];
            let mesh = Mesh::new(
                Direction::periodic(8, 0.0, length_m / 6.0),
                slip(48, width_m),
                slip(48, 1.0),
            )?;
            let settings = FlowSettings {
                pressure,
                pressure_tolerance: 1e-10,
                ..FlowSettings::new(
                    1e-4,
                    TimeStep::Courant {
                        courant: 0.3,
                        longest_s: 1e-3,
                    },
                )
            };
            let eddies = move |[x, y, z]: [f64; 3]| {
                let (a, b, c) = (
                    TAU * 6.0 * x / length_m,
                    TAU * y / width_m + 0.3,
                    TAU * z + 0.5,
                );
                [
                    0.2 * a.cos() * b.sin(),
                    b.cos() * c.sin() + 0.3 * (5.0 * b).cos() * c.cos(),
                    b.sin() * c.cos() + 0.1 * a.sin(),
                ]
            };
            let mut flow = Flow::new(mesh, settings, eddies)?.0;
            let mut worst = f64::NAN;
            for _ in 0..3 {
                let report = flow.step()?;
                let of = if pressure == PressureMethod::Direct {
                    report.pressure_residual
                } else {
                    report.pressure_factor
                };
                worst = worst.max(of.unwrap_or(f64::NAN));
            }
            Ok([worst, NO_THEORY])
        })
    });
    let panel = Panel::new(
        "pressure solvers on flat cells",
        logs(["aspect of the cells", "residual left"]),
        curves,
    )?;
    Ok(vec![Panel {
        limit: Some(("at most 0.10 an iteration", 0.1, true)),
        ..panel
    }])
}

/// Energy that a flow without viscosity gains or loses in half a second, against a cube through the shortest step.
pub(super) fn drift() -> Result<Vec<Panel>, Failure> {
    const STEPS_S: [f64; 5] = [0.02, 0.01, 0.005, 0.0025, 0.00125];
    let curves = SCHEMES.map(|(name, scheme)| {
        let found = STEPS_S.map(|step_s| (step_s, energy_drift(scheme, step_s).ok()));
        let last = found[4].1.unwrap_or(f64::NAN);
        let point = |(step_s, drift): (f64, Option<f64>)| {
            Some([step_s, drift?, last * (step_s / STEPS_S[4]).powi(3)])
        };
        Ok(Curve {
            name: name.into(),
            points: found.into_iter().filter_map(point).collect(),
        })
    });
    Ok(vec![Panel::new(
        "energy lost without viscosity",
        logs(["step [s]", "energy lost, relative"]),
        curves,
    )?])
}

/// Energy that steps feed beyond the powers of viscosity and subgrid stress, over what these take, as vortices break up into turbulence.
pub(super) fn fed() -> Result<Vec<Panel>, Failure> {
    let models = [
        ("no model", SubgridModel::None),
        ("multiscale WALE", SubgridModel::MULTISCALE_WALE),
    ];
    let curves = SCHEMES.into_iter().flat_map(|(scheme_name, scheme)| {
        models.map(|(model_name, subgrid)| {
            let courants = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0];
            // Where steps are refused there is no point.
            let point = |courant| {
                Some([
                    courant,
                    fed_over_taken(scheme, subgrid, courant).ok()?,
                    NO_THEORY,
                ])
            };
            let points = courants.into_iter().filter_map(point).collect();
            Ok(Curve {
                name: format!("{scheme_name}, {model_name}"),
                points,
            })
        })
    });
    let axes = ["Courant number", "fed over taken"].map(Axis::linear);
    let panel = Panel::new("energy that steps feed, over what is taken", axes, curves)?;
    Ok(vec![Panel {
        limit: Some(("nothing fed", 0.0, true)),
        ..panel
    }])
}

fn fed_over_taken(scheme: TimeScheme, subgrid: SubgridModel, courant: f64) -> Result<f64, Failure> {
    let mut case = cases::taylor_green_3d(16, 1e4)?;
    let time_step = TimeStep::Courant {
        courant,
        longest_s: 1.0,
    };
    (
        case.settings.scheme,
        case.settings.subgrid,
        case.settings.time_step,
    ) = (scheme, subgrid, time_step);
    let (mut flow, start) = case.start()?;
    let mut steps = Vec::new();
    while flow.time_s() < 5.0 {
        steps.push(flow.step()?);
    }
    // Powers are those at the start of a step: at its end they are those of the next one.
    let power = |step: &StepReport| step.viscous_power_m5_s3 + step.subgrid_power_m5_s3;
    let taken: f64 = steps
        .windows(2)
        .map(|pair| -0.5 * pair[0].step_s * (power(&pair[0]) + power(&pair[1])))
        .sum();
    let last = steps.len().saturating_sub(2);
    Ok((steps[last].kinetic_energy_m5_s2 - start.kinetic_energy_m5_s2 + taken) / taken)
}

/// Energy of Taylor and Green's vortices on 16 cells a side after 150 steps, over that of the start.
pub(super) fn reynolds() -> Result<Vec<Panel>, Failure> {
    let models = [
        ("no model", SubgridModel::None),
        ("WALE", SubgridModel::WALE),
        ("multiscale WALE", SubgridModel::MULTISCALE_WALE),
    ];
    let curves = models.map(|(name, subgrid)| {
        Curve::new(name, &[1e3, 1e5, 1e8, 1e12], |reynolds| {
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
