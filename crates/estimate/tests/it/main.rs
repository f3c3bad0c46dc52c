//! What the estimators promise, one module for each subject.

// A test that cannot set up its case has failed.
#![allow(clippy::unwrap_used)]

mod accumulate;
mod bound;
mod cell_threshold;
mod correlogram_estimators;
mod draw;
mod extremes;
mod fixtures;
mod likelihood;
mod periodogram;
mod quality;
mod retrieval;
mod retrieval_cases;
mod retrieval_methods;
mod retrieval_of_hard_scans;
mod retrieval_scatter;
mod rolling_moment;
mod secondary_vortices;
mod shown_maps;
mod sliding;
mod turbulence;
mod vortex_fit;
mod wake_detection;
mod wind_aliases;
mod wind_profile;
mod wind_references;
mod window_worth;
