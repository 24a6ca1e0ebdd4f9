//! Which columns are state and action.

use super::{Declared, Info};
use crate::data::dataset::features::{ACTION, ENVIRONMENT, EPISODE, EXECUTED, FRAME, INDEX, STATE, TASK, TIMESTAMP};
use crate::layout::{Holds, Layout, Span};
use crate::words::did_you_mean;
use std::sync::Arc;

/// What stands before the name of the column that has a state after the action.
const NEXT: &str = "next.";
/// Columns that say where a row belongs, not what is in it.
const BOOKKEEPING: [&str; 5] = [TIMESTAMP, FRAME, EPISODE, INDEX, TASK];

/// Columns by name; none for the usual ones.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Choice {
    /// Those that make a state, in their order.
    pub state: Vec<String>,
    /// The one that is the action.
    pub action: Option<String>,
}

/// The columns of a dataset by what they are for.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Columns {
    pub(super) state: Vec<Declared>,
    /// Their values after the action, where all are there.
    pub(super) next: Option<Vec<Declared>>,
    pub(super) action: Declared,
    /// What the motors were given, where that is another column.
    pub(super) executed: Option<Declared>,
    /// Names of the columns that hold pictures, which are skipped.
    pub(super) pictures: Vec<String>,
}

impl Columns {
    /// The columns of `info` by `choice`. `Err` has what is lacking, by the column's name.
    pub(super) fn of(info: &Info, choice: &Choice) -> Result<Columns, String> {
        let usual = [STATE, ENVIRONMENT].into_iter().filter(|name| info.feature(name).is_some());
        let names: Vec<&str> = match choice.state.is_empty() {
            true => usual.collect(),
            false => choice.state.iter().map(String::as_str).collect(),
        };
        if names.is_empty() {
            return Err(format!("has no column {STATE}; name the columns that make a state with --state: {}", numeric(info)));
        }
        let state = names.iter().map(|name| column(info, name, "--state")).collect::<Result<Vec<_>, _>>()?;
        if let Some(twice) = names.iter().enumerate().find(|(i, name)| names[..*i].contains(name)) {
            return Err(format!("--state names {} twice", twice.1));
        }
        let action = column(info, choice.action.as_deref().unwrap_or(ACTION), "--action")?;
        if names.contains(&action.name.as_str()) {
            return Err(format!("--state and --action both name {}", action.name));
        }
        let same = |name: &str, as_this: &Declared| {
            info.feature(name).filter(|found| found.is_numeric() && found.width() == as_this.width()).cloned()
        };
        let next = state.iter().map(|column| same(&format!("{NEXT}{}", column.name), column)).collect();
        let executed = same(EXECUTED, &action).filter(|found| found.name != action.name && choice.action.is_none());
        let pictures = info.features.iter().filter(|column| column.is_picture()).map(|column| column.name.clone()).collect();
        Ok(Columns { state, next, action, executed, pictures })
    }

    /// What the rows hold: numbers and commands of which nothing more is known.
    pub(super) fn layout(&self, name: &str, fps: f64) -> Result<Arc<Layout>, String> {
        let span = |holds| move |column: &Declared| Span { name: column.name.clone(), holds, entries: column.entries() };
        let layout = Layout {
            name: name.into(),
            period_s: 1.0 / fps,
            state: self.state.iter().map(span(Holds::Numbers)).collect(),
            action: vec![span(Holds::Commands)(&self.action)],
            action_limits: Vec::new(),
            action_units: Vec::new(),
            aims: Vec::new(),
            arm: None,
        };
        layout.check().map(|()| Arc::new(layout))
    }
}

/// A column of numbers; `flag` is what names another.
fn column(info: &Info, name: &str, flag: &str) -> Result<Declared, String> {
    let Some(found) = info.feature(name) else {
        let hint = did_you_mean(name, info.features.iter().map(|feature| feature.name.as_str()));
        let sign = if hint.is_empty() { ";" } else { "" };
        return Err(format!(
            "has no column {name}{hint}{sign} its columns of numbers are {} (choose with {flag})",
            numeric(info)
        ));
    };
    if !found.is_numeric() {
        let (dtype, numeric) = (&found.dtype, numeric(info));
        return Err(format!("has {dtype} in column {name}, and numbers are needed: choose one of {numeric} with {flag}"));
    }
    Ok(found.clone())
}

/// The columns that could be chosen, in words.
fn numeric(info: &Info) -> String {
    let can_be = |column: &&Declared| column.is_numeric() && !BOOKKEEPING.contains(&column.name.as_str());
    let names: Vec<&str> = info.features.iter().filter(can_be).map(|column| column.name.as_str()).collect();
    if names.is_empty() { "none".into() } else { names.join(", ") }
}
