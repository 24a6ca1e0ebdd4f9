//! A policy as a server: observations in, commands within the robot's limits out.

use super::bounds::Bounds;
use super::link::{Link, Received};
use super::rows::Rows;
use super::server::Host;
use super::session::Session;
use super::value::Value;
use crate::error::Result;
use crate::layout::Layout;
use crate::learn::Policy;
use crate::robot::Robot;
use serde_json::{Value as Json, json};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How a policy is served.
#[derive(Clone, Debug, Default)]
pub struct PolicyOptions {
    /// How often the robot asks \[Hz\]; once a control period of the policy where it is not said.
    pub robot_rate_hz: Option<f64>,
    /// The robot stops when no observation has come for so long.
    pub watchdog: Option<Duration>,
    /// Whether joint velocities are made of the joint positions that follow each other, instead of believing the robot's.
    pub estimate_dq: bool,
    /// The seed by which actions are sampled; their mean where there is none.
    pub sampling: Option<u64>,
}

/// Serves a policy of a robot.
#[derive(Debug)]
pub struct PolicyHost {
    pub(super) policy: Arc<Policy>,
    pub(super) rows: Rows,
    pub(super) bounds: Bounds,
    pub(super) options: PolicyOptions,
    metadata: Json,
}

impl PolicyHost {
    /// A policy with the robot whose limits hold; `about` are further entries of the metadata.
    ///
    /// # Errors
    /// When the robot is not the one whose rows the policy has learned from.
    pub fn new(
        policy: Policy,
        robot: &Robot,
        options: PolicyOptions,
        about: serde_json::Map<String, Json>,
    ) -> std::result::Result<Self, String> {
        let layout = Arc::clone(policy.layout());
        let joints = robot.joints.len();
        let driven = (layout.action_dim(), layout.positions().len());
        if driven != (joints, joints) {
            let Robot { name, .. } = robot;
            return Err(format!("drives {} joints and sees {}; robot {name} has {joints}", driven.0, driven.1));
        }
        let step_s = options.robot_rate_hz.map_or(layout.period_s, |hz| 1.0 / hz);
        let (rows, bounds) = (Rows::new(&layout), Bounds::new(&layout, robot, step_s));
        let mut host = PolicyHost { policy: Arc::new(policy), rows, bounds, options, metadata: Json::Null };
        host.metadata = host.describe(&layout, robot, about);
        Ok(host)
    }

    /// The first message.
    pub fn metadata(&self) -> &Json {
        &self.metadata
    }

    /// Whether a policy must be told the joint velocities.
    pub(super) fn needs_dq(&self) -> bool {
        !(self.options.estimate_dq || self.policy.settings().mask_dq)
    }

    fn describe(&self, layout: &Layout, robot: &Robot, about: serde_json::Map<String, Json>) -> Json {
        let Json::Object(mut all) = json!({
            "server": "hilt",
            "version": env!("CARGO_PKG_VERSION"),
            "kind": "policy",
            "task": layout.name,
            "robot": robot.name,
            "period_s": layout.period_s,
            "horizon_steps": self.policy.horizon_steps(),
            "action_horizon": 1,
            "keys": self.rows.keys(),
            "actions": self.rows.actions(),
            "action_limits": layout.action_limits,
            "position_limits": self.bounds.position(),
            "needs_dq": self.needs_dq(),
            "estimates_dq": self.options.estimate_dq,
            "stochastic": self.options.sampling.is_some(),
            "robot_rate_hz": self.options.robot_rate_hz,
            "watchdog_ms": self.options.watchdog.map(|time| time.as_millis() as u64),
            "layout": layout,
        }) else {
            unreachable!("an object was written")
        };
        all.extend(about);
        Json::Object(all)
    }
}

impl Host for PolicyHost {
    fn converse(&self, link: &mut dyn Link, number: u64) -> Result<()> {
        link.send(&Value::of_json(&self.metadata));
        let mut session = Session::new(self, number);
        let mut before = None;
        loop {
            let message = match link.receive(session.patience())? {
                Received::Gone => return Ok(()),
                Received::Silence => {
                    let zero = session.stop();
                    if link.takes_what_it_did_not_ask_for() {
                        link.send(&zero);
                        session.stopped();
                    }
                    continue;
                }
                Received::Message(message) => message,
            };
            let began = Instant::now();
            match message.value().and_then(|value| session.answer(&value)) {
                Ok(mut answer) => {
                    answer.insert("server_timing", timing(began, before));
                    link.send(&answer);
                }
                Err(why) => link.refuse(&why),
            }
            before = Some(began.elapsed());
        }
    }
}

/// As openpi's server says it.
fn timing(began: Instant, before: Option<Duration>) -> Value<'static> {
    let ms = |time: Duration| Value::Float(time.as_secs_f64() * 1e3);
    let mut timing = Value::map([("infer_ms", ms(began.elapsed()))]);
    if let Some(before) = before {
        timing.insert("prev_total_ms", ms(before));
    }
    timing
}
