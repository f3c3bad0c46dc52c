//! `cargo xtask validate`: the flows with known answers, run at full resolution and drawn beside their references.
//!
//! The bars are printed with what was measured; the pictures and tables go to `target/validation`, from where the book takes
//! them. A bar that is missed is printed plainly and fails the task at its end.

mod cavity;
mod channel;
mod dipole;
mod order;
mod pair;
mod shown;
mod vortices;
mod wake;
mod waves;

use crate::claim::Claim;
use crate::profile::Profile;
use crate::workspace::{provenance, root};
use fixtures::failure::{Failure, Outcome};
use shown::Shown;
use std::path::PathBuf;
use std::time::Instant;
use wakescope_sim::io::{FileGroup, Table};

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
    ("les_wake_coarse", wake::bars::show_coarse),
    ("les_wake_medium", wake::bars::show_medium),
    ("wake_onset", wake::onset::show),
    ("wake_crosswind", wake::crosswind::show),
    ("les_channel", channel::show),
];

/// Runs the cases, prints the checks, writes tables and pictures.
///
/// # Errors
/// A case that cannot be run, a bar that is missed, an unusable output.
pub(crate) fn run(options: &Options) -> Outcome {
    let folder = options.out.clone().unwrap_or_else(|| root().join("target/validation"));
    let wanted = |name: &str| options.only.as_ref().is_none_or(|word| name.contains(word.as_str()));
    println!("{:<16} {:<46} {:>13} {:>24}  verdict", "case", "quantity", "measured", "reference");
    let mut missed = Vec::new();
    type Make<'a> = Box<dyn Fn() -> Result<Shown, Failure> + 'a>;
    let is_long = |name: &str| {
        (name == "les_channel" && options.profile != Profile::Full)
            || (name == "les_wake_medium" && options.profile == Profile::Quick)
    };
    let cases: Vec<(&str, Make)> = match &options.wake {
        Some(run) => vec![("les_wake_files", Box::new(move || wake::bars::show_files(run)))],
        None => CASES
            .into_iter()
            .filter(|case| wanted(case.0) && !is_long(case.0))
            .map(|(name, show)| (name, Box::new(move || show(options.profile)) as Make))
            .collect(),
    };
    for (name, show) in cases {
        let start = Instant::now();
        let shown = show()?;
        for claim in &shown.checks {
            let Claim { statement, expected, measured, .. } = claim;
            let verdict = if claim.passes() { "pass" } else { "MISSED" };
            println!("{name:<16} {statement:<46} {measured:>13} {expected:>24}  {verdict}");
            if !claim.passes() {
                missed.push(format!("{name}: {statement}"));
            }
        }
        println!("{name:<16} took {:.1} s", start.elapsed().as_secs_f64());
        write(name, options.profile, &shown, &folder)?;
    }
    println!("pictures and tables in {}", folder.display());
    if missed.is_empty() { Ok(()) } else { Err(Failure::new(format!("bars missed: {}", missed.join("; ")))) }
}

fn write(name: &str, profile: Profile, shown: &Shown, folder: &std::path::Path) -> Outcome {
    let parameters = format!("case = \"{name}\"\nprofile = \"{}\"\n", profile.name());
    let origin = provenance(&parameters, 0);
    let text = |get: fn(&Claim) -> &str| shown.checks.iter().map(get).collect::<Vec<_>>();
    let checks = Table::new()
        .text("quantity", text(|c| &c.statement))
        .text("measured", text(|c| &c.measured))
        .text("expected", text(|c| &c.expected))
        .text("verdict", text(|c| c.verdict.name()));
    let mut files = FileGroup::new(folder);
    files.add(&format!("{name}.csv"), shown.table.to_csv(&origin)?)?;
    files.add(&format!("{name}_checks.csv"), checks.to_csv(&origin)?)?;
    shown.figure.add_to(&mut files, name, &origin)?;
    files.commit()?;
    Ok(())
}
