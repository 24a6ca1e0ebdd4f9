//! A policy as a server: observations in, commands within the robot's limits out.

use super::bounds::Bounds;
use super::link::{Link, Received};
use super::rows::Rows;
use super::server::Host;
use super::session::{Acting, PolicyOptions, Session};
use super::value::Value;
use crate::error::Result;
use crate::layout::Layout;
use crate::learn::Policy;
use crate::robot::Robot;
use serde_json::{Value as Json, json};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Serves a policy of a robot.
#[derive(Debug)]
pub struct PolicyHost {
    acting: Acting,
    metadata: Json,
}

impl PolicyHost {
    /// A policy with the robot whose limits hold, none where what it drives is not known; `about` are further entries of the metadata.
    ///
    /// # Errors
    /// When the robot is not the one whose rows the policy has learned from, or velocities are to be estimated that it does not see.
    pub fn new(
        policy: Policy,
        robot: Option<&Robot>,
        options: PolicyOptions,
        about: serde_json::Map<String, Json>,
    ) -> std::result::Result<Self, String> {
        let layout = Arc::clone(policy.layout());
        let driven = (layout.action_dim(), layout.positions().len());
        if let Some(Robot { name, joints, .. }) = robot.filter(|robot| driven != (robot.joints.len(), robot.joints.len())) {
            return Err(format!("drives {} joints and sees {}; robot {name} has {}", driven.0, driven.1, joints.len()));
        }
        if options.estimate_dq && layout.velocities().is_empty() {
            return Err("sees no joint velocities that --estimate-dq could make; leave it out".into());
        }
        let step_s = options.robot_rate_hz.map_or(layout.period_s, |hz| 1.0 / hz);
        let (rows, bounds) = (Rows::new(&layout), Bounds::new(&layout, robot, step_s));
        let mut host = PolicyHost { acting: Acting { policy, rows, bounds, options }, metadata: Json::Null };
        host.metadata = host.describe(&layout, robot, about);
        Ok(host)
    }

    /// The first message.
    pub fn metadata(&self) -> &Json {
        &self.metadata
    }

    fn describe(&self, layout: &Layout, robot: Option<&Robot>, about: serde_json::Map<String, Json>) -> Json {
        let Json::Object(mut all) = json!({
            "server": "hilt",
            "version": env!("CARGO_PKG_VERSION"),
            "kind": "policy",
            "task": layout.name,
            "robot": robot.map(|robot| &robot.name),
            "period_s": layout.period_s,
            "horizon_steps": self.acting.policy.horizon_steps(),
            "action_horizon": 1,
            "keys": self.acting.rows.keys(),
            "actions": self.acting.rows.actions(),
            "action_limits": layout.action_limits,
            "position_limits": self.acting.bounds.position(),
            "needs_dq": self.acting.needs_dq(),
            "estimates_dq": self.acting.options.estimate_dq,
            "stochastic": self.acting.options.sampling.is_some(),
            "robot_rate_hz": self.acting.options.robot_rate_hz,
            "watchdog_ms": self.acting.options.watchdog.map(|time| time.as_millis() as u64),
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
        let mut session = Session::new(&self.acting, number);
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
