//! One arm, a table, the objects of a task and obstacles, in rapier.

use super::arm::{self, SURFACE_FRICTION};
use super::contacts::{self, Owner};
use super::convert::{isometry, pose, to_pose, vector};
use super::physics::{Grain, Physics};
use crate::demo::Body;
use crate::error::{Error, Result};
use crate::math::sin_cos;
use crate::robot::Robot;
use crate::scene::{Placed, Scene};
use crate::state::{Action, State};
use crate::task::{Shape, Task};
use crate::tasks::Observation;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use rapier3d::prelude::*;
use serde::Serialize;
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

/// Gravity \[m/s^2\].
const GRAVITY_M_S2: Real = 9.81;
/// Half extents of the table, a box whose top is the plane z = 0 \[m\]: beyond the arm's reach, too thick to fall through.
const TABLE_HALF_M: [f64; 3] = [1.5, 1.5, 0.25];
/// Sides of the prism that a cylinder is, an even number, made of slabs that lie crosswise: a finger presses on a face. On the line of a true
/// cylinder it holds it no better than a pencil in the simulator's few sweeps, and faces of the engine's own prisms slip (docs/notes.md).
const CYLINDER_SIDES: u32 = 8;
/// An object that moves slower rests \[m/s\].
const REST_M_S: Real = 0.005;

/// The simulated scene. Stepping it depends on nothing but its own state and the actions.
pub struct World {
    scene: Scene,
    settings: Physics,
    physics: PhysicsWorld,
    handle: MultibodyJointHandle,
    /// Of each object of the task.
    objects: Vec<RigidBodyHandle>,
    /// Quaternions x y z w of the objects when they were last observed: the next keep their signs.
    quaternions: Vec<[f64; 4]>,
}

impl World {
    /// The start of an episode: the arm at rest in its ready pose, the objects standing where the scene has them.
    pub fn new(scene: &Scene) -> World {
        World::with(scene, Physics::default())
    }

    /// The same under other settings of the physics.
    pub fn with(scene: &Scene, settings: Physics) -> World {
        World::at(scene, &scene.start(), settings)
    }

    /// The objects stand where the scene has them, the arm moves as in the state.
    fn at(scene: &Scene, state: &State, settings: Physics) -> World {
        let mut physics = PhysicsWorld::new();
        physics.integration_parameters = IntegrationParameters { dt: 0.0, ..settings.parameters(settings.near) };
        physics.gravity = Vector::new(0.0, 0.0, -GRAVITY_M_S2);
        insert_fixed(&mut physics, Owner::Table, [0.0, 0.0, -TABLE_HALF_M[2]], TABLE_HALF_M);
        for obstacle in &scene.obstacles {
            insert_fixed(&mut physics, Owner::Obstacle, obstacle.center_m, obstacle.size_m.map(|s| s / 2.0));
        }
        let objects = scene.task.objects.iter().zip(&scene.objects).enumerate();
        let objects = objects.map(|(i, (object, placed))| insert_object(&mut physics, i, &object.shape, placed)).collect();
        let handle = arm::insert(&mut physics, &scene.robot, &state.q, &state.dq, scene.finger_friction);
        // A step of no duration finds the contacts and moves nothing.
        physics.step();
        physics.integration_parameters = settings.parameters(settings.near);
        let quaternions = state.objects.iter().map(|pose| pose.quaternion_xyzw).collect();
        World { scene: scene.clone(), settings, physics, handle, objects, quaternions }
    }

    /// One control step of 50 ms with the joint velocities `executed` \[rad/s, m/s\] (used in f32).
    pub fn step(&mut self, executed: &Action) {
        arm::command(&mut self.physics, &self.scene.robot, self.handle, executed);
        let grain = self.grain();
        self.physics.integration_parameters = self.settings.parameters(grain);
        for _ in 0..grain.steps {
            self.physics.step();
        }
    }

    /// How finely the next control step is divided.
    fn grain(&self) -> Grain {
        let Physics { near, free, .. } = self.settings;
        let moves = |handle: &RigidBodyHandle| self.physics.bodies[*handle].linvel().length() > REST_M_S;
        let near_all = near == free || contacts::robot_near(&self.physics) || self.objects.iter().any(moves);
        if near_all { near } else { free }
    }

    /// What there is to see now. Forces are those of the physics step that led here (0 in a world that was just made or set).
    pub fn observe(&mut self) -> Observation {
        let (q, dq) = arm::read(&self.physics, &self.scene.robot, self.handle);
        let mut objects = Vec::with_capacity(self.objects.len());
        for (handle, before) in self.objects.iter().zip(&mut self.quaternions) {
            let body = &self.physics.bodies[*handle];
            let mut pose = to_pose(body.position());
            let agreement: f64 = pose.quaternion_xyzw.iter().zip(&*before).map(|(a, b)| a * b).sum();
            if agreement < 0.0 {
                pose.quaternion_xyzw = pose.quaternion_xyzw.map(|v| -v);
            }
            *before = pose.quaternion_xyzw;
            objects.push(Body { pose, speed_m_s: f64::from(body.linvel().length()) });
        }
        // What no goal moves is seen where it stood at the start.
        let moved = self.scene.task.moved();
        let mut state = State { q, dq, ..self.scene.start() };
        state.objects.iter_mut().zip(&objects).take(moved).for_each(|(seen, now)| *seen = now.pose);
        Observation {
            robot: Arc::clone(&self.scene.robot),
            state,
            tool_m: self.scene.robot.tool_pose(&q).translation.vector.into(),
            objects,
            contacts: contacts::read(&self.physics, &self.scene.robot, self.objects.len()),
        }
    }

    /// Poses of the robot's links, from its joint positions.
    pub fn link_poses(&self) -> Vec<Isometry3<f64>> {
        self.scene.robot.link_poses(&arm::read(&self.physics, &self.scene.robot, self.handle).0)
    }

    /// Puts the world into a recorded state: exact in joint angles, joint velocities and poses. The objects are at rest, those
    /// that no goal moves stand where the state has them, and contacts start without force: in the middle of a grasp the future
    /// differs from the recorded one by about half a millimetre.
    pub fn set_state(&mut self, state: &State) {
        *self = World::at(&self.scene.at(state), state, self.settings);
    }

    /// Everything that the future depends on, as bytes.
    pub fn snapshot(&self) -> Vec<u8> {
        let scene = [json(&*self.scene.robot), json(&*self.scene.task), self.scene.to_json().to_string()];
        let moving = (&self.settings, &self.physics, &self.handle, &self.objects, &self.quaternions);
        postcard::to_stdvec(&(scene, moving)).expect("the world is plain data")
    }

    /// The world of a [`World::snapshot`]; it continues bit for bit.
    ///
    /// # Errors
    /// [`Error::Failed`] when the bytes are no snapshot of this version.
    pub fn restore(bytes: &[u8]) -> Result<World> {
        let refuse = |why: String| {
            Error::Failed(format!("{} bytes are no snapshot of a world by this version of hilt: {why}", bytes.len()))
        };
        type Moving = (Physics, PhysicsWorld, MultibodyJointHandle, Vec<RigidBodyHandle>, Vec<[f64; 4]>);
        let (scene, moving): ([String; 3], Moving) = postcard::from_bytes(bytes).map_err(|e| refuse(e.to_string()))?;
        let [robot, task, scene] = scene;
        let robot: Robot = serde_json::from_str(&robot).map_err(|e| refuse(e.to_string()))?;
        let task: Task = serde_json::from_str(&task).map_err(|e| refuse(e.to_string()))?;
        let scene = Scene::from_json(&Arc::new(robot), &Arc::new(task), &scene).map_err(refuse)?;
        let (settings, physics, handle, objects, quaternions) = moving;
        Ok(World { scene, settings, physics, handle, objects, quaternions })
    }
}

fn json(value: &impl Serialize) -> String {
    serde_json::to_string(value).expect("plain data with text keys")
}

fn insert_fixed(physics: &mut PhysicsWorld, owner: Owner, center_m: [f64; 3], half_m: [f64; 3]) {
    let half = vector(half_m);
    let collider = ColliderBuilder::cuboid(half.x, half.y, half.z)
        .translation(vector(center_m))
        .friction(SURFACE_FRICTION)
        .restitution(0.0)
        .user_data(owner.code());
    physics.insert(RigidBodyBuilder::fixed(), collider);
}

/// An object of the task. Its friction multiplies that of whatever it touches, which is 1 of all but objects: it holds against everything.
fn insert_object(physics: &mut PhysicsWorld, number: usize, shape: &Shape, at: &Placed) -> RigidBodyHandle {
    let builder = if shape.is_fixed() { RigidBodyBuilder::fixed() } else { RigidBodyBuilder::dynamic().can_sleep(false) };
    let finish = |collider: ColliderBuilder| {
        collider
            .friction(at.friction as Real)
            .friction_combine_rule(CoefficientCombineRule::Multiply)
            .restitution(0.0)
            .user_data(Owner::Object(number).code())
    };
    let cuboid = |half_m: [f64; 3]| {
        let half = vector(half_m);
        ColliderBuilder::cuboid(half.x, half.y, half.z)
    };
    let body = physics.insert_body(builder.pose(pose(&at.pose)));
    let (mass_kg, mass) = (at.mass_kg, at.mass_kg as Real);
    match *shape {
        Shape::Box(size) => {
            physics.insert_collider(finish(cuboid(size.map(|edge| edge / 2.0)).mass(mass)), Some(body));
        }
        Shape::Cylinder { radius_m, height_m } => {
            let (r, h, side) = (radius_m, height_m, 2.0 * FRAC_PI_2 / f64::from(CYLINDER_SIDES));
            let across = mass_kg * (3.0 * r * r + h * h) / 12.0;
            let inertia = vector([across, across, mass_kg * r * r / 2.0]);
            physics.bodies[body].set_additional_mass_properties(MassProperties::new(Vector::ZERO, mass, inertia), true);
            for k in 0..CYLINDER_SIDES / 2 {
                let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 2.0 * side * f64::from(k));
                let at = isometry(&Isometry3::from_parts(Translation3::identity(), turn));
                let (sin, cos) = sin_cos(side);
                let slab = cuboid([r, r * sin / cos, h / 2.0]).position(at).density(0.0);
                physics.insert_collider(finish(slab), Some(body));
            }
        }
        Shape::Bin { .. } => {
            for (center_m, half_m) in shape.boxes_m() {
                physics.insert_collider(finish(cuboid(half_m).translation(vector(center_m))), Some(body));
            }
        }
    }
    body
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::SceneSettings;
    use crate::robot::file::built_in::paper_robot;
    use crate::task::built_in::{find, pick_up};
    use crate::tasks::draw_scene;

    #[test]
    fn the_table_carries_the_weight_of_the_block() {
        let settings = SceneSettings::default();
        // Of a cube, and of a can, which is made of several parts.
        for task in [pick_up(), find("bin").expect("a task")] {
            let scene =
                draw_scene(&paper_robot(), &task, &settings, &mut crate::seed::stream(0, "weight", 0)).expect("there is room");
            let mut world = World::new(&scene);
            (0..20).for_each(|_| world.step(&[0.0; 9].into()));
            let parts = world.physics.bodies[world.objects[0]].colliders();
            let pairs = parts.iter().flat_map(|part| world.physics.contact_pairs_with(*part));
            let force: f64 = pairs.map(|pair| contacts::force_n(pair, &world.physics)).sum();
            let weight = scene.objects[0].mass_kg * f64::from(GRAVITY_M_S2);
            assert!((force - weight).abs() < 0.02 * weight, "{task}: the table pushes with {force} N against {weight} N");
        }
    }
}
