//! The declaration of what scenes and cases may say.
//!
//! [`keys!`] declares tables (name, type, default and limits of each key), tables whose keys depend on one of them, and
//! choices of names. Reading, the walk over a text ([`super::vet`]), limits, examples and hints follow from it.

use super::key::{Key, Kind};
use super::limit::Checker;
use toml::{Table, Value};

/// A type of keys: what it may hold, how it is read and written, and the limits of what it holds.
pub(crate) trait Declared: Sized {
    /// What a key of this type may hold.
    fn kind() -> Kind;

    /// The value of a key that a table without defaults does not state; `None` if it must state it.
    fn absent() -> Option<Self> {
        None
    }

    /// Reads a value of the [`Self::kind`]; `None` for any other value.
    fn from_value(value: &Value) -> Option<Self>;

    /// The value that is written; `None` if the key is not written.
    fn to_value(&self) -> Option<Value>;

    /// Checks the keys below the one at `at` against their limits.
    fn check_limits(&self, _at: &str, _c: &mut Checker<'_>) {}
}

impl Key {
    /// A key of a table, which may have a default for it.
    pub(crate) fn of<T: Declared>(name: &'static str, has_default: bool) -> Self {
        Self {
            name,
            kind: T::kind(),
            is_required: !has_default && T::absent().is_none(),
        }
    }
}

/// Reads a table whose keys all fit their kinds (see [`super::vet`]); `None` if one does not.
pub(crate) fn from_table<T: Declared>(table: Table) -> Option<T> {
    T::from_value(&Value::Table(table))
}

/// A scene, a case or a part of one as a table, with every default.
pub(crate) fn to_table<T: Declared>(part: &T) -> Table {
    match part.to_value() {
        Some(Value::Table(table)) => table,
        _ => Table::new(),
    }
}

/// Reads the key `name` of a table; `default` is its value where the table does not state it.
pub(crate) fn read_key<T: Declared>(
    table: &Value,
    name: &str,
    default: impl FnOnce() -> Option<T>,
) -> Option<T> {
    match table.get(name) {
        Some(value) => T::from_value(value),
        None => default(),
    }
}

/// Adds the key `name` to a table, unless its value is not written.
pub(crate) fn write_key<T: Declared>(table: &mut Table, name: &str, part: &T) {
    if let Some(value) = part.to_value() {
        table.insert(name.to_owned(), value);
    }
}

/// The keys of the table that `T` is read from.
pub(crate) fn keys_of<T: Declared>() -> Vec<Key> {
    match T::kind() {
        Kind::Table(keys) => keys,
        _ => Vec::new(),
    }
}

/// Tables, tables of several kinds, and choices, one after the other.
macro_rules! keys {
    ($($(#[$doc:meta])* $what:ident $name:ident $(by $tag:literal)? $(with $behaviour:ident)? { $($body:tt)* })*) => {
        $($crate::keys::$what! { $(#[$doc])* $name $(by $tag)? $(with $behaviour)? { $($body)* } })*
    };
}

/// A table of keys: name, type, default and, after each `=>`, what the value must be. A key `as omitted` is not written
/// where it has its default.
macro_rules! table {
    ($(#[$doc:meta])* $name:ident {}) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq, Default)]
        pub struct $name {}
        impl $crate::keys::Declared for $name {
            fn kind() -> $crate::keys::Kind {
                $crate::keys::Kind::Table(Vec::new())
            }
            fn from_value(value: &toml::Value) -> Option<Self> {
                value.as_table().map(|_| Self {})
            }
            fn to_value(&self) -> Option<toml::Value> {
                Some(toml::Value::Table(toml::Table::new()))
            }
        }
    };
    ($(#[$doc:meta])* $name:ident {
        $($(#[$fdoc:meta])* $field:ident: $ty:ty $(as $omitted:ident)? = $default:expr $(=> $limit:expr)*,)*
    }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq)]
        pub struct $name { $($(#[$fdoc])* pub $field: $ty,)* }
        impl Default for $name {
            fn default() -> Self { Self { $($field: $default,)* } }
        }
        impl $crate::keys::Declared for $name {
            fn kind() -> $crate::keys::Kind {
                $crate::keys::Kind::Table(vec![$($crate::keys::Key::of::<$ty>(stringify!($field), true),)*])
            }
            fn from_value(value: &toml::Value) -> Option<Self> {
                let default = Self::default();
                Some(Self { $($field: $crate::keys::read_key(value, stringify!($field), || Some(default.$field))?,)* })
            }
            fn to_value(&self) -> Option<toml::Value> {
                let mut table = toml::Table::new();
                $($crate::keys::written!(table, stringify!($field), self.$field, $default $(, $omitted)?);)*
                Some(toml::Value::Table(table))
            }
            fn check_limits(&self, at: &str, c: &mut $crate::keys::Checker<'_>) {
                $($crate::keys::held!(c, at, $field, &self.$field $(, $limit)*);)*
            }
        }
    };
}

/// A table whose keys depend on the one named after `by`: each kind is a table of its own, or lists its keys, with or without defaults.
/// `with` names a trait of all kinds, which are then tables of their own; `behaviour` returns the kind as that trait.
macro_rules! kinds {
    ($(#[$doc:meta])* $name:ident by $tag:literal $(with $behaviour:ident)? {
        $($(#[$vdoc:meta])* $word:literal => $variant:ident $(($inner:ty))? $({
            $($(#[$fdoc:meta])* $field:ident: $ty:ty $(= $default:expr)? $(=> $limit:expr)*),* $(,)?
        })?,)*
    }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq)]
        pub enum $name {
            $($(#[$vdoc])* $variant $(($inner))? $({ $($(#[$fdoc])* $field: $ty),* })?,)*
        }
        impl $name {
            /// The kind as files write it.
            pub fn name(&self) -> &'static str {
                match self { $(Self::$variant { .. } => $word,)* }
            }
        }
        $crate::keys::behaviour!(($($behaviour)?) $name $($variant)*);
        impl $crate::keys::Declared for $name {
            fn kind() -> $crate::keys::Kind {
                $crate::keys::Kind::Tagged { tag: $tag, kinds: vec![$((
                    $word,
                    vec![$($($crate::keys::Key::of::<$ty>(stringify!($field), $crate::keys::default_of!($ty $(, $default)?).is_some()),)*)?]
                        $(.into_iter().chain($crate::keys::keys_of::<$inner>()).collect())?,
                ),)*] }
            }
            fn from_value(value: &toml::Value) -> Option<Self> {
                match value.get($tag)?.as_str()? {
                    $($word => Some(Self::$variant
                        $((<$inner as $crate::keys::Declared>::from_value(value)?))?
                        $({ $($field: $crate::keys::read_key(value, stringify!($field), || $crate::keys::default_of!($ty $(, $default)?))?),* })?
                    ),)*
                    _ => None,
                }
            }
            fn to_value(&self) -> Option<toml::Value> {
                #[allow(unused_mut)]
                let mut table = toml::Table::from_iter([($tag.to_owned(), toml::Value::from(self.name()))]);
                match self { $(
                    Self::$variant $(($crate::keys::second!($inner, inner)))? $({ $($field),* })? => {
                        $(table.extend($crate::keys::to_table::<$inner>(inner));)?
                        $($($crate::keys::write_key(&mut table, stringify!($field), $field);)*)?
                    }
                )* }
                Some(toml::Value::Table(table))
            }
            #[allow(unused_variables)]
            fn check_limits(&self, at: &str, c: &mut $crate::keys::Checker<'_>) {
                match self { $(
                    Self::$variant $(($crate::keys::second!($inner, inner)))? $({ $($field),* })? => {
                        $(<$inner as $crate::keys::Declared>::check_limits(inner, at, c);)?
                        $($($crate::keys::held!(c, at, $field, $field $(, $limit)*);)*)?
                    }
                )* }
            }
        }
    };
}

/// The kind as the trait of all kinds, if they have one.
macro_rules! behaviour {
    (() $name:ident $($variant:ident)*) => {};
    (($behaviour:ident) $name:ident $($variant:ident)*) => {
        impl $name {
            /// The chosen kind.
            pub(crate) fn behaviour(&self) -> &dyn $behaviour {
                match self { $(Self::$variant(kind) => kind,)* }
            }
        }
    };
}

/// One of several names.
macro_rules! choice {
    ($(#[$doc:meta])* $name:ident { $($(#[$vdoc:meta])* $variant:ident = $word:literal,)* }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum $name { $($(#[$vdoc])* $variant,)* }
        impl $name {
            /// The name in files.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => $word,)* }
            }
        }
        impl $crate::keys::Declared for $name {
            fn kind() -> $crate::keys::Kind { $crate::keys::Kind::Choice(vec![$($word),*]) }
            fn from_value(value: &toml::Value) -> Option<Self> {
                match value.as_str()? {
                    $($word => Some(Self::$variant),)*
                    _ => None,
                }
            }
            fn to_value(&self) -> Option<toml::Value> {
                Some(toml::Value::from(self.name()))
            }
        }
    };
}

/// The default of a key of a kind; without one, what its absence means.
macro_rules! default_of {
    ($ty:ty, $default:expr) => {
        Some::<$ty>($default)
    };
    ($ty:ty) => {
        <$ty as $crate::keys::Declared>::absent()
    };
}

/// Writes a key of a table; one that is omitted only where it does not have its default.
macro_rules! written {
    ($table:ident, $name:expr, $value:expr, $default:expr, omitted) => {
        if $value != $default {
            $crate::keys::write_key(&mut $table, $name, &$value);
        }
    };
    ($table:ident, $name:expr, $value:expr, $default:expr) => {
        $crate::keys::write_key(&mut $table, $name, &$value);
    };
}

/// Holds a value, and what is below it, against its limits.
macro_rules! held {
    ($c:ident, $at:ident, $field:ident, $value:expr $(, $limit:expr)*) => {{
        #[allow(unused_imports)]
        use $crate::keys::{Declared as _, Limit as _};
        let key = $crate::keys::join($at, stringify!($field));
        $(($limit).hold(&key, $value, $c);)*
        ($value).check_limits(&key, $c);
    }};
}

/// The second of two words: a name for what the first one stands for.
macro_rules! second {
    ($first:ty, $second:ident) => {
        $second
    };
}

/// Choices of another crate, by the names that they have in files; each variant needs one.
macro_rules! foreign_choices {
    ($($ty:ident { $($variant:ident = $word:literal),* $(,)? })*) => {
        $(impl $crate::keys::Declared for $ty {
            fn kind() -> $crate::keys::Kind { $crate::keys::Kind::Choice(vec![$($word),*]) }
            fn from_value(value: &toml::Value) -> Option<Self> {
                match value.as_str()? {
                    $($word => Some(Self::$variant),)*
                    _ => None,
                }
            }
            fn to_value(&self) -> Option<toml::Value> {
                Some(match self {
                    $(Self::$variant => $word.into(),)*
                })
            }
        })*
    };
}

pub(crate) use {
    behaviour, choice, default_of, foreign_choices, held, keys, kinds, second, table, written,
};

impl Declared for f64 {
    fn kind() -> Kind {
        Kind::Number
    }

    fn from_value(value: &Value) -> Option<Self> {
        match value {
            Value::Float(number) => Some(*number),
            Value::Integer(number) => Some(*number as f64),
            _ => None,
        }
    }

    fn to_value(&self) -> Option<Value> {
        Some(Value::Float(*self))
    }
}

/// Whole numbers; those of TOML end at the largest of `i64`.
macro_rules! whole_numbers {
    ($($ty:ty => $largest:expr,)*) => {
        $(impl Declared for $ty {
            fn kind() -> Kind {
                Kind::Whole { largest: $largest }
            }

            fn from_value(value: &Value) -> Option<Self> {
                Self::try_from(value.as_integer()?).ok()
            }

            fn to_value(&self) -> Option<Value> {
                Some(Value::Integer(i64::try_from(*self).unwrap_or(i64::MAX)))
            }
        })*
    };
}

whole_numbers! {
    u32 => u32::MAX.into(),
    u64 => i64::MAX as u64,
    usize => i64::MAX as u64,
}

impl Declared for bool {
    fn kind() -> Kind {
        Kind::Switch
    }

    fn from_value(value: &Value) -> Option<Self> {
        value.as_bool()
    }

    fn to_value(&self) -> Option<Value> {
        Some(Value::Boolean(*self))
    }
}

impl Declared for String {
    fn kind() -> Kind {
        Kind::Text
    }

    fn from_value(value: &Value) -> Option<Self> {
        value.as_str().map(str::to_owned)
    }

    fn to_value(&self) -> Option<Value> {
        Some(Value::String(self.clone()))
    }
}

impl<T: Declared> Declared for Option<T> {
    fn kind() -> Kind {
        T::kind()
    }

    fn absent() -> Option<Self> {
        Some(None)
    }

    fn from_value(value: &Value) -> Option<Self> {
        T::from_value(value).map(Some)
    }

    fn to_value(&self) -> Option<Value> {
        self.as_ref().and_then(T::to_value)
    }

    fn check_limits(&self, at: &str, c: &mut Checker<'_>) {
        self.iter().for_each(|value| value.check_limits(at, c));
    }
}

impl<T: Declared> Declared for Box<T> {
    fn kind() -> Kind {
        T::kind()
    }

    fn from_value(value: &Value) -> Option<Self> {
        T::from_value(value).map(Self::new)
    }

    fn to_value(&self) -> Option<Value> {
        (**self).to_value()
    }

    fn check_limits(&self, at: &str, c: &mut Checker<'_>) {
        (**self).check_limits(at, c);
    }
}

impl<T: Declared> Declared for Vec<T> {
    fn kind() -> Kind {
        Kind::List {
            of: Box::new(T::kind()),
            len: None,
        }
    }

    fn from_value(value: &Value) -> Option<Self> {
        value.as_array()?.iter().map(T::from_value).collect()
    }

    fn to_value(&self) -> Option<Value> {
        let values: Option<Vec<Value>> = self.iter().map(T::to_value).collect();
        values.map(Value::Array)
    }

    fn check_limits(&self, at: &str, c: &mut Checker<'_>) {
        self.iter()
            .enumerate()
            .for_each(|(i, value)| value.check_limits(&format!("{at}[{i}]"), c));
    }
}

impl<T: Declared, const N: usize> Declared for [T; N] {
    fn kind() -> Kind {
        Kind::List {
            of: Box::new(T::kind()),
            len: Some(N),
        }
    }

    fn from_value(value: &Value) -> Option<Self> {
        Vec::from_value(value)?.try_into().ok()
    }

    fn to_value(&self) -> Option<Value> {
        let values: Option<Vec<Value>> = self.iter().map(T::to_value).collect();
        values.map(Value::Array)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    fn find<'a>(keys: &'a [Key], name: &str) -> &'a Key {
        keys.iter().find(|key| key.name == name).unwrap()
    }

    #[test]
    fn a_scene_says_what_it_reads() {
        let scene = keys_of::<Scene>();
        let Kind::Table(pulse) = &find(&scene, "pulse").kind else {
            panic!("a table")
        };
        assert_eq!(find(pulse, "energy_j").kind, Kind::Number);
        let Kind::Tagged { kinds, .. } = &find(pulse, "shape").kind else {
            panic!("tagged")
        };
        assert_eq!(
            find(&kinds[0].1, "definition").kind,
            Kind::Choice(vec!["fwhm", "one_over_e_half_width"])
        );
        let Kind::Tagged { tag: "kind", kinds } = &find(&scene, "flow").kind else {
            panic!("tagged")
        };
        let names = [
            "calm",
            "uniform",
            "linear",
            "wind",
            "eddies",
            "vortex_pair",
            "simulated",
            "fields",
        ];
        assert_eq!(kinds.iter().map(|k| k.0).collect::<Vec<_>>(), names);
        assert!(
            kinds[1]
                .1
                .iter()
                .all(|key| key.is_required && key.kind == Kind::Number)
                && kinds[1].1.len() == 2
        );
        assert!(kinds[3].1.iter().all(|key| !key.is_required));
        let Kind::Table(estimator) = &find(&scene, "estimator").kind else {
            panic!("a table")
        };
        assert_eq!(
            find(estimator, "false_alarm").kind,
            Kind::Number,
            "what may be absent"
        );
        let Kind::Tagged { kinds, .. } = &find(estimator, "method").kind else {
            panic!("tagged")
        };
        assert_eq!(
            find(&kinds[2].1, "order").kind,
            Kind::Whole {
                largest: i64::MAX as u64
            }
        );
        let Kind::Tagged { kinds, .. } = &find(estimator, "radius").kind else {
            panic!("tagged")
        };
        let list = Kind::List {
            of: Box::new(Kind::Number),
            len: None,
        };
        assert_eq!(find(&kinds[1].1, "range_m").kind, list);
    }

    /// A text with every key of a kind is read back: what is declared is what serde reads and writes.
    #[test]
    fn names_of_kinds_and_choices_are_those_that_are_written() {
        let scene = to_table(&Scene::default());
        fn look(keys: &[Key], table: &toml::Table) {
            for (name, value) in table {
                let Some(key) = keys.iter().find(|key| key.name == name) else {
                    panic!("{name} is not declared")
                };
                match (&key.kind, value) {
                    (Kind::Choice(names), toml::Value::String(word)) => {
                        assert!(names.contains(&word.as_str()))
                    }
                    (Kind::Table(inner), toml::Value::Table(table)) => look(inner, table),
                    (Kind::Tagged { tag, kinds }, toml::Value::Table(table)) => {
                        let kind = kinds
                            .iter()
                            .find(|(name, _)| table[*tag].as_str() == Some(name))
                            .unwrap();
                        let rest = table.iter().filter(|(name, _)| name != tag);
                        look(
                            &kind.1,
                            &rest
                                .map(|(name, value)| (name.clone(), value.clone()))
                                .collect(),
                        );
                    }
                    _ => {}
                }
            }
        }
        look(&keys_of::<Scene>(), &scene);
    }
}
