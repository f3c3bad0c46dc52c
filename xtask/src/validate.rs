//! `cargo xtask validate`: the flows with known answers, run at full resolution and drawn beside their references.
//!
//! The bars are printed with what was measured; the pictures and tables go to `target/validation`, from where the book takes
//! them. A bar that is missed is printed plainly and fails the task at its end.

mod bars;
mod flows;
mod pair;
mod parameters;
mod runs;

use crate::claim::Claim;
use crate::figures::context::Rendered;
use crate::profile::Profile;
use crate::workspace::{provenance, root, unless};
use fixtures::failure::{Failure, Outcome};
use std::path::PathBuf;
use std::time::Instant;
use wakescope_sim::io::Table;
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

/// What the comparison of a flow with its reference gives.
struct Shown {
    checks: Vec<Claim>,
    table: Table,
    figure: Figure,
}

type CaseFn = fn(Profile) -> Result<Shown, Failure>;

/// The cases, and the first profile that takes so long.
const CASES: [(&str, Profile, CaseFn); 13] = [
    ("les_order", Profile::Quick, flows::order),
    ("les_waves", Profile::Quick, flows::waves),
    ("les_dipole_625", Profile::Quick, |profile| {
        flows::dipole(625.0, profile)
    }),
    ("les_dipole_1250", Profile::Quick, |profile| {
        flows::dipole(1250.0, profile)
    }),
    ("les_cavity", Profile::Quick, flows::cavity),
    ("les_vortices", Profile::Quick, flows::turbulent_vortices),
    ("les_pair", Profile::Quick, pair::show),
    ("les_hyperbola", Profile::Quick, pair::show_hyperbola),
    ("les_wake_coarse", Profile::Quick, |_| bars::show_coarse()),
    ("les_wake_medium", Profile::Standard, |_| {
        bars::show_medium()
    }),
    ("wake_onset", Profile::Quick, parameters::onset_by_noise),
    ("wake_crosswind", Profile::Quick, parameters::cross_wind),
    ("les_channel", Profile::Full, |_| flows::channel()),
];

/// Runs the cases, prints the checks, writes tables and pictures.
///
/// # Errors
/// A case that cannot be run, a bar that is missed, an unusable output.
pub(crate) fn run(options: &Options) -> Outcome {
    let folder = options
        .out
        .clone()
        .unwrap_or_else(|| root().join("target/validation"));
    println!(
        "{:<16} {:<46} {:>13} {:>24}  verdict",
        "case", "quantity", "measured", "reference"
    );
    let mut missed = Vec::new();
    let mut show = |name: &str, shown: Result<Shown, Failure>, start: Instant| -> Outcome {
        let shown = shown?;
        for claim in &shown.checks {
            let Claim {
                statement,
                expected,
                measured,
                ..
            } = claim;
            let verdict = if claim.passes() { "pass" } else { "MISSED" };
            println!("{name:<16} {statement:<46} {measured:>13} {expected:>24}  {verdict}");
            missed.extend((!claim.passes()).then(|| format!("{name}: {statement}")));
        }
        println!("{name:<16} took {:.1} s", start.elapsed().as_secs_f64());
        let origin = provenance(
            &format!(
                "case = \"{name}\"\nprofile = \"{}\"\n",
                options.profile.name()
            ),
            0,
        );
        let text = |get: fn(&Claim) -> &str| shown.checks.iter().map(get);
        let checks = Table::new()
            .text("quantity", text(|c| &c.statement))
            .text("measured", text(|c| &c.measured))
            .text("expected", text(|c| &c.expected))
            .text("verdict", text(|c| c.verdict.name()));
        let mut files =
            Rendered::new(&shown.table, &shown.figure, &origin)?.files_in(&folder, name)?;
        files.add(&format!("{name}_checks.csv"), checks.to_csv(&origin)?)?;
        Ok(files.commit().map(drop)?)
    };
    if let Some(run) = &options.wake {
        show("les_wake_files", bars::show_files(run), Instant::now())?;
    } else {
        let wanted = |name: &str| {
            options
                .only
                .as_ref()
                .is_none_or(|word| name.contains(word.as_str()))
        };
        for (name, _, of) in CASES
            .into_iter()
            .filter(|case| wanted(case.0) && options.profile >= case.1)
        {
            let start = Instant::now();
            show(name, of(options.profile), start)?;
        }
    }
    println!("pictures and tables in {}", folder.display());
    unless("bars missed", &missed)
}
