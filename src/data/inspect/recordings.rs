//! One recording, and a directory of them.

use super::answer::answer;
use super::statistics::{by_entry, statistics};
use crate::data::{ContentHash, Provenance, dataset, recording};
use crate::demo::{Episode, Phase, Step};
use crate::error::{Error, Result};
use crate::interrupt::Interrupt;
use crate::scene::Scene;
use crate::state::{Action, CONTROL_DT_S};
use crate::task::FailureClass;
use rayon::prelude::*;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::path::Path;

/// One episode.
pub(super) fn one(path: &Path) -> Result<Value> {
    let (episode, provenance) = recording::read(path)?;
    let states: Vec<f32> = episode.moments().flat_map(|s| s.state.to_row()).collect();
    let actions =
        |pick: fn(&Step) -> &Action| episode.steps.iter().flat_map(|s| pick(s).iter().map(|v| *v as f32)).collect::<Vec<_>>();
    let layout = episode.scene.task.layout(&episode.scene.robot);
    let [state_names, action_names] = [&layout.state, &layout.action].map(|spans| dataset::names(spans));
    let rest = json!({
        "task": episode.scene.task.name,
        "robot": episode.scene.robot.name,
        "episode": episode.index,
        "steps": episode.steps.len(),
        "duration_s": episode.steps.len() as f64 * CONTROL_DT_S,
        "success": episode.success,
        "failure": episode.failure.map(FailureClass::name),
        "reward": reward(&episode),
        "scene": scene(&episode.scene),
        "conditions": conditions(&episode),
        "phase_steps": phases(&episode),
        "contact_steps": contacts(&episode),
        "states": by_entry(&state_names, &states),
        "actions": by_entry(&action_names, &actions(|s| &s.commanded)),
        "executed_actions": by_entry(&action_names, &actions(|s| &s.executed)),
    });
    Ok(answer("recording", &provenance, rest))
}

/// All recordings in a directory.
pub(super) fn all(dir: &Path, interrupt: &Interrupt) -> Result<Value> {
    let files = recording::files(dir)?;
    if files.is_empty() {
        return Err(Error::input(
            dir,
            "is neither a run, a dataset nor a directory of recordings (episode-00000.mcap, ...); hilt runs lists the runs below it",
        ));
    }
    let (mut all, mut origins) = (Counts::default(), Origins::default());
    for window in files.chunks(AT_ONCE) {
        let read = window.par_iter().map(|file| {
            interrupt.check()?;
            recording::read(file).map(|(episode, provenance)| (Glance::at(&episode), provenance))
        });
        // One after the other: of several that cannot be read the first by name is told, whatever the threads.
        for found in read.collect::<Vec<Result<_>>>() {
            let (glance, provenance) = found?;
            all.add(glance);
            origins.add(provenance);
        }
    }
    Ok(origins.describe(all.describe()))
}

/// Recordings that are read at once, on all threads; of each is kept a glance and its provenance.
const AT_ONCE: usize = 256;

/// What a description takes of an episode.
struct Glance {
    index: u64,
    steps: usize,
    reward: f64,
    success: bool,
    failure: Option<FailureClass>,
    hit: bool,
}

impl Glance {
    fn at(episode: &Episode) -> Self {
        Glance {
            index: episode.index,
            steps: episode.steps.len(),
            reward: reward(episode),
            success: episode.success,
            failure: episode.failure,
            hit: episode.moments().any(|s| s.contacts.robot_obstacle),
        }
    }
}

/// What is kept of all recordings.
#[derive(Default)]
struct Counts {
    steps: Vec<f64>,
    rewards: Vec<f64>,
    failures: BTreeMap<&'static str, usize>,
    failed: Vec<u64>,
    hit: usize,
}

impl Counts {
    fn add(&mut self, glance: Glance) {
        self.steps.push(glance.steps as f64);
        self.rewards.push(glance.reward);
        if let Some(class) = glance.failure {
            *self.failures.entry(class.name()).or_default() += 1;
        }
        if !glance.success {
            self.failed.push(glance.index);
        }
        self.hit += usize::from(glance.hit);
    }

    fn describe(&self) -> Map<String, Value> {
        let fields = [
            ("kind", json!("recordings")),
            ("episodes", json!(self.steps.len())),
            ("episodes_with_obstacle_contact", json!(self.hit)),
            ("successes", json!(self.steps.len() - self.failed.len())),
            ("failures", json!(self.failures)),
            ("failed_episodes", json!(self.failed)),
            ("steps", json!(self.steps.iter().sum::<f64>() as u64)),
            ("episode_steps", json!(statistics(self.steps.iter().copied()))),
            ("episode_reward", json!(statistics(self.rewards.iter().copied()))),
        ];
        Map::from_iter(fields.map(|(key, value)| (key.to_string(), value)))
    }
}

/// Where the recordings of a directory come from: one provenance, or several, which are counted.
#[derive(Default)]
struct Origins {
    first: Option<Provenance>,
    /// How many have the first provenance.
    like_first: usize,
    /// The others, by the hash of their provenance, in the order of the files: how many, and what they are.
    others: Vec<(usize, Map<String, Value>)>,
    places: BTreeMap<String, usize>,
}

impl Origins {
    fn add(&mut self, found: Provenance) {
        let first = self.first.get_or_insert_with(|| found.clone());
        if *first == found {
            self.like_first += 1;
            return;
        }
        let key = ContentHash::of(found.to_json().as_bytes()).to_string();
        let others = &mut self.others;
        let at = *self.places.entry(key).or_insert_with(|| {
            others.push((0, origin(&found, &differences(first, &found))));
            others.len() - 1
        });
        others[at].0 += 1;
    }

    /// The fields with `provenance`, or, where recordings do not agree, with `origins` in its place.
    fn describe(self, mut fields: Map<String, Value>) -> Value {
        let Some(first) = self.first else { return Value::Object(fields) };
        if self.others.is_empty() {
            fields.extend([("task".into(), json!(first.task)), ("provenance".into(), json!(first))]);
            return Value::Object(fields);
        }
        let of_all = [(self.like_first, origin(&first, ""))].into_iter().chain(self.others);
        let counted = of_all.map(|(count, mut origin)| {
            origin.insert("recordings".into(), json!(count));
            Value::Object(origin)
        });
        fields.insert("origins".into(), counted.collect());
        Value::Object(fields)
    }
}

fn origin(of: &Provenance, differs_in: &str) -> Map<String, Value> {
    let fields = [
        ("task", json!(of.task)),
        ("seed", json!(of.seed)),
        ("stage", json!(of.stage)),
        ("hilt_version", json!(of.hilt_version)),
        ("differs_in", json!(differs_in)),
    ];
    Map::from_iter(fields.map(|(key, value)| (key.to_string(), value)))
}

/// The parts in which a provenance is not as the first.
fn differences(first: &Provenance, other: &Provenance) -> String {
    let parts = [
        ("hilt_version", first.hilt_version != other.hilt_version),
        ("stage", first.stage != other.stage),
        ("task", first.task != other.task),
        ("seed", first.seed != other.seed),
        ("settings", first.settings != other.settings),
        ("inputs", first.inputs != other.inputs),
    ];
    parts.iter().filter(|(_, differ)| *differ).map(|(name, _)| *name).collect::<Vec<_>>().join(", ")
}

fn reward(episode: &Episode) -> f64 {
    episode.moments().map(|s| s.reward).sum()
}

/// For each condition: at which step it first held, and whether it holds at the end.
fn conditions(episode: &Episode) -> Vec<Value> {
    let entry = |(i, name): (usize, &String)| {
        let first = episode.moments().position(|s| s.conditions[i]);
        json!({ "name": name, "first_step": first, "at_end": episode.last.conditions[i] })
    };
    episode.scene.task.condition_names().iter().enumerate().map(entry).collect()
}

fn phases(episode: &Episode) -> Map<String, Value> {
    let count = |phase: Phase| episode.steps.iter().filter(|s| s.phase == Some(phase)).count();
    Phase::ALL.iter().map(|p| (p.name().to_string(), json!(count(*p)))).filter(|(_, n)| *n != json!(0)).collect()
}

/// What stood where, by name.
fn scene(scene: &Scene) -> Value {
    let objects = scene.task.objects.iter().zip(&scene.objects).map(|(object, placed)| (object.name.clone(), json!(placed)));
    let goals = scene.task.goal_names().into_iter().zip(&scene.goals).map(|(name, goal)| (name, json!(goal)));
    json!({ "objects": Map::from_iter(objects), "goals": Map::from_iter(goals), "obstacles": scene.obstacles })
}

/// Steps in which something touched something, by the object's name.
fn contacts(episode: &Episode) -> Value {
    let count = |holds: &dyn Fn(&Step) -> bool| episode.moments().filter(|s| holds(s)).count();
    let task = &episode.scene.task;
    let mut counts = Map::new();
    for (i, object) in task.objects.iter().enumerate().take(task.moved()) {
        let fingers = count(&|s| s.contacts.objects[i].fingers_n.iter().any(|f| *f > 0.0));
        counts.insert(format!("finger_{}", object.name), json!(fingers));
        counts.insert(format!("{}_table", object.name), json!(count(&|s| s.contacts.objects[i].table)));
        for (k, other) in task.objects.iter().enumerate().filter(|(k, _)| *k > i) {
            let touched = count(&|s| s.contacts.objects[i].objects.contains(&k));
            counts.insert(format!("{}_{}", object.name, other.name), json!(touched));
        }
    }
    counts.insert("robot_obstacle".into(), json!(count(&|s| s.contacts.robot_obstacle)));
    counts.insert("robot_table".into(), json!(count(&|s| s.contacts.robot_table)));
    Value::Object(counts)
}
