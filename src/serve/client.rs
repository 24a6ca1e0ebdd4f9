//! A policy that somebody else serves, as the controller of an episode.

use super::dial::{Address, Dial};
use super::msgpack;
use super::rows::{EPISODE, FRAME, Rows};
use super::value::Value;
use crate::config::MOST_HORIZON_STEPS;
use crate::error::{Error, Result};
use crate::interrupt::Interrupt;
use crate::layout::Layout;
use crate::robot::Robot;
use crate::sim::Controller;
use crate::state::Action;
use crate::task::Task;
use crate::tasks::Observation;
use serde_json::Value as Json;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

/// A policy behind an address. Every episode is a conversation of its own.
pub struct RemotePolicy {
    address: Address,
    interrupt: Interrupt,
    metadata: Json,
    rows: Rows,
    instruction: String,
    /// Rows of an answer that are executed before the policy is asked again.
    actions_each: usize,
    /// The conversation in which the metadata came, for the first episode.
    first: Mutex<Option<Dial>>,
    /// Why the policy could not be asked any more.
    failure: Mutex<Option<Error>>,
}

impl RemotePolicy {
    /// Asks the server at `address` what it serves, for this robot in this task. Of answers with several actions, `actions_each` are executed.
    ///
    /// # Errors
    /// [`Error::Usage`] for an address that is none; [`Error::Failed`] when nobody answers there, or not as a policy of the task;
    /// [`Error::Interrupted`].
    pub fn connect(
        url: &str,
        token: Option<String>,
        (robot, task): (&Robot, &Task),
        actions_each: Option<usize>,
        interrupt: &Interrupt,
    ) -> Result<Arc<Self>> {
        let address = Address::new(url, token)?;
        let mut dial = Dial::connect(&address, interrupt)?;
        let metadata = metadata(&address, &mut dial)?;
        let layout = task.layout(robot);
        check(&address, &metadata, &layout)?;
        Ok(Arc::new(RemotePolicy {
            address,
            interrupt: interrupt.clone(),
            metadata,
            rows: Rows::new(&layout),
            instruction: task.instruction.clone(),
            actions_each: actions_each.unwrap_or(usize::MAX),
            first: Mutex::new(Some(dial)),
            failure: Mutex::new(None),
        }))
    }

    /// What the server says about itself.
    pub fn metadata(&self) -> &Json {
        &self.metadata
    }

    /// After how many steps the policy would give up, where the server says it.
    pub fn horizon_steps(&self) -> Option<u32> {
        let said = self.metadata.get("horizon_steps")?.as_u64()?;
        u32::try_from(said).ok().filter(|steps| (1..=MOST_HORIZON_STEPS).contains(steps))
    }

    /// Acts in episode `index`.
    ///
    /// # Errors
    /// As [`RemotePolicy::connect`].
    pub fn controller(self: &Arc<Self>, index: u64) -> Result<Box<dyn Controller>> {
        let first = self.first.lock().unwrap_or_else(PoisonError::into_inner).take();
        let dial = match first {
            Some(dial) => dial,
            None => {
                let mut dial = Dial::connect(&self.address, &self.interrupt)?;
                metadata(&self.address, &mut dial)?;
                dial
            }
        };
        Ok(Box::new(RemoteController { policy: Arc::clone(self), dial, index, frame: 0, queue: VecDeque::new() }))
    }

    /// Whether every question had an answer. An episode whose policy has gone is none.
    ///
    /// # Errors
    /// Why one had none.
    pub fn check(&self) -> Result<()> {
        self.failure.lock().unwrap_or_else(PoisonError::into_inner).take().map_or(Ok(()), Err)
    }
}

/// The first message, a map.
fn metadata(address: &Address, dial: &mut Dial) -> Result<Json> {
    let bytes = dial.receive()?;
    match msgpack::decode(&bytes) {
        Ok(map @ Value::Map(_)) => Ok(map.to_json()),
        Ok(other) => {
            Err(address.failed(&format!("begins with {} instead of a map of metadata; it serves no policy", other.kind())))
        }
        Err(why) => Err(address.failed(&format!("begins with what is no msgpack ({why}); it serves no policy"))),
    }
}

/// Refuses what says that it is for other rows, or no policy at all. Who says nothing is believed.
fn check(address: &Address, metadata: &Json, ours: &Layout) -> Result<()> {
    match metadata.get("kind").and_then(Json::as_str) {
        None | Some("policy") => {}
        Some(_) => return Err(address.failed("serves an environment; give the address of a policy")),
    }
    let Some(said) = metadata.get("layout") else { return Ok(()) };
    let theirs: Layout =
        serde_json::from_value(said.clone()).map_err(|e| address.failed(&format!("its \"layout\" is none: {e}")))?;
    if theirs == *ours {
        return Ok(());
    }
    let robot = metadata.get("robot").and_then(Json::as_str).unwrap_or("another robot");
    let [theirs, ours] =
        [&theirs, ours].map(|l| format!("{} (states of {}, actions of {})", l.name, l.state_dim(), l.action_dim()));
    Err(address
        .failed(&format!("serves a policy of {robot} for task {theirs}; asked for is {ours}: give --task and --robot as there")))
}

/// Asks in each step, or when the actions of the last answer are used up.
struct RemoteController {
    policy: Arc<RemotePolicy>,
    dial: Dial,
    index: u64,
    frame: u64,
    queue: VecDeque<Vec<f32>>,
}

impl RemoteController {
    fn next(&mut self, seen: &Observation) -> Result<Vec<f32>> {
        if self.queue.is_empty() {
            let mut question = self.policy.rows.observation(&seen.state.to_row());
            question.insert(EPISODE, Value::Int(self.index as i64));
            question.insert(FRAME, Value::Int(self.frame as i64));
            question.insert("task", Value::text(self.policy.instruction.clone()));
            question.insert("prompt", Value::text(self.policy.instruction.clone()));
            self.dial.send(&question)?;
            let bytes = self.dial.receive()?;
            self.queue = self.actions(&bytes).map_err(|why| self.policy.address.failed(&why))?;
        }
        self.frame += 1;
        Ok(self.queue.pop_front().expect("an answer has an action"))
    }

    /// The actions of an answer, before limits: the simulator has its own.
    fn actions(&self, bytes: &[u8]) -> std::result::Result<VecDeque<Vec<f32>>, String> {
        let answer = msgpack::decode(bytes).map_err(|why| format!("answers with what is no msgpack: {why}"))?;
        let width = self.policy.rows.layout().action_dim();
        if answer.get("command_not_finite").is_some() {
            return Ok([vec![f32::NAN; width]].into());
        }
        let found = ["unlimited_actions", "actions", "action"].iter().find_map(|key| answer.get(key));
        let Some(found) = found else { return Err(format!("answers with {} without \"actions\"", answer.kind())) };
        let numbers = found.numbers().map_err(|why| format!("\"actions\" holds {why}"))?;
        let shape = numbers.shape.clone();
        let rows = numbers.rows(width).ok_or_else(|| {
            format!("answers with actions of shape {shape:?}; {} needs rows of {width} numbers", self.policy.rows.layout().name)
        })?;
        Ok(rows.into_iter().take(self.policy.actions_each).collect())
    }
}

impl Controller for RemoteController {
    fn command(&mut self, seen: &Observation) -> Action {
        let joints = seen.robot.joints.len();
        let action = self.next(seen).unwrap_or_else(|why| {
            self.policy.failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(why);
            // Ends the episode; whoever runs it asks why.
            vec![f32::NAN; joints]
        });
        action.iter().map(|v| f64::from(*v)).collect()
    }
}
