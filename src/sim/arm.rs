//! A robot as a multibody in reduced coordinates, driven by a velocity motor a joint.

use super::contacts::Owner;
use super::convert::{isometry, rotation, vector};
use crate::joints::Joints;
use crate::robot::Robot;
use crate::robot::model::{Joint, JointKind, Shape};
use crate::state::{Action, CONTROL_DT_S};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use rapier3d::prelude::*;
use std::f64::consts::FRAC_PI_2;

/// Gain of a velocity motor \[N m s/rad, N s/m\]: so stiff that only its largest torque or force matters.
const MOTOR_GAIN: Real = 1e5;
/// Limits nearer than this are looked at \[rad, and what counts as one\]: twice what a motor turns in a control step, beside what the joint's own
/// velocity makes.
const LIMIT_MARGIN_RAD: f64 = 0.1;
/// Friction coefficient of the robot's surfaces and of the fixed things; that of objects multiplies it.
pub(super) const SURFACE_FRICTION: Real = 1.0;

/// The axis along which rapier moves a joint: about the local x axis, or along it.
pub(super) fn axis(kind: JointKind) -> JointAxis {
    match kind {
        JointKind::Revolute => JointAxis::AngX,
        JointKind::Prismatic => JointAxis::LinX,
    }
}

/// Adds the robot at joint state `q`, `dq`, its fingers with so much of their dry friction; returns the handle of its first joint (any joint's
/// would do).
pub(super) fn insert(
    physics: &mut PhysicsWorld,
    robot: &Robot,
    q: &[f64],
    dq: &[f64],
    finger_friction: f64,
) -> MultibodyJointHandle {
    let links: Vec<RigidBodyHandle> = (0..robot.links.len()).map(|link| insert_link(physics, robot, link)).collect();
    let mut handles = robot.joints.iter().enumerate().map(|(i, joint)| {
        physics
            .insert_multibody_joint(links[joint.parent], links[i + 1], as_rapier(joint))
            .expect("each link is the child of exactly one joint")
    });
    let handle = handles.next().expect("a robot has joints");
    handles.for_each(drop);
    let multibody = physics.multibody_joints.get_mut(handle).expect("the joint was inserted just now").0;
    // A new multibody floats: this first pass sees the fixed base and removes six degrees of freedom. Whatever is set by row
    // (armature, damping, friction, positions) belongs after it.
    multibody.forward_kinematics(&physics.bodies, true);
    assert_eq!(multibody.ndofs(), robot.joints.len(), "one degree of freedom a joint, and a fixed foot");
    multibody.set_self_contacts_enabled(false);
    for (i, (joint, velocity)) in robot.joints.iter().zip(dq).enumerate() {
        multibody.armature_mut()[i] = joint.motor.armature as Real;
        multibody.damping_mut()[i] = joint.motor.damping as Real;
        let share = if i < robot.arm { 1.0 } else { finger_friction };
        multibody.frictions_mut()[i] = (share * joint.motor.friction) as Real;
        multibody.generalized_velocity_mut()[i] = *velocity as Real;
    }
    multibody.apply_displacements(&q.iter().map(|v| *v as Real).collect::<Vec<_>>());
    multibody.forward_kinematics(&physics.bodies, false);
    multibody.update_rigid_bodies(&mut physics.bodies, true);
    handle
}

/// Sets the motors' velocities \[rad/s, m/s\], and which limits are looked at: a limit that no joint can reach in this control step is left
/// out, for it would be a row that holds nothing, factored and swept in every substep.
pub(super) fn command(physics: &mut PhysicsWorld, robot: &Robot, handle: MultibodyJointHandle, action: &Action) {
    let multibody = physics.multibody_joints.get_mut(handle).expect("the robot is never removed").0;
    for (i, (joint, velocity)) in robot.joints.iter().zip(action).enumerate() {
        let (axis, margin) = (axis(joint.kind), (LIMIT_MARGIN_RAD * joint.per_radian()) as Real);
        let reach = margin + CONTROL_DT_S as Real * multibody.generalized_velocity()[i].abs();
        let link = multibody.link_mut(i + 1).expect("link i + 1 hangs on joint i");
        let position = link.joint.coords()[axis as usize];
        let data = &mut link.joint.data;
        data.set_motor_velocity(axis, *velocity as Real, MOTOR_GAIN);
        if !joint.continuous {
            let limits = data.limits[axis as usize];
            let near = position - reach < limits.min || position + reach > limits.max;
            data.limit_axes.set(axis.into(), near);
        }
    }
}

/// Joint positions \[rad, m\] and velocities \[rad/s, m/s\].
pub(super) fn read(physics: &PhysicsWorld, robot: &Robot, handle: MultibodyJointHandle) -> (Joints, Joints) {
    let multibody = physics.multibody_joints.get(handle).expect("the robot is never removed").0;
    let velocity = multibody.generalized_velocity();
    let position = |i: usize| {
        let link = multibody.link(i + 1).expect("link i + 1 hangs on joint i");
        f64::from(link.joint.coords()[axis(robot.joints[i].kind) as usize])
    };
    let n = robot.joints.len();
    (Joints::from_fn(n, position), Joints::from_fn(n, |i| f64::from(velocity[i])))
}

fn insert_link(physics: &mut PhysicsWorld, robot: &Robot, link: usize) -> RigidBodyHandle {
    let inertia = robot.links[link].inertia;
    let (com, principal) = (vector(inertia.com_m), vector(inertia.principal_kg_m2));
    let mass = MassProperties::with_principal_inertia_frame(com, inertia.mass_kg as Real, principal, rotation(&inertia.axes));
    let builder = if link == 0 { RigidBodyBuilder::fixed() } else { RigidBodyBuilder::dynamic() };
    // No gravity: the real arm's controller compensates its own weight.
    let body = physics.insert_body(builder.gravity_scale(0.0).additional_mass_properties(mass).can_sleep(false));
    for shape in &robot.links[link].shapes {
        let collider = match shape {
            Shape::Capsule { from_m, to_m, radius_m } => {
                ColliderBuilder::capsule_from_endpoints(vector(*from_m), vector(*to_m), *radius_m as Real)
            }
            Shape::Box { pose, half_m } => {
                let half = vector(*half_m);
                ColliderBuilder::cuboid(half.x, half.y, half.z).position(isometry(pose))
            }
        };
        let collider = collider.density(0.0).friction(SURFACE_FRICTION).user_data(Owner::Link(link).code());
        physics.insert_collider(collider, Some(body));
    }
    body
}

/// Rapier moves about or along the local x axis, ours is z.
fn as_rapier(joint: &Joint) -> GenericJoint {
    let z_from_x =
        Isometry3::from_parts(Vector3::zeros().into(), UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -FRAC_PI_2));
    let (axis, locked) = match joint.kind {
        JointKind::Revolute => (JointAxis::AngX, JointAxesMask::LOCKED_REVOLUTE_AXES),
        JointKind::Prismatic => (JointAxis::LinX, JointAxesMask::LOCKED_PRISMATIC_AXES),
    };
    let builder = GenericJointBuilder::new(locked)
        .local_frame1(isometry(&(joint.origin * z_from_x)))
        .local_frame2(isometry(&z_from_x))
        .motor_model(axis, MotorModel::ForceBased)
        .motor_velocity(axis, 0.0, MOTOR_GAIN)
        .motor_max_force(axis, joint.effort as Real)
        .contacts_enabled(false);
    let limits = joint.limits.map(|limit| limit as Real);
    if joint.continuous { builder.build() } else { builder.limits(axis, limits).build() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::file::built_in::all;

    /// A new multibody has six rows more, which vanish with its first pass: what was set earlier would sit on the wrong joints.
    #[test]
    fn motors_armature_damping_and_friction_sit_on_their_joints() {
        for robot in all() {
            let mut physics = PhysicsWorld::new();
            let n = robot.joints.len();
            let handle = insert(&mut physics, &robot, &robot.ready, &Joints::zeros(n), 0.5);
            let action = Joints::from_fn(n, |i| 0.01 * i as f64);
            command(&mut physics, &robot, handle, &action);
            physics.step();
            let multibody = physics.multibody_joints.get(handle).expect("inserted above").0;
            for (i, ours) in robot.joints.iter().enumerate() {
                let share = if i < robot.arm { 1.0 } else { 0.5 };
                let expected = [ours.motor.armature, ours.motor.damping, share * ours.motor.friction].map(|v| v as Real);
                let found = [multibody.armature()[i], multibody.damping()[i], multibody.frictions()[i]];
                assert_eq!(found, expected, "{}", ours.name);
                let joint = &multibody.link(i + 1).expect("a link").joint.data;
                let motor = joint.motor(axis(ours.kind)).expect("each joint has a motor");
                assert_eq!(motor.max_force, ours.effort as Real, "{}", ours.name);
                assert_eq!(motor.target_vel, action[i] as Real, "{}", ours.name);
            }
        }
    }

    #[test]
    fn rapier_and_our_kinematics_agree_on_every_link() {
        for robot in all() {
            let mut physics = PhysicsWorld::new();
            let q = Joints::from_fn(robot.joints.len(), |i| robot.ready[i] + 0.2 * robot.joints[i].per_radian());
            let handle = insert(&mut physics, &robot, &q, &Joints::zeros(q.len()), 1.0);
            let multibody = physics.multibody_joints.get(handle).expect("inserted above").0;
            for (link, ours) in multibody.links().zip(robot.link_poses(&q)) {
                let theirs = crate::sim::convert::to_pose(physics.bodies[link.rigid_body_handle()].position()).isometry();
                let apart =
                    (theirs.translation.vector - ours.translation.vector).norm() + theirs.rotation.angle_to(&ours.rotation);
                assert!(apart < 1e-4, "{}: link {} differs by {apart}", robot.name, link.link_id());
            }
        }
    }
}
