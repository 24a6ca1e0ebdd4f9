use super::fits::{made_by, robot_of};
use super::listen::ListenArgs;
use super::places::Places;
use super::{Context, Outcome, evaluate, train};
use crate::config::ChosenRobot;
use crate::data::{Provenance, weights};
use crate::error::{Error, Result};
use crate::learn::Policy;
use crate::serve::{PolicyHost, PolicyOptions};
use crate::tasks::with_layout;
use serde_json::{Map, json};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Robots ask at rates within these \[Hz\].
const RATES_HZ: [f64; 2] = [0.1, 10_000.0];

/// Serve a policy to robots and programs: openpi's WebSocket protocol, or JSON on standard input and output.
///
/// An observation has LeRobot's keys, observation.state and observation.environment_state; the answer has actions. Commands beyond the
/// robot's limits are not given. docs/serve.md describes the protocol.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  hilt serve policy.safetensors --port 8000\n  hilt serve policy.safetensors --stdio < observations.jsonl"
)]
pub struct Args {
    /// Weights of a policy
    #[arg(value_name = "POLICY")]
    policy: PathBuf,
    /// The robot whose limits hold, where it does not come with hilt: its TOML file
    #[arg(long, value_name = "NAME|FILE.toml")]
    robot: Option<String>,
    /// How often the robot asks; a new action is computed once a control period, and holds in between [default: the policy's rate]
    #[arg(long, value_name = "HZ")]
    robot_rate: Option<f64>,
    /// The next command is to stand still when no observation has come for so long
    #[arg(long, value_name = "MS", value_parser = clap::value_parser!(u64).range(1..=3_600_000))]
    watchdog: Option<u64>,
    /// Make joint velocities of the joint positions that follow each other, in place of the robot's own
    #[arg(long)]
    estimate_dq: bool,
    /// Sample actions from the policy's Gaussian instead of taking its mean
    #[arg(long)]
    stochastic: bool,
    /// Seed of --stochastic
    #[arg(long, value_name = "S", default_value_t = 0, requires = "stochastic")]
    seed: u64,
    #[command(flatten)]
    listen: ListenArgs,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    if args.policy == Path::new("planner") {
        let why = "the planner needs the whole scene, which no observation tells: it cannot be served";
        return Err(Error::Usage(format!("{why}; hilt evaluate --policy planner runs it")));
    }
    if let Some(hz) = args.robot_rate.filter(|hz| !(RATES_HZ[0]..=RATES_HZ[1]).contains(hz)) {
        return Err(Error::Usage(format!("--robot-rate {hz}: allowed: {} to {} Hz", RATES_HZ[0], RATES_HZ[1])));
    }
    Places::new().read(&args.policy).read_all(args.listen.reads()).check(&context.console)?;
    let (tensors, description, made, content) = weights::read_hashed(&args.policy, train::KIND)?;
    let refuse = |why: String| Error::input(&args.policy, why);
    let policy = Policy::from_tensors(&tensors, &with_layout(description)).map_err(refuse)?;
    let robot = robot(args, &policy, &made)?;
    let mut about = Map::new();
    about.insert("policy".into(), json!(content.to_string()));
    about.insert("trained_with".into(), evaluate::world(&made.settings));
    let options = PolicyOptions {
        robot_rate_hz: args.robot_rate,
        watchdog: args.watchdog.map(Duration::from_millis),
        estimate_dq: args.estimate_dq,
        sampling: args.stochastic.then_some(args.seed),
    };
    let period_s = policy.layout().period_s;
    if let Some(hz) = args.robot_rate.filter(|hz| hz * period_s < 1.0) {
        let policy_hz = 1.0 / period_s;
        let words = "each action holds longer than it was learned for";
        context.console.say(&format!("serve: the robot asks at {hz} Hz, the policy was trained at {policy_hz:.4} Hz: {words}"));
    }
    args.listen.serve(&PolicyHost::new(policy, robot.as_ref().map(|robot| &***robot), options, about).map_err(refuse)?, context)
}

/// The robot that the policy was made for: limits of another would be no limits. Of a policy that has learned from a dataset of another
/// program it is not known.
fn robot(args: &Args, policy: &Policy, made: &Provenance) -> Result<Option<ChosenRobot>> {
    if policy.layout().positions().is_empty() {
        return match &args.robot {
            None => Ok(None),
            Some(said) => {
                let why =
                    "has learned from a dataset that says nothing of joints: no limits of a robot fit it; leave --robot out";
                Err(Error::Usage(format!("--robot {said}: {} {why}", args.policy.display())))
            }
        };
    }
    let theirs = robot_of(made);
    let said = args.robot.as_deref().unwrap_or(&theirs);
    let advice =
        format!("{}: was made by robot {theirs}; give --robot with its TOML file, for its limits", args.policy.display());
    let robot = ChosenRobot::read(said).map_err(|why| Error::Usage(format!("{advice} ({said}: {why})")))?;
    if made_by(made, &robot) {
        Ok(Some(robot))
    } else {
        Err(Error::Usage(format!("{advice} ({said} is another robot, or its files have changed since)")))
    }
}
