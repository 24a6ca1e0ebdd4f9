//! An episode: controller, disturbance and world in a loop, watched by the task's monitor.

use super::disturbance::Disturbance;
use super::world::World;
use crate::demo::{Body, Contacts, Episode, LARGEST_NUMBER, Phase, Step};
use crate::error::Result;
use crate::guard::guarded;
use crate::interrupt::Interrupt;
use crate::joints::Joints;
use crate::scene::Scene;
use crate::state::Action;
use crate::tasks::{FailureClass, Monitor, Observation, Verdict};
use std::sync::Arc;

/// Decides the command of each control step: the plan follower, or a learned policy.
pub trait Controller {
    /// Joint velocities to ask for \[rad/s, m/s\], given what is seen.
    fn command(&mut self, seen: &Observation) -> Action;

    /// Hears what holds in the moment that [`Controller::command`] is asked about next.
    fn judged(&mut self, _verdict: &Verdict) {}

    /// The part of the plan that the last command belongs to, if there is a plan.
    fn phase(&self) -> Option<Phase> {
        None
    }
}

/// Runs one episode until success (its last 0.5 s is the proof), `max_steps`, an object below the table, a command that is no number, or a
/// simulation that breaks down: its numbers are none or beyond all measure, or the engine panics. Such a moment or command is left out of the record.
///
/// # Errors
/// [`crate::error::Error::Interrupted`], within a step.
pub fn run_episode(
    index: u64,
    scene: &Scene,
    controller: &mut dyn Controller,
    disturbance: &mut Disturbance,
    max_steps: u32,
    interrupt: &Interrupt,
) -> Result<Episode> {
    let mut run = Run::new(scene);
    let end = guarded(|| run.until_the_end(controller, disturbance, max_steps, interrupt)).unwrap_or(Ok(End::BrokenDown))?;
    let success = end == End::Regular && run.verdict.success;
    let failure = match end {
        End::Regular => (!success).then(|| run.monitor.classify(&run.seen)),
        End::NoCommand => Some(FailureClass::CommandNotFinite),
        End::BrokenDown => Some(FailureClass::SimulationBrokeDown),
    };
    let still = Joints::zeros(scene.robot.joints.len());
    let last = record(&run.seen, &run.verdict, still, still, None);
    Ok(Episode { index, scene: scene.clone(), steps: run.steps, last, success, failure })
}

/// How an episode ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum End {
    /// By success, by its last step, or by a fall.
    Regular,
    /// By a command that is no finite number.
    NoCommand,
    /// By a state that is none, or a panic of the engine.
    BrokenDown,
}

/// What is known of an episode at any moment, also after a panic: the steps so far, and what was seen last.
struct Run<'a> {
    scene: &'a Scene,
    monitor: Monitor,
    steps: Vec<Step>,
    seen: Observation,
    verdict: Verdict,
}

impl<'a> Run<'a> {
    fn new(scene: &'a Scene) -> Self {
        let conditions = vec![false; scene.task.condition_names().len()];
        let verdict = Verdict { conditions, met: Vec::new(), reward: 0.0, success: false };
        Run { scene, monitor: Monitor::new(scene), steps: Vec::new(), seen: at_rest(scene), verdict }
    }

    fn until_the_end(
        &mut self,
        controller: &mut dyn Controller,
        disturbance: &mut Disturbance,
        max_steps: u32,
        interrupt: &Interrupt,
    ) -> Result<End> {
        let mut world = World::new(self.scene);
        let first = world.observe();
        if !sound(&first) {
            return Ok(End::BrokenDown);
        }
        self.see(first);
        while !self.verdict.success && self.steps.len() < max_steps as usize && !fallen(&self.seen.objects) {
            interrupt.check()?;
            controller.judged(&self.verdict);
            let commanded = controller.command(&self.seen).map(|v| f64::from(v as f32));
            if commanded.iter().any(|v| !v.is_finite()) {
                return Ok(End::NoCommand);
            }
            let executed = disturbance.apply(&commanded);
            world.step(&executed);
            let next = world.observe();
            if !sound(&next) {
                return Ok(End::BrokenDown);
            }
            self.steps.push(record(&self.seen, &self.verdict, commanded, executed, controller.phase()));
            self.see(next);
        }
        Ok(End::Regular)
    }

    fn see(&mut self, next: Observation) {
        self.verdict = self.monitor.update(&next);
        self.seen = next;
    }
}

/// What there is to see before the first contact is known: the arm in its ready pose, the objects where the scene has them.
fn at_rest(scene: &Scene) -> Observation {
    let robot = &scene.robot;
    Observation {
        robot: Arc::clone(robot),
        state: scene.start(),
        tool_m: robot.tool_pose(&robot.ready).translation.vector.into(),
        objects: scene.objects.iter().map(|object| Body { pose: object.pose, speed_m_s: 0.0 }).collect(),
        contacts: Contacts::none(robot.fingers().len(), scene.objects.len()),
    }
}

fn record(seen: &Observation, verdict: &Verdict, commanded: Action, executed: Action, phase: Option<Phase>) -> Step {
    Step {
        state: seen.state.clone(),
        objects: seen.objects.clone(),
        commanded,
        executed,
        contacts: seen.contacts.clone(),
        reward: verdict.reward,
        conditions: verdict.conditions.clone(),
        phase,
    }
}

/// Whether an object's centre is below the table's top.
pub fn fallen(objects: &[Body]) -> bool {
    objects.iter().any(|object| object.pose.position_m[2] < 0.0)
}

/// Whether every number is one, and none is beyond what can be.
pub(super) fn sound(seen: &Observation) -> bool {
    let objects = seen.objects.iter().flat_map(|object| object.pose.to_array().into_iter().chain([object.speed_m_s]));
    let motion = seen.state.q.iter().chain(&seen.state.dq).copied();
    let forces = seen.contacts.objects.iter().flat_map(|touch| touch.fingers_n.iter());
    motion.chain(objects).all(|v| v.abs() <= LARGEST_NUMBER) && forces.copied().all(|f| f.is_finite())
}
