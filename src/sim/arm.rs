//! The Jaco as a multibody in reduced coordinates, driven by nine joint velocity motors.

use super::contacts::Owner;
use super::convert::{isometry, vector};
use crate::robot::jaco::{JOINT_SPECS, LINK_INERTIA, LINKS, TORQUE_LIMITS_N_M};
use crate::robot::{Arm, LINK_SHAPES, POSITION_LIMITS_RAD, Shape};
use crate::state::{ARM_JOINTS, Action, CONTROL_DT_S, JOINTS};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use rapier3d::prelude::*;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Gain of a velocity motor \[N m s/rad\]: so stiff that only the torque limit matters.
const MOTOR_GAIN: Real = 1e5;
/// Reflected inertia of the motors \[kg m^2\], arm and fingers (measured: 0 freezes the fingers).
const ARMATURE_KG_M2: [Real; 2] = [0.2, 0.005];
/// Viscous damping \[N m s/rad\], arm and fingers.
const DAMPING_N_M_S: [Real; 2] = [0.1, 0.01];
/// Dry friction \[N m\], arm and fingers: the fingers' worm drives cannot be pushed back; without it two fingers push the thumb open.
/// As the solver meets it, a finger commanded slower than about 0.12 rad/s stands still.
const DRY_FRICTION_N_M: [Real; 2] = [0.0, 0.6];
/// Limits nearer than this are looked at \[rad\]: twice what a motor turns in a control step, beside what the joint's own velocity makes.
const LIMIT_MARGIN_RAD: Real = 0.1;
/// Friction coefficient of the robot's surfaces and of the fixed things; the block's own multiplies it.
pub(super) const SURFACE_FRICTION: Real = 1.0;

/// Adds the robot at joint state `q`, `dq`; returns the handle of joint 1 (any joint's would do).
pub(super) fn insert(physics: &mut PhysicsWorld, q: &[f64; JOINTS], dq: &[f64; JOINTS]) -> MultibodyJointHandle {
    let links: [RigidBodyHandle; LINKS] = std::array::from_fn(|link| insert_link(physics, link));
    let kinematics = Arm::new();
    let joints: [MultibodyJointHandle; JOINTS] = std::array::from_fn(|i| {
        physics
            .insert_multibody_joint(links[JOINT_SPECS[i].parent], links[i + 1], joint(&kinematics, i))
            .expect("each link is the child of exactly one joint")
    });
    let handle = joints[0];
    let multibody = physics.multibody_joints.get_mut(handle).expect("the joint was inserted just now").0;
    // A new multibody floats: this first pass sees the fixed base and removes six degrees of freedom. Whatever is set by row
    // (armature, damping, friction, angles) belongs after it.
    multibody.forward_kinematics(&physics.bodies, true);
    assert_eq!(multibody.ndofs(), JOINTS, "the robot has nine joints and a fixed base");
    multibody.set_self_contacts_enabled(false);
    for (i, velocity) in dq.iter().enumerate() {
        let kind = usize::from(i >= ARM_JOINTS);
        multibody.armature_mut()[i] = ARMATURE_KG_M2[kind];
        multibody.damping_mut()[i] = DAMPING_N_M_S[kind];
        multibody.frictions_mut()[i] = DRY_FRICTION_N_M[kind];
        multibody.generalized_velocity_mut()[i] = *velocity as Real;
    }
    multibody.apply_displacements(&q.map(|v| v as Real));
    multibody.forward_kinematics(&physics.bodies, false);
    multibody.update_rigid_bodies(&mut physics.bodies, true);
    handle
}

/// Sets the motors' velocities \[rad/s\], and which limits are looked at: a limit that no joint can reach in this control step is left
/// out, for it would be a row that holds nothing, factored and swept in every substep.
pub(super) fn command(physics: &mut PhysicsWorld, arm: MultibodyJointHandle, action: &Action) {
    let multibody = physics.multibody_joints.get_mut(arm).expect("the robot is never removed").0;
    for (i, velocity) in action.iter().enumerate() {
        let reach = LIMIT_MARGIN_RAD + CONTROL_DT_S as Real * multibody.generalized_velocity()[i].abs();
        let link = multibody.link_mut(i + 1).expect("link i + 1 hangs on joint i");
        let angle = link.joint.coords()[JointAxis::AngX as usize];
        let joint = &mut link.joint.data;
        joint.set_motor_velocity(JointAxis::AngX, *velocity as Real, MOTOR_GAIN);
        if !is_continuous(i) {
            let limits = joint.limits[JointAxis::AngX as usize];
            let near = angle - reach < limits.min || angle + reach > limits.max;
            joint.limit_axes.set(JointAxesMask::ANG_X, near);
        }
    }
}

/// Joint angles \[rad\] and velocities \[rad/s\].
pub(super) fn read(physics: &PhysicsWorld, arm: MultibodyJointHandle) -> ([f64; JOINTS], [f64; JOINTS]) {
    let multibody = physics.multibody_joints.get(arm).expect("the robot is never removed").0;
    let velocity = multibody.generalized_velocity();
    let angle = |i: usize| {
        let link = multibody.link(i + 1).expect("link i + 1 hangs on joint i");
        f64::from(link.joint.coords()[JointAxis::AngX as usize])
    };
    (std::array::from_fn(angle), std::array::from_fn(|i| f64::from(velocity[i])))
}

fn insert_link(physics: &mut PhysicsWorld, link: usize) -> RigidBodyHandle {
    let inertia = LINK_INERTIA[link];
    let mass = MassProperties::new(vector(inertia.com_m), inertia.mass_kg as Real, vector(inertia.inertia_kg_m2));
    let builder = if link == 0 { RigidBodyBuilder::fixed() } else { RigidBodyBuilder::dynamic() };
    // No gravity: the real arm's controller compensates its own weight.
    let body = physics.insert_body(builder.gravity_scale(0.0).additional_mass_properties(mass).can_sleep(false));
    for primitive in LINK_SHAPES.iter().filter(|s| s.link == link) {
        let collider = match primitive.shape {
            Shape::Capsule { from_m, to_m, radius_m } => {
                ColliderBuilder::capsule_from_endpoints(vector(from_m), vector(to_m), radius_m as Real)
            }
            Shape::Box { center_m, half_m } => {
                let half = vector(half_m);
                ColliderBuilder::cuboid(half.x, half.y, half.z).translation(vector(center_m))
            }
        };
        let collider = collider.density(0.0).friction(SURFACE_FRICTION).user_data(Owner::Link(link).code());
        physics.insert_collider(collider, Some(body));
    }
    body
}

/// Joint `i`: rapier turns about the local x axis, the Jaco about z.
fn joint(kinematics: &Arm, i: usize) -> GenericJoint {
    let z_from_x =
        Isometry3::from_parts(Vector3::zeros().into(), UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -FRAC_PI_2));
    let builder = GenericJointBuilder::new(JointAxesMask::LOCKED_REVOLUTE_AXES)
        .local_frame1(isometry(&(kinematics.origin(i) * z_from_x)))
        .local_frame2(isometry(&z_from_x))
        .motor_model(JointAxis::AngX, MotorModel::ForceBased)
        .motor_velocity(JointAxis::AngX, 0.0, MOTOR_GAIN)
        .motor_max_force(JointAxis::AngX, TORQUE_LIMITS_N_M[i] as Real)
        .contacts_enabled(false);
    let [low, high] = POSITION_LIMITS_RAD[i];
    if is_continuous(i) { builder.build() } else { builder.limits(JointAxis::AngX, [low as Real, high as Real]).build() }
}

/// Whether joint `i` turns without limit.
fn is_continuous(i: usize) -> bool {
    let [low, high] = POSITION_LIMITS_RAD[i];
    high - low > TAU
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::READY_Q_RAD;

    /// A new multibody has 15 rows, six of which vanish with its first pass: what was set earlier would sit on the wrong joints.
    #[test]
    fn motors_armature_damping_and_friction_sit_on_their_joints() {
        let mut physics = PhysicsWorld::new();
        let handle = insert(&mut physics, &READY_Q_RAD, &[0.0; JOINTS]);
        let action = std::array::from_fn(|i| 0.01 * i as f64);
        command(&mut physics, handle, &action);
        physics.step();
        let multibody = physics.multibody_joints.get(handle).expect("inserted above").0;
        for i in 0..JOINTS {
            let kind = usize::from(i >= ARM_JOINTS);
            assert_eq!(multibody.armature()[i], ARMATURE_KG_M2[kind], "armature of joint {i}");
            assert_eq!(multibody.damping()[i], DAMPING_N_M_S[kind], "damping of joint {i}");
            assert_eq!(multibody.frictions()[i], DRY_FRICTION_N_M[kind], "friction of joint {i}");
            let joint = &multibody.link(i + 1).expect("ten links").joint.data;
            let motor = joint.motor(JointAxis::AngX).expect("each joint has a motor");
            assert_eq!(motor.max_force, TORQUE_LIMITS_N_M[i] as Real, "torque limit of joint {i}");
            assert_eq!(motor.target_vel, action[i] as Real, "command of joint {i}");
        }
    }

    #[test]
    fn rapier_and_our_kinematics_agree_on_every_link() {
        let mut physics = PhysicsWorld::new();
        let q = READY_Q_RAD.map(|v| v + 0.2);
        let handle = insert(&mut physics, &q, &[0.0; JOINTS]);
        let multibody = physics.multibody_joints.get(handle).expect("inserted above").0;
        for (link, ours) in multibody.links().zip(Arm::new().link_poses(&q)) {
            let theirs = crate::sim::convert::to_pose(physics.bodies[link.rigid_body_handle()].position()).isometry();
            let apart = (theirs.translation.vector - ours.translation.vector).norm() + theirs.rotation.angle_to(&ours.rotation);
            assert!(apart < 1e-4, "link {} differs by {apart}", link.link_id());
        }
    }
}
