//! What to begin with for the motors of a robot of which nothing is published.

use super::hand::press_n;
use super::model::{JointKind, Robot};

/// Reflected inertia that simulators give arms that stand on a table: .1 to .2 \[kg m^2\].
pub const ARM_ARMATURE: f64 = 0.1;
/// That of fingers that turn: .005 to .05 \[kg m^2\].
const TURNING_ARMATURE: f64 = 0.01;
/// That of fingers that slide: .1 to .2 \[kg\].
const SLIDING_ARMATURE: f64 = 0.1;
/// Damping of an arm whose friction is compensated \[N m s/rad\].
pub const ARM_DAMPING: f64 = 1.0;
/// Dry friction of fingers as a share of their effort: gears that cannot be pushed back have about as much.
pub const FINGER_FRICTION: f64 = 0.4;
/// Fingers that press more strongly are doubtful \[N\]: two-finger grippers for arms of this size have 20 to 235.
const STRONG_N: f64 = 300.0;
/// What such fingers are to press with instead \[N\].
const FIRM_N: f64 = 80.0;

/// Reflected inertia of the fingers \[kg m^2, kg\].
pub fn finger_armature(robot: &Robot) -> f64 {
    match robot.joints.last().map(|finger| finger.kind) {
        Some(JointKind::Prismatic) => SLIDING_ARMATURE,
        _ => TURNING_ARMATURE,
    }
}

/// A finger that presses more strongly than any.
pub struct TooStrong {
    /// Its joint.
    pub joint: usize,
    /// What it presses with \[N\].
    pub press_n: f64,
    /// Effort that is believable \[N m, N\].
    pub effort: f64,
}

/// All fingers that do.
pub fn too_strong(robot: &Robot) -> Vec<TooStrong> {
    let pressing = robot.fingers().zip(press_n(robot)).filter(|(_, press_n)| *press_n > STRONG_N);
    pressing.map(|(joint, press_n)| TooStrong { joint, press_n, effort: robot.joints[joint].effort * FIRM_N / press_n }).collect()
}
