//! A hand-written grasp for tests and benchmarks: straight moves of the tool by damped least squares, fingers on conditions.

use hilt::joints::Joints;
use hilt::sim::Controller;
use hilt::state::{Action, Pose};
use hilt::tasks::Observation;
use nalgebra::{Matrix6, UnitQuaternion, Vector3, Vector6};

/// Height of the tool point in a grasp, above the block's support \[m\].
pub const GRASP_HEIGHT_M: f64 = 0.022;
/// Height of the tool point in transit \[m\].
const TRANSIT_HEIGHT_M: f64 = 0.22;
/// Finger velocities \[rad/s, and what counts as one\].
const CLOSE: f64 = 0.7;
const CARRY: f64 = 0.3;
const OPEN: f64 = -0.6;
/// Gain of the tool's position and orientation error \[1/s\], and its top speed \[m/s\].
const GAIN: f64 = 4.0;
const SPEED_M_S: f64 = 0.15;
/// The tool has arrived \[m\].
const ARRIVED_M: f64 = 0.004;
/// Damping of the least squares.
const DAMPING: f64 = 1e-3;

/// One leg of the script: where the tool goes, what the fingers do, and for how many control steps at least.
#[derive(Clone, Copy, Debug)]
pub struct Leg {
    pub tool_m: [f64; 3],
    pub finger_rad_s: f64,
    pub steps: u32,
}

/// Goes through its legs and stays in the last.
#[derive(Clone)]
pub struct Script {
    yaw: f64,
    pub legs: Vec<Leg>,
    pub at: usize,
    waited: u32,
}

impl Script {
    /// Above the block, down, close, up.
    pub fn lift(block: &Pose) -> Self {
        let yaw = block.isometry().rotation.euler_angles().2;
        let [x, y, z] = block.position_m;
        let low = z - 0.025 + GRASP_HEIGHT_M;
        let legs = vec![
            leg([x, y, TRANSIT_HEIGHT_M], 0.0, 0),
            leg([x, y, low], 0.0, 0),
            leg([x, y, low], CLOSE, 30),
            leg([x, y, TRANSIT_HEIGHT_M + 0.02], CARRY, 0),
        ];
        Script { yaw, legs, at: 0, waited: 0 }
    }

    /// The same with the object held this much higher \[m\].
    #[allow(dead_code, reason = "benches share this file and lift cubes")]
    pub fn gripped_higher(mut self, by_m: f64) -> Self {
        self.legs[1..3].iter_mut().for_each(|leg| leg.tool_m[2] += by_m);
        self
    }

    /// [`Script::lift`], then to above `goal_m` (of the block's centre), down, open, up.
    pub fn carry(block: &Pose, goal_m: [f64; 3]) -> Self {
        let mut script = Script::lift(block);
        let [x, y, z] = goal_m;
        let low = z - 0.025 + GRASP_HEIGHT_M;
        script.legs.extend([
            leg([x, y, TRANSIT_HEIGHT_M], CARRY, 0),
            leg([x, y, low], CARRY, 10),
            leg([x, y, low], OPEN, 20),
            leg([x, y, TRANSIT_HEIGHT_M], 0.0, 20),
        ]);
        script
    }

    /// Whether the last leg is reached.
    pub fn on_last_leg(&self) -> bool {
        self.at + 1 == self.legs.len()
    }
}

fn leg(tool_m: [f64; 3], finger_rad_s: f64, steps: u32) -> Leg {
    Leg { tool_m, finger_rad_s, steps }
}

impl Controller for Script {
    fn command(&mut self, seen: &Observation) -> Action {
        let error = |l: &Leg| Vector3::from(l.tool_m) - Vector3::from(seen.tool_m);
        if self.waited >= self.legs[self.at].steps && error(&self.legs[self.at]).norm() < ARRIVED_M && !self.on_last_leg() {
            self.at += 1;
            self.waited = 0;
        }
        self.waited += 1;
        let now = self.legs[self.at];
        let mut linear = GAIN * error(&now);
        linear *= (SPEED_M_S / linear.norm().max(SPEED_M_S)).min(1.0);
        let (tool, jacobian) = seen.robot.tool_jacobian(&seen.state.q);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.yaw) * tool.rotation.inverse();
        let angular = GAIN * turn.scaled_axis();
        let twist = Vector6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z);
        let normal: Matrix6<f64> = &jacobian * jacobian.transpose() + Matrix6::identity() * DAMPING;
        let arm = jacobian.transpose() * normal.cholesky().expect("a damped matrix is positive definite").solve(&twist);
        let robot = &seen.robot;
        let finger =
            |joint: usize| now.finger_rad_s * robot.joints[joint].per_radian() * robot.closing_way(joint - robot.arm).signum();
        Joints::from_fn(robot.joints.len(), |i| if i < robot.arm { arm[i] } else { finger(i) })
    }
}
