//! `cargo xtask validate`: the flows with known answers, run at full resolution and drawn beside their references.
//!
//! The bars are printed with what was measured; the pictures and tables go to `target/validation`, from where the book takes
//! them. A bar that is missed is printed plainly and fails the task at its end.

mod cavity;
mod channel;
mod dipole;
mod order;
mod pair;
mod vortices;
mod wake;
mod waves;

pub(crate) use wake::{knee, onset};

use crate::workspace::{read, root};
use crate::{Failure, Outcome};
use std::path::PathBuf;
use std::time::Instant;
use wakescope_sim::export::{FileGroup, Provenance, Table};
use wakescope_sim::plot::Figure;

/// Options of the task.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Only the cases whose name contains this.
    #[arg(long, value_name = "WORD")]
    only: Option<String>,
    /// How fine the meshes are.
    #[arg(long, value_enum, default_value_t = Profile::Quick)]
    profile: Profile,
    /// Folder of a finished `wakescope wake` in the flow of `coarse` or `medium`: that alone is compared.
    #[arg(long, value_name = "DIR")]
    wake: Option<PathBuf>,
    /// Folder to write to.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// How much is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Profile {
    /// Coarse meshes and short times, minutes in all; most bars are then wider.
    Quick,
    /// The meshes of the bars, an hour or so.
    Standard,
    /// The standard ones, and the turbulent channel.
    Full,
}

/// One comparison with a bar.
pub(crate) struct Check {
    pub(crate) quantity: String,
    pub(crate) measured: f64,
    pub(crate) reference: f64,
    pub(crate) bar: Bar,
}

/// What a measured value may be beside its reference.
pub(crate) enum Bar {
    /// At most so far from it, in the unit of the quantity.
    Within(f64),
    /// Not below it.
    AtLeast,
    /// Not above it.
    AtMost,
}

impl Check {
    /// Within `share` of the reference.
    pub(crate) fn relative(quantity: &str, measured: f64, reference: f64, share: f64) -> Self {
        Self { quantity: quantity.into(), measured, reference, bar: Bar::Within(share * reference.abs()) }
    }

    /// At least `reference`.
    pub(crate) fn at_least(quantity: &str, measured: f64, reference: f64) -> Self {
        Self { quantity: quantity.into(), measured, reference, bar: Bar::AtLeast }
    }

    /// At most `reference`.
    pub(crate) fn at_most(quantity: &str, measured: f64, reference: f64) -> Self {
        Self { quantity: quantity.into(), measured, reference, bar: Bar::AtMost }
    }

    /// A value that is not a number passes no bar.
    fn passes(&self) -> bool {
        match self.bar {
            Bar::Within(allowed) => (self.measured - self.reference).abs() <= allowed,
            Bar::AtLeast => self.measured >= self.reference,
            Bar::AtMost => self.measured <= self.reference,
        }
    }

    fn bar_words(&self) -> String {
        match self.bar {
            Bar::Within(allowed) => format!("+- {allowed:.2e}"),
            Bar::AtLeast => "at least".into(),
            Bar::AtMost => "at most".into(),
        }
    }
}

/// What a case shows.
pub(crate) struct Shown {
    pub(crate) checks: Vec<Check>,
    pub(crate) table: Table,
    pub(crate) figure: Figure,
}

type CaseFn = fn(Profile) -> Result<Shown, Failure>;

const CASES: [(&str, CaseFn); 13] = [
    ("les_order", order::show),
    ("les_waves", waves::show),
    ("les_dipole_625", dipole::show_625),
    ("les_dipole_1250", dipole::show_1250),
    ("les_cavity", cavity::show),
    ("les_vortices", vortices::show),
    ("les_pair", pair::show),
    ("les_hyperbola", pair::show_hyperbola),
    ("les_wake_coarse", wake::show_coarse),
    ("les_wake_medium", wake::show_medium),
    ("wake_onset", wake::show_onset),
    ("wake_crosswind", wake::show_crosswind),
    ("les_channel", channel::show),
];

/// Runs the cases, prints the checks, writes tables and pictures.
///
/// # Errors
/// A case that cannot be run, a bar that is missed, an unusable output.
pub(crate) fn run(options: &Options) -> Outcome {
    let folder = options.out.clone().unwrap_or_else(|| root().join("target/validation"));
    let wanted = |name: &str| options.only.as_ref().is_none_or(|word| name.contains(word.as_str()));
    println!("{:<16} {:<46} {:>13} {:>13} {:>12}  verdict", "case", "quantity", "measured", "reference", "bar");
    let mut missed = Vec::new();
    type Make<'a> = Box<dyn Fn() -> Result<Shown, Failure> + 'a>;
    let is_long = |name: &str| {
        (name == "les_channel" && options.profile != Profile::Full)
            || (name == "les_wake_medium" && options.profile == Profile::Quick)
    };
    let cases: Vec<(&str, Make)> = match &options.wake {
        Some(run) => vec![("les_wake_files", Box::new(move || wake::show_files(run)))],
        None => CASES
            .into_iter()
            .filter(|case| wanted(case.0) && !is_long(case.0))
            .map(|(name, show)| (name, Box::new(move || show(options.profile)) as Make))
            .collect(),
    };
    for (name, show) in cases {
        let start = Instant::now();
        let shown = show()?;
        for check in &shown.checks {
            let verdict = if check.passes() { "pass" } else { "MISSED" };
            println!(
                "{name:<16} {:<46} {:>13.6} {:>13.6} {:>12}  {verdict}",
                check.quantity,
                check.measured,
                check.reference,
                check.bar_words()
            );
            if !check.passes() {
                missed.push(format!("{name}: {}", check.quantity));
            }
        }
        println!("{name:<16} took {:.1} s", start.elapsed().as_secs_f64());
        write(name, options.profile, &shown, &folder)?;
    }
    println!("pictures and tables in {}", folder.display());
    if missed.is_empty() { Ok(()) } else { Err(Failure::new(format!("bars missed: {}", missed.join("; ")))) }
}

fn write(name: &str, profile: Profile, shown: &Shown, folder: &std::path::Path) -> Outcome {
    let parameters = format!("case = \"{name}\"\nprofile = \"{profile:?}\"\n").to_lowercase();
    let origin = Provenance {
        program: wakescope_sim::PROGRAM.into(),
        scene_hash: wakescope_sim::scene::hash_of(&parameters),
        scene_toml: parameters,
        seed: 0,
    };
    let checks = Table::new()
        .text("quantity", shown.checks.iter().map(|c| c.quantity.clone()))
        .float("measured", shown.checks.iter().map(|c| c.measured))
        .float("reference", shown.checks.iter().map(|c| c.reference))
        .text("bar", shown.checks.iter().map(Check::bar_words));
    let mut files = FileGroup::new(folder);
    files.add(&format!("{name}.csv"), shown.table.to_csv(&origin)?)?;
    files.add(&format!("{name}_checks.csv"), checks.to_csv(&origin)?)?;
    files.add(&format!("{name}.svg"), shown.figure.svg(&origin)?)?;
    files.add(&format!("{name}.png"), shown.figure.png(&origin)?)?;
    files.commit()?;
    Ok(())
}

/// Numbers of a reference file without its comments, row by row.
pub(crate) fn numbers(file: &str) -> Result<Vec<Vec<f64>>, Failure> {
    let text = read(&format!("tests/reference/les/{file}"))?;
    let rows = text.lines().filter(|line| !line.starts_with('#'));
    let parse = |line: &str| line.split(',').map(|cell| cell.trim().parse().ok()).collect::<Option<Vec<f64>>>();
    Ok(rows.filter_map(parse).collect())
}

/// Linear interpolation in points of increasing abscissa.
pub(crate) fn interpolate(points: &[(f64, f64)], x: f64) -> f64 {
    let i = points.partition_point(|p| p.0 < x).clamp(1, points.len().max(2) - 1);
    let (a, b) = (points[i - 1], points[i]);
    a.1 + (b.1 - a.1) * (x - a.0) / (b.0 - a.0)
}

/// The extremum of the parabola through three points.
pub(crate) fn parabola_vertex([a, b, c]: [(f64, f64); 3]) -> (f64, f64) {
    let (left, right) = ((b.1 - a.1) / (b.0 - a.0), (c.1 - b.1) / (c.0 - b.0));
    let bend = (right - left) / (c.0 - a.0);
    let x = 0.5 * (a.0 + b.0) - left / (2.0 * bend);
    (x, a.1 + left * (x - a.0) + bend * (x - a.0) * (x - b.0))
}
