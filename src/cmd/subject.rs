//! Who acts in an evaluation: the demonstrator, a policy, or one that somebody serves.

use super::fits::read_network;
use super::train;
use crate::config::Pipeline;
use crate::data::ContentHash;
use crate::error::{Error, Result};
use crate::eval::{PolicyController, Rollouts};
use crate::interrupt::Interrupt;
use crate::learn::Policy;
use crate::plan::Planner;
use crate::scene::Scene;
use crate::seed;
use crate::serve::{RemotePolicy, read_token};
use crate::sim::{Controller, Follower};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The demonstrator's name where a policy's file could stand.
const PLANNER: &str = "planner";

/// How to talk to a policy that is served.
#[derive(Debug, clap::Args)]
pub struct ServedArgs {
    /// File with the secret of the server at ws://HOST:PORT
    #[arg(long, value_name = "FILE")]
    token_file: Option<PathBuf>,
    /// Of an answer with several actions, execute so many before the server is asked again [default: all]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    actions_each: Option<u32>,
}

impl ServedArgs {
    /// Files that are read.
    pub fn reads(&self) -> Option<&Path> {
        self.token_file.as_deref()
    }
}

/// Who acts.
pub enum Subject {
    /// The demonstrator, in the loop.
    Planner,
    /// A learned policy.
    Policy(Arc<Policy>),
    /// One behind an address.
    Served(Arc<RemotePolicy>),
}

/// Who acts, and what is known of it.
pub struct Chosen {
    /// Who.
    pub subject: Subject,
    /// Hash of the policy's file.
    pub content: Option<ContentHash>,
    /// Settings that it was trained with.
    pub trained: Option<Value>,
    /// What the provenance of an evaluation says.
    pub said: Value,
}

/// An address in place of a file.
fn address(policy: &Path) -> Option<&str> {
    policy.to_str().filter(|said| said.contains("://"))
}

impl Chosen {
    /// The file that `--policy` names, where it names one.
    pub fn file(policy: &Path) -> Option<&Path> {
        Some(policy).filter(|policy| *policy != Path::new(PLANNER) && address(policy).is_none())
    }

    /// What `--policy` names.
    ///
    /// # Errors
    /// What reading or connecting returns; [`Error::Usage`] for flags of a server without one.
    pub fn read(policy: &Path, served: &ServedArgs, pipeline: &Pipeline, interrupt: &Interrupt) -> Result<Self> {
        let address = address(policy);
        if address.is_none() && (served.token_file.is_some() || served.actions_each.is_some()) {
            let message = "--token-file and --actions-each are for a policy that is served: give --policy ws://HOST:PORT";
            return Err(Error::Usage(message.into()));
        }
        if let Some(address) = address {
            return Self::serves(address, served, pipeline, interrupt);
        }
        if Self::file(policy).is_none() {
            return Ok(Chosen { subject: Subject::Planner, content: None, trained: None, said: PLANNER.into() });
        }
        let (network, made, content) =
            read_network(policy, train::KIND, pipeline, Policy::from_tensors, |policy| policy.layout())?;
        let subject = Subject::Policy(Arc::new(network));
        Ok(Chosen { subject, content: Some(content), trained: Some(made.settings), said: train::KIND.into() })
    }

    fn serves(address: &str, served: &ServedArgs, pipeline: &Pipeline, interrupt: &Interrupt) -> Result<Self> {
        if pipeline.evaluate.stochastic {
            let message = "--stochastic is for a policy that hilt runs; give it to hilt serve, or leave it out";
            return Err(Error::Usage(message.into()));
        }
        let token = served.token_file.as_deref().map(read_token).transpose()?;
        let each = served.actions_each.map(|n| n as usize);
        let remote = RemotePolicy::connect(address, token, (&pipeline.robot, &pipeline.task), each, interrupt)?;
        let about = |key: &str| remote.metadata().get(key).cloned();
        let said = json!({ "address": address, "server": about("server"), "policy": about("policy"), "actions_each": each });
        let trained = about("trained_with");
        Ok(Chosen { subject: Subject::Served(remote), content: None, trained, said })
    }
}

impl Subject {
    /// As set; otherwise the policy's own (twice the 95th percentile of its demos), or the demonstrator's patience.
    pub fn horizon_steps(&self, pipeline: &Pipeline) -> u32 {
        match (pipeline.evaluate.horizon_steps, self) {
            (0, Subject::Planner) => pipeline.simulate.max_steps,
            (0, Subject::Policy(policy)) => policy.horizon_steps(),
            (0, Subject::Served(remote)) => remote.horizon_steps().unwrap_or(pipeline.simulate.max_steps),
            (given, _) => given,
        }
    }

    /// A controller for one episode; `None` when the demonstrator finds no plan.
    ///
    /// # Errors
    /// When a policy that is served is not there any more.
    pub fn controller(
        &self,
        rollouts: &Rollouts,
        index: u64,
        scene: &Scene,
        interrupt: &Interrupt,
    ) -> Result<Option<Box<dyn Controller>>> {
        match self {
            Subject::Planner => Ok(planned(rollouts, index, scene, interrupt)),
            Subject::Policy(policy) => {
                let stochastic = rollouts.pipeline.evaluate.stochastic;
                let sampling = stochastic.then(|| seed::stream(rollouts.seed, "evaluate.action", index));
                Ok(Some(Box::new(PolicyController::new(Arc::clone(policy), sampling))))
            }
            Subject::Served(remote) => remote.controller(index).map(Some),
        }
    }

    /// Whether everything that was asked was answered.
    ///
    /// # Errors
    /// Why not.
    pub fn check(&self) -> Result<()> {
        match self {
            Subject::Served(remote) => remote.check(),
            Subject::Planner | Subject::Policy(_) => Ok(()),
        }
    }
}

fn planned(rollouts: &Rollouts, index: u64, scene: &Scene, interrupt: &Interrupt) -> Option<Box<dyn Controller>> {
    let mut rng = seed::stream(rollouts.seed, "evaluate.search", index);
    let planner = Planner::new(&rollouts.pipeline.robot, &rollouts.pipeline.task, &rollouts.pipeline.plan);
    let plan = planner.with_interrupt(interrupt).plan(index, scene, &mut rng).ok()?;
    Some(Box::new(Follower::new(&plan)?))
}
