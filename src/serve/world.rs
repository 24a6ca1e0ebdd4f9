//! The simulated task as somebody else's environment: the episodes of an evaluation, step by step, over a wire.

use super::asked::{Asked, Questions, SPLITS, Wanted};
use super::link::{Link, Received};
use super::rows::Rows;
use super::server::Host;
use super::told::Teller;
use super::value::Value;
use crate::config::Pipeline;
use crate::error::Result;
use crate::eval::Rollouts;
use crate::interrupt::Interrupt;
use crate::joints::Joints;
use crate::sim::Controller;
use crate::state::Action;
use crate::tasks::{FailureClass, Observation, Verdict};
use serde_json::{Value as Json, json};

/// Serves a task's simulated world: each conversation has a world of its own.
#[derive(Debug)]
pub struct WorldHost<'a> {
    pipeline: &'a Pipeline,
    questions: Questions,
    teller: Teller,
    metadata: Json,
    interrupt: Interrupt,
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
        let first = Wanted { seed, episode: 0, horizon_steps, training: false };
        let (questions, teller) = (Questions::new(&rows, first), Teller::new(&rows, conditions));
        WorldHost { pipeline, questions, teller, metadata, interrupt: interrupt.clone() }
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
            link.send(&self.teller.end(&episode, wanted));
        }
        Ok(Next::Idle)
    }

    /// Waits for a reset.
    fn idle(&self, link: &mut dyn Link, last: Option<Wanted>) -> Result<Next> {
        let message = match link.receive(None)? {
            Received::Gone => return Ok(Next::Gone),
            Received::Silence => return Ok(Next::Idle),
            Received::Message(message) => message,
        };
        match self.questions.read(&message, last) {
            Ok(Asked::Reset(wanted)) => return Ok(Next::Reset(wanted)),
            Ok(Asked::Step(_)) => link.refuse("no episode runs: send \"reset\" first"),
            Err(why) => link.refuse(&why),
        }
        Ok(Next::Idle)
    }
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
                Next::Idle => self.idle(link, last)?,
                Next::Reset(wanted) => {
                    last = Some(wanted);
                    self.play(link, wanted)?
                }
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
        let (teller, verdict) = (&self.host.teller, self.verdict.as_ref().expect("a moment is judged before it is acted in"));
        let answer = if self.steps == 0 { teller.first(seen, verdict, self.wanted) } else { teller.step(seen, verdict) };
        self.link.send(&answer);
    }

    /// The client's next action; `None` when it wants none of this episode.
    fn action(&mut self) -> Option<Vec<f32>> {
        loop {
            let next = match self.link.receive(None) {
                Ok(Received::Message(message)) => match self.host.questions.read(&message, Some(self.wanted)) {
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
