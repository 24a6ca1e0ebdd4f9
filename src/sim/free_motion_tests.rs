//! The free motion of robots against an independent dynamics: recursive Newton-Euler in f64, integrated by Runge-Kutta.

use super::arm;
use crate::robot::Robot;
use crate::robot::file::built_in::{all, paper_robot};
use crate::robot::model::JointKind;
use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, Vector3};
use rapier3d::prelude::*;

type Numbers = DVector<f64>;

/// Simulated time \[s\].
const DURATION_S: f64 = 0.25;
/// The simulator's own substep \[s\].
const SUBSTEP_S: f64 = 6.25e-3;
/// Step of the reference \[s\]: halving it changes its end by less than 1e-9.
const REFERENCE_DT_S: f64 = 5e-4;
/// Weight acts along -z \[m/s^2\].
const GRAVITY_M_S2: f64 = 9.81;
/// Rapier diagonalises in single precision, and turns the axes of inertias below this: a thousandth of a hand's. They are not compared.
const NEGLIGIBLE_KG_M2: f64 = 5e-6;
/// The robot's motion at the start \[rad/s\]: each joint another way, near the speeds of plans, and the fingers faster than they are driven.
const START_RAD_S: [f64; 9] = [0.6, -0.5, 0.6, -0.8, 0.8, -0.8, 0.9, -0.7, 0.5];

/// A robot at the start, and what moves besides the links' own inertia, from the world itself.
struct Free<'a> {
    robot: &'a Robot,
    start: Numbers,
    armature: Numbers,
    damping: Numbers,
}

/// Where its joints are in the ready pose, and how they begin to move.
fn start(robot: &Robot) -> [Numbers; 2] {
    let dq = robot.joints.iter().zip(START_RAD_S).map(|(joint, dq)| dq * joint.per_radian());
    [Numbers::from_column_slice(&robot.ready), Numbers::from_iterator(robot.joints.len(), dq)]
}

/// Torques and forces that give `ddq` at `q`, `dq`, by recursive Newton-Euler in the world's frame. Armature and damping are not in it.
fn torques(robot: &Robot, q: &Numbers, dq: &Numbers, ddq: &Numbers, gravity: f64) -> Numbers {
    let links = robot.links.len();
    let mut frames = vec![(Rotation3::identity(), Vector3::zeros()); links];
    let zeros = || vec![Vector3::<f64>::zeros(); links];
    let (mut turn, mut spin, mut lift, mut force, mut moment) = (zeros(), zeros(), zeros(), zeros(), zeros());
    // Weight as an acceleration of the foot.
    lift[0] = Vector3::z() * gravity;
    for (i, joint) in robot.joints.iter().enumerate() {
        let (parent, link) = (joint.parent, i + 1);
        let still = frames[parent].0 * joint.origin.rotation.to_rotation_matrix();
        let axis = still * Vector3::z();
        let slides = joint.kind == JointKind::Prismatic;
        let (own, slid) = if slides { (0.0, q[i]) } else { (q[i], 0.0) };
        let arm = frames[parent].0 * joint.origin.translation.vector + axis * slid;
        frames[link] = (still * Rotation3::from_axis_angle(&Vector3::z_axis(), own), frames[parent].1 + arm);
        let (turns, speeds_up) = if slides { (0.0, 0.0) } else { (dq[i], ddq[i]) };
        turn[link] = turn[parent] + axis * turns;
        spin[link] = spin[parent] + axis * speeds_up + turn[parent].cross(&(axis * turns));
        lift[link] = lift[parent] + spin[parent].cross(&arm) + turn[parent].cross(&turn[parent].cross(&arm));
        if slides {
            lift[link] += axis * ddq[i] + turn[parent].cross(&(axis * dq[i])) * 2.0;
        }
        let body = &robot.links[link].inertia;
        let com = frames[link].0 * Vector3::from(body.com_m);
        let rotation = (frames[link].0 * body.axes.to_rotation_matrix()).into_inner();
        let inertia = rotation * Matrix3::from_diagonal(&Vector3::from(body.principal_kg_m2)) * rotation.transpose();
        let at_com = lift[link] + spin[link].cross(&com) + turn[link].cross(&turn[link].cross(&com));
        force[link] = body.mass_kg * at_com;
        moment[link] = inertia * spin[link] + turn[link].cross(&(inertia * turn[link])) + com.cross(&force[link]);
    }
    let mut out = Numbers::zeros(robot.joints.len());
    for (i, joint) in robot.joints.iter().enumerate().rev() {
        let (parent, link) = (joint.parent, i + 1);
        let along = if joint.kind == JointKind::Prismatic { force[link] } else { moment[link] };
        out[i] = along.dot(&(frames[link].0 * Vector3::z()));
        let arm = frames[link].1 - frames[parent].1;
        let (f, m) = (force[link], moment[link]);
        force[parent] += f;
        moment[parent] += m + arm.cross(&f);
    }
    out
}

fn acceleration(free: &Free, q: &Numbers, dq: &Numbers, gravity: f64) -> Numbers {
    let (n, robot) = (free.robot.joints.len(), free.robot);
    let still = Numbers::zeros(n);
    let bias = torques(robot, q, dq, &still, gravity);
    let mut mass = DMatrix::from_diagonal(&free.armature);
    for i in 0..n {
        let unit = Numbers::from_fn(n, |k, _| if k == i { 1.0 } else { 0.0 });
        let column = mass.column(i) + torques(robot, q, &still, &unit, 0.0);
        mass.set_column(i, &column);
    }
    assert!((&mass - mass.transpose()).abs().max() < 1e-12, "a mass matrix is symmetric");
    mass.cholesky().expect("and positive definite").solve(&(-bias - free.damping.component_mul(dq)))
}

/// Positions and velocities after [`DURATION_S`], by the classical Runge-Kutta method.
fn reference(free: &Free, gravity: f64) -> [Numbers; 2] {
    let [mut q, mut dq] = [free.start.clone(), start(free.robot)[1].clone()];
    let h = REFERENCE_DT_S;
    for _ in 0..(DURATION_S / h).round() as usize {
        let slope = |q: Numbers, dq: Numbers| (dq.clone(), acceleration(free, &q, &dq, gravity));
        let (v1, a1) = slope(q.clone(), dq.clone());
        let (v2, a2) = slope(&q + &v1 * (h / 2.0), &dq + &a1 * (h / 2.0));
        let (v3, a3) = slope(&q + &v2 * (h / 2.0), &dq + &a2 * (h / 2.0));
        let (v4, a4) = slope(&q + &v3 * h, &dq + &a3 * h);
        q += (v1 + v2 * 2.0 + v3 * 2.0 + v4) * (h / 6.0);
        dq += (a1 + a2 * 2.0 + a3 * 2.0 + a4) * (h / 6.0);
    }
    [q, dq]
}

/// The robot of every world, its motors without torque, its fingers without dry friction, its limits not looked at.
fn released(robot: &Robot, substep_s: f64, gravity: f64) -> (PhysicsWorld, MultibodyJointHandle, Free<'_>) {
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::new(0.0, 0.0, -gravity as Real);
    physics.integration_parameters.num_solver_iterations = 1;
    let [q, dq] = start(robot);
    let handle = arm::insert(&mut physics, robot, q.as_slice(), dq.as_slice(), 1.0);
    // A step of no duration gives the bodies their masses.
    physics.integration_parameters.dt = 0.0;
    physics.step();
    physics.integration_parameters.dt = substep_s as Real;
    let multibody = physics.multibody_joints.get_mut(handle).expect("inserted just now").0;
    multibody.frictions_mut().fill(0.0);
    for (i, link) in multibody.links_mut().enumerate().skip(1) {
        link.joint.data.set_motor_max_force(arm::axis(robot.joints[i - 1].kind), 0.0);
        link.joint.data.limit_axes = JointAxesMask::empty();
        let body = &mut physics.bodies[link.rigid_body_handle()];
        body.set_gravity_scale(1.0, true);
        let (ours, theirs) = (&robot.links[i].inertia, &body.mass_properties().local_mprops);
        let inertia = theirs.reconstruct_inertia_matrix().to_cols_array_2d();
        let largest = ours.principal_kg_m2.into_iter().fold(0.0, f64::max);
        let same = |a: Real, b: f64, of: f64| (f64::from(a) - b).abs() <= 1e-5 * of;
        let axes = ours.axes.to_rotation_matrix().into_inner();
        let full = axes * Matrix3::from_diagonal(&Vector3::from(ours.principal_kg_m2)) * axes.transpose();
        let alike = largest < NEGLIGIBLE_KG_M2 || inertia.iter().flatten().zip(full.iter()).all(|(a, b)| same(*a, *b, largest));
        assert!(
            same(body.mass(), ours.mass_kg, ours.mass_kg) && alike,
            "mass of link {i}: {} kg, {inertia:?}, not {full}",
            body.mass()
        );
    }
    let of = |v: &[Real]| Numbers::from_iterator(v.len(), v.iter().map(|v| f64::from(*v)));
    let (armature, damping) = (of(multibody.armature().as_slice()), of(multibody.damping().as_slice()));
    (physics, handle, Free { robot, start: q, armature, damping })
}

/// How far rapier ends from the reference, positions \[rad, m\] and velocities \[rad/s, m/s\].
fn errors(robot: &Robot, substep_s: f64, gravity: f64) -> [Numbers; 2] {
    let (mut physics, handle, free) = released(robot, substep_s, gravity);
    for _ in 0..(DURATION_S / substep_s).round() as usize {
        physics.step();
    }
    let (q, dq) = arm::read(&physics, robot, handle);
    let [true_q, true_dq] = reference(&free, gravity);
    [Numbers::from_column_slice(&q) - true_q, Numbers::from_column_slice(&dq) - true_dq]
}

/// Without motors and dry friction (constraints, not forces) rapier integrates the same equations of motion, by a method of first order:
/// half the substep leaves half the error, and what both errors have in common beyond that, twice the second minus the first, vanishes.
/// So the masses, the Coriolis terms and the weight are right, and the stated errors are those of the substep alone.
#[test]
fn free_motion_converges_to_recursive_newton_euler() {
    let robot = paper_robot();
    // Largest errors at the simulator's own substep, rad and rad/s: without weight, as everywhere in hilt; with it, falling freely.
    for (gravity, bounds) in [(0.0, [1e-3, 2e-3]), (GRAVITY_M_S2, [1.2e-2, 3e-2])] {
        let own = errors(&robot, SUBSTEP_S, gravity);
        let [half, quarter] = [2.0, 4.0].map(|n| errors(&robot, SUBSTEP_S / n, gravity));
        for (k, bound) in bounds.into_iter().enumerate() {
            let largest = [&own[k], &half[k], &quarter[k]].map(|e| e.abs().max());
            assert!(largest[0] < bound, "gravity {gravity}: {} against {bound}", largest[0]);
            for pair in largest.windows(2) {
                assert!((1.85..2.15).contains(&(pair[0] / pair[1])), "gravity {gravity}: errors {largest:?} do not halve");
            }
            let limit = (&quarter[k] * 2.0 - &half[k]).abs().max();
            assert!(limit < 0.02 * largest[0], "gravity {gravity}: in the limit of small substeps an error of {limit} stays");
        }
    }
}

/// The same of every robot, with fingers that slide and links whose axes of inertia are not their own.
#[test]
fn every_robot_moves_freely_as_it_should() {
    for robot in all() {
        let [own, half] = [1.0, 2.0].map(|n| errors(&robot, SUBSTEP_S / n, GRAVITY_M_S2));
        for (own, half) in own.iter().zip(&half) {
            let (largest, ratio) = (own.abs().max(), own.abs().max() / half.abs().max());
            let said = format!("{}: {largest}, of which half the substep leaves 1 / {ratio}", robot.name);
            assert!(largest < 6e-2 && (1.8..2.2).contains(&ratio), "{said}");
        }
    }
}
