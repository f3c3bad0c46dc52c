//! Design studies: many scenes that differ in some keys, what each gives, and which of them are best.
//!
//! | module | what is in it |
//! |---|---|
//! | `key_path`, `expression` | keys of a scene by their paths; arithmetic on them |
//! | `cases` | grids and lists of values; all cases as checked scenes |
//! | `run` | checking all, running what is not there yet, sharing what cases have in common |
//! | `results`, `circulation` | cases of the same signals measured together; their numbers |
//! | `stored` | a folder for each case |
//! | `tables`, `pictures` | tables and pictures of all, from one folder or those of shards |
//! | [`front`](mod@front) | set-ups that no other one dominates |

mod cases;
mod circulation;
pub(crate) mod expression;
pub mod front;
mod key_path;
#[cfg(feature = "plots")]
mod pictures;
mod results;
mod run;
mod stored;
mod tables;

pub use cases::{Case, MOST_CASES, Request, Sweep};
pub(crate) use cases::{number_of_key, set, text_of};
pub(crate) use circulation::Retrieval;
pub(crate) use key_path::{SceneKey, resolve};
pub(crate) use run::Common;
pub use run::{Settings, Shard, Summary, maps, run};
pub use tables::merge;

#[cfg(test)]
mod sweep_tests;
