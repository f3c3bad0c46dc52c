//! The figures: one file each, and what they have in common.
//!
//! A figure is a function from a [`Context`] to the files it writes and the claims it measures.

mod ca_pa;
mod fig01;
mod fig03;
mod fig04;
mod fig05;
mod fig06;
mod fig07;
mod fig08;
mod fig09;
mod fig10;
mod fig11;
mod fig12;
mod fig13;
mod fig14;
mod fig17;
mod fig18;
mod profiles;
mod study;
mod tab01;
mod tab02;

use crate::Failure;
use std::fmt;
use std::path::PathBuf;
use wakescope_sim::export::Provenance;
use wakescope_sim::scene::Scene;

/// Resolution and sample counts of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Profile {
    /// Minutes: every component, small samples.
    Quick,
    /// Up to hours: what the documentation shows.
    Standard,
    /// The chapter's own numbers.
    Full,
}

impl Profile {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Quick => "quick",
            Self::Standard => "standard",
            Self::Full => "full",
        }
    }
}

/// What a figure may depend on.
#[derive(Debug, Clone)]
pub(crate) struct Context {
    pub(crate) profile: Profile,
    pub(crate) seed: u64,
    /// Folder for runs that several figures share.
    pub(crate) stages: PathBuf,
    /// Folder of a wake that is to be shown instead of that of the profile.
    pub(crate) wake: Option<PathBuf>,
    /// Whether figures 10 to 14 look at the analytic pair instead of the simulated wake.
    pub(crate) analytic: bool,
}

impl Context {
    /// One of three values, by profile.
    pub(crate) fn choose<T>(&self, quick: T, standard: T, full: T) -> T {
        match self.profile {
            Profile::Quick => quick,
            Profile::Standard => standard,
            Profile::Full => full,
        }
    }

    pub(crate) fn profile_name(&self) -> &'static str {
        self.profile.name()
    }

    /// The scene of a figure as a checked file, with this run's seed.
    pub(crate) fn scene_file(&self, mut scene: Scene) -> Result<wakescope_sim::scene::SceneFile, Failure> {
        scene.seed = self.seed;
        wakescope_sim::scene::SceneFile::new(scene)
            .map_err(|problems| Failure::new(problems.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")))
    }

    /// Provenance of what belongs to no scene: the tables over all figures.
    pub(crate) fn provenance_of_run(&self) -> Provenance {
        self.provenance_of_formula(&format!("profile = \"{}\"\n", self.profile_name()))
    }

    /// Provenance of a figure that follows from formulas and the parameters given as TOML.
    pub(crate) fn provenance_of_formula(&self, parameters: &str) -> Provenance {
        Provenance {
            program: wakescope_sim::PROGRAM.into(),
            scene_toml: parameters.into(),
            scene_hash: wakescope_sim::scene::hash_of(parameters),
            seed: self.seed,
        }
    }
}

/// A figure that can be asked for.
pub(crate) struct Figure {
    pub(crate) id: &'static str,
    pub(crate) number: u32,
    pub(crate) title: &'static str,
    pub(crate) make: fn(&Context) -> Result<Rendered, Failure>,
}

/// What a figure gives.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Rendered {
    /// Extension and content of each file.
    pub(crate) files: Vec<(String, Vec<u8>)>,
    /// What is drawn, for the report.
    pub(crate) caption: String,
    /// Short notes beside the name, such as what is not the real thing.
    pub(crate) marks: Vec<String>,
    /// Claims measured on the data of the run.
    pub(crate) claims: Vec<Claim>,
    /// Stage and wall-clock time, s.
    pub(crate) timings: Vec<(String, f64)>,
}

impl Rendered {
    /// A table, as the figure's CSV.
    pub(crate) fn csv(&mut self, text: String) {
        self.files.push(("csv".into(), text.into_bytes()));
    }

    /// A picture, as SVG and PNG.
    pub(crate) fn picture(&mut self, svg: String, png: Vec<u8>) {
        self.files.push(("svg".into(), svg.into_bytes()));
        self.files.push(("png".into(), png));
    }

    pub(crate) fn file(&self, extension: &str) -> Option<&[u8]> {
        self.files.iter().find(|(e, _)| e == extension).map(|(_, bytes)| bytes.as_slice())
    }
}

/// How a claim came out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Verdict {
    Pass,
    Fail,
    /// The uncertainty, or the resolution of the profile, does not allow a verdict.
    NotResolved,
}

impl Verdict {
    pub(crate) const ALL: [Self; 3] = [Self::Pass, Self::Fail, Self::NotResolved];

    /// Pass or fail.
    pub(crate) fn of(pass: bool) -> Self {
        if pass { Self::Pass } else { Self::Fail }
    }

    /// Of differences in standard errors: pass if all are above `limit`, fail if one is below its negative.
    pub(crate) fn of_differences(z: &[f64], limit: f64) -> Self {
        match (z.iter().all(|z| *z > limit), z.iter().any(|z| *z < -limit)) {
            (true, _) => Self::Pass,
            (_, true) => Self::Fail,
            _ => Self::NotResolved,
        }
    }

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Fail => "fail",
            Self::NotResolved => "not_resolved",
        }
    }
}

/// A statement about a figure, measured.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Claim {
    pub(crate) id: String,
    pub(crate) figure: String,
    pub(crate) statement: String,
    pub(crate) expected: String,
    pub(crate) measured: String,
    /// NaN where the measurement is deterministic.
    pub(crate) standard_error: f64,
    pub(crate) verdict: Verdict,
}

impl Claim {
    /// A claim that a computation without random numbers decides.
    pub(crate) fn exact(id: &str, figure: &str, statement: &str, expected: &str, measured: String, pass: bool) -> Self {
        Self {
            id: id.into(),
            figure: figure.into(),
            statement: statement.into(),
            expected: expected.into(),
            measured,
            standard_error: f64::NAN,
            verdict: Verdict::of(pass),
        }
    }
}

impl fmt::Display for Claim {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { id, statement, expected, measured, .. } = self;
        write!(f, "{:<12} {id:<4} {statement}: expected {expected}, measured {measured}", self.verdict.name())
    }
}

/// All figures, in the order of the report.
pub(crate) const ALL: [Figure; 18] = [
    Figure { id: "fig01", number: 1, title: "Vertical velocity through the cores of the pair", make: fig01::make },
    Figure { id: "tab01", number: 1, title: "ICAO separations behind a landing aircraft", make: tab01::make },
    Figure {
        id: "tab02",
        number: 2,
        title: "Lidar parameters as read back from the scene that was run",
        make: tab02::make,
    },
    Figure { id: "fig03", number: 3, title: "Scan pattern across the runway", make: fig03::make },
    Figure { id: "fig04", number: 4, title: "Signal-to-noise ratio and system efficiency", make: fig04::make },
    Figure { id: "fig05", number: 5, title: "M'4 stencil on a line of sight", make: fig05::make },
    Figure { id: "fig06", number: 6, title: "Surfaces of equal vorticity", make: fig06::make },
    Figure { id: "fig07", number: 7, title: "Circulation and paths of the vortices", make: fig07::make },
    Figure { id: "fig08", number: 8, title: "Radial velocity of the wake, early and late", make: fig08::make },
    Figure { id: "fig09", number: 9, title: "Accumulation level against range", make: fig09::make },
    Figure { id: "fig10", number: 10, title: "Estimation error and gradient", make: fig10::make },
    Figure { id: "fig11", number: 11, title: "Estimated map, late, 400 ns", make: fig11::make },
    Figure { id: "fig12", number: 12, title: "Error against pulse energy", make: fig12::make },
    Figure { id: "fig13", number: 13, title: "Correlogram against periodogram accumulation", make: fig13::make },
    Figure { id: "fig14", number: 14, title: "The same at 200 and 400 ns about the centre", make: fig14::make },
    Figure { id: "fig17", number: 17, title: "Circulation and positions from single scans", make: fig17::make },
    Figure { id: "fig18", number: 18, title: "Velocity estimators against the Cramer-Rao bound", make: fig18::make },
    Figure { id: "ca_pa", number: 19, title: "CA against PA: where the claim holds", make: ca_pa::make },
];
