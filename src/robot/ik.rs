//! Differential inverse kinematics as a quadratic program: joint steps that reduce the tool's pose error, within joint and velocity limits.

use super::model::{Jacobian, Robot};
use crate::joints::Joints;
use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};
use nalgebra::{DMatrix, Isometry3, Vector6};
use std::sync::Arc;

/// A step may use this much motion at the joints' velocity limits \[s\]: 0.16 to 0.21 rad, small enough for the linear model.
const STEP_S: f64 = 0.25;
/// Weight of a rotation error against a position error \[m/rad\]: about the lever of the hand.
const ROTATION_LEVER_M: f64 = 0.2;
/// Weight of the pull to the robot's posture \[m^2/rad^2\]: costs 0.01 mm of position. It settles what the tool's pose leaves free: the elbow of
/// an arm with seven joints; near the Jaco's wrist singularity (forearm vertical, joint 5 at a full turn: blocks nearer than 0.35 m) it keeps
/// the wrist from swinging round, and joint 5 passes the full turn and stays smooth.
const POSTURE_WEIGHT: f64 = 1e-5;
/// Floor under all joints' weights: keeps the program strictly convex where the Jacobian is not.
const POSTURE_FLOOR: f64 = 1e-9;
/// Converged when no joint moves more \[rad\]: the next step would move its square.
const CONVERGED_RAD: f64 = 1e-3;
/// Steps before a target counts as unreachable; the whole workspace is within 20 steps of the ready posture.
const MAX_STEPS: usize = 60;
/// Residual at which the solver stops refining its linear systems; the steps correct each other.
const REFINEMENT: f64 = 1e-9;
/// Position error of a solution \[m\].
pub const POSITION_TOLERANCE_M: f64 = 1e-4;
/// Rotation error of a solution \[rad\].
pub const ROTATION_TOLERANCE_RAD: f64 = 1e-3;

/// How far the tool stayed from a target that cannot be reached.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("the tool stays {:.1} mm and {:.1} degrees from its target at {:.3?} m", position_error_m * 1e3, rotation_error_rad.to_degrees(), target_m)]
pub struct Unreachable {
    /// Where the tool point should have been \[m\].
    pub target_m: [f64; 3],
    /// \[m\].
    pub position_error_m: f64,
    /// \[rad\].
    pub rotation_error_rad: f64,
}

/// The solver: the robot and one program of fixed structure, whose numbers are exchanged at every step.
pub struct Ik {
    robot: Arc<Robot>,
    program: DefaultSolver<f64>,
}

impl Ik {
    /// For this robot.
    pub fn new(robot: &Arc<Robot>) -> Self {
        let n = robot.arm;
        let ones = upper_triangle(&DMatrix::from_element(n, n, 1.0));
        let (columns, rows) = upper_structure(n);
        let cost = CscMatrix::new(n, n, columns, rows, ones);
        let settings = DefaultSettings {
            verbose: false,
            max_threads: 1,
            presolve_enable: false,
            iterative_refinement_reltol: REFINEMENT,
            iterative_refinement_abstol: REFINEMENT,
            equilibrate_enable: false,
            ..DefaultSettings::default()
        };
        let program = DefaultSolver::new(
            &cost,
            &vec![0.0; n],
            &box_rows(n),
            &vec![1.0; 2 * n],
            &[SupportedConeT::NonnegativeConeT(2 * n)],
            settings,
        )
        .expect("a program of fixed, matching sizes");
        Ik { robot: Arc::clone(robot), program }
    }

    /// Joint positions near `seed` that put the tool at `target` (`world_from_tool`), fingers as in `seed` \[rad, m\].
    ///
    /// # Errors
    /// [`Unreachable`]: how far the tool stayed away.
    pub fn solve(&mut self, target: &Isometry3<f64>, seed: &Joints) -> Result<Joints, Unreachable> {
        let mut q = *seed;
        for _ in 0..MAX_STEPS {
            let (tool, jacobian) = self.robot.tool_jacobian(&q);
            let error = pose_error(&tool, target);
            let Some(step) = self.step(&q, &jacobian, &error) else { break };
            q.iter_mut().zip(&step).for_each(|(q, d)| *q += d);
            if step.iter().all(|d| d.abs() < CONVERGED_RAD) {
                break;
            }
        }
        let error = pose_error(&self.robot.tool_pose(&q), target);
        let (position, rotation) = (error.fixed_rows::<3>(0).norm(), error.fixed_rows::<3>(3).norm());
        if position < POSITION_TOLERANCE_M && rotation < ROTATION_TOLERANCE_RAD {
            return Ok(q);
        }
        Err(Unreachable { target_m: target.translation.vector.into(), position_error_m: position, rotation_error_rad: rotation })
    }

    /// One program: the step d that minimises |W (J d - e)|^2 + w sum over the posture's joints i of (q_i + d_i - p_i)^2 within position and
    /// velocity limits.
    fn step(&mut self, q: &[f64], jacobian: &Jacobian, error: &Vector6<f64>) -> Option<Vec<f64>> {
        let lever = Vector6::new(1.0, 1.0, 1.0, ROTATION_LEVER_M, ROTATION_LEVER_M, ROTATION_LEVER_M);
        let n = self.robot.arm;
        let mut weighted = jacobian.clone();
        weighted.column_iter_mut().for_each(|mut column| column.component_mul_assign(&lever));
        let error = error.component_mul(&lever);
        let mut cost = weighted.tr_mul(&weighted) + DMatrix::identity(n, n) * POSTURE_FLOOR;
        let mut slope = -weighted.tr_mul(&error);
        for posture in &self.robot.posture {
            let i = posture.joint;
            cost[(i, i)] += POSTURE_WEIGHT;
            slope[i] += POSTURE_WEIGHT * (q[i] - posture.position);
        }
        let mut limits = vec![0.0; 2 * n];
        for (i, joint) in self.robot.joints[..n].iter().enumerate() {
            let [low, high] = joint.limits;
            let reach = joint.velocity * STEP_S;
            limits[i] = (high - q[i]).min(reach);
            limits[n + i] = (q[i] - low).min(reach);
        }
        let untouched: [f64; 0] = [];
        self.program
            .update_data(&upper_triangle(&cost), &slope.as_slice().to_vec(), &untouched, &limits)
            .expect("the program keeps its structure");
        self.program.solve();
        match self.program.solution.status {
            SolverStatus::Solved | SolverStatus::AlmostSolved => Some(self.program.solution.x.clone()),
            _ => None,
        }
    }
}

/// Position then rotation that take `from` to `to`, in the world frame \[m, rad\].
fn pose_error(from: &Isometry3<f64>, to: &Isometry3<f64>) -> Vector6<f64> {
    let linear = to.translation.vector - from.translation.vector;
    let angular = (to.rotation * from.rotation.inverse()).scaled_axis();
    Vector6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
}

/// Column starts and row indices of a dense upper triangle.
fn upper_structure(n: usize) -> (Vec<usize>, Vec<usize>) {
    let columns = (0..=n).map(|j| j * (j + 1) / 2).collect();
    let rows = (0..n).flat_map(|j| 0..=j).collect();
    (columns, rows)
}

/// The upper triangle, column by column.
fn upper_triangle(m: &DMatrix<f64>) -> Vec<f64> {
    (0..m.ncols()).flat_map(|j| (0..=j).map(move |i| m[(i, j)])).collect()
}

/// d <= b above, -d <= b below.
fn box_rows(n: usize) -> CscMatrix<f64> {
    let columns = (0..=n).map(|j| 2 * j).collect();
    let rows = (0..n).flat_map(|j| [j, n + j]).collect();
    let values = [1.0, -1.0].repeat(n);
    CscMatrix::new(2 * n, n, columns, rows, values)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::file::built_in::paper_robot;
    use nalgebra::{Translation3, UnitQuaternion};

    fn hand_down(x: f64, y: f64, z: f64, yaw: f64) -> Isometry3<f64> {
        Isometry3::from_parts(Translation3::new(x, y, z), UnitQuaternion::from_euler_angles(0.0, 0.0, yaw))
    }

    #[test]
    fn reaches_what_forward_kinematics_confirms() {
        let mut ik = Ik::new(&paper_robot());
        for (x, y, z, yaw) in [(0.45, 0.0, 0.3, 0.0), (0.4, 0.1, 0.05, 0.3), (0.6, -0.12, 0.1, -0.4)] {
            let target = hand_down(x, y, z, yaw);
            let q = ik.solve(&target, &paper_robot().ready).expect("within reach");
            let tool = paper_robot().tool_pose(&q);
            assert!((tool.translation.vector - target.translation.vector).norm() < POSITION_TOLERANCE_M);
            assert!(tool.rotation.angle_to(&target.rotation) < ROTATION_TOLERANCE_RAD);
            assert_eq!(q[paper_robot().arm..], paper_robot().ready[paper_robot().arm..]);
        }
    }

    #[test]
    fn says_how_far_it_stays_from_what_it_cannot_reach() {
        let failure = Ik::new(&paper_robot())
            .solve(&hand_down(1.5, 0.0, 0.1, 0.0), &paper_robot().ready)
            .expect_err("beyond the arm's length");
        assert!(failure.position_error_m > 0.3, "{failure}");
        assert!(failure.to_string().contains("1.500"), "{failure}");
    }

    #[test]
    fn earlier_targets_leave_no_trace() {
        let (mut fresh, mut used) = (Ik::new(&paper_robot()), Ik::new(&paper_robot()));
        let _ = used.solve(&hand_down(0.6, 0.1, 0.1, 0.5), &paper_robot().ready);
        let target = hand_down(0.35, -0.1, 0.05, 0.0);
        assert_eq!(fresh.solve(&target, &paper_robot().ready), used.solve(&target, &paper_robot().ready));
    }
}
