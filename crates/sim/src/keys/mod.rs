//! Reading scenes and case files: every key is held against what it may hold, before anything is made of it.
//!
//! What a file may say is asked of the types that it becomes ([`probe`]), so that a new key needs no list of keys. [`vet`]
//! walks a text beside that description and says of each key that does not fit its path, its line, its value and what is
//! allowed, with an example. What limits a value alone stands beside its default ([`limit`]); what limits it beside
//! others is asked for; a [`Checker`] collects both.
//!
//! Check: each key of a scene and of every case is given values of the wrong kind; the refusal names that key.

mod checker;
mod key;
mod limit;
mod offer;
mod probe;
mod problem;
mod source;
mod vet;
mod words;

pub(crate) use checker::{Checker, Side};
#[cfg(any(test, feature = "sweep"))]
pub(crate) use key::Kind;
pub(crate) use key::{Key, join};
pub(crate) use limit::{AboveZeroOrInf, Keys, Limit, Limited, NothingOr};
pub(crate) use probe::keys_of;
pub use problem::{Located, Problem, SceneError};
pub(crate) use source::Source;
pub(crate) use vet::{Document, Format};
#[cfg(all(feature = "sweep", feature = "netcdf"))]
pub(crate) use words::unit_of;
#[cfg(feature = "sweep")]
pub(crate) use words::{near, one_of};
