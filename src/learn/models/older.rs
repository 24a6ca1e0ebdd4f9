//! Settings that older versions of hilt wrote beside their networks become those that this one has.

use serde_json::{Map, Value};

/// Keys of dynamics networks that are gone, with the only value under which this version computes what they did.
const RETIRED: [(&str, u64); 2] = [("steps", 1), ("ensemble", 1)];
/// What keys of `[train.sc]` began with before it was a table.
const SC: &str = "sc_";

/// Those of a dynamics network.
///
/// # Errors
/// Says which key asks for what hilt no longer does.
pub fn of_dynamics(settings: &mut Map<String, Value>) -> Result<(), String> {
    for (key, neutral) in RETIRED {
        match settings.remove(key) {
            Some(value) if value != neutral => {
                return Err(format!("it was trained with pretrain.{key} = {value}, which hilt no longer has; pretrain it anew"));
            }
            _ => {}
        }
    }
    Ok(())
}

/// Those of a policy.
///
/// # Errors
/// None.
pub fn of_policy(settings: &mut Map<String, Value>) -> Result<(), String> {
    let (sc, rest): (Map<_, _>, Map<_, _>) = std::mem::take(settings).into_iter().partition(|(key, _)| key.starts_with(SC));
    *settings = rest;
    if !sc.is_empty() {
        let table: Map<_, _> = sc.into_iter().map(|(key, value)| (key[SC.len()..].to_string(), value)).collect();
        settings.insert("sc".into(), table.into());
    }
    Ok(())
}
