//! The declaration of what scenes and cases may say.
//!
//! [`keys!`] declares tables (name, type, default and limits of each key), tables whose keys depend on one of them, and
//! choices of names. Reading, the walk over a text ([`super::vet`]), limits, examples and hints follow from it.

use super::key::{Key, Kind};
use super::limit::Checker;

/// What a type reads, and the limits of what it holds.
pub(crate) trait Declared {
    /// Whether a key may be left out where its table has no default for it.
    const IS_OPTIONAL: bool = false;

    /// What a key of this type may hold.
    fn kind() -> Kind;

    /// Holds the keys below the one at `at` against their limits.
    fn check_limits(&self, _at: &str, _c: &mut Checker<'_>) {}
}

impl Key {
    /// A key of a table, which may have a default for it.
    pub(crate) fn of<T: Declared>(name: &'static str, has_default: bool) -> Self {
        Self {
            name,
            kind: T::kind(),
            is_required: !has_default && !T::IS_OPTIONAL,
        }
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
    ($($(#[$doc:meta])* $what:ident $name:ident $(by $tag:literal)? { $($body:tt)* })*) => {
        $($crate::keys::$what! { $(#[$doc])* $name $(by $tag)? { $($body)* } })*
    };
}

/// A table of keys: name, type, default and, after each `=>`, what the value must be.
macro_rules! table {
    ($(#[$doc:meta])* $name:ident {
        $($(#[$fdoc:meta])* $field:ident: $ty:ty = $default:expr $(=> $limit:expr)*,)*
    }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(default, deny_unknown_fields)]
        pub struct $name { $($(#[$fdoc])* pub $field: $ty,)* }
        impl Default for $name {
            fn default() -> Self { Self { $($field: $default,)* } }
        }
        impl $crate::keys::Declared for $name {
            fn kind() -> $crate::keys::Kind {
                $crate::keys::Kind::Table(vec![$($crate::keys::Key::of::<$ty>(stringify!($field), true),)*])
            }
            fn check_limits(&self, at: &str, c: &mut $crate::keys::Checker<'_>) {
                $($crate::keys::held!(c, at, $field, &self.$field $(, $limit)*);)*
            }
        }
    };
}

/// A table whose keys depend on the one named after `by`: each kind is a table of its own, or lists keys without defaults.
macro_rules! kinds {
    ($(#[$doc:meta])* $name:ident by $tag:literal {
        $($(#[$vdoc:meta])* $word:literal => $variant:ident $(($inner:ty))? $({
            $($(#[$fdoc:meta])* $field:ident: $ty:ty $(=> $limit:expr)*),* $(,)?
        })?,)*
    }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(tag = $tag, deny_unknown_fields)]
        pub enum $name {
            $($(#[$vdoc])* #[serde(rename = $word)] $variant $(($inner))? $({ $($(#[$fdoc])* $field: $ty),* })?,)*
        }
        impl $name {
            /// The kind as files write it.
            pub fn name(&self) -> &'static str {
                match self { $(Self::$variant { .. } => $word,)* }
            }
        }
        impl $crate::keys::Declared for $name {
            fn kind() -> $crate::keys::Kind {
                $crate::keys::Kind::Tagged { tag: $tag, kinds: vec![$((
                    $word,
                    vec![$($($crate::keys::Key::of::<$ty>(stringify!($field), false),)*)?]
                        $(.into_iter().chain($crate::keys::keys_of::<$inner>()).collect())?,
                ),)*] }
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

/// One of several names.
macro_rules! choice {
    ($(#[$doc:meta])* $name:ident { $($(#[$vdoc:meta])* $variant:ident = $word:literal,)* }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
        pub enum $name { $($(#[$vdoc])* #[serde(rename = $word)] $variant,)* }
        impl $name {
            /// The name in files.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => $word,)* }
            }
        }
        impl $crate::keys::Declared for $name {
            fn kind() -> $crate::keys::Kind { $crate::keys::Kind::Choice(vec![$($word),*]) }
        }
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

/// Choices of another crate, by the names that they have in files.
macro_rules! foreign_choices {
    ($($ty:ty: $($word:literal)|*,)*) => {
        $(impl $crate::keys::Declared for $ty {
            fn kind() -> $crate::keys::Kind { $crate::keys::Kind::Choice(vec![$($word),*]) }
        })*
    };
}

pub(crate) use {choice, foreign_choices, held, keys, kinds, second, table};

/// Plain values.
macro_rules! plain {
    ($($ty:ty => $kind:expr,)*) => {
        $(impl Declared for $ty {
            fn kind() -> Kind { $kind }
        })*
    };
}

plain! {
    f64 => Kind::Number,
    u32 => Kind::Whole { largest: u32::MAX.into() },
    // The whole numbers of TOML end here.
    u64 => Kind::Whole { largest: i64::MAX as u64 },
    usize => Kind::Whole { largest: i64::MAX as u64 },
    bool => Kind::Switch,
    String => Kind::Text,
}

impl<T: Declared> Declared for Option<T> {
    const IS_OPTIONAL: bool = true;

    fn kind() -> Kind {
        T::kind()
    }

    fn check_limits(&self, at: &str, c: &mut Checker<'_>) {
        self.iter().for_each(|value| value.check_limits(at, c));
    }
}

impl<T: Declared> Declared for Box<T> {
    fn kind() -> Kind {
        T::kind()
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
            "vortex_lines",
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
        assert!(kinds[4].1.iter().all(|key| !key.is_required));
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
        let scene = toml::Table::try_from(Scene::default()).unwrap();
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
