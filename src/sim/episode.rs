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
    let whole = || match run.begin() {
        Some(mut world) => run.until_the_end(&mut world, controller, disturbance, max_steps, interrupt),
        None => Ok(End::BrokenDown),
    };
    let end = guarded(whole).unwrap_or(Ok(End::BrokenDown))?;
    Ok(run.finished(index, end))
}

/// Runs a recorded episode again up to step `at`, by the commands that the motors were given, and from there as [`run_episode`] does with another
/// controller and another disturbance (whose first `at` steps are let pass). The physics depends on nothing else: joints, objects, their velocities and the
/// forces between them are those of the recorded moment, to the bit where the recording is of this version's physics. Returns how far they are from what was
/// recorded, too: the largest difference of a joint \[rad, m\] or of an object's place \[m\] on the way.
///
/// # Errors
/// [`crate::error::Error::Interrupted`], within a step.
pub fn run_episode_from(
    recorded: &Episode,
    at: usize,
    controller: &mut dyn Controller,
    disturbance: &mut Disturbance,
    max_steps: u32,
    interrupt: &Interrupt,
) -> Result<(Episode, f64)> {
    let (mut run, mut apart) = (Run::new(&recorded.scene), 0.0);
    let whole = || {
        let Some(mut world) = run.begin() else { return Ok(End::BrokenDown) };
        match run.repeat(&mut world, recorded, at, disturbance, interrupt)? {
            Some(found) => apart = found,
            None => return Ok(End::BrokenDown),
        }
        run.until_the_end(&mut world, controller, disturbance, max_steps, interrupt)
    };
    let end = guarded(whole).unwrap_or(Ok(End::BrokenDown))?;
    Ok((run.finished(recorded.index, end), apart))
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

    /// The world at its start; `None` when its numbers are none.
    fn begin(&mut self) -> Option<World> {
        let mut world = World::new(self.scene);
        let first = world.observe();
        sound(&first).then(|| self.see(first))?;
        Some(world)
    }

    /// Goes through the first `steps` of a recorded episode; how far from it, `None` when the simulation breaks down.
    fn repeat(
        &mut self,
        world: &mut World,
        recorded: &Episode,
        steps: usize,
        disturbance: &mut Disturbance,
        interrupt: &Interrupt,
    ) -> Result<Option<f64>> {
        let mut apart = apart(&self.seen, recorded.steps.first().unwrap_or(&recorded.last));
        for (t, step) in recorded.steps.iter().take(steps).enumerate() {
            interrupt.check()?;
            disturbance.apply(&step.commanded);
            world.step(&step.executed);
            let next = world.observe();
            if !sound(&next) {
                return Ok(None);
            }
            self.steps.push(record(&self.seen, &self.verdict, step.commanded, step.executed, step.phase));
            self.see(next);
            apart = self.apart_from(recorded, t + 1).max(apart);
        }
        Ok(Some(apart))
    }

    fn apart_from(&self, recorded: &Episode, t: usize) -> f64 {
        apart(&self.seen, recorded.steps.get(t).unwrap_or(&recorded.last))
    }

    fn until_the_end(
        &mut self,
        world: &mut World,
        controller: &mut dyn Controller,
        disturbance: &mut Disturbance,
        max_steps: u32,
        interrupt: &Interrupt,
    ) -> Result<End> {
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

    /// What is recorded of it.
    fn finished(self, index: u64, end: End) -> Episode {
        let success = end == End::Regular && self.verdict.success;
        let failure = match end {
            End::Regular => (!success).then(|| self.monitor.classify(&self.seen)),
            End::NoCommand => Some(FailureClass::CommandNotFinite),
            End::BrokenDown => Some(FailureClass::SimulationBrokeDown),
        };
        let still = Joints::zeros(self.scene.robot.joints.len());
        let last = record(&self.seen, &self.verdict, still, still, None);
        Episode { index, scene: self.scene.clone(), steps: self.steps, last, success, failure }
    }
}

/// The largest difference of a joint \[rad, m\] or of an object's place \[m\].
fn apart(seen: &Observation, recorded: &Step) -> f64 {
    let joints = seen.state.q.iter().zip(&recorded.state.q).map(|(a, b)| a - b);
    let places = seen.objects.iter().zip(&recorded.objects).flat_map(|(a, b)| {
        let (a, b) = (a.pose.position_m, b.pose.position_m);
        (0..3).map(move |i| a[i] - b[i])
    });
    joints.chain(places).fold(0.0, |most, difference| most.max(difference.abs()))
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
