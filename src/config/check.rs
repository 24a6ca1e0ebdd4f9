//! Refuses settings that are unknown, of a wrong type or out of range, and says what is allowed.

use super::Pipeline;
use super::ranges::MOST_OBSTACLES;
use super::ranges::{RANGES, Range};
use crate::error::{Error, Result};
use crate::scene::Obstacle;
use crate::task::{Spread, built_in};
use crate::words::{did_you_mean, distance, near, shown};
use toml::{Table, Value};

/// A longer key is no slip of the finger, and takes long to compare.
const LONGEST_KEY: usize = 64;
/// Letters of a reason that are kept at each end.
const KEPT_OF_REASON: usize = 120;

/// A table as checked settings; `origin` says in an error where they were written.
pub(super) fn resolve(table: Table, origin: &str) -> Result<Pipeline> {
    unknown_keys(&table, origin)?;
    let pipeline: Pipeline = serde_path_to_error::deserialize(Value::Table(table.clone())).map_err(|e| {
        let key = plain_key(&e.path().to_string());
        let value =
            find(&table, &key).filter(|v| !v.is_table()).map_or(String::new(), |v| format!(" = {}", shown(&v.to_string())));
        let allowed = Range::of(&key).map_or(String::new(), |r| format!("; allowed: {r}"));
        let reason = e.inner().to_string();
        let reason = reason.lines().next().unwrap_or_default();
        let hint = meant_variant(reason);
        Error::Usage(format!("{origin}: {}{value}: {}{hint}{allowed}", e.path(), shortened(reason)))
    })?;
    // The sections of learning check themselves, wherever their settings come from.
    let others =
        leaves(&pipeline.to_table()?).into_iter().filter(|(key, _)| !key.starts_with("pretrain.") && !key.starts_with("train."));
    for (key, value) in others {
        if let Some(range) = Range::of(&key) {
            range.check(&key, &value).map_err(|why| Error::Usage(format!("{origin}: {why}")))?;
        }
    }
    for learning in [pipeline.pretrain.validate(), pipeline.train.validate()] {
        learning.map_err(|why| Error::Usage(format!("{origin}: {why}")))?;
    }
    let boxes = pipeline.scene.obstacles.len();
    if boxes > MOST_OBSTACLES {
        return Err(Error::Usage(format!("{origin}: scene.obstacles has {boxes} boxes; allowed: up to {MOST_OBSTACLES}")));
    }
    all_ordered(&pipeline, origin)?;
    Ok(pipeline)
}

fn all_ordered(Pipeline { scene, simulate, .. }: &Pipeline, origin: &str) -> Result<()> {
    let areas = [
        ("scene.spawn_x_m", scene.spawn_x_m),
        ("scene.spawn_y_m", scene.spawn_y_m),
        ("scene.goal_x_m", scene.goal_x_m),
        ("scene.goal_y_m", scene.goal_y_m),
    ];
    let [base_x, base_y] = scene.base_xy_m;
    let spreads = [
        ("scene.base_xy_m", base_x),
        ("scene.base_xy_m", base_y),
        ("scene.friction", scene.friction),
        ("scene.block_mass_kg", scene.block_mass_kg),
        ("scene.finger_friction", scene.finger_friction),
        ("simulate.delay_steps", simulate.delay_steps),
    ];
    let ranges = spreads.into_iter().filter_map(|(key, spread)| match spread {
        Spread::Fixed(_) => None,
        Spread::Between(range) => Some((key, range)),
    });
    areas.into_iter().chain(ranges).try_for_each(|(key, range)| ordered(key, range, origin))
}

fn ordered(key: &str, [low, high]: [f64; 2], origin: &str) -> Result<()> {
    if low <= high {
        return Ok(());
    }
    Err(Error::Usage(format!("{origin}: {key} = [{low}, {high}]: allowed: the lower end first, [low, high]")))
}

fn unknown_keys(table: &Table, origin: &str) -> Result<()> {
    let known = known_keys();
    // What a task says is checked where it is read.
    for (key, _) in leaves(table).into_iter().filter(|(key, _)| !key.starts_with("task.")) {
        if !known.contains(&key) && !known.iter().any(|k| k.starts_with(&format!("{key}."))) {
            let (key, hint) = (shown(&key), hint(&key));
            return Err(Error::Usage(format!("{origin}: unknown key {key}{hint} (`hilt settings` prints all keys)")));
        }
    }
    Ok(())
}

/// `; did you mean plan.speed?`, or nothing when no known key is near.
pub(super) fn hint(key: &str) -> String {
    nearest(key).map_or(String::new(), |known| format!("; did you mean {known}?"))
}

/// The known dotted key or section that was meant, if one is near: by its full name, or by its last part alone.
fn nearest(key: &str) -> Option<String> {
    if key.len() > LONGEST_KEY {
        return None;
    }
    let last = |k: &str| k.rsplit('.').next().unwrap_or_default().to_string();
    let mut known = known_keys();
    known.extend(known_sections());
    let apart = |k: &str| {
        let (full, part) = (distance(k, key), distance(&last(k), &last(key)));
        let meant = near(full, k.len()) || near(part, last(k).len());
        meant.then_some(full.min(part + 1))
    };
    let candidates = known.into_iter().filter_map(|k| Some((apart(&k)?, k)));
    candidates.min_by_key(|(apart, _)| *apart).map(|(_, k)| k)
}

/// From ``unknown variant `tan`, expected `tanh` or `relu` ``: which one was meant.
fn meant_variant(reason: &str) -> String {
    let mut names = reason.split('`').skip(1).step_by(2);
    match names.next() {
        Some(given) if reason.starts_with("unknown variant") => did_you_mean(given, names),
        _ => String::new(),
    }
}

/// A reason that repeats a long value, without its middle.
fn shortened(reason: &str) -> String {
    let letters: Vec<char> = reason.chars().collect();
    match letters.len().checked_sub(2 * KEPT_OF_REASON) {
        None | Some(0) => reason.into(),
        Some(middle) => {
            let [head, tail] = [&letters[..KEPT_OF_REASON], &letters[KEPT_OF_REASON + middle..]].map(String::from_iter);
            format!("{head}...{tail}")
        }
    }
}

/// Every dotted key that a pipeline file may hold, found by writing out the defaults with one obstacle in them.
fn known_keys() -> Vec<String> {
    let mut keys: Vec<String> = leaves(&example()).into_iter().map(|(key, _)| key).collect();
    keys.extend(RANGES.iter().map(|r| r.key.to_string()));
    keys.push("scene.obstacles".into());
    keys
}

fn known_sections() -> Vec<String> {
    example().iter().filter(|(_, v)| v.is_table()).map(|(k, _)| k.clone()).collect()
}

pub(super) fn example() -> Table {
    let mut pipeline = Pipeline::defaults(&built_in::pick_up());
    pipeline.scene.obstacles = vec![Obstacle { center_m: [0.0; 3], size_m: [1.0; 3] }];
    pipeline.to_table().expect("default settings have a form in TOML")
}

/// All values that are not tables, under dotted keys; a list of tables shares one key without its positions.
pub(super) fn leaves(table: &Table) -> Vec<(String, Value)> {
    fn walk(key: &str, value: &Value, out: &mut Vec<(String, Value)>) {
        let under = |name: &str| if key.is_empty() { name.to_string() } else { format!("{key}.{name}") };
        match value {
            Value::Table(inner) if !inner.is_empty() => inner.iter().for_each(|(name, v)| walk(&under(name), v, out)),
            Value::Array(items) if items.first().is_some_and(Value::is_table) => items.iter().for_each(|v| walk(key, v, out)),
            _ => out.push((key.to_string(), value.clone())),
        }
    }
    let mut out = Vec::new();
    for (name, value) in table {
        walk(name, value, &mut out);
    }
    out
}

/// `scene.obstacles[0].size_m[2]` as `scene.obstacles.size_m`.
fn plain_key(path: &str) -> String {
    path.split('.').map(|part| part.split('[').next().unwrap_or_default()).collect::<Vec<_>>().join(".")
}

fn find<'a>(table: &'a Table, key: &str) -> Option<&'a Value> {
    let mut parts = key.split('.');
    let first = table.get(parts.next()?)?;
    parts.try_fold(first, |at, part| at.get(part))
}
