//! Runs on ranks against runs of one process: what is shown, checkpoints, failures.

use std::sync::Arc;

use super::super::cases::{Case, VortexPairCase};
use super::super::settings::TimeStep;
use super::super::subgrid::SubgridModel;
use super::*;
use crate::ranks::{Ranks, Single, on_threads};

fn wake() -> Case {
    let subgrid = SubgridModel::MULTISCALE_WALE;
    let pair = VortexPairCase {
        cells: [8, 24, 28],
        perturbation: 0.05,
        subgrid,
        ..VortexPairCase::coarse()
    };
    pair.case(TimeStep::Courant {
        courant: 0.65,
        longest_s: 0.1,
    })
    .unwrap()
}

fn start(case: &Case, ranks: Arc<dyn Ranks>, plan: RunPlan) -> Result<Run, Error> {
    let settings = FlowSettings {
        ranks,
        ..case.settings.clone()
    };
    Run::new(case.initial.start(case.mesh.clone(), settings)?.0, plan)
}

/// Keeps what it sees; fails at output 1 if told so.
#[derive(Debug, Default, Clone, PartialEq)]
struct Witness {
    records: Vec<StepRecord>,
    fields: Vec<Vec<f64>>,
    fails: bool,
}

impl RunObserver for Witness {
    fn step(&mut self, flow: &Flow, record: &StepRecord) -> Result<(), String> {
        assert_eq!(
            (flow.steps(), flow.time_s()),
            (record.report.step, record.report.time_s)
        );
        assert_eq!(
            flow.kinetic_energy_m5_s2(),
            record.report.kinetic_energy_m5_s2
        );
        self.records.push(*record);
        Ok(())
    }

    fn output(&mut self, flow: &Flow, index: usize) -> Result<(), String> {
        self.fields
            .extend([0, 1, 2].map(|d| flow.whole(flow.own_centre_velocity_m_s(d))));
        self.fields.extend([
            flow.pressure_m2_s2(),
            flow.subgrid_viscosity_m2_s().unwrap(),
        ]);
        self.fields.extend([
            flow.whole(flow.own_vorticity_magnitude_per_s()),
            vec![flow.relative_divergence()],
        ]);
        if self.fails && index == 1 {
            Err("no space left on device".into())
        } else {
            Ok(())
        }
    }

    fn user_data(&self) -> Vec<u8> {
        vec![self.records.len() as u8]
    }
}

fn plan(path: &Path, pause_after_steps: Option<u64>) -> RunPlan {
    let checkpoint = Some(CheckpointPlan {
        path: path.to_owned(),
        every: Interval::Steps(2),
    });
    RunPlan {
        end_s: 0.25,
        output_times_s: vec![0.0, 0.1, 0.25],
        checkpoint,
        pause_after_steps,
    }
}

#[test]
fn checkpoints_have_the_same_bytes_and_continue_on_any_other_number_of_ranks() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.ckpt");
    let case = wake();
    let bytes = || std::fs::read(&path).unwrap();
    let advance = |pause: Option<u64>, count: usize| {
        let mut seen = on_threads(count, |ranks| {
            let mut witness = Witness::default();
            let mut run = match pause {
                Some(3) => start(&case, ranks, plan(&path, pause)).unwrap(),
                _ => {
                    let settings = FlowSettings {
                        ranks,
                        ..case.settings.clone()
                    };
                    Run::resume(&path, case.mesh.clone(), settings, plan(&path, pause))
                        .unwrap()
                        .0
                }
            };
            run.to_end(&mut witness).unwrap();
            witness
        });
        assert!(
            seen.iter().all(|other| *other == seen[0]),
            "all see the same"
        );
        (bytes(), seen.swap_remove(0).unwrap())
    };
    let stages = [Some(3), Some(5), None];
    let alone = stages.map(|pause| advance(pause, 1));
    assert!(alone[2].1.records.len() > 2 && alone[2].1.fields.iter().flatten().any(|v| *v != 0.0));
    for counts in [[3, 1, 5], [1, 5, 3], [7, 2, 1]] {
        for ((pause, count), expected) in stages.into_iter().zip(counts).zip(&alone) {
            let found = advance(pause, count);
            assert!(
                found.0 == expected.0,
                "the checkpoint of {count} ranks, {pause:?}"
            );
            assert!(found.1 == expected.1, "what {count} ranks show, {pause:?}");
        }
    }
}

/// The error of each rank, as words.
fn words(found: Vec<Option<Result<bool, Error>>>) -> Vec<String> {
    found
        .into_iter()
        .map(|one| one.map_or("a panic".into(), |result| result.unwrap_err().to_string()))
        .collect()
}

#[test]
fn what_fails_on_one_rank_stops_all_with_the_words_of_one_process() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.ckpt");
    let compare_with = |name: &str, case: &Case, fails: bool, implicit: Option<[bool; 3]>| {
        let run = |ranks: Arc<dyn Ranks>| {
            let mut witness = Witness {
                fails: fails && ranks.rank() == 0,
                ..Witness::default()
            };
            let mut run = start(case, ranks, plan(&path, None))?;
            run.flow.state.implicit = implicit.unwrap_or(run.flow.state.implicit);
            run.to_end(&mut witness)
        };
        let alone = run(Arc::new(Single)).unwrap_err().to_string();
        assert_eq!(words(on_threads(3, run)), vec![alone; 3], "{name}");
    };
    let compare = |name: &str, case: &Case, fails: bool| compare_with(name, case, fails, None);
    compare("an output that cannot be written", &wake(), true);
    super::super::checkpoint::check_checkpoint(&path).unwrap();
    let mut case = wake();
    case.settings.time_step = TimeStep::Fixed { step_s: 0.24 };
    compare("a step that is too long", &case, false);
    let mut case = wake();
    case.initial = super::super::cases::Initial::Field(Box::new(|at_m| {
        if at_m[2] > 1.0 && at_m[1] > 1.0 {
            [0.0, f64::NAN, 1.0]
        } else {
            [0.0; 3]
        }
    }));
    compare("a field that is not finite", &case, false);
    let mut case = wake();
    case.settings.time_step = TimeStep::Fixed { step_s: 0.02 };
    case.settings.viscosity_m2_s = 0.05;
    compare_with("an energy that grows", &case, false, Some([false; 3]));
}

#[test]
fn a_rank_that_panics_or_cannot_read_stops_the_others() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.ckpt");
    let case = wake();
    let panicking = |ranks: Arc<dyn Ranks>| {
        let last = ranks.rank() == 2;
        let mut run = start(&case, ranks, plan(&path, Some(2)))?;
        run.to_end(&mut ())?;
        assert!(!last, "this rank breaks down");
        run.plan.pause_after_steps = None;
        run.to_end(&mut ())
    };
    let found = words(on_threads(3, panicking));
    let lost = Error::RankLost { rank: 2 }.to_string();
    assert!(
        found[2] == "a panic" && found[..2].contains(&lost),
        "{found:?}"
    );
    super::super::checkpoint::check_checkpoint(&path).unwrap();
    // Rank 1 finds no checkpoint where the others do.
    let reading = |ranks: Arc<dyn Ranks>| {
        let path = if ranks.rank() == 1 {
            folder.path().join("none")
        } else {
            path.clone()
        };
        let settings = FlowSettings {
            ranks,
            ..case.settings.clone()
        };
        Run::resume(&path, case.mesh.clone(), settings, plan(&path, None))
            .map(|_| ())
            .unwrap_err()
            .to_string()
    };
    let found = on_threads(3, reading);
    assert!(
        found[0].as_ref().unwrap().contains("none") && found.iter().all(|words| *words == found[0]),
        "{found:?}"
    );
}

#[test]
fn more_ranks_than_the_mesh_has_planes_for_are_refused_with_what_is_allowed() {
    let case = wake();
    let refused = on_threads(8, |ranks| start(&case, ranks, RunPlan::default()).map(drop));
    let expected = Error::TooManyRanks {
        ranks: 8,
        planes: 28,
        most: 7,
    };
    assert!(expected.to_string().contains("at most 7"), "{expected}");
    assert!(
        refused
            .iter()
            .all(|found| *found == Some(Err(expected.clone()))),
        "{refused:?}"
    );
}
