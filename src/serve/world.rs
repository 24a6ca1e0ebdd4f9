//! The simulated task as somebody else's environment: the episodes of an evaluation, step by step, over a wire.

use super::link::{Link, Message, Received};
use super::rows::{MOST_HORIZON_STEPS, Rows};
use super::server::Host;
use super::value::Value;
use crate::config::Pipeline;
use crate::demo::Episode;
use crate::error::Result;
use crate::eval::{Rollouts, Trial};
use crate::interrupt::Interrupt;
use crate::joints::Joints;
use crate::sim::{Controller, fallen};
use crate::state::Action;
use crate::tasks::{FailureClass, Observation, Verdict};
use serde_json::{Value as Json, json};

/// What episodes are for.
const SPLITS: [&str; 2] = ["evaluation", "training"];

/// Serves a task's simulated world: each conversation has a world of its own.
#[derive(Debug)]
pub struct WorldHost<'a> {
    pipeline: &'a Pipeline,
    seed: u64,
    horizon_steps: u32,
    rows: Rows,
    conditions: Vec<String>,
    metadata: Json,
    interrupt: Interrupt,
}

/// Which episode is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Wanted {
    seed: u64,
    episode: u64,
    horizon_steps: u32,
    training: bool,
}

impl<'a> WorldHost<'a> {
    /// The world of these settings; `seed` and `horizon_steps` hold where a client says nothing else.
    pub fn new(pipeline: &'a Pipeline, seed: u64, horizon_steps: u32, interrupt: &Interrupt) -> Self {
        let layout = pipeline.task.layout(&pipeline.robot);
        let (rows, conditions) = (Rows::new(&layout), pipeline.task.condition_names());
        let metadata = json!({
            "server": "hilt",
            "version": env!("CARGO_PKG_VERSION"),
            "kind": "environment",
            "task": pipeline.task.name,
            "instruction": pipeline.task.instruction,
            "robot": pipeline.robot.name,
            "period_s": layout.period_s,
            "horizon_steps": horizon_steps,
            "seed": seed,
            "episodes": SPLITS,
            "keys": rows.keys(),
            "actions": rows.actions(),
            "action_limits": layout.action_limits,
            "conditions": conditions,
            "failures": FailureClass::ALL.map(FailureClass::name),
            "layout": *layout,
        });
        WorldHost { pipeline, seed, horizon_steps, rows, conditions, metadata, interrupt: interrupt.clone() }
    }

    /// The first message.
    pub fn metadata(&self) -> &Json {
        &self.metadata
    }

    /// What comes after `last`, unless the message says otherwise.
    fn wanted(&self, reset: &Value, last: Option<Wanted>) -> std::result::Result<Wanted, String> {
        if !matches!(reset, Value::Map(_)) {
            return Err(format!("\"reset\" is {}; it must be a map, empty for the next episode", reset.kind()));
        }
        let number = |key: &str| match reset.get(key) {
            None | Some(Value::Nil) => Ok(None),
            Some(value) => {
                value.as_u64().map(Some).ok_or_else(|| format!("\"{key}\" of \"reset\" must be a whole number from 0"))
            }
        };
        let first = Wanted { seed: self.seed, episode: 0, horizon_steps: self.horizon_steps, training: false };
        let next = last.map_or(first, |last| Wanted { episode: last.episode.saturating_add(1), ..last });
        let training = match reset.get("episodes").map(Value::as_text) {
            None => next.training,
            Some(Some(split)) if SPLITS.contains(&split) => split == SPLITS[1],
            Some(_) => return Err(format!("\"episodes\" of \"reset\" must be one of {SPLITS:?}")),
        };
        let seed = number("seed")?;
        let begins = seed.is_some() || training != next.training;
        let horizon_steps = number("horizon_steps")?.unwrap_or(u64::from(next.horizon_steps));
        if !(1..=u64::from(MOST_HORIZON_STEPS)).contains(&horizon_steps) {
            return Err(format!("\"horizon_steps\" of \"reset\" is {horizon_steps}; allowed: 1 to {MOST_HORIZON_STEPS}"));
        }
        Ok(Wanted {
            seed: seed.unwrap_or(next.seed),
            episode: number("episode")?.unwrap_or(if begins { 0 } else { next.episode }),
            horizon_steps: horizon_steps as u32,
            training,
        })
    }

    fn ask(&self, message: &Message, last: Option<Wanted>) -> std::result::Result<Asked, String> {
        let value = message.value()?;
        if let Some(reset) = value.get("reset") {
            return self.wanted(reset, last).map(Asked::Reset);
        }
        let Some(step) = value.get("step") else { return Err("a message has the key \"reset\" or \"step\"".into()) };
        let Some(action) = step.get("action") else { return Err("\"step\" must be a map with an \"action\"".into()) };
        let numbers = action.numbers().map_err(|why| format!("\"action\" holds {why}"))?;
        let (width, shape) = (self.rows.layout().action_dim(), numbers.shape.clone());
        match numbers.rows(width).as_deref() {
            Some([row]) => Ok(Asked::Step(row.clone())),
            _ => Err(format!("\"action\" has shape {shape:?}; it must be one row of {width} numbers")),
        }
    }

    /// Plays an episode; what ends the conversation or begins another episode.
    fn play(&self, link: &mut dyn Link, wanted: Wanted) -> Result<Next> {
        let make = if wanted.training { Rollouts::training } else { Rollouts::evaluation };
        let rollouts = make(self.pipeline, wanted.seed, wanted.horizon_steps);
        let scene = match rollouts.scene(wanted.episode) {
            Ok(scene) => scene,
            Err(why) => {
                link.refuse(&format!("episode {}: {why}", wanted.episode));
                return Ok(Next::Idle);
            }
        };
        let mut wire = Wire { host: self, link, wanted, steps: 0, verdict: None, next: Next::Idle };
        let episode = rollouts.play(wanted.episode, &scene, &mut wire, &self.interrupt)?;
        let Wire { link, steps, next, .. } = wire;
        if !matches!(next, Next::Idle) {
            return Ok(next);
        }
        if steps == 0 {
            link.refuse(&format!("episode {}: the simulation breaks down before the first step", wanted.episode));
        } else {
            link.send(&self.end(&episode, wanted));
        }
        Ok(Next::Idle)
    }

    fn moment(&self, row: &[f32], reward: f64, conditions: &[bool], success: bool) -> (Value<'static>, Value<'_>) {
        let named = self.conditions.iter().zip(conditions);
        let conditions = named.map(|(name, holds)| (name.as_str().into(), Value::Bool(*holds))).collect();
        let info = Value::map([("success", Value::Bool(success)), ("conditions", Value::Map(conditions))]);
        let mut answer = Value::map([("observation", self.rows.observation(row))]);
        answer.insert("reward", Value::Float(reward));
        (answer, info)
    }

    /// The last answer of an episode.
    fn end(&self, episode: &Episode, wanted: Wanted) -> Value<'_> {
        let (last, trial) = (&episode.last, Trial::of(episode));
        let broken = matches!(episode.failure, Some(FailureClass::CommandNotFinite | FailureClass::SimulationBrokeDown));
        // Such a moment has been paid before.
        let reward = if broken { 0.0 } else { last.reward };
        let terminated = episode.success || broken || fallen(&last.objects);
        let (mut answer, mut info) = self.moment(&last.state.to_row(), reward, &last.conditions, episode.success);
        answer.insert("terminated", Value::Bool(terminated));
        answer.insert("truncated", Value::Bool(!terminated));
        info.insert("failure", episode.failure.map_or(Value::Nil, |class| Value::text(class.name())));
        info.insert("episode", Value::Int(wanted.episode as i64));
        info.insert("steps", Value::Int(trial.steps as i64));
        info.insert("return", Value::Float(trial.reward));
        info.insert("hit_obstacle", Value::Bool(trial.hit_obstacle));
        answer.insert("info", info);
        answer
    }
}

/// What a client asks.
enum Asked {
    Reset(Wanted),
    Step(Vec<f32>),
}

/// What comes after an episode.
enum Next {
    /// It is over; somebody will say what comes.
    Idle,
    /// It was left for another.
    Reset(Wanted),
    /// Nobody is there any more.
    Gone,
}

impl Host for WorldHost<'_> {
    fn converse(&self, link: &mut dyn Link, _number: u64) -> Result<()> {
        link.send(&Value::of_json(&self.metadata));
        let (mut next, mut last) = (Next::Idle, None);
        loop {
            next = match next {
                Next::Gone => return Ok(()),
                Next::Reset(wanted) => {
                    last = Some(wanted);
                    self.play(link, wanted)?
                }
                Next::Idle => match link.receive(None)? {
                    Received::Gone => Next::Gone,
                    Received::Silence => Next::Idle,
                    Received::Message(message) => match self.ask(&message, last) {
                        Ok(Asked::Reset(wanted)) => Next::Reset(wanted),
                        Ok(Asked::Step(_)) => {
                            link.refuse("no episode runs: send \"reset\" first");
                            Next::Idle
                        }
                        Err(why) => {
                            link.refuse(&why);
                            Next::Idle
                        }
                    },
                },
            };
        }
    }
}

/// The client as the controller of an episode.
struct Wire<'a, 'l> {
    host: &'a WorldHost<'a>,
    link: &'l mut dyn Link,
    wanted: Wanted,
    steps: u32,
    verdict: Option<Verdict>,
    next: Next,
}

impl Wire<'_, '_> {
    fn tell(&mut self, seen: &Observation) {
        let Some(verdict) = &self.verdict else { return };
        let (mut answer, mut info) = self.host.moment(&seen.state.to_row(), verdict.reward, &verdict.conditions, false);
        if self.steps == 0 {
            info.insert("episode", Value::Int(self.wanted.episode as i64));
            info.insert("seed", Value::Int(self.wanted.seed as i64));
            info.insert("horizon_steps", Value::Int(i64::from(self.wanted.horizon_steps)));
        } else {
            answer.insert("terminated", Value::Bool(false));
            answer.insert("truncated", Value::Bool(false));
        }
        answer.insert("info", info);
        self.link.send(&answer);
    }

    /// The client's next action; `None` when it wants none of this episode.
    fn action(&mut self) -> Option<Vec<f32>> {
        loop {
            let next = match self.link.receive(None) {
                Ok(Received::Message(message)) => match self.host.ask(&message, Some(self.wanted)) {
                    Ok(Asked::Step(action)) => return Some(action),
                    Ok(Asked::Reset(wanted)) => Next::Reset(wanted),
                    Err(why) => {
                        self.link.refuse(&why);
                        continue;
                    }
                },
                Ok(Received::Silence) => continue,
                // An interrupt is seen by everybody.
                Ok(Received::Gone) | Err(_) => Next::Gone,
            };
            self.next = next;
            return None;
        }
    }
}

impl Controller for Wire<'_, '_> {
    fn command(&mut self, seen: &Observation) -> Action {
        self.tell(seen);
        self.steps += 1;
        let joints = seen.robot.joints.len();
        match self.action() {
            Some(action) => action.iter().map(|v| f64::from(*v)).collect(),
            // Ends an episode that nobody will hear of.
            None => Joints::from_fn(joints, |_| f64::NAN),
        }
    }

    fn judged(&mut self, verdict: &Verdict) {
        self.verdict = Some(verdict.clone());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;
    use crate::serve::lines::LineLink;
    use crate::serve::value::Numbers;
    use crate::task::built_in::pick_up;
    use std::io::Cursor;

    /// The answers to these lines.
    fn talk(lines: &[Json]) -> Vec<Json> {
        let pipeline = Pipeline::defaults(&pick_up());
        let (host, mut out) = (WorldHost::new(&pipeline, 3, 5, &Interrupt::default()), Vec::new());
        let input = lines.iter().map(|line| format!("{line}\n")).collect::<String>();
        let mut link = LineLink::new(Cursor::new(input), &mut out, &Interrupt::default()).expect("a thread");
        host.converse(&mut link, 0).expect("no interrupt");
        let text = String::from_utf8(out).expect("text");
        text.lines().skip(1).map(|line| serde_json::from_str(line).expect("JSON")).collect()
    }

    /// Asks for the same in every step.
    struct Constant;

    impl Controller for Constant {
        fn command(&mut self, seen: &Observation) -> Action {
            Joints::from_fn(seen.robot.joints.len(), |_| 0.1)
        }
    }

    #[test]
    fn a_served_episode_is_the_evaluated_one() {
        let step = json!({ "step": { "action": [0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1] } });
        let mut lines = vec![json!({ "reset": {} }), step.clone(), json!({ "reset": { "episode": 4 } })];
        lines.extend(vec![step.clone(); 6]);
        let answers = talk(&lines);
        assert_eq!(answers.len(), 9);
        let pipeline = Pipeline::defaults(&pick_up());
        let rollouts = Rollouts::evaluation(&pipeline, 3, 5);
        let play = |episode: u64| {
            let scene: Scene = rollouts.scene(episode).expect("a scene");
            rollouts.play(episode, &scene, &mut Constant, &Interrupt::default()).expect("no interrupt")
        };
        let rows = Rows::new(&pipeline.task.layout(&pipeline.robot));
        let same = |answer: &Json, row: Vec<f32>| {
            let observation = &answer["observation"];
            assert_eq!(rows.row(&Value::of_json(observation), true), Ok(row));
        };
        let (first, other) = (play(0), play(4));
        same(&answers[0], first.steps[0].state.to_row());
        same(&answers[1], first.steps[1].state.to_row());
        (0..5).for_each(|t| same(&answers[2 + t], other.steps[t].state.to_row()));
        same(&answers[7], other.last.state.to_row());
        assert_eq!((&answers[7]["terminated"], &answers[7]["truncated"]), (&json!(false), &json!(true)));
        assert_eq!(answers[7]["info"]["failure"], json!(other.failure.expect("a failure").name()));
        assert!(answers[8]["error"].as_str().expect("refused").contains("send \"reset\""));
    }

    #[test]
    fn other_episodes_are_for_training_and_wrong_words_change_nothing() {
        let numbers = |answer: &Json| -> Numbers {
            Value::of_json(&answer["observation"]["observation.environment_state"]).numbers().expect("numbers")
        };
        let answers = talk(&[
            json!({ "reset": { "episode": 1 } }),
            json!({ "reset": { "episode": 1, "episodes": "training" } }),
            json!({ "reset": { "episode": 1, "seed": 4, "episodes": "evaluation" } }),
            json!({ "step": { "action": [0.0] } }),
            json!({ "step": {} }),
            json!({ "reset": 7 }),
            json!({ "reset": { "episode": -1 } }),
            json!({ "reset": { "episodes": "all" } }),
            json!({ "reset": { "horizon_steps": 0 } }),
            json!({ "go": 1 }),
            json!([1]),
            json!({ "step": { "action": [null, 0, 0, 0, 0, 0, 0, 0, 0] } }),
            json!({ "reset": {} }),
        ]);
        assert!(numbers(&answers[0]) != numbers(&answers[1]) && numbers(&answers[0]) != numbers(&answers[2]));
        for (answer, said) in answers[3..11].iter().zip([
            "shape [1]",
            "an \"action\"",
            "a map",
            "\"episode\"",
            "\"episodes\"",
            "allowed: 1",
            "\"reset\" or",
            "a list",
        ]) {
            assert!(answer["error"].as_str().is_some_and(|why| why.contains(said)), "{said}: {answer}");
        }
        assert_eq!((&answers[11]["info"]["failure"], &answers[11]["terminated"]), (&json!("command_not_finite"), &json!(true)));
        assert_eq!((&answers[12]["info"]["episode"], &answers[12]["info"]["seed"]), (&json!(2), &json!(4)));
    }
}
