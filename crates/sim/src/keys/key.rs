//! The description of a key: its name and what it may hold.

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
    Choice(Vec<&'static str>),
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
    if path.is_empty() {
        key.to_owned()
    } else {
        format!("{path}.{key}")
    }
}
