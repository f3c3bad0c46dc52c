//! The one deserializer of scenes and case files: of what a text holds and of what a probe offers alike.
//!
//! Serde compiles every type once for each deserializer that it is read from, and the keys are a large part of this crate: so
//! there is one for both, and none of TOML's own beside it.

use serde::de::value::{MapDeserializer, SeqDeserializer};
use serde::de::{Deserializer, Expected, IntoDeserializer, Unexpected, Visitor};
use std::borrow::Cow;
use std::fmt::Display;

/// A value on offer.
#[derive(Debug, Clone)]
pub(super) enum Offer {
    Whole(i64),
    Number(f64),
    Switch(bool),
    Text(Cow<'static, str>),
    List(Vec<Offer>),
    Table(Vec<(Cow<'static, str>, Offer)>),
}

impl Offer {
    pub(super) fn text(text: &'static str) -> Self {
        Self::Text(text.into())
    }

    pub(super) fn table(values: impl IntoIterator<Item = (&'static str, Self)>) -> Self {
        Self::Table(values.into_iter().map(|(key, value)| (key.into(), value)).collect())
    }
}

impl From<toml::Value> for Offer {
    fn from(value: toml::Value) -> Self {
        match value {
            toml::Value::Integer(value) => Self::Whole(value),
            toml::Value::Float(value) => Self::Number(value),
            toml::Value::Boolean(value) => Self::Switch(value),
            toml::Value::String(text) => Self::Text(text.into()),
            // The walk beside the keys has refused dates before: no key takes one.
            toml::Value::Datetime(date) => Self::Text(date.to_string().into()),
            toml::Value::Array(values) => Self::List(values.into_iter().map(Self::from).collect()),
            toml::Value::Table(table) => table.into(),
        }
    }
}

impl From<toml::Table> for Offer {
    fn from(table: toml::Table) -> Self {
        Self::Table(table.into_iter().map(|(key, value)| (key.into(), value.into())).collect())
    }
}

/// What a type says to an offer.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Answer {
    Accepted,
    UnknownKey(&'static [&'static str]),
    UnknownVariant(&'static [&'static str]),
    Missing(&'static str),
    Wanted(String),
    Other(String),
}

impl std::error::Error for Answer {}

impl Display for Answer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Accepted => write!(f, "accepted"),
            Self::UnknownKey(names) => write!(f, "an unknown key, expected one of {}", names.join(", ")),
            Self::UnknownVariant(names) => write!(f, "an unknown kind, expected one of {}", names.join(", ")),
            Self::Missing(name) => write!(f, "{name} is missing"),
            Self::Wanted(what) => write!(f, "expected {what}"),
            Self::Other(message) => write!(f, "{message}"),
        }
    }
}

impl serde::de::Error for Answer {
    fn custom<T: Display>(message: T) -> Self {
        Self::Other(message.to_string())
    }
    fn invalid_type(_: Unexpected<'_>, wanted: &dyn Expected) -> Self {
        Self::Wanted(wanted.to_string())
    }
    fn unknown_variant(_: &str, names: &'static [&'static str]) -> Self {
        Self::UnknownVariant(names)
    }
    fn unknown_field(_: &str, names: &'static [&'static str]) -> Self {
        Self::UnknownKey(names)
    }
    fn missing_field(name: &'static str) -> Self {
        Self::Missing(name)
    }
}

impl IntoDeserializer<'_, Answer> for Offer {
    type Deserializer = Self;

    fn into_deserializer(self) -> Self {
        self
    }
}

impl<'de> Deserializer<'de> for Offer {
    type Error = Answer;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Answer> {
        match self {
            Self::Whole(value) => visitor.visit_i64(value),
            Self::Number(value) => visitor.visit_f64(value),
            Self::Switch(value) => visitor.visit_bool(value),
            Self::Text(text) => visitor.visit_str(&text),
            Self::List(values) => visitor.visit_seq(SeqDeserializer::new(values.into_iter())),
            Self::Table(values) => visitor.visit_map(MapDeserializer::new(values.into_iter())),
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Answer> {
        visitor.visit_some(self)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Answer> {
        match self {
            Self::Text(text) => visitor.visit_enum(text.into_deserializer()),
            _ => Err(Answer::Other("expected a text".into())),
        }
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 u8 u16 u32 u64 f32 f64 char str string bytes byte_buf unit unit_struct newtype_struct seq tuple
        tuple_struct map struct identifier ignored_any
    }
}
