//! One robot's conversation with a policy: which action it gets when, and when it gets none.

use super::array::Array;
use super::bounds::{Bounds, Limited};
use super::rows::{EPISODE, FRAME, Rows};
use super::value::Value;
use crate::learn::Policy;
use crate::seed::stream;
use rand_chacha::ChaCha8Rng;
use std::f32::consts::{PI, TAU};
use std::time::{Duration, Instant};

/// Rounding of a ratio of rates must not miss a period.
const NEARLY: f64 = 1e-9;

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

/// Who answers all robots.
#[derive(Debug)]
pub struct Acting {
    /// The policy.
    pub policy: Policy,
    /// Of its states.
    pub rows: Rows,
    /// Of its actions.
    pub bounds: Bounds,
    /// How it is served.
    pub options: PolicyOptions,
}

impl Acting {
    /// Whether it must be told the joint velocities.
    pub fn needs_dq(&self) -> bool {
        let sees = !self.rows.layout().velocities().is_empty();
        sees && !(self.options.estimate_dq || self.policy.settings().mask_dq)
    }
}

/// What is known of a robot since its episode began.
pub struct Session<'a> {
    acting: &'a Acting,
    /// The conversation's number: it names the episode where the robot does not.
    number: u64,
    /// The episode, by the robot's number or by that.
    episode: u64,
    rng: Option<ChaCha8Rng>,
    /// Observations in this episode.
    asked: u64,
    /// The command that holds, as the policy gave it.
    held: Vec<f32>,
    /// The joint positions when the velocities were last estimated, with the number of that observation.
    before: Option<(u64, Vec<f32>)>,
    dq: Vec<f32>,
    watch: Watch,
}

/// Whether observations come as they should.
enum Watch {
    /// None has come yet, or the robot was told to stop.
    Off,
    /// The last came then.
    Since(Instant),
    /// Too long ago: the next answer is to stop.
    Late,
}

impl<'a> Session<'a> {
    pub fn new(acting: &'a Acting, number: u64) -> Self {
        let dq = vec![0.0; acting.rows.layout().velocities().len()];
        let mut session = Session {
            acting,
            number,
            episode: number,
            rng: None,
            asked: 0,
            held: Vec::new(),
            before: None,
            dq,
            watch: Watch::Off,
        };
        session.begin(number);
        session
    }

    /// A new episode: nothing of what was before counts.
    fn begin(&mut self, episode: u64) {
        self.episode = episode;
        self.rng = self.acting.options.sampling.map(|seed| stream(seed, "evaluate.action", episode));
        (self.asked, self.before) = (0, None);
        self.dq.fill(0.0);
    }

    /// How long the next observation may take.
    pub fn patience(&self) -> Option<Duration> {
        match (self.acting.options.watchdog, &self.watch) {
            (Some(most), Watch::Since(last)) => Some(most.saturating_sub(last.elapsed())),
            _ => None,
        }
    }

    /// No observation has come for too long: the command is to stand still, and what comes next begins anew.
    pub fn stop(&mut self) -> Value<'static> {
        self.watch = Watch::Late;
        self.begin(self.episode);
        let mut zero = Value::map([("actions", self.actions(&vec![0.0; self.acting.rows.layout().action_dim()]))]);
        zero.insert("watchdog", Value::Bool(true));
        zero
    }

    /// The robot has been told.
    pub fn stopped(&mut self) {
        self.watch = Watch::Off;
    }

    fn actions(&self, action: &[f32]) -> Value<'static> {
        Value::Array(Array::f32(&[1, action.len()], action))
    }

    /// The answer to a message.
    ///
    /// # Errors
    /// Says what is wrong with it; the robot's clock goes on.
    pub fn answer(&mut self, message: &Value) -> Result<Value<'static>, String> {
        let episode = |value: Option<&Value>| value.and_then(Value::as_u64);
        if let Some(reset) = message.get("reset") {
            let episode = episode(reset.get("episode")).unwrap_or(self.number);
            self.begin(episode);
            self.watch = Watch::Off;
            return Ok(Value::map([("reset", Value::Bool(true))]));
        }
        let mut row = self.acting.rows.row(message, self.acting.needs_dq())?;
        if message.get(FRAME).and_then(Value::as_u64) == Some(0) {
            self.begin(episode(message.get(EPISODE)).unwrap_or(self.number));
            // Between two episodes a robot may rest.
            self.watch = Watch::Off;
        }
        let late = matches!(self.watch, Watch::Late);
        self.watch = Watch::Since(Instant::now());
        if late {
            let zero = self.stop();
            self.watch = Watch::Since(Instant::now());
            return Ok(zero);
        }
        let due = self.is_due();
        if due {
            self.estimate(&mut row);
            self.held = match &mut self.rng {
                Some(rng) => self.acting.policy.sample(&row, rng),
                None => self.acting.policy.act(&row),
            };
        }
        self.asked += 1;
        Ok(self.command(&row, due))
    }

    /// Whether a control period of the policy has begun since the last observation.
    fn is_due(&self) -> bool {
        let Some(robot_hz) = self.acting.options.robot_rate_hz else { return true };
        let periods_each = 1.0 / (self.acting.rows.layout().period_s * robot_hz);
        let begun = |observations: u64| (observations as f64 * periods_each + NEARLY).floor();
        self.asked == 0 || begun(self.asked) > begun(self.asked - 1)
    }

    /// Puts estimated velocities into the row: the way since the last control period over its time. The arm is at rest at first.
    fn estimate(&mut self, row: &mut [f32]) {
        if !self.acting.options.estimate_dq {
            return;
        }
        let layout = self.acting.rows.layout();
        let q = row[layout.positions()].to_vec();
        if let Some((then, before)) = &self.before {
            let each_s = self.acting.options.robot_rate_hz.map_or(layout.period_s, |hz| 1.0 / hz);
            let time_s = ((self.asked - then) as f64 * each_s) as f32;
            let names = layout.state.iter().flat_map(|span| &span.entries);
            for (i, name) in names.skip(layout.positions().start).take(q.len()).enumerate() {
                let way = q[i] - before[i];
                // A joint that turns freely may be read as an angle within one turn.
                let turned = name.ends_with("rad") && way.abs() > PI;
                self.dq[i] = (if turned { way - TAU * (way / TAU).round() } else { way }) / time_s;
            }
        }
        self.before = Some((self.asked, q));
        row[layout.velocities()].copy_from_slice(&self.dq);
    }

    /// The command that holds, within the limits at this moment.
    fn command(&self, row: &[f32], due: bool) -> Value<'static> {
        let finite = self.held.iter().all(|v| v.is_finite());
        let mut action = if finite { self.held.clone() } else { vec![0.0; self.held.len()] };
        let limited = self.acting.bounds.apply(&row[self.acting.rows.layout().positions()], &mut action);
        let mut answer = Value::map([("actions", self.actions(&action))]);
        if !limited.is_empty() {
            let Limited { velocity, position } = limited;
            let places = |joints: Vec<usize>| Value::List(joints.into_iter().map(|i| Value::Int(i as i64)).collect());
            answer.insert("limited", Value::map([("velocity", places(velocity)), ("position", places(position))]));
            answer.insert("unlimited_actions", self.actions(&self.held));
        }
        if !finite {
            answer.insert("command_not_finite", Value::Bool(true));
        }
        if !due {
            answer.insert("held", Value::Bool(true));
        }
        answer
    }
}
