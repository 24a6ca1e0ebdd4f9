//! The arm's free motion against an independent dynamics: recursive Newton-Euler in f64, integrated by Runge-Kutta.

use super::arm;
use crate::robot::READY_Q_RAD;
use crate::robot::jaco::{JOINT_SPECS, LINK_INERTIA, LINKS};
use crate::state::JOINTS;
use nalgebra::{Matrix3, Rotation3, SMatrix, SVector, Vector3};
use rapier3d::prelude::*;

type Joints = SVector<f64, JOINTS>;

/// Simulated time \[s\].
const DURATION_S: f64 = 0.25;
/// The simulator's own substep \[s\].
const SUBSTEP_S: f64 = 6.25e-3;
/// Step of the reference \[s\]: halving it changes its end by less than 1e-9.
const REFERENCE_DT_S: f64 = 5e-4;
/// Weight acts along -z \[m/s^2\].
const GRAVITY_M_S2: f64 = 9.81;
/// The arm's motion at the start \[rad/s\]: each joint another way, near the speeds of plans, and the fingers faster than they are driven.
const START_RAD_S: [f64; JOINTS] = [0.6, -0.5, 0.6, -0.8, 0.8, -0.8, 0.9, -0.7, 0.5];

/// What turns besides the links' own inertia, from the world itself.
struct Joint {
    armature: Joints,
    damping: Joints,
}

/// Torques that give `ddq` at `q`, `dq`, by recursive Newton-Euler in the world's frame. Armature and damping are not in it.
fn torques(q: &Joints, dq: &Joints, ddq: &Joints, gravity: f64) -> Joints {
    let mut frames = [(Rotation3::identity(), Vector3::zeros()); LINKS];
    let (mut turn, mut spin, mut lift) = ([Vector3::zeros(); LINKS], [Vector3::zeros(); LINKS], [Vector3::zeros(); LINKS]);
    // Weight as an acceleration of the base.
    lift[0] = Vector3::z() * gravity;
    let (mut force, mut moment) = ([Vector3::zeros(); LINKS], [Vector3::zeros(); LINKS]);
    for (i, spec) in JOINT_SPECS.iter().enumerate() {
        let (parent, link) = (spec.parent, i + 1);
        let [roll, pitch, yaw] = spec.rpy_rad;
        let arm = frames[parent].0 * Vector3::from(spec.xyz_m);
        let still = frames[parent].0 * Rotation3::from_euler_angles(roll, pitch, yaw);
        let axis = still * Vector3::z();
        frames[link] = (still * Rotation3::from_axis_angle(&Vector3::z_axis(), q[i]), frames[parent].1 + arm);
        turn[link] = turn[parent] + axis * dq[i];
        spin[link] = spin[parent] + axis * ddq[i] + turn[parent].cross(&(axis * dq[i]));
        lift[link] = lift[parent] + spin[parent].cross(&arm) + turn[parent].cross(&turn[parent].cross(&arm));
        let body = &LINK_INERTIA[link];
        let com = frames[link].0 * Vector3::from(body.com_m);
        let rotation = frames[link].0.matrix();
        let inertia = rotation * Matrix3::from_diagonal(&Vector3::from(body.inertia_kg_m2)) * rotation.transpose();
        let at_com = lift[link] + spin[link].cross(&com) + turn[link].cross(&turn[link].cross(&com));
        force[link] = body.mass_kg * at_com;
        moment[link] = inertia * spin[link] + turn[link].cross(&(inertia * turn[link])) + com.cross(&force[link]);
    }
    let mut out = Joints::zeros();
    for i in (0..JOINTS).rev() {
        let (parent, link) = (JOINT_SPECS[i].parent, i + 1);
        out[i] = moment[link].dot(&(frames[link].0 * Vector3::z()));
        let arm = frames[link].1 - frames[parent].1;
        let (f, m) = (force[link], moment[link]);
        force[parent] += f;
        moment[parent] += m + arm.cross(&f);
    }
    out
}

fn acceleration(joint: &Joint, q: &Joints, dq: &Joints, gravity: f64) -> Joints {
    let bias = torques(q, dq, &Joints::zeros(), gravity);
    let mut mass = SMatrix::<f64, JOINTS, JOINTS>::from_diagonal(&joint.armature);
    for i in 0..JOINTS {
        let unit = Joints::from_fn(|k, _| if k == i { 1.0 } else { 0.0 });
        let column = mass.column(i) + torques(q, &Joints::zeros(), &unit, 0.0);
        mass.set_column(i, &column);
    }
    assert!((mass - mass.transpose()).abs().max() < 1e-12, "a mass matrix is symmetric");
    mass.cholesky().expect("and positive definite").solve(&(-bias - joint.damping.component_mul(dq)))
}

/// Angles and velocities after [`DURATION_S`], by the classical Runge-Kutta method.
fn reference(joint: &Joint, gravity: f64) -> (Joints, Joints) {
    let (mut q, mut dq) = (Joints::from(READY_Q_RAD), Joints::from(START_RAD_S));
    let h = REFERENCE_DT_S;
    for _ in 0..(DURATION_S / h).round() as usize {
        let slope = |q: Joints, dq: Joints| (dq, acceleration(joint, &q, &dq, gravity));
        let (v1, a1) = slope(q, dq);
        let (v2, a2) = slope(q + v1 * (h / 2.0), dq + a1 * (h / 2.0));
        let (v3, a3) = slope(q + v2 * (h / 2.0), dq + a2 * (h / 2.0));
        let (v4, a4) = slope(q + v3 * h, dq + a3 * h);
        q += (v1 + v2 * 2.0 + v3 * 2.0 + v4) * (h / 6.0);
        dq += (a1 + a2 * 2.0 + a3 * 2.0 + a4) * (h / 6.0);
    }
    (q, dq)
}

/// The robot of every world, its motors without torque, its fingers without dry friction, its limits not looked at.
fn released(substep_s: f64, gravity: f64) -> (PhysicsWorld, MultibodyJointHandle, Joint) {
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::new(0.0, 0.0, -gravity as Real);
    physics.integration_parameters.num_solver_iterations = 1;
    let robot = arm::insert(&mut physics, &READY_Q_RAD, &START_RAD_S);
    // A step of no duration gives the bodies their masses.
    physics.integration_parameters.dt = 0.0;
    physics.step();
    physics.integration_parameters.dt = substep_s as Real;
    let multibody = physics.multibody_joints.get_mut(robot).expect("inserted just now").0;
    multibody.frictions_mut().fill(0.0);
    for (i, link) in multibody.links_mut().enumerate().skip(1) {
        link.joint.data.set_motor_max_force(JointAxis::AngX, 0.0);
        link.joint.data.limit_axes = JointAxesMask::empty();
        let body = &mut physics.bodies[link.rigid_body_handle()];
        body.set_gravity_scale(1.0, true);
        let (ours, theirs) = (&LINK_INERTIA[i], &body.mass_properties().local_mprops);
        let inertia = theirs.reconstruct_inertia_matrix().to_cols_array_2d();
        let same = |a: Real, b: f64, of: f64| (f64::from(a) - b).abs() <= 1e-5 * of;
        let [x, y, z] = ours.inertia_kg_m2;
        let diagonal = [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]];
        let alike = inertia.iter().flatten().zip(diagonal.iter().flatten()).all(|(a, b)| same(*a, *b, x.max(y)));
        assert!(same(body.mass(), ours.mass_kg, ours.mass_kg) && alike, "mass of link {i}: {} kg, {inertia:?}", body.mass());
    }
    let of = |v: &[Real]| Joints::from_fn(|i, _| f64::from(v[i]));
    let joint = Joint { armature: of(multibody.armature().as_slice()), damping: of(multibody.damping().as_slice()) };
    (physics, robot, joint)
}

/// How far rapier ends from the reference, angles \[rad\] and velocities \[rad/s\].
fn errors(substep_s: f64, gravity: f64) -> [Joints; 2] {
    let (mut physics, robot, joint) = released(substep_s, gravity);
    for _ in 0..(DURATION_S / substep_s).round() as usize {
        physics.step();
    }
    let (q, dq) = arm::read(&physics, robot);
    let (true_q, true_dq) = reference(&joint, gravity);
    [Joints::from(q) - true_q, Joints::from(dq) - true_dq]
}

/// Without motors and dry friction (constraints, not forces) rapier integrates the same equations of motion, by a method of first order:
/// half the substep leaves half the error, and what both errors have in common beyond that, twice the second minus the first, vanishes.
/// So the masses, the Coriolis terms and the weight are right, and the stated errors are those of the substep alone.
#[test]
fn free_motion_converges_to_recursive_newton_euler() {
    // Largest errors at the simulator's own substep, rad and rad/s: without weight, as everywhere in hilt; with it, falling freely.
    for (gravity, bounds) in [(0.0, [1e-3, 2e-3]), (GRAVITY_M_S2, [1.2e-2, 3e-2])] {
        let own = errors(SUBSTEP_S, gravity);
        let [half, quarter] = [2.0, 4.0].map(|n| errors(SUBSTEP_S / n, gravity));
        for (k, bound) in bounds.into_iter().enumerate() {
            let largest = [own[k], half[k], quarter[k]].map(|e| e.abs().max());
            assert!(largest[0] < bound, "gravity {gravity}: {} against {bound}", largest[0]);
            for pair in largest.windows(2) {
                assert!((1.85..2.15).contains(&(pair[0] / pair[1])), "gravity {gravity}: errors {largest:?} do not halve");
            }
            let limit = (quarter[k] * 2.0 - half[k]).abs().max();
            assert!(limit < 0.02 * largest[0], "gravity {gravity}: in the limit of small substeps an error of {limit} stays");
        }
    }
}
