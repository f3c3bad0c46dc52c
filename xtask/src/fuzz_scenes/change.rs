//! Random changes of the default scene: numbers scaled and driven to extremes, other kinds and methods, several keys at once.

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::sync::LazyLock;
use toml::{Table, Value};
use wakescope_sim::scene::Scene;

/// What may stand in place of what the default scene has.
#[derive(Default, Deserialize)]
struct Changes {
    /// By section: a short scan, so that a change may make it longer and yet let it end soon.
    short: BTreeMap<String, Table>,
    /// Section, key in it, table of another kind.
    kinds: Vec<(String, String, Value)>,
    /// Section and key that the default scene does not have, and a usual value.
    absent: Vec<(String, String, Value)>,
    /// What a key takes.
    words: BTreeMap<String, Vec<String>>,
}

/// The list of them; the test draws from it.
static CHANGES: LazyLock<Changes> =
    LazyLock::new(|| toml::from_str(include_str!("changes.toml")).unwrap_or_default());

/// The scene of that number.
pub(super) fn scene(seed: u64, index: u64) -> String {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(
        seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(index),
    );
    let mut scene = Table::try_from(Scene::default()).unwrap_or_default();
    for (section, keys) in &CHANGES.short {
        keys.iter()
            .for_each(|(key, value)| put(&mut scene, section, key, value.clone()));
    }
    // Mostly one or two changes, now and then many.
    let changes = 1 + pick(&mut rng, 3) * pick(&mut rng, 2) + 6 * (pick(&mut rng, 12) / 11);
    for _ in 0..changes {
        match pick(&mut rng, 10) {
            0..2 => {
                let (section, key, kind) = &CHANGES.kinds[pick(&mut rng, CHANGES.kinds.len())];
                put(&mut scene, section, key, kind.clone());
            }
            2 => {
                let (section, key, value) = &CHANGES.absent[pick(&mut rng, CHANGES.absent.len())];
                let value = changed(value, key, &mut rng);
                put(&mut scene, section, key, value);
            }
            _ => change_a_key(&mut scene, &mut rng),
        }
    }
    let usual = Table::try_from(Scene::default()).unwrap_or_default();
    toml::to_string(&stated(&scene, &usual)).unwrap_or_default()
}

/// What differs from the defaults: keys that a method has no use for may not be stated, even with their defaults.
fn stated(scene: &Table, usual: &Table) -> Table {
    let mut out = Table::new();
    for (key, value) in scene {
        match (value, usual.get(key)) {
            (Value::Table(inner), Some(Value::Table(usual)))
                if inner.get("kind") == usual.get("kind") =>
            {
                let inner = stated(inner, usual);
                out.extend((!inner.is_empty()).then(|| (key.clone(), Value::Table(inner))));
            }
            (value, Some(usual)) if value == usual => {}
            _ => out.extend([(key.clone(), value.clone())]),
        }
    }
    out
}

fn pick(rng: &mut Xoshiro256PlusPlus, below: usize) -> usize {
    (rng.next_u64() % below.max(1) as u64) as usize
}

/// Puts a value into a section, or into the scene itself.
fn put(scene: &mut Table, section: &str, key: &str, value: Value) {
    if section.is_empty() {
        scene.insert(key.into(), value);
        return;
    }
    let inside = scene
        .entry(section)
        .or_insert_with(|| Value::Table(Table::new()));
    match inside {
        Value::Table(table) => drop(table.insert(key.into(), value)),
        other => *other = Value::Table(Table::from_iter([(key.into(), value)])),
    }
}

/// Goes down the tables at random until it meets a value.
fn change_a_key(table: &mut Table, rng: &mut Xoshiro256PlusPlus) {
    let chosen = pick(rng, table.len());
    match table.iter_mut().nth(chosen) {
        Some((_, Value::Table(inner))) if !inner.is_empty() => change_a_key(inner, rng),
        Some((key, value)) => *value = changed(value, &key.clone(), rng),
        None => {}
    }
}

fn changed(value: &Value, key: &str, rng: &mut Xoshiro256PlusPlus) -> Value {
    match value {
        Value::Float(x) => Value::Float(changed_number(*x, rng)),
        Value::Integer(n) => Value::Integer(changed_count(*n, rng)),
        Value::Boolean(is_on) => Value::Boolean(!is_on),
        Value::String(_) => {
            let words = CHANGES.words.get(key).map_or(&[][..], Vec::as_slice);
            Value::String(
                words
                    .get(pick(rng, words.len()))
                    .map_or("nonsense".into(), Clone::clone),
            )
        }
        Value::Array(list) => Value::Array(list.iter().map(|v| changed(v, key, rng)).collect()),
        other => other.clone(),
    }
}

fn changed_number(x: f64, rng: &mut Xoshiro256PlusPlus) -> f64 {
    const EXTREMES: [f64; 12] = [
        0.0,
        -0.0,
        f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        1e308,
        5e-324,
        1e-300,
        -1.0,
        1.0,
        1e9,
        1e-9,
    ];
    let unit = (rng.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
    match pick(rng, 8) {
        0 => EXTREMES[pick(rng, EXTREMES.len())],
        1 => -x,
        2 | 3 => x * 10f64.powi(pick(rng, 13) as i32 - 6),
        // Near the value, where most scenes are good.
        _ => x * 10f64.powf(1.2 * unit - 0.6),
    }
}

fn changed_count(n: i64, rng: &mut Xoshiro256PlusPlus) -> i64 {
    const EXTREMES: [i64; 8] = [0, 1, -1, 2, 3, i64::MAX, 1 << 31, 1_000_000];
    match pick(rng, 4) {
        0 => EXTREMES[pick(rng, EXTREMES.len())],
        1 => n.saturating_mul(1 << pick(rng, 12)),
        _ => n
            .saturating_sub(n / 2)
            .saturating_add(pick(rng, 2 * n.clamp(1, 1 << 40) as usize) as i64),
    }
}
