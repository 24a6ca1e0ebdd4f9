//! Settings of the scene, the planner and the simulation.

use super::ranges::MOST_OBSTACLES;
use super::ranges::Range;
use crate::scene::{Obstacle, Scene};
use crate::state::Pose;
use crate::task::Spread;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::Value;

/// `[scene]`: areas that tasks refer to, and what is the same for all objects; used by `plan`, `simulate` and `evaluate`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SceneSettings {
    /// Spawn area along x, low and high \[m\]: 30 x 30 cm in front of the arm, within its reach (the paper does not state it).
    pub spawn_x_m: [f64; 2],
    /// Spawn area along y, low and high \[m\].
    pub spawn_y_m: [f64; 2],
    /// Goal area (pick-and-place) along x, low and high \[m\].
    pub goal_x_m: [f64; 2],
    /// Goal area (pick-and-place) along y, low and high \[m\].
    pub goal_y_m: [f64; 2],
    /// Whether the yaw of what stands in the spawn area is random (within a quarter turn) instead of 0.
    pub yaw: bool,
    /// Where the base block of the stack task stands, x y \[m\], each a number or a range: within reach, and far enough from the
    /// spawn area that the open hand fits between: from 0.27 m on it had to grasp some blocks from another side, which no small
    /// policy learns well.
    pub base_xy_m: [Spread; 2],
    /// Coulomb friction of the objects against everything, a number or a range.
    pub friction: Spread,
    /// Mass of an object \[kg\], a number or a range.
    pub block_mass_kg: Spread,
    /// Dry friction of the fingers' joints in units of the robot's own, a number or a range: what keeps a thumb in its place while two fingers press
    /// against it, and is known of hardly any hand.
    pub finger_friction: Spread,
    /// Fixed boxes to keep clear of (`[[scene.obstacles]]`).
    pub obstacles: Vec<Obstacle>,
}

impl Default for SceneSettings {
    fn default() -> Self {
        SceneSettings {
            spawn_x_m: [0.32, 0.62],
            spawn_y_m: [-0.15, 0.15],
            goal_x_m: [0.32, 0.62],
            goal_y_m: [-0.15, 0.15],
            yaw: false,
            base_xy_m: [Spread::Fixed(0.45), Spread::Fixed(0.30)],
            friction: Spread::Fixed(1.0),
            block_mass_kg: Spread::Fixed(0.1),
            finger_friction: Spread::Fixed(1.0),
            obstacles: Vec::new(),
        }
    }
}

/// How far the length of a quaternion may be from 1: what rounding leaves is far less.
const UNIT: f64 = 1e-3;

/// Whether a scene from a file can be one: every number within what settings allow, turned by unit quaternions, with its task's objects and goals.
///
/// # Errors
/// Says which number is none, and what is allowed.
pub fn check_scene(scene: &Scene) -> Result<(), String> {
    let number = |key: &str, value: f64| {
        let range = Range::of(key).expect("every number of a scene has a range");
        range.check(key, &Value::Float(value))
    };
    let point = |key: &str, [x, y, z]: [f64; 3]| [x, y, z].iter().try_for_each(|v| number(key, *v));
    let pose = |name: &str, pose: &Pose| {
        point("scene.obstacles.center_m", pose.position_m).map_err(|why| why.replace("scene.obstacles.center_m", name))?;
        let length = pose.quaternion_xyzw.iter().map(|v| v * v).sum::<f64>().sqrt();
        if (length - 1.0).abs() < UNIT {
            Ok(())
        } else {
            Err(format!("the quaternion of {name} has length {length}, allowed: 1"))
        }
    };
    let task = &scene.task;
    let counts = [(scene.objects.len(), task.objects.len(), "objects"), (scene.goals.len(), task.goal_names().len(), "goals")];
    if let Some((found, expected, what)) = counts.into_iter().find(|(found, expected, _)| found != expected) {
        return Err(format!("it has {found} {what}, {task} has {expected}"));
    }
    number("scene.finger_friction", scene.finger_friction)?;
    for (object, placed) in task.objects.iter().zip(&scene.objects) {
        number("scene.friction", placed.friction)?;
        number("scene.block_mass_kg", placed.mass_kg)?;
        pose(&object.name, &placed.pose)?;
    }
    for (name, goal) in task.goal_names().iter().zip(&scene.goals) {
        point("scene.obstacles.center_m", *goal).map_err(|why| why.replace("scene.obstacles.center_m", name))?;
    }
    if scene.obstacles.len() > MOST_OBSTACLES {
        return Err(format!("it has {} obstacles, allowed: up to {MOST_OBSTACLES}", scene.obstacles.len()));
    }
    scene.obstacles.iter().try_for_each(|o| {
        point("scene.obstacles.center_m", o.center_m)?;
        point("scene.obstacles.size_m", o.size_m)
    })
}

/// `[plan]`: demonstrations as smooth joint trajectories.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PlanSettings {
    /// Demonstrations to plan. Paper: 200 pick-up, 250 pick-and-place, 300 stack.
    pub episodes: u64,
    /// Fraction of the joints' velocity limits that plans may use (0..1].
    pub speed: f64,
    /// Largest acceleration of an arm joint in a plan \[rad/s^2\]: full planned speed within 0.2 s.
    pub max_acceleration_rad_s2: f64,
    /// Iterations of the path search before a transit counts as blocked.
    pub search_iterations: usize,
    /// Shortcut attempts after a search.
    pub shortcut_iterations: usize,
}

impl Default for PlanSettings {
    fn default() -> Self {
        PlanSettings {
            episodes: 200,
            speed: 0.8,
            max_acceleration_rad_s2: 3.0,
            search_iterations: 5000,
            shortcut_iterations: 100,
        }
    }
}

/// `[simulate.pulses]`: disturbance pulses while recording; the recorded command is the correction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PulseSettings {
    /// Probability per step that a pulse begins; 0 turns pulses off.
    pub probability: f64,
    /// Length of a pulse in control steps.
    pub steps: u32,
    /// Standard deviation of a pulse's constant extra velocity on each arm joint \[rad/s\].
    pub sigma_rad_s: f64,
}

impl Default for PulseSettings {
    fn default() -> Self {
        PulseSettings { probability: 0.0, steps: 4, sigma_rad_s: 0.2 }
    }
}

/// `[pretrain.reexecute_fingers]`: for a few control steps each finger is given another command than the demo's, so that the dynamics
/// network sees hands that open and close where no demo does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FingerPulses {
    /// Probability per step that such a pulse begins; 0 turns them off.
    pub probability: f64,
    /// Length of a pulse in control steps.
    pub steps: u32,
    /// Fastest command \[rad/s\]; each finger's is uniform between it and its opposite.
    pub speed_rad_s: f64,
}

impl Default for FingerPulses {
    fn default() -> Self {
        FingerPulses { probability: 0.0, steps: 3, speed_rad_s: 0.8 }
    }
}

/// `[simulate]`: execution of plans in contact physics.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SimulateSettings {
    /// Variance of the Gaussian noise on each of the nine commands, per control step \[(rad/s)^2\] (paper 4.1).
    pub noise_variance: f64,
    /// Control steps after which a command acts, a number or a range of which every episode draws a whole one: what a real arm's bus and servos take.
    pub delay_steps: Spread,
    /// Control steps after which an episode is given up.
    pub max_steps: u32,
    /// Disturbance pulses.
    pub pulses: PulseSettings,
}

impl Default for SimulateSettings {
    fn default() -> Self {
        SimulateSettings {
            noise_variance: 0.001,
            delay_steps: Spread::Fixed(0.0),
            max_steps: 400,
            pulses: PulseSettings::default(),
        }
    }
}
