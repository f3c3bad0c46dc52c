//! Options that have no effect on some inputs or beside some other options: given there, they are
//! refused with the reason.
//!
//! Check: `options` in the tests of the program gives every option of every command with every kind
//! of input; each changes what the command gives, or is refused.

use super::Cli;
use super::help::grouped;
use crate::Error;
use clap::parser::ValueSource;
use clap::{ArgMatches, CommandFactory, FromArgMatches};
use std::ffi::OsString;
use std::path::Path;

/// Options by their long names, each with the reason for which it has no effect.
pub(super) type Idle = [(&'static str, &'static str)];

/// On raw signals.
pub(super) const ON_SIGNALS: &Idle = &[
    ("field", "raw signals have no variable of velocities"),
    (
        "min-snr",
        "raw signals go through the estimator of the scene, whose false_alarm flags estimates of noise",
    ),
];

/// On scans of velocities.
pub(super) const ON_VELOCITIES: &Idle = &[("scale", "it is a factor of raw samples")];

/// On inputs that are no data set.
pub(super) const WITHOUT_DATA_SET: &Idle = &[("split", "no input is a data set")];

/// Of retrievals from a data set.
pub(super) const ON_DATA_SET: &Idle = &[
    ("scene", IN_PLAN),
    ("estimator", IN_PLAN),
    ("pulse", IN_PLAN),
    ("window", IN_PLAN),
    ("weighting", IN_PLAN),
    ("gate-std", IN_PLAN),
    ("field", CELLS),
    ("towards", CELLS),
    ("scale", CELLS),
];
const IN_PLAN: &str = "the plan of the data set has its instrument";
const CELLS: &str = "the velocities of a data set are those of its cells";

/// Of a detector of wakes without scans.
pub(super) const WITHOUT_SCANS: &Idle = &[
    ("field", NO_FILE),
    ("towards", NO_FILE),
    ("min-snr", NO_FILE),
    ("scale", NO_FILE),
];
const NO_FILE: &str = "no file of scans is read";

/// Without a scene on the command line.
pub(super) const WITHOUT_SCENE: &Idle =
    &[("seed", "it replaces that of a scene: --scene states one")];

/// Of estimates of signals that are not those of the scene's own simulation.
pub(super) const OF_RECORDED_SIGNALS: &Idle = &[(
    "seed",
    "nothing in the estimates of recorded signals is random",
)];

/// Of winds, in which nothing is random.
pub(super) const OF_WINDS: &Idle = &[("seed", "nothing in a wind is random")];

/// Of winds whose beams show the wind across them.
pub(super) const OF_FULL_WINDS: &Idle = &[(
    "wind",
    "the beams show the whole wind; it is for stares and scans of one azimuth",
)];

/// Of winds from files without a status of their velocities.
pub(super) const WITHOUT_STATUS: &Idle =
    &[("use-status", "no file says which velocities it trusts")];

/// On an array in the memory of the program that runs the command.
pub(super) const IN_MEMORY: &Idle = &[
    ("format", ARRAY),
    ("byte-order", ARRAY),
    ("header-bytes", ARRAY),
    ("complex", ARRAY),
    ("order", ARRAY),
    ("variable", ARRAY),
    ("quadrature", ARRAY),
];
const ARRAY: &str = "an array says itself how its numbers are stored";

/// Of the method of radial velocities.
pub(super) const BY_RADIAL_VELOCITIES: &Idle = &[
    (
        "turbulence",
        "its linear fit takes velocities for independent",
    ),
    ("secondary", "it fits a pair alone"),
    ("motion", "its vortices stand still"),
];

/// Beside a stated weight of the gates.
pub(super) const BESIDE_GATE_STD: &Idle = &[
    ("pulse", GATE_STD),
    ("window", GATE_STD),
    ("weighting", GATE_STD),
];

/// Beside a stated weight of the gates, unless it says only that velocities are means.
pub(super) const ESTIMATOR_BESIDE_GATE_STD: &Idle = &[("estimator", GATE_STD)];
const GATE_STD: &str = "--gate-std takes velocities for means with that weight";

/// Of velocities that are means.
pub(super) const OF_MEANS: &Idle = &[("weighting", "means over gates are not weighted")];

/// Beside the scene that a file has in it.
pub(super) const BESIDE_OWN_SCENE: &Idle = &[(
    "pulse",
    "the file has its scene in it: --estimator takes its place",
)];

/// Beside an example that is printed.
pub(super) const BESIDE_EXAMPLE: &Idle = &[
    ("restart", PRINTED),
    ("overwrite", PRINTED),
    ("check", PRINTED),
    ("end", PRINTED),
    ("allow-large", PRINTED),
    ("seed", PRINTED),
];

/// Beside a case that is printed.
pub(super) const BESIDE_PRINT: &Idle = &[
    ("out", PRINTED),
    ("restart", PRINTED),
    ("overwrite", PRINTED),
    ("check", PRINTED),
    ("allow-large", PRINTED),
];
const PRINTED: &str = "a case file is printed, and nothing else is done";

/// Beside the plan or the scene of a data set that is printed.
pub(super) const BESIDE_PRINTED_PLAN: &Idle = &[
    ("shard", NO_FLIGHT),
    ("resume", NO_FLIGHT),
    ("overwrite", NO_FLIGHT),
    ("flights", NO_FLIGHT),
];

/// Beside a plan that is checked.
pub(super) const BESIDE_CHECKED_PLAN: &Idle = &[("resume", NO_FLIGHT), ("overwrite", NO_FLIGHT)];
const NO_FLIGHT: &str = "no flight is run";

/// Without a folder or a file to write to.
pub(super) const WITHOUT_OUTPUT: &Idle = &[
    ("overwrite", "nothing is written"),
    ("restart", "a checkpoint is in the folder of --out"),
];

/// Of files that stay in the memory of the program that runs the command.
pub(super) const OF_KEPT_FILES: &Idle = &[("overwrite", "files stay in memory")];

/// Beside results that are merged.
pub(super) const BESIDE_MERGE: &Idle = &[("no-circulation", MERGED), ("allow-large", MERGED)];
const MERGED: &str = "no case is run";

/// Of merged results without the scene of their sweep.
pub(super) const OF_MERGED_WITHOUT_SCENE: &Idle = &[
    ("vary", NOT_COMPARED),
    ("cases", NOT_COMPARED),
    ("let", NOT_COMPARED),
    ("where", NOT_COMPARED),
    ("independent", NOT_COMPARED),
    ("seed", NOT_COMPARED),
];
const NOT_COMPARED: &str = "the results are compared with a sweep only if its scene is given";

/// The definition of the command line: commands, their arguments and options.
pub fn command() -> clap::Command {
    let mut command = grouped(Cli::command());
    command.build();
    command
}

/// The refusal of an option that has no effect on `subject`: a file, a command or another option.
pub(super) fn refusal_of_idle(subject: impl AsRef<Path>, name: &str, reason: &str) -> Error {
    Error::Input {
        path: subject.as_ref().to_owned(),
        reason: format!("--{name} has no effect: {reason}"),
    }
}

impl Cli {
    /// Reads a command line.
    ///
    /// # Errors
    /// Arguments that the command line does not know, or of which one excludes another.
    pub(super) fn read(line: impl IntoIterator<Item = OsString>) -> Result<Self, clap::Error> {
        let matches = grouped(Self::command()).try_get_matches_from(line)?;
        let mut cli = Self::from_arg_matches(&matches)?;
        if let Some((name, matches)) = matches.subcommand()
            && let Some(command) = command().find_subcommand(name)
        {
            cli.given = given(command, matches);
        }
        Ok(cli)
    }

    /// Refuses options that are given although they have no effect on `subject`.
    ///
    /// # Errors
    /// The first such option, with the reason.
    pub(super) fn refuse_idle(&self, subject: impl AsRef<Path>, idle: &Idle) -> Result<(), Error> {
        let given = idle
            .iter()
            .find(|(name, _)| self.given.iter().any(|given| given == name));
        match given {
            Some((name, reason)) => Err(refusal_of_idle(subject, name, reason)),
            None => Ok(()),
        }
    }
}

/// Long names of the options that a command line states.
fn given(command: &clap::Command, matches: &ArgMatches) -> Vec<String> {
    let mut given = Vec::new();
    for argument in command.get_arguments() {
        let id = argument.get_id().as_str();
        // Help is no match that can be requested.
        let source = matches
            .try_contains_id(id)
            .ok()
            .and_then(|_| matches.value_source(id));
        if let (Some(name), Some(ValueSource::CommandLine)) = (argument.get_long(), source) {
            given.push(name.to_owned());
        }
    }
    given
}
