//! What a type reads, found by offering it values that it must refuse: the refusal says what it wants.
//!
//! Serde gives structures, enumerations and tables with a tag no description of themselves, but the errors that they make
//! carry the names of their keys and variants.

use super::key::{Key, Kind};
use super::offer::{Answer, Offer};
use serde::de::DeserializeOwned;

/// A name that no key and no variant has.
const STRANGE: &str = "?";

/// The keys of the table that `T` is read from.
pub(crate) fn keys_of<T: DeserializeOwned>() -> Vec<Key> {
    match (Prober { ask: |offer| T::deserialize(offer).map_or_else(|answer| answer, |_| Answer::Accepted) }).kind(&[]) {
        Kind::Table(keys) => keys,
        _ => Vec::new(),
    }
}

/// A step on the way from the whole to the value that is asked about.
#[derive(Clone, Copy)]
enum Step {
    /// A key of a table, beside the tag that its kind needs.
    Key(&'static str, Option<(&'static str, &'static str)>),
    /// The first value of a list.
    First,
}

struct Prober<F> {
    ask: F,
}

impl<F: Fn(Offer) -> Answer> Prober<F> {
    fn answer(&self, path: &[Step], offer: Offer) -> Answer {
        (self.ask)(path.iter().rev().fold(offer, |inner, step| match *step {
            Step::Key(key, tag) => {
                let tag = tag.map(|(tag, name)| (tag.into(), Offer::text(name)));
                Offer::Table(tag.into_iter().chain([(key.into(), inner)]).collect())
            }
            Step::First => Offer::List(vec![inner]),
        }))
    }

    fn kind(&self, path: &[Step]) -> Kind {
        match self.answer(path, Offer::text(STRANGE)) {
            Answer::UnknownVariant(names) => return Kind::Choice(names),
            Answer::Accepted | Answer::Missing(_) => return Kind::Text,
            _ => {}
        }
        match self.answer(path, Offer::table([(STRANGE, Offer::Switch(true))])) {
            Answer::UnknownKey(names) => Kind::Table(self.keys(path, names, None)),
            Answer::Missing(tag) => self.tagged(path, tag),
            Answer::Wanted(what) => self.plain(path, &what),
            _ => Kind::Other,
        }
    }

    fn plain(&self, path: &[Step], what: &str) -> Kind {
        let list = |len| Kind::List { of: Box::new(self.kind(&[path, &[Step::First]].concat())), len };
        match what {
            "f64" => Kind::Number,
            "u8" => Kind::Whole { largest: u8::MAX.into() },
            "u16" => Kind::Whole { largest: u16::MAX.into() },
            "u32" => Kind::Whole { largest: u32::MAX.into() },
            // The whole numbers of TOML end here.
            "u64" | "usize" => Kind::Whole { largest: i64::MAX as u64 },
            "a boolean" => Kind::Switch,
            "a string" => Kind::Text,
            "a sequence" => list(None),
            _ => match what.strip_prefix("an array of length ").and_then(|len| len.parse().ok()) {
                Some(len) => list(Some(len)),
                None => Kind::Other,
            },
        }
    }

    fn tagged(&self, path: &[Step], tag: &'static str) -> Kind {
        let Answer::UnknownVariant(names) = self.answer(path, Offer::table([(tag, Offer::text(STRANGE))])) else {
            return Kind::Other;
        };
        let further = |name| {
            let strange = Offer::table([(tag, Offer::text(name)), (STRANGE, Offer::Switch(true))]);
            match self.answer(path, strange) {
                Answer::UnknownKey(keys) => self.keys(path, keys, Some((tag, name))),
                _ => Vec::new(),
            }
        };
        Kind::Tagged { tag, kinds: names.iter().map(|&name| (name, further(name))).collect() }
    }

    fn keys(
        &self,
        path: &[Step],
        names: &'static [&'static str],
        tag: Option<(&'static str, &'static str)>,
    ) -> Vec<Key> {
        let kind = |name| self.kind(&[path, &[Step::Key(name, tag)]].concat());
        let mut keys: Vec<Key> = names.iter().map(|&name| Key { name, kind: kind(name), is_required: false }).collect();
        // What is missing from a table that has only the tag, one after the other.
        let mut given: Vec<(&str, Offer)> = tag.into_iter().map(|(tag, name)| (tag, Offer::text(name))).collect();
        for _ in names {
            let Answer::Missing(missing) = self.answer(path, Offer::table(given.clone())) else { break };
            let Some(key) = keys.iter_mut().find(|key| key.name == missing && !key.is_required) else { break };
            key.is_required = true;
            given.push((key.name, example(&key.kind)));
        }
        keys
    }
}

/// A value that a key of this kind takes.
fn example(kind: &Kind) -> Offer {
    let of = |keys: &[Key]| -> Vec<(&'static str, Offer)> {
        keys.iter().filter(|k| k.is_required).map(|k| (k.name, example(&k.kind))).collect()
    };
    match kind {
        Kind::Number | Kind::Whole { .. } | Kind::Other => Offer::Whole(1),
        Kind::Switch => Offer::Switch(true),
        Kind::Text => Offer::text(STRANGE),
        Kind::Choice(names) => Offer::text(names.first().copied().unwrap_or(STRANGE)),
        Kind::List { of, len } => Offer::List(vec![example(of); len.unwrap_or(1)]),
        Kind::Table(keys) => Offer::table(of(keys)),
        Kind::Tagged { tag, kinds } => {
            let (name, keys) = kinds.first().map_or((STRANGE, &[][..]), |(name, keys)| (*name, keys));
            let mut table = of(keys);
            table.push((tag, Offer::text(name)));
            Offer::table(table)
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
        let Kind::Table(pulse) = &find(&scene, "pulse").kind else { panic!("a table") };
        assert_eq!(find(pulse, "energy_j").kind, Kind::Number);
        let Kind::Tagged { kinds, .. } = &find(pulse, "shape").kind else { panic!("tagged") };
        assert_eq!(find(&kinds[0].1, "definition").kind, Kind::Choice(&["fwhm", "one_over_e_half_width"]));
        let Kind::Tagged { tag: "kind", kinds } = &find(&scene, "flow").kind else { panic!("tagged") };
        let names = ["calm", "uniform", "linear", "vortex_lines", "vortex_pair", "simulated", "fields"];
        assert_eq!(kinds.iter().map(|k| k.0).collect::<Vec<_>>(), names);
        assert!(kinds[1].1.iter().all(|key| key.is_required && key.kind == Kind::Number) && kinds[1].1.len() == 2);
        assert!(kinds[4].1.iter().all(|key| !key.is_required));
        let Kind::Table(estimator) = &find(&scene, "estimator").kind else { panic!("a table") };
        assert_eq!(find(estimator, "false_alarm").kind, Kind::Number, "what may be absent");
        let Kind::Tagged { kinds, .. } = &find(estimator, "method").kind else { panic!("tagged") };
        assert_eq!(find(&kinds[2].1, "order").kind, Kind::Whole { largest: i64::MAX as u64 });
        let Kind::Tagged { kinds, .. } = &find(estimator, "radius").kind else { panic!("tagged") };
        let list = Kind::List { of: Box::new(Kind::Number), len: None };
        assert_eq!(find(&kinds[1].1, "range_m").kind, list);
    }

    #[test]
    fn no_key_is_beyond_description() {
        fn look(keys: &[Key]) {
            for key in keys {
                match &key.kind {
                    Kind::Other => panic!("{}", key.name),
                    Kind::Table(keys) => look(keys),
                    Kind::Tagged { kinds, .. } => kinds.iter().for_each(|(_, keys)| look(keys)),
                    Kind::List { of, .. } => assert_ne!(**of, Kind::Other, "{}", key.name),
                    _ => {}
                }
            }
        }
        look(&keys_of::<Scene>());
        #[cfg(feature = "flow")]
        look(&keys_of::<crate::flow::FlowCase>());
    }
}
