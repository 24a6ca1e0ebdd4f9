//! One arm, a table, a block, perhaps a base block and obstacles, in rapier.

use super::arm::{self, SURFACE_FRICTION};
use super::contacts::{self, Owner};
use super::convert::{pose, to_pose, vector};
use super::physics::{Grain, Physics};
use crate::error::{Error, Result};
use crate::joints::Joints;
use crate::robot::Robot;
use crate::scene::{BLOCK_EDGE_M, Scene};
use crate::state::{Action, Context, Pose, State};
use crate::tasks::Observation;
use nalgebra::Isometry3;
use rapier3d::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Gravity \[m/s^2\].
const GRAVITY_M_S2: Real = 9.81;
/// Half extents of the table, a box whose top is the plane z = 0 \[m\]: beyond the arm's reach, too thick to fall through.
const TABLE_HALF_M: [f64; 3] = [1.5, 1.5, 0.25];
/// A block that moves slower rests \[m/s\].
const REST_M_S: Real = 0.005;

/// The simulated scene. Stepping it depends on nothing but its own state and the actions.
#[derive(Serialize, Deserialize)]
pub struct World {
    scene: Scene,
    settings: Physics,
    physics: PhysicsWorld,
    handle: MultibodyJointHandle,
    block: RigidBodyHandle,
    base: Option<RigidBodyHandle>,
    /// Quaternion x y z w of the last observed block: the next keeps its sign.
    block_quaternion: [f64; 4],
}

impl World {
    /// The start of an episode: the arm at rest in its ready pose, block and base block standing where the scene has them.
    pub fn new(scene: &Scene) -> World {
        World::with(scene, Physics::default())
    }

    /// The same under other settings of the physics.
    pub fn with(scene: &Scene, settings: Physics) -> World {
        let start = State {
            q: scene.robot.ready,
            dq: Joints::zeros(scene.robot.joints.len()),
            block: scene.block,
            context: scene.context,
        };
        World::at(scene, &start, settings)
    }

    fn at(scene: &Scene, state: &State, settings: Physics) -> World {
        let mut physics = PhysicsWorld::new();
        physics.integration_parameters = IntegrationParameters { dt: 0.0, ..settings.parameters(settings.near) };
        physics.gravity = Vector::new(0.0, 0.0, -GRAVITY_M_S2);
        insert_fixed(&mut physics, Owner::Table, [0.0, 0.0, -TABLE_HALF_M[2]], TABLE_HALF_M);
        for obstacle in &scene.obstacles {
            insert_fixed(&mut physics, Owner::Obstacle, obstacle.center_m, obstacle.size_m.map(|s| s / 2.0));
        }
        let block = insert_cube(&mut physics, Owner::Block, &state.block, scene);
        let base = match state.context {
            Context::Base(base) => Some(insert_cube(&mut physics, Owner::Base, &base, scene)),
            Context::None | Context::Goal(_) => None,
        };
        let handle = arm::insert(&mut physics, &scene.robot, &state.q, &state.dq);
        // A step of no duration finds the contacts and moves nothing.
        physics.step();
        physics.integration_parameters = settings.parameters(settings.near);
        World { scene: scene.clone(), settings, physics, handle, block, base, block_quaternion: state.block.quaternion_xyzw }
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
        let near_all = near == free || contacts::robot_near(&self.physics) || self.base.iter().chain([&self.block]).any(moves);
        if near_all { near } else { free }
    }

    /// What there is to see now. Forces are those of the physics step that led here (0 in a world that was just made or set).
    pub fn observe(&mut self) -> Observation {
        let (q, dq) = arm::read(&self.physics, &self.scene.robot, self.handle);
        let body = &self.physics.bodies[self.block];
        let mut block = to_pose(body.position());
        let agreement: f64 = block.quaternion_xyzw.iter().zip(&self.block_quaternion).map(|(a, b)| a * b).sum();
        if agreement < 0.0 {
            block.quaternion_xyzw = block.quaternion_xyzw.map(|v| -v);
        }
        self.block_quaternion = block.quaternion_xyzw;
        Observation {
            robot: Arc::clone(&self.scene.robot),
            state: State { q, dq, block, context: self.scene.context },
            tool_m: self.scene.robot.tool_pose(&q).translation.vector.into(),
            base_now: self.base.map(|handle| to_pose(self.physics.bodies[handle].position())),
            contacts: contacts::read(&self.physics, &self.scene.robot),
            block_speed_m_s: f64::from(body.linvel().length()),
        }
    }

    /// Poses of the robot's links, from its joint positions.
    pub fn link_poses(&self) -> Vec<Isometry3<f64>> {
        self.scene.robot.link_poses(&arm::read(&self.physics, &self.scene.robot, self.handle).0)
    }

    /// Puts the world into a recorded state: exact in joint angles, joint velocities and block pose. The block is at rest, the base
    /// block stands where the state's context has it, and contacts start without force: in the middle of a grasp the future
    /// differs from the recorded one by about half a millimetre.
    pub fn set_state(&mut self, state: &State) {
        let scene = Scene { context: state.context, ..self.scene.clone() };
        *self = World::at(&scene, state, self.settings);
    }

    /// Everything that the future depends on, as bytes.
    pub fn snapshot(&self) -> Vec<u8> {
        postcard::to_stdvec(&(&self.scene.robot, self)).expect("the world is plain data")
    }

    /// The world of a [`World::snapshot`]; it continues bit for bit.
    ///
    /// # Errors
    /// [`Error::Failed`] when the bytes are no snapshot of this version.
    pub fn restore(bytes: &[u8]) -> Result<World> {
        let (robot, mut world): (Arc<Robot>, World) = postcard::from_bytes(bytes).map_err(|e| {
            Error::Failed(format!("{} bytes are no snapshot of a world by this version of hilt: {e}", bytes.len()))
        })?;
        world.scene.robot = robot;
        Ok(world)
    }
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

fn insert_cube(physics: &mut PhysicsWorld, owner: Owner, at: &Pose, scene: &Scene) -> RigidBodyHandle {
    let half = (BLOCK_EDGE_M / 2.0) as Real;
    // The block's friction multiplies that of whatever it touches, which is 1: it holds against everything.
    let friction = if owner == Owner::Block { scene.friction as Real } else { SURFACE_FRICTION };
    let collider = ColliderBuilder::cuboid(half, half, half)
        .mass(scene.block_mass_kg as Real)
        .friction(friction)
        .friction_combine_rule(CoefficientCombineRule::Multiply)
        .restitution(0.0)
        .user_data(owner.code());
    physics.insert(RigidBodyBuilder::dynamic().pose(pose(at)).can_sleep(false), collider).0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::SceneSettings;
    use crate::robot::file::built_in::paper_robot;
    use crate::tasks::{Task, draw_scene};

    #[test]
    fn the_table_carries_the_weight_of_the_block() {
        let settings = SceneSettings::default();
        let scene =
            draw_scene(&paper_robot(), Task::PickUp, &settings, &mut crate::seed::stream(0, "weight", 0)).expect("there is room");
        let mut world = World::new(&scene);
        (0..20).for_each(|_| world.step(&[0.0; 9].into()));
        let block = world.physics.bodies[world.block].colliders()[0];
        let force: f64 = world.physics.contact_pairs_with(block).map(|pair| contacts::force_n(pair, &world.physics)).sum();
        let weight = scene.block_mass_kg * f64::from(GRAVITY_M_S2);
        assert!((force - weight).abs() < 0.02 * weight, "the table pushes with {force} N against {weight} N");
    }
}
