//! `cargo xtask reproduce-figs`: draws the figures, measures the claims, writes one report.
//!
//! Each figure is written as soon as it is made, and kept in a cache whose key is what it depends on: a second run draws
//! only what has changed, and an interrupted one goes on where it was. Two figures are drawn at a time; those that measure
//! times come last, alone.

mod cache;
mod report;

use crate::claim::{Claim, Kind};
use crate::cost::clock_s;
use crate::figures::context::{Context, Rendered, column};
use crate::figures::{self, Figure, Lane};
use crate::profile::Profile;
use crate::statistics::Verdict;
use crate::workspace::root;
use fixtures::failure::{Failure, Outcome};
use rayon::ThreadPool;
use rustix::time::ClockId;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Instant;
use wakescope_sim::io::{Table, write_atomic};

/// Runs the task.
///
/// # Errors
/// Unknown figure, unusable output, a figure that cannot be computed, or a claim of the program's own that fails. A claim
/// of the chapter that fails is a result.
pub(crate) fn run(
    only: &[u32],
    out: Option<PathBuf>,
    threads: usize,
    context: &Context,
) -> Outcome {
    let chosen = choose(only)?;
    let out = out.unwrap_or_else(|| root().join("target/figures"));
    std::fs::create_dir_all(&out)
        .map_err(|e| Failure::new(format!("cannot write to {}: {e}", out.display())))?;
    let run = Run {
        chosen: &chosen,
        context,
        threads: match threads {
            0 => std::thread::available_parallelism()?.get(),
            threads => threads,
        },
        out: &out,
        start: Instant::now(),
        is_taken: chosen.iter().map(|_| AtomicBool::new(false)).collect(),
        finished: AtomicUsize::new(0),
    };
    run.announce()?;
    let mut done = run.draw_side_by_side()?;
    done.extend(run.draw(&[Lane::Alone], 1)?);
    done.sort_by_key(|(figure, _)| figures::ALL.iter().position(|of| of.id == figure.id));
    finish(&out, context, &done, run.start.elapsed().as_secs_f64())
}

/// Prints a line at once, also into a file or a pipe.
fn say(line: &str) -> Outcome {
    let mut stdout = std::io::stdout().lock();
    writeln!(stdout, "{line}")?;
    stdout.flush()?;
    Ok(())
}

/// Figures with what they gave.
type Done = Vec<(&'static Figure, Rendered)>;

/// What all figures of a run have in common.
struct Run<'r> {
    chosen: &'r [&'static Figure],
    context: &'r Context,
    threads: usize,
    out: &'r Path,
    start: Instant,
    /// Which of the chosen figures are being drawn or are drawn.
    is_taken: Vec<AtomicBool>,
    /// Number of figures that are written.
    finished: AtomicUsize,
}

impl Run<'_> {
    /// Says what will be drawn, how long it takes and where the report will be.
    fn announce(&self) -> Outcome {
        let mut cached = 0;
        let mut core_s = 0.0;
        for figure in self.chosen {
            if self.cached(figure)?.is_some() {
                cached += 1;
            } else {
                core_s += figure.quick_core_s;
            }
        }
        let profile = self.context.profile;
        let from_cache = match cached {
            0 => String::new(),
            cached => format!(" ({cached} from the cache)"),
        };
        say(&format!(
            "Drawing {} figures and tables of the chapter{from_cache} with the profile {}: {}.",
            self.chosen.len(),
            profile.name(),
            run_time(profile, core_s, self.threads)
        ))?;
        say(&format!(
            "The report will be {}",
            self.out.join("index.html").display()
        ))
    }

    /// Two figures at a time, each with half of the threads, so that one goes on while the threads of the other wait for
    /// each other. One side begins with the figures of the wake, since the first of them
    /// may have to run it, the other one with the rest.
    fn draw_side_by_side(&self) -> Result<Done, Failure> {
        let half = self.threads / 2;
        if half == 0 {
            return self.draw(&[Lane::Wake, Lane::Formula], self.threads);
        }
        std::thread::scope(|scope| {
            let beside = scope.spawn(|| self.draw(&[Lane::Wake, Lane::Formula], half));
            let here = self.draw(&[Lane::Formula, Lane::Wake], self.threads - half);
            let mut done = beside
                .join()
                .map_err(|_| Failure::new("a figure panicked".into()))??;
            done.extend(here?);
            Ok(done)
        })
    }

    /// The chosen figures of some lanes that nobody else has taken, one after the other.
    fn draw(&self, lanes: &[Lane], threads: usize) -> Result<Done, Failure> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()?;
        let mut done = Vec::new();
        for lane in lanes {
            for (figure, is_taken) in self.chosen.iter().zip(&self.is_taken) {
                if figure.lane() == *lane && !is_taken.swap(true, Ordering::Relaxed) {
                    done.push((*figure, self.figure(figure, &pool)?));
                }
            }
        }
        Ok(done)
    }

    /// A figure from the cache, if it is there and may be taken.
    fn cached(&self, figure: &Figure) -> Result<Option<Rendered>, Failure> {
        // The key of the cache does not include a wake from elsewhere.
        if self.context.anew || self.context.wake.is_some() {
            return Ok(None);
        }
        Ok(cache::load(
            figure.id,
            &cache::folder(figure.id, self.context)?,
        ))
    }

    /// One figure, from the cache or made by the threads of the pool, and written.
    fn figure(&self, figure: &'static Figure, pool: &ThreadPool) -> Result<Rendered, Failure> {
        let cached = self.cached(figure)?;
        let note = if cached.is_some() { " (cached)" } else { "" };
        let rendered = match cached {
            Some(rendered) => rendered,
            None => {
                let rendered = make(figure, self.context, pool)?;
                if self.context.wake.is_none() {
                    let folder = cache::folder(figure.id, self.context)?;
                    cache::store(figure.id, &folder, &rendered)?;
                }
                rendered
            }
        };
        rendered.files_in(self.out, figure.id)?.commit()?;
        let finished = self.finished.fetch_add(1, Ordering::Relaxed) + 1;
        say(&format!(
            "[{finished:>2}/{}] {:>6}  {}{note}",
            self.chosen.len(),
            minutes(self.start.elapsed().as_secs_f64()),
            figure.heading()
        ))?;
        Ok(rendered)
    }
}

/// A time as minutes and seconds.
fn minutes(time_s: f64) -> String {
    let whole_s = time_s.round() as u64;
    format!("{}:{:02}", whole_s / 60, whole_s % 60)
}

/// Forecast of the time of a run from the processor time that its figures need with the profile quick.
fn run_time(profile: Profile, quick_core_s: f64, cores: usize) -> String {
    let wall_s = quick_core_s / cores as f64;
    let time = match profile {
        _ if quick_core_s == 0.0 => "seconds".into(),
        Profile::Quick if wall_s < 60.0 => "less than a minute".into(),
        Profile::Quick => format!("about {:.0} minutes", (wall_s / 60.0).ceil()),
        Profile::Standard => "tens of minutes".into(),
        Profile::Full => "a day or more".into(),
    };
    let plural = if cores == 1 { "" } else { "s" };
    format!("{time} on {cores} core{plural}")
}

/// A figure made by the threads of a pool.
fn make(figure: &Figure, context: &Context, pool: &ThreadPool) -> Result<Rendered, Failure> {
    let before_s = used_s(figure.lane(), pool);
    let start = Instant::now();
    let mut rendered = pool.install(|| (figure.make)(context))?;
    rendered.caption = figure.caption(&std::mem::take(&mut rendered.values))?;
    for claim in &mut rendered.claims {
        claim.figure = figure.id.into();
    }
    let cpu_s = used_s(figure.lane(), pool) - before_s;
    rendered.took_s = [start.elapsed().as_secs_f64(), cpu_s];
    Ok(rendered)
}

/// Processor time so far \[s\]: of this process, or of the threads of a pool where the process works on the other lane, too.
fn used_s(lane: Lane, pool: &ThreadPool) -> f64 {
    match lane {
        Lane::Alone => clock_s(ClockId::ProcessCPUTime),
        Lane::Wake | Lane::Formula => {
            let threads_s = pool.broadcast(|_| clock_s(ClockId::ThreadCPUTime));
            threads_s.into_iter().sum()
        }
    }
}

fn choose(only: &[u32]) -> Result<Vec<&'static Figure>, Failure> {
    let numbers: Vec<u32> = figures::ALL.iter().map(|f| f.number).collect();
    if let Some(unknown) = only.iter().find(|n| !numbers.contains(n)) {
        return Err(Failure::new(format!(
            "--only {unknown}: there are {numbers:?}"
        )));
    }
    Ok(figures::ALL
        .iter()
        .filter(|f| only.is_empty() || only.contains(&f.number))
        .collect())
}

/// Writes the tables over all figures and the report, and says what the claims came to.
fn finish(out: &Path, context: &Context, done: &[(&Figure, Rendered)], run_s: f64) -> Outcome {
    let claims: Vec<&Claim> = done.iter().flat_map(|(_, r)| &r.claims).collect();
    write_atomic(
        &out.join("claims.csv"),
        claims_table(&claims).to_csv(&context.provenance_of_run())?,
    )?;
    let table = Table::new()
        .text("figure", column(done, |(figure, _)| figure.id))
        .text("stage", column(done, |_| report::STAGE))
        .float("wall_s", column(done, |(_, r)| r.took_s[0]))
        .float("core_s", column(done, |(_, r)| r.took_s[1]));
    write_atomic(
        &out.join("timings.csv"),
        table.to_csv(&context.provenance_of_run())?,
    )?;
    write_atomic(&out.join("index.html"), report::html(context, done, run_s)?)?;
    let report = out.join("index.html");
    say(&format!("Report: {}", report.display()))?;
    let of_chapter = report::Count::new(claims.iter().copied(), Kind::Chapter);
    let of_program = report::Count::new(claims.iter().copied(), Kind::Own);
    let hint = match (of_chapter.open, context.profile) {
        (1.., Profile::Quick) => " (--profile standard has more data)",
        _ => "",
    };
    say(&format!("Statements of the chapter: {of_chapter}{hint}"))?;
    say(&format!("Checks of the program itself: {of_program}"))?;
    say(&format!("Run time: {}", report::duration(run_s)))?;
    let failed: Vec<&str> = claims
        .iter()
        .filter(|claim| claim.kind() != Kind::Chapter && claim.verdict == Verdict::Fail)
        .map(|claim| claim.id.as_str())
        .collect();
    if failed.is_empty() {
        return Ok(());
    }
    Err(Failure::new(format!(
        "what the program claims of itself does not hold: {}",
        failed.join(", ")
    )))
}

fn claims_table(claims: &[&Claim]) -> Table {
    Table::new()
        .text("id", column(claims, |c| &c.id))
        .text("figure", column(claims, |c| &c.figure))
        .text("statement", column(claims, |c| &c.statement))
        .text("expected", column(claims, |c| &c.expected))
        .text("measured", column(claims, |c| c.all_measured()))
        .float("standard_error", column(claims, |c| c.standard_error))
        .text("verdict", column(claims, |c| c.verdict.name()))
        .text("kind", column(claims, |c| c.kind().name()))
        .text("source", column(claims, |c| c.source()))
        .text("decided_by", column(claims, |c| &c.decided_by))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A run of the first figure with one claim, which fails.
    fn finished(claim: &str) -> (tempfile::TempDir, Outcome) {
        let temp = tempfile::tempdir().unwrap();
        let context = Context {
            profile: Profile::Quick,
            seed: 1,
            stages: temp.path().into(),
            anew: false,
            wake: None,
            analytic: false,
        };
        let rendered = Rendered {
            files: vec![("csv".into(), b"a\n1\n".to_vec())],
            claims: vec![Claim::exact(claim, "2".into(), false)],
            ..Rendered::default()
        };
        let outcome = finish(temp.path(), &context, &[(&figures::ALL[0], rendered)], 1.0);
        (temp, outcome)
    }

    #[test]
    fn an_own_claim_that_fails_is_an_error_after_the_report() {
        let (temp, outcome) = finished("F16");
        assert!(outcome.unwrap_err().to_string().ends_with("F16"));
        assert!(temp.path().join("index.html").exists());
        // One of the chapter is a result.
        assert!(finished("F13").1.is_ok());
    }

    #[test]
    fn forecasts_are_in_minutes_of_the_cores_of_the_run() {
        assert_eq!(
            [(290.0, 2), (20.0, 1), (0.0, 4)].map(|(core_s, cores)| run_time(
                Profile::Quick,
                core_s,
                cores
            )),
            [
                "about 3 minutes on 2 cores",
                "less than a minute on 1 core",
                "seconds on 4 cores"
            ]
        );
        assert_eq!(minutes(125.0), "2:05");
    }
}
