//! `cargo xtask reproduce-figs`: draws the figures, measures the claims, writes one report.
//!
//! Each figure is written as soon as it is made, and kept in a cache whose key is what it depends on: a second run draws
//! only what has changed, and an interrupted one goes on where it was. Figures of the wake are drawn beside the others, for each
//! leaves a core idle at times; those that measure times come last, alone.

mod cache;
mod report;

use crate::claim::{Claim, Kind};
use crate::cost::clock_s;
use crate::figures::context::{Context, Rendered, column};
use crate::figures::{self, Figure, Lane};
use crate::statistics::Verdict;
use crate::workspace::root;
use fixtures::failure::{Failure, Outcome};
use indicatif::{ProgressBar, ProgressStyle};
use rayon::ThreadPool;
use rustix::time::ClockId;
use std::path::{Path, PathBuf};
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
    let start = Instant::now();
    let bar = progress_bar(chosen.len() as u64);
    let run = Run {
        chosen: &chosen,
        context,
        threads,
        out: &out,
        bar: &bar,
    };
    let mut done = if threads == 0 {
        run.draw_side_by_side()?
    } else {
        // No more threads than were requested.
        let mut done = run.draw(Lane::Wake)?;
        done.extend(run.draw(Lane::Formula)?);
        done
    };
    done.extend(run.draw(Lane::Alone)?);
    done.sort_by_key(|(figure, _)| figures::ALL.iter().position(|of| of.id == figure.id));
    bar.finish_and_clear();
    finish(&out, context, &done, start.elapsed().as_secs_f64())
}

/// Figures with what they gave.
type Done = Vec<(&'static Figure, Rendered)>;

/// What all figures of a run have in common.
struct Run<'r> {
    chosen: &'r [&'static Figure],
    context: &'r Context,
    threads: usize,
    out: &'r Path,
    bar: &'r ProgressBar,
}

impl Run<'_> {
    /// Figures of the wake and those of formulas at once.
    fn draw_side_by_side(&self) -> Result<Done, Failure> {
        std::thread::scope(|scope| {
            let beside = scope.spawn(|| self.draw(Lane::Wake));
            let formulas = self.draw(Lane::Formula);
            let mut done = beside
                .join()
                .map_err(|_| Failure::new("a figure of the wake panicked".into()))??;
            done.extend(formulas?);
            Ok(done)
        })
    }

    /// The chosen figures of a lane, one after the other.
    fn draw(&self, lane: Lane) -> Result<Done, Failure> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(self.threads)
            .build()?;
        let mut done = Vec::new();
        for figure in self.chosen {
            if figure.lane() == lane {
                done.push((*figure, self.figure(figure, &pool)?));
            }
        }
        Ok(done)
    }

    /// One figure, from the cache or made by the threads of the pool, and written.
    fn figure(&self, figure: &'static Figure, pool: &ThreadPool) -> Result<Rendered, Failure> {
        self.bar.set_message(figure.id);
        // The key of the cache knows nothing of a wake from elsewhere.
        let is_other = self.context.wake.is_some();
        let folder = cache::folder(figure.id, self.context)?;
        let cached = if self.context.anew || is_other {
            None
        } else {
            cache::load(figure.id, &folder)
        };
        let note = if cached.is_some() { " (cached)" } else { "" };
        let rendered = match cached {
            Some(rendered) => rendered,
            None => {
                let rendered = make(figure, self.context, pool)?;
                if !is_other {
                    cache::store(figure.id, &folder, &rendered)?;
                }
                rendered
            }
        };
        rendered.files_in(self.out, figure.id)?.commit()?;
        self.bar.inc(1);
        self.bar
            .println(format!("{}{note}: {}", figure.id, figure.title));
        Ok(rendered)
    }
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

fn progress_bar(length: u64) -> ProgressBar {
    let style =
        ProgressStyle::with_template("[{bar:32}] {pos}/{len} {msg}  {elapsed} gone, {eta} left")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::new(length).with_style(style);
    bar.enable_steady_tick(std::time::Duration::from_millis(250));
    bar
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
    for claim in &claims {
        println!("{:<8}{claim}", claim.kind().name());
    }
    println!(
        "the chapter's {}\nthe program's own {}\nreport: {}",
        report::counted(Kind::Chapter, &claims),
        report::counted(Kind::Own, &claims),
        out.join("index.html").display()
    );
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
        .text("measured", column(claims, |c| &c.measured))
        .float("standard_error", column(claims, |c| c.standard_error))
        .text("verdict", column(claims, |c| c.verdict.name()))
        .text("kind", column(claims, |c| c.kind().name()))
        .text("source", column(claims, |c| c.source()))
        .text("decided_by", column(claims, |c| &c.decided_by))
}
