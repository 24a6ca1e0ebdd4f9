//! Whether a robot can do a task at all: the demonstrator tries it, as `hilt plan` and `hilt simulate` have it, but without the pulses that only
//! demonstrations are given; and nothing is written.

use super::Context;
use crate::config::{ChosenTask, Pipeline, Preset, Source};
use crate::error::Result;
use crate::plan::{Planner, plan_episode};
use crate::sim::{Follower, execute};
use crate::task::FailureClass;
use rayon::prelude::*;
use serde::Serialize;
use std::collections::BTreeMap;

/// Episodes are those of the stages with this seed, so that they can be recorded and looked at.
const SEED: u64 = 0;
/// Pulses throw a robot off its way, so that demonstrations show the way back.
const NO_PULSES: &str = "simulate.pulses.probability=0";
/// A demonstrator that solves a smaller share has something wrong with its robot: those that come with hilt solve .98 and more.
const SOUND: f64 = 0.9;

/// What came of it.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Trial {
    /// Name of the task.
    pub task: String,
    /// How many were tried.
    pub episodes: u64,
    /// How many were solved.
    pub solved: u64,
    /// How many were executed and failed, by class.
    pub failures: BTreeMap<FailureClass, u64>,
    /// Why others were not even planned.
    pub not_planned: Vec<String>,
}

/// How an episode ended: whether it was solved or how it failed, or why there was no plan.
type End = std::result::Result<Option<FailureClass>, String>;

/// Tries `task` with the robot of this name or file.
///
/// # Errors
/// [`crate::error::Error`] when the task cannot be set up for this robot, and when it is interrupted.
pub fn trial(robot: &str, task: ChosenTask, episodes: u64, context: &Context) -> Result<Trial> {
    let mut trial = Trial { task: task.name.clone(), episodes, ..Trial::default() };
    let robot = format!("robot={}", toml::Value::from(robot));
    let pipeline = Pipeline::load(&Source::BuiltIn(task, Preset::Best), &[robot, NO_PULSES.into()])?;
    let planner = || Planner::new(&pipeline.robot, &pipeline.task, &pipeline.plan).with_interrupt(&context.interrupt);
    let ends = (0..episodes).into_par_iter().map_init(planner, |planner, episode| attempt(planner, &pipeline, episode, context));
    for end in ends.collect::<Result<Vec<End>>>()? {
        match end {
            Ok(None) => trial.solved += 1,
            Ok(Some(class)) => *trial.failures.entry(class).or_default() += 1,
            Err(why) => trial.not_planned.push(why),
        }
    }
    Ok(trial)
}

fn attempt(planner: &mut Planner, of: &Pipeline, episode: u64, context: &Context) -> Result<End> {
    let plan = match plan_episode(planner, of, (SEED, episode), &context.interrupt)? {
        Ok(plan) => plan,
        Err(why) => return Ok(Err(why.to_string())),
    };
    let Some(follower) = Follower::new(&plan) else { return Ok(Err("the plan is empty".into())) };
    Ok(Ok(execute(&plan, follower, &of.simulate, SEED, &context.interrupt)?.failure))
}

impl Trial {
    /// What came of it, in words.
    pub fn words(&self) -> String {
        let Trial { task, episodes, solved, .. } = self;
        let failures = self.failures.iter().map(|(class, count)| format!("{} {count}", class.name()));
        let not_planned = self.not_planned.len();
        let unplanned = (not_planned > 0).then(|| format!("not planned {not_planned}"));
        let how: Vec<String> = failures.chain(unplanned).collect();
        let how = if how.is_empty() { String::new() } else { format!(": {}", how.join(", ")) };
        format!("trial, {task}: the demonstrator solves {solved} of {episodes}{how}")
    }

    /// What is doubtful about the robot for it, if anything is.
    pub fn doubt(&self) -> Option<String> {
        let Trial { task, episodes, solved, .. } = self;
        let unsound = (*solved as f64) < SOUND * *episodes as f64;
        let advice = match self.not_planned.first() {
            Some(why) => format!("the first that was not planned: {why}"),
            None => "look at the motors, at effort, and at the tool point".into(),
        };
        unsound.then(|| format!("the demonstrator solves {solved} of {episodes} trials of {task}: {advice}"))
    }
}
