//! Error against run time: which of the measured settings are worth their time, and which of them a scene should have.
//!
//! The settings of keys are those of `accuracy.csv`, which `cargo xtask work-precision --store` measures and writes.

use super::{Plan, Stage};
use crate::Error;
use crate::scene::{Method, Scene, SceneFile, Turbulence};

/// What was measured of keys of a scene.
const MEASURED: &str = include_str!("accuracy.csv");

/// A setting that was measured: what it takes, and how far off it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// Processor time \[s\].
    pub core_s: f64,
    /// Relative error; NaN where the setting failed.
    pub error: f64,
    /// Its standard error; zero where the error is exact.
    pub standard_error: f64,
}

/// Whether no other setting is at least as good in error and in time and better in one of them; equal settings stay together,
/// and one that failed is never on the front.
#[must_use]
pub fn on_front(settings: &[Measured]) -> Vec<bool> {
    let known = |s: &Measured| s.error.is_finite() && s.core_s.is_finite();
    let beats = |a: &Measured, b: &Measured| {
        a.error <= b.error && a.core_s <= b.core_s && (a.error < b.error || a.core_s < b.core_s)
    };
    settings.iter().map(|s| known(s) && !settings.iter().any(|other| known(other) && beats(other, s))).collect()
}

/// Place of the setting of least time whose error and two standard errors are at most `target`; none if no setting is so good.
#[must_use]
pub fn cheapest(settings: &[Measured], target: f64) -> Option<usize> {
    let reaches = |s: &Measured| s.error + 2.0 * s.standard_error <= target && s.core_s.is_finite();
    let good = settings.iter().enumerate().filter(|(_, s)| reaches(s));
    good.min_by(|a, b| a.1.core_s.total_cmp(&b.1.core_s)).map(|(place, _)| place)
}

/// A key of a scene whose value sets how exact the result is.
struct Knob {
    key: &'static str,
    /// The value of a scene in which the key has an effect of the kind that was measured.
    get: fn(&Plan) -> Option<usize>,
    set: fn(&mut Scene, usize),
}

const KNOBS: [Knob; 6] = [
    Knob {
        key: "atmosphere.turbulence.layers",
        get: |plan| screens(plan).map(|t| t.0),
        set: |scene, value| {
            if let Turbulence::Refractive(turbulence) = &mut scene.atmosphere.turbulence {
                turbulence.layers = value;
            }
        },
    },
    Knob {
        key: "atmosphere.turbulence.grid_points",
        get: |plan| screens(plan).map(|t| t.1),
        set: |scene, value| {
            if let Turbulence::Refractive(turbulence) = &mut scene.atmosphere.turbulence {
                // The width stays: finer or coarser points.
                turbulence.grid_spacing_m *= turbulence.grid_points as f64 / value as f64;
                turbulence.grid_points = value;
            }
        },
    },
    Knob {
        key: "atmosphere.turbulence.realisations",
        get: |plan| screens(plan).map(|t| t.2),
        set: |scene, value| {
            if let Turbulence::Refractive(turbulence) = &mut scene.atmosphere.turbulence {
                turbulence.realisations = value;
            }
        },
    },
    Knob {
        key: "estimator.padded_samples",
        get: |plan| accumulated(plan).map(|scene| scene.estimator.padded_samples),
        set: |scene, value| scene.estimator.padded_samples = value,
    },
    Knob {
        key: "estimator.window_step_samples",
        get: |plan| accumulated(plan).map(|scene| scene.estimator.window_step_samples),
        set: |scene, value| scene.estimator.window_step_samples = value,
    },
    Knob {
        key: "scan.realisations",
        get: |plan| accumulated(plan).map(|scene| scene.scan.realisations),
        set: |scene, value| scene.scan.realisations = value,
    },
];

/// Layers, points and realisations of the phase screens, where they are run.
fn screens(plan: &Plan) -> Option<(usize, usize, usize)> {
    match &plan.scene.scene.atmosphere.turbulence {
        Turbulence::Refractive(t) if plan.runs(Stage::PhaseScreens) => Some((t.layers, t.grid_points, t.realisations)),
        _ => None,
    }
}

/// The scene, if it makes a map with the method for which padding and spacing were measured.
fn accumulated(plan: &Plan) -> Option<&Scene> {
    let scene = &plan.scene.scene;
    let is_measured = matches!(scene.estimator.method, Method::PeriodogramAccumulation {});
    (is_measured && plan.runs(Stage::Estimates)).then_some(scene)
}

/// The cheapest value of a key that reaches an error.
#[derive(Debug, Clone, PartialEq)]
pub struct Proposal {
    /// The key.
    pub key: &'static str,
    /// Its value in the scene.
    pub now: usize,
    /// The cheapest measured value that reaches the error, with what was measured; none reaches it where absent.
    pub proposed: Option<(usize, Measured)>,
    /// Forecast of the run with this value and the rest of the scene as it is \[s of one core\].
    pub core_s: Option<f64>,
}

/// For each key of the scene that was measured, the cheapest value whose error and two standard errors are at most `target`.
///
/// # Errors
/// A scene that a proposal makes and that cannot be planned.
pub fn proposals(plan: &Plan, target: f64) -> Result<Vec<Proposal>, Error> {
    let mut out = Vec::new();
    for knob in &KNOBS {
        let Some(now) = (knob.get)(plan) else { continue };
        let rows: Vec<(usize, Measured)> =
            measured().filter(|(key, ..)| *key == knob.key).map(|(_, v, m)| (v, m)).collect();
        let settings: Vec<Measured> = rows.iter().map(|(_, m)| *m).collect();
        let proposed = cheapest(&settings, target).and_then(|place| rows.get(place).copied());
        let core_s = match proposed {
            Some((value, _)) => {
                let mut scene = plan.scene.scene.clone();
                (knob.set)(&mut scene, value);
                // What the scene then violates is said by its own check; the proposal stands without a forecast.
                let file = SceneFile::new(scene).ok().map(|file| file.with_file_of(plan.scene.clone()));
                file.and_then(|file| Plan::new(file, plan.target).ok()).map(|changed| changed.total().core_s)
            }
            None => None,
        };
        out.push(Proposal { key: knob.key, now, proposed, core_s });
    }
    Ok(out)
}

/// Rows of the stored table: key, value, what was measured.
fn measured() -> impl Iterator<Item = (&'static str, usize, Measured)> {
    let rows = MEASURED.lines().filter(|line| !line.starts_with('#')).skip(1);
    rows.filter_map(|line: &'static str| {
        let mut cells = line.split(',');
        let key = cells.next()?;
        let mut number = || cells.next()?.parse::<f64>().ok();
        let (value, error, standard_error, core_s) = (number()?, number()?, number()?, number()?);
        Some((key, value as usize, Measured { core_s, error, standard_error }))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn front_and_cheapest_settings_are_those_of_the_reference() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/reference/sim/cheapest.csv");
        let text = std::fs::read_to_string(path).unwrap();
        let rows: Vec<Vec<&str>> = text
            .lines()
            .filter(|line| !line.starts_with('#') && !line.starts_with("setting,"))
            .map(|line| line.split(',').collect())
            .collect();
        let number = |row: &[&str], column: usize| row[column].parse::<f64>().unwrap();
        let settings: Vec<Measured> = rows
            .iter()
            .map(|r| Measured { core_s: number(r, 1), error: number(r, 2), standard_error: number(r, 3) })
            .collect();
        let is = |column: usize| rows.iter().map(|r| r[column] == "true").collect::<Vec<bool>>();
        assert_eq!(settings.len(), 7);
        assert_eq!(on_front(&settings), is(4));
        for (column, target) in [(5, 0.10), (6, 0.03), (7, 0.01)] {
            let found = cheapest(&settings, target);
            assert_eq!((0..7).map(|place| Some(place) == found).collect::<Vec<_>>(), is(column), "{target}");
        }
    }

    #[test]
    fn settings_that_fail_and_targets_beyond_reach_give_none() {
        let of = |core_s, error, standard_error| Measured { core_s, error, standard_error };
        let settings = [of(1.0, f64::NAN, 0.0), of(2.0, 0.02, 0.01), of(2.0, 0.02, 0.01), of(f64::NAN, 0.0, 0.0)];
        assert_eq!(on_front(&settings), [false, true, true, false]);
        assert_eq!((cheapest(&settings, 0.05), cheapest(&settings, 0.03), cheapest(&[], 1.0)), (Some(1), None, None));
    }

    #[test]
    fn proposals_reach_what_is_asked_and_name_keys_of_the_scene_alone() {
        let plan = |text: &str| {
            let file = SceneFile::parse(text, std::path::Path::new("s.toml")).unwrap();
            Plan::new(file, crate::plan::Target::Run).unwrap()
        };
        let keys = |plan: &Plan| proposals(plan, 0.03).unwrap().iter().map(|p| p.key).collect::<Vec<_>>();
        let plain = plan("");
        assert_eq!(keys(&plain), ["estimator.padded_samples", "estimator.window_step_samples", "scan.realisations"]);
        let other = plan("[estimator.method]\nkind = \"autoregressive\"\n");
        assert!(keys(&other).is_empty(), "nothing was measured of other methods");
        let padding = |target: f64| proposals(&plain, target).unwrap()[0].clone();
        for target in [0.1, 0.03] {
            let (value, measured) = padding(target).proposed.unwrap();
            assert!(measured.error + 2.0 * measured.standard_error <= target && value >= 128, "{target}: {value}");
            assert!(padding(target).core_s.unwrap() > 0.0);
        }
        assert!(
            padding(1e-9).proposed.is_none() && padding(0.1).proposed.unwrap().0 <= padding(0.03).proposed.unwrap().0
        );
    }

    #[test]
    fn every_stored_row_is_a_setting_of_a_known_key() {
        let rows = MEASURED.lines().filter(|line| !line.starts_with('#')).skip(1).count();
        assert!(rows > 20 && measured().count() == rows);
        for (key, value, measured) in measured() {
            assert!(KNOBS.iter().any(|knob| knob.key == key) && value > 0 && measured.core_s > 0.0, "{key} {value}");
        }
    }
}
