//! A scene: what stands where when an episode begins. Drawn once per episode, recorded with it.

use crate::joints::Joints;
use crate::robot::Robot;
use crate::state::{Pose, State};
use crate::task::Task;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::sync::Arc;

/// An axis-aligned box that stands in the workspace, fixed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Obstacle {
    /// Centre x y z \[m\].
    pub center_m: [f64; 3],
    /// Full edge lengths x y z \[m\].
    pub size_m: [f64; 3],
}

/// An object as it is at the start of an episode.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Placed {
    /// Where it stands.
    pub pose: Pose,
    /// Coulomb friction against everything.
    pub friction: f64,
    /// \[kg\].
    pub mass_kg: f64,
}

/// The scene of one episode. The table's top is the plane z = 0; the robot's foot stands at the origin.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Who acts.
    pub robot: Arc<Robot>,
    /// The task.
    pub task: Arc<Task>,
    /// Its objects, in its order.
    pub objects: Vec<Placed>,
    /// Goals that are places on the table, in the order of [`Task::goal_names`]: where the object's centre is to be \[m\].
    pub goals: Vec<[f64; 3]>,
    /// Fixed boxes to keep clear of.
    pub obstacles: Vec<Obstacle>,
    /// Dry friction of the fingers' joints, in units of the robot's own ([`OWN_FRICTION`] where nothing is said).
    pub finger_friction: f64,
}

/// What stands beside every plan as JSON: whoever reads that says whose plans they are, and of which task.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SceneFile {
    objects: Vec<Placed>,
    goals: Vec<[f64; 3]>,
    obstacles: Vec<Obstacle>,
    #[serde(default = "own_friction", skip_serializing_if = "is_own_friction")]
    finger_friction: f64,
}

/// Fingers as the robot's file has them, which files leave unsaid.
pub const OWN_FRICTION: f64 = 1.0;

fn own_friction() -> f64 {
    OWN_FRICTION
}

fn is_own_friction(share: &f64) -> bool {
    *share == OWN_FRICTION
}

/// The same in files from when there were one block, and a goal or a base block.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct OlderScene {
    task: String,
    block: Pose,
    context: OlderContext,
    obstacles: Vec<Obstacle>,
    friction: f64,
    block_mass_kg: f64,
}

/// The goal or the base block of such files.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OlderContext {
    /// Pick-up: nothing.
    None,
    /// Pick-and-place.
    Goal([f64; 3]),
    /// Stack.
    Base(Pose),
}

/// Friction of the base block in files from when there was but one.
const OLDER_BASE_FRICTION: f64 = 1.0;

impl Scene {
    /// Everything but robot and task.
    pub fn to_json(&self) -> Value {
        let Scene { objects, goals, obstacles, finger_friction, .. } = self.clone();
        serde_json::to_value(SceneFile { objects, goals, obstacles, finger_friction })
            .expect("a scene is plain data with text keys")
    }

    /// The inverse of [`Scene::to_json`], also of files from when there were one block, and a goal or a base block.
    ///
    /// # Errors
    /// What is missing or of another type, and a task that is another.
    pub fn from_json(robot: &Arc<Robot>, task: &Arc<Task>, json: &str) -> Result<Scene, String> {
        let value: Value = serde_json::from_str(json).map_err(|e| e.to_string())?;
        if value.get("block").is_some() {
            let older: OlderScene = serde_json::from_value(value).map_err(|e| e.to_string())?;
            if older.task != task.name {
                return Err(format!("it is of {}, not of {task}", older.task));
            }
            let (friction, mass_kg) = (older.friction, older.block_mass_kg);
            return Ok(Scene::of_older(robot, task, (older.block, older.context), (friction, mass_kg), older.obstacles));
        }
        let SceneFile { objects, goals, obstacles, finger_friction } =
            serde_json::from_value(value).map_err(|e| e.to_string())?;
        Ok(Scene { robot: Arc::clone(robot), task: Arc::clone(task), objects, goals, obstacles, finger_friction })
    }

    /// From when there were one block, and a goal or a base block.
    pub fn of_older(
        robot: &Arc<Robot>,
        task: &Arc<Task>,
        (block, context): (Pose, OlderContext),
        (friction, mass_kg): (f64, f64),
        obstacles: Vec<Obstacle>,
    ) -> Scene {
        let mut objects = vec![Placed { pose: block, friction, mass_kg }];
        if let OlderContext::Base(pose) = context {
            objects.push(Placed { pose, friction: OLDER_BASE_FRICTION, mass_kg });
        }
        let goals = if let OlderContext::Goal(goal) = context { vec![goal] } else { Vec::new() };
        let (robot, task) = (Arc::clone(robot), Arc::clone(task));
        Scene { robot, task, objects, goals, obstacles, finger_friction: OWN_FRICTION }
    }

    /// The state at the start: the arm at rest in its ready pose.
    pub fn start(&self) -> State {
        State {
            q: self.robot.ready,
            dq: Joints::zeros(self.robot.joints.len()),
            objects: self.objects.iter().map(|object| object.pose).collect(),
            goals: self.goals.clone(),
        }
    }

    /// The same scene with its objects and goals where `state` has them.
    pub fn at(&self, state: &State) -> Scene {
        let mut scene = Scene { goals: state.goals.clone(), ..self.clone() };
        scene.objects.iter_mut().zip(&state.objects).for_each(|(object, pose)| object.pose = *pose);
        scene
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::file::built_in::paper_robot;
    use crate::task::built_in::{pick_and_place, pick_up, stack};

    const POSE: &str = r#"{"position_m":[0.4,-0.1,0.025],"quaternion_xyzw":[0.0,0.0,0.0,1.0]}"#;

    /// A scene as plans had it when there were one block, and a goal or a base block.
    fn older(task: &str, context: &str) -> String {
        let rest = r#""obstacles":[{"center_m":[0.4,0.1,0.1],"size_m":[0.02,0.3,0.2]}],"friction":0.7,"block_mass_kg":0.2"#;
        format!(r#"{{"task":"{task}","block":{POSE},"context":{context},{rest}}}"#)
    }

    #[test]
    fn scenes_of_older_plans_are_read() {
        let block = Pose::from_yaw([0.4, -0.1, 0.025], 0.0);
        let placed = |friction| Placed { pose: block, friction, mass_kg: 0.2 };
        let base = format!(r#"{{"base":{POSE}}}"#);
        for (task, context, objects, goals) in [
            (pick_up(), "\"none\"", vec![placed(0.7)], vec![]),
            (pick_and_place(), r#"{"goal":[0.5,0.1,0.025]}"#, vec![placed(0.7)], vec![[0.5, 0.1, 0.025]]),
            (stack(), &base, vec![placed(0.7), placed(1.0)], vec![]),
        ] {
            let text = older(&task.name, context);
            let scene = Scene::from_json(&paper_robot(), &task, &text).expect("an older scene");
            assert_eq!((&scene.objects, &scene.goals, scene.obstacles.len()), (&objects, &goals, 1));
            let again = Scene::from_json(&paper_robot(), &task, &scene.to_json().to_string()).expect("a scene");
            assert_eq!(again, scene);
        }
        let why = Scene::from_json(&paper_robot(), &stack(), &older("pick-up", "\"none\"")).expect_err("another task");
        assert!(why.contains("it is of pick-up, not of stack"), "{why}");
    }
}
