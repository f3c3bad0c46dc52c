//! Plans that come with the program.
//!
//! Check: each is a good plan.

/// Wakes of landing aircraft at an airport: 65 536 scans.
pub const LANDING: &str = include_str!("landing.toml");
/// A small set for tests: 512 scans.
pub const TINY: &str = include_str!("tiny.toml");

/// Names and texts of the plans.
pub const PRESETS: [(&str, &str); 2] = [("landing", LANDING), ("tiny", TINY)];

/// The text of a plan by its name.
pub fn preset_plan(name: &str) -> Option<&'static str> {
    let found = PRESETS.iter().find(|(own, _)| *own == name);
    found.map(|(_, text)| *text)
}
