//! Running a sweep: all cases are checked, then those without a result are run, what they have in common once.
//!
//! Check: counts of what is computed; the bytes of the results for threads, shards, kills.

use super::cases::{Case, Sweep};
use super::results::rows;
use super::stored::{Definition, case_files};
use super::tables;
use crate::io::{Existing, Table};
use crate::measure::map::{self, VelocityEstimates};
use crate::measure::profile::EfficiencyMemo;
use crate::measure::recorded::PredictedError;
use crate::measure::scan::Scanner;
use crate::memo::Memo;
use crate::plan::wind::SceneWind;
use crate::plan::{Plan, Target};
use crate::progress::{Observer, Stage};
use crate::quantities::seconds;
use crate::scene::{Estimator, Outputs, Scene, SceneFile, Site, WindOfPulses, hash_of};
use crate::{Error, machine, outputs};
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Part of the memory that is available which cases that are measured together may take.
const SHARE: f64 = 0.5;

/// Some of the cases of a sweep: those whose number leaves `number - 1` when divided by `of`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Which one, from 1.
    pub number: usize,
    /// Of how many.
    pub of: usize,
}

impl Shard {
    /// Whether a case is in it.
    pub fn has(self, case: usize) -> bool {
        case % self.of.max(1) == self.number.wrapping_sub(1)
    }
}

impl std::str::FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text
            .split_once('/')
            .and_then(|(number, of)| Some((number.parse().ok()?, of.parse().ok()?)));
        match parts {
            Some((number, of)) if (1..=of).contains(&number) => Ok(Self { number, of }),
            _ => Err("a shard is NUMBER/COUNT with a number from 1 to the count, e.g. 2/8".into()),
        }
    }
}

/// How a sweep is run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::Args))]
pub struct Settings {
    /// Run part NUMBER of COUNT, e.g. 2/8; --merge builds the tables.
    #[cfg_attr(feature = "cli", arg(long, value_name = "NUMBER/COUNT"))]
    pub shard: Option<Shard>,
    /// Skip cases whose results exist.
    #[cfg_attr(feature = "cli", arg(long))]
    pub resume: bool,
    /// Skip the circulation fits, which may take longer than the maps.
    #[cfg_attr(feature = "cli", arg(long))]
    pub no_circulation: bool,
    /// Run even if a case's memory forecast exceeds the machine's.
    #[cfg_attr(feature = "cli", arg(long))]
    pub allow_large: bool,
    /// Replace existing files, also those of another sweep.
    #[cfg_attr(feature = "cli", arg(long))]
    pub overwrite: bool,
}

/// What became of a sweep.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Summary {
    /// Cases that were run.
    pub run: usize,
    /// Cases whose result was there.
    pub kept: usize,
    /// Winds, analytic or read, each computed once for all cases that have it in common.
    pub flows: usize,
    /// Efficiency curves, as often.
    pub efficiencies: usize,
    /// Sets of signals, as often.
    pub signals: usize,
    /// Files that were written beside those of the cases.
    pub files: Vec<PathBuf>,
}

/// Checks all cases as `wakescope check` does, runs those of the shard that have no result, and writes the tables.
///
/// # Errors
/// The first case that is refused, before anything is written; a case that cannot be run; what the system says.
pub fn run(
    sweep: &Sweep,
    out: &Path,
    settings: Settings,
    observer: &dyn Observer,
) -> Result<Summary, Error> {
    let definition = Definition::from_sweep(sweep, !settings.no_circulation);
    let continues = settings.resume && definition.is_in(out);
    let existing = Existing::with_overwrite(settings.overwrite || continues);
    if !settings.overwrite {
        definition.refuse_other(out)?;
    }
    let common = Common::default();
    let core_s = check(sweep, &common, settings.allow_large)?;
    let times = settings.shard.map_or("times.csv".into(), |s| {
        format!("times-{}-of-{}.csv", s.number, s.of)
    });
    let mut mine: Vec<&Case> = sweep.cases.iter().collect();
    mine.retain(|case| settings.shard.is_none_or(|shard| shard.has(case.index)));
    let mut names = vec![times.clone()];
    for case in &mine {
        names.extend(case_files(case.index));
    }
    if settings.shard.is_none() {
        names.extend(tables::names(&definition)?);
    }
    // Shards may begin at the same time, in one folder: each writes files of its own.
    outputs::prepare(out, &names, existing, false)
        .map_err(|error| in_the_way(error, definition.is_in(out)))?;
    definition.write(out)?;
    let mut due = mine.clone();
    due.retain(|case| !(settings.resume && definition.stored(out, case.index).is_some()));
    observer.begin(Stage::Cases, due.len() as u64);
    let of_due_s = due.iter().filter_map(|case| core_s.get(case.index)).sum();
    observer.reach(&format!(
        "forecast: {} of one core, to a factor of two",
        seconds(of_due_s)
    ));
    let (signals, mut walls) =
        measure(sweep, &due, &common, &definition, (out, existing), observer)?;
    observer.end();
    let mut files = vec![write_times(out, &times, &definition, &mut walls)?];
    if settings.shard.is_none() {
        let mut rows = Vec::with_capacity(sweep.cases.len());
        for case in 0..sweep.cases.len() {
            rows.push(definition.stored(out, case).ok_or_else(|| {
                Error::input(&out.join("cases"), "a result that was written is gone")
            })?);
        }
        files.extend(tables::write(&definition, &rows, out, existing)?);
    }
    let flows = common.winds.len();
    let efficiencies = common.efficiencies.computed();
    Ok(Summary {
        run: due.len(),
        kept: mine.len() - due.len(),
        flows,
        efficiencies,
        signals,
        files,
    })
}

/// An error of the preparation of the folder; of a file of an earlier run of this sweep, with what to do.
fn in_the_way(error: Error, is_of_this_sweep: bool) -> Error {
    match error {
        Error::Exists { path } if is_of_this_sweep => Error::input(
            &path,
            "it is of an earlier run of this sweep: --resume runs the cases without a result, --overwrite runs all anew",
        ),
        error => error,
    }
}

/// Measures cases, those with the same signals together, and stores their results; returns how often signals were made, and the
/// wall time of each case, s.
fn measure(
    sweep: &Sweep,
    due: &[&Case],
    common: &Common,
    definition: &Definition,
    (out, existing): (&Path, Existing),
    observer: &dyn Observer,
) -> Result<(usize, Vec<(usize, f64)>), Error> {
    let mut signals = 0;
    let mut walls = Vec::new();
    for group in groups(due.iter().map(|case| &case.scene)) {
        let mut planned = Vec::with_capacity(group.len());
        for index in group {
            let case = due[index];
            let plan = common.plan(&case.scene, Target::Map);
            planned.push((case, plan.map_err(|e| sweep.failed(case, 0, e))?));
        }
        for batch in batches(planned) {
            let begun = Instant::now();
            let (cases, plans): (Vec<&Case>, Vec<Plan>) = batch.into_iter().unzip();
            let fits = definition.circulation;
            let found = rows(&plans, &common.efficiencies, observer, fits)
                .map_err(|e| sweep.failed(cases[0], 0, e))?;
            signals += 1;
            let wall_s = begun.elapsed().as_secs_f64() / found.len() as f64;
            for (row, case) in found.iter().zip(&cases) {
                definition.store(out, case, row, existing)?;
                walls.push((case.index, wall_s));
                observer.advance(1);
                observer.reach(&sweep.described(case));
            }
        }
    }
    Ok((signals, walls))
}

/// The plan and the map of every scene, in their order, without any file; what they have in common is computed once: flows,
/// efficiencies, and the signals of those that differ in what is done with the records alone.
///
/// # Errors
/// What a plan refuses; a scene that cannot be run.
pub fn maps(
    scenes: &[SceneFile],
    observer: &dyn Observer,
) -> Result<Vec<(Plan, VelocityEstimates)>, Error> {
    let common = Common::default();
    let mut out: Vec<(usize, (Plan, VelocityEstimates))> = Vec::with_capacity(scenes.len());
    for indices in groups(scenes.iter()) {
        let plans: Vec<Plan> = indices
            .iter()
            .map(|&i| common.plan(&scenes[i], Target::Map))
            .collect::<Result<_, _>>()?;
        let scanner = Scanner::with(&plans[0], &common.efficiencies, observer)?;
        let found = map::of_plans(
            &plans.iter().collect::<Vec<_>>(),
            &scanner,
            observer,
            |_| (),
        )?;
        drop(scanner);
        out.extend(indices.into_iter().zip(plans.into_iter().zip(found)));
    }
    out.sort_by_key(|(index, _)| *index);
    Ok(out.into_iter().map(|(_, found)| found).collect())
}

/// Winds, plans of phase screens and efficiencies that scenes have in common, whenever they are measured.
#[derive(Default)]
pub(crate) struct Common {
    winds: Memo<SceneWind>,
    pub(crate) efficiencies: EfficiencyMemo,
    pub(crate) predicted: Memo<PredictedError>,
}

impl Common {
    /// The plan of a scene with a wind and phase screens that others may share.
    ///
    /// # Errors
    /// As [`Plan::new`].
    pub(crate) fn plan(&self, scene: &SceneFile, target: Target) -> Result<Plan, Error> {
        // Turbulence is drawn with the seed.
        let seed = scene.content.eddies().map(|_| scene.content.seed);
        let cause = hash_of(&format!(
            "{:?}",
            (
                &scene.content.flow,
                &scene.content.added_flows,
                seed,
                scene.folder()
            )
        ));
        let wind = self.winds.get_or_make(cause, || SceneWind::new(scene))?;
        Plan::sharing(scene.clone(), target, wind, &self.efficiencies)
    }
}

/// Plans every case, and finds out whether it fits the memory; returns the forecast of the time of each, s of one core.
fn check(sweep: &Sweep, common: &Common, allow_large: bool) -> Result<Vec<f64>, Error> {
    let found: Vec<_> = sweep
        .cases
        .par_iter()
        .map(|case| check_case(case, common, allow_large))
        .collect();
    let refused = found.iter().filter(|found| found.is_err()).count();
    let mut core_s = Vec::with_capacity(found.len());
    for (case, found) in sweep.cases.iter().zip(found) {
        let others = refused.saturating_sub(1);
        core_s.push(found.map_err(|e| sweep.failed(case, others, e))?);
    }
    Ok(core_s)
}

fn check_case(case: &Case, common: &Common, allow_large: bool) -> Result<f64, Error> {
    let plan = common.plan(&case.scene, Target::Map)?;
    if !allow_large {
        plan.fits()?;
    }
    Ok(plan.core_s())
}

/// Places of the scenes with the same signals: those that differ in what is done with the records alone.
fn groups<'s>(scenes: impl Iterator<Item = &'s SceneFile>) -> Vec<Vec<usize>> {
    let mut groups: Vec<(String, Vec<usize>)> = Vec::new();
    for (place, file) in scenes.enumerate() {
        let signals = Scene {
            estimator: Estimator::default(),
            outputs: Outputs::default(),
            site: Site::default(),
            ..file.content.clone()
        };
        // Where each pulse samples the wind, a scan holds the wind of the pulses at the gates.
        let e = &file.content.estimator;
        let of_pulses = file.content.scan.wind_of_pulses;
        let gates = (of_pulses != WindOfPulses::default())
            .then_some((e.window_samples, e.gate_step_samples));
        let cause = hash_of(&format!("{:?}", (signals, gates, file.folder())));
        match groups.iter_mut().find(|(known, _)| *known == cause) {
            Some((_, group)) => group.push(place),
            None => groups.push((cause, vec![place])),
        }
    }
    groups.into_iter().map(|(_, group)| group).collect()
}

/// Cases in the same order, as many together as fit the memory.
fn batches(planned: Vec<(&Case, Plan)>) -> Vec<Vec<(&Case, Plan)>> {
    let room_bytes = machine::available_memory_bytes().map_or(f64::INFINITY, |bytes| SHARE * bytes);
    let mut batches: Vec<Vec<(&Case, Plan)>> = Vec::new();
    let mut held_bytes = 0.0;
    for (case, plan) in planned {
        // Beside what a run takes, the errors of each realisation are kept.
        let of_scan_bytes =
            9.0 * (plan.geometry.elevation_rad.len() * plan.geometry.gate_range_m.len()) as f64;
        let bytes = plan.memory_bytes() + plan.realisations() as f64 * of_scan_bytes;
        match batches.last_mut() {
            Some(batch) if held_bytes + bytes <= room_bytes => {
                held_bytes += bytes;
                batch.push((case, plan));
            }
            _ => {
                held_bytes = bytes;
                batches.push(vec![(case, plan)]);
            }
        }
    }
    batches
}

/// Wall-clock times of the cases that were run, s; they differ from run to run and are no part of the results.
fn write_times(
    out: &Path,
    name: &str,
    definition: &Definition,
    walls: &mut [(usize, f64)],
) -> Result<PathBuf, Error> {
    walls.sort_by_key(|(case, _)| *case);
    let table = Table::new()
        .int("case", walls.iter().map(|(case, _)| *case as i64))
        .float("wall_s", walls.iter().map(|(_, wall_s)| *wall_s))
        .int(
            "threads",
            walls.iter().map(|_| rayon::current_num_threads() as i64),
        );
    crate::io::write_atomic(&out.join(name), table.to_csv(&definition.origin())?)?;
    Ok(out.join(name))
}
