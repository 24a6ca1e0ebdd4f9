//! What happened when: phases of the demonstrator, contacts, milestones; times in control steps.

use crate::demo::{Contacts, Episode};
use crate::joints::Joints;
use serde_json::{Value, json};

/// First and end of each run of equal values that are something.
fn spans<T: PartialEq + Copy>(values: impl Iterator<Item = Option<T>>) -> Vec<(usize, usize, T)> {
    let mut spans: Vec<(usize, usize, T)> = Vec::new();
    for (t, value) in values.enumerate() {
        match (value, spans.last_mut()) {
            (Some(value), Some((_, end, of))) if *end == t && *of == value => *end = t + 1,
            (Some(value), _) => spans.push((t, t + 1, value)),
            (None, _) => {}
        }
    }
    spans
}

/// First, end and name of each phase.
pub(super) fn phases(episode: &Episode) -> Vec<(usize, usize, &'static str)> {
    let found = spans(episode.steps.iter().map(|step| step.phase));
    found.into_iter().map(|(from, to, phase)| (from, to, phase.name())).collect()
}

/// Who touches whom, of those who ever do: fingers and objects, objects and each other, the robot and what it should not touch. Objects on the table are not told.
pub(super) fn touches(episode: &Episode) -> Vec<Value> {
    let objects = &episode.scene.task.objects;
    let mut all = Vec::new();
    let mut add = |kind: &str, name: String, holds: &dyn Fn(&Contacts) -> bool| {
        let found = spans(episode.moments().map(|step| holds(&step.contacts).then_some(())));
        if !found.is_empty() {
            let spans: Vec<(usize, usize)> = found.into_iter().map(|(from, to, ())| (from, to)).collect();
            all.push(json!({ "kind": kind, "name": name, "spans": spans }));
        }
    };
    let pressed = |forces: &Joints| forces.iter().any(|force| *force > 0.0);
    for (i, object) in objects.iter().enumerate() {
        add("fingers", format!("fingers on {}", object.name), &|contacts| pressed(&contacts.objects[i].fingers_n));
    }
    for (i, object) in objects.iter().enumerate() {
        for (k, other) in objects.iter().enumerate().skip(i + 1) {
            let name = format!("{} on {}", object.name, other.name);
            add("objects", name, &|contacts| {
                contacts.objects[i].objects.contains(&k) || contacts.objects[k].objects.contains(&i)
            });
        }
    }
    add("bad", "robot on obstacle".into(), &|contacts| contacts.robot_obstacle);
    add("bad", "robot on table".into(), &|contacts| contacts.robot_table);
    all
}

/// When a condition holds that did not before, the first time; those that hold from the start are none.
pub(super) fn milestones(episode: &Episode) -> Vec<(usize, String)> {
    let first = |k: usize| {
        let holds: Vec<bool> = episode.moments().map(|step| step.conditions[k]).collect();
        (1..holds.len()).find(|t| holds[*t] && !holds[t - 1]).filter(|_| !holds[0])
    };
    let names = episode.scene.task.condition_names();
    let mut found: Vec<(usize, String)> =
        names.iter().enumerate().filter_map(|(k, name)| Some((first(k)?, name.replace('_', " ")))).collect();
    found.sort();
    found
}

#[cfg(test)]
mod tests {
    use super::spans;

    #[test]
    fn spans_are_runs_of_equal_values() {
        let values = [None, Some('a'), Some('a'), Some('b'), None, Some('b')];
        assert_eq!(spans(values.into_iter()), [(1, 3, 'a'), (3, 4, 'b'), (5, 6, 'b')]);
    }
}
