//! The whole measurement: a scene file goes in, a radial-velocity map with its errors comes out.
//!
//! This crate joins the four others, which know nothing of each other: the wind of `les`, the efficiency
//! of `optics`, the records of `signal` and the velocities of `estimate`. A [`scene::Scene`] becomes a
//! [`plan::Plan`], which says what will run and what is left out and why; [`run()`] runs it; [`write()`](write::write)
//! puts the results on disk, all files or none.
//!
//! ```
//! use wakescope_sim::plan::{Plan, Stage, Target};
//! use wakescope_sim::progress::Silent;
//! use wakescope_sim::scene::{Scene, SceneFile, SnrReference};
//!
//! # fn main() -> Result<(), wakescope_sim::Error> {
//! let mut scene = Scene::default(); // the lidar of the chapter's Table 2 and a vortex pair 400 m away
//! scene.detector.snr = SnrReference::Fixed { snr_db: 10.0 };
//! scene.scan.elevation_min_rad = 0.1;
//! scene.scan.elevation_max_rad = 0.11;
//! scene.scan.pulses_per_line = 1;
//! let plan = Plan::new(SceneFile::new(scene).expect("a good scene"), Target::Map)?;
//! assert!(!plan.runs(Stage::PhaseScreens)); // no turbulence, no screens
//! let map = wakescope_sim::run::run(&plan, &Silent)?.map.expect("a map was asked for");
//! assert_eq!(map.v_mean_m_s.dim(), (9, map.range_m.len()));
//! # Ok(())
//! # }
//! ```
//!
//! | module | what is in it |
//! |---|---|
//! | [`scene`] | the scene: keys, defaults, limits, errors with line numbers |
//! | [`plan`], `stages` | what a run will do: instrument, estimators, wind and geometry of a scene; its stages, planned by their own modules |
//! | [`beams`] | when, from where and in which direction each pulse leaves |
//! | [`progress`], [`streams`] | progress of a run and how to stop it; one random stream for each pulse |
//! | [`measure`] | signals, velocities and their errors |
//! | [`detection`] | whether scans hold a wake, at a rate of false alarms that is calibrated for them |
//! | [`retrieve`] | scans of any instrument: circulation, place and core of their vortices |
//! | [`wind`] | scans of any instrument: wind over height and turbulence |
//! | [`mod@run`] | running a plan |
//! | [`mod@write`] | writing the results of a run |
//! | [`accuracy`] | numerical error and run time, setting by setting |
//! | [`dataset`] | data sets: many flights with exact truth, by a plan |
//! | [`sweep`] | design studies: many scenes, their results, the Pareto front |
//! | [`score`] | predictions against the truth of a data set |
//! | [`flow`] | simulations of the air: case files, running, outputs |
//! | [`io`], [`plot`] | file formats, pictures |
//! | `processes` | the processes of `mpirun` as ranks of a flow |
//! | [`cli`] | the program `wakescope` |
//!
//! Features, all but the last two on by default: `cli` (the program), `flow` (simulations of the air, with `cli`), `netcdf4` (reading
//! of NetCDF-4), `plots` (SVG and PNG), `mpi` (flows on several machines).

pub mod accuracy;
pub mod beams;
pub mod dataset;
pub mod detection;
mod document;
pub mod flow;
mod interpolation;
pub mod io;
mod keys;
mod machine;
pub mod measure;
mod memo;
mod outputs;
pub mod plan;
#[cfg(feature = "mpi")]
pub mod processes;
pub mod progress;
mod quantities;
pub mod retrieve;
pub mod run;
pub mod scene;
pub mod score;
mod stages;
pub mod streams;
pub mod sweep;
pub mod wind;
pub mod write;

#[cfg(feature = "cli")]
pub mod cli;
#[cfg(feature = "plots")]
pub mod plot;

mod error;

pub use error::Error;
pub use outputs::write_contents;
pub use plan::{Plan, Target};
pub use progress::Silent;
pub use run::{RunResult, run};
pub use scene::{Scene, SceneFile};
pub use write::write;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
mod readme {}

/// Version of this program.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Name and version, as every file carries it.
pub const PROGRAM: &str = concat!("wakescope ", env!("CARGO_PKG_VERSION"));

/// Speed of light in vacuum, m/s; the index of air changes a range by 0.03 %, which is left out.
pub const SPEED_OF_LIGHT_M_S: f64 = 299_792_458.0;
