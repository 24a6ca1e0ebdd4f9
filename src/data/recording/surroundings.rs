//! What stands around the robot, as viewers draw it: once as Foxglove's messages have it, once as a URDF.

use crate::robot::write_urdf::{Body, Geometry, Solid, scene_urdf as urdf};
use crate::scene::Scene;
use crate::task::Shape;

/// The fixed frame: the robot's foot, z up.
pub const WORLD_FRAME: &str = "world";
/// The frame of an object of the task: no link of a robot is called so.
pub fn frame_of(object: &str) -> String {
    format!("object/{object}")
}

/// Drawn table: edge lengths \[m\]; it reaches past everything the arm can touch.
const TABLE_SIZE_M: [f64; 3] = [2.0, 2.0, 0.04];
/// Drawn goal: radius of the ball \[m\].
const GOAL_RADIUS_M: f64 = 0.01;
const GREY: [f64; 4] = [0.75, 0.75, 0.72, 1.0];
/// Objects that goals move: red, yellow, violet.
const MOVED: [[f64; 4]; 3] = [[0.80, 0.22, 0.18, 1.0], [0.88, 0.66, 0.16, 1.0], [0.55, 0.33, 0.68, 1.0]];
const BLUE: [f64; 4] = [0.20, 0.40, 0.75, 1.0];
const GREEN: [f64; 4] = [0.20, 0.65, 0.30, 0.8];
const DARK: [f64; 4] = [0.30, 0.30, 0.34, 1.0];

/// A thing that keeps its shape.
pub(super) struct Thing {
    /// Its name among all.
    pub name: String,
    /// What it is fixed to.
    pub frame: String,
    /// What it looks like there.
    pub solids: Vec<Solid>,
}

/// Table, objects, goals, obstacles.
pub(super) fn things(scene: &Scene) -> Vec<Thing> {
    let cube = |at_m, size_m, rgba| Solid { at_m, geometry: Geometry::Box(size_m), rgba };
    let in_world = |name: &str, solids| Thing { name: name.into(), frame: WORLD_FRAME.into(), solids };
    let mut things = vec![in_world("table", vec![cube([0.0, 0.0, -TABLE_SIZE_M[2] / 2.0], TABLE_SIZE_M, GREY)])];
    for (i, object) in scene.task.objects.iter().enumerate() {
        let rgba = if i < scene.task.moved() { MOVED[i % MOVED.len()] } else { BLUE };
        let solids = if let Shape::Cylinder { radius_m, height_m } = object.shape {
            vec![Solid { at_m: [0.0; 3], geometry: Geometry::Cylinder { radius_m, height_m }, rgba }]
        } else {
            let boxes = object.shape.boxes_m().into_iter();
            boxes.map(|(center, half)| cube(center, half.map(|h| 2.0 * h), rgba)).collect()
        };
        things.push(Thing { name: object.name.clone(), frame: frame_of(&object.name), solids });
    }
    for (name, goal) in scene.task.goal_names().iter().zip(&scene.goals) {
        things.push(in_world(name, vec![Solid { at_m: *goal, geometry: Geometry::Ball(GOAL_RADIUS_M), rgba: GREEN }]));
    }
    if !scene.obstacles.is_empty() {
        let cubes = scene.obstacles.iter().map(|o| cube(o.center_m, o.size_m, DARK)).collect();
        things.push(in_world("obstacles", cubes));
    }
    things
}

/// Robot and surroundings as one URDF whose links are the frames of `/tf`, objects where they stand at the start.
pub fn scene_urdf(scene: &Scene) -> String {
    let things = things(scene);
    let fixed: Vec<Solid> = things.iter().filter(|thing| thing.frame == WORLD_FRAME).flat_map(|t| t.solids.clone()).collect();
    let moving = things.into_iter().filter(|thing| thing.frame != WORLD_FRAME).zip(&scene.objects);
    let bodies: Vec<Body> =
        moving.map(|(Thing { frame, solids, .. }, at)| Body { frame, pose: at.pose.isometry(), solids }).collect();
    urdf(&scene.robot, WORLD_FRAME, &fixed, &bodies)
}
