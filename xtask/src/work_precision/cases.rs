//! What is measured: the cases, what the error of each is, and the panels that are drawn.

use serde::Deserialize;
use std::collections::BTreeMap;
use std::sync::LazyLock;

/// What the settings of a case have in common.
#[derive(Deserialize)]
pub(super) struct Case {
    pub(super) name: String,
    /// What the error is, and against what.
    pub(super) metric: String,
    pub(super) reference: String,
    /// None of a case that is not drawn.
    pub(super) panel: Option<Panel>,
}

#[derive(Deserialize)]
pub(super) struct Panel {
    pub(super) title: String,
    /// What is compared with what.
    pub(super) compared: String,
    /// A slope through the first point of this program: its label and its power.
    pub(super) guide: Option<(String, f64)>,
}

/// All cases, in the order of the panels.
pub(super) static CASES: LazyLock<Vec<Case>> = LazyLock::new(|| {
    let cases: Result<BTreeMap<String, Vec<Case>>, _> = toml::from_str(include_str!("cases.toml"));
    cases.map_or(Vec::new(), |cases| cases.into_values().flatten().collect())
});
