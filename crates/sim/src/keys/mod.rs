//! Reading scenes and case files: every key is held against what it may hold, before anything is made of it.
//!
//! What a file may say is asked of the types that it becomes ([`probe`]), so that a new key needs no list of keys. [`vet`]
//! walks a text beside that description and says of each key that does not fit its path, its line, its value and what is
//! allowed, with an example.
//!
//! Check: each key of a scene and of every case is given values of the wrong kind; the refusal names that key.

mod probe;
mod vet;
mod words;

pub(crate) use probe::keys_of;
pub(crate) use vet::{Document, Format};

/// What a key may hold.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Kind {
    /// A floating point number.
    Number,
    /// A whole number from 0.
    Whole {
        /// The largest one that fits.
        largest: u64,
    },
    /// True or false.
    Switch,
    /// A text.
    Text,
    /// One of these names.
    Choice(&'static [&'static str]),
    /// Values of one kind.
    List {
        /// That kind.
        of: Box<Kind>,
        /// How many there must be, if not any number.
        len: Option<usize>,
    },
    /// A table.
    Table(Vec<Key>),
    /// A table whose keys depend on one of them.
    Tagged {
        /// The key that chooses, such as `kind`.
        tag: &'static str,
        /// Its values, each with the further keys.
        kinds: Vec<(&'static str, Vec<Key>)>,
    },
    /// Something else, which is not looked at.
    Other,
}

/// A key of a table.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Key {
    /// Its name.
    pub(crate) name: &'static str,
    /// What it may hold.
    pub(crate) kind: Kind,
    /// Whether it has no default.
    pub(crate) is_required: bool,
}

/// The path of a key in the table at `path`.
pub(crate) fn join(path: &str, key: &str) -> String {
    if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") }
}
