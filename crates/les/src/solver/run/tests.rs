//! Runs that end, resume, blow up or are stopped.

use super::super::cases::taylor_green_plane;
use super::super::mesh::{Direction, Wall};
use super::super::settings::{TimeScheme, TimeStep};
use super::*;
use crate::error::Place;

const NU_M2_S: f64 = 0.01;

/// Vortices of the plane that decay by `exp(-16 pi^2 nu t)` in energy.
fn vortices(time_step: TimeStep, scheme: TimeScheme) -> Flow {
    let mut case = taylor_green_plane(12, [0.0, 0.2], NU_M2_S, 0.01).unwrap();
    case.settings.time_step = time_step;
    case.settings.scheme = scheme;
    let mut flow = case.start().unwrap().0;
    // The same for every length of the step.
    flow.state.implicit = flow.layout.direction.map(|d| d > 0);
    flow
}

/// Keeps all that it is told; stops at one output if told so.
#[derive(Debug, Default, Clone, PartialEq)]
struct Witness {
    records: Vec<StepRecord>,
    outputs: Vec<(usize, f64)>,
    warnings: Vec<RunWarning>,
    fails_at: Option<usize>,
}

impl RunObserver for Witness {
    fn step(&mut self, _: &Flow, record: &StepRecord) -> Result<(), String> {
        self.records.push(*record);
        Ok(())
    }

    fn output(&mut self, flow: &Flow, index: usize) -> Result<(), String> {
        if self.fails_at == Some(index) {
            return Err("no space left on device".into());
        }
        self.outputs.push((index, flow.time_s()));
        Ok(())
    }

    fn warning(&mut self, warning: &RunWarning) {
        self.warnings.push(*warning);
    }

    fn user_data(&self) -> Vec<u8> {
        self.records.len().to_le_bytes().to_vec()
    }
}

fn plan(end_s: f64, output_times_s: &[f64]) -> RunPlan {
    RunPlan {
        end_s,
        output_times_s: output_times_s.to_vec(),
        ..RunPlan::default()
    }
}

fn courant(courant: f64) -> TimeStep {
    TimeStep::Courant {
        courant,
        longest_s: 0.05,
    }
}

#[test]
fn outputs_come_at_their_exact_times_and_steps_are_never_slivers() {
    let times_s = [0.0, 0.1, 0.1 + 0.037, 0.3, 0.5];
    for (time_step, scheme) in [
        (
            TimeStep::Fixed { step_s: 0.013 },
            TimeScheme::AdamsBashforth2,
        ),
        (courant(0.35), TimeScheme::AdamsBashforth2),
        (courant(1.2), TimeScheme::RungeKutta3),
    ] {
        let mut run = Run::new(vortices(time_step, scheme), plan(0.5, &times_s)).unwrap();
        let mut witness = Witness::default();
        let is_complete = run.to_end(&mut witness).unwrap();
        let expected: Vec<(usize, f64)> = times_s.iter().copied().enumerate().collect();
        assert_eq!(witness.outputs, expected);
        assert_eq!((run.flow().time_s(), is_complete), (0.5, true));
        assert_eq!(run.flow().steps(), witness.records.len() as u64);
        let steps: Vec<f64> = witness.records.iter().map(|r| r.report.step_s).collect();
        let longest = steps.iter().copied().fold(0.0, f64::max);
        assert!(steps.iter().all(|&s| s > 0.2 * longest), "{steps:?}");
        let sum: f64 = steps.iter().sum();
        assert!((sum - 0.5).abs() < 1e-12);
    }
}

#[test]
fn a_paused_and_resumed_run_gives_the_same_records_and_outputs_as_one_that_was_not() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.ckpt");
    let with_checkpoint = |pause_after_steps| RunPlan {
        checkpoint: Some(CheckpointPlan {
            path: path.clone(),
            every: Interval::Steps(1000),
        }),
        pause_after_steps,
        ..plan(0.3, &[0.0, 0.1, 0.2, 0.3])
    };
    let flow = || vortices(courant(0.3), TimeScheme::AdamsBashforth2);
    let mut whole = Witness::default();
    Run::new(flow(), with_checkpoint(None))
        .unwrap()
        .to_end(&mut whole)
        .unwrap();
    let total = whole.records.len() as u64;
    assert!(total > 8);
    for pause in 0..=total {
        let mut witness = Witness::default();
        let mut run = Run::new(flow(), with_checkpoint(Some(pause))).unwrap();
        let is_complete = run.to_end(&mut witness).unwrap();
        assert_eq!((run.flow().steps(), is_complete), (pause, pause == total));
        let mesh = run.flow().mesh().clone();
        let settings = run.flow().settings().clone();
        let (mut run, user_data) =
            Run::resume(&path, mesh, settings, with_checkpoint(None)).unwrap();
        assert_eq!(user_data, (pause as usize).to_le_bytes());
        assert!(run.to_end(&mut witness).unwrap());
        assert_eq!(witness, whole, "paused after step {pause}");
    }
}

#[test]
fn the_energy_budget_closes_to_the_second_order_of_the_time_step() {
    // The energy falls by exp(-16 pi^2 nu t), all of it through viscosity.
    let residual = |step_s: f64| {
        let flow = vortices(TimeStep::Fixed { step_s }, TimeScheme::AdamsBashforth2);
        let energy = flow.kinetic_energy_m5_s2();
        let mut witness = Witness::default();
        Run::new(flow, plan(0.16, &[]))
            .unwrap()
            .to_end(&mut witness)
            .unwrap();
        assert_eq!(witness.records[0].budget_before, None);
        let budget = witness.records.last().unwrap().budget_before.unwrap();
        assert_eq!(budget.step, witness.records.len() as u64 - 1);
        let rate = 16.0 * std::f64::consts::PI.powi(2) * NU_M2_S;
        // The middle of the last step but one.
        let expected = -rate * energy * (-rate * (0.16 - 1.5 * step_s)).exp();
        assert!(
            (budget.rate_m5_s3 / expected - 1.0).abs() < 5e-3,
            "{budget:?}, expected {expected}"
        );
        assert!(
            (budget.power_m5_s3 / expected - 1.0).abs() < 5e-3,
            "{budget:?}, expected {expected}"
        );
        assert!(witness.records.iter().all(|r| r.relative_divergence < 1e-9));
        (budget.residual_m5_s3() / expected).abs()
    };
    let order = (residual(0.02) / residual(0.01)).log2();
    assert!((order - 2.0).abs() < 0.3, "order {order}");
}

#[test]
fn steps_in_which_waves_grow_are_told_of_once_and_longer_ones_stop_the_run() {
    // Vortices with a speed of 1 on cells of 1/12 m.
    let run = |step_s| {
        let mut witness = Witness::default();
        let flow = vortices(TimeStep::Fixed { step_s }, TimeScheme::AdamsBashforth2);
        let result = Run::new(flow, plan(3.0 * step_s, &[]))
            .unwrap()
            .to_end(&mut witness);
        (result, witness)
    };
    let (result, witness) = run(0.02);
    assert!(result.is_ok() && witness.warnings.is_empty());
    let (result, witness) = run(0.0305);
    assert!(result.is_ok() && witness.records.len() == 3, "{result:?}");
    let [RunWarning::UndampedGrowth { step: 0, growth }] = witness.warnings[..] else {
        panic!("{witness:?}")
    };
    assert!(
        growth.courant > 0.45 && growth.damped_courant < growth.courant,
        "{growth:?}"
    );
    let (result, _) = run(0.06);
    assert!(
        matches!(result, Err(Error::CourantTooLarge { step: 1, .. })),
        "{result:?}"
    );
}

#[test]
fn a_flow_that_blows_up_stops_with_its_place_and_leaves_a_checkpoint_that_can_be_continued() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.ckpt");
    let wall = Direction::between(12, 0.0, 1.0, Wall::Slip, Wall::Slip);
    let mesh = Mesh::new(
        Direction::thin(1.0),
        Direction::periodic(12, 0.0, 1.0),
        wall,
    )
    .unwrap();
    // A force that grows the speed until the fixed step is too long.
    let settings = FlowSettings {
        force_m_s2: [0.0, 4.0, 0.0],
        ..FlowSettings::new(1e-3, TimeStep::Fixed { step_s: 0.01 })
    };
    let (flow, _) = Flow::new(mesh.clone(), settings.clone(), |_| [0.0, 1.0, 0.0]).unwrap();
    let checkpoint = Some(CheckpointPlan {
        path: path.clone(),
        every: Interval::Steps(1),
    });
    let blown = RunPlan {
        checkpoint,
        ..plan(10.0, &[])
    };
    let mut witness = Witness::default();
    let error = Run::new(flow, blown.clone())
        .unwrap()
        .to_end(&mut witness)
        .unwrap_err();
    let Error::CourantTooLarge {
        step,
        place: Place { component, .. },
        courant,
        ..
    } = error
    else {
        panic!("{error}")
    };
    assert_eq!((component, step), ("v", witness.records.len() as u64 + 1));
    assert!(courant > 0.4);
    // The last state was refused; the one before it is the last that could be stepped from.
    let (flow, _) = Flow::restore(&path, mesh.clone(), settings.clone()).unwrap();
    assert_eq!(flow.steps(), step - 2);
    let slower = FlowSettings {
        time_step: TimeStep::Courant {
            courant: 0.3,
            longest_s: 1.0,
        },
        ..settings
    };
    let (mut run, _) = Run::resume(&path, mesh, slower, plan(flow.time_s() + 0.1, &[])).unwrap();
    run.to_end(&mut ()).unwrap();
}

/// Vortices without viscosity, which keep their energy for ever.
fn inviscid(time_step: TimeStep, scheme: TimeScheme) -> Flow {
    let mut case = taylor_green_plane(16, [0.0, 0.2], 0.0, 0.01).unwrap();
    (case.settings.time_step, case.settings.scheme) = (time_step, scheme);
    case.start().unwrap().0
}

/// Checks that the energy, at first `start`, was refused at its first percent, not after many
/// orders of magnitude; returns the step.
fn check_growth_error(error: &Error, start: f64) -> u64 {
    let text = error.to_string();
    let Error::EnergyGrew {
        step,
        energy_m5_s2: energy,
        allowed_m5_s2: allowed,
        rate_per_s,
        cause,
        ..
    } = error
    else {
        panic!("{error}")
    };
    assert!(*allowed <= start * (1.0 + 1e-9), "{text}");
    assert!(*energy > 1.01 * allowed, "{text}");
    assert!(*energy < 1.5 * start && *rate_per_s > 0.0, "{text}");
    assert!(cause.contains("Runge-Kutta"), "{text}");
    assert!(text.contains("near cell") && text.contains("1/s"), "{text}");
    *step
}

#[test]
fn energy_that_nothing_gave_stops_the_run_and_no_checkpoint_holds_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.ckpt");
    let checkpoint = Some(CheckpointPlan {
        path: path.clone(),
        every: Interval::Steps(10),
    });
    let plan = RunPlan {
        checkpoint,
        ..plan(1000.0, &[])
    };
    let flow = inviscid(courant(0.4), TimeScheme::AdamsBashforth2);
    let mesh = flow.mesh().clone();
    let settings = flow.settings().clone();
    let start = flow.kinetic_energy_m5_s2();
    let mut witness = Witness::default();
    let mut run = Run::new(flow, plan.clone()).unwrap();
    let error = run.to_end(&mut witness).unwrap_err();
    let step = check_growth_error(&error, start);
    assert_eq!(
        step,
        witness.records.len() as u64,
        "the step that failed is recorded"
    );
    assert!(
        matches!(
            witness.warnings[0],
            RunWarning::UndampedGrowth { step: 0, .. }
        ),
        "{:?}",
        witness.warnings
    );
    for name in ["run.ckpt", "run.ckpt.previous"] {
        let (kept, _) =
            Flow::restore(folder.path().join(name), mesh.clone(), settings.clone()).unwrap();
        assert!(
            kept.kinetic_energy_m5_s2() <= 1.01 * start,
            "{name}: {} of {start}",
            kept.kinetic_energy_m5_s2()
        );
    }
    // A resumed run remembers what the flow may have, and stops at the same step.
    let (mut resumed, _) = Run::resume(&path, mesh, settings, plan).unwrap();
    let error = resumed.to_end(&mut ()).unwrap_err();
    assert!(
        matches!(error, Error::EnergyGrew { step: found, .. } if found == step),
        "{error}"
    );
}

#[test]
fn steady_forced_dragged_and_fading_flows_keep_within_the_energy_that_they_may_have() {
    use super::super::cases::{Plates, lid_driven_cavity};
    let mut flows = vec![
        inviscid(courant(1.0), TimeScheme::RungeKutta3),
        // Viscosity takes what the scheme gives.
        vortices(courant(0.35), TimeScheme::AdamsBashforth2),
    ];
    for case in [
        Plates {
            cells: 16,
            strength: 1.5,
            viscosity_m2_s: 0.1,
            step_s: 0.5,
        }
        .poiseuille(0.0),
        Plates {
            cells: 16,
            strength: 1.5,
            viscosity_m2_s: 0.1,
            step_s: 2.0,
        }
        .couette(0.0),
        Plates {
            cells: 16,
            strength: 1.5,
            viscosity_m2_s: 0.1,
            step_s: 0.05,
        }
        .rayleigh_plate(),
        lid_driven_cavity(16, 1.5, 100.0),
        // Decays to round-off.
        Plates {
            cells: 16,
            strength: 1.5,
            viscosity_m2_s: 1.0,
            step_s: 1.0,
        }
        .decaying_layer(),
    ] {
        flows.push(case.unwrap().start().unwrap().0);
    }
    for flow in flows {
        let settings = flow.settings().clone();
        let steps = RunPlan {
            pause_after_steps: Some(300),
            ..plan(1e6, &[])
        };
        let mut run = Run::new(flow, steps).unwrap();
        run.to_end(&mut ())
            .unwrap_or_else(|e| panic!("{e}: {settings:?}"));
        assert_eq!(run.flow().steps(), 300);
    }
}

#[test]
fn steps_that_feed_a_flow_more_than_it_loses_are_told_of_and_stop_it() {
    use super::super::cases::taylor_green_3d;
    let run = |reynolds: f64, scheme: TimeScheme, courant: f64, constant: f64| {
        let mut case = taylor_green_3d(16, reynolds).unwrap();
        case.settings.scheme = scheme;
        case.settings.time_step = TimeStep::Courant {
            courant,
            longest_s: 0.2,
        };
        if constant > 0.0 {
            case.settings.subgrid = SubgridModel::Smagorinsky { constant };
        }
        let mut witness = Witness::default();
        let result = Run::new(case.start().unwrap().0, plan(20.0, &[]))
            .unwrap()
            .to_end(&mut witness);
        (result, witness.warnings)
    };
    let ab2 = TimeScheme::AdamsBashforth2;
    let rk3 = TimeScheme::RungeKutta3;
    // A model that is there but does next to nothing.
    let (result, _) = run(1e6, ab2, 0.35, 0.005);
    let Err(Error::StepFeeds {
        step,
        share,
        suited_courant,
        cause: text,
        ..
    }) = result
    else {
        panic!("{result:?}")
    };
    assert!(step.is_multiple_of(100) && share > 1.0, "{share}");
    assert!(
        text.contains("take Runge-Kutta") && text.contains("feeds"),
        "{text}"
    );
    // The remedies, obeyed; and a model that does its work.
    for (scheme, courant) in [(ab2, suited_courant), (rk3, 0.3)] {
        let (result, warnings) = run(1e6, scheme, courant, 0.005);
        assert!(
            result.is_ok() && warnings.is_empty(),
            "{scheme:?}, {courant}: {result:?}, {warnings:?}"
        );
    }
    let (result, warnings) = run(1e6, ab2, 0.35, 0.17);
    assert!(
        result.is_ok() && warnings.is_empty(),
        "{result:?}, {warnings:?}"
    );
    // Runge-Kutta takes energy at long steps, which is told, and does not stop a run.
    let (result, warnings) = run(1e6, rk3, 0.6, 0.0);
    let [RunWarning::StepEnergy { step: 100, energy }] = warnings[..] else {
        panic!("{warnings:?}")
    };
    assert!(
        result.is_ok() && energy.share < -0.1 && energy.to_string().contains("takes"),
        "{energy:?}"
    );
    let (result, warnings) = run(200.0, rk3, 0.6, 0.0);
    assert!(
        result.is_ok() && warnings.is_empty(),
        "{result:?}, {warnings:?}"
    );
}

#[test]
fn values_that_are_not_finite_are_found_at_once() {
    let mut flow = vortices(
        TimeStep::Fixed { step_s: 0.01 },
        TimeScheme::AdamsBashforth2,
    );
    flow.step().unwrap();
    flow.state.previous_terms[1][17] = f64::NAN;
    let error = Run::new(flow, plan(1.0, &[]))
        .unwrap()
        .to_end(&mut ())
        .unwrap_err();
    assert!(
        matches!(error, Error::Diverged { step: 2..=11, .. }),
        "{error}"
    );
}

#[test]
fn a_failing_output_stops_the_run_and_leaves_the_checkpoint_before_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.ckpt");
    let checkpoint = Some(CheckpointPlan {
        path: path.clone(),
        every: Interval::Time { time_s: 0.05 },
    });
    let plan = RunPlan {
        checkpoint,
        ..plan(0.2, &[0.1, 0.2])
    };
    let flow = || {
        vortices(
            TimeStep::Fixed { step_s: 0.01 },
            TimeScheme::AdamsBashforth2,
        )
    };
    let mut witness = Witness {
        fails_at: Some(0),
        ..Witness::default()
    };
    let error = Run::new(flow(), plan.clone())
        .unwrap()
        .to_end(&mut witness)
        .unwrap_err();
    assert!(
        matches!(&error, Error::Stopped { step: 10, reason, .. } if reason.contains("space")),
        "{error}"
    );
    let mesh = flow().mesh().clone();
    let settings = flow().settings().clone();
    let (mut run, _) = Run::resume(&path, mesh, settings, plan).unwrap();
    assert!(run.flow().steps() < 10);
    // The output that failed is given again.
    let mut witness = Witness::default();
    run.to_end(&mut witness).unwrap();
    assert_eq!(witness.outputs, [(0, 0.1), (1, 0.2)]);
    assert!(folder.path().join("run.ckpt.previous").exists());
}

#[test]
fn plans_that_cannot_be_carried_out_are_refused() {
    let refused = |plan: RunPlan| {
        let flow = vortices(
            TimeStep::Fixed { step_s: 0.01 },
            TimeScheme::AdamsBashforth2,
        );
        Run::new(flow, plan).unwrap_err().to_string()
    };
    assert!(refused(plan(-1.0, &[])).contains("end_s = -1"));
    assert!(refused(plan(f64::NAN, &[])).contains("end_s"));
    assert!(refused(plan(1.0, &[0.5, 0.5])).contains("output_times_s = 0.5"));
    assert!(refused(plan(1.0, &[0.5, 1.5])).contains("output_times_s = 1.5"));
    let checkpoint = Some(CheckpointPlan {
        path: "unused".into(),
        every: Interval::Steps(0),
    });
    assert!(
        refused(RunPlan {
            checkpoint,
            ..plan(1.0, &[])
        })
        .contains("checkpoint interval")
    );
    let mut run = Run::new(
        vortices(courant(0.3), TimeScheme::default()),
        plan(0.0, &[]),
    )
    .unwrap();
    assert_eq!(run.to_end(&mut ()), Ok(true));
    assert_eq!((run.flow().steps(), run.flow().time_s()), (0, 0.0));
}
