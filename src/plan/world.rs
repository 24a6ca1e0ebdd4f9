//! What a plan must keep clear of: table, obstacles, other objects, the object itself, and the arm's own base.

use crate::config::SceneSettings;
use crate::error::{Error, Result};
use crate::joints::Joints;
use crate::robot::Robot;
use crate::robot::collision::Solid;
use crate::scene::{Obstacle, Scene};
use crate::task::{Object, Target};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

/// Least distance of arm and carried object to anything fixed, in a finished plan \[m\].
pub const CLEARANCE_M: f64 = 0.01;
/// Distances that hand poses and paths keep before smoothing \[m\]: first twice as much, so that noise in execution has room; then what must be.
pub(super) const PATH_CLEARANCES_M: [f64; 2] = [2.0 * CLEARANCE_M, CLEARANCE_M];
/// Least height of hand and fingers above the table \[m\]: closed fingers reach 19 mm below the tool point.
const HAND_TABLE_M: f64 = 0.002;
/// Least distance of the open hand to the object that it straddles \[m\].
const HAND_OBJECT_M: f64 = 0.003;
/// Least distance between the arm's own links \[m\].
const SELF_M: f64 = 0.005;
/// Joints of the wrist: what they move may meet foot, shoulder and upper arm.
const WRIST: usize = 3;
/// The carried object may sink this far into its support \[m\]: it begins in contact, and the numbers are rounded.
const SUPPORT_SLACK_M: f64 = 1e-3;
/// The support of the object may be touched within this distance of grasp and release, sideways \[m\] ...
const SUPPORT_ZONE_XY_M: f64 = 0.015;
/// ... and upward \[m\].
const SUPPORT_ZONE_Z_M: f64 = 0.05;
/// The greatest distance between two configurations that are checked \[m\].
pub const RESOLUTION_M: f64 = 0.01;

/// Whether nothing comes too near; what does, in words.
type Free = std::result::Result<(), String>;

/// Where the object to move is while a piece of the plan is executed.
#[derive(Clone, Copy, Debug)]
pub(super) enum Moved {
    /// It stands free in this pose; the open hand must not push it.
    Free(Isometry3<f64>),
    /// The hand holds it, in this pose relative to the tool.
    Held(Isometry3<f64>),
}

/// Whether the boxes of the settings leave the robot's ready pose free, from which every episode begins.
///
/// # Errors
/// [`Error::Usage`] names the box, and the link that it touches.
pub fn check_ready_pose(robot: &Robot, settings: &SceneSettings) -> Result<()> {
    let links = robot.solids(&robot.link_poses(&robot.ready));
    for (i, Obstacle { center_m, size_m }) in settings.obstacles.iter().enumerate() {
        let at = Isometry3::from_parts(Translation3::from(*center_m), UnitQuaternion::identity());
        let solid = Solid::cuboid(at, size_m.map(|s| s / 2.0));
        let touched = links.iter().find(|(_, link)| !link.farther_than(&solid, CLEARANCE_M));
        if let Some((link, _)) = touched {
            let (link, room) = (&robot.links[*link].name, CLEARANCE_M * 1e3);
            return Err(Error::Usage(format!(
                "scene.obstacles[{i}], center_m {center_m:?} and size_m {size_m:?}, comes within {room:.0} mm of the arm where every \
                 episode begins ({link}): move the box or make it smaller"
            )));
        }
    }
    Ok(())
}

/// What stands in the way to a goal: the fixed things of a scene, and its objects where they are when the goals before hold.
#[derive(Clone, Debug)]
pub(super) struct World<'a> {
    pub(super) scene: &'a Scene,
    pub(super) goal: usize,
    obstacles: Vec<Solid>,
    /// Other objects than the one that is moved, with their names.
    others: Vec<(&'a str, Solid)>,
    /// What the object is put on, or into, with its name.
    support: Option<(&'a str, Vec<Solid>)>,
    /// Where the tool releases the object, or the object's centre if that is higher \[m\].
    release_m: Vector3<f64>,
}

impl<'a> World<'a> {
    /// On the way to a goal.
    pub(super) fn new(scene: &'a Scene, goal: usize) -> Self {
        let half = |size: [f64; 3]| size.map(|s| s / 2.0);
        let obstacles = scene
            .obstacles
            .iter()
            .map(|o| {
                Solid::cuboid(Isometry3::from_parts(Translation3::from(o.center_m), UnitQuaternion::identity()), half(o.size_m))
            })
            .collect();
        let task = &scene.task;
        let number = task.goals[goal].object;
        let supports = match task.goals[goal].target {
            Target::On(other) | Target::In(other) => Some(other),
            Target::Lift { .. } | Target::At { .. } => None,
        };
        let solids = |other: usize| -> Vec<Solid> {
            let mut at = scene.objects[other].pose.isometry();
            at.translation = Translation3::from(scene.place_after(other, goal));
            let boxes = task.objects[other].shape.boxes_m();
            boxes.into_iter().map(|(center, half_m)| Solid::cuboid(at * Translation3::from(center), half_m)).collect()
        };
        let name = |other: usize| task.objects[other].name.as_str();
        let others = (0..task.objects.len()).filter(|other| *other != number && Some(*other) != supports);
        let others = others.flat_map(|other| solids(other).into_iter().map(move |solid| (name(other), solid))).collect();
        let support = supports.map(|other| (name(other), solids(other)));
        let release_m = Vector3::from(scene.target_m(goal)) + Vector3::z() * task.objects[number].held_m();
        World { scene, goal, obstacles, others, support, release_m }
    }

    /// The object that is moved, by its place in the task.
    pub(super) fn number(&self) -> usize {
        self.scene.task.goals[self.goal].object
    }

    /// The object that is moved.
    pub(super) fn object(&self) -> &'a Object {
        &self.scene.task.objects[self.number()]
    }

    /// Whether anything stands there that a straight way could meet.
    pub(super) fn has_obstacles(&self) -> bool {
        !self.obstacles.is_empty() || !self.others.is_empty()
    }

    /// Whether the arm at `q` keeps `margin_m` from everything fixed.
    ///
    /// # Errors
    /// Names what comes too near to what.
    pub(super) fn check(&self, q: &Joints, moved: &Moved, margin_m: f64) -> Free {
        self.check_poses(&self.scene.robot.link_poses(q), moved, margin_m)
    }

    /// The same along the straight joint path between two configurations, at [`RESOLUTION_M`]; the first one is not checked.
    pub(super) fn check_motion(&self, from: &Joints, to: &Joints, moved: &Moved, margin_m: f64) -> Free {
        let end = self.scene.robot.link_poses(to);
        let steps = (self.travel_m(&self.scene.robot.link_poses(from), &end) / RESOLUTION_M).ceil().max(1.0) as usize;
        for k in 1..steps {
            let t = k as f64 / steps as f64;
            let q = Joints::from_fn(from.len(), |i| from[i] + t * (to[i] - from[i]));
            self.check(&q, moved, margin_m)?;
        }
        self.check_poses(&end, moved, margin_m)
    }

    fn check_poses(&self, poses: &[Isometry3<f64>], moved: &Moved, margin_m: f64) -> Free {
        let links = self.scene.robot.solids(poses);
        let tool = self.scene.robot.tool_of(poses);
        let at_release = self.at_release(&tool);
        let moving = self.object();
        for (link, solid) in &links {
            let name = &self.scene.robot.links[*link].name;
            let (hand, finger) = (*link >= self.scene.robot.hand(), *link > self.scene.robot.hand());
            let table = if hand { HAND_TABLE_M } else { margin_m };
            if *link > 0 && solid.lowest_m() < table {
                return Err(format!("{name} comes within {:.0} mm of the table", table * 1e3));
            }
            let base_margin = if finger && at_release { HAND_TABLE_M } else { margin_m };
            self.check_fixed(solid, name, margin_m, base_margin)?;
            if let (true, Moved::Free(pose)) = (hand, moved)
                && !solid.farther_than(&Solid::cuboid(*pose, moving.shape.half_m()), HAND_OBJECT_M)
            {
                return Err(format!("{name} would push the {}", moving.name));
            }
        }
        if let Moved::Held(in_tool) = moved {
            let carried = Solid::cuboid(tool * in_tool, moving.shape.half_m());
            let name = format!("the carried {}", moving.name);
            if carried.lowest_m() < -SUPPORT_SLACK_M {
                return Err(format!("{name} is pressed into the table"));
            }
            let base_margin = if at_release { -SUPPORT_SLACK_M } else { margin_m };
            self.check_fixed(&carried, &name, margin_m, base_margin)?;
        }
        self.check_self(&links)
    }

    fn check_fixed(&self, solid: &Solid, name: &str, margin_m: f64, base_margin_m: f64) -> Free {
        if let Some(i) = self.obstacles.iter().position(|o| !solid.farther_than(o, margin_m)) {
            return Err(format!("{name} comes within {:.0} mm of obstacle {i}", margin_m * 1e3));
        }
        if let Some((other, _)) = self.others.iter().find(|(_, o)| !solid.farther_than(o, margin_m)) {
            return Err(format!("{name} comes within {:.0} mm of the {other}", margin_m * 1e3));
        }
        match &self.support {
            Some((support, parts)) if parts.iter().any(|part| !solid.farther_than(part, base_margin_m)) => {
                Err(format!("{name} comes too near to the {support}"))
            }
            _ => Ok(()),
        }
    }

    fn at_release(&self, tool: &Isometry3<f64>) -> bool {
        let away = tool.translation.vector - self.release_m;
        away.xy().norm() < SUPPORT_ZONE_XY_M && away.z < SUPPORT_ZONE_Z_M
    }

    /// Coarse: what the last three joints of the arm move, and the fingers, against what stands before the first three of those.
    fn check_self(&self, links: &[(usize, Solid)]) -> Free {
        let name = |link: &usize| &self.scene.robot.links[*link].name;
        let [outer_from, inner_to] =
            [self.scene.robot.arm.saturating_sub(WRIST - 1), self.scene.robot.arm.saturating_sub(WRIST + 1)];
        for (outer, a) in links.iter().filter(|(link, _)| *link >= outer_from) {
            for (inner, b) in links.iter().filter(|(link, _)| *link <= inner_to && *link < outer_from) {
                if !a.farther_than(b, SELF_M) {
                    return Err(format!("{} comes too near to {}", name(outer), name(inner)));
                }
            }
        }
        Ok(())
    }

    /// The farthest that elbow, wrist, hand or fingertip move between two configurations \[m\].
    fn travel_m(&self, a: &[Isometry3<f64>], b: &[Isometry3<f64>]) -> f64 {
        let origins = a.iter().zip(b).map(|(a, b)| (a.translation.vector - b.translation.vector).norm());
        let [of_a, of_b] = [a, b].map(|poses| self.scene.robot.tool_of(poses).translation.vector);
        origins.fold((of_a - of_b).norm(), f64::max)
    }
}
