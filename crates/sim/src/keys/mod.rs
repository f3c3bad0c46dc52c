//! Reading scenes and case files: every key is held against what it may hold, before anything is made of it.
//!
//! What a file may say is declared once, beside the types that it becomes ([`declare`]): names, defaults, and what limits a
//! value alone ([`limit`]). [`vet`] walks a text beside that declaration and says of each key that does not fit its path, its
//! line, its value and what is allowed, with an example. What limits a value beside others is asked for; a [`Checker`] collects
//! both.
//!
//! Check: each key of a scene and of every case is given values of the wrong kind; the refusal names that key.

mod declare;
mod key;
mod limit;
mod problem;
mod vet;
mod words;

pub(crate) use declare::{
    Declared, behaviour, choice, default_of, foreign_choices, from_table, held, keys, keys_of,
    kinds, read_key, second, table, to_table, write_key, written,
};
pub(crate) use key::{Key, Kind, join};
pub(crate) use limit::{ABOVE_ZERO, FINITE};
pub(crate) use limit::{ABOVE_ZERO_OR_INF, Checker, Is, Limit, Named, Number, ZERO_OR_MORE, side};
pub use problem::Problem;
pub(crate) use problem::listed;
pub(crate) use vet::{Format, Text, lines_with_keys, value_at};
pub(crate) use words::{near, one_of, unit_of};
