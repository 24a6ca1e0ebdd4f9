//! Runs beside each other: a table for people, with the settings in which they differ, and the same for machines.

use super::list::Row;
use crate::report::table::fitted_table;
use serde_json::{Value, json};
use std::collections::BTreeSet;

/// Keys whose values are not the same in all rows, with those values, a row each; none of a single row.
fn differing(rows: &[Row]) -> Vec<(String, Vec<Option<Value>>)> {
    let keys: BTreeSet<&String> = rows.iter().flat_map(|row| row.settings.keys()).collect();
    let values = |key: &String| rows.iter().map(|row| row.settings.get(key).cloned()).collect::<Vec<_>>();
    let all = keys.into_iter().map(|key| (key.clone(), values(key)));
    // A key that a stage does not have (a planner has no train.rho) is no difference by itself.
    let differ = |values: &[Option<Value>]| {
        let mut known = values.iter().flatten();
        known.next().is_some_and(|first| known.any(|other| other != first))
    };
    all.filter(|(_, values)| differ(values)).collect()
}

/// For people: columns in which all rows are the same, and that say nothing, are left out.
pub fn list_text(rows: &[Row], width: Option<usize>) -> String {
    let differing = differing(rows);
    let optional = |name: &'static str, cells: Vec<String>| {
        let told = cells.iter().any(|cell| cell != "-");
        told.then_some((name.to_string(), cells))
    };
    let of = |cell: &dyn Fn(&Row) -> String| rows.iter().map(cell).collect::<Vec<String>>();
    let share = |v: f64| format!("{:.1}", 100.0 * v);
    let success = |row: &Row| {
        row.summary.as_ref().map_or("-".into(), |s| {
            let [low, high] = s.wilson_95;
            format!("{} % ({} to {})", share(s.success_rate), share(low), share(high))
        })
    };
    let episodes = |row: &Row| row.summary.as_ref().map_or("-".into(), |s| format!("{}/{}", s.successes, s.episodes));
    let mut columns = vec![
        Some(("run".to_string(), of(&|row| row.run.clone()))),
        Some(("success".to_string(), of(&success))),
        optional("episodes", of(&episodes)),
        Some(("task".to_string(), of(&|row| row.task.clone()))),
        optional("robot", of(&|row| row.robot.clone().unwrap_or("-".into()))),
        Some(("method".to_string(), of(&|row| row.method.clone()))),
        Some(("seed".to_string(), of(&|row| row.seed.to_string()))),
        optional("demos", of(&|row| row.demos.map_or("-".into(), |n| n.to_string()))),
        optional("wall time", of(&|row| row.wall_s.map_or("-".into(), |s| format!("{s:.0} s")))),
    ];
    columns.extend(differing.iter().map(|(key, values)| Some((key.clone(), values.iter().map(value_text).collect()))));
    let columns: Vec<(String, Vec<String>)> = columns.into_iter().flatten().collect();
    let header: Vec<&str> = columns.iter().map(|(name, _)| name.as_str()).collect();
    let cells: Vec<Vec<String>> =
        (0..rows.len()).map(|row| columns.iter().map(|(_, cells)| cells[row].clone()).collect()).collect();
    fitted_table(&header, &cells, width)
}

fn value_text(value: &Option<Value>) -> String {
    match value {
        None => "-".into(),
        Some(Value::String(text)) => text.clone(),
        Some(other) => other.to_string(),
    }
}

/// For machines: the rows, and of each the settings in which they differ.
pub fn list_json(rows: &[Row]) -> Value {
    let differing = differing(rows);
    let with_settings = |(at, row): (usize, &Row)| {
        let mut value = json!(row);
        let own = differing.iter().map(|(key, values)| (key.clone(), values[at].clone().unwrap_or(Value::Null)));
        value["differs"] = Value::Object(own.collect());
        value
    };
    json!({ "kind": "runs", "runs": rows.iter().enumerate().map(with_settings).collect::<Vec<_>>() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(run: &str, settings: &[(&str, Value)]) -> Row {
        let settings = settings.iter().map(|(key, value)| (key.to_string(), value.clone())).collect();
        Row {
            run: run.into(),
            task: "lift".into(),
            robot: None,
            method: "hil".into(),
            seed: 0,
            demos: Some(10),
            summary: None,
            wall_s: None,
            settings,
        }
    }

    #[test]
    fn only_settings_that_differ_are_told_and_a_key_that_one_lacks_is_no_difference() {
        let rows = [
            row("a", &[("train.rho", json!(0.3)), ("train.tau", json!(0.5)), ("train.ppo.worlds", json!(8))]),
            row("b", &[("train.rho", json!(0.6)), ("train.tau", json!(0.5))]),
        ];
        let keys: Vec<String> = differing(&rows).into_iter().map(|(key, _)| key).collect();
        assert_eq!(keys, ["train.rho"]);
        let text = list_text(&rows, None);
        assert!(text.starts_with("run  success  task  method  seed  demos  train.rho\n"), "{text}");
        assert_eq!(list_json(&rows)["runs"][1]["differs"], json!({ "train.rho": 0.6 }));
    }
}
