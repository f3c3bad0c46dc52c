//! `cargo xtask reproduce-figs`: draws the figures, measures the claims, writes one report.
//!
//! Each figure is written as soon as it is made, and kept in a cache whose key is what it depends on: a second run draws
//! only what has changed, and an interrupted one goes on where it was. Figures of the wake are drawn beside the others, for each
//! leaves a core idle at times; those that measure times come last, alone.

mod cache;
mod report;

use crate::claim::{Claim, Kind};
use crate::cost::clock_s;
use crate::figures::context::{Context, Rendered};
use crate::figures::{self, Figure, Lane};
use crate::workspace::root;
use fixtures::failure::{Failure, Outcome};
use indicatif::{ProgressBar, ProgressStyle};
use rayon::ThreadPool;
use rustix::time::ClockId;
use std::path::{Path, PathBuf};
use std::time::Instant;
use wakescope_sim::io::{Table, write_atomic};

/// Options of the task.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Numbers of the figures to draw, such as 1,5; the default is all.
    #[arg(long, value_delimiter = ',', value_name = "LIST")]
    only: Vec<u32>,
    /// Folder to write to.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Threads to compute with; the default is one for each core. Results do not depend on it.
    #[arg(long, default_value_t = 0, value_name = "N")]
    threads: usize,
    #[command(flatten)]
    context: Context,
}

/// Runs the task.
///
/// # Errors
/// Unknown figure, unusable output, or a figure that cannot be computed. A failed claim is no error.
pub(crate) fn run(options: &Options) -> Outcome {
    let chosen = choose(&options.only)?;
    let out = options
        .out
        .clone()
        .unwrap_or_else(|| root().join("target/figures"));
    std::fs::create_dir_all(&out)
        .map_err(|e| Failure::new(format!("cannot write to {}: {e}", out.display())))?;
    let context = &options.context;
    let bar = progress_bar(chosen.len() as u64);
    let start = Instant::now();
    let draw = |lane: Lane| -> Result<Vec<(&'static Figure, Rendered)>, Failure> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(options.threads)
            .build()?;
        let of_lane = chosen.iter().filter(|figure| figure.lane() == lane);
        of_lane
            .map(|figure| Ok((*figure, drawn(figure, context, (&pool, &bar, &out))?)))
            .collect()
    };
    let (of_wake, others) = if options.threads == 0 {
        std::thread::scope(|scope| {
            let beside = scope.spawn(|| draw(Lane::Wake));
            let others = draw(Lane::Formula);
            (beside.join(), others)
        })
    } else {
        // No more threads than were asked for.
        (Ok(draw(Lane::Wake)), draw(Lane::Formula))
    };
    let mut done =
        of_wake.map_err(|_| Failure::new("a figure of the wake stopped short".into()))??;
    done.extend(others?);
    done.extend(draw(Lane::Alone)?);
    done.sort_by_key(|(figure, _)| figures::ALL.iter().position(|of| of.id == figure.id));
    bar.finish_and_clear();
    finish(&out, context, &done, start.elapsed().as_secs_f64())
}

/// One figure, from the cache or made by the threads of the pool, and written.
fn drawn(
    figure: &'static Figure,
    context: &Context,
    (pool, bar, out): (&ThreadPool, &ProgressBar, &Path),
) -> Result<Rendered, Failure> {
    bar.set_message(figure.id);
    // The key of the cache knows nothing of a wake from elsewhere.
    let is_other = context.wake.is_some();
    let place = cache::Place::new(figure.id, context)?;
    let cached = if context.anew || is_other {
        None
    } else {
        place.load()
    };
    let from_cache = cached.is_some();
    let rendered = match cached {
        Some(rendered) => rendered,
        None => {
            // Of the other lane the process's own clock would count the work, too.
            let used_s = || match figure.lane() {
                Lane::Alone => clock_s(ClockId::ProcessCPUTime),
                Lane::Wake | Lane::Formula => pool
                    .broadcast(|_| clock_s(ClockId::ThreadCPUTime))
                    .into_iter()
                    .sum(),
            };
            let (before_s, start) = (used_s(), Instant::now());
            let mut rendered = pool.install(|| (figure.make)(context))?;
            rendered.caption = figure.caption(&std::mem::take(&mut rendered.values))?;
            rendered
                .claims
                .iter_mut()
                .for_each(|claim| claim.figure = figure.id.into());
            rendered.took_s = [start.elapsed().as_secs_f64(), used_s() - before_s];
            if !is_other {
                place.store(&rendered)?;
            }
            rendered
        }
    };
    rendered.files_in(out, figure.id)?.commit()?;
    bar.inc(1);
    bar.println(format!(
        "{}{}: {}",
        figure.id,
        if from_cache { " (cached)" } else { "" },
        figure.title
    ));
    Ok(rendered)
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
        .text("figure", done.iter().map(|(figure, _)| figure.id))
        .text("stage", done.iter().map(|_| report::STAGE))
        .float("wall_s", done.iter().map(|(_, r)| r.took_s[0]))
        .float("core_s", done.iter().map(|(_, r)| r.took_s[1]));
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
    Ok(())
}

fn claims_table(claims: &[&Claim]) -> Table {
    let text = |get: fn(&Claim) -> String| claims.iter().map(|c| get(c)).collect::<Vec<_>>();
    Table::new()
        .text("id", text(|c| c.id.to_owned()))
        .text("figure", text(|c| c.figure.to_owned()))
        .text("statement", text(|c| c.statement.clone()))
        .text("expected", text(|c| c.expected.clone()))
        .text("measured", text(|c| c.measured.clone()))
        .float("standard_error", claims.iter().map(|c| c.standard_error))
        .text("verdict", text(|c| c.verdict.name().to_owned()))
        .text("kind", text(|c| c.kind().name().to_owned()))
        .text("source", text(|c| c.source()))
        .text("decided_by", text(|c| c.decided_by.clone()))
}
